"""The operating window: where every procedure is safe, where only some are, which response
bounds it, and the recommended operating point.

There is a panel for each value of a third axis, or a strip where only one axis is
swept. Colours are those of the responses; an area that depends on the history is
hatched in the colour of its response over that of safe. Letters name the responses, so
that the picture can be read in grey.
"""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.analysis.window import (
    CRITICAL,
    HISTORY_DEPENDENT,
    UNKNOWN,
    Classes,
    axes_of,
    classes,
    find_window,
    unknown_words,
)
from nsdrill.data import Array, Results
from nsdrill.plot import isolines
from nsdrill.plot.answer import answer, is_hint, notes
from nsdrill.plot.hatching import hatch
from nsdrill.plot.isolines import RATE_OF_PENETRATION, line_variables
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.look import look
from nsdrill.plot.maps import COLUMNS_OF_PANELS, PANEL_WIDTH, lies_across
from nsdrill.plot.named_areas import (
    COLOURS,
    CRITICAL_COLOURS,
    HATCH_WIDTH,
    NORM,
    RIM_HATCH,
    SAFE_CODE,
    UNKNOWN_CODE,
    UNKNOWN_HATCH,
    name_areas,
)
from nsdrill.plot.registry import MAX_PANELS, PLANE, Kind, longest
from nsdrill.plot.slices import edges, spaced
from nsdrill.plot.style import (
    BLACK,
    FULL_WIDTH,
    GREY,
    RESPONSES,
    SAFE_COLOUR,
    SHORTEST_LINE,
    WARNING,
    Picture,
    cell_style,
    font_size,
    new_figure,
    page_width,
    panels_per_row,
    put_title,
)

ALLOWED_LEGEND = 0.5  # inches of a legend for which there is room anyway


def draw(results: Results, units: str = "si", severity: int | None = None, confidence: float | None = None) -> Figure:
    numbers = find_window(results, severity, confidence)
    classified = classes(results, severity, numbers["confidence"])
    map_numbers = _panels_to_draw(len(classified.state))
    figure, panels = _new_panels(classified, map_numbers, units, answer(numbers, units))
    has_lines = False
    for axes, map_number in zip(panels, map_numbers, strict=True):
        has_lines |= draw_map(axes, classified, numbers, map_number, units)
    handles = [*legend_entries(classified, numbers), *([isolines.legend_entry(units)] if has_lines else [])]
    legend_below(figure, handles, 3)
    put_warnings(figure, notes(numbers, units))
    return figure


def draw_map(axes: Axes, classified: Classes, numbers: dict[str, Any], map_number: int, units: str) -> bool:
    """Draw one map of a window into a panel: its areas with their names, the lines of
    equal rate of penetration, the recommended point. Returns whether there are such
    lines."""
    cells, has_lines = cell_edges(classified, units), False
    state, bits = classified.state[map_number], classified.bits[map_number]
    codes = _codes(state, bits)
    axes.pcolormesh(*cells, codes, cmap=COLOURS, norm=NORM, gid="cells", **cell_style(codes.size))
    for code in np.unique(bits[state == HISTORY_DEPENDENT]).tolist():
        chosen = (state == HISTORY_DEPENDENT) & (bits == code)
        colour = CRITICAL_COLOURS[code]
        hatch(axes, cells, chosen, RIM_HATCH, "none", colour, f"rim:{code}", HATCH_WIDTH)
    hatch(axes, cells, state == UNKNOWN, UNKNOWN_HATCH, "none", BLACK, "unknown")
    point, most_probable = (
        numbers["maps"][map_number]["recommended"],
        _most_probable_in(classified, numbers, map_number),
    )
    if classified.y and RATE_OF_PENETRATION in classified.yields:
        scale = {axis: quantity(axis, units).scale for axis in (classified.x, classified.y)}
        x, y = (classified.values(axis) / scale[axis] for axis in scale)
        points = [
            tuple(shown_point[axis] / scale[axis] for axis in scale)
            for shown_point in (point, most_probable)
            if shown_point
        ]
        has_lines = isolines.draw_lines(axes, x, y, classified.yields[RATE_OF_PENETRATION][map_number], units, points)
    _draw_recommended(axes, classified, point, bool(point) and is_hint(numbers, point), units)
    name_areas(axes, classified, cells, map_number, point)
    if most_probable is not None:
        scales = [quantity(axis, units).scale if axis else 1.0 for axis in (classified.x, classified.y)]
        height = most_probable[classified.y] / scales[1] if classified.y else 0.5
        for colour, size in (("white", 8.0), (BLACK, 6.0)):
            name = "most_probable" if colour == BLACK else "halo"
            axes.plot(
                [most_probable[classified.x] / scales[0]],
                [height],
                linestyle="none",
                marker="D",
                markersize=size,
                color=colour,
                zorder=5,
                clip_on=False,
                gid=name,
            )
    return has_lines


