"""Rounding is not drawn as signal, orbits have their own size, and files of unlike
strings are told apart."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from made_up import make_results, make_trace

from nsdrill import plot
from nsdrill.analysis.comparison import other_string
from nsdrill.plot.look import look_of
from nsdrill.plot.page import freeze_layout, new_figure
from nsdrill.plot.style import house_style
from nsdrill.plot.traces import planes_of


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize(("middle", "swing", "opened"), [(-0.884, 1e-8, True), (0.0, 1e-15, True), (3.0, 1e-3, False)])
def test_the_last_digits_of_a_value_do_not_fill_a_panel(middle: float, swing: float, opened: bool) -> None:
    with house_style():
        figure = new_figure(3.0, 3.0)
        axes = figure.add_subplot()
        values = middle + swing * np.sin(np.arange(50.0))
        axes.plot(np.arange(50.0), values)
        freeze_layout(figure)
    low, high = axes.get_ylim()
    assert low < values.min() < values.max() < high
    assert (np.ptp(values) < 1e-3 * (high - low)) == opened
    assert max(len(label.get_text()) for label in axes.get_yticklabels()) <= 7


def test_a_plane_of_rounding_is_left_out() -> None:
    trace = make_trace()
    noise = 1e-15 * np.sin(np.arange(len(trace.time)))
    still = replace(trace, variables={**trace.variables, "z": -8.8e-4 + noise * 1e-3, "vz": noise})
    assert {"z", "vz"} & {name for pair in planes_of(trace) for name in pair}
    assert not {"z", "vz"} & {name for pair in planes_of(still) for name in pair}


@pytest.mark.parametrize(("part", "wall"), [(0.05, False), (0.9, True)])
def test_an_orbit_fills_its_panel_and_the_wall_is_there_where_it_is_near(part: float, wall: bool) -> None:
    trace = make_trace()
    gap, angle = float(trace.attrs["gap"]), 3.0 * trace.time
    x, y = part * gap * np.cos(angle), part * gap * np.sin(angle)
    trace = replace(trace, variables={**trace.variables, "x": x, "y": y, "wall_force": np.zeros(len(x))})
    (axes,) = plot.draw(trace, "orbit").axes
    half = axes.get_xlim()[1]
    assert 1e3 * part * gap < half < 1.5e3 * part * gap
    assert (half > 1e3 * gap) == wall
    assert ("wall at" in axes.get_title()) != wall


def test_a_turn_along_the_wall_is_no_polygon() -> None:
    trace = make_trace()
    gap, time = float(trace.attrs["gap"]), np.arange(0.0, 2.0, 0.02)
    angle = -30.0 * time
    made = {
        "x": gap * np.cos(angle),
        "y": gap * np.sin(angle),
        "vx": 30.0 * gap * np.sin(angle),
        "vy": -30.0 * gap * np.cos(angle),
        "wall_force": np.ones(len(time)),
    }
    variables = {name: values[: len(time)] for name, values in trace.variables.items()} | made
    (axes,) = plot.draw(replace(trace, time=time, variables=variables), "orbit").axes
    (line,) = [line for line in axes.lines if line.get_gid() == "orbit:wall"]
    chords = np.column_stack(
        [0.5 * (line.get_xdata()[1:] + line.get_xdata()[:-1]), 0.5 * (line.get_ydata()[1:] + line.get_ydata()[:-1])]
    )
    # between samples alone it would be cos(0.3) of it
    assert np.hypot(*chords.T).min() > 0.998e3 * gap


def test_without_a_title_there_is_no_strip_for_it() -> None:
    trace = make_trace()
    plain, bare = (plot.draw(trace, "orbit", look=look_of(title=title)) for title in (None, False))
    assert bare.get_figheight() < plain.get_figheight() - 0.25
    assert bare.axes[0].get_title() == ""
    assert plot.draw(trace, "orbit", look=look_of(title=False, height="5in")).get_figheight() == pytest.approx(5.0)


def test_strings_that_differ_are_told_by_their_keys() -> None:
    def study(**bit: float) -> str:
        return json.dumps({"title": "any", "bit": {"lobes": 3, **bit}, "simulation": {"rtol": bit.get("friction", 1)}})

    def sweep(text: str):
        results = make_results(rotary_speed=np.linspace(1, 8, 5))
        return replace(results, attrs={**results.attrs, "study_resolved": text})

    one = {"study_resolved": study(friction=0.3)}
    wob = float(sweep("{}").coords["wob"][0])
    assert other_string(one, sweep(study(friction=0.3)), {"wob": wob}) == []
    assert other_string(one, sweep(study(friction=0.4)), {"wob": wob}) == [("bit.friction", 0.3, 0.4)]
    assert other_string(one, sweep(study(friction=0.4)), {"wob": wob}, {"bit.friction"}) == []
    assert [key for key, *_ in other_string(one, sweep(study(friction=0.3)), {"wob": 2 * wob})] == ["operation.wob"]
