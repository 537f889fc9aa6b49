"""The period of a torsional motion from samples of a signal, as a log has them: the same
as the observer of a run counts on the continuous solution
(:class:`nsdrill.observe.channels.Period`), with the range of the whole stretch."""

from __future__ import annotations

import math

import numpy as np

from nsdrill.data import Array
from nsdrill.observe.channels import LEAST_CYCLES

SAMPLES = 6  # of a cycle, with fewer of which a swing may be missed


def period_of(time: Array, signal: Array) -> float:
    """The mean time [s] between two rises of a ``signal`` above the middle of its range,
    each after a fall below the lower quarter, from samples [n] at ascending times [s].
    NaN where fewer than three cycles are counted, or where one has fewer than six
    samples. Samples that are no number are passed over."""
    time, signal = (np.asarray(values, dtype=float) for values in (time, signal))
    cycle, samples = _cycle(time, signal)
    return cycle if samples >= SAMPLES else math.nan


def samples_a_cycle(time: Array, signal: Array) -> float:
    """How many samples one swing of a ``signal`` has; NaN with fewer than three swings."""
    return _cycle(np.asarray(time, dtype=float), np.asarray(signal, dtype=float))[1]


def _cycle(time: Array, signal: Array) -> tuple[float, float]:
    """The mean time between two rises [s] and how many samples it has."""
    known = np.isfinite(time) & np.isfinite(signal)
    time, signal = time[known], signal[known]
    rises = rises_of(time, signal) if len(time) > LEAST_CYCLES else time[:0]
    if len(rises) <= LEAST_CYCLES:
        return math.nan, math.nan
    period = float((rises[-1] - rises[0]) / (len(rises) - 1))
    return period, period / float(np.median(np.diff(time)))


def rises_of(time: Array, signal: Array) -> Array:
    """The times [s] of the rises that are counted, with the signal linear between two
    samples."""
    low, high = float(signal.min()), float(signal.max())
    middle, quarter = 0.5 * (low + high), low + 0.25 * (high - low)
    # the last of the samples that were below the quarter or above the middle decides
    told = np.flatnonzero((signal < quarter) | (signal > middle))
    above = signal[told] > middle
    last = told[1:][above[1:] & ~above[:-1]]
    before, after = signal[last - 1], signal[last]
    share = np.clip((middle - before) / np.where(after > before, after - before, 1.0), 0.0, 1.0)
    return np.asarray(time[last - 1] + share * (time[last] - time[last - 1]))
