"""Cost against friction smoothing, from 10^2 to 10^6: the sharper the friction law, the stiffer the equations.

    python -m benchmarks.stiffness [--quick] [--out stiffness]

The bit's smoothing (s/rad) is varied in stick-slip and as the bit bounces, the wall's (s/m) in rolling contact; the
other keeps its default. All start from the states that the default smoothing reaches in 30 s. Both methods of nsdrill
run with all observers, the explicit one as far as it comes in reasonable time. LSODA (numbalsoda) and CVODE
(scikit-sundae), both with a compiled right-hand side, take turns with them where they are installed, without observers:
at the same relative tolerance, and at the same error, 1e-4 of the final states in natural sizes against an implicit run
at 1e-11, with times interpolated between tolerances. nsdrill is there the method that ``auto`` takes.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import alone, describe, table, where, write

METHODS = ("explicit", "implicit")
POINTS, LANES = 16, 16
SMOOTHINGS = (1e2, 5e2, 1e3, 1e4, 1e5, 1e6)
EXPLICIT_UP_TO = 1e4
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8)
ERROR = 1e-4
# The side whose friction steepens; depth [m], weight on bit [N], speeds [rad/s], simulated time [s].
CASES = {
    "stick-slip, smoothing of the bit": ("bit", 5000.0, 66.72e3, (0.99, 1.01), 12.0),
    "rolling contact, smoothing of the wall": ("well", 5000.0, 22.24e3, (7.9, 8.1), 4.0),
    "bouncing, smoothing of the bit": ("bit", 5000.0, 22.24e3, (4.2, 4.4), 6.0),
}
HEAD = (
    "smoothing", "steps/s", "rejected", "explicit, us/s", "implicit, us/s", "step: implicit / explicit", "auto",
    "LSODA / auto, rtol 1e-6", "LSODA / auto, error 1e-4", "CVODE / auto, rtol 1e-6", "CVODE / auto, error 1e-4",
)  # fmt: skip
PEERS = ("lsoda", "cvode")
ROUNDS = 3


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
        number("implicit", ".1f"), number("step"), row["auto"], number("lsoda"), number("lsoda_error"),
        number("cvode"), number("cvode_error"),
    )  # fmt: skip


def _measure(
    side: str, depth: float, wob: float, speeds: tuple[float, float], seconds: float, smoothing: float, quick: bool
) -> dict[str, Any]:
    from benchmarks.peers.nsdrill_peer import Nsdrill
    from benchmarks.workload import STATES, grid, problem_of, spun_up
    from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
    from nsdrill.models.leaves import Values
    from nsdrill.models.steepness import implicit

    base = Parameters()
    part = getattr(base, side)
    changed = replace(base, **{side: replace(part, friction=replace(part.friction, smoothing=smoothing))})
    work = spun_up(grid(np.array([depth]), np.linspace(*speeds, POINTS), 0.0, seconds, wob=wob), 30.0, rtol=1e-6)
    work = replace(work, parameters=changed)
    works = {name: replace(work, simulation=replace(work.simulation, method=name)) for name in ("explicit", "implicit")}
    if smoothing > EXPLICIT_UP_TO:
        del works["explicit"]
    auto = METHODS[
        int(np.any(implicit("auto", work.model, Values(changed, Initial(), (depth, wob, np.array(speeds))))))
    ]
    problem, ours = problem_of(work), {name: Nsdrill(LANES) for name in works}
    entries = {name: lambda rtol, name=name: ours[name].run(works[name], rtol) for name in works}
    entries |= {name: lambda rtol, peer=peer: peer.run(problem, rtol) for name, peer in _peers().items()}
    for name, one in works.items():
        ours[name].run(replace(one, simulation=replace(one.simulation, observe=1e-3)))  # compiled before it is timed
    least, _ = _in_turns(entries, 1e-6)
    per = 1e6 / POINTS / seconds
    steps = {name: ours[name].columns["steps"] + ours[name].columns["rejected"] for name in works}
    row: dict[str, Any] = {
        "smoothing": smoothing, "auto": auto,
        "steps": float(steps["implicit"].sum()) / POINTS / seconds,
        "rejected": float(ours["implicit"].columns["rejected"].sum() / steps["implicit"].sum()),
        "explicit": least["explicit"] * per if "explicit" in least else None,
        "implicit": least["implicit"] * per,
        **dict.fromkeys(("step", *PEERS, *(f"{name}_error" for name in PEERS))),
    }  # fmt: skip
    if "explicit" in least:
        row["step"] = least["implicit"] / steps["implicit"].sum() / (least["explicit"] / steps["explicit"].sum())
    there = [name for name in PEERS if name in entries]
    row |= {name: least[name] / least[auto] for name in there}
    if not quick and there:
        exact = Nsdrill(LANES).run(works["implicit"], 1e-11).end[:, :STATES]
        found = [_in_turns({name: entries[name] for name in (auto, *there)}, rtol) for rtol in TOLERANCES]
        scale = problem.sizes + np.abs(exact)
        at = {}
        for name in (auto, *there):
            errors = [_error(one[1][name], exact, scale) for one in found]
            if np.all(np.isfinite(errors)):  # else it gave up at some point
                at[name] = _at_error([one[0][name] for one in found], errors)
        there = [name for name in there if name in at]
        row |= {f"{name}_error": at[name] / at[auto] for name in there}
    return row


def _peers() -> dict[str, Any]:
    """Those that are installed."""
    from benchmarks.peers import MissingPeer
    from benchmarks.peers.cvode_peer import Cvode
    from benchmarks.peers.numbalsoda_peer import NumbaLsoda

    found: dict[str, Any] = {}
    for name, make in zip(PEERS, (lambda: NumbaLsoda("lsoda"), Cvode), strict=True):
        try:
            found[name] = make()
        except MissingPeer as missing:
            print(f"without {name}: {missing}", file=sys.stderr)
    return found


def _in_turns(entries: dict[str, Callable[[float], Any]], rtol: float) -> tuple[dict[str, float], dict[str, Any]]:
    """The least processor seconds of each, and their final states, of runs that take turns."""
    least, ends = dict.fromkeys(entries, np.inf), {}
    for _ in range(ROUNDS):
        for name, run in entries.items():
            done = run(rtol)
            least[name], ends[name] = min(least[name], done.cpu_seconds), done.end
    return least, ends


def _error(end: np.ndarray, exact: np.ndarray, scale: np.ndarray) -> float:
    """The median over the points of the largest error of a state."""
    return float(np.median(np.max(np.abs(end[:, : exact.shape[1]] - exact) / scale, axis=1)))


def _at_error(times: list[float], errors: list[float]) -> float:
    """The processor seconds at the error :data:`ERROR`, by a line through times and errors in logarithms."""
    slope, at = np.polyfit(np.log(errors), np.log(times), 1)
    return float(np.exp(at + slope * np.log(ERROR)))


if __name__ == "__main__":
    main()
