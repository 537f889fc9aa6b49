"""Pictures of one trajectory: nothing of it is lost by drawing fewer samples; a ramp shows
its schedule."""

import json
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from made_up import GAP, make_results, make_trace
from matplotlib.patches import Circle
from seen import artists, legend_words

from nsdrill import figures
from nsdrill.data import Trace
from nsdrill.errors import InputError
from nsdrill.figures.kinds.bifurcation import local_maxima
from nsdrill.figures.traces import PARTS, binned_statistics, count_upcrossings, envelope


def line(figure, gid: str):
    return artists(figure, gid)[0]


def axes_of(trace: Trace, kind: str):
    figure = figures.draw(trace, kind)
    return [axes for sub in (figure.subfigs or [figure]) for axes in sub.axes]


def test_the_page_holds_everything(trace):
    labels = [(axes.get_xlabel(), axes.get_ylabel()) for axes in axes_of(trace, "trace")]
    assert [y for _, y in labels[:6]] == [
        "$z$ [mm]",
        "Bit speed [rad/s]",
        "$r$ [mm]",
        "Bit force [kN]",
        "Bit torque [kN m]",
        "Wall force [kN]",
    ]
    assert labels[5][0] == "Time [s]"
    assert labels[6:] == [
        ("$x$ [mm]", "$y$ [mm]"),
        ("$z$ [mm]", "$\\dot z$ [m/s]"),
        ("Twist [rad]", "Bit speed [rad/s]"),
        ("$r$ [mm]", "$\\dot r$ [m/s]"),
    ]


def test_title_tells_the_operating_point(trace):
    lines = figures.draw(trace, "phase").get_suptitle().splitlines()
    assert lines == ["Speed sweep, state carried", "5000 m, 66.72 kN, 3 rad/s, carried down"]
    assert "16404 ft, 15 klbf, 28.65 rpm" in figures.draw(trace, "phase", units="field").get_suptitle()


SCALES = {"z": 1e-3, "bit_speed": 1.0, "radius": 1e-3, "wall_force": 1e3}


@pytest.mark.parametrize("name", SCALES)
def test_histories_keep_every_extreme(name):
    trace = make_trace(duration=60.0, sample=0.001)
    drawn = line(figures.draw(trace, "histories"), f"history:{name}")
    assert len(drawn.get_xdata()) < len(trace.time) / 10
    assert np.max(drawn.get_ydata()) * SCALES[name] == pytest.approx(trace[name].max(), rel=1e-12)
    assert np.min(drawn.get_ydata()) * SCALES[name] == pytest.approx(trace[name].min(), rel=1e-12)


