"""Compares nsdrill with measurements of two wells and a laboratory rig: every setting of the
studies ``configs/validation_*.yaml`` with the cycles in ``docs/validation``; prints the
tables of the page "Validation".

    python docs/validate.py                   # a minute
    python docs/validate.py --write           # into the page
    python docs/validate.py laboratory_rig    # only these studies, setting by setting

Exit code 1 where the page says something else. How far nsdrill and a measurement are apart
is the result, and fails nothing.
"""

from __future__ import annotations

import csv
import math
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby, pairwise
from pathlib import Path
from statistics import fmean, median

import numpy as np

import nsdrill
from nsdrill.analysis.cycles import period_of, rises_of

DOCS = Path(__file__).resolve().parent
RPM = math.pi / 30
RECORDS = ("wells_b_c_cycles.csv", "laboratory_rig.csv")
QUANTITIES = ("period", "peak ratio", "least torque", "greatest torque")
TORQUES = QUANTITIES[2:]


@dataclass(frozen=True)
class Case:
    """A study with what was known of it: where from, and what had to be set and how."""

    study: str
    title: str
    known: str
    set: str
    sample: str = "20 ms"
    changes: tuple[tuple[str, object], ...] = ()

    @property
    def path(self) -> Path:
        return DOCS.parent / "configs" / f"validation_{self.study}.yaml"


PAPER = "paper, authors' files"
TWO = "static and dynamic torque: means over the torques of all cycles; shear modulus, damping: defaults"
BY_HAND = "two coefficients, damping: by hand, periods in view"
CARRIED = "coefficients and damping of 1733 m"
THIRD = "two coefficients: third pair tried on two torques at 36.2 rpm; damping: by hand"
BLIND = (
    Case("well_b_1733", "well B, 1733 m", PAPER, TWO),
    Case("well_b_2235", "well B, 2235 m", PAPER, TWO),
    Case("well_c_2506", "well C, 2506 m", PAPER, TWO),
    Case("well_c_2953", "well C, 2953 m", PAPER, TWO),
    Case("laboratory_rig", "laboratory rig, drilling", "its record", "inertia of the drive: assumed", "2 ms"),
)
# in the table of the blind ones and not in the statistics: the record of well_b_2235 a second time
AGAIN = Case(
    "well_b_2235",
    "well B, 2235 m, again",
    PAPER,
    "static torque: greatest of the first cycle, 29.6 kN m",
    changes=(("bit.friction.static", "29.6 kN*m"),),
)
FITTED = (
    Case("well_b_1733_wall", "well B, 1733 m", PAPER, BY_HAND),
    Case("well_b_2235_wall", "well B, 2235 m", PAPER, CARRIED),
    Case("well_c_2506_wall", "well C, 2506 m", PAPER, THIRD),
    Case("well_c_2953_wall", "well C, 2953 m", PAPER, "coefficients and damping of 2506 m"),
)
# the same of the fitted ones
FITTED_AGAIN = Case(
    "well_b_2235_wall",
    "well B, 2235 m, again",
    PAPER,
    "coefficients 0.45 and 0.36: by hand from 16 pairs, this record in view; damping of 1733 m",
    changes=(("well.friction_along.static", 0.45), ("well.friction_along.dynamic", 0.36)),
)
CASES = {case.study: case for case in BLIND + FITTED}
STEEL = (("drillstring.material.shear_modulus", "61 GPa"),)

