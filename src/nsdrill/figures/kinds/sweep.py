"""Pictures of a sweep: the bifurcation diagram along one axis, measured values, maps of
responses, and the kinds of motion."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes

from nsdrill.analysis.counts import unknown_exponents
from nsdrill.data import Array, Results
from nsdrill.figures.cells import line_variables
from nsdrill.figures.map_panels import lies_across, map_of, value_map
from nsdrill.figures.page import direction_entries, labelled, lay_up, line_entry, style_areas, write
from nsdrill.figures.painters import Page
from nsdrill.figures.panels import (
    Columns,
    curve_style,
    draw_rows,
    draw_values,
    is_open,
    limit_values,
    lines_of,
    shade_severity,
)
from nsdrill.figures.picture_kinds import (
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
from nsdrill.figures.slices import Line, lay_along, robust_limits
from nsdrill.figures.style import (
    BLACK,
    BLUE,
    DIRECTION_COLOURS,
    GREEN,
    GREY,
    MOTIONS,
    ORANGE,
    REFERENCE,
    SKY,
    VERMILLION,
    WINE,
    Properties,
    page_width,
)
from nsdrill.models.choices import words_along
from nsdrill.models.registry import BY_NAME, described, drawn_in
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.variables import MODEL, PERIODIC, POINT
from nsdrill.words.labels import carried, quantity, sweep_title

# colours and markers of curves, one curve for each word
WORD_COLOURS = (BLACK, BLUE, VERMILLION, GREEN, WINE, ORANGE, SKY, GREY)
WORD_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
# the words in an empty panel
NOTHING: Properties = {"xycoords": "axes fraction", "ha": "center", "color": REFERENCE, "gid": "nothing"}
# dotted, which no curve is
ZERO: Properties = {"color": REFERENCE, "linewidth": 0.6, "linestyle": ":", "zorder": 1, "gid": "zero"}


def curves(results: Results, names: Sequence[str], units: str) -> Page:
    def paint(axes: Axes, line: Line, name: str) -> None:
        draw_values(axes, line, name)
        if not np.isfinite(line[name][line.measured]).any():
            write(axes, "no run has a value", (0.5, 0.06), **NOTHING)
        limit_values(axes, line, columns.lines, name)
        shade_severity(axes, results.attrs, name, units, with_names=line is columns.lines[-1])
        if name in drawn_in(results.attrs).signed:
            axes.axhline(0.0, **ZERO)

    labels = {names[0]: quantity(names[0], units).in_lines()} if len(names) == 1 else {}
    columns = Columns(results, units, names, 1.5 + 1.2 * len(names) if len(names) > 1 else 2.9, paint, labels)
    one = columns.lines[0]
    ways = [
        line_entry(
            label=carried(way, results.attrs),
            gid=f"*:{way}",
            **({"markersize": 4} | curve_style(way, one.procedures, len(one.x))),
        )
        for way in one.procedures
        if one.procedures != ("same",)
    ]
    return columns.page(lambda panels: [*ways, *columns.outcome_entries(panels, markers=False)])


def curves_of_words(results: Results, name: str, units: str) -> Page:
    """A curve for each word of one axis along the other one, whose values are
    numbers."""
    axis = longest(results)
    (word_axis,) = (other for other in results.swept if other != axis)
    y, words = quantity(name, units), quantity(word_axis, units)
    values = results.coords[word_axis]
    lines = [Line.along(results, axis, units, **{word_axis: number}) for number in range(len(values))]

    def paint(axes: Axes) -> None:
        for number, (line, value) in enumerate(zip(lines, values, strict=True)):
            word, colour = words.value(value), WORD_COLOURS[number % len(WORD_COLOURS)]
            style = {
                "color": colour,
                "marker": WORD_MARKERS[number % len(WORD_MARKERS)],
                "markerfacecolor": colour,
                "markersize": 3.5,
                "label": word,
                "gid": f"{name}:{word}",
            }
            draw_values(axes, line, name, style)
        lay_along(axes, results, axis, units)
        lay_up(axes, name, y.label)
        for line in lines:
            limit_values(axes, line, lines, name)
        shade_severity(axes, results.attrs, name, units, with_names=True)

    return Page({name: paint}, sweep_title(results, units), page_width(), 3.2, entries=labelled)


def summary(results: Results, units: str = "si") -> Page:
    names = drawn_in(results.attrs).summary
    if fits_columns(results) and not _has_word_axis(results):
        return curves(results, names, units)
    return value(names[0], results, units)


def value(variable: str, results: Results, units: str = "si") -> Page:
    if len(results.swept) < 2:
        return curves(results, (variable,), units)
    if _has_word_axis(results):
        return curves_of_words(results, variable, units)
    return value_map(results, units, variable)


def _across(data: Results) -> str:
    return longest(data) if len(data.swept) < 2 or _has_word_axis(data) else lies_across(data)


def _has_word_axis(data: Results) -> bool:
    """Whether the sweep is over one axis of words and one of numbers: then a curve is
    drawn for each word."""
    return len(data.swept) == 2 and sum(bool(words_along(axis)) for axis in data.swept) == 1


def _value_advice(variable: str, data: object) -> str:
    if variable in ("lyapunov_exponent", "lyapunov_error") and isinstance(data, Results):
        return "it was not measured: run with record.exponent: true"
    return needs_returns(data) if variable == "zero_one" else ""


def _value_kind(name: str, variable: str, place: float) -> Kind:
    return Kind(
        name,
        f"{BY_NAME[variable].long_name}: one value",
        of=VALUE,
        place=lambda data: place if is_sweep(data) and variable in data.variables else None,
        page=partial(value, variable),
        uses=lambda model: (variable,),
        across=_across,
        advice=partial(_value_advice, variable),
        part_of="value",
    )


def _measured() -> dict[str, str]:
    """The values that are measured in runs of their own, not in checks, by the names of their
    kinds, those with a word of their own first."""
    features = [one for one in BY_NAME.values() if one.origin != "trust"]
    names = [one.name for one in features if one.dtype == "f8" and one.dims == POINT]
    return {**described(MODEL).drawn.values, **dict(zip(names, names, strict=True))}


MOTION_LABELS = {
    "lyapunov_exponent": "Lyapunov\nexponent [1/s]",
    "zero_one": "0-1 test $K$",
    "period": "Period\n[returns]",
}
STANDARD_ERRORS = 2  # half the length of an error bar
WIDE = 30.0  # the largest exponent over the usual one, beyond which the axis is logarithmic


def motion(results: Results, units: str = "si") -> Page:
    return _motion_along(results, units) if fits_columns(results) else map_of(results, units, "motion")


def _motion_along(results: Results, units: str) -> Page:
    lines = lines_of(results)
    names = [name for name in MOTION_LABELS if any(np.isfinite(_values_to_draw(line, name)).any() for line in lines)]

    def paint(axes: Axes, line: Line, name: str) -> None:
        if name == "motion":
            codes = np.ma.masked_where(~line.measured, line["motion"].astype(int))
            draw_rows(axes, line, codes, MOTIONS, "motions")
            return
        _draw_motion_values(axes, line, name)
        if name == "lyapunov_exponent":
            _scale_exponents(axes, lines)

    labels = {"motion": "Motion", **MOTION_LABELS}
    columns = Columns(results, units, ["motion", *names], 2.0 + 1.3 * len(names), paint, labels)
    entries = style_areas(MOTIONS, range(len(MOTIONS)), "motions:*")
    entries += direction_entries(lines[0].procedures, results.attrs) if names else []
    lacking, of = unknown_exponents(results)
    if lacking:
        entries.append(line_entry(linestyle="none", label=f"exponent not known of {lacking} of {of} runs"))
    return columns.page(lambda panels: [*entries, *columns.outcome_entries(panels, markers=False)])


def _scale_exponents(axes: Axes, lines: Sequence[Line]) -> None:
    """Limits that show the bars of all exponents; where chaos makes most of them look
    like zero, logarithmic on either side of it."""
    exponents = [_values_to_draw(line, "lyapunov_exponent") for line in lines]
    errors = [STANDARD_ERRORS * line["lyapunov_error"] for line in lines]
    bars = [values + sign * error for values, error in zip(exponents, errors, strict=True) for sign in (-1, 0, 1)]
    low, high = robust_limits(np.concatenate([values.ravel() for values in bars]))
    low, high = min(low, 0.0), max(high, 0.0)
    sizes = np.abs(np.concatenate([values.ravel() for values in exponents]))
    sizes = sizes[sizes > 0.0]
    usual = 10.0 ** np.floor(np.log10(np.median(sizes))) if sizes.size else 0.0
    if 0.0 < WIDE * usual < max(high, -low):
        axes.set_yscale("symlog", linthresh=usual)
        axes.set_ylim(1.6 * low - 0.3 * usual, 1.6 * high + 0.3 * usual)
    else:
        margin = 0.08 * (high - low)
        axes.set_ylim(low - margin, high + margin)


def _values_to_draw(line: Line, name: str) -> Array:
    """The values to draw [procedure, point], NaN where there are none: periods of
    periodic motions only."""
    if name not in line.results.variables:
        return np.empty(0)
    shown = line.measured
    if name == "period":
        shown = shown & (line["motion"] == PERIODIC)
    return np.where(shown, line[name], np.nan)


def _draw_motion_values(axes: Axes, line: Line, name: str) -> None:
    style: Properties = {"linestyle": "none", "marker": "o", "markersize": 2.4, "markeredgewidth": 0.5}
    for row, (procedure, values) in enumerate(zip(line.procedures, _values_to_draw(line, name), strict=True)):
        colour = DIRECTION_COLOURS.get(procedure, REFERENCE)
        face = "white" if is_open(procedure, line.procedures) else colour
        errors = STANDARD_ERRORS * line["lyapunov_error"][row] if name == "lyapunov_exponent" else None
        own: Properties = style | {"color": colour, "markerfacecolor": face, "elinewidth": 0.4}
        dots, *_ = axes.errorbar(line.across, values, errors, **own)
        dots.set_gid(f"{name}:{procedure}")
    if name == "lyapunov_exponent":
        axes.axhline(0.0, **ZERO)
    else:
        axes.set_ylim(*((-0.15, 1.1) if name == "zero_one" else (0, None)))


def _map_of_kind(name: str, words: str) -> Kind:
    return Kind(
        name,
        f"the kind of {words} over two axes",
        of=PLANE,
        place=lambda data: 41 if is_plane(data) and name in data.variables else None,
        page=partial(map_of, variable=name),
        uses=lambda model: (name,),
        across=lies_across,
        part_of="map",
    )


def KINDS() -> tuple[Kind, ...]:  # a constant of the models that are known
    return (
        Kind(
            "value",
            "measured values along one axis; or one of them, also as a map: panel NAME",
            of=LINE,
            place=lambda data: (31 if fits_columns(data) else 43) if is_sweep(data) else None,
            page=summary,
            uses=lambda model: model.drawn.summary,
            across=lambda data: longest(data) if fits_columns(data) else _across(data),
        ),
        Kind(
            "summary",
            "the most telling values along one axis",
            of=LINE,
            place=lambda data: 31 if fits_columns(data) else None,
            page=lambda results, units="si": curves(results, drawn_in(results.attrs).summary, units),
            uses=lambda model: model.drawn.summary,
            across=longest,
            advice=needs_one_axis,
            part_of="value",
        ),
        *(
            _value_kind(name, variable, 60 + 0.01 * number)
            for number, (name, variable) in enumerate(_measured().items())
        ),
        Kind(
            "motion",
            "the kind of motion: along one axis with Lyapunov exponent, 0-1 test and period, or over two axes",
            of=RETURNS,
            place=lambda data: (
                (33 if fits_columns(data) else 42) if is_sweep(data) and "motion" in data.variables else None
            ),
            page=motion,
            uses=lambda model: ("motion", "period", "zero_one", "lyapunov_exponent", "lyapunov_error"),
            across=lambda data: longest(data) if fits_columns(data) else lies_across(data),
            advice=needs_returns,
        ),
        Kind(
            "map",
            "the responses over two axes",
            of=PLANE,
            place=lambda data: 40 if is_plane(data) else None,
            page=map_of,
            uses=line_variables,
            across=lies_across,
        ),
        *(_map_of_kind(name, response.words) for name, response in RESPONSE_KINDS.items()),
    )
