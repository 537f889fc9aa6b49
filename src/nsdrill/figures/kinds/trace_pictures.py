"""A trajectory: its histories, its phase planes, the path of the collar centre; and all
on one page.

Where the lines of a long run would merge into a solid block, its last seconds are
shown; where the user asks for more of it, a history whose lines would merge is a band
from its least to its greatest sample, with its mean in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
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
from nsdrill.figures.look import BESIDE, between, look
from nsdrill.figures.page import (
    area_entry,
    lay_up,
    line_entry,
    marker_entry,
    panels_per_row,
    set_panel_title,
    stack,
    tiles,
    write,
)
from nsdrill.figures.painters import Page, Paint
from nsdrill.figures.panels import BINS, WALL_VISIBLE_FROM
from nsdrill.figures.picture_kinds import TRACE, Kind
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
    sample_marks,
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


def histories(trace: Trace, units: str = "si") -> Page:
    check_length(trace)
    drawn = Histories(trace, units, page_width())
    return Page(
        drawn.painters(),
        title_of(trace, units),
        page_width(),
        histories_height(trace),
        drawn.arrange,
        lambda panels: drawn.entries(),
    )


def histories_height(trace: Trace, of_one: float = HISTORY_HEIGHT) -> float:
    """The height [inches] of the histories, of which each takes this much."""
    count = len(drawn_in(trace.attrs).histories) - len(constant_histories(trace))
    return of_one * count + SCHEDULE_HEIGHT * len(moving_values(trace))


class Histories:
    """The motions and the contact forces against time, and the operating values that move,
    one below the other on a page of this ``width`` [inches], in panels that are ``of_one``
    inches high."""

    def __init__(self, trace: Trace, units: str, width: float, of_one: float = HISTORY_HEIGHT) -> None:
        self.units, self._of_one, run = units, of_one, float(trace.time[-1])
        self.trace = last_seconds(trace, width - PANEL_MARGINS)
        self._duration = float(self.trace.time[-1] - self.trace.time[0])
        self._part = f"last {self._duration:.3g} s of {run:.4g} s" if self._duration < 0.999 * run else ""
        self._constants = constant_histories(self.trace)
        scheduled = [in_trace_as(name) for name in moving_values(self.trace)]
        self._drive_moves = in_trace_as("rotary_speed") in scheduled
        drawn = drawn_in(trace.attrs)
        self.names = [name for name in (*drawn.histories, *scheduled) if name not in self._constants]
        self._solid, self._bins = bands_of(self.trace, self.names, width - PANEL_MARGINS)

    def painters(self) -> dict[str, Paint]:
        """The painters of the panels by their names."""
        return {name: partial(self._draw, name) for name in self.names}

    def arrange(self, figure: Figure | SubFigure) -> list[Axes]:
        """The empty panels."""
        panels = stack(figure, len(self.names))
        figure.align_ylabels(panels)
        return panels

    def entries(self) -> list[Artist]:
        """The entries of the legend."""
        if not self._solid:
            return []
        words = f"least to greatest in each {3 * self._duration / self._bins:.2g} s"  # a bin and its neighbours
        return [area_entry(words, gid="band", **BAND), line_entry("running mean", gid="mean", **MEAN)]

    def _draw(self, name: str, axes: Axes) -> None:
        trace, shown, time = self.trace, quantity(name, self.units), quantity("time", self.units)
        values = trace[name] / shown.scale
        if name in self._solid:
            _draw_band(axes, trace.time / time.scale, values, self._bins, name)
        else:
            kept_time, kept_values = envelope(trace.time, values, BINS)
            axes.plot(
                kept_time / time.scale,
                kept_values,
                color=BLUE,
                linewidth=0.5,
                gid=f"history:{name}",
                **sample_marks(trace),
            )
        lay_up(axes, name, shown.in_lines(int(LETTERS * self._of_one)))
        axes.margins(x=0)
        if (after_start := self._after_start(name)) is not None:
            axes.set_ylim(top=after_start * 1.06)
        self._draw_references(axes, name)
        axes.set_xlabel(time.label)
        if look.get().alone:
            set_panel_title(axes, self._part, "left", self._notes([name]))
        elif name == self.names[0]:
            set_panel_title(axes, self._part, "left", [*self._constants_note(), *self._notes(self.names)])

    def _after_start(self, name: str) -> float | None:
        """Where a force is cut, in shown units; None where it is not."""
        if not name.endswith("_force"):
            return None
        return greatest_after_start(self.trace[name] / quantity(name, self.units).scale)

    def _draw_references(self, axes: Axes, name: str) -> None:
        """Draw the rotary speed, and the wall of the hole where it is in sight."""
        trace, drawn, scale = self.trace, drawn_in(self.trace.attrs), quantity(name, self.units).scale
        speed = trace.attrs.get("rotary_speed")
        if name == drawn.speed and self._drive_moves:
            kept_time, values = envelope(trace.time, setpoint(trace, "rotary_speed") / scale, BINS)
            kept_time = kept_time / quantity("time", self.units).scale
            axes.plot(kept_time, values, zorder=3, gid="rotary speed", **DASHED)
        elif name == drawn.speed and speed is not None:
            _draw_reference(axes, float(speed) / scale, "rotary speed")
        elif name == drawn.radius and (gap := trace.attrs.get("gap")) is not None and not self._is_far(float(gap)):
            _draw_reference(axes, float(gap) / scale, "wall")

    def _is_far(self, gap: float) -> bool:
        """Whether the wall is out of sight."""
        greatest = float(np.nanmax(self.trace[drawn_in(self.trace.attrs).radius]))
        return greatest <= WALL_VISIBLE_FROM * gap

    def _constants_note(self) -> list[str]:
        """A note on the histories that are left out."""
        shown = {quantity(name, self.units): value for name, value in self._constants.items()}
        texts = [f"{one.words.lower()} {one.value(value)}" for one, value in shown.items()]
        return [f"constant: {', '.join(texts)}"] if texts else []

    def _notes(self, names: Sequence[str]) -> list[str]:
        """Notes on what is cut, or out of sight, in these panels."""
        notes = []
        for name in names:
            if self._after_start(name) is not None:
                shown = quantity(name, self.units)
                notes.append(f"{shown.words.lower()} begins at {shown.value(self.trace[name][0])}, cut")
        radius, gap = drawn_in(self.trace.attrs).radius, self.trace.attrs.get("gap")
        if radius in names and gap is not None and self._is_far(float(gap)):
            notes.append(f"wall at {quantity(radius, self.units).value(float(gap))}")
        return notes


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


def phase(trace: Trace, units: str = "si") -> Page:
    check_length(trace)
    painters = planes(trace, units)
    across = panels_per_row(len(painters), PLANE_WIDTH)
    return Page(
        painters,
        title_of(trace, units),
        page_width(),
        0.7 + 2.2 * -(-len(painters) // across),
        lambda figure: tiles(figure, len(painters), across),
    )


def planes(trace: Trace, units: str, ticks: int = PLANE_TICKS) -> dict[str, Paint]:
    """Painters of velocity over position for each motion, with so many intervals between
    ``ticks`` at most, by the names of their panels."""
    part, part_text = shown_part(trace)
    rasterised, gap = len(trace.time[part]) > MANY_MARKERS, trace.attrs.get("gap")
    marks = sample_marks(trace)

    def paint(across: str, up: str, axes: Axes) -> None:
        x, y = quantity(across, units), quantity(up, units)
        path = trace[across][part] / x.scale, trace[up][part] / y.scale
        axes.plot(*path, color=BLUE, linewidth=0.35, rasterized=rasterised, gid=f"phase:{across}", **marks)
        axes.set_xlabel(x.label)
        lay_up(axes, up, y.label)
        if part_text:
            set_panel_title(axes, part_text)
        axes.xaxis.set_major_locator(MaxNLocator(ticks, steps=(1, 2, 2.5, 5, 10)))
        if across == "radius" and gap is not None:
            low, high = axes.get_xlim()
            if low < float(gap) / x.scale < high:
                axes.axvline(float(gap) / x.scale, gid="wall", **DASHED)

    return {f"phase_{across}": partial(paint, across, up) for across, up in planes_of(trace)}


STEP = 2  # samples between which the direction is taken
MAX_STEP = 0.1  # of the gap: samples farther apart are joined by a curve
SUBDIVISIONS = 8  # of such a curve between two samples
# an arrowhead pointing up
ARROW = Path([(-0.4, -0.6), (0.0, 1.0), (0.4, -0.6), (0.0, -0.25), (-0.4, -0.6)], closed=True)
ARROW_SAMPLES = 300  # samples before the end over which arrowheads show the direction
ARROWS, ARROW_DISTANCE = 2, 0.12  # most arrowheads, and their least distance as a part of the greatest radius


def orbit(trace: Trace, units: str = "si") -> Page:
    page = square_page(trace, units, {"orbit": partial(draw_orbit, trace, units)}, 0.5)
    return replace(page, entries=lambda panels: orbit_entries(), columns=2)


ON_WALL: Properties = {"color": VERMILLION, "linewidth": 0.7, "gid": "orbit:wall"}


def orbit_entries() -> list[Artist]:
    """The entries of the legend for what :func:`draw_orbit` draws."""
    end = marker_entry("end of the orbit", colour=BLACK, size=3, gid="end")
    return [line_entry("collar on the wall", **ON_WALL), end]


def draw_orbit(trace: Trace, units: str, axes: Axes) -> None:
    """Draw the path of the collar centre in the cross-section of the hole, in a
    different colour where the collar is on the wall."""
    part, part_text = shown_part(trace, ORBIT_REVOLUTIONS)
    across, up = quantity("x", units), quantity("y", units)
    gap = trace.attrs.get("gap")
    x, y, force = smoothed_path(trace, part, None if gap is None else float(gap))
    x, y, on_wall = x / across.scale, y / up.scale, force > 0
    rasterised = len(x) > MANY_MARKERS
    axes.plot(x, y, color=BLUE, linewidth=0.4, rasterized=rasterised, gid="orbit")
    if marks := sample_marks(trace):
        samples = trace["x"][part] / across.scale, trace["y"][part] / up.scale
        axes.plot(*samples, color=BLUE, linestyle="none", gid="orbit:samples", **marks)
    if on_wall.any():
        path = np.where(on_wall, (x, y), np.nan)
        axes.plot(*path, rasterized=rasterised, **ON_WALL)
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
    lay_up(axes, "y")
    set_panel_title(axes, part_text or "orbit", notes=[wall_text])


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
WIDE_PART = 1.6 / 2.6  # of the width of a page, for the histories beside planes
TWO_COLUMNS_FROM = 5.0  # inches of width, from which on the planes stand beside the histories
SMALL_PLANE_WIDTH = 1.5  # inches, of a plane below the histories


def everything(trace: Trace, units: str = "si") -> Page:
    check_length(trace)
    shows_orbit, is_wide, width = has_orbit(trace), page_width() >= TWO_COLUMNS_FROM, page_width()
    of_planes = planes(trace, units, PLANE_TICKS if is_wide else SMALL_PLANE_TICKS)
    count = len(of_planes) + shows_orbit
    heights = [1.55, *[1.0] * (count - 1)] if shows_orbit else [1.0] * count
    across = panels_per_row(count, SMALL_PLANE_WIDTH)
    if is_wide:
        of_histories = Histories(trace, units, width if look.get().alone else width * WIDE_PART)
        height = max(1.6 + histories_height(trace), 0.7 + sum(heights) * PLANE_HEIGHT)
        parts = [height]
    else:
        of_histories = Histories(trace, units, width, LOW_HISTORY_HEIGHT)
        parts = [1.0 + histories_height(trace, LOW_HISTORY_HEIGHT), PLANE_HEIGHT * -(-count // across)]

    def arrange(figure: Figure) -> list[Axes]:
        if is_wide:
            left, right = cast("Any", figure.subfigures(1, 2, width_ratios=(WIDE_PART, 1.0 - WIDE_PART)))
            panels = of_histories.arrange(left)
            # few planes are not taller than wide: below them the page stays empty
            below = max(0.0, (parts[0] - 0.7) / MAX_PLANE_HEIGHT - sum(heights))
            beside = stack(right, count, shared=False, heights=heights, below=below)
        else:
            left, right = cast("Any", figure.subfigures(2, 1, height_ratios=parts))
            panels, beside = of_histories.arrange(left), tiles(right, count, across)
        right.align_ylabels(beside[shows_orbit:])
        return [*panels, *beside]

    of_orbit: dict[str, Paint] = {"orbit": partial(draw_orbit, trace, units)} if shows_orbit else {}
    return Page(
        {**of_histories.painters(), **of_orbit, **of_planes},
        title_of(trace, units),
        width,
        sum(parts),
        arrange,
        lambda panels: [*of_histories.entries(), *orbit_entries()],
    )


KINDS = (
    Kind(
        "orbit",
        "path of the collar centre in the hole",
        of=TRACE,
        place=lambda data: 82 if isinstance(data, Trace) and has_orbit(data) else None,
        page=orbit,
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
        page=histories,
        across=lambda data: "time",
        general="the motion against time",
    ),
    Kind(
        "phase",
        "phase planes of the axial, torsional and lateral motion",
        of=TRACE,
        place=lambda data: 83 if isinstance(data, Trace) else None,
        page=phase,
        part_of="trace",
        general="phase planes of the motion",
    ),
    Kind(
        "trace",
        "one page with everything: histories, orbit in the hole, phase planes",
        of=TRACE,
        place=lambda data: 80 if isinstance(data, Trace) else None,
        page=everything,
        across=lambda data: "time",
        general="one page with everything: histories, phase planes",
    ),
)
