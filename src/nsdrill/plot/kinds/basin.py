"""Basins of attraction: which start leads to which attractor, over two states of the
start, at one operating point.

A slice fills a plane with cells. The starts of an ensemble differ in all states; over
two of them they are dots, and basins that are disjoint in the whole state space may
overlap.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from nsdrill.analysis.attractors import Attractor, describe
from nsdrill.data import Array, Results
from nsdrill.errors import InputError, Refusal, option
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.models.starts import Starts, slice_values
from nsdrill.plot.dark import light_of
from nsdrill.plot.kinds.starts import ATTRACTOR_VARIABLES, attractor_label, by_operating_point, has_starts
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below, marker_entry
from nsdrill.plot.registry import STARTS, Kind, needs_starts
from nsdrill.plot.slices import edges
from nsdrill.plot.style import RESPONSES, cell_style, new_figure, page_width, put_title
from nsdrill.variables import OK, has_failed

HEIGHT = 4.4
# attractors with an entry of their own in the legend: their greatest number, and their
# least share
MAX_NAMED, MIN_SHARE = 8, 0.005
OTHERS_COLOUR, FAILED_COLOUR = "#F2F2F2", "#FFFFFF"
# Colours of further attractors with a response that has its colour already: those that
# differ most from the ones in use. Most are Paul Tol's.
FURTHER_COLOURS = (
    "#CCBB44", "#AA3377", "#EE6677", "#117733", "#332288", "#DDCC77", "#F0E442", "#7A5230",
)  # fmt: skip
MARKERS = ("o", "^", "s", "D", "v", "P", "X", "p")


def draw(results: Results, units: str = "si", states: Sequence[str] | None = None) -> Figure:
    if results.swept:
        options = " and ".join(option(name) for name in results.swept)
        found_values = ", ".join(f"{len(results.coords[name])} values of {name}" for name in results.swept)
        raise InputError(
            f"plot kind 'basin': found {found_values}; allowed: one operating point. Select it with {options}."
        )
    variables = by_operating_point(results)
    ((attractors, counts),) = describe(variables, model_in(results.attrs).distinguishing)
    if counts["ungrouped"]:
        raise InputError(
            "The starts are not grouped into attractors yet: this is done when all points are there. Finish the run."
        )
    names = _states(results, states)
    colours = distinct_colours(attractors)
    figure = new_figure(page_width(), HEIGHT)
    axes = figure.add_subplot()
    shown = (quantity(names[0], units), quantity(names[1], units))
    status, number = variables["status"][0], variables["attractor"][0].astype(int)
    starts = _Starts(number, status, attractors, colours)
    if results.slice:
        plane = slice_values(Starts(slice=results.slice), tuple(results["state"].tolist()))
        x, y = (plane[name] / shown_state.scale for name, shown_state in zip(names, shown, strict=True))
        _draw_cells(axes, x, y, starts, transposed=tuple(plane) == names)
    else:
        initial = np.asarray(results["initial_state"]).reshape(len(status), len(results["state"]))
        by_name = dict(zip(results["state"].tolist(), initial.T, strict=True))
        x, y = (by_name[name] / shown_state.scale for name, shown_state in zip(names, shown, strict=True))
        _draw_dots(axes, x, y, starts)
    axes.set_xlabel(shown[0].label)
    axes.set_ylabel(shown[1].label)
    point = operating_point(fixed_values(results), units)
    put_title(figure, heading(results.attrs, f"{point}; {counts['starts']} starts"))
    legend_below(figure, _handles(attractors, counts, colours, as_cells=bool(results.slice)), 2)
    return figure


def _states(results: Results, states: Sequence[str] | None) -> tuple[str, str]:
    """The states along x and y."""
    plane = tuple(name for name in results["state"].tolist() if name in results.slice)
    if plane:
        if states and set(states) != set(plane):
            raise Refusal("states", f"{','.join(states)}", f"those of the slice, {','.join(plane)}")
        across, up = tuple(states) if states else plane
        return across, up
    names, default = results["state"].tolist(), drawn_in(results.attrs).planes[0]
    pair = tuple(states or default)
    if len(pair) != 2 or len(set(pair)) != 2 or not set(pair) <= set(names):
        pair_text, example = ",".join(pair), ",".join(default)
        raise Refusal("states", f"{pair_text}", f"two of {', '.join(names)}, as in {example}")
    return pair[0], pair[1]


def distinct_colours(attractors: list[Attractor]) -> list[str]:
    """The colours of the attractors with an entry of their own: the largest of each
    response has that of the response, the others differ as much as possible, in
    lightness more than in hue, so that they do in grey too."""
    named = [one for one in attractors[:MAX_NAMED] if one.share >= MIN_SHARE]
    largest = {one.response: one.number for one in reversed(named)}
    own = {one.number: RESPONSES[one.response].colour for one in named}
    colours = {number: own[number] for number in largest.values()}
    for one in named:
        if one.number not in colours:
            used = [lightness_and_hue(colour) for colour in colours.values()]
            colours[one.number] = max(
                FURTHER_COLOURS,
                key=lambda colour: min(
                    float(np.linalg.norm((lightness_and_hue(colour) - other) * (2, 1, 1))) for other in used
                ),
            )
    return [colours[one.number] for one in named]


def lightness_and_hue(colour: str) -> Array:
    """The coordinates L*, a*, b* of a colour, whose distances are those that an eye
    sees; about 2 can just be told apart side by side (CIE 1976, white of D65)."""
    x, y, z = np.cbrt(
        np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
        @ light_of(np.array(to_rgb(colour)))
        / (0.9505, 1.0, 1.089)
    )
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@dataclass(frozen=True)
class _Starts:
    """The starts and their attractors: of each start the ``number`` of its attractor
    and its ``status`` [start]; the ``attractors``, the largest first, and the
    ``colours`` of the first of them."""

    number: Array
    status: Array
    attractors: list[Attractor]
    colours: list[str]


def _draw_cells(axes: Axes, x: Array, y: Array, starts: _Starts, *, transposed: bool) -> None:
    """Draw a cell for each start, at the values ``x`` and ``y``. The second state of the
    slice varies faster over the starts: ``transposed`` where that lies along y."""
    colours = starts.colours
    # 0: others; 1 ...: those with colours; then: failed, and not run yet.
    named_attractors = enumerate(starts.attractors[: len(colours)], 1)
    cell_codes = sum(
        (code * (starts.number == attractor.number) for code, attractor in named_attractors), 0 * starts.number
    )
    cell_codes = np.where(starts.status == OK, cell_codes, len(colours) + 1)
    cell_codes = cell_codes.reshape(len(x), len(y)).T if transposed else cell_codes.reshape(len(y), len(x))
    x, y = edges(x), edges(y)
    cells = ListedColormap([OTHERS_COLOUR, *colours, FAILED_COLOUR], name="basins")
    axes.pcolormesh(
        x,
        y,
        cell_codes,
        cmap=cells,
        norm=BoundaryNorm(np.arange(-0.5, len(colours) + 2), len(colours) + 2),
        gid="basins",
        **cell_style(cell_codes.size),
    )
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(y[0], y[-1])


def _draw_dots(axes: Axes, x: Array, y: Array, starts: _Starts) -> None:
    """Draw a dot for each start, at ``x`` and ``y`` [start]."""
    number, attractors, colours = starts.number, starts.attractors, starts.colours
    size = float(np.clip(140 / np.sqrt(len(x)), 1.5, 5.0))
    for attractor, colour, marker in zip(attractors, colours, MARKERS, strict=False):
        members = number == attractor.number
        axes.plot(
            x[members],
            y[members],
            linestyle="none",
            marker=marker,
            color=colour,
            markersize=size,
            markeredgecolor="black",
            markeredgewidth=0.2,
            gid=f"attractor:{attractor.number}",
        )
    rest = np.isin(number, [attractor.number for attractor in attractors[len(colours) :]])
    axes.plot(
        x[rest],
        y[rest],
        linestyle="none",
        marker="o",
        color="#808080",
        markersize=0.5 * size,
        markeredgewidth=0,
        gid="others",
    )
    failed = has_failed(starts.status)
    axes.plot(x[failed], y[failed], "kx", markersize=size, markeredgewidth=0.7, linestyle="none", gid="failed")


def _handles(
    attractors: list[Attractor], counts: dict[str, int], colours: list[str], *, as_cells: bool
) -> list[Artist]:
    handles: list[Artist] = []
    for attractor, colour, marker in zip(attractors, colours, MARKERS, strict=False):
        label = f"{attractor.number}: {attractor_label(attractor)}, {100 * attractor.share:.3g} %"
        if not as_cells:
            label += f" ({100 * attractor.low:.0f} to {100 * attractor.high:.0f})"
        handles.append(_handle(label, colour, marker, as_cells))
    if rest := attractors[len(colours) :]:
        members = sum(attractor.members for attractor in rest)
        label = f"{len(rest)} smaller group{'s' * (len(rest) > 1)}, {members} starts"
        handles.append(_handle(label, OTHERS_COLOUR if as_cells else "#808080", "o", as_cells))
    if counts["failed"]:
        handles.append(_handle(f"failed ({counts['failed']})", FAILED_COLOUR if as_cells else "black", "x", as_cells))
    return handles


def _handle(label: str, colour: str, marker: str, as_cell: bool) -> Artist:
    if as_cell:
        return Patch(facecolor=colour, edgecolor="#808080", linewidth=0.3, label=label)
    return marker_entry(label, marker, colour, edge=0.2)


def _place(data: Any) -> float | None:
    if not has_starts(data):
        return None
    if len(data.swept) > 1:
        return 52
    return 5 if data.slice else 12  # the default of a slice


KINDS = (
    Kind(
        "basin",
        "which start goes to which attractor, over two states; of one operating point",
        of=STARTS,
        place=_place,
        draw=draw,
        uses=lambda model: (*ATTRACTOR_VARIABLES, "initial_state"),
        takes=("states",),
        advice=needs_starts,
    ),
)
