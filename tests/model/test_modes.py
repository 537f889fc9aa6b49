"""Frozen modes: the models of one and two degrees of freedom that the literature has,
as studies of the one model."""

import math

import numpy as np
import pytest

import nsdrill
from nsdrill.app.run import run_in_memory
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.parameters import Drive
from nsdrill.study import parse_study

TORSION = """
modes: {{axial: frozen, lateral: frozen}}
operation: {{wob: {wob} kN, rotary_speed: {speed} rad/s}}
initial: {{twist: {twist} rad, bit_speed: {bit_speed} rad/s}}
simulation: {{transient: {transient} s, observe: {observe} s}}
"""
WHIRL = """
modes: {{axial: frozen, torsional: frozen}}
drillstring: {{lateral_softening: static, eccentric_mass: steel}}
operation: {{wob: {wob} kN, rotary_speed: {speed} rad/s}}
simulation: {{transient: 2000 s, observe: 50 s, rtol: 1.0e-9}}
"""


def features(text: str) -> dict[str, float]:
    found = run_in_memory(parse_study(text), workers=1)
    return {
        name: float(np.ravel(values)[0])
        for name, values in found.variables.items()
        if values.dtype.kind == "f" and values.size == 1
    }


@pytest.mark.parametrize(
    ("wob", "speed", "peak"),
    [(66.72, 1, 6.43), (66.72, 3, 3.10), (66.72, 5, 2.47), (66.72, 8, 2.14), (22.24, 1, 3.11), (22.24, 3, 2.15)],
)
def test_peaks_of_stick_slip(wob, speed, peak):
    """The greatest bit speed over the set speed, computed beforehand from the one
    equation by other code."""
    found = features(TORSION.format(wob=wob, speed=speed, twist=0, bit_speed=0, transient=300, observe=100))
    assert found["bit_speed_max"] / speed == pytest.approx(peak, abs=6e-3)
    assert found["lift_off_fraction"] == found["wall_contact_fraction"] == 0.0
    assert found["bit_force_max"] == pytest.approx(wob * 1e3, rel=1e-12)


@pytest.mark.parametrize(("wob", "hopf"), [(22.24, 2.036), (66.72, 3.770)])
def test_steady_drilling_loses_its_stability_where_friction_falls_too_steeply(wob, hopf):
    """Linear theory: the slope of the friction torque, smoothing included, is the
    torsional damping."""
    for speed, grows in ((hopf - 0.05, True), (hopf + 0.05, False)):
        study = parse_study(TORSION.format(wob=wob, speed=speed, twist=0, bit_speed=speed, transient=1, observe=1))
        k = derive(study.parameters, 5000.0, wob * 1e3, speed)
        law, arm = study.parameters.bit.friction, 2 / 3 * k.bit_radius
        g = 2 / math.pi * math.atan(law.smoothing * speed)
        rest = arm * ((law.static - law.dynamic) / (1 + law.decay * speed) + law.dynamic) + k.cutting_arm
        steady = -(wob * 1e3 * g * rest + 50.0 * speed) / k.k_t
        near = {"wob": wob, "speed": speed, "twist": steady + 0.01, "bit_speed": speed, "observe": 30}
        first, later = (features(TORSION.format(transient=transient, **near)) for transient in (0, 570))
        swing = [one["bit_speed_max"] - one["bit_speed_min"] for one in (first, later)]
        assert (swing[1] > swing[0]) is grows


@pytest.mark.parametrize(("speed", "radius"), [(2.0, 0.942586e-3), (4.0, 5.459086e-3), (5.0, 12.844433e-3)])
def test_synchronous_whirl(speed, radius):
    """The closed form of Jansen's model without swirl and clearance, drag and unbalance
    of the steel alone."""
    found = features(WHIRL.format(wob=22.24, speed=speed))
    # Quadratic drag lets the start die out slowly where the whirl is slow.
    assert found["radius_mean"] == pytest.approx(radius, rel=2e-3 if speed < 3.0 else 4e-5)
    assert found["whirl_ratio"] == pytest.approx(1.0, abs=1e-3)
    assert found["bit_speed_min"] == found["bit_speed_max"] == speed


def test_what_is_frozen_is_not_carried_from_point_to_point():
    """Each point of a chain has the set speed and the static position of its own."""
    text = (
        "modes: {axial: frozen, torsional: frozen}\nsimulation: {transient: 20 s, observe: 5 s}\n"
        "sweep: {rotary_speed: [2 rad/s, 4 rad/s], wob: [10 kN, 30 kN], procedure: up-down, "
        "along: rotary_speed}"
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
        ("bit: {friction: {law: stribeck}}", "hyperbolic, linear, exponential"),
        ("drive: {torque_limit: 60 kN*m}", "the drive ideal does not read"),
        ("drive: {kind: z_torque, torque_limit: 60 kN*m}", "the drive z_torque does not read"),
        ("drive: {kind: soft_torque, compensated_inertia: 9 kg*m^2, torque_limit: 60 kN*m}", "another one"),
        ("drive: {kind: pi}\nsweep: {drive.torque_limit: [20 kN*m, 60 kN*m]}", "without a limit beside it"),
        ("sweep: {rotary_speed: [2 rad/s, 3 rad/s]}\ndrive: {kind: stiff, on_at: 5 s}", "with a sweep"),
        ("operation: {wob: {ramp: [[0 s, 1 kN], [9 s, 2 kN]]}}\ndrive: {kind: stiff, on_at: 5 s}", "with a ramp"),
        ("drive: {on_at: 5 s}", "the drive ideal does not read"),
        ("drive: {kind: stiff, on_at: 5 s}\ninitial: {lag: 1 rad}", "until when"),
    ],
)
def test_what_means_nothing_is_refused(text, said):
    with pytest.raises(nsdrill.StudyError, match=said):
        parse_study(text)


def test_a_limit_that_a_drive_does_not_read_is_none():
    assert not Drive("z_torque", torque_limit=1.0).limited
    with pytest.raises(ValueError, match="torque_limit"):
        Drive("soft_torque", compensated_inertia=9.0, torque_limit=1.0)
