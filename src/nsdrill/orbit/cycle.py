"""Limit cycles of models whose equations are the same at every drive angle, by multiple
shooting in the frame of the drive.

The period is an unknown, and the phase condition of Poincaré is its equation: the start
lies in the plane through a reference state, that of the previous point, normal to the
flow there. One multiplier is 1, along the flow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Evaluation, Task
from nsdrill.orbit.flow import DIFFERENCE_STEP, Flow, Legs
from nsdrill.orbit.frame import rotated, rotation_derivative
from nsdrill.orbit.periodic import Orbit, combined_touches, monodromy_product, shooting_jacobian

Array = np.ndarray[Any, np.dtype[np.float64]]
SEGMENTS = 6  # of a cycle, unless more are given


def corotating_rates(flow: Flow, state: Array, values: Array) -> Array:
    """The time derivatives of states (n, states) in the frame of the drive, at
    ``values`` [parameters], shape (n, states)."""
    all_values = np.tile(values, (len(state), 1))
    phase_rate = flow.phase_rate(np.atleast_2d(values))[0]
    return flow.state_rates(state, all_values) - phase_rate * rotation_derivative(flow.symmetry, state)


@dataclass(frozen=True)
class Cycle:
    """Limit cycles. The unknowns are the free states at the start of each of the
    ``segments``, over ``state_scales`` [free]; the period over ``time_scale`` [s]; and
    the last of ``values``, over its scale. The other states are those of ``fixed``
    [states]. ``reference`` and ``normal`` [free], in natural scales, define the plane
    of the phase condition."""

    flow: Flow
    segments: int
    state_scales: Array
    time_scale: float
    values: Array
    fixed: Array
    reference: Array
    normal: Array
    tolerance_factor = 1.0

    @classmethod
    def at(cls, flow: Flow, period: float, values: Array, state: Array, segments: int = SEGMENTS) -> Cycle:
        """The problem near the cycle of this ``period`` [s] through ``state``
        [states]."""
        free = list(flow.symmetry.free)
        state_scales = flow.state_scales(values)[0][free]
        problem = cls(
            flow,
            segments,
            state_scales,
            period,
            np.array(values),
            state.copy(),
            state[free] / state_scales,
            np.zeros(len(free)),
        )
        return problem.with_phase_condition(state, values)

    def with_phase_condition(self, state: Array, values: Array) -> Cycle:
        """The same problem with its phase condition at ``state`` [states]."""
        free = list(self.flow.symmetry.free)
        normal = corotating_rates(self.flow, state[None], values)[0][free] / self.state_scales
        length = np.linalg.norm(normal)
        return replace(self, reference=state[free] / self.state_scales, normal=normal / max(length, 1e-300))

    def unknowns(self, states: Array, period: float, parameter: float) -> Array:
        """``x`` from the states at the starts of the segments [segments, states], the
        period [s] and the continuation parameter."""
        free = list(self.flow.symmetry.free)
        scaled = states[:, free] / (self.state_scales * math.sqrt(self.segments))
        return np.concatenate([scaled.ravel(), [period / self.time_scale, parameter / self.flow.scales[-1]]])

    def states(self, x: Array) -> Array:
        """The states at the starts of the segments, shape (segments, states)."""
        states = np.tile(self.fixed, (self.segments, 1))
        scaled = x[:-2].reshape(self.segments, -1)
        states[:, list(self.flow.symmetry.free)] = scaled * (self.state_scales * math.sqrt(self.segments))
        return states

    def values_at(self, x: Array) -> Array:
        """The values of the continuation parameters, the last from ``x``."""
        return np.concatenate([self.values[:-1], [x[-1] * self.flow.scales[-1]]])

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        flow, J, states = self.flow, self.segments, self.states(x)
        period, values = float(x[-2] * self.time_scale), self.values_at(x)
        if not period > 0.0:
            return None
        shift = np.zeros(len(values))
        shift[-1] = h = DIFFERENCE_STEP * flow.scales[-1]
        stencil = np.repeat(np.stack([values, values + shift, values - shift]), J, axis=0)
        n_legs = 3 * J
        ends = yield Legs(
            np.tile(states, (3, 1)), np.zeros(n_legs), np.full(n_legs, period / J), stencil, np.arange(n_legs) < J
        )
        if not ends.ok.all():
            return None
        free = list(flow.symmetry.free)
        weight, n = math.sqrt(J), len(free)
        scale = self.state_scales * weight
        angles = -flow.phase_rate(stencil) * period / J
        end = rotated(flow.symmetry, ends.state, angles)
        transposed = rotated(flow.symmetry, np.swapaxes(ends.monodromy[:J], 1, 2), angles[:J, None])
        monodromies = np.swapaxes(transposed, 1, 2)
        by_period = corotating_rates(flow, end[:J], values)[:, free] / scale * (self.time_scale / J)
        residual = np.zeros(J * n + 1)
        jacobian = np.zeros((J * n + 1, J * n + 2))
        residual[:-1] = ((end[:J] - np.roll(states, -1, axis=0))[:, free] / scale).ravel()
        residual[-1] = self.normal @ (states[0][free] / self.state_scales - self.reference)
        blocks = monodromies[:, free][:, :, free] * (scale / scale[:, None])
        jacobian[:-1, :-2] = shooting_jacobian(blocks)
        monodromy = monodromy_product(blocks)
        jacobian[-1, :n] = self.normal * weight
        jacobian[:-1, -2] = by_period.ravel()
        by_parameter = (end[J : 2 * J] - end[2 * J :])[:, free] / scale * (flow.scales[-1] / (2.0 * h))
        jacobian[:-1, -1] = by_parameter.ravel()
        if not np.isfinite(jacobian).all():
            return None
        multipliers = np.linalg.eigvals(monodromy)
        touches = combined_touches(ends.touches[:J])
        orbit = Orbit(states[0], values, period, multipliers, touches, 1, monodromy, math.nan, states, tuple(free))
        return Evaluation(residual, jacobian, lambda: orbit)

    def updated(self, x: Array) -> Cycle:
        return self.with_phase_condition(self.states(x)[0], self.values_at(x))


def sampled_cycle(
    flow: Flow, state: Array, values: Array, interval: float, max_samples: int, segments: int = SEGMENTS
) -> Task[tuple[Array, float] | None]:
    """The states at the starts of the segments [segments, states] and the period [s] of
    a settled motion through ``state`` [states], sampled every ``interval`` [s]. None
    where it does not return to its start within ``max_samples``, or stands still."""
    free = list(flow.symmetry.free)
    state_scales = flow.state_scales(values)[0][free]
    all_values = np.atleast_2d(values)
    phase_rate = float(flow.phase_rate(all_values)[0])
    samples, max_distance, has_left = [state], 0.0, False
    for k in range(1, max_samples + 1):
        ends = yield Legs(samples[-1][None], np.zeros(1), np.array([interval]), all_values, np.zeros(1, dtype=bool))
        if not ends.ok[0]:
            return None
        samples.append(rotated(flow.symmetry, ends.state, -phase_rate * interval)[0])
        distances = [float(np.linalg.norm(((sample - state)[free]) / state_scales)) for sample in samples[-3:]]
        max_distance = max(max_distance, distances[-1])
        has_left = has_left or distances[-1] > 0.5 * max_distance > 1e-3
        if (
            k > 3
            and has_left
            and distances[1] < distances[0]
            and distances[1] <= distances[2]
            and distances[1] < 0.1 * max_distance
        ):
            closest = samples[-2]
            closest_rate = corotating_rates(flow, closest[None], values)[0][free] / state_scales
            overshoot = float(((closest - state)[free] / state_scales) @ closest_rate) / float(
                closest_rate @ closest_rate
            )
            period = (k - 1) * interval - overshoot
            starts = [samples[round(j * (k - 1) / segments)] for j in range(segments)]
            return np.stack(starts), period
    return None
