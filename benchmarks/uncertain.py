"""What a map of probabilities costs: 256 samples of 30 x 30 operating points, up and
back down, 100 s each.

    python -m benchmarks.uncertain [--part 16] [--rounds 3] [--quick] [--out uncertain]

A proportional part of its 460 800 runs: so many of the samples, in one thread, with and
without carried states in interleaved rounds; processor time, also in proportion for all
and two cores. Then, in processes of their own, the largest resident memory of all 460
800 runs (of a tenth of a second), of the window and of the indices from that file.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from benchmarks.machine import describe, spread, table, where, write
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.study import parse_study
from nsdrill.sweep.engine import Engine
from nsdrill.sweep.work import Work, compiled_parts

LANES = 16
ALL = 256
STUDY = """
title: A map of probabilities
operation: {depth: 2000 m}
bit: {lobes: 1, surface_amplitude: 0.5 mm}
sweep:
  wob: {from: 20 kN, to: 160 kN, points: 30}
  rotary_speed: {from: 40 rpm, to: 160 rpm, points: 30}
  procedure: up-down
  along: rotary_speed
uncertain:
  bit.rock_stiffness: {lognormal: {median: 25 MN/m, factor: 2}}
  bit.friction.static: {uniform: [0.3, 0.6]}
  drillstring.eccentricity: {triangular: [1 mm, 3 mm, 8 mm]}
simulation: {transient: 60 s, observe: 40 s}
record: {peaks: 0}
"""
# The largest resident memory of one command [MB]. That of getrusage counts the process
# from which it was started, too.
MEMORY = """
import sys
from nsdrill.cli.main import main
sys.argv = ["nsdrill", *sys.argv[1:]]
try:
    main()
except SystemExit as end:
    assert not end.code, end.code
(peak,) = [line for line in open("/proc/self/status") if line.startswith("VmHWM")]
print(int(peak.split()[1]) * 1.024e-3, file=sys.stderr)
"""


def seconds(work: Work) -> float:
    """Processor time of the whole sweep in one thread and the thread that labels."""
    with ThreadPoolExecutor(1) as threads:
        begun = time.process_time()
        Engine(work, threads, 1, LANES, lambda points, columns: None).run()
        return time.process_time() - begun


def memory(*words: str) -> float:
    """The largest resident memory of ``nsdrill words...`` [MB]."""
    done = subprocess.run(
        [sys.executable, "-c", MEMORY, *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    return float(done.stderr.strip().splitlines()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--part", type=int, default=16, help="samples that are run, of 256")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--quick", action="store_true", help="two samples, one round, no memory")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    part, rounds = (2, 1) if arguments.quick else (arguments.part, arguments.rounds)
    machine = describe()
    ways = {"carried up and back down": [], "each from the same state": ["sweep.procedure=same", "sweep.along=null"]}
    works = {
        name: work_of(prepare(parse_study(STUDY, overrides=[f"uncertain.samples={part}", *more])))
        for name, more in ways.items()
    }
    compiled_parts(LANES, next(iter(works.values())).program)
    times = np.array([[seconds(work) for work in works.values()] for _ in range(rounds)])
    rows = []
    for number, (name, work) in enumerate(works.items()):
        runs = work.plan.points
        every = ALL * runs // part
        one = times[:, number] / runs
        minutes = every * float(np.median(one)) / 120.0
        rows.append([name, runs, every, spread((1e3 * one).tolist()), f"{minutes:.2g}"])
    head = [
        "256 samples of 30 x 30 points",
        "runs measured",
        "runs in all",
        "ms of a core for a run",
        "minutes, two cores",
    ]
    text = f"{where(machine)}\n\n{table(head, rows)}\n"
    held: dict[str, float] = {}
    if not arguments.quick:
        with tempfile.TemporaryDirectory() as folder:
            study, file = Path(folder) / "study.yaml", str(Path(folder) / "out.h5")
            study.write_text(STUDY.replace("60 s, observe: 40 s", "0 s, observe: 0.1 s"))
            held["run"] = memory("run", str(study), "-o", file, "--quiet")
            for words in (["window", file], ["show", file], ["sensitivity", file]):
                held[words[0]] = memory(*words)
        largest = [[name, f"{megabytes:.0f}"] for name, megabytes in held.items()]
        text += f"\n{table(['command, of 460 800 runs', 'largest memory, MB'], largest)}\n"
    write(arguments.out, text, {"machine": machine, "times": times.tolist(), "part": part, "memory": held})


if __name__ == "__main__":
    main()
