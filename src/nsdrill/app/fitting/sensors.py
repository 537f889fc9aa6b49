"""What a signal of a log shows of its sensor, and no residual of a fit: that its sign is the other one, that it is
cut off, stands still, or is read less often than it is written; and what measurements say against each other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from nsdrill.analysis.fitting import Measured
from nsdrill.data import Array

LONGEST_STILL = 20.0  # s of one value, of a signal that moves beside it
STILL_SHARE = 0.1  # of a stretch
LEAST_CHANGES = 20  # from which it is told how often a signal is read
CUT_SHARE, CUT_RATIO = 0.1, 3.0  # of the samples at one end, and over those at the other one
LEAST_LEVELS = 20  # values of a signal: one that is rounded to fewer has many at its ends


def faults(
    name: str, time: Array, values: Array, kept: Sequence[tuple[int, int]], slowest: float, text: Callable[[float], str]
) -> Iterator[str]:
    """A note for each fault that a signal shows in one of the stretches ``kept``, with its number, in the ``text``
    of a value; ``slowest`` is the time [s] between samples beyond which extremes are missed."""
    for number, (a, b) in enumerate(kept, 1):
        part, at = values[a:b], time[a:b]
        where = f"{name}, stretch {number}"
        if "torque" in name and float(part.mean()) < 0.0:
            yield f"BELOW ZERO: {where}: {text(float(part.mean()))} on average. Friction brakes: is its sign turned?"
        if (every := _read_every(at, part)) > slowest:
            yield f"HELD: {where} changes only every {every:.3g} s: its least and greatest values miss extremes"
        elif (still := _stands_still(at, part)) is not None:
            yield f"STANDS STILL: {where} is {text(still[1])} for {still[0]:.0f} s, and moves before or after: a fault?"
        if "torque" in name and (end := _cut_off(part)) is not None:
            yield f"CUT OFF: {where} is {text(end[0])} in {100 * end[1]:.0f} % of its samples: a limit of the sensor?"


def _runs(values: Array) -> tuple[Array, Array]:
    """The places at which runs of equal values begin, and after the last one."""
    begins = np.flatnonzero(np.append(True, values[1:] != values[:-1]))
    return begins, np.append(begins[1:], len(values))


def _stands_still(time: Array, values: Array) -> tuple[float, float] | None:
    """How long [s] a signal has one value, and which; None where it never has for long. A string
    that sticks has a speed of zero, for parts of a cycle."""
    begins, ends = _runs(values)
    lengths = time[ends - 1] - time[begins]
    place = int(np.argmax(lengths))
    duration = float(time[-1] - time[0])
    moves = len(begins) > LEAST_CHANGES
    if not moves or lengths[place] < max(LONGEST_STILL, STILL_SHARE * duration):
        return None
    return float(lengths[place]), float(values[begins[place]])


def _read_every(time: Array, values: Array) -> float:
    """The time [s] between changes of a signal that changes at the multiples of a number of
    samples alone; 0 of another one, as of one that is only rounded."""
    begins, _ = _runs(values)
    if len(begins) <= LEAST_CHANGES:
        return 0.0
    samples = int(np.gcd.reduce(np.diff(begins[1:])))
    step = float(np.median(np.diff(time)))
    return samples * step if samples > 1 else 0.0


def _cut_off(values: Array) -> tuple[float, float] | None:
    """The value at which a signal is cut off, and the share of its samples there; None of one
    that is not."""
    if len(np.unique(values)) < LEAST_LEVELS:
        return None
    shares = [(float(end), float(np.mean(values == end))) for end in (values.min(), values.max())]
    (least, most) = sorted(shares, key=lambda one: one[1])
    return most if most[1] > CUT_SHARE and most[1] > CUT_RATIO * least[1] else None


SLACK = 0.05  # of the set speed: the mean of the bit's is that
APART = 4.0  # standard deviations of one value between which two of one setting differ


def contradictions(speed: Array | None, measured: Measured) -> Iterator[str]:
    """A note for each thing that measurements at operating points say against each other, or against what
    every motion has: a bit turns on average as its string, at the set ``speed`` [points], and friction brakes."""
    values, where = measured.values, measured.where
    ends = (("bit_speed_max", -1.0, "below"), ("bit_speed_min", 1.0, "above")) if speed is not None else ()
    for name, side, word in ends:
        if name in values and speed is not None:
            beyond = np.flatnonzero(side * (values[name] - speed) > SLACK * np.abs(speed))
            if beyond.size:
                yield (
                    f"NOT THE SPEED: {name} is {word} the set speed at {where[beyond[0]]}, and a bit turns on average "
                    "as its string: is the unit right?"
                )
    if "surface_torque_max" in values and (below := np.flatnonzero(values["surface_torque_max"] < 0.0)).size:
        yield (
            f"BELOW ZERO: the greatest surface torque at {where[below[0]]}, and friction brakes: is its sign turned?"
        )
    yield from _one_setting_twice(measured)


def _one_setting_twice(measured: Measured) -> Iterator[str]:
    """A note where points with the same settings have values further apart than their errors: no run gives both."""
    if not measured.at:
        return
    _, groups = np.unique(np.column_stack([*measured.at.values()]), axis=0, return_inverse=True)
    groups = np.ravel(groups)
    for name, values in measured.values.items():
        for group in range(int(groups.max()) + 1):
            places = np.flatnonzero((groups == group) & np.isfinite(values))
            if len(places) < 2:
                continue
            low, high = (int(places[end(values[places])]) for end in (np.argmin, np.argmax))
            if values[high] - values[low] > APART * max(measured.errors[name][low], measured.errors[name][high]):
                yield (
                    f"ONE SETTING, OTHER VALUES: {name} of {measured.where[low]} and {measured.where[high]}, whose "
                    "settings are the same, differ by more than their errors: no run gives both"
                )
                break
