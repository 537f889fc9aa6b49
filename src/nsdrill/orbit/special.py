"""Special points between the points of a branch: zeros of test functions, and intervals
of instability that are narrower than a step. Test functions tell bifurcations from the
multipliers, grazing from the touches.

Codes and two-letter names are those of AUTO-07p; codes above 100 are nsdrill's own.

| special point     | condition                                                        |
| ----------------- | ---------------------------------------------------------------- |
| fold              | the continuation parameter has an extremum, no branch crosses    |
| period doubling   | the number of real multipliers below -1 changes                  |
| branch point      | the number of real multipliers above 1 changes without a fold    |
| torus (or Hopf)   | a complex pair crosses the unit circle; the real numbers stay    |
| any of the last   | the number outside the unit circle changes in another way: where |
| three             | the multiplier of that rank crosses it, by what it is there      |

Signs of determinants alone would take a pair of reciprocal real multipliers for a torus
bifurcation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from nsdrill.analysis.bifurcations import (
    BIFURCATIONS,
    BRANCH,
    CIRCLE,
    DOUBLING,
    EQUILIBRIUM,
    FOLD,
    HOPF,
    NOT_DECIDED,
    TORUS,
    TOUCHES,
)
from nsdrill.data import Array
from nsdrill.orbit.flow import Task
from nsdrill.orbit.newton import NEWTON_TOLERANCE, Point, Problem, corrected_between
from nsdrill.orbit.shooting import UNSTABLE_TOLERANCE, Orbit
from nsdrill.records import dataclass

LOCATION_TOLERANCE = 1e-8  # of the arclength of a special point
UNRESOLVED = "not located more closely"
ELSEWHERE = (0.4, 0.65)  # of the way between two points, where Newton's method fails at the place that is due
# of the search between two points for an interval of instability:
MIN_GAP = 1e-6  # between points that are told apart, in arclength
MAX_LOOKS = 6  # points that are computed
SHARES = (np.arange(32) + 0.5) / 32  # of the way between two points, where the monodromy is interpolated
STENCIL = 4  # points that it is interpolated from
MIN_MARGIN = 1e-6  # of a multiplier that is not on the unit circle
REAL_TOLERANCE = 1e-7  # of the imaginary part of a real multiplier, over its modulus
# Arclength between a fold and a branch point that are one: beside a branch point Newton's method finds points of
# either branch, and its place is not known better.
SAME_PLACE = 0.01
SAME_PARAMETER = 10.0 * NEWTON_TOLERANCE
PITCHFORK = "pitchfork, where the branch turns back"
PITCHFORK_OR_FOLD = "pitchfork, or a fold beside a branch point: too close to tell"
# A branch that keeps the parameter to this, over the arclength, is a family of motions at one value of it, as where
# energy is conserved. All of them have a multiplier 1: it has neither folds nor branch points that are more than noise.
VERTICAL = 1e-8


@dataclass(frozen=True)
class TestFunction:
    """A test function of the special point with the label ``code``: ``value`` of a
    point changes its sign there. It ``jumps`` where it has only a sign. ``words`` say
    what the label leaves open."""

    code: int
    value: Callable[[Point], float]
    words: str = ""
    jumps: bool = False
    label: Callable[[Point], int] | None = None
    """Of the point itself, where only that tells its code."""


@dataclass(frozen=True)
class LabelledPoint:
    """A point of a branch with its label, 0 for none, and its note in ``words``."""

    point: Point
    label: int = 0
    words: str = ""


TestFunctions = Callable[[Point, Point], list[TestFunction]]


@dataclass(frozen=True)
class Stability:
    """How the stability of solutions is computed: the ``monodromy`` [n, n] of a solution,
    and the ``margins`` [k, m] of monodromies [k, n, n], of which each is positive for an
    unstable direction, the largest first."""

    monodromy: Callable[[Orbit], Array]
    margins: Callable[[Array], Array]

    def of(self, points: list[Point]) -> Array:
        """The margins of points [points, m]."""
        return self.margins(np.stack([self.monodromy(point.found) for point in points]))


def special_points(
    problem: Problem,
    previous: Point,
    current: Point,
    test_functions: TestFunctions,
    tolerance: float = LOCATION_TOLERANCE,
) -> Task[list[LabelledPoint]]:
    """The special points between two points, in order, to a ``tolerance`` of the
    arclength."""
    points = []
    for test in test_functions(previous, current):
        found = yield from _located_zero(problem, previous, current, test, tolerance)
        if found is not None:
            point, is_resolved = found
            code = test.code if test.label is None else test.label(point)
            points.append(LabelledPoint(point, code, test.words if is_resolved else UNRESOLVED))
    return _with_pitchforks(sorted(points, key=lambda entry: entry.point.s))


def _with_pitchforks(points: list[LabelledPoint]) -> list[LabelledPoint]:
    """The special points of a step, in order; a branch point at which the parameter turns back
    is one point: a pitchfork, at which no motion vanishes."""
    turns = [entry for entry in points if entry.label == FOLD]
    crossings = [entry for entry in points if entry.label == BRANCH]

    def at(entry: LabelledPoint, others: list[LabelledPoint]) -> LabelledPoint | None:
        return next((one for one in others if abs(entry.point.s - one.point.s) < SAME_PLACE), None)

    found = []
    for entry in points:
        if entry.label == BRANCH and at(entry, turns) is not None:
            continue
        crossing = at(entry, crossings) if entry.label == FOLD else None
        found.append(entry if crossing is None else _pitchfork(entry, crossing))
    return found


def _pitchfork(fold: LabelledPoint, crossing: LabelledPoint) -> LabelledPoint:
    """The branch point at a ``fold``. It may be a fold beside it unless both are located, at one
    parameter within the error of Newton's method."""
    is_located = UNRESOLVED not in (fold.words, crossing.words)
    is_one = abs(float(fold.point.x[-1] - crossing.point.x[-1])) < SAME_PARAMETER
    return replace(fold, label=BRANCH, words=PITCHFORK if is_located and is_one else PITCHFORK_OR_FOLD)


