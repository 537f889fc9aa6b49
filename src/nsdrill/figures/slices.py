"""Cuts through a sweep: ordered axes, lines, cells, limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from nsdrill.analysis.counts import with_failures
from nsdrill.analysis.grades import unsettled_runs
from nsdrill.analysis.safety import known_outcome, known_runs, measured_runs
from nsdrill.analysis.sticking import attributes_at
from nsdrill.data import Array, Results
from nsdrill.errors import InputError, Refusal, option
from nsdrill.models.choices import word_or_number, words_along
from nsdrill.observe.motion_kinds import verdict
from nsdrill.quantity import amount
from nsdrill.records import dataclass
from nsdrill.units import WithUnit
from nsdrill.variables import AXES, SAMPLE
from nsdrill.words.labels import CHOSEN, quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import XAxis, YAxis

T = TypeVar("T")


def ordered(results: Results, at: Mapping[str, float] | None = None) -> Results:
    """The results with every axis ascending, and cut at the values of ``at`` (SI)."""
    keys = {axis.name: axis.key for axis in results.more}
    for axis in results.axes:
        order = np.argsort(np.asarray(results.coords[axis], dtype=float), kind="stable")
        if not np.array_equal(order, np.arange(len(order))):
            results = taken(results, axis, order)
    for axis in results.axes:
        values = np.asarray(results.coords[axis], dtype=float)
        if at and axis in at and axis in results.uncertain:
            argument, key = (axis, "") if axis in AXES else ("at", axis)
            found = quantity(axis).value(at[axis])
            raise Refusal(argument, found, "nothing, as it is uncertain: each sample has its own", key=key)
        if at and axis in at:
            chosen = np.array([_index_of(axis, keys.get(axis, axis), values, at[axis])])
            if len(values) > 1:
                results = replace(taken(results, axis, chosen), part_of=(results, axis, chosen))
    return results


def taken(results: Results, axis: str, indices: Array) -> Results:
    """The results at these indices along an axis, in their order."""
    place = results.grid.index(axis)
    variables = {name: np.take(array, indices, axis=place) for name, array in with_failures(results).items()}
    coords = {**results.coords, axis: np.asarray(results.coords[axis], dtype=float)[indices]}
    return Results(coords, variables, results.attrs, results.more, results.drawn)


ONLY_ONE = {  # why there may be only one of several
    SAMPLE: "no number is uncertain",
    "start": "every operating point has one start",
}


def select(results: Results, dimension: str, number: float) -> Results:
    """The results of one sample of the uncertain numbers, or of one start of every
    operating point, as a sweep without this ``dimension``."""
    argument, key = ("at", SAMPLE) if dimension == SAMPLE else (dimension, "")
    if dimension not in results.coords:
        raise Refusal(argument, f"{number:g}", f"nothing, as {ONLY_ONE[dimension]}", key=key)
    count = len(results.coords[dimension])
    if number != int(number) or not 0 <= number < count:
        raise Refusal(argument, f"{number:g}", f"0 to {count - 1}", key=key)
    coords = {name: values for name, values in results.coords.items() if name != dimension}
    coords |= {name: samples[[int(number)]] for name, samples in results.uncertain.items()}
    place = results.grid.index(dimension)
    variables = {
        name: array.take(int(number), axis=place)
        for name, array in with_failures(results).items()
        if name != "attractor"  # of all starts of a point
    }
    chosen = f"{dimension} {number:g} of 0 to {count - 1}"
    return Results(coords, variables, {**attributes_at(results, dimension, int(number)), CHOSEN: chosen}, results.more)


def _index_of(axis: str, key: str, values: Array, target: float) -> int:
    """The index of the value nearest to ``target``, which lies at most half a step
    beyond the ends of the axis, or within one per cent of a single value."""
    if words_along(axis):
        if target not in values:
            allowed = ", ".join(str(word_or_number(key, value)) for value in values)
            raise InputError(
                f"{option('at')} {key}: found {word_or_number(key, target)}; allowed: {allowed}, as the sweep."
            )
        return int(np.flatnonzero(values == target)[0])
    ascending = np.sort(values)
    steps = np.diff(ascending)
    below, above = (steps[0] / 2, steps[-1] / 2) if len(steps) else 2 * (0.01 * abs(ascending[0]),)
    if not ascending[0] - below <= target <= ascending[-1] + above:

        def shown(value: float) -> str:
            return amount(value, target.unit, 4) if isinstance(target, WithUnit) else quantity(axis).value(value)

        argument = option(axis) if axis in AXES else f"{option('at')} {key}"
        raise InputError(
            f"{argument}: found {shown(target)}; allowed: {shown(ascending[0])} to {shown(ascending[-1])}, as the "
            "sweep, of which the nearest value is drawn."
        )
    return int(np.argmin(np.abs(values - target)))


@dataclass(frozen=True)
class Line:
    """The points along one axis with the other axes held: arrays are [procedure, point]
    or [procedure, point, peak]."""

    results: Results
    axis: str
    place: tuple[int | slice, ...]
    units: str = "si"

    @classmethod
    def along(cls, results: Results, axis: str, units: str = "si", **held: int) -> Line:
        """The line along ``axis`` through the point numbers ``held`` of the other axes
        (0 where not given)."""
        place = (slice(None) if name == axis else held.get(name, 0) for name in results.axes)
        return cls(results, axis, (slice(None), *place), units)

    @property
    def x(self) -> Array:
        """The positions of the points in SI."""
        return positions(self.results, self.axis)

    @property
    def across(self) -> Array:
        """The positions of the points in the units that are shown."""
        return self.x / quantity(self.axis, self.units).scale

    @property
    def edges(self) -> Array:
        """The edges of the cells of the points in the units that are shown."""
        return edges(self.x) / quantity(self.axis, self.units).scale

    @property
    def procedures(self) -> tuple[str, ...]:
        return self.results.procedures

    def __getitem__(self, name: str) -> Array:
        return np.asarray(self.results.variables[name])[self.place]

    def shown(self, name: str) -> Array:
        """The values of a variable in the units that are shown."""
        return self[name] / quantity(name, self.units).scale

    def points(self, name: str, chosen: Array | None = None) -> tuple[Array, Array]:
        """The finite values of a variable, one or several of each point, and their
        positions, in the units that are shown; of the ``chosen`` [procedure, point]
        points alone."""
        values = self.shown(name)
        each_point = (-1, *[1] * (values.ndim - 2))
        across, drawn = np.broadcast_to(self.across.reshape(each_point), values.shape), np.isfinite(values)
        if chosen is not None:
            drawn &= chosen.reshape(len(chosen), *each_point)
        return across[drawn], values[drawn]

    @property
    def outcome(self) -> Array:
        return np.asarray(known_outcome(self.results)[self.place])

    @property
    def measured(self) -> Array:
        """Which points were run and are known, and so have values [procedure, point]."""
        return np.asarray(measured_runs(self.results)[self.place])

    @property
    def unsettled(self) -> Array:
        """Which points were run, are known and had not settled [procedure, point]."""
        return np.asarray((unsettled_runs(self.results) & known_runs(self.results))[self.place])

    @property
    def verdicts(self) -> Array | None:
        """The verdict of the checks on each point; None where there were no checks."""
        return verdict(self) if "trusted" in self.results.variables else None


def positions(results: Results, axis: str) -> Array:
    """The positions of the values of an axis along a picture [n]: 1, 2, 3, ... for
    words."""
    values = np.asarray(results.coords[axis], dtype=float)
    return np.arange(1.0, len(values) + 1.0) if words_along(axis) else values


def name_words(axes: Axes, results: Results, x: str | None = None, y: str | None = None, units: str = "si") -> None:
    """Label the axes ``x`` and ``y`` whose values are words with these words."""
    for name, axis in ((x, axes.xaxis), (y, axes.yaxis)):
        if name is None or not words_along(name):
            continue
        shown = quantity(name, units)
        texts = [shown.value(value) for value in results.coords[name]]
        axis.set_ticks(positions(results, name), texts)
        axis.set_tick_params(length=0)
        if axis is axes.xaxis and sum(map(len, texts)) > 60:
            axis.set_tick_params(rotation=30)


def is_logarithmic(values: Array) -> bool:
    """Whether the values of an axis have equal ratios, at least three of them."""
    values = np.asarray(values, dtype=float)
    if len(values) < 4 or values[0] <= 0.0 or not np.all(np.diff(values) > 0.0):
        return False
    return bool(np.ptp(np.diff(np.log(values))) < 1e-6 * np.log(values[-1] / values[0]))


def spaced(axes: Axes, x: Array | None = None, y: Array | None = None) -> None:
    """Give the axes logarithmic scales where the values along them have equal
    ratios."""
    for values, axis in ((x, axes.xaxis), (y, axes.yaxis)):
        if values is not None and is_logarithmic(values):
            make_logarithmic(axis)


def make_logarithmic(axis: XAxis | YAxis, ticks: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    """Give an axis a logarithmic scale with plain numbers at these ``ticks`` of each
    power of ten."""
    from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

    axis.axes.set(**{f"{axis.axis_name}scale": "log"})
    axis.set_major_locator(LogLocator(subs=ticks))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def lay_along(axes: Axes, results: Results, axis: str, units: str, *, margins: bool = False) -> None:
    """Let the ``axis`` of a sweep lie along x of a panel: its label, its words, a
    logarithmic scale where the values are, and limits at the edges of the cells or,
    with ``margins``, hardly beyond the first and the last point."""
    shown, values = quantity(axis, units), positions(results, axis)
    axes.set_xlabel(shown.label)
    spaced(axes, values)
    name_words(axes, results, axis, units=units)
    if margins:
        axes.margins(x=0.01)
    else:
        axes.set_xlim(*(edges(values)[[0, -1]] / shown.scale))


def edges(centres: Array) -> Array:
    """Cell edges half way between neighbours; so a non-uniform axis is drawn to scale.
    The outer cells end half the least step beyond their values, as nothing is known
    there. Of values with equal ratios, half way on a logarithmic scale. No cell reaches
    below zero where no value does."""
    centres = np.asarray(centres, dtype=float)
    if is_logarithmic(centres):
        ratio = math.sqrt(centres[1] / centres[0])
        return np.append(centres / ratio, centres[-1] * ratio)
    if len(centres) == 1:
        half = 0.05 * abs(centres[0]) or 0.5
        return np.array([centres[0] - half, centres[0] + half])
    middle = 0.5 * (centres[1:] + centres[:-1])
    half = 0.5 * np.diff(centres).min()
    first, last = centres[0] - half, centres[-1] + half
    if centres[0] >= 0.0:
        first = max(first, 0.0)
    return np.concatenate(([first], middle, [last]))


def robust_limits(values: Array, spread: float = 3.0) -> tuple[float, float]:
    """Limits insensitive to a few outliers: the 2nd and 98th percentile, or the
    extremes where these are near: within ``spread`` times the distance of the
    percentile from the median.

    Ratios over a mean bit speed diverge where the bit hardly turns; one such point must
    not flatten all the others.
    """
    finite = np.asarray(values, dtype=float)
    finite = finite[np.isfinite(finite)]
    if not finite.size:
        return 0.0, 1.0
    low, middle, high = np.percentile(finite, (2, 50, 98))
    least, greatest = finite.min(), finite.max()
    low = least if middle - least <= spread * (middle - low) else low
    high = greatest if greatest - middle <= spread * (high - middle) else high
    if low == high:
        low, high = least, greatest
    if low == high:
        half = 0.5 * abs(low) or 0.5
        low, high = low - half, high + half
    return float(low), float(high)
