"""What a model leaves out is told where the answer goes there: weights above that of the collars,
speeds near the second bending mode, and a drive that cannot turn a bit that has stopped."""

import math

import pytest

from nsdrill.analysis.advice import Advice, Border, Kind, Stretch
from nsdrill.app.answering.answers import window
from nsdrill.app.check import check, left_out
from nsdrill.app.running.run import run_study
from nsdrill.data import LEFT_OUT
from nsdrill.study import parse_study
from nsdrill.words.left_out import left_out_texts
from nsdrill.words.values import Formatter

STRING = """
drillstring: {collar: {length: 60 m, span: SPAN}}
drive: {kind: stiff, torque_limit: 6 kN*m}
operation: {depth: 1000 m}
simulation: {transient: 2 s, observe: 1 s}
sweep:
  rotary_speed: {from: 20 rad/s, to: 22 rad/s, points: 3}
  wob: {from: 20 kN, to: TOP, points: 3}
  procedure: same
"""


BORDER = Border(None)


def study_of(span="19 m", top="80 kN", more=""):
    return parse_study(STRING.replace("SPAN", span).replace("TOP", top) + more)


def test_the_second_mode_is_that_of_a_pinned_beam():
    """Under no load, with (2 pi / l)^2 sqrt(E I / m); a weight lowers it."""
    study = study_of(top="40 kN")
    found = left_out(study)["second_mode"]
    collar, material = study.parameters.drillstring.collar, study.parameters.drillstring.material
    inertia = math.pi / 64 * (collar.outer_diameter**4 - collar.inner_diameter**4)
    area = math.pi / 4 * (collar.outer_diameter**2 - collar.inner_diameter**2)
    mud = study.parameters.mud
    mass = material.density * area + mud.density * math.pi / 4 * (
        collar.inner_diameter**2 + mud.added_mass * collar.outer_diameter**2
    )
    dry = (2 * math.pi / collar.span) ** 2 * math.sqrt(material.young_modulus * inertia / mass)
    assert 0.9 * dry < found < dry


def test_the_weight_of_the_collars_is_that_in_mud():
    study = study_of()
    collar, material = study.parameters.drillstring.collar, study.parameters.drillstring.material
    area = math.pi / 4 * (collar.outer_diameter**2 - collar.inner_diameter**2)
    weight = 9.81 * (material.density - study.parameters.mud.density) * area * collar.length
    assert left_out(study)["collar_weight"] == pytest.approx(weight, rel=1e-3)


def test_a_stopped_bit_is_held_from_the_weight_whose_static_torque_the_drive_lacks():
    heavy = left_out(study_of(top="200 kN"))["held_from"]
    per_weight = heavy["needed"] / heavy["wob"]  # nearly: the string is damped, too
    for top in ("40 kN", "150 kN", "160 kN", "180 kN"):
        study = study_of(top=top)
        lacking = study.axes["wob"][per_weight * study.axes["wob"] > 6e3]
        held = left_out(study)["held_from"]
        assert (abs(per_weight * study.axes["wob"] / 6e3 - 1.0) > 0.05).all(), "the border is not to be near"
        assert (held is None) == (lacking.size == 0), (top, per_weight)
        if held is not None:
            assert held["wob"] == lacking[0]
            assert held["needed"] == pytest.approx(per_weight * held["wob"], rel=0.05)
            assert held["available"] == pytest.approx(6e3)


def test_a_sampled_study_is_judged_by_its_samples_alone():
    """The values in the sections of uncertain numbers are those of no sample."""
    samples = "uncertain: {drillstring.collar.length: {uniform: [100 m, 110 m]}, samples: 4}\n"
    alone = left_out(study_of(more=samples))["collar_weight"]
    assert alone > left_out(study_of())["collar_weight"] * 100 / 60 * 0.999


def texts_of(told, point, stay_within, ranges=None):
    advice = Advice(Kind.FROM_BELOW, point=point, stay_within=stay_within)
    summary = {LEFT_OUT: told, "answer": advice, "fixed": {"depth": 1000.0}, "model": "christoforou_yigit"}
    summary["ranges"] = ranges or {}
    return list(left_out_texts(summary, Formatter("si"), "si"))


TOLD = {"collar_weight": 50e3, "second_mode": 20.0, "held_from": {"wob": 70e3, "needed": 9.5e3, "available": 8e3}}
STARTS = ["HEAVIER THAN THE COLLARS", "A SECOND BENDING MODE", "A BIT THAT STOPS"]


