"""The legend below the panels of a picture. It is made when the panels have their limits:
an entry with a name stands for marks, and is there where one of these is seen within the
limits of a panel."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection, QuadMesh
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.data import Array
from nsdrill.figures.look import look
from nsdrill.figures.page import SHORTEST_LINE, Picture, below, lay_out, panels_of
from nsdrill.figures.style import WARNING, font_size

LEGEND_ROWS = 3  # for which a page has room
TOLERANCE = 1e-6  # of a panel: marks on its frame are seen


def put_legend(figure: Figure) -> None:
    """Write what is to stand below the panels of a picture whose panels are complete:
    the entries of its legend whose marks are seen, each once, and its warnings."""
    words, names = below(figure), seen_names(panels_of(figure))
    handles = {str(handle.get_label()): handle for handle in words.entries if is_seen_of(handle, names)}
    _legend_below(figure, list(handles.values()), words.columns)
    if words.warnings is not None:
        _put_warnings(figure, words.warnings)
    if words.within:
        lay_out(figure)
        for write in words.within:
            write()


def is_seen_of(entry: Artist, names: Iterable[str]) -> bool:
    """Whether an entry stands for one of the marks with these ``names``, by its ``gid``:
    a pattern for the whole name of a mark, or for its first words between colons. True
    of an entry without one."""
    gid = entry.get_gid()
    return gid is None or any(fnmatchcase(name, pattern) for name in names for pattern in (gid, f"{gid}:*"))


def seen_names(panels: Iterable[Axes]) -> set[str]:
    """The names of all marks that are seen in these panels; those of cells with codes
    are ``GID:SCALE:CODE``."""
    names: set[str] = set()
    for axes in panels:
        axes.get_xlim()  # fits the limits to the data, which is else done when it is drawn
        for mark in axes.get_children():
            if (gid := mark.get_gid()) is None:
                continue
            if isinstance(mark, QuadMesh) and isinstance(mark.norm, BoundaryNorm):
                names |= {f"{gid}:{mark.get_cmap().name}:{code}" for code in _seen_codes(axes, mark)}
            elif _is_seen(axes, mark):
                names.add(gid)
    return names


def _is_seen(axes: Axes, mark: Artist) -> bool:
    """Whether a part of a mark lies within the limits of a panel."""
    if isinstance(mark, Line2D):
        path = (mark.get_transform() - axes.transAxes).transform(mark.get_xydata())
        has_markers = str(mark.get_marker()).strip().lower() not in ("", "none")
        if has_markers and np.any(_overlap(path, path)):
            return True
        return mark.get_linestyle() != "None" and bool(np.any(_cross(path[:-1], path[1:])))
    if isinstance(mark, Patch | Collection):
        paths = mark.get_paths() if isinstance(mark, Collection) else [mark.get_path()]
        to_panel = mark.get_transform() - axes.transAxes
        areas = [area for path in paths for area in to_panel.transform_path(path).to_polygons(closed_only=False)]
        return any(bool(_overlap(np.nanmin(area, axis=0), np.nanmax(area, axis=0))) for area in map(np.asarray, areas))
    return True


def _overlap(low: Array, high: Array) -> Array:
    """Whether boxes with these corners [..., 2], in parts of a panel, reach into it."""
    return np.all((high > -TOLERANCE) & (low < 1.0 + TOLERANCE), axis=-1)


def _cross(start: Array, end: Array) -> Array:
    """Whether straight pieces of a line [..., 2] reach into the panel: their boxes do, and
    not all of its corners lie on one side of them."""
    (x, y), (along, up) = np.moveaxis(start, -1, 0), np.moveaxis(end - start, -1, 0)
    sides = np.sign([along * (corner_y - y) - up * (corner_x - x) for corner_x in (0, 1) for corner_y in (0, 1)])
    return _overlap(np.minimum(start, end), np.maximum(start, end)) & (np.abs(sides.sum(axis=0)) < 4)


def _seen_codes(axes: Axes, mesh: QuadMesh) -> list[int]:
    """The codes of the cells that are seen."""
    places = np.asarray(mesh.get_coordinates())
    corners = (mesh.get_transform() - axes.transAxes).transform(places.reshape(-1, 2)).reshape(places.shape)
    one, other = corners[:-1, :-1], corners[1:, 1:]
    codes: np.ma.MaskedArray = np.ma.asarray(mesh.get_array(), dtype=int).reshape(one.shape[:2])
    seen = _overlap(np.minimum(one, other), np.maximum(one, other))
    return np.unique(codes[seen].compressed()).tolist()


def _legend_below(figure: Figure, handles: Sequence[Artist], columns: int) -> None:
    """A legend below the panels, in ``columns`` columns or as many as fit the width of
    the figure; long texts are broken in one column, and in two of many entries. A
    picture with a high legend is higher, so that its panels keep their heights."""
    if not handles:
        return
    available = figure.bbox.width
    for count in range(min(columns, len(handles)), 0, -1):
        legend = figure.legend(handles=list(handles), loc="outside lower center", ncols=count)
        width, texts = legend.get_window_extent().width, legend.get_texts()
        if width > available and (count == 1 or (count == 2 and len(handles) > 2 * LEGEND_ROWS)):
            longest = max(len(text.get_text()) for text in texts)
            for text in texts:
                text.set_text(
                    textwrap.fill(text.get_text(), max(SHORTEST_LINE, int(0.95 * longest * available / width)))
                )
            width = legend.get_window_extent().width
        if width <= available or count == 1:
            break
        legend.remove()
    page, lines = legend.get_figure(root=True), sum(text.get_text().count("\n") + 1 for text in texts)
    rows = -(-lines // count)
    if isinstance(page, Picture) and look.get().height is None and rows > LEGEND_ROWS:
        more = legend.get_window_extent().height * (1 - LEGEND_ROWS / rows)
        page.set_figheight(page.get_figheight() + more / page.dpi)


def _put_warnings(figure: Figure, texts: list[str]) -> None:
    """The warnings above the legend, in its width; the figure grows by their height, and
    by that of its title."""
    if not figure.legends:
        return
    texts = texts if look.get().warnings else []
    legend, size = figure.legends[-1], font_size(7)
    height = legend.get_window_extent().height
    title, width = legend.get_title(), figure.bbox.width - 12.0 * figure.dpi / 72
    title.set(color=WARNING, gid="warnings", parse_math=False)
    for characters in range(140, SHORTEST_LINE, -4):
        lines = [textwrap.fill(text, characters, subsequent_indent="   ", break_on_hyphens=False) for text in texts]
        legend.set_title("\n".join(lines), prop=FontProperties(size=size, weight="bold"))
        if title.get_window_extent().width <= width:
            break
    if isinstance(figure, Picture) and look.get().height is None:
        heading_lines = figure.get_suptitle().count("\n")
        grown = (legend.get_window_extent().height - height) / figure.dpi
        figure.set_figheight(figure.get_figheight() + grown + heading_lines * 1.4 * font_size(9) / 72)
