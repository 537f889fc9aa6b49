"""From seeds to branches: which motions are followed, what springs from them, and what
is there already.

The work goes in waves. In each, one seed of every group of neighbours that lies on no
branch yet and one special point of every branch is followed, all side by side; what
turns out to be the same branch is dropped. The outcome is the same whether it is made
at once or taken up again from branches that were kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import (
    BRANCH,
    CIRCLE,
    CYCLE,
    DOUBLING,
    EQUILIBRIUM,
    HOPF,
    PERIODIC,
)
from nsdrill.orbit import circle
from nsdrill.orbit.arclength import Half, Marked, Point, Problem, Steps, Tests, follow, settled
from nsdrill.orbit.branch import Branch, assembled, passes
from nsdrill.orbit.cycle import Cycle, rates, sampled_cycle
from nsdrill.orbit.flow import Flow, Legs
from nsdrill.orbit.frame import turned
from nsdrill.orbit.labels import Graze, kinks_of, margins_of, tests_of
from nsdrill.orbit.periodic import Orbit, Periodic, between_segments, starts_of
from nsdrill.orbit.rounds import advance
from nsdrill.orbit.switch import at_hopf, branched, doubled, doubled_cycle, started

Array = np.ndarray[Any, np.dtype[np.float64]]
Key = tuple[int, ...]
NEAR = 0.05  # in natural scales: how far a settled motion may miss its start after a period
# the same where it may not have settled, and how far Newton's method may then go
MISS, AFAR = 2.0, 3000.0
SAME = 1e-4  # in natural scales: two starts of a motion that are one
NEAR_PARENT = 6  # points
MOST_WAVES = 40
WILD = 1e3  # a multiplier over one fold: such a motion is too unstable to be followed
GROUP = 1.5  # in natural scales: neighbouring seeds that are likely to lie on one branch
FINEST = 8  # segments to a lobe
REVOLUTIONS, PER_REVOLUTION = 24, 96  # that a cycle is looked for


@dataclass(frozen=True)
class Seed:
    """A settled motion: its ``state`` [states] at the drive angle ``phase`` [rad], and
    the ``values`` of what is continued. ``near``: it may not have settled, and the
    motion nearest to it is looked for; ``steady``: it is a guess of steady drilling, or
    of the motion over one lobe, that need not be stable."""

    state: Array
    phase: float
    values: Array
    near: bool = False
    steady: bool = False


@dataclass(frozen=True)
class Orders:
    """What is asked for: the ``lobes`` that are tried, shortest first, to the longest
    of which doublings are followed; whether ``periodic`` motions, ``cycles`` and
    ``circles`` are followed; the ``bounds`` of the number continued, in SI; ``points``
    a branch at most; whether to ``switch`` at doublings and the like; what it means
    that a contact is reached or lost, ``grazes`` by its place."""

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
    """The ``branches``, and what became of each seed: the number of its branch, or why
    it has none in words."""

    branches: list[Branch]
    seeds: list[str]


@dataclass(frozen=True)
class _Guess:
    """What a seed seems to have settled on: its ``problem``, the unknowns ``x`` nearby,
    and how it is told from others (:meth:`Explorer._signatures`); ``far`` is how far
    Newton's method may move them."""

    number: int
    motion: str
    lobes: int
    problem: Any
    x: Array
    signatures: list[Array]
    far: float


@dataclass(frozen=True)
class _Candidate:
    """A converged motion from which a branch may be followed. ``signatures`` tell it
    from others where those of its start are not enough."""

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


