"""Diagrams and maps of a sweep for a page: which there are, and the numbers of one, in
the units that are shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nsdrill.analysis.hysteresis import differences, spans
from nsdrill.analysis.outcome import text
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.models.leaves import words_along
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.plot.labels import quantity
from nsdrill.plot.slices import Line, edges, is_logarithmic, line, positions, robust_limits
from nsdrill.variables import OK, POINT
from nsdrill.web.shown import classes, response_styles, told

MOST_TOLD = 20_000  # points of a diagram of which a page holds the features, to tell them at once
MOST_CELLS = 1_000_000
Reply = tuple[dict[str, Any], dict[str, Array]]


def choices(results: Results, units: str) -> dict[str, Any]:
    """What can be drawn of a sweep: ``axes``, ``panels`` of peaks, single ``features``,
    and ``labels`` for maps."""
    drawn, there = drawn_in(results.attrs), results.variables
    panels = [one for one in drawn.panels if one.greatest in there]
    single = [
        name for name in there if (v := BY_NAME.get(name)) and v.dims == POINT and v.dtype == "f8"
    ]
    labels = [
        "response",
        *(n for n in there if (v := BY_NAME.get(n)) and v.room == "label" and v.flag_meanings),
    ]
    return {
        "axes": [axis_of(results, name, units) for name in results.swept],
        "procedures": [text(name) for name in results.coords["procedure"]],
        "members": {"name": members(results), "count": len(results.coords[name])}
        if (name := members(results))
        else None,
        "panels": [
            {**told(one.peaks, units), "mode": one.mode, "trace": one.trace} for one in panels
        ],
        "features": [told(name, units) for name in _first(drawn.summary, single)],
        "labels": [told(name, units) for name in dict.fromkeys(labels)],
        "responses": response_styles(),
        "dimensions": len(results.grid),
    }


def members(results: Results) -> str | None:
    """The dimension beside procedure and axes, the starts of every point say; None
    where there is none."""
    return next((name for name in results.grid[1:] if name not in results.axes), None)


def _first(chosen: Sequence[str], names: Sequence[str]) -> list[str]:
    return [
        *(name for name in chosen if name in names),
        *(name for name in names if name not in chosen),
    ]


def axis_of(results: Results, name: str, units: str) -> dict[str, Any]:
    """An axis as a page knows it: words and units, its place among the dimensions, and
    its values as they are shown."""
    values, one = positions(results, name), quantity(name, units)
    keys = {axis.name: axis.key for axis in results.more}
    texts = [one.value(value) for value in results.coords[name]] if one.choices else None
    return {
        **told(name, units),
        "key": keys.get(name, name),
        "dimension": results.grid.index(name),
        "values": values / one.scale,
        "log": is_logarithmic(values),
        "texts": texts,
    }


def diagram(
    results: Results,
    units: str,
    y: str,
    x: str | None = None,
    held: Mapping[str, int] | None = None,
    member: int = 0,
) -> Reply:
    """Peaks or a feature ``y`` along the axis ``x``, the other axes ``held`` at these
    of their values (0 where not given).

    Columns: ``values`` [procedure, point, peak], NaN where fewer; ``outcome``
    [procedure, point], the bits of the response, negative where there is none; ``told``
    [procedure, point, feature], of small diagrams. The head has the ``place`` of the
    first point among the dimensions, and along which of them the points lie."""
    drawn = drawn_in(results.attrs)
    axis = x or longest(results)
    if axis not in results.axes:
        raise InputError(f"x: found {axis}; allowed: {', '.join(results.swept)}.")
    place = _held(results, held or {}, member)
    one = _line(results, axis, place)
    panel = next((p for p in drawn.panels if p.peaks == y), None)
    name = panel.greatest if panel and y not in results.variables else y
    if name not in results.variables or BY_NAME[name].dtype != "f8":
        raise InputError(f"y: found {y}; allowed: peaks or a feature of these results.")
    shown = quantity(y, units)
    values = np.asarray(one[name], dtype=float)
    values = values[..., np.newaxis] if values.ndim == 2 else values
    still = np.zeros(values.shape[:2], bool)
    # a point that stands still has no peaks: its constant value
    if panel is not None and values.shape[2] > 1:
        still = ~np.isfinite(values).any(axis=2)
        values = values.copy()
        values[..., 0] = np.where(still, one[panel.greatest], values[..., 0])
    outcomes = one.outcome
    borders = edges(one.x) / quantity(axis, units).scale
    names = [n for n in model_in(results.attrs).shown if n in results.variables]
    if values.shape[0] * values.shape[1] > MOST_TOLD:
        names = []
    head = {
        "x": axis_of(results, axis, units),
        "y": told(y, units),
        "procedures": list(one.procedures),
        "head_told": [told(n, units) for n in names],
        "place": place,
        "dimension": results.grid.index(axis),
        "hysteresis": [
            [borders[first], borders[last + 1]]
            for first, last in spans(differences(one.procedures, outcomes))
        ],
        "lines": _lines(results, one, panel.mode if panel else None, axis, units),
        "edges": [borders[0], borders[-1]],
    }
    scales = np.array([quantity(n, units).scale for n in names])
    columns = {"values": values / shown.scale, "outcome": outcomes, "still": still}
    if names:
        columns["told"] = (
            np.stack([np.asarray(one[n], dtype=float) for n in names], axis=-1) / scales
        )
    return head, columns


def _lines(
    results: Results, one: Line, mode: str | None, axis: str, units: str
) -> list[dict[str, Any]]:
    """The set speed and the wall, where the pictures draw them."""
    gap = results.attrs.get("gap")
    if mode == "lateral" and gap is not None:
        height = float(gap) / quantity("radius_peaks", units).scale
        return [{"words": "wall of the hole", "y": [height, height]}]
    if mode != "torsional":
        return []
    scale = quantity("rotary_speed", units).scale
    place = one.place[1 + results.axes.index("rotary_speed")]
    speeds = results.coords["rotary_speed"] / scale
    ends = (
        [speeds[0], speeds[-1]]
        if axis == "rotary_speed"
        else [speeds[place if isinstance(place, int) else 0]] * 2
    )
    return [{"words": "set speed", "y": [float(value) for value in ends]}]


def plane(
    results: Results,
    units: str,
    colour: str,
    x: str,
    y: str,
    held: Mapping[str, int] | None = None,
    member: int = 0,
) -> Reply:
    """The label or feature ``colour`` over two axes: column ``values``
    [procedure, y, x], with ``outcome`` alike."""
    if x == y or x not in results.axes or y not in results.axes:
        raise InputError(f"x, y: found {x}, {y}; allowed: two of {', '.join(results.swept)}.")
    variable = BY_NAME.get(colour)
    if variable is None or colour not in results.variables or variable.dims != POINT:
        raise InputError(f"colour: found {colour}; allowed: a label or a feature of these results.")
    place = _held(results, held or {}, member)
    index: list[Any] = [slice(None), *place[1:]]
    for axis in (x, y):
        index[results.grid.index(axis)] = slice(None)
    turned = results.axes.index(x) < results.axes.index(y)

    def cut(name: str) -> Array:
        values = np.asarray(results[name])[tuple(index)]
        return np.swapaxes(values, 1, 2) if turned else values

    from nsdrill.analysis.outcome import outcome

    values, outcomes = cut(colour).astype(float), outcome(cut("status"), cut("response"))
    if values.size > MOST_CELLS:
        raise InputError(
            f"The map has {values.size} cells; allowed: {MOST_CELLS}. Use nsdrill plot."
        )
    is_label = variable.room == "label"
    if not is_label:
        values = values / quantity(colour, units).scale
        low, high = robust_limits(values)
    elif colour != "response":
        values = np.where(cut("status") == OK, values, np.nan)
    across, up = (positions(results, axis) for axis in (x, y))
    head = {
        "x": axis_of(results, x, units),
        "y": axis_of(results, y, units),
        "colour": told(colour, units),
        "procedures": [text(name) for name in results.coords["procedure"]],
        "place": place,
        "x_edges": edges(across) / quantity(x, units).scale,
        "y_edges": edges(up) / quantity(y, units).scale,
        "classes": response_styles()
        if colour == "response"
        else classes(colour)
        if is_label
        else None,
        "limits": None if is_label else [low, high],
    }
    return head, {"values": np.where(outcomes < 0, np.nan, values), "outcome": outcomes}


def longest(results: Results) -> str:
    """The axis with most values, as pictures take it: of numbers rather than words."""
    return max(
        results.swept or ["rotary_speed"],
        key=lambda name: (not words_along(name), len(results.coords[name])),
    )


def _held(results: Results, held: Mapping[str, int], member: int) -> list[int]:
    """The place of a point among the dimensions, the first procedure first."""
    wanted = dict(held)
    if name := members(results):
        wanted[name] = member
    place = [0]
    for name in results.grid[1:]:
        count, number = len(results.coords[name]), wanted.get(name, 0)
        if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < count:
            raise InputError(f"{name}: found number {number}; allowed: 0 to {count - 1}.")
        place.append(number)
    return place


def _line(results: Results, axis: str, place: Sequence[int]) -> Line:
    if members(results) is None:
        return line(results, axis, **dict(zip(results.axes, place[1:], strict=True)))
    index: list[Any] = [slice(None), *place[1:]]
    index[results.grid.index(axis)] = slice(None)
    return Line(results, axis, tuple(index))
