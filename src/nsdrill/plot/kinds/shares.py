"""Shares of the starts along one axis: a column for every operating point, stacked by
response, divided by attractor.

Within a response the attractors are stacked by number, so that one attractor is a band
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
from nsdrill.plot.starts import USED, along, has_starts, matched
from nsdrill.plot.style import RESPONSES, new_figure, page_width, put_title, type_size

HEIGHT = 3.6
# borders of attractors with a smaller share are not drawn: their columns would be all
# border
LEAST = 0.02
ROOM = 8.0  # per cent of the height that the number of an attractor needs
BORDER: dict[str, Any] = {"linewidth": 0.6, "solid_capstyle": "butt", "zorder": 2.5}
MOST_BARS = 80  # with more operating points every second, third ... has its interval


def draw(results: Results, units: str = "si") -> Figure:
    axis, found = along(results)
    x = quantity(axis, units)
    centres = positions(results, axis) / x.scale
    borders = edges(centres)
    figure = new_figure(page_width(), HEIGHT)
    axes = figure.add_subplot()
    present = [
        code
        for code in range(len(RESPONSES))
        if any(a.response == code for some, _ in found for a in some)
    ]
    columns = [
        draw_column(axes, some, left, right)
        for (some, _), left, right in zip(found, borders[:-1], borders[1:], strict=True)
    ]
    divided = any(one.divided for column in columns for one in column)
    if matched(results):
        draw_bands(axes, columns, borders)
    sampled = not results.slice
    if sampled:
        draw_intervals(axes, found, present, centres)
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
    if divided:
        handles.append(
            Line2D(
                [],
                [],
                color="white",
                linewidth=1,
                label="between attractors",
                path_effects=_outlined(),
            )
        )
    if sampled and len(present) > 1:
        handles.append(marker_entry("95 % interval", "|", "black", size=7, edge=1.0))
    if failed := sum(counts["failed"] for _, counts in found):
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


def _outlined() -> list[object]:
    from matplotlib.patheffects import Normal, Stroke

    return [Stroke(linewidth=2.2, foreground="#808080"), Normal()]


@dataclass(frozen=True)
class Part:
    """What an attractor has of a column: from ``bottom`` over ``height`` [%], and
    whether the border below it was drawn."""

    of: Attractor
    bottom: float
    height: float
    divided: bool


def draw_column(axes: Axes, some: list[Attractor], left: float, right: float) -> list[Part]:
    """The attractors of one operating point, lowest response first."""
    bottom = 0.0
    parts: list[Part] = []
    for one in sorted(some, key=lambda a: (a.response, a.number)):
        height = 100 * one.share
        axes.fill_between(
            [left, right],
            bottom,
            bottom + height,
            facecolor=RESPONSES[one.response].colour,
            edgecolor=RESPONSES[one.response].colour,
            linewidth=0.2,
            gid=f"attractor:{one.number}:{one.response}",
        )
        before = parts[-1].of if parts else None
        divided = (
            before is not None
            and before.response == one.response
            and max(before.share, one.share) >= LEAST
        )
        if divided:
            axes.plot([left, right], [bottom, bottom], color="white", **BORDER)
        parts.append(Part(one, bottom, height, divided))
        bottom += height
    return parts


def draw_bands(axes: Axes, columns: list[list[Part]], borders: Array) -> None:
    """What shows that an attractor goes on: the steps of its lower border, and its
    number where its band is widest."""
    bands: dict[tuple[int, int], dict[int, Part]] = {}
    for place, column in enumerate(columns):
        for part in column:
            bands.setdefault((part.of.number, part.of.response), {})[place] = part
    for (number, response), parts in bands.items():
        for place, part in parts.items():
            if part.divided and (after := parts.get(place + 1)) and after.divided:
                axes.plot(
                    [borders[place + 1]] * 2, [part.bottom, after.bottom], color="white", **BORDER
                )
        for run in np.split(list(parts), 1 + np.flatnonzero(np.diff(list(parts)) > 1)):
            place = max(run.tolist(), key=lambda i: parts[i].height)
            if (widest := parts[place]).height >= ROOM:
                dark = np.dot(to_rgb(RESPONSES[response].colour), (0.299, 0.587, 0.114)) < 0.5
                axes.text(
                    (borders[place] + borders[place + 1]) / 2,
                    widest.bottom + widest.height / 2,
                    str(number),
                    color="white" if dark else "black",
                    fontsize=type_size(6),
                    ha="center",
                    va="center",
                    clip_on=True,
                    gid=f"number:{number}:{response}",
                )


def draw_intervals(
    axes: Axes, found: list[tuple[list[Attractor], dict[str, int]]], present: list[int], x: Array
) -> None:
    """At every border between responses the interval of the share below it."""
    every = -(-len(found) // MOST_BARS)
    for (some, _), centre in list(zip(found, x, strict=True))[::every]:
        total = sum(one.members for one in some)
        for code in present[:-1]:
            below = sum(one.members for one in some if one.response <= code)
            here = any(one.response == code for one in some)
            if total and (here or below in (0, total)) and 0 < below < total:
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
        uses=lambda model: USED,
        across=lambda data: str(data.swept[0]),
        advice=needs_starts,
    ),
)
