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
    at_held_values = _at_held_values(results, at, measured.points)
    drawn_points, has_legend = 0, False
    if len(swept) == 1:
        x = at[swept[0]] / quantity(swept[0], units).scale
        for axes in figure.axes:
            for name in measured.values:
                if any(str(line.get_gid()).startswith(f"{name}:") for line in axes.lines):
                    drawn = _draw_values(axes, x, measured, name, at_held_values, units)
                    has_legend = has_legend or (drawn > 0 and _add_legend(axes, "D"))
                    drawn_points += drawn
    elif len(swept) == 2:
        for axes in figure.axes:
            if any(collection.get_gid() == "cells" for collection in axes.collections):
                drawn_points = _draw_settings(axes, at, at_held_values, results, units)
                has_legend = has_legend or (drawn_points > 0 and _add_legend(axes, "x"))
    if not drawn_points:
        raise InputError(
            f"{measured.source}: found no measurement that has a place in this picture; allowed: "
            f"one of its values "
            f"along one axis, or a map over two, at the other settings of the sweep (within "
            f"{100 * SETTING_TOLERANCE:g} %)."
        )
    return drawn_points


def _add_legend(axes: Axes, marker: str) -> bool:
    """Explain the marker in a legend of the axes, as the figure has one already."""
    handle = Line2D([], [], color=VERMILLION, marker=marker, markersize=4, linestyle="none", label="measured")
    axes.legend(handles=[handle], loc="upper right", fontsize=6, frameon=True, framealpha=0.9, borderpad=0.3)
    return True


def _at_held_values(results: Results, at: dict[str, Array], points: int) -> Array:
    """Which points [point] agree with the values that the sweep holds fixed, where they
    have these values."""
    same = np.ones(points, dtype=bool)
    for axis in results.axes:
        if axis not in results.swept and axis in at:
            value = float(results.coords[axis][0])
            same &= np.abs(at[axis] - value) <= SETTING_TOLERANCE * abs(value)
    return same


def _draw_values(axes: Axes, x: Array, measured: Measured, name: str, at_held_values: Array, units: str) -> int:
    scale = quantity(name, units).scale
    low, high = axes.get_xlim()
    shown = at_held_values & np.isfinite(measured.values[name]) & (x >= min(low, high)) & (x <= max(low, high))
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
        margin = 0.03 * (top - bottom)
        axes.set_ylim(
            min(bottom, float(np.min(values - errors)) - margin), max(top, float(np.max(values + errors)) + margin)
        )
    return int(shown.sum())


def _draw_settings(axes: Axes, at: dict[str, Array], at_held_values: Array, results: Results, units: str) -> int:
    """Draw crosses at the settings. The labels of the axes show which axis of the sweep
    lies along x."""
    across = next(axis for axis in results.swept if _lies_across(axes, axis, units))
    (up,) = (axis for axis in results.swept if axis != across)
    x, y = (at[axis] / quantity(axis, units).scale for axis in (across, up))
    (left, right), (bottom, top) = sorted(axes.get_xlim()), sorted(axes.get_ylim())
    shown = at_held_values & (x >= left) & (x <= right) & (y >= bottom) & (y <= top)
    for colour, width in (("white", 3.0), (VERMILLION, 1.4)):
        axes.plot(
            x[shown],
            y[shown],
            linestyle="none",
            marker="x",
            markersize=6,
            color=colour,
            markeredgewidth=width,
            zorder=4.5,
            clip_on=False,
            gid="measured" if colour == VERMILLION else "halo",
        )
    return int(shown.sum())


def _lies_across(axes: Axes, axis: str, units: str) -> bool:
    label = quantity(axis, units).label
    shared = axes.get_shared_x_axes().get_siblings(axes)
    return any(other.get_xlabel() == label for other in (axes, *shared))
