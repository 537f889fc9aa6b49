"""Phase planes of a trajectory."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from nsdrill.data import Trace
from nsdrill.plot.labels import quantity
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.style import (
    BLUE,
    MANY_MARKERS,
    REFERENCE,
    name_panel,
    new_figure,
    page_width,
    panels_per_row,
    put_title,
    set_panel_title,
)
from nsdrill.plot.traces import check_length, planes_of, shown_part, title_of

WIDTH = 2.2  # least width of a plane in inches
TICKS = 4  # intervals at most, so that numbers like -5.725 do not overlap


def draw(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    planes = len(planes_of(trace))
    across = panels_per_row(planes, WIDTH)
    down = -(-planes // across)
    figure = new_figure(page_width(), 0.7 + 2.2 * down)
    grid = figure.add_gridspec(down, across)
    draw_planes(
        [figure.add_subplot(grid[divmod(place, across)]) for place in range(planes)], trace, units
    )
    put_title(figure, title_of(trace, units))
    return figure


def draw_planes(panels: list[Axes], trace: Trace, units: str) -> None:
    """Draw velocity over position for each motion."""
    part, part_text = shown_part(trace)
    for axes, (across, up) in zip(panels, planes_of(trace), strict=True):
        x, y = quantity(across, units), quantity(up, units)
        axes.plot(
            trace[across][part] / x.scale,
            trace[up][part] / y.scale,
            color=BLUE,
            linewidth=0.35,
            rasterized=len(trace.time[part]) > MANY_MARKERS,
            gid=f"phase:{across}",
        )
        axes.set(xlabel=x.label, ylabel=y.label)
        name_panel(axes, f"phase_{across}", up)
        if part_text:
            set_panel_title(axes, part_text)
        axes.xaxis.set_major_locator(MaxNLocator(TICKS, steps=(1, 2, 2.5, 5, 10)))
        gap = trace.attrs.get("gap")
        if across == "radius" and gap is not None:
            low, high = axes.get_xlim()
            if low < float(gap) / x.scale < high:
                axes.axvline(
                    float(gap) / x.scale, color=REFERENCE, linewidth=0.7, dashes=(4, 2), gid="wall"
                )


KINDS = (
    Kind(
        "phase",
        "phase planes of the axial, torsional and lateral motion",
        of=TRACE,
        place=lambda data: 83 if isinstance(data, Trace) else None,
        draw=draw,
        part_of="trace",
    ),
)
