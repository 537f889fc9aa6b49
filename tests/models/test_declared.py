"""What a model declares once and what follows from it; friction laws and drilling rates by
themselves."""

import math
from dataclasses import fields
from typing import get_args

import numpy as np
import pytest

import nsdrill
from nsdrill.equations.plain import followed
from nsdrill.equations.trace import Named
from nsdrill.models.choices import OF_SCRIPTS
from nsdrill.models.christoforou_yigit.parameters import BitFriction
from nsdrill.models.drive_laws import Kind
from nsdrill.models.friction import LAWS, KeyedLaw, Numbers, values
from nsdrill.models.numbers import drilled
from nsdrill.models.operation import Values
from nsdrill.models.own_drives import SERVED
from nsdrill.models.registry import BY_NAME, NAMES, described, model_named
from nsdrill.models.responses import RESPONSES, STALLED, STICK_SLIP, Stalled, Thresholds, present, severities
from nsdrill.models.sections import Cutting
from nsdrill.models.tree import lane_values, lanes_of
from nsdrill.models.variant import variant_at
from nsdrill.observe.channels import Channel, Declaration, Mean, Names, TimeAbove, check, measured_by
from nsdrill.study import parse_study
from nsdrill.study.study import study_from_resolved
from nsdrill.units import from_si, to_si
from nsdrill.variables import OK, feature


@pytest.mark.parametrize("name", NAMES)
def test_numbers_are_lane_parameters_under_the_names_they_declare(name):
    model = described(name)
    parameters, operation = model.parameters(), model.operation()
    dynamics, names = model_named(model.name), variant_at(model_named(model.name), parameters).names.parameters
    points = Values(parameters, model.initial(), (operation.depth, operation.wob, operation.rotary_speed))
    (row,) = dynamics.pack(points, Thresholds())
    assert set(lanes_of(model.parameters)) <= set(names)
    assert lane_values(parameters) == {one: row[names.index(one)] for one in lanes_of(model.parameters)}


def test_every_response_has_its_threshold_bounds_and_variables():
    assert [response.bit for response in RESPONSES.values()] == [1, 2, 4, 8]  # as in files of every version
    for response in RESPONSES.values():
        section = getattr(Thresholds(), response.name)
        assert getattr(section, response.feature) > 0.0
        assert response.feature in BY_NAME
        if response.severity is None:
            assert response.name == "stalled", "one without a severity is never safe"
            continue
        bounds = response.bounds_in(Thresholds())
        assert list(bounds) == sorted(bounds)
        assert len(response.bands) == len(bounds) + 1 == len(response.severity.flag_values or ())
        assert {response.feature, response.graded, response.severity.name} <= set(BY_NAME)


@pytest.mark.parametrize("index", [49.0, 165.0, math.inf])
def test_a_bit_that_stays_stuck_is_stalled_and_nothing_else(index):
    """The index of a bit that creeps is arbitrary, and infinite where it does not turn
    at all; a whirling collar does not change that the bit stands."""
    features = {
        "stick_slip_index": np.array([index]),
        "stuck_fraction": np.array([1.0]),
        "lift_off_fraction": np.array([0.2]),
        "wall_contact_fraction": np.array([1.0]),
        "lateral_acceleration_rms": np.array([6.0]),
    }
    response = present(features, Thresholds())
    assert response.tolist() == [STALLED]
    labels = severities(features, response, Thresholds())
    assert {name: value.tolist() for name, value in labels.items()} == {
        "bounce_severity": [2],
        "stick_slip_severity": [0],
        "whirl_severity": [2],
    }


def test_a_bit_is_stalled_above_the_threshold_and_where_its_mean_speed_is_zero():
    stuck = {"stick_slip_index": np.array([300.0, 300.0]), "stuck_fraction": np.array([0.99, 0.9901])}
    assert present(stuck, Thresholds()).tolist() == [STICK_SLIP, STALLED]
    limits = Thresholds(stalled=Stalled(stuck_fraction=0.9))
    assert present(stuck, limits).tolist() == [STALLED, STALLED]
    # of a model that does not measure how long the bit is stuck
    assert present({"stick_slip_index": np.array([300.0, np.inf])}, Thresholds()).tolist() == [STICK_SLIP, STALLED]


@pytest.mark.parametrize("name", NAMES)
def test_every_model_whose_bit_turns_can_show_that_it_is_stalled(name):
    response = next(variable for variable in described(name).variables if variable.name == "response")
    assert response.flag_masks[-1] == STALLED
    assert response.words(STALLED) == "stalled"
    assert {"tight_stuck_fraction", "long_stuck_fraction"} <= {one.name for one in described(name).variables}


