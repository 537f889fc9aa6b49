"""The differences between two sets of results, two traces or two files of branches: of
their axes, and of the numbers at their common points.

Numbers are the same where they are equal to the bit, or both missing (NaN).
"""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.bifurcations import END, FAILED, REGULAR, meanings_of, motion_text
from nsdrill.analysis.counts import AFTER_FAILURE, known
from nsdrill.analysis.hysteresis import response_text
from nsdrill.analysis.planes import judges
from nsdrill.analysis.probability import probabilities_of
from nsdrill.analysis.safety import known_runs
from nsdrill.data import Answer, Array, Attributes, Change, Resolved, Results, Trace, flat, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.choices import word_or_number
from nsdrill.models.registry import BY_NAME, IN_TRACE, described, model_in, named_in
from nsdrill.models.tree import with_values
from nsdrill.variables import MODEL, SAMPLE

if TYPE_CHECKING:
    from xarray import Dataset

AGREEMENT = 1e-5  # relative: special points, which are located to 1e-6, that differ by less are the same
ROUNDING = 1e-12  # relative: values of axes that differ by less are the same
Place = tuple[Array, ...]  # one array of indices for each dimension
MAX_LISTED = 10  # points whose response changed
_NOT_CARRIED = 1 << 14  # of a run after a failed one in its chain, above all response bits
_STATUS_OFFSET = _NOT_CARRIED + 1  # of the status in an outcome without a known response


def compare_results(a: Results, b: Results) -> Answer:
    """The comparison of two results as plain data:

    - ``axes``: for each the number of values in ``a`` and ``b`` and of common ones.
      Where each has a single value and they differ, the points are compared all the
      same, and ``values`` has the two.
    - ``points``: the number of common points.
    - ``responses``: at how many of these they differ, the ``changes`` from one to
      another, and some of the points; None where a model declares none
      (``declares_responses``).
    - ``probabilities`` of results with samples: see :func:`_probabilities`.
    - ``variables``: one row each, see :func:`_row`.
    - ``only_a`` and ``only_b``: the variables that only one of them has.
    """
    grid = list(dict.fromkeys((*a.grid, *b.grid)))
    axes, places = _axes(a, b, grid)
    coords = {name: a.coords[name][i] for name, (i, _) in places.items() if name in a.coords}
    shape = tuple(len(i) for i, _ in places.values())
    selections = tuple(np.ix_(*(place[side] for place in places.values())) for side in (0, 1))
    is_comparable = bool(np.prod(shape)) and a.grid == b.grid
    return {
        "axes": axes,
        "points": int(np.prod(shape)) if is_comparable else 0,
        "declares_responses": judges(a) and judges(b),
        "responses": _responses(a, b, selections, coords) if is_comparable else None,
        "probabilities": _probabilities(a, b, places),
        "variables": [*_rows(a, b, selections, coords)] if is_comparable else [],
        **_only_in_one(a, b),
    }


def _rows(a: Results, b: Results, selections: Sequence[Place], coords: dict[str, Array]) -> Iterator[Answer]:
    """The rows of the variables that both have, at their common points."""
    for name in a.variables:
        if name not in b.variables or name == AFTER_FAILURE.name:
            continue
        left, right = a[name][selections[0]], b[name][selections[1]]
        if left.shape != right.shape:
            lengths = {"a": left.shape[-1], "b": right.shape[-1], "of": named_in(a.attrs)[name].dims[-1]}
            yield {"name": name, "same": False, "points": None, "not_compared": lengths}
            continue
        for row, place in _variable(name, a, left, right, len(coords)):
            yield row | {"at": None if place is None else point_of(coords, place)}


def compare_traces(a: Trace, b: Trace) -> Answer:
    """As :func:`compare_results`, for the samples at common times; ``first`` is the
    first time [s] at which a variable differs, ``at`` that of its largest
    difference."""
    i, j, same = common_places(a.time, b.time)
    axis = {"name": "time", "a": len(a.time), "b": len(b.time), "common": len(i), "same": same}
    rows = []
    for name in a.variables if len(i) else ():
        if name not in b.variables:
            continue
        left, right = a[name][i], b[name][j]
        row, place = _row(name, IN_TRACE.beside(model_in(a.attrs))[name].units, left, right, 1)
        differs = np.flatnonzero(~same_bits(left, right))
        times = {"first": float(a.time[i[differs[0]]]), "at": float(a.time[i[place[0]]])} if place else {}
        rows.append({**row, **{"first": None, "at": None}, **times})
    return {"axes": [axis], "points": len(i), "responses": None, "variables": rows, **_only_in_one(a, b)}


