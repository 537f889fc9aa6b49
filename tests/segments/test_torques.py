"""Friction of the bit as torques of the whole bit in a string of segments, off bottom."""

import math

import numpy as np
import pytest

import nsdrill
from nsdrill.errors import InputError
from nsdrill.models.segments.checks import drilling_at

STRING = """
model: segments
segments: {{pipe: 5, collar: 2, hydraulics: {{pulsation: 0 m^3/s}}}}
drillstring: {{pipe: {{outer_diameter: 5 in, inner_diameter: 4.276 in}}}}
bit: {{friction: {friction}}}
drive: {{kind: ideal}}
operation: {{depth: 2000 m, wob: {wob}, rotary_speed: {speed}}}
initial: {{start: {start}}}
record: {{exponent: {exponent}}}
simulation: {{transient: 40 s, observe: 60 s, method: {method}, rtol: {rtol}}}
"""
TORQUES = "{static: 12 kN*m, dynamic: 7 kN*m, smoothing: 50 s/rad}"


def study_of(friction=TORQUES, wob="0 kN", speed="6 rad/s", start="rest", method="auto", exponent="false", rtol="1e-6"):
    return STRING.format(
        friction=friction, wob=wob, speed=speed, start=start, method=method, exponent=exponent, rtol=rtol
    )


def run(**choices):
    return nsdrill.run(study_of(**choices), progress=False).squeeze()


def test_both_methods_give_the_same_stick_slip():
    explicit, implicit = run(method="explicit"), run(method="implicit")
    assert float(implicit.stuck_fraction) > 0.4
    for name in ("stick_slip_period", "bit_speed_max", "surface_torque_min", "surface_torque_max", "stuck_fraction"):
        assert float(implicit[name]) == pytest.approx(float(explicit[name]), rel=1e-3), name
    assert int(implicit.steps) < int(explicit.steps)


def test_a_deviation_neither_grows_nor_decays_along_a_cycle():
    """The tangent of both methods: the largest exponent of a stable cycle is 0, and off bottom
    no contact that the bit grazes adds to it."""
    for method in ("explicit", "implicit"):
        found = run(method=method, exponent="true", rtol="1e-7")
        assert abs(float(found.lyapunov_exponent)) < 2 * float(found.lyapunov_error) + 2e-3, method


def test_check_says_where_the_error_of_an_exponent_does_not_hold_it():
    """The exponent of a cycle is 0; at the default tolerance steep torques shift it by more
    than two errors, at that which check asks for they do not."""

    def warned(smoothing=500, **choices):
        text = study_of(friction=TORQUES.replace("50 s", f"{smoothing} s"), **choices)
        return text, [one for one in nsdrill.check(text).warnings if one.startswith("Exponent")]

    text, [warning] = warned(exponent="true")
    assert warning.endswith("lyapunov_error does not hold that. Set simulation.rtol: 1e-07.")
    rough, fine = (
        nsdrill.run(one, progress=False).squeeze() for one in (text, text.replace("rtol: 1e-6", "rtol: 1e-7"))
    )
    assert float(rough.lyapunov_exponent) < -2 * float(rough.lyapunov_error)
    assert abs(float(fine.lyapunov_exponent)) < 2e-3
    assert not warned(exponent="true", rtol="1e-7")[1]
    assert not warned(exponent="true", smoothing=50)[1]
    assert not warned(exponent="true", method="explicit")[1]
    assert not warned(exponent="false")[1]


def test_a_bit_off_bottom_meets_no_rock():
    """Neither lobes nor rock damping matter: all is as on a smooth rock."""
    lobed, smooth = (
        nsdrill.run(study_of(start="steady").replace("bit: {", f"bit: {{surface_amplitude: {height}, "), progress=False)
        for height in ("5 mm", "0 mm")
    )
    assert float(lobed.bit_force_max) == 0.0
    assert abs(float(lobed.axial_max)) < 1e-9
    assert float(lobed.bit_speed_max) == pytest.approx(float(smooth.bit_speed_max), rel=1e-5)


def test_a_string_that_turns_steadily_takes_the_torque_of_the_law():
    """g [(T_s - T_d) / (1 + tau w) + T_d] and the drag of the mud, at 30 rad/s."""
    found = run(start="steady", speed="30 rad/s")
    study = nsdrill.load_study(study_of(speed="30 rad/s"))
    drilling = drilling_at(study.parameters, study.operation)
    torque = 2 / math.pi * math.atan(50 * 30) * (5e3 / (1 + 3 * 30) + 7e3)
    mud = drilling.torque - drilling.top_drag * 30 - torque
    assert 0 < mud < 0.03 * torque
    assert float(found.surface_torque_mean) == pytest.approx(torque + mud, rel=1e-6)


def test_the_torques_do_not_depend_on_the_weight():
    loaded = run(wob="50 kN")
    for name in ("stick_slip_period", "bit_speed_max"):
        assert float(loaded[name]) == pytest.approx(float(run()[name]), rel=1e-3)


def test_a_torque_is_an_axis_and_a_setting():
    text = study_of(friction="{dynamic: 7 kN*m}") + "sweep: {bit.friction.static: [8 kN*m, 12 kN*m]}\n"
    found = nsdrill.run(text, progress=False).squeeze()
    assert np.all(np.diff(found.surface_torque_max) > 2e3)
    trace = nsdrill.simulate(
        study_of(), at={"bit.friction.static": "2 kN*m", "bit.friction.dynamic": "1 kN*m"}, duration="20 s"
    )
    assert float(np.abs(trace.bit_torque).max()) < 2e3


@pytest.mark.parametrize(
    ("friction", "words"),
    [
        ("{static: 12 kN*m}", "dynamic"),
        ("{static: 7 kN*m, dynamic: 12 kN*m}", "at most"),
        ("{static: 12 kN*m, dynamic: 7 kN*m, level: 0.1}", "friction as torques does not read"),
        ("{smoothing: 100 s/rad}", "only friction as torques reads"),
        ("{static: 0.4}", "static"),
    ],
)
def test_what_does_not_fit_together_is_refused(friction, words):
    with pytest.raises(InputError, match=words):
        nsdrill.load_study(study_of(friction=friction))


def test_a_string_that_nothing_brakes_is_told():
    told = nsdrill.check(study_of(friction="{}")).warnings
    assert any("nothing but the mud brakes the string" in warning for warning in told)
    assert not nsdrill.check(study_of()).warnings
