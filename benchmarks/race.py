"""The race: one workload through nsdrill and its peers, one core, interleaved.

    python -m benchmarks.race [--quick] [--rounds N] [--rtol X] [--out race]

Every round runs everybody once, each time beginning with another one; ratios are taken
within a round, so that a change of the machine's speed between rounds drops out.
Processor seconds are the measure (``--clock wall`` for the other): everything is
single-threaded on one processor, so the two agree on an idle machine.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import alone, describe, spread, table, where, write

SPARSE = 24  # the slow peers run every so manieth point


def main() -> None:
    arguments = _arguments()
    alone()
    from benchmarks.peers import MissingPeer, everybody
    from benchmarks.peers.nsdrill_peer import Nsdrill
    from benchmarks.workload import mixed, problem_of, regimes
    from nsdrill.kernel.batch import choose_lanes

    machine = describe()
    size = (6, 8, 3.0, 3.0) if arguments.quick else (24, 20, 30.0, 50.0)
    work = mixed(*size, rtol=arguments.rtol)
    problem = problem_of(work)
    simulated = len(problem) * problem.duration
    peers, absent = everybody()
    own = choose_lanes(len(problem))
    base = Nsdrill(own)
    ours: list[Nsdrill] = [base, *(Nsdrill(lanes) for lanes in (16, 8, 1) if lanes != own)]
    try:
        blind = Nsdrill(own, observed=False)
        blind.run(work)
        ours.append(blind)
    except MissingPeer as reason:
        absent["nsdrill, null observer"] = str(reason)

    # One run of everybody to compile, to load and to warm up. The sparse points' share
    # of the steps is nsdrill's count.
    for own in ours:
        own.run(work)
    steps_by_point = base.columns["steps"] + base.columns["rejected"]
    some = np.arange(len(problem) // SPARSE // 2, len(problem), SPARSE)
    share = {
        peer.name: steps_by_point[some].sum() / steps_by_point.sum() if "SciPy" in peer.name else 1.0 for peer in peers
    }
    parts = {peer.name: problem.part(some) if "SciPy" in peer.name else problem for peer in peers}
    for peer in peers:
        peer.run(parts[peer.name], arguments.rtol)

    runners: list[tuple[str, str, float, Any]] = [
        *((own.name, own.lacks, 1.0, lambda own=own: own.run(work)) for own in ours),
        *(
            (peer.name, peer.lacks, share[peer.name], lambda peer=peer: peer.run(parts[peer.name], arguments.rtol))
            for peer in peers
        ),
    ]
    results: dict[str, list[Any]] = {name: [] for name, *_ in runners}
    for turn in range(arguments.rounds):
        for name, _, _, run in runners[turn % len(runners) :] + runners[: turn % len(runners)]:
            results[name].append(run())

    def seconds(name: str) -> np.ndarray:
        """Per simulated second, one value a round."""
        part = next(share for other, _, share, _ in runners if other == name)
        taken = [r.seconds if arguments.clock == "wall" else r.cpu_seconds for r in results[name]]
        return np.array(taken) / part / simulated

    rows, data = [], []
    ends = results[base.name][0].end
    for name, lacks, part, _ in runners:
        cost = seconds(name)
        ratio = cost / seconds(base.name)
        one = results[name][0]
        steps = None if one.steps is None else one.steps / part
        per_step = None if steps is None else cost * simulated / steps * 1e9
        per_call = None if one.evaluations is None else cost * simulated / (one.evaluations / part) * 1e9
        compared = ends if part == 1.0 else ends[some]
        state_scales = problem.state_scales if part == 1.0 else problem.state_scales[some]
        apart = float(np.nanmedian(np.max(np.abs(one.end - compared) / state_scales, axis=1)))
        failed = int(np.sum(~np.isfinite(one.end).all(axis=1)))
        rows.append(
            (
                name,
                "-" if per_step is None else f"{np.median(per_step):.0f}",
                "-" if per_call is None else f"{np.median(per_call):.1f}",
                "-" if steps is None else f"{steps / simulated:.0f}",
                f"{np.median(cost) * 1000:.4f}",
                spread(ratio),
            )
        )
        data.append(
            {
                "name": name,
                "lacks": lacks,
                "ns_per_step": per_step,
                "ns_per_evaluation": per_call,
                "steps": steps,
                "seconds_per_1000_simulated": cost * 1000,
                "ratio": ratio,
                "points_run_share_of_steps": part,
                "median_distance_of_ends": apart,
                "failed": failed,
                "wall_seconds": [r.seconds for r in results[name]],
                "cpu_seconds": [r.cpu_seconds for r in results[name]],
            }
        )
    kinds = regimes(base.columns)
    head = (
        "solver",
        "ns per step tried",
        "ns per evaluation",
        "steps per simulated s",
        "s per 1000 simulated s",
        f"times {base.name} (median, least to largest)",
    )
    text = "\n\n".join(
        [
            "# Race",
            where(machine),
            f"{len(problem)} points, {problem.duration:g} s each, relative tolerance {arguments.rtol:g}; "
            + ", ".join(f"{count} {name}" for name, count in kinds.items())
            + f". {arguments.rounds} rounds, {arguments.clock} time, one core, interleaved. Steps "
            f"count accepted and "
            "rejected ones; an evaluation is one call of the right-hand side for one state. "
            f"Lanes in use: {base.lane_use:.0%} of {base.lanes}.",
            table(head, rows),
            "What each does and leaves out:\n\n"
            + "\n".join(
                f"- **{name}**: {lacks}" + (f"; gave up on {row['failed']} points" if row["failed"] else "") + "."
                for (name, lacks, *_), row in zip(runners, data, strict=True)
            ),
            "Not run:\n\n" + ("\n".join(f"- **{name}**: needs {why}." for name, why in absent.items()) or "- nobody."),
        ]
    )
    write(
        arguments.out,
        text,
        {
            "machine": machine,
            "points": len(problem),
            "duration": problem.duration,
            "rtol": arguments.rtol,
            "regimes": kinds,
            "rounds": arguments.rounds,
            "clock": arguments.clock,
            "results": data,
            "skipped": absent,
            "lane_use": {own.name: own.lane_use for own in ours if own.observed},
        },
    )


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a small workload: a minute with all compilations")
    parser.add_argument("--rounds", type=int, default=None)
    parser.add_argument("--rtol", type=float, default=1e-6)
    parser.add_argument("--clock", choices=("cpu", "wall"), default="cpu")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    arguments.rounds = arguments.rounds or (3 if arguments.quick else 9)
    return arguments


if __name__ == "__main__":
    main()
