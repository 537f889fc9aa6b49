"""Test functions of the special points of a branch: bifurcations from the multipliers,
grazing from the touches.

Codes and two-letter names are those of AUTO-07p; codes above 100 are nsdrill's own.

| special point     | condition                                                        |
| ----------------- | ---------------------------------------------------------------- |
| fold              | the continuation parameter has an extremum                       |
| period doubling   | the number of real multipliers below -1 changes                  |
| branch point      | the number of real multipliers above 1 changes without a fold    |
| torus (or Hopf)   | a complex pair crosses the unit circle; the real numbers stay    |

Signs of determinants alone would take a pair of reciprocal real multipliers for a torus
bifurcation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from nsdrill.analysis.bifurcations import (
    BIFURCATIONS,
    BRANCH,
    CIRCLE,
    CYCLE,
    DOUBLING,
    EQUILIBRIUM,
    FOLD,
    HOPF,
    OWN,
    TORUS,
)
from nsdrill.data import Array
from nsdrill.orbit.branch import Branch
from nsdrill.orbit.circle import Circle
from nsdrill.orbit.flow import Flow, Task, advance
from nsdrill.orbit.newton import Point, corrected_at_parameter
from nsdrill.orbit.periodic import Cycle, Periodic
from nsdrill.orbit.shooting import UNSTABLE_TOLERANCE, Orbit, monodromy_product
from nsdrill.orbit.special import LabelledPoint, Stability, TestFunction, TestFunctions, special_points

REAL_TOLERANCE = 1e-7  # of the imaginary part of a real multiplier, over its modulus
FINEST = 41  # points of the circles on which touches are located
TOUCH_TOLERANCE = 1e-3  # of their arclength there


@dataclass(frozen=True)
class Graze:
    """The codes of the labels where a contact is ``reached`` or ``lost``, None where
    that is no event. ``counted``: a change of how often it begins in a period is an
    event too."""

    reached: int | None
    lost: int | None
    counted: bool = True


def multiplier_counts(orbit: Orbit) -> tuple[int, int, int]:
    """The numbers of nontrivial multipliers that are real and above 1, real and below
    -1, and complex and outside the unit circle."""
    multipliers = orbit.nontrivial
    is_real = np.abs(multipliers.imag) <= REAL_TOLERANCE * np.maximum(np.abs(multipliers), 1.0)
    value = multipliers.real
    above, below = int(np.sum(is_real & (value > 1.0))), int(np.sum(is_real & (value < -1.0)))
    return above, below, int(np.sum(~is_real & (np.abs(multipliers) > 1.0)))


def unstable_beside(entry: LabelledPoint) -> int:
    """The number of multipliers of a point outside the unit circle, without those that
    are on it at a bifurcation: that of the more stable side."""
    multipliers = entry.point.found.nontrivial
    if entry.label in BIFURCATIONS:
        is_pair = entry.label in (TORUS, HOPF)
        real = -1.0 if entry.label == DOUBLING else 1.0
        distance = np.abs(np.abs(multipliers) - 1.0 if is_pair else multipliers - real)
        multipliers = np.delete(multipliers, np.argsort(distance)[: 2 if is_pair else 1])
    return int(np.sum(np.abs(multipliers) > 1.0 + UNSTABLE_TOLERANCE))


def _signed_distance(shift: float) -> Callable[[Point], float]:
    """A function of points with the sign of the determinant of the monodromy less
    ``shift`` times the identity, without the trivial multipliers, and the modulus of
    the smallest factor."""

    def value(point: Point) -> float:
        shifted = point.found.nontrivial - shift
        moduli = np.maximum(np.abs(shifted), 1e-300)
        return float(np.sign(np.prod(shifted / moduli).real) * np.min(moduli) if len(shifted) else 1.0)

    return value


def _pair_margin(rank: int) -> Callable[[Point], float]:
    """A function of points: the modulus less 1 of the complex multiplier of this
    ``rank``, from 0 for the largest."""

    def value(point: Point) -> float:
        multipliers = point.found.nontrivial
        pairs = multipliers[np.abs(multipliers.imag) > REAL_TOLERANCE * np.maximum(np.abs(multipliers), 1.0)]
        moduli = np.sort(np.abs(pairs))[::-1]
        return float(moduli[rank] - 1.0) if len(moduli) > rank else -1.0

    return value


def test_functions_of(grazes: Mapping[int, Graze], motion: str) -> TestFunctions:
    """The function that gives the test functions of the special points between two
    points of a branch of a kind of ``motion``. ``grazes`` has the grazing events of the
    contacts, by place. Of a circle neither the multipliers nor the numbers of touches
    are exact enough to tell a special point."""
    is_circle = motion == CIRCLE

    def test_functions(previous: Point, current: Point) -> list[TestFunction]:
        functions = []
        before, after = previous.found, current.found
        is_fold = (previous.tangent[-1] > 0.0) != (current.tangent[-1] > 0.0)
        if is_fold:
            functions.append(TestFunction(FOLD, lambda point: float(point.tangent[-1])))
        if not is_circle:
            pair = HOPF if motion == EQUILIBRIUM else TORUS
            functions += _bifurcations(multiplier_counts(before), multiplier_counts(after), is_fold, pair)
        for contact, graze in grazes.items():
            counted = graze.counted and not is_circle
            functions += _grazing(before.touches[contact], after.touches[contact], contact, graze, counted)
        return functions

    return test_functions


def _bifurcations(
    before: tuple[int, int, int], after: tuple[int, int, int], is_fold: bool, pair: int
) -> list[TestFunction]:
    """The test functions of multipliers between two points, from their counts there;
    ``pair`` is the label where a complex pair crosses the unit circle."""
    (above1, below1, out1), (above2, below2, out2) = before, after
    functions = []
    if (below1 + below2) % 2:
        functions.append(TestFunction(DOUBLING, _signed_distance(-1.0)))
    if (above1 + above2) % 2 and not is_fold:
        functions.append(TestFunction(BRANCH, _signed_distance(1.0)))
    if out1 != out2 and above1 == above2 and below1 == below2:
        functions.append(TestFunction(pair, _pair_margin(min(out1, out2))))
    return functions


def _grazing(before: np.ndarray, after: np.ndarray, contact: int, graze: Graze, counted: bool) -> list[TestFunction]:
    """The test function of grazing of one contact between two points, from its touches
    there; none where they have no such event between them."""
    (low1, high1, n1), (low2, high2, n2) = before, after
    never1, never2, always1, always2 = high1 <= 0.0, high2 <= 0.0, low1 > 0.0, low2 > 0.0
    if never1 != never2 and graze.reached is not None:
        return [TestFunction(graze.reached, lambda point: float(point.found.touches[contact, 1]))]
    if always1 != always2 and graze.lost is not None:
        return [TestFunction(graze.lost, lambda point: float(point.found.touches[contact, 0]))]
    code = graze.reached if graze.reached is not None else graze.lost
    if not counted or n1 == n2 or never1 or never2 or always1 or always2 or code is None:
        return []
    level, words = 0.5 * (n1 + n2), f"{int(n1)} to {int(n2)} touches a period"
    return [TestFunction(code, lambda point: float(np.sign(point.found.touches[contact, 2] - level)), words, True)]


def kink_predicate(contacts: int) -> Callable[[Orbit, Orbit], bool]:
    """The function that says whether a kink lies between two motions: whether any of
    the first ``contacts`` begins another number of times in a period, or is closed, or
    open, at all times in only one of them."""

    def has_kink(before: Orbit, after: Orbit) -> bool:
        first, second = before.touches[:contacts], after.touches[:contacts]
        return bool(np.any(first[:, 2] != second[:, 2]) or np.any((first[:, :2] > 0.0) != (second[:, :2] > 0.0)))

    return has_kink


def stability_of(trivial: int) -> Stability:
    """The stability of motions with this number of ``trivial`` multipliers: the margins
    are the logarithms of the moduli of the others."""

    def margins(monodromies: np.ndarray) -> np.ndarray:
        multipliers = np.linalg.eigvals(monodromies)
        order = np.argsort(np.abs(multipliers - 1.0), axis=-1)[:, trivial:]
        moduli = np.abs(np.take_along_axis(multipliers, order, axis=-1))
        return np.asarray(np.log(np.maximum(-np.sort(-moduli, axis=-1), 1e-300)))

    return Stability(lambda orbit: orbit.monodromy, margins)


def critical_vector(orbit: Orbit, multiplier: float) -> np.ndarray:
    """The unit eigenvector, in natural scales, of a critical ``multiplier`` (1 or -1):
    the right singular vector of the smallest singular value of the shifted
    monodromy."""
    assert orbit.monodromy is not None
    _, _, right = np.linalg.svd(orbit.monodromy - multiplier * np.eye(len(orbit.monodromy)))
    return np.asarray(right[-1])


def with_located_touches(
    problem: Circle, marked: list[LabelledPoint], test_functions: TestFunctions
) -> Task[list[LabelledPoint]]:
    """The points of one side of a branch, with its touches located on circles of
    ``FINEST`` points: a coarse circle passes by the wall at another speed than the
    motion on it. A touch that is not found there keeps its place, and says so."""
    result = list[LabelledPoint]()
    for k, entry in enumerate(marked):
        if entry.label >= OWN:
            for reach in (1, 2):
                sides = [marked[max(k - reach, 0)].point, marked[min(k + reach, len(marked) - 1)].point]
                found = yield from _finer_touch(problem, sides, entry.label, test_functions)
                if found is not None:
                    break
            entry = replace(entry, words="only on a coarse circle") if found is None else found
        result.append(entry)
    return sorted(result, key=lambda entry: entry.point.s)


def _finer_touch(
    problem: Circle, sides: list[Point], code: int, test_functions: TestFunctions
) -> Task[LabelledPoint | None]:
    """The touch with the label ``code`` between circles at two points, of ``FINEST``
    points; None where it is not found."""
    low, high = sorted(sides, key=lambda point: float(point.x[-1]))
    fine = list[Point]()
    for side in (low, high):
        finer, x = problem.with_points(side.x, FINEST)
        point = yield from corrected_at_parameter(finer, x)
        fine += [] if point is None else [point]
    if len(fine) < 2 or not fine[0].x[-1] < fine[1].x[-1]:
        return None

    def sought(a: Point, b: Point) -> list[TestFunction]:
        return [test for test in test_functions(a, b) if test.code == code]

    found = yield from special_points(finer, fine[0], fine[1], sought, TOUCH_TOLERANCE)
    if not found:
        return None
    point = found[0].point
    share = (point.x[-1] - low.x[-1]) / (high.x[-1] - low.x[-1])
    return replace(found[0], point=replace(point, s=float(low.s + share * (high.s - low.s))))


# Floquet multipliers of the points of finished branches, with a smaller tolerance than
# that of the continuation.
# The error of a deviation is that of the instant at which the motion reaches a contact:
# with the tolerance that suffices for Newton's method, multipliers are wrong by 1e-8 to
# 1e-7. One monodromy of each point at a hundredth of the tolerance costs a fiftieth of
# the continuation. Close to grazing, multipliers depend on the orbit so strongly that the
# orbit itself would need the smaller tolerance: there they keep their values.


TOLERANCE_RATIO = 0.01  # to the tolerance of the flow
# relative, of finer multipliers: with a larger one they are those of another orbit
MAX_DIFFERENCE = 1e-6
BATCH_POINTS = 100  # whose segments make a batch


def problem_of(flow: Flow, branch: Branch, orbit: Orbit) -> Periodic | Cycle:
    """The problem that an orbit of a branch solves."""
    if branch.motion == CYCLE:
        return Cycle.at(flow, orbit.period, orbit.values, orbit.state, len(orbit.mesh_states))
    return Periodic.at(flow, branch.lobes, orbit.values, orbit.state, len(orbit.mesh_states))


def finer_multipliers(flow: Flow, branches: list[Branch], poll: Callable[[], None] = lambda: None) -> list[Array]:
    """The multipliers [free states] of all points of all branches, in order. Those of
    circles keep their values, as their interpolation error is larger. ``poll`` is
    called once a batch, and may raise to stop."""
    flow = Flow(flow.equations, rtol=TOLERANCE_RATIO * flow.rtol, workers=flow.workers)
    points = [(branch, entry.point.found) for branch in branches for entry in branch.marked]
    multipliers = [orbit.multipliers for _, orbit in points]
    fine = [index for index, (branch, _) in enumerate(points) if branch.motion != CIRCLE]
    for first in range(0, len(fine), BATCH_POINTS):
        tasks = {index: _finer(flow, *points[index]) for index in fine[first : first + BATCH_POINTS]}
        for index, found in advance(flow, tasks, poll).items():
            multipliers[index] = found
    return multipliers


def _finer(flow: Flow, branch: Branch, orbit: Orbit) -> Task[Array]:
    """The multipliers of an orbit with the tolerance of ``flow``, where they are those of
    the same orbit."""
    problem = problem_of(flow, branch, orbit)
    values, periods = orbit.values[None], np.array([orbit.period])
    ends = yield problem.legs(orbit.mesh_states[None], values, periods, (True,))
    _, monodromies = problem.shots(ends, values, periods)
    monodromy = monodromy_product(monodromies[0] * (problem.state_scales / problem.state_scales[:, None]))
    if not (ends.ok.all() and np.isfinite(monodromy).all()):
        return orbit.multipliers
    coarse, finer = orbit.multipliers, np.linalg.eigvals(monodromy)
    distances = np.abs(coarse[:, None] - finer[None, :]) / np.maximum(np.abs(coarse[:, None]), 1.0)
    return finer if np.max(distances.min(axis=1)) < MAX_DIFFERENCE else coarse
