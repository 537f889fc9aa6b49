"""The motions and the contact forces of a trajectory against time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from nsdrill.data import Trace
from nsdrill.models.registry import drawn_in
from nsdrill.plot.decimation import envelope
from nsdrill.plot.labels import quantity
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.schedule import moving, set_values
from nsdrill.plot.style import BLUE, FULL_WIDTH, REFERENCE, new_figure, put_title
from nsdrill.plot.traces import check_length, room_for, title_of
from nsdrill.variables import SCHEDULED

BINS = 1500  # stretches of a history: about one for each pixel of print


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    figure = new_figure(FULL_WIDTH, 7.2 + room_for(trace))
    draw_histories(figure, trace, units)
    put_title(figure, title_of(trace, units))
    return figure


def draw_histories(figure: Figure | SubFigure, trace: Trace, units: str) -> None:
    """The motions and the contact forces against time, and what of the operating point moves, one below the other."""
    scheduled = [SCHEDULED[name] for name in moving(trace)]
    names = (*drawn_in(trace.attrs).histories, *scheduled)
    panels = list(np.atleast_1d(figure.subplots(len(names), 1, sharex=True)))
    time = quantity("time", units)
    for axes, name in zip(panels, names, strict=True):
        y = quantity(name, units)
        t, values = envelope(trace.time, trace[name] / y.scale, BINS)
        axes.plot(t / time.scale, values, color=BLUE, linewidth=0.5, gid=f"history:{name}")
        axes.set_ylabel(y.label)
        axes.margins(x=0)
    speed, gap = trace.attrs.get("rotary_speed"), trace.attrs.get("gap")
    if "bit_speed" in names and "drive_speed" in scheduled:
        speeds = set_values(trace, "rotary_speed") / quantity("bit_speed", units).scale
        t, values = envelope(trace.time, speeds, BINS)
        panels[names.index("bit_speed")].plot(
            t / time.scale, values, color=REFERENCE, linewidth=0.7, dashes=(4, 2), zorder=3, gid="set speed"
        )
    elif "bit_speed" in names and speed is not None:
        _reference(panels[names.index("bit_speed")], float(speed) / quantity("bit_speed", units).scale, "set speed")
    if "radius" in names and gap is not None:
        _reference(panels[names.index("radius")], float(gap) / quantity("radius", units).scale, "wall")
    panels[-1].set_xlabel(time.label)
    figure.align_ylabels(panels)


def _reference(axes: Axes, height: float, word: str) -> None:
    """A line that is not data, named where it ends so that no legend is needed."""
    axes.axhline(height, color=REFERENCE, linewidth=0.7, dashes=(4, 2), zorder=3, gid=word)
    axes.annotate(
        word,
        (1.0, height),
        xycoords=("axes fraction", "data"),
        xytext=(2, 0),
        textcoords="offset points",
        va="center",
        rotation=90,
        fontsize=6,
        color=REFERENCE,
    )


KINDS = (
    Kind(
        "histories",
        "the three motions and the contact forces against time",
        of=TRACE,
        place=lambda data: 81 if isinstance(data, Trace) else None,
        draw=draw,
        across=lambda data: "time",
    ),
)
