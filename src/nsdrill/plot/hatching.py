"""Patterns over chosen cells of a map."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.path import Path

from nsdrill.data import Array


def hatch(
    axes: Axes,
    cells: tuple[Array, Array],
    chosen: Array,
    pattern: str,
    face: str,
    edge: str,
    gid: str,
) -> None:
    """Cover the chosen cells [y, x] with a pattern."""
    if not np.any(chosen):
        return
    area = [covered(cells, chosen)]
    if face != "none":
        axes.add_collection(
            PathCollection(
                area, facecolors=face, edgecolors=face, linewidths=0.6, gid=f"{gid}:ground"
            ),
            autolim=False,
        )
    if pattern:
        axes.add_collection(
            PathCollection(
                area, facecolors="none", edgecolors=edge, linewidths=0, hatch=pattern, gid=gid
            ),
            autolim=False,
        )


def covered(cells: tuple[Array, Array], chosen: Array) -> Path:
    """The chosen cells [y, x] as one path, a rectangle for each run of them in a row: a
    pattern is drawn once."""
    x, y = cells
    change = np.diff(np.pad(np.asarray(chosen, dtype=np.int8), ((0, 0), (1, 1))), axis=1)
    rows, left = np.nonzero(change == 1)
    right = np.nonzero(change == -1)[1]
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
