"""A trajectory: its histories, its phase planes, the path of the collar centre; and all
on one page.

Where the lines of a long run would merge into a solid block, its last seconds are
shown; where the user asks for more of it, a history whose lines would merge is a band
from its least to its greatest sample, with its mean in it."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.markers import MarkerStyle
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Affine2D

from nsdrill.data import Array, Trace, frozen_modes, resolved_study
from nsdrill.figures.kinds.hole import ORBIT_REVOLUTIONS, cross_section, draw_circle, has_orbit, square_page
from nsdrill.figures.look import BESIDE, between
from nsdrill.figures.page import (
    area_entry,
    below,
    finish,
    line_entry,
    marker_entry,
    name_panel,
    new_figure,
    panels_per_row,
    put_title,
    set_panel_title,
    stack,
    tiles,
    write,
)
from nsdrill.figures.panels import BINS, WALL_VISIBLE_FROM
from nsdrill.figures.registry import TRACE, Kind
from nsdrill.figures.style import (
    BLACK,
    BLUE,
    DASHED,
    MANY_MARKERS,
    REFERENCE,
    SKY,
    VERMILLION,
    Properties,
    halo,
    page_width,
)
from nsdrill.figures.traces import (
    CONSTANT_TOLERANCE,
    LAST_SAMPLES,
    bands_of,
    binned_statistics,
    check_length,
    envelope,
    is_chosen,
    moving_values,
    planes_of,
    setpoint,
    shown_part,
    title_of,
    varies,
)
from nsdrill.models.operation import in_trace_as
from nsdrill.models.registry import drawn_in
from nsdrill.words.labels import quantity

HISTORY_HEIGHT, LOW_HISTORY_HEIGHT = 1.2, 0.7  # inches, the latter on a narrow page with everything
LETTERS = 17  # per inch of height, of the words beside a panel
SCHEDULE_HEIGHT = 0.7  # inches, for each value that moves
LAST_SECONDS = (20.0, 10.0, 5.0)  # of a run whose histories would be bands: the first that gives none
STANDS_OUT = 1.25  # times the greatest later value: a start that is cut
PANEL_MARGINS = 1.1  # inches of axis and margin beside a panel


def draw_histories_page(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    figure = new_figure(page_width(), histories_height(trace))
    handles = draw_histories(figure, trace, units)
    return finish(figure, title_of(trace, units), handles, 4)


def histories_height(trace: Trace, of_one: float = HISTORY_HEIGHT) -> float:
    """The height [inches] of the histories, of which each takes this much."""
    count = len(drawn_in(trace.attrs).histories) - len(constant_histories(trace))
    return of_one * count + SCHEDULE_HEIGHT * len(moving_values(trace))


def draw_histories(
    figure: Figure | SubFigure, trace: Trace, units: str, of_one: float = HISTORY_HEIGHT
) -> list[Artist]:
    """Draw the motions and the contact forces against time, and the operating values
    that move, one below the other, in panels that are ``of_one`` inches high; returns
    the entries of the legend."""
    run, width = float(trace.time[-1]), figure.bbox.width / figure.dpi - PANEL_MARGINS
    trace, notes = last_seconds(trace, width), []
    duration = float(trace.time[-1] - trace.time[0])
    part = f"last {duration:.3g} s of {run:.4g} s" if duration < 0.999 * run else ""
    constants, scheduled = constant_histories(trace), [in_trace_as(name) for name in moving_values(trace)]
    if constants:
        shown = {quantity(name, units): value for name, value in constants.items()}
        texts = (f"{one.words.lower()} {one.value(value)}" for one, value in shown.items())
        notes.append(f"constant: {', '.join(texts)}")
    names = [name for name in (*drawn_in(trace.attrs).histories, *scheduled) if name not in constants]
    panels = dict(zip(names, stack(figure, len(names)), strict=True))
    time = quantity("time", units)
    solid, bins = bands_of(trace, names, width)
    for name, axes in panels.items():
        shown_value = quantity(name, units)
        values = trace[name] / shown_value.scale
        if name in solid:
            _draw_band(axes, trace.time / time.scale, values, bins, name)
        else:
            kept_time, kept_values = envelope(trace.time, values, BINS)
            axes.plot(kept_time / time.scale, kept_values, color=BLUE, linewidth=0.5, gid=f"history:{name}")
        name_panel(axes, name, name, shown_value.in_lines(int(LETTERS * of_one)))
        axes.margins(x=0)
        if name.endswith("_force") and (after_start := greatest_after_start(values)) is not None:
            axes.set_ylim(top=after_start * 1.06)
            notes.append(f"{shown_value.words.lower()} begins at {shown_value.value(trace[name][0])}, cut")
    notes += _draw_references(panels, trace, units, moves=in_trace_as("rotary_speed") in scheduled)
    column = list(panels.values())
    set_panel_title(column[0], part, "left", notes)
    column[-1].set_xlabel(time.label)
    figure.align_ylabels(column)
    if not solid:
        return []
    words = f"least to greatest in each {3 * duration / bins:.2g} s"  # a bin and its neighbours
    return [area_entry(words, gid="band", **BAND), line_entry("running mean", gid="mean", **MEAN)]


def _draw_references(panels: dict[str, Axes], trace: Trace, units: str, *, moves: bool) -> list[str]:
    """Draw the rotary speed, which ``moves`` or not, and the wall of the hole; returns a
    note on a wall out of sight."""
    speed, gap = trace.attrs.get("rotary_speed"), trace.attrs.get("gap")
    drawn = drawn_in(trace.attrs)
    turning, across = panels.get(drawn.speed), panels.get(drawn.radius)
    scale = quantity(drawn.speed, units).scale if turning is not None else 1.0
    if turning is not None and moves:
        kept_time, values = envelope(trace.time, setpoint(trace, "rotary_speed") / scale, BINS)
        kept_time = kept_time / quantity("time", units).scale
        turning.plot(kept_time, values, zorder=3, gid="rotary speed", **DASHED)
    elif turning is not None and speed is not None:
        _draw_reference(turning, float(speed) / scale, "rotary speed")
    if across is not None and gap is not None:
        radius = quantity(drawn.radius, units)
        if np.nanmax(trace[drawn.radius]) <= WALL_VISIBLE_FROM * float(gap):
            return [f"wall at {radius.value(float(gap))}"]
        _draw_reference(across, float(gap) / radius.scale, "wall")
    return []


def greatest_after_start(values: Array) -> float | None:
    """The greatest of the ``values`` after the fall from the first one, where that stands
    out far above all later ones: the force by which the collar was pressed on the wall.
    None where it does not."""
    rising = np.flatnonzero(np.diff(values) > 0.0)
    if not rising.size:
        return None
    later = float(values[rising[0] :].max())
    return later if 0.0 < STANDS_OUT * later < values[0] else None


def constant_histories(trace: Trace) -> dict[str, float]:
    """The histories that stay at one value, each with that value; none where all do, as
    then all are drawn."""
    names = drawn_in(trace.attrs).histories
    constants = {name: float(np.mean(trace[name])) for name in names if not varies(trace, name)}
    return constants if len(constants) < len(names) else {}


def last_seconds(trace: Trace, width: float) -> Trace:
    """The last of the :data:`LAST_SECONDS` of a run whose histories would be bands in
    panels ``width`` inches wide; all of it where the user chooses the part, where an
    operating value moves, or where the drive is switched on during the run."""
    drive = resolved_study(trace.attrs).get("drive") or {}
    names = drawn_in(trace.attrs).histories
    if is_chosen() or moving_values(trace) or (drive.get("on_at") or 0.0) > 0.0 or not bands_of(trace, names, width)[0]:
        return trace
    run = float(trace.time[-1] - trace.time[0])
    parts = [between(trace, (float(trace.time[-1]) - last, None)) for last in LAST_SECONDS if last < run]
    return next((part for part in parts if not bands_of(part, names, width)[0]), (parts or [trace])[0])


BAND: Properties = {"facecolor": SKY, "edgecolor": SKY, "linewidth": 0.5, "alpha": 0.75}
MEAN: Properties = {"color": BLUE, "linewidth": 0.8}


def _draw_band(axes: Axes, time: Array, values: Array, bins: int, name: str) -> None:
    middle, least, greatest, mean = binned_statistics(time, values, bins)
    middle[[0, -1]] = time[[0, -1]]
    axes.fill_between(middle, least, greatest, gid=f"band:{name}", **BAND)
    axes.plot(middle, mean, gid=f"mean:{name}", **MEAN)


def _draw_reference(axes: Axes, height: float, label: str) -> None:
    """Draw a reference line with its name above its end, so that it needs no legend."""
    axes.axhline(height, zorder=3, gid=label, **DASHED)
    style: Properties = {"ha": "right", "color": REFERENCE, "path_effects": halo(1.5), "zorder": 3.5}
    write(axes, label, (1.0, height), (-2, 1), xycoords=BESIDE, **style)


PLANE_WIDTH = 2.2  # least width of a plane in inches
PLANE_TICKS, SMALL_PLANE_TICKS = 4, 2  # intervals at most, so that numbers like -5.725 do not overlap


def draw_phase_page(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    planes = len(planes_of(trace))
    across = panels_per_row(planes, PLANE_WIDTH)
    figure = new_figure(page_width(), 0.7 + 2.2 * -(-planes // across))
    draw_planes(tiles(figure, planes, across), trace, units)
    put_title(figure, title_of(trace, units))
    return figure


def draw_planes(panels: list[Axes], trace: Trace, units: str, ticks: int = PLANE_TICKS) -> None:
    """Draw velocity over position for each motion, with so many intervals between
    ``ticks`` at most."""
    part, part_text = shown_part(trace)
    rasterised, gap = len(trace.time[part]) > MANY_MARKERS, trace.attrs.get("gap")
    for axes, (across, up) in zip(panels, planes_of(trace), strict=True):
        x, y = quantity(across, units), quantity(up, units)
        path = trace[across][part] / x.scale, trace[up][part] / y.scale
        axes.plot(*path, color=BLUE, linewidth=0.35, rasterized=rasterised, gid=f"phase:{across}")
        axes.set_xlabel(x.label)
        name_panel(axes, f"phase_{across}", up, y.label)
        if part_text:
            set_panel_title(axes, part_text)
        axes.xaxis.set_major_locator(MaxNLocator(ticks, steps=(1, 2, 2.5, 5, 10)))
        if across == "radius" and gap is not None:
            low, high = axes.get_xlim()
            if low < float(gap) / x.scale < high:
                axes.axvline(float(gap) / x.scale, gid="wall", **DASHED)


STEP = 2  # samples between which the direction is taken
MAX_STEP = 0.1  # of the gap: samples farther apart are joined by a curve
SUBDIVISIONS = 8  # of such a curve between two samples
# an arrowhead pointing up
ARROW = Path([(-0.4, -0.6), (0.0, 1.0), (0.4, -0.6), (0.0, -0.25), (-0.4, -0.6)], closed=True)
ARROW_SAMPLES = 300  # samples before the end over which arrowheads show the direction
ARROWS, ARROW_DISTANCE = 2, 0.12  # most arrowheads, and their least distance as a part of the greatest radius


def draw_orbit_page(trace: Trace, units: str = "si") -> Figure:
    figure, axes = square_page(trace, units, 0.5)
    words = below(figure)
    words.entries, words.columns = draw_orbit(axes, trace, units), 2
    return figure


def draw_orbit(axes: Axes, trace: Trace, units: str) -> list[Artist]:
    """Draw the path of the collar centre in the cross-section of the hole, in a
    different colour where the collar is on the wall; returns the entries of the
    legend."""
    part, part_text = shown_part(trace, ORBIT_REVOLUTIONS)
    across, up = quantity("x", units), quantity("y", units)
    gap = trace.attrs.get("gap")
    x, y, force = smoothed_path(trace, part, None if gap is None else float(gap))
    x, y, on_wall = x / across.scale, y / up.scale, force > 0
    rasterised, handles = len(x) > MANY_MARKERS, [marker_entry("end of the orbit", colour=BLACK, size=3, gid="end")]
    axes.plot(x, y, color=BLUE, linewidth=0.4, rasterized=rasterised, gid="orbit")
    if on_wall.any():
        path = np.where(on_wall, (x, y), np.nan)
        style: Properties = {"color": VERMILLION, "linewidth": 0.7, "gid": "orbit:wall"}
        axes.plot(*path, rasterized=rasterised, **style)
        handles.insert(0, line_entry("collar on the wall", **style))
    extent, wall_text = float(np.nanmax(np.hypot(x, y), initial=0.0)), ""
    if gap is not None:
        wall = float(gap) / across.scale
        draw_circle(axes, wall, zorder=1.5, gid="wall")
        if WALL_VISIBLE_FROM * wall <= extent or extent <= CONSTANT_TOLERANCE * wall:
            extent = max(extent, wall)
        else:
            wall_text = f"wall at {wall:.4g} {across.unit}"
    cross_section(axes, (1.2 if wall_text else 1.06) * (extent or 1.0), across.label, up.label, gid="axis")
    draw_direction(axes, np.asarray(x), np.asarray(y), 0.15 * extent)
    name_panel(axes, "orbit", "y")
    set_panel_title(axes, part_text or "orbit", notes=[wall_text])
    return handles


def smoothed_path(trace: Trace, part: slice, gap: float | None) -> tuple[Array, Array, Array]:
    """The path x, y [m] with the wall force [N]. Samples that are far apart for the
    ``gap`` [m] are joined by the cubic with the velocities at both (Hermite), so that a
    revolution along the wall is not drawn as a polygon."""
    time, x, y, force = (trace[name][part] for name in ("time", "x", "y", "wall_force"))
    if gap is None or len(x) < 2 or not {"vx", "vy"} <= trace.variables.keys() or len(x) * SUBDIVISIONS > LAST_SAMPLES:
        return x, y, force
    if not np.isfinite(x + y).all() or np.max(np.hypot(np.diff(x), np.diff(y))) <= MAX_STEP * gap:
        return x, y, force
    from scipy.interpolate import CubicHermiteSpline

    fractions = np.linspace(0.0, 1.0, SUBDIVISIONS, endpoint=False)
    fine_time = np.append((time[:-1, None] + fractions * np.diff(time)[:, None]).ravel(), time[-1])
    # between two samples on the wall the path is on the wall
    force_between = np.minimum(force[:-1], force[1:])
    fine_force = np.where(fractions == 0.0, force[:-1, None], force_between[:, None]).ravel()
    curves = [CubicHermiteSpline(time, trace[name][part], trace[f"v{name}"][part])(fine_time) for name in ("x", "y")]
    return curves[0], curves[1], np.append(fine_force, force[-1])


def draw_direction(axes: Axes, x: Array, y: Array, min_extent: float) -> None:
    """Draw a dot at the end of a path, and along its last part arrowheads that point
    forward in time, none of them on another one or on the dot. A path that reaches less
    far than ``min_extent`` has no arrowheads, which would cover it."""
    finite = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
    if len(finite) < STEP + 1:
        return
    end = finite[-1]
    style: Properties = {"color": BLACK, "linestyle": "none", "zorder": 4}
    axes.plot([x[end]], [y[end]], marker="o", markersize=3, gid="end", **style)
    reach = np.hypot(x[finite], y[finite]).max()
    if reach < min_extent:
        return
    taken, samples = [end], min(len(finite) - STEP, ARROW_SAMPLES)
    # the thirds of the last part first, and those between where an arrow is there already
    for before in dict.fromkeys(max(STEP, int(part * samples / 12)) for part in (4, 8, 6, 10, 2, 5, 7, 9, 11, 3, 1)):
        place = end - before
        step = np.array([x[place + STEP] - x[place], y[place + STEP] - y[place]])
        is_clear = np.hypot(x[taken] - x[place], y[taken] - y[place]).min() > ARROW_DISTANCE * reach
        if len(taken) <= ARROWS and is_clear and np.hypot(*step) > 0.0:
            taken.append(place)
            arrow = MarkerStyle(ARROW, transform=Affine2D().rotate(np.arctan2(step[1], step[0]) - 0.5 * np.pi))
            place_of_arrow = [x[place]], [y[place]]
            axes.plot(*place_of_arrow, marker=arrow, markersize=9, markeredgewidth=0.0, gid="direction", **style)


PLANE_HEIGHT, MAX_PLANE_HEIGHT = 1.6, 2.4  # inches, with labels
TWO_COLUMNS_FROM = 5.0  # inches of width, from which on the planes stand beside the histories
SMALL_PLANE_WIDTH = 1.5  # inches, of a plane below the histories


def draw_page(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    shows_orbit = has_orbit(trace)
    count = len(planes_of(trace)) + shows_orbit
    ticks = PLANE_TICKS
    if page_width() >= TWO_COLUMNS_FROM:
        heights = [1.55, *[1.0] * (count - 1)] if shows_orbit else [1.0] * count
        height = max(1.6 + histories_height(trace), 0.7 + sum(heights) * PLANE_HEIGHT)
        figure = new_figure(page_width(), height)
        left, right = cast("Any", figure.subfigures(1, 2, width_ratios=(1.6, 1.0)))
        handles = draw_histories(left, trace, units)
        # few planes are not taller than wide: below them the page stays empty
        below = max(0.0, (height - 0.7) / MAX_PLANE_HEIGHT - sum(heights))
        panels = stack(right, count, shared=False, heights=heights, below=below)
    else:
        across = panels_per_row(count, SMALL_PLANE_WIDTH)
        heights = [1.0 + histories_height(trace, LOW_HISTORY_HEIGHT), PLANE_HEIGHT * -(-count // across)]
        figure = new_figure(page_width(), sum(heights))
        left, right = cast("Any", figure.subfigures(2, 1, height_ratios=heights))
        handles = draw_histories(left, trace, units, LOW_HISTORY_HEIGHT)
        panels, ticks = tiles(right, count, across), SMALL_PLANE_TICKS
    if shows_orbit:
        handles += draw_orbit(panels[0], trace, units)
    draw_planes(panels[shows_orbit:], trace, units, ticks)
    right.align_ylabels(panels[shows_orbit:])
    return finish(figure, title_of(trace, units), handles, 4)


KINDS = (
    Kind(
        "orbit",
        "path of the collar centre in the hole",
        of=TRACE,
        place=lambda data: 82 if isinstance(data, Trace) and has_orbit(data) else None,
        draw=draw_orbit_page,
        advice=lambda data: (
            "the lateral motion is frozen: the collar centre stays in the middle"
            if isinstance(data, Trace) and "lateral" in frozen_modes(data.attrs)
            else ""
        ),
        part_of="trace",
    ),
    Kind(
        "histories",
        "the three motions and the contact forces against time",
        of=TRACE,
        place=lambda data: 81 if isinstance(data, Trace) else None,
        draw=draw_histories_page,
        across=lambda data: "time",
        general="the motion against time",
    ),
    Kind(
        "phase",
        "phase planes of the axial, torsional and lateral motion",
        of=TRACE,
        place=lambda data: 83 if isinstance(data, Trace) else None,
        draw=draw_phase_page,
        part_of="trace",
        general="phase planes of the motion",
    ),
    Kind(
        "trace",
        "one page with everything: histories, orbit in the hole, phase planes",
        of=TRACE,
        place=lambda data: 80 if isinstance(data, Trace) else None,
        draw=draw_page,
        across=lambda data: "time",
        general="one page with everything: histories, phase planes",
    ),
)
