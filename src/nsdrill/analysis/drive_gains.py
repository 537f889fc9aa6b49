"""The gains of a speed controller from a log of its own speed and torque.

A drive with proportional gain K_p and integral gain K_i that is to turn at the set speed
gives the torque

    T = c - K_p (w - w_set) - K_i integral of (w - w_set) dt

with a constant c in each stretch, the torque of the integral at its beginning. This is
linear in the numbers, and over stretches in which the string swings they follow by least
squares. With torque measured in the string below a machine of inertia J, a third
regressor counts: T_string = T - J w'.

What a log has more of than the law, noise and delay, would make errors of neighbouring
samples alike; their standard deviations are those of blocks of a few seconds that are
left out in turn (jackknife), and do not assume otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.records import dataclass

LEAST_ROWS = 30  # of a stretch
BLOCKS = 20  # that are left out in turn
LEAST_SHARE = 0.5  # of the variance of the torque, that the law must explain
DETERMINED = 0.25  # the greatest error of a gain, over the gain, that is determined
LEAST_SWING = 1e-3  # of the set speed: a top that swings less says nothing of its gains


class Stretch(NamedTuple):
    """Samples of a stretch of a log at one set speed [rad/s]: times [s], the speed of the
    top [rad/s] and the torque [N m], arrays [rows]; ``set_speed`` may be an array
    too."""

    time: Array
    speed: Array
    torque: Array
    set_speed: float | Array


@dataclass(frozen=True)
class DriveGains:
    """``damping`` K_p [N m s/rad] and ``stiffness`` K_i [N m/rad] with their standard
    ``errors`` (in this order, then that of the inertia), the ``inertia`` [kg m^2] of the
    machine where it was a regressor, else None; the ``share`` of the variance of the
    torque that the law explains, the ``rows`` that were used, and ``doubts``, in words,
    why the numbers should not be used."""

    damping: float
    stiffness: float
    inertia: float | None
    errors: tuple[float, ...]
    share: float
    rows: int
    doubts: tuple[str, ...]

    @property
    def sure(self) -> bool:
        """Whether nothing speaks against the gains."""
        return not self.doubts

    def study(self) -> str:
        """The section of a study with these gains, YAML."""
        inertia = "" if self.inertia is None else f", inertia: {self.inertia:.4g} kg*m^2"
        return (
            f"drive: {{kind: pi, damping: {self.damping:.4g} N*m*s/rad, stiffness: {self.stiffness:.4g} N*m/rad"
            f"{inertia}}}"
        )

    def sentences(self) -> list[str]:
        """What was found, in words."""
        gains = [("K_p", self.damping, "N m s/rad"), ("K_i", self.stiffness, "N m/rad")]
        if self.inertia is not None:
            gains.append(("inertia", self.inertia, "kg m^2"))
        told = [
            f"{name} {value:.4g} +- {error:.2g} {unit}"
            for (name, value, unit), error in zip(gains, self.errors, strict=True)
        ]
        found = f"Gains of the drive from {self.rows} rows: {', '.join(told)}; the law explains "
        found += f"{100 * self.share:.0f} % of the variance of the torque."
        return [found, *(f"Do not use them: {doubt}." for doubt in self.doubts)]


def gains_of_drive(stretches: Sequence[Stretch], *, inertia: bool = False) -> DriveGains:
    """The gains from stretches of a log. ``inertia``: the torque is that in the string, so
    the inertia of the machine is found as well.

    ValueError where no stretch has :data:`LEAST_ROWS` rows of numbers.
    """
    parts = [part for one in stretches if (part := _regressors(one, inertia)) is not None]
    if not parts:
        raise ValueError(f"found no stretch with {LEAST_ROWS} rows of numbers; allowed: at least one")
    rows = np.concatenate([part[0] for part in parts])
    torque = np.concatenate([part[1] for part in parts])
    swing = max(part[2] for part in parts)
    normal, size = _blocks(rows, torque)
    numbers = _solved(normal.sum(axis=0))
    # each block left out in turn
    others = np.array([_solved(normal.sum(axis=0) - block) for block in normal])
    count = len(normal)
    errors = np.sqrt((count - 1) / count * np.sum((others - others.mean(axis=0)) ** 2, axis=0))
    left = torque - rows @ numbers
    share = 1.0 - float(left @ left) / max(float(torque @ torque), 1e-300)
    damping, stiffness = float(-numbers[0]), float(-numbers[1])
    found = tuple(float(-number) for number in numbers[2:])
    doubts = _doubts(damping, stiffness, tuple(errors.tolist()), share, swing)
    return DriveGains(
        damping, stiffness, found[0] if found else None, tuple(errors.tolist()), share, size, tuple(doubts)
    )


def _regressors(stretch: Stretch, inertia: bool) -> tuple[Array, Array, float] | None:
    """(regressors [rows, 2 or 3], torque [rows], swing of the speed over the set speed)
    of a stretch, less their means; None where it is too short."""
    time, speed, torque = (np.asarray(values, dtype=float) for values in stretch[:3])
    target = np.broadcast_to(np.asarray(stretch.set_speed, dtype=float), time.shape)
    known = np.isfinite(time) & np.isfinite(speed) & np.isfinite(torque) & np.isfinite(target)
    time, speed, torque, target = time[known], speed[known], torque[known], target[known]
    if len(time) < LEAST_ROWS:
        return None
    error = speed - target
    steps = np.diff(time)
    lag = np.concatenate([[0.0], np.cumsum(0.5 * (error[1:] + error[:-1]) * steps)])
    columns = [error, lag]
    if inertia:
        columns.append(np.gradient(speed, time))
    # the constant of the stretch, and with it an offset of the set speed, which adds a ramp
    trend = np.stack([np.ones_like(time), time - time[0]], axis=1)
    rows = np.stack(columns, axis=1)
    rows = rows - trend @ np.linalg.lstsq(trend, rows, rcond=None)[0]
    torque = torque - trend @ np.linalg.lstsq(trend, torque, rcond=None)[0]
    return rows, torque, float(np.std(rows[:, 0]) / max(float(np.abs(target).max()), 1e-9))


def _blocks(rows: Array, torque: Array) -> tuple[Array, int]:
    """The normal equations of each block, shape (blocks, n, n + 1), and the number of
    rows."""
    whole = np.concatenate([rows, torque[:, None]], axis=1)
    return np.array([part[:, :-1].T @ part for part in np.array_split(whole, BLOCKS)]), len(whole)


def _solved(normal: Array) -> Array:
    matrix, right = normal[:, :-1], normal[:, -1]
    size = np.sqrt(np.maximum(np.diag(matrix), 1e-300))  # the regressors differ in unit
    return np.linalg.lstsq(matrix / np.outer(size, size), right / size, rcond=1e-12)[0] / size


def _doubts(damping: float, stiffness: float, errors: tuple[float, ...], share: float, swing: float) -> list[str]:
    doubts = []
    if swing < LEAST_SWING:
        doubts.append(
            f"the top swings by {100 * swing:.2g} % of the set speed only, as under a very stiff drive, and its gains "
            "do not show; take stretches with stick-slip"
        )
    if share < LEAST_SHARE:
        doubts.append(
            "the torque does not follow from the speed of the top: it may be of another place, delayed, limited or "
            "smoothed, or the drive damps by another law"
        )
    for name, value, error in (("K_p", damping, errors[0]), ("K_i", stiffness, errors[1])):
        if value < 0.0:
            doubts.append(f"{name} is negative: the torque is of the other sign, or the law is another one")
        elif error > DETERMINED * abs(value) or math.isnan(error):
            doubts.append(f"{name} is not determined: its error is {100 * error / max(abs(value), 1e-300):.0f} % of it")
    return doubts
