"""The outcome of a declaration's observer, and the features computed from it, in plain
numpy.

For each run the observer fills columns of the outbox: the measurements of the first and
of the second half of the observation, then rings of the last peaks, then a ring of the
last returns to the section.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nsdrill.abi import CACHE_LINE, aligned_zeros
from nsdrill.data import Array
from nsdrill.errors import InputError
from nsdrill.observe.channels import (
    HALF_DIFFERENCE,
    LEAST_CYCLES,
    NATURAL,
    Declaration,
    Derived,
    Extremes,
    Mean,
    Names,
    Period,
    RmsOfSlopes,
    TimeAbove,
    arguments,
    measure_of,
    scale_of,
)

# The store begins with the numbers of peaks and of returns that are kept, and the number
# of parts into which the section divides its spacing. Then come the
# rings of peaks of each lane, then the ring of returns of each. A ring begins with the
# number of peaks or returns that have occurred.
PEAKS, RETURNS, PARTS = range(3)
RINGS = CACHE_LINE
# Fraction of the natural scale that is added to the range of a quantity when its
# extremes in the two halves are compared, and that a change in a step must exceed to count
# as faster than the steps.
RANGE_FLOOR = 0.01


def section_width(names: Names, declaration: Declaration, returns: int) -> int:
    """Columns of the ring of returns: their number, then the states and the angle of
    each."""
    return 1 + (len(names.states) + 1) * returns if declaration.section and returns else 0


def outcome_width(names: Names, declaration: Declaration, peaks: int = 0, returns: int = 0) -> int:
    """The number of columns of the outcome, if the last ``peaks`` maxima of each
    channel with peaks and the last ``returns`` to the section are kept."""
    rings = len(declaration.channels_with_peaks) * (peaks + 1)
    return 2 * len(declaration.measured_per_half) + rings + section_width(names, declaration, returns)


def new_store(
    lanes: int, names: Names, declaration: Declaration, peaks: int = 0, returns: int = 0, more: int = 0, parts: int = 1
) -> Array:
    """The observer's store, with ``more`` entries for other observers at its end. The
    section returns ``parts`` times in its spacing."""
    rings = len(declaration.channels_with_peaks) * (peaks + 1) + section_width(names, declaration, returns)
    store = aligned_zeros(RINGS + lanes * rings + more)
    store[PEAKS], store[RETURNS], store[PARTS] = peaks, returns, parts
    return store


def measured(
    names: Names,
    declaration: Declaration,
    outcome: Array,
    parameters: Array,
    state_scales: Array,
    observe: Array | float,
) -> dict[str, Array]:
    """The features of finished runs over the whole observation, each an array [runs],
    and ``half_difference``.

    ``outcome`` holds the observer's columns [runs, outcome_width], ``parameters``
    [runs, parameters] and ``state_scales`` [runs, states] those of the runs,
    ``observe`` the observation time [s], one for all or [runs].

    ``half_difference`` is the largest difference between the two halves of the
    observation: of the extremes relative to their range (plus a hundredth of the
    natural scale), but for angles that turn, of means relative to the scale by which they
    are compared, of the fractions of time as such. It is NaN if a declaration has none of them.
    """
    width = len(declaration.measured_per_half)
    first = dict(zip(declaration.measured_per_half, outcome[:, :width].T, strict=True))
    second = dict(zip(declaration.measured_per_half, outcome[:, width : 2 * width].T, strict=True))
    by_name = dict(zip(names.parameters, parameters.T, strict=True))
    join = {"least": np.minimum, "greatest": np.maximum}
    whole = {key: join.get(key[0], np.add)(first[key], second[key]) for key in declaration.measured_per_half}
    features: dict[str, Array] = {}
    for name, feature in declaration.named_features:
        if isinstance(feature, Derived):
            arrays = {**by_name, **features}
            features[name] = _derived(feature, arrays, len(outcome))
        elif isinstance(feature, Extremes):
            end = "greatest" if name == feature.greatest else "least"
            features[name] = _root(declaration, feature.channel, whole[end, feature.channel])
        else:
            if isinstance(feature, Period):
                cycles = whole["cycles", feature.channel]
                with np.errstate(divide="ignore", invalid="ignore"):
                    mean = whole[measure_of(feature)] / cycles
                features[name] = np.where(cycles >= LEAST_CYCLES, mean, np.nan)
                continue
            mean = whole[measure_of(feature)] / observe
            if isinstance(feature, TimeAbove):
                mean = _fraction(mean)
            elif isinstance(feature, RmsOfSlopes):
                mean = np.sqrt(np.maximum(mean, 0.0))
            features[name] = mean
    by_name.update(zip(names.states, state_scales.T, strict=True))
    features[HALF_DIFFERENCE] = _half_difference(
        names, declaration, len(outcome), first, second, by_name, 0.5 * np.asarray(observe)
    )
    return features


def _derived(feature: Derived, given: dict[str, Array], runs: int) -> Array:
    """What the function of a feature gives. InputError, with its place, where that is not a real
    number for each run."""
    code = getattr(feature.function, "__code__", None)
    place = f" ({code.co_filename}, line {code.co_firstlineno})" if code is not None else ""
    allowed = "a real number, or an array of one for each run"
    try:
        found = feature.function(*(given[argument] for argument in arguments(feature.function)))
    except (Exception, SystemExit) as error:
        said = f"{type(error).__name__}: {error}".rstrip(": ")
        raise InputError(f"Derived {feature.name!r}{place}: found {said}; allowed: {allowed}.") from error
    values = np.asarray(found)
    if values.dtype.kind not in "biuf" or values.shape not in ((), (1,), (runs,)):
        shown = repr(found)[:80].replace("\n", " ")
        raise InputError(f"Derived {feature.name!r}{place}: found {shown}; allowed: {allowed}.")
    return values if values.shape == (runs,) else np.full(runs, values)


def peaks_of(declaration: Declaration, outcome: Array, peaks: int) -> dict[str, Array]:
    """The last ``peaks`` maxima by their names in the declaration, oldest first, NaN
    where there are fewer: arrays [runs, peaks]. ``outcome`` as for
    :func:`measured`."""
    first_ring, found = 2 * len(declaration.measured_per_half), {}
    for number, channel in enumerate(declaration.channels_with_peaks):
        ring = outcome[:, first_ring + number * (peaks + 1) :][:, : peaks + 1]
        ordered = _oldest_first(ring[:, :1], ring[:, 1:, None], peaks)[:, :, 0]
        for feature in declaration.of_kind(Extremes):
            if feature.channel == channel and feature.peaks:
                found[feature.peaks] = _root(declaration, channel, ordered)
    return found


def returns_of(names: Names, declaration: Declaration, outcome: Array, peaks: int, returns: int) -> Array:
    """The last ``returns`` to the section, oldest first, NaN where there are fewer:
    shape (runs, returns, states + 1), the states and the angle. ``outcome`` as for
    :func:`measured`."""
    ring = outcome[:, outcome_width(names, declaration, peaks) : outcome_width(names, declaration, peaks, returns)]
    if not ring.shape[1]:
        return np.full((len(outcome), returns, len(names.states) + 1), np.nan)
    return _oldest_first(ring[:, :1], ring[:, 1:].reshape(len(outcome), returns, -1), returns)


def _oldest_first(counts: Array, entries: Array, room: int) -> Array:
    """The entries of rings in order of time, NaN where there are fewer than ``room``;
    from ``counts`` [runs, 1] and ``entries`` [runs, room, columns]."""
    if room == 0:
        return entries
    count, position = counts.astype(np.int64), np.arange(room)
    oldest = np.where(count > room, count % room, 0)
    ordered = np.take_along_axis(entries, ((oldest + position) % room)[:, :, None], axis=1)
    return np.where((position < count)[:, :, None], ordered, np.nan)


def _fraction(value: Array) -> Array:
    # The sum of many step lengths differs from the observation time by rounding, so
    # fractions within 1e-12 of 0 and of 1 are set to these.
    return np.where(value < 1e-12, 0.0, np.where(value > 1.0 - 1e-12, 1.0, value))


def _half_difference(
    names: Names,
    declaration: Declaration,
    runs: int,
    first: dict[tuple[str, str], Array],
    second: dict[tuple[str, str], Array],
    by_name: dict[str, Array],
    half_time: Array,
) -> Array:
    """``by_name`` has the parameters and the natural scales of the states."""
    differences = []
    channels = {channel.name: channel for channel in declaration.channels}

    def size(scale: str | float | Callable[..., Array]) -> Array | float:
        if callable(scale):
            return scale(*(by_name[name] for name in arguments(scale)))
        return np.abs(by_name[scale]) if isinstance(scale, str) else scale

    for name, feature in declaration.extremes.items():
        scale = feature.compared
        if scale is None:
            continue
        natural = size(scale_of(channels[name], names) if scale == NATURAL else scale)
        halves = [[_root(declaration, name, half[end, name]) for end in feature.ends] for half in (first, second)]
        low_1, low_2 = (half[0] if len(half) == 2 else np.zeros(runs) for half in halves)
        high_1, high_2 = (half[-1] for half in halves)
        with np.errstate(invalid="ignore"):  # of a quantity that is infinite
            reach = np.maximum(high_1, high_2) - np.minimum(low_1, low_2)
            span = reach + RANGE_FLOOR * natural
            change = np.maximum(np.abs(low_1 - low_2), np.abs(high_1 - high_2))
        if feature.revolution is not None:
            change = np.where(reach > feature.revolution, 0.0, change)
        differences.append(np.divide(change, span, out=np.zeros(runs), where=span != 0.0))
    for mean in declaration.of_kind(Mean):
        if mean.compared is not None:
            change = first["integral", mean.channel] - second["integral", mean.channel]
            differences.append(np.abs(change / half_time) / size(mean.compared))
    for above in declaration.of_kind(TimeAbove):
        differences.append(np.abs(first["above", above.name] - second["above", above.name]) / half_time)
    return np.maximum.reduce(differences) if differences else np.full(runs, np.nan)


def _root(declaration: Declaration, channel: str, values: Array) -> Array:
    """The quantity itself where the channel is its square."""
    squared = any(c.squared for c in declaration.channels if c.name == channel)
    return np.sqrt(np.maximum(values, 0.0)) if squared else values
