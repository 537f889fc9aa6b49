"""What tells a motion from others of its kind, and which motions are known already: on
branches that have ended, and on those that are followed now."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE
from nsdrill.orbit.branch import Branch, passes_near
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.periodic import lobe_starts
from nsdrill.orbit.shooting import Array, Orbit

Key = tuple[int, ...]
Kind = tuple[str, int]  # of a motion, and its period in lobes
NEAR_PARENT = 6  # points of a branch that may lie near the branch it emanates from


def signature(flow: Flow, kind: str, values: Array, state: Array, number: float = 0.0) -> Array:
    """A vector, in natural scales, that tells a motion of a ``kind`` at ``values`` from
    others: of an orbit its start, the free ``state``, and the parameter; of a cycle the
    logarithm of the ``number`` that is its period, and the parameter; of a circle its
    rotation, the ``number``, the mean of w, the free ``state``, and the parameter."""
    parameter = values[-1] / float(flow.scales[-1])
    if kind == CYCLE:
        return np.array([10.0 * math.log(number), parameter])
    scaled = np.append(state / flow.state_scales(values)[0][list(flow.symmetry.free)], parameter)
    return np.append(10.0 * number, scaled) if kind == CIRCLE else scaled


def signatures(flow: Flow, kind: Kind, orbit: Orbit) -> list[Array]:
    """The signatures of an orbit of a kind, one for each lobe at which it may begin."""
    motion, lobes = kind
    if motion == CYCLE:
        return [signature(flow, motion, orbit.values, orbit.state, orbit.period)]
    if motion == CIRCLE:
        return [signature_of_circle(flow, orbit, orbit.mesh_states)]
    return [signature(flow, motion, orbit.values, start) for start in lobe_starts(orbit, flow, lobes)]


def signature_of_circle(flow: Flow, orbit: Orbit, w: Array) -> Array:
    """The signature of a circle, begun at the lobe where its points are ``w``."""
    return signature(flow, CIRCLE, orbit.values, w.mean(axis=0)[list(orbit.free)], orbit.rotation)


@dataclass
class Line:
    """One side of a branch that is being followed, as the signatures of its points, from
    that of its ``seed``; its ``kind``; and the ``rank`` of the branch in its wave."""

    kind: Kind
    rank: int
    seed: list[Array]
    points: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.points.append(self.seed[0])


class Known:
    """The ``branches`` that have ended, and the ``lines`` of those of a wave, by the key
    of the branch and the side."""

    def __init__(self, flow: Flow) -> None:
        self.flow = flow
        self.branches: list[Branch] = []
        self.lines: dict[Key, Line] = {}
        self._of_branches: dict[int, Array] = {}

    def on_branch(self, kind: Kind, found: list[Array], tolerance: float = 0.0) -> bool:
        """Whether a motion with one of the signatures ``found`` lies on a branch."""
        return any(
            (branch.motion, branch.lobes) == kind and passes_near(self._line_of(number), found, tolerance)
            for number, branch in enumerate(self.branches)
        )

    def _line_of(self, number: int) -> Array:
        """The signatures of the points of a branch, in order; that of a single point
        twice."""
        if number not in self._of_branches:
            branch = self.branches[number]
            kind = branch.motion, branch.lobes
            line = [signatures(self.flow, kind, entry.point.found)[0] for entry in branch.marked]
            self._of_branches[number] = np.stack(line * 2 if len(line) == 1 else line)
        return self._of_branches[number]

    def points_of(self, branch: Key) -> int:
        """How many points both sides of a branch of the wave have, which share them."""
        return sum(len(self.lines[(*branch, side)].points) for side in (1, -1) if (*branch, side) in self.lines)

    def stop(self, branch: Key, side: int, orbit: Orbit) -> str:
        """Add an orbit to a side of a branch of the wave. Why the branch ends there: it
        meets its own other side, a known branch, or one that comes before it in the
        wave, on which its seed may lie as well; "" where it goes on."""
        own = self.lines[(*branch, side)]
        found = signatures(self.flow, own.kind, orbit)
        # Of several signatures the one that continues the line.
        own.points.append(min(found, key=lambda one: float(np.linalg.norm(one - own.points[-1]))))
        # The first points lie near the branch from which this one emanates.
        if len(own.points) > NEAR_PARENT and self.on_branch(own.kind, found):
            return "known"
        for key, other in self.lines.items():
            is_other_side = key == (*branch, -side) and min(len(own.points), len(other.points)) > 5
            if is_other_side and passes_near(np.stack(other.points), found):
                return "closed"
            is_before = other.rank < own.rank and other.kind == own.kind and len(other.points) > 1
            if is_before and passes_near(np.stack(other.points), [*found, *own.seed]):
                return "known"
        return ""
