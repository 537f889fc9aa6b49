"""Measured values along one axis, a panel for each, over bands of severity whose bounds are
the thresholds in force in the file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.data import Results, resolved_study
from nsdrill.observe.thresholds import Thresholds
from nsdrill.plot.decimation import envelope
from nsdrill.plot.labels import Shown, fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.panels import is_open, new_columns, outcome_handles
from nsdrill.plot.registry import longest
from nsdrill.plot.slices import Line, edges, robust_limits, spaced
from nsdrill.plot.slices import line as line_along
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    DIRECTION_COLOURS,
    GREEN,
    GREY,
    ORANGE,
    REFERENCE,
    SKY,
    VERMILLION,
    WINE,
    font_size,
    name_panel,
    new_figure,
    page_width,
    put_title,
)
from nsdrill.variables import INFERRED, OK

# variable -> section of the thresholds, its four bounds in ascending order, and the
# names of the five bands
_GRADED: dict[str, tuple[str, tuple[str, ...], tuple[str, ...]]] = {
    "stick_slip_index": (
        "stick_slip",
        ("oscillation_index", "medium_index", "stall_index", "severe_index"),
        ("none", "oscillation", "medium", "onset of stall", "severe"),
    ),
    "lift_off_fraction": (
        "bit_bounce",
        ("light_fraction", "moderate_fraction", "strong_fraction", "severe_fraction"),
        ("none", "light", "moderate", "strong", "severe"),
    ),
    "lateral_acceleration_rms": (
        "whirl",
        ("light_acceleration", "moderate_acceleration", "strong_acceleration", "severe_acceleration"),
        ("none", "light", "moderate", "strong", "severe"),
    ),
}


def severity_bounds(attrs: Mapping[str, Any], name: str) -> tuple[float, ...]:
    """The four bounds of severity of variable ``name`` in its own units, none where it
    is not graded.

    ``attrs`` are the root attributes of a results file. The thresholds of a new
    classification come before those of the study, and these before the defaults.
    """
    if name not in _GRADED:
        return ()
    section, keys, _ = _GRADED[name]
    classify: dict[str, Any] = asdict(Thresholds())
    if "classification_resolved" in attrs:
        classify = json.loads(attrs["classification_resolved"])
    else:
        classify = resolved_study(attrs).get("classify", classify)
    thresholds = {**asdict(Thresholds())[section], **classify.get(section, {})}
    return tuple(float(thresholds[key]) for key in keys)


def band_names(name: str) -> tuple[str, ...]:
    """The names of the five bands of a graded variable, the mildest first."""
    return _GRADED[name][2]


BINS = 1500  # of a curve: about one for each pixel in print
MAX_MARKERS = 200
# colours and markers of curves, one curve for each word
WORD_COLOURS = (BLACK, BLUE, VERMILLION, GREEN, WINE, ORANGE, SKY, GREY)
WORD_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
SEVERITY_GREYS = ("#FFFFFF", "#F5F5F5", "#EBEBEB", "#DFDFDF", "#D2D2D2")


def draw_curves(results: Results, names: Sequence[str], units: str) -> Figure:
    figure, lines, columns = new_columns(results, units, names, 1.5 + 1.2 * len(names) if len(names) > 1 else 2.9)
    for row, name in enumerate(names, start=1):
        y = quantity(name, units)
        for line, column in zip(lines, columns, strict=True):
            draw_values(column[row], line, name, quantity(line.axis, units), y)
        _limit_y([column[row] for column in columns], lines, name, y, units)
        if bounds := severity_bounds(results.attrs, name):
            for column in columns:
                shade_severity(
                    column[row],
                    [bound / y.scale for bound in bounds],
                    band_names(name),
                    with_names=column is columns[-1],
                )
        elif name == "whirl_ratio":
            for column in columns:
                column[row].axhline(0.0, color=REFERENCE, linewidth=0.5, zorder=1)
        if len(names) == 1:
            columns[0][row].set_ylabel(y.wrapped)
    legend_below(figure, [*_direction_handles(lines[0]), *outcome_handles(lines, markers=False)], 4)
    return figure


def draw_words(results: Results, name: str, units: str) -> Figure:
    """A curve for each word of one axis along the other one, whose values are numbers."""
    axis = longest(results)
    (word_axis,) = (other for other in results.swept if other != axis)
    x, y, word_quantity = quantity(axis, units), quantity(name, units), quantity(word_axis, units)
    figure = new_figure(page_width(), 3.2)
    axes, lines = figure.add_subplot(), []
    for number, value in enumerate(results.coords[word_axis]):
        lines.append(line_along(results, axis, **{word_axis: number}))
        word, colour = word_quantity.value(value), WORD_COLOURS[number % len(WORD_COLOURS)]
        style = {
            "color": colour,
            "marker": WORD_MARKERS[number % len(WORD_MARKERS)],
            "markerfacecolor": colour,
            "markersize": 3.5,
            "label": word,
            "gid": f"{name}:{word}",
        }
        draw_values(axes, lines[-1], name, x, y, style)
    spaced(axes, lines[0].x)
    axes.set_xlim(*(edges(lines[0].x)[[0, -1]] / x.scale))
    axes.set_xlabel(x.label)
    axes.set_ylabel(y.label)
    name_panel(axes, name, name)
    _limit_y([axes] * len(lines), lines, name, y, units)
    if bounds := severity_bounds(results.attrs, name):
        shade_severity(axes, [bound / y.scale for bound in bounds], band_names(name), with_names=True)
    handles, _ = axes.get_legend_handles_labels()
    legend_below(figure, handles, 4)
    put_title(figure, heading(results.attrs, operating_point(fixed_values(results), units)))
    return figure


def draw_values(axes: Axes, line: Line, name: str, x: Shown, y: Shown, style: Mapping[str, Any] | None = None) -> None:
    """A line for each procedure, broken where a run did not end well; points that were
    inferred instead of run are skipped."""
    for row, procedure in enumerate(line.procedures):
        ended_well, was_run = line["status"][row] == OK, line["status"][row] != INFERRED
        values = np.where(ended_well, line[name][row] / y.scale, np.nan)
        kept_x, kept_y = envelope(line.x[was_run] / x.scale, values[was_run], BINS)
        own = {"gid": f"{name}:{procedure}", **_style(procedure, line.procedures, len(kept_x))}
        axes.plot(kept_x, kept_y, **{**own, **(style or {})})


def _style(procedure: str, procedures: tuple[str, ...], points: int = 0) -> dict[str, Any]:
    """A line with markers; of more than :data:`MAX_MARKERS` points a line alone,
    thinner from :data:`BINS` points on."""
    colour = DIRECTION_COLOURS.get(procedure, REFERENCE)
    hollow = is_open(procedure, procedures)
    if points > MAX_MARKERS:
        return {"color": colour, "linewidth": 0.7 if points < BINS else 0.4, "zorder": 3 if hollow else 2.5}
    return {
        "color": colour,
        "linewidth": 0.7,
        "linestyle": "--" if hollow else "-",
        "marker": "v" if procedure == "down" else "^" if procedure == "up" else "o",
        "markersize": 2.8,
        "markerfacecolor": "white" if hollow else colour,
        "markeredgewidth": 0.5,
        "zorder": 3 if hollow else 2.5,
    }


def _direction_handles(line: Line) -> list[Line2D]:
    if line.procedures == ("same",):
        return []
    return [
        Line2D(
            [],
            [],
            label=f"carried {name}" if name in ("up", "down") else name,
            **({"markersize": 4} | _style(name, line.procedures, len(line.x))),
        )
        for name in line.procedures
    ]


def _limit_y(panels: list[Axes], lines: list[Line], name: str, y: Shown, units: str) -> None:
    """Set limits insensitive to a few outliers, and draw those as arrows on the
    border."""
    values = np.concatenate([np.where(line["status"] == OK, line[name] / y.scale, np.nan).ravel() for line in lines])
    low, high = robust_limits(values)
    if y.unit == "%":  # a share of time or of a mean speed: the axis begins at zero
        low = 0.0
        high = max(high, 110.0 if name == "stick_slip_index" else 5.0)
    margin = 0.06 * (high - low)
    panels[0].set_ylim(low - (margin if low else 0.03 * (high - low)), high + margin)
    bottom, top = panels[0].get_ylim()
    for axes, line in zip(panels, lines, strict=True):
        x = line.x / quantity(line.axis, units).scale
        for row, procedure in enumerate(line.procedures):
            shown = line[name][row] / y.scale
            for outside, border, marker in ((shown > top, top, "^"), (shown < bottom, bottom, "v")):
                outside = outside & (line["status"][row] == OK)
                if outside.any():
                    axes.plot(
                        x[outside],
                        np.full(int(outside.sum()), border),
                        linestyle="none",
                        marker=marker,
                        color=DIRECTION_COLOURS.get(procedure, REFERENCE),
                        markersize=4,
                        clip_on=False,
                        zorder=5,
                        gid=f"{name}:{procedure}:beyond",
                    )


def shade_severity(axes: Axes, bounds: Sequence[float], band_labels: Sequence[str], *, with_names: bool) -> None:
    """The bands of severity between ``bounds`` behind the curve, with their names at
    the right where ``with_names``."""
    top = axes.get_ylim()[1]
    starts = [0.0, *bounds]
    ends = [*bounds, max(top, bounds[-1])]
    for number, (start, end, word, grey) in enumerate(zip(starts, ends, band_labels, SEVERITY_GREYS, strict=True)):
        axes.axhspan(start, end, facecolor=grey, edgecolor="none", zorder=0, gid=f"severity:{number}")
        end = min(end, top)
        if with_names and end - start > 0.07 * top:
            axes.annotate(
                word,
                (1.005, 0.5 * (start + end)),
                xycoords=("axes fraction", "data"),
                va="center",
                fontsize=font_size(6),
                color=REFERENCE,
            )
