"""From seeds to branches: which motions are followed, and which branches emanate from
them.

Branches are followed in waves. Each wave follows, side by side, one seed of every group
of neighbours that lies on no branch yet and the branch that emanates from one special
point of every branch; duplicates are dropped. Each branch is stored when it ends. The
result is the same whether it is computed at once or resumed from stored branches, also
from some of a wave: the others then meet their points in the rounds in which these were
found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from dataclasses import replace
from typing import TypeVar

import numpy as np

from nsdrill.analysis.bifurcations import BRANCH, CYCLE, DOUBLING, END, EQUILIBRIUM, FAILED, HOPF, PERIODIC
from nsdrill.data import Array
from nsdrill.orbit.arclength import MET, NO_CONVERGENCE, HalfBranch
from nsdrill.orbit.branch import Branch, Key, Stretch
from nsdrill.orbit.flow import DIFFERENCE_STEP, Flow, Task, advance, gather
from nsdrill.orbit.newton import Point, Problem, corrected
from nsdrill.orbit.periodic import SEGMENTS, Cycle, Periodic, corotating_rates, segment_starts
from nsdrill.orbit.seeds import (
    RETURN_TOLERANCE,
    Candidate,
    Guess,
    Kind,
    Orders,
    Seed,
    at_angle_zero,
    candidate_of,
    equal_parts,
    guess_of,
    representatives,
    signatures,
)
from nsdrill.orbit.shooting import Orbit
from nsdrill.orbit.sides import Known, Side, followed_side, repeated
from nsdrill.orbit.special import LabelledPoint
from nsdrill.records import dataclass

T = TypeVar("T", bound=Guess | Candidate)
MAX_WAVES = 40
STEP_LENGTHS = (0.05, 0.2, 0.01)  # from the bifurcation, in natural scales, in order of trial
MAX_CYCLE_SEGMENTS = 4 * SEGMENTS  # of a cycle whose doubling is followed
BETWEEN_SIDES = 0.1  # arclength from a branch point to the first point on its other side


@dataclass
class Found:
    """The ``branches``, and for each of the ``seeds`` ``followed`` or the reason why it
    was not. ``sprung`` are the special points, by the numbers of the branch and of the point, of
    which the branch that springs there is one of the branches; None where it is not known."""

    branches: list[Branch]
    seeds: list[str]
    sprung: set[tuple[int, int]] | None = None


@dataclass(frozen=True)
class Going:
    """How far a branch of this ``kind`` is: its ``points``, and where its sides are that go
    on, values of the continued number (SI)."""

    kind: Kind
    points: int
    at: tuple[float, ...]


@dataclass(frozen=True)
class Wave:
    """How far the branches are that are followed side by side, in the round with this
    ``number``: how many ``branches``; those of them that go on, ``running``; and how many
    of the ``seeds`` lie on no branch that has ended, and are not given up: ``open``."""

    number: int
    branches: int
    running: tuple[Going, ...]
    open: int
    seeds: int


class Explorer:
    """Follows all branches that can be reached from seeds. ``stored`` are branches of
    an earlier run, by key; ``store`` is called with each new branch as it ends, and
    ``watch`` often while others are followed; ``poll`` is called often, and may raise to
    stop."""

    def __init__(
        self,
        flow: Flow,
        orders: Orders,
        stored: dict[Key, Branch] | None = None,
        store: Callable[[Key, Branch], None] = lambda key, branch: None,
        poll: Callable[[], None] = lambda: None,
        watch: Callable[[Wave], object] = lambda wave: None,
    ) -> None:
        self.flow, self.orders, self.stored, self.store, self.poll = flow, orders, stored or {}, store, poll
        self.watch, self.known, self._waves = watch, Known(flow), 0
        self._tried: set[tuple[int, int]] = set()  # branch and special point
        self._sprung: set[tuple[int, int]] = set()  # of these those from which a branch was found
        self._ended: dict[Key, Branch] = {}  # of a wave
        self._own: dict[Key, Stretch] = {}  # of the known branches
        self.seeds = self.open = 0

    def run(self, seeds: list[Seed]) -> Found:
        """The branches from ``seeds``, and which seeds were followed."""
        flow, orders, outcomes = self.flow, self.orders, ["followed"] * len(seeds)
        self.seeds = self.open = len(seeds)
        at_zero = enumerate(at_angle_zero(flow, seeds))
        first = advance(flow, {n: guess_of(flow, orders, n, seed) for n, seed in at_zero}, self.poll)
        guesses = self._taken(first, outcomes)
        for _ in range(MAX_WAVES):
            guesses = self._on_no_branch(guesses)
            chosen = representatives(guesses)
            found = advance(flow, {guess.number: candidate_of(flow, guess) for guess in chosen}, self.poll)
            taken: list[Candidate | Guess] = self._taken(found, outcomes)
            shorter = [one for one in taken if isinstance(one, Guess)]
            guesses = [guess for guess in guesses if guess.number not in found] + shorter
            self.open = len(guesses) + len(chosen) - len(shorter)
            wave = self._new([one for one in taken if isinstance(one, Candidate)]) + self._emanating()
            if wave:
                self._follow_wave(wave)
            elif not guesses and not self._special_points():
                break
        for guess in self._on_no_branch(guesses):
            outcomes[guess.number] = f"left when {MAX_WAVES} rounds of seeds had been followed"
        return Found(self.known.branches, outcomes, self._sprung)

    @staticmethod
    def _taken(results: dict[int, T | str], outcomes: list[str]) -> list[T]:
        """The ``results`` but for reasons, which become the outcomes of their seeds."""
        for number, result in results.items():
            if isinstance(result, str):
                outcomes[number] = result
        return [result for result in results.values() if not isinstance(result, str)]

    def _on_no_branch(self, guesses: list[Guess]) -> list[Guess]:
        tasks = {
            one.number: self.known.on_branch(one.kind, one.signatures, one.problem.states(one.x), RETURN_TOLERANCE)
            for one in guesses
        }
        on_branch = advance(self.flow, tasks, self.poll)
        return [one for one in guesses if not on_branch[one.number]]

    def _new(self, candidates: Collection[Candidate]) -> list[Candidate]:
        tasks = {
            one.key: self.known.on_branch(
                one.kind, one.signatures, one.point.found.mesh_states, but=one.parent if one.crosses else -1
            )
            for one in candidates
        }
        on_branch = advance(self.flow, tasks, self.poll)
        return [one for one in candidates if not on_branch[one.key]]

    def _special_points(self) -> dict[tuple[int, int], tuple[Branch, LabelledPoint]]:
        """The special points from which a branch may emanate that were not tried yet, by
        the numbers of the branch and of the point."""
        return {
            (number, index): (branch, entry)
            for number, branch in enumerate(self.known.branches)
            for index, entry in enumerate(branch.marked)
            if self.orders.switch and entry.label in (HOPF, BRANCH, DOUBLING) and (number, index) not in self._tried
        }

    def _emanating(self) -> list[Candidate]:
        """The new branches that emanate from the first untried special point of every
        branch."""
        first = {place[0]: (place, entry) for place, entry in reversed(self._special_points().items())}
        places = dict(sorted(first.values(), key=lambda one: one[0]))
        self._tried |= places.keys()
        tasks = {place: emanating(self.flow, self.orders, (1, *place), *entry) for place, entry in places.items()}
        found = advance(self.flow, tasks, self.poll)
        self._sprung |= {place for place, one in found.items() if one is not None}
        return self._new([one for one in found.values() if one is not None])

    def _follow_wave(self, wave: list[Candidate]) -> None:
        """Follow the branches of a wave side by side; add those that are new."""
        is_new = not all(one.key in self.stored for one in wave)
        self._ended = {one.key: self.stored[one.key] for one in wave if one.key in self.stored}
        self.known.sides = {
            (*one.key, number): side
            for one in wave
            if is_new
            for number, side in _sides(one, self.orders.direction).items()
        }
        self.known.round, halves = 0, dict[Key, HalfBranch]()
        self._waves += is_new
        tasks = {key: self._side(key, side, halves) for key, side in self.known.sides.items()}
        advance(self.flow, tasks, self.poll, self._watched)
        for one in wave:
            if self._new([one]) and (own := self.known.own_points(self._ended[one.key])) is not None:
                self.known.branches.append(self._ended[one.key].stretch(own))
                self._own[one.key] = own
        self._ended = {}

    def _side(self, key: Key, side: Side, halves: dict[Key, HalfBranch]) -> Task[None]:
        """Follow a side of a branch into ``halves``; where it is the last one of the branch,
        the branch is stored at once. A stored one is not followed again."""
        candidate = side.candidate
        if candidate.key in self.stored:
            yield from repeated(
                self.known, side, self.stored[candidate.key].tracks[key[-1]], self.stored[candidate.key]
            )
            return
        halves[key] = yield from followed_side(self.flow, self.orders, self.known, side)
        own = {other[-1]: one for other, one in self.known.sides.items() if one.candidate is candidate}
        if all((*candidate.key, number) in halves for number in own):
            forward, *backward = (one.until_cut(halves[*candidate.key, number]) for number, one in own.items())
            branch = _branch(candidate, forward, backward[0] if backward else None)
            branch = replace(branch, tracks={number: one.track for number, one in own.items()})
            self._ended[candidate.key] = branch
            self.store(candidate.key, branch)

    @property
    def so_far(self) -> dict[Key, Stretch]:
        """The stretches of the branches that have ended, those of the wave that is followed
        last; some of these may turn out to be parts of others."""
        return {**self._own, **{key: (0, len(branch)) for key, branch in self._ended.items()}}

    def _watched(self, running: Collection[Key]) -> None:
        """Tell how far the branches of a wave are, of which these sides go on."""
        self.known.round += 1
        at: dict[Key, list[float]] = {}
        for key in running:
            if key[:-1] not in self._ended:
                at.setdefault(key[:-1], []).append(self.known.sides[key].at)
        kinds = {key[:-1]: side.candidate.kind for key, side in self.known.sides.items()}
        going = tuple(Going(kinds[key], self.known.points_of(key), tuple(ends)) for key, ends in at.items())
        self.watch(Wave(self._waves, len(kinds), going, self.open, self.seeds))


def _sides(candidate: Candidate, direction: int) -> dict[int, Side]:
    """The sides of the branch of a candidate that are followed, by their numbers 1 and
    -1: of one that begins at a seed only that in the ``direction`` of the parameter, if
    one is given."""
    seed = candidate.signatures[0]
    if direction and candidate.parent < 0:
        along = 1 if candidate.point.tangent[-1] >= 0.0 else -1
        return {1: Side(candidate, candidate.point, direction * along, [seed])}
    sides = {1: Side(candidate, candidate.point, 1, [seed])}
    if candidate.other is not None:
        sides[-1] = Side(candidate, candidate.other, 1, [seed])
    elif not candidate.one_side:
        sides[-1] = Side(candidate, candidate.point, -1, [seed])
    return sides


def _branch(candidate: Candidate, forward: HalfBranch, backward: HalfBranch | None) -> Branch:
    """The branch of a candidate from its sides; with one side it begins at the seed. Where
    the sides meet, it begins and ends with their common point."""
    if forward.ended == "closed":
        backward = None
    elif candidate.other is not None and backward is not None:
        points = [LabelledPoint(candidate.other), *backward.points]
        backward = HalfBranch(points, backward.ended).shifted(BETWEEN_SIDES)
    before = [] if backward is None else backward.points[::-1]
    offset = before[0].point.s if before else 0.0
    marked = [replace(entry, point=replace(entry.point, s=offset - entry.point.s)) for entry in before]
    marked += [LabelledPoint(replace(candidate.point, s=offset)), *forward.shifted(offset).points]
    begins = ("start" if candidate.parent < 0 else "seed") if backward is None else backward.ended
    is_closed = forward.ended == "closed" or MET in (begins, forward.ended)
    ended = ("closed", "closed") if is_closed else (begins, forward.ended)
    for index, reason in ((0, ended[0]), (-1, ended[1])):
        if marked[index].label == 0 and reason not in ("closed", "seed", "start"):
            label = FAILED if reason.startswith(NO_CONVERGENCE) else END
            marked[index] = replace(marked[index], label=label)
    return Branch(*candidate.kind, marked, ended, candidate.parent, candidate.parent_point)


# Branch switching: the first point of a branch that emanates from a period doubling, a
# branch point or a Hopf bifurcation of another branch.


def emanating(flow: Flow, orders: Orders, key: Key, branch: Branch, entry: LabelledPoint) -> Task[Candidate | None]:
    """The branch that emanates from a special point of a ``branch``; None where none is
    found or asked for. ``key`` ends with the numbers of the branch and of the point."""
    orbit, motion = entry.point.found, branch.motion
    problem: Periodic | Cycle
    if entry.label == HOPF and motion == EQUILIBRIUM and orders.cycles:
        hopf = _hopf(flow, orbit)
        if hopf is None:
            return None
        problem, tasks = hopf[0], [first_point_on(*hopf)]
    elif entry.label == DOUBLING and motion == CYCLE and len(orbit.mesh_states) <= MAX_CYCLE_SEGMENTS:
        doubled = _doubled_cycle(flow, orbit)
        problem, tasks = doubled[0], [first_point_on(*doubled)]
    elif entry.label == DOUBLING and motion == PERIODIC and 2 * branch.lobes <= max(orders.lobes):
        longer = problem = Periodic.at(flow, 2 * branch.lobes, orbit.values, orbit.state)
        tasks = [_switched(longer, orbit, critical_vector(orbit, -1.0))]
    elif entry.label == BRANCH and motion in (EQUILIBRIUM, PERIODIC, CYCLE):
        problem = _problem_at(flow, branch, orbit)
        base, across = yield from _across(problem, branch, entry)
        tasks = [first_point_on(problem, base, one) for one in across]
    else:
        return None
    sides = yield from gather(dict(enumerate(tasks)))
    kind = (motion, branch.lobes) if entry.label == BRANCH else _kind_of(problem)
    found = []
    for _, one in sorted(sides.items()):
        if one is not None and (yield from equal_parts(flow, kind, one.found)) == 1:
            found.append(one)
    if not found:
        return None
    point, other = found[0], found[1] if len(found) > 1 else None
    own = signatures(flow, kind, point.found)
    crosses = entry.label == BRANCH
    return Candidate(key, kind, problem.updated(point.x), point, own, key[-2], key[-1], other is None, other, crosses)


def _kind_of(problem: Periodic | Cycle) -> Kind:
    """The kind of the motions that emanate at a doubling or a Hopf bifurcation."""
    return (CYCLE, 1) if isinstance(problem, Cycle) else (PERIODIC, problem.lobes)


def _problem_at(flow: Flow, branch: Branch, orbit: Orbit) -> Periodic | Cycle:
    """The problem of the motions of a ``branch``, near one of them."""
    segments = len(orbit.mesh_states)
    if branch.motion == CYCLE:
        return Cycle.at(flow, orbit.period, orbit.values, orbit.state, segments)
    return Periodic.at(flow, branch.lobes, orbit.values, orbit.state, segments)


def _unknowns(problem: Periodic | Cycle, orbit: Orbit) -> Array:
    """The unknowns of ``problem`` at a motion."""
    if isinstance(problem, Cycle):
        return problem.unknowns(orbit.mesh_states, orbit.period, orbit.values[-1])
    return problem.unknowns(orbit.mesh_states, orbit.values[-1])


def _across(problem: Periodic | Cycle, branch: Branch, entry: LabelledPoint) -> Task[tuple[Array, list[Array]]]:
    """The unknowns at a branch point of a ``branch``, and both directions in which another one crosses
    there. Where two branches cross the Jacobian has two null vectors: this one is normal to that
    along the branch. The critical vector of the motion alone does not tell it: where the branch
    turns back, that is the vector along it. No direction where the runs fail."""
    place = next(k for k, one in enumerate(branch.marked) if one is entry)
    base = _unknowns(problem, entry.point.found)
    neighbours = branch.marked[max(place - 1, 0) : place] + branch.marked[place + 1 : place + 2]
    beside = [_unknowns(problem, one.point.found) for one in neighbours]
    evaluation = yield from problem.evaluate(base)
    same = [one for one in beside if one.shape == base.shape]
    if evaluation is None or not same:
        return base, []
    along = same[-1] - same[0] if len(same) > 1 else same[0] - base
    null = np.linalg.svd(evaluation.jacobian)[2][-2:]
    one, other = null @ along
    vector = other * null[0] - one * null[1]
    return base, [vector, -vector]


def first_point_on(problem: Problem, base: Array, direction: Array) -> Task[Point | None]:
    """The first point of ``problem`` away from the unknowns ``base`` in a
    ``direction``; None where no step leads to one."""
    length = float(np.linalg.norm(direction))
    if not length > 0.0:
        return None
    normal = direction / length
    for step in STEP_LENGTHS:
        point = yield from corrected(problem, base + step * normal, normal, normal)
        if point is None:
            continue
        displacement = point.x - base
        if abs(normal @ displacement) > 0.5 * step and np.linalg.norm(displacement) < 10.0 * step:
            return point
    return None


def _switched(problem: Periodic, orbit: Orbit, vector: Array) -> Task[Point | None]:
    """The first point of ``problem`` away from the orbit, whose start is displaced along
    ``vector`` [free]."""
    states = yield from segment_starts(problem, orbit.state, orbit.values)
    displaced = orbit.state.copy()
    step = 1e-4
    displaced[list(orbit.free)] += step * vector * problem.state_scales
    neighbours = yield from segment_starts(problem, displaced, orbit.values)
    if states is None or neighbours is None:
        return None
    base = problem.unknowns(states, orbit.values[-1])
    direction = (problem.unknowns(neighbours, orbit.values[-1]) - base) / step
    return (yield from first_point_on(problem, base, direction))


def _doubled_cycle(flow: Flow, orbit: Orbit) -> tuple[Cycle, Array, Array]:
    """The problem of the cycles of twice the period that emanate at a doubling of
    cycles, its unknowns there, and their direction."""
    segments, period = len(orbit.mesh_states), 2.0 * orbit.period
    doubled = Cycle.at(flow, period, orbit.values, orbit.state, 2 * segments)
    vector = critical_vector(orbit, -1.0)
    base = doubled.unknowns(np.concatenate([orbit.mesh_states] * 2), period, orbit.values[-1])
    direction, n = np.zeros(len(base)), len(vector)
    direction[:n] = vector
    direction[segments * n : (segments + 1) * n] = -vector
    return doubled, base, direction


def _hopf(flow: Flow, orbit: Orbit) -> tuple[Cycle, Array, Array] | None:
    """The problem of the cycles that emanate from an equilibrium at a Hopf bifurcation,
    its unknowns there, and their direction; None where the equilibrium has no complex
    pair of multipliers."""
    assert orbit.monodromy is not None
    multipliers, vectors = np.linalg.eig(orbit.monodromy)
    pairs = np.flatnonzero(multipliers.imag > 1e-6)
    if not len(pairs):
        return None
    nearest = pairs[np.argmin(np.abs(np.abs(multipliers[pairs]) - 1.0))]
    vector = vectors[:, nearest]
    angle, expected = float(np.angle(multipliers[nearest])), _frequency(flow, orbit, vector) * orbit.period
    # The multiplier tells the angle but for full turns.
    frequency = (angle + 2.0 * math.pi * round((expected - angle) / (2.0 * math.pi))) / orbit.period
    if frequency < 0.0:
        frequency, vector = -frequency, np.conj(vector)
    period = 2.0 * math.pi / frequency
    cycle = Cycle.at(flow, period, orbit.values, orbit.state)
    states = np.real(vector[None, :] * np.exp(2j * math.pi * np.arange(SEGMENTS) / SEGMENTS)[:, None])
    base = cycle.unknowns(np.tile(orbit.state, (SEGMENTS, 1)), period, orbit.values[-1])
    direction = np.concatenate([states.ravel() / math.sqrt(SEGMENTS), [0.0, 0.0]])
    # The normal of the phase condition is the flow at the start, which vanishes at an
    # equilibrium: that of the emanating cycles is taken.
    return cycle.with_normal(orbit.state, np.imag(vector)), base, direction


def _frequency(flow: Flow, orbit: Orbit, vector: np.ndarray) -> float:
    """The imaginary part [rad/s] of the eigenvalue of the rates at an equilibrium that belongs
    to an eigenvector, in natural scales [free], from central differences."""
    free = list(orbit.free)
    scales = flow.state_scales(orbit.values)[0][free]
    states = np.tile(orbit.state, (4, 1))
    steps = DIFFERENCE_STEP * np.stack([vector.real, -vector.real, vector.imag, -vector.imag])
    states[:, free] += steps * scales
    rates = corotating_rates(flow, states, orbit.values)[:, free] / scales
    change = ((rates[0] - rates[1]) + 1j * (rates[2] - rates[3])) / (2.0 * DIFFERENCE_STEP)
    return float((np.vdot(vector, change) / np.vdot(vector, vector)).imag)


def critical_vector(orbit: Orbit, multiplier: float) -> np.ndarray:
    """The unit eigenvector, in natural scales, of a critical ``multiplier`` (1 or -1):
    the right singular vector of the smallest singular value of the shifted
    monodromy."""
    assert orbit.monodromy is not None
    _, _, right = np.linalg.svd(orbit.monodromy - multiplier * np.eye(len(orbit.monodromy)))
    return np.asarray(right[-1])
