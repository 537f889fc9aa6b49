"""Friction of the string of segments along the wall of an inclined hole."""

import math
from itertools import pairwise

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.cycles import rises_of
from nsdrill.errors import InputError
from nsdrill.models.operation import Operation
from nsdrill.models.responses import BIT_BOUNCE
from nsdrill.models.sections import Section
from nsdrill.models.segments.checks import drilling_at
from nsdrill.models.segments.parameters import Parameters, WallFriction
from nsdrill.models.segments.string import string_of
from nsdrill.models.segments.wall import levers
from nsdrill.models.tree import with_values

STRING = """
model: segments
segments: {{pipe: 5, collar: 2, rock_damping: 0 N*s/m, material_damping: {{torsional: 15 ms}},
  hydraulics: {{pulsation: 0 m^3/s}}}}
well: {{inclination: 40 deg, friction_along: {friction}}}
bit: {{surface_amplitude: 0 mm, cutting: {{zeta: 0}}, friction: {{level: 0}}}}
drive: {{kind: ideal}}
operation: {{depth: 2000 m, wob: 0 kN, rotary_speed: {speed}}}
initial: {{start: {start}}}
record: {{exponent: {exponent}}}
simulation: {{transient: 40 s, observe: 60 s, method: {method}}}
"""
STICKY = "{static: 0.3, dynamic: 0.15, smoothing: 200 s/rad}"


def study_of(friction=STICKY, speed="6 rad/s", start="rest", method="auto", exponent="false"):
    return STRING.format(friction=friction, speed=speed, start=start, method=method, exponent=exponent)


def run(**choices):
    return nsdrill.run(study_of(**choices)).squeeze()


def parameters_of(inclination, friction):
    return with_values(Parameters(), {"well.inclination": inclination, "well.friction_along": friction})


def loads(parameters, depth):
    return levers(parameters, string_of(parameters, depth).rubbing_parts)


def test_two_sections_rub_as_pipe_and_collar():
    as_pipe = parameters_of(math.radians(35.0), WallFriction(0.3, 0.3))
    drill = as_pipe.drillstring
    sections = (
        Section(1800.0, drill.pipe.outer_diameter, drill.pipe.inner_diameter),
        Section(drill.collar.length, drill.collar.outer_diameter, drill.collar.inner_diameter),
    )
    as_sections = with_values(as_pipe, {"drillstring.sections": sections})
    assert loads(as_sections, 2000.0) == pytest.approx(loads(as_pipe, 2000.0), rel=1e-12)


def test_the_loads_are_those_of_the_weight_in_mud():
    """Closed form of one inclination: (rho - rho_f) g A L sin(a) D/2 of pipe and collars."""
    parameters = parameters_of(math.radians(35.0), WallFriction(0.3, 0.3))
    drill, expected = parameters.drillstring, 0.0
    for tube, length in ((drill.pipe, 2000.0), (drill.collar, 200.0)):
        area = math.pi / 4 * (tube.outer_diameter**2 - tube.inner_diameter**2)
        expected += (7850 - 1198) * 9.80665 * area * length * math.sin(math.radians(35.0)) * tube.outer_diameter / 2
    assert sum(loads(parameters, 2200.0)) == pytest.approx(expected, rel=1e-12)
    several = loads(parameters, np.array([1500.0, 2200.0]))
    assert sum(lever[1] for lever in several) == pytest.approx(expected, rel=1e-12)


def test_a_string_that_turns_steadily_takes_the_torque_of_check():
    found = run(friction="{static: 0.3, dynamic: 0.3}", start="steady")
    study = nsdrill.load_study(study_of(friction="{static: 0.3, dynamic: 0.3}"))
    drilling = drilling_at(study.parameters, study.operation)
    torque = drilling.torque - drilling.top_drag * drilling.speed  # below the top
    assert float(found.surface_torque_mean) == pytest.approx(torque, rel=1e-6)
    assert torque == pytest.approx(0.3 * sum(loads(study.parameters, 2000.0)), rel=0.02)  # and the drag of the mud


def test_a_bit_off_bottom_does_not_bounce():
    assert not int(run(friction="{static: 0.3, dynamic: 0.3}", start="steady").response) & BIT_BOUNCE


def test_the_string_sticks_and_slips_by_the_wall_alone():
    """And the bit turns back, which one whose friction sits at the bit never does."""
    found = run()
    assert float(found.stick_slip_index) > 100
    assert float(found.bit_speed_min) < -0.2
    assert np.isfinite(found.stick_slip_period)


def test_both_methods_give_the_same_motion():
    explicit, implicit = run(method="explicit"), run(method="implicit")
    for name in ("stick_slip_period", "bit_speed_max", "surface_torque_min", "surface_torque_max"):
        assert float(implicit[name]) == pytest.approx(float(explicit[name]), rel=1e-3), name
    assert int(implicit.steps) < int(explicit.steps)


def test_a_bit_that_cuts_creeps_beside_a_wall():
    """The cutters and the wall brake different nodes."""
    text = (
        study_of().replace("zeta: 0", "zeta: 1").replace("wob: 0 kN", "wob: 100 kN").replace("level: 0", "level: 0.06")
    )
    explicit, implicit = (
        nsdrill.run(text.replace("method: auto", f"method: {method}")).squeeze() for method in ("explicit", "implicit")
    )
    assert int(implicit.status) == 1
    assert float(implicit.stick_slip_period) == pytest.approx(float(explicit.stick_slip_period), rel=2e-3)


