"""The returns to the Poincare section along one axis, coloured by the kind of motion.

One dot is period one, n dots a period of n returns, a closed curve quasi-periodic
motion, a cloud chaos.
"""

from __future__ import annotations

from math import pi
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nsdrill.data import Results
from nsdrill.models.registry import drawn_in
from nsdrill.plot.columns import is_open, new_columns, outcome_handles
from nsdrill.plot.decimation import one_per_pixel
from nsdrill.plot.kinds.section import draw_point
from nsdrill.plot.labels import Shown, quantity
from nsdrill.plot.legend import direction_entries, legend_below, motion_entries
from nsdrill.plot.references import draw_set_speed, draw_wall, marker_size
from nsdrill.plot.registry import RETURNS, Kind, fits_columns, longest, needs_returns
from nsdrill.plot.slices import Line
from nsdrill.plot.style import MANY_MARKERS, MOTIONS
from nsdrill.variables import OK

PIXELS = (1050, 300)  # of a panel: half those in print, as a marker covers several


def draw(results: Results, units: str = "si") -> Figure:
    """Every recorded return along one axis; of a single point its section in planes."""
    if not results.swept:
        return draw_point(results, units)
    shown = drawn_in(results.attrs).section
    figure, lines, columns = new_columns(results, units, shown, 1.5 * len(shown) + 1.5)
    markers = len(shown) * int(np.isfinite(results[shown[0]]).sum())
    present: set[int] = set()
    for line, column in zip(lines, columns, strict=True):
        x = quantity(line.axis, units)
        for axes, name in zip(column[1:], shown, strict=True):
            present |= draw_returns(
                axes, line, name, x, quantity(name, units), markers > MANY_MARKERS
            )
    rows = {name: [column[1 + row] for column in columns] for row, name in enumerate(shown)}
    for axes in rows.get("section_whirl_angle", ()):
        _set_angle_axis(axes, quantity("section_whirl_angle", units))
    handles = [*motion_entries(present), *direction_entries(lines[0].procedures)]
    wall = draw_wall(results, rows["section_radius"], units) if "section_radius" in rows else []
    speed = (
        draw_set_speed(lines, rows["section_bit_speed"], units)
        if "section_bit_speed" in rows
        else []
    )
    legend_below(figure, [*handles, *speed, *wall, *outcome_handles(lines, markers=False)], 4)
    return figure


def draw_returns(
    axes: Axes, line: Line, name: str, x: Shown, y: Shown, rasterise: bool
) -> set[int]:
    """Draw one panel, an artist for each kind of motion and procedure; returns the kinds
    that occur."""
    motion, values, x_values = line["motion"], line[name] / y.scale, line.x / x.scale
    size = 0.75 * marker_size(len(x_values), axes)
    present = set()
    for code, style in enumerate(MOTIONS):
        for row, procedure in enumerate(line.procedures):
            selected = (motion[row] == code) & (line["status"][row] == OK)
            return_y = values[row, selected]
            finite = np.isfinite(return_y)
            if not finite.any():
                continue
            present.add(code)
            hollow = is_open(procedure, line.procedures)
            return_x = np.broadcast_to(x_values[selected][:, None], return_y.shape)[finite]
            kept = one_per_pixel(return_x, return_y[finite], PIXELS)
            axes.plot(
                return_x[kept],
                return_y[finite][kept],
                linestyle="none",
                marker="o",
                color=style.colour,
                markersize=size,
                markerfacecolor="none" if hollow else style.colour,
                markeredgewidth=0.3 if hollow else 0.0,
                rasterized=rasterise,
                zorder=2 + 0.01 * code,
                gid=f"{name}:{procedure}:{code}",
            )
    return present


def _set_angle_axis(axes: Axes, y: Shown) -> None:
    """Limit an axis of angles to minus and plus half a revolution, with ticks at the
    quarters."""
    axes.set_ylim(-1.04 * pi / y.scale, 1.04 * pi / y.scale)
    ticks = np.array([-pi, -pi / 2, 0.0, pi / 2, pi]) / y.scale
    axes.set_yticks(
        ticks,
        ["−π", "−π/2", "0", "π/2", "π"] if y.unit == "rad" else [f"{tick:g}" for tick in ticks],
    )


def _place(data: Any) -> float | None:
    if not fits_columns(data) or "motion" not in data.variables:
        return None
    return 32 if data.swept else 20


KINDS = (
    Kind(
        "poincare",
        "every return to the Poincare section along one axis, coloured by the kind of motion; "
        "planes of one point",
        of=RETURNS,
        place=_place,
        draw=draw,
        uses=lambda model: ("motion", "period", *(variable.name for variable in model.section)),
        across=lambda data: longest(data) if data.swept else None,
        advice=needs_returns,
    ),
)
