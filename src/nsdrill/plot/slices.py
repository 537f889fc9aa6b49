"""Cuts through a sweep: ordered axes, cells, the outcome of each point, where two procedures disagree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.variables import OK, PENDING

AXES = ("depth", "wob", "rotary_speed")
PENDING_POINT, FAILED_POINT = -1, -2  # outcomes beside the response bits, which are never negative


def text(value: object) -> str:
    """A procedure name, which HDF5 gives back as bytes and numpy as a scalar."""
    return value.decode() if isinstance(value, bytes) else str(value)


def ordered(results: Results, at: Mapping[str, float] | None = None) -> Results:
    """The results with every axis ascending, and cut at the values of ``at`` (SI)."""
    coords, variables = dict(results.coords), dict(results.variables)
    for place, axis in enumerate(AXES, start=1):
        values = np.asarray(coords[axis], dtype=float)
        chosen = np.argsort(values, kind="stable")
        if at and axis in at:
            chosen = np.array([_index_of(axis, values, at[axis])])
        if np.array_equal(chosen, np.arange(len(values))):
            continue
        coords[axis] = values[chosen]
        variables = {name: np.take(array, chosen, axis=place) for name, array in variables.items()}
    return Results(coords, variables, results.attrs)


def _index_of(axis: str, values: Array, wanted: float) -> int:
    nearest = int(np.argmin(np.abs(values - wanted)))
    if not np.isclose(values[nearest], wanted, rtol=1e-6, atol=0.0):
        raise InputError(
            f"{axis}: found {wanted:g}; allowed: one of the {len(values)} values of the sweep in SI units, "
            f"{values.min():g} to {values.max():g}. The nearest is {values[nearest]:.10g}."
        )
    return nearest


@dataclass(frozen=True)
class Line:
    """The points along one axis with the other axes held: arrays are [procedure, point] or [procedure, point, peak]."""

    results: Results
    axis: str
    place: tuple[int | slice, ...]

    @property
    def x(self) -> Array:
        return np.asarray(self.results.coords[self.axis], dtype=float)

    @property
    def procedures(self) -> tuple[str, ...]:
        return tuple(text(name) for name in self.results.coords["procedure"])

    def __getitem__(self, name: str) -> Array:
        return np.asarray(self.results.variables[name])[self.place]

    @property
    def outcome(self) -> Array:
        return outcome(self["status"], self["response"])


def line(results: Results, axis: str, **held: int) -> Line:
    """The line along ``axis`` through the point numbers ``held`` of the other axes (0 where not given)."""
    return Line(results, axis, (slice(None), *(slice(None) if a == axis else held.get(a, 0) for a in AXES)))


def outcome(status: Array, response: Array) -> Array:
    """The response bits where the run ended well, else :data:`PENDING_POINT` or :data:`FAILED_POINT`."""
    failed = np.where(status == PENDING, PENDING_POINT, FAILED_POINT)
    return np.where(status == OK, response.astype(int), failed)


def disagreement(procedures: tuple[str, ...], outcomes: Array) -> Array | None:
    """Where up and down both ended well and differ in response (0 or 1), -1 where one of them did not end well.

    None where the two are not both there: then there is nothing to compare.
    """
    if not {"up", "down"} <= set(procedures):
        return None
    up, down = outcomes[procedures.index("up")], outcomes[procedures.index("down")]
    return np.where((up >= 0) & (down >= 0), (up != down).astype(int), -1)


def edges(centres: Array) -> Array:
    """Cell edges half way between neighbours, mirrored at both ends; so a non-uniform axis is drawn to scale."""
    centres = np.asarray(centres, dtype=float)
    if len(centres) == 1:
        half = 0.05 * abs(centres[0]) or 0.5
        return np.array([centres[0] - half, centres[0] + half])
    middle = 0.5 * (centres[1:] + centres[:-1])
    first, last = 2 * centres[0] - middle[0], 2 * centres[-1] - middle[-1]
    return np.concatenate(([first], middle, [last]))


def intervals(flags: Array, cell_edges: Array) -> list[tuple[float, float]]:
    """The runs of neighbouring cells in which ``flags`` holds, as (from, to)."""
    steps = np.diff(np.concatenate(([0], np.asarray(flags, dtype=bool).astype(int), [0])))
    starts, ends = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    return [(float(cell_edges[a]), float(cell_edges[b])) for a, b in zip(starts, ends, strict=True)]


def robust_limits(values: Array, spread: float = 3.0) -> tuple[float, float]:
    """Limits that a few wild values do not own: the 2nd and 98th percentile, opened to the extremes if these are near.

    Ratios over a mean bit speed explode where the bit hardly turns; one such point must not flatten all the others.
    """
    finite = np.asarray(values, dtype=float)
    finite = finite[np.isfinite(finite)]
    if not finite.size:
        return 0.0, 1.0
    low, middle, high = np.percentile(finite, (2, 50, 98))
    least, greatest = finite.min(), finite.max()
    low = least if middle - least <= spread * (middle - low) else low
    high = greatest if greatest - middle <= spread * (high - middle) else high
    if low == high:
        low, high = least, greatest
    if low == high:
        half = 0.5 * abs(low) or 0.5
        low, high = low - half, high + half
    return float(low), float(high)
