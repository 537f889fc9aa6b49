"""The limits of one row of a map on the way in: where stick-slip ends, and the first limit
above that; along another axis than the speed, where it begins, and the first limit of all; and
how they scatter over samples of uncertain numbers."""

from __future__ import annotations

import numpy as np

from nsdrill.analysis.advice import names_of, only_unstable, sticks_to
from nsdrill.analysis.graded import Graded
from nsdrill.analysis.histories import Grade, Label, is_allowed
from nsdrill.analysis.planes import Cell
from nsdrill.analysis.sticking import joined
from nsdrill.analysis.untried import jumps_of, past
from nsdrill.data import Array
from nsdrill.models.registry import responses_in
from nsdrill.models.responses import STICK_SLIP, WHIRL
from nsdrill.records import dataclass

SPEED = "rotary_speed"  # along which stick-slip ends; along others, as the weight, it begins
QUANTILES = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Step:
    """A limit between two values of the first axis that were run: it is met after ``last``
    and at ``next`` at the latest; None beyond an end of the axis."""

    last: float | None
    next: float | None
    is_known: bool = True
    """Of stick-slip whether it is its end: not where the runs alone tell it and another vibration took its place."""


def past_jumps(maps: Graded) -> Array:
    """Which allowed points, bool [third, y, x], are brought up by steps that may jump across a vibration, or a gap."""
    return np.asarray(maps.allowed & ~started_only(maps) & past(maps, jumps_of(maps)))


@dataclass(frozen=True)
class Limit:
    """A limit above which a row is not allowed: its ``step``, the ``grade`` of the first
    point beyond it, and the ``responses`` there on the way in."""

    step: Step
    grade: Grade
    responses: tuple[str, ...]


def end_of_sticking(maps: Graded, number: int, row: int, below: int | None = None) -> Step | None:
    """Up to where stick-slip, once started, lasts in a row [third, y]: by the model, or where a run sticks at
    greater speeds, by that; where the model does not tell it by the runs alone, the last end below the place ``below``.
    Along another axis than the speed where it begins. None where there is none."""
    if maps.x == SPEED and maps.confidence is None and maps.modelled is not None and maps.modelled[number, row].all():
        return _by_model(maps, number, row)
    bits, values = maps.bits_on(maps.way_in)[number, row], maps.values(maps.x)
    is_ending = maps.x == SPEED
    # without samples or starts, of which some differ
    others = _others(maps, number, row) if maps.confidence is None and maps.share is None else 0
    sticks = _sticks(bits, _lasting(maps, number, row), others)
    sticking = np.flatnonzero(
        joined(sticks, bits, maps.grade[number, row] == Grade.UNKNOWN)[:below] if is_ending else sticks
    )
    if not sticking.size:
        return None
    known = np.flatnonzero(maps.grade[number, row] != Grade.UNKNOWN)
    if not is_ending:
        before = known[known < sticking[0]]
        return Step(float(values[before[-1]]) if before.size else None, float(values[sticking[0]]))
    after = known[known > sticking[-1]]
    if not after.size:
        return Step(float(values[sticking[-1]]), None)
    return Step(float(values[sticking[-1]]), float(values[after[0]]), not bits[after[0]])


def _by_model(maps: Graded, number: int, row: int) -> Step | None:
    """Up to where stick-slip lasts in a row of which the model tells it."""
    values, is_lasting = maps.values(maps.x), _sticking_runs(maps, number, row)
    to = max((sticks_to(maps, (number, row, column)) or 0.0) for column in range(len(values)))
    found = np.flatnonzero(is_lasting | (values <= to))
    if not found.size:
        return None
    last = int(found[-1])
    return Step(float(values[last]), float(values[last + 1]) if last + 1 < len(values) else None)


def end_in_runs(maps: Graded, number: int, row: int) -> Step | None:
    """Above the last run of a row [third, y] that sticks, of all ways, starts and samples, along the speed; None where
    none does. It is all that runs tell of where stick-slip ends, and no more than that."""
    sticking = np.flatnonzero(_sticking_runs(maps, number, row))
    if not sticking.size:
        return None
    values, last = maps.values(maps.x), int(sticking[-1])
    known = np.flatnonzero((maps.labels[:, number, row] > Label.UNKNOWN).any(axis=(0, -1)))
    after = known[known > last]
    return Step(float(values[last]), float(values[after[0]]) if after.size else None)


def _sticking_runs(maps: Graded, number: int, row: int) -> Array:
    """Where a run of a row sticks; of a collar on the wall it is the friction there, and not told."""
    ways, bits = maps.bits[:, number, row], maps.bits_on(maps.way_in)[number, row]
    alone = (ways & STICK_SLIP > 0) & (ways & WHIRL == 0)
    beside = joined(bits & STICK_SLIP > 0, bits, maps.grade[number, row] == Grade.UNKNOWN)
    return np.asarray(alone.any(axis=(0, -1)) | beside)


def _lasting(maps: Graded, number: int, row: int) -> Array:
    """Where stick-slip that was started lasts in a row of which the way in is free."""
    return np.asarray((maps.grade[number, row] == Grade.STICKS_ON) & ~only_unstable(maps)[number, row])