@pytest.mark.usefixtures("laid_out")
@pytest.mark.parametrize(("name", "width"), [("z", 7.0), ("z", 3.3), ("wall_force", 3.3)])
def test_a_long_trace_is_a_band_that_holds_every_sample(name, width):
    trace = make_trace(duration=600.0, sample=0.01)
    figure = figures.draw(trace, "histories", look=figures.look_of(width=f"{width}in", time=(0, None), title=False))
    (band,) = artists(figure, f"band:{name}")
    values = trace[name] / SCALES[name]
    corners = band.get_paths()[0].vertices
    assert corners[:, 1].max() == pytest.approx(values.max(), rel=1e-12)
    assert corners[:, 1].min() == pytest.approx(values.min(), rel=1e-12)
    assert corners[:, 0].min() == trace.time[0]
    assert corners[:, 0].max() == trace.time[-1]
    mean = line(figure, f"mean:{name}")
    stretches = len(mean.get_xdata())
    assert stretches < 100 * width
    inner = slice(len(values) // stretches * 2, -len(values) // stretches * 2)
    assert np.mean(mean.get_ydata()[2:-2]) == pytest.approx(values[inner].mean(), rel=0.02)
    # a note that is no title
    said = legend_words(figure)
    assert said == [f"least to greatest in each {3 * 600 / stretches:.2g} s", "running mean"]
    figure.draw_without_rendering()
    for axes in figure.axes:  # the words stay on the page
        assert axes.get_tightbbox().x1 <= figure.bbox.width + 1


def test_edges_of_a_band_and_its_mean_are_smooth():
    """Of an oscillation of which two and a half periods fall in a bin the edges are its
    amplitude, and the mean is zero to 4 %; of single bins it beats by 13 % (the integral
    of half a period, 1 / pi, over the phase of two and a half)."""
    time = np.arange(0.0, 250.0, 0.01)
    _, least, greatest, mean = binned_statistics(time, np.sin(2 * np.pi * time), 100)
    assert least == pytest.approx(-1.0, abs=1e-3)
    assert greatest == pytest.approx(1.0, abs=1e-3)
    assert np.abs(mean[1:-1]).max() < 0.04
    steps = np.where(np.arange(25_000) < 12_500, 1.0, 3.0)
    _, _, above, _ = binned_statistics(time, steps, 100)
    assert (above >= steps.reshape(100, -1).max(axis=1)).all()
    assert np.diff(above).max() <= 1.0  # a jump of two takes more than a bin
    steps[:1000] = np.nan
    assert np.isnan(binned_statistics(time, steps, 100)[1]).tolist() == [True] * 4 + [False] * 96


def test_a_history_is_a_band_only_where_its_own_lines_merge():
    """Seventeen periods of one are lines beside the rattle of another."""
    trace = make_trace(duration=20.0, sample=0.002)
    trace.variables["z"] = 1e-3 * np.sin(2 * np.pi * 17 / 20 * trace.time)
    trace.variables["wall_force"] = 1e4 * (1 + np.sin(2 * np.pi * 10 * trace.time))
    look = figures.look_of(width="3.3in", time=(0, None), title=False)
    figure = figures.draw(trace, "histories", look=look)
    assert len(line(figure, "history:z").get_xdata()) > 1000
    assert artists(figure, "band:") == artists(figure, "band:wall_force")
    assert len(legend_words(figure)) == 2
    for panel, words in (("z", 0), ("wall_force", 2)):
        alone = figures.draw(trace, panel=panel, look=look)
        assert len(legend_words(alone)) == words
        assert bool(alone.legends) == bool(words)


def test_a_long_run_shows_its_last_seconds():
    """Lines that can be read in place of solid bands; a part that the user chooses, a
    ramp and a drive that is switched on are drawn as they are."""
    long = make_trace(duration=600.0, sample=0.01)
    for kind in ("trace", "histories"):
        figure = figures.draw(long, kind)
        times = line(figure, "history:z").get_xdata()
        assert times[-1] == long.time[-1]
        assert times[-1] - times[0] == pytest.approx(20.0)
        assert not artists(figure, "band:")
        assert figure.axes[0].get_title(loc="left").startswith("last 20 s of 600")
    whole = figures.draw(long, "histories", look=figures.look_of(time=("0 s", None)))
    assert line(whole, "mean:z").get_xdata()[0] == 0.0
    long.attrs["study_resolved"] = '{"drive": {"kind": "lqr", "on_at": 40.0}}'
    assert line(figures.draw(long, "histories"), "mean:z").get_xdata()[0] == 0.0
    short = make_trace(duration=60.0)
    assert line(figures.draw(short, "histories"), "history:z").get_xdata()[0] == 0.0


def test_a_narrow_picture_shows_as_many_seconds_as_its_lines_leave_white():
    trace = make_trace(duration=200.0, sample=0.002)
    trace.variables["wall_force"] = 1e4 * (1 + np.sin(2 * np.pi * 8 * trace.time))
    figure = figures.draw(trace, "histories", look=figures.look_of(width="3.3in"))
    assert figure.axes[0].get_title(loc="left") == "last 10 s of 200 s"
    assert not artists(figure, "band:")


@pytest.mark.usefixtures("laid_out")
def test_one_column_fits_a_page(trace):
    """A page of a journal is 9 in high. No label reaches into that of its neighbour."""
    figure = figures.draw(trace, look=figures.look_of(width="3.3in"))
    assert figure.get_figheight() < 9.0
    labels = [axes.yaxis.label.get_window_extent() for axes in figure.subfigs[0].axes]
    assert all(below.y1 <= above.y0 for above, below in pairwise(labels))
    sizes = [axes.get_position().bounds[2:] * figure.get_size_inches() for axes in figure.subfigs[0].axes]
    assert min(height for _, height in sizes) > 0.5


def test_without_a_title_the_legend_says_what_the_marks_of_an_orbit_are(trace):
    bare = figures.look_of(title=False)
    for figure in (
        figures.draw(trace, look=bare),
        figures.draw(trace, "orbit", look=bare),
        figures.draw(trace, panel="orbit"),
    ):
        assert legend_words(figure) == ["collar on the wall", "end of the orbit"]
    assert legend_words(figures.draw(trace, panel="phase_z")) == []
    trace.variables["radius"] = 0.1 * trace.variables["radius"]
    note = figures.draw(trace, "histories", look=bare).axes[0].get_title(loc="left")
    assert note == f"wall at {GAP * 1e3:g} mm"


def test_a_wall_out_of_reach_takes_no_room(trace):
    trace.variables["radius"] = 0.1 * trace.variables["radius"]
    figure = figures.draw(trace, "histories")
    radius = next(axes for axes in figure.axes if axes.get_label() == "radius")
    assert radius.get_ylim()[1] < 0.2 * GAP * 1e3
    assert f"wall at {GAP * 1e3:g} mm" in figure.axes[0].get_title(loc="left")


def test_slow_motion_stays_a_line_however_long_it_takes():
    time = np.linspace(0.0, 600.0, 60_001)
    rippled = np.sin(2 * np.pi * time / 20.0) + 0.01 * np.sin(2 * np.pi * 5 * time)
    assert count_upcrossings(rippled) < 60  # of 3000 ripples
    # nor is the level
    assert count_upcrossings(np.sin(2 * np.pi * 2 * time) + 0.03 * time) == pytest.approx(1200, abs=PARTS)
    assert count_upcrossings(np.full(1000, np.nan)) == count_upcrossings(np.zeros(5000)) == 0


def test_reference_lines(trace):
    figure = figures.draw(trace, "histories")
    assert line(figure, "rotary speed").get_ydata()[0] == 3.0
    assert line(figure, "wall").get_ydata()[0] == pytest.approx(GAP * 1e3)


def test_orbit_in_the_hole(trace):
    figure = figures.draw(trace, "orbit")
    [axes] = figure.axes
    [wall] = [patch for patch in axes.patches if isinstance(patch, Circle)]
    assert wall.get_radius() == pytest.approx(GAP * 1e3)
    assert axes.get_aspect() == 1.0
    on_wall = line(figure, "orbit:wall").get_ydata()
    shown = trace["wall_force"][-len(on_wall) :] > 0
    np.testing.assert_array_equal(np.isfinite(on_wall), shown)


def test_the_part_that_is_shown_is_said(trace):
    # 20 turns at 3 rad/s take 41.9 s
    assert figures.draw(trace, "phase").axes[0].get_title() == "last 41.9 s"
    short = make_trace(duration=20.0)
    figure = figures.draw(short, "phase")
    assert figure.axes[0].get_title() == ""
    assert len(line(figure, "phase:twist").get_xdata()) == len(short.time)


@pytest.mark.usefixtures("laid_out")
def test_a_trace_without_attributes_is_drawn(trace):
    trace.attrs.clear()
    for kind in ("trace", "phase"):
        figures.draw(trace, kind)


@pytest.mark.usefixtures("laid_out")
def test_a_trace_that_ends_in_nan_is_drawn(trace):
    for values in trace.variables.values():
        values[len(trace.time) // 3 :] = np.nan
    for kind in ("histories", "orbit"):
        figures.draw(trace, kind)


def test_one_sample_is_no_line(trace):
    short = Trace(trace.time[:1], {name: values[:1] for name, values in trace.variables.items()})
    with pytest.raises(InputError, match="two or more"):
        figures.draw(short)


def test_a_million_samples_are_thinned():
    figure = figures.draw(make_trace(duration=1000.0, sample=0.001))
    drawn = [one for sub in figure.subfigs for axes in sub.axes for one in axes.get_lines()]
    assert sum(len(one.get_xdata()) for one in drawn) < 400_000


def test_envelope():
    t = np.arange(10.0)
    # short enough already
    assert envelope(t, t, 5) == (t, t) or np.array_equal(envelope(t, t, 5)[1], t)
    kept_t, kept = envelope(t, np.array([0, 9, 1, 2, 3, 3, -5, 4, 4, 4.0]), 2)
    assert list(kept_t) == [0, 1, 6, 7]
    assert list(kept) == [0, 9, -5, 4]
    assert np.isnan(envelope(t, np.full(10, np.nan), 2)[1]).all()


def test_what_stays_at_one_value_is_told_not_drawn():
    trace = make_trace(duration=20.0)
    steady = {**trace.variables, "wall_force": np.zeros(len(trace.time)), "z": np.full(len(trace.time), 2e-3)}
    steady["vz"] = np.zeros(len(trace.time))
    resting = Trace(trace.time, steady, trace.attrs)
    figure = figures.draw(resting, "histories")
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "Bit speed [rad/s]",
        "$r$ [mm]",
        "Bit force [kN]",
        "Bit torque [kN m]",
    ]
    assert figure.axes[0].get_title(loc="left") == "constant: $z$ 2 mm, wall force 0 kN"
    assert [axes.get_xlabel() for axes in figures.draw(resting, "phase").axes] == ["Twist [rad]", "$r$ [mm]"]
    still = Trace(trace.time, {name: np.ones(len(trace.time)) for name in steady}, trace.attrs)
    assert len(figures.draw(still, "histories").axes) == 6  # of a string at rest all is to be seen
    assert len(figures.draw(still, "phase").axes) == 3


def test_the_force_that_holds_a_collar_before_its_release_is_cut(trace):
    """The axis fits the blows that follow, and the title says what it leaves out."""
    force = np.linspace(0.0, 2e5, len(trace.time)) % 1e5
    force[:3] = 1e6, 5e5, 0.0
    trace.variables["wall_force"] = force
    figure = figures.draw(trace, "histories")
    (axes,) = (axes for axes in figure.axes if axes.get_label() == "wall_force")
    assert force[3:].max() < 1e3 * axes.get_ylim()[1] < 1.1e5
    assert "wall force begins at 1000 kN, cut" in figure.axes[0].get_title(loc="left").replace("\n", " ")


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
    assert "ramp" not in figures.kinds_for(make_trace())
    assert figures.kinds_for(ramped())[0] == "trace"
    assert figures.kinds_for(ramped())[-1] == "ramp"
    with pytest.raises(InputError, match="it shows a run along a ramp"):
        figures.draw(make_trace(), "ramp")


@pytest.mark.parametrize("kind", ["trace", "histories"])
def test_the_schedule_has_panels_of_its_own(kind):
    trace = ramped("wob", (1e4, 6e4), ramped())
    figure = figures.draw(trace, kind)
    panels = figure.subfigs[0].axes if kind == "trace" else figure.axes
    assert [axes.get_ylabel() for axes in panels][6:] == ["Drive speed [rad/s]", "Weight on bit [kN]"]
    assert "5000 m, 10 to 60 kN, 3 to 8 to 3 rad/s" in figure.get_suptitle()


def test_peaks_stand_at_the_speed_of_their_moment():
    trace = ramped()
    figure = figures.draw(trace, "ramp")
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
    figure = figures.draw(ramped("depth", (5000.0, 5100.0)), "ramp", units="field")
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
    figure = figures.draw(ramped(), over=sweep)
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
        figures.draw(ramped(), over=make_results(depth=(1000.0, 2000.0)))
    with pytest.raises(InputError, match=r"found a sweep at 22\.24 kN; allowed: one at 66\.72 kN"):
        figures.draw(ramped(), over=make_results(rotary_speed=(1.0, 5.0)))
    with pytest.raises(InputError, match="over: found with kind='bifurcation'; allowed: with kind='branches, ramp'"):
        figures.draw(make_results(), over=make_results())
