"""A sweep as maps of grades: the class of every operating point from the runs of it, of
each sample of uncertain numbers, or of all starts."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from nsdrill.analysis.counts import carried_axis
from nsdrill.analysis.grades import grades_of, labels_of, spread_of, sticking_of, unsettled_runs
from nsdrill.analysis.histories import Grade, Label, as_known, is_allowed, of_starts
from nsdrill.analysis.planes import Cell, along_axis, axes_or_refusal, mean_known, planes_of
from nsdrill.analysis.probability import effective_number, independent, interval
from nsdrill.analysis.safety import barring, known_runs
from nsdrill.analysis.unmodelled import unmodelled
from nsdrill.data import WITHIN, Array, Results
from nsdrill.models.registry import responses_in
from nsdrill.records import dataclass
from nsdrill.variables import INFERRED, SAMPLE

SLACK = 1e-6  # relative: 100 rpm written in another unit


@dataclass(frozen=True)
class Graded:
    """The grades of a sweep over the axes ``x``, ``y`` and ``third``; the last two are
    None where no such axis is swept, and their length is then 1.

    ``labels`` and ``bits`` are [way, third, y, x, world], the :class:`Label` and the
    responses of every run, ``bars`` those of them that a severity does not allow; a world is a sample, or a start.
    ``grades`` are
    [third, y, x, world], of all starts together [third, y, x, 1]. ``sticks_to`` is the set speed up to which
    stick-slip, once started, may last at the setting [rad/s], 0 where it does at none, ``shown_to`` the same by the
    smoothed friction of the runs, and ``modelled`` whether the model says so and not the runs alone; ``unstable`` is
    whether it begins there by itself, by the model, and ``tried`` whether it is known at all, see
    :class:`nsdrill.analysis.sticking.Sticking`; all
    [third, y, x, world]. ``share`` is the share of starts that are safe, [third, y, x];
    None without starts. ``effective`` is the effective number of samples, ``confidence`` the share of them that must be
    allowed; both None without samples. The points ``outside`` of where one drills,
    [third, y, x], are run-up only; None where there are none. Of the cells ``in_trials`` trials have withdrawn what
    the map says. With ``settled_only`` a point that is ``unsettled`` is not allowed.
    """

    results: Results
    x: str
    y: str | None
    third: str | None
    along: str | None
    labels: Array
    bits: Array
    bars: Array
    grades: Array
    sticks_to: Array | None = None
    shown_to: Array | None = None
    modelled: Array | None = None
    unstable: Array | None = None
    tried: Array | None = None
    share: Array | None = None
    confidence: float | None = None
    effective: float | None = None
    in_trials: frozenset[Cell] = frozenset()
    outside: Array | None = None
    settled_only: bool = False

    def without(self, found: Mapping[Cell, int]) -> Graded:
        """These maps with cells that are critical after all, each with its responses as bits."""
        grades, bits, bars = np.array(self.grades), np.array(self.bits), np.array(self.bars)
        for cell, of_cell in found.items():
            grades[cell] = Grade.CRITICAL
            bits[(slice(None), *cell)] = bars[(slice(None), *cell)] = of_cell
        return replace(self, grades=grades, bits=bits, bars=bars, in_trials=self.in_trials | found.keys())

    def values(self, axis: str | None) -> Array:
        """The values of an axis; a single zero for None."""
        return np.zeros(1) if axis is None else np.asarray(self.results.coords[axis], dtype=float)

    @property
    def ways(self) -> tuple[str, ...]:
        """The procedures of the file."""
        return self.results.procedures

    @cached_property
    def allowed(self) -> Array:
        """Which points may be recommended, [third, y, x]; of samples those at which the
        share of all samples reaches the confidence, whatever became of those that
        failed."""
        return self._at_confidence(is_allowed(self.grades))

    @cached_property
    def better(self) -> Array:
        """Which of them are safe after any history."""
        return self._at_confidence(self.grades == Grade.ANY_HISTORY)

    @cached_property
    def fields(self) -> tuple[Array, ...]:
        """The fields of allowed points, each [third, y, x], within which one may move: what
        is free on the slow way from below, what is free from a start at the point, and
        all that is allowed. What is free from a quick start only bounds the first: a
        string that is brought there slowly vibrates."""
        below = self._at_confidence(self.grades >= Grade.FROM_BELOW_ONLY)
        if "same" not in self.ways or self.share is not None:
            return (below,)
        started = self.labels[self.ways.index("same")] == Label.CLEAR
        return below, self._at_confidence(is_allowed(self.grades) & started), self.allowed

    @cached_property
    def was_run(self) -> Array:
        """Which points were run, [third, y, x], and not inferred from their neighbours."""
        inferred = self.results["status"] == INFERRED
        return ~np.asarray(planes_of(self.results, self.x, self.y, self.third)(inferred).any(axis=-1))

    @cached_property
    def unmodelled(self) -> Array:
        """Which points lie where the model leaves out a motion of the string, [third, y, x]."""
        planes = planes_of(self.results, self.x, self.y, self.third)
        return np.asarray(planes(unmodelled(self.results)[None]).any(axis=-1))

    @cached_property
    def may_be(self) -> Array:
        """Which points would be allowed if all that is not known of them were good."""
        return self._at_confidence(is_allowed(self.grades) | (self.grades == Grade.UNKNOWN))

    @property
    def least(self) -> Array:
        """The share of all samples in which each point is known to be allowed."""
        share = is_allowed(self.grades).mean(axis=-1)
        return np.asarray(share if self.outside is None else np.where(self.outside, 0.0, share))

    def _at_confidence(self, chosen: Array) -> Array:
        enough = chosen.all(axis=-1)
        if self.confidence is not None:
            enough = chosen.mean(axis=-1) >= self.confidence - 1e-9
        if self.settled_only:
            enough &= ~self.unsettled
        return np.asarray(enough if self.outside is None else enough & ~self.outside)

    @cached_property
    def unsettled(self) -> Array:
        """Where a run on which the class of a point rests was finished and had not settled,
        [third, y, x]: the start of a point that is safe from it alone, all ways of one that is
        safe after any history, else the way in. Of samples where so many had not settled that
        the confidence may fail."""
        planes = planes_of(self.results, self.x, self.y, self.third)
        found = planes(unsettled_runs(self.results))
        if self.confidence is not None:
            open_ = found | planes(~known_runs(self.results))
            return np.asarray(found.any(axis=-1) & (open_.mean(axis=-1) > 1.0 - self.confidence + 1e-9))
        if found.shape[-1] != len(self.ways):
            return np.asarray(found.any(axis=-1))
        grade, rests = self.grades[..., 0], found[..., self.ways.index(self.way_in)]
        if "same" in self.ways:
            rests = np.where(grade == Grade.FROM_START, found[..., self.ways.index("same")], rests)
        carried = [place for place, way in enumerate(self.ways) if way != "same"] or [0]
        return np.where(grade == Grade.ANY_HISTORY, found[..., carried].any(axis=-1), rests)

    def is_left_out(self, cell: Cell) -> bool:
        """Whether a cell is not allowed for that alone that it had not settled."""
        return self.settled_only and bool(self.unsettled[cell]) and bool(is_allowed(self.grades[cell]).any())

    @cached_property
    def grade(self) -> Array:
        """The grade of each point, [third, y, x]. Of samples that of allowed points; of
        others the commonest one that is not allowed, and of two the worse."""
        if self.confidence is None:
            return np.asarray(self.grades[..., 0])
        counts = np.stack([(self.grades == grade).sum(axis=-1) for grade in Grade if not grade.allowed])
        below = np.where(self.better, Grade.ANY_HISTORY, Grade.FROM_BELOW_ONLY)
        return np.asarray(np.where(self.allowed, below, np.argmax(counts, axis=0)))

    def probability(self, any_history: bool = False) -> tuple[Array, Array, Array]:
        """The share of the known samples in which each point is allowed, or safe after any
        history, and the ends of its 95 % interval, which holds whatever the samples
        that failed would have given; arrays [third, y, x]."""
        chosen = self.grades == Grade.ANY_HISTORY if any_history else is_allowed(self.grades)
        count, total = chosen.sum(axis=-1), chosen.shape[-1]
        open_ = (self.grades == Grade.UNKNOWN).sum(axis=-1)
        scale = (self.effective or total) / total
        known_ = np.maximum(total - open_, 1)
        low, high = interval(count * scale, total * scale, open_ * scale)
        return np.where(total > open_, count / known_, np.nan), low, high

    def bits_on(self, way: str) -> Array:
        """The responses on a way, [third, y, x]: of samples those that may prevent that
        the confidence is reached, of starts those of any."""
        return self._responses(self.bits[self.ways.index(way)])

    @cached_property
    def barred(self) -> Array:
        """Those on the way in that prevent that a point is allowed, [third, y, x]: none that a severity allows."""
        return self._responses(self.bars[self.ways.index(self.way_in)])

    def _responses(self, bits: Array) -> Array:
        if self.confidence is None:
            return np.asarray(np.bitwise_or.reduce(bits, axis=-1))
        critical = responses_in(self.results.attrs).values()
        least = least_share(self.confidence, len(critical))
        return np.asarray(sum(one.bit * ((bits & one.bit > 0).mean(axis=-1) >= least) for one in critical))

    def yields(self, name: str) -> Array:
        """A yield at every point, [third, y, x]: the mean of the known runs on the way in, of
        a point that is free from a start only that of the start; NaN where the file does
        not have it, or no run is known."""
        if name not in self.results.variables:
            return np.full(self.allowed.shape, np.nan)
        values = np.where(known_runs(self.results), self.results[name], np.nan)
        planes = planes_of(self.results, self.x, self.y, self.third)
        found = mean_known(planes(values[self.ways.index(self.way_in)][None]))
        if "same" in self.ways and self.confidence is None and self.share is None:
            started = mean_known(planes(values[self.ways.index("same")][None]))
            found = np.where(self.grade == Grade.FROM_START, started, found)
        return found

    def free_way(self, cell: Cell) -> str:
        """The way on which an allowed point is free: that in, or the start at the point."""
        return "same" if self.grade[cell] == Grade.FROM_START and "same" in self.ways else self.way_in

    @property
    def way_in(self) -> str:
        """The way on which a point is reached: up, else where it starts, else down."""
        return way_in(self.ways)


def least_share(confidence: float, responses: int) -> float:
    """The probability from which one of so many ``responses`` counts among those that may
    prevent that a point is safe: of four it must have a quarter of 1 less
    ``confidence``."""
    return (1.0 - confidence) / max(responses, 1)


def way_in(procedures: Sequence[str]) -> str:
    """On which of the ``procedures`` a point is reached."""
    return next(way for way in ("up", "same", "down") if way in procedures)


def graded(results: Results, severity: int | None = None, confidence: float | None = None) -> Graded:
    """The grades of a sweep. InputError where its axes do not make maps."""
    swept = axes_or_refusal(results)
    planes = planes_of(results, *swept)
    counted = independent(results) if SAMPLE in results.coords else slice(None)

    outside = _outside(results, *swept)

    def worlds(array: Array) -> Array:
        """``array`` on the grid as [way, third, y, x, world]."""
        if SAMPLE in results.coords:
            array = array[..., counted]
        return np.array([planes(part[None]) for part in array])

    along = carried_axis(results)
    labels = worlds(labels_of(results, severity))
    # a run that came free where the model leaves a motion out tells nothing
    is_untold = worlds(unmodelled(results)[None])
    labels = np.where(is_untold & (labels >= Label.TOUCHING), Label.OPEN, labels)
    bits = worlds(np.where(known_runs(results), results["response"], 0).astype(int))
    bars = bits if severity is None else worlds(barring(results, severity))
    found = sticking_of(results, severity)
    about = (found.to, found.shown_to, found.modelled, found.unstable, found.tried)
    to, shown_to, modelled, unstable, tried = (worlds(part[None])[0] for part in about)
    if "start" in results.coords:
        starts = as_known(np.concatenate(list(labels), axis=-1))
        is_known = np.maximum((starts != Label.UNKNOWN).sum(axis=-1), 1)
        share = (starts >= Label.TOUCHING).sum(axis=-1) / is_known
        # of the model, and so of all starts alike
        sticks = (worlds((found.unstable | (found.met & found.lasts))[None])[0]).any(axis=-1)
        grades = of_starts(starts, sticks, worlds(found.between[None])[0].any(axis=-1))[..., None]
        if spread_of(results) is not None:  # of all that there may be these are some
            grades = np.where(grades == Grade.ANY_HISTORY, Grade.FROM_SOME, grades)
        return Graded(
            results,
            *swept,
            along,
            starts[None],
            bits,
            bars,
            grades,
            to,
            shown_to,
            modelled,
            unstable,
            tried,
            share,
            outside=outside,
        )
    samples = SAMPLE in results.coords
    return Graded(
        results,
        *swept,
        along,
        as_known(labels),
        bits,
        bars,
        worlds(grades_of(results, severity)[None])[0],
        to,
        shown_to,
        modelled,
        unstable,
        tried,
        confidence=confidence if samples else None,
        effective=effective_number(results, counted) if samples else None,
        outside=outside,
    )


def _outside(results: Results, x: str, y: str | None, third: str | None) -> Array | None:
    """Which points, [third, y, x], are outside of where one drills; None where that is not given."""
    return _beyond(results, (third, y, x)) if json.loads(results.attrs.get(WITHIN, "{}")) else None


def drilled_runs(results: Results) -> Array:
    """Which runs are where one drills; all where that is not given."""
    return np.broadcast_to(~_beyond(results, results.grid), results.shape)


def _beyond(results: Results, axes: Sequence[str | None]) -> Array:
    """Where one of these ``axes`` is beyond the values between which one drills, an array over them, one long where
    there is no axis."""
    ranges = json.loads(results.attrs.get(WITHIN, "{}"))
    lengths = [len(results.coords[axis]) if axis is not None else 1 for axis in axes]
    found = np.zeros(lengths, dtype=bool)
    for place, axis in enumerate(axes):
        if axis is not None and axis in ranges:
            at, (low, high) = results.coords[axis], ranges[axis]
            is_out = (at < low - SLACK * abs(low)) | (at > high + SLACK * abs(high))
            found |= along_axis(is_out, place, len(lengths))
    return found
