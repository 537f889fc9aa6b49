"""The disk space, memory and time of a sweep, estimated before it runs."""

from __future__ import annotations

import math
from pathlib import Path

from nsdrill.app.experiment import Experiment
from nsdrill.errors import InputError, option
from nsdrill.files import amount
from nsdrill.store import record_dtype
from nsdrill.sweep.plan import Plan

BASE = 3e8  # bytes that every run takes: the interpreter, the libraries, the batches
MANY = 10**6  # runs, above which they have to be asked for
PACE = 1e5  # s of motion of the main model in a second of one processor: docs/benchmarks.md
PER_POINT = 40  # bytes for each point: axes, order and status; measured on sweeps of 10^8 points


def disk(experiment: Experiment) -> int:
    """The bytes of all points, at most; the results file takes up to as many again
    while it is written."""
    return experiment.plan.points * record_dtype(experiment.kept).itemsize


def memory(plan: Plan) -> float:
    """The approximate bytes of memory of a run into a file."""
    return BASE + PER_POINT * plan.points


def check_memory(experiment: Experiment, *, in_file: bool) -> None:
    """InputError where this machine has too little memory free for the run."""
    plan = experiment.plan
    need, free = memory(plan) + (0 if in_file else disk(experiment)), memory_free()
    if need > free and need > 2 * BASE:  # a small sweep is worth a try anywhere
        advice = "" if in_file else "Give the name of a results file, into which the points go, or sweep"
        raise InputError(
            f"found a sweep of {plan.points} points, which takes {amount(need)} of memory; "
            f"allowed: up to "
            f"{amount(free)}, which are free on this machine. {advice or 'Sweep'} fewer points at "
            f"once."
        )


def check_large(what: str, runs: int, seconds: float, size: str, workers: int, *, large: bool) -> None:
    """InputError, with what they cost, where so many ``runs`` of ``seconds`` of motion
    were not asked for by ``large``; ``what`` and ``size`` say in words what they are
    and how much room they take."""
    if runs <= MANY or large:
        return
    hours = runs * seconds / (PACE * workers * 3600)
    raise InputError(
        f"found {what}: {runs} runs of {seconds:g} s, which take roughly {hours:.2g} hours on "
        f"{workers} processor{'s' * (workers > 1)}, {size}; allowed: up to {MANY} runs, or more "
        f"where they are meant: {option('large')}."
    )


def memory_free() -> float:
    """The bytes of memory that are available to a process; infinite where unknown."""
    free = math.inf
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                free = 1024.0 * int(line.split()[1])
        group = Path("/sys/fs/cgroup")  # of a container or a batch job
        limit = (group / "memory.max").read_text().strip()
        if limit != "max":
            free = min(free, int(limit) - int((group / "memory.current").read_text()))
    except (OSError, ValueError, IndexError):
        pass
    return free
