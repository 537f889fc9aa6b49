"""The attractors along one axis: a marker for each, its size by share, its colour and
shape by response, open where most of its members are unsettled. A line joins the
markers of the same attractor, dotted where no start reaches it at an operating point in
between."""

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
from nsdrill.plot.starts import ATTRACTOR_VARIABLES, attractors_along, has_starts, is_matched
from nsdrill.plot.style import (
    REFERENCE,
    RESPONSES,
    font_size,
    name_panel,
    new_figure,
    page_width,
    put_title,
)

HEIGHT = 6.0
# diameters in points, of the share 1 and of a single start among many
LARGEST_MARKER, SMALLEST_MARKER = 8.0, 2.6
MIN_SHARE = 0.05  # of attractors with a number in the picture


def draw(results: Results, units: str = "si") -> Figure:
    axis, by_point = attractors_along(results)
    x = quantity(axis, units)
    centres = positions(results, axis) / x.scale
    figure = new_figure(page_width(), HEIGHT)
    panels_shown = drawn_in(results.attrs).attractors
    grid = figure.add_gridspec(len(panels_shown), 1)
    panels: list[Axes] = []
    joins_attractors = is_matched(results)
    for row, (lower_name, name, label) in enumerate(panels_shown):
        axes = figure.add_subplot(grid[row, 0], sharex=panels[0] if panels else None)
        y = quantity(name, units)
        points = [
            (centre, value(attractor, lower_name, name) / y.scale, attractor)
            for (attractors, _), centre in zip(by_point, centres, strict=True)
            for attractor in attractors
        ]
        for centre, height, attractor in sorted(points, key=lambda point: -point[2].share):
            axes.plot(
                [centre],
                [height],
                linestyle="none",
                **style(attractor),
                zorder=3,
                gid=f"{name}:{attractor.response}",
            )
        if joins_attractors:
            join_attractors(
                axes, points, centres, with_numbers=row == min(1, len(panels_shown) - 1)
            )
        low, high = robust_limits(np.array([height for _, height, _ in points]), 6.0)
        low = min(low, 0.0)
        axes.set_ylim(low - 0.03 * (high - low), high + 0.06 * (high - low))
        axes.set_ylabel(Shown(label, y.unit, y.scale).label)
        name_panel(axes, name, name)
        axes.tick_params(labelbottom=row == len(panels_shown) - 1)
        panels.append(axes)
    spaced(panels[0], centres)
    name_words(panels[0], results, axis, units=units)
    panels[0].set_xlim(*edges(centres)[[0, -1]])
    panels[-1].set_xlabel(x.label)
    figure.align_ylabels(panels)
    starts = len(results.coords["start"])
    point_text = operating_point(fixed_values(results), units)
    put_title(figure, heading(results.attrs, f"{point_text}; {starts} starts each"))
    legend_below(
        figure,
        _handles(
            [attractor for attractors, _ in by_point for attractor in attractors],
            joins_attractors=joins_attractors,
        ),
        4,
    )
    return figure


def join_attractors(
    axes: Axes, points: list[tuple[float, float, Attractor]], centres: Array, *, with_numbers: bool
) -> None:
    """Draw a line along each attractor, under the markers, and the numbers of those
    with a share of ``MIN_SHARE`` or more."""
    lines: dict[int, list[tuple[float, float, Attractor]]] = {}
    for point in points:
        lines.setdefault(point[2].number, []).append(point)
    for number, members in lines.items():
        for (x, y, _), (next_x, next_y, _) in pairwise(members):
            points_between = np.count_nonzero(
                (centres > min(x, next_x)) & (centres < max(x, next_x))
            )
            axes.plot(
                [x, next_x],
                [y, next_y],
                color=REFERENCE,
                linewidth=0.5,
                linestyle=":" if points_between else "-",
                zorder=2,
                gid=f"branch:{number}",
            )
        if (
            with_numbers
            and len(members) > 1
            and max(attractor.share for _, _, attractor in members) >= MIN_SHARE
        ):
            axes.annotate(
                str(number),
                members[0][:2],
                (0, 4),
                textcoords="offset points",
                fontsize=font_size(6),
                ha="center",
                va="bottom",
                gid=f"number:{number}",
            )


def value(attractor: Attractor, lower_name: str | None, name: str) -> float:
    """The median of the feature of a panel [SI], less that of ``lower_name`` if given:
    a range is taken between the medians of the extremes."""
    return attractor.features[name] - (attractor.features[lower_name] if lower_name else 0.0)


def size(share: float) -> float:
    """The diameter of a marker [points]: it grows with the root of the share, from the
    smallest that can be distinguished."""
    return SMALLEST_MARKER + (LARGEST_MARKER - SMALLEST_MARKER) * math.sqrt(share)


def style(attractor: Attractor) -> dict[str, Any]:
    response = RESPONSES[attractor.response]
    hollow = attractor.unsettled > attractor.members / 2
    return {
        "marker": response.marker,
        "color": response.colour,
        "markersize": size(attractor.share),
        "markerfacecolor": "none" if hollow else response.colour,
        "markeredgewidth": 0.7 if hollow else 0.0,
    }


def _handles(attractors: list[Attractor], *, joins_attractors: bool) -> list[Artist]:
    handles = response_entries(sorted({attractor.response for attractor in attractors}))
    if any(attractor.unsettled > attractor.members / 2 for attractor in attractors):
        handles.append(marker_entry("open: most of its starts unsettled", hollow=True))
    if joins_attractors:
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
            *ATTRACTOR_VARIABLES,
            *(name for panel in model.drawn.attractors for name in panel[:2] if name),
        ),
        across=lambda data: str(data.swept[0]),
        advice=needs_starts,
    ),
)
