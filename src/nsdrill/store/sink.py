"""What a sweep needs of the place where its points go, whether a file or memory.

Points are numbered in C order over the procedures and the axes, and over the starts of
each where there are several.
"""

from __future__ import annotations

import math
from typing import Any, Protocol, Self

from nsdrill.data import Array
from nsdrill.models.kept import Kept


class Source(Protocol):
    """Something that points can be read from, in order."""

    @property
    def header(self) -> dict[str, Any]:
        """``coords``: the axes as lists, SI; ``attrs``: the root attributes of the
        results file."""

    @property
    def n_points(self) -> int:
        """Number of points, written or not."""

    @property
    def kept(self) -> Kept:
        """What is kept of each point."""

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]; pending points have status 0 and NaN features."""


class Sink(Source, Protocol):
    """Something that points can be written to, in any order."""

    def write(self, indices: Any, records: Array) -> None:
        """Put ``records`` [n] at the points ``indices`` [n]. What was there before is
        replaced."""

    def clear(self, indices: Any) -> None:
        """Make the points ``indices`` [n] pending again, to run them once more."""

    def sync(self) -> None:
        """Return when everything written is safe against a crash."""

    def status(self) -> Array:
        """Status of every point: int8 [n_points]."""

    def done(self) -> Array:
        """Which points have a result, good or failed: bool [n_points]."""

    def close(self) -> None:
        """Let go of it; what was synced stays."""

    def discard(self) -> None:
        """Let go of it and of everything in it."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: object) -> None: ...


def grid_shape(header: dict[str, Any], kept: Kept) -> tuple[int, ...]:
    """(procedures, values of each axis) of a header, and the number of starts where
    there are several."""
    return tuple(len(header["coords"][name]) for name in kept.grid)


def check_header(header: dict[str, Any], n_points: int, kept: Kept) -> None:
    """ValueError unless ``header`` describes ``n_points`` points."""
    missing = [name for name in kept.grid if name not in header.get("coords", {})]
    if missing or "attrs" not in header:
        wanted = ", ".join(kept.grid)
        raise ValueError(
            f"a header needs 'attrs' and 'coords' with {wanted}; missing: {missing or 'attrs'}"
        )
    if n_points < 1 or math.prod(grid_shape(header, kept)) != n_points:
        raise ValueError(
            f"the axes span {math.prod(grid_shape(header, kept))} points, not {n_points}"
        )
