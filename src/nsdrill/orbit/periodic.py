"""Periodic orbits as fixed points of the lobe map. Steady drilling and bounces are such
fixed points.

The lobe map P_m is the flow over m folds of a revolution of the drive, followed by the
rotation back by the same angle (``models.base.Symmetry``). An orbit of period m is a
fixed point of P_m. Where the equations are the same at every drive angle, a fixed point
of the map over any angle is an equilibrium in the frame of the drive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nsdrill.orbit.flow import DIFFERENCE_STEP, Ends, Flow, Legs
from nsdrill.orbit.frame import rotated
from nsdrill.orbit.lockstep import Task
from nsdrill.orbit.newton import Evaluation
from nsdrill.orbit.shooting import Array, Orbit, Shooting, map_angle, shooting_jacobian


@dataclass(frozen=True)
class Periodic(Shooting):
    """Fixed points of P_m, m being ``lobes``. The only further unknown is the
    continuation parameter."""

    lobes: int
    rotation = 0.0

    @classmethod
    def at(cls, flow: Flow, lobes: int, values: Array, state: Array, segments: int | None = None) -> Periodic:
        """The problem near ``state`` [states] at ``values`` [parameters]."""
        scales = flow.state_scales(values)[0][list(flow.symmetry.free)]
        return cls(flow, segments or max(1, lobes), scales, np.array(values), state.copy(), lobes)

    @property
    def angle(self) -> float:
        """The angle by which the drive advances in one period [rad]."""
        return map_angle(self.flow, self.lobes)

    def unknowns(self, states: Array, parameter: float) -> Array:
        """``x`` from the states at the starts of the segments [segments, states] and
        the continuation parameter."""
        return self.packed(states, parameter / self.flow.scales[-1])

    def legs(self, states: Array, values: Array, periods: Array, tangent: Sequence[bool] | Array) -> Legs:
        """The segments of several cases: ``states`` [cases, segments, states], ``values``
        [cases, parameters], and whether their monodromies are computed, ``tangent``
        [cases]. The period is that of the drive."""
        J, cases = self.segments, len(values)
        phases = np.tile(np.arange(J) * self.angle / J, cases)
        all_values, all_tangent = np.repeat(values, J, axis=0), np.repeat(tangent, J)
        return Legs(states.reshape(cases * J, -1), phases, self.angle / J, all_values, all_tangent, 1.0, True)

    def shots(self, ends: Ends, values: Array, periods: Array) -> tuple[Array, Array]:
        """The ends and monodromies of :meth:`legs`, in the frame of the drive at its
        angle 0, as of :meth:`.Shooting.rotated_back`."""
        last = np.arange(self.segments) == self.segments - 1
        return self.rotated_back(ends, np.tile(np.where(last, self.angle, 0.0), len(values)))

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        J, states, values = self.segments, self.states(x), self.values_around(x, DIFFERENCE_STEP)
        nothing = np.zeros(0)
        ends = yield self.legs(np.stack([states] * 3), values, nothing, (True, False, False))
        if not ends.ok.all():
            return None
        end, monodromies = self.shots(ends, values, nothing)
        blocks = monodromies[0] * self.ratios
        by_parameter = (end[1] - end[2])[:, self.free] / self.scale / (2.0 * DIFFERENCE_STEP)
        jacobian = np.column_stack([shooting_jacobian(blocks), by_parameter.ravel()])
        if not np.isfinite(jacobian).all():
            return None
        found = states, values[0], float(ends.duration[:J].sum()), blocks, ends.touches[:J]
        return Evaluation(self.misses(end[0], states), jacobian, lambda: self.orbit(*found))

    def phase_condition(self, states: Array) -> tuple[Array, Array]:
        """The residual and the derivative by the first segment of the phase condition:
        there is none."""
        return np.zeros(0), np.zeros((0, len(self.free)))

    def critical_matrix(self, multiplier: float, monodromy: Array, state: Array, values: Array) -> Array:
        """The matrix that is singular where a motion through ``state`` has this
        multiplier."""
        return monodromy - multiplier * np.eye(len(monodromy))


def lobe_starts(orbit: Orbit, flow: Flow, lobes: int) -> list[Array]:
    """The free states at the start of each of the ``lobes`` of an orbit, rotated back
    to the drive angle 0: those at which it may begin."""
    states = orbit.mesh_states[:: max(len(orbit.mesh_states) // lobes, 1)][:lobes]
    angle = map_angle(flow)
    return [rotated(flow.symmetry, state, -k * angle)[list(orbit.free)] for k, state in enumerate(states)]


def segment_starts(problem: Periodic, state: Array, values: Array) -> Task[Array | None]:
    """The states at the starts of the segments of ``problem`` [segments, states] on the
    motion from ``state`` at ``values``; None where a run fails."""
    starts, angle = [state], problem.angle / problem.segments
    for j in range(problem.segments - 1):
        ends = yield Legs(starts[-1][None], j * angle, angle, values, angular=True)
        if not ends.ok[0]:
            return None
        starts.append(ends.state[0])
    return np.stack(starts)
