"""The cycle of stick-slip on a string that is linear but for the torque on its bit, by
integration: at which set speeds it lasts.

While the bit rests it winds the string up, until the rock gives way to the greatest
torque on it; then it slips, until it comes to rest again, or does not. With the
deviations x from steady drilling::

    x' = A x + b (T(omega) - T(w))

``A`` is constant, so a step is exact but for the torque on the bit, which is taken as
linear in time over it (a first-order hold). All set speeds go together, each by its own
clock: the step in which a bit breaks away or comes to rest ends there.

Smoothed friction rises steeply up to a low speed and falls beyond it. Up to the speed up to
which no step can follow its rise, the bit rests; from there on the motion is integrated
through the greatest torque, as what the string is wound up further while the bit creeps past
it decides, near the end of stick-slip, on whether it comes to rest again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from nsdrill.data import Array

STEPS = 48  # of a torsional period
FINE, FINEST = 6, 48  # so many times shorter is a step while the bit is slow, as the torque falls steeply there
FOLLOWED, RISING = (
    0.3,
    0.5,
)  # of a speed: by so much it changes in a fine step at most, by the fall and rise of the torque
SLOW = 0.05  # of the speed in steady drilling: up to which the bit is slow
WINDING = 12  # steps while the bit rests, where the drive moves; else one is exact
MOST_PERIODS = 8.0  # of a slip; one that is longer does not end
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


class _Lanes(NamedTuple):
    """What a set speed goes by, an entry each [m]: where its ``table`` of torques begins, and its
    ``slowest`` bit speed, the ``low`` end and the points ``per_unit`` of its logarithm; the
    ``speed``, and the torque in ``steady`` drilling and its ``surplus`` at rest; the deviations
    at the ``edge`` of rest and up to which it is ``slow``; the ``row`` of the torque that keeps
    the speed; and of each kind of step the matrix ``across``, the columns of the torque at its
    two ends, ``first`` and ``second``, and the ``length`` in periods."""

    table: Array
    slowest: Array
    low: Array
    per_unit: Array
    speed: Array
    steady: Array
    surplus: Array
    leaves: Array
    edge: Array
    peak: Array
    slow: Array
    row: Array
    across: Array
    first: Array
    second: Array
    length: Array

    def steps(self) -> _Steps:
        """Its steps of every kind, one after the other."""
        flat = (part.reshape(-1, *part.shape[2:]) for part in (self.across, self.first, self.second, self.length))
        return _Steps(KINDS * np.arange(len(self.speed)), *flat)


class _Steps(NamedTuple):
    """Where the steps of each set speed ``begin`` [m] among those of all, and of each step
    [m KINDS] what :class:`_Lanes` has of it."""

    begin: Array
    across: Array
    first: Array
    second: Array
    length: Array


KINDS = 3  # of steps: a coarse one, a fine one, and one of a bit that rests
RESTING = 2


@np.errstate(over="ignore", invalid="ignore")  # of a drive that swings the string ever wider by itself
def lasting(
    cycles: Cycles, times: int, start: Array | None = None, watch: Callable[[Array], object] | None = None
) -> tuple[Array, Array]:
    """(whether stick-slip lasts [m], the deviations at the end [m, n]): whether a bit that
    is held until it breaks away is as slow as at its greatest torque again so many
    ``times``; with a ``start`` [m, n], the deviations of a bit that comes to rest there.
    ``watch`` is called with the deviations after each step of those that go on."""
    matrix, column, bit, speed, speeds, torques, period, stiffness, of_strings = cycles
    lanes, size = np.arange(len(speed)), column.shape[1]
    peak = np.argmax(torques, axis=1)
    of_peak, greatest = speeds[lanes, peak], torques[lanes, peak]
    slowest, fastest, last = speeds[:, 0], speeds[:, -1], speeds.shape[1] - 1
    low, per_unit = np.log(slowest), last / np.log(fastest / slowest)
    coarse, per_inertia = period / STEPS, -column[:, bit]
    slopes = per_inertia[:, None] * np.diff(torques, axis=1) / np.diff(speeds, axis=1)
    fine = coarse / np.clip(np.ceil(coarse * np.max(-slopes, axis=1, initial=0.0) / FOLLOWED), FINE, FINEST)
    rises = np.arange(last) < peak[:, None]
    rest = np.where(rises & (slopes > RISING / fine[:, None]), np.arange(1, last + 1), 0).max(axis=1)
    falls = np.max(speeds[:, 1:], axis=1, initial=0.0, where=slopes < -FOLLOWED / coarse[:, None])
    beyond = _beyond(speeds, torques, rest, stiffness / per_inertia, speed)
    # a bit that is slower rests, so that a step which ends there must not see the torque fall
    most = torques[lanes, rest]
    torques = np.where(np.arange(torques.shape[1]) < rest[:, None], most[:, None], torques)
    at, rise = torques.ravel(), np.diff(torques, axis=1, append=np.nan).ravel()

    def torque(omega: Array, of: _Lanes) -> Array:
        place = (np.log(np.maximum(omega, of.slowest)) - of.low) * of.per_unit
        below = np.minimum(place.astype(np.intp), last - 1)
        there = of.table + below
        return np.asarray(at.take(there) + (place - below) * rise.take(there))

    held = matrix.copy()
    held[:, bit] = 0.0
    fallen = greatest - torques.min(axis=1, initial=np.inf, where=speeds >= of_peak[:, None])
    winding = 2.0 * fallen / (stiffness * speed)
    winding = np.maximum(winding, coarse) if size == 2 else np.maximum(winding / WINDING, coarse)
    lengths = np.stack([coarse, fine, winding])
    without = np.where(np.arange(size) == bit, 0.0, column)
    systems = zip((matrix, matrix, held), (column, column, without), lengths, strict=True)
    kinds = [_step(*system, of_strings) for system in systems]
    across, first, second = (np.stack(parts, axis=1) for parts in zip(*kinds, strict=True))

    edge = speeds[lanes, rest] - speed
    of = _Lanes(
        table=lanes * (last + 1),
        slowest=slowest,
        low=low,
        per_unit=per_unit,
        speed=speed,
        steady=np.zeros(len(speed)),
        surplus=most,
        leaves=most,
        edge=edge,
        peak=of_peak - speed,
        slow=np.maximum(of_peak + SLOW * speed, falls) - speed,
        row=-matrix[:, bit] / column[:, bit, None],
        across=across,
        first=first,
        second=second,
        length=(lengths / period).T,
    )
    steady = torque(speed, of)
    of = of._replace(steady=steady, surplus=most - steady, leaves=most - steady + beyond)

    x = np.zeros(column.shape) if start is None else start.copy()
    x[:, bit] = edge
    sticks, came = np.ones(len(speed), dtype=bool), np.zeros(len(speed), dtype=int)
    over, slipped = np.zeros((2, len(speed)))
    over[of_peak >= speed] = np.inf  # the torque does not fall: no bit sticks
    ends, often, steps = x.copy(), came.copy(), of.steps()
    while (going := (came < times) & (over < MOST_PERIODS) & (slipped < MOST_PERIODS)).any():
        if 2 * np.count_nonzero(going) <= len(going):  # go on without those that have ended
            ends[lanes], often[lanes] = x, came
            of = _Lanes(*(part[going] for part in of))
            lanes, x, sticks, came = lanes[going], x[going], sticks[going], came[going]
            over, slipped, going, steps = over[going], slipped[going], going[going], of.steps()
        before = x[:, bit]
        which = steps.begin + np.where(sticks, RESTING, before < of.slow)
        first, second = steps.first.take(which, axis=0), steps.second.take(which, axis=0)
        now = np.where(sticks, of.surplus, torque(of.speed + before, of) - of.steady)
        known = (steps.across.take(which, axis=0) @ x[..., None])[..., 0] + first * now[:, None]
        omega = of.speed + (known + second * now[:, None])[:, bit]
        if not (known_speed := np.isfinite(omega)).all():
            omega = np.where(known_speed, omega, fastest[lanes])
        then = np.where(sticks, of.surplus, torque(omega, of) - of.steady)
        ahead = known + second * then[:, None]
        took = steps.length.take(which)
        over += took
        slipped += np.where(sticks, 0.0, took)
        lost = None if (found := np.isfinite(ahead)).all() else ~found.all(axis=1)
        if lost is not None:
            ahead[lost] = x[lost]
        after = ahead[:, bit]
        needed = (of.row * ahead).sum(axis=1)
        breaks = sticks & (needed > of.leaves)
        stops = ~sticks & (after < before) & (after < of.edge)
        events = (breaks | stops) & going
        if events.any():  # the step ends there
            had = (of.row * x).sum(axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                part = np.where(breaks, (of.leaves - had) / (needed - had), (of.edge - before) / (after - before))
            part = np.where(events, np.clip(part, 0.0, 1.0), 1.0)
            ahead = x + part[:, None] * (ahead - x)
            ahead[events, bit] = of.edge[events]
            sticks = (sticks | stops) & ~breaks
        caught = going & ~breaks & (before > of.peak) & (ahead[:, bit] <= of.peak)
        came += caught
        over[events | caught] = 0.0
        slipped[caught] = 0.0
        if size == 2:  # all that comes to rest goes on alike
            came[stops & going] = times
        if lost is not None:
            over[lost] = np.inf
        x = np.where(going[:, None], ahead, x)
        if watch is not None:
            watch(x[going])
    ends[lanes], often[lanes] = x, came
    return often >= times, ends


def _beyond(speeds: Array, torques: Array, rest: Array, winding: Array, speed: Array) -> Array:
    """By how much [N m] the torque n of the string exceeds that on a bit which leaves ``rest``, a place
    in its table [m], as it creeps ever faster: with n' = k (v - omega) and J omega' = n - T(omega),
    dn/domega = ``winding`` (v - omega) / (n - T), by implicit steps from entry to entry."""
    last = int(rest.max(initial=0))
    later = speeds[:, 1 : last + 1]
    grown = winding[:, None] * np.diff(speeds[:, : last + 1], axis=1) * np.maximum(speed[:, None] - later, 0.0)
    given = torques[:, 0].copy()
    for place in range(last):
        taken = torques[:, place + 1]
        ahead = 0.5 * (given + taken + np.sqrt((given - taken) ** 2 + 4.0 * grown[:, place]))
        given = np.where(place < rest, ahead, given)
    return np.asarray(given - torques[np.arange(len(rest)), rest])


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
