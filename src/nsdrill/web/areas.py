"""Maps over two axes for a page: the operating window, probabilities, the verdicts of the
checks, and basins of attraction.

Each is a title with a reply in the form of :func:`nsdrill.web.diagrams.plane`: column
``values`` [1, y, x], and ``outcome`` of the same shape.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from nsdrill.analysis.outcome import outcome, text
from nsdrill.analysis.probability import EVERY, SAFE, Probabilities, probabilities_of
from nsdrill.analysis.window import CRITICAL, HISTORY_DEPENDENT, classes
from nsdrill.analysis.window import SAFE as SAFE_STATE
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.models.registry import model_in
from nsdrill.models.starts import Starts, slice_values
from nsdrill.observe.trust import AGREES, CHECK_FAILED, FEATURES_DIFFER, RESPONSE_DIFFERS, UNCHECKED, verdict
from nsdrill.plot.labels import quantity
from nsdrill.plot.slices import edges
from nsdrill.plot.style import BAD_TO_GOOD, GREY, SAFE_COLOUR
from nsdrill.plot.style import RESPONSES as RESPONSE_STYLES
from nsdrill.variables import RESPONSES
from nsdrill.web.diagrams import Reply, axis_data
from nsdrill.web.shown import quantity_data, response_styles

TitledReply = tuple[str, Reply]
MAX_MAPS = 4  # over a third axis

# The areas of a window as in its picture: critical ones in the colour of their response,
# those that depend on the history striped with it over the colour of safe.
SAFE_CODE, UNKNOWN_CODE = 2 * len(RESPONSE_STYLES), 2 * len(RESPONSE_STYLES) + 1
WINDOW_CLASSES: dict[int, tuple[str, ...]] = {
    **{
        code: (style.name, style.colour) if code else ("critical by severity", BAD_TO_GOOD[0])
        for code, style in enumerate(RESPONSE_STYLES)
    },
    **{
        len(RESPONSE_STYLES) + code: (
            f"{style.name}, by the history" if code else "by the history",
            SAFE_COLOUR,
            style.colour if code else BAD_TO_GOOD[0],
        )
        for code, style in enumerate(RESPONSE_STYLES)
    },
    SAFE_CODE: ("safe", SAFE_COLOUR),
    UNKNOWN_CODE: ("not known", GREY),
}
# None of the colours is that of a response: a check that agrees is not a safe point.
VERDICT_CLASSES = {
    UNCHECKED: ("not checked", GREY),
    AGREES: ("checks agree", "#DDE6F0"),
    FEATURES_DIFFER: ("response holds, numbers differ", "#8899BB"),
    RESPONSE_DIFFERS: ("response differs", "#223366"),
    CHECK_FAILED: ("a check failed", "#000000"),
}


def window_areas(results: Results, units: str, thirds: Sequence[int] | None = None) -> Iterator[TitledReply]:
    """Safe, dependent on the history and critical over the axes of a window, for each
    of up to four values of a third axis, or for those with the numbers ``thirds``;
    nothing where there are not two or three axes."""
    try:
        window = classes(results)
    except InputError:
        return
    if window.y is None or len(results.swept) > 3:
        return
    x, y = (axis_data(results, axis, units) for axis in (window.x, window.y))
    for number in evenly_spaced(len(window.state)) if thirds is None else thirds:
        where = ""
        if window.third:
            third = quantity(window.third, units)
            value = third.value(float(window.values(window.third)[number]))
            where = f", {third.words.lower()} {value}"
        codes = window_codes(window.state[number], window.bits[number])
        yield f"Operating window{where}", _area(x, y, codes, "Window", WINDOW_CLASSES)


def window_codes(state: Array, bits: Array) -> Array:
    """The class of each point of a window among :data:`WINDOW_CLASSES`."""
    code = np.select(
        [state == CRITICAL, state == HISTORY_DEPENDENT, state == SAFE_STATE],
        [bits, len(RESPONSE_STYLES) + bits, SAFE_CODE],
        UNKNOWN_CODE,
    )
    return np.asarray(code)


def verdict_areas(results: Results, units: str, x: str, y: str) -> Iterator[TitledReply]:
    """The verdict of the checks at each point over two axes, for each procedure;
    nothing where no point was checked."""
    if "trusted" not in results.variables or len(results.swept) != 2:
        return
    verdicts = verdict(results)
    x_axis, y_axis = (axis_data(results, axis, units) for axis in (x, y))
    names = [text(name) for name in results.coords["procedure"]]
    for number, name in enumerate(names):
        plane = _as_plane(results, verdicts[number], x, y)
        yield (
            f"Checks{f', {name}' if len(names) > 1 else ''}",
            _area(x_axis, y_axis, plane, "Checks", VERDICT_CLASSES),
        )


def probability_areas(results: Results, units: str, x: str, y: str) -> Iterator[TitledReply]:
    """The probabilities, in percent, of a safe run and of each response that occurs,
    over two axes and whatever the history."""
    probabilities = probabilities_of(results, responses=model_in(results.attrs).responses)
    x_axis, y_axis = (axis_data(results, axis, units) for axis in (x, y))
    for name, words in occurring_outcomes(probabilities):
        share = _as_plane(results, 100.0 * probabilities.of(name)[0], x, y)
        head, columns = _area(x_axis, y_axis, share, f"Probability: {words}", None)
        head["colour"] |= {"unit": "%"}
        head["limits"] = [0.0, 100.0]
        head["scale"] = BAD_TO_GOOD if name == SAFE else BAD_TO_GOOD[::-1]
        yield f"Probability: {words}", (head, columns)


def probability_lines(results: Results, units: str, x: str) -> Reply:
    """The probabilities, in percent, of a safe run and of each response that occurs
    along one axis: a line for each."""
    probabilities = probabilities_of(results, responses=model_in(results.attrs).responses)
    outcomes = occurring_outcomes(probabilities)
    codes = [0 if name == SAFE else 1 << RESPONSES.index(name) for name, _ in outcomes]
    values = np.stack([100.0 * probabilities.of(name)[0].ravel() for name, _ in outcomes])
    x_edges = edges(results.coords[x]) / quantity(x, units).scale
    head = {
        "x": axis_data(results, x, units),
        "y": _plain_quantity("Probability", "%"),
        "hover_quantities": [],
        "hysteresis": [],
        "procedures": [words for _, words in outcomes],
        "lines": [],
        "edges": [x_edges[0], x_edges[-1]],
    }
    return head, {
        "values": values[..., np.newaxis],
        "outcome": np.broadcast_to(np.array(codes)[:, np.newaxis], values.shape),
        "constant": np.zeros(values.shape, bool),
    }


def occurring_outcomes(probabilities: Probabilities) -> list[tuple[str, str]]:
    """The outcomes that occur, safe first, each with its words."""
    suffix = ", whatever the history" if EVERY in probabilities.histories else ""
    return [(SAFE, f"safe{suffix}")] + [
        (name, f"{name.replace('_', '-')}{' in any procedure' if suffix else ''}")
        for name in probabilities.outcomes
        if name != SAFE and probabilities.of(name)[0].any()
    ]


def basin_area(results: Results, units: str) -> TitledReply:
    """The response that each start of a slice leads to, at one operating point."""
    (x_name, x), (y_name, y) = slice_values(Starts(slice=results.slice), tuple(results["state"].tolist())).items()
    codes = outcome(results["status"], results["response"]).reshape(-1, len(x), len(y))[0].T
    styles = {code: (style["name"], style["colour"]) for code, style in enumerate(response_styles())}
    axes = [
        {**quantity_data(name, units), "values": values / quantity(name, units).scale, "log": False}
        for name, values in ((x_name, x), (y_name, y))
    ]
    return "Response by the start", _area(axes[0], axes[1], codes, "Response", styles)


def evenly_spaced(count: int) -> list[int]:
    """Up to :data:`MAX_MAPS` of the indices below ``count``, evenly spaced, with the
    first and the last."""
    if count <= MAX_MAPS:
        return list(range(count))
    return [round(number * (count - 1) / (MAX_MAPS - 1)) for number in range(MAX_MAPS)]


def _as_plane(results: Results, values: Array, x: str, y: str) -> Array:
    """``values`` [axes] over the two axes that are swept, as [y, x]."""
    plane = values.reshape([len(results.coords[name]) for name in results.axes if name in (x, y)])
    return plane.T if results.axes.index(x) < results.axes.index(y) else plane


def _plain_quantity(words: str, unit: str = "") -> dict[str, Any]:
    """The data of a quantity that is no variable of a file, in the form of
    :func:`nsdrill.web.shown.quantity_data`."""
    label = f"{words} [{unit}]" if unit else words
    return {"name": words, "words": words, "unit": unit, "label": label, "scale": 1.0, "long": words}


def _area(
    x: Mapping[str, Any], y: Mapping[str, Any], values: Array, words: str, styles: Mapping[int, tuple[str, ...]] | None
) -> Reply:
    """``values`` [y, x] as a map: of classes, whose names, colours and stripes
    ``styles`` gives, or of numbers."""
    failed = values < 0 if styles else np.zeros(values.shape, bool)
    head = {
        "x": dict(x),
        "y": dict(y),
        "colour": _plain_quantity(words),
        "procedures": [""],
        "place": None,
        "x_edges": edges(np.asarray(x["values"])),
        "y_edges": edges(np.asarray(y["values"])),
        "classes": [dict(zip(("name", "colour", "stripes"), style, strict=False)) for style in _in_order(styles)]
        if styles
        else None,
        "limits": None,
    }
    shown = np.where(failed, np.nan, values.astype(float))
    return head, {"values": shown[np.newaxis], "outcome": np.where(failed, values, 0)[np.newaxis].astype(int)}


def _in_order(styles: Mapping[int, tuple[str, ...]]) -> Sequence[tuple[str, ...]]:
    return [styles[code] for code in range(len(styles))]
