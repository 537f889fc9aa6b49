"""Cost against friction smoothing, from 10^2 to 10^6: the sharper the friction law, the stiffer the equations.

    python -m benchmarks.stiffness [--quick] [--out stiffness]

The bit's smoothing (s/rad) is varied in stick-slip, the wall's (s/m) in rolling contact; the other keeps its default.
All start from the states that the default smoothing reaches in 30 s. Stick-slip is followed over whole cycles; rolling,
which is steady, over the shorter the sharper the friction.
LSODA, which turns implicit where the motion is stiff, runs along where numbalsoda is installed.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import alone, describe, table, where, write

POINTS = 32
SMOOTHINGS = (1e2, 1e3, 1e4, 1e5, 1e6)
CASES = {
    "stick-slip, smoothing of the bit": ("bit", 2000.0, (0.95, 1.05)),
    "rolling contact, smoothing of the wall": ("well", 2000.0, (7.9, 8.1)),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="to 10^4")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    alone()
    machine = describe()
    sections, data = [], {}
    for title, case in CASES.items():
        rows = [_measure(*case, smoothing) for smoothing in (SMOOTHINGS[:3] if arguments.quick else SMOOTHINGS)]
        data[title] = rows
        sections.append(
            f"## {title.capitalize()}\n\n"
            + table(
                (
                    "smoothing",
                    "steps per simulated s",
                    "rejected",
                    "s per 1000 simulated s",
                    "in regime",
                    "lsoda, times nsdrill",
                ),
                [
                    (
                        f"{r['smoothing']:.0e}",
                        f"{r['steps']:.0f}",
                        f"{r['rejected']:.1%}",
                        f"{1000 * r['seconds']:.3f}",
                        f"{r['in_regime']:.0%}",
                        "-" if r["lsoda"] is None else f"{r['lsoda']:.2f}",
                    )
                    for r in rows
                ],
            )
        )
    text = "\n\n".join(
        [
            "# Friction smoothing",
            where(machine),
            f"{POINTS} points each, relative tolerance 1e-6, eight lanes, processor time, median of three.",
            *sections,
        ]
    )
    write(arguments.out, text, {"machine": machine, "cases": data})


def _measure(side: str, depth: float, speeds: tuple[float, float], smoothing: float) -> dict[str, Any]:
    from benchmarks.peers import MissingPeer
    from benchmarks.peers.nsdrill_peer import Nsdrill
    from benchmarks.peers.numbalsoda_peer import NumbaLsoda
    from benchmarks.workload import grid, problem_of, spun_up
    from nsdrill.models.christoforou_yigit.parameters import Parameters

    base = Parameters()
    part = getattr(base, side)
    changed = replace(base, **{side: replace(part, friction=replace(part.friction, smoothing=smoothing))})
    # Two cycles of stick-slip; of rolling as much as makes some ten thousand steps.
    seconds = 15.0 if side == "bit" else min(20.0, 2e4 / smoothing)
    work = spun_up(grid(np.array([depth]), np.linspace(*speeds, POINTS), 0.0, seconds), 30.0, rtol=1e-6)
    work = replace(work, parameters=changed)
    ours = Nsdrill(8)
    ours.run(work)
    taken = [ours.run(work) for _ in range(3)]
    cpu = float(np.median([r.cpu_seconds for r in taken])) / POINTS / seconds
    columns = ours.columns
    inside = columns["stuck_fraction"] > 0.0 if side == "bit" else columns["wall_contact_fraction"] > 0.5
    steps = columns["steps"] + columns["rejected"]
    try:
        lsoda = NumbaLsoda("lsoda")
        problem = problem_of(work)
        ratio = lsoda.run(problem, 1e-6).cpu_seconds / POINTS / seconds / cpu
    except MissingPeer:
        ratio = None
    return {
        "smoothing": smoothing,
        "steps": float(np.mean(steps)) / seconds,
        "rejected": float(columns["rejected"].sum() / steps.sum()),
        "seconds": cpu,
        "in_regime": float(np.mean(inside)),
        "lsoda": ratio,
    }


if __name__ == "__main__":
    main()
