"""Cost against friction smoothing, from 10^2 to 10^6: the sharper the friction law, the
stiffer the equations.

    python -m benchmarks.stiffness [--quick] [--out stiffness] [--lanes 16]

The bit's smoothing (s/rad) is varied in stick-slip and as the bit bounces, the wall's
(s/m) in rolling contact; the other keeps its default. All start from the states that
the default smoothing reaches in 30 s. Both methods of nsdrill run with all observers,
the explicit one as far as it comes in reasonable time. LSODA (numbalsoda) and CVODE
(scikit-sundae), both with a compiled right-hand side, take turns with them where they
are installed, without observers: at the same relative tolerance, and at the same error,
1e-4 of the final states in natural scales against an implicit run at 1e-11, with times
interpolated between tolerances. nsdrill is there the method that ``auto`` takes.

The time is that of a simulated second in the regime: of runs of two lengths, the
difference over the time simulated in between. What a sweep and a run cost besides is
the same for both lengths and drops out: a millisecond and some microseconds, more than
a bit that bounces for 6 s. (``benchmarks.scaling`` measures that.)
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import alone, describe, table, where, write

METHODS = ("explicit", "implicit")
POINTS = 128  # of nsdrill: a few to a lane, as in a sweep
PEER_POINTS = 16  # a peer makes one after the other
LONGER = 4  # times the length of the short runs, at whose end the error is taken
SMOOTHINGS = (1e2, 5e2, 1e3, 1e4, 1e5, 1e6)
EXPLICIT_UP_TO = 1e4
TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8)
ERROR = 1e-4
# The side whose friction steepens; depth [m], weight on bit [N], speeds [rad/s],
# simulated time [s].
CASES = {
    "stick-slip, smoothing of the bit": ("bit", 5000.0, 66.72e3, (0.99, 1.01), 12.0),
    "rolling contact, smoothing of the wall": ("well", 5000.0, 22.24e3, (7.9, 8.1), 4.0),
    "bouncing, smoothing of the bit": ("bit", 5000.0, 22.24e3, (4.2, 4.4), 6.0),
}
HEAD = (
    "smoothing",
    "steps/s",
    "rejected",
    "explicit, us/s",
    "implicit, us/s",
    "explicit, ns/step",
    "implicit, ns/step",
    "step: implicit / explicit",
    "step: without observers",
    "auto",
    "LSODA / auto, rtol 1e-6",
    "LSODA / auto, error 1e-4",
    "CVODE / auto, rtol 1e-6",
    "CVODE / auto, error 1e-4",
)
PEERS = ("lsoda", "cvode")
# of the short runs (0) or the long ones (1), at a relative tolerance
Entry = Callable[[int, float], Any]
ROUNDS, SLOW = 4, 2.0  # what takes longer [s] runs once


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="to 10^4, without the same error")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    parser.add_argument("--lanes", type=int, help="of nsdrill; else what a sweep takes")
    arguments = parser.parse_args()
    alone()
    machine = describe()
    sections, data = [], {}
    for title, case in CASES.items():
        chosen = [one for one in SMOOTHINGS if one <= 1e4 or not arguments.quick]
        rows = []
        for smoothing in chosen:
            rows.append(_measure(*case, smoothing, arguments.quick, arguments.lanes))
            print(title, *_cells(rows[-1]), file=sys.stderr)
        data[title] = rows
        first, last = rows[0], rows[-1]
        sections.append(
            f"## {title.capitalize()}\n\n{table(HEAD, [_cells(row) for row in rows])}\n\n"
            f"From {chosen[0]:.0e} to {chosen[-1]:.0e} the implicit time grows "
            f"{last['implicit'] / first['implicit']:.2f} times, its steps {last['steps'] / first['steps']:.2f} times, "
            f"and the time of auto ({first['auto']}, then {last['auto']}) "
            f"{last[last['auto']] / first[first['auto']]:.2f} times."
        )
    text = "\n\n".join(
        [
            "# Friction smoothing",
            where(machine),
            f"{POINTS} points each ({PEER_POINTS} of the peers), relative tolerance 1e-6, "
            f"{arguments.lanes or 'the usual'} lanes; processor time of a simulated second in one process, without "
            f"what a sweep and a run cost besides; the least of {ROUNDS} runs that take turns (of one where it takes "
            f"over {SLOW:g} s).",
            *sections,
        ]
    )
    write(arguments.out, text, {"machine": machine, "cases": data})


def _cells(row: dict[str, Any]) -> tuple[str, ...]:
    def number(name: str, form: str = ".2f") -> str:
        return "-" if row[name] is None or not np.isfinite(row[name]) else format(row[name], form)

    return (
        f"{row['smoothing']:.0e}",
        number("steps", ".0f"),
        number("rejected", ".0%"),
        number("explicit"),
        number("implicit"),
        number("explicit_step", ".1f"),
        number("implicit_step", ".1f"),
        number("step"),
        number("bare_step"),
        row["auto"],
        number("lsoda"),
        number("lsoda_error"),
        number("cvode"),
        number("cvode_error"),
    )


def _measure(
    side: str,
    depth: float,
    wob: float,
    speeds: tuple[float, float],
    seconds: float,
    smoothing: float,
    quick: bool,
    lanes: int | None,
) -> dict[str, Any]:
    from benchmarks.peers.nsdrill_peer import Nsdrill
    from benchmarks.workload import STATES, grid, problem_of, spun_up
    from nsdrill.kernel.batch import choose_lanes, widened
    from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
    from nsdrill.models.friction import implicit
    from nsdrill.models.operation import Values

    base = Parameters()
    part = getattr(base, side)
    changed = replace(base, **{side: replace(part, friction=replace(part.friction, smoothing=smoothing))})
    work = spun_up(grid(np.array([depth]), np.linspace(*speeds, POINTS), 0.0, seconds, wob=wob), 30.0, rtol=1e-6)
    work = replace(work, parameters=changed)
    methods = METHODS if smoothing <= EXPLICIT_UP_TO else METHODS[1:]
    auto = METHODS[
        int(np.any(implicit("auto", work.model, Values(changed, Initial(), (depth, wob, np.array(speeds))))))
    ]
    lengths = (seconds, LONGER * seconds)
    works = {
        name: [replace(work, simulation=replace(work.simulation, method=name, observe=length)) for length in lengths]
        for name in methods
    }
    taken = {name: lanes or widened(choose_lanes(POINTS), POINTS, works[name][0].program.rows) for name in methods}
    ours = {name: Nsdrill(taken[name]) for name in methods}
    bare = {f"{name}, bare": Nsdrill(taken[name], observed=False) for name in methods}
    some = slice(None, None, POINTS // PEER_POINTS)
    problems = [problem_of(one).part(some) for one in works[METHODS[1]]]
    entries: dict[str, Entry] = {}
    for name in methods:
        entries[name] = lambda which, rtol, name=name: ours[name].run(works[name][which], rtol)
    for name, peer in _peers().items():
        entries[name] = lambda which, rtol, peer=peer: peer.run(problems[which], rtol)
    simulated = {name: (PEER_POINTS if name in PEERS else POINTS) * (lengths[1] - lengths[0]) for name in entries}
    for name, one in works.items():
        # compiled before
        ours[name].run(replace(one[0], simulation=replace(one[0].simulation, observe=1e-3)))
    runs = {
        f"{name}, bare": lambda which, rtol, name=name: bare[f"{name}, bare"].run(works[name][which], rtol)
        for name in methods
    }
    found = _in_turns(entries | runs, 1e-6)
    second = {name: found[name].seconds / simulated[name] for name in entries}
    columns = ours["implicit"].columns
    steps = float(np.sum(columns["steps"] + columns["rejected"]))
    row: dict[str, Any] = {
        "smoothing": smoothing,
        "auto": auto,
        "lanes": taken[auto],
        "steps": steps / POINTS / lengths[1],
        "rejected": float(np.sum(columns["rejected"])) / steps,
        **{name: second[name] * 1e6 if name in second else None for name in METHODS},
        **{f"{name}_step": found[name].step * 1e9 if name in found else None for name in METHODS},
        **dict.fromkeys(("step", "bare_step", *PEERS, *(f"{name}_error" for name in PEERS))),
    }
    if "explicit" in found:
        row["step"] = found["implicit"].step / found["explicit"].step
        row["bare_step"] = found["implicit, bare"].step / found["explicit, bare"].step
    there = [name for name in PEERS if name in entries]
    row |= {name: second[name] / second[auto] for name in there}
    if not quick and there:
        exact = Nsdrill(taken["implicit"]).run(works["implicit"][0], 1e-11).end[some, :STATES]
        scale = problems[0].state_scales + np.abs(exact)
        each = [_in_turns({name: entries[name] for name in (auto, *there)}, rtol) for rtol in TOLERANCES]
        at = {}
        for name in (auto, *there):
            errors = [_error(one[name].end[some if name == auto else slice(None)], exact, scale) for one in each]
            times = [one[name].seconds / simulated[name] for one in each]
            if np.all(np.isfinite([errors, times])):  # else it gave up at some point
                at[name] = _at_error(times, errors)
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


@dataclass
class Found:
    """Processor seconds by which the long runs take longer than the short ones, those
    of a step, and the states at the end of the short ones."""

    seconds: float
    step: float
    end: np.ndarray


def _in_turns(entries: dict[str, Entry], rtol: float) -> dict[str, Found]:
    """Of each the least times, of runs that take turns; NaN seconds where a long run
    gave up."""
    least, steps = {name: [np.inf, np.inf] for name in entries}, {name: [0, 0] for name in entries}
    ends: dict[str, dict[int, np.ndarray]] = {name: {} for name in entries}
    for _ in range(ROUNDS):
        for name, run in entries.items():
            for which in (0, 1) if not SLOW < least[name][1] < np.inf else ():
                done = run(which, rtol)
                least[name][which] = min(least[name][which], done.cpu_seconds)
                steps[name][which] = done.steps or 0
                ends[name][which] = done.end
    found = {}
    for name, (short, long) in least.items():
        between = steps[name][1] - steps[name][0]
        taken = long - short if np.all(np.isfinite(ends[name][1])) else np.nan
        found[name] = Found(taken, taken / between if between else np.nan, ends[name][0])
    return found


def _error(end: np.ndarray, exact: np.ndarray, scale: np.ndarray) -> float:
    """The median over the points of the largest error of a state."""
    return float(np.median(np.max(np.abs(end[:, : exact.shape[1]] - exact) / scale, axis=1)))


def _at_error(times: list[float], errors: list[float]) -> float:
    """The processor seconds at the error :data:`ERROR`, by a line through times and
    errors in logarithms."""
    slope, at = np.polyfit(np.log(errors), np.log(times), 1)
    return float(np.exp(at + slope * np.log(ERROR)))


if __name__ == "__main__":
    main()
