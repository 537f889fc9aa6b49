"""What kind of motion a response is: equilibrium, period-n, quasi-periodic, chaotic, or not settled.

The returns to the Poincare section tell a period; where there is none, the largest Lyapunov exponent tells chaos from
quasi-periodicity, or, where it was not measured, the 0-1 test. Plain numpy, rerunnable on a file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.observe.thresholds import Motion
from nsdrill.variables import CHAOTIC, EQUILIBRIUM, OK, PERIODIC, QUASI_PERIODIC, UNDETERMINED, UNSETTLED

Array = np.ndarray[Any, np.dtype[Any]]
REPEATS = 3  # so often must a period be seen
STANDS_OUT = 0.2  # scatter of what is the same, in parts of that of all returns, below which a longer period is one
LEAST_RETURNS = 100  # for the 0-1 test
FREQUENCIES = 60  # of the 0-1 test


def in_the_bit_frame(section: Mapping[str, Array]) -> Array:
    """States at the section as an observer on the bit sees them: shape (..., returns, 8), in the order of the states.

    A motion that repeats after some revolutions does so in this frame, whatever the lobes and the drive angle.
    """
    r, angle = section["section_radius"], section["section_whirl_angle"]
    outward, around = section["section_radial_velocity"], r * section["section_whirl_speed"]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack(
        [r * c, outward * c - around * s, r * s, outward * s + around * c, section["section_axial"],
         section["section_axial_velocity"], section["section_twist"], section["section_bit_speed"]], axis=-1)


def period(returns: Array, sizes: Array, t: Motion) -> Array:
    """The least number of returns after which all of them repeat, 0 where none is found: int [points].

    ``returns`` has shape (points, returns, 8), oldest first and NaN where there are none, ``sizes`` (points, 8) is the
    natural size of each state. Two returns are the same where every state differs by less than ``absolute`` times its
    size plus ``relative`` times its range over all returns. A period of two or more must stand out besides: a
    motion that spirals towards its goal comes near some of its returns again and again.
    """
    points, count, _ = returns.shape
    found = np.zeros(points, dtype=np.int16)
    seen = np.count_nonzero(np.isfinite(returns[:, :, 0]), axis=1)
    high, low = _largest(returns, 1), -_largest(-returns, 1)
    allowed = t.absolute * sizes + t.relative * (high - low)
    for n in range(1, min(t.longest_period, count // REPEATS) + 1):
        open_ = np.flatnonzero((found == 0) & (seen >= REPEATS * n))
        if not len(open_):
            continue
        padded = np.full((len(open_), -(-count // n) * n, 8), np.nan)
        padded[:, :count] = returns[open_]
        cycles = padded.reshape(len(open_), -1, n, 8)
        spread = _largest(cycles, 1) + _largest(-cycles, 1)
        # A place in the cycle that lies in the part without returns has none: it says nothing.
        if n > 1:
            limit = np.minimum(allowed, STANDS_OUT * np.max((high - low) / sizes, axis=1, keepdims=True) * sizes)
        else:
            limit = allowed
        same = np.all((spread <= limit[open_, None, :]) | ~np.isfinite(spread), axis=(1, 2))
        found[open_[same]] = n
    return found


def _largest(values: Array, axis: int) -> Array:
    """The greatest along an axis, NaN left out, -inf where there is nothing else."""
    return np.where(np.isfinite(values), values, -np.inf).max(axis=axis)


def zero_one(returns: Array, sizes: Array) -> Array:
    """The 0-1 test for chaos on the returns (Gottwald & Melbourne 2009, SIAM J. Appl. Dyn. Syst. 8:129-145): near 0 for
    regular motion, near 1 for chaotic. NaN where there are fewer than LEAST_RETURNS. Shapes as of :func:`period`.

    The observable is the sum of all states in units of their scatter. It drives p and q in the plane by c n for some
    frequencies c; the mean square displacement, less its oscillating part, grows with n if the motion is chaotic and is
    bounded if it is regular: K is its correlation with n, in the median over c.
    """
    out = np.full(len(returns), np.nan)
    frequencies = np.random.Generator(np.random.PCG64(1)).uniform(math.pi / 5, 4 * math.pi / 5, FREQUENCIES)
    for number, states in enumerate(returns):
        states = states[np.isfinite(states[:, 0])]
        if len(states) < LEAST_RETURNS:
            continue
        scatter = states.std(axis=0)
        observable = ((states - states.mean(axis=0)) / np.maximum(scatter, 1e-9 * sizes[number])).sum(axis=1)
        out[number] = _growth(observable, frequencies)
    return out


def _growth(observable: Array, frequencies: Array) -> float:
    count = len(observable)
    cut = count // 10
    phase = np.outer(frequencies, np.arange(1, count + 1))
    p = np.cumsum(observable * np.cos(phase), axis=1)
    q = np.cumsum(observable * np.sin(phase), axis=1)
    steps = np.arange(1, cut + 1)
    displacement = np.empty((len(frequencies), cut))
    for n in steps:
        dp, dq = p[:, n : count - cut + n] - p[:, : count - cut], q[:, n : count - cut + n] - q[:, : count - cut]
        displacement[:, n - 1] = np.mean(dp * dp + dq * dq, axis=1)
    mean = observable.mean()
    oscillation = mean * mean * (1 - np.cos(np.outer(frequencies, steps))) / (1 - np.cos(frequencies))[:, None]
    grown = displacement - oscillation
    grown -= grown.mean(axis=1, keepdims=True)
    even = steps - steps.mean()
    size = np.sqrt(np.sum(grown * grown, axis=1) * np.sum(even * even))
    return float(np.median(np.divide(grown @ even, size, out=np.zeros(len(size)), where=size > 0)))


def classify_motion(
    features: Mapping[str, Array], status: Array, settled: Array, found: Array, sizes: Array, t: Motion
) -> Array:
    """The kind of motion of runs: int8, shape of ``status``.

    ``found`` is their :func:`period`, ``settled`` their label, ``sizes`` (..., 8) the natural sizes of the states;
    ``features`` holds the extremes, ``section_radius``, ``zero_one``, and, if measured, ``lyapunov_exponent`` with its
    error. No motion and no period without three returns: undetermined.
    """
    still = (
        (features["axial_max"] - features["axial_min"] <= t.absolute * sizes[..., 4])
        & (features["bit_speed_max"] - features["bit_speed_min"] <= t.absolute * sizes[..., 7])
        & (features["radius_max"] - -_largest(-features["section_radius"], -1) <= t.absolute * sizes[..., 0])
    )
    enough = np.count_nonzero(np.isfinite(features["section_radius"]), axis=-1) >= REPEATS
    if "lyapunov_exponent" in features:
        exponent, error = features["lyapunov_exponent"], 2.0 * features["lyapunov_error"]
        chaotic, decaying = exponent - error > t.exponent, exponent + error < -t.exponent
        regular = np.isfinite(exponent) & ~decaying
    else:
        index = features["zero_one"]
        with np.errstate(invalid="ignore"):
            chaotic, regular = index > t.chaotic_above, index < t.regular_below
    settled = settled.astype(bool)
    kind = np.select(
        [~enough, (found == 1) & still, found > 0, chaotic, ~settled, regular],
        [UNDETERMINED, EQUILIBRIUM, PERIODIC, CHAOTIC, UNSETTLED, QUASI_PERIODIC],
        default=UNSETTLED if "lyapunov_exponent" in features else UNDETERMINED,
    )
    return np.where(status == OK, kind, UNDETERMINED).astype(np.int8)
