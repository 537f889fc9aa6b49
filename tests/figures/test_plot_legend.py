"""An entry of a legend stands for a mark that is seen within the limits of a panel."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_up import make_results, make_trace
from matplotlib.figure import Figure
from seen import legend_words

from nsdrill import figures
from nsdrill.figures.legend import seen_names
from nsdrill.figures.look import look_of
from nsdrill.figures.style import RESPONSES, lettered
from nsdrill.variables import DIVERGED

RESPONSE_NAMES = {style.name for style in (*RESPONSES, *lettered(RESPONSES))}
CARRIED = {"up: filled", "down: open", "up and down differ in response"}


def words(data: Any, kind: str | None = None, panel: str | None = None, **more: Any) -> set[str]:
    """Those of the legend; none where there is none."""
    limits = {name: more.pop(name) for name in ("xlim", "ylim") if name in more}
    return set(legend_words(figures.draw(data, kind, panel=panel, look=look_of(**limits), **more)))


def test_of_a_bifurcation_diagram(speeds):
    whole, strip, peaks = (words(speeds, panel=panel) for panel in (None, "strip", "radius"))
    assert CARRIED | {"rotary speed"} < whole
    assert any(word.startswith("failed") for word in whole)
    assert not strip & (CARRIED | {"rotary speed"})
    assert strip & RESPONSE_NAMES
    assert any(word.startswith("failed") for word in strip)
    assert peaks > CARRIED
    assert not any(word.startswith("failed") for word in peaks), "the crosses are in the strip"


def test_of_a_value_in_axes_of_a_user(speeds):
    """The responses are in the strip, which is not drawn there."""
    axes = Figure().subplots()
    figures.draw(speeds, "stick_slip_index", ax=axes)
    assert {text.get_text() for text in axes.get_legend().get_texts()} == {"carried up", "carried down"}
    assert words(speeds, "stick_slip_index") & RESPONSE_NAMES


def test_of_a_map():
    data = make_results(wob=np.linspace(1e4, 6e4, 6), rotary_speed=np.linspace(1, 8, 9), procedures=("up", "down"))
    data.variables["status"][0, 0, 0, 0] = DIVERGED  # at the least weight
    whole, up, compared = (words(data, "map", panel) for panel in (None, "up", "compared"))
    differ = {word for word in whole if word.startswith("up and down differ")}
    assert len(differ) == 1
    assert compared == differ
    of_up = {
        lettered(RESPONSES)[code].name for code in np.unique(data.variables["response"][0, 0].ravel()[1:]).tolist()
    }
    assert up == whole - differ - (RESPONSE_NAMES - of_up)
    assert "failed (1 of 108)" in up
    assert "failed (1 of 108)" not in words(data, "map", "up", ylim=("30 kN", "60 kN"))
    some = np.unique(data.variables["response"][0, 0, 3:]).tolist()  # within the limits
    assert words(data, "map", "up", ylim=("35 kN", "60 kN")) & RESPONSE_NAMES == {
        lettered(RESPONSES)[code].name for code in some
    }


@pytest.mark.parametrize(
    ("limits", "seen"),
    [
        ({}, {"stable", "unstable", "periodic motions", "fold", "wall of the hole"}),
        ({"ylim": ("0 mm", "40 mm")}, {"stable", "periodic motions", "fold"}),
        ({"ylim": ("32 mm", "40 mm")}, {"stable", "periodic motions"}),
        ({"xlim": ("6 rad/s", "8 rad/s")}, {"unstable", "periodic motions", "wall of the hole"}),
        ({"xlim": ("2 rad/s", "3 rad/s"), "ylim": ("70 mm", "80 mm")}, {"wall of the hole"}),
    ],
)
def test_of_branches_within_limits(branches, limits, seen):
    assert words(branches, panel="radius_max", **limits) == seen


def test_branches_have_no_marks_of_lines_in_the_strip(branches):
    assert words(branches, panel="strip") == set()


def test_a_sweep_without_peaks_below_branches_shows_its_greatest_values(branches):
    """``record.peaks: 0`` stores none."""
    sweep = make_results(rotary_speed=np.linspace(2, 8, 9))
    assert "all peaks of the sweep" in words(branches, over=sweep)
    kept = {name: values for name, values in sweep.variables.items() if not name.endswith("_peaks")}
    without = words(branches, over=replace(sweep, variables=kept))
    assert "greatest values of the sweep" in without
    assert "all peaks of the sweep" not in without


def test_of_a_ramp_that_only_rises():
    trace = make_trace()
    trace.variables["drive_speed"] = trace.time / 20.0
    assert words(trace, "ramp") & {"rising", "falling", "held"} == {"rising"}
    assert "rotary speed" not in words(trace, "ramp", "axial")


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_marks_within_the_limits_of_a_panel(scale):
    axes = Figure().subplots()
    axes.set(xscale=scale, yscale=scale, xlim=(1.0, 10.0), ylim=(1.0, 10.0))
    nan = np.nan
    lines = {
        "within": ([2.0, 3.0], [2.0, 3.0]),
        "across": ([0.5, 20.0], [0.5, 20.0]),
        "past a corner": ([0.1, 2.0], [9.0, 200.0]),
        "above": ([2.0, 3.0], [11.0, 12.0]),
        "interrupted": ([0.5, nan, 20.0], [0.5, nan, 20.0]),
        "point": ([2.0, nan], [2.0, nan]),
    }
    for name, points in lines.items():
        axes.plot(*points, gid=name, scalex=False, scaley=False)
    axes.plot([2.0, nan], [2.0, nan], "o", gid="marker")
    axes.plot([1.0], [10.0], "o", gid="at the corner")
    axes.plot([0.5, 20.0], [0.5, 20.0], "o", linestyle="none", gid="markers outside", scalex=False, scaley=False)
    axes.axhline(5.0, gid="height")
    axes.axhline(50.0, gid="height above")
    axes.axvspan(0.5, 20.0, gid="band around")
    axes.axvspan(12.0, 20.0, gid="band beside")
    axes.fill_between([2.0, 3.0], 0.5, 20.0, gid="area")
    axes.fill_between([2.0, 3.0], 12.0, 20.0, gid="area above")
    axes.set(xlim=(1.0, 10.0), ylim=(1.0, 10.0))
    assert seen_names([axes]) == {"within", "across", "marker", "at the corner", "height", "band around", "area"}
