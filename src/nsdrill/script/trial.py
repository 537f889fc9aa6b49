"""The natural scales of a model's states, from a short trial run at its defaults."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator

import numpy as np

from nsdrill.data import Array
from nsdrill.models.own_quantities import power_of_two
from nsdrill.script.reading import Reading

PERIODS = 40  # at most
CALLS = 3000  # of the function at most
RTOL, ATOL = 1e-3, 1e-6


def natural_scales(reading: Reading, rate: float) -> dict[str, float]:
    """The natural scale of each state: its own if the model gives one, else a tenth of the
    greatest value of the trial, as a power of two, which does not depend on last bits;
    ``rate`` is that of the slowest motion [1/s]."""
    start = reading.signature.start
    found = {name: value.scale for name, value in start.items() if value.scale is not None}
    if len(found) < len(start):
        greatest = dict(zip(start, _greatest(reading, PERIODS * 2.0 * math.pi / rate), strict=True))
        greatest |= {name: min(greatest[name], math.pi) for name in reading.angles}  # whether it turns or not
        found = {name: power_of_two(0.1 * value) for name, value in greatest.items()} | found
    return {name: found[name] for name in reading.states}


def _greatest(reading: Reading, duration: float) -> Array:
    """The greatest magnitude of each state in the trial."""
    signature, names = reading.signature, tuple(reading.signature.start)
    parameters = {name: float(value) for name, value in signature.parameters.items()}

    def slopes(t: float, y: Array) -> Array:
        states = dict(zip(names, y.tolist(), strict=True))
        found = signature.called(signature.function, t, states, parameters)
        return np.array([float(found[name]) for name in names])

    y = np.array([float(signature.start[name]) for name in names])
    greatest = np.abs(y)
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            for reached in _steps(slopes, y, duration):
                np.maximum(greatest, np.abs(reached), out=greatest)
    except ArithmeticError:  # it diverges: as far as it came
        pass
    return greatest


def _steps(slopes: Callable[[float, Array], Array], y: Array, duration: float) -> Iterator[Array]:
    """The states after each step of the pair of Bogacki and Shampine (1989), until the end
    of the trial, or until the run diverges or has no calls left."""
    t, h, k1, calls = 0.0, 1e-3 * duration, slopes(0.0, y), 1
    size = np.maximum(np.abs(y), 1e-3)
    while t < duration and calls < CALLS and h > 1e-12 * duration:
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
            yield y
        h *= min(5.0, max(0.2, 0.9 * max(error, 1e-9) ** (-1 / 3)))
