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

from nsdrill.analysis.attractors import Attractor
from nsdrill.analysis.safety import known_runs
from nsdrill.data import Array, Results
from nsdrill.errors import InputError, Refusal, option
from nsdrill.figures.cells import UNSETTLED_HATCH, hatch
from nsdrill.figures.kinds.start_pictures import (
    ATTRACTOR_VARIABLES,
    UNGROUPED,
    UNKNOWN_HATCH,
    by_operating_point,
    described_starts,
)
from nsdrill.figures.page import area_entry, marker_entry
from nsdrill.figures.painters import Page
from nsdrill.figures.panels import draw_codes
from nsdrill.figures.picture_kinds import STARTS, Kind, has_starts, needs_starts
from nsdrill.figures.slices import edges
from nsdrill.figures.style import Properties, ResponseStyle, further_colour, page_width, styles_of
from nsdrill.models.registry import BY_NAME, drawn_in
from nsdrill.models.starts import Starts, slice_values
from nsdrill.variables import OK, has_failed
from nsdrill.words.labels import quantity, sweep_title

BASIN_HEIGHT = 4.4
# attractors with an entry of their own in the legend: their greatest number, and their
# least share
MAX_NAMED, MIN_SHARE = 8, 0.005
OTHER_CELLS, UNKNOWN_CELLS, OTHER_DOTS = "#F2F2F2", "#FFFFFF", "#808080"
MARKERS = ("o", "^", "s", "D", "v", "P", "X", "p")


def basin(results: Results, units: str = "si", states: Sequence[str] | None = None) -> Page:
    if results.swept:
        options = " and ".join(option(name) for name in results.swept)
        found_values = ", ".join(f"{len(results.coords[name])} values of {name}" for name in results.swept)
        raise InputError(
            f"plot kind 'basin': found {found_values}; allowed: one operating point. Select it with {options}."
        )
    variables, known_states = by_operating_point(results), results["state"].tolist()
    ((attractors, counts),) = described_starts(results)
    if counts["ungrouped"]:
        raise InputError(UNGROUPED)
    names, as_cells = _states(results, known_states, states), bool(results.slice)
    styles = styles_of(results.attrs)
    starts = _Starts(
        np.where(known_runs(results).ravel(), variables["attractor"][0].astype(int), 0),
        variables["status"][0],
        variables["settled"][0] == 0,
        attractors,
        styles,
    )
    if as_cells:
        by_name = slice_values(Starts(slice=results.slice), tuple(known_states))
    else:
        initial = np.asarray(results["initial_state"]).reshape(len(starts.status), len(known_states))
        by_name = dict(zip(known_states, initial.T, strict=True))
    shown = [quantity(name, units) for name in names]
    x, y = (by_name[name] / state.scale for name, state in zip(names, shown, strict=True))

    def paint(axes: Axes) -> None:
        if as_cells:
            _draw_cells(axes, x, y, starts, transposed=tuple(by_name) == names)
        else:
            _draw_dots(axes, x, y, starts)
        axes.set(xlabel=shown[0].label, ylabel=shown[1].label)

    return Page(
        {"panel": paint},
        sweep_title(results, units, f"{counts['starts']} starts"),
        page_width(),
        BASIN_HEIGHT,
        entries=lambda panels: _handles(starts, counts["failed"], as_cells=as_cells),
        columns=2,
    )


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


def distinct_colours(attractors: list[Attractor], styles: Sequence[ResponseStyle]) -> list[str]:
    """The colours of the attractors with an entry of their own: the largest of each
    response has that of the response, the others differ as much as possible."""
    named = [one for one in attractors[:MAX_NAMED] if one.share >= MIN_SHARE]
    largest = {one.response: one.number for one in reversed(named)}
    colours = {number: styles[response].colour for response, number in largest.items()}
    for one in named:
        if one.number not in colours:
            colours[one.number] = further_colour(colours.values())
    return [colours[one.number] for one in named]


class _Starts:
    """The starts and their attractors: of each start the ``number`` of its attractor, 0 where
    that is not known, its ``status`` and whether it is ``unsettled`` [start]; of the ``named``
    attractors, the largest first, their colours and markers; and the ``others``. The ``styles``
    are those of the responses."""

    def __init__(
        self,
        number: Array,
        status: Array,
        unsettled: Array,
        attractors: list[Attractor],
        styles: Sequence[ResponseStyle],
    ) -> None:
        self.styles = styles
        self.number, self.status, self.unsettled = number, status, unsettled & (status == OK)
        self.unknown = has_failed(status) | ((status == OK) & (number == 0))
        colours = distinct_colours(attractors, styles)
        self.named = list(zip(attractors, colours, MARKERS, strict=False))
        self.others = attractors[len(colours) :]


