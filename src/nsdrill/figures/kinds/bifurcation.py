"""Bifurcation diagrams: the peaks of the three motions along one axis, coloured by
response; the returns to the Poincare section along one axis, coloured by the kind of
motion; and of a ramp in time local maxima against the operating value that was moved.

Of the returns one dot is period one, n dots a period of n returns, a closed curve
quasi-periodic motion, a cloud chaos. Markers of a ramp are filled where it rose, open
where it fell, and small and grey where it was held; the peaks of a quasi-static sweep can
be drawn below for comparison."""

from __future__ import annotations

from functools import partial
from math import pi

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nsdrill.data import Array, Results, Trace
from nsdrill.errors import InputError, option
from nsdrill.figures.kinds.returns import section_of_point
from nsdrill.figures.page import direction_entries, lay_up, line_entry, marker_entry, stack
from nsdrill.figures.painters import Page
from nsdrill.figures.panels import (
    TEXT_HEIGHT,
    Columns,
    draw_dots,
    draw_rotary_speed,
    draw_wall,
    greatest_of,
    hysteresis_entry,
    rotary_speed_entry,
    shade_hysteresis,
    wall_entry,
)
from nsdrill.figures.picture_kinds import (
    LINE,
    RAMP,
    RETURNS,
    Kind,
    fits_columns,
    longest,
    needs_one_axis,
    needs_returns,
)
from nsdrill.figures.slices import Line, ordered
from nsdrill.figures.style import (
    BLUE,
    DASHED,
    GREY,
    MANY_MARKERS,
    MOTIONS,
    REFERENCE,
    VERMILLION,
    Properties,
    page_width,
    styles_of,
)
from nsdrill.figures.traces import moving_values, operating_point_text, rate_text, setpoint
from nsdrill.models.model_description import Panel
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.variables import OK
from nsdrill.words.labels import heading, operating_point, quantity, way_word

MISSED = 2.0  # times the highest of the last peaks: the greatest value is drawn as well
NO_PEAKS = "no peaks"
BIFURCATION_HEIGHT = 6.3  # inches, of three panels and the words


def bifurcation(results: Results, units: str = "si") -> Page:
    panels = {panel.peaks: panel for panel in drawn_in(results.attrs).panels}
    styles = styles_of(results.attrs)

    def paint(axes: Axes, line: Line, name: str) -> None:
        panel = panels[name]
        shade_hysteresis(axes, line)
        codes, peaks, greatest = line.outcome, line[name], line[panel.greatest]
        rasterise = sum(int(np.isfinite(results[one]).sum()) for one in panels) > MANY_MARKERS
        draw_dots(axes, line, name, codes, styles, with_greatest(peaks, greatest), rasterise=rasterise)
        constant = np.where(np.isfinite(peaks).any(axis=-1), np.nan, greatest)[..., None]
        draw_dots(axes, line, panel.greatest, codes, styles, constant, marker="_", gid=NO_PEAKS)
        if panel.mode == "torsional":
            draw_rotary_speed(axes, line)
        if panel.mode == "lateral":
            draw_wall(axes, results.attrs, greatest_of(results, (name, panel.greatest)), units)

    height = TEXT_HEIGHT + (BIFURCATION_HEIGHT - TEXT_HEIGHT) * len(panels) / 3
    columns = Columns(results, units, list(panels), height, paint)
    return columns.page(
        lambda drawn: [
            *columns.outcome_entries(drawn, markers=True),
            *direction_entries(results.procedures, results.attrs),
            hysteresis_entry(results.attrs),
            marker_entry(f"{NO_PEAKS}: greatest value", "_", size=5, edge=1.0, gid=NO_PEAKS),
            rotary_speed_entry(),
            wall_entry(),
        ]
    )


def with_greatest(peaks: Array, greatest: Array) -> Array:
    """The ``peaks`` [..., peak] with the greatest value of each point, NaN where they
    have it nearly already: the last peaks of a bit that sticks may all be ripples on
    its rest, and leave out the slip."""
    highest = np.max(peaks, axis=-1, initial=-np.inf, where=np.isfinite(peaks))
    missed = np.isfinite(highest) & (greatest > MISSED * np.maximum(highest, 0.0))
    return np.concatenate((peaks, np.where(missed, greatest, np.nan)[..., None]), axis=-1)


def _bifurcation_advice(data: object) -> str:
    if isinstance(data, Results) and drawn_in(data.attrs).peaks[0] not in data.variables:
        return "no peaks were recorded: run with record.peaks"
    return needs_one_axis(data)


THIN: Properties = {"scale": 0.3, "edge": 0.2}  # dots of returns at all angles


