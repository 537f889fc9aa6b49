"""Pictures of a ramp: its schedule is shown, and its peaks stand at the value of their
moment."""

import json
from typing import Any

import numpy as np
import pytest
from made_up import make_results, make_trace
from seen import artists

from nsdrill import plot
from nsdrill.data import Trace
from nsdrill.errors import InputError
from nsdrill.plot.kinds.bifurcation import local_maxima


def ramped(name: str = "rotary_speed", values: tuple[float, ...] = (3.0, 8.0, 8.0, 3.0), trace: Trace | None = None):
    trace = trace or make_trace(duration=60.0)
    times = np.linspace(0.0, 60.0, len(values))
    variable = {"rotary_speed": "drive_speed"}.get(name, name)
    trace.variables[variable] = np.interp(trace.time, times, values)
    ramps = json.loads(trace.attrs.get("ramps", "{}"))
    trace.attrs |= {"ramps": json.dumps({**ramps, name: [times.tolist(), list(values)]})}
    return trace


def lines(figure, start: str) -> dict[str, Any]:
    return {line.get_gid(): line for line in artists(figure, start)}


def test_the_kind_is_offered_for_a_ramp_only():
    assert "ramp" not in plot.kinds_for(make_trace())
    assert plot.kinds_for(ramped())[0] == "trace"
    assert plot.kinds_for(ramped())[-1] == "ramp"
    with pytest.raises(InputError, match="it shows a run along a ramp"):
        plot.draw(make_trace(), "ramp")


@pytest.mark.parametrize("kind", ["trace", "histories"])
def test_the_schedule_has_panels_of_its_own(kind):
    trace = ramped("wob", (1e4, 6e4), ramped())
    figure = plot.draw(trace, kind)
    panels = figure.subfigs[0].axes if kind == "trace" else figure.axes
    assert [axes.get_ylabel() for axes in panels][6:] == ["Drive speed [rad/s]", "Weight on bit [kN]"]
    assert "5000 m, 10 to 60 kN, 3 to 8 to 3 rad/s" in figure.get_suptitle()


def test_peaks_stand_at_the_speed_of_their_moment():
    trace = ramped()
    figure = plot.draw(trace, "ramp")
    assert figure.axes[-1].get_xlabel() == "Rotary speed [rad/s]"
    assert "15 rad/s per min" in figure.get_suptitle()
    times, heights = local_maxima(trace.time, trace["z"])
    drawn = lines(figure, "z:")
    assert set(drawn) == {"z:rising", "z:falling", "z:held"}
    assert sum(len(line.get_xdata()) for line in drawn.values()) == len(times)
    rising = drawn["z:rising"]
    early = times < 19.9
    assert rising.get_xdata()[: early.sum()] == pytest.approx(3.0 + times[early] / 4.0, abs=1e-9)
    assert rising.get_ydata()[: early.sum()] == pytest.approx(heights[early] * 1e3)


def test_a_ramp_of_depth_and_field_units():
    figure = plot.draw(ramped("depth", (5000.0, 5100.0)), "ramp", units="field")
    assert figure.axes[-1].get_xlabel() == "Measured depth [ft]"
    assert "16404 to 16732 ft" in figure.get_suptitle()


def test_local_maxima_are_those_of_the_motion():
    """Of a cosine with 100 samples a turn: the parabola's vertex is right to the fourth
    order of the step, 1e-6."""
    time = np.arange(0.0, 10.0, 0.01)
    at, height = local_maxima(time, 3.0 * np.cos(2 * np.pi * (time - 0.3371)))
    assert at == pytest.approx(0.3371 + np.arange(10), abs=1e-4)
    assert height == pytest.approx(3.0, abs=3e-6)


def test_a_sweep_lies_behind():
    sweep = make_results(rotary_speed=np.linspace(1, 10, 19), wob=(22240.0, 66720.0), procedures=("up", "down"))
    figure = plot.draw(ramped(), over=sweep)
    behind = lines(figure, "sweep:")
    assert set(behind) == {
        f"sweep:{way}:{peaks}" for way in ("up", "down") for peaks in ("axial_peaks", "bit_speed_peaks", "radius_peaks")
    }
    line = behind["sweep:up:bit_speed_peaks"]
    # that of 66.72 kN, as the trace, and no further than the ramp goes
    peaks = sweep["bit_speed_peaks"][0, 0, 1]
    inside = (sweep.coords["rotary_speed"] >= 3) & (sweep.coords["rotary_speed"] <= 8)
    assert sorted(line.get_ydata()) == pytest.approx(sorted(peaks[inside][np.isfinite(peaks[inside])]))
    assert line.get_zorder() < min(one.get_zorder() for one in lines(figure, "bit_speed:").values())


def test_a_sweep_that_does_not_fit_is_refused():
    with pytest.raises(InputError, match=r"found a sweep of depth; allowed: a sweep of rotary_speed"):
        plot.draw(ramped(), over=make_results(depth=(1000.0, 2000.0)))
    with pytest.raises(InputError, match=r"found a sweep at 22\.24 kN; allowed: one at 66\.72 kN"):
        plot.draw(ramped(), over=make_results(rotary_speed=(1.0, 5.0)))
    with pytest.raises(InputError, match="over: found with kind='bifurcation'; allowed: with kind='branches, ramp'"):
        plot.draw(make_results(), over=make_results())
