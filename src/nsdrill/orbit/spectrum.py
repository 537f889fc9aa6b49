"""The whole Lyapunov spectrum of a motion: the mean rates at which deviations from it
grow or shrink in all directions.

The motion is cut into intervals, over each of which the monodromy is computed. A basis of
deviations goes through one interval after the other and is made orthonormal again by a QR
factorisation; the logarithms of the diagonal of R are the growth in each direction
(Benettin et al. 1980, Meccanica 15:9-20 and 21-30). Lengths are measured in the natural
scales of the states; the exponents do not depend on that choice. The means and their
standard errors are those of the largest exponent alone
(:mod:`nsdrill.observe.exponent`): weighted by half a sine over the time of observation.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence

import numpy as np

from nsdrill.data import Array
from nsdrill.observe.exponent import WAVES, exponent_of
from nsdrill.orbit.flow import Ends, Legs
from nsdrill.records import dataclass

SPIN_UP = 0.25  # of the observation, before it: the basis turns into the directions
CONTRAST = math.log(1e6)  # of the growth of two directions in an interval, at most
LONGEST, SHORTEST = 1.0, 1e-6  # s, of an interval
AT_ONCE = 64  # intervals whose monodromies are computed in one batch
LEAST = 100  # intervals of an observation: its error is read from 8 waves of the growth
WITHIN_ERRORS = 2.0  # an exponent that lies within so many standard errors of zero may be zero
ZERO_ERROR = 0.01  # 1/s: with a greater error it may as well not be


@dataclass(frozen=True)
class Spectrum:
    """The Lyapunov exponents [1/s] of a motion, falling, with their standard errors
    ``errors``, over ``seconds`` of it in ``intervals``."""

    exponents: Array
    errors: Array
    seconds: float
    intervals: int

    @property
    def sum(self) -> float:
        """The mean rate at which volumes of states grow [1/s]."""
        return float(self.exponents.sum())

    @property
    def signs(self) -> list[str]:
        """Of each exponent whether it is ``positive``, ``zero`` or ``negative``: zero within
        two errors, which are small; ``undetermined`` where they are not."""
        near = np.abs(self.exponents) <= WITHIN_ERRORS * self.errors
        words = np.where(self.exponents > 0.0, "positive", "negative")
        words = np.where(near, np.where(self.errors <= ZERO_ERROR, "zero", "undetermined"), words)
        return [str(word) for word in words]

    @property
    def dimension(self) -> tuple[float, float]:
        """The ends of the Kaplan-Yorke dimension of the attractor, with exponents two errors
        below and above: how many directions the volumes of which do not shrink, and the
        part of the next one (Kaplan & Yorke 1979, Lect. Notes Math. 730:204-227). An
        exponent of zero is zero at both ends."""
        is_zero, spread = np.array(self.signs) == "zero", WITHIN_ERRORS * self.errors
        low, high = (np.where(is_zero, 0.0, self.exponents + sign * spread) for sign in (-1.0, 1.0))
        return _dimension(low), _dimension(high)


def _dimension(exponents: Array) -> float:
    """The Kaplan-Yorke dimension of these exponents."""
    falling = np.sort(exponents)[::-1]
    sums = np.cumsum(falling)
    whole = int(np.count_nonzero(np.logical_and.accumulate(sums >= 0.0)))
    if whole == 0 or whole == len(falling):
        return float(whole)
    return whole + float(sums[whole - 1] / -falling[whole])


class Lost(Exception):
    """A part of the motion that could not be integrated, at ``time`` [s]."""

    def __init__(self, time: float) -> None:
        super().__init__(time)
        self.time = time


def spectrum(
    state: Array,
    phase: float,
    values: Array,
    seconds: float,
    scales: Array,
    rate: float,
    moving: Sequence[int] | None = None,
    watch: Callable[[float], object] = lambda done: None,
) -> Generator[Legs, Ends, Spectrum]:
    """A task of a flow: the spectrum of the motion from ``state`` [states] at the drive
    angle ``phase`` on, over ``seconds`` after a spin-up.

    ``values`` are the continuation parameters, ``scales`` [states] the natural scales of
    the states and ``rate`` [rad/s] that of the drive angle. The indices of the states that
    move are ``moving``, by default all: a deviation of another would stay, and count as an
    exponent of zero. ``watch`` is called with the
    part that is done. Lost where the motion or a deviation cannot be integrated.
    """
    free = np.arange(len(state)) if moving is None else np.array(moving)
    spin_up, ratios = SPIN_UP * seconds, scales[free] / scales[free][:, None]
    basis, now = np.eye(len(free)), 0.0
    interval = min(LONGEST, seconds / LEAST)
    rises: list[Array] = []
    lengths: list[float] = []
    while now < spin_up + seconds * (1.0 - 1e-12):
        end = spin_up if now < spin_up else spin_up + seconds
        count = max(1, min(AT_ONCE, math.ceil((end - now) / interval - 1e-9)))
        duration = min(interval, (end - now) / count)
        states, phases = [state], phase + rate * duration * np.arange(count)
        for one in phases[:-1]:
            ends = yield Legs(states[-1][None], one, duration, values[None])
            if not ends.ok.all():
                raise Lost(now)
            states.append(ends.state[0])
        ends = yield Legs(np.array(states), phases, duration, values[None], tangent=True)
        if not (ends.ok.all() and np.isfinite(ends.monodromy).all()):
            raise Lost(now)
        kept = 0
        for monodromy in ends.monodromy:
            turned, upper = np.linalg.qr(monodromy[np.ix_(free, free)] * ratios @ basis)
            with np.errstate(divide="ignore"):
                rise = np.log(np.abs(np.diag(upper)))
            contrast = np.ptp(rise) if np.isfinite(rise).all() else math.inf
            if contrast > 2.0 * CONTRAST and interval > SHORTEST:
                interval = max(SHORTEST, min(0.5, CONTRAST / contrast) * duration)
                break
            basis, kept = turned, kept + 1
            if now >= spin_up:
                rises.append(rise)
                lengths.append(duration)
            now += duration
        if kept:
            state = ends.state[kept - 1]
            phase = phases[0] + rate * duration * kept
        watch(now / (spin_up + seconds))
    return _means(np.array(rises), np.array(lengths), seconds)


def _means(rises: Array, lengths: Array, seconds: float) -> Spectrum:
    """The spectrum of the growth ``rises`` [intervals, states] in intervals of these
    ``lengths`` [s], one after the other."""
    angle = 2.0 * math.pi * (np.cumsum(lengths) - 0.5 * lengths) / seconds
    half, hann = np.sin(0.5 * angle), 1.0 - np.cos(angle)
    waves = np.sin(np.arange(1, WAVES + 1)[:, None] * angle)
    outcome = np.concatenate([np.full((1, rises.shape[1]), half @ lengths), (half @ rises)[None], waves @ rises])
    found = exponent_of(outcome.T, seconds)
    exponents = found["lyapunov_exponent"]
    # Of few cycles the mean depends on the weights, which the waves do not show.
    errors = np.hypot(found["lyapunov_error"], exponents - (hann @ rises) / (hann @ lengths))
    order = np.argsort(-exponents, kind="stable")
    exponents = exponents[order]
    errors = np.hypot(errors[order], _turned(exponents, SPIN_UP * seconds) / seconds)
    return Spectrum(exponents, errors, seconds, len(rises))


def _turned(exponents: Array, spin_up: float) -> Array:
    """How far the basis may still turn after the spin-up [s]: a direction leaves its
    neighbour at the difference of their exponents, and its length changes by about as much."""
    left = np.exp(-np.abs(np.diff(exponents)) * spin_up)
    return np.maximum(np.append(left, 0.0), np.append(0.0, left))
