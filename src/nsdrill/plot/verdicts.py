"""The verdicts of the checks of a sweep, drawn on the cells of a map or of a strip of
responses."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.data import Array
from nsdrill.observe.trust import CHECK_FAILED, FEATURES_DIFFER, RESPONSE_DIFFERS, UNCHECKED
from nsdrill.plot.hatching import covering_path
from nsdrill.plot.style import GREY

_HATCH = "//////"
_LARGEST_DOT, _SMALLEST_DOT = 4.5, 1.6  # points of diameter of a dot


def overlay_verdicts(axes: Axes, x: Array, y: Array, verdicts: Array, cell_size: float) -> None:
    """Hatch the cells [y, x] between the edges ``x`` and ``y`` where a check found other
    features, and put a dot where it found another response, or failed; ``cell_size`` in
    points."""
    if np.any(doubtful := verdicts == FEATURES_DIFFER):
        axes.add_collection(
            PathCollection(
                [covering_path((x, y), doubtful)],
                facecolors="none",
                edgecolors="white",
                linewidths=0,
                hatch=_HATCH,
                gid="features_differ",
            ),
            autolim=False,
        )
    rows, columns = np.nonzero((verdicts == RESPONSE_DIFFERS) | (verdicts == CHECK_FAILED))
    if rows.size:
        size = float(np.clip(0.6 * cell_size, _SMALLEST_DOT, _LARGEST_DOT))
        axes.plot(
            0.5 * (x[columns] + x[columns + 1]),
            0.5 * (y[rows] + y[rows + 1]),
            marker="o",
            color="black",
            markersize=size,
            markeredgecolor="white",
            markeredgewidth=min(0.5, 0.2 * size),
            linestyle="none",
            gid="response_differs",
            scalex=False,
            scaley=False,
        )


def verdict_handles(verdicts: Array) -> list[Artist]:
    """Legend entries with the numbers of doubtful points."""
    handles: list[Artist] = []
    checked = int(np.count_nonzero(verdicts != UNCHECKED))
    if features := int(np.count_nonzero(verdicts == FEATURES_DIFFER)):
        handles.append(
            Patch(
                facecolor=GREY,
                edgecolor="white",
                linewidth=0,
                hatch=_HATCH,
                label=f"checked: numbers differ ({features} of {checked})",
            )
        )
    responses, failed = (int(np.count_nonzero(verdicts == code)) for code in (RESPONSE_DIFFERS, CHECK_FAILED))
    if responses or failed:
        unknown = f", {failed} unknown: a check failed" if failed else ""
        handles.append(
            Line2D(
                [],
                [],
                color="black",
                marker="o",
                markersize=4,
                markeredgecolor="white",
                markeredgewidth=0.5,
                linestyle="none",
                label=f"checked: response differs ({responses} of {checked}{unknown})",
            )
        )
    return handles