def compare_branches(a: Dataset, b: Dataset) -> Answer:
    """As :func:`compare_results`, for two files of branches: their ``axes`` are the
    dimensions, ``points`` the points along the branches, 0 where their numbers differ,
    and ``at`` is the number of a point or branch. Variables are compared where both
    have as many values. Each file numbers its branches, and no pairs are formed:
    ``special`` has the special points by their kind, see :func:`_special`, and
    ``seeds`` the numbers of seeds of both, by their outcome; ``along`` is the continued
    number."""
    axes, rows = [], []
    for name in map(str, dict.fromkeys((*a.sizes, *b.sizes))):
        left, right = (one[name].values if name in one.sizes else np.empty(0) for one in (a, b))
        common, same = len(np.intersect1d(left, right)), np.array_equal(left, right)
        axes.append({"name": name, "a": len(left), "b": len(right), "common": common, "same": same})
    for name in [str(name) for name in a.data_vars if name in b.data_vars]:
        left, right = a[name].values, b[name].values
        if left.shape != right.shape:
            lengths = {"a": left.size, "b": right.size, "of": str(a[name].dims[0])}
            rows.append({"name": name, "same": False, "points": None, "not_compared": lengths})
            continue
        units, has_words = str(a[name].attrs.get("units", "1")), left.dtype.kind not in "fiu"
        row, place = _row(name, units, left, right, 1, flags=has_words)
        rows.append({**row, "at": {str(a[name].dims[0]): place[0]} if place else None})
    points = a.sizes["point"] if a.sizes["point"] == b.sizes["point"] else 0
    only = {
        "only_a": [str(name) for name in a.data_vars if name not in b.data_vars],
        "only_b": [str(name) for name in b.data_vars if name not in a.data_vars],
    }
    seeds = [json.loads(one.attrs.get("seeds", "{}")) for one in (a, b)]
    more = {"along": str(a.attrs["along"]), "special": _special(a, b), "seeds": seeds}
    return {"axes": axes, "points": points, "responses": None, "variables": rows, **only, **more}


def _special(a: Dataset, b: Dataset) -> list[Answer]:
    """For every ``label`` on every ``motion`` and period in ``lobes`` the number of
    special points in ``a`` and in ``b``, and the values of the continued number (SI) of
    those that only one of them has: to :data:`AGREEMENT`, each of the nearest once."""
    (along, of_a), (other, of_b) = _specials(a), _specials(b)
    rows = list[Answer]()
    for kind in sorted({*of_a, *of_b}) if along == other else ():
        left, right = of_a.get(kind, []), of_b.get(kind, [])
        only_a, only_b = list[float](), list(right)
        for value in left:
            near = min(only_b, key=lambda one: abs(one - value), default=math.inf)
            if abs(near - value) <= AGREEMENT * abs(value):
                only_b.remove(near)
            else:
                only_a.append(value)
        row = dict(zip(("motion", "lobes", "label"), kind, strict=True))
        row["words"] = motion_text(kind[0], kind[1], model_in(a.attrs))
        rows.append({**row, "a": len(left), "b": len(right), "only_a": only_a, "only_b": only_b})
    return rows


def _specials(data: Dataset) -> tuple[str, dict[tuple[str, int, str], list[float]]]:
    """The continued number, and its values at the special points of branches, rising, by
    motion, lobes and label."""
    along, meanings = str(data.attrs["along"]), meanings_of(model_in(data.attrs))
    labels, branches = data["label"].values, data["branch_of_point"].values
    found: dict[tuple[str, int, str], list[float]] = {}
    for place in np.argsort(data[along].values):
        branch, label = int(branches[place]), int(labels[place])
        if label in meanings and label not in (REGULAR, END, FAILED):
            kind = str(data["motion"].values[branch]), int(data["lobes"].values[branch]), meanings[label].name
            found.setdefault(kind, []).append(float(data[along].values[place]))
    return along, found


