"""Periodic orbits as fixed points of the lobe map, and limit cycles. Steady drilling and bounces are such
fixed points.

The lobe map P_m is the flow over m folds of a revolution of the drive, followed by the
rotation back by the same angle (``models.base.Symmetry``). An orbit of period m is a
fixed point of P_m. Where the equations are the same at every drive angle, a fixed point
of the map over any angle is an equilibrium in the frame of the drive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nsdrill.data import Array
from nsdrill.orbit.flow import DIFFERENCE_STEP, Ends, Flow, Legs, Task
from nsdrill.orbit.newton import Evaluation
from nsdrill.orbit.shooting import Orbit, Shooting, map_angle, rotated, rotation_derivative, shooting_jacobian
from nsdrill.records import dataclass


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


# Limit cycles of models whose equations are the same at every drive angle, by multiple
# shooting in the frame of the drive.
# The period is an unknown, and the phase condition of Poincaré is its equation: the start
# lies in the plane through a reference state, that of the previous point, normal to the
# flow there. One multiplier is 1, along the flow.


SEGMENTS = 6  # of a cycle, unless more are given
CYCLE_SAMPLES = 96  # of a cycle from which distances are taken


def corotating_rates(flow: Flow, state: Array, values: Array) -> Array:
    """The time derivatives of states (n, states) in the frame of the drive, at
    ``values`` [parameters], shape (n, states)."""
    all_values = np.tile(values, (len(state), 1))
    phase_rate = flow.phase_rate(np.atleast_2d(values))[0]
    return flow.state_rates(state, all_values) - phase_rate * rotation_derivative(flow.symmetry, state)


@dataclass(frozen=True)
class Cycle(Shooting):
    """Limit cycles. The further unknowns are the period over ``time_scale`` [s] and the
    continuation parameter. ``reference`` and ``normal`` [free], in natural scales,
    define the plane of the phase condition."""

    time_scale: float
    reference: Array
    normal: Array
    lobes = 1
    trivial = 1

    @classmethod
    def at(cls, flow: Flow, period: float, values: Array, state: Array, segments: int = SEGMENTS) -> Cycle:
        """The problem near the cycle of this ``period`` [s] through ``state``
        [states]."""
        scales = flow.state_scales(values)[0][list(flow.symmetry.free)]
        zeros = np.zeros(len(scales))
        problem = cls(flow, segments, scales, np.array(values), state.copy(), period, zeros, zeros)
        return problem.with_phase_condition(state, values)

    def with_phase_condition(self, state: Array, values: Array) -> Cycle:
        return self.with_normal(
            state, corotating_rates(self.flow, state[None], values)[0][self.free] / self.state_scales
        )

    def with_normal(self, state: Array, normal: Array) -> Cycle:
        """The same problem with the plane of its phase condition through ``state``
        [states]; ``normal`` [free] has any length."""
        reference = state[self.free] / self.state_scales
        return replace(self, reference=reference, normal=normal / max(float(np.linalg.norm(normal)), 1e-300))

    def unknowns(self, states: Array, period: float, parameter: float) -> Array:
        """``x`` from the states at the starts of the segments [segments, states], the
        period [s] and the continuation parameter."""
        return self.packed(states, period / self.time_scale, parameter / self.flow.scales[-1])

    def legs(self, states: Array, values: Array, periods: Array, tangent: Sequence[bool] | Array) -> Legs:
        """The segments of several cases: ``states`` [cases, segments, states], ``values``
        [cases, parameters], ``periods`` [cases] [s], and whether their monodromies are
        computed, ``tangent`` [cases]."""
        J = self.segments
        all_values, durations = np.repeat(values, J, axis=0), np.repeat(periods / J, J)
        return Legs(states.reshape(len(all_values), -1), 0.0, durations, all_values, np.repeat(tangent, J))

    def shots(self, ends: Ends, values: Array, periods: Array) -> tuple[Array, Array]:
        """The ends and monodromies of :meth:`legs` in the frame of the drive, as of
        :meth:`.Shooting.rotated_back`."""
        return self.rotated_back(ends, np.repeat(self.flow.phase_rate(values) * periods / self.segments, self.segments))

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        J, free, scale, states = self.segments, self.free, self.scale, self.states(x)
        period, values = float(x[-2] * self.time_scale), self.values_around(x, DIFFERENCE_STEP)
        if not period > 0.0:
            return None
        periods = np.full(3, period)
        ends = yield self.legs(np.stack([states] * 3), values, periods, (True, False, False))
        if not ends.ok.all():
            return None
        end, monodromies = self.shots(ends, values, periods)
        blocks = monodromies[0] * self.ratios
        by_period = corotating_rates(self.flow, end[0], values[0])[:, free] / scale * (self.time_scale / J)
        parameter_scale = self.flow.scales[-1]
        per_step = parameter_scale / (2.0 * (DIFFERENCE_STEP * parameter_scale))
        by_parameter = (end[1] - end[2])[:, free] / scale * per_step
        phase_error, phase_row = self.phase_condition(states)
        jacobian = np.zeros((len(x) - 1, len(x)))
        jacobian[:-1] = np.column_stack([shooting_jacobian(blocks), by_period.ravel(), by_parameter.ravel()])
        jacobian[-1, : len(free)] = phase_row
        if not np.isfinite(jacobian).all():
            return None
        residual = np.concatenate([self.misses(end[0], states), phase_error])
        found = states, values[0], period, blocks, ends.touches[:J]
        return Evaluation(residual, jacobian, lambda: self.orbit(*found))

    def phase_condition(self, states: Array) -> tuple[Array, Array]:
        """The residual [1] and the derivative by the first segment [1, free] of the
        phase condition."""
        error = self.normal @ (states[0][self.free] / self.state_scales - self.reference)
        return np.array([error]), self.normal[None] * math.sqrt(self.segments)

    def critical_matrix(self, multiplier: float, monodromy: Array, state: Array, values: Array) -> Array:
        """The matrix that is singular where a cycle through ``state`` has this
        multiplier beside the trivial one: the shifted monodromy bordered by the flow and
        by the normal of the phase condition [free + 1, free + 1]."""
        rates = corotating_rates(self.flow, state[None], values)[0][self.free] / self.state_scales
        shifted = monodromy - multiplier * np.eye(len(monodromy))
        corner = [[shifted, rates[:, None] * self.time_scale], [self.normal[None], np.zeros((1, 1))]]
        return np.block(corner)


def cycle_starts(cycle: Cycle, state: Array, period: float, values: Array) -> Task[Array | None]:
    """The states at the starts of the segments of ``cycle`` [segments, states], which goes
    through ``state`` [states] in a ``period`` [s], in the frame of the drive; None where a
    run fails."""
    flow, duration = cycle.flow, period / cycle.segments
    starts, turn = [state], float(flow.phase_rate(values)[0]) * duration
    for _ in range(cycle.segments - 1):
        ends = yield Legs(starts[-1][None], 0.0, duration, values)
        if not ends.ok[0]:
            return None
        starts.append(rotated(flow.symmetry, ends.state, -turn)[0])
    return np.stack(starts)


def states_on_cycle(flow: Flow, orbit: Orbit, times: Array) -> Task[Array | None]:
    """The states [n, states] of a cycle at ``times`` [n] after its start [s], in the frame of
    the drive, each reached from the last start of a segment before it; None where a run fails."""
    segments = len(orbit.mesh_states)
    duration = orbit.period / segments
    before = np.floor(times / duration)
    rests, states = times - before * duration, orbit.mesh_states[before.astype(int) % segments]
    is_between = rests > 1e-9 * orbit.period
    ends = yield Legs(states[is_between], 0.0, rests[is_between], orbit.values)
    if not ends.ok.all():
        return None
    turns = float(flow.phase_rate(orbit.values)[0]) * rests[is_between]
    states[is_between] = rotated(flow.symmetry, ends.state, -turns)
    return states


def distance_from_cycle(flow: Flow, orbit: Orbit, states: Array) -> Task[tuple[float, float]]:
    """The distance from a cycle of that of some ``states`` [n, states] which is farthest from
    it, at whatever phase, and the size of the cycle, the greatest distance from its mean, in
    natural scales. Infinite where a run fails."""
    free, step = list(orbit.free), orbit.period / CYCLE_SAMPLES
    scales = flow.state_scales(orbit.values)[0][free]
    times = step * np.arange(CYCLE_SAMPLES)
    found = yield from states_on_cycle(flow, orbit, times)
    if found is None:
        return math.inf, math.inf
    path, sought = found[:, free] / scales, states[:, free] / scales
    size = float(np.max(np.linalg.norm(path - path.mean(axis=0), axis=1)))
    nearest = np.argmin(np.linalg.norm(sought[:, None] - path, axis=2), axis=1)
    times, found = times[nearest], found[nearest]
    for _ in range(2):  # between the samples
        rates = corotating_rates(flow, found, orbit.values)[:, free] / scales
        along = np.sum((sought - found[:, free] / scales) * rates, axis=1) / np.maximum(
            np.sum(rates**2, axis=1), 1e-300
        )
        times = times + np.clip(along, -step, step)
        found = yield from states_on_cycle(flow, orbit, times)
        if found is None:
            return math.inf, math.inf
    return float(np.max(np.linalg.norm(sought - found[:, free] / scales, axis=1))), size


def sampled_cycle(
    flow: Flow, state: Array, values: Array, interval: float, max_samples: int
) -> Task[tuple[Array, float] | None]:
    """The states at the starts of the ``SEGMENTS`` [segments, states] and the period [s]
    of a settled motion through ``state`` [states], sampled every ``interval`` [s]. None
    where it does not return to its start within ``max_samples``, or stands still."""
    free = list(flow.symmetry.free)
    state_scales = flow.state_scales(values)[0][free]
    phase_rate = float(flow.phase_rate(values)[0])
    samples, distances, has_left = [state], [0.0], False
    for k in range(1, max_samples + 1):
        ends = yield Legs(samples[-1][None], 0.0, interval, values)
        if not ends.ok[0]:
            return None
        samples.append(rotated(flow.symmetry, ends.state, -phase_rate * interval)[0])
        distances.append(float(np.linalg.norm((samples[-1] - state)[free] / state_scales)))
        has_left = has_left or distances[-1] > 0.5 * max(distances) > 1e-3
        before, least, after = distances[-3:] if k > 3 else (0.0, 0.0, 0.0)
        if has_left and least < before and least <= after:
            closest = samples[-2]
            rate = corotating_rates(flow, closest[None], values)[0][free] / state_scales
            offset = (closest - state)[free] / state_scales
            overshoot = float(offset @ rate) / float(rate @ rate)
            # A sample of a fast motion may be far from its start, along the path.
            beside = offset - min(max(overshoot, -interval), interval) * rate
            if np.linalg.norm(beside) >= 0.1 * max(distances):
                continue
            starts = [samples[round(j * (k - 1) / SEGMENTS)] for j in range(SEGMENTS)]
            return np.stack(starts), (k - 1) * interval - overshoot
    return None
