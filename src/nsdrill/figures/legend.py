"""The legend below the panels of a picture. It is made when the panels have their limits:
an entry with a name stands for marks, and is there where one of these is seen within the
limits of a panel."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from typing import Protocol

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection, QuadMesh
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.data import Array
from nsdrill.figures.look import look
from nsdrill.figures.page import SHORTEST_LINE, Picture, lay_out
from nsdrill.figures.painters import Page
from nsdrill.figures.style import WARNING, font_size

LEGEND_ROWS = 3  # for which a page has room
TOLERANCE = 1e-6  # of a panel: marks on its frame are seen


def put_legend(figure: Figure, page: Page, panels: Mapping[str, Axes], further: Iterable[Artist] = ()) -> None:
    """Write what is to stand below the ``panels`` of a figure when these are complete: the
    entries of its legend whose marks are seen, each once, those of the page before
    ``further`` ones, and its warnings. Then the panels have their sizes, and the words that
    need these are written."""
    put_words(_Below(figure), seen_entries([*page.entries(panels), *further], panels.values()), page)
    if page.within:
        lay_out(figure)
    for name, paint in page.within.items():
        if name in panels:
            paint(panels[name])


def put_words(below: Below, entries: Sequence[Artist], page: Page) -> None:
    """Write the legend with these entries, and above it the warnings of a page."""
    legend = _put_entries(below, entries, page.columns)
    if legend is not None and page.warnings is not None:
        _put_warnings(below, legend, page.warnings)


class Below(Protocol):
    """The room below panels: its ``width`` in pixels, how a legend is made there, and
    the picture that is higher where there is much in it, if any."""

    width: float
    picture: Picture | None

    def legend(self, handles: Sequence[Artist], columns: int) -> Legend:
        """A legend of these handles."""


class _Below:
    """The room below the panels of a figure."""

    def __init__(self, figure: Figure) -> None:
        self.width, self.figure = figure.bbox.width, figure
        self.picture = figure if isinstance(figure, Picture) else None

    def legend(self, handles: Sequence[Artist], columns: int) -> Legend:
        return self.figure.legend(handles=list(handles), loc="outside lower center", ncols=columns)


def seen_entries(entries: Iterable[Artist], panels: Iterable[Axes]) -> list[Artist]:
    """Those of the entries whose marks are seen in the panels, each once."""
    names = seen_names(panels)
    return list({str(entry.get_label()): entry for entry in entries if is_seen_of(entry, names)}.values())


def is_seen_of(entry: Artist, names: Iterable[str]) -> bool:
    """Whether an entry stands for one of the marks with these ``names``, by its ``gid``:
    a pattern for the whole name of a mark, or for its first words between colons. True
    of an entry without one."""
    gid = entry.get_gid() if isinstance(entry, Artist) else None  # none of a container, as of bars
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


def _put_entries(below: Below, handles: Sequence[Artist], columns: int) -> Legend | None:
    """A legend in ``columns`` columns or as many as fit the width; long texts are broken in
    one column, and in two of many entries. A picture with a high legend is higher, so that
    its panels keep their heights. None without handles."""
    if not handles:
        return None
    for count in range(min(columns, len(handles)), 0, -1):
        legend = below.legend(handles, count)
        width, texts = legend.get_window_extent().width, legend.get_texts()
        if width > below.width and (count == 1 or (count == 2 and len(handles) > 2 * LEGEND_ROWS)):
            longest = max(len(text.get_text()) for text in texts)
            for text in texts:
                text.set_text(
                    textwrap.fill(text.get_text(), max(SHORTEST_LINE, int(0.95 * longest * below.width / width)))
                )
            width = legend.get_window_extent().width
        if width <= below.width or count == 1:
            break
        legend.remove()
    rows = -(-sum(text.get_text().count("\n") + 1 for text in texts) // count)
    if below.picture is not None and look.get().height is None and rows > LEGEND_ROWS:
        more = legend.get_window_extent().height * (1 - LEGEND_ROWS / rows)
        below.picture.set_figheight(below.picture.get_figheight() + more / below.picture.dpi)
    return legend


def _put_warnings(below: Below, legend: Legend, texts: Sequence[str]) -> None:
    """The warnings above the legend, in its width; the figure grows by their height, and
    by that of its title."""
    texts = texts if look.get().warnings else []
    size, height, dpi = font_size(7), legend.get_window_extent().height, legend.figure.dpi
    title, width = legend.get_title(), below.width - 12.0 * dpi / 72
    title.set(color=WARNING, gid="warnings", parse_math=False)
    for characters in range(140, SHORTEST_LINE, -4):
        lines = [textwrap.fill(text, characters, subsequent_indent="   ", break_on_hyphens=False) for text in texts]
        legend.set_title("\n".join(lines), prop=FontProperties(size=size, weight="bold"))
        if title.get_window_extent().width <= width:
            break
    if below.picture is not None and look.get().height is None:
        heading_lines = below.picture.get_suptitle().count("\n")
        grown = (legend.get_window_extent().height - height) / dpi
        below.picture.set_figheight(below.picture.get_figheight() + grown + heading_lines * 1.4 * font_size(9) / 72)