def common_places(a: Array, b: Array) -> tuple[Array, Array, bool]:
    """The indices in ``a`` and in ``b`` of their common values, of numbers to
    :data:`ROUNDING`, and whether all are the same to the bit. The values of each are
    distinct."""
    if not len(a) or not len(b) or a.dtype.kind != "f" or b.dtype.kind != "f":
        _, i, j = np.intersect1d(a, b, return_indices=True)
        order = np.argsort(i)
        return i[order], j[order], np.array_equal(a, b)
    order = np.argsort(b, kind="stable")
    above = np.clip(np.searchsorted(b[order], a), 0, len(b) - 1)
    below = np.maximum(above - 1, 0)
    nearest = order[np.where(np.abs(b[order[below]] - a) <= np.abs(b[order[above]] - a), below, above)]
    is_common = np.abs(b[nearest] - a) <= ROUNDING * np.abs(a)
    return np.flatnonzero(is_common), nearest[is_common], np.array_equal(a, b)


def _axes(a: Results, b: Results, grid: Sequence[str]) -> tuple[list[Answer], dict[str, tuple[Array, Array]]]:
    axes, places = [], {}
    nothing = np.empty(0)
    for name in grid:
        left, right = a.coords.get(name, nothing), b.coords.get(name, nothing)
        i, j, same = common_places(left, right)
        if name == SAMPLE and len(i):
            i, j = (numbers[_equal_samples(a, b, i, j)] for numbers in (i, j))
            same = same and len(i) == len(left)
        row = {"name": name, "a": len(left), "b": len(right), "common": len(i), "same": bool(same)}
        if not len(i) and len(left) == len(right) == 1 and name != SAMPLE:
            i = j = np.zeros(1, dtype=int)
            row["values"] = [str(values[0]) if name == "procedure" else values[0].item() for values in (left, right)]
        axes.append(row)
        places[name] = (i, j)
    return axes, places


def _equal_samples(a: Results, b: Results, i: Array, j: Array) -> Array:
    """Which of the samples of the same numbers, ``i`` in ``a`` and ``j`` in ``b``, have
    the same values of all unknowns."""
    drawn_a, drawn_b = ({unknown.key: values for unknown, values in data.drawn.items()} for data in (a, b))
    if drawn_a.keys() != drawn_b.keys():
        return np.zeros(len(i), dtype=bool)
    return (
        np.all([drawn_a[key][i] == drawn_b[key][j] for key in drawn_a], axis=0)
        if drawn_a
        else np.ones(len(i), dtype=bool)
    )


def _only_in_one(a: Results | Trace, b: Results | Trace) -> dict[str, list[str]]:
    """The variables that only one of the two has."""
    return {
        "only_a": [name for name in a.variables if name not in (*b.variables, AFTER_FAILURE.name)],
        "only_b": [name for name in b.variables if name not in (*a.variables, AFTER_FAILURE.name)],
    }


def point_of(coords: dict[str, Array], place: Sequence[int]) -> Answer:
    """The coordinates of a point, as plain data."""
    return {
        name: str(values[i]) if name == "procedure" else word_or_number(name, values[i].item())
        for (name, values), i in zip(coords.items(), place, strict=True)
    }


def same_bits(a: Array, b: Array) -> Array:
    """Which numbers are the same."""
    if a.dtype.kind != "f":
        return np.asarray(a == b)
    bits = np.ascontiguousarray(a, np.float64).view(np.int64) == np.ascontiguousarray(b, np.float64).view(np.int64)
    return np.asarray(bits | (np.isnan(a) & np.isnan(b)))


def _variable(
    name: str, results: Results, a: Array, b: Array, dims: int
) -> Iterator[tuple[Answer, tuple[int, ...] | None]]:
    """The rows of one variable: a single one, or one for each state where states have
    units of their own."""
    model = model_in(results.attrs)
    variable = BY_NAME.beside(model)[name]
    if variable.dims[-1] != "state":
        yield _row(name, variable.units, a, b, dims, flags=variable.flag_meanings is not None)
        return
    for number, state in enumerate(results.coords["state"].tolist()):
        yield _row(f"{name}[{state}]", IN_TRACE.beside(model)[state].units, a[..., number], b[..., number], dims)


