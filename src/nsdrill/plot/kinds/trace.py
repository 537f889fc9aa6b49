"""A trajectory on one page: histories, orbit in the hole, phase planes."""

from __future__ import annotations

from typing import Any, cast

from matplotlib.figure import Figure

from nsdrill.data import Trace
from nsdrill.plot.kinds.histories import constant_histories, draw_histories
from nsdrill.plot.kinds.orbit import draw_orbit, has_orbit
from nsdrill.plot.kinds.phase import draw_planes
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.style import new_figure, page_width, put_title, stack
from nsdrill.plot.traces import HISTORY_HEIGHT, check_length, extra_height, planes_of, title_of

PLANE_HEIGHT = 1.6  # inches
TWO_COLUMNS_FROM = 5.0  # inches of width, from which on the planes stand beside the histories


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    planes, shows_orbit = len(planes_of(trace)), has_orbit(trace)
    height, heights = (
        8.6 + extra_height(trace) - HISTORY_HEIGHT * len(constant_histories(trace)),
        [*[1.55] * shows_orbit, *[1.0] * planes],
    )
    height = max(height, 0.7 + sum(heights) * PLANE_HEIGHT)
    if page_width() >= TWO_COLUMNS_FROM:
        figure = new_figure(page_width(), height)
        left, right = cast("Any", figure.subfigures(1, 2, width_ratios=(1.6, 1.0)))
    else:
        height_below = sum(heights) * 0.55 * page_width()
        figure = new_figure(page_width(), height + height_below)
        left, right = cast("Any", figure.subfigures(2, 1, height_ratios=(height, height_below)))
    draw_histories(left, trace, units)
    panels = stack(right, shows_orbit + planes, shared=False, height_ratios=heights)
    if shows_orbit:
        draw_orbit(panels[0], trace, units)
    draw_planes(panels[shows_orbit:], trace, units)
    right.align_ylabels(panels[shows_orbit:])
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
