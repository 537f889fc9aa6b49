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

import numpy as np

from nsdrill.orbit.cycle import Cycle
from nsdrill.orbit.lockstep import Task
from nsdrill.orbit.newton import Evaluation
from nsdrill.orbit.periodic import Periodic
from nsdrill.orbit.shooting import Array, Orbit, monodromy_product, shooting_jacobian

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
    """Motions at which the condition holds. The unknowns are those of the problem
    ``motion`` with two parameters, over their scales, in place of one; the last is the
    continuation parameter. ``left`` and ``right`` border the matrix that is singular
    where a multiplier has the value of the condition."""

    motion: Periodic | Cycle
    condition: Condition
    left: Array
    right: Array
    tolerance_factor = TOLERANCE_FACTOR

    @classmethod
    def at(cls, motion: Periodic | Cycle, orbit: Orbit, values: Array, condition: Condition) -> Curve:
        """The problem near an ``orbit``, of the problem ``motion``, at a special point,
        at ``values`` of both parameters."""
        left = right = np.zeros(0)
        if condition.multiplier and orbit.monodromy is not None:
            matrix = motion.critical_matrix(condition.multiplier, orbit.monodromy, orbit.state, values)
            u, _, v = np.linalg.svd(matrix)
            left, right = u[:, -1], v[-1]
        return cls(motion, condition, left, right)

    def unknowns(self, orbit: Orbit, values: Array) -> Array:
        """``x`` of an ``orbit`` at ``values`` of both parameters."""
        period = [orbit.period / self.motion.time_scale] if isinstance(self.motion, Cycle) else []
        return self.motion.packed(orbit.mesh_states, *period, *(values / self.motion.flow.scales))

    def _cases(self, x: Array) -> tuple[Array, Array]:
        """The states [cases, segments, states] and the further unknowns [cases, further]
        of the motion itself; then, for each free state, with that state of all segments
        displaced to both sides; then with each further unknown displaced."""
        motion = self.motion
        states, numbers = motion.states(x), x[motion.segments * len(motion.free) :]
        displaced = len(motion.free) + len(numbers)
        all_states, all_numbers = np.stack([states] * (1 + 2 * displaced)), np.tile(numbers, (1 + 2 * displaced, 1))
        steps = DIFFERENCE_STEP / math.sqrt(motion.segments) * motion.scale
        for case in range(displaced):
            for place, sign in ((1 + 2 * case, 1.0), (2 + 2 * case, -1.0)):
                if case < len(steps):
                    all_states[place, :, motion.free[case]] += sign * steps[case]
                else:
                    all_numbers[place, case - len(steps)] += sign * DIFFERENCE_STEP
        return all_states, all_numbers

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        motion, J, n = self.motion, self.motion.segments, len(self.motion.free)
        step, (all_states, all_numbers) = DIFFERENCE_STEP / math.sqrt(J), self._cases(x)
        by_number = slice(1 + 2 * n, None)
        values = all_numbers[:, -2:] * motion.flow.scales
        periods = all_numbers[:, 0] * getattr(motion, "time_scale", math.nan)
        if np.any(periods <= 0.0):
            return None
        tangent = self.condition.of_monodromy | (np.arange(len(values)) == 0)
        ends = yield motion.legs(all_states, values, periods, tangent)
        if not ends.ok.all():
            return None
        end, monodromies = motion.shots(ends, values, periods)
        blocks = monodromies * motion.ratios
        touches = ends.touches.reshape(len(values), J, *ends.touches.shape[1:])

        def test_with(case: int, segment: int) -> float:
            """The test function of the motion with one ``segment`` of another case."""
            mixed_blocks, mixed_touches = blocks[0].copy(), touches[0].copy()
            mixed_blocks[segment], mixed_touches[segment] = blocks[case, segment], touches[case, segment]
            return self._test(mixed_blocks, mixed_touches, all_states[case if segment == 0 else 0, 0], values[0])

        tests = np.array([self._test(*one) for one in zip(blocks, touches, all_states[:, 0], values, strict=True)])
        tests_with = np.array([[test_with(case, j) for case in range(1, 1 + 2 * n)] for j in range(J)])
        phase_error, phase_row = motion.phase_condition(all_states[0])
        residual = np.concatenate([motion.misses(end[0], all_states[0]), phase_error, tests[:1]])
        jacobian = np.zeros((len(residual), len(x)))
        jacobian[: J * n, : J * n] = shooting_jacobian(blocks[0])
        jacobian[J * n : -1, :n] = phase_row
        jacobian[-1, : J * n] = _differences(tests_with.ravel(), step)
        jacobian[: J * n, J * n :] = _differences(end[by_number][..., motion.free] / motion.scale, DIFFERENCE_STEP)
        jacobian[-1, J * n :] = _differences(tests[by_number], DIFFERENCE_STEP)
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        period = float(periods[0]) if isinstance(motion, Cycle) else float(ends.duration[:J].sum())
        found = all_states[0], values[0], period, blocks[0], touches[0]
        return Evaluation(residual, jacobian, lambda: motion.orbit(*found))

    def _test(self, blocks: Array, touches: Array, state: Array, values: Array) -> float:
        """The function that vanishes along the curve, from the monodromies of the
        segments or from their touches."""
        if not self.condition.of_monodromy:
            extremes = touches[:, self.condition.contact, self.condition.which]
            return float(extremes.max() if self.condition.which else extremes.min()) / CONTACT_SCALE
        monodromy = monodromy_product(blocks)
        if self.condition.pair:
            return _log_modulus(monodromy)
        matrix = self.motion.critical_matrix(self.condition.multiplier, monodromy, state, values)
        return _bordered_test(matrix, self.left, self.right)

    def updated(self, x: Array) -> Curve:
        values = x[-2:] * self.motion.flow.scales
        return replace(self, motion=self.motion.with_phase_condition(self.motion.states(x)[0], values))


def _differences(values: Array, step: float) -> Array:
    """The derivatives [any, m] from ``values`` [2 m, ...] at steps to both sides."""
    return ((values[0::2] - values[1::2]) / (2.0 * step)).reshape(len(values) // 2, -1).T


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
