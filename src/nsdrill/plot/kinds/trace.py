"""One page with everything of a trajectory: histories, orbit in the hole, phase planes."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from matplotlib.figure import Figure

from nsdrill.data import Trace
from nsdrill.models.registry import drawn_in
from nsdrill.plot.kinds.histories import draw_histories
from nsdrill.plot.kinds.orbit import draw_orbit, has_orbit
from nsdrill.plot.kinds.phase import draw_planes
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.style import FULL_WIDTH, new_figure, put_title
from nsdrill.plot.traces import check_length, room_for, title_of


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    planes, orbit = len(drawn_in(trace.attrs).planes), has_orbit(trace)
    figure = new_figure(FULL_WIDTH, 8.6 + room_for(trace))
    left, right = cast("Any", figure.subfigures(1, 2, width_ratios=(1.6, 1.0)))
    draw_histories(left, trace, units)
    panels = list(np.atleast_1d(right.subplots(orbit + planes, 1, height_ratios=[*[1.55] * orbit, *[1.0] * planes])))
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
