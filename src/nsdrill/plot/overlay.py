"""Measurements on pictures of a sweep: values with their errors along an axis, settings
as crosses over two axes."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from nsdrill.analysis.fitting import Measured
from nsdrill.data import Array, Results
from nsdrill.errors import InputError
from nsdrill.plot.labels import quantity
from nsdrill.plot.style import BLACK, VERMILLION
from nsdrill.variables import dimension_of

SAME = 0.05  # part of a value of the sweep within which a setting is that value


def overlay(figure: Figure, results: Results, measured: Measured, units: str) -> int:
    """Put ``measured`` on the ``figure`` of ``results``, a picture over one axis or
    over two, and give how many points have their place in it. InputError where the
    picture has no place for any."""
    swept = results.swept
    at = {dimension_of(key): values for key, values in measured.at.items()}
    if lacking := [axis for axis in swept if axis not in at]:
        raise InputError(
            f"{measured.source}: found no {lacking[0]}, which the sweep varies; "
            f"allowed: a column of it."
        )
    here = _held(results, at, measured.points)
    found, named = 0, False
    if len(swept) == 1:
        x = at[swept[0]] / quantity(swept[0], units).scale
        for axes in figure.axes:
            for name in measured.values:
                if any(str(line.get_gid()).startswith(f"{name}:") for line in axes.lines):
                    put = _values(axes, x, measured, name, here, units)
                    named = named or (put > 0 and _named(axes, "D"))
                    found += put
    elif len(swept) == 2:
        for axes in figure.axes:
            if any(one.get_gid() == "cells" for one in axes.collections):
                found = _settings(axes, at, here, results, units)
                named = named or (found > 0 and _named(axes, "x"))
    if not found:
        raise InputError(
            f"{measured.source}: found no measurement that has a place in this picture; allowed: "
            f"one of its values "
            f"along one axis, or a map over two, at the other settings of the sweep (within "
            f"{100 * SAME:g} %)."
        )
    return found


def _named(axes: Axes, marker: str) -> bool:
    """Say in the axes what the marker is: the legend of the figure is there already."""
    handle = Line2D(
        [], [], color=VERMILLION, marker=marker, markersize=4, linestyle="none", label="measured"
    )
    axes.legend(
        handles=[handle], loc="upper right", fontsize=6, frameon=True, framealpha=0.9, borderpad=0.3
    )
    return True


def _held(results: Results, at: dict[str, Array], points: int) -> Array:
    """Which points have the values that the sweep does not vary, as far as they say."""
    same = np.ones(points, dtype=bool)
    for axis in results.axes:
        if axis not in results.swept and axis in at:
            value = float(results.coords[axis][0])
            same &= np.abs(at[axis] - value) <= SAME * abs(value)
    return same


def _values(axes: Axes, x: Array, measured: Measured, name: str, here: Array, units: str) -> int:
    scale = quantity(name, units).scale
    low, high = axes.get_xlim()
    shown = (
        here & np.isfinite(measured.values[name]) & (x >= min(low, high)) & (x <= max(low, high))
    )
    values, errors = measured.values[name][shown] / scale, measured.errors[name][shown] / scale
    if values.size:
        bottom, top = axes.get_ylim()
        axes.errorbar(
            x[shown],
            values,
            errors,
            linestyle="none",
            marker="D",
            markersize=4,
            color=VERMILLION,
            markeredgecolor=BLACK,
            markeredgewidth=0.5,
            capsize=2,
            elinewidth=0.9,
            zorder=6,
            gid=f"measured:{name}",
        )
        room = 0.03 * (top - bottom)
        axes.set_ylim(
            min(bottom, float(np.min(values - errors)) - room),
            max(top, float(np.max(values + errors)) + room),
        )
    return int(shown.sum())


def _settings(axes: Axes, at: dict[str, Array], here: Array, results: Results, units: str) -> int:
    """Crosses at the settings; which axis lies across follows from the labels."""
    across = next(axis for axis in results.swept if _lies_across(axes, axis, units))
    (up,) = (axis for axis in results.swept if axis != across)
    x, y = (at[axis] / quantity(axis, units).scale for axis in (across, up))
    (left, right), (bottom, top) = sorted(axes.get_xlim()), sorted(axes.get_ylim())
    shown = here & (x >= left) & (x <= right) & (y >= bottom) & (y <= top)
    for colour, wide in (("white", 3.0), (VERMILLION, 1.4)):
        axes.plot(
            x[shown],
            y[shown],
            linestyle="none",
            marker="x",
            markersize=6,
            color=colour,
            markeredgewidth=wide,
            zorder=4.5,
            clip_on=False,
            gid="measured" if colour == VERMILLION else "halo",
        )
    return int(shown.sum())


def _lies_across(axes: Axes, axis: str, units: str) -> bool:
    label = quantity(axis, units).label
    shared = axes.get_shared_x_axes().get_siblings(axes)
    return any(one.get_xlabel() == label for one in (axes, *shared))
