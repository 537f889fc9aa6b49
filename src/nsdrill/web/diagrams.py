"""Diagrams and maps of a sweep for a page: the choices, and the numbers of one drawing
in the units that are shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from nsdrill.analysis.hysteresis import differences, spans
from nsdrill.analysis.planes import axes_of
from nsdrill.analysis.safety import known_outcome
from nsdrill.data import Answer, Array, Results
from nsdrill.errors import InputError
from nsdrill.figures.panels import says_nothing
from nsdrill.figures.picture_kinds import longest
from nsdrill.figures.slices import Line, edges, is_logarithmic, positions, robust_limits
from nsdrill.models.registry import drawn_in, model_in, named_in
from nsdrill.models.responses import STALLED
from nsdrill.variables import INFERRED, OK, POINT
from nsdrill.web.shown import classes, quantity_data, response_styles
from nsdrill.words.labels import quantity, way_word

MAX_HOVER_POINTS = 20_000  # of a diagram; a page with more has no features at the pointer
MAX_CELLS = 1_000_000
Reply = tuple[Answer, dict[str, Array]]


def choices(results: Results, units: str) -> Answer:
    """What can be drawn of a sweep: ``axes``, ``panels`` of peaks, single ``features``,
    and ``labels`` for maps, whose ``map_axes`` are those along x and along y first."""
    drawn, variables = drawn_in(results.attrs), results.variables
    named = named_in(results.attrs)
    panels = [panel for panel in drawn.panels if panel.greatest in variables]
    single = [name for name in variables if (v := named.get(name)) and v.dims == POINT and v.dtype == "f8"]
    labels = ["response", *(n for n in variables if (v := named.get(n)) and v.origin == "label" and v.flag_meanings)]
    return {
        "axes": [axis_data(results, name, units) for name in results.swept],
        "map_axes": map_axes(results),
        **_histories(results),
        "members": {"name": member_dimension(results), "count": len(results.coords[name])}
        if (name := member_dimension(results))
        else None,
        "panels": [{**quantity_data(panel.peaks, units), "mode": panel.mode, "trace": panel.trace} for panel in panels],
        # those of a summary first
        "features": [quantity_data(n, units) for n in dict.fromkeys([*drawn.summary, *single]) if n in single],
        "labels": [quantity_data(name, units) for name in dict.fromkeys(labels)],
        "dimensions": len(results.grid),
    }


def _histories(results: Results) -> Answer:
    """The procedures of a sweep, and the words for them."""
    return {
        "procedures": list(results.procedures),
        "ways": [way_word(procedure, results.attrs) for procedure in results.procedures],
    }


def map_axes(results: Results) -> list[str]:
    """The swept axes in the order in which the window takes them, that along x first."""
    return list(dict.fromkeys([*filter(None, axes_of(results) or ()), *results.swept]))


def member_dimension(results: Results) -> str | None:
    """The dimension besides procedure and axes, for example the starts of every point;
    None where there is none."""
    return next((name for name in results.grid[1:] if name not in results.axes), None)


def axis_data(results: Results, name: str, units: str) -> Answer:
    """An axis as plain data: its quantity, its position among the dimensions, and its
    values in the unit that is shown."""
    values, shown = positions(results, name), quantity(name, units)
    keys = {axis.name: axis.key for axis in results.more}
    texts = [shown.value(value) for value in results.coords[name]] if shown.choices else None
    return {
        **quantity_data(name, units),
        "key": keys.get(name, name),
        "dimension": results.grid.index(name),
        "values": values / shown.scale,
        "log": is_logarithmic(values),
        "texts": texts,
    }


def diagram(
    results: Results, units: str, y: str, x: str | None = None, held: Mapping[str, int] | None = None, member: int = 0
) -> Reply:
    """Peaks or a feature ``y`` along the axis ``x``, the other axes ``held`` at the
    values with these indices (0 where not given).

    Columns:

    * ``values`` [procedure, point, peak]: NaN where a point has fewer peaks;
    * ``outcome`` [procedure, point]: the bits of the response, negative where there is
      none;
    * ``constant`` [procedure, point]: 1 where a motion has no peaks, so that the first
      of its ``values`` is its constant value;
    * ``hover`` [procedure, point, feature]: the values of ``hover_quantities``, only of
      small diagrams.

    The head has the ``place`` of the first point among the dimensions, and the
    ``dimension`` along which the points lie."""
    drawn = drawn_in(results.attrs)
    axis = x or longest(results)
    if axis not in results.axes:
        raise InputError(f"x: found {axis}; allowed: {', '.join(results.swept)}.")
    place = place_of(results, held or {}, member)
    series = _data_line(results, axis, place)
    panel = next((p for p in drawn.panels if p.peaks == y), None)
    name = panel.greatest if panel and y not in results.variables else y
    named = named_in(results.attrs)
    if name not in results.variables or named[name].dtype != "f8":
        names = [p.peaks for p in drawn.panels]
        names += [one for one in results.variables if one in named and named[one].dtype == "f8"]
        listed = ", ".join(dict.fromkeys(names))
        raise InputError(f"y: found {y}; allowed: what a panel or a feature of these results is called, {listed}.")
    values, constant = _peaks(series, name, panel.greatest if panel else None)
    outcomes = series.outcome
    x_edges = edges(series.x) / quantity(axis, units).scale
    names = [n for n in model_in(results.attrs).shown if n in results.variables]
    if values.shape[0] * values.shape[1] > MAX_HOVER_POINTS:
        names = []
    head = {
        "x": axis_data(results, axis, units),
        "y": quantity_data(y, units),
        **_histories(results),
        "hover_quantities": [quantity_data(n, units) for n in names],
        "place": place,
        "dimension": results.grid.index(axis),
        "hysteresis": [
            [x_edges[first], x_edges[last + 1]] for first, last in spans(differences(series.procedures, outcomes))
        ],
        "lines": _reference_lines(results, series, panel.mode if panel else None, axis, units),
        "edges": [x_edges[0], x_edges[-1]],
        "inferred": _inferred_words(series["status"]),
    }
    scales = np.array([quantity(n, units).scale for n in names])
    columns = {"values": values / quantity(y, units).scale, "outcome": outcomes, "constant": constant}
    if names:
        columns["hover"] = np.stack([np.asarray(series[n], dtype=float) for n in names], axis=-1) / scales
    return head, columns


def _peaks(series: Line, name: str, greatest: str | None) -> tuple[Array, Array]:
    """The values [procedure, point, peak] of a variable, and where a motion is constant: it
    has no peaks and is drawn at its ``greatest`` value."""
    values = np.array(series[name], dtype=float)
    values = values[..., np.newaxis] if values.ndim == 2 else values
    if greatest is None or values.shape[2] == 1:
        return values, np.zeros(values.shape[:2], bool)
    constant = np.asarray(~np.isfinite(values).any(axis=2))
    values[..., 0] = np.where(constant, series[greatest], values[..., 0])
    return values, constant


def _reference_lines(results: Results, series: Line, mode: str | None, axis: str, units: str) -> list[Answer]:
    """The rotary speed and the wall of the hole, as the pictures draw them."""
    gap = results.attrs.get("gap")
    if mode == "lateral" and gap is not None:
        height = float(gap) / quantity(drawn_in(results.attrs).radius, units).scale
        return [{"words": "wall of the hole", "y": [height, height]}]
    if mode != "torsional" or "rotary_speed" not in results.axes:
        return []
    scale = quantity("rotary_speed", units).scale
    place = series.place[1 + results.axes.index("rotary_speed")]
    speeds = results.coords["rotary_speed"] / scale
    ends = [speeds[0], speeds[-1]] if axis == "rotary_speed" else [speeds[place if isinstance(place, int) else 0]] * 2
    return [{"words": "rotary speed", "y": [float(value) for value in ends]}]


def plane(
    results: Results, units: str, colour: str, x: str, y: str, held: Mapping[str, int] | None = None, member: int = 0
) -> Reply:
    """The label or feature ``colour`` over two axes: column ``values``
    [procedure, y, x], and ``outcome`` of the same shape. A value that says nothing, as
    the bit is stalled, is NaN; the head has the style of these cells, ``silent``."""
    if x == y or x not in results.axes or y not in results.axes:
        raise InputError(f"x, y: found {x}, {y}; allowed: two of {', '.join(results.swept)}.")
    variable = named_in(results.attrs).get(colour)
    if variable is None or colour not in results.variables or variable.dims != POINT:
        raise InputError(f"colour: found {colour}; allowed: a label or a feature of these results.")
    place = place_of(results, held or {}, member)
    index: list[int | slice] = [slice(None), *place[1:]]
    for axis in (x, y):
        index[results.grid.index(axis)] = slice(None)
    transposed = results.axes.index(x) < results.axes.index(y)

    def placed(array: Array) -> Array:
        values = np.asarray(array)[tuple(index)]
        return np.swapaxes(values, 1, 2) if transposed else values

    values, outcomes = placed(results[colour]).astype(float), placed(known_outcome(results))
    if values.size > MAX_CELLS:
        raise InputError(f"The map has {values.size} cells; allowed: {MAX_CELLS}. Use nsdrill plot.")
    is_label = variable.origin == "label"
    stands = says_nothing(colour, placed(results["response"]).astype(int), results.attrs) & (outcomes >= 0)
    values = np.where(stands, np.nan, values)
    if not is_label:
        values = values / quantity(colour, units).scale
        low, high = robust_limits(values)
    elif colour != "response":
        values = np.where(placed(results["status"]) == OK, values, np.nan)
    x_values, y_values = (positions(results, axis) for axis in (x, y))
    head = {
        "x": axis_data(results, x, units),
        "y": axis_data(results, y, units),
        "colour": quantity_data(colour, units),
        **_histories(results),
        "place": place,
        "x_edges": edges(x_values) / quantity(x, units).scale,
        "y_edges": edges(y_values) / quantity(y, units).scale,
        "classes": classes(colour, results.attrs) if is_label else None,
        "limits": None if is_label else [low, high],
        "silent": response_styles(results.attrs)[STALLED] if stands.any() else None,
        "inferred": _inferred_words(placed(results["status"])),
    }
    return head, {"values": np.where(outcomes < 0, np.nan, values), "outcome": outcomes}


def _inferred_words(status: Array) -> str:
    """How many of the points that are drawn were not run; empty where all were."""
    inferred = int(np.count_nonzero(status == INFERRED))
    return f"inferred from the points around, not run: {inferred} of {status.size}" if inferred else ""


def place_of(results: Results, held: Mapping[str, int], member: int) -> list[int]:
    """The index of a point in every dimension, in the first procedure."""
    indices = dict(held)
    if name := member_dimension(results):
        indices[name] = member
    place = [0]
    for name in results.grid[1:]:
        count, number = len(results.coords[name]), indices.get(name, 0)
        if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number < count:
            raise InputError(f"{name}: found number {number}; allowed: 0 to {count - 1}.")
        place.append(number)
    return place


def _data_line(results: Results, axis: str, place: Sequence[int]) -> Line:
    if member_dimension(results) is None:
        return Line.along(results, axis, "si", **dict(zip(results.axes, place[1:], strict=True)))
    index: list[int | slice] = [slice(None), *place[1:]]
    index[results.grid.index(axis)] = slice(None)
    return Line(results, axis, tuple(index))