# The two torques of the lumped string at 1733 m on the collars of a string of segments: the
# hole is horizontal along them and vertical above, where they would be 21.25 kN m with a
# coefficient of one.
ON_COLLARS = (
    ("well.survey", [{"depth": "1502 m", "inclination": "0 deg"}, {"depth": "1503 m", "inclination": "90 deg"}]),
    ("well.friction_along.static", round(20.9 / 21.25, 3)),
    ("well.friction_along.dynamic", round(12.2 / 21.25, 3)),
)
LUMPED, SEGMENTS = (Case(f"well_b_1733{end}", "", "", "") for end in ("", "_wall"))
CAUSES = (
    ("friction at the bit, as above", LUMPED),
    ("without torsional damping", replace(LUMPED, changes=(("drillstring.torsional_damping", "0 N*m*s/rad"),))),
    ("with an ideal drive", replace(LUMPED, changes=(("drive.kind", "ideal"),))),
    (
        "string of segments, the same torques at the collars, default steel",
        replace(SEGMENTS, changes=(*ON_COLLARS, ("drillstring.material.shear_modulus", "79.6 GPa"))),
    ),
    ("the same, 61 GPa", replace(SEGMENTS, changes=ON_COLLARS)),
    ("string of segments, friction along the wall, fitted", SEGMENTS),
)
CAUSES_AT = 69.7  # rpm


@dataclass(frozen=True)
class Setting:
    """One rotary speed of a case: what was measured and what came, by the quantity; torques
    in N m, periods in s; NaN where nothing was measured or nothing came."""

    case: Case
    rpm: float
    cycles: int
    measured: dict[str, float]
    computed: dict[str, float]

    def apart(self, quantity: str) -> float:
        """The difference: over the measured value, or of a torque over the measured swing."""
        size = self.measured[TORQUES[1]] - self.measured[TORQUES[0]] if quantity in TORQUES else self.measured[quantity]
        return (self.computed[quantity] - self.measured[quantity]) / size


@cache
def recorded() -> dict[tuple[str, float], list[dict[str, float]]]:
    """The cycles of every study without its ending, by the speed [rpm]."""
    found: dict[tuple[str, float], list[dict[str, float]]] = {}
    for name in RECORDS:
        lines = [line for line in (DOCS / "validation" / name).read_text("utf-8").splitlines() if line[:1] != "#"]
        for row in list(csv.reader(lines))[1:]:
            where, depth, *numbers = (cell.strip() for cell in row)
            study = f"well_{where.lower()}_{depth}" if depth else "laboratory_rig"
            rpm, period, least, greatest, _, peak = (float(number) if number else math.nan for number in numbers)
            ratio = peak / rpm if depth else peak
            cycle = dict(zip(QUANTITIES, (period, ratio, 1e3 * least, 1e3 * greatest), strict=True))
            found.setdefault((study, rpm), []).append(cycle)
    return found


def settings(case: Case, only: Iterable[float] = ()) -> Iterator[Setting]:
    """All settings of a case, or only those at some speeds [rpm]."""
    name = case.study.removesuffix("_wall")
    for (study, rpm), cycles in sorted(recorded().items()):
        if study == name and (not only or rpm in only):
            measured = {quantity: fmean(cycle[quantity] for cycle in cycles) for quantity in QUANTITIES}
            yield Setting(case, rpm, len(cycles), measured, computed(case, rpm))


def computed(case: Case, rpm: float) -> dict[str, float]:
    """The same of a run, after its transient: means over its cycles, as the measured ones
    are. NaN of all but the torques where it settles to steady rotation."""
    time = nsdrill.load_study(case.path).simulation
    trace = nsdrill.simulate(
        case.path,
        rotary_speed=f"{rpm} rpm",
        duration=f"{time.transient + time.observe} s",
        sample=case.sample,
        set=dict(case.changes),
    )
    kept = trace.sel(time=slice(time.transient, None))
    at, speed, torque = (kept[name].values for name in ("time", "bit_speed", "surface_torque"))
    if np.ptp(speed) < 0.1 * rpm * RPM:
        return {"period": math.nan, "peak ratio": math.nan, TORQUES[0]: torque.min(), TORQUES[1]: torque.max()}
    rises = rises_of(at, speed)
    cycles = [slice(*pair) for pair in pairwise(np.searchsorted(at, rises))]
    return {
        "period": period_of(at, speed),
        "peak ratio": fmean(speed[cycle].max() for cycle in cycles) / (rpm * RPM),
        TORQUES[0]: fmean(torque[cycle].min() for cycle in cycles),
        TORQUES[1]: fmean(torque[cycle].max() for cycle in cycles),
    }


