"""The picture of a fit: the distributions of the unknowns before and after, and
measured beside predicted values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.analysis.fitting import Measured
from nsdrill.data import Array
from nsdrill.plot.labels import Shown, check_units, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    GREY,
    SKY,
    font_size,
    freeze_layout,
    house_style,
    new_figure,
    page_width,
    put_title,
)

COLUMNS = 3
MAX_NAMED = 6  # points up to which their operating values are written out
PANEL_HEIGHT = 1.5  # inches
BINS = 30  # of the distributions before, and at most of those after


def draw(
    title: str,
    measured: Measured,
    prior: Mapping[str, Array],
    samples: Mapping[str, Array],
    predicted: Mapping[str, Array],
    units: str = "si",
) -> Figure:
    """Draw a fit: the ``prior`` and the posterior ``samples`` of each unknown by key, in
    SI, and the ``predicted`` values [samples, points] by name beside those
    ``measured``."""
    check_units(units)
    with house_style():
        figure = _draw_figure(title, measured, prior, samples, predicted, units)
        freeze_layout(figure)
    return figure


def _draw_figure(
    title: str,
    measured: Measured,
    prior: Mapping[str, Array],
    samples: Mapping[str, Array],
    predicted: Mapping[str, Array],
    units: str,
) -> Figure:
    unknown_rows, feature_rows = -(-len(samples) // COLUMNS), len(measured.values)
    with_names = measured.points <= MAX_NAMED
    figure = new_figure(
        page_width(), 1.2 + PANEL_HEIGHT * (unknown_rows + feature_rows) + (0.25 if with_names else 0.0)
    )
    grid = figure.add_gridspec(unknown_rows + feature_rows, 1, height_ratios=[1.0] * (unknown_rows + feature_rows))
    keys, number = list(samples), effective_number(samples)
    for row in range(unknown_rows):
        cells = grid[row].subgridspec(1, COLUMNS)
        for column, key in enumerate(keys[row * COLUMNS : (row + 1) * COLUMNS]):
            _draw_unknown(
                figure.add_subplot(cells[column]), quantity(key, units), prior[key], samples[key], bins_for(number)
            )
    panels = [figure.add_subplot(grid[unknown_rows + row]) for row in range(feature_rows)]
    for axes, name in zip(panels, measured.values, strict=True):
        _draw_feature(axes, quantity(name, units), measured, name, predicted[name])
        axes.tick_params(labelbottom=axes is panels[-1])
    _label_points(panels[-1], measured, units, with_names)
    put_title(figure, title)
    legend_below(figure, _handles(number), 3)
    return figure


def effective_number(samples: Mapping[str, Array]) -> float:
    """How many independent samples these are worth: those of great weight are among
    them several times (Kish 1965)."""
    repeats = np.unique(np.column_stack(list(samples.values())), axis=0, return_counts=True)[1]
    return float(repeats.sum() ** 2 / np.sum(repeats.astype(float) ** 2))


def bins_for(number: float) -> int:
    """The number of bins in which so many samples show a distribution, not their own
    noise (Rice's rule, 2 n^(1/3))."""
    return int(np.clip(round(2.0 * number ** (1.0 / 3.0)), 1, BINS))


def _draw_unknown(axes: Axes, shown: Shown, prior: Array, samples: Array, after_bins: int) -> None:
    before, after = prior / shown.scale, samples / shown.scale
    low, high = np.percentile(before, [0.5, 99.5])
    low, high = min(low, after.min()), max(high, after.max())
    bins: Any = np.linspace(low, high, BINS + 1)
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
    style: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 3, "color": BLACK}
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


def _handles(number: float) -> list[Any]:
    return [
        Patch(facecolor=GREY, alpha=0.6, label="before: what the study says"),
        Patch(facecolor=BLUE, alpha=0.7, label=f"after, worth {number:.0f} samples"),
        Line2D([], [], color=BLACK, marker="o", markersize=3, linewidth=0.7, label="measured, one deviation"),
        Patch(facecolor=SKY, alpha=0.6, label="the model after, 5 to 95 %"),
        Line2D([], [], color=BLUE, linewidth=1.0, label="its median"),
    ]
