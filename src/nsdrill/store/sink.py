"""What run logs have in common, in a file or in memory: reading and writing points.

Points are numbered in C order over the procedures and the axes, and over the samples or
starts where there are several.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol, Self, TypedDict

import numpy as np

from nsdrill.data import Array, Attributes
from nsdrill.models.kept import Kept
from nsdrill.variables import PENDING

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Header(TypedDict):
    """The coordinates of the points [SI], and the root attributes of the results file."""

    coords: Mapping[str, Array | Sequence[float | str]]
    attrs: Attributes


class Source(Protocol):
    """A source of points, which are read in order.

    ``n_points`` counts all points, pending ones included; ``kept`` says what the record
    of each has."""

    header: Header
    n_points: int
    kept: Kept

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]; pending points have status 0 and NaN features."""


class Sink(ABC):
    """A store of points, which are written in any order. It is a :class:`Source`."""

    def __init__(self, header: Header, n_points: int, kept: Kept) -> None:
        self.header, self.n_points, self.kept = header, n_points, kept
        self._status: Array = np.zeros(n_points, np.int8)

    @abstractmethod
    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start]; pending points have status 0 and NaN features."""

    @abstractmethod
    def write(self, indices: ArrayLike, records: Array) -> None:
        """Store ``records`` [n] of the points ``indices`` [n], in place of earlier
        ones."""

    @abstractmethod
    def clear(self, indices: ArrayLike) -> None:
        """Make the points ``indices`` [n] pending, so that they run again."""

    def sync(self) -> None:
        """Return when all written points would survive a crash, as far as they can."""
        return

    def status(self) -> Array:
        """Status of every point: int8 [n_points]."""
        return self._status.copy()

    def done(self) -> Array:
        """Which points have a result, successful or failed: bool [n_points]."""
        return np.asarray(self._status != PENDING)

    def close(self) -> None:
        """Close the store; synced points stay."""
        return

    @abstractmethod
    def discard(self) -> None:
        """Close the store and remove it with all of its points."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def grid_shape(header: Header, kept: Kept) -> tuple[int, ...]:
    """The lengths of the dimensions of a header: procedures, values of each axis, and
    samples or starts where there are several."""
    return tuple(len(header["coords"][name]) for name in kept.grid)


def check_header(header: Header, n_points: int, kept: Kept) -> None:
    """ValueError unless ``header`` describes ``n_points`` points."""
    missing = [name for name in kept.grid if name not in header.get("coords", {})]
    if missing or "attrs" not in header:
        wanted = ", ".join(kept.grid)
        raise ValueError(f"a header needs 'attrs' and 'coords' with {wanted}; missing: {missing or 'attrs'}")
    if n_points < 1 or math.prod(grid_shape(header, kept)) != n_points:
        raise ValueError(f"the axes span {math.prod(grid_shape(header, kept))} points, not {n_points}")
