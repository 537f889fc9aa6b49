"""What the observer of a declaration leaves of a run, and what becomes of it: feature
arrays, in plain numpy.

Of each run the observer fills columns of the outbox: what it measured in either half of
the window, then rings of the last peaks, then a ring of the last returns to the
section.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nsdrill.abi import CACHE_LINE, aligned_zeros
from nsdrill.observe.channels import (
    HALF_DIFFERENCE,
    Declaration,
    Derived,
    Extremes,
    Mean,
    Names,
    Passages,
    Rms,
    TimeAbove,
    Winding,
    arguments,
    scale_of,
)

Array = np.ndarray[Any, np.dtype[np.float64]]
# The store begins with how many peaks and returns are kept. Then come the rings of
# peaks of each lane, then the ring of returns of each. A ring begins with the number of
# those found.
PEAKS, RETURNS = range(2)
RINGS = CACHE_LINE
# Of the natural scale: what is added to the range of a quantity when its extremes in
# both halves are compared.
FLOOR = 0.01


def section_width(names: Names, declaration: Declaration, returns: int) -> int:
    """Columns of the ring of returns: their number, then the states and the angle of
    each."""
    return 1 + (len(names.states) + 1) * returns if declaration.section and returns else 0


def report_width(names: Names, declaration: Declaration, peaks: int = 0, returns: int = 0) -> int:
    """Columns that the observer fills in the outbox, if the last ``peaks`` maxima of
    each channel whose peaks are wanted and the last ``returns`` to the section are
    kept."""
    rings = len(declaration.peaking) * (peaks + 1)
    return 2 * len(declaration.half) + rings + section_width(names, declaration, returns)


def new_store(
    lanes: int,
    names: Names,
    declaration: Declaration,
    peaks: int = 0,
    returns: int = 0,
    more: int = 0,
) -> Array:
    """The observer's store, with room for ``more`` numbers of other observers at its
    end."""
    rings = len(declaration.peaking) * (peaks + 1) + section_width(names, declaration, returns)
    store = aligned_zeros(RINGS + lanes * rings + more)
    store[PEAKS], store[RETURNS] = peaks, returns
    return store


def measured(
    names: Names,
    declaration: Declaration,
    report: Array,
    parameters: Array,
    state_scales: Array,
    observe: Array | float,
) -> dict[str, Array]:
    """The features of finished runs over the whole window, each an array [runs], and
    ``half_difference``.

    ``report`` holds the observer's columns [runs, report_width], ``parameters`` [runs,
    parameters] and ``state_scales`` [runs, states] those of the runs, ``observe`` the
    length of the window [s], one for all or [runs].

    ``half_difference`` is the largest disagreement between the halves of the window: of
    the extremes relative to their range (plus a hundredth of the natural scale), of the
    fractions of time as such. It is NaN where a declaration has neither.
    """
    width = len(declaration.half)
    first = dict(zip(declaration.half, report[:, :width].T, strict=True))
    second = dict(zip(declaration.half, report[:, width : 2 * width].T, strict=True))
    by_name = dict(zip(names.parameters, parameters.T, strict=True))
    join = {"least": np.minimum, "greatest": np.maximum}
    whole = {key: join.get(key[0], np.add)(first[key], second[key]) for key in declaration.half}
    found: dict[str, Array] = {}
    for name, feature in declaration.named:
        if isinstance(feature, Derived):
            known = {**by_name, **found}
            found[name] = feature.function(
                *(known[argument] for argument in arguments(feature.function))
            )
        elif isinstance(feature, Extremes):
            found[name] = whole[
                "greatest" if name == feature.greatest else "least", feature.channel
            ]
        elif isinstance(feature, TimeAbove):
            found[name] = _fraction(whole["above", feature.channel] / observe)
        elif isinstance(feature, Mean):
            found[name] = whole["integral", feature.channel] / observe
        elif isinstance(feature, Passages):
            found[name] = whole["passages", feature.channel] / observe
        elif isinstance(feature, Winding):
            found[name] = whole["angle", name] / observe
        elif isinstance(feature, Rms):
            found[name] = np.sqrt(np.maximum(whole["square", feature.channel], 0.0) / observe)
    by_name.update(zip(names.states, state_scales.T, strict=True))
    found[HALF_DIFFERENCE] = _half_difference(
        names, declaration, len(report), first, second, by_name, 0.5 * np.asarray(observe)
    )
    return found


def peaks_of(declaration: Declaration, report: Array, peaks: int) -> dict[str, Array]:
    """The last ``peaks`` maxima under each name that is given to peaks, oldest first,
    NaN where there are fewer: arrays [runs, peaks]. ``report`` is as for
    :func:`measured`."""
    place, found = 2 * len(declaration.half), {}
    for number, channel in enumerate(declaration.peaking):
        ring = report[:, place + number * (peaks + 1) :][:, : peaks + 1]
        ordered = _oldest_first(ring[:, :1], ring[:, 1:, None], peaks)[:, :, 0]
        for feature in declaration.those(Extremes):
            if feature.channel == channel and feature.peaks:
                found[feature.peaks] = ordered
    return found


def returns_of(
    names: Names, declaration: Declaration, report: Array, peaks: int, returns: int
) -> Array:
    """The last ``returns`` to the section, oldest first, NaN where there are fewer:
    shape (runs, returns, states + 1), the states and the angle. ``report`` is as for
    :func:`measured`."""
    ring = report[
        :,
        report_width(names, declaration, peaks) : report_width(names, declaration, peaks, returns),
    ]
    if not ring.shape[1]:
        return np.full((len(report), returns, len(names.states) + 1), np.nan)
    return _oldest_first(ring[:, :1], ring[:, 1:].reshape(len(report), returns, -1), returns)


def _oldest_first(counts: Array, entries: Array, room: int) -> Array:
    """From rings with ``counts`` [runs, 1] and ``entries`` [runs, room, columns]."""
    if room == 0:
        return entries
    count, place = counts.astype(np.int64), np.arange(room)
    oldest = np.where(count > room, count % room, 0)
    ordered = np.take_along_axis(entries, ((oldest + place) % room)[:, :, None], axis=1)
    return np.where((place < count)[:, :, None], ordered, np.nan)


def _fraction(value: Array) -> Array:
    # The sums of many step lengths miss the window's length by rounding: never above is
    # 0, not 1e-16.
    return np.where(value < 1e-12, 0.0, np.where(value > 1.0 - 1e-12, 1.0, value))


def _half_difference(
    names: Names,
    declaration: Declaration,
    runs: int,
    first: dict[Any, Array],
    second: dict[Any, Array],
    by_name: dict[str, Array],
    half_time: Array,
) -> Array:
    """``by_name`` has the parameters and the natural scales of the states."""
    differences = []
    channels = {channel.name: channel for channel in declaration.channels}
    for name in declaration.channels_of(Extremes):
        scale = scale_of(channels[name], names)
        low_1, low_2, high_1, high_2 = (
            half[end, name] for end in ("least", "greatest") for half in (first, second)
        )
        natural = np.abs(by_name[scale]) if isinstance(scale, str) else scale
        span = np.maximum(high_1, high_2) - np.minimum(low_1, low_2) + FLOOR * natural
        change = np.maximum(np.abs(low_1 - low_2), np.abs(high_1 - high_2))
        differences.append(np.divide(change, span, out=np.zeros(runs), where=span != 0.0))
    for name in declaration.channels_of(TimeAbove):
        differences.append(np.abs(first["above", name] - second["above", name]) / half_time)
    return np.maximum.reduce(differences) if differences else np.full(runs, np.nan)