def test_a_deviation_neither_grows_nor_decays_along_a_cycle():
    """The tangent of both methods: the largest exponent of a stable cycle is 0."""
    for method in ("explicit", "implicit"):
        text = study_of(method=method, exponent="true").replace("wob: 0 kN", "wob: 10 kN")  # the bit stays on the rock
        found = nsdrill.run(text).squeeze()
        assert abs(float(found.lyapunov_exponent)) < 2 * float(found.lyapunov_error) + 2e-3, method


def test_below_the_onset_steady_rotation_is_left():
    """Friction at the wall falls with speed near the threshold only: onset above it."""
    study = nsdrill.load_study(study_of())
    onset = drilling_at(study.parameters, study.operation).onset
    assert onset is not None
    assert 0.9 < onset.speed < 3.0
    text = study_of(start="steady").replace("transient: 40 s", "transient: 400 s")
    text = text.replace("start: steady", "start: steady, bit_speed: {}")
    for factor, sticks in ((0.9, True), (1.1, False)):
        speed = factor * float(onset.speed)
        found = nsdrill.run(text.replace("6 rad/s", f"{speed} rad/s").replace("{}", f"{0.99 * speed} rad/s")).squeeze()
        assert (float(found.stick_slip_index) > 50) == sticks, factor


def test_friction_of_zero_is_no_friction():
    none, zero = run(friction="null"), run(friction="{static: 0}")
    for name in ("bit_speed_max", "surface_torque_max", "steps"):
        assert float(none[name]) == float(zero[name])


def test_an_axis_of_friction_begins_at_none():
    """A point without friction, compiled with it, has the bits of one compiled without."""
    text = study_of(friction="{smoothing: 200 s/rad}") + "sweep: {well.friction_along.static: [0, 0.5]}\n"
    found, alone = nsdrill.run(text).squeeze(), run(friction="null")
    first = found.isel(well_friction_along_static=0)
    assert float(first.surface_torque_mean) == pytest.approx(float(alone.surface_torque_mean), rel=1e-6, abs=1e-3)
    assert float(found.isel(well_friction_along_static=1).surface_torque_mean) > 100


def test_a_deviation_off_bottom_is_measured():
    """Without weight the depth of cut has no slope that is infinite."""
    found = run(friction="null", exponent="true", start="steady")
    assert np.isfinite(found.lyapunov_exponent)


@pytest.mark.parametrize(
    ("friction", "words"),
    [
        ("{static: 0.2, dynamic: 0.3}", "well.friction_along.dynamic"),
        ("null, survey: [{depth: 500 m}, {depth: 300 m}]", "stations whose depths ascend"),
    ],
)
def test_what_does_not_fit_together_is_refused(friction, words):
    with pytest.raises(InputError, match=words):
        nsdrill.load_study(study_of(friction=friction))


def test_a_vertical_hole_is_told():
    told = nsdrill.check(study_of().replace("40 deg", "0 deg"))
    assert any("the hole is vertical" in warning for warning in told.warnings)


def test_steady_drilling_at_one_speed_balances():
    study = nsdrill.load_study(study_of())
    drilling = drilling_at(study.parameters, Operation(2000.0, 0.0, 6.0))
    assert drilling.estimates is not None
    assert drilling.estimates.period > 2 * math.pi / drilling.frequency


WELL_B = """
model: segments
title: Well B of Aarsnes and Shor 2018, 1733 m, off bottom
drillstring:
  pipe: {outer_diameter: 146.529 mm, inner_diameter: 123.024 mm}
  collar: {outer_diameter: 175.7 mm, inner_diameter: 96.8 mm, length: 230 m}
  material: {shear_modulus: 61 GPa}
mud: {density: 1500 kg/m^3}
well:
  diameter: 311.15 mm
  survey:
    - {depth: 300 m, inclination: 0 deg}
    - {depth: 700 m, inclination: 40 deg}
    - {depth: 1250 m, inclination: 40 deg}
    - {depth: 1300 m, inclination: 45 deg}
  friction_along: {static: 0.83, dynamic: 0.415, threshold: 0.9 rad/s}
bit: {surface_amplitude: 0 mm, cutting: {zeta: 0}, friction: {level: 0}}
segments: {pipe: 20, collar: 5, rock_damping: 0 N*s/m, hydraulics: {pulsation: 0 m^3/s},
  material_damping: {torsional: 3.5 ms}}
drive: {kind: stiff}
operation: {depth: 1733 m, wob: 0 kN}
initial: {start: rest}
"""


@pytest.mark.parametrize(
    ("speed", "period", "least"),  # s and kN m, means of the cycles in figures 15 to 18 of the paper
    [(57.2, 4.08, 5.2), (64.7, 3.82, 1.9), (69.7, 3.96, 2.2), (84.3, 3.58, 2.1)],
)
def test_a_well_off_bottom(speed, period, least):
    """Coefficients and damping were chosen with the torques and the greatest speeds in
    view. The least torque is the mean over the cycles."""
    trace = nsdrill.simulate(WELL_B, rotary_speed=f"{speed} rpm", duration="200 s", sample="20 ms")
    trace = trace.sel(time=slice(60, None))
    time, torque = trace.time.values, trace.surface_torque.values
    rises = rises_of(time, trace.bit_speed.values)
    lowest = [torque[(time >= a) & (time < b)].min() for a, b in pairwise(rises)]
    assert np.diff(rises).mean() == pytest.approx(period, rel=0.07)
    assert np.mean(lowest) / 1e3 == pytest.approx(least, abs=1.5)
    assert trace.bit_speed.min() < -0.3  # measured: -13 rpm; friction at the bit alone gives 0
