"""How cost and memory grow with the number of points, and what it costs to begin.

    python -m benchmarks.scaling [--quick] [--out scaling]

Runs of 100 s and of 10 s in sweeps of 10^2 to 10^5 points; a study of 10^6 points
through the command line, with its largest resident memory; times from the command to
the first step, with a full and with an empty compilation cache; one thread against two;
a whole study of the paper on one core. Wall time throughout: leave the machine alone.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import describe, spread, table, where, write
from nsdrill.kernel.batch import choose_lanes

ROOT = Path(__file__).parents[1]
STUDY = """title: Scaling
sweep:
  depth: {{from: 1000 m, to: 8000 m, points: {depths}}}
  rotary_speed: {{from: 1 rad/s, to: 8 rad/s, points: {speeds}}}
  procedure: same
simulation: {{transient: {transient} s, observe: {observe} s}}
"""
# Up to where the first step would be made; the argument is the wall time at which the
# command was given.
FIRST_STEP = """
import sys, time
import numpy as np
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.study import load_study
from nsdrill.sweep.work import compiled_parts
work = work_of(prepare(load_study(sys.argv[1])))
compiled_parts(8, work.program)
batch = work.new_batch(8, 64)
batch.add_many(np.arange(4), work.prepare(np.arange(4)))
print(time.time() - float(sys.argv[2]))
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="to 10^3 points, memory at 2 10^4, no whole study")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    machine = describe()
    quick = arguments.quick
    with tempfile.TemporaryDirectory() as folder:
        begin = _beginnings(Path(folder))
        memory = [_memory(Path(folder), n) for n in ((100, 20_000) if quick else (100, 10_000, 1_000_000))]
        study = None if quick else _whole_study(Path(folder))
    sides = (10, 32) if quick else (10, 32, 100, 316)
    cost = [entry for duration in (100.0, 10.0) for entry in _cost(sides, duration)]
    threads = _threads(12 if quick else 60)
    text = "\n\n".join(
        [
            "# Scaling",
            where(machine),
            f"## Cost per point\n\nOne thread, {choose_lanes(100)} lanes; engine, features, classification included; "
            "medians of three, the longest once.\n\n"
            + table(
                ("duration [s]", "points", "us per point", "ns per step", "lanes in use"),
                [
                    (
                        f"{c['duration']:g}",
                        c["points"],
                        f"{c['microseconds']:.1f}",
                        f"{c['ns_per_step']:.0f}",
                        f"{c['lane_use']:.0%}",
                    )
                    for c in cost
                ],
            ),
            "## Memory\n\n`nsdrill run`, results file and all; 1 ms + 1 ms each.\n\n"
            + table(
                ("points", "largest resident [MB]", "s", "results file [MB]"),
                [
                    (m["points"], f"{m['megabytes']:.0f}", f"{m['seconds']:.1f}", f"{m['file_megabytes']:.1f}")
                    for m in memory
                ],
            ),
            "## To begin\n\nMedian, least and largest.\n\n"
            + table(("what", "s"), [(name, spread(values, "{:.2f}")) for name, values in begin.items()]),
            f"## Threads\n\n{threads['points']} points of 100 s: one worker {threads['one']:.2f} s, two workers "
            f"{threads['two']:.2f} s: {threads['one'] / threads['two']:.2f} times.",
            "## A whole study\n\n"
            + (
                "Not run."
                if study is None
                else f"configs/fig4_speed_22kN.yaml ({study['points']} points of 500 s in one "
                f"chain), one worker: "
                f"{study['seconds']:.1f} s."
            ),
        ]
    )
    write(
        arguments.out,
        text,
        {"machine": machine, "cost": cost, "memory": memory, "begin": begin, "threads": threads, "study": study},
    )


