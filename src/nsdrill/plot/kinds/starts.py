"""Pictures of several starts: the share of them that reaches each response, and the
attractors along an axis."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeGuard

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke

from nsdrill.analysis.attractors import Attractor, describe, wilson
from nsdrill.data import Array, Results, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.registry import BY_NAME, drawn_in, model_in
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.plot.labels import Shown, quantity, sweep_title
from nsdrill.plot.page import (
    area_entry,
    finish,
    line_entry,
    marker_entry,
    name_panel,
    new_figure,
    response_entries,
    stack,
    write,
)
from nsdrill.plot.registry import STARTS, Kind, needs_starts
from nsdrill.plot.slices import edges, lay_along, positions, robust_limits
from nsdrill.plot.style import REFERENCE, RESPONSES, Properties, font_size, ink_on, page_width

ATTRACTOR_VARIABLES = ("attractor", *RESPONSE_KINDS, "settled")  # variables that describe an attractor
UNGROUPED = "The starts are not grouped into attractors yet: this is done when all points are there. Finish the run."


def has_starts(data: object) -> TypeGuard[Results]:
    """Whether these are results with several starts of every operating point."""
    return isinstance(data, Results) and "start" in data.coords


def by_operating_point(results: Results) -> dict[str, Array]:
    """The variables on the grid, as arrays [operating point, start]."""
    starts, dimensions = len(results.coords["start"]), 1 + len(results.shape[1:])
    on_grid = {name: np.asarray(array) for name, array in results.variables.items() if array.ndim == dimensions}
    return {name: array.reshape(-1, starts) for name, array in on_grid.items()}


def attractor_label(attractor: Attractor) -> str:
    """The description of an attractor in a legend."""
    words = (BY_NAME[name].words(value).replace("_", " ") for name, value in attractor.kinds.items() if value)
    return RESPONSES[attractor.response].name + "".join(f" ({word})" for word in words)


class Along:
    """The attractors and counts of every operating point along the axis that is swept,
    which has these ``centres`` in the units that are shown."""

    def __init__(self, results: Results, units: str) -> None:
        self.results, self.units, self.axis = results, units, results.swept[0]
        described = list(describe(by_operating_point(results), model_in(results.attrs).distinguishing))
        self.points = [attractors for attractors, _ in described]
        self.failed = sum(counts["failed"] for _, counts in described)
        self.attractors = [attractor for attractors in self.points for attractor in attractors]
        if not self.attractors:
            raise InputError(UNGROUPED)
        self.centres = positions(results, self.axis) / quantity(self.axis, units).scale
        # the responses that occur
        self.present = sorted({attractor.response for attractor in self.attractors})

    @property
    def is_matched(self) -> bool:
        """Whether a number denotes the same attractor at all operating points. In files
        of older versions it does so at each operating point only, until they are
        classified again."""
        study, attrs = resolved_study(self.results.attrs), self.results.attrs
        thresholds = json.loads(attrs.get("classification_resolved") or "null") or study.get("classify", {})
        return "matching" in thresholds.get("attractors", {})

    def finish(self, figure: Figure, axes: Axes, handles: list[Artist]) -> Figure:
        """The figure with its axis along the lowest panel, its title and its legend."""
        lay_along(axes, self.results, self.axis, self.units)
        title = sweep_title(self.results, self.units, f"{len(self.results.coords['start'])} starts each")
        return finish(figure, title, handles, 4)


SHARES_HEIGHT = 3.6
# borders between attractors with smaller shares are not drawn: they would fill the
# column
MIN_DIVIDED_SHARE = 0.02
MIN_NUMBERED_HEIGHT = 8.0  # per cent of the height, for the number of an attractor
BORDER_STYLE: Properties = {"color": "white", "linewidth": 0.6, "solid_capstyle": "butt", "zorder": 2.5}
MAX_INTERVALS = 80  # with more operating points only every second, third ... has an interval


def draw_shares(results: Results, units: str = "si") -> Figure:
    along = Along(results, units)
    borders = edges(along.centres)
    figure = new_figure(page_width(), SHARES_HEIGHT)
    axes = figure.add_subplot()
    columns = [
        draw_column(axes, attractors, left, right)
        for attractors, left, right in zip(along.points, borders[:-1], borders[1:], strict=True)
    ]
    if along.is_matched:
        draw_bands(axes, columns, borders)
    is_sample = not results.slice
    if is_sample:
        draw_intervals(axes, along)
    axes.set(ylim=(0, 100), ylabel=f"Share of the {'starts' if is_sample else 'slice'} [%]")
    handles: list[Artist] = [
        area_entry(facecolor=RESPONSES[code].colour, label=RESPONSES[code].name) for code in along.present
    ]
    if any(share.is_divided for column in columns for share in column):
        outline = [Stroke(linewidth=2.2, foreground="#808080"), Normal()]
        handles.append(line_entry(color="white", linewidth=1, label="between attractors", path_effects=outline))
    if is_sample and len(along.present) > 1:
        handles.append(marker_entry("95 % interval", "|", "black", size=7, edge=1.0))
    if along.failed:
        label = f"failed, left out ({along.failed})"
        handles.append(area_entry(facecolor="white", edgecolor="black", linewidth=0.4, label=label))
    return along.finish(figure, axes, handles)


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
        top, colour = bottom + 100 * attractor.share, RESPONSES[attractor.response].colour
        gid = f"attractor:{attractor.number}:{attractor.response}"
        axes.fill_between([left, right], bottom, top, facecolor=colour, edgecolor=colour, linewidth=0.2, gid=gid)
        below = shares[-1].attractor if shares else None
        is_divided = (
            below is not None
            and below.response == attractor.response
            and max(below.share, attractor.share) >= MIN_DIVIDED_SHARE
        )
        if is_divided:
            axes.plot([left, right], [bottom, bottom], **BORDER_STYLE)
        shares.append(AttractorShare(attractor, bottom, 100 * attractor.share, is_divided))
        bottom = top
    return shares


def draw_bands(axes: Axes, columns: list[list[AttractorShare]], borders: Array) -> None:
    """Connect the attractors along the axis: draw the steps of their lower borders, and
    their numbers where their bands are widest."""
    bands: dict[tuple[int, int], dict[int, AttractorShare]] = {}
    for place, column in enumerate(columns):
        for share in column:
            bands.setdefault((share.attractor.number, share.attractor.response), {})[place] = share
    centred: Properties = {"ha": "center", "va": "center", "clip_on": True, "fontsize": font_size(6)}
    for (number, response), shares in bands.items():
        for place, share in shares.items():
            if share.is_divided and (following := shares.get(place + 1)) and following.is_divided:
                axes.plot([borders[place + 1]] * 2, [share.bottom, following.bottom], **BORDER_STYLE)
        for consecutive in np.split(list(shares), 1 + np.flatnonzero(np.diff(list(shares)) > 1)):
            place = max(consecutive.tolist(), key=lambda i: shares[i].height)
            if (widest := shares[place]).height >= MIN_NUMBERED_HEIGHT:
                middle = (borders[place] + borders[place + 1]) / 2, widest.bottom + widest.height / 2
                colour, gid = ink_on(RESPONSES[response].colour), f"number:{number}:{response}"
                axes.text(*middle, str(number), color=colour, gid=gid, **centred)


def draw_intervals(axes: Axes, along: Along) -> None:
    """Draw at every border between responses the interval of the share below it."""
    stride = -(-len(along.points) // MAX_INTERVALS)
    for attractors, centre in list(zip(along.points, along.centres, strict=True))[::stride]:
        total = sum(attractor.members for attractor in attractors)
        for code in along.present[:-1]:
            below = sum(attractor.members for attractor in attractors if attractor.response <= code)
            if 0 < below < total and any(attractor.response == code for attractor in attractors):
                ends = [100 * end for end in wilson(below, total)]
                axes.plot([centre, centre], ends, color="black", linewidth=0.9, zorder=3, gid=f"interval:{code}")


ATTRACTORS_HEIGHT = 6.0
# diameters in points, of the share 1 and of a single start among many
LARGEST_MARKER, SMALLEST_MARKER = 8.0, 2.6
MIN_NUMBERED = 0.05  # of attractors with a number in the picture


def draw_attractors(results: Results, units: str = "si") -> Figure:
    along, shown = Along(results, units), drawn_in(results.attrs).attractors
    figure = new_figure(page_width(), ATTRACTORS_HEIGHT)
    panels = stack(figure, len(shown))
    for axes, (lower_name, name, label) in zip(panels, shown, strict=True):
        y = quantity(name, units)
        points = [
            # a range is taken between the medians of the extremes
            (centre, (attractor.features[name] - attractor.features.get(lower_name or "", 0.0)) / y.scale, attractor)
            for attractors, centre in zip(along.points, along.centres, strict=True)
            for attractor in attractors
        ]
        for centre, height, attractor in sorted(points, key=lambda point: -point[2].share):
            gid = f"{name}:{attractor.response}"
            response, hollow = RESPONSES[attractor.response], attractor.unsettled > attractor.members / 2
            axes.plot(
                [centre],
                [height],
                linestyle="none",
                marker=response.marker,
                color=response.colour,
                markersize=marker_diameter(attractor.share),
                markerfacecolor="none" if hollow else response.colour,
                markeredgewidth=0.7 if hollow else 0.0,
                zorder=3,
                gid=gid,
            )
        if along.is_matched:
            join_attractors(axes, points, along.centres)
        low, high = robust_limits(np.array([height for _, height, _ in points]), 6.0)
        low = min(low, 0.0)
        axes.set_ylim(low - 0.03 * (high - low), high + 0.12 * (high - low))  # room for a number above
        axes.set_ylabel(Shown(label, y.unit, y.scale).label)
        name_panel(axes, name, name)
    figure.align_ylabels(panels)
    handles = response_entries(along.present)
    if any(attractor.unsettled > attractor.members / 2 for attractor in along.attractors):
        handles.append(marker_entry("open: most of its starts unsettled", hollow=True))
    if along.is_matched:
        handles.append(line_entry(color=REFERENCE, linewidth=0.5, label="one attractor; its number"))
    for share in (1.0, 0.25, 0.05):
        handles.append(marker_entry(f"share {100 * share:.0f} %", size=marker_diameter(share)))
    return along.finish(figure, panels[-1], handles)


def join_attractors(axes: Axes, points: list[tuple[float, float, Attractor]], centres: Array) -> None:
    """Draw a line along each attractor, under the markers, and the numbers of those
    with a share of ``MIN_NUMBERED`` or more."""
    lines: dict[int, list[tuple[float, float, Attractor]]] = {}
    for point in points:
        lines.setdefault(point[2].number, []).append(point)
    style: Properties = {"color": REFERENCE, "linewidth": 0.5, "zorder": 2}
    for number, members in lines.items():
        for (x, y, _), (next_x, next_y, _) in pairwise(members):
            between = np.any((centres > min(x, next_x)) & (centres < max(x, next_x)))
            axes.plot([x, next_x], [y, next_y], linestyle=":" if between else "-", gid=f"branch:{number}", **style)
        if len(members) > 1 and max(attractor.share for _, _, attractor in members) >= MIN_NUMBERED:
            write(axes, str(number), members[0][:2], (0, 4), ha="center", va="bottom", gid=f"number:{number}")


def marker_diameter(share: float) -> float:
    """The diameter of a marker [points]: it grows with the root of the share, from the
    smallest that can be distinguished."""
    return SMALLEST_MARKER + (LARGEST_MARKER - SMALLEST_MARKER) * math.sqrt(share)


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
