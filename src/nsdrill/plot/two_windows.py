"""The windows of two studies side by side; in that of the second a line shows where the
first one was safe."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.analysis.window import SAFE, Classes, classes, find_window
from nsdrill.data import Array, Results
from nsdrill.plot import isolines
from nsdrill.plot.answer import answer, chosen_map, warnings
from nsdrill.plot.kinds.probability import draw_outline, outline_effects
from nsdrill.plot.kinds.window import cell_edges, draw_map, legend_entries, put_warnings
from nsdrill.plot.labels import operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.look import Look
from nsdrill.plot.slices import spaced
from nsdrill.plot.style import (
    SHORTEST_LINE,
    font_size,
    freeze_layout,
    has_title,
    house_style,
    new_figure,
    page_width,
    put_title,
    using_look,
    without_glyph_warnings,
)

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
    a third axis the map that the answer is about."""
    with using_look(look or Look()), house_style(), without_glyph_warnings():
        figure = _draw([a, b], names, units, severity, confidence)
        freeze_layout(figure)
    return figure


def _draw(
    data: Sequence[Results], names: Sequence[str], units: str, severity: int | None, confidence: float | None
) -> Figure:
    numbers = [find_window(one, severity, confidence) for one in data]
    maps = [classes(one, severity, window["confidence"]) for one, window in zip(data, numbers, strict=True)]
    is_map = maps[0].y is not None
    figure = new_figure(page_width(), 4.4 if is_map else 3.6)
    grid = figure.add_gridspec(1 if is_map else 2, 2 if is_map else 1)
    handles: dict[str, Artist] = {}
    has_lines = False
    first = None
    for number, (letter, name, one, window) in enumerate(zip("ab", names, maps, numbers, strict=True)):
        axes = figure.add_subplot(grid[number], sharex=first, sharey=first)
        place = _map_number(window)
        has_lines |= draw_map(axes, one, window, place, units)
        at = {one.third: one.values(one.third)[place]} if one.third else {}
        where = f", {operating_point(at, units)}" if at else ""
        title = [f"{letter}: {name}{where}", f"{letter}: {answer(window, units)}"]
        width = int(CHARACTERS * figure.get_figwidth() / (2 if is_map else 1))
        if has_title():
            wrapped = "\n".join(textwrap.fill(line, max(width, SHORTEST_LINE)) for line in title)
            axes.set_title(wrapped, loc="left", fontsize=font_size(7), parse_math=False)
        is_lowest = is_map or number == 1
        axes.set_xlabel(quantity(one.x, units).label if is_lowest else "")
        axes.tick_params(labelbottom=is_lowest, labelleft=is_map and number == 0)
        if one.y:
            axes.set_ylabel(quantity(one.y, units).label if number == 0 else "")
        else:
            axes.set_yticks([])
        if first is None:
            first = axes
            spaced(axes, one.values(one.x), one.values(one.y) if one.y else None)
        for handle in legend_entries(one, window):
            # shares are of one of the two
            label = str(handle.get_label()).rpartition(" (")[0] or str(handle.get_label())
            handle.set_label(label)
            handles.setdefault(label, handle)
        if number == 1:
            cells, inside = cell_edges(maps[0], units), maps[0].state[_map_number(numbers[0])]
            draw_outline(axes, *cells, inside == SAFE)
    assert first is not None
    _limit(first, maps, units)
    outline = Line2D([], [], color="white", linewidth=1.2, path_effects=outline_effects(), label="safe in a")
    entries = [*handles.values(), outline, *([isolines.legend_entry(units)] if has_lines else [])]
    legend_below(figure, entries, 3)
    texts = [
        f"{letter}: {text.partition('. ')[0].rstrip('.')}."
        for letter, window in zip("ab", numbers, strict=True)
        for text in warnings(window, units)
    ]
    put_warnings(figure, texts)
    put_title(figure, str(data[0].attrs.get("title") or "") if _same_title(data) else "a and b")
    return figure


def _same_title(data: Sequence[Results]) -> bool:
    titles = {str(one.attrs.get("title") or "") for one in data}
    return len(titles) == 1


def _map_number(window: dict[str, object]) -> int:
    """The number of the map that the answer is about, of what is safe throughout the
    first."""
    chosen, maps = chosen_map(window), window["maps"]
    assert isinstance(maps, list)
    at = chosen["at"] if chosen else {}
    return next((n for n, one in enumerate(maps) if one["at"] == at), 0)


def _limit(axes: object, maps: Sequence[Classes], units: str) -> None:
    """Limits that hold the cells of both."""
    ends: list[list[Array]] = [list(cell_edges(one, units)) for one in maps]
    x, y = ((min(one[k].min() for one in ends), max(one[k].max() for one in ends)) for k in (0, 1))
    axes.set_xlim(*x)  # type: ignore[attr-defined]
    axes.set_ylim(*(y[::-1] if maps[0].y == "depth" else y))  # type: ignore[attr-defined]
