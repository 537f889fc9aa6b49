"""What each attractor is like, along one axis: a marker for each, its size by share,
its colour and shape by response, open where most of its members are unsettled. A line
joins what is one attractor along the axis, dotted where an operating point between has
none of its starts."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.analysis.attractors import Attractor
from nsdrill.data import Array, Results
from nsdrill.models.registry import drawn_in
from nsdrill.plot.labels import Shown, fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below, marker_entry, response_entries
from nsdrill.plot.registry import STARTS, Kind, needs_starts
from nsdrill.plot.slices import edges, name_words, positions, robust_limits, spaced
from nsdrill.plot.starts import USED, along, has_starts, matched
from nsdrill.plot.style import REFERENCE, RESPONSES, new_figure, page_width, put_title, type_size

HEIGHT = 6.0
LARGEST, SMALLEST = 8.0, 2.6  # points of diameter, of the share 1 and of a single start among many
LEAST = 0.05


def draw(results: Results, units: str = "si") -> Figure:
    axis, found = along(results)
    x = quantity(axis, units)
    centres = positions(results, axis) / x.scale
    figure = new_figure(page_width(), HEIGHT)
    shown = drawn_in(results.attrs).attractors
    grid = figure.add_gridspec(len(shown), 1)
    panels: list[Axes] = []
    joined = matched(results)
    for row, (least, name, word) in enumerate(shown):
        axes = figure.add_subplot(grid[row, 0], sharex=panels[0] if panels else None)
        y = quantity(name, units)
        points = [
            (centre, value(one, least, name) / y.scale, one)
            for (some, _), centre in zip(found, centres, strict=True)
            for one in some
        ]
        for centre, height, one in sorted(points, key=lambda p: -p[2].share):
            axes.plot(
                [centre],
                [height],
                linestyle="none",
                **style(one),
                zorder=3,
                gid=f"{name}:{one.response}",
            )
        if joined:
            draw_branches(axes, points, centres, numbered=row == min(1, len(shown) - 1))
        low, high = robust_limits(np.array([height for _, height, _ in points]), 6.0)
        low = min(low, 0.0)
        axes.set_ylim(low - 0.03 * (high - low), high + 0.06 * (high - low))
        axes.set_ylabel(Shown(word, y.unit, y.scale).label)
        axes.tick_params(labelbottom=row == len(shown) - 1)
        panels.append(axes)
    spaced(panels[0], centres)
    name_words(panels[0], results, axis, units=units)
    panels[0].set_xlim(*edges(centres)[[0, -1]])
    panels[-1].set_xlabel(x.label)
    figure.align_ylabels(panels)
    starts = len(results.coords["start"])
    point = operating_point(fixed_values(results), units)
    put_title(figure, heading(results.attrs, f"{point}; {starts} starts each"))
    legend_below(figure, _handles([one for some, _ in found for one in some], joined=joined), 4)
    return figure


def draw_branches(
    axes: Axes, points: list[tuple[float, float, Attractor]], centres: Array, *, numbered: bool
) -> None:
    """A line along each attractor, under the markers, and the numbers of those with a
    share of ``LEAST`` or more."""
    branches: dict[int, list[tuple[float, float, Attractor]]] = {}
    for point in points:
        branches.setdefault(point[2].number, []).append(point)
    for number, branch in branches.items():
        for (x, y, _), (to_x, to_y, _) in pairwise(branch):
            between = np.count_nonzero((centres > min(x, to_x)) & (centres < max(x, to_x)))
            axes.plot(
                [x, to_x],
                [y, to_y],
                color=REFERENCE,
                linewidth=0.5,
                linestyle=":" if between else "-",
                zorder=2,
                gid=f"branch:{number}",
            )
        if numbered and len(branch) > 1 and max(one.share for _, _, one in branch) >= LEAST:
            axes.annotate(
                str(number),
                branch[0][:2],
                (0, 4),
                textcoords="offset points",
                fontsize=type_size(6),
                ha="center",
                va="bottom",
                gid=f"number:{number}",
            )


def value(one: Attractor, least: str | None, name: str) -> float:
    """The median feature of a panel, SI; the range from ``least`` on is between the
    medians of the extremes."""
    return one.features[name] - (one.features[least] if least else 0.0)


def size(share: float) -> float:
    """Diameter in points, by the root of the share; the least that is seen and told
    from others for none."""
    return SMALLEST + (LARGEST - SMALLEST) * math.sqrt(share)


def style(one: Attractor) -> dict[str, Any]:
    response = RESPONSES[one.response]
    loose = one.unsettled > one.members / 2
    return {
        "marker": response.marker,
        "color": response.colour,
        "markersize": size(one.share),
        "markerfacecolor": "none" if loose else response.colour,
        "markeredgewidth": 0.7 if loose else 0.0,
    }


def _handles(every: list[Attractor], *, joined: bool) -> list[Artist]:
    handles = response_entries(sorted({one.response for one in every}))
    if any(one.unsettled > one.members / 2 for one in every):
        handles.append(marker_entry("open: most of its starts unsettled", opened=True))
    if joined:
        handles.append(
            Line2D([], [], color=REFERENCE, linewidth=0.5, label="one attractor; its number")
        )
    for share in (1.0, 0.25, 0.05):
        handles.append(marker_entry(f"share {100 * share:.0f} %", size=size(share)))
    return handles


KINDS = (
    Kind(
        "attractors",
        "radius, axial range and stick-slip index of each attractor along one axis, size by share",
        of=STARTS,
        place=lambda data: 11 if has_starts(data) and len(data.swept) == 1 else None,
        draw=draw,
        uses=lambda model: (
            *USED,
            *(name for one in model.drawn.attractors for name in one[:2] if name),
        ),
        across=lambda data: str(data.swept[0]),
        advice=needs_starts,
    ),
)
