"""From seeds to branches: which motions are followed, and which branches emanate from
them.

Branches are followed in waves. Each wave follows, side by side, one seed of every group
of neighbours that lies on no branch yet and the branch that emanates from one special
point of every branch; duplicates are dropped. The result is the same whether it is
computed at once or resumed from stored branches.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

from nsdrill.analysis.bifurcations import BRANCH, DOUBLING, HOPF
from nsdrill.orbit.arclength import HalfBranch
from nsdrill.orbit.branch import Branch, Key, assembled
from nsdrill.orbit.flow import Flow, advance
from nsdrill.orbit.seeds import (
    RETURN_TOLERANCE,
    Candidate,
    Guess,
    Orders,
    Seed,
    at_angle_zero,
    candidate_of,
    guess_of,
    representatives,
)
from nsdrill.orbit.sides import Known, Side, followed_side
from nsdrill.orbit.special import LabelledPoint
from nsdrill.orbit.switch import emanating

MAX_WAVES = 40
BETWEEN_SIDES = 0.1  # arclength from a branch point to the first point on its other side


@dataclass
class Found:
    """The ``branches``, and for each of the ``seeds`` ``followed`` or the reason why it
    was not."""

    branches: list[Branch]
    seeds: list[str]


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
        self.flow, self.orders, self.stored, self.store, self.poll = flow, orders, stored or {}, store, poll
        self.watch, self.known, self._waves = watch, Known(flow), 0
        self._tried: set[tuple[int, int]] = set()  # branch and special point

    def run(self, seeds: list[Seed]) -> Found:
        """The branches from ``seeds``, and which seeds were followed."""
        flow, orders, outcomes = self.flow, self.orders, ["followed"] * len(seeds)
        at_zero = enumerate(at_angle_zero(flow, seeds))
        first = advance(flow, {n: guess_of(flow, orders, n, seed) for n, seed in at_zero}, self.poll)
        guesses = self._taken(first, outcomes)
        for _ in range(MAX_WAVES):
            guesses = self._on_no_branch(guesses)
            chosen = representatives(guesses)
            found = advance(flow, {guess.number: candidate_of(flow, guess) for guess in chosen}, self.poll)
            guesses = [guess for guess in guesses if guess.number not in found]
            wave = self._new(self._taken(found, outcomes)) + self._emanating()
            if wave:
                self._follow_wave(wave)
            elif not guesses and not self._special_points():
                break
        for guess in self._on_no_branch(guesses):
            outcomes[guess.number] = f"left when {MAX_WAVES} rounds of seeds had been followed"
        return Found(self.known.branches, outcomes)

    @staticmethod
    def _taken(results: dict[int, Guess | Candidate | str], outcomes: list[str]) -> list:
        """The ``results`` but for reasons, which become the outcomes of their seeds."""
        for number, result in results.items():
            if isinstance(result, str):
                outcomes[number] = result
        return [result for result in results.values() if not isinstance(result, str)]

    def _on_no_branch(self, guesses: list[Guess]) -> list[Guess]:
        return [one for one in guesses if not self.known.on_branch(one.kind, one.signatures, RETURN_TOLERANCE)]

    def _new(self, candidates: Collection[Candidate]) -> list[Candidate]:
        return [one for one in candidates if not self.known.on_branch(one.kind, one.signatures)]

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
        return self._new([one for one in advance(self.flow, tasks, self.poll).values() if one is not None])

    def _follow_wave(self, wave: list[Candidate]) -> None:
        """Follow the branches of a wave side by side; add those that are new."""
        sides = self.known.sides = {
            (*one.key, number): side
            for one in wave
            if one.key not in self.stored
            for number, side in _sides(one).items()
        }
        self._waves += bool(sides)
        tasks = {key: followed_side(self.flow, self.orders, self.known, side) for key, side in sides.items()}
        halves = advance(self.flow, tasks, self.poll, self._watched)
        followed: dict[Key, Branch] = {}
        for one in wave:
            if one.key not in self.stored:
                followed[one.key] = _branch(one, halves[(*one.key, 1)], halves.get((*one.key, -1)))
            if self._new([one]):
                self.known.branches.append(self.stored.get(one.key) or followed[one.key])
        self.store(followed)

    def _watched(self, running: Collection[Key]) -> None:
        """Tell how far the branches of a wave are, of which these sides go on."""
        lengths = {key: len(side.line) for key, side in self.known.sides.items()}
        points = {key[:-1]: self.known.points_of(key[:-1]) for key in lengths}
        sides, longest = Counter(key[:-1] for key in running), max(lengths.values(), default=0)
        left = max((max(0, self.orders.points - points[key]) // n for key, n in sides.items()), default=0)
        self.watch(Wave(self._waves, len(points), len(sides), sum(lengths.values()), longest, left))


def _sides(candidate: Candidate) -> dict[int, Side]:
    """The sides of the branch of a candidate that are followed, by their numbers 1 and
    -1."""
    seed = candidate.signatures[0]
    sides = {1: Side(candidate, candidate.point, 1, [seed])}
    if candidate.other is not None:
        sides[-1] = Side(candidate, candidate.other, 1, [seed])
    elif not candidate.one_side:
        sides[-1] = Side(candidate, candidate.point, -1, [seed])
    return sides


def _branch(candidate: Candidate, forward: HalfBranch, backward: HalfBranch | None) -> Branch:
    """The branch of a candidate from its sides."""
    is_closed = forward.ended == "closed"
    if is_closed:
        backward = None
    elif candidate.other is not None and backward is not None:
        points = [LabelledPoint(candidate.other), *backward.points]
        backward = HalfBranch(points, backward.ended).shifted(BETWEEN_SIDES)
    seed, parents = LabelledPoint(candidate.point), (candidate.parent, candidate.parent_point)
    branch = assembled(*candidate.kind, seed, backward, forward, *parents)
    return replace(branch, ended=("closed", "closed")) if is_closed else branch


__all__ = ["Explorer", "Found", "Orders", "Seed", "Wave"]