def returns_along(results: Results, units: str = "si") -> Page:
    """Every recorded return along one axis; of a single point its section in planes."""
    if not results.swept:
        return section_of_point(results, units)
    shown = drawn_in(results.attrs).section
    rasterise = len(shown) * int(np.isfinite(results[shown[0]]).sum()) > MANY_MARKERS
    style: Properties = {"marker": "o", "scale": 0.75, "edge": 0.3, "rasterise": rasterise}

    def paint(axes: Axes, line: Line, name: str) -> None:
        codes = np.where(line["status"] == OK, line["motion"], -1)
        # a collar that rolls returns at all angles: thin points, where dots would merge to bars
        own = style | (THIN if name == "section_whirl_angle" else {})
        draw_dots(axes, line, name, codes, MOTIONS, line[name], **own)
        if name == "section_whirl_angle":
            _limit_angle(axes, name, units)
        if name == "section_radius":
            draw_wall(axes, results.attrs, greatest_of(results, (name,)), units)
        if name == "section_bit_speed":
            draw_rotary_speed(axes, line)

    columns = Columns(results, units, shown, 1.5 * len(shown) + 1.5, paint)
    motions = [
        marker_entry(motion.name, "o", motion.colour, size=4, gid=f"section_*:*:{code}")
        for code, motion in enumerate(MOTIONS)
    ]
    directions = direction_entries(results.procedures, results.attrs)
    references = rotary_speed_entry(), wall_entry()
    return columns.page(
        lambda drawn: [*motions, *directions, *references, *columns.outcome_entries(drawn, markers=False)]
    )


def _limit_angle(axes: Axes, name: str, units: str) -> None:
    """Limits at a whole turn, with ticks at its quarters."""
    angle = quantity(name, units)
    ticks = np.array([-pi, -pi / 2, 0.0, pi / 2, pi]) / angle.scale
    words = ["−π", "−π/2", "0", "π/2", "π"] if angle.unit == "rad" else [f"{tick:g}" for tick in ticks]
    axes.set_ylim(1.04 * ticks[0], 1.04 * ticks[-1])
    axes.set_yticks(ticks, words)


SWEEP_COLOUR = "#D9D9D9"  # of the sweep below, paler than the peaks of the ramp


def ramp(trace: Trace, units: str = "si", over: Results | None = None) -> Page:
    axis, shown = moving_values(trace)[0], drawn_in(trace.attrs).panels
    x, values = quantity(axis, units), setpoint(trace, axis)
    direction = np.sign(np.diff(values, append=values[-1]))
    direction[-1] = direction[-2]
    below = None if over is None else _Sweep(over, trace, axis, units)
    peaks = {panel.peaks: local_maxima(trace.time, trace[panel.trace]) for panel in shown}
    rasterise = sum(len(times) for times, _ in peaks.values()) > MANY_MARKERS
    margin = 0.03 * float(np.ptp(values))

    def paint(panel: Panel, axes: Axes) -> None:
        if below is not None:
            below.draw(axes, panel.peaks)
        y, (times, heights) = quantity(panel.peaks, units), peaks[panel.peaks]
        sign_of_peak = direction[np.clip(np.searchsorted(trace.time, times), 0, len(values) - 1)]
        across = np.interp(times, trace.time, values) / x.scale
        for sign, style in STYLES.items():
            here, gid = sign_of_peak == sign, f"{panel.trace}:{style['label']}"
            if here.any():
                points = across[here], heights[here] / y.scale
                axes.plot(*points, linestyle="none", rasterized=rasterise, gid=gid, **style)
        lay_up(axes, panel.peaks, y.label)
        if panel.mode == "torsional":
            _draw_speed_of_ramp(axes, trace, axis, units)
        if panel.mode == "lateral":
            draw_wall(axes, trace.attrs, float(np.max(heights, initial=0.0)), units)
        axes.set_xlim((values.min() - margin) / x.scale, (values.max() + margin) / x.scale)
        axes.set_xlabel(x.label)

    def arrange(figure: Figure) -> list[Axes]:
        panels = stack(figure, len(shown))
        figure.align_ylabels(panels)
        return panels

    styles = [STYLES[sign] | {"markersize": 3.5} for sign in (1, -1, 0)]
    entries = [] if below is None else below.entries()
    entries += [line_entry(linestyle="none", gid=f"*:{style['label']}", **style) for style in styles]
    entries += [line_entry(label="rotary speed", **SPEED_OF_RAMP), wall_entry()]
    point = "; ".join(filter(None, (operating_point_text(trace, units), rate_text(trace, axis, units))))
    return Page(
        {panel.peaks: partial(paint, panel) for panel in shown},
        heading(trace.attrs, point),
        page_width(),
        1.2 + 1.7 * len(shown),
        arrange,
        lambda drawn: entries,
    )


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


