"""What differs between two sets of results, or two traces: the axes, and the numbers of
the points that both have.

Numbers are the same where they are equal to the bit, or both missing (NaN).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from nsdrill.analysis.hysteresis import words
from nsdrill.analysis.outcome import known, text
from nsdrill.analysis.probability import chances
from nsdrill.data import Array, Results, Trace
from nsdrill.errors import InputError
from nsdrill.models.leaves import as_told
from nsdrill.models.registry import model_in
from nsdrill.models.vocabulary import BY_NAME, IN_TRACE
from nsdrill.variables import PENDING, SAMPLE

ROUNDING = 1e-12  # axes whose values differ by less, relatively, differ by rounding only
MOST_NAMED = 10  # points whose response changed, one by one
_STATUS = 100  # outcomes from here on are a status: no response is known


def compare_results(a: Results, b: Results) -> dict[str, Any]:
    """``axes``: for each its values in ``a`` and ``b`` and how many are common, and
    where each has one, another one, these in ``values``, as their points are compared
    all the same; ``points`` that both have; ``responses``: at how many of these they
    differ, ``changes`` from what to what, and some of the points; ``probabilities`` of
    results with samples, see :func:`_probabilities`; and ``variables``, one row each,
    see :func:`_row`."""
    grid = list(dict.fromkeys((*a.grid, *b.grid)))
    axes, places = _axes(a, b, grid)
    coords = {name: a.coords[name][i] for name, (i, _) in places.items() if name in a.coords}
    shape = tuple(len(i) for i, _ in places.values())
    chance = _probabilities(a, b, places)
    if not np.prod(shape) or a.grid != b.grid:
        return {
            "axes": axes,
            "points": 0,
            "responses": None,
            "probabilities": chance,
            "variables": [],
            **_alone(a, b),
        }
    at = tuple(np.ix_(*(place[side] for place in places.values())) for side in (0, 1))
    rows = []
    for name in a.variables:
        if name not in b.variables:
            continue
        left, right = a[name][at[0]], b[name][at[1]]
        if left.shape != right.shape:
            sizes = {"a": left.shape[-1], "b": right.shape[-1], "of": BY_NAME[name].dims[-1]}
            rows.append({"name": name, "same": False, "points": None, "not_compared": sizes})
            continue
        rows += [
            row | {"at": None if place is None else point_of(coords, place)}
            for row, place in _variable(name, a, left, right, len(shape))
        ]
    return {
        "axes": axes,
        "points": int(np.prod(shape)),
        "responses": _responses(a, b, at, coords),
        "probabilities": chance,
        "variables": rows,
        **_alone(a, b),
    }


def compare_traces(a: Trace, b: Trace) -> dict[str, Any]:
    """As :func:`compare_results`, of the samples at the times that both have; ``first``
    is the time [s] from which a variable differs, ``at`` that of its largest
    difference."""
    i, j, same = common(a.time, b.time)
    axis = {"name": "time", "a": len(a.time), "b": len(b.time), "common": len(i), "same": same}
    rows = []
    for name in a.variables if len(i) else ():
        if name not in b.variables:
            continue
        left, right = a[name][i], b[name][j]
        row, place = _row(name, IN_TRACE[name].units, left, right, 1)
        differs = np.flatnonzero(~same_bits(left, right))
        times = (
            {"first": float(a.time[i[differs[0]]]), "at": float(a.time[i[place[0]]])}
            if place
            else {}
        )
        rows.append({**row, **{"first": None, "at": None}, **times})
    return {"axes": [axis], "points": len(i), "responses": None, "variables": rows, **_alone(a, b)}


def common(a: Array, b: Array) -> tuple[Array, Array, bool]:
    """The places in ``a`` and in ``b`` of the values that are in both, numbers to
    :data:`ROUNDING`; and whether all are the same to the bit. The values of each are
    distinct."""
    if not len(a) or not len(b) or a.dtype.kind != "f" or b.dtype.kind != "f":
        _, i, j = np.intersect1d(a, b, return_indices=True)
        order = np.argsort(i)
        return i[order], j[order], np.array_equal(a, b)
    order = np.argsort(b, kind="stable")
    above = np.clip(np.searchsorted(b[order], a), 0, len(b) - 1)
    below = np.maximum(above - 1, 0)
    nearest = order[
        np.where(np.abs(b[order[below]] - a) <= np.abs(b[order[above]] - a), below, above)
    ]
    near = np.abs(b[nearest] - a) <= ROUNDING * np.abs(a)
    return np.flatnonzero(near), nearest[near], np.array_equal(a, b)


def _axes(
    a: Results, b: Results, grid: Sequence[str]
) -> tuple[list[dict[str, Any]], dict[str, tuple[Array, Array]]]:
    axes, places = [], {}
    nothing = np.empty(0)
    for name in grid:
        left, right = a.coords.get(name, nothing), b.coords.get(name, nothing)
        i, j, same = common(left, right)
        if name == SAMPLE and len(i):
            i, j = (numbers[_drawn_alike(a, b, i, j)] for numbers in (i, j))
            same = same and len(i) == len(left)
        row = {"name": name, "a": len(left), "b": len(right), "common": len(i), "same": bool(same)}
        if not len(i) and len(left) == len(right) == 1 and name != SAMPLE:
            i = j = np.zeros(1, dtype=int)
            row["values"] = [
                text(one[0]) if name == "procedure" else one[0].item() for one in (left, right)
            ]
        axes.append(row)
        places[name] = (i, j)
    return axes, places


def _drawn_alike(a: Results, b: Results, i: Array, j: Array) -> Array:
    """Of samples of the same number, ``i`` in ``a`` and ``j`` in ``b``, those with the
    same values of all unknowns."""
    one, two = ({unknown.key: values for unknown, values in data.drawn.items()} for data in (a, b))
    if one.keys() != two.keys():
        return np.zeros(len(i), dtype=bool)
    return (
        np.all([one[key][i] == two[key][j] for key in one], axis=0)
        if one
        else np.ones(len(i), dtype=bool)
    )


def _alone(a: Results | Trace, b: Results | Trace) -> dict[str, list[str]]:
    """The variables that only one of the two has."""
    return {
        "only_a": [name for name in a.variables if name not in b.variables],
        "only_b": [name for name in b.variables if name not in a.variables],
    }


def point_of(coords: dict[str, Array], place: Sequence[int]) -> dict[str, Any]:
    """The coordinates of a point, as plain data."""
    return {
        name: text(values[i]) if name == "procedure" else as_told(name, values[i].item())
        for (name, values), i in zip(coords.items(), place, strict=True)
    }


def same_bits(a: Array, b: Array) -> Array:
    """Which numbers are the same."""
    if a.dtype.kind != "f":
        return np.asarray(a == b)
    bits = np.ascontiguousarray(a, np.float64).view(np.int64) == np.ascontiguousarray(
        b, np.float64
    ).view(np.int64)
    return np.asarray(bits | (np.isnan(a) & np.isnan(b)))


def _variable(
    name: str, results: Results, a: Array, b: Array, dims: int
) -> Iterator[tuple[dict[str, Any], tuple[int, ...] | None]]:
    """The rows of one variable: one, or one for each state, as these have units of
    their own."""
    variable = BY_NAME[name]
    if variable.dims[-1] != "state":
        yield _row(name, variable.units, a, b, dims, flags=variable.flag_meanings is not None)
        return
    for number, state in enumerate(results.coords["state"].tolist()):
        yield _row(f"{name}[{state}]", IN_TRACE[state].units, a[..., number], b[..., number], dims)


def _row(
    name: str, units: str, a: Array, b: Array, dims: int, *, flags: bool = False
) -> tuple[dict[str, Any], tuple[int, ...] | None]:
    """How two arrays differ, of which the first ``dims`` dimensions are those of the
    points: whether they are the ``same`` to the bit; if not, at how many ``points``
    they differ; of numbers the ``largest`` difference of those that both have, the
    largest ``relative`` to the larger of the two, and ``undefined``, at how many points
    a number stands against none. And the place of the largest difference, or of the
    first where there is no number."""
    differs = ~same_bits(a, b)
    row: dict[str, Any] = {
        "name": name,
        "units": units,
        "same": not differs.any(),
        "points": _points(differs, dims),
    }
    if row["same"]:
        return row, None
    chosen = np.flatnonzero(differs.ravel())
    place = chosen[0]
    if not flags:
        left, right = a.ravel()[chosen].astype(float), b.ravel()[chosen].astype(float)
        finite = np.isfinite(left) & np.isfinite(right)
        gap = np.abs(left[finite] - right[finite])
        scale = np.maximum(np.abs(left[finite]), np.abs(right[finite]))
        undefined = np.zeros(differs.shape, dtype=bool)
        undefined.ravel()[chosen[~finite]] = True
        row |= {
            "largest": float(gap.max()) if gap.size else None,
            "relative": float(np.max(gap / np.where(scale > 0, scale, 1.0))) if gap.size else None,
            "undefined": _points(undefined, dims),
        }
        if gap.size:
            place = chosen[finite][np.argmax(gap)]
    return row, tuple(int(i) for i in np.unravel_index(place, differs.shape)[:dims])


def _points(chosen: Array, dims: int) -> int:
    return int(np.count_nonzero(chosen.reshape(*chosen.shape[:dims], -1).any(axis=-1)))


def _responses(
    a: Results, b: Results, at: Sequence[Any], coords: dict[str, Array]
) -> dict[str, Any] | None:
    """Which outcomes changed: a response, or how the run ended where none is known."""
    if not all(name in data.variables for data in (a, b) for name in ("status", "response")):
        return None
    left, right = (
        _outcomes(data["status"][place], data["response"][place])
        for data, place in zip((a, b), at, strict=True)
    )
    differs = left != right
    pairs, counts = np.unique(np.stack([left[differs], right[differs]]), axis=1, return_counts=True)
    changes = [
        {"from": _word(int(x)), "to": _word(int(y)), "points": int(n)}
        for (x, y), n in zip(pairs.T, counts, strict=True)
    ]
    named = [
        {
            **point_of(coords, place),
            "from": _word(int(left[tuple(place)])),
            "to": _word(int(right[tuple(place)])),
        }
        for place in np.argwhere(differs)[:MOST_NAMED]
    ]
    return {
        "changed": int(np.count_nonzero(differs)),
        "changes": sorted(changes, key=lambda one: -one["points"]),
        "at": named,
    }


def _probabilities(
    a: Results, b: Results, places: dict[str, tuple[Array, Array]]
) -> dict[str, Any] | None:
    """Of two results with samples, the same or others: at how many operating
    ``points``, and for each outcome its mean probability in ``a`` and in ``b``, the
    ``largest`` change, b less a, with its place ``at``, and at how many points their 95
    % intervals lie ``apart``. A safe run is one in all procedures. None where they
    cannot be compared."""
    if any(
        SAMPLE not in data.coords or not {"status", "response"} <= data.variables.keys()
        for data in (a, b)
    ):
        return None
    there = [name for name in places if name not in ("procedure", SAMPLE)]
    points = int(np.prod([len(places[name][0]) for name in there]))
    if not points or a.axes != b.axes or "start" in places:
        return None
    if not np.array_equal(a.coords["procedure"], b.coords["procedure"]):
        return None
    if any(np.any(data["status"] == PENDING) for data in (a, b)):
        return None
    try:
        found = [chances(data, None, model_in(data.attrs).responses) for data in (a, b)]
    except InputError:  # a part of a design of which only all samples tell a probability
        return None
    if found[0].outcomes != found[1].outcomes:
        return None
    coords = {name: a.coords[name][places[name][0]] for name in there}
    rows = []
    for name in found[0].outcomes:
        (one, *ends), (other, *others) = (
            [part[np.ix_(*(places[axis][side] for axis in there))] for part in made.of(name)]
            for side, made in enumerate(found)
        )
        change = other - one
        place = np.unravel_index(int(np.argmax(np.abs(change))), change.shape)
        rows.append(
            {
                "name": name,
                "a": float(one.mean()),
                "b": float(other.mean()),
                "largest": float(change[place]),
                "at": point_of(coords, [int(i) for i in place]),
                "apart": int(np.count_nonzero((ends[1] < others[0]) | (others[1] < ends[0]))),
            }
        )
    return {"points": points, "outcomes": rows}


def _outcomes(status: Array, response: Array) -> Array:
    return np.where(known(status), response.astype(int), _STATUS + status.astype(int))


def _word(outcome: int) -> str:
    if outcome < _STATUS:
        return words(outcome)
    return (BY_NAME["status"].flag_meanings or "").split()[outcome - _STATUS]
