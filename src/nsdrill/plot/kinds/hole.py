"""The collar in the hole, to scale, and the path of its centre: one moment of a whirl.
An animation is many of them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from math import pi
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from nsdrill.data import Array, Trace, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in
from nsdrill.plot.kinds.orbit import has_orbit
from nsdrill.plot.labels import quantity
from nsdrill.plot.registry import TRACE, Kind
from nsdrill.plot.style import (
    BLUE,
    REFERENCE,
    VERMILLION,
    new_figure,
    page_width,
    put_title,
    say_over,
    titled,
    type_size,
)
from nsdrill.plot.traces import check_length, shown_part, title_of

ROCK, MUD, STEEL, EDGE = "#CDBFA9", "#F5F2EA", "#C3CCD4", "#5A6570"
BIT, BLADES = "#8A7F6C", 3  # a sign for the bit below: its ring, and marks that turn with it
TAIL = 1.0  # turns of the bit that the path is drawn back from the moment


@dataclass(frozen=True)
class Hole:
    """Radii of the hole and of the collar [m]."""

    hole: float
    collar: float

    @classmethod
    def of(cls, trace: Trace) -> Hole:
        """InputError where the trace does not say how wide they are."""
        gap, diameter = trace.attrs.get("gap"), _diameter(trace)
        if gap is None or diameter is None:
            raise InputError(
                "trace: found no width of the hole or of the collar; allowed: a trace whose "
                "string has them. The kind "
                "orbit needs neither."
            )
        return cls(float(gap) + 0.5 * diameter, 0.5 * diameter)


def _diameter(trace: Trace) -> float | None:
    """The outer diameter of the collar [m]: that of the point where it was an axis,
    else of the study."""
    key = drawn_in(trace.attrs).collar
    if key is None:
        return None
    at = json.loads(str(trace.attrs.get("at") or "{}"))
    found: Any = resolved_study(trace.attrs)
    for part in key.split("."):
        found = found.get(part) if isinstance(found, dict) else None
    found = at.get(key, found)
    return float(found) if isinstance(found, int | float) else None


def bit_angle(trace: Trace) -> Array:
    """The angle that the bit has turned [rad]; the collar above it turns with it."""
    return np.asarray(trace["drive_angle"] + trace["twist"])


class Scene:
    """Hole, bit and collar in one axes: what stands still is drawn once, :meth:`show`
    moves the rest."""

    def __init__(self, axes: Axes, trace: Trace, units: str) -> None:
        self.size = Hole.of(trace)
        across, up = quantity("x", units), quantity("y", units)
        self._scale = across.scale
        self._time, self._angle = trace.time, bit_angle(trace)
        self._x, self._y = trace["x"], trace["y"]
        self._force, self._speed = trace["wall_force"], trace["bit_speed"]
        self._shown_speed = quantity("bit_speed", units)
        self._turn = 2 * pi / max(float(np.nanmean(np.abs(self._speed))), 1e-3)
        hole, collar = self.size.hole / self._scale, self.size.collar / self._scale
        half = 1.1 * hole
        axes.set_facecolor(ROCK)
        axes.set(
            xlim=(-half, half),
            ylim=(-half, half),
            xlabel=across.label,
            ylabel=up.label,
            aspect="equal",
        )
        axes.add_patch(
            Circle((0, 0), hole, facecolor=MUD, edgecolor=REFERENCE, linewidth=0.9, gid="wall")
        )
        axes.add_patch(
            Circle(
                (0, 0),
                0.95 * hole,
                fill=False,
                edgecolor=BIT,
                linewidth=0.6,
                linestyle="--",
                gid="bit",
            )
        )
        axes.plot(
            [0],
            [0],
            marker="+",
            color=REFERENCE,
            markersize=6,
            markeredgewidth=0.6,
            linestyle="none",
            zorder=4,
        )
        line: dict[str, Any] = {"solid_capstyle": "round", "zorder": 3}
        self._blades = [
            axes.plot([], [], color=BIT, linewidth=3.0, gid="blade")[0] for _ in range(BLADES)
        ]
        self._collar = Circle(
            (0, 0), collar, facecolor=STEEL, edgecolor=EDGE, linewidth=0.9, zorder=2
        )
        axes.add_patch(self._collar)
        self._collar.set_gid("collar")
        (self._spoke,) = axes.plot([], [], color=EDGE, linewidth=1.2, gid="spoke", **line)
        (self._path,) = axes.plot([], [], color=BLUE, linewidth=0.7, alpha=0.8, gid="path", **line)
        (self._centre,) = axes.plot(
            [], [], marker="o", color=BLUE, markersize=3.5, linestyle="none", zorder=4
        )
        (self._touch,) = axes.plot(
            [], [], marker="o", color=VERMILLION, markersize=6, linestyle="none", zorder=5
        )
        self._touch.set_gid("touch")
        self._words = axes.text(
            0.02,
            0.98,
            "",
            transform=axes.transAxes,
            va="top",
            fontsize=type_size(7),
            gid="clock",
            zorder=6,
        )

    @property
    def moving(self) -> list[Artist]:
        """What :meth:`show` changes, in the order in which it is drawn."""
        return [
            *self._blades,
            self._collar,
            self._path,
            self._spoke,
            self._centre,
            self._touch,
            self._words,
        ]

    def show(self, time: float, since: float | None = None) -> None:
        """The moment ``time`` [s], with the path ``since`` then, or of the last turn."""
        x, y, angle, force, speed = (
            float(np.interp(time, self._time, values))
            for values in (self._x, self._y, self._angle, self._force, self._speed)
        )
        hole, collar, scale = (
            self.size.hole / self._scale,
            self.size.collar / self._scale,
            self._scale,
        )
        x, y = x / scale, y / scale
        for number, blade in enumerate(self._blades):
            direction = np.array(
                [np.cos(angle + 2 * pi * number / BLADES), np.sin(angle + 2 * pi * number / BLADES)]
            )
            blade.set_data(*np.outer(direction, [0.9 * hole, 0.985 * hole]))
        self._collar.set_center((x, y))
        self._spoke.set_data([x, x + collar * np.cos(angle)], [y, y + collar * np.sin(angle)])
        begin = time - TAIL * self._turn if since is None else since
        past = (self._time >= begin) & (self._time < time)
        self._path.set_data(
            np.append(self._x[past] / scale, x), np.append(self._y[past] / scale, y)
        )
        self._centre.set_data([x], [y])
        radius = np.hypot(x, y)
        touching = force > 0.0 and radius > 0.0
        self._touch.set_data(
            *(([x / radius * hole], [y / radius * hole]) if touching else ([], []))
        )
        shown = speed / self._shown_speed.scale
        self._words.set_text(f"{time:.2f} s\nbit {shown:.2f} {self._shown_speed.unit}")


def draw(trace: Trace, units: str = "si") -> Figure:
    """The end of a trace."""
    check_length(trace)
    figure = new_figure(page_width(4.0), page_width(4.0) + (0.6 if titled() else 0.2))
    axes = figure.add_subplot()
    scene = Scene(axes, trace, units)
    part, words = shown_part(trace)
    scene.show(float(trace.time[-1]), float(trace.time[part][0]))
    say_over(axes, f"{words or 'path'}; collar and bit at the end")
    put_title(figure, title_of(trace, units, width=50))
    return figure


KINDS = (
    Kind(
        "hole",
        "the collar in the hole, to scale, with the path of its centre; --animate lets it whirl",
        of=TRACE,
        place=lambda data: 82.5 if isinstance(data, Trace) and has_orbit(data) else None,
        draw=draw,
    ),
)
