"""Processor time of this checkout and of another one, in interleaved rounds.

    python -m benchmarks.speed --against OTHER/src [--rounds 5] [--cold 1] [--only WORD] [--out NAME]

Sweeps: the time of a long run of the command less that of one of a second, over the steps
tried between them, so that start, compilation and file drop out. First runs: into an
empty cache of machine code (``NUMBA_CACHE_DIR``). Second runs and short commands: whole. In every
round both checkouts run each of them, each time the other one first; a ratio is taken
within a round. Start-up is also told in times of ``import numba`` in the same round,
which makes it comparable between machines. Processor seconds of the child, user and
system: the machine need not be idle, though neighbours on the same core still cost some
percent.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

from benchmarks.machine import describe, spread, table, where, write

SRC = Path(__file__).parents[1] / "src"
GRID = (
    "sweep: {{depth: {{from: 1000 m, to: 8000 m, points: 8}},"
    " rotary_speed: {{from: 1 rad/s, to: 8 rad/s, points: {}}}}}\n"
)
SEGMENTS = "model: segments\ninitial: {start: rest}\n"
STEEP = "bit: {friction: {smoothing: 1.0e+4 s/rad}}\nwell: {friction: {smoothing: 1.0e+4 s/m}}\n"
# a study, and the seconds of the long run
SWEEPS = {
    "race": (GRID.format(12), 2000),
    "implicit": (GRID.format(6) + STEEP + "simulation: {method: implicit}\n", 600),
    "segments": (SEGMENTS + "sweep: {rotary_speed: {from: 8 rad/s, to: 60 rad/s, points: 16}}\n", 200),
    "beam": ("model: beam\n" + GRID.format(6), 800),
}
TWO = "sweep: {rotary_speed: [13 rad/s, 30 rad/s]}\n"
RUNS = {
    "main": TWO,
    "soft torque, exponent": TWO + "drive: {kind: soft_torque}\nrecord: {exponent: true}\n",
    "segments": SEGMENTS + TWO,
}
BRIEF = "--set=simulation.transient=0 s", "--set=simulation.observe=1 s"
START = {
    "--help": ["--help"],
    "check": ["check", "study.yaml"],
    "show": ["show", "kept.h5"],
    "window": ["window", "map.h5"],
}
MAP = """bit: {lobes: 1, surface_amplitude: 0 mm}
sweep:
  wob: {from: 20 kN, to: 100 kN, points: 5}
  rotary_speed: {from: 50 rpm, to: 200 rpm, points: 16}
  procedure: all
  along: rotary_speed
"""


def seconds(words: list[str], source: Path, cache: str | None = None) -> float:
    """Processor seconds of ``python WORDS`` with the package of ``source``."""
    environment = os.environ | {"PYTHONPATH": str(source), "OMP_NUM_THREADS": "1"}
    if cache is not None:
        environment["NUMBA_CACHE_DIR"] = cache
    quiet = os.open(os.devnull, os.O_WRONLY)
    child = os.posix_spawn(
        sys.executable, [sys.executable, *words], environment, file_actions=[(os.POSIX_SPAWN_DUP2, quiet, 1)]
    )
    _, status, used = os.wait4(child, 0)
    os.close(quiet)
    if status:
        raise SystemExit(f"{source}: exit status {status} of python {' '.join(words)}")
    return used.ru_utime + used.ru_stime


def run(text: str, source: Path, *more: str, cache: str | None = None) -> tuple[float, int]:
    """Processor seconds of a run of the study, and the steps that it tried."""
    Path("study.yaml").write_text(text)
    words = ["-m", "nsdrill", "run", "study.yaml", "-o", "out.h5", "--overwrite", "--quiet"]
    taken = seconds([*words, "--workers", "1", *more], source, cache)
    with h5py.File("out.h5") as file:
        return taken, int(np.sum(file["steps"][()]) + np.sum(file["rejected"][()]))


def sweep(name: str, source: Path) -> float:
    """Nanoseconds per step tried."""
    text, duration = SWEEPS[name]
    long = "--set=simulation.transient=0 s", f"--set=simulation.observe={duration} s"
    (more, steps), (less, few) = run(text, source, *long), run(text, source, *BRIEF)
    return 1e9 * (more - less) / (steps - few)


def first(name: str, source: Path) -> float:
    with tempfile.TemporaryDirectory() as empty:
        return run(RUNS[name], source, *BRIEF, cache=empty)[0]


def second(name: str, source: Path) -> float:
    return run(RUNS[name], source, *BRIEF)[0]


def start(name: str, source: Path) -> float:
    Path("study.yaml").write_text(TWO)
    return seconds(["-m", "nsdrill", *START[name]], source)


CASES = {
    **{f"{name} sweep, ns per step": (sweep, name) for name in SWEEPS},
    **{f"second run of two points, {name}, s": (second, name) for name in RUNS},
    **{f"start-up, {name}, s": (start, name) for name in START},
    **{f"first run, {name}, s": (first, name) for name in RUNS},
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", type=Path, required=True, help="folder with the other nsdrill")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cold", type=int, default=1, help="rounds with an empty cache (1)")
    parser.add_argument("--only", default="", help="cases whose name has this word")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    out = arguments.out and arguments.out.resolve()
    sources = (SRC.resolve(), arguments.against.resolve())
    for source in sources:
        if not (source / "nsdrill").is_dir():
            parser.error(f"{source} has no folder nsdrill")
    cases = {case: how for case, how in CASES.items() if arguments.only in case}
    if not cases:
        parser.error(f"--only: found {arguments.only}; allowed: a word of {', '.join(CASES)}")
    taken: dict[str, list[list[float]]] = {case: [] for case in cases}
    imports = []
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        run(TWO, SRC, *BRIEF)
        Path("out.h5").rename("kept.h5")
        run(MAP, SRC)
        Path("out.h5").rename("map.h5")
        for source in sources:  # into the caches
            for measure, name in cases.values():
                if measure in (sweep, second):
                    run(SWEEPS[name][0] if measure is sweep else RUNS[name], source, *BRIEF)
                elif measure is start:
                    start(name, source)
        for turn in range(max(arguments.rounds, arguments.cold)):
            imports.append(seconds(["-c", "import numba"], SRC))
            for case, (measure, name) in cases.items():
                if turn >= (arguments.cold if measure is first else arguments.rounds):
                    continue
                both = [0.0, 0.0]
                for i in (0, 1) if turn % 2 == 0 else (1, 0):
                    both[i] = measure(name, sources[i])
                taken[case].append(both)
                print(f"{case}: {both[0]:.4g} {both[1]:.4g}", file=sys.stderr, flush=True)
        os.chdir("/")
    rows = []
    for case, measured in taken.items():
        here, there = np.array(measured or [[np.nan] * 2]).T
        whole = cases[case][0] is start
        rows.append(
            (
                case,
                f"{np.median(here):.4g}",
                f"{np.median(there):.4g}",
                spread((here / there).tolist()),
                f"{np.median(here / imports[: len(here)]):.3g}" if whole else "",
            )
        )
    head = ("processor time", "this", "other", "this / other", "this / import numba")
    machine = describe()
    numbers = {"machine": machine, "sources": sources, "taken": taken, "import numba": imports}
    write(out, f"{where(machine)}\n\n{table(head, rows)}", numbers)


if __name__ == "__main__":
    main()
