"""Branches of motions over the peaks of a sweep: solid where stable, dashed where
unstable, with markers at special points."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from nsdrill.analysis.bifurcations import (
    BRANCH,
    CIRCLE,
    CYCLE,
    DOUBLING,
    END,
    EQUILIBRIUM,
    FAILED,
    FOLD,
    HOPF,
    PERIODIC,
    TORUS,
    meanings_of,
)
from nsdrill.analysis.equations import other_string
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.plot.labels import check_units, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.limits import resolve_ends
from nsdrill.plot.look import Look
from nsdrill.plot.look import look as chosen_look
from nsdrill.plot.slices import line as line_of
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    SKY,
    VERMILLION,
    WINE,
    font_size,
    freeze_layout,
    house_style,
    new_figure,
    page_width,
    put_title,
    using_look,
)
from nsdrill.quantity import quantity as base_quantity

HEIGHT, TEXT_HEIGHT = 5.6, 1.4  # inches
# The peaks of the sweep: a pale colour, and points wider than the lines above them.
SWEEP_COLOUR, SWEEP_MARKER_SIZE = "#A9C3DC", 3.2
# Marker and colour of each label; those of grazing take the rest in order.
MARKERS: dict[int, tuple[str, str]] = {
    FOLD: ("s", VERMILLION),
    DOUBLING: ("^", BLUE),
    TORUS: ("D", GREEN),
    BRANCH: ("P", WINE),
    HOPF: ("o", ORANGE),
    FAILED: ("x", BLACK),
}
GRAZING_MARKERS = (("v", SKY), ("<", "#7A5195"), (">", "#8C6D31"))
COLOURS = {PERIODIC: BLACK, EQUILIBRIUM: BLACK, CYCLE: "#7A3B00", CIRCLE: "#00634A"}
MOTION_NAMES = {
    EQUILIBRIUM: "steady drilling",
    PERIODIC: "periodic motions",
    CYCLE: "limit cycles",
    CIRCLE: "invariant circles (whirl)",
}
# of the width of the axes: of labels of one kind that are closer, only the first is
# drawn
MERGE_DISTANCE = 0.004


def draw_branches(
    data: Any, *, units: str = "si", over: Results | None = None, look: Look | None = None
) -> Figure:
    """The branches of a Dataset: of each motion the greatest values over its period, in
    the panels that its model declares. ``over`` is a sweep whose peaks are drawn
    beneath, ``look`` how the user wants the picture to look."""
    check_units(units)
    with using_look(look or Look()), house_style():
        figure = _draw_figure(data, units, over)
        freeze_layout(figure)
    return figure


def _draw_figure(data: Any, units: str, over: Results | None) -> Figure:
    along = str(data.attrs.get("along", "rotary_speed"))
    panels = [panel for panel in drawn_in(data.attrs).panels if panel.greatest in data]
    if not panels:
        raise InputError(
            "the branches: found no feature that a panel shows; allowed: a file of "
            "nsdrill branches."
        )
    x = quantity(along, units)
    fixed = {
        name: float(data[name].values[0])
        for name in ("depth", "wob", "rotary_speed")
        if name in data and name != along
    }
    if over is not None:
        check_same_string(data, over, fixed)
    figure = new_figure(
        page_width(), TEXT_HEIGHT + (HEIGHT - TEXT_HEIGHT) * max(2, len(panels)) / 3
    )
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    handles: dict[str, Artist] = {}
    ends = [
        float(data.attrs.get(name, np.nan)) / x.scale for name in ("continue_from", "continue_to")
    ]
    for panel_axes, panel in zip(axes, panels, strict=True):
        y = quantity(panel.greatest, units)
        if over is not None:
            _draw_sweep(panel_axes, over, along, panel, x.scale, y.scale, handles)
        _draw_branches(panel_axes, data, along, panel.greatest, x.scale, y.scale, handles)
        panel_axes.set_ylabel(y.label)
    axes[-1].set_xlabel(x.label)
    if (xlim := chosen_look.get().xlim) is not None:
        low, high = resolve_ends(
            "xlim", xlim, base_quantity(along).units, *(end * x.scale for end in ends)
        )
        ends = [low / x.scale, high / x.scale]
    if np.all(np.isfinite(ends)):
        axes[-1].set_xlim(*ends)
    _draw_wall(data, panels, axes, units, handles)
    put_title(figure, heading(data.attrs, operating_point(fixed, units)))
    legend_below(figure, list(handles.values()), 4)
    return figure


def check_same_string(data: Any, over: Results, fixed: dict[str, float]) -> None:
    """InputError where a sweep and branches, one of which is drawn over the other, are
    of different strings."""
    ignored = {str(data.attrs.get(name, "")) for name in ("along", "along_key", "over", "over_key")}
    differences = other_string(data.attrs, over, fixed, ignored)
    if differences:
        listing = "; ".join(
            f"{key}: {of_branches} of the branches, {of_sweep} of the sweep"
            for key, of_branches, of_sweep in differences[:4]
        )
        raise InputError(
            f"--over: found another string ({listing}); allowed: results of the same string."
        )


def _draw_sweep(
    axes: Axes,
    over: Results,
    along: str,
    panel: Any,
    x_scale: float,
    y_scale: float,
    handles: dict[str, Artist],
) -> None:
    """The peaks of a sweep."""
    if along not in over.axes:
        raise InputError(
            f"--over: found a sweep without {along}; allowed: a sweep along the "
            f"number that is continued."
        )
    others = {name: 0 for name in over.swept if name != along}
    if others:
        raise InputError(
            f"--over: found a sweep over {' and '.join(over.swept)}; allowed: one over {along} "
            f"alone. Run a study "
            "of that axis."
        )
    sweep_line = line_of(over, along)
    if panel.peaks in over.variables:
        peaks = sweep_line[panel.peaks]
        x = np.broadcast_to(sweep_line.x[None, :, None], peaks.shape)
        finite = np.isfinite(peaks)
        axes.plot(
            x[finite] / x_scale,
            peaks[finite] / y_scale,
            ".",
            color=SWEEP_COLOUR,
            markersize=SWEEP_MARKER_SIZE,
            markeredgewidth=0,
            zorder=1,
            rasterized=True,
            gid="sweep",
        )
    if panel.greatest in over.variables:
        greatest = sweep_line[panel.greatest]
        x = np.broadcast_to(sweep_line.x[None, :], greatest.shape)
        axes.plot(
            x.ravel() / x_scale,
            greatest.ravel() / y_scale,
            ".",
            color=SWEEP_COLOUR,
            markersize=SWEEP_MARKER_SIZE,
            markeredgewidth=0,
            zorder=1,
            rasterized=True,
            gid="sweep greatest",
        )
    handles.setdefault(
        "sweep",
        Line2D(
            [], [], linestyle="none", marker=".", color=SWEEP_COLOUR, label="peaks of the sweep"
        ),
    )


def _draw_branches(
    axes: Axes,
    data: Any,
    along: str,
    feature: str,
    x_scale: float,
    y_scale: float,
    handles: dict[str, Artist],
) -> None:
    """The branches in one panel."""
    numbers, values = data[along].values / x_scale, data[feature].values / y_scale
    unstable, labels = data["unstable"].values, data["label"].values
    row_sizes, motions = (data[key].values for key in ("row_size", "motion"))
    meanings = meanings_of(model_in(data.attrs))
    grazing_markers: dict[int, tuple[str, str]] = {}
    for code in meanings:
        if code > 100:
            grazing_markers[code] = GRAZING_MARKERS[len(grazing_markers) % len(GRAZING_MARKERS)]
    low, high = (
        float(data.attrs.get(key, np.nan)) / x_scale for key in ("continue_from", "continue_to")
    )
    merge_distance = MERGE_DISTANCE * (high - low) if np.isfinite(high - low) else 0.0
    first = 0
    for number, size in enumerate(row_sizes.tolist()):
        part = slice(first, first + size)
        first += size
        x, y, stable = numbers[part], values[part], unstable[part] == 0
        colour = COLOURS.get(str(motions[number]), BLACK)
        style: Any
        for is_stable, style, width, name in (
            (True, "-", 1.3, "stable"),
            (False, (0, (3, 2)), 0.8, "unstable"),
        ):
            # A piece between two points is stable where both points are.
            drawn = (stable[1:] & stable[:-1]) == is_stable
            x_pieces, y_pieces = _connected_pieces(x, y, drawn)
            axes.plot(
                x_pieces,
                y_pieces,
                linestyle=style,
                linewidth=width,
                color=colour,
                zorder=3 if is_stable else 2.5,
                gid=f"branch {number} {name}",
            )
            if drawn.any() and name not in handles:
                handles[name] = Line2D(
                    [], [], linestyle=style, linewidth=width, color=BLACK, label=name
                )
        labelled: list[tuple[int, float, float]] = []
        for place in np.flatnonzero((labels[part] != 0) & (labels[part] != END)):
            code = int(labels[part][place])
            if not np.isfinite(y[place]) or any(
                label_code == code and abs(x[place] - label_x) < merge_distance
                for label_code, label_x, _ in labelled
            ):
                continue
            labelled.append((code, x[place], y[place]))
            marker, colour_of_label = MARKERS.get(code, grazing_markers.get(code, ("o", BLACK)))
            meaning = meanings.get(code)
            name = (meaning.name if meaning else str(code)).replace("_", " ")
            axes.plot(
                x[place],
                y[place],
                marker=marker,
                color=colour_of_label,
                markersize=4,
                markeredgecolor="white" if marker != "x" else colour_of_label,
                markeredgewidth=0.4 if marker != "x" else 0.9,
                zorder=4,
                linestyle="none",
                gid=f"label {code}",
            )
            handles.setdefault(
                name,
                Line2D(
                    [],
                    [],
                    marker=marker,
                    color=colour_of_label,
                    linestyle="none",
                    markersize=4,
                    label=name,
                ),
            )
    # The colour denotes the motion, solid or dashed its stability.
    for motion in dict.fromkeys(str(motion) for motion in motions):
        words = MOTION_NAMES.get(motion, motion.replace("_", " "))
        handles.setdefault(words, Patch(facecolor=COLOURS.get(motion, BLACK), label=words))


def _connected_pieces(x: Array, y: Array, selected: Array) -> tuple[Array, Array]:
    """The line with NaN between its runs of selected pieces: every run is one unbroken
    line, as the dash pattern restarts after a break."""
    x_pieces: list[float] = []
    y_pieces: list[float] = []
    for place in np.flatnonzero(selected):
        if place == 0 or not selected[place - 1]:
            x_pieces += [np.nan, x[place]]
            y_pieces += [np.nan, y[place]]
        x_pieces.append(x[place + 1])
        y_pieces.append(y[place + 1])
    return np.array(x_pieces), np.array(y_pieces)


def _draw_wall(data: Any, panels: Any, axes: Any, units: str, handles: dict[str, Artist]) -> None:
    gap = data.attrs.get("gap")
    if not isinstance(gap, float):
        return
    for panel_axes, panel in zip(axes, panels, strict=True):
        if panel.mode == "lateral":
            y = quantity(panel.greatest, units)
            if panel_axes.get_ylim()[1] > 0.4 * gap / y.scale:
                panel_axes.axhline(
                    gap / y.scale, color="#4D4D4D", linewidth=0.9, zorder=1.5, gid="wall"
                )
                handles["wall"] = Line2D(
                    [], [], color="#4D4D4D", linewidth=0.9, label="wall of the hole"
                )


def draw_branch_curves(figure: Figure, data: Any, x: str, y: str, units: str) -> None:
    """The curves of a file of branches over the panels of a map with the axes ``x`` and
    ``y``."""
    along, over = str(data.attrs.get("along", "")), str(data.attrs.get("over", ""))
    if "curve_row_size" not in data or {along, over} != {x, y}:
        available = f"curves over {along} and {over}" if over else "no curves"
        raise InputError(
            f"--over: found branches with {available}; allowed: curves over {x} and {y}, for which "
            "continue.curves of a study asks."
        )
    x_quantity, y_quantity = quantity(x, units), quantity(y, units)
    meanings = meanings_of(model_in(data.attrs))
    styles: dict[int, Any] = {FOLD: "-", DOUBLING: (0, (5, 1.5))}
    grazing_styles: list[Any] = [(0, (1, 1)), (0, (4, 1, 1, 1)), (0, (2, 2))]
    handles: dict[str, Artist] = {}
    panels = [axes for axes in figure.axes if axes.get_subplotspec() is not None]
    first = 0
    for number, size in enumerate(data["curve_row_size"].values.tolist()):
        part = slice(first, first + size)
        first += size
        code = int(data["curve_label"].values[number])
        if code not in styles:
            styles[code] = grazing_styles[
                sum(style_code > 100 for style_code in styles) % len(grazing_styles)
            ]
        name = meanings[code].title
        line: dict[str, Any] = {
            "linestyle": styles[code],
            "color": BLACK,
            "linewidth": 1.3,
            "zorder": 6,
        }
        curve_x, curve_y = (
            data[f"curve_{x}"].values[part] / x_quantity.scale,
            data[f"curve_{y}"].values[part] / y_quantity.scale,
        )
        for axes in panels:
            limits = axes.get_xlim(), axes.get_ylim()
            axes.plot(curve_x, curve_y, color="white", linewidth=2.6, zorder=5.5)
            axes.plot(curve_x, curve_y, gid=f"curve {number}", **line)
            axes.set_xlim(*limits[0])
            axes.set_ylim(*limits[1])
        handles.setdefault(name, Line2D([], [], label=name, **line))
    if panels and handles:
        panels[0].legend(
            handles=list(handles.values()),
            loc="upper left",
            frameon=True,
            framealpha=0.9,
            fontsize=font_size(6),
        )
