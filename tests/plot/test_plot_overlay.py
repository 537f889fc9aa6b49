"""Measurements on pictures: at their settings, in the units shown, and only on pictures
of the same settings."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import make_results
from seen import artists

from nsdrill import plot
from nsdrill.analysis.fitting import Measured
from nsdrill.errors import InputError
from nsdrill.plot.measured import overlay

SPEEDS, WEIGHTS = np.linspace(1.0, 6.0, 11), np.linspace(10e3, 60e3, 9)


def measured(**more):
    values = {"stick_slip_index": np.array([50.0, 80.0, 20.0]), "surface_torque_max": np.array([1e3, np.nan, 3e3])}
    errors = {name: 0.1 * one for name, one in values.items()}
    at = {"rotary_speed": np.array([2.0, 4.0, 5.0]), "wob": np.array([22e3, 22.5e3, 40e3])}
    return Measured("field.csv", at | more, values, errors, ("line 2", "line 3", "line 4"))


def test_values_lie_along_the_axis():
    results = make_results(rotary_speed=SPEEDS)
    figure = plot.draw(results, "stick_slip_index", units="field")
    assert overlay(figure, results, measured(), "field") == 2  # the third is at another weight
    [marks] = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "D"]
    np.testing.assert_allclose(marks.get_xdata(), np.array([2.0, 4.0]) * 30 / np.pi)
    assert marks.get_ydata().tolist() == [50.0, 80.0]
    figure = plot.draw(results, "surface_torque_max")
    assert overlay(figure, results, measured(), "si") == 1
    [marks] = [line for axes in figure.axes for line in axes.lines if line.get_marker() == "D"]
    assert marks.get_ydata().tolist() == [1.0]  # kN m


def test_settings_are_crosses_on_a_map():
    results = make_results(rotary_speed=SPEEDS, wob=WEIGHTS, procedures=("up", "down"))
    for kind, panels in (("map", 3), ("window", 1)):
        figure = plot.draw(results, kind)
        assert overlay(figure, results, measured(), "si") == 3
        marks = artists(figure, "measured")
        assert 1 <= len(marks) <= panels
        np.testing.assert_allclose(marks[0].get_data(), [[2.0, 4.0, 5.0], [22.0, 22.5, 40.0]])


def test_what_has_no_place_is_told():
    along, plane = make_results(rotary_speed=SPEEDS), make_results(rotary_speed=SPEEDS, wob=WEIGHTS)
    far = measured(depth=np.full(3, 100.0))
    for results, kind, one, said in (
        (along, "stick_slip_index", far, "no measurement that has a place"),
        (along, "radius_max", measured(), "no measurement that has a place"),
        (plane, "map", far, "no measurement that has a place"),
        (make_results(depth=[1e3, 2e3, 3e3]), "stick_slip_index", measured(), "found no depth, which the sweep varies"),
    ):
        with pytest.raises(InputError, match=said):
            overlay(plot.draw(results, kind), results, one, "si")
