"""From seeds to branches: which motions are followed, which branches emanate from them,
and which of them are known already.

Branches are followed in waves. Each wave follows, side by side, one seed of every group
of neighbours that lies on no branch yet and the branch that emanates from one special
point of every branch; duplicates are dropped. The result is the same whether it is
computed at once or resumed from stored branches.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Generator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import BRANCH, CIRCLE, CYCLE, DOUBLING, EQUILIBRIUM, HOPF, PERIODIC
from nsdrill.orbit import circle
from nsdrill.orbit.arclength import (
    HalfBranch,
    LabelledPoint,
    Point,
    Problem,
    Task,
    TestFunctions,
    corrected_at_parameter,
    follow,
)
from nsdrill.orbit.branch import Branch, assembled, passes_near
from nsdrill.orbit.cycle import Cycle, corotating_rates, sampled_cycle
from nsdrill.orbit.flow import Flow, Legs
from nsdrill.orbit.frame import rotated
from nsdrill.orbit.labels import Graze, kink_predicate, orbit_test_functions, stability_of
from nsdrill.orbit.lockstep import advance
from nsdrill.orbit.periodic import Orbit, Periodic, lobe_starts, segment_starts
from nsdrill.orbit.switch import (
    cycle_doubling_problem,
    first_point_on,
    hopf_problem,
    switched_at_branch_point,
    switched_at_doubling,
)

Array = np.ndarray[Any, np.dtype[np.float64]]
Key = tuple[int, ...]
# distances in natural scales:
RETURN_TOLERANCE = 0.05  # between the ends of one period of a settled motion
UNSETTLED_TOLERANCE = 2.0  # the same of a motion that may not have settled
MAX_CORRECTION = 3000.0  # by Newton's method, from such a motion
DUPLICATE_DISTANCE = 1e-4  # between equal starts of a motion
GROUP_DISTANCE = 1.5  # between seeds that are likely to lie on one branch
NEAR_PARENT = 6  # points of a branch that may lie near the branch it emanates from
MAX_WAVES = 40
MAX_MULTIPLIER = 1e3  # over one fold, of a motion that can still be followed
MAX_SEGMENTS_PER_LOBE = 8
CYCLE_REVOLUTIONS, SAMPLES_PER_REVOLUTION = 24, 96  # of the search for a cycle


@dataclass(frozen=True)
class Seed:
    """A settled motion: its ``state`` [states] at the drive angle ``phase`` [rad], and
    the ``values`` [parameters] of the continuation parameters. ``near``: it may not
    have settled, and the nearest motion is searched for. ``steady``: it is a guess of
    steady drilling or of the motion over one lobe, which may be unstable."""

    state: Array
    phase: float
    values: Array
    near: bool = False
    steady: bool = False


@dataclass(frozen=True)
class Orders:
    """The settings of a continuation:

    - ``lobes``, the periods to try, shortest first; doublings are followed up to the
      longest;
    - ``bounds`` of the continuation parameter, in SI;
    - ``points``, the greatest number of points of a branch;
    - ``switch``, whether emanating branches are followed;
    - ``periodic``, ``cycles`` and ``circles``, whether these motions are followed;
    - ``grazes``, the grazing events of the contacts, by place.
    """

    lobes: tuple[int, ...]
    bounds: tuple[float, float]
    points: int = 400
    switch: bool = True
    periodic: bool = True
    cycles: bool = True
    circles: bool = True
    grazes: dict[int, Graze] = field(default_factory=dict)


@dataclass
class Found:
    """The ``branches``, and for each of the ``seeds`` ``followed`` or the reason why it
    was not."""

    branches: list[Branch]
    seeds: list[str]


@dataclass(frozen=True)
class _Guess:
    """The motion that the seed ``number`` seems to have settled on: its ``problem``,
    the unknowns ``x`` nearby, its signatures (:meth:`Explorer._signatures`), and the
    greatest correction of the unknowns by Newton's method, ``max_correction``."""

    number: int
    motion: str
    lobes: int
    problem: Any
    x: Array
    signatures: list[Array]
    max_correction: float


@dataclass(frozen=True)
class _Candidate:
    """A converged motion from which a branch may be followed, to one side only where
    ``one_side``. ``other`` is the first point on the other side of a branch point.
    ``signatures`` replace those of ``point`` where these are not enough."""

    key: Key
    motion: str
    lobes: int
    problem: Any
    point: Point
    parent: int = -1
    parent_point: int = -1
    one_side: bool = False
    other: Point | None = None
    signatures: tuple[Array, ...] = ()


