"""Pictures of several starts: the share of them that reaches each response, and the
attractors along an axis."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.analysis.attractors import Attractor, describe, wilson
from nsdrill.data import Array, Results, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.plot.labels import Shown, fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below, marker_entry, response_entries
from nsdrill.plot.registry import STARTS, Kind, needs_starts
from nsdrill.plot.slices import edges, name_words, positions, robust_limits, spaced
from nsdrill.plot.style import REFERENCE, RESPONSES, font_size, name_panel, new_figure, page_width, put_title

ATTRACTOR_VARIABLES = ("attractor", "whirl_kind", "settled")  # variables that describe an attractor


def has_starts(data: Any) -> bool:
    """Whether these are results with several starts of every operating point."""
    return isinstance(data, Results) and "start" in data.coords


def attractors_along(results: Results) -> tuple[str, list[tuple[list[Attractor], dict[str, int]]]]:
    """The swept axis, and the attractors and counts of every operating point along it."""
    attractors_and_counts = list(describe(by_operating_point(results), model_in(results.attrs).distinguishing))
    if not any(attractors for attractors, _ in attractors_and_counts):
        raise InputError(
            "The starts are not grouped into attractors yet: this is done when all points are there. Finish the run."
        )
    return results.swept[0], attractors_and_counts


def is_matched(results: Results) -> bool:
    """Whether a number denotes the same attractor at all operating points. In files of
    older versions it does so at each operating point only, until they are classified
    again."""
    study = resolved_study(results.attrs)
    thresholds = json.loads(results.attrs.get("classification_resolved") or "null") or study.get("classify", {})
    return "matching" in thresholds.get("attractors", {})


def by_operating_point(results: Results) -> dict[str, Array]:
    """The variables on the grid, as arrays [operating point, start]."""
    dimensions = 1 + len(results.shape[1:])
    starts = len(results.coords["start"])
    return {
        name: np.asarray(array).reshape(-1, starts)
        for name, array in results.variables.items()
        if array.ndim == dimensions
    }


def attractor_label(attractor: Attractor) -> str:
    """The description of an attractor in a legend."""
    kinds = (BY_NAME["whirl_kind"].flag_meanings or "").split()
    text = RESPONSES[attractor.response].name
    if attractor.whirl_kind:
        text += f" ({kinds[attractor.whirl_kind].replace('_', ' ')})"
    return text


SHARES_HEIGHT = 3.6
# borders between attractors with smaller shares are not drawn: they would fill the
# column
MIN_DIVIDED_SHARE = 0.02
MIN_NUMBERED_HEIGHT = 8.0  # per cent of the height, for the number of an attractor
BORDER_STYLE: dict[str, Any] = {"linewidth": 0.6, "solid_capstyle": "butt", "zorder": 2.5}
MAX_INTERVALS = 80  # with more operating points only every second, third ... has an interval


def draw_shares(results: Results, units: str = "si") -> Figure:
    axis, by_point = attractors_along(results)
    x = quantity(axis, units)
    centres = positions(results, axis) / x.scale
    borders = edges(centres)
    figure = new_figure(page_width(), SHARES_HEIGHT)
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
    handles: list[Artist] = [Patch(facecolor=RESPONSES[code].colour, label=RESPONSES[code].name) for code in present]
    if is_divided:
        handles.append(
            Line2D([], [], color="white", linewidth=1, label="between attractors", path_effects=_outline_effects())
        )
    if is_sample and len(present) > 1:
        handles.append(marker_entry("95 % interval", "|", "black", size=7, edge=1.0))
    if failed := sum(counts["failed"] for _, counts in by_point):
        handles.append(Patch(facecolor="white", edgecolor="black", linewidth=0.4, label=f"failed, left out ({failed})"))
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


def draw_column(axes: Axes, attractors: list[Attractor], left: float, right: float) -> list[AttractorShare]:
    """Draw the attractors of one operating point, the lowest response first."""
    bottom = 0.0
    shares: list[AttractorShare] = []
    for attractor in sorted(attractors, key=lambda attractor: (attractor.response, attractor.number)):
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
                axes.plot([borders[place + 1]] * 2, [share.bottom, following.bottom], color="white", **BORDER_STYLE)
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


ATTRACTORS_HEIGHT = 6.0
# diameters in points, of the share 1 and of a single start among many
LARGEST_MARKER, SMALLEST_MARKER = 8.0, 2.6
MIN_NUMBERED = 0.05  # of attractors with a number in the picture


def draw_attractors(results: Results, units: str = "si") -> Figure:
    axis, by_point = attractors_along(results)
    x = quantity(axis, units)
    centres = positions(results, axis) / x.scale
    figure = new_figure(page_width(), ATTRACTORS_HEIGHT)
    panels_shown = drawn_in(results.attrs).attractors
    grid = figure.add_gridspec(len(panels_shown), 1)
    panels: list[Axes] = []
    joins_attractors = is_matched(results)
    for row, (lower_name, name, label) in enumerate(panels_shown):
        axes = figure.add_subplot(grid[row, 0], sharex=panels[0] if panels else None)
        y = quantity(name, units)
        points = [
            # a range is taken between the medians of the extremes
            (centre, (attractor.features[name] - attractor.features.get(lower_name or "", 0.0)) / y.scale, attractor)
            for (attractors, _), centre in zip(by_point, centres, strict=True)
            for attractor in attractors
        ]
        for centre, height, attractor in sorted(points, key=lambda point: -point[2].share):
            axes.plot(
                [centre],
                [height],
                linestyle="none",
                **marker_style(attractor),
                zorder=3,
                gid=f"{name}:{attractor.response}",
            )
        if joins_attractors:
            join_attractors(axes, points, centres, with_numbers=row == min(1, len(panels_shown) - 1))
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
        _attractor_handles(
            [attractor for attractors, _ in by_point for attractor in attractors], joins_attractors=joins_attractors
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
            points_between = np.count_nonzero((centres > min(x, next_x)) & (centres < max(x, next_x)))
            axes.plot(
                [x, next_x],
                [y, next_y],
                color=REFERENCE,
                linewidth=0.5,
                linestyle=":" if points_between else "-",
                zorder=2,
                gid=f"branch:{number}",
            )
        if with_numbers and len(members) > 1 and max(attractor.share for _, _, attractor in members) >= MIN_NUMBERED:
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


def marker_diameter(share: float) -> float:
    """The diameter of a marker [points]: it grows with the root of the share, from the
    smallest that can be distinguished."""
    return SMALLEST_MARKER + (LARGEST_MARKER - SMALLEST_MARKER) * math.sqrt(share)


def marker_style(attractor: Attractor) -> dict[str, Any]:
    response = RESPONSES[attractor.response]
    hollow = attractor.unsettled > attractor.members / 2
    return {
        "marker": response.marker,
        "color": response.colour,
        "markersize": marker_diameter(attractor.share),
        "markerfacecolor": "none" if hollow else response.colour,
        "markeredgewidth": 0.7 if hollow else 0.0,
    }


def _attractor_handles(attractors: list[Attractor], *, joins_attractors: bool) -> list[Artist]:
    handles = response_entries(sorted({attractor.response for attractor in attractors}))
    if any(attractor.unsettled > attractor.members / 2 for attractor in attractors):
        handles.append(marker_entry("open: most of its starts unsettled", hollow=True))
    if joins_attractors:
        handles.append(Line2D([], [], color=REFERENCE, linewidth=0.5, label="one attractor; its number"))
    for share in (1.0, 0.25, 0.05):
        handles.append(marker_entry(f"share {100 * share:.0f} %", size=marker_diameter(share)))
    return handles


KINDS = (
    Kind(
        "shares",
        "shares of the starts by response and attractor along one axis, with 95 % intervals",
        of=STARTS,
        place=lambda data: 10 if has_starts(data) and len(data.swept) == 1 else None,
        draw=draw_shares,
        uses=lambda model: ATTRACTOR_VARIABLES,
        across=lambda data: str(data.swept[0]),
        advice=needs_starts,
    ),
    Kind(
        "attractors",
        "radius, axial range and stick-slip index of each attractor along one axis, size by share",
        of=STARTS,
        place=lambda data: 11 if has_starts(data) and len(data.swept) == 1 else None,
        draw=draw_attractors,
        uses=lambda model: (
            *ATTRACTOR_VARIABLES,
            *(name for panel in model.drawn.attractors for name in panel[:2] if name),
        ),
        across=lambda data: str(data.swept[0]),
        advice=needs_starts,
    ),
)
