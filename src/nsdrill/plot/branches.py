"""Branches of motions: solid where stable, dashed where not, markers at special points,
over the peaks of a sweep."""

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
from nsdrill.plot.limits import ends_of
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
    house_style,
    looking,
    new_figure,
    page_width,
    put_title,
    settle,
    type_size,
)
from nsdrill.quantity import quantity as known_quantity

HEIGHT, WORDS = 5.6, 1.4  # inches
# the peaks of the sweep: a pale colour, and points wider than the lines above them
BEHIND, DOT = "#A9C3DC", 3.2
# Marker and colour of each label; grazing has the rest in turn.
MARKERS: dict[int, tuple[str, str]] = {
    FOLD: ("s", VERMILLION),
    DOUBLING: ("^", BLUE),
    TORUS: ("D", GREEN),
    BRANCH: ("P", WINE),
    HOPF: ("o", ORANGE),
    FAILED: ("x", BLACK),
}
GRAZING = (("v", SKY), ("<", "#7A5195"), (">", "#8C6D31"))
COLOURS = {PERIODIC: BLACK, EQUILIBRIUM: BLACK, CYCLE: "#7A3B00", CIRCLE: "#00634A"}
NAMES = {
    EQUILIBRIUM: "steady drilling",
    PERIODIC: "periodic motions",
    CYCLE: "limit cycles",
    CIRCLE: "invariant circles (whirl)",
}
MOST_MULTIPLE = 12
PIXEL = 0.004  # of the width of the axes: labels of one kind that are closer are one


def draw_branches(
    data: Any, *, units: str = "si", over: Results | None = None, look: Look | None = None
) -> Figure:
    """The branches of a Dataset: of each motion the greatest values over its period, as
    the panels of its model have them; ``over`` is a sweep whose peaks are drawn
    beneath, ``look`` how the user wants it to look."""
    check_units(units)
    with looking(look or Look()), house_style():
        figure = _draw(data, units, over)
        settle(figure)
    return figure


def _draw(data: Any, units: str, over: Results | None) -> Figure:
    along = str(data.attrs.get("along", "rotary_speed"))
    panels = [one for one in drawn_in(data.attrs).panels if one.greatest in data]
    if not panels:
        raise InputError(
            "the branches: found no feature that a panel shows; allowed: a file of "
            "nsdrill continue."
        )
    x = quantity(along, units)
    fixed = {
        name: float(data[name].values[0])
        for name in ("depth", "wob", "rotary_speed")
        if name in data and name != along
    }
    if over is not None:
        check_same_string(data, over, fixed)
    figure = new_figure(page_width(), WORDS + (HEIGHT - WORDS) * max(2, len(panels)) / 3)
    axes = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    handles: dict[str, Artist] = {}
    ends = [
        float(data.attrs.get(name, np.nan)) / x.scale for name in ("continue_from", "continue_to")
    ]
    for one, panel in zip(axes, panels, strict=True):
        y = quantity(panel.greatest, units)
        if over is not None:
            _behind(one, over, along, panel, x.scale, y.scale, handles)
        _curves(one, data, along, panel.greatest, x.scale, y.scale, handles)
        one.set_ylabel(y.label)
    axes[-1].set_xlabel(x.label)
    if (asked := chosen_look.get().xlim) is not None:
        low, high = ends_of(
            "xlim", asked, known_quantity(along).units, *(end * x.scale for end in ends)
        )
        ends = [low / x.scale, high / x.scale]
    if np.all(np.isfinite(ends)):
        axes[-1].set_xlim(*ends)
    _wall(data, panels, axes, units, handles)
    put_title(figure, heading(data.attrs, operating_point(fixed, units)))
    legend_below(figure, list(handles.values()), 4)
    return figure


