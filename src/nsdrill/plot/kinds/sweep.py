"""Pictures of a sweep: the bifurcation diagram along one axis, measured values, maps of
responses, and the kinds of motion."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from nsdrill.data import Array, Results
from nsdrill.models.leaves import words_along
from nsdrill.models.registry import drawn_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.plot.curves import draw_curves, draw_words
from nsdrill.plot.isolines import line_variables
from nsdrill.plot.labels import Shown, quantity
from nsdrill.plot.legend import direction_entries, legend_below, marker_entry
from nsdrill.plot.maps import draw_map, lies_across
from nsdrill.plot.panels import (
    TEXT_HEIGHT,
    draw_cells,
    draw_dots,
    draw_rotary_speed,
    draw_wall,
    is_open,
    lines_of,
    new_columns,
    outcome_handles,
    shade_hysteresis,
)
from nsdrill.plot.registry import (
    LINE,
    PLANE,
    RETURNS,
    VALUE,
    Kind,
    fits_columns,
    is_plane,
    is_sweep,
    longest,
    needs_one_axis,
    needs_returns,
)
from nsdrill.plot.slices import Line, robust_limits
from nsdrill.plot.style import DIRECTION_COLOURS, MANY_MARKERS, MOTIONS, REFERENCE, RESPONSES, SHADE, SHADE_EDGE
from nsdrill.variables import OK, PERIODIC, POINT

MISSED = 2.0  # times the highest of the last peaks: the greatest value is drawn as well
BIFURCATION_HEIGHT = 6.3  # inches, of three panels and the words


def draw_bifurcation(results: Results, units: str = "si") -> Figure:
    panels = drawn_in(results.attrs).panels
    names = [panel.peaks for panel in panels]
    height = TEXT_HEIGHT + (BIFURCATION_HEIGHT - TEXT_HEIGHT) * len(panels) / 3
    figure, lines, columns = new_columns(results, units, names, height)
    handles = outcome_handles(lines, markers=True)
    shaded = steady = 0
    rasterise = sum(int(np.isfinite(results[name]).sum()) for name in names) > MANY_MARKERS
    for line, column in zip(lines, columns, strict=True):
        for axes, panel in zip(column[1:], panels, strict=True):
            shaded += shade_hysteresis(axes, line, quantity(line.axis, units).scale)
            peaks, greatest = line[panel.peaks], line[panel.greatest]
            values = with_greatest(peaks, greatest)
            draw_dots(axes, line, panel.peaks, (line.outcome, RESPONSES), values, units, rasterise)
            constant = np.where(np.isfinite(peaks).any(axis=-1), np.nan, greatest)[..., None]
            draw_dots(axes, line, panel.greatest, (line.outcome, RESPONSES), constant, units, marker="_")
            steady += int(np.count_nonzero(np.isfinite(constant[..., 0]) & (line.outcome >= 0)))
    rows = {panel.mode: [column[1 + row] for column in columns] for row, panel in enumerate(panels)}
    speed = draw_rotary_speed(lines, rows["torsional"], units) if "torsional" in rows else []
    wall = draw_wall(results.attrs, rows["lateral"], units) if "lateral" in rows else []
    handles += direction_entries(lines[0].procedures)
    if shaded:
        handles.append(Patch(facecolor=SHADE, edgecolor=SHADE_EDGE, linewidth=0.5, label="up and down differ"))
    if steady:
        handles.append(marker_entry("no peaks: constant value", "_", size=5, edge=1.0))
    legend_below(figure, [*handles, *speed, *wall], 4)
    return figure


def with_greatest(peaks: Array, greatest: Array) -> Array:
    """The ``peaks`` [..., peak] with the greatest value of each point, NaN where they
    have it nearly already: the last peaks of a bit that sticks may all be ripples on
    its rest, and leave out the slip."""
    highest = np.max(peaks, axis=-1, initial=-np.inf, where=np.isfinite(peaks))
    missed = np.isfinite(highest) & (greatest > MISSED * np.maximum(highest, 0.0))
    return np.concatenate((peaks, np.where(missed, greatest, np.nan)[..., None]), axis=-1)


def _bifurcation_place(data: Any) -> float | None:
    return 30 if fits_columns(data) and drawn_in(data.attrs).peaks[0] in data.variables else None


def _bifurcation_advice(data: Any) -> str:
    if isinstance(data, Results) and drawn_in(data.attrs).peaks[0] not in data.variables:
        return "no peaks were recorded: run with record.peaks"
    return needs_one_axis(data)


ALIASES = {"lift_off": "lift_off_fraction", "wall_contact": "wall_contact_fraction", "radius": "radius_max"}
FIRST = ("stick_slip_index", *ALIASES, "whirl_ratio")  # in the list of kinds, before all others


def draw_summary(results: Results, units: str = "si") -> Figure:
    summary = drawn_in(results.attrs).summary
    if fits_columns(results) and not _has_word_axis(results):
        return draw_curves(results, summary, units)
    return draw_value(summary[0], results, units)


def draw_value(variable: str, results: Results, units: str = "si") -> Figure:
    if len(results.swept) < 2:
        return draw_curves(results, (variable,), units)
    if _has_word_axis(results):
        return draw_words(results, variable, units)
    return draw_map(results, units, name=variable)


def _across(data: Any) -> str:
    return longest(data) if len(data.swept) < 2 or _has_word_axis(data) else lies_across(data)


def _has_word_axis(data: Any) -> bool:
    """Whether the sweep is over one axis of words and one of numbers: then a curve is
    drawn for each word."""
    return len(data.swept) == 2 and sum(bool(words_along(axis)) for axis in data.swept) == 1


def _value_advice(variable: str, data: Any) -> str:
    if variable in ("lyapunov_exponent", "lyapunov_error") and isinstance(data, Results):
        return "it was not measured: run with record.exponent: true"
    return needs_returns(data) if variable == "zero_one" else ""


def _value_kind(name: str, variable: str, place: float) -> Kind:
    return Kind(
        name,
        f"{BY_NAME[variable].long_name}: one value",
        of=VALUE,
        place=lambda data: place if is_sweep(data) and variable in data.variables else None,
        draw=partial(draw_value, variable),
        uses=lambda model: (variable,),
        across=_across,
        advice=partial(_value_advice, variable),
        part_of="value",
    )


_MEASURED = [name for name, variable in BY_NAME.items() if variable.dtype == "f8" and variable.dims == POINT]


MOTION_LABELS = {
    "lyapunov_exponent": "Lyapunov\nexponent [1/s]",
    "zero_one": "0-1 test $K$",
    "period": "Period\n[returns]",
}
STANDARD_ERRORS = 2  # half the length of an error bar


def draw_motion(results: Results, units: str = "si") -> Figure:
    return _draw_motion_lines(results, units) if fits_columns(results) else draw_map(results, units, "motion")


def _draw_motion_lines(results: Results, units: str) -> Figure:
    names = [
        name
        for name in MOTION_LABELS
        if any(np.isfinite(_values_to_draw(line, name)).any() for line in lines_of(results))
    ]
    figure, lines, columns = new_columns(results, units, ["motion", *names], 2.0 + 1.3 * len(names))
    present: set[int] = set()
    for line, column in zip(lines, columns, strict=True):
        x = quantity(line.axis, units)
        kinds_here = np.ma.masked_where(line["status"] != OK, line["motion"].astype(int))
        first = column is columns[0]
        draw_cells(column[1], line, x.scale, kinds_here, MOTIONS, "motions", name_rows=first)
        present |= set(kinds_here.compressed().tolist())
        for axes, name in zip(column[2:], names, strict=True):
            _draw_motion_values(axes, line, name, x)
    for axes, label in zip(columns[0][1:], ["Motion", *map(MOTION_LABELS.get, names)], strict=True):
        axes.set_ylabel(str(label))
    if "lyapunov_exponent" in names:
        bar_ends = [
            _values_to_draw(line, "lyapunov_exponent") + sign * STANDARD_ERRORS * line["lyapunov_error"]
            for line in lines
            for sign in (-1, 0, 1)
        ]
        low, high = robust_limits(np.concatenate([values.ravel() for values in bar_ends]))
        margin = 0.08 * (high - low)
        columns[0][2].set_ylim(min(low, 0.0) - margin, max(high, 0.0) + margin)
    kinds = [Patch(facecolor=style.colour, label=style.name) for code, style in enumerate(MOTIONS) if code in present]
    directions = direction_entries(lines[0].procedures) if names else []
    legend_below(figure, [*kinds, *directions, *outcome_handles(lines, markers=False)], 4)
    return figure


def _values_to_draw(line: Line, name: str) -> Array:
    """The values to draw [procedure, point], NaN where there are none: periods of
    periodic motions only."""
    if name not in line.results.variables:
        return np.empty(0)
    shown = line["status"] == OK
    if name == "period":
        shown = shown & (line["motion"] == PERIODIC)
    return np.where(shown, line[name], np.nan)


def _draw_motion_values(axes: Axes, line: Line, name: str, x: Shown) -> None:
    for row, (procedure, values) in enumerate(zip(line.procedures, _values_to_draw(line, name), strict=True)):
        hollow = is_open(procedure, line.procedures)
        colour = DIRECTION_COLOURS.get(procedure, REFERENCE)
        errors = STANDARD_ERRORS * line["lyapunov_error"][row] if name == "lyapunov_exponent" else None
        axes.errorbar(
            line.x / x.scale,
            values,
            yerr=errors,
            linestyle="none",
            marker="o",
            color=colour,
            markersize=2.4,
            markerfacecolor="white" if hollow else colour,
            markeredgewidth=0.5,
            elinewidth=0.4,
        )
    if name == "lyapunov_exponent":
        axes.axhline(0.0, color=REFERENCE, linewidth=0.5, zorder=1)
    elif name == "zero_one":
        axes.set_ylim(-0.15, 1.1)
    else:
        axes.set_ylim(0, None)


KINDS = (
    Kind(
        "bifurcation",
        "peaks of the three motions along one axis, coloured by response, hysteresis shaded",
        of=LINE,
        place=_bifurcation_place,
        draw=draw_bifurcation,
        uses=lambda model: (*model.drawn.peaks, *(panel.greatest for panel in model.drawn.panels)),
        across=longest,
        advice=_bifurcation_advice,
    ),
    Kind(
        "value",
        "measured values along one axis; or one of them, also as a map: panel NAME",
        of=LINE,
        place=lambda data: (31 if fits_columns(data) else 43) if is_sweep(data) else None,
        draw=draw_summary,
        uses=lambda model: model.drawn.summary,
        across=lambda data: longest(data) if fits_columns(data) else _across(data),
    ),
    Kind(
        "summary",
        "the most telling values along one axis",
        of=LINE,
        place=lambda data: 31 if fits_columns(data) else None,
        draw=lambda results, units="si": draw_curves(results, drawn_in(results.attrs).summary, units),
        uses=lambda model: model.drawn.summary,
        across=longest,
        advice=needs_one_axis,
        part_of="value",
    ),
    *(
        _value_kind(name, ALIASES.get(name, name), 60 + 0.01 * number)
        for number, name in enumerate(dict.fromkeys((*FIRST, *_MEASURED)))
    ),
    Kind(
        "motion",
        "the kind of motion: along one axis with Lyapunov exponent, 0-1 test and period, or over two axes",
        of=RETURNS,
        place=lambda data: (
            (33 if fits_columns(data) else 42) if is_sweep(data) and "motion" in data.variables else None
        ),
        draw=draw_motion,
        uses=lambda model: ("motion", "period", "zero_one", "lyapunov_exponent", "lyapunov_error"),
        across=lambda data: longest(data) if fits_columns(data) else lies_across(data),
        advice=needs_returns,
    ),
    Kind(
        "map",
        "the responses over two axes",
        of=PLANE,
        place=lambda data: 40 if is_plane(data) else None,
        draw=draw_map,
        uses=line_variables,
        across=lies_across,
    ),
    Kind(
        "whirl_kind",
        "the kind of whirl over two axes",
        of=PLANE,
        place=lambda data: 41 if is_plane(data) and "whirl_kind" in data.variables else None,
        draw=partial(draw_map, variable="whirl_kind"),
        uses=lambda model: ("whirl_kind",),
        across=lies_across,
        part_of="map",
    ),
)
