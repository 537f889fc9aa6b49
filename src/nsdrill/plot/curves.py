"""Measured values along one axis, a panel for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.data import Results
from nsdrill.plot.bands import bounds, words
from nsdrill.plot.columns import frame, is_open, outcome_handles
from nsdrill.plot.decimation import envelope
from nsdrill.plot.labels import Shown, fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.registry import longest
from nsdrill.plot.slices import Line, edges, line, robust_limits, spaced
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
    new_figure,
    page_width,
    put_title,
    type_size,
)
from nsdrill.variables import INFERRED, OK

BINS = 1500  # stretches of a curve: about one for each pixel of print
MOST_MARKERS = 200
# colours of curves, each of one word
WORDS = (BLACK, BLUE, VERMILLION, GREEN, WINE, ORANGE, SKY, GREY)
MARKS = ("o", "s", "^", "D", "v", "P", "X", "*")
SEVERITY_GREYS = ("#FFFFFF", "#F5F5F5", "#EBEBEB", "#DFDFDF", "#D2D2D2")


def draw_curves(results: Results, names: Sequence[str], units: str) -> Figure:
    figure, lines, columns = frame(
        results, units, len(names), 1.5 + 1.2 * len(names) if len(names) > 1 else 2.9
    )
    for row, name in enumerate(names, start=1):
        y = quantity(name, units)
        for one, column in zip(lines, columns, strict=True):
            draw_values(column[row], one, name, quantity(one.axis, units), y)
        _limit([column[row] for column in columns], lines, name, y, units)
        if graded := bounds(results.attrs, name):
            for column in columns:
                shade_severity(
                    column[row],
                    [bound / y.scale for bound in graded],
                    words(name),
                    named=column is columns[-1],
                )
        elif name == "whirl_ratio":
            for column in columns:
                column[row].axhline(0.0, color=REFERENCE, linewidth=0.5, zorder=1)
        columns[0][row].set_ylabel(y.upright if len(names) == 1 else y.label)
    legend_below(figure, [*_direction_handles(lines[0]), *outcome_handles(lines, markers=False)], 4)
    return figure


def draw_words(results: Results, name: str, units: str) -> Figure:
    """A curve for each word of one axis along the other one, whose values are numbers."""
    axis = longest(results)
    (word,) = (other for other in results.swept if other != axis)
    x, y, told = quantity(axis, units), quantity(name, units), quantity(word, units)
    figure = new_figure(page_width(), 3.2)
    axes, lines = figure.add_subplot(), []
    for number, value in enumerate(results.coords[word]):
        one = line(results, axis, **{word: number})
        lines.append(one)
        for row, procedure in enumerate(one.procedures):
            good, needed = one["status"][row] == OK, one["status"][row] != INFERRED
            heights = np.where(good, one[name][row] / y.scale, np.nan)
            at, heights = envelope(one.x[needed] / x.scale, heights[needed], BINS)
            style = _style(procedure, one.procedures, len(at)) | {
                "color": WORDS[number % len(WORDS)]
            }
            style |= {
                "marker": MARKS[number % len(MARKS)],
                "markerfacecolor": style["color"],
                "markersize": 3.5,
            }
            axes.plot(
                at, heights, gid=f"{name}:{told.value(value)}", label=told.value(value), **style
            )
    spaced(axes, lines[0].x)
    axes.set_xlim(*(edges(lines[0].x)[[0, -1]] / x.scale))
    axes.set_xlabel(x.label)
    axes.set_ylabel(y.label)
    _limit([axes] * len(lines), lines, name, y, units)
    if graded := bounds(results.attrs, name):
        shade_severity(axes, [bound / y.scale for bound in graded], words(name), named=True)
    handles, _ = axes.get_legend_handles_labels()
    legend_below(figure, handles, 4)
    put_title(figure, heading(results.attrs, operating_point(fixed_values(results), units)))
    return figure


def draw_values(axes: Axes, one: Line, name: str, x: Shown, y: Shown) -> None:
    """A line for each procedure, broken where a run has not ended well; it passes over
    points that were not needed."""
    for row, procedure in enumerate(one.procedures):
        good, needed = one["status"][row] == OK, one["status"][row] != INFERRED
        values = np.where(good, one[name][row] / y.scale, np.nan)
        at, heights = envelope(one.x[needed] / x.scale, values[needed], BINS)
        axes.plot(
            at, heights, gid=f"{name}:{procedure}", **_style(procedure, one.procedures, len(at))
        )


def _style(procedure: str, procedures: tuple[str, ...], points: int = 0) -> dict[str, Any]:
    """Markers where they stand apart; of many points a line alone, thinner the more
    there are."""
    colour = DIRECTION_COLOURS.get(procedure, REFERENCE)
    opened = is_open(procedure, procedures)
    if points > MOST_MARKERS:
        return {
            "color": colour,
            "linewidth": 0.7 if points < BINS else 0.4,
            "zorder": 3 if opened else 2.5,
        }
    return {
        "color": colour,
        "linewidth": 0.7,
        "linestyle": "--" if opened else "-",
        "marker": "v" if procedure == "down" else "^" if procedure == "up" else "o",
        "markersize": 2.8,
        "markerfacecolor": "white" if opened else colour,
        "markeredgewidth": 0.5,
        "zorder": 3 if opened else 2.5,
    }


def _direction_handles(one: Line) -> list[Line2D]:
    if one.procedures == ("same",):
        return []
    return [
        Line2D(
            [],
            [],
            label=f"carried {name}" if name in ("up", "down") else name,
            **({"markersize": 4} | _style(name, one.procedures, len(one.x))),
        )
        for name in one.procedures
    ]


def _limit(panels: list[Axes], lines: list[Line], name: str, y: Shown, units: str) -> None:
    """Limits that a few wild values do not own; these are drawn as arrows on the
    border."""
    values = np.concatenate(
        [np.where(one["status"] == OK, one[name] / y.scale, np.nan).ravel() for one in lines]
    )
    low, high = robust_limits(values)
    if y.unit == "%":  # a share of time or of a mean speed: zero means something
        low = 0.0
        high = max(high, 110.0 if name == "stick_slip_index" else 5.0)
    room = 0.06 * (high - low)
    panels[0].set_ylim(low - (room if low else 0.03 * (high - low)), high + room)
    bottom, top = panels[0].get_ylim()
    for axes, one in zip(panels, lines, strict=True):
        at = one.x / quantity(one.axis, units).scale
        for row, procedure in enumerate(one.procedures):
            shown = one[name][row] / y.scale
            for beyond, border, marker in ((shown > top, top, "^"), (shown < bottom, bottom, "v")):
                beyond = beyond & (one["status"][row] == OK)
                if beyond.any():
                    axes.plot(
                        at[beyond],
                        np.full(int(beyond.sum()), border),
                        linestyle="none",
                        marker=marker,
                        color=DIRECTION_COLOURS.get(procedure, REFERENCE),
                        markersize=4,
                        clip_on=False,
                        zorder=5,
                        gid=f"{name}:{procedure}:beyond",
                    )


def shade_severity(
    axes: Axes, graded: Sequence[float], names: Sequence[str], *, named: bool
) -> None:
    """The bands of severity between the bounds ``graded`` behind the curve, with their
    words at the right."""
    top = axes.get_ylim()[1]
    starts = [0.0, *graded]
    ends = [*graded, max(top, graded[-1])]
    for number, (start, end, word, grey) in enumerate(
        zip(starts, ends, names, SEVERITY_GREYS, strict=True)
    ):
        axes.axhspan(
            start, end, facecolor=grey, edgecolor="none", zorder=0, gid=f"severity:{number}"
        )
        end = min(end, top)
        if named and end - start > 0.07 * top:
            axes.annotate(
                word,
                (1.005, 0.5 * (start + end)),
                xycoords=("axes fraction", "data"),
                va="center",
                fontsize=type_size(6),
                color=REFERENCE,
            )
