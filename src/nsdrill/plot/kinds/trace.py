"""One page with everything of a trajectory: histories, orbit in the hole, phase planes."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from matplotlib.figure import Figure

from nsdrill.data import Trace
from nsdrill.plot.kinds.histories import ROOM, draw_histories, still
from nsdrill.plot.kinds.orbit import draw_orbit, has_orbit
from nsdrill.plot.kinds.phase import draw_planes
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.style import new_figure, page_width, put_title
from nsdrill.plot.traces import check_length, planes_of, room_for, title_of

ROW = 1.6  # inches of a plane
TWO_COLUMNS = 5.0  # inches from which on the planes stand beside the histories


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    planes, orbit = len(planes_of(trace)), has_orbit(trace)
    tall, heights = (
        8.6 + room_for(trace) - ROOM * len(still(trace)),
        [*[1.55] * orbit, *[1.0] * planes],
    )
    tall = max(tall, 0.7 + sum(heights) * ROW)
    if page_width() >= TWO_COLUMNS:
        figure = new_figure(page_width(), tall)
        left, right = cast("Any", figure.subfigures(1, 2, width_ratios=(1.6, 1.0)))
    else:
        below = sum(heights) * 0.55 * page_width()
        figure = new_figure(page_width(), tall + below)
        left, right = cast("Any", figure.subfigures(2, 1, height_ratios=(tall, below)))
    draw_histories(left, trace, units)
    panels = list(np.atleast_1d(right.subplots(orbit + planes, 1, height_ratios=heights)))
    if orbit:
        draw_orbit(panels[0], trace, units)
    draw_planes(panels[orbit:], trace, units)
    right.align_ylabels(panels[orbit:])
    put_title(figure, title_of(trace, units))
    return figure


KINDS = (
    Kind(
        "trace",
        "one page with everything: histories, orbit in the hole, phase planes",
        of=TRACE,
        place=lambda data: 80 if isinstance(data, Trace) else None,
        draw=draw,
        across=lambda data: "time",
    ),
)
