"""Frozen modes: the models of one and two degrees of freedom that the literature has,
as studies of the one model; and what modes, laws and drives refuse."""

import numpy as np
import pytest

import nsdrill
from main_model.cases import features, torsion
from nsdrill.models.christoforou_yigit.parameters import Drive
from nsdrill.study import parse_study


@pytest.mark.parametrize(
    ("wob", "speed", "peak"),
    [(66.72, 1, 6.43), (66.72, 3, 3.10), (66.72, 5, 2.47), (66.72, 8, 2.14), (22.24, 1, 3.11), (22.24, 3, 2.15)],
)
def test_peaks_of_stick_slip(wob, speed, peak):
    """The greatest bit speed over the set speed, computed beforehand from the one
    equation by other code."""
    found = features(torsion(wob=wob, speed=speed))
    assert found["bit_speed_max"] / speed == pytest.approx(peak, abs=6e-3)
    assert found["lift_off_fraction"] == found["wall_contact_fraction"] == 0.0
    assert found["bit_force_max"] == pytest.approx(wob * 1e3, rel=1e-12)


def test_what_is_frozen_is_not_carried_from_point_to_point():
    """Each point of a chain has the set speed and the static position of its own."""
    text = (
        "modes: {axial: frozen, torsional: frozen}\nsimulation: {transient: 20 s, observe: 5 s}\n"
        "sweep: {rotary_speed: [2 rad/s, 4 rad/s], wob: [10 kN, 30 kN], procedure: up-down, along: rotary_speed}"
    )
    found = nsdrill.run(text)
    speed = found.rotary_speed.broadcast_like(found.bit_speed_min)
    assert np.array_equal(found.bit_speed_min, speed)
    assert np.array_equal(found.bit_speed_max, speed)
    assert np.all(found.surface_torque_max == 0.0)
    assert np.allclose(found.bit_force_max, found.wob.broadcast_like(found.bit_force_max), rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("modes: {axial: frozen, torsional: frozen, lateral: frozen}", "at least one free"),
        ("modes: {torsional: frozen}\ndrive: {kind: stiff}", "modes.torsional: frozen"),
        ("modes: {lateral: frozen}\nsweep: {drillstring.eccentricity: [1 mm, 2 mm]}", "frozen does without"),
        ("modes: {lateral: frozen}\ninitial: {x: 2 mm}", "frozen does without"),
        (
            "modes: {torsional: frozen}\noperation: {rotary_speed: {ramp: [[0 s, 2 rad/s], [9 s, 3 rad/s]]}}",
            "would not follow it",
        ),
        ("drive: {kind: stiff, matching: 2}", "the drive stiff does not read"),
        ("sweep: {drive.inertia: [1000 kg*m^2, 2000 kg*m^2]}", "the drive ideal does not read"),
        ("drive: {kind: soft_torque, compensated_inertia: 3000 kg*m^2}", "below drive.inertia"),
        ("initial: {lag: 1 rad}", "the drive ideal does not read"),
        ("bit: {friction: {law: linear, decay: 2 s/rad}}", "the law linear does not read"),
        ("bit: {friction: {law: rational, static: 0.4}}", r"reads: b0, b1, b2, b3"),
        ("bit: {friction: {b1: 3 s/rad}}", "the law hyperbolic does not read"),
        ("sweep: {bit.friction.dynamic_from: [1 rad/s, 2 rad/s]}", "the law hyperbolic does not read"),
        ("bit: {friction: {law: rational}}\nsweep: {bit.cutting.zeta: [0, 1]}", "the law rational does not read"),
        ("bit: {friction: {law: of_nobody}}", "hyperbolic, linear, exponential"),
        ("drive: {torque_limit: 60 kN*m}", "the drive ideal does not read"),
        ("drive: {kind: z_torque, torque_limit: 60 kN*m}", "the drive z_torque does not read"),
        ("drive: {kind: soft_torque, compensated_inertia: 9 kg*m^2, torque_limit: 60 kN*m}", "another one"),
        ("drive: {kind: pi}\nsweep: {drive.torque_limit: [20 kN*m, 60 kN*m]}", "without a limit beside it"),
    ],
)
def test_what_means_nothing_is_refused(text, said):
    with pytest.raises(nsdrill.StudyError, match=said):
        parse_study(text)


def test_a_limit_that_a_drive_does_not_read_is_none():
    assert not Drive("z_torque", torque_limit=1.0).limited
    with pytest.raises(ValueError, match="torque_limit"):
        Drive("soft_torque", compensated_inertia=9.0, torque_limit=1.0)