@pytest.mark.parametrize(
    ("heaviest", "fastest", "told"),
    [(40e3, 10.0, []), (60e3, 10.0, [0]), (40e3, 19.0, [1]), (80e3, 10.0, [0, 2]), (70e3, 25.0, [0, 1, 2])],
)
def test_only_what_the_answer_allows_is_told(heaviest, fastest, told):
    stretch = {"wob": Stretch(30e3, heaviest, BORDER, BORDER), "rotary_speed": Stretch(8.0, fastest, BORDER, BORDER)}
    found = texts_of(TOLD, {"wob": 30e3, "rotary_speed": 9.0}, stretch)
    assert [text.partition(":")[0].partition(" MAY")[0].partition(" MODE")[0] for text in found] == [
        STARTS[one].removesuffix(" MODE") for one in told
    ]
    assert texts_of(TOLD, {}, {}) == [], "without a setting nothing is allowed"


@pytest.mark.parametrize(
    ("buckles", "holds"),
    [
        (None, "It holds to that: above, the pipe over them may buckle"),
        (60e3, "It holds to 60 kN: above, the pipe over them may buckle"),
        (90e3, "It holds: the pipe above them is in compression, but in this inclined hole it does not buckle below"),
    ],
)
def test_to_which_weight_the_answer_holds_is_told(buckles, holds):
    stretch = {"wob": Stretch(30e3, 80e3, BORDER, BORDER)}
    (text,) = texts_of({"collar_weight": 50e3, "pipe_buckles": buckles}, {"wob": 30e3}, stretch)
    assert text.startswith("HEAVIER THAN THE COLLARS: the answer goes to 80 kN, and the collars weigh 50 kN. ")
    assert holds in text


def test_an_inclined_hole_holds_the_pipe_that_a_vertical_one_does_not():
    """By Dawson and Paslay 2 sqrt(E I w sin(i) / r) of the pipe, beyond the weight of the collars along the hole."""
    upright = left_out(study_of())
    assert upright["pipe_buckles"] == upright["collar_weight"]
    study = study_of(more="well: {inclination: 30 deg}\n")
    inclined, pipe = left_out(study), study.parameters.drillstring.pipe
    steel, mud = study.parameters.drillstring.material, study.parameters.mud.density
    inertia = math.pi / 64 * (pipe.outer_diameter**4 - pipe.inner_diameter**4)
    weight = 9.81 * (steel.density - mud) * math.pi / 4 * (pipe.outer_diameter**2 - pipe.inner_diameter**2)
    clearance = (study.parameters.well.diameter - pipe.outer_diameter) / 2
    load = 2 * math.sqrt(steel.young_modulus * inertia * weight * 0.5 / clearance)
    assert inclined["collar_weight"] == pytest.approx(upright["collar_weight"] * math.cos(math.pi / 6))
    assert inclined["pipe_buckles"] - inclined["collar_weight"] == pytest.approx(load, rel=0.01)


def test_the_second_mode_is_told_wherever_it_takes_points_of_the_map():
    (text,) = texts_of({"second_mode": 20.0}, {}, {}, {"rotary_speed": [5.0, 18.5]})
    assert "nothing above 18 rad/s" in text
    assert texts_of({"second_mode": 20.0}, {}, {}, {"rotary_speed": [5.0, 17.5]}) == []


def test_check_tells_the_second_mode_of_a_model_of_one():
    fast = "sweep: {rotary_speed: {from: 20 rad/s, to: 40 rad/s, points: 3}}\n"
    for model, told in (("model: christoforou_yigit\n", True), ("model: beam\nbeam: {modes: 1}\n", True)):
        warnings = check(parse_study(model + fast)).warnings
        assert any(one.startswith("Second mode") for one in warnings) == told
    warnings = check(parse_study("model: beam\nbeam: {modes: 2}\n" + fast)).warnings
    assert not any(one.startswith("Second mode") for one in warnings)


def test_window_tells_it_of_runs(tmp_path):
    path = tmp_path / "out.h5"
    run_study(study_of(), path)
    found = window(path)
    assert found[LEFT_OUT] == left_out(study_of())
    told = [one.partition(":")[0] for one in found["answer"]["warnings"]]
    assert ("HEAVIER THAN THE COLLARS" in told) == bool(found["answer"]["point"])