def _draw_cells(axes: Axes, x: Array, y: Array, starts: _Starts, *, transposed: bool) -> None:
    """Draw a cell for each start, at the values ``x`` and ``y``. The second state of the
    slice varies faster over the starts: ``transposed`` where that lies along y."""
    # 0: others; 1 ...: those with colours; then: not known, and not run yet.
    codes = np.zeros_like(starts.number)
    for code, (attractor, _, _) in enumerate(starts.named, 1):
        codes[starts.number == attractor.number] = code
    codes = np.where((starts.status == OK) & ~starts.unknown, codes, len(starts.named) + 1)

    def placed(array: Array) -> Array:
        return array.reshape(len(x), len(y)).T if transposed else array.reshape(len(y), len(x))

    codes, unsettled, unknown = (placed(array) for array in (codes, starts.unsettled, starts.unknown))
    x, y = edges(x), edges(y)
    colours = [OTHER_CELLS, *(colour for _, colour, _ in starts.named), UNKNOWN_CELLS]
    draw_codes(axes, (x, y), codes, colours, "basins", "basins")
    hatch(axes, (x, y), unsettled, UNSETTLED_HATCH, "black", "unsettled")
    hatch(axes, (x, y), unknown, UNKNOWN_HATCH, "black", "unknown")
    axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))


def _draw_dots(axes: Axes, x: Array, y: Array, starts: _Starts) -> None:
    """Draw a dot for each start, at ``x`` and ``y`` [start]."""
    size = float(np.clip(140 / np.sqrt(len(x)), 1.5, 5.0))
    outlined: Properties = {"linestyle": "none", "markersize": size, "markeredgecolor": "black", "markeredgewidth": 0.2}
    open_marker: Properties = {"markerfacecolor": "white", "markeredgewidth": 0.6, "linestyle": "none"}
    for attractor, colour, marker in starts.named:
        of_it, gid = starts.number == attractor.number, f"attractor:{attractor.number}"
        settled, unsettled = of_it & ~starts.unsettled, of_it & starts.unsettled
        axes.plot(x[settled], y[settled], gid=gid, marker=marker, color=colour, **outlined)
        own: Properties = {"gid": f"unsettled:{attractor.number}", "markeredgecolor": colour, "markersize": size}
        axes.plot(x[unsettled], y[unsettled], marker=marker, **own, **open_marker)
    rest = np.isin(starts.number, [attractor.number for attractor in starts.others])
    axes.plot(x[rest], y[rest], "o", color=OTHER_DOTS, markersize=0.5 * size, markeredgewidth=0, gid="others")
    axes.plot(x[starts.unknown], y[starts.unknown], "kx", markersize=size, markeredgewidth=0.7, gid="unknown")


def _handles(starts: _Starts, failed: int, *, as_cells: bool) -> list[Artist]:
    """Entries for the named attractors with their shares, of dots with their intervals;
    for the others, and for starts that are not known."""
    entries: list[tuple[str, str, str]] = []
    for attractor, colour, marker in starts.named:
        kinds = (BY_NAME[name].words(value).replace("_", " ") for name, value in attractor.kinds.items() if value)
        words = starts.styles[attractor.response].name + "".join(f" ({kind})" for kind in kinds)
        interval = "" if as_cells else f" ({100 * attractor.low:.0f} to {100 * attractor.high:.0f})"
        entries.append((f"{attractor.number}: {words}, {100 * attractor.share:.3g} %{interval}", marker, colour))
    if count := len(starts.others):
        members = sum(attractor.members for attractor in starts.others)
        label = f"{count} smaller group{'s' * (count > 1)}, {members} starts"
        entries.append((label, "o", OTHER_CELLS if as_cells else OTHER_DOTS))
    count, unsettled = len(starts.status), int(np.count_nonzero(starts.unsettled))
    of_unsettled, unknown = f"({unsettled} of {count} starts)", int(np.count_nonzero(starts.unknown))
    unknown_words = f"failed, not known ({failed} of {count} starts)"
    if unknown > failed:
        unknown_words = f"not known ({unknown} of {count} starts, {failed} failed)"
    handles: list[Artist]
    if as_cells:
        border: Properties = {"edgecolor": "#808080", "linewidth": 0.3}
        handles = [area_entry(facecolor=colour, label=label, **border) for label, _, colour in entries]
        for number, label, pattern in (
            (unsettled, f"unsettled {of_unsettled}", UNSETTLED_HATCH),
            (unknown, unknown_words, UNKNOWN_HATCH),
        ):
            if number:
                style: Properties = {"facecolor": "white", "edgecolor": "black", "linewidth": 0.3, "hatch": pattern}
                handles.append(area_entry(label=label, **style))
        return handles
    handles = [marker_entry(label, marker, colour, edge=0.2) for label, marker, colour in entries]
    if unsettled:
        handles.append(marker_entry(f"open: unsettled {of_unsettled}", hollow=True))
    if unknown:
        handles.append(marker_entry(unknown_words, "x", "black", edge=0.2))
    return handles


KINDS = (
    Kind(
        "basin",
        "which start goes to which attractor, over two states; of one operating point",
        of=STARTS,
        # the default of a slice
        place=lambda data: (52 if len(data.swept) > 1 else 5 if data.slice else 12) if has_starts(data) else None,
        page=basin,
        uses=lambda model: (*ATTRACTOR_VARIABLES, "initial_state"),
        takes=("states",),
        advice=needs_starts,
    ),
)