@dataclass(frozen=True)
class _Place:
    """A ``point`` at the distance ``s`` along a chord, where a test function has a
    ``value``."""

    point: Point
    s: float
    value: float


def _located_zero(
    problem: Problem, previous: Point, current: Point, test: TestFunction, tolerance: float
) -> Task[tuple[Point, bool] | None]:
    """The zero of ``test``, by the method of Chandrupatla (1997), bisection and
    inverse quadratic interpolation, and whether it is resolved to the ``tolerance``.
    None where both ends have the same sign, a value is not finite, or Newton's method
    fails at once. Where it fails at one place only, as it may at a contact, the search
    goes on at another. (SciPy's methods call a function; this value is waited for.)"""
    length = float(previous.tangent @ (current.x - previous.x))
    a, b = _Place(current, length, test.value(current)), _Place(previous, 0.0, test.value(previous))
    if not (np.isfinite(a.value) and np.isfinite(b.value)) or a.value * b.value > 0.0:
        return None
    fraction, best = 0.5, None
    for _ in range(60):
        low, high = sorted((a, b), key=lambda place: place.s)
        distances = tuple(a.s + share * (b.s - a.s) for share in (fraction, *ELSEWHERE))
        found = yield from corrected_between(problem, previous, low.point, high.point, distances)
        if found is None:
            break
        s, point = found
        new = _Place(point, s, test.value(point))
        if not np.isfinite(new.value):
            return None
        is_beside_a = (new.value > 0.0) == (a.value > 0.0)
        c, b = (a, b) if is_beside_a else (b, a)
        a = new
        best = (a if abs(a.value) < abs(b.value) else b).point
        width = abs(b.s - a.s)
        is_resolved = test.jumps and abs(a.point.x[-1] - b.point.x[-1]) < 10.0 * LOCATION_TOLERANCE
        if width < tolerance or a.value == 0.0 or is_resolved:
            return best, True
        least = 0.5 * tolerance / width
        fraction = min(max(_next_share(a, b, c), least), 1.0 - least)
    return None if best is None else (best, False)


def _next_share(a: _Place, b: _Place, c: _Place) -> float:
    """The share of the way from ``a`` to ``b`` at which Chandrupatla's method looks
    next; ``c`` is the place that was left out last."""
    xi = (a.s - b.s) / (c.s - b.s)
    phi = (a.value - b.value) / (c.value - b.value) if c.value != b.value else 2.0
    if not (phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi):
        return 0.5
    fa, fb, fc = a.value, b.value, c.value
    return fa / (fb - fa) * fc / (fb - fc) + (c.s - a.s) / (b.s - a.s) * fa / (fc - fa) * fb / (fc - fb)


def stencil_around(nodes: list[LabelledPoint], place: int) -> tuple[list[Point], int]:
    """The nodes from which a monodromy between the node ``place`` and the next is
    interpolated, and the number of the former among them. A special point may be a
    kink: none lies beyond one."""

    def gap(low: int) -> float:
        """The distance of the node ``low`` from the next."""
        gap = nodes[low + 1].point.s - nodes[low].point.s
        return gap if gap > MIN_GAP else np.inf

    low, high = place, place + 1
    while high - low < STENCIL - 1:
        left = np.inf if low == 0 or nodes[low].label else gap(low - 1)
        right = np.inf if high + 1 == len(nodes) or nodes[high].label else gap(high)
        if np.isinf(min(left, right)):
            break
        low, high = (low - 1, high) if left <= right else (low, high + 1)
    return [entry.point for entry in nodes[low : high + 1]], place - low


