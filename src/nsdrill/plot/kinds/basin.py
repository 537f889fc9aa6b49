"""Basins of attraction: which start leads to which attractor, over two states of the
start, at one operating point.

A slice fills a plane with cells. The starts of an ensemble differ in all states; over
two of them they are dots, and basins that are disjoint in the whole state space may
overlap.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from nsdrill.analysis.attractors import Attractor, describe
from nsdrill.data import Array, Results
from nsdrill.errors import InputError, Refusal, option
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.models.starts import Starts, slice_values
from nsdrill.plot.kinds.starts import ATTRACTOR_VARIABLES, UNGROUPED, attractor_label, by_operating_point, has_starts
from nsdrill.plot.labels import quantity, sweep_title
from nsdrill.plot.page import area_entry, finish, marker_entry, new_figure
from nsdrill.plot.panels import draw_codes
from nsdrill.plot.registry import STARTS, Kind, needs_starts
from nsdrill.plot.slices import edges
from nsdrill.plot.style import RESPONSES, Properties, light_of, page_width
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
        raise InputError(UNGROUPED)
    names = _states(results, states)
    shown = [quantity(name, units) for name in names]
    starts = _Starts(variables["attractor"][0].astype(int), variables["status"][0], attractors)
    figure = new_figure(page_width(), HEIGHT)
    axes = figure.add_subplot()
    if results.slice:
        by_name = slice_values(Starts(slice=results.slice), tuple(results["state"].tolist()))
    else:
        initial = np.asarray(results["initial_state"]).reshape(len(starts.status), len(results["state"]))
        by_name = dict(zip(results["state"].tolist(), initial.T, strict=True))
    x, y = (by_name[name] / state.scale for name, state in zip(names, shown, strict=True))
    if results.slice:
        _draw_cells(axes, x, y, starts, transposed=tuple(by_name) == names)
    else:
        _draw_dots(axes, x, y, starts)
    axes.set(xlabel=shown[0].label, ylabel=shown[1].label)
    title = sweep_title(results, units, f"{counts['starts']} starts")
    return finish(figure, title, _handles(starts, counts, as_cells=bool(results.slice)), 2)


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
    colours = [OTHERS_COLOUR, *(colour for _, colour, _ in starts.named), FAILED_COLOUR]
    draw_codes(axes, (x, y), codes, colours, "basins", "basins")
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))


def _draw_dots(axes: Axes, x: Array, y: Array, starts: _Starts) -> None:
    """Draw a dot for each start, at ``x`` and ``y`` [start]."""
    size = float(np.clip(140 / np.sqrt(len(x)), 1.5, 5.0))
    for attractor, colour, marker in starts.named:
        of_it, gid = starts.number == attractor.number, f"attractor:{attractor.number}"
        style: Properties = {"linestyle": "none", "marker": marker, "color": colour, "markersize": size}
        axes.plot(x[of_it], y[of_it], gid=gid, **style, markeredgecolor="black", markeredgewidth=0.2)
    rest = np.isin(starts.number, [attractor.number for attractor in starts.others])
    style = {"linestyle": "none", "marker": "o", "color": "#808080", "markersize": 0.5 * size, "markeredgewidth": 0}
    axes.plot(x[rest], y[rest], gid="others", **style)
    failed = has_failed(starts.status)
    axes.plot(x[failed], y[failed], "kx", markersize=size, markeredgewidth=0.7, linestyle="none", gid="failed")


def _handles(starts: _Starts, counts: dict[str, int], *, as_cells: bool) -> list[Artist]:
    entries: list[tuple[str, str, str]] = []
    for attractor, colour, marker in starts.named:
        label = f"{attractor.number}: {attractor_label(attractor)}, {100 * attractor.share:.3g} %"
        if not as_cells:
            label += f" ({100 * attractor.low:.0f} to {100 * attractor.high:.0f})"
        entries.append((label, marker, colour))
    if count := len(starts.others):
        members = sum(attractor.members for attractor in starts.others)
        label = f"{count} smaller group{'s' * (count > 1)}, {members} starts"
        entries.append((label, "o", OTHERS_COLOUR if as_cells else "#808080"))
    if counts["failed"]:
        entries.append((f"failed ({counts['failed']})", "x", FAILED_COLOUR if as_cells else "black"))
    if as_cells:
        border: Properties = {"edgecolor": "#808080", "linewidth": 0.3}
        return [area_entry(facecolor=colour, label=label, **border) for label, _, colour in entries]
    return [marker_entry(label, marker, colour, edge=0.2) for label, marker, colour in entries]


def _place(data: object) -> float | None:
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
