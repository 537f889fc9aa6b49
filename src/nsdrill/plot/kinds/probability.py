"""How probable a safe run and each response are: over two axes as maps, along one axis
with bands, else as points.

One scale from 0 to 100 % in all panels, the same light and dark for every reader
(cividis). A line surrounds the safe window at the confidence.
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

from nsdrill.analysis.probability import EVERY, SAFE, Chances, chances, window_state
from nsdrill.analysis.window import ACROSS, USUAL_CONFIDENCE
from nsdrill.data import Array, Results
from nsdrill.models.leaves import words_along
from nsdrill.models.registry import model_in
from nsdrill.plot.labels import fixed_values, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.maps import WRAP, lies_across
from nsdrill.plot.registry import SAMPLES, Kind, has_samples, longest, needs_samples
from nsdrill.plot.slices import edges, name_words, positions, spaced
from nsdrill.plot.style import (
    BLACK,
    REFERENCE,
    RESPONSES,
    new_figure,
    page_width,
    put_title,
    seamless,
    type_size,
)
from nsdrill.variables import RESPONSES as NAMES
from nsdrill.variables import SAMPLE

SCALE = "cividis"
PERCENT = Normalize(0.0, 100.0)
BAND: dict[str, Any] = {"alpha": 0.16, "linewidth": 0}
EDGES: tuple[Any, ...] = ("-", (0, (4, 2)), (0, (1, 1.5)), (0, (6, 2, 1, 2)))


def draw(results: Results, units: str = "si", confidence: float = USUAL_CONFIDENCE) -> Figure:
    found = chances(results, responses=model_in(results.attrs).responses)
    if len(results.swept) == 2:
        return _maps(results, found, units, confidence)
    return (
        _lines(results, found, units, confidence)
        if results.swept
        else _points(results, found, units)
    )


def _style(outcome: str) -> tuple[str, str, str]:
    """Words, colour and marker of an outcome."""
    if outcome == SAFE:
        return "safe", BLACK, "o"
    style = RESPONSES[1 << NAMES.index(outcome)]
    return style.name, style.colour, style.marker


def _title(results: Results, found: Chances, units: str) -> str:
    samples = f"{len(results.coords[SAMPLE])} samples"
    history = "; whatever the history" if EVERY in found.histories else ""
    point = operating_point(fixed_values(results), units)
    return heading(results.attrs, f"{point}; {samples}{history}", width=80)


def _maps(results: Results, found: Chances, units: str, confidence: float) -> Figure:
    numbers_first = sorted(results.axes, key=lambda axis: bool(words_along(axis)))
    order = [axis for axis in (*ACROSS, *numbers_first) if axis in results.swept]
    across, up = dict.fromkeys(order)
    wrap = WRAP.get(len(found.outcomes), 4)
    deep = -(-len(found.outcomes) // wrap)
    figure = new_figure(page_width(), 1.3 + deep * 2.4)
    grid = figure.add_gridspec(deep, wrap)
    x, y = quantity(across, units), quantity(up, units)
    columns, rows = (
        edges(positions(results, name)) / one.scale for name, one in ((across, x), (up, y))
    )

    def plane(values: Array) -> Array:
        kept = [results.axes.index(up), results.axes.index(across)]
        rest = [i for i in range(len(results.axes)) if i not in kept]
        return values.transpose(*rest, *kept).reshape(len(rows) - 1, len(columns) - 1)

    inside, _ = window_state(found, confidence)
    panels: list[Axes] = []
    mesh: Any = None
    for place, outcome in enumerate(found.outcomes):
        first = panels[0] if panels else None
        axes = figure.add_subplot(grid[divmod(place, wrap)], sharex=first, sharey=first)
        share = 100.0 * plane(found.of(outcome)[0])
        mesh = axes.pcolormesh(
            columns,
            rows,
            share,
            cmap=SCALE,
            norm=PERCENT,
            gid=f"probability:{outcome}",
            **seamless(share.size),
        )
        _outline(axes, columns, rows, plane(inside))
        axes.set_title(_style(outcome)[0], pad=3)
        lowest, leftmost = place + wrap >= len(found.outcomes), place % wrap == 0
        axes.tick_params(labelbottom=lowest, labelleft=leftmost)
        axes.set_xlabel(x.label if lowest else "")
        axes.set_ylabel(y.label if leftmost else "")
        panels.append(axes)
    spaced(panels[0], positions(results, across), positions(results, up))
    name_words(panels[0], results, across, up, units)
    panels[0].set_xlim(columns[0], columns[-1])
    downwards = up == "depth" or bool(words_along(up))
    panels[0].set_ylim((rows[-1], rows[0]) if downwards else (rows[0], rows[-1]))
    figure.colorbar(mesh, ax=panels, label="Probability [%]", aspect=30, pad=0.01)
    part = 100.0 * np.count_nonzero(inside) / inside.size
    words = f"safe with {100 * confidence:g} % or more ({part:.1f} % of the points)"
    handle = Line2D([], [], color="white", linewidth=1.2, path_effects=_outlined(), label=words)
    legend_below(figure, [handle], 1)
    put_title(figure, _title(results, found, units))
    return figure


def _outlined() -> list[Any]:
    return [Stroke(linewidth=2.6, foreground=BLACK), Normal()]


def _outline(axes: Axes, columns: Array, rows: Array, inside: Array) -> None:
    """The borders of the cells that are ``inside`` [y, x], white within black: seen on
    every shade."""
    padded = np.pad(inside, 1)
    upright = [
        ((columns[j], rows[i]), (columns[j], rows[i + 1]))
        for i, j in np.argwhere(padded[1:-1, 1:] != padded[1:-1, :-1])
    ]
    level = [
        ((columns[j], rows[i]), (columns[j + 1], rows[i]))
        for i, j in np.argwhere(padded[1:, 1:-1] != padded[:-1, 1:-1])
    ]
    drawn = LineCollection(
        [*upright, *level], colors="white", linewidths=1.2, capstyle="round", gid="confidence"
    )
    drawn.set_path_effects(_outlined())
    drawn.set_clip_on(False)
    axes.add_collection(drawn)


def _lines(results: Results, found: Chances, units: str, confidence: float) -> Figure:
    axis = results.swept[0]
    shown, values = quantity(axis, units), positions(results, axis)
    figure = new_figure(page_width(), 3.2)
    axes = figure.add_subplot(figure.add_gridspec(1, 1)[0])
    x, handles = values / shown.scale, []
    for place, outcome in enumerate(found.outcomes):
        words, colour, marker = _style(outcome)
        share, low, high = (100.0 * part.ravel() for part in found.of(outcome))
        axes.fill_between(x, low, high, facecolor=colour, gid=f"band:{outcome}", **BAND)
        for edge in (low, high):  # bands one over another are told apart by their edges
            axes.plot(
                x,
                edge,
                color=colour,
                linewidth=0.7,
                linestyle=EDGES[place % len(EDGES)],
                gid=f"edge:{outcome}",
            )
        above = len(found.outcomes) - 1 - place  # lines one upon another: the lower is the wider
        (line,) = axes.plot(
            x,
            share,
            color=colour,
            marker=marker,
            markersize=2.6 + 0.8 * above,
            linewidth=0.9 + 0.4 * above,
            label=words,
            gid=f"line:{outcome}",
        )
        handles.append(line)
    for history, dashes in zip(found.histories[:-1], ("--", ":"), strict=False):
        share = 100.0 * found.of(SAFE, history)[0].ravel()
        label = f"safe, {history} by itself"
        handles += axes.plot(
            x,
            share,
            color=BLACK,
            linestyle=dashes,
            linewidth=0.9,
            label=label,
            gid=f"alone:{history}",
        )
    axes.axhline(
        100.0 * confidence,
        color=REFERENCE,
        linewidth=0.6,
        linestyle=(0, (4, 2)),
        zorder=0,
        gid="confidence",
    )
    axes.set_ylim(-2.0, 102.0)
    axes.set_xlabel(shown.label)
    axes.set_ylabel("Probability [%]")
    spaced(axes, values)
    axes.margins(x=0.01)
    reference = Line2D(
        [],
        [],
        color=REFERENCE,
        linewidth=0.6,
        linestyle=(0, (4, 2)),
        label=f"{100 * confidence:g} %",
    )
    band = Line2D([], [], color=REFERENCE, linewidth=5, alpha=BAND["alpha"], label="95 % interval")
    legend_below(figure, [*handles, band, reference], 6)
    put_title(figure, _title(results, found, units))
    return figure


def _points(results: Results, found: Chances, units: str) -> Figure:
    """At one operating point: each outcome with its interval."""
    figure = new_figure(page_width(5.0), 0.9 + 0.3 * len(found.outcomes))
    axes = figure.add_subplot(figure.add_gridspec(1, 1)[0])
    for row, outcome in enumerate(found.outcomes):
        _, colour, marker = _style(outcome)
        share, low, high = (100.0 * float(part.ravel()[0]) for part in found.of(outcome))
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
            f"{share:.1f} %",
            (high, row),
            (5, 0),
            textcoords="offset points",
            va="center",
            fontsize=type_size(7),
        )
    axes.set_yticks(range(len(found.outcomes)), [_style(outcome)[0] for outcome in found.outcomes])
    axes.set_ylim(len(found.outcomes) - 0.5, -0.5)
    axes.set_xlim(-2.0, 115.0)
    axes.set_xlabel("Probability [%], with its 95 % interval")
    put_title(figure, _title(results, found, units))
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
