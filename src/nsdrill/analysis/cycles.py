"""The period of a torsional motion from samples of a signal, as a log has them: the same
as the observer of a run counts on the continuous solution
(:class:`nsdrill.observe.channels.Period`), with the range of the whole stretch."""

from __future__ import annotations

import math

import numpy as np

from nsdrill.data import Array
from nsdrill.observe.channels import LEAST_CYCLES
from nsdrill.records import dataclass

SAMPLES = 6  # of a cycle, with fewer of which a swing may be missed
SCATTER = 0.25  # of the mean length of a cycle, beyond which cycles are no motion with a period
LIKENESS = 0.5  # of a signal to itself one period later, below which it is noise
SWING = 0.05  # of the mean, below which a motion that repeats is a ripple or a drift
BEYOND = 0.1  # of the samples, at either end of the range of a signal whose cycles differ in depth
LAGS = 61  # at which the likeness is looked for, at most


@dataclass(frozen=True)
class Cycles:
    """What the rises of a signal say: the mean length ``period`` [s] of a cycle, the standard
    deviation ``scatter`` of the lengths and the amplitude ``swing`` of what repeats, both as
    parts of their means, the correlation ``likeness`` of the signal with itself a period
    later, and how many ``samples`` a cycle has. All are NaN with fewer than three cycles."""

    period: float = math.nan
    scatter: float = math.nan
    likeness: float = math.nan
    swing: float = math.nan
    samples: float = math.nan

    @property
    def counted(self) -> bool:
        """Whether there are three cycles."""
        return math.isfinite(self.period)

    @property
    def sampled(self) -> bool:
        """Whether a cycle has so many samples that no swing is missed."""
        return self.samples >= SAMPLES

    @property
    def regular(self) -> bool:
        """Whether the cycles repeat, as those of noise do not."""
        return self.scatter <= SCATTER and self.likeness >= LIKENESS

    @property
    def large(self) -> bool:
        """Whether the motion that repeats is more than a ripple."""
        return self.swing >= SWING


def period_of(time: Array, signal: Array) -> float:
    """The mean time [s] between two rises of a ``signal`` above the middle of its range,
    each after a fall below the lower quarter, from samples [n] at ascending times [s].
    NaN where fewer than three cycles are counted, or where one has fewer than six
    samples. Samples that are no number are passed over."""
    time, _, rises = _known(time, signal)
    if len(rises) <= LEAST_CYCLES:
        return math.nan
    period = _mean_length(rises)
    return period if period / float(np.median(np.diff(time))) >= SAMPLES else math.nan


def cycles_of(time: Array, signal: Array) -> Cycles:
    """The cycles of a measured ``signal`` [n] at ascending times [s], with what tells a motion
    from noise: those of :func:`period_of`, or those within the middle eight tenths of the
    samples if their lengths scatter less. A torque whose cycles differ in depth does not
    fall below a quarter of its whole range in each."""
    time, signal, rises = _known(time, signal)
    if len(time) <= LEAST_CYCLES:
        return Cycles()
    step = float(np.median(np.diff(time)))
    within = rises_of(time, signal, BEYOND)
    found = [one for one in (rises, within) if len(one) > LEAST_CYCLES]
    found = [one for one in found if _mean_length(one) >= SAMPLES * step] or found
    if not found:
        return Cycles()
    rises = min(found, key=lambda one: float(np.diff(one).std()) / _mean_length(one))
    period = _mean_length(rises)
    likeness, deviation = _likeness(time, signal, period, step)
    size = max(abs(float(signal.mean())), 1e-300)
    return Cycles(
        period,
        float(np.diff(rises).std()) / period,
        likeness,
        math.sqrt(2.0 * max(likeness, 0.0)) * deviation / size,
        period / step,
    )


def _known(time: Array, signal: Array) -> tuple[Array, Array, Array]:
    """The samples that are numbers, and the times of the rises among them."""
    time, signal = (np.asarray(values, dtype=float) for values in (time, signal))
    known = np.isfinite(time) & np.isfinite(signal)
    time, signal = time[known], signal[known]
    return time, signal, rises_of(time, signal) if len(time) > LEAST_CYCLES else time[:0]


def _mean_length(rises: Array) -> float:
    return float((rises[-1] - rises[0]) / (len(rises) - 1))


def _likeness(time: Array, signal: Array, period: float, step: float) -> tuple[float, float]:
    """The greatest correlation of a signal, without its trend, with itself about a ``period``
    later, and its standard deviation."""
    even = np.linspace(time[0], time[-1], max(round((time[-1] - time[0]) / step), LEAST_CYCLES) + 1)
    values = np.interp(even, time, signal)
    trend = np.polynomial.Polynomial.fit(even, values, 1)
    values = values - trend(even)
    near = np.linspace(0.85 * period / step, 1.15 * period / step, LAGS).round().astype(int)
    found = [_correlation(values[:-lag], values[lag:]) for lag in np.unique(near) if 0 < lag < len(values) - 1]
    return max(found, default=0.0), float(values.std())


def _correlation(one: Array, other: Array) -> float:
    size = math.sqrt(float(one @ one) * float(other @ other))
    return float(one @ other) / size if size > 0.0 else 0.0


def rises_of(time: Array, signal: Array, beyond: float = 0.0) -> Array:
    """The times [s] of the rises that are counted, with the signal linear between two
    samples. Its range leaves out the part ``beyond`` of the samples at either end."""
    low, high = (float(one) for one in np.quantile(signal, [beyond, 1.0 - beyond]))
    middle, quarter = 0.5 * (low + high), low + 0.25 * (high - low)
    # the last of the samples that were below the quarter or above the middle decides
    told = np.flatnonzero((signal < quarter) | (signal > middle))
    above = signal[told] > middle
    last = told[1:][above[1:] & ~above[:-1]]
    before, after = signal[last - 1], signal[last]
    share = np.clip((middle - before) / np.where(after > before, after - before, 1.0), 0.0, 1.0)
    return np.asarray(time[last - 1] + share * (time[last] - time[last - 1]))
