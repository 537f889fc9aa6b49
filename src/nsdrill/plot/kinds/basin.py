"""Basins: which start goes to which attractor, over two states of the start, at one
operating point.

A slice fills a plane with cells. The starts of an ensemble differ in all states; over
two of them they are dots, and basins that lie apart in the whole may overlap there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap, to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from nsdrill.analysis.attractors import Attractor, describe
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.models.starts import Starts, slice_values
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below, marker_entry
from nsdrill.plot.registry import STARTS, Kind, needs_starts
from nsdrill.plot.slices import edges
from nsdrill.plot.starts import USED, flat, has_starts, words
from nsdrill.plot.style import RESPONSES, new_figure, page_width, put_title, seamless
from nsdrill.variables import OK, has_failed

HEIGHT = 4.4
# so many attractors have an entry of their own in the legend, with such a share or more
NAMED, LEAST = 8, 0.005
OTHERS, FAILED, WAITING = "#F2F2F2", "#FFFFFF", "#FFFFFF"
# Attractors of one response: its own colour, then towards white and towards black by
# turns.
TINTS = (0.0, 0.55, -0.45, 0.3, -0.25, 0.75, -0.65, 0.45)
MARKERS = ("o", "^", "s", "D", "v", "P", "X", "p")


def draw(results: Results, units: str = "si", states: Sequence[str] | None = None) -> Figure:
    if results.swept:
        options = " and ".join(f"--{name.replace('_', '-')}" for name in results.swept)
        many = ", ".join(f"{len(results.coords[name])} values of {name}" for name in results.swept)
        raise InputError(
            f"plot kind 'basin': found {many}; allowed: one operating point. Select "
            f"it with {options}."
        )
    variables = flat(results)
    ((found, counts),) = describe(variables, model_in(results.attrs).told)
    if counts["ungrouped"]:
        raise InputError(
            "The starts are not grouped into attractors yet: this is done when all points are "
            "there. Finish the run."
        )
    names = _states(results, states)
    colours = tinted(found)
    figure = new_figure(page_width(), HEIGHT)
    axes = figure.add_subplot()
    shown = (quantity(names[0], units), quantity(names[1], units))
    status, number = variables["status"][0], variables["attractor"][0].astype(int)
    came = _Came(number, status, found, colours)
    if results.slice:
        plane = slice_values(Starts(slice=results.slice), tuple(results["state"].tolist()))
        x, y = (plane[name] / one.scale for name, one in zip(names, shown, strict=True))
        _draw_cells(axes, x, y, came, turned=tuple(plane) == names)
    else:
        initial = np.asarray(results["initial_state"]).reshape(len(status), len(results["state"]))
        by_name = dict(zip(results["state"].tolist(), initial.T, strict=True))
        x, y = (by_name[name] / one.scale for name, one in zip(names, shown, strict=True))
        _draw_dots(axes, x, y, came)
    axes.set_xlabel(shown[0].label)
    axes.set_ylabel(shown[1].label)
    point = operating_point(fixed_values(results), units)
    put_title(figure, heading(results.attrs, f"{point}; {counts['starts']} starts"))
    legend_below(figure, _handles(found, counts, colours, cells=bool(results.slice)), 2)
    return figure


def _states(results: Results, asked: Sequence[str] | None) -> tuple[str, str]:
    """The states across and up."""
    plane = tuple(name for name in results["state"].tolist() if name in results.slice)
    if plane:
        if asked and set(asked) != set(plane):
            raise InputError(
                f"--states: found {','.join(asked)}; allowed: those of the slice, "
                f"{','.join(plane)}."
            )
        across, up = tuple(asked) if asked else plane
        return across, up
    names, usual = results["state"].tolist(), drawn_in(results.attrs).planes[0]
    chosen = tuple(asked or usual)
    if len(chosen) != 2 or len(set(chosen)) != 2 or not set(chosen) <= set(names):
        found, example = ",".join(chosen), ",".join(usual)
        raise InputError(
            f"--states: found {found}; allowed: two of {', '.join(names)}, as in {example}."
        )
    return chosen[0], chosen[1]


def tinted(found: list[Attractor]) -> list[str]:
    """The colours of the attractors that are named: that of the response, in another
    tint for each."""
    used: dict[int, int] = {}
    colours = []
    for one in [one for one in found[:NAMED] if one.share >= LEAST]:
        turn = used.get(one.response, 0)
        used[one.response] = turn + 1
        base, tint = np.array(to_rgb(RESPONSES[one.response].colour)), TINTS[turn % len(TINTS)]
        red, green, blue = base + (1 - base) * tint if tint >= 0 else base * (1 + tint)
        colours.append(to_hex((red, green, blue)))
    return colours


@dataclass(frozen=True)
class _Came:
    """What became of the starts: of each the ``number`` of its attractor and its
    ``status`` [start]; the attractors ``found``, the largest first, of which the first
    have ``colours``."""

    number: Array
    status: Array
    found: list[Attractor]
    colours: list[str]


def _draw_cells(axes: Axes, x: Array, y: Array, came: _Came, *, turned: bool) -> None:
    """A cell for each start, at the values ``x`` across and ``y`` up. The second state
    of the slice runs faster over the starts: ``turned`` where that lies up."""
    colours = came.colours
    # 0 others, 1 ... the named ones, then failed and waiting.
    named = enumerate(came.found[: len(colours)], 1)
    kind = sum((place * (came.number == one.number) for place, one in named), 0 * came.number)
    kind = np.where(came.status == OK, kind, len(colours) + 1)
    kind = kind.reshape(len(x), len(y)).T if turned else kind.reshape(len(y), len(x))
    x, y = edges(x), edges(y)
    cells = ListedColormap([OTHERS, *colours, FAILED], name="basins")
    axes.pcolormesh(
        x,
        y,
        kind,
        cmap=cells,
        norm=BoundaryNorm(np.arange(-0.5, len(colours) + 2), len(colours) + 2),
        gid="basins",
        **seamless(kind.size),
    )
    axes.set_xlim(x[0], x[-1])
    axes.set_ylim(y[0], y[-1])


def _draw_dots(axes: Axes, x: Array, y: Array, came: _Came) -> None:
    """A dot for each start, at ``x`` and ``y`` [start]."""
    number, found, colours = came.number, came.found, came.colours
    size = float(np.clip(140 / np.sqrt(len(x)), 1.5, 5.0))
    for one, colour, marker in zip(found, colours, MARKERS, strict=False):
        chosen = number == one.number
        axes.plot(
            x[chosen],
            y[chosen],
            linestyle="none",
            marker=marker,
            color=colour,
            markersize=size,
            markeredgecolor="black",
            markeredgewidth=0.2,
            gid=f"attractor:{one.number}",
        )
    rest = np.isin(number, [one.number for one in found[len(colours) :]])
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
    failed = has_failed(came.status)
    axes.plot(
        x[failed],
        y[failed],
        "kx",
        markersize=size,
        markeredgewidth=0.7,
        linestyle="none",
        gid="failed",
    )


def _handles(
    found: list[Attractor], counts: dict[str, int], colours: list[str], *, cells: bool
) -> list[Artist]:
    handles: list[Artist] = []
    for one, colour, marker in zip(found, colours, MARKERS, strict=False):
        label = f"{one.number}: {words(one)}, {100 * one.share:.3g} %"
        if not cells:
            label += f" ({100 * one.low:.0f} to {100 * one.high:.0f})"
        handles.append(_handle(label, colour, marker, cells))
    if rest := found[len(colours) :]:
        members = sum(one.members for one in rest)
        label = f"{len(rest)} smaller group{'s' * (len(rest) > 1)}, {members} starts"
        handles.append(_handle(label, OTHERS if cells else "#808080", "o", cells))
    if counts["failed"]:
        handles.append(
            _handle(f"failed ({counts['failed']})", FAILED if cells else "black", "x", cells)
        )
    return handles


def _handle(label: str, colour: str, marker: str, cell: bool) -> Artist:
    if cell:
        return Patch(facecolor=colour, edgecolor="#808080", linewidth=0.3, label=label)
    return marker_entry(label, marker, colour, edge=0.2)


def _place(data: Any) -> float | None:
    if not has_starts(data):
        return None
    if len(data.swept) > 1:
        return 52
    return 5 if data.slice else 12  # a slice was made for this


KINDS = (
    Kind(
        "basin",
        "which start goes to which attractor, over two states; of one operating point",
        of=STARTS,
        place=_place,
        draw=draw,
        uses=lambda model: (*USED, "initial_state"),
        takes=("states",),
        advice=needs_starts,
    ),
)
