"""A branch: the points of one family of motions, from its seed to both sides, and
whether a line passes a motion."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.analysis.bifurcations import END, FAILED
from nsdrill.orbit.arclength import Half, Marked

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
    """One branch. ``marked`` are its points in order; ``ended`` says why at its
    beginning and at its end; ``parent`` and ``parent_point`` are the number of the
    branch from which it springs and the place of the point there, -1 where it was found
    from a seed."""

    motion: str
    lobes: int
    marked: list[Marked]
    ended: tuple[str, str]
    parent: int = -1
    parent_point: int = -1

    @property
    def closed(self) -> bool:
        return "closed" in self.ended

    @property
    def end_reason(self) -> str:
        """Why it ends on both sides, in words."""
        first, last = (ENDINGS.get(word, word) for word in self.ended)
        return first if first == last or "closed" in self.ended else f"{first}; {last}"

    def __len__(self) -> int:
        return len(self.marked)


def assembled(
    motion: str,
    lobes: int,
    seed: Marked,
    back: Half | None,
    on: Half,
    parent: int = -1,
    parent_point: int = -1,
) -> Branch:
    """A branch from its seed and the halves to both sides; without ``back`` it begins
    with the seed."""
    before = [] if back is None else back.points[::-1]
    reach = before[0].point.s if before else 0.0
    marked = [replace(one, point=replace(one.point, s=reach - one.point.s)) for one in before]
    marked += [replace(seed, point=replace(seed.point, s=reach))]
    marked += [replace(one, point=replace(one.point, s=reach + one.point.s)) for one in on.points]
    ended = ("seed" if back is None else back.ended, on.ended)
    for place, word in ((0, ended[0]), (-1, ended[1])):
        if marked[place].label == 0 and word not in ("closed", "seed"):
            label = FAILED if word.startswith("no convergence") else END
            marked[place] = replace(marked[place], label=label)
    return Branch(motion, lobes, marked, ended, parent, parent_point)


def passes(line: Array, signatures: list[Array], slack: float = 0.0) -> bool:
    """Whether a ``line`` through points [points, coordinates] passes one of these:
    closer than a fifth of the distance of the two points between which it does, and
    ``slack``."""
    along, here = np.diff(line, axis=0), line[:-1]
    square = np.maximum(np.sum(along**2, axis=1), 1e-300)
    for signature in signatures:
        off = signature - here
        share = np.clip(np.sum(off * along, axis=1) / square, 0.0, 1.0)
        beside = np.linalg.norm(off - share[:, None] * along, axis=1)
        if np.any(beside < 0.2 * np.sqrt(square) + 1e-3 + slack):
            return True
    return False
