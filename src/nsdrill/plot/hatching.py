"""Patterns over selected cells of a map."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.colors import to_hex, to_rgb
from matplotlib.path import Path

from nsdrill.data import Array
from nsdrill.plot.style import GREY

VEIL = 0.18  # share of white over cells that were not run
_RED, _GREEN, _BLUE = ((1 - VEIL) * part + VEIL for part in to_rgb(GREY))
PALE_GREY = to_hex((_RED, _GREEN, _BLUE))


def veil(axes: Axes, cells: tuple[Array, Array], selected: Array) -> None:
    """Make the ``selected`` cells paler, as what they show is inferred from those
    around them. No pattern: it would hide what the map shows."""
    if np.any(selected):
        axes.add_collection(
            PathCollection(
                [covering_path(cells, selected)], facecolors=(1.0, 1.0, 1.0, VEIL), linewidths=0, gid="inferred"
            ),
            autolim=False,
        )


def hatch(
    axes: Axes,
    cells: tuple[Array, Array],
    selected: Array,
    pattern: str,
    face: str,
    edge: str,
    gid: str,
    width: float | None = None,
) -> None:
    """Cover the ``selected`` cells [y, x], whose edges are ``cells`` (x, y), with a
    pattern; ``width`` of its lines in points."""
    if not np.any(selected):
        return
    paths = [covering_path(cells, selected)]
    if face != "none":
        axes.add_collection(
            PathCollection(paths, facecolors=face, edgecolors=face, linewidths=0.6, gid=f"{gid}:ground"), autolim=False
        )
    if pattern:
        collection = PathCollection(paths, facecolors="none", edgecolors=edge, linewidths=0, hatch=pattern, gid=gid)
        if width is not None and hasattr(collection, "set_hatch_linewidth"):  # of 3.10 on
            collection.set_hatch_linewidth(width)
        axes.add_collection(collection, autolim=False)


def covering_path(cells: tuple[Array, Array], selected: Array) -> Path:
    """The ``selected`` cells [y, x] as one path, a rectangle for each run of them in a
    row, so that the pattern is drawn once."""
    x, y = cells
    steps = np.diff(np.pad(np.asarray(selected, dtype=np.int8), ((0, 0), (1, 1))), axis=1)
    rows, left = np.nonzero(steps == 1)
    right = np.nonzero(steps == -1)[1]
    corners = np.stack(
        [
            np.column_stack((x[left], y[rows])),
            np.column_stack((x[right], y[rows])),
            np.column_stack((x[right], y[rows + 1])),
            np.column_stack((x[left], y[rows + 1])),
            np.column_stack((x[left], y[rows])),
        ],
        axis=1,
    )
    codes = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
    return Path(corners.reshape(-1, 2), codes * len(rows))
