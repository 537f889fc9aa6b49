"""Sections, kinds of motion, and the special points of branches."""

import numpy as np
import pytest
from made_up import make_results
from matplotlib.colors import to_hex
from model_tables import SECTION, VARIABLES
from seen import artists, legend_words
from xarray import Dataset

from nsdrill import figures
from nsdrill.analysis.bifurcations import DOUBLING, FOLD, TORUS
from nsdrill.data import Results, Trace
from nsdrill.errors import InputError
from nsdrill.figures.kinds.returns import section_of
from nsdrill.figures.look import look_of
from nsdrill.figures.style import MOTIONS
from nsdrill.variables import CHAOTIC, PERIODIC

RETURNS = 12
SPEEDS = np.linspace(2.0, 8.0, 7)


@pytest.fixture
def sweep():
    """Periodic up to 5 rad/s, with period two; chaotic above; on the way down chaotic
    throughout."""
    results = make_results(rotary_speed=SPEEDS, procedures=("up", "down"))
    shape = results["status"].shape
    for variable in (v for v in VARIABLES if v.only in ("returns", "exponent")):
        extra = (RETURNS,) if variable.name in SECTION else ()
        results.variables[variable.name] = np.zeros((*shape, *extra), variable.dtype)
    results.coords["crossing"] = np.arange(RETURNS)
    periodic = np.zeros(shape, dtype=bool)
    periodic[0, ..., SPEEDS <= 5.0] = True
    results["motion"][...] = np.where(periodic, PERIODIC, CHAOTIC)
    results["period"][...] = np.where(periodic, 2, 0)
    scatter = np.random.default_rng(0).uniform(0.0, 0.05, (*shape, RETURNS))
    two = np.where(np.arange(RETURNS) % 2 == 0, 0.01, 0.02)
    results["section_radius"][...] = np.where(periodic[..., None], two, scatter)
    results["lyapunov_exponent"][...] = np.where(periodic, -0.1, 0.5)
    results["lyapunov_error"][...] = 0.05
    return results


def test_every_return_is_drawn_in_the_colour_of_its_motion(sweep):
    figure = figures.draw(sweep, "poincare")
    lines = {line.get_gid(): line for axes in figure.axes for line in axes.get_lines() if line.get_gid()}
    up = lines[f"section_radius:up:{PERIODIC}"]
    assert to_hex(up.get_color()) == MOTIONS[PERIODIC].colour.lower()
    assert sorted(set(np.round(up.get_ydata(), 6))) == [10.0, 20.0], "in mm"
    assert sorted(set(up.get_xdata())) == [2.0, 3.0, 4.0, 5.0]
    drawn = sum(
        len(lines[f"section_radius:{way}:{kind}"].get_xdata())
        for way, kind in (("up", PERIODIC), ("up", CHAOTIC), ("down", CHAOTIC))
    )
    assert drawn == 2 * len(SPEEDS) * RETURNS
    words = legend_words(figure)
    assert "periodic" in words
    assert "chaotic" in words
    assert "quasi-periodic" not in words


def test_motion_is_drawn_with_exponent_and_period(sweep):
    figure = figures.draw(sweep, "motion")
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert [word in " ".join(labels) for word in ("Lyapunov", "0-1 test", "Period")] == [True] * 3
    for name in ("lyapunov_exponent", "lyapunov_error"):
        del sweep.variables[name]
    assert "Lyapunov" not in " ".join(axes.get_ylabel() for axes in figures.draw(sweep, "motion").axes)


def test_the_section_of_one_point_needs_one_point(sweep):
    with pytest.raises(InputError, match="select a value of every axis"):
        figures.draw(sweep, "section")
    figure = figures.draw(sweep, "section", at={"rotary_speed": 3.0})
    text = " ".join(sub.get_suptitle() for sub in figure.subfigs)
    assert "carried up: periodic, period 2, 12 returns" in text
    assert "carried down: chaotic, 12 returns" in text


def test_what_was_not_recorded_is_not_offered():
    plain = make_results(rotary_speed=SPEEDS)
    assert not {"poincare", "motion", "section"} & set(figures.kinds_for(plain))
    with pytest.raises(InputError, match=r"record\.poincare"):
        figures.draw(plain, "poincare")


