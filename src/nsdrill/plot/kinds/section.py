"""The Poincare section of one operating point or of a trace, in planes of the motion.

One dot is period one, n dots a period of n returns, a closed curve quasi-periodic
motion, a cloud chaos.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import pi
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from nsdrill.data import Array, Results, Trace
from nsdrill.errors import InputError
from nsdrill.models.description import Drawn
from nsdrill.models.registry import drawn_in
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.registry import TRACE, Kind, is_sweep, needs_returns
from nsdrill.plot.slices import text
from nsdrill.plot.style import (
    BLUE,
    MOTIONS,
    REFERENCE,
    new_figure,
    page_width,
    put_title,
    side_by_side,
)
from nsdrill.plot.traces import title_of

WIDTH = 1.6  # inches that a plane needs


def draw(data: Results | Trace, units: str = "si") -> Figure:
    return draw_trace(data, units) if isinstance(data, Trace) else draw_point(data, units)


def draw_point(results: Results, units: str = "si") -> Figure:
    """The section of one operating point, a row of planes for each procedure."""
    names = [text(name) for name in results.coords["procedure"]]
    down = _rows(results.attrs)
    figure = new_figure(page_width(), 0.4 + 2.2 * down * len(names))
    rows = np.atleast_1d(np.asarray(figure.subfigures(len(names), 1), dtype=object))
    gap, drawn = results.attrs.get("gap"), drawn_in(results.attrs)
    for row, name in enumerate(names):
        here = {
            key: results[key][row].ravel()
            for key in results.variables
            if key.startswith("section_")
        }
        code = int(results["motion"][row].ravel()[0])
        words = MOTIONS[code].name
        if period := int(results["period"][row].ravel()[0]):
            words = f"{words}, period {period}"
        count = int(np.isfinite(here[drawn.section[0]]).sum())
        label = {"up": "carried up: ", "down": "carried down: "}.get(name, "")
        rows[row].suptitle(f"{label}{words}, {count} returns", fontsize="medium")
        _draw_planes(rows[row], here, drawn, units, gap, MOTIONS[code].colour)
    put_title(figure, heading(results.attrs, operating_point(fixed_values(results), units)))
    return figure


def draw_trace(trace: Trace, units: str) -> Figure:
    """The section of a trace: its returns after the transient, if there is time for
    three."""
    section, drawn = section_of(trace), drawn_in(trace.attrs)
    figure = new_figure(page_width(), 0.6 + 2.1 * _rows(trace.attrs))
    begin = _observed_from(trace)
    words = f"{len(section['section_bit_speed'])} returns" + (
        f" after {begin:g} s" if begin else ""
    )
    _draw_planes(figure, section, drawn, units, trace.attrs.get("gap"), BLUE)
    put_title(figure, f"{title_of(trace, units)}; {words}")
    return figure


def _draw_planes(
    figure: Any,
    section: Mapping[str, Array],
    drawn: Drawn,
    units: str,
    gap: float | None,
    colour: str,
) -> None:
    """The returns in a row of planes, the first of them the orbit where there is one."""
    style: dict[str, Any] = {
        "linestyle": "none",
        "marker": "o",
        "markersize": 2.0,
        "markeredgewidth": 0.0,
        "color": colour,
    }
    orbit = "section_radius" in section and "section_radius" in drawn.section
    count = orbit + len(drawn.section_planes)
    wide = side_by_side(count, WIDTH)
    grid = figure.add_gridspec(-(-count // wide), wide)
    panels = [figure.add_subplot(grid[divmod(place, wide)]) for place in range(count)]
    if orbit:
        _draw_orbit(panels[0], section, units, gap, style)
    for axes, (across, up) in zip(panels[orbit:], drawn.section_planes, strict=True):
        a, b = quantity(across, units), quantity(up, units)
        axes.plot(
            section[across] / a.scale, section[up] / b.scale, gid=f"section:{across}", **style
        )
        axes.set(xlabel=a.label, ylabel=b.label)
        _open(axes)
    for axes in panels:
        axes.xaxis.set_major_locator(MaxNLocator(3))
        axes.yaxis.set_major_locator(MaxNLocator(5))


def _rows(attrs: Mapping[str, Any]) -> int:
    """Rows of planes of one section."""
    drawn = drawn_in(attrs)
    count = len(drawn.section_planes) + ("section_radius" in drawn.section)
    return -(-count // side_by_side(count, WIDTH))


def _draw_orbit(
    axes: Axes,
    section: Mapping[str, Array],
    units: str,
    gap: float | None,
    style: Mapping[str, Any],
) -> None:
    """The collar centre in the hole, as an observer on the bit sees it."""
    x = quantity("x", units)
    r, angle = section["section_radius"] / x.scale, section["section_whirl_angle"]
    axes.plot(r * np.cos(angle), r * np.sin(angle), gid="section:orbit", **style)
    axes.plot(
        [0], [0], marker="+", color=REFERENCE, markersize=6, markeredgewidth=0.6, linestyle="none"
    )
    reach = float(np.nanmax(r, initial=0.0)) or 1.0
    if gap is not None and reach > 0.4 * gap / x.scale:
        axes.add_patch(
            Circle((0, 0), gap / x.scale, fill=False, color=REFERENCE, linewidth=0.9, zorder=1.5)
        )
        reach = max(reach, gap / x.scale)
    axes.set(
        xlim=(-1.1 * reach, 1.1 * reach),
        ylim=(-1.1 * reach, 1.1 * reach),
        xlabel=f"along the bit [{x.unit}]",
        ylabel=f"across [{x.unit}]",
    )
    axes.set_aspect("equal")


def _open(axes: Axes) -> None:
    """Limits that do not blow up rounding: a section of one point looks like one point."""
    for get, put in ((axes.get_xlim, axes.set_xlim), (axes.get_ylim, axes.set_ylim)):
        low, high = get()
        middle, least = 0.5 * (low + high), 0.02 * max(abs(low), abs(high))
        if high - low < least:
            put(middle - least, middle + least)


def _observed_from(trace: Trace) -> float:
    """Where the section of a trace begins: after its transient, or at its start if
    hardly anything follows."""
    transient, speed = (
        float(trace.attrs.get("transient", 0.0)),
        float(trace.attrs.get("rotary_speed", 0.0)),
    )
    turns = (trace.time[-1] - transient) * speed / (2 * pi)
    return transient if turns >= 3 else 0.0


def section_of(trace: Trace) -> dict[str, Array]:
    """The section of a trace at whole revolutions of the bit, by the cubic through
    samples and their rates."""
    chosen = trace.time >= _observed_from(trace)
    time = trace.time[chosen]
    angle = (trace["twist"] + trace["drive_angle"])[chosen]
    if not np.all(np.isfinite(angle)):
        raise InputError(
            "trace: found samples of the bit angle that are no numbers; the section "
            "needs all of them."
        )
    reached = np.maximum.accumulate(angle)  # a bit that turns back is not counted twice
    levels = (
        np.arange(np.floor(angle[0] / (2 * pi)) + 1, np.floor(reached[-1] / (2 * pi)) + 1) * 2 * pi
    )
    if not len(levels):
        raise InputError(
            "trace: found less than one revolution of the bit; the section needs "
            "one. Simulate longer."
        )
    after = np.searchsorted(reached, levels, side="left")
    after = np.clip(after, 1, len(time) - 1)
    h = time[after] - time[after - 1]

    def cubic(values: Array, rates: Array, theta: Array) -> Array:
        v0, v1, d0, d1 = values[after - 1], values[after], h * rates[after - 1], h * rates[after]
        rise = v1 - v0
        return v0 + theta * (d0 + theta * (3 * rise - 2 * d0 - d1 + theta * (d0 + d1 - 2 * rise)))

    speed = trace["bit_speed"][chosen]
    theta = (levels - angle[after - 1]) / np.maximum(angle[after] - angle[after - 1], 1e-300)
    for _ in range(3):  # the angle is nearly straight between samples
        theta = np.clip(
            theta - (cubic(angle, speed, theta) - levels) / np.maximum(h * speed[after], 1e-300),
            0.0,
            1.0,
        )

    def of(name: str, rate: str | None = None) -> Array:
        values = trace[name][chosen]
        if rate is None:
            return values[after - 1] + theta * (values[after] - values[after - 1])
        return cubic(values, trace[rate][chosen], theta)

    found = {"section_twist": of("twist"), "section_bit_speed": of("bit_speed")}
    if "z" in trace.variables:
        found |= {"section_axial": of("z", "vz"), "section_axial_velocity": of("vz")}
    if "x" in trace.variables:
        x, y, vx, vy = of("x", "vx"), of("y", "vy"), of("vx"), of("vy")
        r = np.sqrt(x * x + y * y)
        found |= {
            "section_radius": r,
            "section_whirl_angle": np.arctan2(y, x),
            "section_radial_velocity": (x * vx + y * vy) / np.where(r > 0, r, 1.0),
        }
    return found


def _place(data: Any) -> float | None:
    if isinstance(data, Trace):
        return 84
    return 20 if is_sweep(data) and not data.swept and "motion" in data.variables else None


def _advice(data: Any) -> str:
    if isinstance(data, Results) and "motion" in data.variables:
        return "it shows one operating point: select a value of every axis"
    return needs_returns(data)


KINDS = (
    Kind(
        "section",
        "the Poincare section of one operating point, or of a trace: the motion once in every "
        "revolution of the bit",
        of=TRACE,
        place=_place,
        draw=draw,
        uses=lambda model: ("motion", "period", *(variable.name for variable in model.section)),
        advice=_advice,
    ),
)