def _cost(sides: tuple[int, ...], duration: float) -> list[dict[str, Any]]:
    from benchmarks.workload import middles, sweep

    lanes = choose_lanes(100)
    works = {side: middles(side, duration) for side in sides}
    sweep(middles(4, 1.0), lanes)
    taken: dict[int, list[tuple[float, float, float]]] = {side: [] for side in sides}
    for turn in range(3):
        for side, work in works.items():
            if turn > 0 and work.plan.points * duration > 2e6:
                continue
            repeats = max(1, round(1e5 / (work.plan.points * duration)))
            begun = time.perf_counter()
            for _ in range(repeats):
                _, progress = sweep(work, lanes)
            seconds = (time.perf_counter() - begun) / repeats
            taken[side].append(
                (seconds / work.plan.points * 1e6, seconds / progress.lane_steps * 1e9, progress.lanes_in_use)
            )
    return [
        {"duration": duration}
        | dict(
            zip(
                ("points", "microseconds", "ns_per_step", "lane_use"),
                (works[side].plan.points, *np.median(taken[side], axis=0).tolist()),
                strict=True,
            )
        )
        for side in sides
    ]


def _threads(side: int) -> dict[str, Any]:
    from benchmarks.workload import middles, sweep

    work = middles(side, 100.0)
    taken: dict[int, list[float]] = {1: [], 2: []}
    for _ in range(3):
        for workers in taken:
            with ThreadPoolExecutor(workers) as executor:
                begun = time.perf_counter()
                sweep(work, choose_lanes(work.plan.points // workers), executor, workers)
                taken[workers].append(time.perf_counter() - begun)
    return {"points": work.plan.points, "one": float(np.median(taken[1])), "two": float(np.median(taken[2]))}


def _study(folder: Path, points: int, transient: float, observe: float) -> Path:
    speeds = max(points // 100, 10)
    path = folder / f"study{points}.yaml"
    path.write_text(STUDY.format(depths=points // speeds, speeds=speeds, transient=transient, observe=observe))
    return path


def _command(*arguments: str | Path) -> list[str]:
    return [sys.executable, "-c", "from nsdrill.cli.main import main; main()", *map(str, arguments)]


def _memory(folder: Path, points: int) -> dict[str, Any]:
    out = folder / f"out{points}.h5"
    begun = time.perf_counter()
    child = subprocess.Popen(
        _command("run", _study(folder, points, 0.001, 0.001), "--output", out),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    assert child.stderr is not None
    said = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        raise SystemExit(f"nsdrill run failed: {said.decode()[-2000:]}")
    scale = 1 if sys.platform == "darwin" else 1024
    return {
        "points": points,
        "megabytes": usage.ru_maxrss * scale / 1e6,
        "seconds": time.perf_counter() - begun,
        "file_megabytes": out.stat().st_size / 1e6,
    }


def _beginnings(folder: Path) -> dict[str, list[float]]:
    study = _study(folder, 100, 0.001, 0.001)

    def timed(command: list[str], environment: dict[str, str] | None = None) -> float:
        begun = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True, env=environment)
        return time.perf_counter() - begun

    def first_step(environment: dict[str, str] | None = None) -> float:
        command = [sys.executable, "-c", FIRST_STEP, str(study), repr(time.time())]
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
        if done.returncode:
            raise SystemExit(done.stderr)
        return float(done.stdout)

    first_step()
    empty = []
    for i in range(2):
        empty.append(first_step({**os.environ, "NUMBA_CACHE_DIR": str(folder / f"cache{i}")}))
    return {
        "python itself": [timed([sys.executable, "-c", "pass"]) for _ in range(5)],
        "nsdrill --help": [timed(_command("--help")) for _ in range(5)],
        "to the first step, full cache": [first_step() for _ in range(5)],
        "to the first step, empty cache": empty,
    }


def _whole_study(folder: Path) -> dict[str, Any]:
    from nsdrill.app.experiment import prepare
    from nsdrill.study import load_study

    path = ROOT / "configs" / "fig4_speed_22kN.yaml"
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    begun = time.perf_counter()
    subprocess.run(
        _command("run", path, "--output", folder / "fig4.h5", "--workers", "1"), check=True, capture_output=True
    )
    return {
        "points": prepare(load_study(path)).plan.points,
        "seconds": time.perf_counter() - begun,
        "cpu_seconds": resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before,
    }


if __name__ == "__main__":
    main()