def _row(
    name: str, units: str, a: Array, b: Array, dims: int, *, flags: bool = False
) -> tuple[Answer, tuple[int, ...] | None]:
    """The difference of two arrays, of which the first ``dims`` dimensions are those of
    the points, and the place of the largest difference, or of the first one where no
    number is in both.

    ``same``: whether they are equal to the bit; ``points``: at how many points they
    differ. Of numbers also the ``largest`` difference, the largest ``relative`` to the
    larger of the two, and ``undefined``: at how many points only one has a number.
    """
    differs = ~same_bits(a, b)
    row: Answer = {"name": name, "units": units, "same": not differs.any(), "points": _points(differs, dims)}
    if row["same"]:
        return row, None
    different = np.flatnonzero(differs.ravel())
    largest = different[0]
    if not flags:
        left, right = a.ravel()[different].astype(float), b.ravel()[different].astype(float)
        finite = np.isfinite(left) & np.isfinite(right)
        difference = np.abs(left[finite] - right[finite])
        scale = np.maximum(np.abs(left[finite]), np.abs(right[finite]))
        undefined = np.zeros(differs.shape, dtype=bool)
        undefined.ravel()[different[~finite]] = True
        row |= {
            "largest": float(difference.max()) if difference.size else None,
            "relative": float(np.max(difference / np.where(scale > 0, scale, 1.0))) if difference.size else None,
            "undefined": _points(undefined, dims),
        }
        if difference.size:
            largest = different[finite][np.argmax(difference)]
    return row, tuple(int(i) for i in np.unravel_index(largest, differs.shape)[:dims])


def _points(is_chosen: Array, dims: int) -> int:
    return int(np.count_nonzero(is_chosen.reshape(*is_chosen.shape[:dims], -1).any(axis=-1)))


def _responses(a: Results, b: Results, selections: Sequence[Place], coords: dict[str, Array]) -> Answer | None:
    """The outcomes that changed: a response, or the status of the run where no response
    is known; how many are ``unchanged``, known and the same; and ``unknown``: at how many
    points one or both of the responses are not."""
    if not all(name in data.variables and judges(data) for data in (a, b) for name in ("status", "response")):
        return None
    left, right = (_outcomes(data)[point] for data, point in zip((a, b), selections, strict=True))
    differs, unknown = left != right, (left >= _NOT_CARRIED) | (right >= _NOT_CARRIED)
    pairs, counts = np.unique(np.stack([left[differs], right[differs]]), axis=1, return_counts=True)
    changes = [
        {"from": _outcome_name(int(x), a.attrs), "to": _outcome_name(int(y), b.attrs), "points": int(n)}
        for (x, y), n in zip(pairs.T, counts, strict=True)
    ]
    examples = [
        {
            **point_of(coords, point),
            "from": _outcome_name(int(left[tuple(point)]), a.attrs),
            "to": _outcome_name(int(right[tuple(point)]), b.attrs),
        }
        for point in np.argwhere(differs)[:MAX_LISTED]
    ]
    return {
        "changed": int(np.count_nonzero(differs)),
        "unchanged": int(np.count_nonzero(~differs & ~unknown)),
        "unknown": int(np.count_nonzero(unknown)),
        "changes": sorted(changes, key=lambda change: -change["points"]),
        "at": examples,
    }


def _probabilities(a: Results, b: Results, places: dict[str, tuple[Array, Array]]) -> Answer | None:
    """The comparison of two results with samples, equal or not: the number of operating
    ``points``; of how many samples at them every run is known, failed or pending in ``a``
    and in ``b``, as plain data of :class:`nsdrill.analysis.counts.Counts`; and for each
    outcome the number of points at which both ``known`` it of some sample, the mean
    probability there in ``a`` and in ``b``, the ``largest`` change, b less a, with its
    place ``at`` (None where there are no such points), and the number of all points at
    which their 95 % intervals lie ``apart``. What is safe is the class of the point. None
    where they cannot be compared."""
    if any(SAMPLE not in data.coords or not {"status", "response"} <= data.variables.keys() for data in (a, b)):
        return None
    axes = [name for name in places if name not in ("procedure", SAMPLE)]
    points = int(np.prod([len(places[name][0]) for name in axes]))
    if not points or a.axes != b.axes or "start" in places:
        return None
    if not np.array_equal(a.coords["procedure"], b.coords["procedure"]):
        return None
    try:
        probabilities = [probabilities_of(data) for data in (a, b)]
    except InputError:  # a part of a design of which only the whole gives a probability
        return None
    if probabilities[0].outcomes != probabilities[1].outcomes:
        return None
    coords = {name: a.coords[name][places[name][0]] for name in axes}
    selections = [np.ix_(*(places[axis][side] for axis in axes)) for side in (0, 1)]
    rows = []
    for name in probabilities[0].outcomes:
        (in_a, *interval_a), (in_b, *interval_b) = (
            [part[selection] for part in one.of(name)] for one, selection in zip(probabilities, selections, strict=True)
        )
        change = in_b - in_a
        in_both = np.isfinite(change)
        row: Answer = {"name": name, "known": int(np.count_nonzero(in_both))}
        row |= dict.fromkeys(("a", "b", "largest", "at"))
        if in_both.any():
            place = np.unravel_index(int(np.nanargmax(np.abs(change))), change.shape)
            row |= {"a": float(in_a[in_both].mean()), "b": float(in_b[in_both].mean())}
            row |= {"largest": float(change[place]), "at": point_of(coords, [int(i) for i in place])}
        apart = (interval_a[1] < interval_b[0]) | (interval_b[1] < interval_a[0])
        rows.append(row | {"apart": int(np.count_nonzero(apart))})
    counts = [
        one.runs.each(lambda part, selection=selection: np.asarray(part[-1][selection].sum())).at()  # type: ignore[misc]
        for one, selection in zip(probabilities, selections, strict=True)
    ]
    return {"points": points, "a": counts[0], "b": counts[1], "outcomes": rows}


