"""The protocols of run logs, in a file or in memory: reading and writing points.

Points are numbered in C order over the procedures and the axes, and over the samples or
starts where there are several.
"""

from __future__ import annotations

import math
from typing import Any, Protocol, Self

from nsdrill.data import Array
from nsdrill.models.kept import Kept


class Source(Protocol):
    """A source of points, which are read in order."""

    @property
    def header(self) -> dict[str, Any]:
        """``coords``: the axes as lists [SI]; ``attrs``: the root attributes of the
        results file."""

    @property
    def n_points(self) -> int:
        """Number of all points, pending ones included."""

    @property
    def kept(self) -> Kept:
        """The contents of the record of each point."""

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]; pending points have status 0 and NaN features."""


class Sink(Source, Protocol):
    """A store of points, which are written in any order."""

    def write(self, indices: Any, records: Array) -> None:
        """Store ``records`` [n] of the points ``indices`` [n], in place of earlier
        ones."""

    def clear(self, indices: Any) -> None:
        """Make the points ``indices`` [n] pending, so that they run again."""

    def sync(self) -> None:
        """Return when all written points would survive a crash."""

    def status(self) -> Array:
        """Status of every point: int8 [n_points]."""

    def done(self) -> Array:
        """Which points have a result, successful or failed: bool [n_points]."""

    def close(self) -> None:
        """Close the store; synced points stay."""

    def discard(self) -> None:
        """Close the store and remove it with all of its points."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *exc: object) -> None: ...


def grid_shape(header: dict[str, Any], kept: Kept) -> tuple[int, ...]:
    """The lengths of the dimensions of a header: procedures, values of each axis, and
    samples or starts where there are several."""
    return tuple(len(header["coords"][name]) for name in kept.grid)


def check_header(header: dict[str, Any], n_points: int, kept: Kept) -> None:
    """ValueError unless ``header`` describes ``n_points`` points."""
    missing = [name for name in kept.grid if name not in header.get("coords", {})]
    if missing or "attrs" not in header:
        wanted = ", ".join(kept.grid)
        raise ValueError(f"a header needs 'attrs' and 'coords' with {wanted}; missing: {missing or 'attrs'}")
    if n_points < 1 or math.prod(grid_shape(header, kept)) != n_points:
        raise ValueError(f"the axes span {math.prod(grid_shape(header, kept))} points, not {n_points}")