def check_same_string(data: Any, over: Results, fixed: dict[str, float]) -> None:
    """InputError where a sweep and branches, one of which is to be drawn over the
    other, are of unlike strings."""
    free = {str(data.attrs.get(name, "")) for name in ("along", "along_key", "over", "over_key")}
    found = other_string(data.attrs, over, fixed, free)
    if found:
        told = "; ".join(
            f"{key}: {there} of the branches, {here} of the sweep" for key, there, here in found[:4]
        )
        raise InputError(
            f"--over: found another string ({told}); allowed: results of the same string."
        )


def _behind(
    axes: Axes,
    over: Results,
    along: str,
    panel: Any,
    x: float,
    y: float,
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
    one = line_of(over, along)
    if panel.peaks in over.variables:
        peaks = one[panel.peaks]
        at = np.broadcast_to(one.x[None, :, None], peaks.shape)
        good = np.isfinite(peaks)
        axes.plot(
            at[good] / x,
            peaks[good] / y,
            ".",
            color=BEHIND,
            markersize=DOT,
            markeredgewidth=0,
            zorder=1,
            rasterized=True,
            gid="sweep",
        )
    if panel.greatest in over.variables:
        top = one[panel.greatest]
        at = np.broadcast_to(one.x[None, :], top.shape)
        axes.plot(
            at.ravel() / x,
            top.ravel() / y,
            ".",
            color=BEHIND,
            markersize=DOT,
            markeredgewidth=0,
            zorder=1,
            rasterized=True,
            gid="sweep greatest",
        )
    handles.setdefault(
        "sweep",
        Line2D([], [], linestyle="none", marker=".", color=BEHIND, label="peaks of the sweep"),
    )


def _curves(
    axes: Axes, data: Any, along: str, name: str, x: float, y: float, handles: dict[str, Artist]
) -> None:
    """The branches in one panel."""
    numbers, values = data[along].values / x, data[name].values / y
    unstable, labels = data["unstable"].values, data["label"].values
    sizes, motions = (data[key].values for key in ("row_size", "motion"))
    meanings = meanings_of(model_in(data.attrs))
    graze: dict[int, tuple[str, str]] = {}
    for code in meanings:
        if code > 100:
            graze[code] = GRAZING[len(graze) % len(GRAZING)]
    low, high = (float(data.attrs.get(key, np.nan)) / x for key in ("continue_from", "continue_to"))
    pixel = PIXEL * (high - low) if np.isfinite(high - low) else 0.0
    first = 0
    for number, size in enumerate(sizes.tolist()):
        part = slice(first, first + size)
        first += size
        px, py, stable = numbers[part], values[part], unstable[part] == 0
        colour = COLOURS.get(str(motions[number]), BLACK)
        style: Any
        for steady, style, width, word in (
            (True, "-", 1.3, "stable"),
            (False, (0, (3, 2)), 0.8, "unstable"),
        ):
            # A piece between two points is stable where both of them are.
            chosen = (stable[1:] & stable[:-1]) == steady
            gx, gy = _pieces(px, py, chosen)
            axes.plot(
                gx,
                gy,
                linestyle=style,
                linewidth=width,
                color=colour,
                zorder=3 if steady else 2.5,
                gid=f"branch {number} {word}",
            )
            if chosen.any() and word not in handles:
                handles[word] = Line2D(
                    [], [], linestyle=style, linewidth=width, color=BLACK, label=word
                )
        seen: list[tuple[int, float, float]] = []
        for place in np.flatnonzero((labels[part] != 0) & (labels[part] != END)):
            code = int(labels[part][place])
            if not np.isfinite(py[place]) or any(
                other == code and abs(px[place] - at) < pixel for other, at, _ in seen
            ):
                continue
            seen.append((code, px[place], py[place]))
            marker, face = MARKERS.get(code, graze.get(code, ("o", BLACK)))
            meaning = meanings.get(code)
            word = (meaning.name if meaning else str(code)).replace("_", " ")
            axes.plot(
                px[place],
                py[place],
                marker=marker,
                color=face,
                markersize=4,
                markeredgecolor="white" if marker != "x" else face,
                markeredgewidth=0.4 if marker != "x" else 0.9,
                zorder=4,
                linestyle="none",
                gid=f"label {code}",
            )
            handles.setdefault(
                word,
                Line2D(
                    [], [], marker=marker, color=face, linestyle="none", markersize=4, label=word
                ),
            )
    # The colour says which motion, solid or dashed how stable it is.
    for motion in dict.fromkeys(str(one) for one in motions):
        words = NAMES.get(motion, motion.replace("_", " "))
        handles.setdefault(words, Patch(facecolor=COLOURS.get(motion, BLACK), label=words))


def _pieces(x: Array, y: Array, chosen: Array) -> tuple[Array, Array]:
    """The parts of a line whose pieces are chosen, each without a break, as dashes
    begin anew after one."""
    gx: list[float] = []
    gy: list[float] = []
    for place in np.flatnonzero(chosen):
        if place == 0 or not chosen[place - 1]:
            gx += [np.nan, x[place]]
            gy += [np.nan, y[place]]
        gx.append(x[place + 1])
        gy.append(y[place + 1])
    return np.array(gx), np.array(gy)


def _wall(data: Any, panels: Any, axes: Any, units: str, handles: dict[str, Artist]) -> None:
    gap = data.attrs.get("gap")
    if not isinstance(gap, float):
        return
    for one, panel in zip(axes, panels, strict=True):
        if panel.mode == "lateral":
            y = quantity(panel.greatest, units)
            if one.get_ylim()[1] > 0.4 * gap / y.scale:
                one.axhline(gap / y.scale, color="#4D4D4D", linewidth=0.9, zorder=1.5, gid="wall")
                handles["wall"] = Line2D(
                    [], [], color="#4D4D4D", linewidth=0.9, label="wall of the hole"
                )


def draw_borders(figure: Figure, data: Any, x: str, y: str, units: str) -> None:
    """The curves of a file of branches over the panels of a map with the axes ``x`` and
    ``y``."""
    along, over = str(data.attrs.get("along", "")), str(data.attrs.get("over", ""))
    if "curve_row_size" not in data or {along, over} != {x, y}:
        has = f"curves over {along} and {over}" if over else "no curves"
        raise InputError(
            f"--over: found branches with {has}; allowed: curves over {x} and {y}, for which "
            "continue.curves of a study asks."
        )
    sx, sy = quantity(x, units), quantity(y, units)
    meanings = meanings_of(model_in(data.attrs))
    styles: dict[int, Any] = {FOLD: "-", DOUBLING: (0, (5, 1.5))}
    grazing: list[Any] = [(0, (1, 1)), (0, (4, 1, 1, 1)), (0, (2, 2))]
    handles: dict[str, Artist] = {}
    panels = [axes for axes in figure.axes if axes.get_subplotspec() is not None]
    first = 0
    for number, size in enumerate(data["curve_row_size"].values.tolist()):
        part = slice(first, first + size)
        first += size
        code = int(data["curve_label"].values[number])
        if code not in styles:
            styles[code] = grazing[sum(one > 100 for one in styles) % len(grazing)]
        word = meanings[code].title
        line: dict[str, Any] = {
            "linestyle": styles[code],
            "color": BLACK,
            "linewidth": 1.3,
            "zorder": 6,
        }
        px, py = (
            data[f"curve_{x}"].values[part] / sx.scale,
            data[f"curve_{y}"].values[part] / sy.scale,
        )
        for axes in panels:
            limits = axes.get_xlim(), axes.get_ylim()
            axes.plot(px, py, color="white", linewidth=2.6, zorder=5.5)
            axes.plot(px, py, gid=f"curve {number}", **line)
            axes.set_xlim(*limits[0])
            axes.set_ylim(*limits[1])
        handles.setdefault(word, Line2D([], [], label=word, **line))
    if panels and handles:
        panels[0].legend(
            handles=list(handles.values()),
            loc="upper left",
            frameon=True,
            framealpha=0.9,
            fontsize=type_size(6),
        )