def instability_interval(
    problem: Problem, base: Point, nodes: list[Point], place: int, test_functions: TestFunctions, stability: Stability
) -> Task[list[LabelledPoint]]:
    """An interval between the node ``place`` and the next in which another number of
    directions is unstable: a point inside and the special points on both sides; empty
    where none is found. The step there sets out from ``base`` with ``problem``.

    Multipliers that meet leave the unit circle for as long as they keep together, and
    none of the points around need show it. The monodromy, though, is smooth: where one
    that is interpolated has another number of margins above zero, a point is computed,
    and serves to interpolate anew: where the margin is greatest or, where Newton's
    method fails there, at the ends of that stretch, or elsewhere.
    """
    ends = nodes[place], nodes[place + 1]
    # a special point has a margin of about zero
    counts = {int(np.sum(margins > 0.0)) for margins in stability.of([*ends]) if np.min(np.abs(margins)) > MIN_MARGIN}
    if len(counts) != 1:
        return []
    count = counts.pop()
    for _ in range(MAX_LOOKS):
        inner = [node for node in nodes if ends[0].s <= node.s <= ends[1].s]
        found = [_excess(nodes, *pair, count, stability) for pair in pairwise(inner)]
        k = max(range(len(found)), key=lambda k: found[k].max())
        is_other = found[k] > 0.0
        if not is_other.any():
            break
        first, last = inner[k : k + 2]
        at = [float(base.tangent @ (point.x - base.x)) for point in (first, last)]
        shares = SHARES[np.argmax(found[k])], *SHARES[is_other][[0, -1]], *ELSEWHERE
        distances = tuple(share * at[1] + (1.0 - share) * at[0] for share in shares)
        reached = yield from corrected_between(problem, base, first, last, distances)
        if reached is None or not first.s < reached[1].s < last.s:
            break
        point = reached[1]
        margins = stability.of([point])
        if np.sum(margins > 0.0) != count and np.min(np.abs(margins)) > MIN_MARGIN:
            points = yield from special_points(problem, first, point, test_functions)
            points.append(LabelledPoint(point))
            points += yield from special_points(problem, point, last, test_functions)
            return points
        nodes = sorted([*nodes, point], key=lambda node: node.s)
    return []


def _excess(nodes: list[Point], first: Point, last: Point, count: int, stability: Stability) -> Array:
    """The margin that lies inside where ``count`` margins are outside, or the distance
    inside of the least one outside, whichever is greater, at all ``SHARES`` of the way
    between two neighbouring nodes, from monodromies interpolated between the nearest
    nodes."""
    from scipy.interpolate import krogh_interpolate

    near = sorted(nodes, key=lambda node: max(first.s - node.s, node.s - last.s))[:STENCIL]
    s = first.s + (last.s - first.s) * SHARES
    monodromies = np.stack([stability.monodromy(node.found) for node in near])
    margins = stability.margins(krogh_interpolate([node.s for node in near], monodromies, s))
    bounded = np.pad(margins, ((0, 0), (1, 1)), constant_values=((0, 0), (np.inf, -np.inf)))
    return np.asarray(np.maximum(bounded[:, count + 1], -bounded[:, count]))


# Test functions: bifurcations from the multipliers, grazing from the touches.


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
    is_real = ~_is_complex(multipliers)
    value = multipliers.real
    above, below = int(np.sum(is_real & (value > 1.0))), int(np.sum(is_real & (value < -1.0)))
    return above, below, int(np.sum(~is_real & (np.abs(multipliers) > 1.0)))


def circle_tolerance(point: Point) -> float:
    """The error of the modulus of a multiplier on the unit circle: the orbit is known as well as
    its residual says."""
    return max(UNSTABLE_TOLERANCE, point.residual)


def unstable_beside(entry: LabelledPoint, finer: Array) -> int:
    """The number of multipliers of a point outside the unit circle, without those that
    are on it at a bifurcation: that of the more stable side. ``NOT_DECIDED`` where none is
    outside, and one lies on the circle within its error, for which its distance from those with
    a smaller tolerance, ``finer``, stands too."""
    multipliers = entry.point.found.nontrivial
    if entry.label in BIFURCATIONS:
        is_pair = entry.label in (TORUS, HOPF)
        real = -1.0 if entry.label == DOUBLING else 1.0
        distance = np.abs(np.abs(multipliers) - 1.0 if is_pair else multipliers - real)
        multipliers = np.delete(multipliers, np.argsort(distance)[: 2 if is_pair else 1])
    if not len(multipliers):
        return 0
    errors = np.abs(multipliers[:, None] - finer[None, :]).min(axis=1)
    margins, errors = np.abs(multipliers) - 1.0, np.maximum(errors, circle_tolerance(entry.point))
    outside = int(np.sum(margins > errors))
    return NOT_DECIDED if outside == 0 and np.any(margins >= -errors) else outside