class Explorer:
    """Follows all that can be found. ``known`` are branches that were kept, by key;
    ``keep`` is told of those of each wave; ``look`` is called often, and may raise to
    stop; ``begin`` is told how many branches a wave has."""

    def __init__(
        self,
        flow: Flow,
        orders: Orders,
        known: dict[Key, Branch] | None = None,
        keep: Callable[[dict[Key, Branch]], None] = lambda branches: None,
        look: Callable[[], None] = lambda: None,
        begin: Callable[[int], object] = lambda number: None,
    ) -> None:
        self.flow, self.orders, self.known, self.keep, self.look = (
            flow,
            orders,
            known or {},
            keep,
            look,
        )
        self.begin = begin
        self.scale = float(flow.scales[-1])
        low, high = orders.bounds
        self.bounds = (low / self.scale, high / self.scale)
        self.smooth = flow.symmetry.folds == 0
        self.branches: list[Branch] = []
        # of the branches that grow: their points so far, as signatures
        self._lines: dict[Key, list[Array]] = {}
        self._made: dict[int, Array] = {}
        self._rank: dict[Key, int] = {}
        self._kinds: dict[Key, tuple[str, int]] = {}

    def _all(self, jobs: dict[Any, Generator[Any, Any, Any]]) -> dict[Any, Any]:
        return advance(self.flow, jobs, look=self.look)

    # Seeds

    def run(self, seeds: list[Seed]) -> Found:
        """The branches from these seeds."""
        words = [""] * len(seeds)
        begun = self._begun(seeds, words)
        guessed = self._all(
            {number: self._guessed(number, seed, words) for number, seed in begun.items()}
        )
        guesses = [guessed[number] for number in begun if guessed[number] is not None]
        switched: set[tuple[int, int]] = set()
        for _ in range(MOST_WAVES):
            guesses = [
                one
                for one in guesses
                if not self._known_line(one.motion, one.lobes, one.signatures, NEAR)
            ]
            chosen = self._representatives(guesses)
            settled_on = self._all({one.number: self._settled(one, words) for one in chosen})
            taken = {one.number for one in chosen}
            guesses = [one for one in guesses if one.number not in taken]
            wave = [one for one in settled_on.values() if one is not None and not self._there(one)]
            if self.orders.switch:
                wave += self._springing(switched)
            if wave:
                self._grow(wave)
            elif not guesses and not (self.orders.switch and self._left(switched)):
                break
        for one in guesses:
            if not self._known_line(one.motion, one.lobes, one.signatures, NEAR):
                words[one.number] = f"left when {MOST_WAVES} rounds of seeds had been followed"
        return Found(self.branches, [word or "followed" for word in words])

    def _settled(self, one: _Guess, words: list[str]) -> Steps[_Candidate | None]:
        """The motion near a guess, by Newton's method."""
        point = yield from settled(one.problem, one.x)
        if point is None or np.linalg.norm(point.x - one.x) > one.far:
            what = (
                f"motion of {one.lobes} lobes"
                if one.motion == PERIODIC
                else one.motion.replace("_", " ")
            )
            words[one.number] = f"Newton's method finds no {what} near the seed"
            return None
        if one.motion == CIRCLE and circle.tail_of(point.found) > circle.TAIL:
            words[one.number] = "the circle that the motion fills is not smooth"
            return None
        found = _Candidate((0, one.number), one.motion, one.lobes, one.problem, point)
        if one.motion == PERIODIC:
            return (yield from self._shortest(found))
        if one.motion == CIRCLE:
            every = yield from circle.images(one.problem, point)
            return replace(
                found, signatures=tuple(self._signature_of_circle(point.found, w) for w in every)
            )
        return found

    def _shortest(self, one: _Candidate) -> Steps[_Candidate]:
        """The same motion with its least period."""
        orbit = one.point.found
        starts = starts_of(orbit, self.flow, one.lobes)
        state_scales = self.flow.state_scales(orbit.values)[0][list(orbit.free)]
        for lobes in range(1, one.lobes):
            if (
                one.lobes % lobes == 0
                and np.max(np.abs((starts[lobes] - starts[0]) / state_scales)) < SAME
            ):
                problem = Periodic.at(self.flow, lobes, orbit.values, orbit.state)
                point = yield from settled(
                    problem, problem.unknowns(orbit.pieces[:lobes], orbit.values[-1])
                )
                if point is not None:
                    return replace(one, lobes=lobes, problem=problem, point=point)
        return one

    def _begun(self, seeds: list[Seed], words: list[str]) -> dict[int, Seed]:
        """Seeds at the drive angle 0: those of a model with lobes run on to the next
        fold of a revolution."""
        symmetry = self.flow.symmetry
        made: dict[int, Seed] = {}
        if not seeds:
            return made
        if self.smooth:
            return {
                n: replace(one, state=turned(symmetry, one.state, -one.phase), phase=0.0)
                for n, one in enumerate(seeds)
            }
        fold = 2.0 * math.pi / symmetry.folds
        phases = np.array([one.phase for one in seeds])
        whole = np.ceil(phases / fold - 1e-9)
        values = np.stack([one.values for one in seeds])
        durations = np.maximum((whole * fold - phases) / self.flow.phase_rate(values), 1e-9)
        states = np.stack([one.state for one in seeds])
        legs = Legs(states, phases, durations, values, np.zeros(len(seeds), dtype=bool))
        ends = self.flow.run(legs)
        back = turned(symmetry, ends.state, -whole * fold)
        for number, seed in enumerate(seeds):
            if ends.ok[number]:
                made[number] = replace(seed, state=back[number], phase=0.0)
            else:
                words[number] = "the motion could not be integrated"
        return made

    def _guessed(self, number: int, seed: Seed, words: list[str]) -> Steps[_Guess | None]:
        """What a seed has settled on."""
        if self.smooth:
            return (yield from self._guessed_smooth(number, seed, words))
        orders, flow, free = self.orders, self.flow, list(self.flow.symmetry.free)
        state_scales = flow.state_scales(seed.values)[0]
        fold, value = 2.0 * math.pi / flow.symmetry.folds, seed.values[-1]
        duration = fold / flow.phase_rate(seed.values)
        starts, pieces, misses = [seed.state], [seed.state], dict[int, float]()

        def guess(lobes: int, far: float) -> _Guess:
            problem = Periodic.at(flow, lobes, seed.values, seed.state)
            x = problem.unknowns(np.stack(pieces[:lobes]), value)
            signs = [
                np.append((start / state_scales)[free], value / self.scale)
                for start in starts[:lobes]
            ]
            return _Guess(number, PERIODIC, lobes, problem, x, signs, far)

        for lobes in range(1, max(orders.lobes) + 1) if orders.periodic else ():
            angle = np.array([(lobes - 1) * fold])
            ends = yield Legs(
                pieces[-1][None], angle, duration, seed.values[None], np.zeros(1, dtype=bool)
            )
            if not ends.ok[0]:
                words[number] = "the motion could not be integrated"
                return None
            pieces.append(ends.state[0])
            starts.append(turned(flow.symmetry, ends.state, -lobes * fold)[0])
            if seed.steady:
                return guess(1, AFAR)
            if lobes in orders.lobes:
                misses[lobes] = float(
                    np.max(np.abs((starts[-1] - seed.state) / state_scales)[free])
                )
                if misses[lobes] < NEAR:
                    return guess(lobes, 10.0 * NEAR)
        if orders.circles and flow.symmetry.turned:
            made = yield from circle.fitted_circle(flow, seed.state, seed.values, orders.lobes)
            if made is not None:
                problem, x, means = made
                rotation = 10.0 * math.remainder(x[-2], 2.0 * math.pi)
                signs = [
                    np.concatenate([[rotation], (mean / state_scales)[free], [value / self.scale]])
                    for mean in means
                ]
                return _Guess(number, CIRCLE, problem.lobes, problem, x, signs, 1.0)
        if seed.near and misses and min(misses.values()) < MISS:
            return guess(min(misses, key=lambda lobes: misses[lobes]), AFAR)
        what = "chaotic, stick-slip (a torus over lobes), or not settled"
        words[number] = f"neither a period of the lobes asked for nor a circle: {what}"
        return None

    def _guessed_smooth(self, number: int, seed: Seed, words: list[str]) -> Steps[_Guess | None]:
        """The same where every angle is alike: an equilibrium, or a cycle."""
        orders, flow, free = self.orders, self.flow, list(self.flow.symmetry.free)
        state_scales, value = flow.state_scales(seed.values)[0][free], seed.values[-1]
        moves = rates(flow, seed.state[None], seed.values)[0][free] / state_scales
        turn = 2.0 * math.pi / float(flow.phase_rate(seed.values)[0])
        if np.linalg.norm(moves) * turn < NEAR or seed.steady:
            if not orders.periodic:
                words[number] = "a steady motion, which the study does not ask for"
                return None
            fixed = Periodic.at(flow, 1, seed.values, seed.state)
            sign = np.append(seed.state[free] / state_scales, value / self.scale)
            return _Guess(
                number, EQUILIBRIUM, 1, fixed, fixed.unknowns(seed.state[None], value), [sign], AFAR
            )
        if not orders.cycles:
            words[number] = "a motion that does not stand still, which the study does not ask for"
            return None
        sampled = yield from sampled_cycle(
            flow, seed.state, seed.values, turn / PER_REVOLUTION, REVOLUTIONS * PER_REVOLUTION
        )
        if sampled is None:
            words[number] = "no cycle: the motion does not come back to its start"
            return None
        starts, period = sampled
        problem = Cycle.at(flow, period, seed.values, starts[0])
        sign = np.array([10.0 * math.log(period), value / self.scale])
        return _Guess(
            number, CYCLE, 1, problem, problem.unknowns(starts, period, value), [sign], math.inf
        )

    # What is there already

    def _signatures(self, motion: str, lobes: int, point: Point) -> list[Array]:
        orbit, flow = point.found, self.flow
        number = orbit.values[-1] / self.scale
        if motion == CYCLE:
            return [np.array([10.0 * math.log(orbit.period), number])]
        if motion == CIRCLE:
            return [self._signature_of_circle(orbit, orbit.pieces)]
        state_scales = flow.state_scales(orbit.values)[0][list(orbit.free)]
        return [np.append(start / state_scales, number) for start in starts_of(orbit, flow, lobes)]

    def _signature_of_circle(self, orbit: Orbit, w: Array) -> Array:
        free = list(orbit.free)
        mean = w.mean(axis=0)[free] / self.flow.state_scales(orbit.values)[0][free]
        return np.concatenate([[10.0 * orbit.rotation], mean, [orbit.values[-1] / self.scale]])

    def _of(self, one: _Candidate) -> list[Array]:
        return [*one.signatures] or self._signatures(one.motion, one.lobes, one.point)

    def _known_line(
        self, motion: str, lobes: int, signatures: list[Array], slack: float = 0.0
    ) -> bool:
        """Whether a motion lies on a branch that is there."""
        return any(
            branch.motion == motion
            and branch.lobes == lobes
            and passes(self._line(number), signatures, slack)
            for number, branch in enumerate(self.branches)
        )

    def _line(self, number: int) -> Array:
        """The signatures of the points of a branch that is there, in order; of a single
        point it is given twice."""
        if number not in self._made:
            branch = self.branches[number]
            signs = [
                self._signatures(branch.motion, branch.lobes, one.point)[0] for one in branch.marked
            ]
            self._made[number] = np.stack(signs * 2 if len(signs) == 1 else signs)
        return self._made[number]

    def _there(self, one: _Candidate) -> bool:
        return self._known_line(one.motion, one.lobes, self._of(one))

    def _representatives(self, guesses: list[_Guess]) -> list[_Guess]:
        """One guess of every group of neighbours: the one in the middle."""
        groups: list[list[_Guess]] = []
        for one in sorted(guesses, key=lambda one: (one.motion, one.lobes, one.x[-1], one.number)):
            for group in reversed(groups):
                last = group[-1]
                if (last.motion, last.lobes) != (one.motion, one.lobes):
                    continue
                if (
                    min(float(np.linalg.norm(sign - last.signatures[0])) for sign in one.signatures)
                    < GROUP
                ):
                    group.append(one)
                    break
            else:
                groups.append([one])
        return [group[len(group) // 2] for group in groups]

    # Branches

    def _grow(self, wave: list[_Candidate]) -> None:
        jobs: dict[Any, Any] = {}
        self._lines, self._rank = {}, {one.key: place for place, one in enumerate(wave)}
        for one in wave:
            if one.key in self.known:
                continue
            jobs[(*one.key, 1)] = self._side(one, 1, one.point)
            if one.other is not None:
                jobs[(*one.key, -1)] = self._side(one, 1, one.other)
            elif not one.one_side:
                jobs[(*one.key, -1)] = self._side(one, -1, one.point)
        if new := sum(one.key not in self.known for one in wave):
            self.begin(new)
        halves = self._all(jobs)
        made: dict[Key, Branch] = {}
        for one in wave:
            if one.key in self.known:
                branch = self.known[one.key]
            else:
                on, back = halves[(*one.key, 1)], halves.get((*one.key, -1))
                branch = self._assembled(one, on, back)
                made[one.key] = branch
            if not self._there(one):
                self.branches.append(branch)
        self.keep(made)

    def _assembled(self, one: _Candidate, on: Half, back: Half | None) -> Branch:
        if on.ended == "closed":
            back = None
        seed = Marked(one.point)
        if one.other is not None and back is not None:
            back = Half([Marked(one.other), *back.points], back.ended)
            back = Half(
                [replace(m, point=replace(m.point, s=m.point.s + 0.1)) for m in back.points],
                back.ended,
            )
        made = assembled(one.motion, one.lobes, seed, back, on, one.parent, one.parent_point)
        return replace(made, ended=("closed", "closed")) if on.ended == "closed" else made

    def _tests(self, one: _Candidate) -> Tests:
        if one.motion == CIRCLE:
            return circle.tests_of_circle(self.orders.grazes)
        return tests_of(self.orders.grazes, equilibrium=one.motion == EQUILIBRIUM)

    def _side(self, one: _Candidate, sense: int, start: Point) -> Steps[Half]:
        """One side of a branch; where Newton's method fails, with more and more
        segments."""
        orders, tests = self.orders, self._tests(one)
        stop = self._stops(one, sense if one.other is None or start is one.point else -1)
        problem: Any = one.problem
        most = orders.points
        # A circle is smooth, and ends where it is not.
        kinks = kinks_of(0 if one.motion == CIRCLE else len(self.flow.equations.contacts))
        margins = None if one.motion == CIRCLE else margins_of  # of a circle they are too rough
        half = yield from follow(
            problem, start, sense, self.bounds, most, tests, stop, kinked=kinks, margins=margins
        )
        while (
            half.ended.startswith("no convergence")
            and isinstance(problem, Periodic)
            and problem.segments < FINEST * one.lobes
            and len(half.points) - half.further < most
        ):
            last = (
                half.points[-1].point
                if half.points
                else replace(start, tangent=sense * start.tangent)
            )
            problem = replace(problem, segments=2 * problem.segments)
            states = yield from between_segments(problem, last.found.state, last.found.values)
            if states is None:
                break
            again = yield from settled(problem, problem.unknowns(states, last.found.values[-1]))
            if again is None or np.max(
                np.abs(again.found.state - last.found.state)
            ) > 1e-3 * np.max(np.abs(last.found.state) + 1e-9):
                continue
            side = 1 if last.tangent[-1] > 0.0 else -1
            left = most - len(half.points) + half.further
            more = yield from follow(
                problem, again, side, self.bounds, left, tests, stop, kinked=kinks, margins=margins
            )
            if not more.points:
                continue
            reach = last.s
            half = Half(
                half.points
                + [replace(m, point=replace(m.point, s=reach + m.point.s)) for m in more.points],
                more.ended,
                half.further + more.further,
            )
        return half

    def _stops(self, one: _Candidate, sense: int) -> Callable[[Point, Point], str]:
        """The words for the end of a side of a branch: those of :meth:`_stop`; that it
        is too unstable; that it, or its seed, lies on a branch that grows beside it and
        comes first."""
        own = self._stop(one)
        seed = self._of(one)
        line = self._lines.setdefault((*one.key, sense), [seed[0]])
        kind = (one.motion, one.lobes)
        self._kinds[(*one.key, sense)] = kind

        def stop(here: Point, there: Point) -> str:
            if word := own(here, there):
                return word
            # Both sides share the points of a branch.
            if (
                sum(len(self._lines.get((*one.key, side), ())) for side in (1, -1))
                > self.orders.points
            ):
                return "points"
            if one.motion == PERIODIC and np.max(np.abs(there.found.multipliers)) > WILD**one.lobes:
                return "wild"
            signs = self._signatures(one.motion, one.lobes, there)
            # Continuous along the branch: of several starts that of the line so far.
            line.append(min(signs, key=lambda sign: float(np.linalg.norm(sign - line[-1]))))
            # On a branch that is there; the first points are near the one that it
            # springs from.
            if len(line) > NEAR_PARENT and self._known_line(one.motion, one.lobes, signs):
                return "known"
            for key, other in self._lines.items():
                if (
                    key == (*one.key, -sense)
                    and min(len(line), len(other)) > 5
                    and passes(np.stack(other), signs)
                ):
                    return "closed"  # the two sides meet
                if (
                    self._rank[key[:-1]] >= self._rank[one.key]
                    or self._kinds[key] != kind
                    or len(other) < 2
                ):
                    continue
                if passes(np.stack(other), [*signs, *seed]):
                    return "known"
            return ""

        return stop

    def _stop(self, one: _Candidate) -> Callable[[Point, Point], str]:
        """A motion of even period joins that of half of it where its halves become one;
        a cycle shrinks to a steady motion where all its points do; a circle ends where
        it has kinks."""
        if one.motion == CIRCLE:
            return circle.ends_of(self.flow.symmetry)
        if one.motion == EQUILIBRIUM or (one.motion == PERIODIC and one.lobes % 2):
            return lambda here, there: ""
        word = "still" if one.motion == CYCLE else "half"

        def apart(point: Point) -> Array:
            orbit = point.found
            state_scales = self.flow.state_scales(orbit.values)[0][list(orbit.free)]
            if one.motion == CYCLE:
                half = len(orbit.pieces) // 2
                return np.asarray(
                    (orbit.pieces[half] - orbit.pieces[0])[list(orbit.free)] / state_scales
                )
            starts = starts_of(orbit, self.flow, one.lobes)
            return np.asarray((starts[one.lobes // 2] - starts[0]) / state_scales)

        def stop(here: Point, there: Point) -> str:
            before, after = apart(here), apart(there)
            return word if before @ after < 0.0 and np.linalg.norm(after) < 2.0 else ""

        return stop

    # Switching

    def _left(self, switched: set[tuple[int, int]]) -> bool:
        return any(
            (number, place) not in switched and marked.label in (HOPF, BRANCH, DOUBLING)
            for number, branch in enumerate(self.branches)
            for place, marked in enumerate(branch.marked)
        )

    def _springing(self, switched: set[tuple[int, int]]) -> list[_Candidate]:
        """What springs from the first special point of every branch that was not tried
        yet."""
        jobs: dict[Any, Any] = {}
        for number, branch in enumerate(self.branches):
            for place, marked in enumerate(branch.marked):
                if (number, place) in switched or marked.label not in (HOPF, BRANCH, DOUBLING):
                    continue
                switched.add((number, place))
                jobs[(number, place)] = self._sprung(number, place, branch, marked)
                break
        found = self._all(jobs)
        return [one for one in found.values() if one is not None and not self._there(one)]

    def _sprung(
        self, number: int, place: int, branch: Branch, marked: Marked
    ) -> Steps[_Candidate | None]:
        flow, orbit = self.flow, marked.point.found
        key = (1, number, place)
        problem: Problem
        if marked.label == HOPF and branch.motion == EQUILIBRIUM and self.orders.cycles:
            made = at_hopf(flow, orbit)
            if made is None:
                return None
            point = yield from started(*made)
            return (
                None
                if point is None
                else _Candidate(key, CYCLE, 1, made[0].moved(point.x), point, number, place, True)
            )
        if marked.label == DOUBLING and branch.motion == CYCLE:
            cycle = Cycle.at(flow, orbit.period, orbit.values, orbit.state, len(orbit.pieces))
            twice = doubled_cycle(cycle, orbit)
            if len(orbit.pieces) > 4 * 6:
                return None
            point = yield from started(*twice)
            return (
                None
                if point is None
                else _Candidate(key, CYCLE, 1, twice[0].moved(point.x), point, number, place, True)
            )
        if branch.motion != PERIODIC:
            return None
        if marked.label == DOUBLING and 2 * branch.lobes <= max(self.orders.lobes):
            problem = Periodic.at(flow, 2 * branch.lobes, orbit.values, orbit.state)
            point = yield from doubled(problem, orbit)
            return (
                None
                if point is None
                else _Candidate(
                    key, PERIODIC, 2 * branch.lobes, problem, point, number, place, True
                )
            )
        if marked.label == BRANCH:
            problem = Periodic.at(flow, branch.lobes, orbit.values, orbit.state, len(orbit.pieces))
            one = yield from branched(problem, orbit, 1)
            two = yield from branched(problem, orbit, -1)
            if one is None and two is None:
                return None
            first, other = (one, two) if one is not None else (two, None)
            assert first is not None
            return _Candidate(
                key,
                PERIODIC,
                branch.lobes,
                problem,
                first,
                number,
                place,
                one_side=other is None,
                other=other,
            )
        return None


__all__ = ["Explorer", "Found", "Orders", "Seed"]
