"""Areas over two axes for a page: where it is safe, how probable that is, what the
checks say, and basins of starts.

Each is a title with a reply in the form of :func:`nsdrill.web.diagrams.plane`: column
``values`` [1, y, x], with ``outcome`` alike.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from nsdrill.analysis.outcome import outcome, text
from nsdrill.analysis.probability import EVERY, SAFE, Chances, chances
from nsdrill.analysis.window import CRITICAL, HISTORY_DEPENDENT, UNKNOWN, classes
from nsdrill.analysis.window import SAFE as SAFE_STATE
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.models.registry import model_in
from nsdrill.models.starts import Starts, slice_values
from nsdrill.observe.trust import (
    AGREES,
    CHECK_FAILED,
    FEATURES_DIFFER,
    RESPONSE_DIFFERS,
    UNCHECKED,
    verdict,
)
from nsdrill.plot.labels import quantity
from nsdrill.plot.slices import edges
from nsdrill.plot.style import GREY, ORANGE, SKY, VERMILLION, WINE
from nsdrill.variables import RESPONSES
from nsdrill.web.diagrams import Reply, axis_of
from nsdrill.web.shown import response_styles, told

Titled = tuple[str, Reply]
MOST = 4  # maps of a third axis

WINDOW = {  # the colours of the pictures (nsdrill.plot.kinds.window); white is what is not known
    UNKNOWN: ("not known", "#FFFFFF"),
    CRITICAL: ("critical", "#6E6E6E"),
    HISTORY_DEPENDENT: ("depends on the history", "#E69F00"),
    SAFE_STATE: ("safe", "#D3ECFA"),
}
VERDICTS = {
    UNCHECKED: ("not checked", GREY),
    AGREES: ("checks agree", SKY),
    FEATURES_DIFFER: ("response holds, numbers differ", ORANGE),
    RESPONSE_DIFFERS: ("response differs", VERMILLION),
    CHECK_FAILED: ("a check failed", WINE),
}


def window_areas(results: Results, units: str) -> Iterator[Titled]:
    """Safe, dependent on the history and critical over the axes of a window, for each
    of up to four values of a third axis; nothing where there are not two or three
    axes."""
    try:
        found = classes(results)
    except InputError:
        return
    if found.y is None or len(results.swept) > 3:
        return
    x, y = (axis_of(results, axis, units) for axis in (found.x, found.y))
    names = {state - UNKNOWN: words for state, words in WINDOW.items()}
    for number in chosen(len(found.state)):
        where = ""
        if found.third:
            one = quantity(found.third, units)
            where = f", {one.words.lower()} {one.value(float(found.values(found.third)[number]))}"
        yield f"Safe window{where}", _area(x, y, found.state[number] - UNKNOWN, "Window", names)


def verdict_areas(results: Results, units: str, x: str, y: str) -> Iterator[Titled]:
    """What the checks of each point say, over two axes, for each procedure; nothing
    where there were none."""
    if "trusted" not in results.variables or len(results.swept) != 2:
        return
    verdicts = verdict(results)
    across, up = (axis_of(results, axis, units) for axis in (x, y))
    names = [text(name) for name in results.coords["procedure"]]
    for number, name in enumerate(names):
        plane = _turned(results, verdicts[number], x, y)
        yield (
            f"Checks{f', {name}' if len(names) > 1 else ''}",
            _area(across, up, plane, "Checks", VERDICTS),
        )


def probability_areas(results: Results, units: str, x: str, y: str) -> Iterator[Titled]:
    """How probable a safe run and each response that occurs are, over two axes, in
    percent; whatever the history."""
    found = chances(results, responses=model_in(results.attrs).responses)
    across, up = (axis_of(results, axis, units) for axis in (x, y))
    for name, words in outcomes_of(found):
        share = _turned(results, 100.0 * found.of(name)[0], x, y)
        head, columns = _area(across, up, share, f"Probability: {words}", None)
        head["colour"] |= {"unit": "%"}
        head["limits"] = [0.0, 100.0]
        yield f"Probability: {words}", (head, columns)


def probability_lines(results: Results, units: str, x: str) -> Reply:
    """How probable a safe run and each response that occurs are along one axis, in
    percent: a line for each."""
    found = chances(results, responses=model_in(results.attrs).responses)
    named = outcomes_of(found)
    codes = [0 if name == SAFE else 1 << RESPONSES.index(name) for name, _ in named]
    values = np.stack([100.0 * found.of(name)[0].ravel() for name, _ in named])
    borders = edges(results.coords[x]) / quantity(x, units).scale
    head = {
        "x": axis_of(results, x, units),
        "y": _named("Probability", "%"),
        "head_told": [],
        "hysteresis": [],
        "procedures": [words for _, words in named],
        "lines": [],
        "edges": [borders[0], borders[-1]],
    }
    return head, {
        "values": values[..., np.newaxis],
        "outcome": np.broadcast_to(np.array(codes)[:, np.newaxis], values.shape),
        "still": np.zeros(values.shape, bool),
    }


def outcomes_of(found: Chances) -> list[tuple[str, str]]:
    """The outcomes that occur, safe first, each with its words."""
    often = ", whatever the history" if EVERY in found.histories else ""
    return [(SAFE, f"safe{often}")] + [
        (name, f"{name.replace('_', '-')}{' in any procedure' if often else ''}")
        for name in found.outcomes
        if name != SAFE and found.of(name)[0].any()
    ]


def basin_area(results: Results, units: str) -> Titled:
    """Which response each start of a slice comes to, of one operating point."""
    (across, x), (up, y) = slice_values(
        Starts(slice=results.slice), tuple(results["state"].tolist())
    ).items()
    codes = outcome(results["status"], results["response"]).reshape(-1, len(x), len(y))[0].T
    styles = {code: (one["name"], one["colour"]) for code, one in enumerate(response_styles())}
    axes = [
        {**told(name, units), "values": values / quantity(name, units).scale, "log": False}
        for name, values in ((across, x), (up, y))
    ]
    return "Response by the start", _area(axes[0], axes[1], codes, "Response", styles)


def chosen(count: int) -> list[int]:
    """Up to :data:`MOST` of so many numbers, evenly, the first and the last among
    them."""
    if count <= MOST:
        return list(range(count))
    return [round(number * (count - 1) / (MOST - 1)) for number in range(MOST)]


def _turned(results: Results, values: Array, x: str, y: str) -> Array:
    """``values`` [axes] over the two axes that are swept, as [y, x]."""
    plane = values.reshape([len(results.coords[name]) for name in results.axes if name in (x, y)])
    return plane.T if results.axes.index(x) < results.axes.index(y) else plane


def _named(words: str, unit: str = "") -> dict[str, Any]:
    """What a page knows of a number that is no variable of a file."""
    label = f"{words} [{unit}]" if unit else words
    return {
        "name": words,
        "words": words,
        "unit": unit,
        "label": label,
        "scale": 1.0,
        "long": words,
    }


def _area(
    x: Mapping[str, Any],
    y: Mapping[str, Any],
    values: Array,
    words: str,
    named: Mapping[int, tuple[str, str]] | None,
) -> Reply:
    """``values`` [y, x] as a map: classes with their words and colours, or numbers."""
    failed = values < 0 if named else np.zeros(values.shape, bool)
    head = {
        "x": dict(x),
        "y": dict(y),
        "colour": _named(words),
        "procedures": [""],
        "place": None,
        "x_edges": edges(np.asarray(x["values"])),
        "y_edges": edges(np.asarray(y["values"])),
        "classes": [{"name": of, "colour": colour} for of, colour in _in_order(named)]
        if named
        else None,
        "limits": None,
    }
    shown = np.where(failed, np.nan, values.astype(float))
    return head, {
        "values": shown[np.newaxis],
        "outcome": np.where(failed, values, 0)[np.newaxis].astype(int),
    }


def _in_order(named: Mapping[int, tuple[str, str]]) -> Sequence[tuple[str, str]]:
    return [named[code] for code in range(len(named))]
