"""The cycle of stick-slip on a string that is linear but for the torque on its bit, by
integration: at which set speeds it lasts.

While the bit rests it winds the string up, until the rock gives way to the greatest
torque on it; then it slips, until it comes to rest again, or does not. With the
deviations x from steady drilling::

    x' = A x + b (T(omega) - T(w))

``A`` is constant, so a step is exact but for the torque on the bit, which is taken as
linear in time over it (a first-order hold). All set speeds go together, each by its own
clock: the step in which a bit breaks away or comes to rest ends there. With friction
that is smoothed, a bit that is slower than at its greatest torque rests.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from nsdrill.data import Array

STEPS = 48  # of a torsional period
FINE = 6  # shorter is a step while the bit is slow, as the torque falls steeply there
SLOW = 0.05  # of the speed in steady drilling: up to which the bit is slow
WINDING = 12  # steps while the bit rests, where the drive moves; else one is exact
MOST_PERIODS = 3.0  # of a slip; one that is longer does not end
POINTS = 800  # of a table of the torque


class Cycles(NamedTuple):
    """The strings at set speeds [m]: ``matrix`` [m, n, n] and ``column`` [m, n] of the
    deviations, the place of the ``bit`` among them, its ``speed`` in steady drilling
    [m], the ``torques`` on it [m, k] at bit ``speeds`` [m, k] that ascend evenly in their
    logarithm, the torsional ``period`` [m] [s], and the ``stiffness`` [m] [N m/rad]; and
    how many set speeds each string has, ``lanes``."""

    matrix: Array
    column: Array
    bit: int
    speed: Array
    speeds: Array
    torques: Array
    period: Array
    stiffness: Array
    lanes: tuple[int, ...]


@np.errstate(over="ignore", invalid="ignore")  # of a drive that swings the string ever wider by itself
def lasting(cycles: Cycles, times: int, start: Array | None = None) -> tuple[Array, Array]:
    """(whether stick-slip lasts [m], the deviations at the end [m, n]): whether a bit that
    is held until it breaks away comes to rest so many ``times``; with a ``start`` [m, n], the
    deviations of a bit that comes to rest there."""
    matrix, column, bit, speed, speeds, torques, period, stiffness, of_strings = cycles
    lanes, size = np.arange(len(speed)), column.shape[1]
    peak = np.argmax(torques, axis=1)
    rest, most = speeds[lanes, peak], torques[lanes, peak]
    slowest, fastest, last = speeds[:, 0], speeds[:, -1], speeds.shape[1] - 1
    low, per_point = np.log(slowest), last / np.log(fastest / slowest)
    flat, first_of = torques.ravel(), lanes * (last + 1)

    def torque(omega: Array) -> Array:
        omega = np.where(np.isfinite(omega), omega, fastest)
        place = (np.log(np.maximum(omega, slowest)) - low) * per_point
        below = np.minimum(place.astype(np.intp), last - 1)
        at = flat[first_of + below]
        return np.asarray(at + (place - below) * (flat[first_of + below + 1] - at))

    steady = torque(speed)
    surplus = most - steady
    held = matrix.copy()
    held[:, bit] = 0.0
    coarse, fallen = period / STEPS, (most - torques.min(axis=1, initial=np.inf, where=speeds >= rest[:, None]))
    winding = 2.0 * fallen / (stiffness * speed)
    winding = np.maximum(winding, coarse) if size == 2 else np.maximum(winding / WINDING, coarse)
    lengths = np.stack([coarse, coarse / FINE, winding])
    without = np.where(np.arange(size) == bit, 0.0, column)
    systems = zip((matrix, matrix, held), (column, column, without), lengths, strict=True)
    kinds = [_step(*system, of_strings) for system in systems]
    across, first, second = (np.concatenate(parts) for parts in zip(*kinds, strict=True))

    x = np.zeros(column.shape) if start is None else start.copy()
    x[:, bit] = rest - speed
    sticks, came, over = np.ones(len(speed), dtype=bool), np.zeros(len(speed), dtype=int), np.zeros(len(speed))
    over[rest >= speed] = np.inf  # the torque does not fall: no bit sticks
    row = -matrix[:, bit] / column[:, bit, None]  # of the torque with which the bit keeps its speed
    edge = rest - speed
    while np.any(going := (came < times) & (over < MOST_PERIODS)):
        before = x[:, bit]
        kind = np.where(sticks, 2, np.where(before < edge + SLOW * speed, 1, 0))
        which = kind * len(lanes) + lanes
        now = np.where(sticks, surplus, torque(speed + before) - steady)
        known = (across[which] @ x[..., None])[..., 0] + first[which] * now[:, None]
        gain = second[which]
        ahead = known + gain * now[:, None]
        for _ in range(1):
            then = np.where(sticks, surplus, torque(speed + ahead[:, bit]) - steady)
            ahead = known + gain * then[:, None]
        lost = ~np.isfinite(ahead).all(axis=1)
        ahead = np.where(lost[:, None], x, ahead)
        after = ahead[:, bit]
        needed = (row * ahead).sum(axis=1)
        breaks = sticks & (needed > surplus)
        stops = ~sticks & (after < before) & (after < edge)
        events = (breaks | stops) & going
        over += lengths[kind, lanes] / period
        if events.any():  # the step ends there
            had = (row * x).sum(axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                part = np.where(breaks, (surplus - had) / (needed - had), (edge - before) / (after - before))
            part = np.where(events, np.clip(part, 0.0, 1.0), 1.0)
            ahead = x + part[:, None] * (ahead - x)
            ahead[events, bit] = edge[events]
            over[events] = 0.0
            came += stops & going
            sticks = (sticks | stops) & ~breaks
        over[lost] = np.inf
        x = np.where(going[:, None], ahead, x)
    return came >= times, x


def _step(matrix: Array, column: Array, step: Array, lanes: tuple[int, ...]) -> tuple[Array, Array, Array]:
    """(E, p, q) of x(t + step) = E x(t) + p u(t) + q u(t + step) with x' = A x + b u, u
    linear in time: the exponential of the matrix with two further rows."""
    m, n = column.shape
    whole = np.zeros((m, n + 2, n + 2))
    whole[:, :n, :n], whole[:, :n, n] = matrix * step[:, None, None], column * step[:, None]
    whole[:, n, n + 1] = 1.0
    found = _exponential(whole, lanes)
    later = found[:, :n, n + 1]
    return found[:, :n, :n], found[:, :n, n] - later, later


def _exponential(matrix: Array, lanes: tuple[int, ...]) -> Array:
    """The exponentials of matrices, by a Taylor series of what is small and squaring: as
    often for all ``lanes`` of a string."""
    greatest = np.abs(matrix).sum(axis=-1).max(axis=-1)
    sizes = np.maximum.reduceat(greatest, np.cumsum((0, *lanes[:-1])))
    halvings = np.repeat(np.maximum(0, np.ceil(np.log2(np.maximum(sizes, 1e-9))).astype(int) + 3), lanes)
    whole = np.empty(matrix.shape)
    for times in set(halvings.tolist()):
        those = halvings == times
        small = matrix[those] / 2.0**times
        found = term = np.broadcast_to(np.eye(matrix.shape[-1]), small.shape)
        for k in range(1, 11):
            term = term @ small / k
            found = found + term
        for _ in range(times):
            found = found @ found
        whole[those] = found
    return whole
