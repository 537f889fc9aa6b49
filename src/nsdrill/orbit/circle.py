"""Invariant circles of the lobe map: rolling over lobes, a motion on a torus.

A circle is u(theta) = R(theta) w(theta), with R the rotation of the frame; the map over
m lobes takes u(theta) to u(theta + rho). The unknowns are w at N angles and the
rotation rho; the equation of rho is a phase condition, that the mean of w keeps its
direction. Between the angles w is its trigonometric interpolant.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from nsdrill.data import Array
from nsdrill.models.base import Symmetry
from nsdrill.orbit.flow import Flow, Legs, Task
from nsdrill.orbit.newton import Evaluation, Point
from nsdrill.orbit.shooting import Orbit, Shooting, map_angle, rotated, rotation_derivative
from nsdrill.records import dataclass

POINT_COUNTS = (11, 21)  # of a circle; the second where the first fits too badly
REFINEMENT = 8  # angles per point, where a contact may begin or end between points
MAX_RETURNS = 240  # of the lobe map, to which a circle is fitted
MIN_RETURNS = 40  # of the map that a circle is fitted to
TOLERANCE_FACTOR = 30.0  # the error of interpolation along a circle is far larger still
# of central differences by a parameter, in its natural scale: longer than that of
# orbits, as the tolerance is looser
DIFFERENCE_STEP = 1e-3
MAX_MISFIT = 0.3  # of the fit, in natural scales
MAX_TAIL = 0.03  # of the highest harmonics, for a circle that is smooth enough


def shift_matrix(points: int, angle: float) -> tuple[Array, Array]:
    """The matrix [points, points] that maps values at ``points`` equal angles (an odd
    number) to those of their trigonometric interpolant at angles greater by ``angle``
    [rad], and its derivative by the angle."""
    t = angle + 2.0 * math.pi * (np.arange(points)[:, None] - np.arange(points)[None, :]) / points
    k = np.arange(1, points // 2 + 1)
    phase = t[..., None] * k
    return (1.0 + 2.0 * np.cos(phase).sum(axis=-1)) / points, -2.0 * (k * np.sin(phase)).sum(axis=-1) / points


@dataclass(frozen=True)
class Circle(Shooting):
    """Invariant circles of the map over ``lobes``. The unknowns are w at as many equal
    angles as there are ``segments``, the rotation [rad], and the continuation
    parameter. The multipliers of circles are only told, and cost as much as all else of
    one with many points: those of solutions that are not ``judged`` are NaN."""

    lobes: int
    judged: bool = True
    tolerance_factor = TOLERANCE_FACTOR

    @property
    def angles(self) -> Array:
        """The angles theta of the points [points], in rad."""
        return 2.0 * math.pi * np.arange(self.segments) / self.segments

    def unknowns(self, w: Array, rotation: float, parameter: float) -> Array:
        """``x`` from w [points, states], the rotation [rad] and the continuation
        parameter."""
        return self.packed(w, rotation, parameter / self.flow.scales[-1])

    def updated(self, x: Array) -> Circle:
        return self

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        flow, N, angle = self.flow, self.segments, map_angle(self.flow, self.lobes)
        w, rotation, values = self.states(x), float(x[-2]), self.values_around(x, DIFFERENCE_STEP)
        states = rotated(flow.symmetry, w, self.angles)
        all_values, tangent = np.repeat(values, N, axis=0), np.arange(3 * N) < N
        ends = yield _map_legs(np.tile(states, (3, 1)), angle, all_values, tangent)
        if not ends.ok.all():
            return None
        back_angles = -(np.tile(self.angles, 3) + rotation + angle)
        end = rotated(flow.symmetry, ends.state, back_angles)
        blocks = self._blocks(ends.monodromy[:N], back_angles[:N])
        residual, jacobian = self._equations(w, rotation, end, blocks)
        if not np.isfinite(jacobian).all():
            return None
        sampled = ends.touches[:N]
        if _may_cross(sampled[..., 0]) or _may_cross(-sampled[..., 1]):
            sampled = np.concatenate([sampled, (yield self._legs_between_angles(w, values[0])).touches])
        extremes = sampled[..., 0].min(axis=0), sampled[..., 1].max(axis=0)
        touches = np.stack([*extremes, ends.touches[:N, :, 2].mean(axis=0)], axis=-1)
        period, wrapped = float(ends.duration[0]), math.remainder(rotation, 2.0 * math.pi)

        def orbit() -> Orbit:
            missing = np.full(len(self.free), np.nan + 0j)
            multipliers = self._multipliers(blocks, rotation) if self.judged else missing
            free = flow.symmetry.free
            return Orbit(states[0], values[0], period, multipliers, touches, 1, None, wrapped, w, free)

        return Evaluation(residual, jacobian, orbit)

    def _blocks(self, monodromies: Array, back_angles: Array) -> Array:
        """The derivatives R(-theta - rho) M R(theta) of the map at each point, in the
        scales of the unknowns [points, free, free]."""
        symmetry, free = self.flow.symmetry, self.free
        transposed = rotated(symmetry, np.swapaxes(monodromies, 1, 2), back_angles[:, None])
        rotations = rotated(symmetry, np.tile(np.eye(self.flow.states), (self.segments, 1, 1)), self.angles[:, None])
        blocks = np.einsum("kij,klj->kil", np.swapaxes(transposed, 1, 2), rotations)
        return blocks[:, free][:, :, free] * self.ratios

    def _equations(self, w: Array, rotation: float, end: Array, blocks: Array) -> tuple[Array, Array]:
        """The residual and the Jacobian, from the ends of the map at the parameter, above
        and below it [3 points, states], and its derivatives at the points."""
        flow, N, n, free, scale = self.flow, self.segments, len(self.free), self.free, self.scale
        shifted, shift_by_angle = shift_matrix(N, rotation)
        flat, weight = w[:, free] / scale, math.sqrt(N)
        phase_state = free.index(flow.symmetry.turned[0][1])
        residual = np.zeros(N * n + 1)
        residual[:-1] = (end[:N][:, free] / scale - shifted @ flat).ravel()
        residual[-1] = flat[:, phase_state].sum() * (weight / N)
        jacobian = np.zeros((N * n + 1, N * n + 2))
        jacobian[:-1, :-2] = -np.kron(shifted, np.eye(n))
        for k, block in enumerate(blocks):
            jacobian[k * n : (k + 1) * n, k * n : (k + 1) * n] += block
        by_rotation = -rotation_derivative(flow.symmetry, end[:N])[:, free] / scale
        jacobian[:-1, -2] = (by_rotation - shift_by_angle @ flat).ravel()
        per_step = flow.scales[-1] / (2 * (DIFFERENCE_STEP * flow.scales[-1]))
        jacobian[:-1, -1] = ((end[N : 2 * N] - end[2 * N :])[:, free] / scale * per_step).ravel()
        jacobian[-1, phase_state : N * n : n] = weight / N
        return residual, jacobian

    def _multipliers(self, blocks: Array, rotation: float) -> Array:
        """The multipliers [free]. The linearised map of the circle has as many
        eigenvalues for each as there are points, rotated about zero; those are taken
        whose eigenvectors have the lowest harmonics."""
        N, n = self.segments, blocks.shape[1]
        shift_back, _ = shift_matrix(N, -rotation)
        columns = [np.kron(shift_back[:, k : k + 1], block) for k, block in enumerate(blocks)]
        values, vectors = np.linalg.eig(np.concatenate(columns, axis=1))
        power = np.abs(np.fft.fft(vectors.reshape(N, n, -1), axis=0)) ** 2
        harmonic = np.abs(np.fft.fftfreq(N, 1.0 / N))
        mean = np.einsum("k,kij->j", harmonic, power) / np.maximum(power.sum(axis=(0, 1)), 1e-300)
        return np.asarray(values[np.argsort(mean, kind="stable")[:n]])

    def _legs_between_angles(self, w: Array, values: Array) -> Legs:
        """The map from angles between those of the points."""
        steps = np.arange(1, REFINEMENT) * (2.0 * math.pi / (REFINEMENT * self.segments))
        states = np.concatenate([shift_matrix(self.segments, step)[0] @ w for step in steps])
        angles = (self.angles + steps[:, None]).ravel()
        return _map_legs(rotated(self.flow.symmetry, states, angles), map_angle(self.flow, self.lobes), values)

    def with_points(self, x: Array, points: int) -> tuple[Circle, Array]:
        """The problem with another number of points, and the same circle as its
        unknowns."""
        finer = replace(self, segments=points)
        w = np.stack([shift_matrix(self.segments, angle)[0][0] @ self.states(x) for angle in finer.angles])
        return finer, finer.unknowns(w, float(x[-2]), float(x[-1] * self.flow.scales[-1]))

    def images(self, orbit: Orbit) -> Task[list[Array]]:
        """w [points, states] of a circle of the map over several lobes and of its images
        under the map over one lobe: the same motion, begun one lobe later each time."""
        symmetry, angle = self.flow.symmetry, map_angle(self.flow)
        x, y = symmetry.turned[0]
        circles, states = [orbit.mesh_states], rotated(symmetry, orbit.mesh_states, self.angles)
        for _ in range(self.lobes - 1):
            ends = yield _map_legs(states, angle, orbit.values)
            if not ends.ok.all():
                break
            states = rotated(symmetry, ends.state, -angle)
            w = rotated(symmetry, states, -self.angles)
            mean = w.mean(axis=0)
            circles.append(rotated(symmetry, w, -math.atan2(mean[y], mean[x])))
        return circles


def _map_legs(states: Array, angle: float, values: Array, tangent: bool | Array = False) -> Legs:
    """The map over an ``angle`` of the drive from ``states`` at the drive angle 0."""
    return Legs(states, 0.0, angle, values, tangent, TOLERANCE_FACTOR, True)


def _may_cross(extremes: Array) -> bool:
    """Whether an extreme [points, contacts] that is positive at all angles may reach zero
    between them."""
    low = extremes.min(axis=0)
    return bool(np.any((low > 0.0) & (low < extremes.max(axis=0) - low)))


def harmonic_tail(orbit: Orbit) -> float:
    """The amplitude of the highest two harmonics along a circle relative to the
    largest, the maximum over the states."""
    w = orbit.mesh_states[:, list(orbit.free)]
    amplitudes = np.abs(np.fft.rfft(w - w.mean(axis=0), axis=0)) * 2.0 / len(w)
    largest = np.maximum(amplitudes.max(axis=0), 1e-4 * np.abs(w).max(axis=0) + 1e-12)
    return float(np.max(amplitudes[-2:].max(axis=0) / largest))


def circle_stop(symmetry: Symmetry, previous: Point, current: Point) -> str:
    """Why a branch of circles ends between two points: where the circle has shrunk to a
    point, beyond which the same circles follow with the opposite sign, and where the
    last two are not smooth."""
    x = symmetry.turned[0][0]
    before, after = (float(point.found.mesh_states[:, x].mean()) for point in (previous, current))
    if before * after < 0.0:
        return "shrunk"
    is_rough = harmonic_tail(current.found) > 3.0 * MAX_TAIL and harmonic_tail(previous.found) > MAX_TAIL
    return "kinks" if is_rough else ""


def fitted_circle(
    flow: Flow, state: Array, values: Array, lobes: tuple[int, ...]
) -> Task[tuple[Circle, Array, list[Array]] | None]:
    """The circle that the returns of a settled motion through ``state`` seem to fill,
    under the map over the first of ``lobes`` for which they do: its problem, its
    unknowns, and the mean w [states] of the circle and of each of its images under the
    map over one lobe. None where the returns fill no circle."""
    angle, returns = map_angle(flow), [state]
    for _ in range(MAX_RETURNS):
        ends = yield _map_legs(returns[-1][None], angle, values)
        if not ends.ok[0]:
            return None
        returns.append(rotated(flow.symmetry, ends.state, -angle)[0])
    for multiple in lobes:
        if len(returns) < MIN_RETURNS * multiple:
            continue
        fits = [_fitted(flow, np.stack(returns[k::multiple]), values, multiple) for k in range(multiple)]
        if fits[0] is not None:
            return *fits[0], [circle.states(x).mean(axis=0) for circle, x in filter(None, fits)]
    return None


def _fitted(flow: Flow, states: Array, values: Array, lobes: int) -> tuple[Circle, Array] | None:
    """The circle through the returns ``states`` [n, states] and its unknowns; None
    where they lie on none."""
    symmetry, free = flow.symmetry, list(flow.symmetry.free)
    x, y = symmetry.turned[0]
    radius = np.hypot(states[:, x], states[:, y])
    if radius.min() < 0.2 * radius.max():
        return None
    angle = np.arctan2(states[:, y], states[:, x])
    rotation = _mean_step(angle)
    theta = rotation * np.arange(len(states))
    theta = theta + math.atan2(np.sin(angle - theta).sum(), np.cos(angle - theta).sum())
    state_scales = flow.state_scales(values)[0][free]
    samples = rotated(symmetry, states, -theta)
    for points in POINT_COUNTS:
        if 2 * points > len(states):
            continue
        basis = _harmonics(theta, points)
        fit, *_ = np.linalg.lstsq(basis, samples, rcond=1e-10)
        if float(np.max(np.abs(basis @ fit - samples)[:, free] / state_scales)) <= MAX_MISFIT:
            problem = Circle(flow, points, state_scales, np.array(values), states[0].copy(), lobes)
            return problem, problem.unknowns(_harmonics(problem.angles, points) @ fit, rotation, values[-1])
    return None


def _mean_step(angle: Array) -> float:
    """The mean of the steps between angles [n], by a weighted average (Das et al. 2017)
    that converges faster than any power of n where the motion is quasi-periodic."""
    steps = np.diff(angle)
    # Steps are unwrapped about their mean, which may lie anywhere on the circle.
    mean = math.atan2(np.sin(steps).sum(), np.cos(steps).sum())
    steps = mean + np.remainder(steps - mean + math.pi, 2.0 * math.pi) - math.pi
    t = (np.arange(len(steps)) + 1.0) / (len(steps) + 1.0)
    weights = np.exp(-1.0 / (t * (1.0 - t)))
    return float(weights @ steps / weights.sum())


def _harmonics(theta: Array, points: int) -> Array:
    """A constant, cosines and sines of ``theta`` [n], as many as a circle has points."""
    phases = theta[:, None] * np.arange(1, points // 2 + 1)
    return np.concatenate([np.ones((len(theta), 1)), np.cos(phases), np.sin(phases)], axis=1)
