"""Operating points of a log: stretches of rows in which the settings are constant.

What no run can have ends a stretch: a gap, a cell that is no number, a speed of zero or a
weight below it, a time that does not go on. Such rows are left out, counted and told.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from itertools import pairwise

import numpy as np

from nsdrill.data import Array
from nsdrill.errors import FileError, count, option
from nsdrill.records import dataclass

SAME = 0.05  # of its mean, within which a setting is constant
HOLE = 5.0  # median steps without a sample, from which a hole in the time ends a stretch
FIRST_LOOK = 64  # rows
SPIKE = 0.5  # of a setting, by which it jumps for a row or two where a cell may be wrong
LISTED = 5  # holes
LEAST_ROWS = 3  # of what is used of a stretch


@dataclass
class Unusable:
    """The rows of a log that cannot be used: ``bad`` [rows], and how many there are for each
    reason, with the first of them in words. ``time`` [s] is that of all rows, NaN where it
    is not known; ``notes`` are on what else interrupts, and ``gaps`` says whether rows have
    some, which could be skipped."""

    lines: Array
    time: Array
    notes: list[str] = field(default_factory=list)
    gaps: bool = False
    bad: Array = field(init=False)
    reasons: list[tuple[int, str, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.bad = np.zeros(len(self.lines), dtype=bool)

    def add(self, rows: Array, what: str, first: Callable[[int], str] = lambda row: "") -> None:
        """Leave out the ``rows`` (a mask) of which no other reason is known yet; ``first``
        says what the first of them has."""
        new = rows & ~self.bad
        if new.any():
            row = int(np.argmax(new))
            detail = first(row)
            where = f"line {self.lines[row]}{f': {detail}' if detail else ''}"
            self.reasons.append((int(new.sum()), what, where))
            self.bad |= new

    def told(self) -> str:
        """The reasons in words."""
        return ", ".join(f"{number} {what} ({where})" for number, what, where in self.reasons)


@dataclass(frozen=True)
class Stretches:
    """The ``kept`` stretches, (first row, row after the last) of what is used of each, and
    ``notes`` on the rest."""

    kept: list[tuple[int, int]]
    notes: list[str]


@dataclass(frozen=True)
class Cuts:
    """Before which rows a stretch ends, with the reason (``ends``); how many
    ``interruptions`` by rows that cannot be used there are; and the ``holes`` in the time
    besides, in words."""

    ends: dict[int, str]
    interruptions: int
    holes: str


def stretches_of(
    path: str,
    time: Array,
    settings: Mapping[str, Array],
    lines: Array,
    unusable: Unusable,
    *,
    shortest: float,
    settle: float,
) -> Stretches:
    """The stretches of a log whose rows that can be used have these ``time`` [s] and
    ``settings`` in the ``lines`` of its file; ``unusable`` are all others. FileError,
    with what ended the longest stretch, where none lasts ``shortest`` [s]; the first
    ``settle`` [s] of each are not used."""
    step = _step(time)
    cuts = _cuts(time, step, lines, unusable)
    kept: list[tuple[int, int]] = []
    short = 0
    longest, lasted, ended_by = (0, 0), -1.0, ""
    parts = _constant(settings, len(time), cuts.ends)
    for start, stop, why in parts:
        used = start + int(np.searchsorted(time[start:stop], time[start] + settle)) if stop > start else start
        if stop - used < LEAST_ROWS or time[stop - 1] - time[start] < shortest:
            short += 1
            if time[stop - 1] - time[start] > lasted:
                longest, lasted, ended_by = (start, stop), float(time[stop - 1] - time[start]), why
            continue
        kept.append((used, stop))
    notes = list(unusable.notes)
    if unusable.reasons:
        rows = int(unusable.bad.sum())
        notes.append(
            f"{count(cuts.interruptions, 'interruption')}, {count(rows, 'row')} of {len(unusable.bad)} not drilling or "
            f"not usable: {unusable.told()}"
        )
    if cuts.holes:
        notes.append(f"{cuts.holes}, where a stretch ends")
    notes += _spikes(settings, parts, lines)
    if not kept:
        a, b = longest
        found = (
            f"{path}: found no stretch of at least {shortest:g} s in which the settings stay within {100 * SAME:g} % "
            f"of their mean, with {LEAST_ROWS} rows after its first {settle:g} s; allowed: at least one. "
            f"{option('shortest')} takes shorter ones, {option('settle')} uses more of each."
        )
        if b > a:
            found += f" The longest lasts {lasted:g} s (lines {lines[a]} to {lines[b - 1]}), ended by {ended_by}."
        if notes:
            found += f" {'. '.join(notes)}."
            if unusable.gaps:
                found += f" {option('skip_gaps')} passes over rows with gaps and goes on with the stretch."
        raise FileError(found)
    told = f"{count(len(kept), 'stretch')} of constant settings, without their first {settle:g} s"
    return Stretches(kept, [told + (f"; {short} shorter than {shortest:g} s left out" if short else ""), *notes])


def longest_part(time: Array, lines: Array, unusable: Unusable) -> tuple[int, int]:
    """The first row, and the row after the last, of the longest part of a log that nothing
    interrupts."""
    cuts = _cuts(time, _step(time), lines, unusable)
    edges = sorted({0, len(time), *(row for row in cuts.ends if 0 < row < len(time))})
    return max(pairwise(edges), key=lambda part: float(time[part[1] - 1] - time[part[0]]))


def _step(time: Array) -> float:
    """The usual time between two samples [s]."""
    steps = np.diff(time)
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if steps.size else np.inf


def _cuts(time: Array, step: float, lines: Array, unusable: Unusable) -> Cuts:
    """Where stretches of these rows end."""
    ends = {}
    groups = np.flatnonzero(np.diff(unusable.bad.astype(int), prepend=0) == 1)
    good = np.flatnonzero(~unusable.bad)
    index = np.searchsorted(good, groups)  # the next row that can be used
    for row, first in zip(index.tolist(), groups.tolist(), strict=True):
        ends[row] = f"line {unusable.lines[first]}, which cannot be used"
    steps = np.diff(time)
    for row in np.flatnonzero(steps <= 0.0).tolist():
        ends[row + 1] = f"line {lines[row + 1]}, whose time is {time[row + 1]:g} s after {time[row]:g} s"
    # between all rows: those that cannot be used are no hole, and may have one before them
    known = np.flatnonzero(np.isfinite(unusable.time))
    across = np.diff(unusable.time[known])
    holes = []
    for place in np.flatnonzero(across > max(HOLE * step, 1e-9)).tolist():
        row = int(known[place + 1])
        holes.append(f"before line {unusable.lines[row]}, {across[place]:g} s long")
        ends.setdefault(int(np.searchsorted(good, row)), f"a hole in the time {holes[-1]}")
    more = f"; and {len(holes) - LISTED} more" if len(holes) > LISTED else ""
    told = f"{count(len(holes), 'hole')} in the time ({'; '.join(holes[:LISTED])}{more})" if holes else ""
    return Cuts(ends, len(groups) + int(np.count_nonzero(steps <= 0.0)), told)


def _constant(settings: Mapping[str, Array], rows: int, cuts: Mapping[int, str]) -> list[tuple[int, int, str]]:
    """(First row, row after the last, what ended it) of each stretch in which every setting is
    within :data:`SAME` of its mean so far."""
    names = list(settings)
    table = np.stack([settings[name] for name in names], axis=1) if names else np.zeros((rows, 0))
    size = np.maximum(np.abs(table).max(axis=0, initial=0.0), 1e-300)
    edges = sorted({0, rows, *(row for row in cuts if 0 < row < rows)})
    found = []
    for begin, end in pairwise(edges):
        start = begin
        while start < end:
            stop, name = _deviating(table, size, start, end)
            why = cuts.get(stop, "the end of the log") if name is None else f"a change of {names[name]}"
            found.append((start, stop, why))
            start = stop
    return found


def _spikes(settings: Mapping[str, Array], parts: Sequence[tuple[int, int, str]], lines: Array) -> list[str]:
    """A note for each setting that leaves its value for a row or two, by half of it or more."""
    notes = []
    for name, values in settings.items():
        found = []
        for before, (start, stop, why), after in zip(parts, parts[1:], parts[2:], strict=False):
            changed = before[2] == why == f"a change of {name}"
            if (
                not changed
                or stop - start >= LEAST_ROWS
                or min(before[1] - before[0], after[1] - after[0]) < LEAST_ROWS
            ):
                continue
            usual, then = (float(values[slice(*part[:2])].mean()) for part in (before, after))
            size = max(abs(usual), 1e-300)
            if abs(then - usual) <= SAME * size and abs(values[start] - usual) >= SPIKE * size:
                found.append((int(lines[start]), float(values[start]) / size))
        if found:
            line, times = found[0]
            notes.append(
                f"SPIKE: {name} leaves its value for a row or two and comes back {count(len(found), 'time')}, where a "
                f"stretch ends (line {line}: {times:.3g} times the value before)"
            )
    return notes


def _deviating(table: Array, size: Array, start: int, end: int) -> tuple[int, int | None]:
    """The first row from ``start`` on that is off the mean of those before, and the setting
    that is; ``end`` and None where there is none."""
    look, total, row = FIRST_LOOK, table[start].copy(), start + 1
    while row < end:
        part = table[row : min(row + look, end)]
        sums = np.cumsum(np.concatenate([total[np.newaxis], part]), axis=0)
        means = sums[:-1] / (row - start + np.arange(len(part)))[:, np.newaxis]
        deviates = np.abs(part - means) > SAME * np.maximum(np.abs(means), 0.02 * size)
        if deviates.any():
            first = int(np.argmax(deviates.any(axis=1)))
            return row + first, int(np.argmax(deviates[first]))
        row, look, total = row + len(part), 2 * look, sums[-1]
    return end, None
