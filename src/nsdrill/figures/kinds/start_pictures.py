"""Pictures of several starts along an axis: the share of them that reaches each response,
and the attractors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import chain, pairwise, product

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke

from nsdrill.analysis.attractors import Attractor, describe, wilson
from nsdrill.analysis.safety import known_runs
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.figures.page import (
    area_entry,
    lay_up,
    line_entry,
    marker_entry,
    response_entries,
    stack,
    style_areas,
    write,
)
from nsdrill.figures.painters import Page
from nsdrill.figures.picture_kinds import STARTS, Kind, has_starts, needs_starts
from nsdrill.figures.slices import edges, lay_along, positions, robust_limits
from nsdrill.figures.style import REFERENCE, Properties, ResponseStyle, font_size, halo, ink_on, page_width, styles_of
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.records import dataclass
from nsdrill.words.labels import Shown, quantity, sweep_title

ATTRACTOR_VARIABLES = ("attractor", *RESPONSE_KINDS, "settled")  # variables that describe an attractor
UNGROUPED = "The starts are not grouped into attractors yet: this is done when all points are there. Finish the run."
NOTHING_KNOWN = "No start is on a known attractor: all failed, are off speed, or rest on an unstable motion."


def by_operating_point(results: Results) -> dict[str, Array]:
    """The variables on the grid, as arrays [operating point, start]."""
    starts, dimensions = len(results.coords["start"]), 1 + len(results.shape[1:])
    on_grid = {name: np.asarray(array) for name, array in results.variables.items() if array.ndim == dimensions}
    return {name: array.reshape(-1, starts) for name, array in on_grid.items()}


def described_starts(results: Results) -> list[tuple[list[Attractor], dict[str, int]]]:
    """The attractors and the counts of starts of each operating point."""
    is_known = known_runs(results).reshape(-1, len(results.coords["start"]))
    return list(describe(by_operating_point(results), is_known, model_in(results.attrs).distinguishing))


class Along:
    """The attractors and counts of every operating point along the axis that is swept,
    which has these ``centres`` in the units that are shown."""

    def __init__(self, results: Results, units: str) -> None:
        self.results, self.units, self.axis = results, units, results.swept[0]
        described = described_starts(results)
        self.points = [attractors for attractors, _ in described]
        # of each operating point, and of all: starts, known, failed and pending ones
        self.counts = [counts for _, counts in described]
        self.total = {name: sum(counts[name] for counts in self.counts) for name in ("starts", "failed", "unsettled")}
        self.unknown = self.total["starts"] - sum(counts["known"] for counts in self.counts)
        self.attractors = [attractor for attractors in self.points for attractor in attractors]
        if not self.attractors:
            is_open = any(counts["ungrouped"] or counts["pending"] for counts in self.counts)
            raise InputError(UNGROUPED if is_open else NOTHING_KNOWN)
        self.centres = positions(results, self.axis) / quantity(self.axis, units).scale
        self.styles = styles_of(results.attrs)
        # the responses that occur
        self.present = sorted({attractor.response for attractor in self.attractors})

    def lie(self, axes: Axes) -> None:
        """Let the axis that is swept lie along x of a panel."""
        lay_along(axes, self.results, self.axis, self.units)

    @property
    def title(self) -> str:
        return sweep_title(self.results, self.units, f"{len(self.results.coords['start'])} starts each")


Styles = Sequence[ResponseStyle]  # by the response bits
SHARES_HEIGHT = 3.6
UNKNOWN_HATCH = "xxxxxx"
# borders between attractors with smaller shares are not drawn: they would fill the
# column
MIN_DIVIDED_SHARE = 0.02
MIN_NUMBERED_HEIGHT = 8.0  # per cent of the height, for the number of an attractor
BORDER_STYLE: Properties = {
    "color": "white",
    "linewidth": 0.6,
    "solid_capstyle": "butt",
    "zorder": 2.5,
    "gid": "border",
}
MAX_INTERVALS = 80  # with more operating points only every second, third ... has an interval


def shares(results: Results, units: str = "si") -> Page:
    along = Along(results, units)
    borders, is_sample = edges(along.centres), not results.slice

    def paint(axes: Axes) -> None:
        columns = [
            draw_column(axes, along.styles, attractors, counts["starts"], left, right)
            for attractors, counts, (left, right) in zip(along.points, along.counts, pairwise(borders), strict=True)
        ]
        draw_bands(axes, along.styles, columns, borders, beside=is_sample)
        if is_sample:
            draw_intervals(axes, along)
        axes.set(ylim=(0, 100), ylabel=f"Share of the {'starts' if is_sample else 'slice'} [%]")
        if along.unknown:
            mark_unknown(axes, along, borders)
        along.lie(axes)

    outline = [Stroke(linewidth=2.2, foreground="#808080"), Normal()]
    between = line_entry(color="white", linewidth=1, label="between attractors", path_effects=outline, gid="border")
    entries = [*style_areas(along.styles, along.present), between]
    if is_sample and len(along.present) > 1:
        entries.append(marker_entry("95 % interval", "|", "black", size=7, edge=1.0))
    if along.unknown:
        label = f"not known ({along.unknown} of {along.total['starts']}, {along.total['failed']} failed)"
        style: Properties = {"facecolor": "white", "edgecolor": "black", "linewidth": 0.4, "hatch": UNKNOWN_HATCH}
        entries.append(area_entry(label=label, **style))
    return Page({"panel": paint}, along.title, page_width(), SHARES_HEIGHT, entries=lambda panels: entries)


def mark_unknown(axes: Axes, along: Along, borders: Array) -> None:
    """Hatch the part of each column of the starts that are not known."""
    for counts, (left, right) in zip(along.counts, pairwise(borders), strict=True):
        if part := 1.0 - counts["known"] / counts["starts"]:
            style: Properties = {"facecolor": "white", "edgecolor": "black", "linewidth": 0, "hatch": UNKNOWN_HATCH}
            axes.fill_between([left, right], 100 * (1.0 - part), 100, gid="unknown", **style)


@dataclass(frozen=True)
class Share:
    """The share of an attractor in a column: from ``bottom`` over ``height`` [%]."""

    attractor: Attractor
    bottom: float
    height: float

    def is_divided_from(self, other: Share) -> bool:
        """Whether there is a border to this one."""
        one, two = self.attractor, other.attractor
        differ = one.response == two.response and one.number != two.number
        return differ and max(one.share, two.share) >= MIN_DIVIDED_SHARE


def draw_column(
    axes: Axes, styles: Styles, attractors: list[Attractor], starts: int, left: float, right: float
) -> list[Share]:
    """Draw the attractors of one operating point, the lowest response first, as parts of
    all its ``starts``; those that are not known remain free above."""
    bottom = 0.0
    shares: list[Share] = []
    for attractor in sorted(attractors, key=lambda attractor: (attractor.response, attractor.number)):
        height, colour = 100 * attractor.members / starts, styles[attractor.response].colour
        gid = f"attractor:{attractor.number}:{attractor.response}"
        area: Properties = {"facecolor": colour, "edgecolor": colour, "linewidth": 0.2, "gid": gid}
        axes.fill_between([left, right], bottom, bottom + height, **area)
        shares.append(Share(attractor, bottom, height))
        bottom += height
    for below, share in pairwise(shares):
        if share.is_divided_from(below):
            axes.plot([left, right], [share.bottom] * 2, **BORDER_STYLE)
    return shares


def draw_bands(axes: Axes, styles: Styles, columns: list[list[Share]], borders: Array, *, beside: bool) -> None:
    """Divide the attractors of neighbouring columns, and write their numbers where their
    bands are widest, ``beside`` the middle of a column or in it."""
    for border, (left, right) in zip(borders[1:], pairwise(columns), strict=False):
        for one, other in product(left, right):
            low = max(one.bottom, other.bottom)
            high = min(one.bottom + one.height, other.bottom + other.height)
            if low < high and one.is_divided_from(other):
                axes.plot([border, border], [low, high], **BORDER_STYLE)
    bands: dict[tuple[int, int], dict[int, Share]] = {}
    for place, column in enumerate(columns):
        for share in column:
            bands.setdefault((share.attractor.number, share.attractor.response), {})[place] = share
    centred: Properties = {"ha": "center", "va": "center", "clip_on": True, "fontsize": font_size(6), "zorder": 4}
    part = 0.25 if beside else 0.5
    for (number, response), shares in bands.items():
        for consecutive in np.split(list(shares), 1 + np.flatnonzero(np.diff(list(shares)) > 1)):
            place = max(consecutive.tolist(), key=lambda i: shares[i].height)
            if (widest := shares[place]).height >= MIN_NUMBERED_HEIGHT:
                x = borders[place] + part * (borders[place + 1] - borders[place])
                ground, gid = styles[response].colour, f"number:{number}:{response}"
                style: Properties = {"color": ink_on(ground), "path_effects": halo(1.5, ground), "gid": gid}
                axes.text(x, widest.bottom + widest.height / 2, str(number), **style, **centred)


def draw_intervals(axes: Axes, along: Along) -> None:
    """Draw at every border between responses the interval of the share below it."""
    stride = -(-len(along.points) // MAX_INTERVALS)
    for attractors, counts, centre in list(zip(along.points, along.counts, along.centres, strict=True))[::stride]:
        total = counts["starts"]
        for code in along.present[:-1]:
            below = sum(attractor.members for attractor in attractors if attractor.response <= code)
            if 0 < below < total and any(attractor.response == code for attractor in attractors):
                ends = [100 * end for end in wilson(below, total, total - counts["known"])]
                axes.plot([centre, centre], ends, color="black", linewidth=0.9, zorder=3, gid=f"interval:{code}")


ATTRACTORS_HEIGHT = 6.0
# diameters in points, of the share 1 and of a single start among many
LARGEST_MARKER, SMALLEST_MARKER = 8.0, 2.6
MIN_NUMBERED = 0.05  # of attractors with a number in the picture
NUMBER_ROOM = 14.0  # points between two markers with a number between them


@dataclass(frozen=True, eq=False)
class Mark:
    """An attractor of the operating point at ``centre``, drawn at ``x`` and ``y``."""

    centre: float
    x: float
    y: float
    attractor: Attractor


def attractors(results: Results, units: str = "si") -> Page:
    along, shown = Along(results, units), drawn_in(results.attrs).attractors

    def paint(panel: tuple[str | None, str, str], axes: Axes) -> None:
        lower_name, name, label = panel
        y = quantity(name, units)
        marks = [
            # a range is taken between the medians of the extremes
            Mark(x, x, (one.features[name] - one.features.get(lower_name or "", 0.0)) / y.scale, one)
            for attractors, x in zip(along.points, along.centres, strict=True)
            for one in attractors
        ]
        low, high = robust_limits(np.array([mark.y for mark in marks]), 6.0)
        low = min(low, 0.0)
        axes.set_ylim(low - 0.03 * (high - low), high + 0.15 * (high - low))  # room for a number above
        groups = set_apart(axes, marks, along.centres)
        for mark in sorted(chain.from_iterable(groups), key=lambda mark: -mark.attractor.share):
            draw_mark(axes, mark, name, along.styles)
        join_attractors(axes, groups, along.centres)
        lay_up(axes, name, Shown(label, y.unit, y.scale).label)
        along.lie(axes)

    def arrange(figure: Figure) -> list[Axes]:
        panels = stack(figure, len(shown))
        figure.align_ylabels(panels)
        return panels

    entries = response_entries(along.present, along.styles)
    if any(map(_is_unsettled, along.attractors)):
        entries.append(marker_entry("open: most of its starts unsettled", hollow=True))
    if along.unknown:
        words = f"not known: {along.unknown} of {along.total['starts']} starts, {along.total['failed']} failed"
        entries.append(line_entry(linestyle="none", label=words))
    entries.append(line_entry(color=REFERENCE, linewidth=0.5, label="one attractor; its number"))
    entries += [marker_entry(f"share {100 * share:.0f} %", size=marker_diameter(share)) for share in (1.0, 0.25, 0.05)]
    return Page(
        {panel[1]: partial(paint, panel) for panel in shown},
        along.title,
        page_width(),
        ATTRACTORS_HEIGHT,
        arrange,
        lambda panels: entries,
    )


def draw_mark(axes: Axes, mark: Mark, name: str, styles: Styles) -> None:
    """The marker of an attractor in the panel of a variable."""
    attractor = mark.attractor
    response, size = styles[attractor.response], marker_diameter(attractor.share)
    own: Properties = {"color": response.colour, "gid": f"{name}:{attractor.response}", "markeredgewidth": 0.0}
    if _is_unsettled(attractor):
        own |= {"markerfacecolor": "none", "markeredgewidth": 0.7}
    axes.plot([mark.x], [mark.y], response.marker, markersize=size, zorder=3, **own)


def _is_unsettled(attractor: Attractor) -> bool:
    """Whether most of the starts that lead to it had not settled."""
    return attractor.unsettled > attractor.members / 2


def set_apart(axes: Axes, marks: list[Mark], centres: Array) -> list[list[Mark]]:
    """The marks in groups, along the axis, of those of one operating point that would
    cover each other or a number above one of them, as the limits of ``axes`` along y
    are: those of a group stand side by side, the highest first."""
    to_points = 72 / axes.figure.dpi
    close = NUMBER_ROOM * float(np.ptp(axes.get_ylim())) / (axes.bbox.height * to_points)
    width = LARGEST_MARKER * float(np.ptp(edges(centres))) / (axes.bbox.width * to_points)
    groups: list[list[Mark]] = []
    for mark in sorted(marks, key=lambda mark: (mark.centre, -mark.y)):
        above = groups[-1][-1] if groups else None
        if above and above.centre == mark.centre and above.y - mark.y < close:
            groups[-1].append(mark)
        else:
            groups.append([mark])
    steps = [min(width, float(np.abs(np.diff(centres)).min()) / (2 * len(group))) for group in groups]
    return [
        [replace(mark, x=mark.x + step * (place - 0.5 * (len(group) - 1))) for place, mark in enumerate(group)]
        for group, step in zip(groups, steps, strict=True)
    ]


def join_attractors(axes: Axes, groups: list[list[Mark]], centres: Array) -> None:
    """Draw a line along each attractor, under the markers, and where it begins the
    number of one with a share of ``MIN_NUMBERED`` or more."""
    lines: dict[int, list[Mark]] = {}
    for mark in chain.from_iterable(groups):
        lines.setdefault(mark.attractor.number, []).append(mark)
    style: Properties = {"color": REFERENCE, "linewidth": 0.5, "zorder": 2}
    for number, marks in lines.items():
        for one, following in pairwise(marks):
            low, high = sorted((one.centre, following.centre))
            line = ":" if np.any((centres > low) & (centres < high)) else "-"
            axes.plot([one.x, following.x], [one.y, following.y], linestyle=line, gid=f"branch:{number}", **style)
    first = {marks[0] for marks in lines.values() if max(mark.attractor.share for mark in marks) >= MIN_NUMBERED}
    for group in groups:
        if named := [mark for mark in group if mark in first]:
            words = ", ".join(str(mark.attractor.number) for mark in named)
            place = float(np.mean([mark.x for mark in named])), named[0].y
            write(axes, words, place, (0, 4), ha="center", va="bottom", gid="numbers", path_effects=halo(1.5))


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
        page=shares,
        uses=lambda model: ATTRACTOR_VARIABLES,
        across=lambda data: str(data.swept[0]),
        advice=needs_starts,
    ),
    Kind(
        "attractors",
        "radius, axial range and stick-slip index of each attractor along one axis, size by share",
        of=STARTS,
        place=lambda data: 11 if has_starts(data) and len(data.swept) == 1 else None,
        page=attractors,
        uses=lambda model: (
            *ATTRACTOR_VARIABLES,
            *(name for panel in model.drawn.attractors for name in panel[:2] if name),
        ),
        across=lambda data: str(data.swept[0]),
        advice=needs_starts,
        general="features of each attractor along one axis, size by share",
    ),
)
