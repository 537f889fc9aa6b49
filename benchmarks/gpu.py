"""A GPU beside all processors of its machine: the same bits, and how fast.

    python -m benchmarks.gpu [--quick] [--seconds 280] [--only rates,bits,chains,whole,programs,cubie] [--out gpu]

- ``rates``: steps a second of the main model in the transient, while it is observed, and
  over whole maps, beside all processors;
- ``bits``: whole sweeps of every kind on both, every number of the results compared;
- ``chains``: steps a second over the number of chains, which says from which on a GPU pays;
- ``whole``: a map from the study to results, with one batch and with two that take turns;
- ``programs``: registers, stack and steps a second of the other kinds of code;
- ``cubie``: the same map by cubie, where it is installed.

Every result is printed and written as it is there, with the order above; what there was no
time for is named. ``NSDRILL_GPU=host`` and ``--quick`` rehearse it without a GPU.
"""

from __future__ import annotations

import argparse
import json
import os
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import describe, table, where, write

Array = np.ndarray[Any, np.dtype[Any]]
MAP = (
    "operation: {{depth: 5000 m}}\nsweep: {{wob: {{from: 10 kN, to: 100 kN, points: {0}}}, "
    "rotary_speed: {{from: 1 rad/s, to: 8 rad/s, points: {1}}}{2}}}\n"
)
SEGMENTS = (
    "model: segments\ninitial: {{start: rest}}\nsweep: {{rotary_speed: {{from: 8 rad/s, to: 60 rad/s, points: {0}}}}}\n"
)
SAMPLES = "uncertain: {bit.rock_stiffness: {lognormal: {median: 25 MN/m, factor: 2}}, samples: 8}\n"
TIMES = "simulation: {{transient: {0} s, observe: {1} s{2}}}\n"
PEAKS = "record: {peaks: 8}\n"
CARRIED = ", procedure: up-down, along: {0}"


def study(
    wobs: int,
    speeds: int,
    transient: float = 15.0,
    observe: float = 10.0,
    *,
    sweep: str = "",
    times: str = "",
    more: str = PEAKS,
) -> str:
    """A map of weight and speed."""
    return MAP.format(wobs, speeds, sweep) + TIMES.format(transient, observe, times) + more