def _codes(state: Array, bits: Array) -> Array:
    """The code of each cell; cells that depend on the history are drawn as safe, with a
    hatch above."""
    codes = np.where(state == CRITICAL, bits, SAFE_CODE)
    return np.asarray(np.where(state == UNKNOWN, UNKNOWN_CODE, codes))


def put_warnings(figure: Figure, texts: list[str]) -> None:
    """The warnings above the legend, in its width; the figure grows by the height of
    both, and of its title."""
    if not figure.legends:
        return
    texts = texts if look.get().warnings else []
    legend, size = figure.legends[-1], font_size(7)
    title, width = legend.get_title(), figure.bbox.width - 12.0 * figure.dpi / 72
    title.set(color=WARNING, gid="warnings", parse_math=False)
    for characters in range(140, SHORTEST_LINE, -4):
        lines = [textwrap.fill(text, characters, subsequent_indent="   ", break_on_hyphens=False) for text in texts]
        legend.set_title("\n".join(lines), prop=FontProperties(size=size, weight="bold"))
        if title.get_window_extent().width <= width:
            break
    if isinstance(figure, Picture) and look.get().height is None:
        heading_lines = figure.get_suptitle().count("\n")
        grown = legend.get_window_extent().height / figure.dpi - ALLOWED_LEGEND
        figure.set_figheight(figure.get_figheight() + max(0.0, grown) + heading_lines * 1.4 * font_size(9) / 72)


def _panels_to_draw(count: int) -> list[int]:
    """The indices of the maps to draw: all, or as many as fit on a page, evenly spaced,
    with the first and the last."""
    if count <= MAX_PANELS:
        return list(range(count))
    return [round(number * (count - 1) / (MAX_PANELS - 1)) for number in range(MAX_PANELS)]


