"""Where the time goes: floating-point work of a packed step, its time, and the share of
what the core can do.

    python -m benchmarks.flops [--quick] [--out flops]

The hot functions are compiled into an empty cache, their machine code is counted by
kind of instruction. The counts are static: for the right-hand side and for the
stepper's straight parts that is what runs; the observer's rare parts (turns and
crossings) are counted as if they ran every time. The core's peak is a loop of
independent fused multiply-adds, measured between the other measurements. ``perf stat``
is asked for cycles and instructions where the machine allows it.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import alone, describe, spread, table, where, write

LANES = 8
# Operations a packed instruction makes for each number in it.
WORK = {"fma": 2, "add": 1, "mul": 1, "div": 1, "sqrt": 1, "max/min": 1}
KINDS = (*WORK, "compare", "blend/mask", "logic/integer", "convert", "shuffle", "load/store/move", "call", "jump")
PATTERNS = (
    ("fma", r"vf(n?m)(add|sub)"),
    ("add", r"v(add|sub)[ps]d"),
    ("mul", r"vmul[ps]d"),
    ("div", r"vdiv[ps]d"),
    ("sqrt", r"vsqrt[ps]d"),
    ("max/min", r"v(max|min)[ps]d"),
    ("compare", r"v(u?comi|cmp|pcmp|pt?estn?m?|fpclass)"),
    ("blend/mask", r"v(p?blend)|^k(and|or|xor|not|mov|test|ortest|shift|unpck)"),
    ("convert", r"vcvt"),
    ("shuffle", r"v(perm|shuf|unpck|pshuf|extract|insert|p?broadcast|pack|palign)"),
    ("load/store/move", r"v(p?mov|gather|pgather|scatter)"),
    ("logic/integer", r"v(and|or|xor|pand|por|pxor|pternlog|psll|psra|psrl|padd|psub|pmul|pabs|rndscale|pmax|pmin)"),
    ("call", r"call"),
    ("jump", r"j[a-z]+"),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="short measurements")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    parser.add_argument("--only-steps", type=float, metavar="S", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    alone()
    if arguments.only_steps:
        _busy(arguments.only_steps)
        return
    machine = describe()
    with tempfile.TemporaryDirectory() as cache:
        os.environ["NUMBA_CACHE_DIR"] = cache
        functions = _functions()
        counted = {name: _count(function) for name, (function, _) in functions.items()}
        timed = _times(functions["right-hand side"][0], 3 if arguments.quick else 9, 0.05 if arguments.quick else 0.3)
        perf = _perf()
    peak = timed.pop("peak")
    rows = []
    for name, (_, calls) in functions.items():
        packed = counted[name]["packed"]
        rows.append(
            (
                name,
                calls,
                *(packed[kind] for kind in KINDS[:-2]),
                sum(counted[name]["scalar"].values()),
                counted[name]["call"],
                counted[name]["spills"],
                counted[name]["jumps back"],
                _operations(packed),
            )
        )
    by_part = {name: _operations(counted[name]["packed"]) * calls for name, (_, calls) in functions.items()}
    core = by_part["right-hand side"] + by_part["stepper"]
    per_step = {
        "right-hand sides": 6 * np.array(timed["right-hand side"]),
        "in turn": 6 * np.array(timed["in turn"]),
        "null": np.array(timed["null observer"]),
        "whole": np.array(timed["whole"]),
    }
    in_turn = per_step["in turn"]
    times = [
        (
            "six right-hand sides, each after the last",
            spread(in_turn, "{:.0f}"),
            by_part["right-hand side"],
            spread(by_part["right-hand side"] / in_turn / peak, "{:.0%}"),
        ),
        (
            "six right-hand sides, overlapping",
            spread(per_step["right-hand sides"], "{:.0f}"),
            by_part["right-hand side"],
            spread(by_part["right-hand side"] / per_step["right-hand sides"] / peak, "{:.0%}"),
        ),
        (
            "stepper: what is left of the kernel",
            spread(per_step["null"] - in_turn, "{:.0f}"),
            by_part["stepper"],
            spread(by_part["stepper"] / (per_step["null"] - in_turn) / peak, "{:.0%}"),
        ),
        (
            "kernel: both (null observer)",
            spread(per_step["null"], "{:.0f}"),
            core,
            spread(core / per_step["null"] / peak, "{:.0%}"),
        ),
        ("observer", spread(per_step["whole"] - per_step["null"], "{:.0f}"), f"up to {by_part['observer']}", "-"),
        (
            "whole packed step",
            spread(per_step["whole"], "{:.0f}"),
            f"{core} and more",
            spread(core / per_step["whole"] / peak, "{:.0%}"),
        ),
    ]
    text = "\n\n".join(
        [
            "# Floating-point work",
            where(machine),
            f"Peak of the core in this measurement: {spread(peak, '{:.1f}')} GFLOP/s.",
            f"## Machine code, {LANES} lanes\n\nPacked instructions by kind (any width above one number), then "
            "instructions on single numbers, calls, accesses to the stack, jumps back (loops). Operations: of one "
            "call, all lanes.\n\n"
            + table(("function", "calls a step", *KINDS[:-2], "scalar", "calls", "stack", "loops", "operations"), rows),
            f"## A packed step of {LANES} lanes\n\n"
            + table(("part", "ns", "operations", "of the peak, in the same round"), times)
            + f"\n\nA lane-step: {spread(per_step['whole'] / LANES, '{:.0f}')} ns with all "
            f"observers, "
            f"{spread(per_step['null'] / LANES, '{:.0f}')} ns without.",
            f"## perf stat\n\n{perf}",
        ]
    )
    write(
        arguments.out,
        text,
        {
            "machine": machine,
            "counts": counted,
            "operations": by_part,
            "times_ns": per_step,
            "peak_gflops": peak,
            "perf": perf,
        },
    )


def _functions() -> dict[str, tuple[Any, int]]:
    """The hot functions, compiled, and how often each runs in a packed step."""
    from benchmarks.workload import mixed
    from nsdrill.kernel.steppers import STEPPERS, make_step
    from nsdrill.sweep.work import compiled_parts

    work = mixed(2, 2, 1.0, 1.0)
    parts = compiled_parts(LANES, work.program)
    stepper = make_step(STEPPERS["tsitouras"], LANES, work.new_batch(LANES, 8).rows)
    return {"right-hand side": (parts.right_hand_side, 6), "stepper": (stepper, 1), "observer": (parts.observer, 1)}


def _count(function: Any) -> dict[str, Any]:
    """Instructions of the first (the native) function in the assembly, by kind."""
    text = next(iter(function.inspect_asm().values()))
    packed, scalar = Counter(dict.fromkeys(KINDS, 0)), Counter()
    calls = stack = back = 0
    seen: set[str] = set()
    inside = False
    for raw in text.splitlines():
        line = raw.split("#")[0].strip()
        if label := re.match(r"([.\w$]+):$", line):
            if not inside and not label[1].startswith("."):
                inside = True
            elif inside and label[1].startswith(".Lfunc_end"):
                break
            seen.add(label[1])
            continue
        if not inside or not line or line.startswith("."):
            continue
        word, _, operands = line.partition("\t") if "\t" in line else line.partition(" ")
        kind = next((kind for kind, pattern in PATTERNS if re.match(pattern, word)), None)
        stack += int("(%rsp" in operands or "(%rbp" in operands) if word.startswith("v") else 0
        if kind == "call":
            calls += 1
        elif kind == "jump":
            back += operands.strip() in seen
        elif kind is not None:
            single = word.endswith(("sd", "ss")) or ("mov" in word and "mm" not in operands)
            (scalar if single else packed)[kind] += 1
    return {
        "packed": dict(packed),
        "scalar": dict(scalar),
        "call": calls,
        "spills": stack,
        "jumps back": back,
        "width": max((w for w, mark in ((8, "zmm"), (4, "ymm"), (2, "xmm")) if mark in text), default=1),
    }


def _operations(packed: dict[str, int]) -> int:
    return LANES * sum(WORK[kind] * packed[kind] for kind in WORK)


def _times(right_hand_side: Any, rounds: int, seconds: float) -> dict[str, Any]:
    """Nanoseconds of a right-hand side and of whole packed steps, and the peak
    [GFLOP/s], one value a round."""
    from benchmarks.peers.nsdrill_peer import Nsdrill
    from benchmarks.workload import mixed

    work = mixed(16, 16, 20.0, 20.0)
    whole, blind = Nsdrill(LANES), Nsdrill(LANES, observed=False)
    call = _caller(right_hand_side)
    in_turn = _caller(right_hand_side, in_turn=True)
    peak = _peak()
    out: dict[str, list[float]] = {"right-hand side": [], "in turn": [], "null observer": [], "whole": [], "peak": []}
    for turn in range(rounds + 1):
        rate = peak()
        calls = call(seconds), in_turn(seconds)
        results = []
        for peer in (blind, whole):
            result = peer.run(work)
            results.append(result.cpu_seconds / (result.steps or 1) * 1e9 * LANES)
        # The engine's tail and its bookkeeping are in: lanes that idle count as if they
        # had worked.
        if turn:
            for name, value in zip(out, (*calls, *results, rate), strict=True):
                out[name].append(value)
    return {name: np.array(values) for name, values in out.items()}


def _caller(right_hand_side: Any, in_turn: bool = False) -> Callable[[float], float]:
    """Times the right-hand side alone: nanoseconds a call, on a buffer with the states
    of ordinary points. ``in_turn`` makes each call wait for the last one, as in a step,
    by adding next to nothing of its result to the state."""
    import numba

    from benchmarks.workload import mixed

    work = mixed(4, 2, 1.0, 1.0)
    batch = work.new_batch(LANES, 2 * LANES)
    rows = batch.rows
    runs = work.prepare(np.arange(LANES) % work.plan.points)
    raw = np.zeros(rows.total * LANES + 8)
    buffer = raw[(-raw.ctypes.data % 64) // 8 :][: rows.total * LANES]
    grid = buffer.reshape(rows.total, LANES)
    grid[rows.parameter : rows.parameter + rows.parameters] = runs.parameters.T
    grid[rows.stage : rows.stage + rows.states] = runs.initial[:, : rows.states].T

    # the row after the first of the slopes
    states, result = LANES * rows.states, LANES * (rows.states + 1)
    first = LANES * rows.stage

    @numba.njit(nogil=True)
    def many(function, b, n):  # type: ignore[no-untyped-def]
        for _ in range(n):
            function(b)
            if in_turn:
                for j in range(0, states, LANES):
                    for i in range(LANES):
                        b[first + j + i] += 1e-30 * b[result + i]

    many(right_hand_side, buffer, 10)

    def measure(seconds: float) -> float:
        n, spent = 0, 0.0
        while spent < seconds:
            begun = time.process_time()
            many(right_hand_side, buffer, 100_000)
            spent += time.process_time() - begun
            n += 100_000
        return spent / n * 1e9

    return measure


def _peak() -> Callable[[], float]:
    compiler = os.environ.get("CXX") or shutil.which("g++") or shutil.which("c++")
    if compiler is None:
        return lambda: float("nan")
    folder = tempfile.mkdtemp()
    binary = Path(folder, "peak")
    flags = ["-std=c++17", "-O3", "-march=native", "-ffp-contract=fast"]
    source = Path(__file__).parent / "peers" / "peak.cpp"
    wide = subprocess.run([compiler, *flags, "-mprefer-vector-width=512", source, "-o", binary], capture_output=True)
    if wide.returncode:
        subprocess.run([compiler, *flags, source, "-o", binary], check=True)
    return lambda: float(subprocess.run([binary], capture_output=True, text=True, check=True).stdout)


def _busy(seconds: float) -> None:
    from benchmarks.peers.nsdrill_peer import Nsdrill
    from benchmarks.workload import mixed

    work, peer = mixed(16, 16, 20.0, 20.0), Nsdrill(LANES)
    end = time.perf_counter() + seconds
    while time.perf_counter() < end:
        peer.run(work)


def _perf() -> str:
    if shutil.which("perf") is None:
        return "perf is not installed."
    command = [
        "perf",
        "stat",
        "-x",
        ";",
        "-e",
        "cycles,instructions",
        sys.executable,
        "-m",
        "benchmarks.flops",
        "--only-steps",
        "5",
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    numbers = {}
    for line in done.stderr.splitlines():
        value, *rest = line.split(";")
        if value.isdigit() and len(rest) > 1:
            numbers[rest[1]] = int(value)
    if not {"cycles", "instructions"} <= numbers.keys():
        return "perf is there, but this machine does not let it count cycles."
    rate = numbers["instructions"] / numbers["cycles"]
    return f"{numbers['instructions']:.3g} instructions in {numbers['cycles']:.3g} cycles: {rate:.2f} a cycle."


if __name__ == "__main__":
    main()
