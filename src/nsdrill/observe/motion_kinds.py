"""Labels of every model: the kind of motion of a response (equilibrium, period-n,
quasi-periodic, chaotic, not settled, or undetermined), and the verdict of the checks of
a point.

The returns to the Poincare section determine a period. Without one, the largest
Lyapunov exponent distinguishes chaos from quasi-periodicity or, where it was not
measured, the 0-1 test does. The classification can be repeated on a file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from itertools import pairwise
from typing import Protocol

import numpy as np

from nsdrill.compiler.functions import BUFFER, FLOAT, INTEGER, INTEGERS, LaneFunction, compiled, inlined, packed
from nsdrill.data import Array
from nsdrill.observe.thresholds import LEAST_PEAKS, MotionThresholds
from nsdrill.variables import (
    CHAOTIC,
    CHECKS,
    EQUILIBRIUM,
    OK,
    PENDING,
    PERIODIC,
    QUASI_PERIODIC,
    UNDETERMINED,
    UNSETTLED,
)

LEAST_DIMENSION = 3  # of a flow with chaos (Poincare & Bendixson)
LEAST_REPEATS = 3  # of a period among the returns
# The greatest scatter of returns that count as the same, as a fraction of that of all
# returns, for a period of two or more.
CLUSTER_SCATTER = 0.2
# The least ratio of the spreads of the returns in the first and in the last third, the
# smaller to the larger, for a period of two or more.
LEAST_SPREAD_RATIO = 0.9
LEAST_RETURNS = 1000  # for the 0-1 test; 200 identify neither a rattling collar nor a slow decay
FREQUENCIES = 64  # of the 0-1 test
LEAST_RISE = 0.002  # of the reach of a quantity, over two thirds of its peaks, and of half_difference


def period(returns: Array, state_scales: Array, t: MotionThresholds) -> Array:
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
    periods = np.zeros(len(returns), dtype=np.int64)
    _make_period()(
        periods,
        np.ravel(returns),
        np.ravel(state_scales),
        np.empty(2 * returns.shape[2]),
        returns.shape[1],
        returns.shape[2],
        t.longest_period,
        t.absolute,
        t.relative,
    )
    return periods.astype(np.int16)


@inlined
def _spread(b, first, end, step):
    """The greatest less the least of every ``step``-th number of ``b`` from the place
    ``first`` to before ``end``."""
    low, high, k = np.inf, -np.inf, first
    while k < end:
        low, high = min(low, b[k]), max(high, b[k])
        k += step
    return high - low


@lru_cache
def _make_period() -> LaneFunction:
    """``S`` states of each of ``room`` returns."""

    @compiled(INTEGERS, *[BUFFER] * 3, *[INTEGER] * 3, FLOAT, FLOAT)
    def least_periods(periods, returns, state_scales, limits, room, S, longest, absolute, relative):
        for point in range(len(periods)):
            states, scales = returns[point * room * S :], state_scales[point * S :]
            count = 0
            while count < room and abs(states[count * S]) < np.inf:
                count += 1
            end, third = count * S, count // 3 * S
            widest, is_stationary = 0.0, True
            for j in range(S):
                spread = _spread(states, j, end, S)
                limits[j] = absolute * scales[j] + relative * spread
                if count > 0 and spread / scales[j] > widest:
                    widest = spread / scales[j]
                    first = _spread(states, j, third, S)
                    last = _spread(states, end - third + j, end, S)
                    is_stationary = min(first, last) >= LEAST_SPREAD_RATIO * max(first, last)
            for j in range(S):
                limits[S + j] = min(limits[j], CLUSTER_SCATTER * widest * scales[j])
            for n in range(1, (min(longest, count // LEAST_REPEATS) if is_stationary else 1) + 1):
                repeats = True
                for k in range(n * S):  # a state of one of n returns
                    allowed = limits[k if n == 1 else S + k % S]
                    if _spread(states, k, end, n * S) > allowed:
                        repeats = False
                        break
                if repeats:
                    periods[point] = n
                    break

    return least_periods


def keeps_rising(peaks: Array, greatest: Array, least: Array, tolerance: float) -> Array:
    """Whether the last ``peaks`` [..., n] of a quantity between ``least`` and ``greatest``
    [...] rise, and will by more than the ``tolerance`` of its reach: oldest first, NaN where
    there are fewer.

    Each third of them lies above the one before, and the last above all that was observed,
    so that it is no part of a swing that comes back. By the ratio of the two rises the rise
    ends at a limit, as of a motion that is approached, or grows on.
    """
    count, place = np.count_nonzero(np.isfinite(peaks), axis=-1), np.arange(peaks.shape[-1])
    third = count // 3
    ends = [count - n * third for n in (3, 2, 1, 0)]
    parts = [(place >= begin[..., None]) & (place < end[..., None]) for begin, end in pairwise(ends)]
    mean = [np.where(part, peaks, 0.0).sum(axis=-1) / np.maximum(third, 1) for part in parts]
    low = [np.where(part, peaks, np.inf).min(axis=-1, initial=np.inf) for part in parts]
    high = [np.where(part, peaks, -np.inf).max(axis=-1, initial=-np.inf) for part in parts]
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        first, second, reach = mean[1] - mean[0], mean[2] - mean[1], greatest - least
        to_come = np.where(second < first, second * second / (first - second), np.inf)
        return np.asarray(
            (count >= LEAST_PEAKS)
            & (low[1] > high[0])
            & (low[2] > high[1])
            & (greatest - high[2] <= 0.5 * (high[2] - high[1]))
            & (first + second > LEAST_RISE * reach)
            & (to_come > tolerance * reach)
        )


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
    frequencies = np.random.Generator(np.random.PCG64(1)).uniform(math.pi / 5, 4 * math.pi / 5, FREQUENCIES)
    phase = np.outer(np.arange(1, returns.shape[1] + 1), frequencies)
    cosine, sine = np.cos(phase), np.sin(phase)
    displace = _make_displacement()
    for number, states in enumerate(returns):
        states = states[np.isfinite(states[:, 0])]
        count, lags = len(states), len(states) // 10
        if count < LEAST_RETURNS:
            continue
        scatter = np.maximum(states.std(axis=0), 1e-9 * state_scales[number])
        observable = ((states - states.mean(axis=0)) / scatter).sum(axis=1)
        displacement = np.zeros((lags, FREQUENCIES))
        p, q = (np.cumsum(observable[:, np.newaxis] * wave[:count], axis=0) for wave in (cosine, sine))
        displace(np.ravel(p), np.ravel(q), np.ravel(displacement), lags)
        # The mean of the observable is zero, and so is the oscillating part of the
        # displacement.
        growth = displacement - displacement.mean(axis=0)
        centred = np.arange(1, lags + 1) - 0.5 * (lags + 1)
        norm = np.sqrt(np.sum(growth * growth, axis=0) * np.sum(centred * centred))
        # summed row by row, as the sums of BLAS depend on the processor
        covariance = np.sum(centred[:, np.newaxis] * growth, axis=0)
        out[number] = np.median(np.divide(covariance, norm, out=np.zeros(len(norm)), where=norm > 0))
    return out


@lru_cache
def _make_displacement() -> LaneFunction:
    """Mean square displacements after 1, 2, ... ``lags`` returns."""
    F = FREQUENCIES

    @compiled(BUFFER, BUFFER, BUFFER, INTEGER)
    def displace(p, q, displacement, lags):
        count = len(p) // F - lags
        for n in range(lags):
            for k in range(count):
                begin, end = k * F, (k + n + 1) * F
                for c in packed(F):
                    dp, dq = p[end + c] - p[begin + c], q[end + c] - q[begin + c]
                    displacement[n * F + c] += dp * dp + dq * dq
            for c in packed(F):
                displacement[n * F + c] /= float(count)

    return displace


def classify_motion(
    features: Mapping[str, Array],
    status: Array,
    settled: Array,
    grows: Array,
    periods: Array,
    returns: Array,
    still: Array,
    dimension: Array,
    t: MotionThresholds,
) -> Array:
    """The kind of motion of runs: int8, shape of ``status``.

    ``periods`` is their :func:`period`, ``settled`` their label, ``grows`` whether their peaks
    keep rising, as those of a motion that leaves an unstable one, ``returns`` the number of
    returns of each, ``still`` whether it is at rest; ``features`` has ``zero_one``
    and, if measured, ``lyapunov_exponent`` with its error. A run with fewer than three
    returns is undetermined, and a flow of a ``dimension`` below three is never chaotic.
    """
    if "lyapunov_exponent" in features:
        exponent, error = features["lyapunov_exponent"], 2.0 * features["lyapunov_error"]
        chaotic, decaying = exponent - error > t.exponent, exponent + error < 0.0
        regular = (np.abs(exponent) <= error) & (error <= t.exponent_error)
    else:
        with np.errstate(invalid="ignore"):
            chaotic, regular = features["zero_one"] > t.chaotic_above, features["zero_one"] < t.regular_below
        decaying = np.zeros_like(chaotic)
    settled, chaotic = settled.astype(bool), chaotic & ~grows & (dimension >= LEAST_DIMENSION)
    kind = np.select(
        [returns < LEAST_REPEATS, (periods == 1) & still, periods > 0, chaotic, ~settled | decaying, regular],
        [UNDETERMINED, EQUILIBRIUM, PERIODIC, CHAOTIC, UNSETTLED, QUASI_PERIODIC],
        default=UNDETERMINED,
    )
    return np.where(status == OK, kind, UNDETERMINED).astype(np.int8)


def motions(
    features: Mapping[str, Array],
    status: Array,
    settled: Array,
    grows: Array,
    returns: Array,
    state_scales: Array,
    still: Array,
    dimension: Array,
    t: MotionThresholds,
) -> dict[str, Array]:
    """The labels ``motion`` and ``period`` of runs with these ``returns`` (...,
    returns, states) to the section, NaN where there are none; ``state_scales`` (...,
    states) are the natural scales, ``still`` is true for runs at rest, ``dimension`` is
    that of the flow."""
    count = np.count_nonzero(np.isfinite(returns[..., 0]), axis=-1)
    flat = returns.reshape(-1, *returns.shape[-2:])
    ok = status == OK
    periods = np.where(ok, period(flat, state_scales.reshape(len(flat), -1), t).reshape(ok.shape), 0).astype(np.int16)
    motion = classify_motion(features, status, settled, grows, periods, count, still, dimension, t)
    return {"motion": motion, "period": np.where(motion == PERIODIC, periods, 0).astype(np.int16)}


# Whether the response of a point holds in more accurate runs: labels from the results
# of the point's checks.
# There are two checks: ``tight``, the same run with a smaller tolerance, and ``long``,
# the run continued for the same time again.


UNCHECKED, AGREES, FEATURES_DIFFER, RESPONSE_DIFFERS, CHECK_FAILED = range(5)  # verdicts


class ArraysByName(Protocol):
    """Arrays by name."""

    def __getitem__(self, name: str, /) -> Array: ...


def verdict(values: ArraysByName) -> Array:
    """The result of the checks of each point, from ``response``, the labels of
    :func:`nsdrill.models.responses.trust_labels` and the status of the checks:

    - :data:`UNCHECKED`;
    - :data:`AGREES`;
    - :data:`FEATURES_DIFFER`: the response is the same and the features are not
      (chaotic motion, or one that has not settled);
    - :data:`RESPONSE_DIFFERS`;
    - :data:`CHECK_FAILED`: a check failed, and no other gave another response.
    """
    shape = np.shape(values["trusted"])
    checked, succeeded, differs = (np.ones(shape, dtype=bool), np.ones(shape, dtype=bool), np.zeros(shape, dtype=bool))
    for check in CHECKS:
        ok = values[f"{check}_status"] == OK
        checked &= values[f"{check}_status"] != PENDING
        succeeded &= ok
        differs |= ok & (values[f"{check}_response"] != values["response"])
    return np.select(
        [~checked, values["trusted"] == 1, differs, succeeded],
        [UNCHECKED, AGREES, RESPONSE_DIFFERS, FEATURES_DIFFER],
        CHECK_FAILED,
    )
