"""Periodic orbits as zeros: of the lobe map, in which steady drilling is a fixed point
and bounces are too.

P_m is the flow over m folds of a revolution of the drive, turned back by as much
(``models.base.Symmetry``). An orbit of period m is a fixed point of P_m, found by
multiple shooting: ``segments`` pieces that end where the next begins. Where every angle
is alike, a fixed point of the map over any angle is an equilibrium in the frame of the
drive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Problem, Reading, Steps
from nsdrill.orbit.flow import DEFAULT_DIFFERENCE, Flow, Legs
from nsdrill.orbit.frame import turn_matrix, turned

Array = np.ndarray[Any, np.dtype[np.float64]]
ANGLES = 8  # folds of a revolution over which an equilibrium is mapped, where every angle is alike


@dataclass(frozen=True)
class Orbit:
    """What is known of a periodic motion: the ``state`` at its start, at the drive
    angle 0; the ``values`` of what is continued; the ``period`` [s]; its
    ``multipliers``, complex, of all free states over one period, ``trivial`` of them
    the number of those that are 1 for every such motion; ``touches`` [contacts, 3]
    (:class:`.flow.Ends`); ``monodromy`` of the ``free`` states in natural scales; the
    ``rotation`` number [rad] of a circle over one period; ``pieces`` [pieces, states]:
    the states at the starts of the segments, or at the points of a circle."""

    state: Array
    values: Array
    period: float
    multipliers: np.ndarray[Any, np.dtype[Any]]
    touches: Array
    trivial: int = 0
    monodromy: Array | None = None
    rotation: float = math.nan
    pieces: Array | None = None
    free: tuple[int, ...] = ()

    @property
    def start(self) -> Array:
        """The free states at the start."""
        return self.state[list(self.free)]

    @property
    def own(self) -> np.ndarray[Any, np.dtype[Any]]:
        """The multipliers that tell of stability."""
        if not self.trivial:
            return self.multipliers
        return np.delete(
            self.multipliers, np.argsort(np.abs(self.multipliers - 1.0))[: self.trivial]
        )

    @property
    def unstable(self) -> int:
        """How many multipliers lie outside the unit circle."""
        return int(np.sum(np.abs(self.own) > 1.0 + 1e-9))


def over_segments(touches: Array) -> Array:
    """Touches of a whole motion from those of its segments, [segments, contacts, 3]."""
    return np.stack(
        [touches[..., 0].min(axis=0), touches[..., 1].max(axis=0), touches[..., 2].sum(axis=0)],
        axis=-1,
    )


def ring(blocks: Array) -> Array:
    """The derivative of the ends of segments, less the starts of those that follow, by
    all starts: of ``blocks`` [segments, n, n], how an end follows its start, the matrix
    [segments n, segments n]."""
    J, n = len(blocks), blocks.shape[-1]
    made = np.zeros((J, n, J, n))
    for j, block in enumerate(blocks):
        made[j, :, j] += block
        made[j, :, (j + 1) % J] -= np.eye(n)
    return made.reshape(J * n, J * n)


def product(blocks: Array) -> Array:
    """The monodromy of a motion, [n, n], from those of its segments in order."""
    whole = np.eye(blocks.shape[-1])
    for block in blocks:
        whole = block @ whole
    return whole


@dataclass(frozen=True)
class Periodic:
    """Fixed points of P_m. The unknowns are the free states at the start of each of
    ``segments`` pieces, over ``size`` [free], then the last of ``values``, over its
    scale; ``fixed`` [states] are the others."""

    flow: Flow
    lobes: int
    segments: int
    size: Array
    values: Array
    fixed: Array
    slack = 1.0

    @classmethod
    def at(
        cls, flow: Flow, lobes: int, values: Array, state: Array, segments: int | None = None
    ) -> Periodic:
        """The problem near ``state`` [states] at ``values`` [numbers]."""
        free = list(flow.symmetry.free)
        return cls(
            flow,
            lobes,
            segments or max(1, lobes),
            flow.state_scales(values)[0][free],
            np.array(values),
            state.copy(),
        )

    @property
    def folds(self) -> int:
        return self.flow.symmetry.folds or ANGLES

    @property
    def angle(self) -> float:
        """By how much the drive turns in one period [rad]."""
        return 2.0 * math.pi * self.lobes / self.folds

    def unknowns(self, states: Array, number: float) -> Array:
        """``x`` from the states at the starts of the segments [segments, states] and
        the number continued."""
        free = list(self.flow.symmetry.free)
        share = math.sqrt(self.segments)
        scaled = states[:, free] / (self.size * share)
        return np.concatenate([scaled.ravel(), [number / self.flow.scales[-1]]])

    def states(self, x: Array) -> Array:
        """The states at the starts of the segments, shape (segments, states)."""
        free = list(self.flow.symmetry.free)
        made = np.tile(self.fixed, (self.segments, 1))
        made[:, free] = x[:-1].reshape(self.segments, -1) * (self.size * math.sqrt(self.segments))
        return made

    def numbers(self, x: Array) -> Array:
        """The values of what is continued, the last from ``x``."""
        return np.concatenate([self.values[:-1], [x[-1] * self.flow.scales[-1]]])

    def legs(self, x: Array, *, tangent: bool = True) -> Legs:
        """The segments at ``x``, then at a slightly greater and a slightly smaller
        number, without monodromies."""
        states, values = self.states(x), self.numbers(x)
        h = DEFAULT_DIFFERENCE * self.flow.scales[-1]
        shift = np.zeros(len(values))
        shift[-1] = h
        three = np.stack([values, values + shift, values - shift])[: 3 if tangent else 1]
        J, k = self.segments, len(three)
        return Legs(
            np.tile(states, (k, 1)),
            np.tile(np.arange(J) * self.angle / J, k),
            np.full(k * J, self.angle / J),
            np.repeat(three, J, axis=0),
            np.arange(k * J) < J if tangent else np.zeros(J, dtype=bool),
            angular=True,
        )

    def read(self, x: Array) -> Steps[Reading | None]:
        ends = yield self.legs(x)
        if not ends.ok.all():
            return None
        flow, J, states = self.flow, self.segments, self.states(x)
        free = list(flow.symmetry.free)
        share = math.sqrt(J)
        scale, n = self.size * share, len(free)
        end = ends.state.reshape(3, J, -1)
        end[:, -1] = turned(flow.symmetry, end[:, -1], -self.angle)
        back = turn_matrix(flow.symmetry, flow.states, -self.angle)
        monodromy = ends.monodromy[:J].copy()
        monodromy[-1] = back @ monodromy[-1]
        residual = (end[0] - np.roll(states, -1, axis=0))[:, free] / scale
        blocks = monodromy[:, free][:, :, free] * (scale / scale[:, None])
        jacobian = np.zeros((J * n, J * n + 1))
        jacobian[:, :-1] = ring(blocks)
        whole = product(blocks)
        slope = (end[1] - end[2])[:, free] / scale / (2.0 * DEFAULT_DIFFERENCE)
        jacobian[:, -1] = slope.ravel()
        if not np.isfinite(jacobian).all():
            return None
        values = self.numbers(x)
        period = float(ends.duration[:J].sum())
        orbit = Orbit(
            states[0],
            values,
            period,
            np.linalg.eigvals(whole),
            over_segments(ends.touches[:J]),
            0,
            whole,
            0.0,
            states,
            tuple(free),
        )
        return Reading(residual.ravel(), jacobian, lambda: orbit)

    def moved(self, x: Array) -> Problem:
        return self


def starts_of(orbit: Orbit, flow: Flow, lobes: int) -> list[Array]:
    """The states, turned back to the drive angle 0, at which an orbit of so many
    ``lobes`` may begin, each of its free states."""
    assert orbit.pieces is not None
    step = len(orbit.pieces) // lobes
    fold = 2.0 * math.pi / (flow.symmetry.folds or ANGLES)
    pieces = orbit.pieces[:: max(step, 1)][:lobes]
    return [
        turned(flow.symmetry, piece, -k * fold)[list(orbit.free)] for k, piece in enumerate(pieces)
    ]


def between_segments(problem: Periodic, state: Array, values: Array) -> Steps[Array | None]:
    """The states at the starts of the segments of ``problem`` on the motion from
    ``state`` at ``values``."""
    made, J = [state], problem.segments
    angle = np.array([problem.angle / J])
    for j in range(J - 1):
        ends = yield Legs(
            made[-1][None],
            j * angle,
            angle,
            np.atleast_2d(values),
            np.zeros(1, dtype=bool),
            angular=True,
        )
        if not ends.ok[0]:
            return None
        made.append(ends.state[0])
    return np.stack(made)