def test_a_record_is_measured_unless_a_feature_of_that_name_is_declared():
    records = [
        feature("mean_a", "m", "mean of a", measure=Mean("a")),
        feature("mean_b", "m", "mean of b", measure=Mean("b")),
        feature("above_c", "1", "time above c", "option", measure=TimeAbove("c")),
        feature("derived", "1", "measured elsewhere"),
    ]
    own = [Mean("another", "mean_b")]
    assert measured_by(records, own) == [Mean("a", "mean_a")]
    assert measured_by(records, own, ("option",)) == [Mean("a", "mean_a"), TimeAbove("c", "above_c")]


def test_a_number_of_the_physics_that_has_always_been_there_is_not_left_out():
    with pytest.raises(Exception, match="density"):
        study_from_resolved({**parse_study("title: now\n").resolved, "mud": {"added_mass": 1.7}})


@pytest.mark.parametrize("name", LAWS)
def test_no_slip_falls_more_steeply_than_the_law_says(name):
    """And one falls as steeply: a scan of the slips without smoothing."""
    numbers = {"smoothing": 1e12, "decay": 3.0, "rise": 0.7, "dynamic": 0.2}
    slips = np.concatenate([[1e-9], np.linspace(1e-3, 10.0, 200_001)])
    falls = values(LAWS[name], "fall", slips, Numbers(**numbers))
    assert np.max(falls) == pytest.approx(LAWS[name].steepest_fall(Named(**numbers)), rel=1e-6)


def test_every_law_of_the_bit_has_its_keys():
    assert {item.name for item in fields(BitFriction)} == {"law", *(key for law in LAWS.values() for key in law.keys)}
    with pytest.raises(nsdrill.StudyError) as refused:
        parse_study("bit: {rock: {law: regenerative}, friction: {law: linear, dynamic_from: 2 rad/s, b0: 30 mm}}")
    for key in ("law", "dynamic_from", "b0"):
        assert f"bit.friction.{key}: found" in str(refused.value)


@pytest.mark.parametrize("model", SERVED)
def test_every_kind_of_drive_is_one_of_every_model_that_has_drives(model):
    """Also of the string of segments, which has equations of its own: its lane parameters are
    those that they read, as numbers."""
    for kind in get_args(Kind):
        study = nsdrill.load_study({"model": model, "drive.kind": kind, "operation.rotary_speed": "12 rad/s"})
        points = Values(study.parameters, study.initial, tuple(vars(study.operation).values()))
        assert np.all(np.isfinite(model_named(model).pack(points, Thresholds()))), kind


def squared(v, factors, numbers):
    direction, weakened = factors
    return direction * (numbers.rise * weakened * weakened + numbers.dynamic)


def test_a_law_with_a_coefficient_of_its_own_is_unsmoothed_too():
    """At a slip at which the smoothing still matters, (2/pi) atan(20) = 0.968."""
    law = KeyedLaw(LAWS["hyperbolic"].factors, squared, lambda n: 2.0 * n.rise * n.decay)
    numbers, v = Numbers(smoothing=100.0, decay=3.0, rise=0.3, dynamic=0.2), 0.2
    assert values(law, "unsmoothed", v, numbers) == pytest.approx(0.3 / (1 + 3 * v) ** 2 + 0.2, rel=1e-12)
    assert values(law, "fall", v, numbers) == pytest.approx(2 * 3 * 0.3 / (1 + 3 * v) ** 3, rel=1e-12)


def test_a_rate_that_is_missing_is_refused():
    """What a followed quantity reads and what has no rate is constant: a parameter, and
    nothing that moves."""
    names = Names(("twist", "bit_speed"), ("acceleration",), ("stiffness",))

    def torque(n):
        return n.stiffness * n.twist + n.bit_speed

    def observed(rates):
        return Declaration(channels=(Channel("torque", *followed(torque, rates), scale=1.0),), features=())

    check(names, observed(lambda n: {"twist": n.bit_speed, "bit_speed": n.acceleration}))
    with pytest.raises(ValueError, match=r"channel 'torque': found no rate of bit_speed, which its value reads"):
        check(names, observed(lambda n: {"twist": n.bit_speed}))


