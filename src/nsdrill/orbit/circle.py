"""Invariant circles of the lobe map: rolling over lobes, a motion on a torus.

A circle is u(theta) = R(theta) w(theta), with R the rotation of the frame; the map over
m lobes takes u(theta) to u(theta + rho). The unknowns are w at N angles and the
rotation rho; the equation of rho is a phase condition, that the mean of w keeps its
direction. Between the angles w is its trigonometric interpolant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import FOLD, OWN
from nsdrill.models.base import Symmetry
from nsdrill.orbit.arclength import (
    Evaluation,
    LabelledPoint,
    Point,
    Task,
    TestFunction,
    TestFunctions,
    corrected_at_parameter,
    special_points,
)
from nsdrill.orbit.flow import Flow, Legs
from nsdrill.orbit.frame import rotated, rotation_derivative
from nsdrill.orbit.labels import Graze
from nsdrill.orbit.periodic import Orbit

Array = np.ndarray[Any, np.dtype[np.float64]]
POINT_COUNTS = (11, 21)  # of a circle; the second where the first fits too badly
FINEST = 41  # points of the circles on which touches are located
TOUCH_TOLERANCE = 1e-3  # of their arclength there
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
class Circle:
    """Invariant circles. The unknowns are the free states of w at ``points`` equal
    angles, over ``state_scales`` [free], the rotation [rad], and the last of ``values``
    over its scale. The other states are those of ``fixed`` [states]."""

    flow: Flow
    points: int
    lobes: int
    state_scales: Array
    values: Array
    fixed: Array
    tolerance_factor = TOLERANCE_FACTOR

    @property
    def map_angle(self) -> float:
        """The angle by which the drive advances in the map [rad]."""
        return 2.0 * math.pi * self.lobes / self.flow.symmetry.folds

    @property
    def angles(self) -> Any:
        """The angles theta of the points [points], in rad."""
        return 2.0 * math.pi * np.arange(self.points) / self.points

    def unknowns(self, w: Array, rotation: float, parameter: float) -> Array:
        """``x`` from w [points, states], the rotation [rad] and the continuation
        parameter."""
        scaled = w[:, list(self.flow.symmetry.free)] / (self.state_scales * math.sqrt(self.points))
        return np.concatenate([scaled.ravel(), [rotation, parameter / self.flow.scales[-1]]])

    def w(self, x: Array) -> Array:
        """w at the angles, shape (points, states)."""
        w = np.tile(self.fixed, (self.points, 1))
        w[:, list(self.flow.symmetry.free)] = x[:-2].reshape(self.points, -1) * (
            self.state_scales * math.sqrt(self.points)
        )
        return w

    def values_at(self, x: Array) -> Array:
        """The values of the continuation parameters, the last from ``x``."""
        return np.concatenate([self.values[:-1], [x[-1] * self.flow.scales[-1]]])

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        flow, N = self.flow, self.points
        symmetry, free = flow.symmetry, list(flow.symmetry.free)
        w, rotation, values = self.w(x), float(x[-2]), self.values_at(x)
        shift = np.zeros(len(values))
        shift[-1] = h = DIFFERENCE_STEP * flow.scales[-1]
        stencil = np.repeat(np.stack([values, values + shift, values - shift]), N, axis=0)
        states = rotated(symmetry, w, self.angles)
        ends = yield Legs(
            np.tile(states, (3, 1)),
            np.zeros(3 * N),
            np.full(3 * N, self.map_angle),
            stencil,
            np.arange(3 * N) < N,
            TOLERANCE_FACTOR,
            True,
        )
        if not ends.ok.all():
            return None
        back_angles = -(np.tile(self.angles, 3) + rotation + self.map_angle)
        end = rotated(symmetry, ends.state, back_angles)
        n, weight = len(free), math.sqrt(N)
        scale = self.state_scales * weight
        shifted, shift_by_angle = shift_matrix(N, rotation)
        flat = w[:, free] / scale
        residual = np.zeros(N * n + 1)
        residual[:-1] = (end[:N][:, free] / scale - shifted @ flat).ravel()
        phase_state = free.index(symmetry.turned[0][1])
        residual[-1] = flat[:, phase_state].sum() * (weight / N)
        jacobian = np.zeros((N * n + 1, N * n + 2))
        jacobian[:-1, :-2] = -np.kron(shifted, np.eye(n))
        # R(-theta - rho) M R(theta) at each point
        transposed = rotated(symmetry, np.swapaxes(ends.monodromy[:N], 1, 2), np.asarray(back_angles[:N, None]))
        blocks = np.swapaxes(transposed, 1, 2)
        rotations = rotated(symmetry, np.tile(np.eye(flow.states), (N, 1, 1)), self.angles[:, None])
        blocks = np.einsum("kij,klj->kil", blocks, rotations)[:, free][:, :, free] * (scale / scale[:, None])
        for k in range(N):
            jacobian[k * n : (k + 1) * n, k * n : (k + 1) * n] += blocks[k]
        by_rotation = -rotation_derivative(symmetry, end[:N])[:, free] / scale
        jacobian[:-1, -2] = (by_rotation - shift_by_angle @ flat).ravel()
        jacobian[:-1, -1] = ((end[N : 2 * N] - end[2 * N :])[:, free] / scale * (flow.scales[-1] / (2 * h))).ravel()
        jacobian[-1, phase_state : N * n : n] = weight / N
        if not np.isfinite(jacobian).all():
            return None
        sampled = ends.touches[:N]
        if _may_cross(sampled[..., 0]) or _may_cross(-sampled[..., 1]):
            sampled = np.concatenate([sampled, (yield self._between_angles(w, values)).touches])
        touches = np.stack(
            [sampled[..., 0].min(axis=0), sampled[..., 1].max(axis=0), ends.touches[:N, :, 2].mean(axis=0)], axis=-1
        )
        period = float(ends.duration[0])
        wrapped = math.remainder(rotation, 2.0 * math.pi)

        def orbit() -> Orbit:
            multipliers = self._multipliers(blocks, rotation)
            return Orbit(states[0], values, period, multipliers, touches, 1, None, wrapped, w, tuple(free))

        return Evaluation(residual, jacobian, orbit)

    def _multipliers(self, blocks: Array, rotation: float) -> Array:
        """The multipliers [free]. The linearised map of the circle has ``points``
        eigenvalues for each, rotated about zero; those are taken whose eigenvectors
        have the lowest harmonics."""
        N, n = self.points, blocks.shape[1]
        shift_back, _ = shift_matrix(N, -rotation)
        linearised_map = np.zeros((N * n, N * n))
        for k in range(N):
            linearised_map[:, k * n : (k + 1) * n] = np.kron(shift_back[:, k : k + 1], blocks[k])
        values, vectors = np.linalg.eig(linearised_map)
        power = np.abs(np.fft.fft(vectors.reshape(N, n, -1), axis=0)) ** 2
        harmonic = np.abs(np.fft.fftfreq(N, 1.0 / N))
        mean = np.einsum("k,kij->j", harmonic, power) / np.maximum(power.sum(axis=(0, 1)), 1e-300)
        return np.asarray(values[np.argsort(mean, kind="stable")[:n]])

    def updated(self, x: Array) -> Circle:
        return self

    def _between_angles(self, w: Array, values: Array) -> Legs:
        """The map from angles between those of the points."""
        steps = np.arange(1, REFINEMENT) * (2.0 * math.pi / (REFINEMENT * self.points))
        states = np.concatenate([shift_matrix(self.points, step)[0] @ w for step in steps])
        angles = (self.angles + steps[:, None]).ravel()
        n = len(angles)
        return Legs(
            rotated(self.flow.symmetry, states, angles),
            np.zeros(n),
            np.full(n, self.map_angle),
            np.tile(values, (n, 1)),
            np.zeros(n, dtype=bool),
            TOLERANCE_FACTOR,
            True,
        )

    def with_points(self, x: Array, points: int) -> tuple[Circle, Array]:
        """The problem with another number of points, and the same circle as its
        unknowns."""
        finer = replace(self, points=points)
        w = np.stack([shift_matrix(self.points, angle)[0][0] @ self.w(x) for angle in finer.angles])
        return finer, finer.unknowns(w, float(x[-2]), float(x[-1] * self.flow.scales[-1]))


def _may_cross(extremes: Array) -> bool:
    """Whether an extreme [points, contacts] that is positive at all angles may reach zero
    between them."""
    low = extremes.min(axis=0)
    return bool(np.any((low > 0.0) & (low < extremes.max(axis=0) - low)))


def harmonic_tail(orbit: Orbit) -> float:
    """The amplitude of the highest two harmonics along a circle relative to the
    largest, the maximum over the states."""
    assert orbit.mesh_states is not None
    w = orbit.mesh_states[:, list(orbit.free)]
    amplitudes = np.abs(np.fft.rfft(w - w.mean(axis=0), axis=0)) * 2.0 / len(w)
    return float(
        np.max(amplitudes[-2:].max(axis=0) / np.maximum(amplitudes.max(axis=0), 1e-4 * np.abs(w).max(axis=0) + 1e-12))
    )


def circle_stop(symmetry: Symmetry) -> Callable[[Point, Point], str]:
    """The stop function of a branch of circles. It ends where the circle has shrunk to
    a point, beyond which the same circles follow with the opposite sign, and where the
    last two are not smooth."""
    x = symmetry.turned[0][0]

    def stop(previous: Point, current: Point) -> str:
        before, after = (float(point.found.mesh_states[:, x].mean()) for point in (previous, current))
        if before * after < 0.0:
            return "shrunk"
        is_rough = harmonic_tail(current.found) > 3.0 * MAX_TAIL and harmonic_tail(previous.found) > MAX_TAIL
        return "kinks" if is_rough else ""

    return stop


def fitted_circle(
    flow: Flow, state: Array, values: Array, lobes: tuple[int, ...]
) -> Task[tuple[Circle, Array, list[Array]] | None]:
    """The circle that the returns of a settled motion through ``state`` seem to fill,
    under the map over the first of ``lobes`` for which they do: its problem, its
    unknowns, and the mean w [states] of the circle and of each of its images under the
    map over one lobe. None where the returns fill no circle."""
    symmetry = flow.symmetry
    fold_angle = 2.0 * math.pi / symmetry.folds
    angle, all_values = np.array([fold_angle]), values[None]
    returns = [state]
    for _ in range(MAX_RETURNS):
        ends = yield Legs(
            returns[-1][None], np.zeros(1), angle, all_values, np.zeros(1, dtype=bool), TOLERANCE_FACTOR, True
        )
        if not ends.ok[0]:
            return None
        returns.append(rotated(symmetry, ends.state, -fold_angle)[0])
    for multiple in lobes:
        if len(returns) < MIN_RETURNS * multiple:
            continue
        fit = _fitted(flow, np.stack(returns[::multiple]), values, multiple)
        if fit is not None:
            problem, unknowns = fit
            image_fits = [_fitted(flow, np.stack(returns[k::multiple]), values, multiple) for k in range(1, multiple)]
            return (problem, unknowns, [circle.w(x).mean(axis=0) for circle, x in [fit, *filter(None, image_fits)]])
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
    steps = np.diff(angle)
    # Steps are unwrapped about their mean, which may lie anywhere on the circle.
    mean = math.atan2(np.sin(steps).sum(), np.cos(steps).sum())
    steps = mean + np.remainder(steps - mean + math.pi, 2.0 * math.pi) - math.pi
    t = (np.arange(len(steps)) + 1.0) / (len(steps) + 1.0)
    weights = np.exp(-1.0 / (t * (1.0 - t)))  # Das et al. 2017, faster than any power
    rotation = float(weights @ steps / weights.sum())
    theta = rotation * np.arange(len(states))
    state_scales = flow.state_scales(values[None])[0][free]
    offset = math.atan2(np.sin(angle - theta).sum(), np.cos(angle - theta).sum())
    theta = theta + offset
    samples = rotated(symmetry, states, -theta)
    for points in POINT_COUNTS:
        if 2 * points > len(states):
            continue
        k = np.arange(1, points // 2 + 1)
        phases = theta[:, None] * k
        basis = np.concatenate([np.ones((len(theta), 1)), np.cos(phases), np.sin(phases)], axis=1)
        fit, *_ = np.linalg.lstsq(basis, samples, rcond=1e-10)
        if float(np.max(np.abs(basis @ fit - samples)[:, free] / state_scales)) > MAX_MISFIT:
            continue
        problem = Circle(flow, points, lobes, state_scales, np.array(values), states[0].copy())
        phases = problem.angles[:, None] * k
        w = np.concatenate([np.ones((points, 1)), np.cos(phases), np.sin(phases)], axis=1) @ fit
        return problem, problem.unknowns(w, rotation, values[-1])
    return None


def images(problem: Circle, point: Point) -> Task[list[Array]]:
    """w [points, states] of a circle of the map over several lobes and of its images
    under the map over one lobe: the same motion, begun one lobe later each time."""
    symmetry, orbit = problem.flow.symmetry, point.found
    fold_angle, N = 2.0 * math.pi / symmetry.folds, problem.points
    x, y = symmetry.turned[0]
    circles, states = [orbit.mesh_states], rotated(symmetry, orbit.mesh_states, problem.angles)
    values = np.tile(orbit.values, (N, 1))
    for _ in range(problem.lobes - 1):
        ends = yield Legs(
            states, np.zeros(N), np.full(N, fold_angle), values, np.zeros(N, dtype=bool), TOLERANCE_FACTOR, True
        )
        if not ends.ok.all():
            break
        states = rotated(symmetry, ends.state, -fold_angle)
        w = rotated(symmetry, states, -problem.angles)
        mean = w.mean(axis=0)
        circles.append(rotated(symmetry, w, -math.atan2(mean[y], mean[x])))
    return circles


def _touch_extremum(contact: int, which: int) -> Callable[[Point], float]:
    """The least (0) or greatest (1) value of a contact's function."""
    return lambda point: float(point.found.touches[contact, which])


