"""Motions that repeat, by multiple shooting: what periodic orbits, cycles and circles
have in common.

The unknowns of a motion are its free states at the starts of its segments, in natural
scales, then a few numbers, of which the last is the continuation parameter. Each
segment ends where the next one begins.
"""

from __future__ import annotations

import math
from typing import ClassVar, Self

import numpy as np

from nsdrill.data import Array
from nsdrill.models.base import Symmetry
from nsdrill.orbit.flow import Ends, Flow
from nsdrill.records import dataclass

# folds of a revolution in the map of an equilibrium, where every drive angle is alike
EQUILIBRIUM_FOLDS = 8
UNSTABLE_TOLERANCE = 1e-9  # of the modulus of a multiplier on the unit circle
TRIVIAL_TOLERANCE = 0.1  # of a trivial multiplier, which is 1, beside others that are known


def map_angle(flow: Flow, lobes: int = 1) -> float:
    """The angle by which the drive advances over so many folds of a revolution [rad]."""
    return 2.0 * math.pi * lobes / (flow.symmetry.folds or EQUILIBRIUM_FOLDS)


@dataclass(frozen=True)
class Orbit:
    """A motion that repeats: a periodic orbit, an equilibrium, a cycle or a circle.

    - ``state`` [states] at its start, at the drive angle 0;
    - ``values`` [parameters] of the continuation parameters;
    - ``period`` [s];
    - ``multipliers`` [free], the complex Floquet multipliers over one period, of which
      ``trivial`` are 1 for every such motion;
    - ``touches`` [contacts and levels, 3], as of :class:`.flow.Ends`;
    - ``monodromy`` [free, free] in natural scales; None for a circle;
    - ``rotation`` of a circle over one period [rad];
    - ``mesh_states`` [mesh points, states] at the starts of the segments; of a circle
      w at its points (:mod:`.circle`);
    - ``free``, the places of the free states.
    """

    state: Array
    values: Array
    period: float
    multipliers: Array
    touches: Array
    trivial: int
    monodromy: Array | None
    rotation: float
    mesh_states: Array
    free: tuple[int, ...]

    @property
    def nontrivial(self) -> Array:
        """The multipliers that decide on stability."""
        if not self.trivial:
            return self.multipliers
        return np.delete(self.multipliers, np.argsort(np.abs(self.multipliers - 1.0))[: self.trivial])

    @property
    def resolved(self) -> bool:
        """Whether the multipliers are known: the errors of one that is very large are those
        of all, and are seen in the trivial ones."""
        off = np.sort(np.abs(self.multipliers - 1.0))[: self.trivial]
        return bool(np.all(off < TRIVIAL_TOLERANCE))

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
class Shooting:
    """A problem whose unknowns are the free states at the start of each of the
    ``segments``, over ``state_scales`` [free], then further numbers, the last of them
    the last of ``values`` over its scale. The other states are those of ``fixed``
    [states]."""

    flow: Flow
    segments: int
    state_scales: Array
    values: Array
    fixed: Array
    tolerance_factor: ClassVar[float] = 1.0
    trivial: ClassVar[int] = 0
    rotation: ClassVar[float] = math.nan

    @property
    def free(self) -> list[int]:
        return list(self.flow.symmetry.free)

    @property
    def scale(self) -> Array:
        """The scales of the unknowns of a segment [free], such that distances do not
        depend on the number of segments."""
        return self.state_scales * math.sqrt(self.segments)

    @property
    def ratios(self) -> Array:
        """The factors that bring a monodromy into the scales of the unknowns."""
        return self.scale / self.scale[:, None]

    def packed(self, states: Array, *numbers: float) -> Array:
        """``x`` from the states at the starts of the segments [segments, states] and
        the further numbers in their scales."""
        return np.concatenate([(states[:, self.free] / self.scale).ravel(), numbers])

    def states(self, x: Array) -> Array:
        """The states at the starts of the segments, shape (segments, states)."""
        states = np.tile(self.fixed, (self.segments, 1))
        states[:, self.free] = x[: self.segments * len(self.free)].reshape(self.segments, -1) * self.scale
        return states

    def values_at(self, x: Array) -> Array:
        """The values of the continuation parameters, the last from ``x``."""
        return np.concatenate([self.values[:-1], [x[-1] * self.flow.scales[-1]]])

    def values_around(self, x: Array, step: float) -> Array:
        """Those values, and with a parameter that is greater and one that is smaller by
        ``step`` natural scales: [3, parameters]."""
        shift = np.zeros(len(self.values))
        shift[-1] = step * self.flow.scales[-1]
        return self.values_at(x) + np.outer([0.0, 1.0, -1.0], shift)

    def rotated_back(self, ends: Ends, angles: Array) -> tuple[Array, Array]:
        """The states at ``ends`` [cases segments] that are rotated back by ``angles``,
        [cases, segments, states], and the monodromies of the free states,
        [cases, segments, free, free], in SI."""
        symmetry, states = self.flow.symmetry, self.flow.states
        end = rotated(symmetry, ends.state, -angles)
        blocks = (rotation_matrices(symmetry, states, -angles) @ ends.monodromy)[:, self.free][:, :, self.free]
        return end.reshape(-1, self.segments, states), blocks.reshape(-1, self.segments, *blocks.shape[1:])

    def misses(self, end: Array, states: Array) -> Array:
        """By how much the segments miss the next ones [segments free]: their ends and
        starts are both [segments, states]."""
        return ((end - np.roll(states, -1, axis=0))[:, self.free] / self.scale).ravel()

    def orbit(self, states: Array, values: Array, period: float, blocks: Array, touches: Array) -> Orbit:
        """The solution, from the ``states`` at the starts of the segments, and the
        monodromies and ``touches`` of these."""
        monodromy, combined = monodromy_product(blocks), combined_touches(touches)
        multipliers, free = np.linalg.eigvals(monodromy), self.flow.symmetry.free
        return Orbit(
            states[0], values, period, multipliers, combined, self.trivial, monodromy, self.rotation, states, free
        )

    def with_phase_condition(self, state: Array, values: Array) -> Self:
        """The same problem with its phase condition, if any, at ``state`` [states]."""
        return self

    def updated(self, x: Array) -> Self:
        return self.with_phase_condition(self.states(x)[0], self.values_at(x))


# The rotating frame of the drive, in which motions repeat.


def rotated(symmetry: Symmetry, state: Array, angle: float | Array) -> Array:
    """States (..., states) rotated by ``angle`` [rad], a number or an array over all
    but the last dimension."""
    rotated_state = np.array(state, dtype=float)
    cosine, sine = np.cos(angle), np.sin(angle)
    for x, y in symmetry.turned:
        rotated_state[..., x] = cosine * state[..., x] - sine * state[..., y]
        rotated_state[..., y] = sine * state[..., x] + cosine * state[..., y]
    return rotated_state


def rotation_matrices(symmetry: Symmetry, states: int, angles: Array) -> Array:
    """The matrices [n, states, states] of :func:`rotated` for ``angles`` [n]."""
    return np.swapaxes(rotated(symmetry, np.tile(np.eye(states), (len(angles), 1, 1)), angles[:, None]), 1, 2)


def rotation_derivative(symmetry: Symmetry, state: Array) -> Array:
    """The derivative of :func:`rotated` by the angle, at the angle 0."""
    derivative = np.zeros_like(state)
    for x, y in symmetry.turned:
        derivative[..., x], derivative[..., y] = -state[..., y], state[..., x]
    return derivative
