"""The operating window: where every procedure is safe, where only some are, which
response bounds it, and the recommended operating point; and the windows of two studies
side by side.

There is a panel for each value of a third axis, or a strip where only one axis is
swept. Colours are those of the responses; an area that depends on the history is
hatched in the colour of its response over that of safe. Letters name the responses, so
that the picture can be read in grey.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nsdrill.analysis.maps import CRITICAL, HISTORY_DEPENDENT, SAFE, UNKNOWN, USES, classes
from nsdrill.analysis.planes import axes_of
from nsdrill.analysis.window import find_window, unknown_words
from nsdrill.data import Answer, Array, Results, evenly_spaced
from nsdrill.plot.answer import answer, chosen_map, is_hint, notes, of_both, warnings
from nsdrill.plot.cells import (
    RATE_OF_PENETRATION,
    Cells,
    draw_equal_rates,
    draw_outline,
    hatch,
    line_variables,
    name_areas,
    outline_entry,
)
from nsdrill.plot.labels import operating_point, sweep_title, way_word
from nsdrill.plot.legend import put_legend
from nsdrill.plot.look import Look
from nsdrill.plot.maps import COLUMNS_OF_PANELS, PANEL_WIDTH, Plane, height_of_maps, lies_across
from nsdrill.plot.page import (
    SHORTEST_LINE,
    area_entry,
    finish,
    freeze_layout,
    has_title,
    line_entry,
    new_figure,
    panels_per_row,
)
from nsdrill.plot.panels import draw_codes
from nsdrill.plot.registry import MAX_PANELS, PLANE, Kind, longest
from nsdrill.plot.style import (
    BAD_TO_GOOD,
    BLACK,
    FULL_WIDTH,
    GREY,
    LETTERED,
    RESPONSES,
    SAFE_COLOUR,
    Properties,
    font_size,
    house_style,
    page_width,
    using_look,
    without_glyph_warnings,
)

# Codes of the cells: the response bits of critical points (0: by a severity or by
# disagreeing checks alone), and after them safe and unknown.
SAFE_CODE, UNKNOWN_CODE = len(RESPONSES), len(RESPONSES) + 1
CRITICAL_COLOURS = (BAD_TO_GOOD[0], *(style.colour for style in RESPONSES[1:]))
RIM_HATCH, UNKNOWN_HATCH = "////", "xxxxxx"
HATCH_WIDTH = 1.8  # points
BORDER: Properties = {"edgecolor": "#3A3A3A", "linewidth": 0.4}


class Window:
    """The operating window of a sweep, as it is drawn: its ``numbers`` and its
    ``maps``, one for each value of a third axis, over a ``plane``."""

    def __init__(self, results: Results, units: str, severity: int | None, confidence: float | None) -> None:
        self.units, self.numbers = units, find_window(results, severity, confidence)
        self.maps = classes(results, severity, self.numbers["confidence"])
        self.plane = Plane(results, self.maps.x, self.maps.y, units)
        self.lines: list[Artist] = []  # the legend entry of lines of equal rate

    def where(self, number: int) -> str:
        """The value of the third axis of a map; empty where there is none."""
        third = self.maps.third
        return operating_point({third: self.maps.values(third)[number]}, self.units) if third else ""

    def draw(self, axes: Axes, number: int) -> None:
        """Draw a map into a panel: its areas with their names, the lines of equal rate
        of penetration, the recommended point."""
        cells, state, bits = self.plane.cells, self.maps.state[number], self.maps.bits[number]
        # cells that depend on the history are drawn as safe, with a hatch above
        codes = np.where(state == UNKNOWN, UNKNOWN_CODE, np.where(state == CRITICAL, bits, SAFE_CODE))
        draw_codes(axes, cells, codes, [*CRITICAL_COLOURS, SAFE_COLOUR, GREY], "window", "cells")
        for code in np.unique(bits[state == HISTORY_DEPENDENT]).tolist():
            chosen = (state == HISTORY_DEPENDENT) & (bits == code)
            hatch(axes, cells, chosen, RIM_HATCH, CRITICAL_COLOURS[code], f"rim:{code}", width=HATCH_WIDTH)
        hatch(axes, cells, state == UNKNOWN, UNKNOWN_HATCH, BLACK, "unknown")
        point, most_probable = self.numbers["maps"][number]["recommended"], self._most_probable_in(number)
        self._name_areas(axes, cells, number, point)
        if self.maps.y and RATE_OF_PENETRATION in self.maps.yields:
            rates, centres = self.maps.yields[RATE_OF_PENETRATION][number], self.plane.centres
            clear = [self.plane.shown(one) for one in (point, most_probable) if one]
            self.lines = draw_equal_rates(axes, centres, rates, self.units, clear) or self.lines
        if point:
            self._draw_recommended(axes, point)
        if most_probable:
            # White below black is visible on every colour.
            x, y = self.plane.shown(most_probable)
            style: Properties = {"marker": "D", "linestyle": "none", "zorder": 5, "clip_on": False}
            for colour, size, gid in (("white", 8.0, "halo"), (BLACK, 6.0, "most_probable")):
                axes.plot([x], [y], color=colour, markersize=size, gid=gid, **style)

    def _draw_recommended(self, axes: Axes, point: Answer) -> None:
        """Draw the recommended point, with bars to the last safe point in each
        direction; hollow where it is a hint."""
        x, y = self.plane.shown(point)
        less, more = (
            self.plane.shown({axis: sides[side]["margin"] for axis, sides in point["margins"].items()})
            for side in ("less", "more")
        )
        bars: Properties = {"xerr": [[less[0]], [more[0]]]}
        if self.maps.y:
            bars["yerr"] = [[less[1]], [more[1]]]
        hint = is_hint(self.numbers, point)
        for colour, width, size in (("white", 2.4, 6.0), (BLACK, 1.0, 4.5)):
            face = "white" if hint else colour
            caps: Properties = {"elinewidth": width, "capsize": 2.5, "capthick": width}
            artists = axes.errorbar(
                [x], [y], **bars, color=colour, **caps, marker="o", markersize=size, markerfacecolor=face, zorder=5
            )
            artists[0].set_gid("recommended" if colour == BLACK else "halo")

    def _most_probable_in(self, number: int) -> Answer | None:
        """The point that is most probably safe, if no point is safe and it lies in this
        map."""
        point: Answer | None = self.numbers["most_probable"]
        if point is None or self.numbers["safe"]:
            return None
        third = self.maps.third
        return point if not third or self.numbers["maps"][number]["at"] == {third: point[third]} else None

    def _name_areas(self, axes: Axes, cells: Cells, number: int, point: Answer | None) -> None:
        """The letters, or where there is room the name, of the response of each area;
        with a question mark where the history decides. Small areas have none but where
        they bound the recommended point."""
        state, bits = self.maps.state[number], self.maps.bits[number]
        bounding = self._beside(point) if point else set()
        for value, mark in ((CRITICAL, ""), (HISTORY_DEPENDENT, "?")):
            for code in np.unique(bits[state == value]).tolist():
                name, letters = (RESPONSES[code].name, RESPONSES[code].letters) if code else ("!", "!")
                ground = CRITICAL_COLOURS[code] if value == CRITICAL else "#FFFFFF"
                chosen = (state == value) & (bits == code)
                name_areas(axes, cells, chosen, (name + mark, letters + mark), ground, f"area:{code}", bounding)

    def _beside(self, point: Answer) -> set[tuple[int, int]]:
        """The cells (row, column) that bound the recommended point."""
        maps = self.maps

        def nearest(axis: str, value: float) -> int:
            return int(np.argmin(np.abs(maps.values(axis) - value)))

        at = {axis: nearest(axis, point[axis]) for axis in (maps.x, maps.y) if axis}
        found = set()
        for axis in at:
            for side in point["margins"][axis].values():
                if side["first_not_safe"] is not None:
                    place = {**at, axis: nearest(axis, side["first_not_safe"])}
                    found.add((place.get(str(maps.y), 0), place[maps.x]))
        return found

    def entries(self) -> Iterator[Artist]:
        """The legend entries of the areas, with their meaning in this file and their
        shares of all points, and of the points drawn."""
        numbers, state, bits = self.numbers, self.maps.state, self.maps.bits
        share = numbers["share"]
        yield area_entry(facecolor=SAFE_COLOUR, label=f"{self._criterion()} ({100 * share['safe']:.1f} %)", **BORDER)
        critical, by_history = (state == value for value in (CRITICAL, HISTORY_DEPENDENT))
        words_of_none = "! checks disagree" if numbers["severity"] is None else "! severity"
        for code in np.unique(bits[critical | by_history]).tolist():
            here = bits == code
            parts = [
                f"{100 * (area & here).mean():.1f} %{words}"
                for area, words in ((critical, ""), (by_history, " by the history"))
                if np.any(area & here)
            ]
            name = LETTERED[code].name if code else words_of_none
            yield area_entry(facecolor=CRITICAL_COLOURS[code], label=f"{name} ({', '.join(parts)})", **BORDER)
        if np.any(by_history):
            label = f"hatched, with ?: history-dependent ({100 * share['rim']:.1f} %)"
            yield area_entry(facecolor=SAFE_COLOUR, edgecolor=BLACK, linewidth=0, hatch=RIM_HATCH, label=label)
        if numbers["unknown"]:
            style: Properties = {"edgecolor": BLACK, "linewidth": 0.4, "hatch": UNKNOWN_HATCH}
            yield area_entry(facecolor=GREY, label=f"unknown ({unknown_words(numbers)})", **style)
        yield from self._entries_of_points()

    def _criterion(self) -> str:
        """What is safe here."""
        numbers = self.numbers
        procedures = " and ".join(way_word(name, self.maps.results.attrs) for name in numbers["procedures"])
        criterion = (
            "no critical response" if numbers["severity"] is None else f"no severity above {numbers['severity']}"
        )
        if numbers["confidence"] is not None:
            history = f"in {procedures}" if numbers["history_examined"] else "history not examined"
            return f"safe with {100 * numbers['confidence']:g} %: {criterion}, {history}"
        if not numbers["history_examined"]:
            return f"safe: {criterion}; history not examined"
        return f"safe: {criterion}, {procedures}"

    def _entries_of_points(self) -> Iterator[Artist]:
        numbers = self.numbers
        style: Properties = {"color": BLACK, "markersize": 5}
        best = [one["recommended"] for one in numbers["maps"] if one["recommended"]]
        for of_hints, words, face in ((False, "recommended", BLACK), (True, "a hint, not a setting", "white")):
            if any(is_hint(numbers, point) == of_hints for point in best):
                label = f"{words}, bars to the last safe point"
                yield line_entry(linewidth=1.0, marker="o", markerfacecolor=face, label=label, **style)
        if numbers["most_probable"] and not numbers["safe"]:
            label = f"most probably safe ({100 * numbers['most_probable']['probability']:.0f} %)"
            yield line_entry(marker="D", linestyle="none", label=label, **style)
        if (count := len(self.maps.state)) > MAX_PANELS:
            yield line_entry(linestyle="none", label=f"{MAX_PANELS} of {count} panels shown")


def draw(results: Results, units: str = "si", severity: int | None = None, confidence: float | None = None) -> Figure:
    window = Window(results, units, severity, confidence)
    numbers = evenly_spaced(range(len(window.maps.state)), MAX_PANELS)
    columns = panels_per_row(COLUMNS_OF_PANELS.get(len(numbers), 4), PANEL_WIDTH)
    height = height_of_maps(len(numbers), columns) if window.maps.y else 0.8 + 0.9 * -(-len(numbers) // columns)
    figure = new_figure(page_width(FULL_WIDTH if len(numbers) > 1 or not window.maps.y else 5.0), height)
    panels = window.plane.panels(figure, [window.where(number) for number in numbers], columns)
    for axes, number in zip(panels, numbers, strict=True):
        window.draw(axes, number)
    title = f"{sweep_title(results, units, width=80)}\n{answer(window.numbers, units)}"
    return finish(figure, title, [*window.entries(), *window.lines], 3, notes(window.numbers, units))


CHARACTERS = 15  # in an inch of the title of a panel


def draw_two(
    a: Results,
    b: Results,
    names: Sequence[str],
    units: str = "si",
    severity: int | None = None,
    confidence: float | None = None,
    look: Look | None = None,
) -> Figure:
    """The windows of two results over the same axes, under the ``names`` of the two; of
    a third axis the map that the answer is about. In that of the second a line shows
    where the first one is safe."""
    with using_look(look or Look()), house_style(), without_glyph_warnings():
        figure = _draw_two([Window(one, units, severity, confidence) for one in (a, b)], names, units)
        put_legend(figure)
        freeze_layout(figure)
    return figure


def _draw_two(windows: Sequence[Window], names: Sequence[str], units: str) -> Figure:
    columns = 2 if windows[0].maps.y else 1
    figure = new_figure(page_width(), 4.4 if columns == 2 else 3.6)
    characters = max(int(CHARACTERS * figure.get_figwidth() / columns), SHORTEST_LINE)
    panels = windows[0].plane.panels(figure, ["", ""], columns)
    (x, y), (other_x, other_y) = (window.plane.cells for window in windows)
    windows[0].plane.limit(panels[0], _ends(x, other_x), _ends(y, other_y))
    handles: dict[str, Artist] = {}
    places = [_answered(window) for window in windows]
    for letter, name, window, place, axes in zip("ab", names, windows, places, panels, strict=True):
        window.draw(axes, place)
        where = f", {window.where(place)}" if window.maps.third else ""
        words = [f"{letter}: {name}{where}", *([answer(window.numbers, units)] if has_title() else [])]
        wrapped = "\n".join(textwrap.fill(line, characters) for line in words)
        axes.set_title(wrapped, loc="left", fontsize=font_size(7), parse_math=False)
        for handle in window.entries():
            # shares are of one of the two
            label = str(handle.get_label()).rpartition(" (")[0] or str(handle.get_label())
            handle.set_label(label)
            handles.setdefault(label, handle)
    safe_in_a = windows[0].maps.state[places[0]] == SAFE
    draw_outline(panels[1], windows[0].plane.cells, safe_in_a)
    outline = [outline_entry("safe in a")] if safe_in_a.any() else []
    lines = windows[0].lines or windows[1].lines
    titles = {str(window.maps.results.attrs.get("title") or "") for window in windows}
    title = titles.pop() if len(titles) == 1 else "a and b"
    texts = [[f"{text.partition('. ')[0].rstrip('.')}." for text in warnings(one.numbers, units)] for one in windows]
    return finish(figure, title, [*handles.values(), *outline, *lines], 3, of_both(*texts))


def _answered(window: Window) -> int:
    """The number of the map that the answer is about, of what is safe throughout the
    first."""
    at = (chosen_map(window.numbers) or {"at": {}})["at"]
    return next((number for number, one in enumerate(window.numbers["maps"]) if one["at"] == at), 0)


def _ends(*edges: Array) -> Array:
    """The least and the greatest of all edges."""
    return np.array([min(one.min() for one in edges), max(one.max() for one in edges)])


KINDS = (
    Kind(
        "window",
        "where all procedures are safe, where only some, and the recommended operating point",
        of=PLANE,
        place=lambda data: 50 if isinstance(data, Results) and axes_of(data) is not None else None,
        draw=draw,
        uses=lambda model: tuple(dict.fromkeys((*line_variables(model), *USES))),
        takes=("severity", "confidence"),
        across=lambda data: lies_across(data) if len(data.swept) > 1 else longest(data),
    ),
)
