"""Cost against friction smoothing, from 10^2 to 10^6: the sharper the friction law, the stiffer the equations.

    python -m benchmarks.stiffness [--quick] [--out stiffness]

The bit's smoothing (s/rad) is varied in stick-slip, the wall's (s/m) in rolling contact; the other keeps its default.
All start from the states that the default smoothing reaches in 30 s. Both methods of nsdrill run with all observers,
the explicit one as far as it comes in reasonable time. LSODA (numbalsoda) and CVODE (scikit-sundae) run along where
they are installed, without observers: at the same relative tolerance, and LSODA also at the same error, 1e-4 of the
final states in natural sizes against an implicit run at 1e-11, with times interpolated between tolerances.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import alone, describe, table, where, write

POINTS, LANES = 16, 16
SMOOTHINGS = (1e2, 5e2, 1e3, 1e4, 1e5, 1e6)
EXPLICIT_UP_TO = 1e4
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8)
ERROR = 1e-4
# The side whose friction steepens; depth [m], weight on bit [N], speeds [rad/s], simulated time [s].
CASES = {
    "stick-slip, smoothing of the bit": ("bit", 5000.0, 66.72e3, (0.99, 1.01), 12.0),
    "rolling contact, smoothing of the wall": ("well", 5000.0, 22.24e3, (7.9, 8.1), 4.0),
}
HEAD = (
    "smoothing", "steps/s", "rejected", "explicit, us/s", "implicit, us/s", "step: implicit / explicit",
    "LSODA / nsdrill, rtol 1e-6", "LSODA / nsdrill, error 1e-4", "CVODE / nsdrill, evaluations",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="to 10^4, without the same error")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    alone()
    machine = describe()
    sections, data = [], {}
    for title, case in CASES.items():
        chosen = [one for one in SMOOTHINGS if one <= 1e4 or not arguments.quick]
        rows = []
        for smoothing in chosen:
            rows.append(_measure(*case, smoothing, arguments.quick))
            print(title, *_cells(rows[-1]), file=sys.stderr)
        data[title] = rows
        growth = rows[-1]["implicit"] / rows[0]["implicit"]
        sections.append(
            f"## {title.capitalize()}\n\n{table(HEAD, [_cells(row) for row in rows])}\n\n"
            f"From {chosen[0]:.0e} to {chosen[-1]:.0e} the implicit time grows {growth:.2f} times."
        )
    text = "\n\n".join(
        [
            "# Friction smoothing",
            where(machine),
            f"{POINTS} points each, relative tolerance 1e-6, {LANES} lanes, processor time of a simulated second in "
            "one process, the least of three runs that take turns.",
            *sections,
        ]
    )
    write(arguments.out, text, {"machine": machine, "cases": data})


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    def number(name: str, form: str = ".2f") -> str:
        return "-" if row[name] is None else format(row[name], form)

    return (
        f"{row['smoothing']:.0e}", number("steps", ".0f"), number("rejected", ".0%"), number("explicit", ".1f"),
        number("implicit", ".1f"), number("step"), number("lsoda"), number("lsoda_error"), number("cvode"),
    )  # fmt: skip


def _measure(
    side: str, depth: float, wob: float, speeds: tuple[float, float], seconds: float, smoothing: float, quick: bool
) -> dict[str, Any]:
    from benchmarks.peers import MissingPeer
    from benchmarks.peers.cvode_peer import Cvode
    from benchmarks.peers.nsdrill_peer import Nsdrill
    from benchmarks.peers.numbalsoda_peer import NumbaLsoda
    from benchmarks.workload import STATES, grid, problem_of, spun_up
    from nsdrill.models.christoforou_yigit.parameters import Parameters

    base = Parameters()
    part = getattr(base, side)
    changed = replace(base, **{side: replace(part, friction=replace(part.friction, smoothing=smoothing))})
    work = spun_up(grid(np.array([depth]), np.linspace(*speeds, POINTS), 0.0, seconds, wob=wob), 30.0, rtol=1e-6)
    work = replace(work, parameters=changed)
    works = {name: replace(work, simulation=replace(work.simulation, method=name)) for name in ("explicit", "implicit")}
    if smoothing > EXPLICIT_UP_TO:
        del works["explicit"]
    ours = {name: Nsdrill(LANES) for name in works}
    for name, one in works.items():
        ours[name].run(replace(one, simulation=replace(one.simulation, observe=1e-3)))  # compiled before it is timed
    least = dict.fromkeys(works, np.inf)
    for _ in range(3):
        for name, one in works.items():
            least[name] = min(least[name], ours[name].run(one).cpu_seconds)
    tries = {name: float(np.sum(ours[name].columns["steps"] + ours[name].columns["rejected"])) for name in works}
    per = 1e6 / POINTS / seconds
    row: dict[str, Any] = {
        "smoothing": smoothing,
        "steps": tries["implicit"] / POINTS / seconds,
        "rejected": float(ours["implicit"].columns["rejected"].sum() / tries["implicit"]),
        "explicit": least["explicit"] * per if "explicit" in least else None,
        "implicit": least["implicit"] * per,
        "step": None, "lsoda": None, "lsoda_error": None, "cvode": None,
    }  # fmt: skip
    if "explicit" in least:
        row["step"] = least["implicit"] / tries["implicit"] / (least["explicit"] / tries["explicit"])
    problem = problem_of(work)
    try:
        lsoda = NumbaLsoda("lsoda")
        row["lsoda"] = lsoda.run(problem, 1e-6).cpu_seconds / least["implicit"]
        if not quick:
            exact = Nsdrill(LANES).run(works["implicit"], 1e-11).end[:, :STATES]
            mine = [Nsdrill(LANES).run(works["implicit"], rtol) for rtol in TOLERANCES]
            theirs = [lsoda.run(problem, rtol) for rtol in TOLERANCES]
            row["lsoda_error"] = _at_error(theirs, exact, problem) / _at_error(mine, exact, problem)
    except MissingPeer:
        pass
    try:
        evaluations = Cvode().run(problem.part(slice(0, 2)), 1e-6).evaluations
        row["cvode"] = evaluations / 2 / (7.0 * tries["implicit"] / POINTS)
    except MissingPeer:
        pass
    return row


def _at_error(results: list[Any], exact: np.ndarray, problem: Any) -> float:
    """The processor seconds at the median error :data:`ERROR`, by a line through times and errors in logarithms."""
    scale = problem.sizes + np.abs(exact)
    errors = [float(np.median(np.max(np.abs(one.end - exact) / scale, axis=1))) for one in results]
    slope, at = np.polyfit(np.log(errors), np.log([one.cpu_seconds for one in results]), 1)
    return float(np.exp(at + slope * np.log(ERROR)))


if __name__ == "__main__":
    main()
