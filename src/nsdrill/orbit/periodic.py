"""Periodic orbits as fixed points of the lobe map, by multiple shooting. Steady
drilling and bounces are such fixed points.

The lobe map P_m is the flow over m folds of a revolution of the drive, followed by the
rotation back by the same angle (``models.base.Symmetry``). An orbit of period m is a
fixed point of P_m; each of its ``segments`` ends where the next one begins. Where the
equations are the same at every drive angle, a fixed point of the map over any angle is
an equilibrium in the frame of the drive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Evaluation, Problem, Task
from nsdrill.orbit.flow import DIFFERENCE_STEP, Flow, Legs
from nsdrill.orbit.frame import rotated, rotation_matrix

Array = np.ndarray[Any, np.dtype[np.float64]]
# folds of a revolution in the map of an equilibrium, where every drive angle is alike
EQUILIBRIUM_FOLDS = 8
UNSTABLE_TOLERANCE = 1e-9  # of the modulus of a multiplier on the unit circle


@dataclass(frozen=True)
class Orbit:
    """A motion that repeats: a periodic orbit, an equilibrium, a cycle or a circle.

    - ``state`` [states] at its start, at the drive angle 0;
    - ``values`` [parameters] of the continuation parameters;
    - ``period`` [s];
    - ``multipliers`` [free], the complex Floquet multipliers over one period, of which
      ``trivial`` are 1 for every such motion;
    - ``touches`` [contacts and levels, 3], as of :class:`.flow.Ends`;
    - ``monodromy`` [free, free] in natural scales;
    - ``rotation`` of a circle over one period [rad];
    - ``mesh_states`` [mesh points, states] at the starts of the segments; of a circle
      w at its points (:mod:`.circle`);
    - ``free``, the places of the free states.
    """

    state: Array
    values: Array
    period: float
    multipliers: np.ndarray[Any, np.dtype[Any]]
    touches: Array
    trivial: int = 0
    monodromy: Array | None = None
    rotation: float = math.nan
    mesh_states: Array | None = None
    free: tuple[int, ...] = ()

    @property
    def nontrivial(self) -> np.ndarray[Any, np.dtype[Any]]:
        """The multipliers that decide on stability."""
        if not self.trivial:
            return self.multipliers
        return np.delete(self.multipliers, np.argsort(np.abs(self.multipliers - 1.0))[: self.trivial])

    @property
    def unstable(self) -> int:
        """How many multipliers lie outside the unit circle."""
        return int(np.sum(np.abs(self.nontrivial) > 1.0 + UNSTABLE_TOLERANCE))


def combined_touches(touches: Array) -> Array:
    """The touches of a whole motion [contacts, 3] from those of its segments
    [segments, contacts, 3]."""
    return np.stack([touches[..., 0].min(axis=0), touches[..., 1].max(axis=0), touches[..., 2].sum(axis=0)], axis=-1)


def shooting_jacobian(blocks: Array) -> Array:
    """The Jacobian of multiple shooting, [segments n, segments n]: the derivative by
    all starts of the end of each segment less the start of the next. ``blocks``
    [segments, n, n] are the monodromies of the segments."""
    J, n = len(blocks), blocks.shape[-1]
    matrix = np.zeros((J, n, J, n))
    for j, block in enumerate(blocks):
        matrix[j, :, j] += block
        matrix[j, :, (j + 1) % J] -= np.eye(n)
    return matrix.reshape(J * n, J * n)


def monodromy_product(blocks: Array) -> Array:
    """The monodromy of a motion, [n, n], from those of its segments in order."""
    monodromy = np.eye(blocks.shape[-1])
    for block in blocks:
        monodromy = block @ monodromy
    return monodromy


@dataclass(frozen=True)
class Periodic:
    """Fixed points of P_m. The unknowns are the free states at the start of each of the
    ``segments``, over ``state_scales`` [free], then the last of ``values``, over its
    scale. The other states are those of ``fixed`` [states]."""

    flow: Flow
    lobes: int
    segments: int
    state_scales: Array
    values: Array
    fixed: Array
    tolerance_factor = 1.0

    @classmethod
    def at(cls, flow: Flow, lobes: int, values: Array, state: Array, segments: int | None = None) -> Periodic:
        """The problem near ``state`` [states] at ``values`` [parameters]."""
        free = list(flow.symmetry.free)
        return cls(
            flow, lobes, segments or max(1, lobes), flow.state_scales(values)[0][free], np.array(values), state.copy()
        )

    @property
    def folds(self) -> int:
        return self.flow.symmetry.folds or EQUILIBRIUM_FOLDS

    @property
    def angle(self) -> float:
        """The angle by which the drive advances in one period [rad]."""
        return 2.0 * math.pi * self.lobes / self.folds

    def unknowns(self, states: Array, parameter: float) -> Array:
        """``x`` from the states at the starts of the segments [segments, states] and
        the continuation parameter."""
        free = list(self.flow.symmetry.free)
        weight = math.sqrt(self.segments)
        scaled = states[:, free] / (self.state_scales * weight)
        return np.concatenate([scaled.ravel(), [parameter / self.flow.scales[-1]]])

    def states(self, x: Array) -> Array:
        """The states at the starts of the segments, shape (segments, states)."""
        free = list(self.flow.symmetry.free)
        states = np.tile(self.fixed, (self.segments, 1))
        states[:, free] = x[:-1].reshape(self.segments, -1) * (self.state_scales * math.sqrt(self.segments))
        return states

    def values_at(self, x: Array) -> Array:
        """The values of the continuation parameters, the last from ``x``."""
        return np.concatenate([self.values[:-1], [x[-1] * self.flow.scales[-1]]])

    def legs(self, x: Array, *, tangent: bool = True) -> Legs:
        """The segments at ``x``; with ``tangent`` also, without monodromies, at a
        slightly greater and a slightly smaller continuation parameter."""
        states, values = self.states(x), self.values_at(x)
        h = DIFFERENCE_STEP * self.flow.scales[-1]
        shift = np.zeros(len(values))
        shift[-1] = h
        stencil = np.stack([values, values + shift, values - shift])[: 3 if tangent else 1]
        J, k = self.segments, len(stencil)
        return Legs(
            np.tile(states, (k, 1)),
            np.tile(np.arange(J) * self.angle / J, k),
            np.full(k * J, self.angle / J),
            np.repeat(stencil, J, axis=0),
            np.arange(k * J) < J if tangent else np.zeros(J, dtype=bool),
            angular=True,
        )

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        ends = yield self.legs(x)
        if not ends.ok.all():
            return None
        flow, J, states = self.flow, self.segments, self.states(x)
        free = list(flow.symmetry.free)
        weight = math.sqrt(J)
        scale, n = self.state_scales * weight, len(free)
        end = ends.state.reshape(3, J, -1)
        end[:, -1] = rotated(flow.symmetry, end[:, -1], -self.angle)
        rotate_back = rotation_matrix(flow.symmetry, flow.states, -self.angle)
        monodromies = ends.monodromy[:J].copy()
        monodromies[-1] = rotate_back @ monodromies[-1]
        residual = (end[0] - np.roll(states, -1, axis=0))[:, free] / scale
        blocks = monodromies[:, free][:, :, free] * (scale / scale[:, None])
        jacobian = np.zeros((J * n, J * n + 1))
        jacobian[:, :-1] = shooting_jacobian(blocks)
        monodromy = monodromy_product(blocks)
        by_parameter = (end[1] - end[2])[:, free] / scale / (2.0 * DIFFERENCE_STEP)
        jacobian[:, -1] = by_parameter.ravel()
        if not np.isfinite(jacobian).all():
            return None
        values = self.values_at(x)
        period = float(ends.duration[:J].sum())
        orbit = Orbit(
            states[0],
            values,
            period,
            np.linalg.eigvals(monodromy),
            combined_touches(ends.touches[:J]),
            0,
            monodromy,
            0.0,
            states,
            tuple(free),
        )
        return Evaluation(residual.ravel(), jacobian, lambda: orbit)

    def updated(self, x: Array) -> Problem:
        return self


def lobe_starts(orbit: Orbit, flow: Flow, lobes: int) -> list[Array]:
    """The free states at the start of each of the ``lobes`` of an orbit, rotated back
    to the drive angle 0: those at which it may begin."""
    assert orbit.mesh_states is not None
    step = len(orbit.mesh_states) // lobes
    fold_angle = 2.0 * math.pi / (flow.symmetry.folds or EQUILIBRIUM_FOLDS)
    states = orbit.mesh_states[:: max(step, 1)][:lobes]
    return [rotated(flow.symmetry, state, -k * fold_angle)[list(orbit.free)] for k, state in enumerate(states)]


def segment_starts(problem: Periodic, state: Array, values: Array) -> Task[Array | None]:
    """The states at the starts of the segments of ``problem`` [segments, states] on the
    motion from ``state`` at ``values``; None where a run fails."""
    starts, J = [state], problem.segments
    angle = np.array([problem.angle / J])
    for j in range(J - 1):
        ends = yield Legs(
            starts[-1][None], j * angle, angle, np.atleast_2d(values), np.zeros(1, dtype=bool), angular=True
        )
        if not ends.ok[0]:
            return None
        starts.append(ends.state[0])
    return np.stack(starts)
