"""Pictures of several starts: the share of them that reaches each response, the
attractors along an axis, and the basins of attraction.

A basin shows which start leads to which attractor, over two states of the start, at one
operating point. A slice fills a plane with cells. The starts of an ensemble differ in
all states; over two of them they are dots, and basins that are disjoint in the whole
state space may overlap.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import Normal, Stroke

from nsdrill.analysis.attractors import Attractor, describe, wilson
from nsdrill.data import Array, Results, resolved_study
from nsdrill.errors import InputError, Refusal, option
from nsdrill.models.registry import BY_NAME, drawn_in, model_in
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.models.starts import Starts, slice_values
from nsdrill.plot.labels import Shown, quantity, sweep_title
from nsdrill.plot.page import (
    area_entry,
    finish,
    line_entry,
    marker_entry,
    name_panel,
    new_figure,
    response_entries,
    single_panel,
    stack,
    style_areas,
    write,
)
from nsdrill.plot.panels import draw_codes
from nsdrill.plot.registry import STARTS, Kind, has_starts, needs_starts
from nsdrill.plot.slices import edges, lay_along, positions, robust_limits
from nsdrill.plot.style import REFERENCE, RESPONSES, Properties, font_size, further_colour, ink_on, page_width
from nsdrill.variables import OK, has_failed

ATTRACTOR_VARIABLES = ("attractor", *RESPONSE_KINDS, "settled")  # variables that describe an attractor
UNGROUPED = "The starts are not grouped into attractors yet: this is done when all points are there. Finish the run."


def by_operating_point(results: Results) -> dict[str, Array]:
    """The variables on the grid, as arrays [operating point, start]."""
    starts, dimensions = len(results.coords["start"]), 1 + len(results.shape[1:])
    on_grid = {name: np.asarray(array) for name, array in results.variables.items() if array.ndim == dimensions}
    return {name: array.reshape(-1, starts) for name, array in on_grid.items()}


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
    figure, axes = single_panel(page_width(), SHARES_HEIGHT)
    columns = [
        draw_column(axes, attractors, left, right)
        for attractors, (left, right) in zip(along.points, pairwise(borders), strict=True)
    ]
    if along.is_matched:
        draw_bands(axes, columns, borders)
    is_sample = not results.slice
    if is_sample:
        draw_intervals(axes, along)
    axes.set(ylim=(0, 100), ylabel=f"Share of the {'starts' if is_sample else 'slice'} [%]")
    handles = style_areas(RESPONSES, along.present)
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
class Share:
    """The share of an attractor in a column: from ``bottom`` over ``height`` [%], and
    whether the border below it was drawn."""

    attractor: Attractor
    bottom: float
    height: float
    is_divided: bool


def draw_column(axes: Axes, attractors: list[Attractor], left: float, right: float) -> list[Share]:
    """Draw the attractors of one operating point, the lowest response first."""
    bottom = 0.0
    shares: list[Share] = []
    for attractor in sorted(attractors, key=lambda attractor: (attractor.response, attractor.number)):
        height, colour = 100 * attractor.share, RESPONSES[attractor.response].colour
        gid = f"attractor:{attractor.number}:{attractor.response}"
        area: Properties = {"facecolor": colour, "edgecolor": colour, "linewidth": 0.2, "gid": gid}
        axes.fill_between([left, right], bottom, bottom + height, **area)
        below = shares[-1].attractor if shares else None
        is_divided = (
            below is not None
            and below.response == attractor.response
            and max(below.share, attractor.share) >= MIN_DIVIDED_SHARE
        )
        if is_divided:
            axes.plot([left, right], [bottom, bottom], **BORDER_STYLE)
        shares.append(Share(attractor, bottom, height, is_divided))
        bottom += height
    return shares


def draw_bands(axes: Axes, columns: list[list[Share]], borders: Array) -> None:
    """Connect the attractors along the axis: draw the steps of their lower borders, and
    their numbers where their bands are widest."""
    bands: dict[tuple[int, int], dict[int, Share]] = {}
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
            response, size = RESPONSES[attractor.response], marker_diameter(attractor.share)
            own: Properties = {"color": response.colour, "gid": f"{name}:{attractor.response}", "markeredgewidth": 0.0}
            if _is_unsettled(attractor):
                own |= {"markerfacecolor": "none", "markeredgewidth": 0.7}
            axes.plot([centre], [height], response.marker, markersize=size, zorder=3, **own)
        if along.is_matched:
            join_attractors(axes, points, along.centres)
        low, high = robust_limits(np.array([height for _, height, _ in points]), 6.0)
        low = min(low, 0.0)
        axes.set_ylim(low - 0.03 * (high - low), high + 0.12 * (high - low))  # room for a number above
        name_panel(axes, name, name, Shown(label, y.unit, y.scale).label)
    figure.align_ylabels(panels)
    handles = response_entries(along.present)
    if any(map(_is_unsettled, along.attractors)):
        handles.append(marker_entry("open: most of its starts unsettled", hollow=True))
    if along.is_matched:
        handles.append(line_entry(color=REFERENCE, linewidth=0.5, label="one attractor; its number"))
    shares = (1.0, 0.25, 0.05)
    handles += [marker_entry(f"share {100 * share:.0f} %", size=marker_diameter(share)) for share in shares]
    return along.finish(figure, panels[-1], handles)


def _is_unsettled(attractor: Attractor) -> bool:
    """Whether most of the starts that lead to it had not settled."""
    return attractor.unsettled > attractor.members / 2


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


BASIN_HEIGHT = 4.4
# attractors with an entry of their own in the legend: their greatest number, and their
# least share
MAX_NAMED, MIN_SHARE = 8, 0.005
OTHER_CELLS, FAILED_CELLS, OTHER_DOTS = "#F2F2F2", "#FFFFFF", "#808080"
MARKERS = ("o", "^", "s", "D", "v", "P", "X", "p")


def draw_basin(results: Results, units: str = "si", states: Sequence[str] | None = None) -> Figure:
    if results.swept:
        options = " and ".join(option(name) for name in results.swept)
        found_values = ", ".join(f"{len(results.coords[name])} values of {name}" for name in results.swept)
        raise InputError(
            f"plot kind 'basin': found {found_values}; allowed: one operating point. Select it with {options}."
        )
    variables, known_states = by_operating_point(results), results["state"].tolist()
    ((attractors, counts),) = describe(variables, model_in(results.attrs).distinguishing)
    if counts["ungrouped"]:
        raise InputError(UNGROUPED)
    names, as_cells = _states(results, known_states, states), bool(results.slice)
    starts = _Starts(variables["attractor"][0].astype(int), variables["status"][0], attractors)
    if as_cells:
        by_name = slice_values(Starts(slice=results.slice), tuple(known_states))
    else:
        initial = np.asarray(results["initial_state"]).reshape(len(starts.status), len(known_states))
        by_name = dict(zip(known_states, initial.T, strict=True))
    shown = [quantity(name, units) for name in names]
    x, y = (by_name[name] / state.scale for name, state in zip(names, shown, strict=True))
    figure, axes = single_panel(page_width(), BASIN_HEIGHT)
    if as_cells:
        _draw_cells(axes, x, y, starts, transposed=tuple(by_name) == names)
    else:
        _draw_dots(axes, x, y, starts)
    axes.set(xlabel=shown[0].label, ylabel=shown[1].label)
    title = sweep_title(results, units, f"{counts['starts']} starts")
    return finish(figure, title, _handles(starts, counts["failed"], as_cells=as_cells), 2)


def _states(results: Results, known: list[str], states: Sequence[str] | None) -> tuple[str, ...]:
    """The states along x and y, of those ``known``."""
    if of_slice := tuple(name for name in known if name in results.slice):
        if states and set(states) != set(of_slice):
            raise Refusal("states", ",".join(states), f"those of the slice, {','.join(of_slice)}")
        return tuple(states or of_slice)
    default = drawn_in(results.attrs).planes[0]
    pair = tuple(states or default)
    if len(pair) != 2 or len(set(pair)) != 2 or not set(pair) <= set(known):
        raise Refusal("states", ",".join(pair), f"two of {', '.join(known)}, as in {','.join(default)}")
    return pair


def distinct_colours(attractors: list[Attractor]) -> list[str]:
    """The colours of the attractors with an entry of their own: the largest of each
    response has that of the response, the others differ as much as possible."""
    named = [one for one in attractors[:MAX_NAMED] if one.share >= MIN_SHARE]
    largest = {one.response: one.number for one in reversed(named)}
    colours = {number: RESPONSES[response].colour for response, number in largest.items()}
    for one in named:
        if one.number not in colours:
            colours[one.number] = further_colour(colours.values())
    return [colours[one.number] for one in named]


class _Starts:
    """The starts and their attractors: of each start the ``number`` of its attractor
    and its ``status`` [start]; of the ``named`` attractors, the largest first, their
    colours and markers; and the ``others``."""

    def __init__(self, number: Array, status: Array, attractors: list[Attractor]) -> None:
        self.number, self.status = number, status
        colours = distinct_colours(attractors)
        self.named = list(zip(attractors, colours, MARKERS, strict=False))
        self.others = attractors[len(colours) :]


def _draw_cells(axes: Axes, x: Array, y: Array, starts: _Starts, *, transposed: bool) -> None:
    """Draw a cell for each start, at the values ``x`` and ``y``. The second state of the
    slice varies faster over the starts: ``transposed`` where that lies along y."""
    # 0: others; 1 ...: those with colours; then: failed, and not run yet.
    codes = np.zeros_like(starts.number)
    for code, (attractor, _, _) in enumerate(starts.named, 1):
        codes[starts.number == attractor.number] = code
    codes = np.where(starts.status == OK, codes, len(starts.named) + 1)
    codes = codes.reshape(len(x), len(y)).T if transposed else codes.reshape(len(y), len(x))
    x, y = edges(x), edges(y)
    colours = [OTHER_CELLS, *(colour for _, colour, _ in starts.named), FAILED_CELLS]
    draw_codes(axes, (x, y), codes, colours, "basins", "basins")
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))


def _draw_dots(axes: Axes, x: Array, y: Array, starts: _Starts) -> None:
    """Draw a dot for each start, at ``x`` and ``y`` [start]."""
    size = float(np.clip(140 / np.sqrt(len(x)), 1.5, 5.0))
    outlined: Properties = {"linestyle": "none", "markersize": size, "markeredgecolor": "black", "markeredgewidth": 0.2}
    for attractor, colour, marker in starts.named:
        of_it, gid = starts.number == attractor.number, f"attractor:{attractor.number}"
        axes.plot(x[of_it], y[of_it], gid=gid, marker=marker, color=colour, **outlined)
    rest = np.isin(starts.number, [attractor.number for attractor in starts.others])
    axes.plot(x[rest], y[rest], "o", color=OTHER_DOTS, markersize=0.5 * size, markeredgewidth=0, gid="others")
    failed = has_failed(starts.status)
    axes.plot(x[failed], y[failed], "kx", markersize=size, markeredgewidth=0.7, gid="failed")


def _handles(starts: _Starts, failed: int, *, as_cells: bool) -> list[Artist]:
    """Entries for the named attractors with their shares, of dots with their intervals;
    for the others, and for failed starts."""
    entries: list[tuple[str, str, str]] = []
    for attractor, colour, marker in starts.named:
        kinds = (BY_NAME[name].words(value).replace("_", " ") for name, value in attractor.kinds.items() if value)
        words = RESPONSES[attractor.response].name + "".join(f" ({kind})" for kind in kinds)
        interval = "" if as_cells else f" ({100 * attractor.low:.0f} to {100 * attractor.high:.0f})"
        entries.append((f"{attractor.number}: {words}, {100 * attractor.share:.3g} %{interval}", marker, colour))
    if count := len(starts.others):
        members = sum(attractor.members for attractor in starts.others)
        label = f"{count} smaller group{'s' * (count > 1)}, {members} starts"
        entries.append((label, "o", OTHER_CELLS if as_cells else OTHER_DOTS))
    if failed:
        entries.append((f"failed ({failed})", "x", FAILED_CELLS if as_cells else "black"))
    if as_cells:
        border: Properties = {"edgecolor": "#808080", "linewidth": 0.3}
        return [area_entry(facecolor=colour, label=label, **border) for label, _, colour in entries]
    return [marker_entry(label, marker, colour, edge=0.2) for label, marker, colour in entries]


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
    Kind(
        "basin",
        "which start goes to which attractor, over two states; of one operating point",
        of=STARTS,
        # the default of a slice
        place=lambda data: (52 if len(data.swept) > 1 else 5 if data.slice else 12) if has_starts(data) else None,
        draw=draw_basin,
        uses=lambda model: (*ATTRACTOR_VARIABLES, "initial_state"),
        takes=("states",),
        advice=needs_starts,
    ),
)