def _outcomes(results: Results) -> Array:
    """The outcome of every run: its response, or what became of it where none is known."""
    status, is_known = results["status"].astype(int), known_runs(results)
    not_known = np.where(known(status), _NOT_CARRIED, _STATUS_OFFSET + status)
    return np.where(is_known, results["response"].astype(int), not_known)


def _outcome_name(outcome: int, attrs: Attributes) -> str:
    if outcome < _NOT_CARRIED:
        return response_text(outcome, attrs)
    if outcome == _NOT_CARRIED:
        return "not known"
    return (BY_NAME["status"].flag_meanings or "").split()[outcome - _STATUS_OFFSET]


# Whether two files describe the same string, as pictures that are drawn over one
# another must.


# Sections that change no equation. The operating point is compared by its values.
NO_EQUATION = (
    "title",
    "sweep",
    "simulation",
    "classify",
    "record",
    "initial",
    "continue",
    "uncertain",
    "ramps",
    "operation",
)
RELATIVE_TOLERANCE = 1e-9


def string_differences(first: Resolved, second: Resolved, free: Collection[str] = ()) -> list[Change]:
    """(key, value in the first, value in the second), in SI, of the numbers and choices
    of the string in which two resolved studies differ beyond rounding, except for the
    keys that are ``free`` and those that neither reads, as of a frozen motion. A key that
    only one of them has belongs to another version, or to a part that the other does not
    have, which then differs in another key."""
    unread = _unread(first) & _unread(second)
    first, second = dict(flat(first)), dict(flat(second))
    return [
        (key, first[key], value)
        for key, value in second.items()
        if key.partition(".")[0] not in NO_EQUATION
        and key not in free
        and key not in unread
        and key in first
        and not _is_equal(first[key], value)
    ]


def _unread(study: Resolved) -> frozenset[str]:
    """The keys of a resolved study that its string does not read; none where it is not
    one of this version."""
    parameters = described(study.get("model") or MODEL).parameters()
    sections = {one.name: study[one.name] for one in fields(parameters) if one.name in study}
    given = {key: value for key, value in flat(sections) if not isinstance(value, list)}
    with suppress(AttributeError):
        return frozenset(with_values(parameters, given).unread)
    return frozenset()


def other_string(
    branches: Attributes, sweep: Results, fixed: Mapping[str, float], free: Collection[str] = ()
) -> list[Change]:
    """(key, value of the branches, value of the sweep), in SI, of the differences
    between a file of ``branches`` with these root attributes and a ``sweep``. ``fixed``
    are the operating values of the branches by their names; the axes of the sweep and
    the keys that are ``free`` may differ."""
    swept = {*free, *(axis.key for axis in sweep.more)}
    differences = string_differences(resolved_study(branches), resolved_study(sweep.attrs), swept)
    for name, value in fixed.items():
        held = sweep.coords[name].tolist() if name in sweep.coords and name not in free else []
        if len(held) == 1 and not _is_equal(value, held[0]):
            differences.append((f"operation.{name}", value, held[0]))
    return differences


def _is_equal(one: object, other: object) -> bool:
    if isinstance(one, bool) or isinstance(other, bool):
        return one == other
    if isinstance(one, int | float) and isinstance(other, int | float):
        return math.isclose(one, other, rel_tol=RELATIVE_TOLERANCE)
    return one == other
