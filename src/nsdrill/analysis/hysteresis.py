"""Where up and down differ: the intervals along the axis along which the state was
carried.

The shading of the pictures, the table of ``show`` and its JSON all come from
:func:`differences`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.analysis.outcome import outcome, text
from nsdrill.data import Array, Results
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.variables import dimension_of


@dataclass(frozen=True)
class Difference:
    """Neighbouring points, numbers ``first`` to ``last``, with the response bits ``up``
    one way and ``down`` the other."""

    first: int
    last: int
    up: int
    down: int


def disagreement(procedures: Sequence[str], outcomes: Array) -> Array | None:
    """Where up and down are both known and differ in response (0 or 1), -1 where one of
    them is not known.

    ``outcomes`` are [procedure, ...]. None where the two are not both there: then there
    is nothing to compare.
    """
    if not {"up", "down"} <= set(procedures):
        return None
    up, down = outcomes[procedures.index("up")], outcomes[procedures.index("down")]
    return np.where((up >= 0) & (down >= 0), (up != down).astype(int), -1)


def differences(procedures: Sequence[str], outcomes: Array) -> list[Difference]:
    """The intervals of a line of points in which up and down differ, each with one
    response up and one down.

    ``outcomes`` are [procedure, point], the response bits, negative where not known. A
    point that is not known on either side ends an interval; so does a change of what is
    compared.
    """
    differs = disagreement(procedures, outcomes)
    if differs is None:
        return []
    up, down = outcomes[procedures.index("up")], outcomes[procedures.index("down")]
    found: list[Difference] = []
    for point in np.flatnonzero(differs == 1).tolist():
        pair = int(up[point]), int(down[point])
        if found and found[-1].last == point - 1 and (found[-1].up, found[-1].down) == pair:
            found[-1] = Difference(found[-1].first, point, *pair)
        else:
            found.append(Difference(point, point, *pair))
    return found


def spans(found: Sequence[Difference]) -> list[tuple[int, int]]:
    """Neighbouring differences joined, whatever they are: (first, last) of each
    stretch."""
    joined: list[tuple[int, int]] = []
    for one in found:
        if joined and joined[-1][1] == one.first - 1:
            joined[-1] = joined[-1][0], one.last
        else:
            joined.append((one.first, one.last))
    return joined


def carried_axis(results: Results) -> str | None:
    """The axis along which the state was carried: the study says it, or it is the only
    one swept."""
    try:
        along = json.loads(results.attrs["study_resolved"])["sweep"]["along"]
    except (KeyError, TypeError, ValueError):
        along = None
    if isinstance(along, str) and dimension_of(along) in results.axes:
        return dimension_of(along)
    return results.swept[0] if len(results.swept) == 1 else None


def hysteresis(results: Results, along: str | None = None) -> list[dict[str, Any]]:
    """The intervals along the carried axis in which the two directions of an up-down
    sweep differ, for every combination of the other axes; empty for any other sweep.
    Plain data, SI units.

    ``from`` and ``to`` are the first and the last value that differ. The true end lies
    outside, within the ``step`` of the axis there (the larger one, where the two ends
    differ); but where the sweep ended or a point failed, nothing bounds it, and
    ``open`` names that end. ``up`` and ``down`` are the responses either way,
    ``differs`` those that only one way has; ``up_whirl`` and ``down_whirl`` are the
    kinds of whirl in the interval.
    """
    along = along or carried_axis(results)
    procedures = [text(name) for name in results.coords["procedure"]]
    if along is None or not {"up", "down"} <= set(procedures):
        return []
    return [
        row for place in _lines(results, along) for row in _rows(results, procedures, along, place)
    ]


def _lines(results: Results, along: str) -> Iterator[tuple[int | slice, ...]]:
    """Places of the lines along the carried axis, one for each combination of the other
    axes (and starts)."""
    grid = results["status"].shape[1:]
    axis = results.axes.index(along)
    for place in np.ndindex(*grid[:axis], *grid[axis + 1 :]):
        yield (slice(None), *place[:axis], slice(None), *place[axis:])


def _rows(
    results: Results, procedures: Sequence[str], along: str, place: tuple[int | slice, ...]
) -> Iterator[dict[str, Any]]:
    outcomes = outcome(results["status"][place], results["response"][place])
    kinds = results["whirl_kind"][place] if "whirl_kind" in results.variables else None
    x = np.asarray(results.coords[along], dtype=float)
    held = {
        axis: results.coords[axis][number].item()
        for axis, number in zip(results.grid[1:], place[1:], strict=True)
        if isinstance(number, int)
    }
    unknown = np.minimum(outcomes[procedures.index("up")], outcomes[procedures.index("down")]) < 0
    for one in differences(procedures, outcomes):
        row: dict[str, Any] = {
            "axis": along,
            "from": float(x[one.first]),
            "to": float(x[one.last]),
            "points": one.last - one.first + 1,
            "up": words(one.up),
            "down": words(one.down),
            "differs": words(one.up ^ one.down).split("+"),
            **held,
            **_ends(x, one, unknown),
        }
        if kinds is not None:
            for name in ("up", "down"):
                here = kinds[procedures.index(name), one.first : one.last + 1]
                row[f"{name}_whirl"] = [_kind(int(kind)) for kind in np.unique(here[here > 0])]
        yield row


def _ends(x: Array, one: Difference, unknown: Array) -> dict[str, Any]:
    """How far outside the true ends may lie, and the ends that nothing bounds."""
    steps: list[float] = []
    loose: list[str] = []
    for name, point, outside in (
        ("from", one.first, one.first - 1),
        ("to", one.last, one.last + 1),
    ):
        if 0 <= outside < len(x):
            steps.append(abs(float(x[point] - x[outside])))
        if not 0 <= outside < len(x) or unknown[outside]:
            loose.append(name)
    return {"step": max(steps, default=None), "open": loose}


def words(bits: int) -> str:
    """The response bits as in the JSON of ``show``: ``bit_bounce+whirl``, ``none``."""
    names = (BY_NAME["response"].flag_meanings or "").split()
    return "+".join(name for number, name in enumerate(names) if bits >> number & 1) or "none"


def _kind(value: int) -> str:
    return (BY_NAME["whirl_kind"].flag_meanings or "").split()[value]
