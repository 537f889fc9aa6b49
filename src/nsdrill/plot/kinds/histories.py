"""The motions and the contact forces of a trajectory against time.

Where the lines of a long trace would run into one block of ink, each history is a band
from its least to its greatest sample, with its mean in it, and the picture says so.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from nsdrill.data import Array, Trace
from nsdrill.models.registry import drawn_in
from nsdrill.plot.decimation import bands, envelope, swings
from nsdrill.plot.labels import quantity
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.schedule import moving, set_values
from nsdrill.plot.style import (
    BLUE,
    REFERENCE,
    SKY,
    new_figure,
    page_width,
    put_title,
    say_over,
    type_size,
)
from nsdrill.plot.traces import check_length, moves, room_for, title_of
from nsdrill.variables import SCHEDULED

BINS = 1500  # stretches of a history: about one for each pixel of print
SOLID = 50  # swings in an inch of which lines leave no white between them
BAND_BINS = 100  # stretches of a band in an inch
ROOM = 1.2  # inches of a page that a history takes
LEGIBLE = 1.1  # inches of a panel that axis and margin take


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    figure = new_figure(page_width(), 7.2 + room_for(trace) - ROOM * len(still(trace)))
    draw_histories(figure, trace, units)
    put_title(figure, title_of(trace, units))
    return figure


def draw_histories(figure: Figure | SubFigure, trace: Trace, units: str) -> None:
    """The motions and the contact forces against time, and what of the operating point
    moves, one below the other."""
    scheduled, resting = [SCHEDULED[name] for name in moving(trace)], still(trace)
    names = [name for name in (*drawn_in(trace.attrs).histories, *scheduled) if name not in resting]
    panels = list(np.atleast_1d(figure.subplots(len(names), 1, sharex=True)))
    time = quantity("time", units)
    histories = {name: trace[name] / quantity(name, units).scale for name in names}
    words = [
        f"{quantity(one, units).words.lower()} {quantity(one, units).value(value)}"
        for one, value in resting.items()
    ]
    words = [f"constant: {', '.join(words)}"] if words else []
    stretches = band_stretches(
        list(histories.values()), figure.bbox.width / panels[0].figure.dpi - LEGIBLE
    )
    for axes, (name, values) in zip(panels, histories.items(), strict=True):
        if stretches:
            _band(axes, trace.time / time.scale, values, stretches, name)
        else:
            t, kept = envelope(trace.time, values, BINS)
            axes.plot(t / time.scale, kept, color=BLUE, linewidth=0.5, gid=f"history:{name}")
        axes.set_ylabel(quantity(name, units).label)
        axes.margins(x=0)
    if stretches:
        each = float(trace.time[-1] - trace.time[0]) / stretches
        words += [f"bands: least to greatest in each {each:.2g} s", "lines: the mean"]
    say_over(panels[0], "; ".join(words), "left")
    speed, gap = trace.attrs.get("rotary_speed"), trace.attrs.get("gap")
    if "bit_speed" in names and "drive_speed" in scheduled:
        speeds = set_values(trace, "rotary_speed") / quantity("bit_speed", units).scale
        t, values = envelope(trace.time, speeds, BINS)
        panels[names.index("bit_speed")].plot(
            t / time.scale,
            values,
            color=REFERENCE,
            linewidth=0.7,
            dashes=(4, 2),
            zorder=3,
            gid="set speed",
        )
    elif "bit_speed" in names and speed is not None:
        _reference(
            panels[names.index("bit_speed")],
            float(speed) / quantity("bit_speed", units).scale,
            "set speed",
        )
    if "radius" in names and gap is not None:
        _reference(
            panels[names.index("radius")], float(gap) / quantity("radius", units).scale, "wall"
        )
    panels[-1].set_xlabel(time.label)
    figure.align_ylabels(panels)


def still(trace: Trace) -> dict[str, float]:
    """The histories that stay at one value, each with that; none where all do, and the
    trace is to be seen."""
    names = drawn_in(trace.attrs).histories
    found = {name: float(np.mean(trace[name])) for name in names if not moves(trace, name)}
    return found if len(found) < len(names) else {}


def band_stretches(histories: list[Array], width: float) -> int:
    """Of how many stretches the bands are in panels of so many inches; 0 where lines
    are legible."""
    most = max(swings(values) for values in histories)
    if most <= SOLID * width:
        return 0
    # a stretch holds two swings, or its ends would be those of the waves
    return int(min(most / 2, BAND_BINS * width))


def _band(axes: Axes, time: Array, values: Array, stretches: int, name: str) -> None:
    middle, least, greatest, mean = bands(time, values, stretches)
    middle[[0, -1]] = time[[0, -1]]
    axes.fill_between(
        middle,
        least,
        greatest,
        facecolor=SKY,
        edgecolor=SKY,
        linewidth=0.5,
        alpha=0.75,
        gid=f"history:{name}:band",
    )
    axes.plot(middle, mean, color=BLUE, linewidth=0.8, gid=f"history:{name}")


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
        fontsize=type_size(6),
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
