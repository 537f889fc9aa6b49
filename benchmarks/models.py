"""What a simulated second costs in each model, beside the main one and beside SciPy and
numbalsoda.

    python -m benchmarks.models [--quick] [--rounds N] [--out models]

Every model runs a fan of speeds in stick-slip through the whole engine, packed, one
thread, features and labels included. The peers get the very right-hand side that
nsdrill compiled, for one lane, and no observer; the states are integrated in units of
their scales. Processor time, interleaved; ratios are taken within a round. The time to
compile is that of a process with an empty cache (``--compile``).
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import alone, describe, spread, table, where, write

Array = np.ndarray[Any, np.dtype[Any]]
MAIN = "main model"
SPEEDS = "sweep: {{rotary_speed: {{from: {0} rad/s, to: {1} rad/s, points: {2}}}}}\n"
TIMES = "simulation: {{transient: {0} s, observe: {0} s}}\n"
# Model, its speeds, the share of the others' simulated time, and a study in stick-slip.
MODELS = {
    MAIN: (1.0, 2.0, 4.0, "operation: {depth: 5000 m, wob: 66.72 kN}\n"),
    "torsion": (1.0, 2.0, 4.0, "model: torsion\noperation: {depth: 5000 m, wob: 66.72 kN}\n"),
    "beam, 5 modes, 1 station": (
        1.0,
        2.0,
        4.0,
        "model: beam\nbeam: {stations: [{at: 0.5}]}\noperation: {depth: 5000 m, wob: 66.72 kN}\n",
    ),
    "beam, 5 modes, 5 stations": (1.0, 2.0, 4.0, "model: beam\noperation: {depth: 5000 m, wob: 66.72 kN}\n"),
    "segments, 10 + 10": (10.0, 20.0, 1.0, "model: segments\ninitial: {start: rest}\n"),
}


@dataclass
class Runner:
    """One way to run one model, and the simulated seconds of a run."""

    model: str
    way: str
    run: Callable[[], None]
    simulated: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--compile", action="store_true", help="also the time of the first use of each model")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    alone()
    machine = describe()
    points, seconds = (32, 5.0) if arguments.quick else (128, 20.0)
    runners = [one for name in MODELS for one in _runners(name, points, seconds)]
    for one in runners:  # compile, warm up
        one.run()
    taken: dict[tuple[str, str], list[float]] = {(one.model, one.way): [] for one in runners}
    for turn in range(arguments.rounds):
        for one in runners[turn % len(runners) :] + runners[: turn % len(runners)]:
            begun = time.process_time()
            one.run()
            taken[one.model, one.way].append((time.process_time() - begun) / one.simulated)
    rows, base = [], np.array(taken[MAIN, "nsdrill"])
    for (model, way), times in taken.items():
        own = np.array(taken[model, "nsdrill"])
        ratios = np.array(times) / (base if way == "nsdrill" else own)
        of = (
            f"{spread(ratios.tolist())} of the main model" if way == "nsdrill" else f"{spread(ratios.tolist())} of ours"
        )
        rows.append([f"{model}: {way}", f"{1e6 * np.median(times):.1f}", of])
    text = f"{where(machine)}\n\n{table(['', 'us per simulated second', 'times'], rows)}\n"
    data: dict[str, Any] = {"machine": machine, "seconds": {f"{m}: {w}": t for (m, w), t in taken.items()}}
    if arguments.compile:
        first = {name: _first_use(name) for name in MODELS}
        text += "\n" + table(["first use", "processor seconds"], [[n, f"{s:.1f}"] for n, s in first.items()]) + "\n"
        data["first_use"] = first
    write(arguments.out, text, data)


def _study(name: str, points: int, seconds: float) -> str:
    low, high, share, text = MODELS[name]
    return text + SPEEDS.format(low, high, points) + TIMES.format(share * seconds / 2)


def _runners(name: str, points: int, seconds: float) -> list[Runner]:
    from nsdrill.app.experiment import prepare
    from nsdrill.app.running.run import work_of
    from nsdrill.kernel.batch import choose_lanes
    from nsdrill.study import parse_study
    from nsdrill.sweep.engine import Engine
    from nsdrill.sweep.work import compiled_parts

    work = work_of(prepare(parse_study(_study(name, points, seconds))))
    explicit = work.by("explicit")
    ((work, _),) = work.by_method(np.arange(points))  # one method for all of them
    lanes = choose_lanes(points)
    compiled_parts(lanes, work.program)
    duration = work.simulation.transient + work.simulation.observe

    def own() -> None:
        with ThreadPoolExecutor(1) as threads:
            Engine(work, threads, 1, lanes, lambda points, columns: None).run()

    found = [Runner(name, "nsdrill", own, points * duration)]
    few = np.arange(0, points, 16)
    short = duration / 4
    problem = Problem(replace(explicit), few)

    found.append(Runner(name, "SciPy DOP853", lambda: problem.scipy(short), len(few) * short))
    if solvers := problem.numbalsoda():
        for way, solve in solvers.items():
            found.append(Runner(name, way, lambda solve=solve: solve(short), len(few) * short))  # type: ignore[misc]
    return found


class Problem:
    """Some points of a sweep as initial-value problems for one lane, in units of the
    natural scales of the states."""

    def __init__(self, work: Any, points: Array) -> None:
        variant = work.program.variant
        self.rtol, self.rows = work.simulation.rtol, variant.rows()
        runs = work.prepare(points)
        self.initial = runs.initial[:, :-1] / runs.state_scales
        columns = [runs.parameters, runs.state_scales, runs.frame_rates, runs.initial[:, -1:]]
        self.data = np.concatenate([np.atleast_2d(one) for one in columns], axis=1)
        self.function = variant.right_hand_side(1)
        self.widths = (runs.parameters.shape[1], runs.state_scales.shape[1], runs.frame_rates.shape[1])
        self.derivative = self._derivative()

    def _derivative(self) -> Any:
        """``derivative(t, scaled, slopes, data, buffer)`` in compiled code."""
        import numba

        rows, function, (columns, states, slopes) = self.rows, self.function, self.widths
        stage, acceleration, parameter = rows.stage, rows.acceleration, rows.parameter
        time_, phase, singles = rows.stage_time, rows.phase, 2 * slopes - states

        @numba.njit
        def derivative(t, scaled, out, data, b):  # type: ignore[no-untyped-def]
            for i in range(columns):
                b[parameter + i] = data[i]
            b[time_], b[phase] = t, data[columns + states + slopes]
            for i in range(states):
                b[stage + i] = scaled[i] * data[columns + i]
            function(b)
            for k in range(slopes - singles):
                frame_rate = data[columns + states + k]
                out[2 * k] = (b[stage + 2 * k + 1] + frame_rate) / data[columns + 2 * k]
                out[2 * k + 1] = b[acceleration + k] / data[columns + 2 * k + 1]
            for k in range(slopes - singles, slopes):
                i = k + slopes - singles
                out[i] = b[acceleration + k] / data[columns + i]

        return derivative

    def scipy(self, duration: float) -> None:
        from scipy.integrate import solve_ivp

        buffer, out = np.zeros(self.rows.total), np.empty(self.initial.shape[1])
        for start, data in zip(self.initial, self.data, strict=True):

            def slopes(t: float, y: Array, data: Array = data) -> Array:
                self.derivative(t, y, out, data, buffer)
                return out.copy()

            solve_ivp(slopes, (0.0, duration), start, "DOP853", rtol=self.rtol, atol=self.rtol)

    def numbalsoda(self) -> dict[str, Callable[[float], None]]:
        """LSODA and DOP853 in compiled code, where numbalsoda is installed."""
        try:
            import numba
            import numbalsoda
        except ImportError:
            return {}
        derivative, total, (columns, states, slopes) = self.derivative, self.rows.total, self.widths
        length = columns + states + slopes + 1

        @numba.cfunc(numbalsoda.lsoda_sig)
        def right_hand_side(t, scaled, d, p):  # type: ignore[no-untyped-def]
            data = numba.carray(p, (length + total,))
            derivative(t, numba.carray(scaled, (states,)), numba.carray(d, (states,)), data[:length], data[length:])

        found: dict[str, Callable[[float], None]] = {}
        for word in ("lsoda", "dop853"):
            solver, address = getattr(numbalsoda, word), right_hand_side.address

            def solve(duration: float, solver: Any = solver, address: Any = address) -> None:
                for start, data in zip(self.initial, self.data, strict=True):
                    both = np.concatenate([data, np.zeros(total)])
                    _, ok = solver(address, start.copy(), np.array([0.0, duration]), both, self.rtol, self.rtol, 10**8)
                    if not ok:
                        raise RuntimeError(f"{solver} gave up")

            found[f"numbalsoda {word}"] = solve
        return found


def _first_use(name: str) -> float:
    """Processor seconds of a sweep of two points in a process with an empty cache."""
    code = "import sys, time, nsdrill; nsdrill.run(sys.argv[1], progress=False); print(time.process_time())"
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", code, _study(name, 2, 1.0)],
            env={**os.environ, "NUMBA_CACHE_DIR": folder},
            capture_output=True,
            text=True,
            check=True,
        )
    return float(done.stdout.split()[-1])


if __name__ == "__main__":
    main()