def torques(case: Case) -> tuple[float, float]:
    """Static and dynamic torque [N m] of a well by the rule of the page: of every cycle the
    middle between least and greatest torque, and what is left of the swing without the
    energy of rotation; means over the cycles. No period is read."""
    string = nsdrill.check(nsdrill.load_study(case.path)).coefficients
    middles, rests = [], []
    for (study, rpm), cycles in recorded().items():
        if study == case.study:
            for cycle in cycles:
                least, greatest = (cycle[quantity] for quantity in TORQUES)
                middles.append((greatest + least) / 2)
                rests.append(math.sqrt(((greatest - least) / 2) ** 2 - string.k_t * string.J * (rpm * RPM) ** 2))
    return fmean(middles) + fmean(rests), fmean(middles)


def natural_period(case: Case) -> float:
    """That of the string by ``check`` [s]."""
    coefficients = nsdrill.check(nsdrill.load_study(case.path)).coefficients
    return 2 * math.pi * math.sqrt(coefficients.J / coefficients.k_t)


def verdict(errors: list[float]) -> str:
    """One rule for all: see the page."""
    if any(map(math.isnan, errors)):
        return "**no**"
    sizes = [abs(error) for error in errors]
    if median(sizes) <= 0.1 and max(sizes) <= 0.2:
        return "agrees"
    return "in part" if median(sizes) <= 0.2 else "**no**"


def cell(quantity: str, value: float) -> str:
    """One number with three digits, torques in kN m with one decimal."""
    if math.isnan(value):
        return "–"
    return (f"{value / 1e3:.1f}" if quantity in TORQUES else f"{value:#.3g}").replace("-", "−")


def percent(error: float) -> str:
    return "–" if math.isnan(error) else f"{100 * error:+.0f} %".replace("-", "−")


def between(values: Iterable[str]) -> str:
    """The ends of values in their order along the speed."""
    first, *_, last = [*values] * 2
    return first if first == last else f"{first} to {last}"


def table(*rows: Iterable[str]) -> str:
    head, *others = [[*row] for row in rows]
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, ["---"] * len(head), *others))


def summary(found: list[Setting]) -> str:
    """A row of every case and quantity."""
    rows = [("case", "known from", "not known, how set", "quantity", "measured", "nsdrill", "error", "verdict")]
    for case, group in groupby(found, lambda one: one.case):
        some = [*group]
        told: tuple[str, ...] = (f"{case.title}, {between(f'{one.rpm:g}' for one in some)} rpm", case.known, case.set)
        for quantity in QUANTITIES:
            known = [one for one in some if not math.isnan(one.measured[quantity])]
            if known:
                errors = [one.apart(quantity) for one in known]
                unit = {"period": " s", "peak ratio": ""}.get(quantity, " kN m")
                ends = [between(cell(quantity, one[quantity]) for one in side) + unit for side in sides(known)]
                spread = between(percent(error) for error in sorted(errors))
                rows.append((*told, quantity, *ends, spread, verdict(errors)))
                told = ("", "", "")
    return table(*rows)


def sides(some: list[Setting]) -> tuple[list[dict[str, float]], list[dict[str, float]]]:
    return [one.measured for one in some], [one.computed for one in some]


def every(found: list[Setting]) -> str:
    """A row of every setting: measured, nsdrill, and the error of the period."""
    rows = [("case", "rpm", "cycles", "period [s]", "error", "peak ratio", "least torque", "greatest torque")]
    for one in found:
        period, *others = (
            ", ".join(cell(quantity, side[quantity]) for side in (one.measured, one.computed))
            for quantity in QUANTITIES
        )
        rows.append((one.case.title, f"{one.rpm:g}", str(one.cycles), period, percent(one.apart("period")), *others))
    return table(*rows)