def test_the_section_of_a_trace_is_found_between_samples():
    """A motion known in closed form, sampled every 0.05 s: the cubic is good to the
    fourth power of that."""
    time = np.arange(0.0, 60.0, 0.05)
    speed, swing = 3.0, 0.4
    twist, rate = 0.5 * np.sin(swing * time), 0.5 * swing * np.cos(swing * time)
    values = {
        "x": 0.03 * np.cos(2.0 * time),
        "vx": -0.06 * np.sin(2.0 * time),
        "y": 0.03 * np.sin(2.0 * time),
        "vy": 0.06 * np.cos(2.0 * time),
        "z": np.sin(time),
        "vz": np.cos(time),
        "twist": twist,
        "bit_speed": speed + rate,
        "drive_angle": speed * time,
    }
    trace = Trace(time, values, {"rotary_speed": speed})
    found = section_of(trace)
    assert len(found["section_radius"]) == int((speed * time[-1] + twist[-1]) // (2 * np.pi))
    assert found["section_radius"] == pytest.approx(np.full(len(found["section_radius"]), 0.03), rel=1e-5)
    moments = (np.arange(1, len(found["section_twist"]) + 1) * 2 * np.pi - found["section_twist"]) / speed
    assert found["section_axial"] == pytest.approx(np.sin(moments), abs=1e-5)
    assert found["section_twist"] == pytest.approx(0.5 * np.sin(swing * moments), abs=1e-4)
    assert found["section_whirl_angle"] == pytest.approx(np.angle(np.exp(2j * moments)), abs=1e-4)


def test_a_trace_without_a_turn_has_no_section():
    time = np.linspace(0.0, 1.0, 50)
    values = {name: np.zeros(50) for name in ("x", "vx", "y", "vy", "z", "vz", "twist", "bit_speed")}
    with pytest.raises(InputError, match="less than one revolution"):
        section_of(Trace(time, {**values, "drive_angle": 2.0 * time}, {"rotary_speed": 2.0}))
    values["twist"][7] = np.nan
    with pytest.raises(InputError, match="are no numbers"):
        section_of(Trace(time, {**values, "drive_angle": 2.0 * time}, {"rotary_speed": 2.0}))


MOTION_SPEEDS = np.linspace(1.0, 8.0, 8)


@pytest.fixture
def motions():
    """Eight points, six of period two and two chaotic, with the 0-1 test for these and
    without Lyapunov exponents."""
    made = make_results(rotary_speed=MOTION_SPEEDS)
    shape = made["status"].shape
    motion, period, zero_one = np.full(shape, PERIODIC), np.full(shape, 2), np.full(shape, np.nan)
    motion[..., 3:5], period[..., 3:5], zero_one[..., 3:5] = CHAOTIC, 0, 0.9
    more = {"motion": motion, "period": period, "zero_one": zero_one}
    return Results(made.coords, {**made.variables, **more}, made.attrs)


def labels(results: Results) -> list[str]:
    return [axes.get_ylabel() for axes in figures.draw(results, "motion").axes]


def test_a_panel_for_everything_there_is(motions):
    assert labels(motions) == ["", "Motion", "0-1 test $K$", "Period\n[returns]"]


def test_no_panel_without_values(motions):
    motions.variables["zero_one"][:] = np.nan
    assert labels(motions) == ["", "Motion", "Period\n[returns]"]
    motions.variables["motion"][:] = CHAOTIC
    assert labels(motions) == ["", "Motion"]


def test_only_periods_of_periodic_motions_are_drawn(motions):
    motions.variables["period"][..., 4] = 7
    [line] = [line for line in figures.draw(motions, "motion").axes[3].get_lines() if line.get_marker() == "o"]
    drawn = np.asarray(line.get_ydata(), dtype=float)
    assert np.array_equal(np.isfinite(drawn), motions["motion"].ravel() == PERIODIC)
    assert np.nanmax(drawn) == 2


@pytest.fixture
def crowd():
    """One branch with 41 special points of three kinds within 0.4 of 6 rad/s, and a
    fold by itself."""
    speed = np.linspace(2.0, 8.0, 601)
    label = np.zeros(601, dtype=int)
    label[400:441] = np.array([FOLD, TORUS, DOUBLING])[np.arange(41) % 3]
    label[100] = FOLD
    return Dataset(
        {
            "rotary_speed": ("point", speed),
            "radius_max": ("point", np.full(601, 0.05)),
            "unstable": ("point", np.zeros(601, dtype=int)),
            "label": ("point", label),
            "row_size": ("branch", np.array([601])),
            "motion": ("branch", np.array(["periodic"])),
        },
        attrs={"along": "rotary_speed", "continue_from": 2.0, "continue_to": 8.0},
    )


@pytest.mark.usefixtures("laid_out")
def test_special_points_that_lie_on_each_other_share_a_marker(crowd):
    figure = figures.draw(crowd)
    _, axes = figure.axes
    figure.draw_without_rendering()
    marked = np.array([axes.transData.transform(line.get_xydata()[0]) for line in artists(axes, "special:")])
    apart = np.diff(np.sort(marked[:, 0])) / figure.dpi
    assert apart.min() > 0.05, "inches: no marker, 0.055 wide, covers another one"
    alone = [line for line in artists(axes, "special:") if line.get_xdata()[0] == pytest.approx(3.0)]
    assert [line.get_gid() for line in alone] == ["special:fold"]
    assert "several special points" in legend_words(figure)


def two_branches(labels, motions=("periodic", "periodic")):
    """Two branches side by side, 0.1 mm apart, which is less than a marker; each with
    special points of these ``labels`` at 5.995, 6 and 6.005 rad/s."""
    speed = np.tile(np.linspace(2.0, 8.0, 1201), 2)
    label, unstable = np.zeros((2, 1201), dtype=int), np.zeros((2, 1201), dtype=int)
    label[:, 799:802] = labels
    unstable[:, :400] = 1
    return Dataset(
        {
            "rotary_speed": ("point", speed),
            "radius_max": ("point", np.repeat([0.05, 0.0501], 1201) + 1e-3 * speed),
            "unstable": ("point", unstable.ravel()),
            "label": ("point", label.ravel()),
            "row_size": ("branch", np.array([1201, 1201])),
            "motion": ("branch", np.array(motions)),
        },
        attrs={"along": "rotary_speed", "continue_from": 2.0, "continue_to": 8.0},
    )


def test_special_points_of_other_branches_have_markers_of_their_own():
    """The heights are 56 mm and 56.1 mm at 6 rad/s."""
    for labels, names in (
        ([[0, FOLD, 0], [0, TORUS, 0]], {"special:fold": 56.0, "special:torus": 56.1}),
        ([[FOLD, TORUS, FOLD], [0, TORUS, 0]], {"special:several special points": 55.995, "special:torus": 56.1}),
    ):
        _, axes = figures.draw(two_branches(labels)).axes
        marked = {line.get_gid(): float(line.get_ydata()[0]) for line in artists(axes, "special:")}
        assert marked == pytest.approx(names)


def test_motions_differ_in_more_than_colour():
    """Solid and dashed are for the stability."""
    figure = figures.draw(two_branches(np.zeros((2, 3)), ("periodic", "invariant_circle")))
    (axes,) = figure.axes
    for stability in ("stable", "unstable"):
        plain, cored = (artists(axes, f"branch {number} {stability}:")[0] for number in (0, 1))
        assert plain.is_dashed() == cored.is_dashed() == (stability == "unstable")
        assert cored.get_linewidth() > plain.get_linewidth()
        assert cored.get_path_effects()
        assert not plain.get_path_effects()
    (legend,) = figure.legends
    entries = dict(zip(legend_words(figure), legend.legend_handles, strict=True))
    assert entries["invariant circles (whirl)"].get_path_effects()
    assert not entries["periodic motions"].get_path_effects()


def test_a_sweep_below_branches_shows_up_and_down_and_where_they_differ(speeds, crowd):
    """The peaks are those within the limits, 2 to 8 rad/s, of both ways."""
    figure = figures.draw(crowd, over=speeds)
    axes = figure.axes[1]
    for row, way in enumerate(("up", "down")):
        lines = artists(axes, f"sweep:{way}:")
        assert {line.get_markerfacecolor() == "none" for line in lines} == {way == "down"}
        peaks = np.isfinite(speeds["radius_peaks"][row, 0, 0]) & (speeds["rotary_speed"] >= 2.0)[:, None]
        dots = np.concatenate([line.get_xydata() for line in lines])
        assert set(dots[:, 0]) == set(speeds["rotary_speed"][peaks.any(axis=-1)])
        assert len(dots) > 3 * len(set(dots[:, 0])), "all peaks, but for those of one pixel"
    shades, whole = (
        {patch.get_x() for patch in artists(drawn, "hysteresis")} for drawn in (axes, figures.draw(speeds).axes[-1])
    )
    assert shades
    assert shades < whole
    words = ("all peaks of the sweep, up", "all peaks of the sweep, down", "up and down differ in response")
    assert set(words) <= set(legend_words(figure))


def test_every_special_point_in_sight_has_a_tick_in_the_row_of_its_kind(crowd):
    label, speed = crowd["label"].values, crowd["rotary_speed"].values
    for ends in ((2.0, 8.0), (5.9, 6.2)):
        strip, *_ = figures.draw(crowd, look=look_of(xlim=ends)).axes
        rows = [text.get_text() for text in strip.get_yticklabels()]
        assert rows == ["fold", "doubling", "torus"]
        for code, name in ((FOLD, "fold"), (DOUBLING, "doubling"), (TORUS, "torus")):
            (ticks,) = artists(strip, f"ticks:{name}")
            expected = speed[(label == code) & (speed >= ends[0]) & (speed <= ends[1])]
            np.testing.assert_array_equal(np.sort(ticks.get_positions()), expected)
            assert ticks.get_lineoffset() == rows.index(name)
    assert len(figures.draw(crowd, look=look_of(xlim=(4.0, 4.5))).axes) == 1, "no special point, no row"


def test_a_panel_alone_names_the_kinds_of_special_points_in_its_legend(crowd):
    assert "fold" not in legend_words(figures.draw(crowd)), "the rows above the panels do"
    assert "fold" in legend_words(figures.draw(crowd, panel="radius_max"))


def test_closer_to_them_they_are_apart(crowd):
    far, near = (
        figures.draw(crowd, look=look_of(xlim=ends)).axes[1] for ends in ((2.0, 8.0), ("5.95 rad/s", "6.25 rad/s"))
    )
    assert len(artists(near, "special:")) > 2 * len(artists(far, "special:"))
    kinds = {line.get_gid() for line in artists(near, "special:")}
    assert {"special:fold", "special:torus", "special:doubling"} <= kinds


def test_the_other_axes_fit_what_is_within_the_limits(crowd):
    """The radius rises from 20 to 80 mm over the whole range, and by 5 mm within the limits."""
    crowd["radius_max"] = "point", np.linspace(0.02, 0.08, 601)
    low, high = figures.draw(crowd, look=look_of(xlim=(4.0, 4.5))).axes[0].get_ylim()
    assert 39.0 < low < 40.0
    assert 45.0 < high < 46.0


def test_branches_are_a_kind_like_others(crowd):
    assert figures.kinds_for(crowd) == ("branches",)
    assert [axes.get_label() for axes in figures.draw(crowd, panel="radius").axes] == ["radius_max"]


def test_labels_are_broken_beside_low_panels(crowd):
    labels = [
        figures.draw(crowd, look=look_of(width="3.3 in", height=height)).axes[1].get_ylabel()
        for height in ("5 in", "1.9 in")
    ]
    assert "\n" not in labels[0]
    assert labels[1].split() == labels[0].split()
    assert "\n" in labels[1]


def test_a_panel_is_one_name(crowd):
    with pytest.raises(InputError, match="panel: found a value of the type list"):
        figures.draw(crowd, panel=["radius_max"])
