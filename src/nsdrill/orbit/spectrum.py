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
from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np

from nsdrill.data import Array
from nsdrill.observe.exponent import WAVES, exponent_of
from nsdrill.orbit.flow import Ends, Legs

SPIN_UP = 0.25  # of the observation, before it: the basis turns into the directions
CONTRAST = math.log(1e6)  # of the growth of two directions in an interval, at most
LONGEST, SHORTEST = 1.0, 1e-6  # s, of an interval
AT_ONCE = 64  # intervals whose monodromies are computed in one batch
LEAST = 100  # intervals of an observation: its error is read from 8 waves of the growth
WITHIN_ERRORS = 2.0  # an exponent that lies within so many standard errors of zero is none


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
    def zero(self) -> int:
        """How many exponents do not differ from zero by their errors."""
        return int(np.count_nonzero(self._is_zero))

    @property
    def positive(self) -> int:
        """How many exponents are positive beyond their errors."""
        return int(np.count_nonzero((self.exponents > 0.0) & ~self._is_zero))

    @property
    def dimension(self) -> float:
        """The Kaplan-Yorke dimension of the attractor: how many directions the volumes
        of which do not shrink, and the part of the next one (Kaplan & Yorke 1979,
        Lect. Notes Math. 730:204-227). An
        exponent that does not differ from zero counts as zero."""
        exponents = np.sort(np.where(self._is_zero, 0.0, self.exponents))[::-1]
        sums = np.cumsum(exponents)
        whole = int(np.count_nonzero(np.logical_and.accumulate(sums >= 0.0)))
        if whole == 0 or whole == len(exponents):
            return float(whole)
        return whole + float(sums[whole - 1] / -exponents[whole])

    @property
    def _is_zero(self) -> Array:
        near: Array = np.abs(self.exponents) <= WITHIN_ERRORS * self.errors
        return near


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
    watch: Callable[[float], object] = lambda done: None,
) -> Generator[Legs, Ends, Spectrum]:
    """A task of a flow: the spectrum of the motion from ``state`` [states] at the drive
    angle ``phase`` on, over ``seconds`` after a spin-up.

    ``values`` are the continuation parameters, ``scales`` [states] the natural scales of
    the states and ``rate`` [rad/s] that of the drive angle. ``watch`` is called with the
    part that is done. Lost where the motion or a deviation cannot be integrated.
    """
    n, spin_up = len(state), SPIN_UP * seconds
    basis, now = np.eye(n), 0.0
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
            turned, upper = np.linalg.qr(monodromy * (scales / scales[:, None]) @ basis)
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
    half = np.sin(0.5 * angle)
    waves = np.sin(np.arange(1, WAVES + 1)[:, None] * angle)
    outcome = np.concatenate([np.full((1, rises.shape[1]), half @ lengths), (half @ rises)[None], waves @ rises])
    found = exponent_of(outcome.T, seconds)
    exponents, errors = found["lyapunov_exponent"], found["lyapunov_error"]
    order = np.argsort(-exponents, kind="stable")
    return Spectrum(exponents[order], errors[order], seconds, len(rises))