def cases(quick: bool) -> dict[str, str]:
    """The sweeps whose bits are compared, by name."""
    n, m = (4, 5) if quick else (100, 100)
    t, o = (0.5, 0.5) if quick else (15.0, 10.0)
    along, limit = CARRIED.format("rotary_speed"), 1000 if quick else 4000
    return {
        "map": study(*((6, 7) if quick else (400, 340)), t, o),
        "implicit": study(n, m, t, o, times=", method: implicit"),
        "returns to the section": study(n, m, t, o, more="record: {peaks: 8, poincare: 200}\n"),
        "carried up and down, many chains": study(*((4, 5) if quick else (528, 20)), t, o, sweep=along),
        "carried up and down, 46 chains": study(*((3, 5) if quick else (46, 57)), t, o, sweep=along),
        "starts": study(n // 2, m // 4 + 1, t, o, more="initial: {ensemble: 8, seed: 2}\n" + PEAKS),
        "samples": study(n // 2, m // 4 + 1, t, o, more=SAMPLES + PEAKS),
        "verified": study(n // 2, m // 2, t, o, times=", verify: true", more="record: {peaks: 0}\n"),
        "refined": study(*((5, 5) if quick else (65, 65)), t, o, sweep=", refine: 2"),
        "limit of steps": study(n, m, t, o, times=f", max_steps: {limit}", sweep=CARRIED.format("wob")),
        "beam": "model: beam\n" + study(n // 2, m // 2, t / 2, o / 2),
        "torsion": "model: torsion\n" + study(n, m, t, o),
        "exponent": study(n, m, t, o, more="record: {peaks: 8, exponent: true}\n"),
        "segments, 10 + 10": SEGMENTS.format(n if quick else 256) + TIMES.format(t / 2, o / 2, "") + PEAKS,
    }


@dataclass
class Told:
    """Prints and keeps what was measured, until the time is used."""

    out: Path | None
    seconds: float
    data: dict[str, Any]
    began: float

    def __call__(self, name: str, /, **values: Any) -> None:
        values["at"] = round(time.perf_counter() - self.began, 1)
        print(json.dumps({name: values}, default=_plain), flush=True)
        self.data.setdefault(name, []).append(values)
        if self.out is not None:
            self.out.with_suffix(".json").write_text(json.dumps(self.data, indent=1, default=_plain) + "\n")

    def item(self, part: str, name: str, measure: Callable[[], None]) -> None:
        """Measure one thing, unless the time is over; a failure is a result."""
        if time.perf_counter() - self.began > self.seconds:
            self("no time for", what=f"{part}: {name}")
            return
        try:
            measure()
        except Exception as error:
            self("failed", what=f"{part}: {name}", error=str(error), where=traceback.format_exc()[-1500:])


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)


def main() -> None:
    arguments = _arguments()
    from nsdrill.app.running.run import processors
    from nsdrill.errors import DeviceError
    from nsdrill.sweep.gpu import Gpu

    try:
        gpu = Gpu.found()
    except DeviceError as error:
        raise SystemExit(f"No GPU to measure. {error}") from None
    machine = describe()
    told = Told(arguments.out, arguments.seconds, {"machine": [machine]}, time.perf_counter())
    found = {
        name: getattr(gpu.launcher, name)
        for name in ("name", "ratio", "capability", "multiprocessors")
        if hasattr(gpu.launcher, name)
    }
    told("device", **found, free_memory=gpu.launcher.free_memory(), processors=processors())
    for part in arguments.only.split(","):
        for name, measure in PARTS[part](told, gpu, arguments.quick):
            told.item(part, name, measure)
    write(arguments.out, summary(machine, told.data), told.data)


Item = tuple[str, Callable[[], None]]


def _bits(told: Told, gpu: Any, quick: bool) -> Iterator[Item]:
    several = cases(quick)
    first = next(iter(several))
    yield first, lambda: _compare(told, first, several[first], _compiled(several[first]))
    with ThreadPoolExecutor(8) as threads:  # the compiler of the driver takes up to half a minute
        compiling = {name: threads.submit(_compiled, text) for name, text in several.items() if name != first}
        for name, seconds in compiling.items():
            yield name, lambda name=name, seconds=seconds: _compare(told, name, several[name], seconds.result())  # type: ignore[misc]
    yield "runs that grow without bound", lambda: _compare_diverging(told, gpu, quick)


def _compiled(text: str) -> float:
    """How long it takes to compile a study for the GPU [s]."""
    from nsdrill.app.experiment import prepare
    from nsdrill.app.running.place import place_of
    from nsdrill.study import parse_study

    began = time.perf_counter()
    place_of("gpu", prepare(parse_study(text)), 1)
    return time.perf_counter() - began


def _compare(told: Told, name: str, text: str, compiled: float) -> None:
    """Both whole sweeps, and how many of their numbers have the same bits. Meanwhile others
    may be compiled: how long they take is measured elsewhere."""
    from nsdrill.app.running.run import run_in_memory
    from nsdrill.study import parse_study

    study = parse_study(text)
    seconds, results = {"compile": compiled}, {}
    for device in ("cpu", "gpu"):
        began = time.perf_counter()
        results[device] = run_in_memory(study, device=device)
        seconds[device] = time.perf_counter() - began
    here, there = results["cpu"].variables, results["gpu"].variables
    told("bits", case=name, runs=here["status"].size, seconds=seconds, **_same(here, there))


def _same(here: dict[str, Array], there: dict[str, Array]) -> dict[str, Any]:
    """How many numbers of two results have the same bits, and which variables differ."""
    assert list(here) == list(there)
    equal = {name: _as_bits(here[name]) == _as_bits(there[name]) for name in here}
    status, counts = np.unique(here["status"], return_counts=True)
    return {
        "numbers": sum(one.size for one in equal.values()),
        "equal": sum(int(np.count_nonzero(one)) for one in equal.values()),
        "differing": {name: int(np.count_nonzero(~one)) for name, one in equal.items() if not one.all()},
        "status": dict(zip(map(int, status), map(int, counts), strict=True)),
        "steps": int(np.sum(here["steps"]) + np.sum(here["rejected"])),
    }


def _as_bits(values: Array) -> Array:
    return values.view(np.int64) if values.dtype == np.float64 else values


def _compare_diverging(told: Told, gpu: Any, quick: bool) -> None:
    """Every third run begins with an infinite or absurd velocity, or with no number."""
    from benchmarks.workload import mixed

    work = mixed(*((3, 4) if quick else (30, 40)), *((0.5, 0.5) if quick else (5.0, 5.0)))
    points = np.arange(work.plan.points)
    states = work.prepare(points).initial
    bad = points % 3 == 1
    states[bad, 3] = np.array([np.inf, 1e200, np.nan, 1e30])[points[bad] // 3 % 4]
    work = replace(work, begun=states)
    here, there = (columns_of(work, one)[0] for one in (None, gpu))
    told("bits", case="runs that grow without bound", runs=len(points), **_same(here, there))


def columns_of(work: Any, gpu: Any, store: bool = True) -> tuple[dict[str, Array], float, int]:
    """The columns of a work by point through the engine, on the ``gpu`` or on all
    processors; the time [s]; and the steps tried."""
    from nsdrill.app.running.run import processors
    from nsdrill.kernel.batch import choose_lanes
    from nsdrill.sweep.engine import Engine
    from nsdrill.sweep.work import compiled_parts

    workers = processors()
    lanes = choose_lanes(-(-work.plan.points // workers))
    if gpu is None:
        compiled_parts(lanes, work.program)
    parts: list[tuple[Array, dict[str, Array]]] = []

    def deliver(points: Array, columns: dict[str, Array]) -> None:
        if store:
            parts.append((points, columns))

    with ThreadPoolExecutor(workers) as threads:
        began = time.perf_counter()
        progress = Engine(work, threads, workers, lanes, deliver, gpu=gpu).run()
        seconds = time.perf_counter() - began
    if not store:
        return {}, seconds, progress.lane_steps
    order = np.argsort(np.concatenate([points for points, _ in parts]))
    columns = {name: np.concatenate([c[name] for _, c in parts])[order] for name in parts[0][1]}
    return columns, seconds, progress.lane_steps


def work_of(text: str) -> Any:
    """The work of a study with one kind of code."""
    from nsdrill.app.experiment import prepare
    from nsdrill.app.running.stages import work_of as all_of
    from nsdrill.study import parse_study

    work = all_of(prepare(parse_study(text)))
    return next(work.by_method(np.arange(1)))[0]


def _rates(told: Told, gpu: Any, quick: bool) -> Iterator[Item]:
    wobs, speeds = (6, 7) if quick else (400, 340)
    for name, transient, observe, share in (
        ("transient", 25.0, 0.01, 1),
        ("observing", 0.0, 25.0, 1),
        ("map, 15 + 10 s", 15.0, 10.0, 1),
        ("map, 150 + 100 s", 150.0, 100.0, 16),
    ):
        if quick:
            transient, observe = transient / 50, max(observe / 50, 0.01)

        def measure(
            name: str = name, transient: float = transient, observe: float = observe, share: int = share
        ) -> None:
            work = work_of(study(wobs, speeds, transient, observe))
            seconds, steps, batch = bare(work, gpu)
            part = work_of(study(max(2, wobs // share), speeds, transient, observe))
            _, here, steps_here = columns_of(part, None, store=False)
            told(
                "rates",
                what=name,
                points=work.plan.points,
                steps=steps,
                seconds=seconds,
                rate=steps / seconds,
                threads=batch.lanes,
                processors=dict(points=part.plan.points, seconds=here, rate=steps_here / here),
                ratio=(steps / seconds) / (steps_here / here),
                **_kernel(batch),
            )

        yield name, measure


def bare(work: Any, gpu: Any, most: int | None = None) -> tuple[float, int, Any]:
    """The time of all runs of a work in one batch of a device [s], without what makes,
    measures and stores them; their steps; and the batch."""
    from nsdrill.sweep.work import lane_parts

    points = np.arange(work.plan.points)
    speeds = len(work.plan.axes["rotary_speed"])
    points = points[np.argsort(-(points % speeds), kind="stable")]  # fast ones first, as the engine has them
    gpu.check(work)
    with work.device_batch(gpu.launcher, most or _resident(work, gpu), len(points)) as batch:
        steps, parts = 0, lane_parts(1, work.program)
        at = 0
        seconds = 0.0
        while at < len(points) or not batch.idle:
            some = points[at : at + batch.free]
            at += len(some)
            if len(some):
                batch.add_many(some, work.prepare(some))
            began = time.perf_counter()
            done = batch.advance(parts, 1.0, at == len(points))
            seconds += time.perf_counter() - began
            steps += int(np.sum(done.accepted + done.rejected))
    return seconds, steps, batch


def _resident(work: Any, gpu: Any) -> int:
    with work.device_batch(gpu.launcher, 1, 1) as batch:
        return int(batch.resident)


def _kernel(batch: Any) -> dict[str, int]:
    """Registers, stack [bytes] and threads of the code of a batch, of transients and of
    observations where these are apart."""
    attributes = [getattr(kernel, "attribute", lambda which: 0) for kernel in batch._kernels]
    registers, stack = ([attribute(which) for attribute in attributes] for which in (4, 3))
    return {"registers": registers, "stack": stack, "resident": batch.resident}


def _rate(work: Any, gpu: Any, threads: int, seconds: float) -> tuple[float, Any]:
    """Steps a second of so many runs that do not end meanwhile, and their batch."""
    from nsdrill.kernel.loop import PACKED_STEPS
    from nsdrill.kernel.thread import LANE, OWN
    from nsdrill.sweep.work import lane_parts

    points = np.random.default_rng(1).permutation(work.plan.points)
    points = np.resize(points, threads)
    with work.device_batch(gpu.launcher, threads, threads) as batch:
        parts = lane_parts(1, work.program)

        def tried() -> int:
            kept = [numbers for name, numbers in batch._memory.items() if name.startswith("lanes")]
            return sum(int(one.read(OWN * batch.lanes)[LANE + PACKED_STEPS :: OWN].sum()) for one in kept)

        batch.add_many(points, work.prepare(points))
        batch.advance(parts, seconds / 2, True)
        before, began = tried(), time.perf_counter()
        batch.advance(parts, seconds, True)
        took = time.perf_counter() - began
        return (tried() - before) / took, batch


def _chains(told: Told, gpu: Any, quick: bool) -> Iterator[Item]:
    numbers = (1, 4, 16) if quick else (1, 64, 256, 512, 1024, 1408, 2048, 4224, 8448, 16896, 33792)
    size, seconds = ((3, 3), 0.1) if quick else ((200, 170), 0.4)
    for what, transient, observe in (("transient", 1e5, 0.01), ("observing", 0.0, 1e5)):
        work = work_of(study(*size, transient, observe))
        for number in numbers:

            def measure(what: str = what, work: Any = work, number: int = number) -> None:
                rate, batch = _rate(work, gpu, number, seconds)
                told("chains", what=what, chains=batch.lanes, rate=rate)

            yield f"{number} chains, {what}", measure


def _programs(told: Told, gpu: Any, quick: bool) -> Iterator[Item]:
    names = ("implicit", "returns to the section", "torsion", "beam", "exponent", "segments, 10 + 10")
    texts = cases(quick)
    for name in names:

        def measure(name: str = name) -> None:
            work = work_of(texts[name])
            long = replace(work, simulation=replace(work.simulation, transient=0.01, observe=1e5))
            began = time.perf_counter()
            threads = _resident(long, gpu)
            compiled = time.perf_counter() - began
            rate, batch = _rate(long, gpu, threads, 0.2 if quick else 1.0)
            points = np.linspace(0, work.plan.points - 1, min(work.plan.points, 16 if quick else 2048)).astype(int)
            here, steps = _long_enough(work, points, 0.1 if quick else 1.0)
            told(
                "programs",
                what=name,
                compile=compiled,
                rate=rate,
                threads=batch.lanes,
                **_kernel(batch),
                processors=dict(rate=steps / here, points=len(points)),
                ratio=rate / (steps / here),
            )

        yield name, measure


def _long_enough(work: Any, points: Array, least: float) -> tuple[float, int]:
    """The time [s] and the steps of some points on all processors, observed so long that
    loading the code and starting the threads, which take up to a second, do not count."""
    observe = 1.0
    while True:
        own = replace(work, simulation=replace(work.simulation, transient=0.01, observe=observe))
        _some(own, points)
        here, steps = _some(own, points)
        if here >= least or observe > 1e4:
            return here, steps
        observe *= min(max(1.5 * least / here, 2.0), 20.0)


def _some(work: Any, points: Array) -> tuple[float, int]:
    """The time [s] and the steps of some points on all processors."""
    from nsdrill.app.running.run import processors
    from nsdrill.kernel.batch import choose_lanes, widened
    from nsdrill.sweep.engine import Engine
    from nsdrill.sweep.work import compiled_parts

    workers = processors()
    share = -(-len(points) // workers)
    lanes = widened(choose_lanes(share), share, work.program.rows)
    compiled_parts(lanes, work.program)
    with ThreadPoolExecutor(workers) as threads:
        began = time.perf_counter()
        progress = Engine(work, threads, workers, lanes, lambda points, columns: None).run(None, points)
        return time.perf_counter() - began, progress.lane_steps


def _whole(told: Told, gpu: Any, quick: bool) -> Iterator[Item]:
    from nsdrill.app.running.run import run_in_memory
    from nsdrill.study import parse_study
    from nsdrill.sweep import gpu as worker

    wobs, speeds = (6, 7) if quick else (400, 340)
    for times in ((0.3, 0.2), (3.0, 2.0)) if quick else ((15.0, 10.0), (150.0, 100.0)):
        for batches in (1, 2):

            def measure(times: tuple[float, float] = times, batches: int = batches) -> None:
                text = study(wobs, speeds, *times)
                before, worker.SEVERAL = worker.SEVERAL, batches
                try:
                    began = time.perf_counter()
                    results = run_in_memory(parse_study(text), device="gpu")
                    seconds = time.perf_counter() - began
                finally:
                    worker.SEVERAL = before
                steps = int(np.sum(results["steps"]) + np.sum(results["rejected"]))
                told(
                    "whole",
                    times=times,
                    batches=batches,
                    points=results["status"].size,
                    seconds=seconds,
                    rate=steps / seconds,
                )

            yield f"{times}, {batches} batches", measure


def _cubie(told: Told, gpu: Any, quick: bool) -> Iterator[Item]:
    from benchmarks.peers import cubie_peer

    yield "the map", lambda: cubie_peer.race(lambda **values: told("cubie", **values), gpu, quick)


PARTS = {"rates": _rates, "bits": _bits, "chains": _chains, "whole": _whole, "programs": _programs, "cubie": _cubie}


def _rate_text(rate: float) -> str:
    return f"{rate / 1e9:.3g} G" if rate >= 1e9 else f"{rate / 1e6:.3g} M"


def _numbers(several: list[int]) -> str:
    return ", ".join(map(str, several))


def _here(row: dict[str, Any]) -> str:
    return _rate_text(row["processors"]["rate"])


Column = Callable[[dict[str, Any]], Any]
RATE: dict[str, Column] = {
    "steps/s": lambda row: _rate_text(row["rate"]),
    "processors, steps/s": _here,
    "ratio": lambda row: f"{row['ratio']:.3g}",
}
TABLES: dict[str, dict[str, Column]] = {
    "bits": {
        "sweep": lambda row: row["case"],
        "runs": lambda row: row["runs"],
        "numbers with the same bits": lambda row: f"{row['equal']:,} of {row['numbers']:,}",
        "variables that differ": lambda row: ", ".join(row["differing"]) or "none",
        "compile, s": lambda row: f"{row['seconds']['compile']:.1f}" if "seconds" in row else "-",
    },
    "rates": {
        "main model": lambda row: row["what"],
        "threads": lambda row: row["threads"],
        "s": lambda row: f"{row['seconds']:.3f}",
        **RATE,
    },
    "chains": {"chains": lambda row: row["chains"], "what": lambda row: row["what"], "steps/s": RATE["steps/s"]},
    "programs": {
        "code": lambda row: row["what"],
        "registers": lambda row: _numbers(row["registers"]),
        "stack, B": lambda row: _numbers(row["stack"]),
        "threads": lambda row: row["threads"],
        "compile, s": lambda row: f"{row['compile']:.1f}",
        **RATE,
    },
    "whole": {
        "map from study to results": lambda row: f"{row['times'][0]:g} + {row['times'][1]:g} s",
        "batches": lambda row: row["batches"],
        "s": lambda row: f"{row['seconds']:.2f}",
        "steps/s": RATE["steps/s"],
    },
}


def summary(machine: dict[str, Any], data: dict[str, Any]) -> str:
    """All of it in Markdown."""
    device = data["device"][0]
    parts = [f"\n# {device['name']} beside {device['processors']} processors\n", where(machine)]
    for name, columns in TABLES.items():
        if rows := data.get(name):
            parts.append(table([*columns], [[column(row) for column in columns.values()] for row in rows]))
    for name in ("cubie", "no time for", "failed"):
        if rows := data.get(name):
            parts.append(f"{name}: {json.dumps(rows, default=_plain, indent=1)}")
    return "\n\n".join(parts)


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="small sweeps, to rehearse")
    parser.add_argument("--seconds", type=float, default=280.0, help="after which nothing more is begun")
    parser.add_argument("--only", default=",".join(PARTS), help="parts, with commas between")
    parser.add_argument("--out", type=Path, default=None)
    return parser.parse_args()


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    main()
