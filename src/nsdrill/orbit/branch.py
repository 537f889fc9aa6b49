"""A branch: the points of one family of motions on both sides of its seed, and whether
a line of points passes near a motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import END, FAILED
from nsdrill.orbit.arclength import NO_CONVERGENCE, HalfBranch
from nsdrill.orbit.special import LabelledPoint

Array = np.ndarray[Any, np.dtype[np.float64]]
ENDINGS = {
    "from": "the end of the range",
    "to": "the end of the range",
    "closed": "the branch comes back to its seed",
    "points": "as many points as the study allows",
    "half": "it joins the motion of half its period",
    "still": "the cycle shrinks to a steady motion (Hopf)",
    "seed": "the bifurcation that it springs from",
    "range": "the end of the range of the first number",
    "shrunk": "the circle shrinks to a motion that repeats (torus)",
    "kinks": "the circle has lost its smoothness",
    "known": "it goes on as a branch that is there already",
    "wild": "the motion becomes too unstable to be followed",
}


@dataclass(frozen=True)
class Branch:
    """One branch: its points in order, ``marked`` with their labels, and the reasons
    why it ``ended``, at its beginning and at its end. ``parent`` is the number of the
    branch from which it emanates and ``parent_point`` the number of the point there, -1
    for a branch from a seed."""

    motion: str
    lobes: int
    marked: list[LabelledPoint]
    ended: tuple[str, str]
    parent: int = -1
    parent_point: int = -1

    @property
    def closed(self) -> bool:
        return "closed" in self.ended

    @property
    def end_reason(self) -> str:
        """The reasons for both ends, in words."""
        first, last = (ENDINGS.get(word, word) for word in self.ended)
        return first if first == last or "closed" in self.ended else f"{first}; {last}"

    def __len__(self) -> int:
        return len(self.marked)


def assembled(
    motion: str,
    lobes: int,
    seed: LabelledPoint,
    backward: HalfBranch | None,
    forward: HalfBranch,
    parent: int = -1,
    parent_point: int = -1,
) -> Branch:
    """A branch from its seed and the halves on both sides; without ``backward`` it
    begins at the seed."""
    before = [] if backward is None else backward.points[::-1]
    offset = before[0].point.s if before else 0.0
    marked = [replace(entry, point=replace(entry.point, s=offset - entry.point.s)) for entry in before]
    marked += [replace(seed, point=replace(seed.point, s=offset)), *forward.shifted(offset).points]
    ended = ("seed" if backward is None else backward.ended, forward.ended)
    for index, reason in ((0, ended[0]), (-1, ended[1])):
        if marked[index].label == 0 and reason not in ("closed", "seed"):
            label = FAILED if reason.startswith(NO_CONVERGENCE) else END
            marked[index] = replace(marked[index], label=label)
    return Branch(motion, lobes, marked, ended, parent, parent_point)


def passes_near(line: Array, signatures: list[Array], tolerance: float = 0.0) -> bool:
    """Whether a ``line`` through points [points, coordinates] passes near one of the
    ``signatures`` [coordinates]: nearer than a fifth of the length of the chord there,
    plus 1e-3, plus ``tolerance``."""
    chords, starts = np.diff(line, axis=0), line[:-1]
    square = np.maximum(np.sum(chords**2, axis=1), 1e-300)
    for signature in signatures:
        offsets = signature - starts
        fraction = np.clip(np.sum(offsets * chords, axis=1) / square, 0.0, 1.0)
        distances = np.linalg.norm(offsets - fraction[:, None] * chords, axis=1)
        if np.any(distances < 0.2 * np.sqrt(square) + 1e-3 + tolerance):
            return True
    return False
