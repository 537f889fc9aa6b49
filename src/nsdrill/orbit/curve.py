"""Curves of special points in two parameters: folds, period doublings, torus and Hopf
bifurcations, folds of cycles, and grazing.

The equations of the motion are extended by one that vanishes along the curve:

- for a multiplier of 1 or -1, the test function of the bordered monodromy (Govaerts
  2000, Numerical Methods for Bifurcations of Dynamical Equilibria, chapter 4);
- for a complex pair, the logarithm of its modulus;
- for grazing, the least or greatest value of a contact's function over the period.

Its derivatives are central differences, of monodromies where it depends on them. A
derivative by the start of a segment needs only that segment.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Evaluation, Task
from nsdrill.orbit.cycle import Cycle, corotating_rates
from nsdrill.orbit.flow import Flow, Legs
from nsdrill.orbit.frame import rotated, rotation_matrix
from nsdrill.orbit.periodic import EQUILIBRIUM_FOLDS, Orbit, combined_touches, monodromy_product, shooting_jacobian

Array = np.ndarray[Any, np.dtype[np.float64]]
DIFFERENCE_STEP = 1e-4  # of central differences, in natural scales
TOLERANCE_FACTOR = 30.0  # of Newton's method, for the noise in differences of monodromies
CONTACT_SCALE = 1e-3  # the natural scale of a contact's function
MIN_IMAGINARY = 1e-6  # of the imaginary part of a multiplier of a complex pair


@dataclass(frozen=True)
class Condition:
    """The condition along a curve, one of three: a multiplier is ``multiplier`` (1 or
    -1); a complex ``pair`` of multipliers has the modulus 1; or the least (``which`` 0)
    or greatest (1) value of the function of the contact at the place ``contact``
    vanishes."""

    multiplier: float = 0.0
    pair: bool = False
    contact: int = -1
    which: int = 0

    @property
    def of_monodromy(self) -> bool:
        """Whether the condition is one on the multipliers."""
        return self.contact < 0


@dataclass(frozen=True)
class Curve:
    """Periodic orbits over ``lobes`` at which the condition holds. The unknowns are
    the free states at the starts of the ``segments``, over ``state_scales`` [free], and
    two parameters, over their scales; the last is the continuation parameter. The other
    states are those of ``fixed`` [states]. ``left`` and ``right`` [free] border the
    monodromy."""

    flow: Flow
    lobes: int
    segments: int
    state_scales: Array
    fixed: Array
    condition: Condition
    left: Array
    right: Array
    tolerance_factor = TOLERANCE_FACTOR

    @classmethod
    def at(cls, flow: Flow, lobes: int, orbit: Orbit, values: Array, condition: Condition) -> Curve:
        """The problem near an orbit at a special point, at ``values`` of both
        parameters."""
        assert orbit.mesh_states is not None
        state_scales = flow.state_scales(values)[0][list(orbit.free)]
        problem = cls(
            flow,
            lobes,
            len(orbit.mesh_states),
            state_scales,
            orbit.state.copy(),
            condition,
            np.zeros(len(state_scales)),
            np.zeros(len(state_scales)),
        )
        return problem._with_borders(orbit)

    def _with_borders(self, orbit: Orbit) -> Curve:
        if not self.condition.multiplier or orbit.monodromy is None:
            return self
        shifted = orbit.monodromy - self.condition.multiplier * np.eye(len(orbit.monodromy))
        u, _, v = np.linalg.svd(shifted)
        return replace(self, left=u[:, -1], right=v[-1])

    @property
    def angle(self) -> float:
        """The angle by which the drive advances in one period [rad]."""
        return 2.0 * math.pi * self.lobes / (self.flow.symmetry.folds or EQUILIBRIUM_FOLDS)

    def unknowns(self, states: Array, values: Array) -> Array:
        """``x`` from the states at the starts of the segments [segments, states] and
        both parameters."""
        scaled = states[:, list(self.flow.symmetry.free)] / (self.state_scales * math.sqrt(self.segments))
        return np.concatenate([scaled.ravel(), values / self.flow.scales])

    def states(self, x: Array) -> Array:
        """The states at the starts of the segments, shape (segments, states)."""
        states = np.tile(self.fixed, (self.segments, 1))
        scaled = x[:-2].reshape(self.segments, -1) * (self.state_scales * math.sqrt(self.segments))
        states[:, list(self.flow.symmetry.free)] = scaled
        return states

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        flow, J = self.flow, self.segments
        free = list(flow.symmetry.free)
        n, weight = len(free), math.sqrt(J)
        scale = self.state_scales * weight
        states, values = self.states(x), x[-2:] * flow.scales
        step = DIFFERENCE_STEP / weight
        # The orbit itself; then, for each free state, all segments with that state
        # displaced to both sides; then the orbit with each parameter displaced.
        variants = [states]
        for index in range(n):
            for sign in (1.0, -1.0):
                variant = states.copy()
                variant[:, free[index]] += sign * step * scale[index]
                variants.append(variant)
        variant_values = [values] * (2 * n + 1)
        for parameter in range(2):
            for sign in (1.0, -1.0):
                shifted = values.copy()
                shifted[parameter] += sign * DIFFERENCE_STEP * flow.scales[parameter]
                variants.append(states)
                variant_values.append(shifted)
        all_values = np.repeat(np.stack(variant_values), J, axis=0)
        phases = np.tile(np.arange(J) * self.angle / J, len(variants))
        tangent = np.arange(len(all_values)) < (len(all_values) if self.condition.of_monodromy else J)
        ends = yield Legs(
            np.concatenate(variants),
            phases,
            np.full(len(all_values), self.angle / J),
            all_values,
            tangent,
            angular=True,
        )
        if not ends.ok.all():
            return None
        end = ends.state.reshape(len(variants), J, -1).copy()
        end[:, -1] = rotated(flow.symmetry, end[:, -1], -self.angle)
        rotate_back = rotation_matrix(flow.symmetry, flow.states, -self.angle)
        blocks = ends.monodromy.reshape(len(variants), J, flow.states, flow.states).copy()
        blocks[:, -1] = rotate_back @ blocks[:, -1]
        blocks = blocks[:, :, free][:, :, :, free] * (scale / scale[:, None])
        touches = ends.touches.reshape(len(variants), J, *ends.touches.shape[1:])
        residual = np.zeros(J * n + 1)
        jacobian = np.zeros((J * n + 1, J * n + 2))
        residual[:-1] = ((end[0] - np.roll(states, -1, axis=0))[:, free] / scale).ravel()
        residual[-1] = self._test_value(blocks[0], touches[0])
        jacobian[:-1, : J * n] = shooting_jacobian(blocks[0])
        for j in range(J):
            for index in range(n):
                sides = []
                for side in (1 + 2 * index, 2 + 2 * index):
                    varied_blocks, varied_touches = blocks[0].copy(), touches[0].copy()
                    varied_blocks[j], varied_touches[j] = blocks[side, j], touches[side, j]
                    sides.append(self._test_value(varied_blocks, varied_touches))
                jacobian[-1, j * n + index] = (sides[0] - sides[1]) / (2.0 * step)
        for parameter in range(2):
            up, down = 2 * n + 1 + 2 * parameter, 2 * n + 2 + 2 * parameter
            jacobian[:-1, J * n + parameter] = (
                (end[up] - end[down])[:, free] / scale / (2.0 * DIFFERENCE_STEP)
            ).ravel()
            difference = self._test_value(blocks[up], touches[up]) - self._test_value(blocks[down], touches[down])
            jacobian[-1, J * n + parameter] = difference / (2.0 * DIFFERENCE_STEP)
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        monodromy = monodromy_product(blocks[0])
        period = float(ends.duration[:J].sum())
        orbit = Orbit(
            states[0],
            values,
            period,
            np.linalg.eigvals(monodromy),
            combined_touches(touches[0]),
            0,
            monodromy,
            0.0,
            states,
            tuple(free),
        )
        return Evaluation(residual, jacobian, lambda: orbit)

    def _test_value(self, blocks: Array, touches: Array) -> float:
        """The function that vanishes along the curve, from the monodromies of the
        segments or from their touches."""
        if not self.condition.of_monodromy:
            values = touches[:, self.condition.contact, self.condition.which]
            return float(values.max() if self.condition.which else values.min()) / CONTACT_SCALE
        monodromy = monodromy_product(blocks)
        if self.condition.pair:
            return _log_modulus(monodromy)
        return _bordered_test(monodromy - self.condition.multiplier * np.eye(len(monodromy)), self.left, self.right)

    def updated(self, x: Array) -> Curve:
        return self


def _log_modulus(monodromy: Array) -> float:
    """The logarithm of the modulus of the complex pair of multipliers that is nearest
    to the unit circle; NaN where there is none."""
    multipliers = np.linalg.eigvals(monodromy)
    logarithms = np.log(np.abs(multipliers[multipliers.imag > MIN_IMAGINARY]))
    return float(logarithms[np.argmin(np.abs(logarithms))]) if len(logarithms) else math.nan


def _bordered_test(matrix: Array, left: Array, right: Array) -> float:
    """A smooth function that vanishes where ``matrix`` [n, n] is singular: the last
    component of the solution of the bordered system, whose right-hand side is the last
    unit vector. NaN where that system is singular."""
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
    two parameters, over their scales. At a fold the monodromy less the identity,
    bordered by the flow and by the normal of the phase condition, is singular; ``left``
    and ``right`` [free + 1] border that matrix."""

    cycle: Cycle
    left: Array
    right: Array
    tolerance_factor = TOLERANCE_FACTOR

    @property
    def flow(self) -> Flow:
        return self.cycle.flow

    @classmethod
    def at(cls, flow: Flow, orbit: Orbit, values: Array) -> CycleFolds:
        """The problem near the cycle ``orbit`` at a fold, at ``values`` of both
        parameters."""
        assert orbit.mesh_states is not None
        assert orbit.monodromy is not None
        cycle = Cycle.at(flow, orbit.period, values, orbit.state, len(orbit.mesh_states))
        zeros = np.zeros(len(orbit.free) + 1)
        problem = cls(cycle, zeros, zeros)
        u, _, v = np.linalg.svd(problem._matrix(orbit.monodromy, orbit.state, values))
        return replace(problem, left=u[:, -1], right=v[-1])

    def _matrix(self, monodromy: Array, state: Array, values: Array) -> Array:
        """The bordered monodromy less the identity [free + 1, free + 1]."""
        cycle, n = self.cycle, len(monodromy)
        matrix = np.zeros((n + 1, n + 1))
        matrix[:n, :n] = monodromy - np.eye(n)
        matrix[:n, n] = (
            corotating_rates(cycle.flow, state[None], values)[0][list(cycle.flow.symmetry.free)]
            / cycle.state_scales
            * cycle.time_scale
        )
        matrix[n, :n] = cycle.normal
        return matrix

    def unknowns(self, states: Array, period: float, values: Array) -> Array:
        """``x`` from the states at the starts of the segments [segments, states], the
        period [s] and both parameters."""
        x = self.cycle.unknowns(states, period, 0.0)
        return np.concatenate([x[:-1], values / self.flow.scales])

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        cycle, flow, J = self.cycle, self.flow, self.cycle.segments
        free = list(flow.symmetry.free)
        n, weight = len(free), math.sqrt(J)
        scale, step = cycle.state_scales * weight, DIFFERENCE_STEP / weight
        states = cycle.states(x[:-1])
        # The cycle itself; then, for each free state, all segments with that state
        # displaced to both sides; then the cycle with the period and each parameter
        # displaced.
        variants, tails = [states], [x[-3:]] * (2 * n + 1)
        for index in range(n):
            for sign in (1.0, -1.0):
                variant = states.copy()
                variant[:, free[index]] += sign * step * scale[index]
                variants.append(variant)
        for index in range(3):
            for sign in (1.0, -1.0):
                variants.append(states)
                tails.append(x[-3:] + sign * DIFFERENCE_STEP * np.eye(3)[index])
        periods = np.array([entry[0] for entry in tails]) * cycle.time_scale
        values = np.stack([entry[1:] for entry in tails]) * flow.scales
        if not np.all(periods > 0.0):
            return None
        all_values, count = np.repeat(values, J, axis=0), len(variants)
        durations = np.repeat(periods / J, J)
        ends = yield Legs(
            np.concatenate(variants), np.zeros(count * J), durations, all_values, np.ones(count * J, dtype=bool)
        )
        if not ends.ok.all():
            return None
        angles = -flow.phase_rate(all_values) * durations
        end = rotated(flow.symmetry, ends.state, angles).reshape(count, J, -1)[:, :, free]
        transposed = rotated(flow.symmetry, np.swapaxes(ends.monodromy, 1, 2), angles[:, None])
        blocks = np.swapaxes(transposed, 1, 2)[:, free][:, :, free] * (scale / scale[:, None])
        blocks = blocks.reshape(count, J, n, n)

        def test_value(varied_blocks: Array, case: int) -> float:
            matrix = self._matrix(monodromy_product(varied_blocks), variants[case][0], values[case])
            return _bordered_test(matrix, self.left, self.right)

        residual, jacobian = np.zeros(J * n + 2), np.zeros((J * n + 2, J * n + 3))
        residual[: J * n] = ((end[0] - np.roll(states, -1, axis=0)[:, free]) / scale).ravel()
        residual[J * n] = cycle.normal @ (states[0][free] / cycle.state_scales - cycle.reference)
        residual[-1] = test_value(blocks[0], 0)
        jacobian[: J * n, : J * n] = shooting_jacobian(blocks[0])
        jacobian[J * n, :n] = cycle.normal * weight
        for j in range(J):
            for index in range(n):
                sides = []
                for case in (1 + 2 * index, 2 + 2 * index):
                    varied_blocks = blocks[0].copy()
                    varied_blocks[j] = blocks[case, j]
                    sides.append(test_value(varied_blocks, case if j == 0 else 0))
                jacobian[-1, j * n + index] = (sides[0] - sides[1]) / (2.0 * step)
        for index in range(3):
            up, down = 2 * n + 1 + 2 * index, 2 * n + 2 + 2 * index
            jacobian[: J * n, J * n + index] = ((end[up] - end[down]) / scale).ravel() / (2.0 * DIFFERENCE_STEP)
            jacobian[-1, J * n + index] = (test_value(blocks[up], up) - test_value(blocks[down], down)) / (
                2.0 * DIFFERENCE_STEP
            )
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        monodromy = monodromy_product(blocks[0])
        orbit = Orbit(
            states[0],
            values[0],
            float(periods[0]),
            np.linalg.eigvals(monodromy),
            combined_touches(ends.touches[:J]),
            1,
            monodromy,
            math.nan,
            states,
            tuple(free),
        )
        return Evaluation(residual, jacobian, lambda: orbit)

    def updated(self, x: Array) -> CycleFolds:
        values = x[-2:] * self.flow.scales
        return replace(self, cycle=self.cycle.with_phase_condition(self.cycle.states(x[:-1])[0], values))
