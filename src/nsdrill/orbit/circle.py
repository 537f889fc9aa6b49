"""Invariant circles of the lobe map: rolling over lobes, a motion on a torus.

A circle is u(theta) = R(theta) w(theta), with R the turn of the frame; the map over m
lobes takes it to u(theta + rho). The unknowns are w at N angles and the rotation rho; a
phase condition, that w does not turn on average, takes rho's equation. Between the
angles w is its trigonometric interpolant.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import FOLD
from nsdrill.models.base import Symmetry
from nsdrill.orbit.arclength import Point, Reading, Steps, Test
from nsdrill.orbit.flow import Flow, Legs
from nsdrill.orbit.frame import turned, turning
from nsdrill.orbit.labels import Graze
from nsdrill.orbit.periodic import Orbit

Array = np.ndarray[Any, np.dtype[np.float64]]
POINTS = (11, 21)  # on the circle; more where fewer leave too much
RETURNS = 240  # of the lobe map, that a circle is fitted to
FEWEST_RETURNS = 40  # to fit a circle to
SLACK = 30.0  # of the integration's tolerance: interpolation along a circle errs by far more
# of the natural scale of a number, for derivatives by it: the tolerance asks for a
# longer one
DIFFERENCE = 1e-3
MISFIT = 0.3  # of the fit, in natural scales
TAIL = 0.03  # of the highest harmonics: a circle with more is not smooth enough


def shift(points: int, angle: float) -> tuple[Array, Array]:
    """The matrix that takes values at ``points`` equal angles (an odd number) to those
    of their trigonometric interpolant at angles greater by ``angle``, and its
    derivative by the angle."""
    t = angle + 2.0 * math.pi * (np.arange(points)[:, None] - np.arange(points)[None, :]) / points
    k = np.arange(1, points // 2 + 1)
    phase = t[..., None] * k
    return (1.0 + 2.0 * np.cos(phase).sum(axis=-1)) / points, -2.0 * (k * np.sin(phase)).sum(
        axis=-1
    ) / points


@dataclass(frozen=True)
class Circle:
    """Invariant circles. The unknowns are the free states of w at ``points`` equal
    angles, over ``size`` [free], the rotation [rad], and the last of ``values`` over
    its scale."""

    flow: Flow
    points: int
    lobes: int
    size: Array
    values: Array
    fixed: Array
    slack = SLACK

    @property
    def fold(self) -> float:
        """By how much the drive turns in the map [rad]."""
        return 2.0 * math.pi * self.lobes / self.flow.symmetry.folds

    @property
    def angles(self) -> Any:
        return 2.0 * math.pi * np.arange(self.points) / self.points

    def unknowns(self, w: Array, rotation: float, number: float) -> Array:
        """``x`` from w [points, states], the rotation [rad] and the number
        continued."""
        scaled = w[:, list(self.flow.symmetry.free)] / (self.size * math.sqrt(self.points))
        return np.concatenate([scaled.ravel(), [rotation, number / self.flow.scales[-1]]])

    def w(self, x: Array) -> Array:
        """The states w at the angles, shape (points, states)."""
        made = np.tile(self.fixed, (self.points, 1))
        made[:, list(self.flow.symmetry.free)] = x[:-2].reshape(self.points, -1) * (
            self.size * math.sqrt(self.points)
        )
        return made

    def numbers(self, x: Array) -> Array:
        """The values of what is continued, the last from ``x``."""
        return np.concatenate([self.values[:-1], [x[-1] * self.flow.scales[-1]]])

    def read(self, x: Array) -> Steps[Reading | None]:
        flow, N = self.flow, self.points
        symmetry, free = flow.symmetry, list(flow.symmetry.free)
        w, rotation, values = self.w(x), float(x[-2]), self.numbers(x)
        change = np.zeros(len(values))
        change[-1] = h = DIFFERENCE * flow.scales[-1]
        three = np.repeat(np.stack([values, values + change, values - change]), N, axis=0)
        states = turned(symmetry, w, self.angles)
        ends = yield Legs(
            np.tile(states, (3, 1)),
            np.zeros(3 * N),
            np.full(3 * N, self.fold),
            three,
            np.arange(3 * N) < N,
            SLACK,
            True,
        )
        if not ends.ok.all():
            return None
        back = -(np.tile(self.angles, 3) + rotation + self.fold)
        end = turned(symmetry, ends.state, back)
        n, share = len(free), math.sqrt(N)
        scale = self.size * share
        moved, by_angle = shift(N, rotation)
        flat = w[:, free] / scale
        residual = np.zeros(N * n + 1)
        residual[:-1] = (end[:N][:, free] / scale - moved @ flat).ravel()
        place = free.index(symmetry.turned[0][1])
        residual[-1] = flat[:, place].sum() * (share / N)
        jacobian = np.zeros((N * n + 1, N * n + 2))
        jacobian[:-1, :-2] = -np.kron(moved, np.eye(n))
        # R(-theta - rho) M R(theta), of each point
        columns = turned(
            symmetry, np.swapaxes(ends.monodromy[:N], 1, 2), np.asarray(back[:N, None])
        )
        blocks = np.swapaxes(columns, 1, 2)
        along = turned(symmetry, np.tile(np.eye(flow.states), (N, 1, 1)), self.angles[:, None])
        blocks = np.einsum("kij,klj->kil", blocks, along)[:, free][:, :, free] * (
            scale / scale[:, None]
        )
        for k in range(N):
            jacobian[k * n : (k + 1) * n, k * n : (k + 1) * n] += blocks[k]
        turn_rate = -turning(symmetry, end[:N])[:, free] / scale
        jacobian[:-1, -2] = (turn_rate - by_angle @ flat).ravel()
        jacobian[:-1, -1] = (
            (end[N : 2 * N] - end[2 * N :])[:, free] / scale * (flow.scales[-1] / (2 * h))
        ).ravel()
        jacobian[-1, place : N * n : n] = share / N
        if not np.isfinite(jacobian).all():
            return None
        touches = np.stack(
            [
                ends.touches[:N, :, 0].min(axis=0),
                ends.touches[:N, :, 1].max(axis=0),
                ends.touches[:N, :, 2].mean(axis=0),
            ],
            axis=-1,
        )
        period = float(ends.duration[0])
        wrapped = math.remainder(rotation, 2.0 * math.pi)

        def found() -> Orbit:
            multipliers = self._multipliers(blocks, rotation)
            return Orbit(
                states[0], values, period, multipliers, touches, 1, None, wrapped, w, tuple(free)
            )

        return Reading(residual, jacobian, found)

    def _multipliers(self, blocks: Array, rotation: float) -> Array:
        """Of the eigenvalues of the linearised map of the circle, of which each
        multiplier has ``points``, turned about zero, those whose vectors have the
        lowest harmonics."""
        N, n = self.points, blocks.shape[1]
        back, _ = shift(N, -rotation)
        whole = np.zeros((N * n, N * n))
        for k in range(N):
            whole[:, k * n : (k + 1) * n] = np.kron(back[:, k : k + 1], blocks[k])
        values, vectors = np.linalg.eig(whole)
        waves = np.abs(np.fft.fft(vectors.reshape(N, n, -1), axis=0)) ** 2
        harmonic = np.abs(np.fft.fftfreq(N, 1.0 / N))
        mean = np.einsum("k,kij->j", harmonic, waves) / np.maximum(waves.sum(axis=(0, 1)), 1e-300)
        return np.asarray(values[np.argsort(mean, kind="stable")[:n]])

    def moved(self, x: Array) -> Circle:
        return self


def tail_of(orbit: Orbit) -> float:
    """The share of the highest two harmonics in what varies along a circle, the largest
    of all states."""
    assert orbit.pieces is not None
    w = orbit.pieces[:, list(orbit.free)]
    waves = np.abs(np.fft.rfft(w - w.mean(axis=0), axis=0)) * 2.0 / len(w)
    return float(
        np.max(
            waves[-2:].max(axis=0)
            / np.maximum(waves.max(axis=0), 1e-4 * np.abs(w).max(axis=0) + 1e-12)
        )
    )


def ends_of(symmetry: Symmetry) -> Callable[[Point, Point], str]:
    """The function that gives the word for the end of a branch of circles: where one
    has shrunk to a point, beyond which they come again with the other sign, and where
    the last one is not smooth."""
    place = symmetry.turned[0][0]

    def ended(here: Point, there: Point) -> str:
        before, after = (float(point.found.pieces[:, place].mean()) for point in (here, there))
        if before * after < 0.0:
            return "shrunk"
        rough = tail_of(there.found) > 3.0 * TAIL and tail_of(here.found) > TAIL
        return "kinks" if rough else ""

    return ended


def fitted_circle(
    flow: Flow, state: Array, values: Array, lobes: tuple[int, ...]
) -> Steps[tuple[Circle, Array, list[Array]] | None]:
    """The problem and the unknowns of the circle that a settled motion through
    ``state`` seems to fill at every lobe, or else at every second, third, ... of
    ``lobes``, and the mean w [states] of it and of its images under the map over one
    lobe; None where it fills none."""
    symmetry = flow.symmetry
    fold = 2.0 * math.pi / symmetry.folds
    angle, every = np.array([fold]), values[None]
    made = [state]
    for _ in range(RETURNS):
        ends = yield Legs(
            made[-1][None], np.zeros(1), angle, every, np.zeros(1, dtype=bool), SLACK, True
        )
        if not ends.ok[0]:
            return None
        made.append(turned(symmetry, ends.state, -fold)[0])
    for number in lobes:
        if len(made) < FEWEST_RETURNS * number:
            continue
        fitted = _fitted(flow, np.stack(made[::number]), values, number)
        if fitted is not None:
            problem, x = fitted
            beside = [
                _fitted(flow, np.stack(made[k::number]), values, number) for k in range(1, number)
            ]
            return (
                problem,
                x,
                [one.w(at).mean(axis=0) for one, at in [fitted, *filter(None, beside)]],
            )
    return None


def _fitted(flow: Flow, states: Array, values: Array, lobes: int) -> tuple[Circle, Array] | None:
    """The circle through these returns, if they lie on one."""
    symmetry, free = flow.symmetry, list(flow.symmetry.free)
    x, y = symmetry.turned[0]
    radius = np.hypot(states[:, x], states[:, y])
    if radius.min() < 0.2 * radius.max():
        return None
    angle = np.arctan2(states[:, y], states[:, x])
    steps = np.diff(angle)
    # Rotation about a mean step that may lie anywhere on the circle.
    mean = math.atan2(np.sin(steps).sum(), np.cos(steps).sum())
    steps = mean + np.remainder(steps - mean + math.pi, 2.0 * math.pi) - math.pi
    t = (np.arange(len(steps)) + 1.0) / (len(steps) + 1.0)
    weight = np.exp(-1.0 / (t * (1.0 - t)))  # Das et al. 2017: converges faster than any power
    rotation = float(weight @ steps / weight.sum())
    theta = rotation * np.arange(len(states))
    size = flow.state_scales(values[None])[0][free]
    offset = math.atan2(np.sin(angle - theta).sum(), np.cos(angle - theta).sum())
    theta = theta + offset
    w = turned(symmetry, states, -theta)
    for points in POINTS:
        if 2 * points > len(states):
            continue
        k = np.arange(1, points // 2 + 1)
        waves = theta[:, None] * k
        basis = np.concatenate([np.ones((len(theta), 1)), np.cos(waves), np.sin(waves)], axis=1)
        fit, *_ = np.linalg.lstsq(basis, w, rcond=1e-10)
        if float(np.max(np.abs(basis @ fit - w)[:, free] / size)) > MISFIT:
            continue
        problem = Circle(flow, points, lobes, size, np.array(values), states[0].copy())
        waves = problem.angles[:, None] * k
        there = np.concatenate([np.ones((points, 1)), np.cos(waves), np.sin(waves)], axis=1) @ fit
        return problem, problem.unknowns(there, rotation, values[-1])
    return None


def images(problem: Circle, point: Point) -> Steps[list[Array]]:
    """Of a circle of the map over several lobes w [points, states] on its images under
    the map over one lobe, itself first: the same motion, begun a lobe later."""
    symmetry, orbit = problem.flow.symmetry, point.found
    fold, N = 2.0 * math.pi / symmetry.folds, problem.points
    first, second = symmetry.turned[0]
    made, states = [orbit.pieces], turned(symmetry, orbit.pieces, problem.angles)
    values = np.tile(orbit.values, (N, 1))
    for _ in range(problem.lobes - 1):
        ends = yield Legs(
            states, np.zeros(N), np.full(N, fold), values, np.zeros(N, dtype=bool), SLACK, True
        )
        if not ends.ok.all():
            break
        states = turned(symmetry, ends.state, -fold)
        w = turned(symmetry, states, -problem.angles)
        mean = w.mean(axis=0)
        made.append(turned(symmetry, w, -math.atan2(mean[second], mean[first])))
    return made


def _touch(contact: int, which: int) -> Callable[[Point], float]:
    """The least (0) or greatest (1) value of a contact's function."""
    return lambda point: float(point.found.touches[contact, which])


def tests_of_circle(grazes: Mapping[int, Graze]) -> Callable[[Point, Point], list[Test]]:
    """The tests for special points of circles: folds, and the first and last
    touches."""

    def tests(here: Point, there: Point) -> list[Test]:
        found = []
        if (here.tangent[-1] > 0.0) != (there.tangent[-1] > 0.0):
            found.append(Test(FOLD, lambda point: float(point.tangent[-1])))
        for contact, graze in grazes.items():
            (low1, high1, _), (low2, high2, _) = (
                here.found.touches[contact],
                there.found.touches[contact],
            )
            if (high1 <= 0.0) != (high2 <= 0.0) and graze.reached is not None:
                found.append(Test(graze.reached, _touch(contact, 1)))
            elif (low1 > 0.0) != (low2 > 0.0) and graze.lost is not None:
                found.append(Test(graze.lost, _touch(contact, 0)))
        return found

    return tests
