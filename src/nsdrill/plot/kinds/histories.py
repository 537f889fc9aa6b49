"""The motions and the contact forces of a trajectory against time.

Where the lines of a long trace would merge into a solid block, each history is a band
from its least to its greatest sample, with its mean in it, and a note says so.
"""

from __future__ import annotations

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from nsdrill.data import Array, Trace, resolved_study
from nsdrill.models.registry import drawn_in
from nsdrill.plot.decimation import binned_statistics, count_upcrossings, envelope
from nsdrill.plot.labels import quantity
from nsdrill.plot.limits import between
from nsdrill.plot.references import WALL_VISIBLE_FROM
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.schedule import moving_values, setpoint
from nsdrill.plot.style import (
    BLUE,
    REFERENCE,
    SKY,
    font_size,
    name_panel,
    new_figure,
    page_width,
    put_title,
    set_panel_title,
    stack,
)
from nsdrill.plot.traces import (
    HISTORY_HEIGHT,
    check_length,
    extra_height,
    is_chosen,
    title_of,
    varies,
)
from nsdrill.variables import SCHEDULED

BINS = 1500  # of a history: about one for each pixel in print
SOLID_DENSITY = 50  # oscillations per inch from which on lines leave no white between them
LAST_SECONDS = 20.0  # of a run whose histories would be bands
BAND_BINS = 100  # bins of a band per inch
PANEL_MARGINS = 1.1  # inches of axis and margin beside a panel


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    figure = new_figure(
        page_width(), 7.2 + extra_height(trace) - HISTORY_HEIGHT * len(constant_histories(trace))
    )
    draw_histories(figure, trace, units)
    put_title(figure, title_of(trace, units))
    return figure


def draw_histories(figure: Figure | SubFigure, trace: Trace, units: str) -> None:
    """Draw the motions and the contact forces against time, and the operating values
    that move, one below the other."""
    run, width = float(trace.time[-1]), figure.bbox.width / figure.dpi - PANEL_MARGINS
    trace, notes = last_seconds(trace, width), []
    if trace.time[-1] - trace.time[0] < 0.999 * run:
        notes.append(f"last {LAST_SECONDS:g} s of {run:.4g} s")
    scheduled, constants = (
        [SCHEDULED[name] for name in moving_values(trace)],
        constant_histories(trace),
    )
    names = [
        name for name in (*drawn_in(trace.attrs).histories, *scheduled) if name not in constants
    ]
    panels = stack(figure, len(names))
    time = quantity("time", units)
    histories = {name: trace[name] / quantity(name, units).scale for name in names}
    if constants:
        texts = (
            f"{quantity(name, units).words.lower()} {quantity(name, units).value(value)}"
            for name, value in constants.items()
        )
        notes.append(f"constant: {', '.join(texts)}")
    bins = band_bins(list(histories.values()), width)
    for axes, (name, values) in zip(panels, histories.items(), strict=True):
        if bins:
            _draw_band(axes, trace.time / time.scale, values, bins, name)
        else:
            kept_time, kept_values = envelope(trace.time, values, BINS)
            axes.plot(
                kept_time / time.scale,
                kept_values,
                color=BLUE,
                linewidth=0.5,
                gid=f"history:{name}",
            )
        axes.set_ylabel(quantity(name, units).label)
        name_panel(axes, name, name)
        axes.margins(x=0)
    if bins:
        bin_width = float(trace.time[-1] - trace.time[0]) / bins
        notes += [f"bands: least to greatest in each {bin_width:.2g} s", "lines: the mean"]
    speed, gap = trace.attrs.get("rotary_speed"), trace.attrs.get("gap")
    if "bit_speed" in names and "drive_speed" in scheduled:
        speeds = setpoint(trace, "rotary_speed") / quantity("bit_speed", units).scale
        kept_time, values = envelope(trace.time, speeds, BINS)
        panels[names.index("bit_speed")].plot(
            kept_time / time.scale,
            values,
            color=REFERENCE,
            linewidth=0.7,
            dashes=(4, 2),
            zorder=3,
            gid="rotary speed",
        )
    elif "bit_speed" in names and speed is not None:
        _draw_reference(
            panels[names.index("bit_speed")],
            float(speed) / quantity("bit_speed", units).scale,
            "rotary speed",
        )
    if "radius" in names and gap is not None:
        radius = quantity("radius", units)
        if np.nanmax(trace["radius"]) > WALL_VISIBLE_FROM * float(gap):
            _draw_reference(panels[names.index("radius")], float(gap) / radius.scale, "wall")
        else:
            notes.append(f"wall at {radius.value(float(gap))}")
    set_panel_title(panels[0], "; ".join(notes), "left")
    panels[-1].set_xlabel(time.label)
    figure.align_ylabels(panels)


def constant_histories(trace: Trace) -> dict[str, float]:
    """The histories that stay at one value, each with that value; none where all do, as
    then all are drawn."""
    names = drawn_in(trace.attrs).histories
    constants = {name: float(np.mean(trace[name])) for name in names if not varies(trace, name)}
    return constants if len(constants) < len(names) else {}


def last_seconds(trace: Trace, width: float) -> Trace:
    """The last :data:`LAST_SECONDS` of a run whose histories would be bands in panels
    ``width`` inches wide; all of it where the user chooses the part, where an operating
    value moves, or where the drive is switched on during the run."""
    drive = resolved_study(trace.attrs).get("drive") or {}
    names = drawn_in(trace.attrs).histories
    if (
        is_chosen()
        or trace.time[-1] - trace.time[0] <= LAST_SECONDS
        or moving_values(trace)
        or (drive.get("on_at") or 0.0) > 0.0
        or not band_bins([trace[name] for name in names], width)
    ):
        return trace
    return between(trace, (float(trace.time[-1]) - LAST_SECONDS, None))


def band_bins(histories: list[Array], width: float) -> int:
    """The number of bins of bands in panels ``width`` inches wide; 0 where lines are
    legible."""
    crossings = max(count_upcrossings(values) for values in histories)
    if crossings <= SOLID_DENSITY * width:
        return 0
    # a bin holds two oscillations: in a shorter one the extremes depend on the phase
    return int(min(crossings / 2, BAND_BINS * width))


def _draw_band(axes: Axes, time: Array, values: Array, bins: int, name: str) -> None:
    middle, least, greatest, mean = binned_statistics(time, values, bins)
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


def _draw_reference(axes: Axes, height: float, label: str) -> None:
    """Draw a reference line with its name above its end, so that it needs no legend."""
    axes.axhline(height, color=REFERENCE, linewidth=0.7, dashes=(4, 2), zorder=3, gid=label)
    axes.annotate(
        label,
        (1.0, height),
        xycoords=("axes fraction", "data"),
        xytext=(-2, 1),
        textcoords="offset points",
        ha="right",
        fontsize=font_size(6),
        color=REFERENCE,
        path_effects=[patheffects.withStroke(linewidth=1.5, foreground="white")],
        zorder=3.5,
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
