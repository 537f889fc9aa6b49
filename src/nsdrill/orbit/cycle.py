"""Limit cycles as zeros, where every angle of the drive is alike: of the flow in the
frame of the drive.

The period is an unknown, and a phase condition takes its equation: the start lies in
the plane through a reference state of the point before, across the flow there. One
multiplier is 1, along the flow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Reading, Steps
from nsdrill.orbit.flow import DEFAULT_DIFFERENCE, Flow, Legs
from nsdrill.orbit.frame import turned, turning
from nsdrill.orbit.periodic import Orbit, over_segments, product, ring

Array = np.ndarray[Any, np.dtype[np.float64]]
SEGMENTS = 6


def rates(flow: Flow, state: Array, values: Array) -> Array:
    """The rates of states (n, states) in the frame of the drive, at ``values``
    [numbers]."""
    every = np.tile(values, (len(state), 1))
    spin = flow.phase_rate(np.atleast_2d(values))[0]
    return flow.slopes(state, every) - spin * turning(flow.symmetry, state)


@dataclass(frozen=True)
class Cycle:
    """Limit cycles. The unknowns are the free states at the start of each of
    ``segments`` pieces, over ``size`` [free], the period over ``time`` [s], then the
    last of ``values`` over its scale. ``reference`` and ``across`` [free], in natural
    scales, are the place and the normal of the phase condition."""

    flow: Flow
    segments: int
    size: Array
    time: float
    values: Array
    fixed: Array
    reference: Array
    across: Array
    slack = 1.0

    @classmethod
    def at(
        cls, flow: Flow, period: float, values: Array, state: Array, segments: int = SEGMENTS
    ) -> Cycle:
        """The problem near the cycle through ``state`` [states] of this ``period``
        [s]."""
        free = list(flow.symmetry.free)
        size = flow.state_scales(values)[0][free]
        made = cls(
            flow,
            segments,
            size,
            period,
            np.array(values),
            state.copy(),
            state[free] / size,
            np.zeros(len(free)),
        )
        return made.through(state, values)

    def through(self, state: Array, values: Array) -> Cycle:
        free = list(self.flow.symmetry.free)
        across = rates(self.flow, state[None], values)[0][free] / self.size
        length = np.linalg.norm(across)
        return replace(self, reference=state[free] / self.size, across=across / max(length, 1e-300))

    def unknowns(self, states: Array, period: float, number: float) -> Array:
        """``x`` from the states at the starts of the segments, the period [s] and the
        number continued."""
        free = list(self.flow.symmetry.free)
        scaled = states[:, free] / (self.size * math.sqrt(self.segments))
        return np.concatenate([scaled.ravel(), [period / self.time, number / self.flow.scales[-1]]])

    def states(self, x: Array) -> Array:
        """The states at the starts of the segments, shape (segments, states)."""
        made = np.tile(self.fixed, (self.segments, 1))
        scaled = x[:-2].reshape(self.segments, -1)
        made[:, list(self.flow.symmetry.free)] = scaled * (self.size * math.sqrt(self.segments))
        return made

    def numbers(self, x: Array) -> Array:
        """The values of what is continued, the last from ``x``."""
        return np.concatenate([self.values[:-1], [x[-1] * self.flow.scales[-1]]])

    def read(self, x: Array) -> Steps[Reading | None]:
        flow, J, states = self.flow, self.segments, self.states(x)
        period, values = float(x[-2] * self.time), self.numbers(x)
        if not period > 0.0:
            return None
        shift = np.zeros(len(values))
        shift[-1] = h = DEFAULT_DIFFERENCE * flow.scales[-1]
        three = np.repeat(np.stack([values, values + shift, values - shift]), J, axis=0)
        n_legs = 3 * J
        ends = yield Legs(
            np.tile(states, (3, 1)),
            np.zeros(n_legs),
            np.full(n_legs, period / J),
            three,
            np.arange(n_legs) < J,
        )
        if not ends.ok.all():
            return None
        free = list(flow.symmetry.free)
        share, n = math.sqrt(J), len(free)
        scale = self.size * share
        angles = -flow.phase_rate(three) * period / J
        end = turned(flow.symmetry, ends.state, angles)
        columns = turned(flow.symmetry, np.swapaxes(ends.monodromy[:J], 1, 2), angles[:J, None])
        monodromy = np.swapaxes(columns, 1, 2)
        along = rates(flow, end[:J], values)[:, free] / scale * (self.time / J)
        residual = np.zeros(J * n + 1)
        jacobian = np.zeros((J * n + 1, J * n + 2))
        residual[:-1] = ((end[:J] - np.roll(states, -1, axis=0))[:, free] / scale).ravel()
        residual[-1] = self.across @ (states[0][free] / self.size - self.reference)
        blocks = monodromy[:, free][:, :, free] * (scale / scale[:, None])
        jacobian[:-1, :-2] = ring(blocks)
        whole = product(blocks)
        jacobian[-1, :n] = self.across * share
        jacobian[:-1, -2] = along.ravel()
        slope = (end[J : 2 * J] - end[2 * J :])[:, free] / scale * (flow.scales[-1] / (2.0 * h))
        jacobian[:-1, -1] = slope.ravel()
        if not np.isfinite(jacobian).all():
            return None
        multipliers = np.linalg.eigvals(whole)
        touches = over_segments(ends.touches[:J])
        orbit = Orbit(
            states[0], values, period, multipliers, touches, 1, whole, math.nan, states, tuple(free)
        )
        return Reading(residual, jacobian, lambda: orbit)

    def moved(self, x: Array) -> Cycle:
        return self.through(self.states(x)[0], self.numbers(x))


def sampled_cycle(
    flow: Flow, state: Array, values: Array, interval: float, most: int, segments: int = SEGMENTS
) -> Steps[tuple[Array, float] | None]:
    """Of a settled motion through ``state`` (states) the states at the starts of the
    segments and the period [s], if it comes back to its start within ``most`` times
    ``interval`` [s]; None where it does not, or stands still."""
    free = list(flow.symmetry.free)
    size = flow.state_scales(values)[0][free]
    every = np.atleast_2d(values)
    spin = float(flow.phase_rate(every)[0])
    made, away, far = [state], 0.0, False
    for k in range(1, most + 1):
        ends = yield Legs(
            made[-1][None], np.zeros(1), np.array([interval]), every, np.zeros(1, dtype=bool)
        )
        if not ends.ok[0]:
            return None
        made.append(turned(flow.symmetry, ends.state, -spin * interval)[0])
        distances = [float(np.linalg.norm(((one - state)[free]) / size)) for one in made[-3:]]
        away = max(away, distances[-1])
        far = far or distances[-1] > 0.5 * away > 1e-3
        if (
            k > 3
            and far
            and distances[1] < distances[0]
            and distances[1] <= distances[2]
            and distances[1] < 0.1 * away
        ):
            near = made[-2]
            rate = rates(flow, near[None], values)[0][free] / size
            back = float(((near - state)[free] / size) @ rate) / float(rate @ rate)
            period = (k - 1) * interval - back
            starts = [made[round(j * (k - 1) / segments)] for j in range(segments)]
            return np.stack(starts), period
    return None
