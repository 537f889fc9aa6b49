"""A trajectory: its histories, its phase planes; both on one page with its path; and of a
ramp in time the bifurcation diagram, local maxima against the operating value that was
moved.

Where the lines of a long run would merge into a solid block, its last seconds are
shown; where the user asks for all of it, each history is a band from its least to its
greatest sample, with its mean in it. Markers of a ramp are filled where it rose, open
where it fell, and small and grey where it was held; the peaks of a quasi-static sweep can
be drawn below for comparison."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import MaxNLocator

from nsdrill.data import Array, Results, Trace, resolved_study
from nsdrill.errors import InputError, option
from nsdrill.models.operation import SCHEDULED
from nsdrill.models.registry import drawn_in
from nsdrill.plot.kinds.hole import draw_orbit, has_orbit
from nsdrill.plot.labels import heading, operating_point, quantity, way_word
from nsdrill.plot.look import BESIDE, between
from nsdrill.plot.page import (
    finish,
    line_entry,
    name_panel,
    new_figure,
    panels_per_row,
    put_title,
    set_panel_title,
    stack,
    tiles,
    write,
)
from nsdrill.plot.panels import BINS, WALL_VISIBLE_FROM, draw_wall
from nsdrill.plot.registry import RAMP, TRACE, Kind
from nsdrill.plot.slices import line, ordered
from nsdrill.plot.style import (
    BLUE,
    DASHED,
    GREY,
    MANY_MARKERS,
    REFERENCE,
    SKY,
    VERMILLION,
    Properties,
    halo,
    page_width,
)
from nsdrill.plot.traces import (
    HISTORY_HEIGHT,
    binned_statistics,
    check_length,
    count_upcrossings,
    envelope,
    extra_height,
    is_chosen,
    moving_values,
    operating_point_text,
    planes_of,
    rate_text,
    setpoint,
    shown_part,
    title_of,
    varies,
)
from nsdrill.variables import AXES, OK

SOLID_DENSITY = 50  # oscillations per inch from which on lines leave no white between them
LAST_SECONDS = 20.0  # of a run whose histories would be bands
BAND_BINS = 100  # bins of a band per inch
STANDS_OUT = 1.25  # times the greatest later value: a start that is cut
PANEL_MARGINS = 1.1  # inches of axis and margin beside a panel


def draw_histories_page(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    figure = new_figure(page_width(), 7.2 + extra_height(trace) - HISTORY_HEIGHT * len(constant_histories(trace)))
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
    constants, scheduled = constant_histories(trace), [SCHEDULED[name] for name in moving_values(trace)]
    if constants:
        shown = {quantity(name, units): value for name, value in constants.items()}
        texts = (f"{one.words.lower()} {one.value(value)}" for one, value in shown.items())
        notes.append(f"constant: {', '.join(texts)}")
    names = [name for name in (*drawn_in(trace.attrs).histories, *scheduled) if name not in constants]
    panels = dict(zip(names, stack(figure, len(names)), strict=True))
    time = quantity("time", units)
    bins = band_bins([trace[name] for name in names], width)
    for name, axes in panels.items():
        shown_value = quantity(name, units)
        values = trace[name] / shown_value.scale
        if bins:
            _draw_band(axes, trace.time / time.scale, values, bins, name)
        else:
            kept_time, kept_values = envelope(trace.time, values, BINS)
            axes.plot(kept_time / time.scale, kept_values, color=BLUE, linewidth=0.5, gid=f"history:{name}")
        axes.set_ylabel(shown_value.label)
        name_panel(axes, name, name)
        axes.margins(x=0)
        if name.endswith("_force") and (after_start := greatest_after_start(values)) is not None:
            axes.set_ylim(top=after_start * 1.06)
            notes.append(f"{shown_value.words.lower()} begins at {shown_value.value(trace[name][0])}, cut")
    if bins:
        bin_width = float(trace.time[-1] - trace.time[0]) / bins
        notes += [f"bands: least to greatest in each {bin_width:.2g} s", "lines: the mean"]
    notes += _draw_references(panels, trace, units, moves=SCHEDULED["rotary_speed"] in scheduled)
    column = list(panels.values())
    set_panel_title(column[0], "; ".join(notes), "left")
    column[-1].set_xlabel(time.label)
    figure.align_ylabels(column)


def _draw_references(panels: dict[str, Axes], trace: Trace, units: str, *, moves: bool) -> list[str]:
    """Draw the rotary speed, which ``moves`` or not, and the wall of the hole; returns a
    note on a wall out of sight."""
    speed, gap = trace.attrs.get("rotary_speed"), trace.attrs.get("gap")
    drawn = drawn_in(trace.attrs)
    turning, across = panels.get(drawn.speed), panels.get(drawn.radius)
    scale = quantity(drawn.speed, units).scale
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
        middle, least, greatest, gid=f"history:{name}:band", facecolor=SKY, edgecolor=SKY, linewidth=0.5, alpha=0.75
    )
    axes.plot(middle, mean, color=BLUE, linewidth=0.8, gid=f"history:{name}")


def _draw_reference(axes: Axes, height: float, label: str) -> None:
    """Draw a reference line with its name above its end, so that it needs no legend."""
    axes.axhline(height, zorder=3, gid=label, **DASHED)
    style: Properties = {"ha": "right", "color": REFERENCE, "path_effects": halo(1.5), "zorder": 3.5}
    write(axes, label, (1.0, height), (-2, 1), xycoords=BESIDE, **style)


PLANE_WIDTH = 2.2  # least width of a plane in inches
PLANE_TICKS = 4  # intervals at most, so that numbers like -5.725 do not overlap


def draw_phase_page(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    planes = len(planes_of(trace))
    across = panels_per_row(planes, PLANE_WIDTH)
    figure = new_figure(page_width(), 0.7 + 2.2 * -(-planes // across))
    draw_planes(tiles(figure, planes, across), trace, units)
    put_title(figure, title_of(trace, units))
    return figure


def draw_planes(panels: list[Axes], trace: Trace, units: str) -> None:
    """Draw velocity over position for each motion."""
    part, part_text = shown_part(trace)
    rasterised, gap = len(trace.time[part]) > MANY_MARKERS, trace.attrs.get("gap")
    for axes, (across, up) in zip(panels, planes_of(trace), strict=True):
        x, y = quantity(across, units), quantity(up, units)
        path = trace[across][part] / x.scale, trace[up][part] / y.scale
        axes.plot(*path, color=BLUE, linewidth=0.35, rasterized=rasterised, gid=f"phase:{across}")
        axes.set(xlabel=x.label, ylabel=y.label)
        name_panel(axes, f"phase_{across}", up)
        if part_text:
            set_panel_title(axes, part_text)
        axes.xaxis.set_major_locator(MaxNLocator(PLANE_TICKS, steps=(1, 2, 2.5, 5, 10)))
        if across == "radius" and gap is not None:
            low, high = axes.get_xlim()
            if low < float(gap) / x.scale < high:
                axes.axvline(float(gap) / x.scale, gid="wall", **DASHED)


PLANE_HEIGHT, MAX_PLANE_HEIGHT = 1.6, 2.4  # inches, with labels
TWO_COLUMNS_FROM = 5.0  # inches of width, from which on the planes stand beside the histories


def draw_page(trace: Trace, units: str = "si") -> Figure:
    check_length(trace)
    planes, shows_orbit = len(planes_of(trace)), has_orbit(trace)
    heights = [*[1.55] * shows_orbit, *[1.0] * planes]
    below = 0.0
    height = 8.6 + extra_height(trace) - HISTORY_HEIGHT * len(constant_histories(trace))
    height = max(height, 0.7 + sum(heights) * PLANE_HEIGHT)
    if page_width() >= TWO_COLUMNS_FROM:
        figure = new_figure(page_width(), height)
        left, right = cast("Any", figure.subfigures(1, 2, width_ratios=(1.6, 1.0)))
        # few planes are not taller than wide: below them the page stays empty
        below = max(0.0, (height - 0.7) / MAX_PLANE_HEIGHT - sum(heights))
    else:
        height_below = sum(heights) * 0.55 * page_width()
        figure = new_figure(page_width(), height + height_below)
        left, right = cast("Any", figure.subfigures(2, 1, height_ratios=(height, height_below)))
    draw_histories(left, trace, units)
    panels = stack(right, len(heights), shared=False, heights=heights, below=below)
    if shows_orbit:
        draw_orbit(panels[0], trace, units)
    draw_planes(panels[shows_orbit:], trace, units)
    right.align_ylabels(panels[shows_orbit:])
    put_title(figure, title_of(trace, units))
    return figure


SWEEP_COLOUR = "#D9D9D9"  # of the sweep below, paler than the peaks of the ramp


def draw_ramp(trace: Trace, units: str = "si", over: Results | None = None) -> Figure:
    axis, shown = moving_values(trace)[0], drawn_in(trace.attrs).panels
    x, values = quantity(axis, units), setpoint(trace, axis)
    figure = new_figure(page_width(), 1.2 + 1.7 * len(shown))
    panels = stack(figure, len(shown))
    direction = np.sign(np.diff(values, append=values[-1]))
    direction[-1] = direction[-2]
    handles = draw_sweep(panels, over, trace, axis, units) if over is not None else []
    peaks = [local_maxima(trace.time, trace[panel.trace]) for panel in shown]
    rasterise = sum(len(times) for times, _ in peaks) > MANY_MARKERS
    signs_shown = set()
    for axes, panel, (times, heights) in zip(panels, shown, peaks, strict=True):
        y = quantity(panel.peaks, units)
        sign_of_peak = direction[np.clip(np.searchsorted(trace.time, times), 0, len(values) - 1)]
        across = np.interp(times, trace.time, values) / x.scale
        for sign, style in STYLES.items():
            here, gid = sign_of_peak == sign, f"{panel.trace}:{style['label']}"
            if here.any():
                signs_shown.add(sign)
                points = across[here], heights[here] / y.scale
                axes.plot(*points, linestyle="none", rasterized=rasterise, gid=gid, **style)
        axes.set_ylabel(y.label)
        name_panel(axes, panel.peaks, panel.peaks)
    styles = [STYLES[sign] | {"markersize": 3.5} for sign in (1, -1, 0) if sign in signs_shown]
    handles += [line_entry(linestyle="none", **style) for style in styles]
    by_mode = {panel.mode: [axes] for panel, axes in zip(shown, panels, strict=True)}
    handles += _draw_speed_of_ramp(by_mode.get("torsional", []), trace, axis, units)
    handles += draw_wall(trace.attrs, by_mode.get("lateral", []), units)
    margin = 0.03 * float(np.ptp(values))
    panels[-1].set_xlim((values.min() - margin) / x.scale, (values.max() + margin) / x.scale)
    panels[-1].set_xlabel(x.label)
    figure.align_ylabels(panels)
    point = "; ".join(filter(None, (operating_point_text(trace, units), rate_text(trace, axis, units))))
    return finish(figure, heading(trace.attrs, point), handles, 4)


STYLES: dict[int, Properties] = {
    0: {"label": "held", "color": REFERENCE, "marker": ".", "markersize": 1.5, "markeredgewidth": 0.0, "zorder": 2.0},
    1: {"label": "rising", "color": BLUE, "marker": "o", "markersize": 1.6, "markeredgewidth": 0.0, "zorder": 2.1},
    -1: {
        "label": "falling",
        "color": VERMILLION,
        "marker": "o",
        "markersize": 2.2,
        "markeredgewidth": 0.35,
        "markerfacecolor": "none",
        "zorder": 2.2,
    },
}


def local_maxima(time: Array, values: Array) -> tuple[Array, Array]:
    """Times and heights of the local maxima of equidistant samples, from the parabola
    through three of them."""
    previous, current, following = values[:-2], values[1:-1], values[2:]
    maxima = np.flatnonzero((current > previous) & (current >= following))
    a, b, c = previous[maxima], current[maxima], following[maxima]
    # within half a sample, as the middle one is the greatest
    offset = 0.5 * (a - c) / (a - 2 * b + c)
    sample_time = time[1] - time[0]
    return time[maxima + 1] + offset * sample_time, b - 0.25 * (a - c) * offset


def draw_sweep(panels: list[Axes], results: Results, trace: Trace, axis: str, units: str) -> list[Artist]:
    """Draw the peaks of a sweep along the same axis, pale; where it has several values
    of another axis, those at the value of the ramp."""
    if axis not in results.swept:
        raise InputError(
            f"{option('over')}: found a sweep of {', '.join(results.swept) or 'nothing'}; allowed: a sweep "
            f"of {axis}, which this trace ramps."
        )
    held: dict[str, float] = {}
    for other in (name for name in AXES if name != axis):
        axis_values = np.asarray(results.coords[other], dtype=float)
        target = float(setpoint(trace, other)[0])
        held[other] = float(axis_values[np.argmin(np.abs(axis_values - target))])
        if abs(held[other] - target) > 0.01 * abs(target):
            raise InputError(
                f"{option('over')}: found a sweep at {operating_point({other: held[other]}, units)}; "
                f"allowed: one at {operating_point({other: target}, units)}, as this trace."
            )
    sweep_line, values_set = line(ordered(results, held), axis, units), setpoint(trace, axis)
    in_range = (sweep_line["status"] == OK) & (sweep_line.x >= values_set.min()) & (sweep_line.x <= values_set.max())
    handles: list[Artist] = []
    for row, procedure in enumerate(sweep_line.procedures):
        style: Properties = {"color": SWEEP_COLOUR, "marker": "o", "markersize": 3.0, "markeredgewidth": 0.0}
        if procedure == "down":
            style = {"color": GREY, "marker": "x", "markersize": 2.2, "markeredgewidth": 0.4}
        style |= {"linestyle": "none", "zorder": 1.0}
        for axes, peaks in zip(panels, drawn_in(trace.attrs).peaks, strict=True):
            heights = np.where(in_range[row][:, None], sweep_line.shown(peaks)[row], np.nan)
            across, finite = np.broadcast_to(sweep_line.across[:, None], heights.shape), np.isfinite(heights)
            own: Properties = {"rasterized": heights.size > MANY_MARKERS, "gid": f"sweep:{procedure}:{peaks}"}
            axes.plot(across[finite], heights[finite], **own, **style)
        label = "sweep" if procedure == "same" else f"sweep, {way_word(procedure, results.attrs)}"
        handles.append(line_entry(label=label, **{**style, "markersize": 3.5}))
    return handles


def _draw_speed_of_ramp(panels: list[Axes], trace: Trace, axis: str, units: str) -> list[Artist]:
    """Draw the rotary speed as a line, unless it moves while another value lies along
    x."""
    speed = setpoint(trace, "rotary_speed") / quantity(drawn_in(trace.attrs).speed, units).scale
    ends, style = np.array([speed.min(), speed.max()]), {**DASHED, "zorder": 3}
    if not panels or (axis != "rotary_speed" and ends[0] != ends[1]):
        return []
    if axis == "rotary_speed":
        panels[0].plot(ends, ends, gid="rotary speed", **style)
    else:
        panels[0].axhline(ends[0], gid="rotary speed", **style)
    return [line_entry(label="rotary speed", **style)]


KINDS = (
    Kind(
        "histories",
        "the three motions and the contact forces against time",
        of=TRACE,
        place=lambda data: 81 if isinstance(data, Trace) else None,
        draw=draw_histories_page,
        across=lambda data: "time",
    ),
    Kind(
        "phase",
        "phase planes of the axial, torsional and lateral motion",
        of=TRACE,
        place=lambda data: 83 if isinstance(data, Trace) else None,
        draw=draw_phase_page,
        part_of="trace",
    ),
    Kind(
        "trace",
        "one page with everything: histories, orbit in the hole, phase planes",
        of=TRACE,
        place=lambda data: 80 if isinstance(data, Trace) else None,
        draw=draw_page,
        across=lambda data: "time",
    ),
    Kind(
        "ramp",
        "peaks of the three motions against the value that was moved: a bifurcation diagram made by a real ramp",
        of=RAMP,
        place=lambda data: 85 if isinstance(data, Trace) and moving_values(data) else None,
        draw=draw_ramp,
        takes=("over",),
        across=lambda data: moving_values(data)[0],
        advice=lambda data: "it shows a run along a ramp" if isinstance(data, Trace) else "",
    ),
)
