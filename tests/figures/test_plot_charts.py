"""Charts of a study: what stands in them, in which units, and that the same study gives
the same picture."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from seen import artists, legend_words

import nsdrill
from nsdrill.errors import InputError
from nsdrill.figures.kinds.chart_pictures import DRIVES

STUDY = {
    "title": "A string",
    "operation": {"wob": "66.72 kN"},
    "drillstring": {"lateral_softening": "static"},
    "sweep": {"rotary_speed": ["2 rad/s", "8 rad/s"]},
}
KINDS = ("critical-speeds", "drive-card", "drive-tuning")


def lines(figure: Figure, gid: str) -> list[np.ndarray]:
    return [line.get_xydata() for line in artists(figure, gid)]


def test_critical_speeds_by_depth():
    figure = nsdrill.chart(STUDY, "critical-speeds")
    axes = figure.axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("Measured depth [m]", "Rotary speed [rad/s]")
    torsional = lines(figure, "torsional waves, once a turn")
    assert len(torsional) == 4
    # Known beforehand at 5000 m.
    at = [float(np.interp(5000.0, *one.T)) for one in torsional]
    assert at == pytest.approx([0.5862, 2.284, 4.276, 6.323], rel=1e-3)
    lateral = lines(figure, "lateral, of 1, 2, 3 half waves of the span")
    assert [float(one[0, 1]) for one in lateral] == pytest.approx([6.323, 26.27, 59.51], rel=1e-3)
    assert "one mode of each kind" in axes.get_title(loc="left")
    assert "A string" in figure.get_suptitle()
    assert "66.72 kN" in figure.get_suptitle()


def test_the_band_is_that_of_the_sweep_or_the_ramp():
    ramp = {"title": "t", "operation": {"rotary_speed": {"ramp": [["0 s", "4 rad/s"], ["60 s", "7 rad/s"]]}}}
    for study, low, high in ((STUDY, 2.0, 8.0), (ramp, 4.0, 7.0)):
        axes = nsdrill.chart(study, "critical-speeds").axes[0]
        (band,) = (patch for patch in axes.patches if patch.get_gid() == "operating")
        assert (band.get_y(), band.get_y() + band.get_height()) == pytest.approx((low, high))
    one = nsdrill.chart({"title": "t"}, "critical-speeds").axes[0]
    (line,) = (line for line in one.lines if line.get_gid() == "operating")
    assert line.get_ydata() == pytest.approx([3.0, 3.0])


def test_field_units():
    si, field = (nsdrill.chart(STUDY, "critical-speeds", units=units) for units in ("si", "field"))
    assert field.axes[0].get_xlabel() == "Measured depth [ft]"
    assert field.axes[0].get_ylabel() == "Rotary speed [rpm]"
    name = "torsional waves, once a turn"
    for one, other in zip(lines(si, name), lines(field, name), strict=True):
        assert other == pytest.approx(one * [1 / 0.3048, 30 / np.pi], rel=1e-9)
    assert "ft-lbf s/rad" in nsdrill.chart(STUDY, "drive-card", units="field").axes[0].get_title(loc="left")


def test_motions_that_are_frozen_have_no_critical_speed():
    figure = nsdrill.chart(STUDY, "critical-speeds", set={"modes": {"axial": "frozen", "lateral": "frozen"}})
    assert len(legend_words(figure)) == 2
    assert len(lines(figure, "torsional waves, once a turn")) == 4


def test_a_span_that_buckles_has_no_speed():
    study = {"title": "t", "operation": {"wob": "120 kN"}, "sweep": {"drillstring.collar.span": ["10 m", "60 m"]}}
    figure = nsdrill.chart(study, "critical-speeds", along="drillstring.collar.span")
    first = lines(figure, "lateral, of 1, 2, 3 half waves of the span")[0]
    # The span whose load of Euler is 120 kN: pi sqrt(E I / W) with E I = 27.803 MN m^2;
    # a little less with its torque.
    assert first[np.isfinite(first[:, 1]), 0].max() == pytest.approx(np.pi * np.sqrt(27.803e6 / 120e3), rel=0.02)
    assert np.isnan(first[-1, 1])
    assert figure.axes[0].get_ylim()[0] > 0.1


def test_drive_card_has_the_drives_and_what_they_hold():
    figure = nsdrill.chart(STUDY, "drive-card", set={"drive": {"kind": "soft_torque"}})
    (shares,) = lines(figure, "soft_torque")
    assert np.interp(0.093996, *shares.T) == pytest.approx(0.6, abs=1e-3)
    assert "this study: soft torque, holds 136.4" in legend_words(figure)
    assert "LQR, holds 193.3 (no impedance)" in legend_words(figure)
    drawn = {line.get_gid(): line for line in figure.axes[0].lines if line.get_gid() in DRIVES}
    assert len({(line.get_color(), line.get_linestyle()) for line in drawn.values()}) == len(drawn) == 5
    assert drawn["soft_torque"].get_linewidth() > drawn["stiff"].get_linewidth()


def test_tuning_marks_the_best_and_the_own():
    figure = nsdrill.chart(STUDY, "drive-tuning", set={"drive": {"kind": "soft_torque"}})
    (own,) = lines(figure, "the drive of the study")
    assert own[0] == pytest.approx([4.0, 0.093996], rel=1e-4)
    assert len(lines(figure, next(word for word in legend_words(figure) if word.startswith("best")))) == 1
    outside = nsdrill.chart(STUDY, "drive-tuning", set={"drive": {"kind": "soft_torque", "matching": 20.0}})
    assert "the drive of the study lies outside" in legend_words(outside)
    ideal = nsdrill.chart(STUDY, "drive-tuning")
    assert not lines(ideal, "the drive of the study")


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_study_gives_the_same_bytes(kind, tmp_path):
    for name in ("a.svg", "b.svg"):
        nsdrill.save(nsdrill.chart(STUDY, kind), tmp_path / name)
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()


@pytest.mark.parametrize("kind", KINDS)
def test_into_axes_of_ones_own(kind):
    figure = Figure()
    axes = figure.subplots()
    axes.set_title("mine")
    assert nsdrill.chart(STUDY, kind, ax=axes) is figure
    assert axes.get_title() == "mine"
    assert axes.get_title(loc="left") == ""
    assert axes.lines


def test_plot_draws_charts_of_a_study():
    study = nsdrill.load_study(STUDY)
    figure = nsdrill.plot(study, "critical-speeds")
    assert lines(figure, "torsional waves, once a turn")
    with pytest.raises(InputError, match="wob: found with a study"):
        nsdrill.plot(study, "critical-speeds", wob=3e4)
    with pytest.raises(InputError, match=r"along: found with kind='drive-card', which is of one point"):
        nsdrill.chart(study, "drive-card", along="rotary_speed")
    with pytest.raises(InputError, match="a study without a kind"):
        nsdrill.plot(study)