def circle_test_functions(grazes: Mapping[int, Graze]) -> Callable[[Point, Point], list[TestFunction]]:
    """The function that gives the test functions between two points of a branch of
    circles: of folds, and of the first and last touches."""

    def test_functions(previous: Point, current: Point) -> list[TestFunction]:
        functions = []
        if (previous.tangent[-1] > 0.0) != (current.tangent[-1] > 0.0):
            functions.append(TestFunction(FOLD, lambda point: float(point.tangent[-1])))
        for contact, graze in grazes.items():
            (low1, high1, _), (low2, high2, _) = (previous.found.touches[contact], current.found.touches[contact])
            if (high1 <= 0.0) != (high2 <= 0.0) and graze.reached is not None:
                functions.append(TestFunction(graze.reached, _touch_extremum(contact, 1)))
            elif (low1 > 0.0) != (low2 > 0.0) and graze.lost is not None:
                functions.append(TestFunction(graze.lost, _touch_extremum(contact, 0)))
        return functions

    return test_functions


def with_located_touches(
    problem: Circle, marked: list[LabelledPoint], test_functions: TestFunctions
) -> Task[list[LabelledPoint]]:
    """The points of one side of a branch, with its touches located on circles of
    ``FINEST`` points: a coarse circle passes by the wall at another speed than the
    motion on it. A touch that is not found there keeps its place, and says so."""
    result = list[LabelledPoint]()
    for k, entry in enumerate(marked):
        if entry.label < OWN:
            result.append(entry)
            continue

        def sought(a: Point, b: Point, code: int = entry.label) -> list[TestFunction]:
            return [test for test in test_functions(a, b) if test.code == code]

        found: list[LabelledPoint] = []
        for reach in (1, 2):
            sides = [marked[max(k - reach, 0)].point, marked[min(k + reach, len(marked) - 1)].point]
            sides.sort(key=lambda point: float(point.x[-1]))
            finer, fine = problem, list[Point]()
            for side in sides:
                finer, x = problem.with_points(side.x, FINEST)
                point = yield from corrected_at_parameter(finer, x)
                fine += [] if point is None else [point]
            if len(fine) == 2 and fine[0].x[-1] < fine[1].x[-1]:
                found = yield from special_points(finer, fine[0], fine[1], sought, TOUCH_TOLERANCE)
            if found:
                break
        if found:
            at = found[0].point
            share = (at.x[-1] - sides[0].x[-1]) / (sides[1].x[-1] - sides[0].x[-1])
            s = float(sides[0].s + share * (sides[1].s - sides[0].s))
            result.append(replace(found[0], point=replace(at, s=s)))
        else:
            result.append(replace(entry, words="only on a coarse circle"))
    return sorted(result, key=lambda entry: entry.point.s)