def _signed_distance(shift: float) -> Callable[[Point], float]:
    """A function of points with the sign of the determinant of the monodromy less
    ``shift`` times the identity, without the trivial multipliers, and the modulus of
    the smallest factor."""

    def value(point: Point) -> float:
        shifted = point.found.nontrivial - shift
        moduli = np.maximum(np.abs(shifted), 1e-300)
        return float(np.sign(np.prod(shifted / moduli).real) * np.min(moduli) if len(shifted) else 1.0)

    return value


def _is_complex(multipliers: Array) -> Array:
    """Which multipliers are those of a pair."""
    return np.asarray(np.abs(multipliers.imag) > REAL_TOLERANCE * np.maximum(np.abs(multipliers), 1.0))


def _margin(rank: int, *, of_pairs: bool = False) -> Callable[[Point], float]:
    """A function of points: the modulus less 1 of the nontrivial multiplier of this
    ``rank``, from 0 for the largest; of those ``of_pairs`` alone."""

    def value(point: Point) -> float:
        multipliers = point.found.nontrivial
        moduli = np.sort(np.abs(multipliers[_is_complex(multipliers)] if of_pairs else multipliers))[::-1]
        return float(moduli[rank] - 1.0) if len(moduli) > rank else -1.0

    return value


def _label_of_rank(rank: int, pair: int) -> Callable[[Point], int]:
    """A function of points: the label of the nontrivial multiplier of this ``rank`` on
    the unit circle; ``pair`` is that of a complex one."""

    def label(point: Point) -> int:
        multipliers = point.found.nontrivial
        critical = multipliers[np.argsort(-np.abs(multipliers))[rank]]
        if _is_complex(critical):
            return pair
        return BRANCH if critical.real > 0.0 else DOUBLING

    return label


def test_functions_of(
    grazes: Mapping[int, Graze],
    motion: str,
    bends: Callable[[Orbit], bool] | None = None,  # noqa: PT028  # no test of pytest
) -> TestFunctions:
    """The function that gives the test functions of the special points between two
    points of a branch of a kind of ``motion``. ``grazes`` has the grazing events of the
    contacts, by place. Of a circle neither the multipliers nor the numbers of touches
    are exact enough to tell a special point. Of an equilibrium at which the equations are said to
    bend, by ``bends``, the multipliers and the tangent are those of one side, and tell none."""
    is_circle = motion == CIRCLE

    def test_functions(previous: Point, current: Point) -> list[TestFunction]:
        functions = []
        before, after = previous.found, current.found
        is_linear = motion != EQUILIBRIUM or bends is None or not (bends(before) or bends(after))
        is_vertical = max(abs(previous.tangent[-1]), abs(current.tangent[-1])) < VERTICAL
        is_fold = (previous.tangent[-1] > 0.0) != (current.tangent[-1] > 0.0) and not is_vertical
        if is_fold and is_linear:
            functions.append(TestFunction(FOLD, lambda point: float(point.tangent[-1])))
            if previous.orientation * current.orientation < 0.0:
                # Of the multipliers, two crossings between these points, or a pitchfork, do not tell.
                functions.append(TestFunction(BRANCH, lambda point: point.orientation))
        if not is_circle and not is_vertical and is_linear:
            pair = HOPF if motion == EQUILIBRIUM else TORUS
            found = _bifurcations(multiplier_counts(before), multiplier_counts(after), is_fold, pair)
            # What stays on the unit circle, as where energy is conserved, crosses it by errors alone.
            noise = max(circle_tolerance(previous), circle_tolerance(current))
            functions += [one for one in found if max(abs(one.value(previous)), abs(one.value(current))) > noise]
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
        functions.append(TestFunction(pair, _margin(min(out1, out2), of_pairs=True)))
    outside = above1 + below1 + out1, above2 + below2 + out2
    if not functions and not is_fold and outside[0] != outside[1]:
        # several at once, as a symmetry makes them, or a pair that has met on the real axis since
        rank = min(outside)
        functions.append(TestFunction(BRANCH, _margin(rank), label=_label_of_rank(rank, pair)))
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
    level, words = 0.5 * (n1 + n2), f"{int(n1)} to {int(n2)} {TOUCHES}"
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

    def monodromy(orbit: Orbit) -> Array:
        assert orbit.monodromy is not None  # as it is of a circle
        return orbit.monodromy

    return Stability(monodromy, margins)