def causes() -> str:
    """A row of every string of which one thing is another, at one setting of well B."""
    rows = [("1733 m, 69.7 rpm", "period [s]", "peak ratio", "least torque", "greatest torque")]
    for words, case in CAUSES:
        (one,) = settings(case, (CAUSES_AT,))
        if len(rows) == 1:
            rows.append(("measured", *(cell(quantity, one.measured[quantity]) for quantity in QUANTITIES)))
        rows.append((words, *(cell(quantity, one.computed[quantity]) for quantity in QUANTITIES)))
    return table(*rows)


def statistics(blind: list[Setting], fitted: list[Setting]) -> str:
    """Errors of all settings together."""
    rows = [("quantity", "settings", "independent strings", "median absolute error", "largest", "sign")]

    def row(words: str, errors: list[tuple[Setting, float]]) -> None:
        known = [(one.case.title.partition(",")[0], error) for one, error in errors if not math.isnan(error)]
        sizes = [abs(error) for _, error in known]
        low = sum(error < 0 for _, error in known)
        sign = f"{low} low, {len(known) - low} high"
        counted = (str(len(known)), str(len({title for title, _ in known})))
        rows.append((words, *counted, f"{100 * median(sizes):.0f} %", f"{100 * max(sizes):.0f} %", sign))

    free = {case: natural_period(case) for case in BLIND}
    row("period, blind", [(one, one.apart("period")) for one in blind])
    tuned = [one for case in BLIND[:4] for one in settings(replace(case, changes=STEEL))]
    row("the same with 61 GPa, which the authors tuned", [(one, one.apart("period")) for one in tuned])
    row("period, fitted, friction along the wall", [(one, one.apart("period")) for one in fitted])
    natural = [(one, free[one.case] / one.measured["period"] - 1) for one in blind]
    row("`free_period` of `check`: a lower bound, no prediction", natural)
    for quantity in QUANTITIES[1:]:
        for words, found in (("blind", blind), ("fitted", fitted)):
            more = " over the swing" if quantity in TORQUES else ""
            row(f"{quantity}{more}, {words}", [(one, one.apart(quantity)) for one in found])
    return table(*rows)


def tables() -> dict[str, str]:
    """What stands on the page, by its mark there."""
    blind, fitted = ([one for case in cases for one in settings(case)] for cases in (BLIND, FITTED))
    return {
        "blind": summary([*blind, *settings(AGAIN)]),
        "fitted": summary([*fitted, *settings(FITTED_AGAIN)]),
        "causes": causes(),
        "statistics": statistics(blind, fitted),
        "every blind": every(blind),
        "every fitted": every(fitted),
    }


def main(arguments: list[str]) -> int:
    chosen = [name for name in arguments if not name.startswith("--")]
    needed = [
        DOCS / "validation.md",
        *(DOCS / "validation" / name for name in RECORDS),
        *(one.path for one in CASES.values()),
    ]
    if lacking := [path for path in needed if not path.exists()]:
        print(
            f"{lacking[0]}: there is no such file; this script needs a checkout of nsdrill, with the page, records and "
            "studies: python docs/validate.py. One study: nsdrill new --example validation-well-b-1733 -o well.yaml",
            file=sys.stderr,
        )
        return 2
    if unknown := set(chosen) - set(CASES):
        print(f"no such study: {', '.join(sorted(unknown))}; there are {', '.join(CASES)}", file=sys.stderr)
        return 2
    if chosen:
        print(every([one for name in chosen for one in settings(CASES[name])]), end="")
        return 0
    page = DOCS / "validation.md"
    was = text = page.read_text("utf-8")
    for name, rows in tables().items():
        print(f"{name}\n\n{rows}")
        text = on_page(text, name, rows)
    if "--write" in arguments:
        page.write_text(text, encoding="utf-8")
    elif text != was:
        print("The page says something else: python docs/validate.py --write", file=sys.stderr)
        return 1
    return 0


def on_page(text: str, name: str, rows: str) -> str:
    """The page with the rows of a table."""
    marked = rf"(<!-- measured: {name} -->\n).*?(<!-- end of table -->)"
    return re.sub(marked, lambda found: found[1] + rows + found[2], text, flags=re.DOTALL)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