def test_a_key_of_another_model_is_refused_as_such():
    with pytest.raises(nsdrill.StudyError, match=r"bit\.friction\.b0: found a key of the model christoforou_yigit,"):
        parse_study("model: torsion\nbit: {friction: {b0: 1 mm}}")
    with pytest.raises(nsdrill.StudyError, match=r"segments: found a key of the model segments, which the model beam"):
        parse_study("model: beam\nsegments: {pipe: 3}")
    with pytest.raises(nsdrill.StudyError, match=r"bit\.friction\.lwa: found an unknown key"):
        parse_study("model: torsion\nbit: {friction: {lwa: linear}}")


RUN = {"transient": "20 s", "observe": "20 s"}


def test_the_energy_is_that_of_the_formula_in_oilfield_units():
    # Teale 1965 as rigs compute it: MSE [psi] = 4 W/(pi D^2) + 480 T N/(D^2 ROP); 480
    # is 2 pi 60 12 4/pi / 12, exact.
    wob, speed, torque, diameter = 20e3, 120.0, 5500.0, 8.5  # lbf, rpm, ft lbf, in
    found = drilled(
        np.array([to_si(f"{torque} ft*lbf", "N m")]),
        to_si(f"{speed} rpm", "rad/s"),
        Cutting(),
        to_si(f"{wob} lbf", "N"),
        to_si(f"{diameter / 2} in", "m"),
    )
    rate = from_si(found["rate_of_penetration"][0], "ft/h")
    energy = 4 * wob / (math.pi * diameter**2) + 480 * torque * speed / (diameter**2 * rate)
    assert from_si(found["mechanical_specific_energy"][0], "psi") == pytest.approx(energy, rel=1e-12)


def test_the_rate_is_that_of_the_law_and_none_where_it_is_negative():
    law = Cutting(c1=1e-8, c2=-1e-4)
    wob = np.array([0.0, 1e3, 4e4])
    found = drilled(np.full(3, 1e3), np.array([4.0, 4.0, 9.0]), law, wob, 0.1)
    np.testing.assert_allclose(found["rate_of_penetration"], [0.0, 0.0, 1e-8 * 4e4 * 3.0 - 1e-4], rtol=1e-14)
    assert np.isinf(found["mechanical_specific_energy"]).tolist() == [True, True, False]


@pytest.mark.parametrize("model", ["christoforou_yigit", "beam", "segments"])
def test_a_run_takes_the_power_of_its_trace(model, tmp_path):
    study = nsdrill.load_study({"model": model, "simulation": RUN, "operation": {"rotary_speed": "110 rpm"}})
    point = nsdrill.run(study, tmp_path / "out.h5")
    assert point.status.item() == OK
    trace = nsdrill.replay(tmp_path / "out.h5", sample="5 ms")
    late = trace.sel(time=slice(20.0, None))
    power = np.trapezoid(late.surface_torque * late.drive_speed, late.time) / 20.0
    bit_radius = study.parameters.bit.radius if model == "segments" else study.parameters.well.diameter / 2
    rate, wob = point.rate_of_penetration.item(), study.operation.wob
    energy = (power + wob * rate) / (math.pi * bit_radius**2 * rate)
    assert point.mechanical_specific_energy.item() == pytest.approx(energy, rel=0.01 if model == "segments" else 1e-4)


def test_no_energy_is_told_of_a_string_that_is_not_twisted(tmp_path):
    point = nsdrill.run({"modes": {"torsional": "frozen"}, "simulation": RUN}, tmp_path / "out.h5")
    assert np.isnan(point.mechanical_specific_energy.item())
    assert point.rate_of_penetration.item() == pytest.approx(1.35e-8 * 22.24e3 * math.sqrt(3.0) - 1.9e-4, rel=1e-12)


def test_a_motor_at_its_limit_drills_at_the_speed_that_it_keeps(tmp_path):
    drive = {"kind": "soft_torque", "torque_limit": "1 kN*m"}
    point = nsdrill.run({"drive": drive, "simulation": RUN}, tmp_path / "out.h5")
    mean = point.drive_speed_mean.item()
    assert mean < 2.9
    law = 1.35e-8 * 22.24e3 * math.sqrt(max(mean, 0.0)) - 1.9e-4
    assert point.rate_of_penetration.item() == pytest.approx(max(law, 0.0), rel=1e-9)


def test_no_model_has_the_section_of_a_script():
    """So a number of a script is no choice of theirs, which is known without importing them."""
    assert not [name for name in NAMES if OF_SCRIPTS in described(name).sections]
