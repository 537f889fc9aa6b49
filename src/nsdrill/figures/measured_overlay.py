"""Measured values: on pictures of a sweep, with their errors along an axis or as
crosses over two axes; and the picture of a fit, with the distributions of the unknowns
before and after it, and measured beside predicted values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nsdrill.analysis.counts import FIT_DOUBTS
from nsdrill.analysis.fitting import Measured
from nsdrill.data import Array, Results, resolved_study, value_at
from nsdrill.errors import InputError, count
from nsdrill.figures.legend import put_legend
from nsdrill.figures.page import area_entry, draw_page, freeze_layout, line_entry
from nsdrill.figures.painters import Page
from nsdrill.figures.style import BLACK, BLUE, GREY, SKY, VERMILLION, Properties, font_size, house_style, page_width
from nsdrill.models.choices import as_value
from nsdrill.variables import dimension_of, long_key, short_key
from nsdrill.words.labels import Shown, check_units, operating_point, quantity

SETTING_TOLERANCE = 0.05  # relative deviation up to which a setting counts as a value of the sweep


def overlay(figure: Figure, results: Results, measured: Measured, units: str) -> int:
    """Draw ``measured`` on the ``figure`` of ``results``, a picture over one axis or
    over two; returns the number of points drawn. InputError where no point lies in the
    picture."""
    swept = results.swept
    at = {dimension_of(key): values for key, values in measured.at.items()}
    if missing_axes := [axis for axis in swept if axis not in at]:
        raise InputError(
            f"{measured.source}: found no {missing_axes[0]}, which the sweep varies; allowed: a column of it."
        )
    at_held_values = _at_held_values(results, measured.at)
    drawn_points = 0
    shown = {axis: values / quantity(axis, units).scale for axis, values in at.items() if axis in swept}
    for axes in figure.axes:
        had_none, drawn = drawn_points == 0, 0
        if len(swept) == 1:
            for name in measured.values:
                if any(str(line.get_gid()).startswith(f"{name}:") for line in axes.lines):
                    drawn += _draw_values(axes, shown[swept[0]], measured, name, at_held_values, units)
            drawn_points += drawn
        elif len(swept) == 2 and any(collection.get_gid() == "cells" for collection in axes.collections):
            drawn = drawn_points = _draw_settings(axes, shown, at_held_values, units)
        if drawn and had_none:
            # in the panel, as the figure has a legend already
            marker = "D" if len(swept) == 1 else "x"
            handle = line_entry("measured", color=VERMILLION, marker=marker, markersize=4, linestyle="none")
            axes.legend(handles=[handle], loc="upper right", fontsize=6, frameon=True, framealpha=0.9, borderpad=0.3)
    if not drawn_points:
        ignored = next((f" I{note[1:]}." for note in measured.notes if note.startswith("ignored: ")), "")
        raise InputError(
            f"{measured.source}: found no measurement that has a place in this picture; allowed: one of its values "
            "along one axis, or a map over two, at the other settings of the sweep (within "
            f"{100 * SETTING_TOLERANCE:g} %).{ignored}"
        )
    return drawn_points


def _at_held_values(results: Results, at: Mapping[str, Array]) -> Array:
    """Which points, bool [points], were measured at the settings that the runs of the ``results`` have: at
    the values that the sweep holds fixed, and of whatever else they were measured ``at`` that of the study."""
    found: Array = np.ones(len(next(iter(at.values()))), dtype=bool)
    drawn = {short_key(unknown.key): values for unknown, values in results.drawn.items()}
    for key, values in at.items():
        if dimension_of(key) in results.swept:
            continue
        # of samples a value that none is near is none of the runs
        own = drawn[key] if key in drawn else np.array([_own_value(results, key)])
        low, high = float(np.min(own)), float(np.max(own))
        found &= values >= low - SETTING_TOLERANCE * abs(low)
        found &= values <= high + SETTING_TOLERANCE * abs(high)
    return found


def _own_value(results: Results, key: str) -> float:
    """The value of a setting in the runs, in SI; NaN where the study has no number there, so that none is the same."""
    if (name := dimension_of(key)) in results.coords:
        return float(results.coords[name][0])
    with suppress(KeyError, TypeError, ValueError):
        return as_value(key, value_at(resolved_study(results.attrs), long_key(key)))
    return float("nan")


def _draw_values(axes: Axes, x: Array, measured: Measured, name: str, at_held_values: Array, units: str) -> int:
    low, high = sorted(axes.get_xlim())
    shown = at_held_values & np.isfinite(measured.values[name]) & (x >= low) & (x <= high)
    values, errors = (
        by_name[name][shown] / quantity(name, units).scale for by_name in (measured.values, measured.errors)
    )
    if values.size:
        bottom, top = axes.get_ylim()
        marker: Properties = {"marker": "D", "markersize": 4, "markeredgecolor": BLACK, "markeredgewidth": 0.5}
        bars: Properties = {"linestyle": "none", "color": VERMILLION, "capsize": 2, "elinewidth": 0.9}
        axes.errorbar(x[shown], values, errors, zorder=6, gid=f"measured:{name}", **marker, **bars)
        low, high = float(np.min(values - errors)), float(np.max(values + errors))
        margin = 0.03 * (max(top, high) - min(bottom, low))
        if low < bottom:
            axes.set_ylim(low - margin, top + margin)
        if high + margin > top:
            axes.set_ylim(top=high + margin)
    return int(shown.sum())


def _draw_settings(axes: Axes, at: dict[str, Array], at_held_values: Array, units: str) -> int:
    """Draw crosses at the settings. The labels of the axes show which axis of the sweep
    lies along x."""
    siblings = (axes, *axes.get_shared_x_axes().get_siblings(axes))
    labels = {one.get_xlabel() for one in siblings}
    (x, y) = (at[axis] for axis in sorted(at, key=lambda axis: quantity(axis, units).label not in labels))
    (left, right), (bottom, top) = sorted(axes.get_xlim()), sorted(axes.get_ylim())
    shown = at_held_values & (x >= left) & (x <= right) & (y >= bottom) & (y <= top)
    cross: Properties = {"linestyle": "none", "marker": "x", "markersize": 6, "zorder": 4.5, "clip_on": False}
    for colour, width, gid in (("white", 3.0, "halo"), (VERMILLION, 1.4, "measured")):
        axes.plot(x[shown], y[shown], color=colour, markeredgewidth=width, gid=gid, **cross)
    return int(shown.sum())


COLUMNS = 3
MAX_NAMED = 6  # points up to which their operating values are written out
PANEL_HEIGHT = 1.5  # inches
BINS = 30  # of the distributions before, and at most of those after


def draw_fit(
    title: str,
    measured: Measured,
    prior: Mapping[str, Array],
    samples: Mapping[str, Array],
    predicted: Mapping[str, Array],
    effective: float,
    failed: int = 0,
    units: str = "si",
    doubts: Sequence[str] = (),
) -> Figure:
    """Draw a fit: the ``prior`` and the posterior ``samples`` of each unknown by key,
    in SI, and the ``predicted`` values [samples, points] by name beside those
    ``measured``; ``effective`` is the effective number of samples of the fit, ``failed`` the
    number of those that failed, and ``doubts`` are those of the fit."""
    check_units(units)
    unknown_rows, names = -(-len(samples) // COLUMNS), [*measured.values]
    rows, with_names = unknown_rows + len(names), measured.points <= MAX_NAMED

    def arrange(figure: Figure) -> list[Axes]:
        grid = figure.add_gridspec(rows, 1, height_ratios=[1.0] * rows)
        cells = [grid[row].subgridspec(1, COLUMNS) for row in range(unknown_rows)]
        unknown = [figure.add_subplot(cells[place // COLUMNS][place % COLUMNS]) for place in range(len(samples))]
        features = [figure.add_subplot(grid[row]) for row in range(unknown_rows, rows)]
        for axes in features[:-1]:
            axes.tick_params(labelbottom=False)
        return [*unknown, *features]

    def paint_unknown(key: str, axes: Axes) -> None:
        _draw_unknown(axes, quantity(key, units), prior[key], samples[key], bins_for(effective))

    def paint_feature(name: str, axes: Axes) -> None:
        _draw_feature(axes, quantity(name, units), measured, name, predicted[name])
        if name == names[-1]:
            _label_points(axes, measured, units, with_names)

    height = 1.2 + PANEL_HEIGHT * rows + (0.25 if with_names else 0.0)
    painters = {key: partial(paint_unknown, key) for key in samples}
    painters |= {name: partial(paint_feature, name) for name in names}
    with house_style():
        page = Page(
            painters, title, page_width(), height, arrange, lambda panels: _entries(effective, failed, doubts), 3
        )
        figure, panels = draw_page(page)
        put_legend(figure, page, panels)
        freeze_layout(figure)
    return figure


def bins_for(number: float) -> int:
    """The number of bins in which so many samples show a distribution, not their own
    noise (Rice's rule, 2 n^(1/3))."""
    return int(np.clip(round(2.0 * number ** (1.0 / 3.0)), 1, BINS))


def _draw_unknown(axes: Axes, shown: Shown, prior: Array, samples: Array, after_bins: int) -> None:
    before, after = prior / shown.scale, samples / shown.scale
    low, high = np.percentile(before, [0.5, 99.5])
    low, high = min(low, after.min()), max(high, after.max())
    bins = np.linspace(low, high, BINS + 1).tolist()
    axes.hist(before, bins=bins, density=True, color=GREY, alpha=0.6, gid="before")
    axes.hist(after, bins=after_bins, density=True, histtype="stepfilled", color=BLUE, alpha=0.7, gid="after")
    axes.set_yticks([])
    axes.ticklabel_format(axis="x", style="plain")
    greatest = max(abs(low), abs(high))
    if greatest >= 1e4:  # a power of ten at the end of the axis is easily overlooked
        power = int(np.floor(np.log10(greatest)))
        axes.xaxis.set_major_formatter(lambda value, place: f"{value / 10.0**power:g}")
        axes.set_xlabel(f"{shown.words} [$10^{power}$ {shown.unit}]")
    else:
        axes.set_xlabel(shown.label)


def _draw_feature(axes: Axes, shown: Shown, measured: Measured, name: str, predicted: Array) -> None:
    numbers = np.arange(1, measured.points + 1)
    is_measured = np.isfinite(measured.values[name])
    low, middle, high = np.percentile(predicted[:, is_measured], [5, 50, 95], axis=0) / shown.scale
    axes.bar(numbers[is_measured], high - low, 0.5, low, color=SKY, alpha=0.6, gid="predicted", zorder=2)
    axes.hlines(middle, numbers[is_measured] - 0.25, numbers[is_measured] + 0.25, color=BLUE, linewidth=1.0, zorder=2.5)
    values, errors = (by_name[name][is_measured] / shown.scale for by_name in (measured.values, measured.errors))
    style: Properties = {"linestyle": "none", "marker": "o", "markersize": 3, "color": BLACK}
    axes.errorbar(numbers[is_measured], values, errors, capsize=2, elinewidth=0.7, zorder=3, **style)
    axes.set_ylabel(shown.label.replace(" [", "\n["), fontsize=font_size(7))
    axes.set_xlim(0.4, measured.points + 0.6)
    axes.use_sticky_edges = False
    axes.margins(y=0.1)


def _label_points(axes: Axes, measured: Measured, units: str, with_names: bool) -> None:
    if not with_names:
        axes.set_xlabel("Operating point, in the order of the file")
        return
    axes.set_xticks(range(1, measured.points + 1))
    texts = [
        operating_point({key: values[i] for key, values in measured.at.items()}, units) for i in range(measured.points)
    ]
    axes.set_xticklabels([text.replace(", ", "\n") for text in texts])


def _entries(effective: float, failed: int, doubts: Sequence[str] = ()) -> list[Artist]:
    lost = f"\nNOT KNOWN: {count(failed, 'sample')} failed, the truth may lie outside" if failed else ""
    lost += "".join(f"\nDOUBTFUL: {FIT_DOUBTS[name]}" for name in doubts if name != "failed")
    return [
        area_entry(facecolor=GREY, alpha=0.6, label="before: what the study says"),
        area_entry(facecolor=BLUE, alpha=0.7, label=f"after, effective number of samples {effective:.0f}{lost}"),
        line_entry(color=BLACK, marker="o", markersize=3, linewidth=0.7, label="measured, one deviation"),
        area_entry(facecolor=SKY, alpha=0.6, label="the model after, 5 to 95 %"),
        line_entry(color=BLUE, linewidth=1.0, label="its median"),
    ]
