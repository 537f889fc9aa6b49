"""A bounce of the bit over lobes that lasts: from which speed on, and where the bit is in it."""

import itertools
import math
from dataclasses import astuple

import numpy as np
import pytest

from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.app.answering.answers import with_lasting_motions
from nsdrill.app.check import lasting_motions, tells_what_lasts
from nsdrill.app.running.run import run_in_memory
from nsdrill.models.christoforou_yigit.bouncing import SWING, bounce, bounce_speed
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.derived_quantities import lobe_resonance
from nsdrill.study import parse_study

# The resonance with the lobe is at 324 rpm.
LOBE = """\
drillstring: {torsional_damping: 100 N*m*s/rad}
bit: {lobes: 1, surface_amplitude: 0.5 mm, rock_stiffness: 60 MN/m, friction: {static: 0.2, dynamic: 0.15}}
modes: {lateral: frozen, torsional: frozen}
operation: {depth: 1500 m, wob: 60 kN, rotary_speed: 120 rpm}
"""
RPM = math.pi / 30


def speed_of(*texts: str) -> float | None:
    study = parse_study(LOBE, "the test", list(texts))
    return bounce_speed(study.parameters, study.operation, derive(study.parameters, *astuple(study.operation)))


def test_on_hard_rock_under_a_long_string_a_bounce_gains_what_its_flight_loses():
    """Where contact is short and the string soft, v is W T/2m as the bit leaves the rock and v^2/3 on average;
    lobes that pass with the speed s w give the momentum W T at most: w^3 = pi^2 c W/(3 m^2 s)."""
    texts = ("operation.depth=10000 m", "bit.rock_stiffness=1e4 MN/m", "drillstring.axial_damping=100 kN*s/m")
    study = parse_study(LOBE, "the test", list(texts))
    k = derive(study.parameters, *astuple(study.operation))
    known = (math.pi**2 * 1e5 * 60e3 / (3 * float(k.m_a) ** 2 * 5e-4)) ** (1 / 3)
    assert speed_of(*texts) / SWING == pytest.approx(known, rel=0.05)


def test_the_lighter_the_bit_is_pressed_the_slower_a_bounce_lasts_and_without_weight_at_any_speed():
    """So 0 without weight is no special case: a bit that hardly anything presses leaves the rock at each lobe."""
    speeds = [speed_of(f"operation.wob={weight} kN") for weight in (60, 20, 5, 1, 0.1, 0.01, 0.001)]
    assert all(slow <= fast for fast, slow in itertools.pairwise(speeds))
    assert speeds[-1] < 0.02 * speeds[0]
    assert speed_of("operation.wob=0 N") == 0.0


def test_no_bounce_lasts_without_lobes_or_with_much_damping_and_any_without_weight_or_damping():
    assert speed_of("bit.surface_amplitude=0 mm") is None
    assert speed_of("drillstring.axial_damping=2 MN*s/m") is None
    assert speed_of("operation.wob=0 kN") == 0.0
    assert speed_of("drillstring.axial_damping=0 N*s/m") == 0.0


BITS = [
    (),
    ("drillstring.axial_damping=16 kN*s/m",),
    ("bit.lobes=3", "bit.surface_amplitude=0.2 mm"),
    ("bit.rock_stiffness=25 MN/m", "bit.surface_amplitude=1 mm"),
    ("operation.wob=20 kN", "operation.depth=800 m", "drillstring.axial_damping=16 kN*s/m"),
]


@pytest.mark.parametrize("bit", BITS)
def test_a_bounce_lasts_from_little_above_that_speed_and_below_it_none_does(bit):
    """Started at the top of the bounce, in step with the lobes, it goes on 10 % above the limit, far below the
    resonance; of many starts from lifts up to 300 times the depth of the bit in the rock none does 3 % below it."""
    limit = speed_of(*bit) / SWING
    study = parse_study(LOBE, "the test", [*bit, f"operation.rotary_speed={1.1 * limit} rad/s"])
    k = derive(study.parameters, *astuple(study.operation))
    assert 1.1 * limit < 0.8 * lobe_resonance(study.parameters, k)
    at = bounce(study.parameters, 1.1 * limit, study.operation, k)
    assert at is not None
    times = ["simulation.transient=400 s", "simulation.observe=30 s"]
    top = [f"initial.z={at.height} m", f"initial.drive_angle={at.phase / study.parameters.bit.lobes} rad"]
    one = parse_study(LOBE, "the test", [*bit, f"operation.rotary_speed={1.1 * limit} rad/s", *top, *times])
    assert float(run_in_memory(one, workers=1)["lift_off_fraction"].squeeze()) > 0.3
    depth = float(study.operation.wob) / float(k.k_a + study.parameters.bit.rock_stiffness)
    lifts = ", ".join(f"{depth * one} m" for one in np.geomspace(0.5, 300.0, 24))
    phases = ", ".join(f"{math.pi / study.parameters.bit.lobes * one} rad" for one in (-0.75, 0.0, 0.75))
    sweep = f"{{initial.z: [{lifts}], initial.drive_angle: [{phases}], procedure: same}}"
    speed = f"operation.rotary_speed={0.97 * limit} rad/s"
    none = run_in_memory(parse_study(LOBE + f"sweep: {sweep}\n", "the test", [*bit, speed, *times]), workers=1)
    assert float(np.max(none["lift_off_fraction"])) == 0.0


def test_the_motion_that_may_last_begins_there_and_not_at_the_resonance():
    """At 30 kN from 59 rpm on, and at 283 rpm it begins."""
    sweep = "{wob: [30 kN, 70 kN], rotary_speed: [40 rpm, 240 rpm], procedure: up-down, along: rotary_speed}"
    study = parse_study(f"{LOBE.replace(', torsional: frozen', '')}sweep: {sweep}\n")
    (one,) = (one for one in lasting_motions(study) if one["name"] == "lobe_resonance")
    assert one["min"] > 250 * RPM
    assert one["lasts"] == pytest.approx([speed_of(f"operation.wob={wob} kN") for wob in (30, 70)])
    assert one["lasts"][0] == pytest.approx(59.3 * RPM, abs=0.1 * RPM)


def test_a_sweep_that_meets_no_bounce_is_safe_from_below_where_one_may_last():
    """At 60 kN none is met up to 240 rpm. Below 75 rpm none lasts, whatever went before."""
    sweep = "{rotary_speed: {from: 40 rpm, to: 200 rpm, points: 9}, procedure: up-down}"
    text = f"{LOBE.replace(', torsional: frozen', '')}sweep: {sweep}\nsimulation: {{transient: 60 s, observe: 20 s}}\n"
    results = with_lasting_motions(run_in_memory(parse_study(text), workers=1))
    grade = graded(results).grade.ravel()
    assert list(grade[:2]) == [Grade.ANY_HISTORY] * 2
    assert list(grade[2:]) == [Grade.FROM_BELOW] * 7


def test_of_a_bit_on_the_surface_that_its_blades_leave_not_all_that_lasts_is_told():
    study = parse_study(LOBE.replace(", torsional: frozen", ""), "the test", ["bit.surface_amplitude=0 mm"])
    assert tells_what_lasts(study)
    cutting = "bit: {rock: {law: regenerative}}\noperation: {depth: 1500 m, wob: 60 kN, rotary_speed: 120 rpm}\n"
    assert not tells_what_lasts(parse_study(cutting))
