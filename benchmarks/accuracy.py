"""Work and precision: the error reached at the end of short runs against the time
taken, for nsdrill and its peers.

    python -m benchmarks.accuracy [--quick] [--out accuracy]

Each regime is a fan of neighbouring points that begin in it. The error of a point is
the largest of its states' end errors in units of their natural scales (those of the
tolerance), against DOP853 at 1e-12; of a fan, the median over points. The cost is that
of a simulated second in the regime, taken over longer runs from the same states. Times
at equal error come from straight lines between the measured points in log-log. Where
the motion is chaotic no end state can be compared: there the means over an ensemble
must agree within their statistical spread.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import alone, describe, table, where, write

TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
# seconds of simulated time over which the cost is taken: a run's fixed cost is the
# scaling benchmark's
TIMED = 20.0
LEVELS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
MEANS = (
    "bit_speed_max",
    "stick_slip_index",
    "lift_off_fraction",
    "axial_max",
    "bit_force_max",
    "radius_mean",
    "radius_max",
    "wall_contact_fraction",
    "lateral_acceleration_rms",
)


@dataclass(frozen=True)
class Regime:
    """A fan of speeds at one depth: ``spin`` seconds are run first, ``horizon`` seconds
    are compared."""

    name: str
    depth: float
    speeds: tuple[float, float]
    spin: float
    horizon: float


REGIMES = (
    Regime("free whirl, bit on rock", 1000.0, (2.95, 3.05), 0.0, 20.0),
    Regime("bouncing", 3500.0, (2.95, 3.05), 10.0, 2.0),
    Regime("rolling along the wall", 2000.0, (7.9, 8.1), 30.0, 1.0),
    Regime("stick-slip", 2000.0, (0.95, 1.05), 10.0, 4.0),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer points, tolerances and rounds")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    alone()
    from benchmarks.peers import everybody

    machine = describe()
    peers, absent = everybody()
    # SciPy's loop in Python has its place in the race; its errors are those of the
    # other Dormand-Prince pairs.
    peers = [peer for peer in peers if "SciPy" not in peer.name and ", skips" not in peer.name]
    points, rounds = (16, 1) if arguments.quick else (64, 3)
    tolerances = TOLERANCES[::2] if arguments.quick else TOLERANCES
    measured = [_precision(regime, peers, points, rounds, tolerances) for regime in REGIMES]
    statistics, ends = _chaos(peers, 64 if arguments.quick else 256)
    text = "\n\n".join(
        [
            "# Work and precision",
            where(machine),
            f"{points} points a regime, median error over them; median of {rounds} interleaved timings.",
            *(_tables(regime, result, tolerances) for regime, result in zip(REGIMES, measured, strict=True)),
            statistics,
            "Not run:\n\n" + ("\n".join(f"- **{name}**: needs {why}." for name, why in absent.items()) or "- nobody."),
        ]
    )
    write(
        arguments.out,
        text,
        {"machine": machine, "regimes": dict(zip((r.name for r in REGIMES), measured, strict=True)), "chaos": ends},
    )


def _precision(
    regime: Regime, peers: list[Any], points: int, rounds: int, tolerances: tuple[float, ...]
) -> dict[str, Any]:
    """Errors and seconds by solver, over the tolerances."""
    from benchmarks.peers.nsdrill_peer import Nsdrill
    from benchmarks.peers.scipy_peer import reference
    from benchmarks.workload import grid, problem_of, spun_up

    work = grid(np.array([regime.depth]), np.linspace(*regime.speeds, points), 0.0, regime.horizon)
    if regime.spin:
        work = spun_up(work, regime.spin)
    problem = problem_of(work)
    timed = replace(work, simulation=replace(work.simulation, observe=TIMED))
    timed_problem = problem_of(timed)
    checked = np.arange(0, points, max(points // 8, 1))
    exact = reference(problem.part(checked))
    state_scales = problem.state_scales[checked]
    ours = Nsdrill(8)
    runners: dict[str, Any] = {ours.name: lambda short, rtol: ours.run(work if short else timed, rtol)}
    for peer in peers:
        runners[peer.name] = lambda short, rtol, peer=peer: peer.run(problem if short else timed_problem, rtol)
    out: dict[str, Any] = {name: {"error": [], "worst": [], "seconds": []} for name in runners}
    for rtol in tolerances:
        for name, run in runners.items():
            error = np.max(np.abs(run(True, rtol).end[checked] - exact) / state_scales, axis=1)
            error = np.where(np.isfinite(error), error, np.inf)
            out[name]["error"].append(float(np.median(error)))
            out[name]["worst"].append(float(np.max(error)))
        taken = [{name: run(False, rtol).cpu_seconds for name, run in runners.items()} for _ in range(rounds)]
        for name in runners:
            out[name]["seconds"].append(float(np.median([t[name] for t in taken])) / points / TIMED)
    return out


def time_at(level: float, errors: list[float], seconds: list[float]) -> float:
    """Seconds at which the error is ``level``, NaN outside of what was measured."""
    e, s = np.log(np.array(errors)), np.log(np.array(seconds))
    good = np.isfinite(e)
    # From loose to tight; an error that does not fall any more adds nothing.
    e, s = e[good], s[good]
    for i in range(len(e) - 1):
        if e[i] >= np.log(level) >= e[i + 1] and e[i] > e[i + 1]:
            return float(np.exp(s[i] + (s[i + 1] - s[i]) * (e[i] - np.log(level)) / (e[i] - e[i + 1])))
    return float("nan")


def _tables(regime: Regime, result: dict[str, Any], tolerances: tuple[float, ...]) -> str:
    base = next(name for name in result if name.startswith("nsdrill"))
    errors = table(
        ("error at rtol", *(f"{rtol:.0e}" for rtol in tolerances)),
        [(name, *(f"{e:.1e}" for e in one["error"])) for name, one in result.items()],
    )
    own = {level: time_at(level, result[base]["error"], result[base]["seconds"]) for level in LEVELS}
    rows = []
    for name, one in result.items():
        ratios = [time_at(level, one["error"], one["seconds"]) / own[level] for level in LEVELS]
        rows.append((name, *("-" if not np.isfinite(r) else f"{r:.2f}" for r in ratios)))
    equal = table(("time at equal error, nsdrill = 1", *(f"{level:.0e}" for level in LEVELS)), rows)
    return (
        f"## {regime.name.capitalize()}\n\n{regime.depth:g} m, {regime.speeds[0]:g} to {regime.speeds[1]:g} rad/s, "
        f"{regime.horizon:g} s after {regime.spin:g} s.\n\n{errors}\n\n{equal}"
    )


def _chaos(peers: list[Any], members: int) -> tuple[str, dict[str, Any]]:
    """Ensembles of bouncing runs with nearly the same speed: features over tolerances,
    end states over solvers."""
    from benchmarks.peers.nsdrill_peer import Nsdrill
    from benchmarks.workload import grid, problem_of, sweep, with_rtol

    work = grid(np.array([5000.0]), np.linspace(2.999, 3.001, members), 20.0, 20.0)
    problem = problem_of(work)

    def apart(a: np.ndarray, b: np.ndarray) -> float:
        """Difference of the means in standard errors."""
        error = np.sqrt(np.var(a, ddof=1) / len(a) + np.var(b, ddof=1) / len(b))
        return float(abs(np.mean(a) - np.mean(b)) / error) if error > 0 else 0.0

    base, _ = sweep(work, 8)
    rows, data = [], {}
    others = {rtol: sweep(with_rtol(work, rtol), 8)[0] for rtol in (1e-4, 1e-8)}
    for name in MEANS:
        scores = [apart(base[name], others[rtol][name]) for rtol in others]
        data[name] = scores
        rows.append((name, f"{np.mean(base[name]):.4g}", f"{np.std(base[name]):.2g}", *(f"{s:.1f}" for s in scores)))
    features = table(("feature", "mean", "spread", *(f"apart at {rtol:.0e}" for rtol in others)), rows)

    def seen(end: np.ndarray) -> np.ndarray:
        good = end[np.isfinite(end).all(axis=1)]
        return np.stack([np.hypot(good[:, 0], good[:, 2]), good[:, 4], good[:, 6], good[:, 7]])

    own = seen(Nsdrill(8).run(work).end)
    rows = []
    for peer in peers:
        scores = [apart(a, b) for a, b in zip(own, seen(peer.run(problem, 1e-6).end), strict=True)]
        data[peer.name] = scores
        rows.append((peer.name, *(f"{s:.1f}" for s in scores)))
    solvers = table(("end states against nsdrill's", "radius", "z", "twist", "bit speed"), rows)
    return (
        f"## Chaotic motion\n\n{members} runs of 40 s at 5000 m, 2.999 to 3.001 rad/s. Differences of means in "
        f"standard errors: below about 3 they are chance.\n\n{features}\n\n{solvers}"
    ), data


if __name__ == "__main__":
    main()
