"""A branch: the points of one family of motions on both sides of its seed; and branches
as plain arrays, so that an unfinished continuation can be stored and resumed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import TypedDict

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE, END
from nsdrill.data import Array
from nsdrill.orbit.flow import Flow, Task, advance
from nsdrill.orbit.newton import Point
from nsdrill.orbit.periodic import Cycle, Periodic
from nsdrill.orbit.shooting import Orbit, monodromy_product
from nsdrill.orbit.special import LabelledPoint
from nsdrill.records import dataclass

Key = tuple[int, ...]  # of a branch, by where it sets out
Stretch = tuple[int, int]  # of a branch: the number of its first point, and that after its last
_PARTS = 10  # arrays of one point that are stored
ENDINGS = {
    "from": "the end of the range",
    "to": "the end of the range",
    "closed": "the branch comes back to its seed",
    "points": "as many points as {limit} allows",
    "half": "it joins the motion of half its period (doubling)",
    "shorter": "it joins a motion over fewer lobes",
    "still": "the cycle shrinks to a steady motion (Hopf)",
    "seed": "the bifurcation that it springs from",
    "start": "the motion from which it set out",
    "range": "the end of the range of the first number",
    "shrunk": "the circle shrinks to a motion that repeats (torus)",
    "kinks": "the circle has lost its smoothness",
    "turned": "it turns back over itself",
    "known": "it goes on as a branch that is there already",
    "wild": "the motion becomes too unstable to be followed",
    "unresolved": "its multipliers are too large to be known, as where its period grows without bound (homoclinic)",
}


def end_reason(ended: tuple[str, str], limit: str = "continue.points") -> str:
    """The reasons for both ends, in words; ``limit`` is the key of the greatest number of
    points."""
    first, last = (ENDINGS.get(word, word).replace("{limit}", limit) for word in ended)
    return first if first == last or "closed" in ended else f"{first}; {last}"


@dataclass(frozen=True)
class Track:
    """The signatures of the points of one side of a branch, ``line`` [points + 1, numbers],
    the first that of its seed, and the ``rounds`` [points] of its wave in which they were
    found: what other branches of the wave have met of it."""

    rounds: Array
    line: Array


@dataclass(frozen=True)
class Branch:
    """One branch: its points in order, ``marked`` with their labels, and the reasons
    why it ``ended``, at its beginning and at its end. ``parent`` is the number of the
    branch from which it emanates and ``parent_point`` the number of the point there, -1
    for a branch from a seed. ``tracks`` are those of its sides, by 1 and -1."""

    motion: str
    lobes: int
    marked: list[LabelledPoint]
    ended: tuple[str, str]
    parent: int = -1
    parent_point: int = -1
    tracks: Mapping[int, Track] = field(default_factory=dict, compare=False)

    @property
    def closed(self) -> bool:
        return "closed" in self.ended

    @property
    def end_reason(self) -> str:
        """The reasons for both ends, in words."""
        return end_reason(self.ended)

    def __len__(self) -> int:
        return len(self.marked)

    def stretch(self, own: Stretch) -> Branch:
        """The branch of these points alone; an end that it did not have is labelled so."""
        first, after = own
        if own == (0, len(self)):
            return self
        offset = self.marked[first].point.s
        marked = [
            replace(entry, point=replace(entry.point, s=entry.point.s - offset)) for entry in self.marked[first:after]
        ]
        for place, is_cut in ((0, first > 0), (-1, after < len(self))):
            if is_cut and marked[place].label == 0:
                marked[place] = replace(marked[place], label=END)
        return replace(self, marked=marked)


class Description(TypedDict):
    """What is stored of a branch beside its arrays."""

    key: list[int]
    motion: str
    lobes: int
    ended: list[str]
    parent: int
    parent_point: int
    words: list[str]
    sides: list[int]


def to_arrays(branches: Mapping[Key, Branch]) -> tuple[dict[str, Array], list[Description]]:
    """The branches as arrays by name, and plain data about each of them."""
    arrays: dict[str, Array] = {}
    descriptions: list[Description] = []
    for number, (key, branch) in enumerate(branches.items()):
        parts = [part for entry in branch.marked for part in _parts(entry)]
        arrays[f"numbers_{number}"] = np.concatenate([part.ravel() for part in parts])
        arrays[f"shapes_{number}"] = np.array([(*part.shape, *[-1] * (3 - part.ndim)) for part in parts], np.int64)
        for side, track in branch.tracks.items():
            arrays[f"rounds_{number}_{side}"], arrays[f"line_{number}_{side}"] = track.rounds, track.line
        descriptions.append(
            {
                "key": list(key),
                "motion": branch.motion,
                "lobes": branch.lobes,
                "ended": list(branch.ended),
                "parent": branch.parent,
                "parent_point": branch.parent_point,
                "words": [entry.words for entry in branch.marked],
                "sides": list(branch.tracks),
            }
        )
    return arrays, descriptions


def _parts(entry: LabelledPoint) -> list[Array]:
    point, orbit = entry.point, entry.point.found
    scalars = np.array(
        [
            point.s,
            point.iterations,
            point.residual,
            entry.label,
            orbit.period,
            orbit.rotation,
            orbit.trivial,
            orbit.monodromy is not None,
        ]
    )
    monodromy = np.zeros((0, 0)) if orbit.monodromy is None else orbit.monodromy
    return [
        scalars,
        point.x,
        point.tangent,
        orbit.state,
        orbit.values,
        np.stack([orbit.multipliers.real, orbit.multipliers.imag]),
        orbit.touches,
        monodromy,
        orbit.mesh_states,
        np.array(orbit.free, dtype=float),
    ]


def from_arrays(arrays: Mapping[str, Array], descriptions: list[Description]) -> dict[Key, Branch]:
    """The inverse of :func:`to_arrays`. KeyError, ValueError, TypeError or IndexError
    where the arguments are no output of it."""
    branches = {}
    for number, description in enumerate(descriptions):
        numbers, shapes = arrays[f"numbers_{number}"], arrays[f"shapes_{number}"]
        parts, first = [], 0
        for row in shapes:
            shape = tuple(int(n) for n in row if n >= 0)
            size = math.prod(shape)
            parts.append(np.asarray(numbers[first : first + size], dtype=float).reshape(shape))
            first += size
        marked = [
            _labelled_point(parts[k : k + _PARTS], words)
            for k, words in zip(range(0, len(parts), _PARTS), description["words"], strict=True)
        ]
        branches[tuple(map(int, description["key"]))] = Branch(
            str(description["motion"]),
            int(description["lobes"]),
            marked,
            (str(description["ended"][0]), str(description["ended"][1])),
            int(description["parent"]),
            int(description["parent_point"]),
            {
                int(side): Track(arrays[f"rounds_{number}_{side}"], arrays[f"line_{number}_{side}"])
                for side in description["sides"]
            },
        )
    return branches


def _labelled_point(parts: list[Array], words: str) -> LabelledPoint:
    scalars, x, tangent, state, values, multipliers, touches, monodromy, mesh_states, free = parts
    s, iterations, residual, label, period, rotation, trivial, has_monodromy = map(float, scalars)
    orbit = Orbit(
        state,
        values,
        period,
        multipliers[0] + 1j * multipliers[1],
        touches,
        int(trivial),
        monodromy if has_monodromy else None,
        rotation,
        mesh_states,
        tuple(int(index) for index in free),
    )
    return LabelledPoint(Point(x, tangent, orbit, int(iterations), residual, s), int(label), words)


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
