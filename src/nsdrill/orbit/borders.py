"""Borders: curves through the special points of branches in two parameters."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE, END, OWN
from nsdrill.data import Array
from nsdrill.orbit.arclength import HalfBranch, Rules, follow
from nsdrill.orbit.branch import Branch, problem_of
from nsdrill.orbit.flow import Flow, Task, advance
from nsdrill.orbit.newton import Evaluation, Point, corrected_at_parameter
from nsdrill.orbit.periodic import Cycle, Periodic, lobe_starts
from nsdrill.orbit.shooting import Orbit, monodromy_product, shooting_jacobian
from nsdrill.orbit.special import LabelledPoint, TestFunction
from nsdrill.records import dataclass

DUPLICATE_DISTANCE = 1e-4  # between equal special points, over the range
MAX_SIDE_BY_SIDE = 8  # curves that advance at the same time
# lengths of steps, in natural scales; long ones, as nothing is detected along a curve
FIRST_STEP, MAX_STEP = 0.1, 6.0
MERGED = 1e-3  # between the lobes of a motion that is one over fewer of them, in natural scales
MAX_CORRECTION = 0.5  # from a special point to the first point of its curve, in natural scales


@dataclass(frozen=True)
class Border:
    """A curve: the ``label`` of its points, their ``motion`` and period in ``lobes``,
    the ``points`` with values of both parameters, the reasons why it ``ended``, at its
    beginning and at its end, and the number of a ``branch`` that it crosses."""

    label: int
    motion: str
    lobes: int
    points: list[Point]
    ended: tuple[str, str]
    branch: int


@dataclass(frozen=True)
class Frame:
    """Where curves are followed: the ``ranges`` of both parameters, first that of the
    branches, the value ``start`` of the second one on these, and the most ``points`` of
    a curve."""

    start: float
    ranges: tuple[tuple[float, float], tuple[float, float]]
    points: int


@dataclass(frozen=True, eq=False)
class _SpecialPoint:
    """A special point of the ``branch`` of this ``number``."""

    number: int
    branch: Branch
    labelled: LabelledPoint

    @property
    def kind(self) -> tuple[int, str, int]:
        return self.labelled.label, self.branch.motion, self.branch.lobes

    @property
    def value(self) -> float:
        return float(self.labelled.point.found.values[-1])


def borders(
    flows: Callable[[Condition], Flow],
    branches: list[Branch],
    conditions: dict[int, Condition],
    frame: Frame,
    poll: Callable[[], None],
    say: Callable[[str], object],
) -> list[Border]:
    """The curves through the special points with a label among ``conditions``, one for
    each point that lies on no other curve.

    ``flows(condition)`` is the flow for a condition, in which both parameters are free.
    ``poll`` is called often, and may raise to stop; ``say`` how far it is. Folds and
    doublings next to a grazing point are left out: they belong to the curve of that
    point.
    """
    low, high = frame.ranges[0]
    tolerance = DUPLICATE_DISTANCE * (high - low)
    remaining = [
        special
        for number, branch in enumerate(branches)
        for special in _followable(number, branch, conditions, tolerance)
    ]
    found: list[Border] = []
    while remaining:
        remaining = [one for one in remaining if not any(_crosses(line, one, frame.start, tolerance) for line in found)]
        say(f"curves: {len(found)} followed, at most {len(remaining)} to follow")
        first_of_kind: dict[tuple[int, str, int], _SpecialPoint] = {}
        for special in remaining:
            first_of_kind.setdefault(special.kind, special)
        chosen = [*first_of_kind.values()][:MAX_SIDE_BY_SIDE]
        remaining = [special for special in remaining if special not in chosen]
        tasks: dict[Flow, dict[_SpecialPoint, Task[Border | None]]] = {}
        for special in chosen:
            condition = conditions[special.labelled.label]
            flow = flows(condition)
            tasks.setdefault(flow, {})[special] = _border(flow, special, condition, frame)
        results: dict[_SpecialPoint, Border | None] = {}
        for flow, of_flow in tasks.items():
            results |= advance(flow, of_flow, poll)
        found += [line for special in chosen if (line := results[special]) is not None]
    return found


def _followable(number: int, branch: Branch, conditions: dict[int, Condition], tolerance: float) -> list[_SpecialPoint]:
    """The special points of a branch that a curve of ``conditions`` can start from."""
    specials = [_SpecialPoint(number, branch, entry) for entry in branch.marked if entry.label]
    grazing = [special.value for special in specials if special.labelled.label > OWN]
    followable = []
    for special in specials:
        condition = conditions.get(special.labelled.label)
        # A point with a note has another number of touches in a period: no extreme
        # value of the contact's function vanishes there.
        if condition is None or special.labelled.words or branch.motion == CIRCLE:
            continue
        if branch.motion == CYCLE and condition.multiplier != 1.0:
            continue
        if condition.of_monodromy and any(abs(special.value - value) < tolerance for value in grazing):
            continue
        followable.append(special)
    return followable


def _crosses(border: Border, special: _SpecialPoint, start: float, tolerance: float) -> bool:
    """Whether a curve passes through a special point, where the second parameter is
    ``start``."""
    if (border.label, border.motion, border.lobes) != special.kind:
        return False
    values = np.array([point.found.values for point in border.points])
    offsets = values[:, 1] - start
    crossings = np.flatnonzero(offsets[:-1] * offsets[1:] <= 0.0)
    for index in crossings:
        rise = offsets[index + 1] - offsets[index]
        fraction = 0.0 if rise == 0.0 else -offsets[index] / rise
        if (
            abs(values[index, 0] + fraction * (values[index + 1, 0] - values[index, 0]) - special.value)
            < 10.0 * tolerance
        ):
            return True
    return False


def _border(flow: Flow, special: _SpecialPoint, condition: Condition, frame: Frame) -> Task[Border | None]:
    """The curve through a special point; None where Newton's method does not lead onto
    it."""
    orbit = special.labelled.point.found
    values = np.array([special.value, frame.start])
    motion = problem_of(flow, special.branch, replace(orbit, values=values))
    problem = Curve.at(motion, orbit, values, condition)
    guess = problem.unknowns(orbit, values)
    seed = yield from corrected_at_parameter(problem, guess)
    if seed is None or np.linalg.norm(seed.x - guess) > MAX_CORRECTION:
        return None
    low, high = np.array(frame.ranges[0]) / flow.scales[0]
    second_low, second_high = np.array(frame.ranges[1]) / flow.scales[1]

    gaps = partial(_gaps, flow, special.branch.lobes)

    def stop(previous: Point, current: Point) -> str:
        if _is_shorter(gaps(previous)):
            return "shorter"
        return "" if low <= current.x[-2] <= high else "range"

    limits = (second_low, second_high), frame.points // 2
    rules = Rules(*limits, partial(_mergers, gaps), stop, first_step=FIRST_STEP, max_step=MAX_STEP)
    forward = _until_shorter((yield from follow(problem, seed, 1, rules)), gaps)
    backward = HalfBranch([], forward.ended)
    if forward.ended != "closed":
        rules = replace(rules, max_points=frame.points - len(forward.points))
        backward = _until_shorter((yield from follow(problem, seed, -1, rules)), gaps)
    before, after = ([entry.point for entry in half.points] for half in (backward, forward))
    line = [*before[::-1], seed, *after]
    return Border(*special.kind, line, (backward.ended, forward.ended), special.number)


def _gaps(flow: Flow, lobes: int, point: Point) -> list[Array]:
    """The states after every part of a motion's lobes over which a shorter one could
    repeat, less that at its start, in natural scales [free]."""
    orbit = point.found
    parts = [part for part in range(1, lobes) if lobes % part == 0]
    starts = lobe_starts(orbit, flow, lobes) if parts else []
    state_scales = flow.state_scales(orbit.values)[0][list(orbit.free)]
    return [(starts[part] - starts[0]) / state_scales for part in parts]


def _is_shorter(gaps: list[Array]) -> bool:
    """Whether a motion is one over fewer lobes."""
    return any(np.linalg.norm(gap) < MERGED for gap in gaps)


def _mergers(gaps: Callable[[Point], list[Array]], previous: Point, current: Point) -> list[TestFunction]:
    """The test functions of the places between two points of a curve where the motion
    becomes one over fewer lobes: a gap closes, or changes its sides."""

    def value(place: int, normal: Array, point: Point) -> float:
        return float(gaps(point)[place] @ normal) - 0.5 * MERGED

    normals = [gap / np.linalg.norm(gap) for gap in gaps(previous)]
    functions = [TestFunction(END, partial(value, *one)) for one in enumerate(normals)]
    return [test for test in functions if test.value(previous) > 0.0 > test.value(current)]


def _until_shorter(half: HalfBranch, gaps: Callable[[Point], list[Array]]) -> HalfBranch:
    """A side of a curve as far as its motion becomes one over fewer lobes."""
    for place, entry in enumerate(half.points):
        if _is_shorter(gaps(entry.point)):
            return HalfBranch([one for one in half.points[: place + 1] if not one.label or one is entry], "shorter")
    return replace(half, points=[entry for entry in half.points if not entry.label])


# Curves of special points in two parameters: folds, period doublings, torus and Hopf
# bifurcations, folds of cycles, and grazing.
# The equations of the motion are extended by one that vanishes along the curve:
# - for a multiplier of 1 or -1, the test function of the bordered monodromy (Govaerts
# 2000, Numerical Methods for Bifurcations of Dynamical Equilibria, chapter 4);
# - for a complex pair, the logarithm of its modulus;
# - for grazing, the least or greatest value of a contact's function over the period.
# Its derivatives are central differences, of monodromies where it depends on them. A
# derivative by the start of a segment needs only that segment.


DIFFERENCE_STEP = 1e-4  # of central differences, in natural scales
TOLERANCE_FACTOR = 30.0  # of Newton's method, for the noise in differences of monodromies
CONTACT_SCALE = 1e-3  # the natural scale of a contact's function
MIN_IMAGINARY = 1e-6  # of the imaginary part of a multiplier of a complex pair


@dataclass(frozen=True)
class Condition:
    """The condition along a curve, one of three: a multiplier is ``multiplier`` (1 or
    -1); a complex ``pair`` of multipliers has the modulus 1; or the least (``which`` 0)
    or greatest (1) value of the function of the contact at the place ``contact``
    vanishes."""

    multiplier: float = 0.0
    pair: bool = False
    contact: int = -1
    which: int = 0

    @property
    def of_monodromy(self) -> bool:
        """Whether the condition is one on the multipliers."""
        return self.contact < 0


@dataclass(frozen=True)
class Curve:
    """Motions at which the condition holds. The unknowns are those of the problem
    ``motion`` with two parameters, over their scales, in place of one; the last is the
    continuation parameter. ``left`` and ``right`` border the matrix that is singular
    where a multiplier has the value of the condition."""

    motion: Periodic | Cycle
    condition: Condition
    left: Array
    right: Array
    tolerance_factor = TOLERANCE_FACTOR

    @classmethod
    def at(cls, motion: Periodic | Cycle, orbit: Orbit, values: Array, condition: Condition) -> Curve:
        """The problem near an ``orbit``, of the problem ``motion``, at a special point,
        at ``values`` of both parameters."""
        left = right = np.zeros(0)
        if condition.multiplier and orbit.monodromy is not None:
            matrix = motion.critical_matrix(condition.multiplier, orbit.monodromy, orbit.state, values)
            u, _, v = np.linalg.svd(matrix)
            left, right = u[:, -1], v[-1]
        return cls(motion, condition, left, right)

    def unknowns(self, orbit: Orbit, values: Array) -> Array:
        """``x`` of an ``orbit`` at ``values`` of both parameters."""
        period = [orbit.period / self.motion.time_scale] if isinstance(self.motion, Cycle) else []
        return self.motion.packed(orbit.mesh_states, *period, *(values / self.motion.flow.scales))

    def _cases(self, x: Array) -> tuple[Array, Array]:
        """The states [cases, segments, states] and the further unknowns [cases, further]
        of the motion itself; then, for each free state, with that state of all segments
        displaced to both sides; then with each further unknown displaced."""
        motion = self.motion
        states, numbers = motion.states(x), x[motion.segments * len(motion.free) :]
        displaced = len(motion.free) + len(numbers)
        all_states, all_numbers = np.stack([states] * (1 + 2 * displaced)), np.tile(numbers, (1 + 2 * displaced, 1))
        steps = DIFFERENCE_STEP / math.sqrt(motion.segments) * motion.scale
        for case in range(displaced):
            for place, sign in ((1 + 2 * case, 1.0), (2 + 2 * case, -1.0)):
                if case < len(steps):
                    all_states[place, :, motion.free[case]] += sign * steps[case]
                else:
                    all_numbers[place, case - len(steps)] += sign * DIFFERENCE_STEP
        return all_states, all_numbers

    def evaluate(self, x: Array) -> Task[Evaluation | None]:
        motion, J, n = self.motion, self.motion.segments, len(self.motion.free)
        step, (all_states, all_numbers) = DIFFERENCE_STEP / math.sqrt(J), self._cases(x)
        by_number = slice(1 + 2 * n, None)
        values = all_numbers[:, -2:] * motion.flow.scales
        periods = all_numbers[:, 0] * getattr(motion, "time_scale", math.nan)
        if np.any(periods <= 0.0):
            return None
        tangent = self.condition.of_monodromy | (np.arange(len(values)) == 0)
        ends = yield motion.legs(all_states, values, periods, tangent)
        if not ends.ok.all():
            return None
        end, monodromies = motion.shots(ends, values, periods)
        blocks = monodromies * motion.ratios
        touches = ends.touches.reshape(len(values), J, *ends.touches.shape[1:])

        def test_with(case: int, segment: int) -> float:
            """The test function of the motion with one ``segment`` of another case."""
            mixed_blocks, mixed_touches = blocks[0].copy(), touches[0].copy()
            mixed_blocks[segment], mixed_touches[segment] = blocks[case, segment], touches[case, segment]
            return self._test(mixed_blocks, mixed_touches, all_states[case if segment == 0 else 0, 0], values[0])

        tests = np.array([self._test(*one) for one in zip(blocks, touches, all_states[:, 0], values, strict=True)])
        tests_with = np.array([[test_with(case, j) for case in range(1, 1 + 2 * n)] for j in range(J)])
        phase_error, phase_row = motion.phase_condition(all_states[0])
        residual = np.concatenate([motion.misses(end[0], all_states[0]), phase_error, tests[:1]])
        jacobian = np.zeros((len(residual), len(x)))
        jacobian[: J * n, : J * n] = shooting_jacobian(blocks[0])
        jacobian[J * n : -1, :n] = phase_row
        jacobian[-1, : J * n] = _differences(tests_with.ravel(), step)
        jacobian[: J * n, J * n :] = _differences(end[by_number][..., motion.free] / motion.scale, DIFFERENCE_STEP)
        jacobian[-1, J * n :] = _differences(tests[by_number], DIFFERENCE_STEP)
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        period = float(periods[0]) if isinstance(motion, Cycle) else float(ends.duration[:J].sum())
        found = all_states[0], values[0], period, blocks[0], touches[0]
        return Evaluation(residual, jacobian, lambda: motion.orbit(*found))

    def _test(self, blocks: Array, touches: Array, state: Array, values: Array) -> float:
        """The function that vanishes along the curve, from the monodromies of the
        segments or from their touches."""
        if not self.condition.of_monodromy:
            extremes = touches[:, self.condition.contact, self.condition.which]
            return float(extremes.max() if self.condition.which else extremes.min()) / CONTACT_SCALE
        monodromy = monodromy_product(blocks)
        if self.condition.pair:
            return _log_modulus(monodromy)
        matrix = self.motion.critical_matrix(self.condition.multiplier, monodromy, state, values)
        return _bordered_test(matrix, self.left, self.right)

    def updated(self, x: Array) -> Curve:
        values = x[-2:] * self.motion.flow.scales
        return replace(self, motion=self.motion.with_phase_condition(self.motion.states(x)[0], values))


def _differences(values: Array, step: float) -> Array:
    """The derivatives [any, m] from ``values`` [2 m, ...] at steps to both sides."""
    return ((values[0::2] - values[1::2]) / (2.0 * step)).reshape(len(values) // 2, -1).T


def _log_modulus(monodromy: Array) -> float:
    """The logarithm of the modulus of the complex pair of multipliers that is nearest
    to the unit circle; NaN where there is none."""
    multipliers = np.linalg.eigvals(monodromy)
    logarithms = np.log(np.abs(multipliers[multipliers.imag > MIN_IMAGINARY]))
    return float(logarithms[np.argmin(np.abs(logarithms))]) if len(logarithms) else math.nan


def _bordered_test(matrix: Array, left: Array, right: Array) -> float:
    """A smooth function that vanishes where ``matrix`` [n, n] is singular: the last
    component of the solution of the bordered system, whose right-hand side is the last
    unit vector. NaN where that system is singular."""
    n = len(matrix)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n], system[:n, n], system[n, :n] = matrix, left, right
    try:
        return float(np.linalg.solve(system, np.eye(n + 1)[n])[n])
    except np.linalg.LinAlgError:
        return math.nan