def _new_panels(classified: Classes, map_numbers: list[int], units: str, sentence: str) -> tuple[Figure, list[Axes]]:
    panel_columns = panels_per_row(COLUMNS_OF_PANELS.get(len(map_numbers), 4), PANEL_WIDTH)
    panel_rows = -(-len(map_numbers) // panel_columns)
    width = page_width() / panel_columns
    height = (
        1.3 + panel_rows * (min(0.8 * width, 3.4) if panel_rows == 1 else 0.72 * width)
        if classified.y
        else 0.8 + 0.9 * panel_rows
    )
    figure = new_figure(page_width(FULL_WIDTH if len(map_numbers) > 1 or not classified.y else 5.0), height)
    grid = figure.add_gridspec(panel_rows, panel_columns)
    x = quantity(classified.x, units)
    panels: list[Axes] = []
    x_edges, y_edges = cell_edges(classified, units)
    for place, map_number in enumerate(map_numbers):
        first = panels[0] if panels else None
        axes = figure.add_subplot(grid[divmod(place, panel_columns)], sharex=first, sharey=first)
        is_lowest, is_leftmost = (place + panel_columns >= len(map_numbers), place % panel_columns == 0)
        axes.tick_params(labelbottom=is_lowest, labelleft=is_leftmost)
        axes.set_xlabel(x.label if is_lowest else "")
        if classified.y:
            axes.set_ylabel(quantity(classified.y, units).label if is_leftmost else "")
        else:
            axes.set_yticks([])
        if classified.third:
            axes.set_title(operating_point({classified.third: classified.values(classified.third)[map_number]}, units))
        panels.append(axes)
    spaced(panels[0], classified.values(classified.x), classified.values(classified.y) if classified.y else None)
    panels[0].set_xlim(x_edges[0], x_edges[-1])
    panels[0].set_ylim((y_edges[-1], y_edges[0]) if classified.y == "depth" else (y_edges[0], y_edges[-1]))
    point = operating_point(fixed_values(classified.results), units)
    put_title(figure, f"{heading(classified.results.attrs, point, width=80)}\n{sentence}")
    return figure, panels


def cell_edges(classified: Classes, units: str) -> tuple[Array, Array]:
    """The edges of the cells along x and y, in the shown units; a strip of height one
    where only one axis is swept."""
    y_edges = (
        edges(classified.values(classified.y)) / quantity(classified.y, units).scale
        if classified.y
        else np.array([0.0, 1.0])
    )
    return edges(classified.values(classified.x)) / quantity(classified.x, units).scale, y_edges


def _draw_recommended(axes: Axes, classified: Classes, point: dict[str, Any] | None, hint: bool, units: str) -> None:
    """Draw the recommended point, with bars to the last safe point in each direction;
    hollow where it is a ``hint``."""
    if point is None:
        return
    scale = quantity(classified.x, units).scale
    bars: dict[str, Any] = {"xerr": _margins(point, classified.x, scale)}
    height = 0.5
    if classified.y:
        scale_y = quantity(classified.y, units).scale
        bars["yerr"], height = _margins(point, classified.y, scale_y), point[classified.y] / scale_y
    # White below black is visible on every colour.
    for colour, width, size in (("white", 2.4, 6.0), (BLACK, 1.0, 4.5)):
        artists = axes.errorbar(
            [point[classified.x] / scale],
            [height],
            **bars,
            color=colour,
            elinewidth=width,
            capsize=2.5,
            capthick=width,
            marker="o",
            markersize=size,
            markerfacecolor="white" if hint else colour,
            zorder=5,
        )
        artists[0].set_gid("recommended" if colour == BLACK else "halo")


def _most_probable_in(classified: Classes, numbers: dict[str, Any], map_number: int) -> dict[str, Any] | None:
    """The point that is most probably safe, if no point is safe and it lies in this
    map."""
    point: dict[str, Any] | None = numbers["most_probable"]
    if point is None or numbers["safe"]:
        return None
    return (
        point
        if classified.third is None or numbers["maps"][map_number]["at"] == {classified.third: point[classified.third]}
        else None
    )


def _margins(point: dict[str, Any], axis: str, scale: float) -> list[list[float]]:
    return [[point["margins"][axis][side]["margin"] / scale] for side in ("less", "more")]


def legend_entries(classified: Classes, numbers: dict[str, Any]) -> list[Artist]:
    """The legend entries of the areas, with their meaning in this file and their shares
    of all points, and of the points drawn."""
    criterion = "no critical response" if numbers["severity"] is None else f"no severity above {numbers['severity']}"
    procedures = " and ".join(numbers["procedures"])
    label = f"safe: {criterion}, {procedures}"
    if not numbers["history_examined"]:
        label = f"safe: {criterion}; history not examined"
    if numbers["confidence"] is not None:
        history = f"in {procedures}" if numbers["history_examined"] else "history not examined"
        label = f"safe with {100 * numbers['confidence']:g} %: {criterion}, {history}"
    share = numbers["share"]
    border: dict[str, Any] = {"edgecolor": "#3A3A3A", "linewidth": 0.4}
    handles: list[Artist] = [Patch(facecolor=SAFE_COLOUR, label=f"{label} ({100 * share['safe']:.1f} %)", **border)]
    critical, by_history = (classified.state == value for value in (CRITICAL, HISTORY_DEPENDENT))
    words_of_none = "! checks disagree" if numbers["severity"] is None else "! severity"
    for code in np.unique(classified.bits[critical | by_history]).tolist():
        here = classified.bits == code
        parts = [
            f"{100 * (area & here).mean():.1f} %{words}"
            for area, words in ((critical, ""), (by_history, " by the history"))
            if np.any(area & here)
        ]
        name = f"{RESPONSES[code].letters} {RESPONSES[code].name}" if code else words_of_none
        label = f"{name} ({', '.join(parts)})"
        handles.append(Patch(facecolor=CRITICAL_COLOURS[code], label=label, **border))
    if np.any(by_history):
        label = f"hatched, with ?: history-dependent ({100 * share['rim']:.1f} %)"
        handles.append(Patch(facecolor=SAFE_COLOUR, edgecolor=BLACK, linewidth=0, hatch=RIM_HATCH, label=label))
    if numbers["unknown"]:
        handles.append(
            Patch(
                facecolor=GREY,
                edgecolor=BLACK,
                linewidth=0.4,
                hatch=UNKNOWN_HATCH,
                label=f"unknown ({unknown_words(numbers)})",
            )
        )
    recommended = [point_of_map["recommended"] for point_of_map in numbers["maps"] if point_of_map["recommended"]]
    for of_hints in (False, True):
        if any(is_hint(numbers, point_of_map) == of_hints for point_of_map in recommended):
            label = (
                "a hint, not a setting, bars to the last safe point"
                if of_hints
                else "recommended, bars to the last safe point"
            )
            face = "white" if of_hints else BLACK
            style: dict[str, Any] = {"color": BLACK, "marker": "o", "markersize": 5, "markerfacecolor": face}
            handles.append(Line2D([], [], linewidth=1.0, label=label, **style))
    if numbers["most_probable"] and not numbers["safe"]:
        label = f"most probably safe, with {100 * numbers['most_probable']['probability']:.0f} %"
        handles.append(Line2D([], [], color=BLACK, marker="D", markersize=5, linestyle="none", label=label))
    if len(classified.state) > MAX_PANELS:
        handles.append(Line2D([], [], linestyle="none", label=f"{MAX_PANELS} of {len(classified.state)} panels shown"))
    return handles


def _place(data: Any) -> float | None:
    return 50 if isinstance(data, Results) and axes_of(data) is not None else None


KINDS = (
    Kind(
        "window",
        "where all procedures are safe, where only some, and the recommended operating point",
        of=PLANE,
        place=_place,
        draw=draw,
        uses=lambda model: (*line_variables(model), "settled"),
        takes=("severity", "confidence"),
        across=lambda data: lies_across(data) if len(data.swept) > 1 else longest(data),
    ),
)
