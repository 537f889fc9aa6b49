"""The natural scales of a model's states, from a short trial run at its defaults."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress

import numpy as np

from nsdrill.data import Array
from nsdrill.errors import InputError
from nsdrill.models.own_quantities import RESTING, power_of_two
from nsdrill.records import dataclass
from nsdrill.script.reading import Reading
from nsdrill.script.signature import number

PERIODS = 40  # at most
GROWTH = (
    3.0  # of the last third over what is before: a state that only drifts has 1.5, one that accelerates evenly 2.25
)
FAR = 10.0  # starts away a motion that grows has left its beginning
CALLS = 3000  # of the function at most
LONGER = 4  # times that, of a motion that grows
RTOL, ATOL = 1e-3, 1e-6


@dataclass(frozen=True)
class Scales:
    """The natural scale of each state, and the states of which it is a guess, as the motion at
    the defaults grows without bound and has no size of its own."""

    of: Mapping[str, float]
    guessed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Trial:
    """The greatest magnitude of each state in a trial, at its beginning and in the last third;
    which states ``grow`` to its end, as far as it is seen."""

    greatest: Array
    at_first: Array
    last: Array
    grow: Array


def natural_scales(reading: Reading, rate: float) -> Scales:
    """The natural scale of each state: its own if the model gives one, else a tenth of the
    greatest value of the trial, as a power of two, which does not depend on last bits;
    ``rate`` is that of the slowest motion [1/s]. Of a trial that grows it is a tenth of the
    greatest value at its beginning: a scale that is too small costs steps, and one that is too
    large lets any error pass."""
    start = reading.signature.start
    found = {name: value.scale for name, value in start.items() if value.scale is not None}
    guessed: tuple[str, ...] = ()
    if len(found) < len(start):
        numbers = _numbers(reading.signature.parameters), _numbers(start)
        trial = trial_of(reading, rate, *numbers)
        if trial.grow.any():  # it may only be slow to reach its size
            with suppress(InputError):  # what only a longer motion reaches is judged in runs
                trial = trial_of(reading, rate, *numbers, longer=LONGER)
        greatest = dict(zip(start, np.where(trial.grow, trial.at_first, trial.greatest).tolist(), strict=True))
        greatest |= {name: min(greatest[name], math.pi) for name in reading.angles}  # whether it turns or not
        growing = {name for name, grows in zip(start, trial.grow, strict=True) if grows and name not in found}
        found = {name: power_of_two(0.1 * value) for name, value in greatest.items()} | found
        guessed = tuple(name for name in reading.states if name in growing)
    return Scales({name: found[name] for name in reading.states}, guessed)


def _numbers(values: Mapping[str, number]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items()}


def trial_of(
    reading: Reading, rate: float, parameters: Mapping[str, float], start: Mapping[str, float], longer: int = 1
) -> Trial:
    """A trial run with these numbers of the function from this start, over some periods of the
    ``rate`` [1/s], so many times ``longer``."""
    signature, names = reading.signature, tuple(start)

    def slopes(t: float, y: Array) -> Array:
        states = dict(zip(names, y.tolist(), strict=True))
        found = signature.called(signature.function, t, states, parameters)
        return np.array([*map(float, found.values())])

    y = np.array([start[name] for name in names])
    times, sizes = [0.0], [np.abs(y)]
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            for t, reached in _steps(slopes, y, longer * PERIODS * 2.0 * math.pi / rate, longer * CALLS):
                times.append(t)
                sizes.append(np.abs(reached))
    except ArithmeticError:  # it diverges: as far as it came
        pass
    turning = np.array([name in reading.angles for name in names])
    return _seen(np.array(times), np.array(sizes), 1.0 / rate, turning)


def _seen(times: Array, sizes: Array, radian: float, turning: Array) -> Trial:
    """What magnitudes, a row at each time, say of a motion; states that turn may grow. The
    beginning is the first radian, or ends where a state is far from its start."""
    from_here = times[-1] * 2.0 / 3.0
    late = times > from_here
    there = np.array([np.interp(from_here, times, column) for column in sizes.T])  # steps may be as long as that
    before, last = np.maximum(there, sizes[~late].max(axis=0)), sizes[late].max(axis=0, initial=0.0)
    grow = (last > GROWTH * before) & (last > RESTING) & ~turning
    is_far = np.any((sizes > FAR * sizes[0]) & (sizes[0] > 0.0) & ~turning, axis=1)
    begins = (times <= radian) & ~np.logical_or.accumulate(is_far)
    begins[:2] = True  # with a step, in which what is at rest begins to move
    at_first, greatest = sizes[begins].max(axis=0), sizes.max(axis=0)
    return Trial(greatest, np.where(at_first > RESTING, at_first, np.minimum(before, 1.0)), last, grow)


def _steps(
    slopes: Callable[[float, Array], Array], y: Array, duration: float, most: int
) -> Iterator[tuple[float, Array]]:
    """The time and the states after each step of the pair of Bogacki and Shampine (1989), until the end
    of the trial, or until the run diverges or ``most`` calls are made."""
    t, h, k1, calls = 0.0, 1e-3 * duration, slopes(0.0, y), 1
    size = np.maximum(np.abs(y), 1e-3)
    while t < duration and calls < most and h > 1e-12 * duration:
        k2 = slopes(t + h / 2, y + h / 2 * k1)
        k3 = slopes(t + 3 * h / 4, y + 3 * h / 4 * k2)
        new = y + h * (2 * k1 + 3 * k2 + 4 * k3) / 9
        k4 = slopes(t + h, new)
        calls += 3
        off = h * (-5 * k1 / 72 + k2 / 12 + k3 / 9 - k4 / 8)
        error = float(np.max(np.abs(off) / (ATOL * size + RTOL * np.maximum(np.abs(y), np.abs(new)))))
        if not math.isfinite(error):
            h *= 0.1
            continue
        if error <= 1.0:
            t, y, k1 = t + h, new, k4
            size = np.maximum(size, np.abs(y))
            yield t, y
        h *= min(5.0, max(0.2, 0.9 * max(error, 1e-9) ** (-1 / 3)))
