"""Shares of the starts along one axis: a column for every operating point, stacked by
response and divided by attractor.

Within a response the attractors are stacked by number, so that an attractor is a band
along the axis.

The bars at the borders between responses are 95 % intervals of the share below that
border; none where the starts are a slice, which is no sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.analysis.attractors import Attractor, wilson
from nsdrill.data import Array, Results
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below, marker_entry
from nsdrill.plot.registry import STARTS, Kind, needs_starts
from nsdrill.plot.slices import edges, name_words, positions, spaced
from nsdrill.plot.starts import ATTRACTOR_VARIABLES, attractors_along, has_starts, is_matched
from nsdrill.plot.style import RESPONSES, font_size, new_figure, page_width, put_title

HEIGHT = 3.6
# borders between attractors with smaller shares are not drawn: they would fill the
# column
MIN_DIVIDED_SHARE = 0.02
MIN_NUMBERED_HEIGHT = 8.0  # per cent of the height, for the number of an attractor
BORDER_STYLE: dict[str, Any] = {"linewidth": 0.6, "solid_capstyle": "butt", "zorder": 2.5}
MAX_INTERVALS = 80  # with more operating points only every second, third ... has an interval


def draw(results: Results, units: str = "si") -> Figure:
    axis, by_point = attractors_along(results)
    x = quantity(axis, units)
    centres = positions(results, axis) / x.scale
    borders = edges(centres)
    figure = new_figure(page_width(), HEIGHT)
    axes = figure.add_subplot()
    present = [
        code
        for code in range(len(RESPONSES))
        if any(attractor.response == code for attractors, _ in by_point for attractor in attractors)
    ]
    columns = [
        draw_column(axes, attractors, left, right)
        for (attractors, _), left, right in zip(by_point, borders[:-1], borders[1:], strict=True)
    ]
    is_divided = any(share.is_divided for column in columns for share in column)
    if is_matched(results):
        draw_bands(axes, columns, borders)
    is_sample = not results.slice
    if is_sample:
        draw_intervals(axes, by_point, present, centres)
    spaced(axes, centres)
    name_words(axes, results, axis, units=units)
    axes.set_xlim(borders[0], borders[-1])
    axes.set_ylim(0, 100)
    axes.set_xlabel(x.label)
    axes.set_ylabel("Share of the slice [%]" if results.slice else "Share of the starts [%]")
    starts = len(results.coords["start"])
    point = operating_point(fixed_values(results), units)
    put_title(figure, heading(results.attrs, f"{point}; {starts} starts each"))
    handles: list[Artist] = [
        Patch(facecolor=RESPONSES[code].colour, label=RESPONSES[code].name) for code in present
    ]
    if is_divided:
        handles.append(
            Line2D(
                [],
                [],
                color="white",
                linewidth=1,
                label="between attractors",
                path_effects=_outline_effects(),
            )
        )
    if is_sample and len(present) > 1:
        handles.append(marker_entry("95 % interval", "|", "black", size=7, edge=1.0))
    if failed := sum(counts["failed"] for _, counts in by_point):
        handles.append(
            Patch(
                facecolor="white",
                edgecolor="black",
                linewidth=0.4,
                label=f"failed, left out ({failed})",
            )
        )
    legend_below(figure, handles, 4)
    return figure


def _outline_effects() -> list[object]:
    from matplotlib.patheffects import Normal, Stroke

    return [Stroke(linewidth=2.2, foreground="#808080"), Normal()]


@dataclass(frozen=True)
class AttractorShare:
    """The share of an attractor in a column: from ``bottom`` over ``height`` [%], and
    whether the border below it was drawn."""

    attractor: Attractor
    bottom: float
    height: float
    is_divided: bool


def draw_column(
    axes: Axes, attractors: list[Attractor], left: float, right: float
) -> list[AttractorShare]:
    """Draw the attractors of one operating point, the lowest response first."""
    bottom = 0.0
    shares: list[AttractorShare] = []
    for attractor in sorted(
        attractors, key=lambda attractor: (attractor.response, attractor.number)
    ):
        height = 100 * attractor.share
        axes.fill_between(
            [left, right],
            bottom,
            bottom + height,
            facecolor=RESPONSES[attractor.response].colour,
            edgecolor=RESPONSES[attractor.response].colour,
            linewidth=0.2,
            gid=f"attractor:{attractor.number}:{attractor.response}",
        )
        previous = shares[-1].attractor if shares else None
        is_divided = (
            previous is not None
            and previous.response == attractor.response
            and max(previous.share, attractor.share) >= MIN_DIVIDED_SHARE
        )
        if is_divided:
            axes.plot([left, right], [bottom, bottom], color="white", **BORDER_STYLE)
        shares.append(AttractorShare(attractor, bottom, height, is_divided))
        bottom += height
    return shares


def draw_bands(axes: Axes, columns: list[list[AttractorShare]], borders: Array) -> None:
    """Connect the attractors along the axis: draw the steps of their lower borders, and
    their numbers where their bands are widest."""
    bands: dict[tuple[int, int], dict[int, AttractorShare]] = {}
    for place, column in enumerate(columns):
        for share in column:
            bands.setdefault((share.attractor.number, share.attractor.response), {})[place] = share
    for (number, response), shares in bands.items():
        for place, share in shares.items():
            if share.is_divided and (following := shares.get(place + 1)) and following.is_divided:
                axes.plot(
                    [borders[place + 1]] * 2,
                    [share.bottom, following.bottom],
                    color="white",
                    **BORDER_STYLE,
                )
        for consecutive in np.split(list(shares), 1 + np.flatnonzero(np.diff(list(shares)) > 1)):
            place = max(consecutive.tolist(), key=lambda i: shares[i].height)
            if (widest := shares[place]).height >= MIN_NUMBERED_HEIGHT:
                is_dark = np.dot(to_rgb(RESPONSES[response].colour), (0.299, 0.587, 0.114)) < 0.5
                axes.text(
                    (borders[place] + borders[place + 1]) / 2,
                    widest.bottom + widest.height / 2,
                    str(number),
                    color="white" if is_dark else "black",
                    fontsize=font_size(6),
                    ha="center",
                    va="center",
                    clip_on=True,
                    gid=f"number:{number}:{response}",
                )


def draw_intervals(
    axes: Axes, by_point: list[tuple[list[Attractor], dict[str, int]]], present: list[int], x: Array
) -> None:
    """Draw at every border between responses the interval of the share below it."""
    stride = -(-len(by_point) // MAX_INTERVALS)
    for (attractors, _), centre in list(zip(by_point, x, strict=True))[::stride]:
        total = sum(attractor.members for attractor in attractors)
        for code in present[:-1]:
            below = sum(attractor.members for attractor in attractors if attractor.response <= code)
            occurs = any(attractor.response == code for attractor in attractors)
            if total and (occurs or below in (0, total)) and 0 < below < total:
                low, high = wilson(below, total)
                axes.plot(
                    [centre, centre],
                    [100 * low, 100 * high],
                    color="black",
                    linewidth=0.9,
                    zorder=3,
                    gid=f"interval:{code}",
                )


KINDS = (
    Kind(
        "shares",
        "shares of the starts by response and attractor along one axis, with 95 % intervals",
        of=STARTS,
        place=lambda data: 10 if has_starts(data) and len(data.swept) == 1 else None,
        draw=draw,
        uses=lambda model: ATTRACTOR_VARIABLES,
        across=lambda data: str(data.swept[0]),
        advice=needs_starts,
    ),
)
