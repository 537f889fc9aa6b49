"""The safe window: where every procedure is safe, where only some are, and the
recommended operating point.

A panel for each value of a third axis, or a strip where one axis is swept. The areas
differ in lightness and pattern as well as in colour.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.analysis.window import (
    CRITICAL,
    HISTORY_DEPENDENT,
    SAFE,
    UNKNOWN,
    Classes,
    axes_of,
    classes,
    find_window,
    unknown_words,
)
from nsdrill.data import Array, Results
from nsdrill.plot import equal
from nsdrill.plot.equal import RATE, drawn_of
from nsdrill.plot.hatching import hatch
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.maps import PANEL, WRAP, lies_across
from nsdrill.plot.registry import MAX_PANELS, PLANE, Kind, longest
from nsdrill.plot.slices import edges, spaced
from nsdrill.plot.style import (
    BLACK,
    FULL_WIDTH,
    new_figure,
    page_width,
    put_title,
    seamless,
    side_by_side,
)

SAFE_COLOUR, HISTORY_COLOUR, CRITICAL_COLOUR, UNKNOWN_COLOUR = (
    "#D3ECFA",
    "#E69F00",
    "#6E6E6E",
    "#FFFFFF",
)
COLOURS = ListedColormap(
    [UNKNOWN_COLOUR, CRITICAL_COLOUR, HISTORY_COLOUR, SAFE_COLOUR], name="window"
)
NORM = BoundaryNorm([-1.5, -0.5, 0.5, 1.5, 2.5], 4)


def draw(
    results: Results,
    units: str = "si",
    severity: int | None = None,
    confidence: float | None = None,
) -> Figure:
    note = find_window(results, severity, confidence)
    found = classes(results, severity, note["confidence"])
    shown = _shown(len(found.state))
    figure, panels = _frame(found, shown, units)
    cells = _cells(found, units)
    lines = False
    for axes, number in zip(panels, shown, strict=True):
        axes.pcolormesh(
            *cells,
            found.state[number],
            cmap=COLOURS,
            norm=NORM,
            gid="cells",
            **seamless(found.state[number].size),
        )
        hatch(
            axes,
            cells,
            found.state[number] == HISTORY_DEPENDENT,
            "//////",
            HISTORY_COLOUR,
            "#3A3A3A",
            "rim",
        )
        hatch(
            axes, cells, found.state[number] == UNKNOWN, "xxxxxx", UNKNOWN_COLOUR, BLACK, "unknown"
        )
        best, likely = note["maps"][number]["recommended"], _likely(found, note, number)
        if found.y and RATE in found.yields:
            scale = {axis: quantity(axis, units).scale for axis in (found.x, found.y)}
            x, y = (found.values(axis) / scale[axis] for axis in scale)
            points = [
                tuple(one[axis] / scale[axis] for axis in scale) for one in (best, likely) if one
            ]
            lines |= equal.draw_lines(axes, x, y, found.yields[RATE][number], units, points)
        _recommend(axes, found, best, units)
        if likely is not None:
            scales = [quantity(axis, units).scale if axis else 1.0 for axis in (found.x, found.y)]
            height = likely[found.y] / scales[1] if found.y else 0.5
            for colour, size in (("white", 8.0), (BLACK, 6.0)):
                name = "most_probable" if colour == BLACK else "halo"
                axes.plot(
                    [likely[found.x] / scales[0]],
                    [height],
                    linestyle="none",
                    marker="D",
                    markersize=size,
                    color=colour,
                    zorder=5,
                    clip_on=False,
                    gid=name,
                )
    handles = [*_legend(found, note), *([equal.handle(units)] if lines else [])]
    legend_below(figure, handles, 3)
    return figure


def _shown(panels: int) -> list[int]:
    """The numbers of the maps to draw: all, or as many as a page takes, evenly, the
    first and the last among them."""
    if panels <= MAX_PANELS:
        return list(range(panels))
    return [round(number * (panels - 1) / (MAX_PANELS - 1)) for number in range(MAX_PANELS)]


def _frame(found: Classes, shown: list[int], units: str) -> tuple[Figure, list[Axes]]:
    wrap = side_by_side(WRAP.get(len(shown), 4), PANEL)
    deep = -(-len(shown) // wrap)
    width = page_width() / wrap
    tall = 1.3 + deep * (min(0.8 * width, 3.4) if deep == 1 else 0.72 * width) if found.y else 1.6
    figure = new_figure(page_width(FULL_WIDTH if len(shown) > 1 or not found.y else 5.0), tall)
    grid = figure.add_gridspec(deep, wrap)
    x = quantity(found.x, units)
    panels: list[Axes] = []
    across, up = _cells(found, units)
    for place, number in enumerate(shown):
        first = panels[0] if panels else None
        axes = figure.add_subplot(grid[divmod(place, wrap)], sharex=first, sharey=first)
        lowest, leftmost = place + wrap >= len(shown), place % wrap == 0
        axes.tick_params(labelbottom=lowest, labelleft=leftmost)
        axes.set_xlabel(x.label if lowest else "")
        if found.y:
            axes.set_ylabel(quantity(found.y, units).label if leftmost else "")
        else:
            axes.set_yticks([])
        if found.third:
            axes.set_title(operating_point({found.third: found.values(found.third)[number]}, units))
        panels.append(axes)
    spaced(panels[0], found.values(found.x), found.values(found.y) if found.y else None)
    panels[0].set_xlim(across[0], across[-1])
    panels[0].set_ylim((up[-1], up[0]) if found.y == "depth" else (up[0], up[-1]))
    put_title(
        figure,
        heading(found.results.attrs, operating_point(fixed_values(found.results), units), width=80),
    )
    return figure, panels


def _cells(found: Classes, units: str) -> tuple[Array, Array]:
    """The edges of the cells across and up, in the shown units; a strip of height one
    where one axis is swept."""
    up = (
        edges(found.values(found.y)) / quantity(found.y, units).scale
        if found.y
        else np.array([0.0, 1.0])
    )
    return edges(found.values(found.x)) / quantity(found.x, units).scale, up


def _recommend(axes: Axes, found: Classes, best: dict[str, Any] | None, units: str) -> None:
    """The recommended point, with bars to the last safe point each way."""
    if best is None:
        return
    scale = quantity(found.x, units).scale
    bars: dict[str, Any] = {"xerr": _bar(best, found.x, scale)}
    height = 0.5
    if found.y:
        scale_y = quantity(found.y, units).scale
        bars["yerr"], height = _bar(best, found.y, scale_y), best[found.y] / scale_y
    # White below black: seen on every ground.
    for colour, wide, size in (("white", 2.4, 6.0), (BLACK, 1.0, 4.5)):
        drawn = axes.errorbar(
            [best[found.x] / scale],
            [height],
            **bars,
            color=colour,
            elinewidth=wide,
            capsize=2.5,
            capthick=wide,
            marker="o",
            markersize=size,
            markerfacecolor="white" if is_hint(best) else colour,
            zorder=5,
        )
        drawn[0].set_gid("recommended" if colour == BLACK else "halo")


def is_hint(best: dict[str, Any]) -> bool:
    """Whether a recommended point has no room to one side or more: a finer map might
    not have it."""
    return any(side["margin"] == 0.0 for axis in best["margins"].values() for side in axis.values())


def _likely(found: Classes, note: dict[str, Any], number: int) -> dict[str, Any] | None:
    """Where nothing is safe, the most probable point, if it lies in this map."""
    best: dict[str, Any] | None = note["most_probable"]
    if best is None or note["safe"]:
        return None
    return (
        best
        if found.third is None or note["maps"][number]["at"] == {found.third: best[found.third]}
        else None
    )


def _bar(best: dict[str, Any], axis: str, scale: float) -> list[list[float]]:
    return [[best["margins"][axis][side]["margin"] / scale] for side in ("less", "more")]


def _legend(found: Classes, note: dict[str, Any]) -> list[Artist]:
    """What the areas mean in this file, with their shares of all points."""
    calm = (
        "no critical response"
        if note["severity"] is None
        else f"no severity above {note['severity']}"
    )
    both = " and ".join(note["procedures"])
    meaning = {
        SAFE: f"safe: {calm}, {both}",
        HISTORY_DEPENDENT: "rim: depends on the history",
        CRITICAL: "critical",
    }
    if not note["history_examined"]:
        meaning[SAFE] = f"safe: {calm}; history not examined"
    if note["confidence"] is not None:
        history = f"in {both}" if note["history_examined"] else "history not examined"
        meaning[SAFE] = f"safe with {100 * note['confidence']:g} %: {calm}, {history}"
    handles: list[Artist] = []
    for value, name in ((SAFE, "safe"), (HISTORY_DEPENDENT, "rim"), (CRITICAL, "critical")):
        if value == HISTORY_DEPENDENT and (
            not note["history_examined"] or note["confidence"] is not None
        ):
            continue
        handles.append(
            Patch(
                facecolor=COLOURS(NORM(value)),
                edgecolor="#3A3A3A",
                linewidth=0.4,
                hatch="//////" if value == HISTORY_DEPENDENT else None,
                label=f"{meaning[value]} ({100 * note['share'][name]:.1f} %)",
            )
        )
    if note["unknown"]:
        handles.append(
            Patch(
                facecolor=UNKNOWN_COLOUR,
                edgecolor=BLACK,
                linewidth=0.4,
                hatch="xxxxxx",
                label=f"unknown ({unknown_words(note)})",
            )
        )
    best = [one["recommended"] for one in note["maps"] if one["recommended"]]
    for hint in (False, True):
        if any(is_hint(one) == hint for one in best):
            words = (
                "a hint: no room to one side"
                if hint
                else "recommended, bars to the last safe point"
            )
            face = "white" if hint else BLACK
            style: dict[str, Any] = {
                "color": BLACK,
                "marker": "o",
                "markersize": 5,
                "markerfacecolor": face,
            }
            handles.append(Line2D([], [], linewidth=1.0, label=words, **style))
    if note["most_probable"] and not note["safe"]:
        words = f"most probably safe, with {100 * note['most_probable']['probability']:.0f} %"
        handles.append(
            Line2D([], [], color=BLACK, marker="D", markersize=5, linestyle="none", label=words)
        )
    if len(found.state) > MAX_PANELS:
        handles.append(
            Line2D(
                [], [], linestyle="none", label=f"{MAX_PANELS} of {len(found.state)} panels shown"
            )
        )
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
        uses=drawn_of,
        takes=("severity", "confidence"),
        across=lambda data: lies_across(data) if len(data.swept) > 1 else longest(data),
    ),
)
