"""One side of a branch: followed on more segments where Newton's method fails, until the
motion merges with another, comes back or is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field, replace
from functools import partial

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE, DOUBLING, OWN, PERIODIC
from nsdrill.data import Array
from nsdrill.orbit.arclength import HALF, KNOWN, LEAP, MAX_STEP, MET, NO_CONVERGENCE, SHORTER, HalfBranch, Rules, follow
from nsdrill.orbit.branch import Branch, Key, Stretch, Track
from nsdrill.orbit.circle import Circle, circle_stop
from nsdrill.orbit.flow import Flow, Legs, Task
from nsdrill.orbit.newton import Point, Problem, corrected, corrected_at_parameter, parameter_normal
from nsdrill.orbit.periodic import Cycle, Periodic, corotating_rates, distance_from_cycle, lobe_starts, segment_starts
from nsdrill.orbit.seeds import (
    DUPLICATE_DISTANCE,
    Candidate,
    Kind,
    Orders,
    equal_parts,
    nearest_chord,
    passes_near,
    signatures,
)
from nsdrill.orbit.shooting import Orbit, map_angle, rotated
from nsdrill.orbit.special import (
    LabelledPoint,
    TestFunction,
    TestFunctions,
    kink_predicate,
    special_points,
    stability_of,
    test_functions_of,
)
from nsdrill.records import dataclass

NEAR_PARENT = 6  # points of a branch that may lie near the branch it emanates from
MAX_MULTIPLIER = 1e3  # over one fold, of a motion that can still be followed
MAX_SEGMENTS_PER_LOBE = 8
FINEST = 41  # points of the circles on which touches are located
TOUCH_TOLERANCE = 1e-3  # of their arclength there
SAME_CYCLE = 0.01  # the greatest distance of equal cycles, over their size
EQUAL_HALVES = 0.05  # their difference where a branch joins the motion of half its period, over that before
BESIDE_DOUBLING = 0.1  # the same, in natural scales, from where a step leads to the motion of half the period
AT_DOUBLING = 0.05  # the distance from -1 of a multiplier there
MAX_RESTART_CHANGE = 1e-3  # of the state where a branch restarts, relative to its largest


@dataclass(frozen=True)
class Line:
    """The points of a branch, in order: their ``signatures`` [points, numbers], and their
    ``orbits``, None where one is not known."""

    signatures: Array
    orbits: Sequence[Orbit | None]


@dataclass(eq=False)
class Side:
    """A side of the branch of a ``candidate``, which is followed from ``start`` in one
    ``direction`` (1 or -1 along its tangent); ``line`` has the signatures of its points so
    far, the first that of its seed, and ``rounds`` when each of the others was found;
    ``points`` are these others. ``orbits`` are those of all points of the line, None where
    they are not known. ``suspects`` are other branches that pass near its
    last point or its seed, with that point. ``cut`` has the point at which the other side of the
    branch has met this one, which ends there."""

    candidate: Candidate
    start: Point
    direction: int
    line: list[Array]
    rounds: list[int] = field(default_factory=list)
    points: list[Point] = field(default_factory=list)
    cut: list[Point] = field(default_factory=list)
    suspects: list[tuple[Line, Point]] = field(default_factory=list)
    orbits: list[Orbit | None] = field(default_factory=list)

    @property
    def at(self) -> float:
        """The continued number (SI) at its last point."""
        last = self.points[-1] if self.points else self.start
        return float(last.found.values[0])

    def __post_init__(self) -> None:
        self.orbits.append(self.start.found)

    @property
    def track(self) -> Track:
        """What others have met of it."""
        return Track(np.array(self.rounds, np.int64), np.stack(self.line))

    def until_cut(self, half: HalfBranch) -> HalfBranch:
        """What was followed of this side, as far as the other side has met it."""
        for place, entry in enumerate(half.points):
            if self.cut and entry.point.x is self.cut[0].x:
                return replace(half, points=half.points[: place + 1], ended=MET)
        return half


class Known:
    """The ``branches`` that have ended, and the ``sides`` of those of a wave, by the key
    of the branch and the side, those of the first branch of the wave first; ``round``
    counts the rounds of legs of the wave."""

    def __init__(self, flow: Flow) -> None:
        self.flow = flow
        self.branches: list[Branch] = []
        self.sides: dict[Key, Side] = {}
        self.round = 0
        self._of_branches: dict[int, Line] = {}

    def on_branch(
        self, kind: Kind, found: list[Array], states: Array, tolerance: float = 0.0, but: int = -1
    ) -> Task[bool]:
        """Whether a motion with one of the signatures ``found`` lies on a branch, ``but`` for that of
        this number, beside which it begins. That of a
        cycle is but its period, which another cycle may have as well: then ``states``
        [n, states] of the motion have to lie about a cycle of the branch."""
        lines = self._lines_near(kind, found, tolerance, but)
        if kind[0] != CYCLE:
            return bool(lines)
        for line in lines:
            place = nearest_chord(line.signatures, found)
            one, other = line.orbits[place : place + 2]
            assert one is not None  # as all are of a branch that has ended
            assert other is not None
            reach, _ = yield from distance_from_cycle(self.flow, one, other.mesh_states)
            distance, size = yield from distance_from_cycle(self.flow, one, states)
            if not distance > reach + size:
                return True
        return False

    def _lines_near(self, kind: Kind, found: list[Array], tolerance: float = 0.0, but: int = -1) -> list[Line]:
        """The branches that pass near a motion with one of these signatures."""
        of_kind = (k for k, one in enumerate(self.branches) if (one.motion, one.lobes) == kind and k != but)
        lines = (self._line_of(k) for k in of_kind)
        return [line for line in lines if passes_near(line.signatures, found, tolerance)]

    def _line_of(self, number: int) -> Line:
        """The points of a branch, in order; a single point twice."""
        if number not in self._of_branches:
            branch = self.branches[number]
            kind = branch.motion, branch.lobes
            orbits = [entry.point.found for entry in branch.marked]
            orbits = orbits * 2 if len(orbits) == 1 else orbits
            line = np.stack([signatures(self.flow, kind, orbit)[0] for orbit in orbits])
            self._of_branches[number] = Line(line, orbits)
        return self._of_branches[number]

    def own_points(self, branch: Branch) -> Stretch | None:
        """The stretch of a branch without the points at its ends that a known one has too: it
        ended where it met that one, which went on over them, and may have ended within. None
        where nothing else remains, or only points near its parent, where it was not compared."""
        first, after = 0, len(branch)
        for place, ended in enumerate(branch.ended):
            if ended == KNOWN:
                marked = branch.marked[first:after]
                # the last one stays, as the point that both have
                repeats = max(self._repeats(branch, marked if place == 0 else marked[::-1]) - 1, 0)
                first, after = (first + repeats, after) if place == 0 else (first, after - repeats)
        if after - first < len(branch) and after - first <= (NEAR_PARENT if branch.parent >= 0 else 1):
            return None
        return first, after

    def _repeats(self, branch: Branch, inwards: list[LabelledPoint]) -> int:
        """How many points of a branch, from an end on, lie on one known branch, along which
        they go in one direction: where arms lie side by side others pass near it, too."""
        most, kind = 0, (branch.motion, branch.lobes)
        for number, one in enumerate(self.branches):
            if (one.motion, one.lobes) != kind:
                continue
            line, places = self._line_of(number).signatures, list[int]()
            for entry in inwards:
                found = signatures(self.flow, kind, entry.point.found)
                if not passes_near(line, found):
                    break
                places.append(nearest_chord(line, found))
                if len(set(np.sign(np.diff(places)).tolist()) - {0}) > 1:
                    places.pop()
                    break
            most = max(most, len(places))
        return most

    def points_of(self, branch: Key) -> int:
        """How many points both sides of a branch of the wave have, which share them."""
        return sum(len(one.line) for key, one in self.sides.items() if key[:-1] == branch)

    def stop(self, own: Side, point: Point) -> str:
        """Add a point to a side of a branch of the wave. Why the branch ends there: it
        may meet its own other side (:meth:`meeting` tells), or it meets a known branch,
        or one that comes before it in the wave, on which its seed may lie as well; ""
        where it goes on."""
        candidate = own.candidate
        found = signatures(self.flow, candidate.kind, point.found)
        # Of several signatures the one that continues the line.
        own.line.append(min(found, key=lambda one: float(np.linalg.norm(one - own.line[-1]))))
        own.rounds.append(self.round)
        own.points.append(point)
        own.orbits.append(point.found)
        # The first points lie near the branch from which this one emanates.
        own.suspects = []
        if len(own.line) > NEAR_PARENT:
            own.suspects += [(line, point) for line in self._lines_near(candidate.kind, found)]
        is_before = True
        for other in self.sides.values():
            points, is_same_kind = np.stack(other.line), other.candidate.kind == candidate.kind
            if other.candidate is candidate:
                is_before, is_long = False, min(len(own.line), len(points)) > 5
                if other is not own and is_long and passes_near(points, found):
                    return KNOWN if own.suspects else MET
            elif is_before and is_same_kind:
                near = ((found, point), (candidate.signatures, own.start))
                own.suspects += [(Line(points, other.orbits), one) for given, one in near if passes_near(points, given)]
        return KNOWN if own.suspects else ""

    def is_known(self, own: Side, problem: Problem, current: Point) -> Task[bool]:
        """Whether a side that passes near lines of other branches is on one of them: its motion
        at the parameter of one of their points is that one."""
        kind = own.candidate.kind
        for line, point in own.suspects:
            at = problem if point is current else own.candidate.problem
            place = nearest_chord(line.signatures, signatures(self.flow, kind, point.found))
            for k in (place, place + 1):
                if (yield from _is_at(self.flow, kind, at, point, line.signatures[k], line.orbits[k])):
                    return True
        return False

    def meeting(self, own: Side, problem: Problem, current: Point) -> Task[Point | None]:
        """The point after ``current``, the last one of a side, that is also one of the
        other side of its branch, of which it is then the end; None where both sides only
        pass near each other, as where they come to a fold from both sides."""
        (other,) = (one for one in self.sides.values() if one.candidate is own.candidate and one is not own)
        found = signatures(self.flow, own.candidate.kind, current.found)
        # The sides come from opposite directions: the point ahead is the earlier one.
        place = nearest_chord(np.stack(other.line), found)
        if place == 0 or own.cut:
            return None
        target = other.points[place - 1]
        point = yield from reached(self.flow, own.candidate.kind, problem, current, target)
        if point is None or own.cut:  # the other side has met this one meanwhile
            return None
        is_ahead = float(current.tangent @ (point.x - current.x)) > 0.0
        if not is_ahead or point.tangent[-1] * target.tangent[-1] > 0.0:
            return None
        other.cut.append(target)
        return point


def _is_at(flow: Flow, kind: Kind, problem: Problem, current: Point, sought: Array, orbit: Orbit | None) -> Task[bool]:
    """Whether a motion on the branch through ``current``, less than two steps from it, has the
    signature ``sought``, from whichever lobe or phase it begins, and if it is a cycle is that
    ``orbit``. One of another orientation is on another branch, to which a straight line leads
    where both turn away."""
    point = yield from _beside(problem, current, float(sought[-1]))
    if point is None or point.orientation != current.orientation:
        return False
    found = signatures(flow, kind, point.found)
    if min(float(np.linalg.norm(one - sought)) for one in found) > DUPLICATE_DISTANCE:
        return False
    return kind[0] != CYCLE or orbit is None or (yield from _is_same_cycle(flow, point.found, orbit))


def _is_same_cycle(flow: Flow, one: Orbit, other: Orbit) -> Task[bool]:
    """Whether two cycles with the same parameters and period are the same, at whatever phases
    they begin."""
    distance, size = yield from distance_from_cycle(flow, other, one.mesh_states)
    return distance < SAME_CYCLE * size


def _beside(problem: Problem, current: Point, parameter: float) -> Task[Point | None]:
    """The point of a branch at a ``parameter``, less than two steps from ``current``; None
    where there is none."""
    slope = float(current.tangent[-1])
    change = parameter - float(current.x[-1])
    if abs(change) >= 2.0 * MAX_STEP * abs(slope):
        return None
    guess = current.x + change / slope * current.tangent
    guess[-1] = parameter
    point = yield from corrected(problem, guess, parameter_normal(len(guess)), current.tangent, current)
    return None if point is None or np.linalg.norm(point.x - current.x) > 2.0 * MAX_STEP else point


def reached(flow: Flow, kind: Kind, problem: Problem, current: Point, target: Point) -> Task[Point | None]:
    """The point of a branch at the parameter of ``target``, less than two steps from
    ``current``, if its motion of a ``kind`` is that of ``target``, from whichever lobe
    or phase it begins; None where it is another one."""
    point = yield from _beside(problem, current, float(target.x[-1]))
    if point is None:
        return None
    (sought, *_), found = (signatures(flow, kind, one.found) for one in (target, point))
    if min(float(np.linalg.norm(one - sought)) for one in found) > DUPLICATE_DISTANCE:
        return None
    if kind[0] == CYCLE and not (yield from _is_same_cycle(flow, point.found, target.found)):
        return None
    return point


def repeated(known: Known, one: Side, track: Track, branch: Branch) -> Task[None]:
    """Nothing is followed: the points of a side that ended before an interruption are
    there for the others of its wave to meet, from the rounds on in which they were found.
    So the others end where they would have ended without the interruption."""
    kind = one.candidate.kind
    orbits = {
        signatures(known.flow, kind, entry.point.found)[0].tobytes(): entry.point.found
        for entry in (branch.marked if kind[0] == CYCLE else [])
    }
    nothing = Legs(np.empty((0, known.flow.states)), 0.0, 0.0, one.start.found.values[None][:0])
    for found_in, signature in zip(track.rounds.tolist(), track.line[1:], strict=True):
        while known.round < found_in:
            yield nothing
        one.line.append(signature)
        one.orbits.append(orbits.get(signature.tobytes()))
        one.rounds.append(found_in)


def followed_side(flow: Flow, orders: Orders, known: Known, one: Side) -> Task[HalfBranch]:
    """A side of a branch. Where Newton's method fails, it continues with twice the
    segments. Touches of circles are located on finer ones."""
    motion, lobes = one.candidate.kind
    scale = float(flow.scales[-1])
    # A branch of circles ends where it has a kink, and a circle has no monodromy.
    rules = Rules(
        (orders.bounds[0] / scale, orders.bounds[1] / scale),
        orders.points,
        test_functions_of(orders.grazes, motion, orders.bends),
        _stop(flow, orders, known, one),
        partial(known.meeting, one),
        partial(known.is_known, one),
        partial(crossing_of, flow, one.candidate.kind),
        partial(_returned, flow, one.candidate.kind),
        kink_predicate(0 if motion == CIRCLE else len(flow.equations.contacts)),
        None if motion == CIRCLE else stability_of(one.start.found.trivial),
        corners=motion != CIRCLE,
    )
    problem, start = one.candidate.problem, one.start
    half = yield from follow(problem, start, one.direction, rules)
    while (
        isinstance(problem, Periodic)
        and half.ended.startswith(NO_CONVERGENCE)
        and problem.segments < MAX_SEGMENTS_PER_LOBE * lobes
        and (remaining := orders.points - len(half.points) + half.inserted) > 0
    ):
        last = half.points[-1].point if half.points else replace(start, tangent=one.direction * start.tangent)
        problem = replace(problem, segments=2 * problem.segments)
        states = yield from segment_starts(problem, last.found.state, last.found.values)
        if states is None:
            break
        again = yield from corrected_at_parameter(problem, problem.unknowns(states, last.found.values[-1]))
        if again is None or _is_elsewhere(again.found.state, last.found.state):
            continue
        direction = 1 if last.tangent[-1] > 0.0 else -1
        more = yield from follow(problem, again, direction, replace(rules, max_points=remaining))
        if more.points:
            points = half.points + more.shifted(last.s).points
            half = HalfBranch(points, more.ended, half.inserted + more.inserted)
    if isinstance(problem, Circle):
        half = replace(half, points=(yield from with_located_touches(problem, half.points, rules.test_functions)))
    return half


def _returned(flow: Flow, kind: Kind, problem: Problem, previous: Point, origin: Point) -> Task[Point | None]:
    """The point after ``previous`` at which a branch comes back to its ``origin``, in the
    same direction; None where it does not."""
    point = yield from reached(flow, kind, problem, previous, origin)
    return point if point is not None and point.tangent[-1] * origin.tangent[-1] > 0.0 else None


def _is_elsewhere(state: Array, former: Array) -> bool:
    """Whether a restarted motion is another one."""
    return bool(np.max(np.abs(state - former)) > MAX_RESTART_CHANGE * np.max(np.abs(former) + 1e-9))


def _stop(flow: Flow, orders: Orders, known: Known, one: Side) -> Callable[[Point, Point], str]:
    """The stop function of one side of a branch. It ends where a cycle shrinks to a steady
    motion, where a circle shrinks to a motion that repeats or loses its smoothness, where the
    motion is too unstable or its multipliers are not known, and where it meets a branch
    (:meth:`.Known.stop`)."""
    kind = one.candidate.kind

    def stop(previous: Point, current: Point) -> str:
        if kind[0] == CIRCLE and (reason := circle_stop(flow.symmetry, previous, current)):
            return reason
        if kind[0] == CYCLE and _is_still(flow, previous, current):
            return "still"
        if one.cut:
            return "cut"
        if known.points_of(one.candidate.key) > orders.points:
            return "points"
        if kind[0] == PERIODIC and np.max(np.abs(current.found.multipliers)) > MAX_MULTIPLIER ** kind[1]:
            return "wild"
        if not current.found.resolved:
            return "unresolved"
        return known.stop(one, current)

    return stop


def crossing_of(flow: Flow, kind: Kind, problem: Problem, previous: Point, current: Point) -> Task[str]:
    """What a step of a branch of a ``kind`` does beside going on: it leads to a motion of a
    shorter period (``SHORTER``), or the halves of the motion are exchanged in it. Where they
    become equal between the points, at a doubling of the motion of half the period, the branch
    joins that (``HALF``); where they do not, the step leaps to the same motion half a period
    later (``LEAP``), unless the difference of the halves but turns."""
    motion, lobes = kind
    if motion == CYCLE and _is_still(flow, previous, current):
        return ""
    parts = yield from equal_parts(flow, kind, current.found)
    if motion not in (CYCLE, PERIODIC) or (motion == PERIODIC and lobes % 2):
        return SHORTER if parts > 1 else ""
    before = _difference_of_halves(flow, kind, previous)
    size = float(np.linalg.norm(before))
    if parts > 1:
        is_beside = parts == 2 and size < BESIDE_DOUBLING
        return HALF if is_beside and (yield from _is_doubling_of_half(flow, kind, previous.found)) else SHORTER
    if before @ _difference_of_halves(flow, kind, current) >= 0.0:
        return ""
    exchange = TestFunction(DOUBLING, lambda point: float(before @ _difference_of_halves(flow, kind, point)))
    located = yield from special_points(problem, previous, current, lambda *points: [exchange])
    if not located or abs(exchange.value(point := located[0].point)) > EQUAL_HALVES * size**2:
        return LEAP
    if np.linalg.norm(_difference_of_halves(flow, kind, point)) > EQUAL_HALVES * size:
        return ""
    return HALF if (yield from _is_doubling_of_half(flow, kind, point.found)) else LEAP


def _is_doubling_of_half(flow: Flow, kind: Kind, orbit: Orbit) -> Task[bool]:
    """Whether the motion of half the period near an orbit of a ``kind``, whose halves are
    about equal, has a multiplier of about -1: its period doubles there."""
    (motion, lobes), values, segments = kind, orbit.values, len(orbit.mesh_states) // 2
    turn = 0.0 if motion == CYCLE else map_angle(flow, lobes // 2)
    states = 0.5 * (orbit.mesh_states[:segments] + rotated(flow.symmetry, orbit.mesh_states[segments:], -turn))
    half: Cycle | Periodic
    if motion == CYCLE:
        half = Cycle.at(flow, orbit.period / 2.0, values, states[0], segments)
        x = half.unknowns(states, orbit.period / 2.0, values[-1])
    else:
        half = Periodic.at(flow, lobes // 2, values, states[0], segments)
        x = half.unknowns(states, values[-1])
    point = yield from corrected_at_parameter(half, x)
    return point is not None and bool(np.min(np.abs(point.found.nontrivial + 1.0)) < AT_DOUBLING)


def _is_still(flow: Flow, previous: Point, current: Point) -> bool:
    """Whether a cycle shrinks to a steady motion between two points."""
    before, after = (_difference_of_halves(flow, (CYCLE, 1), point) for point in (previous, current))
    is_exchanged = before @ after < 0.0 and np.linalg.norm(after) < 2.0
    return _is_inverted(flow, previous, current) if is_exchanged else _grows_again(previous, current)


def _is_inverted(flow: Flow, previous: Point, current: Point) -> bool:
    """Whether a cycle turns into its opposite between two points, as in a step over a steady
    motion: its velocities change sign. Those of a cycle that meets that of half its period
    do not: what changes sign there is the small difference of its halves."""
    free = list(current.found.free)
    before, after = (
        corotating_rates(flow, one.found.mesh_states, one.found.values)[:, free]
        / flow.state_scales(one.found.values)[0][free]
        for one in (previous, current)
    )
    return bool(np.sum(before * after) < 0.0)


def _grows_again(previous: Point, current: Point) -> bool:
    """Whether a cycle that shrinks at ``previous`` grows at ``current``, less far from
    standing still than the step is long, while the parameter turns back: a step over a Hopf
    point. The plane of the phase condition need not contain the steady motion; then the
    cycles beyond begin at another phase, and their halves need not be exchanged. At a fold
    the size goes on as before."""
    if (previous.tangent[-1] > 0.0) == (current.tangent[-1] > 0.0):
        return False
    (_, rate_before), (size, rate_after) = _size_of(previous), _size_of(current)
    return rate_before < 0.0 < rate_after and size < float(np.linalg.norm(current.x - previous.x))


def _size_of(point: Point) -> tuple[float, float]:
    """The distance of a cycle from its mean, in natural scales, and its derivative by the
    arclength, with the sign of the tangent."""
    segments = len(point.found.mesh_states)
    states, rates = (one[:-2].reshape(segments, -1) for one in (point.x, point.tangent))
    swing = states - states.mean(axis=0)
    size = float(np.linalg.norm(swing))
    return size, float(np.sum(swing * rates)) / max(size, 1e-300)


def _difference_of_halves(flow: Flow, kind: Kind, point: Point) -> Array:
    """The state half a period after the start less that at the start, in natural
    scales [free]."""
    orbit, (motion, lobes) = point.found, kind
    free = list(orbit.free)
    starts = orbit.mesh_states[:, free] if motion == CYCLE else lobe_starts(orbit, flow, lobes)
    return np.asarray((starts[len(starts) // 2] - starts[0]) / flow.state_scales(orbit.values)[0][free])


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
        finer, x = replace(problem, judged=False).with_points(side.x, FINEST)
        point = yield from corrected_at_parameter(finer, x)
        fine += [] if point is None else [point]
    if len(fine) < 2 or not fine[0].x[-1] < fine[1].x[-1]:
        return None

    def sought(a: Point, b: Point) -> list[TestFunction]:
        return [test for test in test_functions(a, b) if test.code == code]

    found = yield from special_points(finer, fine[0], fine[1], sought, TOUCH_TOLERANCE)
    evaluation = (yield from replace(finer, judged=True).evaluate(found[0].point.x)) if found else None
    if evaluation is None:
        return None
    point = replace(found[0].point, found=evaluation.solution())
    share = (point.x[-1] - low.x[-1]) / (high.x[-1] - low.x[-1])
    return replace(found[0], point=replace(point, s=float(low.s + share * (high.s - low.s))))