def _sticks(bits: Array, lasting: Array, others: Array | int = 0) -> Array:
    """Where stick-slip is met on the way in, or where that is free is ``lasting``, or among the
    responses on ``others`` of the ways; what vibrates otherwise on the way in bounds what is brought up, whatever
    a start there shows."""
    lasts = lasting | (np.asarray(others) & STICK_SLIP > 0)
    return np.asarray((bits & STICK_SLIP > 0) | (lasts & (bits == 0)))


def _others(maps: Graded, number: int, row: int) -> Array:
    """The responses on all ways of a row [third, y]."""
    return np.asarray(np.bitwise_or.reduce(maps.bits[:, number, row], axis=(0, -1)))


def started_only(maps: Graded) -> Array:
    """Which allowed points, bool [third, y, x], are free from a start at the point alone, where the
    others are brought up."""
    found = maps.allowed & (maps.grade == Grade.FROM_START)
    return np.asarray(found if "up" in maps.ways else np.zeros_like(found))


def next_limits(maps: Graded, number: int, row: int) -> list[Limit]:
    """The first limit above each stretch of what is allowed in a row [third, y], in order, and where nothing is that
    is brought up, the one above the end of stick-slip; along another axis than the speed the first of all. None above
    a stretch that goes on to the end of the axis. A point that is free from a quick start only bounds what is brought
    up."""
    bits, values = maps.bits_on(maps.way_in)[number, row], maps.values(maps.x)
    grades = maps.grade[number, row]
    lasting = _lasting(maps, number, row)
    sticking = np.flatnonzero(joined(_sticks(bits, lasting), bits, grades == Grade.UNKNOWN) & (maps.x == SPEED))
    begin = int(sticking[-1]) + 1 if sticking.size else 0
    reached = maps.allowed[number, row] & ~started_only(maps)[number, row]
    is_beyond = ~reached
    if maps.outside is not None:
        is_beyond &= ~maps.outside[number, row]
    found: list[Limit] = []
    while begin < len(values):
        if reached[begin:].any():
            begin += int(np.flatnonzero(reached[begin:])[0])
        elif found:
            break
        beyond = begin + np.flatnonzero(is_beyond[begin:])
        if not beyond.size:
            break
        first = int(beyond[0])
        last = float(values[first - 1]) if first > begin else None
        grade = Grade(int(maps.grade[number, row, first]))
        names = names_of(int(bits[first]), responses_in(maps.results.attrs))
        found.append(Limit(Step(last, float(values[first])), grade, names))
        begin = first + 1
    return found


def limits_of_starts(maps: Graded, number: int, row: int) -> list[Limit]:
    """The limit above each stretch of a row [third, y] whose last point is free from a quick start only, in order;
    none above one that goes on to the end of the axis."""
    quick, allowed, values = started_only(maps)[number, row], maps.allowed[number, row], maps.values(maps.x)
    found: list[Limit] = []
    for first in (np.flatnonzero(quick[:-1] & ~allowed[1:]) + 1).tolist():
        ways = ("same",) if maps.unmodelled[number, row, first] else ("same", maps.way_in)
        bits = next(filter(None, (int(maps.bits_on(way)[number, row, first]) for way in ways)), 0)
        step = Step(float(values[first - 1]), float(values[first]))
        names = names_of(bits, responses_in(maps.results.attrs))
        found.append(Limit(step, Grade(int(maps.grade[number, row, first])), names))
    return found


def open_to_starts(maps: Graded, number: int, row: int) -> float | None:
    """From which value on a row [third, y] is allowed to the end of the axis, from a quick start only at first; None
    where it is not."""
    quick, allowed = started_only(maps)[number, row], maps.allowed[number, row]
    begin = int(np.flatnonzero(~allowed).max(initial=-1)) + 1
    return float(maps.values(maps.x)[begin]) if begin < len(quick) and quick[begin] else None


@dataclass(frozen=True)
class Scatter:
    """A limit over samples: its 5, 50 and 95 % ``values``, and of how many samples."""

    values: tuple[float, ...]
    of: int


def sticking_over_samples(maps: Graded, number: int, row: int) -> Scatter | None:
    """Where stick-slip ends in a row, over the samples that are known: the first value
    without it; the first of the axis where there is none."""
    values = maps.values(maps.x)
    bits = maps.bits[maps.ways.index(maps.way_in), number, row]
    ends = []
    for world in range(bits.shape[-1]):
        if np.any(maps.grades[number, row, :, world] == Grade.UNKNOWN):
            continue
        grades = maps.grades[number, row, :, world]
        lasting = grades == Grade.STICKS_ON
        sticking = np.flatnonzero(joined(_sticks(bits[:, world], lasting), bits[:, world], grades == Grade.UNKNOWN))
        ends.append(values[min(int(sticking[-1]) + 1, len(values) - 1) if sticking.size else 0])
    return _scatter(np.asarray(ends))


def allowed_over_samples(maps: Graded, cell: Cell) -> Scatter | None:
    """The last allowed value of the stretch around a cell, over the samples in which the
    cell is allowed."""
    number, row, column = cell
    values = maps.values(maps.x)
    ends = []
    for allowed in is_allowed(maps.grades[number, row]).T:
        if allowed[column]:
            over = np.flatnonzero(~allowed[column:])
            ends.append(values[column + int(over[0]) - 1] if over.size else values[-1])
    return _scatter(np.asarray(ends))


def _scatter(ends: Array) -> Scatter | None:
    if not ends.size:
        return None
    return Scatter(tuple(np.quantile(ends, QUANTILES, method="inverted_cdf").tolist()), int(ends.size))
