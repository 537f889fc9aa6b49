"""What the checks of a sweep say of its points, on the cells of a map or of a strip of
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
from nsdrill.plot.hatching import covered
from nsdrill.plot.style import GREY

_PATTERN = "//////"
_LARGEST, _SMALLEST = 4.5, 1.6  # points of diameter of a dot


def overlay_verdicts(axes: Axes, x: Array, y: Array, verdicts: Array, cell_size: float) -> None:
    """Hatch the cells [y, x] between the edges ``x`` and ``y`` whose features do not
    hold, and put a dot where the response does not or a check failed; ``cell_size`` in
    points."""
    if np.any(doubtful := verdicts == FEATURES_DIFFER):
        axes.add_collection(
            PathCollection(
                [covered((x, y), doubtful)],
                facecolors="none",
                edgecolors="white",
                linewidths=0,
                hatch=_PATTERN,
                gid="features_differ",
            ),
            autolim=False,
        )
    rows, columns = np.nonzero((verdicts == RESPONSE_DIFFERS) | (verdicts == CHECK_FAILED))
    if rows.size:
        size = float(np.clip(0.6 * cell_size, _SMALLEST, _LARGEST))
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
    """Legend entries with how many points are in doubt."""
    handles: list[Artist] = []
    checked = int(np.count_nonzero(verdicts != UNCHECKED))
    if features := int(np.count_nonzero(verdicts == FEATURES_DIFFER)):
        handles.append(
            Patch(
                facecolor=GREY,
                edgecolor="white",
                linewidth=0,
                hatch=_PATTERN,
                label=f"checked: numbers differ ({features} of {checked})",
            )
        )
    responses, failed = (
        int(np.count_nonzero(verdicts == code)) for code in (RESPONSE_DIFFERS, CHECK_FAILED)
    )
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
