"""Lines of equal rate of penetration: where the rate has the value that stands beside
them."""

from __future__ import annotations

import numpy as np
import pytest
from made_up import make_results
from matplotlib.figure import Figure

from nsdrill import plot
from nsdrill.data import Results
from nsdrill.plot import isolines

SPEEDS, WEIGHTS = np.linspace(1.0, 6.0, 11), np.linspace(10e3, 60e3, 9)


@pytest.fixture
def results() -> Results:
    """The rate [m/h] is the speed times the weight in 10 kN."""
    made = make_results(wob=WEIGHTS, rotary_speed=SPEEDS, procedures=("up", "down"))
    made.variables["rate_of_penetration"] = np.broadcast_to(np.outer(WEIGHTS / 1e4, SPEEDS) / 3600.0, made.shape).copy()
    return made


def lines(figure):
    return [one for axes in figure.axes for one in axes.collections if one.get_gid() == "equal"]


@pytest.mark.parametrize(("kind", "panels"), [("map", 2), ("window", 1)])
def test_the_rate_is_equal_along_a_line(results, kind, panels):
    figure = plot.draw(results, kind)
    found = lines(figure)
    assert len(found) == panels
    for line in found:
        for level, path in zip(line.levels, line.get_paths(), strict=True):
            x, y = path.vertices.T  # rad/s, kN
            # straight between points of the map
            np.testing.assert_allclose(x * y / 10, level, rtol=0.02)
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "Rate of penetration [m/h]" in legend


def test_in_field_units_it_is_in_feet(results):
    figure = plot.draw(results, "window", units="field")
    [line] = lines(figure)
    x, y = line.get_paths()[0].vertices.T
    metres = (x * 2 * np.pi / 60) * (y * 4448.2216152605 / 1e4)
    np.testing.assert_allclose(metres / 0.3048, line.levels[0], rtol=0.02)


def test_points_that_were_not_run_are_passed_over(results):
    results.variables["rate_of_penetration"][:, :, 1::2, 1::2] = np.nan
    figure = plot.draw(results, "map")
    for line in lines(figure):
        for level, path in zip(line.levels, line.get_paths(), strict=True):
            x, y = path.vertices.T
            np.testing.assert_allclose(x * y / 10, level, rtol=0.05)


def test_no_lines_where_nothing_varies_or_none_is_known(results):
    for values in (np.full(results.shape, 1e-3), np.full(results.shape, np.nan), np.zeros(results.shape)):
        results.variables["rate_of_penetration"] = values
        assert not lines(plot.draw(results, "map"))


def test_no_label_covers_a_point_that_is_to_be_clear():
    x, y = SPEEDS, WEIGHTS / 1e3
    values = np.outer(WEIGHTS / 1e4, SPEEDS) / 3600.0

    def labels(clear):
        axes = Figure().add_subplot()
        axes.set(xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
        assert isolines.draw_lines(axes, x, y, values, "si", clear)
        return {text.get_text(): np.array(text.get_position()) for text in axes.texts}

    usual = labels(())
    extent = [np.ptp(x), np.ptp(y)]
    for text, place in usual.items():
        moved = labels([tuple(place)])
        assert moved.keys() == usual.keys()
        for other, where in moved.items():
            assert np.hypot(*((where - place) / extent)) > 0.1
            assert other == text or np.allclose(where, usual[other], atol=0.02 * np.array(extent))
