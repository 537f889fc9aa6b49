"""What lies on the cells of maps and strips: patterns, veils, outlines, names of areas, the
verdicts of the checks, values filled in from the cells around, and lines of equal rate of
penetration, which show the yield of a setting beside its safety."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import to_hex, to_rgb
from matplotlib.path import Path
from matplotlib.patheffects import AbstractPathEffect, Normal, Stroke
from matplotlib.ticker import MaxNLocator
from matplotlib.tri import LinearTriInterpolator, Triangulation

from nsdrill.analysis.planes import stretches
from nsdrill.data import Array
from nsdrill.figures.page import LABEL_OF_LINE, area_entry, line_entry
from nsdrill.figures.slices import edges
from nsdrill.figures.style import BLACK, FIELD_BORDER, GREY, Properties, Property, font_size, halo, ink_on
from nsdrill.models.model_description import Description
from nsdrill.observe.motion_kinds import CHECK_FAILED, FEATURES_DIFFER, RESPONSE_DIFFERS, UNCHECKED
from nsdrill.words.labels import quantity

VEIL = 0.18  # share of white over cells that were not run
red, green, blue = ((1 - VEIL) * part + VEIL for part in to_rgb(GREY))
PALE_GREY = to_hex((red, green, blue))
Cells = tuple[Array, Array]  # their edges along x and y, in the units that are shown


def cover(axes: Axes, cells: Cells, selected: Array, gid: str, **style: Property) -> None:
    """Cover the ``selected`` cells [y, x] with one path."""
    if np.any(selected):
        unlined: Properties = {"facecolors": "none", "linewidths": 0}
        axes.add_collection(
            PathCollection([covering_path(cells, selected)], gid=gid, **{**unlined, **style}), autolim=False
        )


def veil(axes: Axes, cells: Cells, selected: Array) -> None:
    """Make the ``selected`` cells paler, as what they show is inferred from those
    around them. No pattern: it would hide what the map shows."""
    cover(axes, cells, selected, "inferred", facecolors=(1.0, 1.0, 1.0, VEIL))


def hatch(
    axes: Axes, cells: Cells, selected: Array, pattern: str, edge: str, gid: str, *, face: str = "", width: float = 0.0
) -> None:
    """Cover the ``selected`` cells with a pattern, above a ground of the colour
    ``face`` where there is one; ``width`` of its lines in points, where it is not the
    usual one."""
    if face:
        cover(axes, cells, selected, f"{gid}:ground", facecolors=face, edgecolors=face, linewidths=0.6)
    if pattern:
        of_width = {"hatch_linewidth": width} if width and hasattr(PathCollection, "set_hatch_linewidth") else {}
        cover(axes, cells, selected, gid, edgecolors=edge, hatch=pattern, **of_width)


def covering_path(cells: Cells, selected: Array) -> Path:
    """The ``selected`` cells [y, x] as one path, a rectangle for each run of them in a
    row, so that the pattern is drawn once."""
    x, y = cells
    steps = np.diff(np.pad(np.asarray(selected, dtype=np.int8), ((0, 0), (1, 1))), axis=1)
    rows, left = np.nonzero(steps == 1)
    right = np.nonzero(steps == -1)[1]
    around = ((left, rows), (right, rows), (right, rows + 1), (left, rows + 1), (left, rows))
    corners = np.stack([np.column_stack((x[column], y[row])) for column, row in around], axis=1)
    codes = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
    return Path(corners.reshape(-1, 2), codes * len(rows))


def outline_entry(label: str) -> Artist:
    """The legend entry of an outline."""
    return line_entry(color="white", linewidth=1.2, path_effects=_outline_effects(), label=label)


def _outline_effects() -> list[AbstractPathEffect]:
    return [Stroke(linewidth=2.6, foreground=BLACK), Normal()]


def draw_outline(axes: Axes, cells: Cells, inside: Array) -> None:
    """Draw the border of the cells that are ``inside`` [y, x], white within black,
    which is visible on every colour."""
    outline = LineCollection(_borders(cells, inside, True), colors="white", linewidths=1.2, gid="confidence")
    outline.set(capstyle="round", path_effects=_outline_effects(), clip_on=False)
    axes.add_collection(outline)


def draw_field(axes: Axes, cells: Cells, inside: Array) -> None:
    """Draw a dark line around the cells that are ``inside`` [y, x]; none along the edge of
    the map, beyond which nothing is known."""
    line = LineCollection(_borders(cells, inside, False), colors=FIELD_BORDER, linewidths=1.8, gid="field")
    line.set(capstyle="projecting", zorder=3)
    axes.add_collection(line)


def _borders(cells: Cells, inside: Array, outer: bool) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """The sides of cells that lie between one ``inside`` [y, x] and one that is not, with
    ``outer`` those along the edge of the map too."""
    (x, y), padded = cells, np.pad(inside, 1, mode="constant" if outer else "edge")
    vertical = np.argwhere(padded[1:-1, 1:] != padded[1:-1, :-1])
    horizontal = np.argwhere(padded[1:, 1:-1] != padded[:-1, 1:-1])
    borders = [((x[j], y[i]), (x[j], y[i + 1])) for i, j in vertical]
    return borders + [((x[j], y[i]), (x[j + 1], y[i])) for i, j in horizontal]


CHARACTER, LINE = 0.075, 0.16  # inches of a letter of an area, and of its line
SMALLEST_AREA = 0.004  # of the map, from which an area has a letter


def name_areas(
    axes: Axes,
    cells: Cells,
    chosen: Array,
    words: tuple[str, str],
    ground: str,
    gid: str,
    bounding: Collection[tuple[int, int]] = (),
) -> None:
    """Write into every area of the ``chosen`` cells [y, x] the first of the ``words``
    or, where that has no room, the second. Small areas have none but where they contain
    one of the cells ``bounding``."""
    from scipy import ndimage

    box = axes.get_window_extent()
    # inches for one unit of the axes
    width, height = (
        size / axes.figure.dpi / abs(ends[-1] - ends[0])
        for size, ends in zip((box.width, box.height), cells, strict=True)
    )
    labels, count = ndimage.label(chosen)
    for inside in (labels == area for area in range(1, count + 1)):
        is_bound = any(inside[cell] for cell in bounding)
        if not is_bound and inside.mean() < SMALLEST_AREA:
            continue
        row, begin, end = _widest(inside)
        rows = np.flatnonzero(inside[:, (begin + end) // 2])
        room = (cells[0][end] - cells[0][begin]) * width
        tall = abs(cells[1][rows[-1] + 1] - cells[1][rows[0]]) * height
        text = words[0] if room > CHARACTER * (len(words[0]) + 1) else words[1]
        if not is_bound and (room < CHARACTER * len(text) or tall < LINE):
            continue
        middle = (cells[0][begin] + cells[0][end]) / 2, (cells[1][row] + cells[1][row + 1]) / 2
        if len(inside) == 1 and room <= 2 * CHARACTER * len(text):
            middle = middle[0], float(np.interp(0.82, (0.0, 1.0), cells[1]))
        write_name(axes, middle, text, ground, gid)


def write_name(axes: Axes, place: tuple[float, float], text: str, ground: str, gid: str) -> None:
    """Write the name of an area of the colour ``ground`` at this place."""
    centred: Properties = {"ha": "center", "va": "center", "zorder": 4.5, "clip_on": True}
    style: Properties = {"color": ink_on(ground), "fontsize": font_size(7), "path_effects": halo(2.5, ground)}
    axes.text(place[0], place[1], text, gid=gid, **style, **centred)


def _widest(inside: Array) -> tuple[int, int, int]:
    """The row of an area, and the ends of its longest run of cells in it: the longest
    of all, of equal ones the middle one."""
    runs = [(row, first, last + 1) for row, cells in enumerate(inside) for first, last in stretches(cells)]
    longest_run = max(end - begin for _, begin, end in runs)
    chosen = [run for run in runs if run[2] - run[1] == longest_run]
    return chosen[len(chosen) // 2]


DOUBT_HATCH = "///"
UNSETTLED_HATCH = "/////"
LARGEST_DOT, SMALLEST_DOT = 4.5, 1.6  # points of diameter of a dot
DOT: Properties = {"marker": "o", "color": "black", "markeredgecolor": "white", "linestyle": "none"}


def overlay_verdicts(axes: Axes, cells: Cells, verdicts: Array, cell_size: float) -> None:
    """Hatch the cells [y, x] where a check found other features, and put a dot where it
    found another response, or failed; ``cell_size`` in points."""
    x, y = cells
    hatch(axes, cells, verdicts == FEATURES_DIFFER, DOUBT_HATCH, "white", "features_differ", width=0.4)
    rows, columns = np.nonzero((verdicts == RESPONSE_DIFFERS) | (verdicts == CHECK_FAILED))
    if rows.size:
        size = float(np.clip(0.6 * cell_size, SMALLEST_DOT, LARGEST_DOT))
        middle = 0.5 * (x[columns] + x[columns + 1]), 0.5 * (y[rows] + y[rows + 1])
        own: Properties = {"markersize": size, "markeredgewidth": min(0.5, 0.2 * size), "gid": "response_differs"}
        axes.plot(*middle, scalex=False, scaley=False, **DOT, **own)


def hatch_unsettled(axes: Axes, cells: Cells, unsettled: Array) -> None:
    """Hatch the cells [y, x] of runs that had not settled, in black with white beside it, which is seen
    on every colour: what they show need not be what comes to stay."""
    hatch(axes, cells, unsettled, UNSETTLED_HATCH, "white", "unsettled:ground", width=1.5)
    hatch(axes, cells, unsettled, UNSETTLED_HATCH, "black", "unsettled", width=0.5)


def unsettled_entry(number: int, of: int) -> Artist:
    """The legend entry of what :func:`hatch_unsettled` hatches, with its number."""
    style: Properties = {"facecolor": "white", "edgecolor": "black", "linewidth": 0.4, "hatch": UNSETTLED_HATCH}
    return area_entry(unsettled_label(number, of), gid="unsettled", **style)


def unsettled_label(number: int, of: int) -> str:
    """The words of a legend for so many of so many points that had not settled."""
    return f"not settled ({number} of {of})"


def verdict_handles(verdicts: Array) -> list[Artist]:
    """Legend entries with the numbers of doubtful points."""
    handles: list[Artist] = []
    features, responses, failed, unchecked = (
        int(np.count_nonzero(verdicts == code)) for code in (FEATURES_DIFFER, RESPONSE_DIFFERS, CHECK_FAILED, UNCHECKED)
    )
    checked = verdicts.size - unchecked
    if features:
        label = f"checked: numbers differ ({features} of {checked})"
        style: Properties = {"facecolor": GREY, "edgecolor": "white", "linewidth": 0, "hatch": DOUBT_HATCH}
        handles.append(area_entry(label, gid="features_differ", **style))
    if responses or failed:
        unknown = f", {failed} unknown: a check failed" if failed else ""
        label = f"checked: response differs ({responses} of {checked}{unknown})"
        handles.append(line_entry(markersize=4, markeredgewidth=0.5, label=label, gid="response_differs", **DOT))
    return handles


def fill_inferred(values: Array, inferred: Array, known: Array, *, linear: bool) -> Array:
    """The values [procedure, row, y, x], those of ``inferred`` points filled in from
    the ``known`` points around them: by linear interpolation, or from the nearest."""
    from scipy.ndimage import distance_transform_edt

    result = values.copy()
    for place in np.ndindex(values.shape[:2]):
        known_here, to_fill = known[place] & np.isfinite(values[place]), inferred[place]
        if not known_here.any() or not to_fill.any():
            continue
        nearest = distance_transform_edt(~known_here, return_distances=False, return_indices=True)
        result[place][to_fill] = values[place][tuple(nearest)][to_fill]
        if linear:
            interpolated = _interpolated(values[place], known_here, to_fill)
            result[place][to_fill] = np.where(np.isfinite(interpolated), interpolated, result[place][to_fill])
    return result


def _interpolated(values: Array, known: Array, to_fill: Array) -> Array:
    """Linear interpolation between the known points; NaN outside their convex hull."""
    rows, columns = np.nonzero(known)
    try:
        interpolator = LinearTriInterpolator(Triangulation(columns, rows), values[known])
    except (RuntimeError, ValueError):  # too few, or all on a line
        return np.full(int(to_fill.sum()), np.nan)
    rows, columns = np.nonzero(to_fill)
    return np.ma.filled(interpolator(columns, rows), np.nan)


RATE_OF_PENETRATION = "rate_of_penetration"
MAX_LINES = 6
MIN_RELATIVE_RANGE = 0.02  # range relative to the greatest value: below it no lines are drawn
LABEL_CLEARANCE = 0.12  # between a label and a point kept clear, as a part of the axes
NAME_CLEARANCE = 0.07  # between a label and the name of an area
LABEL_ROOM = 1.1  # of the size of a label: the room that it needs inside the axes
ALONG_A_LINE = (0.5, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9)  # where a label that is moved may stand


def line_variables(model: Description) -> tuple[str, ...]:
    """The variables of a sweep of ``model`` that lines of equal rate are drawn from."""
    return tuple(variable.name for variable in model.derived if variable.name == RATE_OF_PENETRATION)


def draw_equal_rates(
    axes: Axes, centres: Cells, values: Array, units: str, keep_clear: Sequence[tuple[float, float]] = ()
) -> None:
    """Draw labelled lines of equal rate of penetration, ``values`` [y, x] in SI at the
    ``centres`` of cells in shown units. Values of NaN, as of points that were not run,
    are left out and the lines follow from the others. No label stands over the points
    ``keep_clear``, in units of the axes, and none over a text where there is another
    place.

    There are no lines with fewer than two values along an axis, or of values that hardly
    vary.
    """
    shown = quantity(RATE_OF_PENETRATION, units)
    values = values / shown.scale
    known = np.isfinite(values)
    if min(values.shape) < 2 or np.count_nonzero(known) < 4:
        return
    low, high = float(values[known].min()), float(values[known].max())
    levels = [level for level in MaxNLocator(MAX_LINES).tick_values(low, high) if max(low, 0.0) < level < high]
    if high - low < MIN_RELATIVE_RANGE * high or not levels:
        return
    if min(np.count_nonzero(known.any(axis=axis)) for axis in (0, 1)) < 2:
        return
    style: Properties = {"levels": levels, "colors": "black", "linewidths": 0.7, "linestyles": "dashed"}
    centres, values = _to_the_edges(centres, values)
    known = np.isfinite(values)
    if known.all():
        lines: Any = axes.contour(*centres, values, zorder=4, **style)
    else:
        x, y = np.meshgrid(*centres)
        lines = axes.tricontour(x[known], y[known], values[known], zorder=4, **style)
    lines.set(gid="equal", path_effects=halo(1.8))
    label_style: Properties = {"fontsize": font_size(6), "inline_spacing": 2}
    positions = _label_positions(axes, lines, keep_clear, label_style)
    for label in axes.clabel(lines, inline=True, manual=positions, **label_style):
        label.set(path_effects=halo(2.5), gid=f"equal{LABEL_OF_LINE}")


def equal_rates_entry(units: str) -> Artist:
    """The entry of what :func:`draw_equal_rates` draws."""
    label = quantity(RATE_OF_PENETRATION, units).label
    return line_entry(color="black", linewidth=0.7, linestyle="dashed", label=label, gid="equal")


def _to_the_edges(centres: Cells, values: Array) -> tuple[Cells, Array]:
    """The values [y, x] at the centres of cells, continued in a straight line to the
    outer edges of the outer cells."""
    continued = []
    for axis, centre in zip((1, 0), centres, strict=True):
        ends, along = edges(centre)[[0, -1]], np.moveaxis(values, axis, 0)
        before, after = (ends - centre[[0, -1]]) / (centre[[1, -1]] - centre[[0, -2]])
        outer = along[0] + before * (along[1] - along[0]), along[-1] + after * (along[-1] - along[-2])
        places, kept = np.unique([ends[0], *centre, ends[1]], return_index=True)
        values = np.moveaxis(np.stack([outer[0], *along, outer[1]])[kept], 0, axis)
        continued.append(places)
    return (continued[0], continued[1]), values


def _label_positions(
    axes: Axes, lines: Any, keep_clear: Sequence[tuple[float, float]], label_style: Properties
) -> list[tuple[float, float]]:
    """The positions of the labels of the lines: matplotlib's own where these lie inside
    the axes and leave the points ``keep_clear`` and if possible the names of areas free,
    else others along the same line. A line without such a place gets no label."""
    boxes = [text.get_window_extent() for text in axes.texts]
    corners = [(x, 0.5 * (box.y0 + box.y1)) for box in boxes for x in np.linspace(box.x0, box.x1, 5)]
    names = axes.transData.inverted().transform(corners) if corners else ()
    default_labels = axes.clabel(lines, inline=False, **label_style)
    positions = [label.get_position() for label in default_labels]
    sizes = [label.get_window_extent() for label in default_labels]
    for label in default_labels:
        label.remove()
    box = axes.get_window_extent()
    parts = axes.transData - axes.transAxes  # from the units of the axes to parts of them

    def clearance(place: Array, of: Array | Sequence[tuple[float, float]]) -> float:
        places = parts.transform(of) if len(of) else np.empty((0, 2))
        return float(np.min(np.hypot(*(places - place).T), initial=np.inf))

    found = []
    segments = [parts.transform(segment) for level in lines.allsegs for segment in level if len(segment)]
    for position, size in zip(positions, sizes, strict=True):
        half = LABEL_ROOM * np.hypot(size.width, size.height) / 2 / np.array([box.width, box.height])
        place = parts.transform(position)
        nearest = min(segments, key=lambda segment: float(np.min(np.hypot(*(segment - place).T))))
        number = np.linspace(0.0, 1.0, len(nearest))
        along = np.transpose([np.interp(ALONG_A_LINE, number, part) for part in nearest.T])
        inside = [one for one in (place, *along) if np.all((half < one) & (one < 1.0 - half))]
        free = [one for one in inside if clearance(one, keep_clear) > LABEL_CLEARANCE]
        if free:
            best = next((one for one in free if clearance(one, names) > NAME_CLEARANCE), free[0])
            x, y = parts.inverted().transform(best)
            found.append((float(x), float(y)))
    return found
