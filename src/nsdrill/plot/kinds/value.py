"""Measured values: those that a model counts as its most telling along one axis; or one
of them, along an axis or as a map. Every feature has a panel with its name."""

from __future__ import annotations

from functools import partial
from typing import Any

from matplotlib.figure import Figure

from nsdrill.data import Results
from nsdrill.models.leaves import words_along
from nsdrill.models.registry import drawn_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.plot.curves import draw_curves, draw_words
from nsdrill.plot.maps import draw_values_map, lies_across
from nsdrill.plot.registry import (
    LINE,
    VALUE,
    Kind,
    fits_columns,
    is_sweep,
    longest,
    needs_one_axis,
    needs_returns,
)
from nsdrill.variables import POINT

ALIASES = {
    "lift_off": "lift_off_fraction",
    "wall_contact": "wall_contact_fraction",
    "radius": "radius_max",
}
FIRST = ("stick_slip_index", *ALIASES, "whirl_ratio")  # in the list of kinds, before all others


def draw(results: Results, units: str = "si") -> Figure:
    summary = drawn_in(results.attrs).summary
    if fits_columns(results) and not _has_word_axis(results):
        return draw_curves(results, summary, units)
    return draw_one(summary[0], results, units)


def draw_one(variable: str, results: Results, units: str = "si") -> Figure:
    if len(results.swept) < 2:
        return draw_curves(results, (variable,), units)
    if _has_word_axis(results):
        return draw_words(results, variable, units)
    return draw_values_map(results, variable, units)


def _across(data: Any) -> str:
    return longest(data) if len(data.swept) < 2 or _has_word_axis(data) else lies_across(data)


def _across_several(data: Any) -> str:
    return longest(data) if fits_columns(data) else _across(data)


def _has_word_axis(data: Any) -> bool:
    """Whether the sweep is over one axis of words and one of numbers: then a curve is
    drawn for each word."""
    return len(data.swept) == 2 and sum(bool(words_along(axis)) for axis in data.swept) == 1


def _advice(variable: str, data: Any) -> str:
    if variable in ("lyapunov_exponent", "lyapunov_error") and isinstance(data, Results):
        return "it was not measured: run with record.exponent: true"
    return needs_returns(data) if variable == "zero_one" else ""


def _kind(name: str, variable: str, place: float) -> Kind:
    return Kind(
        name,
        f"{BY_NAME[variable].long_name}: one value",
        of=VALUE,
        place=lambda data: place if is_sweep(data) and variable in data.variables else None,
        draw=partial(draw_one, variable),
        uses=lambda model: (variable,),
        across=_across,
        advice=partial(_advice, variable),
        part_of="value",
    )


_MEASURED = [
    name for name, variable in BY_NAME.items() if variable.dtype == "f8" and variable.dims == POINT
]
KINDS = (
    Kind(
        "value",
        "measured values along one axis; or one of them, also as a map: --panel NAME",
        of=LINE,
        place=lambda data: (31 if fits_columns(data) else 43) if is_sweep(data) else None,
        draw=draw,
        uses=lambda model: model.drawn.summary,
        across=_across_several,
    ),
    Kind(
        "summary",
        "the most telling values along one axis",
        of=LINE,
        place=lambda data: 31 if fits_columns(data) else None,
        draw=lambda results, units="si": draw_curves(
            results, drawn_in(results.attrs).summary, units
        ),
        uses=lambda model: model.drawn.summary,
        across=longest,
        advice=needs_one_axis,
        part_of="value",
    ),
    *(
        _kind(name, ALIASES.get(name, name), 60 + 0.01 * number)
        for number, name in enumerate(dict.fromkeys((*FIRST, *_MEASURED)))
    ),
)
