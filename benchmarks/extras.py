"""What the explorer's measurements cost: returns to the Poincare section, kinds of
motion, the Lyapunov exponent.

    python -m benchmarks.extras [--rounds 5] [--out extras]

480 operating points with the default times (300 s, then 200 s observed), one thread, 16
lanes: with the features alone, with 200 returns kept of each point, and with the
exponent besides, in interleaved rounds. Processor time, labels included; ratios are
taken within a round.
"""

from __future__ import annotations

import argparse
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.machine import describe, spread, table, where, write
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.observe.thresholds import Record
from nsdrill.study import parse_study
from nsdrill.sweep.engine import Engine
from nsdrill.sweep.work import Work, compiled_parts

LANES = 16
STUDY = """
sweep:
  depth: {from: 1000 m, to: 8000 m, points: 24}
  rotary_speed: {from: 1 rad/s, to: 8 rad/s, points: 20}
simulation: {transient: 300 s, observe: 200 s}
"""
WAYS = {
    "features and peaks": Record(),
    "and 200 returns to the section": Record(poincare=200),
    "and the Lyapunov exponent": Record(poincare=200, exponent=True),
}


def seconds(work: Work) -> float:
    """Processor time of the whole sweep in one thread and the thread that labels."""
    compiled_parts(LANES, work.program)
    with ThreadPoolExecutor(1) as threads:
        begun = time.process_time()
        Engine(work, threads, 1, LANES, lambda points, columns: None).run()
        return time.process_time() - begun


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    machine = describe()
    study = work_of(prepare(parse_study(STUDY)))
    works = {name: replace(study, record=record) for name, record in WAYS.items()}
    for work in works.values():  # compile, warm the caches
        seconds(replace(work, simulation=replace(work.simulation, transient=0.0, observe=5.0)))
    times = np.array([[seconds(work) for work in works.values()] for _ in range(arguments.rounds)])
    ratios = times / times[:, :1]
    rows = [[name, f"{np.median(times[:, i]):.2f}", spread(ratios[:, i].tolist())] for i, name in enumerate(works)]
    text = f"{where(machine)}\n\n{table(['measured', 'processor seconds', 'times the first'], rows)}\n"
    write(arguments.out, text, {"machine": machine, "times": times.tolist(), "ways": list(works)})


if __name__ == "__main__":
    main()
