"""The areas of a window: the code and colour of each response, and its name written into
the area, so that the picture can be read in grey."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patheffects import withStroke

from nsdrill.analysis.window import CRITICAL, HISTORY_DEPENDENT, Classes
from nsdrill.data import Array
from nsdrill.plot.style import BAD_TO_GOOD, BLACK, GREY, RESPONSES, SAFE_COLOUR, font_size, ink_on

# Codes of the cells: the response bits of critical points (0: by a severity or
# by disagreeing checks alone), and after them safe and unknown.
SAFE_CODE, UNKNOWN_CODE = len(RESPONSES), len(RESPONSES) + 1
CRITICAL_COLOURS = (BAD_TO_GOOD[0], *(style.colour for style in RESPONSES[1:]))
COLOURS = ListedColormap([*CRITICAL_COLOURS, SAFE_COLOUR, GREY], name="window")
NORM = BoundaryNorm(np.arange(-0.5, UNKNOWN_CODE + 1), UNKNOWN_CODE + 1)
RIM_HATCH, UNKNOWN_HATCH = "////", "xxxxxx"
HATCH_WIDTH = 1.8  # points
CHARACTER, LINE = 0.075, 0.16  # inches of a letter of an area, and of its line
SMALLEST_AREA = 0.004  # of the map, from which an area has a letter


def name_areas(
    axes: Axes, classified: Classes, cells: tuple[Array, Array], number: int, point: dict[str, Any] | None
) -> None:
    """The letters, or where there is room the name, of the response of each area; with
    a question mark where the history decides. Small areas have none but where they
    bound the recommended point."""
    from scipy import ndimage

    state, bits = classified.state[number], classified.bits[number]
    box = axes.get_window_extent()
    width, height = box.width / axes.figure.dpi, box.height / axes.figure.dpi
    (left, right), (low, high) = ((edge[0], edge[-1]) for edge in cells)
    bounding = _beside(classified, point) if point else set()
    for value in (CRITICAL, HISTORY_DEPENDENT):
        for code in np.unique(bits[state == value]).tolist():
            style, mark = RESPONSES[code], "?" if value == HISTORY_DEPENDENT else ""
            labels, count = ndimage.label((state == value) & (bits == code))
            for area in range(1, count + 1):
                inside = labels == area
                is_bound = any(inside[cell] for cell in bounding)
                if not is_bound and inside.mean() < SMALLEST_AREA:
                    continue
                row, begin, end = _widest(inside)
                column = (begin + end) // 2
                room = (cells[0][end] - cells[0][begin]) / (right - left) * width
                rows = np.flatnonzero(inside[:, column])
                tall = abs(cells[1][rows[-1] + 1] - cells[1][rows[0]]) / abs(high - low) * height
                name = (style.name if code else "!") + mark
                letters = (style.letters or "!") + mark
                text = name if room > CHARACTER * (len(name) + 1) else letters
                if not is_bound and (room < CHARACTER * len(text) or tall < LINE):
                    continue
                colour = ink_on(CRITICAL_COLOURS[code]) if value == CRITICAL else BLACK
                halo = CRITICAL_COLOURS[code] if value == CRITICAL else "white"
                axes.text(
                    (cells[0][begin] + cells[0][end]) / 2,
                    (cells[1][row] + cells[1][row + 1]) / 2
                    if classified.y or room > 2 * CHARACTER * len(text)
                    else 0.82,
                    text,
                    color=colour,
                    fontsize=font_size(7),
                    ha="center",
                    va="center",
                    zorder=4,
                    clip_on=True,
                    path_effects=[withStroke(linewidth=2.5, foreground=halo)],
                    gid=f"area:{code}",
                )


def _widest(inside: Array) -> tuple[int, int, int]:
    """The row of an area, and the ends of its longest run of cells in it: the longest of
    all, of equal ones the middle one."""
    runs = []
    for row in np.flatnonzero(inside.any(axis=1)).tolist():
        steps = np.flatnonzero(np.diff(np.pad(inside[row].astype(int), 1))).tolist()
        runs += [(row, begin, end) for begin, end in zip(steps[::2], steps[1::2], strict=True)]
    longest_run = max(end - begin for _, begin, end in runs)
    chosen = [run for run in runs if run[2] - run[1] == longest_run]
    return chosen[len(chosen) // 2]


def _beside(classified: Classes, point: dict[str, Any]) -> set[tuple[int, int]]:
    """The cells (row, column) that bound the recommended point."""
    at = {
        axis: int(np.argmin(np.abs(classified.values(axis) - point[axis])))
        for axis in (classified.x, classified.y)
        if axis
    }
    found = set()
    for axis in at:
        for side in point["margins"][axis].values():
            if side["first_not_safe"] is not None:
                beyond = int(np.argmin(np.abs(classified.values(axis) - side["first_not_safe"])))
                place = {**at, axis: beyond}
                found.add((place.get(str(classified.y), 0), place[classified.x]))
    return found
