"""Branches of motions over the peaks of a sweep: solid where stable, dashed where
unstable, with markers at special points."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import patheffects
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
from nsdrill.errors import InputError, Refusal, option
from nsdrill.models.registry import drawn_in, model_in
from nsdrill.plot.labels import heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.look import look as look
from nsdrill.plot.look import value_of
from nsdrill.plot.panels import draw_wall
from nsdrill.plot.registry import BRANCHES, Kind, is_branches
from nsdrill.plot.slices import line as line_of
from nsdrill.plot.style import (
    BLACK,
    BLUE,
    FONT_SIZE,
    GREEN,
    ORANGE,
    SKY,
    VERMILLION,
    WINE,
    font_size,
    name_panel,
    new_figure,
    page_width,
    put_title,
    stack,
)
from nsdrill.quantity import quantity as base_quantity

HEIGHT, TEXT_HEIGHT = 5.6, 1.4  # inches
LETTER = 0.48  # its mean width, in font sizes
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
GRAZING_DASHES = ((0, (1, 1)), (0, (4, 1, 1, 1)), (0, (2, 2)))
GRAZING_MARKERS = (("v", SKY), ("<", "#7A5195"), (">", "#8C6D31"))
COLOURS = {PERIODIC: BLACK, EQUILIBRIUM: BLACK, CYCLE: "#7A3B00", CIRCLE: "#00634A"}
MOTION_NAMES = {
    EQUILIBRIUM: "steady drilling",
    PERIODIC: "periodic motions",
    CYCLE: "limit cycles",
    CIRCLE: "invariant circles (whirl)",
}
# inches along x and y: special points that are closer share a marker
MARKER_DISTANCE = (0.14, 0.09)


def draw(data: Any, units: str = "si", over: Results | None = None) -> Figure:
    """The branches of a Dataset: of each motion the greatest values over its period, in
    the panels that its model declares. ``over`` is a sweep whose peaks are drawn
    beneath."""
    along = str(data.attrs.get("along", "rotary_speed"))
    panels = [panel for panel in drawn_in(data.attrs).panels if panel.greatest in data]
    if not panels:
        raise InputError("the branches: found no feature that a panel shows; allowed: a file of nsdrill branches.")
    x = quantity(along, units)
    fixed = {
        name: float(data[name].values[0]) for name in ("depth", "wob", "rotary_speed") if name in data and name != along
    }
    if over is not None:
        check_same_string(data, over, fixed)
    figure = new_figure(page_width(), TEXT_HEIGHT + (HEIGHT - TEXT_HEIGHT) * max(2, len(panels)) / 3)
    axes = stack(figure, len(panels))
    panel_height = (figure.get_figheight() - TEXT_HEIGHT) / len(panels)
    letters = max(8, int(72.0 * panel_height / (LETTER * font_size(FONT_SIZE))))
    handles: dict[str, Artist] = {}
    ends = [float(data.attrs.get(name, np.nan)) / x.scale for name in ("continue_from", "continue_to")]
    for panel_axes, panel in zip(axes, panels, strict=True):
        y = quantity(panel.greatest, units)
        if over is not None:
            _draw_sweep(panel_axes, over, along, panel, x.scale, y.scale, handles)
        _draw_branches(panel_axes, data, along, panel.greatest, x.scale, y.scale, handles)
        panel_axes.set_ylabel(y.in_lines(letters))
        name_panel(panel_axes, panel.greatest, panel.greatest)
    axes[-1].set_xlabel(x.label)
    if (xlim := look.get().xlim) is not None:
        ends = [value_of("xlim", end, base_quantity(along).units) / x.scale for end in xlim]
    for panel_axes in axes if np.all(np.isfinite(ends)) else ():
        panel_axes.set_xlim(*ends)
    for panel_axes, panel in zip(axes, panels, strict=True):
        y = quantity(panel.greatest, units)
        _draw_special_points(panel_axes, data, along, panel.greatest, x.scale, y.scale, handles)
    radii = [one for one, panel in zip(axes, panels, strict=True) if panel.mode == "lateral"]
    walls = draw_wall(data.attrs, radii, units) if radii else []
    put_title(figure, heading(data.attrs, operating_point(fixed, units)))
    legend_below(figure, [*handles.values(), *walls], 4)
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
        raise Refusal("over", f"another string ({listing})", "results of the same string")


def _draw_sweep(
    axes: Axes, over: Results, along: str, panel: Any, x_scale: float, y_scale: float, handles: dict[str, Artist]
) -> None:
    """The peaks of a sweep."""
    if along not in over.axes:
        raise Refusal("over", f"a sweep without {along}", "a sweep along the number that is continued")
    others = {name: 0 for name in over.swept if name != along}
    if others:
        raise InputError(
            f"{option('over')}: found a sweep over {' and '.join(over.swept)}; allowed: one over {along} "
            f"alone. Run a study "
            "of that axis."
        )
    sweep_line = line_of(over, along)
    for name, gid in ((panel.peaks, "sweep"), (panel.greatest, "sweep greatest")):
        if name in over.variables:
            values = sweep_line[name]
            x = np.broadcast_to(sweep_line.x.reshape(-1, *[1] * (values.ndim - 2)), values.shape)
            finite = np.isfinite(values)
            axes.plot(
                x[finite] / x_scale,
                values[finite] / y_scale,
                ".",
                color=SWEEP_COLOUR,
                markersize=SWEEP_MARKER_SIZE,
                markeredgewidth=0,
                zorder=1,
                rasterized=True,
                gid=gid,
            )
    handles.setdefault(
        "sweep", Line2D([], [], linestyle="none", marker=".", color=SWEEP_COLOUR, label="peaks of the sweep")
    )


def _draw_branches(
    axes: Axes, data: Any, along: str, feature: str, x_scale: float, y_scale: float, handles: dict[str, Artist]
) -> None:
    """The branches in one panel."""
    numbers, values = data[along].values / x_scale, data[feature].values / y_scale
    unstable = data["unstable"].values
    motions = data["motion"].values
    for number, part in enumerate(_parts(data["row_size"].values)):
        x, y, stable = numbers[part], values[part], unstable[part] == 0
        colour = COLOURS.get(str(motions[number]), BLACK)
        looks: tuple[tuple[bool, Any, float, str], ...] = (
            (True, "-", 1.3, "stable"),
            (False, (0, (3, 2)), 0.8, "unstable"),
        )
        for is_stable, style, width, name in looks:
            # A piece between two points is stable where both points are.
            drawn = (stable[1:] & stable[:-1]) == is_stable
            # Every run of pieces is one line, as the dash pattern restarts after a break.
            breaks = np.flatnonzero(~drawn) + 1
            axes.plot(
                np.insert(x, breaks, np.nan),
                np.insert(y, breaks, np.nan),
                linestyle=style,
                linewidth=width,
                color=colour,
                zorder=3 if is_stable else 2.5,
                gid=f"branch {number} {name}",
            )
            if drawn.any() and name not in handles:
                handles[name] = Line2D([], [], linestyle=style, linewidth=width, color=BLACK, label=name)
    # The colour denotes the motion, solid or dashed its stability.
    for motion in dict.fromkeys(str(motion) for motion in motions):
        words = MOTION_NAMES.get(motion, motion.replace("_", " "))
        handles.setdefault(words, Patch(facecolor=COLOURS.get(motion, BLACK), label=words))


def _parts(sizes: Array) -> list[slice]:
    """The parts of these sizes, one after the other."""
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for end, size in zip(ends, sizes.tolist(), strict=True)]


def _draw_special_points(
    axes: Axes, data: Any, along: str, feature: str, x_scale: float, y_scale: float, handles: dict[str, Artist]
) -> None:
    """The special points in one panel. Where several would lie on each other, one
    marker stands for them, with their number above it; a black one for more than two
    kinds."""
    meanings = meanings_of(model_in(data.attrs))
    grazing = [code for code in meanings if code > 100]
    looks = {**MARKERS, **{code: GRAZING_MARKERS[i % 3] for i, code in enumerate(grazing)}}
    labels = data["label"].values
    x, y = data[along].values / x_scale, data[feature].values / y_scale
    low, high = sorted(axes.get_xlim())
    shown = (labels != 0) & (labels != END) & np.isfinite(y) & (x >= low) & (x <= high)
    places = np.flatnonzero(shown)
    inches = axes.transData.transform(np.column_stack((x, y))[places]) / axes.figure.dpi
    steps = inches / MARKER_DISTANCE
    groups: list[list[int]] = []  # of numbers in places, the first of which has the marker
    for number in range(len(places)):
        distances = [float(np.hypot(*(steps[group[0]] - steps[number]))) for group in groups]
        if distances and min(distances) < 1.0:
            groups[int(np.argmin(distances))].append(number)
        else:
            groups.append([number])
    for group in groups:
        members = places[group]
        codes = dict.fromkeys(labels[members].tolist())
        if len(codes) > 2:
            _mark(axes, "several special points", x, y, members[0], handles, "o")
        for code in codes if len(codes) <= 2 else ():
            name = meanings[code].name.replace("_", " ") if code in meanings else str(code)
            marker, colour = looks.get(code, ("o", BLACK))
            first = members[labels[members] == code][0]
            _mark(axes, name, x, y, first, handles, marker, colour)
        if len(group) > 2:
            axes.annotate(
                str(len(group)),
                (x[members[0]], y[members[0]]),
                (0, 3.5),
                textcoords="offset points",
                ha="center",
                fontsize=font_size(6),
                path_effects=[patheffects.withStroke(linewidth=1.5, foreground="white")],
                zorder=5,
                gid="number",
            )


def _mark(
    axes: Axes, name: str, x: Array, y: Array, place: int, handles: dict[str, Artist], marker: str, colour: str = BLACK
) -> None:
    """A marker with this ``name`` in the legend, at one ``place`` of the branches."""
    style: dict[str, Any] = {
        "marker": marker,
        "color": colour,
        "linestyle": "none",
        "markersize": 4,
        "markeredgecolor": colour if marker == "x" else "white",
        "markeredgewidth": 0.9 if marker == "x" else 0.4,
    }
    axes.plot([x[place]], [y[place]], zorder=4, gid=f"special:{name}", **style)
    handles.setdefault(name, Line2D([], [], label=name, **style))


def draw_branch_curves(figure: Figure, data: Any, x: str, y: str, units: str) -> None:
    """The curves of a file of branches over the panels of a map with the axes ``x`` and
    ``y``."""
    along, over = str(data.attrs.get("along", "")), str(data.attrs.get("over", ""))
    if "curve_row_size" not in data or {along, over} != {x, y}:
        available = f"curves over {along} and {over}" if over else "no curves"
        raise InputError(
            f"{option('over')}: found branches with {available}; allowed: curves over {x} and {y}, for which "
            "continue.curves of a study asks."
        )
    x_quantity, y_quantity = quantity(x, units), quantity(y, units)
    meanings = meanings_of(model_in(data.attrs))
    codes = data["curve_label"].values.tolist()
    styles: dict[int, Any] = {FOLD: "-", DOUBLING: (0, (5, 1.5))}
    grazing = [code for code in dict.fromkeys(codes) if code not in styles]
    styles |= {code: GRAZING_DASHES[i % 3] for i, code in enumerate(grazing)}
    handles: dict[str, Artist] = {}
    panels = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    for number, part in enumerate(_parts(data["curve_row_size"].values)):
        code = codes[number]
        name = meanings[code].title
        line: dict[str, Any] = {"linestyle": styles[code], "color": BLACK, "linewidth": 1.3, "zorder": 6}
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
            handles=list(handles.values()), loc="upper left", frameon=True, framealpha=0.9, fontsize=font_size(6)
        )


KINDS = (
    Kind(
        "branches",
        "stable and unstable motions along the number that is continued",
        of=BRANCHES,
        place=lambda data: 0 if is_branches(data) else None,
        draw=draw,
        takes=("over",),
        across=lambda data: str(data.attrs.get("along", "rotary_speed")),
    ),
)
