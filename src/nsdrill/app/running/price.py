"""How long a run will take, before it begins: some of its points are timed.

The cost of a point depends on its motion: one on which the collar rolls along the wall
takes up to 64 times the steps of the median. So points are spread evenly over all axes,
samples and starts; where the state is carried each is started twice, from the start of
the study and from a drawn one, as a chain may come to it rolling. The mean of their steps
and the time of a step give the time of all, within a factor of two on most of the studies
that come with nsdrill; that is what is told.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from nsdrill import interrupt
from nsdrill.app.experiment import Experiment, coarse_points, prepare
from nsdrill.app.running.stages import work_of
from nsdrill.data import Answer, Array
from nsdrill.errors import InputError, count
from nsdrill.kernel.batch import Runs, choose_lanes, widened
from nsdrill.records import dataclass
from nsdrill.study.study import Study
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Work, compiled_parts

TIMED = 24  # runs
SPREAD = 2.0  # the true time over the estimate, and the inverse, at most
SHARE, SHARE_ASKED = 0.04, 0.25  # of the run that timing takes at most, unasked and asked
CHECKS = 3.1  # times the steps of the sweep that its checks take: docs/benchmarks.md
WIDER = 2.0  # times the time of a step of few lanes that one of many takes
WORTH = 10.0  # s from which a run is priced unasked
GLIMPSE = 5.0  # s of motion of each point, which tell whether it is worth it
LEAST = 1e-3  # s of motion observed
ENOUGH = 500_000, 20_000  # steps, and steps for each second of motion, after which a run is not timed further
MOST_THREADS = 4
TAIL, TAIL_OF_CHAINS = 0.5, 1.0  # of the last run, or chain, of a lane, in which others are idle already


@dataclass(frozen=True)
class Price:
    """The estimated time of a run.

    Attributes
    ----------
    seconds : float
        On ``workers`` processors like this one [s].
    low, high : float
        Between which the time will be [s]. Where a map is refined ``high`` is that of the
        finest grid, and ``seconds`` and ``low`` are those of the coarse one.
    timed, runs, workers : int
        Runs that were timed, those of the study, and the processors.
    slow : int
        Of those that were timed how many took so many steps that they were not timed to
        their end: they are taken to reach ``simulation.max_steps``.
    took : float
        Time that this took [s].
    """

    seconds: float
    low: float
    high: float
    timed: int
    runs: int
    workers: int
    took: float
    slow: int = 0

    @property
    def text(self) -> str:
        """``about 2 to 8 min on 2 processors (24 of 462 points timed)``"""
        timed = f"{self.timed} runs timed for {count(self.runs, 'point')}"
        if self.slow:
            timed += f", {self.slow} of which take ever shorter steps and will end at simulation.max_steps"
        return f"about {between(self.low, self.high)} on {count(self.workers, 'processor')} ({timed})"

    def as_json(self) -> Answer:
        """All of it as plain data."""
        times = {"seconds": self.seconds, "low": self.low, "high": self.high, "took": self.took}
        numbers = {"timed": self.timed, "runs": self.runs, "workers": self.workers, "slow": self.slow}
        return {**{name: {"value": value, "units": "s"} for name, value in times.items()}, **numbers}


_UNITS = ((1.0, "s"), (60.0, "min"), (3600.0, "h"), (86400.0, "days"))


def between(low: float, high: float) -> str:
    """Two times [s] in words: ``2 to 8 min``."""
    size, unit = next(one for one in reversed(_UNITS) if high >= 2.0 * one[0] or one[0] == 1.0)
    first, last = (f"{value / size:.2g}" if value < 99.5 * size else f"{value / size:.0f}" for value in (low, high))
    return f"{first} to {last} {unit}"


def price_of(study: Study, workers: int) -> Price:
    """The price of running ``study`` on ``workers`` threads."""
    experiment = prepare(study)
    found = price(experiment, work_of(experiment), workers)
    assert found is not None
    return found


def price(
    experiment: Experiment, work: Work, workers: int, missing: int | None = None, *, asked: bool = True
) -> Price | None:
    """The price of running ``work``, of which ``missing`` points, by default all, are to be
    run on ``workers`` threads. Unless it is ``asked`` for, None for a run that is soon
    done."""
    began, study, plan = time.perf_counter(), experiment.study, work.plan
    coarse = coarse_points(study, plan.points)
    share = 1.0 if missing is None else missing / plan.points
    duration = work.simulation.transient + work.simulation.observe
    part = min(1.0, (SHARE_ASKED if asked else SHARE) * coarse * share / TIMED)
    if not asked:
        if part * duration <= GLIMPSE:
            return None
        glimpse, *_ = _estimate(work, workers, GLIMPSE / duration)
        if glimpse * coarse * share < WORTH * plan.points:
            return None
    whole, timed, slow = _estimate(work, workers, min(1.0, max(part, GLIMPSE / duration)))
    whole *= share
    seconds = whole * coarse / plan.points
    took = time.perf_counter() - began
    return Price(seconds, seconds / SPREAD, whole * SPREAD, timed, int(coarse * share), workers, took, slow)


def cost_of_second(study: Study, simulated: float) -> float:
    """The time that a second of the motions of ``study`` takes in one lane [s/s], of ``simulated`` seconds of each of
    some of its points, from steady and from drawn starts."""
    experiment = prepare(study)
    work = work_of(experiment)
    duration = work.simulation.transient + work.simulation.observe
    seconds, *_ = _estimate(work, 1, min(1.0, simulated / duration), lasts=True)
    return seconds / (duration * experiment.plan.points)


def _estimate(work: Work, workers: int, part: float, *, lasts: bool = False) -> tuple[float, int, int]:
    """The time of all points and of their checks [s], from runs of this ``part`` of their
    time, the number of these runs, and how many of them were not timed to their end."""
    simulation = work.simulation
    transient, observe = part * simulation.transient, max(LEAST, part * simulation.observe)
    part = (transient + observe) / (simulation.transient + simulation.observe)
    plan, chains = work.plan, -(-work.plan.abreast // workers)
    points = spread(plan, TIMED // 2 if plan.carried else TIMED, work.compiled_axes)
    most = min(simulation.max_steps, int(ENOUGH[0] + ENOUGH[1] * (transient + observe)))
    shorter = replace(work, simulation=replace(simulation, transient=transient, observe=observe, max_steps=most))
    cost, timed, slow = 0.0, 0, 0
    parts = ((found, len(those)) for piece, those in shorter.parts(points) for found in piece.by_method(those))
    for (one, own), of_part in parts:
        lanes = widened(choose_lanes(chains), chains, one.program.rows)
        compiled_parts(lanes, one.program)
        found, per_step = _timed(one, own, lanes, workers)
        slow += sum(int(np.count_nonzero(steps >= most)) for steps in found)
        found = [np.where(steps >= most, simulation.max_steps * part, steps) for steps in found]
        # Parts with code of their own run one after the other. The method may change
        # along a chain, of which each then has a share.
        if lasts:  # a vibration that is carried along the way up: the costlier kind of start
            found = [max(found, key=lambda steps: float(np.mean(steps)))]
        share, of_method = of_part / len(points), len(own) / of_part
        of_points = share * of_method * plan.points
        filled = of_method * _packed_steps(share * plan.abreast, plan.chain_length, lanes * workers, found)
        if not plan.carried:
            filled = _packed_steps(of_points, 1, lanes * workers, found)
        if work.simulation.verify:  # of every point alone, also where the sweep is a chain
            many = max(lanes, choose_lanes(-(-plan.points // workers)))
            of_checks = CHECKS * (WIDER if many > lanes else 1.0)
            filled += of_checks * _packed_steps(of_points, 1, many * workers, found)
        cost += filled * per_step
        timed += sum(map(len, found))
    return cost / part, timed, slow


def _packed_steps(chains: float, length: int, lanes: int, steps: list[Array]) -> float:
    """The steps of a batch for these ``chains`` of points, on so many ``lanes`` of all
    workers, where each point takes as many as those that were timed, on average; the
    longest of several chains as many as from the costlier kind of start."""
    means = [float(np.mean(of_kind)) for of_kind in steps]
    of_chain, longest = length * sum(means) / len(means), length * max(means)
    if chains <= 1:
        return of_chain
    if chains <= lanes:
        return longest
    return max(longest, of_chain * (chains / lanes + (TAIL_OF_CHAINS if length > 1 else TAIL)))


def _timed(work: Work, points: Array, lanes: int, workers: int) -> tuple[list[Array], float]:
    """The steps of the runs of these points [runs] from each kind of start, and the time of
    a step of all lanes [s], on as many threads as the run will have."""
    starts = list(_starts(work, points))
    threads = min(workers, work.plan.chains, MOST_THREADS, len(points))
    stop = threading.Event()
    with ThreadPoolExecutor(threads) as pool:
        parts = [[(own[k::threads], runs[k::threads]) for own, runs in starts] for k in range(threads)]
        try:
            found = [one.result() for one in [pool.submit(_time, work, part, lanes, stop) for part in parts]]
        except BaseException:
            stop.set()
            raise
    steps = [np.concatenate(of_kind) for of_kind in zip(*(steps for steps, _, _ in found), strict=True)]
    return steps, sum(seconds for _, seconds, _ in found) / sum(number for *_, number in found)


def _time(
    work: Work, starts: list[tuple[Array, Runs]], lanes: int, stop: threading.Event
) -> tuple[list[Array], float, int]:
    """The steps of runs from each kind of start, and the time [s] and number of the steps of
    all lanes; until ``stop`` is set."""
    ends = np.cumsum([len(points) for points, _ in starts])
    batch, steps = work.new_batch(lanes, int(ends[-1])), np.zeros(int(ends[-1]))
    for end, (points, runs) in zip(ends, starts, strict=True):
        batch.add_many(np.arange(end - len(points), end), runs)
    functions = compiled_parts(lanes, work.program)
    began = time.perf_counter()
    while not batch.idle and not stop.is_set():
        interrupt.check()
        done = batch.advance(functions, 0.25, True)
        steps[done.job] = done.accepted + done.rejected
    return np.split(steps, ends[:-1]), time.perf_counter() - began, max(1, batch.packed_steps)


def _starts(work: Work, points: Array) -> Iterator[tuple[Array, Runs]]:
    """The runs of these points from their own starts and, where the state is carried, also
    from drawn ones, if the model has such."""
    runs = work.prepare(points)
    yield points, runs
    if not work.plan.carried or len(points) < 2:
        return
    at = work.at(work.plan.values(points))
    drawn = replace(at.initial, ensemble=len(points), slice={})
    try:
        states = work.computed.starts(replace(at, initial=drawn), np.arange(len(points)))
    except InputError:  # the model draws none
        return
    initial = runs.initial.copy()
    for row, state in zip(initial, states, strict=True):
        work.begin(row, state)
    yield points, replace(runs, initial=initial)


def spread(plan: Plan, most: int, apart: Sequence[str] = ()) -> Array:
    """Numbers of at most ``most`` points of a ``plan``, evenly spread over all axes, samples
    and starts: equal shares of the speed, an additive sequence (Roberts 2018) along the
    others. Of the axes ``apart`` every value has as many points, two or more, where these
    are not more than the most."""
    of_each = [1 + list(plan.axes).index(axis) for axis in apart]
    values = int(np.prod([plan.grid[axis] for axis in of_each], dtype=int))
    if values > 1 and 2 * values <= most:
        one = np.unravel_index(_spread(plan, most // values, of_each), plan.grid)
        places = np.indices([plan.grid[axis] for axis in of_each]).reshape(len(of_each), -1)
        indices = [np.tile(index, values) for index in one]
        for axis, place in zip(of_each, places, strict=True):
            indices[axis] = np.repeat(place, len(one[0]))
        return np.unique(np.ravel_multi_index(tuple(indices), plan.grid))
    return _spread(plan, most)


def _spread(plan: Plan, most: int, without: Sequence[int] = ()) -> Array:
    """Those points at the first values of the axes with the numbers ``without``."""
    grid = np.array(plan.grid)
    names = ["procedure", *plan.axes, *["other"] * (len(grid) - 1 - len(plan.axes))]
    order = sorted(range(1, len(grid)), key=lambda axis: names[axis] != "rotary_speed" or grid[axis] == 1)
    order = [axis for axis in order if grid[axis] > 1 and axis not in without]
    number = min(most, int(np.prod(grid[order])))
    k = np.arange(number)
    ratio = _additive_ratio(max(1, len(order) - 1))
    indices = np.zeros((len(grid), number), np.int64)
    for place, axis in enumerate(order):
        share = (k + 0.5) / number if place == 0 else (0.5 + (k + 1) * ratio**-place) % 1.0
        indices[axis] = np.minimum((share * grid[axis]).astype(np.int64), grid[axis] - 1)
    return np.unique(np.ravel_multi_index(tuple(indices), tuple(grid)))


def _additive_ratio(dimensions: int) -> float:
    """The root of x^(d + 1) = x + 1, the golden ratio for d = 1."""
    x = 2.0
    for _ in range(64):
        x = (1.0 + x) ** (1.0 / (dimensions + 1))
    return x
