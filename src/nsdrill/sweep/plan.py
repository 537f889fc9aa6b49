"""From axes to points to chains: which operating points there are, and in which order the state is carried.

Points are numbered in the order of the results file: (procedure, depth, wob, rotary_speed), the last fastest; where
every operating point is started from several states, each start is a point of its own, and the starts run fastest. A
chain is a row of points that follow one another; without carried state every point is a chain of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.variables import AXES

Array = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class Plan:
    """``axes``: ascending values of depth [m], wob [N] and rotary_speed [rad/s]; ``procedure`` same, up, down or
    up-down; ``along`` the axis along which the state is carried; ``starts`` from how many states each operating point
    is started, 0 where from one; there are several with procedure same only.

    Up-down is one chain: up to the end and back down from there, so that the end point is run twice.
    """

    axes: dict[str, Array]
    procedure: str
    along: str | None
    starts: int = 0

    def __post_init__(self) -> None:
        if self.starts and self.procedure != "same":
            raise ValueError(f"starts: found {self.starts} with procedure {self.procedure}, allowed: with same")

    @property
    def procedures(self) -> tuple[str, ...]:
        return ("up", "down") if self.procedure == "up-down" else (self.procedure,)

    @property
    def shape(self) -> tuple[int, int, int, int]:
        d, w, s = (len(self.axes[name]) for name in AXES)
        return len(self.procedures), d, w, s

    @property
    def grid(self) -> tuple[int, ...]:
        """The shape over which points are numbered."""
        return (*self.shape, self.starts) if self.starts else self.shape

    @property
    def points(self) -> int:
        return int(np.prod(self.grid))

    @property
    def chain_length(self) -> int:
        if self.procedure == "same" or self.along is None:
            return 1
        return len(self.axes[self.along]) * len(self.procedures)

    @property
    def chains(self) -> int:
        return self.points // self.chain_length

    def points_of(self, chain: Array | int, place: Array | int) -> Array:
        """Numbers of the points at these places of these chains (arrays that broadcast together)."""
        chain, place = np.broadcast_arrays(np.asarray(chain), np.asarray(place))
        if self.chain_length == 1:
            return np.asarray(chain)
        assert self.along is not None
        _, *lengths = self.shape
        axis = AXES.index(self.along)
        n = lengths[axis]
        others = [length if i != axis else 1 for i, length in enumerate(lengths)]
        position = list(np.unravel_index(chain, others))
        # On the way back, and in a down-sweep, the axis runs from its end.
        second = place >= n
        backward = second | (self.procedure == "down")
        step = np.where(second, place - n, place)
        position[axis] = np.where(backward, n - 1 - step, step)
        return np.asarray(np.ravel_multi_index((second.astype(np.int64), *position), self.shape))

    def values(self, points: Array) -> tuple[Array, Array, Array]:
        """Depth [m], weight on bit [N] and speed [rad/s] of these points."""
        _, *indices = np.unravel_index(points, self.grid)[:4]
        depth, wob, speed = (self.axes[name][index] for name, index in zip(AXES, indices, strict=True))
        return depth, wob, speed

    def starts_of(self, points: Array) -> Array:
        """The number of the start of these points."""
        return np.asarray(points) % max(self.starts, 1)

    def find(
        self, depth: float, wob: float, rotary_speed: float, procedure: str, start: int = 0
    ) -> tuple[int, tuple[float, ...]]:
        """The point nearest to these values in a procedure, and its values. Raises ValueError for a procedure or a
        start that is not there."""
        if not 0 <= start < max(self.starts, 1):
            raise ValueError(f"start: found {start}, allowed: 0 to {max(self.starts, 1) - 1}")
        if procedure not in self.procedures:
            raise ValueError(f"procedure: found {procedure}, allowed: {', '.join(self.procedures)}")
        wanted = (depth, wob, rotary_speed)
        nearest = [
            int(np.argmin(np.abs(self.axes[name] - value))) for name, value in zip(AXES, wanted, strict=True)]
        found = tuple(float(self.axes[name][i]) for name, i in zip(AXES, nearest, strict=True))
        operating_point = int(np.ravel_multi_index((self.procedures.index(procedure), *nearest), self.shape))
        return operating_point * max(self.starts, 1) + start, found
