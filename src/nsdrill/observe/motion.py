"""The kind of motion of a response: equilibrium, period-n, quasi-periodic, chaotic, not
settled, or undetermined.

The returns to the Poincare section determine a period. Without one, the largest
Lyapunov exponent distinguishes chaos from quasi-periodicity or, where it was not
measured, the 0-1 test does. The classification can be repeated on a file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numba import types

from nsdrill.compiler.driver import driver, helper
from nsdrill.observe.thresholds import Motion
from nsdrill.variables import (
    CHAOTIC,
    EQUILIBRIUM,
    OK,
    PERIODIC,
    QUASI_PERIODIC,
    UNDETERMINED,
    UNSETTLED,
)

Array = np.ndarray[Any, np.dtype[Any]]
LEAST_REPEATS = 3  # of a period among the returns
# The greatest scatter of returns that count as the same, as a fraction of that of all
# returns, for a period of two or more.
CLUSTER_SCATTER = 0.2
# The least ratio of the spreads of the returns in the first and in the last third, the
# smaller to the larger, for a period of two or more.
LEAST_SPREAD_RATIO = 0.9
LEAST_RETURNS = 1000  # for the 0-1 test; 200 identify neither a rattling collar nor a slow decay
FREQUENCIES = 64  # of the 0-1 test


def period(returns: Array, state_scales: Array, t: Motion) -> Array:
    """The least number of returns after which all of them repeat, 0 where there is
    none: int16 [points].

    ``returns`` has shape (points, returns, states), oldest first and NaN where there
    are none, ``state_scales`` (points, states) is the natural scale of each state. Two
    returns are the same if every state differs by less than ``absolute`` times its
    scale plus ``relative`` times its range over all returns. For a period of two or
    more, returns that are the same must also be close compared with all returns, and
    the spread of the returns must not change: a motion that spirals into its limit
    comes near earlier returns repeatedly, but its returns contract.
    """
    periods = np.zeros(len(returns), dtype=np.int16)
    # The compiled function takes contiguous and writable arrays.
    returns, state_scales = (
        np.require(array, requirements=["C", "W"]) for array in (returns, state_scales)
    )
    _make_period()(
        returns,
        state_scales,
        t.absolute,
        t.relative,
        t.longest_period,
        periods,
        np.empty((2, returns.shape[2])),
    )
    return periods


@lru_cache
def _make_period() -> Any:
    @helper
    def spread(states, j, begin, end):  # type: ignore[no-untyped-def]
        low, high = np.inf, -np.inf
        for k in range(begin, end):
            low, high = min(low, states[k, j]), max(high, states[k, j])
        return high - low

    @driver(
        types.void(
            types.float64[:, :, ::1],
            types.float64[:, ::1],
            types.float64,
            types.float64,
            types.int64,
            types.int16[::1],
            types.float64[:, ::1],
        )
    )
    def least_periods(returns, state_scales, absolute, relative, longest, periods, limits):  # type: ignore[no-untyped-def]
        for point in range(len(returns)):
            states = returns[point]
            count = 0
            while count < len(states) and math.isfinite(states[count, 0]):
                count += 1
            widest, is_stationary = 0.0, True
            for j in range(states.shape[1]):
                low, high = np.inf, -np.inf
                for k in range(count):
                    low, high = min(low, states[k, j]), max(high, states[k, j])
                limits[0, j] = absolute * state_scales[point, j] + relative * (high - low)
                if count > 0 and (high - low) / state_scales[point, j] > widest:
                    widest = (high - low) / state_scales[point, j]
                    first, last = (
                        spread(states, j, 0, count // 3),
                        spread(states, j, count - count // 3, count),
                    )
                    is_stationary = min(first, last) >= LEAST_SPREAD_RATIO * max(first, last)
            for j in range(states.shape[1]):
                limits[1, j] = min(limits[0, j], CLUSTER_SCATTER * widest * state_scales[point, j])
            for n in range(1, (min(longest, count // LEAST_REPEATS) if is_stationary else 1) + 1):
                repeats = True
                for j in range(states.shape[1]):
                    allowed = limits[0 if n == 1 else 1, j]
                    for place in range(n):
                        low, high = np.inf, -np.inf
                        for k in range(place, count, n):
                            low, high = min(low, states[k, j]), max(high, states[k, j])
                        if high - low > allowed:
                            repeats = False
                            break
                    if not repeats:
                        break
                if repeats:
                    periods[point] = n
                    break

    return least_periods


def zero_one(returns: Array, state_scales: Array) -> Array:
    """The 0-1 test for chaos on the returns (Gottwald & Melbourne 2009, SIAM J. Appl.
    Dyn. Syst. 8:129-145): near 0 for regular motion, near 1 for chaotic. NaN where
    there are fewer than LEAST_RETURNS. Shapes as of :func:`period`.

    The observable is the sum of all states in units of their standard deviation. It
    drives a point (p, q) in the plane with phases c n, for several frequencies c. The
    mean square displacement, less its oscillating part, grows with n if the motion is
    chaotic and is bounded if it is regular: K is its correlation with n, in the median
    over c.
    """
    out = np.full(len(returns), np.nan)
    frequencies = np.random.Generator(np.random.PCG64(1)).uniform(
        math.pi / 5, 4 * math.pi / 5, FREQUENCIES
    )
    phase = np.outer(np.arange(1, returns.shape[1] + 1), frequencies)
    cosine, sine = np.cos(phase), np.sin(phase)
    p, q = np.empty_like(phase), np.empty_like(phase)
    displace = _make_displacement()
    for number, states in enumerate(returns):
        states = states[np.isfinite(states[:, 0])]
        count, lags = len(states), len(states) // 10
        if count < LEAST_RETURNS:
            continue
        scatter = np.maximum(states.std(axis=0), 1e-9 * state_scales[number])
        observable = ((states - states.mean(axis=0)) / scatter).sum(axis=1)
        displacement = np.zeros((lags, FREQUENCIES))
        displace(observable, cosine, sine, p, q, displacement)
        # The mean of the observable is zero, and so is the oscillating part of the
        # displacement.
        growth = displacement - displacement.mean(axis=0)
        centred = np.arange(1, lags + 1) - 0.5 * (lags + 1)
        norm = np.sqrt(np.sum(growth * growth, axis=0) * np.sum(centred * centred))
        # summed row by row, as the sums of BLAS depend on the processor
        covariance = np.sum(centred[:, np.newaxis] * growth, axis=0)
        out[number] = np.median(
            np.divide(covariance, norm, out=np.zeros(len(norm)), where=norm > 0)
        )
    return out


@lru_cache
def _make_displacement() -> Any:
    """Mean square displacements after 1, 2, ... returns. The inner loop runs over the
    frequencies, so it is packed."""

    @driver(types.void(types.float64[::1], *[types.float64[:, ::1]] * 5))
    def displace(observable, cosine, sine, p, q, displacement):  # type: ignore[no-untyped-def]
        for c in range(FREQUENCIES):
            p[0, c], q[0, c] = observable[0] * cosine[0, c], observable[0] * sine[0, c]
        for k in range(1, len(observable)):
            for c in range(FREQUENCIES):
                p[k, c] = p[k - 1, c] + observable[k] * cosine[k, c]
                q[k, c] = q[k - 1, c] + observable[k] * sine[k, c]
        lags = len(displacement)
        count = len(observable) - lags
        for n in range(lags):
            for k in range(count):
                for c in range(FREQUENCIES):
                    dp, dq = p[k + n + 1, c] - p[k, c], q[k + n + 1, c] - q[k, c]
                    displacement[n, c] += dp * dp + dq * dq
            for c in range(FREQUENCIES):
                displacement[n, c] /= count

    return displace


def classify_motion(
    features: Mapping[str, Array],
    status: Array,
    settled: Array,
    periods: Array,
    returns: Array,
    still: Array,
    t: Motion,
) -> Array:
    """The kind of motion of runs: int8, shape of ``status``.

    ``periods`` is their :func:`period`, ``settled`` their label, ``returns`` the number
    of returns of each, ``still`` whether it is at rest; ``features`` has ``zero_one``
    and, if measured, ``lyapunov_exponent`` with its error. A run with fewer than three
    returns is undetermined.
    """
    if "lyapunov_exponent" in features:
        exponent, error = features["lyapunov_exponent"], 2.0 * features["lyapunov_error"]
        chaotic, decaying = exponent - error > t.exponent, exponent + error < 0.0
        regular = (np.abs(exponent) <= error) & (error <= t.exponent_error)
    else:
        # earlier versions computed it from fewer returns
        index = np.where(returns >= LEAST_RETURNS, features["zero_one"], np.nan)
        with np.errstate(invalid="ignore"):
            chaotic, regular = index > t.chaotic_above, index < t.regular_below
        decaying = np.zeros_like(chaotic)
    settled = settled.astype(bool)
    kind = np.select(
        [
            returns < LEAST_REPEATS,
            (periods == 1) & still,
            periods > 0,
            chaotic,
            ~settled | decaying,
            regular,
        ],
        [UNDETERMINED, EQUILIBRIUM, PERIODIC, CHAOTIC, UNSETTLED, QUASI_PERIODIC],
        default=UNDETERMINED,
    )
    return np.where(status == OK, kind, UNDETERMINED).astype(np.int8)
