"""Curves of special points in two numbers: folds, doublings, tori and Hopf points,
folds of cycles, and grazing.

To the equations of a motion comes one more: the bordered system of a multiplier of 1 or
-1 (Govaerts 2000, Numerical Methods for Bifurcations of Dynamical Equilibria, chapter
4), the logarithm of the modulus of a pair of multipliers, or the least or greatest
value of a contact's function over the period. Its derivatives are central differences,
of monodromies where it needs them; those by the start of a segment need that segment
alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Reading, Steps
from nsdrill.orbit.cycle import Cycle, rates
from nsdrill.orbit.flow import Flow, Legs
from nsdrill.orbit.frame import turn_matrix, turned
from nsdrill.orbit.periodic import ANGLES, Orbit, over_segments, product, ring

Array = np.ndarray[Any, np.dtype[np.float64]]
STEP = 1e-4  # of differences, in natural scales
SLACK = 30.0  # of Newton's method: differences of monodromies make noise
GRAZE = 1e-3  # of a contact's function: its natural scale
PAIR = 1e-6  # of a multiplier's imaginary part: those with less are none of a pair


@dataclass(frozen=True)
class Condition:
    """What holds along a curve: a multiplier is ``multiplier`` (1 or -1); or a ``pair``
    of multipliers has the modulus 1; or of the contact at the place ``contact`` the
    least (``which`` 0) or greatest (1) value of its function vanishes."""

    multiplier: float = 0.0
    pair: bool = False
    contact: int = -1
    which: int = 0

    @property
    def of_monodromy(self) -> bool:
        return self.contact < 0


@dataclass(frozen=True)
class Curve:
    """Points of periodic orbits over ``lobes`` at which the condition holds. The
    unknowns are those of the orbit and two numbers over their scales, of which the last
    runs along the curve. ``left`` and ``right`` [free] border the monodromy."""

    flow: Flow
    lobes: int
    segments: int
    size: Array
    fixed: Array
    condition: Condition
    left: Array
    right: Array
    slack = SLACK

    @classmethod
    def at(cls, flow: Flow, lobes: int, orbit: Orbit, values: Array, condition: Condition) -> Curve:
        """The problem near a special orbit, at ``values`` of both numbers."""
        assert orbit.pieces is not None
        size = flow.state_scales(values)[0][list(orbit.free)]
        made = cls(
            flow,
            lobes,
            len(orbit.pieces),
            size,
            orbit.state.copy(),
            condition,
            np.zeros(len(size)),
            np.zeros(len(size)),
        )
        return made._with_borders(orbit)

    def _with_borders(self, orbit: Orbit) -> Curve:
        if not self.condition.multiplier or orbit.monodromy is None:
            return self
        shifted = orbit.monodromy - self.condition.multiplier * np.eye(len(orbit.monodromy))
        u, _, v = np.linalg.svd(shifted)
        return replace(self, left=u[:, -1], right=v[-1])

    @property
    def angle(self) -> float:
        return 2.0 * math.pi * self.lobes / (self.flow.symmetry.folds or ANGLES)

    def unknowns(self, states: Array, values: Array) -> Array:
        """``x`` from the states at the starts of the segments and both numbers."""
        scaled = states[:, list(self.flow.symmetry.free)] / (self.size * math.sqrt(self.segments))
        return np.concatenate([scaled.ravel(), values / self.flow.scales])

    def states(self, x: Array) -> Array:
        """The states at the starts of the segments, shape (segments, states)."""
        made = np.tile(self.fixed, (self.segments, 1))
        scaled = x[:-2].reshape(self.segments, -1) * (self.size * math.sqrt(self.segments))
        made[:, list(self.flow.symmetry.free)] = scaled
        return made

    def read(self, x: Array) -> Steps[Reading | None]:
        flow, J = self.flow, self.segments
        free = list(flow.symmetry.free)
        n, share = len(free), math.sqrt(J)
        scale = self.size * share
        states, values = self.states(x), x[-2:] * flow.scales
        step = STEP / share
        # All of it; then each segment with each of its states moved to both sides; then
        # all with each number moved.
        moved = [states]
        for place in range(n):
            for sign in (1.0, -1.0):
                other = states.copy()
                other[:, free[place]] += sign * step * scale[place]
                moved.append(other)
        at = [values] * (2 * n + 1)
        for number in range(2):
            for sign in (1.0, -1.0):
                shifted = values.copy()
                shifted[number] += sign * STEP * flow.scales[number]
                moved.append(states)
                at.append(shifted)
        numbers = np.repeat(np.stack(at), J, axis=0)
        phases = np.tile(np.arange(J) * self.angle / J, len(moved))
        tangent = np.arange(len(numbers)) < (len(numbers) if self.condition.of_monodromy else J)
        ends = yield Legs(
            np.concatenate(moved),
            phases,
            np.full(len(numbers), self.angle / J),
            numbers,
            tangent,
            angular=True,
        )
        if not ends.ok.all():
            return None
        end = ends.state.reshape(len(moved), J, -1).copy()
        end[:, -1] = turned(flow.symmetry, end[:, -1], -self.angle)
        back = turn_matrix(flow.symmetry, flow.states, -self.angle)
        blocks = ends.monodromy.reshape(len(moved), J, flow.states, flow.states).copy()
        blocks[:, -1] = back @ blocks[:, -1]
        blocks = blocks[:, :, free][:, :, :, free] * (scale / scale[:, None])
        touches = ends.touches.reshape(len(moved), J, *ends.touches.shape[1:])
        residual = np.zeros(J * n + 1)
        jacobian = np.zeros((J * n + 1, J * n + 2))
        residual[:-1] = ((end[0] - np.roll(states, -1, axis=0))[:, free] / scale).ravel()
        residual[-1] = self._value(blocks[0], touches[0])
        jacobian[:-1, : J * n] = ring(blocks[0])
        for j in range(J):
            for place in range(n):
                sides = []
                for side in (1 + 2 * place, 2 + 2 * place):
                    own, contact = blocks[0].copy(), touches[0].copy()
                    own[j], contact[j] = blocks[side, j], touches[side, j]
                    sides.append(self._value(own, contact))
                jacobian[-1, j * n + place] = (sides[0] - sides[1]) / (2.0 * step)
        for number in range(2):
            up, down = 2 * n + 1 + 2 * number, 2 * n + 2 + 2 * number
            jacobian[:-1, J * n + number] = (
                (end[up] - end[down])[:, free] / scale / (2.0 * STEP)
            ).ravel()
            rise = self._value(blocks[up], touches[up]) - self._value(blocks[down], touches[down])
            jacobian[-1, J * n + number] = rise / (2.0 * STEP)
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        whole = product(blocks[0])
        period = float(ends.duration[:J].sum())
        orbit = Orbit(
            states[0],
            values,
            period,
            np.linalg.eigvals(whole),
            over_segments(touches[0]),
            0,
            whole,
            0.0,
            states,
            tuple(free),
        )
        return Reading(residual, jacobian, lambda: orbit)

    def _value(self, blocks: Array, touches: Array) -> float:
        """What vanishes along the curve, from the monodromies of the segments, or from
        their touches."""
        if not self.condition.of_monodromy:
            values = touches[:, self.condition.contact, self.condition.which]
            return float(values.max() if self.condition.which else values.min()) / GRAZE
        whole = product(blocks)
        if self.condition.pair:
            return _growth(whole)
        return _bordered(
            whole - self.condition.multiplier * np.eye(len(whole)), self.left, self.right
        )

    def moved(self, x: Array) -> Curve:
        return self


def _growth(whole: Array) -> float:
    """The logarithm of the modulus of the pair of multipliers that is nearest to the
    unit circle."""
    multipliers = np.linalg.eigvals(whole)
    pairs = np.log(np.abs(multipliers[multipliers.imag > PAIR]))
    return float(pairs[np.argmin(np.abs(pairs))]) if len(pairs) else math.nan


def _bordered(matrix: Array, left: Array, right: Array) -> float:
    """What vanishes where ``matrix`` [n, n] is singular, smoothly: the last of the
    solution of the matrix with these borders."""
    n = len(matrix)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n], system[:n, n], system[n, :n] = matrix, left, right
    try:
        return float(np.linalg.solve(system, np.eye(n + 1)[n])[n])
    except np.linalg.LinAlgError:
        return math.nan


@dataclass(frozen=True)
class CycleFolds:
    """Folds of limit cycles. The unknowns are those of the cycle, with its period, and
    two numbers over their scales. At a fold the monodromy less one, bordered by the
    flow and by the normal of the phase condition, is singular; ``left`` and ``right``
    [free + 1] border that."""

    cycle: Cycle
    left: Array
    right: Array
    slack = SLACK

    @property
    def flow(self) -> Flow:
        return self.cycle.flow

    @classmethod
    def at(cls, flow: Flow, orbit: Orbit, values: Array) -> CycleFolds:
        """The problem near the cycle ``orbit`` at a fold, at ``values`` of both
        numbers."""
        assert orbit.pieces is not None
        assert orbit.monodromy is not None
        cycle = Cycle.at(flow, orbit.period, values, orbit.state, len(orbit.pieces))
        blank = np.zeros(len(orbit.free) + 1)
        made = cls(cycle, blank, blank)
        u, _, v = np.linalg.svd(made._matrix(orbit.monodromy, orbit.state, values))
        return replace(made, left=u[:, -1], right=v[-1])

    def _matrix(self, whole: Array, state: Array, values: Array) -> Array:
        cycle, n = self.cycle, len(whole)
        made = np.zeros((n + 1, n + 1))
        made[:n, :n] = whole - np.eye(n)
        made[:n, n] = (
            rates(cycle.flow, state[None], values)[0][list(cycle.flow.symmetry.free)]
            / cycle.size
            * cycle.time
        )
        made[n, :n] = cycle.across
        return made

    def unknowns(self, states: Array, period: float, values: Array) -> Array:
        """``x`` from the states at the starts of the segments, the period [s] and both
        numbers."""
        x = self.cycle.unknowns(states, period, 0.0)
        return np.concatenate([x[:-1], values / self.flow.scales])

    def read(self, x: Array) -> Steps[Reading | None]:
        cycle, flow, J = self.cycle, self.flow, self.cycle.segments
        free = list(flow.symmetry.free)
        n, share = len(free), math.sqrt(J)
        scale, step = cycle.size * share, STEP / share
        states = cycle.states(x[:-1])
        # All of it; then each segment with each of its states moved to both sides; then
        # all with the period and the numbers moved.
        moved, tail = [states], [x[-3:]] * (2 * n + 1)
        for place in range(n):
            for sign in (1.0, -1.0):
                other = states.copy()
                other[:, free[place]] += sign * step * scale[place]
                moved.append(other)
        for place in range(3):
            for sign in (1.0, -1.0):
                moved.append(states)
                tail.append(x[-3:] + sign * STEP * np.eye(3)[place])
        periods = np.array([one[0] for one in tail]) * cycle.time
        values = np.stack([one[1:] for one in tail]) * flow.scales
        if not np.all(periods > 0.0):
            return None
        every, k = np.repeat(values, J, axis=0), len(moved)
        durations = np.repeat(periods / J, J)
        ends = yield Legs(
            np.concatenate(moved), np.zeros(k * J), durations, every, np.ones(k * J, dtype=bool)
        )
        if not ends.ok.all():
            return None
        angles = -flow.phase_rate(every) * durations
        end = turned(flow.symmetry, ends.state, angles).reshape(k, J, -1)[:, :, free]
        columns = turned(flow.symmetry, np.swapaxes(ends.monodromy, 1, 2), angles[:, None])
        blocks = np.swapaxes(columns, 1, 2)[:, free][:, :, free] * (scale / scale[:, None])
        blocks = blocks.reshape(k, J, n, n)

        def fold(own: Array, case: int) -> float:
            matrix = self._matrix(product(own), moved[case][0], values[case])
            return _bordered(matrix, self.left, self.right)

        residual, jacobian = np.zeros(J * n + 2), np.zeros((J * n + 2, J * n + 3))
        residual[: J * n] = ((end[0] - np.roll(states, -1, axis=0)[:, free]) / scale).ravel()
        residual[J * n] = cycle.across @ (states[0][free] / cycle.size - cycle.reference)
        residual[-1] = fold(blocks[0], 0)
        jacobian[: J * n, : J * n] = ring(blocks[0])
        jacobian[J * n, :n] = cycle.across * share
        for j in range(J):
            for place in range(n):
                sides = []
                for case in (1 + 2 * place, 2 + 2 * place):
                    own = blocks[0].copy()
                    own[j] = blocks[case, j]
                    sides.append(fold(own, case if j == 0 else 0))
                jacobian[-1, j * n + place] = (sides[0] - sides[1]) / (2.0 * step)
        for place in range(3):
            up, down = 2 * n + 1 + 2 * place, 2 * n + 2 + 2 * place
            jacobian[: J * n, J * n + place] = ((end[up] - end[down]) / scale).ravel() / (
                2.0 * STEP
            )
            jacobian[-1, J * n + place] = (fold(blocks[up], up) - fold(blocks[down], down)) / (
                2.0 * STEP
            )
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        whole = product(blocks[0])
        orbit = Orbit(
            states[0],
            values[0],
            float(periods[0]),
            np.linalg.eigvals(whole),
            over_segments(ends.touches[:J]),
            1,
            whole,
            math.nan,
            states,
            tuple(free),
        )
        return Reading(residual, jacobian, lambda: orbit)

    def moved(self, x: Array) -> CycleFolds:
        values = x[-2:] * self.flow.scales
        return replace(self, cycle=self.cycle.through(self.cycle.states(x[:-1])[0], values))