class _Sweep:
    """The peaks of a sweep along the ``axis`` of a ramp, to be drawn pale below those of
    its ``trace``; where it has several values of another axis, those at the value of the
    ramp. InputError where it is none of this ramp."""

    def __init__(self, results: Results, trace: Trace, axis: str, units: str) -> None:
        if axis not in results.swept:
            raise InputError(
                f"{option('over')}: found a sweep of {', '.join(results.swept) or 'nothing'}; allowed: a sweep "
                f"of {axis}, which this trace ramps."
            )
        held: dict[str, float] = {}
        for other in (name for name in model_in(trace.attrs).operation.names() if name != axis):
            axis_values = np.asarray(results.coords[other], dtype=float)
            target = float(setpoint(trace, other)[0])
            held[other] = float(axis_values[np.argmin(np.abs(axis_values - target))])
            if abs(held[other] - target) > 0.01 * abs(target):
                raise InputError(
                    f"{option('over')}: found a sweep at {operating_point({other: held[other]}, units)}; "
                    f"allowed: one at {operating_point({other: target}, units)}, as this trace."
                )
        self._attrs, values = results.attrs, setpoint(trace, axis)
        self._line = line = Line.along(ordered(results, held), axis, units)
        self._chosen = (line["status"] == OK) & (line.x >= values.min()) & (line.x <= values.max())

    def draw(self, axes: Axes, peaks: str) -> None:
        """Draw the peaks of one motion."""
        for row, procedure in enumerate(self._line.procedures):
            chosen = self._chosen & (np.arange(len(self._chosen)) == row)[:, None]
            rasterise, points = self._line[peaks][row].size > MANY_MARKERS, self._line.points(peaks, chosen)
            axes.plot(*points, rasterized=rasterise, gid=f"sweep:{procedure}:{peaks}", **self._style(procedure))

    def entries(self) -> list[Artist]:
        """The entries of the legend."""
        return [
            line_entry(
                label="sweep" if procedure == "same" else f"sweep, {way_word(procedure, self._attrs)}",
                gid=f"sweep:{procedure}",
                **{**self._style(procedure), "markersize": 3.5},
            )
            for procedure in self._line.procedures
        ]

    def _style(self, procedure: str) -> Properties:
        style: Properties = {"color": SWEEP_COLOUR, "marker": "o", "markersize": 3.0, "markeredgewidth": 0.0}
        if procedure == "down":
            style = {"color": GREY, "marker": "x", "markersize": 2.2, "markeredgewidth": 0.4}
        return style | {"linestyle": "none", "zorder": 1.0}


SPEED_OF_RAMP: Properties = {**DASHED, "zorder": 3, "gid": "rotary speed"}


def _draw_speed_of_ramp(axes: Axes, trace: Trace, axis: str, units: str) -> None:
    """Draw the rotary speed as a line, unless it moves while another value lies along
    x."""
    if "rotary_speed" not in model_in(trace.attrs).axes:
        return
    speed = setpoint(trace, "rotary_speed") / quantity(drawn_in(trace.attrs).speed, units).scale
    ends = np.array([speed.min(), speed.max()])
    if axis == "rotary_speed":
        axes.plot(ends, ends, **SPEED_OF_RAMP)
    elif ends[0] == ends[1]:
        axes.axhline(ends[0], **SPEED_OF_RAMP)


def _has_peaks(data: Results) -> bool:
    return any(name in data.variables for name in drawn_in(data.attrs).peaks[:1])


KINDS = (
    Kind(
        "bifurcation",
        "peaks of the three motions along one axis, coloured by response, hysteresis shaded",
        of=LINE,
        place=lambda data: 30 if fits_columns(data) and _has_peaks(data) else None,
        page=bifurcation,
        uses=lambda model: (*model.drawn.peaks, *(panel.greatest for panel in model.drawn.panels)),
        across=longest,
        advice=_bifurcation_advice,
        panels=lambda data: drawn_in(data.attrs).peaks,
        general="peaks of the motion along one axis, coloured by response, hysteresis shaded",
    ),
    Kind(
        "poincare",
        "every return to the Poincare section along one axis, coloured by the kind of motion; planes of one point",
        of=RETURNS,
        place=lambda data: (32 if data.swept else 20) if fits_columns(data) and "motion" in data.variables else None,
        page=returns_along,
        uses=lambda model: ("motion", "period", *(variable.name for variable in model.section)),
        across=lambda data: longest(data) if data.swept else None,
        advice=needs_returns,
    ),
    Kind(
        "ramp",
        "peaks of the three motions against the value that was moved: a bifurcation diagram made by a real ramp",
        of=RAMP,
        place=lambda data: 85 if isinstance(data, Trace) and moving_values(data) else None,
        page=ramp,
        takes=("over",),
        across=lambda data: moving_values(data)[0],
        advice=lambda data: "it shows a run along a ramp" if isinstance(data, Trace) else "",
        general="peaks of the motion against the value that was moved: a bifurcation diagram made by a real ramp",
    ),
)
