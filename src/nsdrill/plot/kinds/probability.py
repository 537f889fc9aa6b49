"""The probability of a safe run and of each response: as maps over two axes, with bands
along one axis, else as points.

All panels have one colour scale, from bad to good: 100 % of a safe run is as good as 0 %
of a response. Its lightness rises all the way, so that it is read in grey and by
colour-blind readers. A line surrounds the operating window at the confidence.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import Normal, Stroke

from nsdrill.analysis.probability import EVERY, SAFE, Probabilities, probabilities_of, window_state
from nsdrill.analysis.window import ACROSS, USUAL_CONFIDENCE
from nsdrill.data import Array, Results
from nsdrill.models.leaves import words_along
from nsdrill.models.registry import model_in
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.maps import COLUMNS_OF_PANELS, lies_across
from nsdrill.plot.registry import SAMPLES, Kind, has_samples, longest, needs_samples
from nsdrill.plot.slices import edges, name_words, positions, spaced
from nsdrill.plot.style import (
    BLACK,
    GOODNESS,
    REFERENCE,
    RESPONSES,
    cell_style,
    font_size,
    new_figure,
    page_width,
    put_title,
)
from nsdrill.variables import RESPONSES as RESPONSE_NAMES
from nsdrill.variables import SAMPLE

PERCENT_NORM = Normalize(0.0, 100.0)
BAND_STYLE: dict[str, Any] = {"alpha": 0.16, "linewidth": 0}
EDGE_DASHES: tuple[Any, ...] = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))


def draw(results: Results, units: str = "si", confidence: float = USUAL_CONFIDENCE) -> Figure:
    probabilities = probabilities_of(results, responses=model_in(results.attrs).responses)
    if len(results.swept) == 2:
        return _draw_maps(results, probabilities, units, confidence)
    return (
        _draw_lines(results, probabilities, units, confidence)
        if results.swept
        else _draw_points(results, probabilities, units)
    )


def _style(outcome: str) -> tuple[str, str, str]:
    """Label, colour and marker of an outcome."""
    if outcome == SAFE:
        return "safe", BLACK, "o"
    style = RESPONSES[1 << RESPONSE_NAMES.index(outcome)]
    return style.name, style.colour, style.marker


def _title(results: Results, probabilities: Probabilities, units: str) -> str:
    samples = f"{len(results.coords[SAMPLE])} samples"
    history = "; whatever the history" if EVERY in probabilities.histories else ""
    point = operating_point(fixed_values(results), units)
    return heading(results.attrs, f"{point}; {samples}{history}", width=80)


def _draw_maps(results: Results, probabilities: Probabilities, units: str, confidence: float) -> Figure:
    numbers_first = sorted(results.axes, key=lambda axis: bool(words_along(axis)))
    axes_in_order = [axis for axis in (*ACROSS, *numbers_first) if axis in results.swept]
    x_axis, y_axis = dict.fromkeys(axes_in_order)
    panel_columns = COLUMNS_OF_PANELS.get(len(probabilities.outcomes), 4)
    panel_rows = -(-len(probabilities.outcomes) // panel_columns)
    figure = new_figure(page_width(), 1.3 + panel_rows * 2.4)
    grid = figure.add_gridspec(panel_rows, panel_columns)
    x, y = quantity(x_axis, units), quantity(y_axis, units)
    x_edges, y_edges = (edges(positions(results, name)) / shown.scale for name, shown in ((x_axis, x), (y_axis, y)))

    def plane(values: Array) -> Array:
        plane_axes = [results.axes.index(y_axis), results.axes.index(x_axis)]
        other_axes = [i for i in range(len(results.axes)) if i not in plane_axes]
        return values.transpose(*other_axes, *plane_axes).reshape(len(y_edges) - 1, len(x_edges) - 1)

    inside, _ = window_state(probabilities, confidence)
    panels: list[Axes] = []
    mesh: Any = None
    for place, outcome in enumerate(probabilities.outcomes):
        first = panels[0] if panels else None
        axes = figure.add_subplot(grid[divmod(place, panel_columns)], sharex=first, sharey=first)
        share = 100.0 * plane(probabilities.of(outcome)[0])
        cells = axes.pcolormesh(
            x_edges,
            y_edges,
            share,
            cmap=GOODNESS if outcome == SAFE else GOODNESS.reversed(),
            norm=PERCENT_NORM,
            gid=f"probability:{outcome}",
            **cell_style(share.size),
        )
        mesh = cells if outcome == SAFE else mesh
        draw_outline(axes, x_edges, y_edges, plane(inside))
        axes.set_title(_style(outcome)[0], pad=3)
        is_lowest, is_leftmost = (place + panel_columns >= len(probabilities.outcomes), place % panel_columns == 0)
        axes.tick_params(labelbottom=is_lowest, labelleft=is_leftmost)
        axes.set_xlabel(x.label if is_lowest else "")
        axes.set_ylabel(y.label if is_leftmost else "")
        panels.append(axes)
    spaced(panels[0], positions(results, x_axis), positions(results, y_axis))
    name_words(panels[0], results, x_axis, y_axis, units)
    panels[0].set_xlim(x_edges[0], x_edges[-1])
    downwards = y_axis == "depth" or bool(words_along(y_axis))
    panels[0].set_ylim((y_edges[-1], y_edges[0]) if downwards else (y_edges[0], y_edges[-1]))
    bar = figure.colorbar(mesh, ax=panels, aspect=30, pad=0.01, ticks=range(0, 101, 20))
    bar.set_label("Probability of a safe run / of a response [%]")
    bar.set_ticklabels([f"{tick} / {100 - tick}" for tick in range(0, 101, 20)])
    safe_share = 100.0 * np.count_nonzero(inside) / inside.size
    label = f"safe with {100 * confidence:g} % or more ({safe_share:.1f} % of the points)"
    handle = Line2D([], [], color="white", linewidth=1.2, path_effects=outline_effects(), label=label)
    legend_below(figure, [handle], 1)
    put_title(figure, _title(results, probabilities, units))
    return figure


def outline_effects() -> list[Any]:
    return [Stroke(linewidth=2.6, foreground=BLACK), Normal()]


def draw_outline(axes: Axes, x_edges: Array, y_edges: Array, inside: Array) -> None:
    """Draw the border of the cells that are ``inside`` [y, x], white within black, which
    is visible on every colour."""
    padded = np.pad(inside, 1)
    vertical = [
        ((x_edges[j], y_edges[i]), (x_edges[j], y_edges[i + 1]))
        for i, j in np.argwhere(padded[1:-1, 1:] != padded[1:-1, :-1])
    ]
    horizontal = [
        ((x_edges[j], y_edges[i]), (x_edges[j + 1], y_edges[i]))
        for i, j in np.argwhere(padded[1:, 1:-1] != padded[:-1, 1:-1])
    ]
    outline = LineCollection(
        [*vertical, *horizontal], colors="white", linewidths=1.2, capstyle="round", gid="confidence"
    )
    outline.set_path_effects(outline_effects())
    outline.set_clip_on(False)
    axes.add_collection(outline)


def _draw_lines(results: Results, probabilities: Probabilities, units: str, confidence: float) -> Figure:
    axis = results.swept[0]
    shown, values = quantity(axis, units), positions(results, axis)
    figure = new_figure(page_width(), 3.2)
    axes = figure.add_subplot(figure.add_gridspec(1, 1)[0])
    x, handles = values / shown.scale, []
    for place, outcome in enumerate(probabilities.outcomes):
        label, colour, marker = _style(outcome)
        share, low, high = (100.0 * values_of_share.ravel() for values_of_share in probabilities.of(outcome))
        axes.fill_between(x, low, high, facecolor=colour, gid=f"band:{outcome}", **BAND_STYLE)
        for edge in (low, high):  # overlapping bands are distinguished by their edges
            axes.plot(
                x,
                edge,
                color=colour,
                linewidth=0.7,
                linestyle=EDGE_DASHES[place % len(EDGE_DASHES)],
                gid=f"edge:{outcome}",
            )
        # of coinciding lines the lower one is wider
        lines_above = len(probabilities.outcomes) - 1 - place
        (line,) = axes.plot(
            x,
            share,
            color=colour,
            marker=marker,
            markersize=2.6 + 0.8 * lines_above,
            linewidth=0.9 + 0.4 * lines_above,
            label=label,
            gid=f"line:{outcome}",
        )
        handles.append(line)
    for history, dashes in zip(probabilities.histories[:-1], ("--", ":"), strict=False):
        share = 100.0 * probabilities.of(SAFE, history)[0].ravel()
        history_label = f"safe, {history} by itself"
        handles += axes.plot(
            x, share, color=BLACK, linestyle=dashes, linewidth=0.9, label=history_label, gid=f"alone:{history}"
        )
    axes.axhline(100.0 * confidence, color=REFERENCE, linewidth=0.6, linestyle=(0, (4, 2)), zorder=0, gid="confidence")
    axes.set_ylim(-2.0, 102.0)
    axes.set_xlabel(shown.label)
    axes.set_ylabel("Probability [%]")
    spaced(axes, values)
    axes.margins(x=0.01)
    reference = Line2D([], [], color=REFERENCE, linewidth=0.6, linestyle=(0, (4, 2)), label=f"{100 * confidence:g} %")
    band = Line2D([], [], color=REFERENCE, linewidth=5, alpha=BAND_STYLE["alpha"], label="95 % interval")
    legend_below(figure, [*handles, band, reference], 6)
    put_title(figure, _title(results, probabilities, units))
    return figure


def _draw_points(results: Results, probabilities: Probabilities, units: str) -> Figure:
    """Draw each outcome of one operating point with its interval."""
    figure = new_figure(page_width(5.0), 0.9 + 0.3 * len(probabilities.outcomes))
    axes = figure.add_subplot(figure.add_gridspec(1, 1)[0])
    for row, outcome in enumerate(probabilities.outcomes):
        _, colour, marker = _style(outcome)
        share, low, high = (100.0 * float(part.ravel()[0]) for part in probabilities.of(outcome))
        axes.errorbar(
            [share],
            [row],
            xerr=[[share - low], [high - share]],
            color=colour,
            marker=marker,
            markersize=5,
            capsize=3,
            linestyle="none",
        )[0].set_gid(f"point:{outcome}")
        axes.annotate(
            f"{share:.1f} %", (high, row), (5, 0), textcoords="offset points", va="center", fontsize=font_size(7)
        )
    axes.set_yticks(range(len(probabilities.outcomes)), [_style(outcome)[0] for outcome in probabilities.outcomes])
    axes.set_ylim(len(probabilities.outcomes) - 0.5, -0.5)
    axes.set_xlim(-2.0, 115.0)
    axes.set_xlabel("Probability [%], with its 95 % interval")
    put_title(figure, _title(results, probabilities, units))
    return figure


KINDS = (
    Kind(
        "probability",
        "how probable a safe run and each response are: maps over two axes, with bands along one",
        of=SAMPLES,
        place=lambda data: 10 if has_samples(data) and len(data.swept) < 3 else None,
        draw=draw,
        takes=("confidence",),
        across=lambda data: lies_across(data) if len(data.swept) > 1 else longest(data),
        advice=needs_samples,
    ),
)
