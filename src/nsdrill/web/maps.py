"""What an explorer opens on: the operating window with its border, the probabilities, or the
basins of a slice of starts. Each is an area (:mod:`nsdrill.web.areas`) with the places
of its points, which a click runs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.analysis.plane import largest_margin
from nsdrill.analysis.window import SAFE, USUAL_CONFIDENCE, Classes, axes_of, classes
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.variables import SAMPLE
from nsdrill.web.areas import basin_area, probability_areas, probability_lines, window_areas
from nsdrill.web.diagrams import Reply, member_dimension

WINDOW, PROBABILITY, BASIN = "window", "probability", "basin"
WORDS = {WINDOW: "Operating window", PROBABILITY: "Probability", BASIN: "Response by the start"}


def area_choices(results: Results) -> list[dict[str, str]]:
    """The areas that these results have, each with its name and words; the first one is
    what a page opens on."""
    names = []
    if results.slice and not results.swept:
        names.append(BASIN)
    elif member_dimension(results) == SAMPLE:
        names += [PROBABILITY] if 1 <= len(results.swept) <= 2 else []
    elif len(results.swept) in (2, 3) and (axes := axes_of(results)) and axes[1]:
        names.append(WINDOW)
    return [{"name": name, "words": WORDS[name]} for name in names]


def area(results: Results, units: str, name: str, held: Mapping[str, int]) -> Reply:
    """The area ``name``; where there are several of one kind, as the probabilities of
    several outcomes, ``values`` [area, y, x] has all of them, and ``procedures`` their
    words. ``safe`` [y, x] is 1 where a run is safe, along whose border a line is drawn,
    ``recommended`` the column and the row of the point to choose first."""
    names = [choice["name"] for choice in area_choices(results)]
    if name not in names:
        raise InputError(f"name: found {name}; allowed: {', '.join(names) or 'none'}.")
    if name == BASIN:
        head, columns = basin_area(results, units)[1]
        across, up = results.grid.index("start"), len(head["y"]["values"])
        axes = {"x": (across, up), "y": (across, 1)}
    elif len(results.swept) == 1:
        head, columns = probability_lines(results, units, results.swept[0])
        return head | {
            "place": [0] * len(results.grid),
            "dimension": results.grid.index(results.swept[0]),
            "joined": True,
        }, columns
    else:
        maps = classes(results, None, USUAL_CONFIDENCE if name == PROBABILITY else None)
        assert maps.y is not None
        third = held.get(maps.third, 0) if maps.third else 0
        if isinstance(third, bool) or not isinstance(third, int) or not 0 <= third < len(maps.state):
            raise InputError(f"{maps.third}: found number {third}; allowed: 0 to {len(maps.state) - 1}.")
        if name == WINDOW:
            ((_, (head, columns)),) = window_areas(results, units, [third])
        else:
            head, columns = _stacked([*probability_areas(results, units, maps.x, maps.y)])
        axes = {"x": (results.grid.index(maps.x), 1), "y": (results.grid.index(maps.y), 1)}
        safe = maps.state[third] == SAFE
        head |= {"recommended": _first_point(maps, safe)}
        columns |= {"safe": safe.astype(float)}
    place = [0] * len(results.grid)
    for axis, number in held.items():
        if axis in results.axes and name == WINDOW:
            place[results.grid.index(axis)] = number
    for axis, (dimension, step) in axes.items():
        head[axis] = {**head[axis], "dimension": dimension, "step": step}
        place[dimension] = 0
    return head | {"place": place, "title": WORDS[name]}, columns


def _stacked(areas: list[tuple[str, Reply]]) -> Reply:
    """Areas of one kind as one: ``values`` [area, y, x], with the colour scale of each."""
    head = areas[0][1][0]
    columns: dict[str, Array] = {
        name: np.concatenate([reply[1][name] for _, reply in areas]) for name in ("values", "outcome")
    }
    scales = [reply[0].get("scale") for _, reply in areas]
    return head | {"procedures": [words for words, _ in areas], "scales": scales}, columns


def _first_point(maps: Classes, safe: Array) -> list[int] | None:
    """The column and the row of the safe point with the largest margin; None where no
    point is safe."""
    best: Any = largest_margin(safe, maps.values(maps.y), maps.values(maps.x))
    return None if best is None else [int(best[1]), int(best[0])]
