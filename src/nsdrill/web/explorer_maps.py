"""What an explorer opens on: the operating window with its border, the probabilities, or
the basins of a slice of starts. Each is a map in the form of
:func:`nsdrill.web.diagrams.plane`, with the places of its points, which a click runs."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nsdrill.analysis.counts import open_words
from nsdrill.analysis.maps import Classes, classes
from nsdrill.analysis.planes import axes_of, judges
from nsdrill.analysis.probability import EVERY, SAFE, Probabilities, probabilities_of, safe_in_words
from nsdrill.analysis.safety import FAILED_POINT, counts_of, known_outcome
from nsdrill.analysis.window import USUAL_CONFIDENCE, find_window
from nsdrill.app.answering.answers import results_for_window
from nsdrill.data import Answer, Array, Results
from nsdrill.errors import InputError
from nsdrill.figures.cells import unsettled_label
from nsdrill.figures.slices import edges
from nsdrill.figures.style import BAD_TO_GOOD, FIELD_BORDER
from nsdrill.figures.zones import ONLY_FROM_ABOVE, STARTED, UNKNOWN, codes_of, lowered, zones
from nsdrill.models.registry import responses_in
from nsdrill.models.starts import Starts, slice_values
from nsdrill.variables import OK, SAMPLE
from nsdrill.web.diagrams import Reply, axis_data, member_dimension
from nsdrill.web.shown import quantity_data, response_styles
from nsdrill.words.answer import before_trials, warnings, words_of
from nsdrill.words.labels import quantity

WINDOW, PROBABILITY, BASIN = "window", "probability", "basin"
WORDS = {WINDOW: "Operating window", PROBABILITY: "Probability", BASIN: "Response by the start"}


def area_choices(results: Results) -> list[dict[str, str]]:
    """The areas that these results have, each with its name and words; the first one is
    what a page opens on."""
    names = []
    if results.slice and not results.swept:
        names.append(BASIN)
    elif member_dimension(results) == SAMPLE:
        names += [PROBABILITY] if judges(results) and 1 <= len(results.swept) <= 2 else []
    elif judges(results) and len(results.swept) in (2, 3) and (axes := axes_of(results)) and axes[1]:
        names.append(WINDOW)
    return [{"name": name, "words": WORDS[name]} for name in names]


def area(results: Results, units: str, name: str, held: Mapping[str, int]) -> Reply:
    """The area ``name``; where there are several of one kind, as the probabilities of
    several outcomes, ``values`` [area, y, x] has all of them, and ``procedures`` their
    words. ``safe`` [y, x] is 1 where a run is safe, along whose border a line is drawn,
    ``recommended`` the column and the row of the point to choose first, ``answer`` and
    ``warnings`` what the window of the file says."""
    names = [choice["name"] for choice in area_choices(results)]
    if name not in names:
        raise InputError(f"name: found {name}; allowed: {', '.join(names) or 'none'}.")
    if name != BASIN:
        results = results_for_window(results)
    if name == PROBABILITY and len(results.swept) == 1:
        head, columns = probability_lines(results, units, results.swept[0])
        return head | _told(find_window(results), units), columns
    if name == BASIN:
        head, columns = _basin(results, units)
        axes = {"x": (results.grid.index("start"), len(head["y"]["values"])), "y": (results.grid.index("start"), 1)}
    else:
        maps = classes(results, None, USUAL_CONFIDENCE if name == PROBABILITY else None)
        assert maps.y is not None
        third = held.get(maps.third, 0) if maps.third else 0
        if isinstance(third, bool) or not isinstance(third, int) or not 0 <= third < len(maps.state):
            raise InputError(f"{maps.third}: found number {third}; allowed: 0 to {len(maps.state) - 1}.")
        safe = maps.grades.allowed[third]
        head, columns = _window(results, units, maps, third) if name == WINDOW else _probabilities(results, units, maps)
        axes = {"x": (results.grid.index(maps.x), 1), "y": (results.grid.index(maps.y), 1)}
        found = find_window(results)
        head |= {"recommended": _first_point(found, maps, third)} | _told(found, units)
        columns |= {"safe": safe.astype(float)}
        if name == WINDOW:  # striped as in the picture: what they show need not be what comes to stay
            columns["open"] = maps.unsettled[third].astype(float)[None]
            head["open_words"] = unsettled_label(int(columns["open"].sum()), columns["open"].size)
    place = [held.get(axis, 0) if axis in results.axes and name == WINDOW else 0 for axis in results.grid]
    for axis, (dimension, step) in axes.items():
        head[axis] = {**head[axis], "dimension": dimension, "step": step}
        place[dimension] = 0
    return head | {"place": place, "title": WORDS[name]}, columns


def _told(found: Answer, units: str) -> Answer:
    """What the window of the file says, what lies beside its setting, and its warnings."""
    words = words_of(found, units)
    return {
        "answer": words.sentence(),
        "lines": words.lines(),
        "warnings": [*before_trials(found), *warnings(found, units)],
    }


def _first_point(window: Answer, maps: Classes, third: int) -> list[int] | None:
    """The column and the row of the point to choose first of a map, that of the answer
    where it is in this map; None where no point is allowed."""
    cell = window["answer"].cell
    if cell is not None and cell[0] == third:
        return [cell[2], cell[1]]
    best = window["maps"][third]["recommended"]
    if best is None:
        return None
    return [int(np.argmin(np.abs(maps.values(axis) - best[axis]))) for axis in (maps.x, maps.y) if axis]


def _window(results: Results, units: str, maps: Classes, third: int) -> Reply:
    """What happens on the way in, at one value of a third axis: the classes of the picture,
    and after them those that are free only when lowered from above, striped white."""
    of_picture = zones(maps.grades)
    styles: list[tuple[str, ...]] = [(zone.name, zone.colour) for zone in of_picture]
    styles[STARTED] += (FIELD_BORDER,)
    styles[UNKNOWN] += ("#000000",)
    styles += [(f"{zone.name}, {ONLY_FROM_ABOVE}", zone.colour, "#ffffff") for zone in of_picture]
    codes = codes_of(maps.grades)[third] + len(of_picture) * lowered(maps.grades)[third]
    x, y = (axis_data(results, str(axis), units) for axis in (maps.x, maps.y))
    return _map(x, y, codes, "Window", styles)


def _probabilities(results: Results, units: str, maps: Classes) -> Reply:
    """The probabilities, in percent, of a safe run and of each response that occurs,
    whatever the history."""
    probabilities = probabilities_of(results)
    outcomes = occurring_outcomes(probabilities)
    x, y = (axis_data(results, str(axis), units) for axis in (maps.x, maps.y))

    def placed(arrays: list[Array]) -> Array:
        """Arrays over the axes as [area, y, x]."""
        stacked = np.array(arrays).reshape(len(outcomes), *(len(results.coords[axis]) for axis in results.swept))
        return stacked.swapaxes(1, 2) if results.swept.index(maps.x) == 0 else stacked

    shares = placed([100.0 * probabilities.of(name)[0] for name, _ in outcomes])
    head, columns = _map(x, y, shares, f"Probability: {outcomes[0][1]}", None)
    head["colour"] |= {"unit": "%"}
    # striped where some samples are not known, crossed where none is
    is_open = placed([probabilities.open[probabilities.place(name)] > 0 for name, _ in outcomes])
    columns |= {"open": is_open.astype(float), "outcome": np.where(np.isnan(columns["values"]), FAILED_POINT, 0)}
    return head | {
        "open_words": "some samples are not known",
        "limits": [0.0, 100.0],
        "procedures": [f"Probability: {words}" for _, words in outcomes],
        "scales": [BAD_TO_GOOD if name == SAFE else BAD_TO_GOOD[::-1] for name, _ in outcomes],
    }, columns


def probability_lines(results: Results, units: str, x: str) -> Reply:
    """The probabilities, in percent, of a safe run and of each response that occurs
    along one axis: a line for each."""
    probabilities = probabilities_of(results)
    outcomes = occurring_outcomes(probabilities)
    codes = [0 if name == SAFE else responses_in(results.attrs)[name].bit for name, _ in outcomes]
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
        "place": [0] * len(results.grid),
        "dimension": results.grid.index(x),
        "joined": True,
    }
    return head, {
        "values": values[..., np.newaxis],
        "outcome": np.broadcast_to(np.array(codes)[:, np.newaxis], values.shape),
        "constant": np.zeros(values.shape, bool),
    }


def occurring_outcomes(probabilities: Probabilities) -> list[tuple[str, str]]:
    """The outcomes that occur, safe first, each with its words."""
    suffix = " in any procedure" if EVERY in probabilities.histories else ""
    return [(SAFE, safe_in_words([one for one in probabilities.histories if one != EVERY]))] + [
        (name, f"{name.replace('_', '-')}{suffix}")
        for name in probabilities.outcomes
        if name != SAFE and (probabilities.count + probabilities.open)[probabilities.place(name)].any()
    ]


def _basin(results: Results, units: str) -> Reply:
    """The response that each start of a slice leads to, at one operating point."""
    (x_name, x), (y_name, y) = slice_values(Starts(slice=results.slice), tuple(results["state"].tolist())).items()
    codes = known_outcome(results).reshape(-1, len(x), len(y))[0].T
    axes = [
        {**quantity_data(name, units), "values": values / quantity(name, units).scale, "log": False}
        for name, values in ((x_name, x), (y_name, y))
    ]
    head, columns = _map(
        axes[0], axes[1], codes, "Response", [(one["name"], one["colour"]) for one in response_styles(results.attrs)]
    )
    unsettled = (results["status"] == OK) & (results["settled"] == 0)
    columns["open"] = unsettled.reshape(-1, len(x), len(y))[:1].swapaxes(1, 2).astype(float)
    counts, told = counts_of(results), []
    if number := int(np.count_nonzero(unsettled)):
        told.append(f"NOT SETTLED: {number} of {counts['of']} starts, which are striped, were still changing.")
    if words := open_words(counts, "starts"):
        told.append(f"NOT KNOWN: {words}.")
    told_of_all = {"answer": f"The response of {counts['known']} starts.", "warnings": told}
    return head | told_of_all | {"open_words": "not settled"}, columns


def _plain_quantity(words: str, unit: str = "") -> Answer:
    """The data of a quantity that is no variable of a file, in the form of
    :func:`nsdrill.web.shown.quantity_data`."""
    label = f"{words} [{unit}]" if unit else words
    return {"name": words, "words": words, "unit": unit, "label": label, "scale": 1.0, "long": words}


def _map(x: Answer, y: Answer, values: Array, words: str, styles: list[tuple[str, ...]] | None) -> Reply:
    """``values`` [y, x] or [map, y, x] as maps: of classes, whose names, colours and
    stripes ``styles`` gives, or of numbers."""
    values = values.reshape(-1, *values.shape[-2:])
    failed = values < 0 if styles else np.zeros(values.shape, bool)
    head: Answer = {
        "x": dict(x),
        "y": dict(y),
        "colour": _plain_quantity(words),
        "procedures": [""],
        "place": None,
        "x_edges": edges(np.asarray(x["values"])),
        "y_edges": edges(np.asarray(y["values"])),
        "classes": None,
        "limits": None,
    }
    if styles:
        head["classes"] = [dict(zip(("name", "colour", "stripes"), style, strict=False)) for style in styles]
    shown = np.where(failed, np.nan, values.astype(float))
    return head, {"values": shown, "outcome": np.where(failed, values, 0).astype(int)}
