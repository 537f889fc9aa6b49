"""Hysteresis: the intervals of the carried axis in which the directions up and down
differ.

The shading of the pictures, the table of ``show`` and its JSON all use
:func:`differences`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from nsdrill.analysis.counts import Counts, carried_axis, knowledge
from nsdrill.analysis.safety import known_outcome, known_runs
from nsdrill.data import NATURAL_SCALES, Answer, Array, Attributes, Results
from nsdrill.models.registry import model_in, named_in
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.records import dataclass

NEEDED = ("status", "response")  # the variables of results that are used
# by how much features of two motions differ: in natural scales, each a tenth of the greatest
# value; and of fractions of time
APART, APART_IN_TIME = 0.5, 0.05


@dataclass(frozen=True)
class Difference:
    """Neighbouring points, numbers ``first`` to ``last``, with the same response bits
    ``up`` and the same ``down``."""

    first: int
    last: int
    up: int
    down: int


def disagreement(procedures: Sequence[str], outcomes: Array) -> Array | None:
    """1 where up and down differ in response, 0 where they agree, -1 where one of them
    is not known.

    ``outcomes`` are [procedure, ...]. None where the procedures lack up or down.
    """
    if not {"up", "down"} <= set(procedures):
        return None
    up, down = outcomes[procedures.index("up")], outcomes[procedures.index("down")]
    return np.where((up >= 0) & (down >= 0), (up != down).astype(int), -1)


def differences(procedures: Sequence[str], outcomes: Array) -> list[Difference]:
    """The intervals of a line of points in which up and down differ, each with one
    response up and one down.

    ``outcomes`` are [procedure, point], the response bits, negative where not known. An
    interval ends at a point where either is not known, and where a response changes.
    """
    differs = disagreement(procedures, outcomes)
    if differs is None:
        return []
    up, down = outcomes[procedures.index("up")], outcomes[procedures.index("down")]
    intervals: list[Difference] = []
    for point in np.flatnonzero(differs == 1).tolist():
        pair = int(up[point]), int(down[point])
        if intervals and intervals[-1].last == point - 1 and (intervals[-1].up, intervals[-1].down) == pair:
            intervals[-1] = Difference(intervals[-1].first, point, *pair)
        else:
            intervals.append(Difference(point, point, *pair))
    return intervals


def spans(intervals: Sequence[Difference]) -> list[tuple[int, int]]:
    """Neighbouring intervals joined, whatever their responses: (first, last) of each
    stretch."""
    joined: list[tuple[int, int]] = []
    for interval in intervals:
        if joined and joined[-1][1] == interval.first - 1:
            joined[-1] = joined[-1][0], interval.last
        else:
            joined.append((interval.first, interval.last))
    return joined


def hysteresis(results: Results, along: str | None = None) -> list[Answer]:
    """The intervals along the carried axis in which the two directions of an up-down
    sweep differ, for every combination of the other axes; empty for any other sweep.
    Plain data, SI units.

    ``from`` and ``to`` are the first and the last value that differ: the runs change within
    the ``step`` of the axis there (the larger of those at the two ends). The true end may lie
    some steps away on either side, as motions near it grow or decay slowly. Where the sweep ends
    or a point failed no run shows a change, and ``open`` names that end.

    ``up`` and ``down`` are the responses in the two directions, ``differs`` those of only one of
    them; ``up_whirl`` and ``down_whirl`` are the kinds of that response in the interval. Of a
    model without responses, ``differs`` are the features by which the two motions differ
    (:func:`apart`).
    """
    along = along or carried_axis(results)
    if along is None or not {"up", "down"} <= set(results.procedures):
        return []
    outcomes, features = known_outcome(results), apart(results)
    differing = np.any([*features.values()], axis=0) if features else None
    return [
        row
        for place in _lines(results, along)
        for row in _rows(results, along, place, _by_motion(results, outcomes, differing)[place], features)
    ]


def comparable(results: Results) -> bool:
    """Whether it is known in what two motions differ: in responses, or in features by
    natural scales."""
    return bool(model_in(results.attrs).responses or _scales(results))


def apart(results: Results) -> dict[str, Array]:
    """Of a model without responses, where up and down differ in each feature by which runs
    are compared: bool on the grid without the procedures, by feature. A motion is another
    one from :data:`APART` natural scales on, which a file keeps; empty without these."""
    model, scales = model_in(results.attrs), _scales(results)
    if model.responses or not scales or not {"up", "down"} <= set(results.procedures):
        return {}
    up, down = (results.procedures.index(name) for name in ("up", "down"))
    signals = {variable.name: variable.signal for variable in model.features}
    found: dict[str, Array] = {}
    for name, scale in model.compared.items():
        if name in results.variables:
            least = APART * scales[signals[name]] if scale else APART_IN_TIME
            values = np.asarray(results[name])
            found[name] = np.abs(values[up] - values[down]) > least
    return found


def _scales(results: Results) -> Mapping[str, float]:
    """The natural scales of the states that a file keeps."""
    found: Mapping[str, float] = json.loads(str(results.attrs.get(NATURAL_SCALES, "{}")))
    return found


def _by_motion(results: Results, outcomes: Array, differing: Array | None) -> Array:
    """The ``outcomes``, in which up is another motion than down where they are
    ``differing``."""
    if differing is None:
        return outcomes
    changed = outcomes.copy()
    up = results.procedures.index("up")
    changed[up] = np.where((outcomes[up] >= 0) & differing, 1, outcomes[up])
    return changed


def not_compared(results: Results) -> Answer | None:
    """At how many of the operating points (and starts) up and down are not compared, as
    one of them is not known: plain data of :class:`nsdrill.analysis.counts.Counts`. None
    where the file does not have both."""
    if not {"up", "down"} <= set(results.procedures):
        return None
    ways = [results.procedures.index(name) for name in ("up", "down")]
    found = knowledge(np.asarray(results["status"]), known_runs(results))[ways]
    return Counts.over(found.max(axis=0)).at()


def _lines(results: Results, along: str) -> Iterator[tuple[int | slice, ...]]:
    """The indices of the lines along the carried axis, one for each combination of the
    other axes (and starts)."""
    grid = results["status"].shape[1:]
    axis = results.axes.index(along)
    for place in np.ndindex(*grid[:axis], *grid[axis + 1 :]):
        yield (slice(None), *place[:axis], slice(None), *place[axis:])


def _rows(
    results: Results, along: str, place: tuple[int | slice, ...], outcomes: Array, features: Mapping[str, Array]
) -> Iterator[Answer]:
    procedures = results.procedures
    x = np.asarray(results.coords[along], dtype=float)
    fixed = {
        axis: results.coords[axis][number].item()
        for axis, number in zip(results.grid[1:], place[1:], strict=True)
        if isinstance(number, int)
    }
    unknown = np.minimum(outcomes[procedures.index("up")], outcomes[procedures.index("down")]) < 0
    for interval in differences(procedures, outcomes):
        inside = slice(interval.first, interval.last + 1)
        motions = [name for name, differs in features.items() if differs[place[1:]][inside].any()]
        up, down = (0, 0) if motions else (interval.up, interval.down)
        row: Answer = {
            "axis": along,
            "from": float(x[interval.first]),
            "to": float(x[interval.last]),
            "points": interval.last - interval.first + 1,
            "up": response_text(up, results.attrs),
            "down": response_text(down, results.attrs),
            "differs": motions or response_text(up ^ down, results.attrs).split("+"),
            **fixed,
            **_end_bounds(x, interval, unknown),
        }
        for label, response in RESPONSE_KINDS.items():
            for name in ("up", "down") if label in results.variables else ():
                found = results[label][place][procedures.index(name), inside]
                kinds = sorted(set(found[found > 0].tolist()))
                row[f"{name}_{response.name}"] = [named_in(results.attrs)[label].words(kind) for kind in kinds]
        yield row


def _end_bounds(x: Array, interval: Difference, unknown: Array) -> Answer:
    """Within which step outside the interval the runs change, and at which ends no run shows
    that."""
    steps: list[float] = []
    open_ends: list[str] = []
    for name, point, outside in (
        ("from", interval.first, interval.first - 1),
        ("to", interval.last, interval.last + 1),
    ):
        if 0 <= outside < len(x):
            steps.append(abs(float(x[point] - x[outside])))
        if not 0 <= outside < len(x) or unknown[outside]:
            open_ends.append(name)
    return {"step": max(steps, default=None), "open": open_ends}


def response_text(bits: int, attrs: Attributes) -> str:
    """The response bits as in the JSON of ``show``: names with ``+`` between them, or
    ``none``; of a file with the root attributes ``attrs``."""
    return named_in(attrs)["response"].words(bits)
