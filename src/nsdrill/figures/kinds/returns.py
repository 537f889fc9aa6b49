"""The returns to the Poincare section: along one axis, coloured by the kind of motion,
and of one operating point or a trace in planes.

One dot is period one, n dots a period of n returns, a closed curve quasi-periodic
motion, a cloud chaos."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import pi

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import MaxNLocator

from nsdrill.data import Array, Attributes, Results, Trace
from nsdrill.errors import InputError
from nsdrill.figures.kinds.hole import cross_section, draw_circle
from nsdrill.figures.page import lay_up, panels_per_row, tiles
from nsdrill.figures.painters import Page, Paint, numbered
from nsdrill.figures.panels import WALL_VISIBLE_FROM
from nsdrill.figures.picture_kinds import TRACE, Kind, is_sweep, needs_returns
from nsdrill.figures.style import BLUE, MOTIONS, Properties, page_width
from nsdrill.figures.traces import title_of
from nsdrill.models.registry import drawn_in
from nsdrill.words.labels import carried, quantity, sweep_title

PLANE_WIDTH = 1.6  # least width of a plane in inches
DOTS: Properties = {"linestyle": "none", "marker": "o", "markersize": 2.0, "markeredgewidth": 0.0}


def section(data: Results | Trace, units: str = "si") -> Page:
    return section_of_trace(data, units) if isinstance(data, Trace) else section_of_point(data, units)


def section_of_point(results: Results, units: str = "si") -> Page:
    """The section of one operating point, a row of planes for each procedure."""
    painters, headings = [], []
    for row, name in enumerate(results.procedures):
        returns = {key: results[key][row].ravel() for key in results.variables if key.startswith("section_")}
        motion = MOTIONS[int(results["motion"][row].ravel()[0])]
        period = int(results["period"][row].ravel()[0])
        description = f"{motion.name}, period {period}" if period else motion.name
        count = int(np.isfinite(returns[drawn_in(results.attrs).section[0]]).sum())
        label = "" if name == "same" else f"{carried(name, results.attrs)}: "
        headings.append(f"{label}{description}, {count} returns")
        painters.append(_planes(returns, results.attrs, units, motion.colour))

    def arrange(figure: Figure) -> list[Axes]:
        panels = []
        rows = np.atleast_1d(np.asarray(figure.subfigures(len(headings), 1), dtype=object))
        for row, heading, of_row in zip(rows, headings, painters, strict=True):
            row.suptitle(heading, fontsize="medium")
            panels += _arranged(row, len(of_row))
        return panels

    names = numbered(name for of_row in painters for name in of_row)
    flat = [paint for of_row in painters for paint in of_row.values()]
    height = 0.4 + 2.2 * _rows(len(painters[0])) * len(painters)
    return Page(dict(zip(names, flat, strict=True)), sweep_title(results, units), page_width(), height, arrange)


def section_of_trace(trace: Trace, units: str) -> Page:
    """The section of a trace: its returns after the transient, if this leaves three
    revolutions."""
    returns, start = section_of(trace), _observed_from(trace)
    description = f"{len(returns['section_bit_speed'])} returns" + (f" after {start:g} s" if start else "")
    painters = _planes(returns, trace.attrs, units, BLUE)
    return Page(
        painters,
        f"{title_of(trace, units)}; {description}",
        page_width(),
        0.6 + 2.1 * _rows(len(painters)),
        lambda figure: _arranged(figure, len(painters)),
    )


def _rows(count: int) -> int:
    """The number of rows in which so many planes of one section stand."""
    return -(-count // panels_per_row(count, PLANE_WIDTH))


def _arranged(figure: Figure | SubFigure, count: int) -> list[Axes]:
    """The panels of so many planes of one section."""
    return tiles(figure, count, panels_per_row(count, PLANE_WIDTH))


def _planes(returns: Mapping[str, Array], attrs: Attributes, units: str, colour: str) -> dict[str, Paint]:
    """Painters of the returns in planes, the first of which is the orbit where there is
    one."""
    drawn = drawn_in(attrs)

    def paint(across: str, up: str, axes: Axes) -> None:
        x, y = quantity(across, units), quantity(up, units)
        axes.plot(returns[across] / x.scale, returns[up] / y.scale, gid=f"section:{across}", color=colour, **DOTS)
        axes.set(xlabel=x.label, ylabel=y.label)
        lay_up(axes, up)
        # limits that would magnify rounding are widened, so that one point appears as one
        for ends, set_ends in ((axes.get_xlim(), axes.set_xlim), (axes.get_ylim(), axes.set_ylim)):
            middle, half_width = 0.5 * sum(ends), 0.02 * max(map(abs, ends))
            if ends[1] - ends[0] < half_width:
                set_ends(middle - half_width, middle + half_width)
        _space_ticks(axes)

    def paint_orbit(axes: Axes) -> None:
        _draw_orbit(axes, returns, units, attrs.get("gap"), colour)
        _space_ticks(axes)

    has_orbit = "section_radius" in returns and "section_radius" in drawn.section
    painters: dict[str, Paint] = {"section_orbit": paint_orbit} if has_orbit else {}
    return painters | {across: partial(paint, across, up) for across, up in drawn.section_planes}


def _space_ticks(axes: Axes) -> None:
    axes.xaxis.set_major_locator(MaxNLocator(3))
    axes.yaxis.set_major_locator(MaxNLocator(5))


def _draw_orbit(axes: Axes, section: Mapping[str, Array], units: str, gap: float | None, colour: str) -> None:
    """Draw the collar centre in the hole, in axes that rotate with the bit."""
    x = quantity("x", units)
    radius, angle = section["section_radius"] / x.scale, section["section_whirl_angle"]
    axes.plot(radius * np.cos(angle), radius * np.sin(angle), gid="section:orbit", color=colour, **DOTS)
    extent = float(np.nanmax(radius, initial=0.0)) or 1.0
    if gap is not None and extent > WALL_VISIBLE_FROM * gap / x.scale:
        draw_circle(axes, gap / x.scale, zorder=1.5)
        extent = max(extent, gap / x.scale)
    cross_section(axes, 1.1 * extent, f"along the bit [{x.unit}]", f"across [{x.unit}]")
    lay_up(axes, "")


def _observed_from(trace: Trace) -> float:
    """The time [s] at which the section of a trace begins: after its transient, or at
    its start if fewer than three revolutions follow."""
    transient, speed = (float(trace.attrs.get(name, 0.0)) for name in ("transient", "rotary_speed"))
    revolutions = (trace.time[-1] - transient) * speed / (2 * pi)
    return transient if revolutions >= 3 else 0.0


def section_of(trace: Trace) -> dict[str, Array]:
    """The section of a trace at whole revolutions of the bit, interpolated by the cubic
    through samples and their rates (Hermite); the variables by name [return]."""
    chosen = trace.time >= _observed_from(trace)
    time = trace.time[chosen]
    drawn = drawn_in(trace.attrs)
    if not drawn.angle:
        return {}
    angle = np.sum([trace[name] for name in drawn.angle], axis=0)[chosen]
    if not np.all(np.isfinite(angle)):
        raise InputError("trace: found samples of the bit angle that are no numbers; the section needs all of them.")
    furthest = np.maximum.accumulate(angle)  # a bit that rotates back is not counted twice
    levels = np.arange(np.floor(angle[0] / (2 * pi)) + 1, np.floor(furthest[-1] / (2 * pi)) + 1) * 2 * pi
    if not len(levels):
        raise InputError("trace: found less than one revolution of the bit; the section needs one. Simulate longer.")
    after = np.searchsorted(furthest, levels, side="left")
    after = np.clip(after, 1, len(time) - 1)
    step = time[after] - time[after - 1]

    def cubic(values: Array, rates: Array, theta: Array) -> Array:
        v0, v1, d0, d1 = (values[after - 1], values[after], step * rates[after - 1], step * rates[after])
        rise = v1 - v0
        return v0 + theta * (d0 + theta * (3 * rise - 2 * d0 - d1 + theta * (d0 + d1 - 2 * rise)))

    speed = trace[drawn.speed][chosen]
    theta = (levels - angle[after - 1]) / np.maximum(angle[after] - angle[after - 1], 1e-300)
    for _ in range(3):  # the angle is nearly straight between samples
        theta = np.clip(
            theta - (cubic(angle, speed, theta) - levels) / np.maximum(step * speed[after], 1e-300), 0.0, 1.0
        )

    def at_section(name: str, rate: str | None = None) -> Array:
        values = trace[name][chosen]
        if rate is None:
            return values[after - 1] + theta * (values[after] - values[after - 1])
        return cubic(values, trace[rate][chosen], theta)

    section = {f"section_{name}": at_section(name) for name in (drawn.angle[0], drawn.speed)}
    if "z" in trace.variables:
        section |= {"section_axial": at_section("z", "vz"), "section_axial_velocity": at_section("vz")}
    if "x" in trace.variables:
        x, y, vx, vy = (at_section("x", "vx"), at_section("y", "vy"), at_section("vx"), at_section("vy"))
        radius = np.sqrt(x * x + y * y)
        section |= {
            "section_radius": radius,
            "section_whirl_angle": np.arctan2(y, x),
            "section_radial_velocity": (x * vx + y * vy) / np.where(radius > 0, radius, 1.0),
        }
    return section


def _section_place(data: object) -> float | None:
    if isinstance(data, Trace):
        return 84 if drawn_in(data.attrs).angle else None
    return 20 if is_sweep(data) and not data.swept and "motion" in data.variables else None


def _section_advice(data: object) -> str:
    if isinstance(data, Results) and "motion" in data.variables:
        return "it shows one operating point: select a value of every axis"
    return needs_returns(data)


KINDS = (
    Kind(
        "section",
        "the Poincare section of one operating point, or of a trace: the motion once in every revolution of the bit",
        of=TRACE,
        place=_section_place,
        page=section,
        uses=lambda model: ("motion", "period", *(variable.name for variable in model.section)),
        advice=_section_advice,
        part_of="trace",
        general="the Poincare section of one operating point, or of a trace: the motion once in every period",
    ),
)