@dataclass(frozen=True)
class Wave:
    """How far the branches are that are followed side by side, in the round with this
    ``number``: how many ``branches``, and how many of them go on, ``running``; their
    ``points``; the points of the ``longest`` side of a branch, and how many a side may
    have more, ``left``."""

    number: int
    branches: int
    running: int
    points: int
    longest: int
    left: int


class Explorer:
    """Follows all branches that can be reached from seeds. ``stored`` are branches of
    an earlier run, by key; ``store`` is called with the new branches of each wave, and
    ``watch`` often while they are followed; ``poll`` is called often, and may raise to
    stop."""

    def __init__(
        self,
        flow: Flow,
        orders: Orders,
        stored: dict[Key, Branch] | None = None,
        store: Callable[[dict[Key, Branch]], None] = lambda branches: None,
        poll: Callable[[], None] = lambda: None,
        watch: Callable[[Wave], object] = lambda wave: None,
    ) -> None:
        self.flow, self.orders, self.stored, self.store, self.poll = (flow, orders, stored or {}, store, poll)
        self.watch = watch
        self.scale = float(flow.scales[-1])
        low, high = orders.bounds
        self.bounds = (low / self.scale, high / self.scale)
        self.is_smooth = flow.symmetry.folds == 0
        self.branches: list[Branch] = []
        # the points so far of the branches of a wave, as signatures
        self._growing_lines: dict[Key, list[Array]] = {}
        self._branch_lines: dict[int, Array] = {}
        self._waves = 0
        self._rank: dict[Key, int] = {}
        self._kinds: dict[Key, tuple[str, int]] = {}

    def _advance(self, tasks: dict[Any, Generator[Any, Any, Any]]) -> dict[Any, Any]:
        return advance(self.flow, tasks, poll=self.poll)

    # Seeds

    def run(self, seeds: list[Seed]) -> Found:
        """The branches from ``seeds``, and which seeds were followed."""
        reasons = [""] * len(seeds)
        started = self._at_angle_zero(seeds, reasons)
        results = self._advance({number: self._guess(number, seed, reasons) for number, seed in started.items()})
        guesses = [results[number] for number in started if results[number] is not None]
        switched: set[tuple[int, int]] = set()
        for _ in range(MAX_WAVES):
            guesses = [
                guess
                for guess in guesses
                if not self._lies_on_branch(guess.motion, guess.lobes, guess.signatures, RETURN_TOLERANCE)
            ]
            chosen = self._representatives(guesses)
            candidates = self._advance({guess.number: self._candidate(guess, reasons) for guess in chosen})
            tried = {guess.number for guess in chosen}
            guesses = [guess for guess in guesses if guess.number not in tried]
            wave = [
                candidate
                for candidate in candidates.values()
                if candidate is not None and not self._is_known(candidate)
            ]
            if self.orders.switch:
                wave += self._emanating(switched)
            if wave:
                self._follow_wave(wave)
            elif not guesses and not (self.orders.switch and self._has_untried(switched)):
                break
        for guess in guesses:
            if not self._lies_on_branch(guess.motion, guess.lobes, guess.signatures, RETURN_TOLERANCE):
                reasons[guess.number] = f"left when {MAX_WAVES} rounds of seeds had been followed"
        return Found(self.branches, [reason or "followed" for reason in reasons])

    def _candidate(self, guess: _Guess, reasons: list[str]) -> Task[_Candidate | None]:
        """The motion near a guess, by Newton's method; None, with a reason, where there
        is none."""
        point = yield from corrected_at_parameter(guess.problem, guess.x)
        if point is None or np.linalg.norm(point.x - guess.x) > guess.max_correction:
            kind = f"motion of {guess.lobes} lobes" if guess.motion == PERIODIC else guess.motion.replace("_", " ")
            reasons[guess.number] = f"Newton's method finds no {kind} near the seed"
            return None
        if guess.motion == CIRCLE and circle.harmonic_tail(point.found) > circle.MAX_TAIL:
            reasons[guess.number] = "the circle that the motion fills is not smooth"
            return None
        candidate = _Candidate((0, guess.number), guess.motion, guess.lobes, guess.problem, point)
        if guess.motion == PERIODIC:
            return (yield from self._with_least_period(candidate))
        if guess.motion == CIRCLE:
            circles = yield from circle.images(guess.problem, point)
            return replace(candidate, signatures=tuple(self._signature_of_circle(point.found, w) for w in circles))
        return candidate

    def _with_least_period(self, candidate: _Candidate) -> Task[_Candidate]:
        """The same periodic motion with its least period."""
        orbit = candidate.point.found
        starts = lobe_starts(orbit, self.flow, candidate.lobes)
        state_scales = self.flow.state_scales(orbit.values)[0][list(orbit.free)]
        for lobes in range(1, candidate.lobes):
            if (
                candidate.lobes % lobes == 0
                and np.max(np.abs((starts[lobes] - starts[0]) / state_scales)) < DUPLICATE_DISTANCE
            ):
                problem = Periodic.at(self.flow, lobes, orbit.values, orbit.state)
                point = yield from corrected_at_parameter(
                    problem, problem.unknowns(orbit.mesh_states[:lobes], orbit.values[-1])
                )
                if point is not None:
                    return replace(candidate, lobes=lobes, problem=problem, point=point)
        return candidate

    def _at_angle_zero(self, seeds: list[Seed], reasons: list[str]) -> dict[int, Seed]:
        """The seeds at the drive angle 0, by number. Those of a model with lobes are
        run on to the next fold of a revolution."""
        symmetry = self.flow.symmetry
        started: dict[int, Seed] = {}
        if not seeds:
            return started
        if self.is_smooth:
            return {
                number: replace(seed, state=rotated(symmetry, seed.state, -seed.phase), phase=0.0)
                for number, seed in enumerate(seeds)
            }
        fold_angle = 2.0 * math.pi / symmetry.folds
        phases = np.array([seed.phase for seed in seeds])
        folds = np.ceil(phases / fold_angle - 1e-9)
        values = np.stack([seed.values for seed in seeds])
        durations = np.maximum((folds * fold_angle - phases) / self.flow.phase_rate(values), 1e-9)
        states = np.stack([seed.state for seed in seeds])
        legs = Legs(states, phases, durations, values, np.zeros(len(seeds), dtype=bool))
        ends = self.flow.run(legs)
        rotated_back = rotated(symmetry, ends.state, -folds * fold_angle)
        for number, seed in enumerate(seeds):
            if ends.ok[number]:
                started[number] = replace(seed, state=rotated_back[number], phase=0.0)
            else:
                reasons[number] = "the motion could not be integrated"
        return started

    def _guess(self, number: int, seed: Seed, reasons: list[str]) -> Task[_Guess | None]:
        """The motion that a seed seems to have settled on; None, with a reason, where
        it is of no kind that is followed."""
        if self.is_smooth:
            return (yield from self._smooth_guess(number, seed, reasons))
        orders, flow, free = self.orders, self.flow, list(self.flow.symmetry.free)
        state_scales = flow.state_scales(seed.values)[0]
        fold_angle, value = 2.0 * math.pi / flow.symmetry.folds, seed.values[-1]
        duration = fold_angle / flow.phase_rate(seed.values)
        starts, states, misses = [seed.state], [seed.state], dict[int, float]()

        def guess(lobes: int, max_correction: float) -> _Guess:
            problem = Periodic.at(flow, lobes, seed.values, seed.state)
            x = problem.unknowns(np.stack(states[:lobes]), value)
            signatures = [np.append((start / state_scales)[free], value / self.scale) for start in starts[:lobes]]
            return _Guess(number, PERIODIC, lobes, problem, x, signatures, max_correction)

        for lobes in range(1, max(orders.lobes) + 1) if orders.periodic else ():
            angle = np.array([(lobes - 1) * fold_angle])
            ends = yield Legs(states[-1][None], angle, duration, seed.values[None], np.zeros(1, dtype=bool))
            if not ends.ok[0]:
                reasons[number] = "the motion could not be integrated"
                return None
            states.append(ends.state[0])
            starts.append(rotated(flow.symmetry, ends.state, -lobes * fold_angle)[0])
            if seed.steady:
                return guess(1, MAX_CORRECTION)
            if lobes in orders.lobes:
                misses[lobes] = float(np.max(np.abs((starts[-1] - seed.state) / state_scales)[free]))
                if misses[lobes] < RETURN_TOLERANCE:
                    return guess(lobes, 10.0 * RETURN_TOLERANCE)
        if orders.circles and flow.symmetry.turned:
            fitted = yield from circle.fitted_circle(flow, seed.state, seed.values, orders.lobes)
            if fitted is not None:
                problem, x, means = fitted
                rotation = 10.0 * math.remainder(x[-2], 2.0 * math.pi)
                signatures = [
                    np.concatenate([[rotation], (mean / state_scales)[free], [value / self.scale]]) for mean in means
                ]
                return _Guess(number, CIRCLE, problem.lobes, problem, x, signatures, 1.0)
        if seed.near and misses and min(misses.values()) < UNSETTLED_TOLERANCE:
            return guess(min(misses, key=lambda lobes: misses[lobes]), MAX_CORRECTION)
        reason = "chaotic, stick-slip (a torus over lobes), or not settled"
        reasons[number] = f"neither a period of the lobes asked for nor a circle: {reason}"
        return None

    def _smooth_guess(self, number: int, seed: Seed, reasons: list[str]) -> Task[_Guess | None]:
        """The same for equations that are equal at every drive angle: an equilibrium or
        a cycle."""
        orders, flow, free = self.orders, self.flow, list(self.flow.symmetry.free)
        state_scales, value = flow.state_scales(seed.values)[0][free], seed.values[-1]
        rates_scaled = corotating_rates(flow, seed.state[None], seed.values)[0][free] / state_scales
        revolution = 2.0 * math.pi / float(flow.phase_rate(seed.values)[0])
        if np.linalg.norm(rates_scaled) * revolution < RETURN_TOLERANCE or seed.steady:
            if not orders.periodic:
                reasons[number] = "a steady motion, which the study does not ask for"
                return None
            equilibrium = Periodic.at(flow, 1, seed.values, seed.state)
            signature = np.append(seed.state[free] / state_scales, value / self.scale)
            return _Guess(
                number,
                EQUILIBRIUM,
                1,
                equilibrium,
                equilibrium.unknowns(seed.state[None], value),
                [signature],
                MAX_CORRECTION,
            )
        if not orders.cycles:
            reasons[number] = "a motion that does not stand still, which the study does not ask for"
            return None
        sampled = yield from sampled_cycle(
            flow,
            seed.state,
            seed.values,
            revolution / SAMPLES_PER_REVOLUTION,
            CYCLE_REVOLUTIONS * SAMPLES_PER_REVOLUTION,
        )
        if sampled is None:
            reasons[number] = "no cycle: the motion does not come back to its start"
            return None
        starts, period = sampled
        cycle = Cycle.at(flow, period, seed.values, starts[0])
        signature = np.array([10.0 * math.log(period), value / self.scale])
        return _Guess(number, CYCLE, 1, cycle, cycle.unknowns(starts, period, value), [signature], math.inf)

    # Known branches

    def _signatures(self, motion: str, lobes: int, point: Point) -> list[Array]:
        """Vectors that tell a motion from others of its kind, in natural scales: the
        start and the parameter of an orbit, one for each lobe at which it may begin;
        the logarithm of the period and the parameter of a cycle; the rotation, the mean
        of w and the parameter of a circle."""
        orbit, flow = point.found, self.flow
        parameter = orbit.values[-1] / self.scale
        if motion == CYCLE:
            return [np.array([10.0 * math.log(orbit.period), parameter])]
        if motion == CIRCLE:
            return [self._signature_of_circle(orbit, orbit.mesh_states)]
        state_scales = flow.state_scales(orbit.values)[0][list(orbit.free)]
        return [np.append(start / state_scales, parameter) for start in lobe_starts(orbit, flow, lobes)]

    def _signature_of_circle(self, orbit: Orbit, w: Array) -> Array:
        free = list(orbit.free)
        mean = w.mean(axis=0)[free] / self.flow.state_scales(orbit.values)[0][free]
        return np.concatenate([[10.0 * orbit.rotation], mean, [orbit.values[-1] / self.scale]])

    def _candidate_signatures(self, candidate: _Candidate) -> list[Array]:
        return [*candidate.signatures] or self._signatures(candidate.motion, candidate.lobes, candidate.point)

    def _lies_on_branch(self, motion: str, lobes: int, signatures: list[Array], tolerance: float = 0.0) -> bool:
        """Whether a motion lies on a known branch."""
        return any(
            branch.motion == motion
            and branch.lobes == lobes
            and passes_near(self._branch_line(number), signatures, tolerance)
            for number, branch in enumerate(self.branches)
        )

    def _branch_line(self, number: int) -> Array:
        """The signatures of the points of a known branch, in order; that of a single
        point twice."""
        if number not in self._branch_lines:
            branch = self.branches[number]
            signatures = [self._signatures(branch.motion, branch.lobes, entry.point)[0] for entry in branch.marked]
            self._branch_lines[number] = np.stack(signatures * 2 if len(signatures) == 1 else signatures)
        return self._branch_lines[number]

    def _is_known(self, candidate: _Candidate) -> bool:
        return self._lies_on_branch(candidate.motion, candidate.lobes, self._candidate_signatures(candidate))

    def _representatives(self, guesses: list[_Guess]) -> list[_Guess]:
        """The middle guess of every group of neighbours."""
        groups: list[list[_Guess]] = []
        for guess in sorted(guesses, key=lambda guess: (guess.motion, guess.lobes, guess.x[-1], guess.number)):
            for group in reversed(groups):
                last = group[-1]
                if (last.motion, last.lobes) != (guess.motion, guess.lobes):
                    continue
                if (
                    min(float(np.linalg.norm(signature - last.signatures[0])) for signature in guess.signatures)
                    < GROUP_DISTANCE
                ):
                    group.append(guess)
                    break
            else:
                groups.append([guess])
        return [group[len(group) // 2] for group in groups]

    # Branches

    def _follow_wave(self, wave: list[_Candidate]) -> None:
        """Follow the branches of a wave side by side; add those that are new."""
        tasks: dict[Any, Any] = {}
        self._growing_lines, self._rank = ({}, {candidate.key: index for index, candidate in enumerate(wave)})
        for candidate in wave:
            if candidate.key in self.stored:
                continue
            tasks[(*candidate.key, 1)] = self._follow_side(candidate, 1, candidate.point)
            if candidate.other is not None:
                tasks[(*candidate.key, -1)] = self._follow_side(candidate, 1, candidate.other)
            elif not candidate.one_side:
                tasks[(*candidate.key, -1)] = self._follow_side(candidate, -1, candidate.point)
        self._waves += bool(tasks)
        halves = advance(self.flow, tasks, self.poll, self._watched)
        followed: dict[Key, Branch] = {}
        for candidate in wave:
            if candidate.key in self.stored:
                branch = self.stored[candidate.key]
            else:
                forward, backward = halves[(*candidate.key, 1)], halves.get((*candidate.key, -1))
                branch = self._branch(candidate, forward, backward)
                followed[candidate.key] = branch
            if not self._is_known(candidate):
                self.branches.append(branch)
        self.store(followed)

    def _watched(self, running: Collection[Key]) -> None:
        """Tell how far the branches of a wave are, of which these sides go on."""
        points: dict[Key, int] = {}
        for side, line in self._growing_lines.items():
            points[side[:-1]] = points.get(side[:-1], 0) + len(line)
        sides: dict[Key, int] = {}
        for side in running:
            sides[side[:-1]] = sides.get(side[:-1], 0) + 1
        longest = max(map(len, self._growing_lines.values()), default=0)
        left = max((max(0, self.orders.points - points.get(key, 0)) // n for key, n in sides.items()), default=0)
        self.watch(Wave(self._waves, len(points), len(sides), sum(points.values()), longest, left))

    def _branch(self, candidate: _Candidate, forward: HalfBranch, backward: HalfBranch | None) -> Branch:
        if forward.ended == "closed":
            backward = None
        seed = LabelledPoint(candidate.point)
        if candidate.other is not None and backward is not None:
            backward = HalfBranch([LabelledPoint(candidate.other), *backward.points], backward.ended)
            backward = HalfBranch(
                [replace(entry, point=replace(entry.point, s=entry.point.s + 0.1)) for entry in backward.points],
                backward.ended,
            )
        branch = assembled(
            candidate.motion, candidate.lobes, seed, backward, forward, candidate.parent, candidate.parent_point
        )
        return replace(branch, ended=("closed", "closed")) if forward.ended == "closed" else branch

    def _test_functions(self, candidate: _Candidate) -> TestFunctions:
        if candidate.motion == CIRCLE:
            return circle.circle_test_functions(self.orders.grazes)
        return orbit_test_functions(self.orders.grazes, equilibrium=candidate.motion == EQUILIBRIUM)

    def _follow_side(self, candidate: _Candidate, direction: int, start: Point) -> Task[HalfBranch]:
        """One side of a branch. Where Newton's method fails, it continues with twice
        the segments. Touches of circles are located on finer ones."""
        orders, test_functions = self.orders, self._test_functions(candidate)
        stop = self._side_stop(candidate, direction if candidate.other is None or start is candidate.point else -1)
        problem: Any = candidate.problem
        max_points = orders.points
        # A branch of circles ends where it has a kink.
        has_kink = kink_predicate(0 if candidate.motion == CIRCLE else len(self.flow.equations.contacts))
        # A circle has no monodromy.
        stability = None if candidate.motion == CIRCLE else stability_of(start.found.trivial)
        half = yield from follow(
            problem,
            start,
            direction,
            self.bounds,
            max_points,
            test_functions,
            stop,
            has_kink=has_kink,
            stability=stability,
        )
        while (
            half.ended.startswith("no convergence")
            and isinstance(problem, Periodic)
            and problem.segments < MAX_SEGMENTS_PER_LOBE * candidate.lobes
            and len(half.points) - half.inserted < max_points
        ):
            last = half.points[-1].point if half.points else replace(start, tangent=direction * start.tangent)
            problem = replace(problem, segments=2 * problem.segments)
            states = yield from segment_starts(problem, last.found.state, last.found.values)
            if states is None:
                break
            restarted = yield from corrected_at_parameter(problem, problem.unknowns(states, last.found.values[-1]))
            if restarted is None or np.max(np.abs(restarted.found.state - last.found.state)) > 1e-3 * np.max(
                np.abs(last.found.state) + 1e-9
            ):
                continue
            restart_direction = 1 if last.tangent[-1] > 0.0 else -1
            remaining = max_points - len(half.points) + half.inserted
            continuation = yield from follow(
                problem,
                restarted,
                restart_direction,
                self.bounds,
                remaining,
                test_functions,
                stop,
                has_kink=has_kink,
                stability=stability,
            )
            if not continuation.points:
                continue
            offset = last.s
            half = HalfBranch(
                half.points
                + [
                    replace(entry, point=replace(entry.point, s=offset + entry.point.s))
                    for entry in continuation.points
                ],
                continuation.ended,
                half.inserted + continuation.inserted,
            )
        if candidate.motion == CIRCLE:
            points = yield from circle.with_located_touches(problem, half.points, test_functions)
            half = replace(half, points=points)
        return half

    def _side_stop(self, candidate: _Candidate, direction: int) -> Callable[[Point, Point], str]:
        """The stop function of one side of a branch. It ends as by
        :meth:`_merging_stop`, where the motion is too unstable, where it meets a known
        branch or its own other side, and where it, or its seed, lies on a branch that
        comes before it in the same wave."""
        merging_stop = self._merging_stop(candidate)
        seed = self._candidate_signatures(candidate)
        line = self._growing_lines.setdefault((*candidate.key, direction), [seed[0]])
        kind = (candidate.motion, candidate.lobes)
        self._kinds[(*candidate.key, direction)] = kind

        def stop(previous: Point, current: Point) -> str:
            if reason := merging_stop(previous, current):
                return reason
            # Both sides share the points of a branch.
            if sum(len(self._growing_lines.get((*candidate.key, side), ())) for side in (1, -1)) > self.orders.points:
                return "points"
            if (
                candidate.motion == PERIODIC
                and np.max(np.abs(current.found.multipliers)) > MAX_MULTIPLIER**candidate.lobes
            ):
                return "wild"
            signatures = self._signatures(candidate.motion, candidate.lobes, current)
            # Of several signatures the one that continues the line.
            line.append(min(signatures, key=lambda signature: float(np.linalg.norm(signature - line[-1]))))
            # The first points lie near the branch from which this one emanates.
            if len(line) > NEAR_PARENT and self._lies_on_branch(candidate.motion, candidate.lobes, signatures):
                return "known"
            for key, other in self._growing_lines.items():
                if (
                    key == (*candidate.key, -direction)
                    and min(len(line), len(other)) > 5
                    and passes_near(np.stack(other), signatures)
                ):
                    return "closed"  # the two sides meet
                if self._rank[key[:-1]] >= self._rank[candidate.key] or self._kinds[key] != kind or len(other) < 2:
                    continue
                if passes_near(np.stack(other), [*signatures, *seed]):
                    return "known"
            return ""

        return stop

    def _merging_stop(self, candidate: _Candidate) -> Callable[[Point, Point], str]:
        """The stop function where a branch merges with another: a motion over an even
        number of lobes where its halves become equal, a cycle where it shrinks to a
        steady motion. A branch of circles also ends where it loses its smoothness."""
        if candidate.motion == CIRCLE:
            return circle.circle_stop(self.flow.symmetry)
        if candidate.motion == EQUILIBRIUM or (candidate.motion == PERIODIC and candidate.lobes % 2):
            return lambda previous, current: ""
        reason = "still" if candidate.motion == CYCLE else "half"

        def difference(point: Point) -> Array:
            orbit = point.found
            state_scales = self.flow.state_scales(orbit.values)[0][list(orbit.free)]
            if candidate.motion == CYCLE:
                half = len(orbit.mesh_states) // 2
                return np.asarray((orbit.mesh_states[half] - orbit.mesh_states[0])[list(orbit.free)] / state_scales)
            starts = lobe_starts(orbit, self.flow, candidate.lobes)
            return np.asarray((starts[candidate.lobes // 2] - starts[0]) / state_scales)

        def stop(previous: Point, current: Point) -> str:
            before, after = difference(previous), difference(current)
            return reason if before @ after < 0.0 and np.linalg.norm(after) < 2.0 else ""

        return stop

    # Switching

    def _has_untried(self, switched: set[tuple[int, int]]) -> bool:
        """Whether a special point is left from which a branch may emanate."""
        return any(
            (number, index) not in switched and entry.label in (HOPF, BRANCH, DOUBLING)
            for number, branch in enumerate(self.branches)
            for index, entry in enumerate(branch.marked)
        )

    def _emanating(self, switched: set[tuple[int, int]]) -> list[_Candidate]:
        """The new branches that emanate from the first untried special point of every
        branch."""
        tasks: dict[Any, Any] = {}
        for number, branch in enumerate(self.branches):
            for index, entry in enumerate(branch.marked):
                if (number, index) in switched or entry.label not in (HOPF, BRANCH, DOUBLING):
                    continue
                switched.add((number, index))
                tasks[(number, index)] = self._switched(number, index, branch, entry)
                break
        candidates = self._advance(tasks)
        return [
            candidate for candidate in candidates.values() if candidate is not None and not self._is_known(candidate)
        ]

    def _switched(self, number: int, index: int, branch: Branch, entry: LabelledPoint) -> Task[_Candidate | None]:
        """The branch that emanates from a special point; None where none is found or
        asked for."""
        flow, orbit = self.flow, entry.point.found
        key = (1, number, index)
        problem: Problem
        if entry.label == HOPF and branch.motion == EQUILIBRIUM and self.orders.cycles:
            hopf = hopf_problem(flow, orbit)
            if hopf is None:
                return None
            point = yield from first_point_on(*hopf)
            return (
                None
                if point is None
                else _Candidate(key, CYCLE, 1, hopf[0].updated(point.x), point, number, index, True)
            )
        if entry.label == DOUBLING and branch.motion == CYCLE:
            cycle = Cycle.at(flow, orbit.period, orbit.values, orbit.state, len(orbit.mesh_states))
            doubling = cycle_doubling_problem(cycle, orbit)
            if len(orbit.mesh_states) > 4 * 6:
                return None
            point = yield from first_point_on(*doubling)
            return (
                None
                if point is None
                else _Candidate(key, CYCLE, 1, doubling[0].updated(point.x), point, number, index, True)
            )
        if branch.motion != PERIODIC:
            return None
        if entry.label == DOUBLING and 2 * branch.lobes <= max(self.orders.lobes):
            problem = Periodic.at(flow, 2 * branch.lobes, orbit.values, orbit.state)
            point = yield from switched_at_doubling(problem, orbit)
            return (
                None
                if point is None
                else _Candidate(key, PERIODIC, 2 * branch.lobes, problem, point, number, index, True)
            )
        if entry.label == BRANCH:
            problem = Periodic.at(flow, branch.lobes, orbit.values, orbit.state, len(orbit.mesh_states))
            forward = yield from switched_at_branch_point(problem, orbit, 1)
            backward = yield from switched_at_branch_point(problem, orbit, -1)
            if forward is None and backward is None:
                return None
            first, other = (forward, backward) if forward is not None else (backward, None)
            assert first is not None
            return _Candidate(
                key, PERIODIC, branch.lobes, problem, first, number, index, one_side=other is None, other=other
            )
        return None


__all__ = ["Explorer", "Found", "Orders", "Seed"]
