"""What the charts of a study have in common. Charts are computed without a run."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from nsdrill.models.numbers import BucklingLoads, CriticalSpeeds, DriveCard, DriveTuning
from nsdrill.plot.labels import Shown, heading, operating_point, quantity
from nsdrill.plot.legend import legend_below
from nsdrill.plot.registry import STUDY, Kind
from nsdrill.plot.style import REFERENCE, font_size, new_figure, page_width, put_title, target
from nsdrill.quantity import SHOWN, SYSTEMS, shown_scale, sign

Numbers = CriticalSpeeds | BucklingLoads | DriveCard | DriveTuning

SLOPE_UNIT = "N m s/rad"
TO_HERTZ = 1.0 / (2.0 * math.pi)
LONG_SPAN = 10.0  # m: from here on lengths are shown in m or ft
OPERATING_COLOUR = "#E4E4E4"  # the rotary speeds of the study


@dataclass(frozen=True)
class Chart:
    """The numbers of a chart and the contents of its title: ``attrs`` are the title and
    the study, ``point`` the operating values that the chart holds fixed; ``speeds`` are
    the least and the greatest rotary speed [rad/s] of the study."""

    numbers: Numbers
    attrs: Mapping[str, Any]
    point: Mapping[str, float]
    speeds: tuple[float, float]


def chart_kind(
    name: str, words: str, numbers: type, panel: Callable[[Figure, Axes, Chart, str], list[Artist]]
) -> Kind:
    """The kind of chart that shows ``numbers``; ``panel`` draws them and returns the
    entries of the legend."""

    def draw(chart: Chart, units: str = "si") -> Figure:
        figure = new_figure(page_width(), 4.4)
        axes = figure.add_subplot(figure.add_gridspec(1, 1)[0, 0])
        handles = panel(figure, axes, chart, units)
        put_title(figure, heading(chart.attrs, operating_point(chart.point, units)))
        legend_below(figure, handles, 3)
        return figure

    def place(data: Any) -> float | None:
        return 90 if isinstance(data, Chart) and isinstance(data.numbers, numbers) else None

    return Kind(name, words, of=STUDY, place=place, draw=draw)


def shown_quantity(words: str, unit_name: str, system: str) -> Shown:
    """How a quantity that is not a variable is shown: ``unit_name`` is its unit in the
    tables of :mod:`nsdrill.quantity`, ``system`` the system of units."""
    shown_unit = SHOWN[unit_name][SYSTEMS.index(system)]
    return Shown(words, sign(shown_unit), shown_scale(shown_unit, unit_name))


def set_log_ticks(axis: Any, subs: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    axis.set_major_locator(LogLocator(subs=subs))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def axis_quantity(axis: str, x: np.ndarray, system: str) -> Shown:
    """How the axis of a chart is shown: long spans in m or ft instead of mm or in."""
    if axis == "inclination":
        return Shown("Inclination of the hole", "°", math.pi / 180)
    shown = quantity(axis, system)
    if shown.unit not in SHOWN["m"] or np.max(x) < LONG_SPAN:
        return shown
    unit = "m" if system == "si" else "ft"
    return Shown(shown.words, unit, shown_scale(unit, "m"))


def write_note(axes: Axes, text: str) -> None:
    """Write a note above the panel. Axes of the caller keep their own title there."""
    if target.get() is not None:
        return
    axes.set_title(text, fontsize=font_size(7), loc="left", color=REFERENCE)
