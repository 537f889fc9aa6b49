"""Steady drilling and the linearised string, which come from the differentiated equations,
against equations of motion that are written here by themselves; and what ``check`` says
of drives that droop or stall."""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest
from scipy.optimize import brentq

import nsdrill
from nsdrill.app.check import check, operation_of
from nsdrill.equations.trace import prepared
from nsdrill.models.christoforou_yigit import table, twist
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.drives import gains
from nsdrill.models.christoforou_yigit.equations import equations
from nsdrill.models.christoforou_yigit.table import drilling_at
from nsdrill.models.drilling import Drilling, find_folds
from nsdrill.models.tree import with_values
from nsdrill.study import parse_study

# A constant torque on a table with damping, above a disc: 2122 and 374 kg m^2, 473 N m/rad,
# 425, 50 and 23.2 N m s/rad; the bit of Navarro-Lopez and others under 97 347 N.
SOFT = """
modes: {{axial: frozen, lateral: frozen}}
well: {{diameter: 0.466725 m}}
bit:
  cutting: {{zeta: 0}}
  friction: {{law: exponential, static: 0.8, dynamic: 0.5, decay: 0.9 s/rad, smoothing: 500 s/rad}}
drillstring:
  torsional_damping: 50 N*m*s/rad
  pipe: {{outer_diameter: 0.1261505 m, inner_diameter: 0.1072279 m}}
  collar: {{outer_diameter: 0.212078 m, inner_diameter: 0 m, length: 200 m, span: 19 m}}
drive: {{kind: pi, inertia: 2122 kg*m^2, stiffness: 0 N*m/rad, damping: 425 N*m*s/rad, shaft_damping: 23.2 N*m*s/rad}}
operation: {{depth: 2200 m, wob: 97347 N, rotary_speed: {} rad/s}}
"""


def rock(omega: float) -> float:
    """The torque of the bit."""
    arm = 2 / 3 * 0.466725 / 2
    return 97347 * arm * 2 / math.pi * math.atan(500 * omega) * (0.3 * math.exp(-0.9 * abs(omega)) + 0.5)


def set_speed_of(omega: float) -> float:
    """The set speed at which motor and bit balance at the bit speed ``omega``."""
    return omega + (rock(omega) + 50 * omega) / 425


def growth(omega: float, J: float = 373.999, k: float = 473.0) -> float:
    """The greatest real part of an eigenvalue at the balance with this bit speed, by finite
    differences."""
    fall = (rock(omega + 1e-5) - rock(omega - 1e-5)) / 2e-5
    matrix = [  # of the twist of the pipe, the speeds of table and bit
        [0, -1, 1],
        [k / 2122, -(425 + 23.2) / 2122, 23.2 / 2122],
        [-k / J, 23.2 / J, -(50 + 23.2 + fall) / J],
    ]
    return float(np.linalg.eigvals(np.array(matrix)).real.max())


def test_speeds_are_those_of_the_balance_of_motor_and_bit():
    """The Hopf point is at a bit speed of 4.1766 rad/s, which takes a set speed of 22.729
    and 9.66 kN m of the table; at 23.53 rad/s the bit turns at 5.0 with 7.87 kN m."""
    omega = brentq(growth, 2.0, 8.0)
    assert omega == pytest.approx(4.1766, abs=2e-4)
    figures = check(parse_study(SOFT.format(23.53))).figures
    assert figures["stick_slip_onset_at_bit"].value == pytest.approx(omega, rel=1e-5)
    assert figures["stick_slip_onset"].value == pytest.approx(set_speed_of(omega), rel=1e-6)
    assert figures["stick_slip_onset"].value == pytest.approx(22.729, abs=1e-3)
    balance = brentq(lambda w: set_speed_of(w) - 23.53, 4.5, 8.0)
    assert figures["balance_speed"].value == pytest.approx(balance, rel=1e-8)
    assert figures["mean_torque"].value == pytest.approx(rock(balance) + 50 * balance, rel=1e-8)
    k_t = 473.0
    assert figures["static_twist"].value == pytest.approx(-figures["mean_torque"].value / k_t, rel=1e-4)
    assert figures["droop"].value == pytest.approx(23.53 - balance, rel=1e-8)
    assert figures["wall_speed"].value == pytest.approx(set_speed_of(figures["wall_speed_at_bit"].value), rel=1e-6)
    fold = figures["stick_slip_fold_at_bit"].value  # a speed of steady drilling, beside which it lasts
    assert figures["stick_slip_fold"].value == pytest.approx(set_speed_of(fold), rel=1e-6)
    assert figures["stick_slip_fold"].value > figures["stick_slip_onset"].value


def test_a_drive_that_turns_much_slower_than_it_is_set_is_told():
    """At 23.53 rad/s the bit turns at 5.0: without a word a safe window was one of another speed. One
    that holds its speed is not told of."""
    told = [one for one in check(parse_study(SOFT.format(23.53))).warnings if one.startswith("Slower than set")]
    assert len(told) == 1
    balance = brentq(lambda w: set_speed_of(w) - 23.53, 4.5, 8.0)
    assert "at a set speed of 23.53 rad/s" in told[0]
    assert f"turns at {balance:.4g} rad/s" in told[0]
    assert f"To turn at 23.53 rad/s, set {set_speed_of(23.53):.4g} rad/s" in told[0]
    stiff = SOFT.format(23.53).replace(
        "kind: pi, inertia: 2122 kg*m^2, stiffness: 0", "kind: pi, inertia: 2122 kg*m^2, stiffness: 500"
    )
    assert not any("Slower" in one for one in check(parse_study(stiff)).warnings)


def test_a_set_speed_without_a_balance_that_turns_is_told():
    """8500 N m at rest and less in motion: less than the bit takes to turn."""
    slow, fast = (check(parse_study(SOFT.format(speed))) for speed in (20, 35))
    assert slow.figures["balance_speed"].value is None
    assert slow.as_json()["figures"]["balance_speed"]["value"] is None
    told = " ".join(slow.warnings)
    assert "At rest: at a set speed of 20 rad/s" in told
    assert "the only balance of motor and bit is the resting bit" in told
    least = min(set_speed_of(w) for w in np.linspace(1.0, 20.0, 2000))
    assert f"It turns from a set speed of {least:.4g} rad/s on" in told
    assert not any("At rest" in warning or "Stalls" in warning for warning in fast.warnings)
    # it rests as the run does
    rest = brentq(lambda w: set_speed_of(w) - 20.0, 1e-6, 0.1)
    assert slow.figures["mean_torque"].value == pytest.approx(rock(rest) + 50 * rest, rel=1e-8)


def with_twist_gain(gain, damping, speed):
    drive = f"{{kind: pi, stiffness: 0 N*m/rad, damping: {damping} N*m*s/rad, twist_gain: {gain} N*m/rad}}"
    return parse_study(
        f"modes: {{axial: frozen, lateral: frozen}}\ndrive: {drive}\noperation: {{rotary_speed: {speed} rad/s}}"
    )


@pytest.mark.parametrize(("gain", "speed"), [(500, 3), (500, 6), (400, 3), (300, 6)])
def test_a_drive_that_overshoots_its_set_speed_balances_beyond_it(gain, speed):
    """A gain on the twist above the stiffness of the string: the torque of the motor exceeds
    the load, and the bit settles well above the set speed."""
    study = with_twist_gain(gain, 300, speed)
    report, operation = check(study), operation_of(study)
    k, string = derive(study.parameters, *astuple(operation)), drilling_at(study.parameters, operation).string

    def surplus(w: float) -> float:  # the torque of the motor over that of the load
        load = float(string.bit_torque(w, speed)) + study.parameters.drillstring.torsional_damping * w
        return 300.0 * (speed - w) + gain * load / float(k.k_t) - load

    balance = brentq(surplus, 1.001 * speed, 10 * speed)
    assert balance > 1.3 * speed
    assert report.figures["balance_speed"].value == pytest.approx(balance, rel=1e-6)
    assert report.figures["droop"].value == pytest.approx(speed - balance, rel=1e-6)
    if gain == 500:  # the speeds at which runs of these settle
        assert balance == pytest.approx({3: 9.8725, 6: 13.6941}[speed], abs=1e-3)
    assert not any(one.startswith(("At rest", "Stalls", "No balance")) for one in report.warnings)


def test_a_drive_that_speeds_up_without_end_is_told():
    told = " ".join(check(with_twist_gain(2000, 300, 3)).warnings)
    assert "No balance: at a set speed of 3 rad/s" in told
    assert "set speed of -" not in told
    assert "At rest" not in told


@pytest.mark.parametrize("model", ["christoforou_yigit", "regenerative", "segments"])
def test_a_drive_without_any_torque_is_told(model):
    """No set speed changes what it gives the bit."""
    study = f"model: {model}\noperation: {{wob: 60 kN, rotary_speed: 8 rad/s}}\n"
    study += "drive: {kind: pi, stiffness: 0 N*m/rad, damping: 0 N*m*s/rad}\n"
    report = check(parse_study(study))
    assert report.figures["balance_speed"].value is None
    assert any(warning.startswith("At rest") for warning in report.warnings)


def test_a_drive_that_swings_the_string_ever_wider_is_told():
    """Beside it no cycle of stick-slip is found: the deviations grow beyond all numbers."""
    drive = "drive: {kind: pi, shaft_damping: 10 kN*m*s/rad, twist_gain: 1e9 N*m/rad}\n"
    report = check(parse_study(f"operation: {{rotary_speed: 4 rad/s}}\n{drive}"))
    assert any(warning.startswith("Unstable") for warning in report.warnings), report.warnings


LIMITED = """
modes: {{axial: frozen, lateral: frozen}}
operation: {{depth: 5000 m, wob: 66.72 kN, rotary_speed: 4 rad/s}}
bit: {{cutting: {{zeta: 0}}}}
drive: {{kind: soft_torque, torque_limit: {} kN*m}}
"""


def test_a_drive_that_cannot_break_the_bit_away_is_told():
    """2/3 x 0.1905 m x 66.72 kN x 0.5 = 4.237 kN m, of which the smoothed law has 92 % at
    the speed at which it is greatest."""
    reports = [check(parse_study(LIMITED.format(limit))) for limit in (2.0, 3.5, 4.0)]
    told = [[warning for warning in report.warnings if warning.startswith("Stalls")] for report in reports]
    assert [len(warnings) for warnings in told] == [1, 1, 0]
    needed = float(told[0][0].split("takes ")[1].split(" kN")[0])
    assert 0.9 * 4.237 < needed < 4.237
    assert "drive.torque_limit" in told[0][0]
    assert reports[0].figures["balance_speed"].value is None  # steady drilling takes 2.1 kN m


def test_a_drive_of_segments_that_cannot_break_the_bit_away_is_told():
    text = "model: segments\nsegments: {{pipe: 3, collar: 2}}\noperation: {{rotary_speed: 8 rad/s}}\ndrive: {{{}}}"
    for drive, stalls in (("kind: stiff, torque_limit: 2 kN*m", True), ("kind: stiff, torque_limit: 40 kN*m", False)):
        warnings = check(parse_study(text.format(drive))).warnings
        assert any(warning.startswith("Stalls") for warning in warnings) is stalls


def dragged(t, phase, s, p, o):
    """The equations with a further torque on the bit, 200 N m s/rad times its speed."""
    slopes, outputs = _own(t, phase, s, p, o)
    return slopes | {"bit_speed": slopes["bit_speed"] - 200.0 * s.bit_speed * p.per_inertia}, outputs


_own = prepared(equations)


@pytest.mark.parametrize("kind", ["ideal", "stiff", "lqr", "dc_motor", "regulated"])
def test_a_term_of_the_equations_reaches_check(monkeypatch, kind):
    """A drag of the bit in the equations does what the same torsional damping does, which
    is a number of the model: torque, slope, onset, fold, and the gains that are tuned to
    the string."""
    drive = "dc_motor, gains: [0.0272, 22.2, 1.138, -13.03, 15.6]" if kind == "regulated" else kind
    study = parse_study(f"operation: {{wob: 66.72 kN}}\ndrive: {{kind: {drive}}}")
    damped = with_values(study.parameters, {"drillstring.torsional_damping": 250.0})
    plain, expected = drilling_at(study.parameters, study.operation), drilling_at(damped, study.operation)
    wanted = [expected.torque, expected.withstood, expected.onset.set_speed, expected.fold.set_speed]
    k = derive(study.parameters, 5000.0, 66.72e3, 3.0)
    law = gains(damped, k, 3.0) if kind == "lqr" else None
    monkeypatch.setattr(twist, "equations", dragged)
    table._drilling.cache_clear()
    try:
        found = drilling_at(study.parameters, study.operation)
        got = [found.torque, found.withstood, found.onset.set_speed, found.fold.set_speed]
        assert got == pytest.approx(wanted, rel=1e-9)
        assert found.withstood > plain.withstood + 20.0
        if law is not None:
            assert gains(study.parameters, k, 3.0) == pytest.approx(law, rel=1e-8)
        if kind == "regulated":
            assert found.speed == pytest.approx(3.0, rel=1e-12)  # its torque is that of these equations
    finally:
        table._drilling.cache_clear()


@pytest.mark.parametrize(
    ("drive", "wob", "hopf"),
    [("ideal", 66.72, 3.770), ("stiff", 66.72, 3.683), ("soft_torque", 66.72, 2.149), ("ideal", 22.24, 2.036)],
)
def test_the_onset_is_the_hopf_point(drive, wob, hopf):
    """By continuation of the torsional motion; docs/drives.md."""
    study = parse_study(f"operation: {{wob: {wob} kN}}\ndrive: {{kind: {drive}}}")
    onset = check(study).figures["stick_slip_onset"].value
    assert onset == pytest.approx(hopf, abs=6e-4)


@pytest.mark.parametrize(
    ("wob", "speed", "drive"),
    [(66.72, 2, "ideal"), (66.72, 6, "ideal"), (22.24, 2, "ideal"), (66.72, 2, "soft_torque")],
)
def test_stick_slip_is_as_estimated(wob, speed, drive):
    """Period within 4 % and greatest speed within 8 % of a run of the torsional model."""
    study = parse_study(
        f"modes: {{axial: frozen, lateral: frozen}}\ninitial: {{bit_speed: 0 rad/s}}\ndrive: {{kind: {drive}}}\n"
        f"operation: {{wob: {wob} kN, rotary_speed: {speed} rad/s}}"
    )
    figures = check(study).figures
    trace = nsdrill.simulate(study, duration=150.0, sample=0.02)
    late = trace.time.values > 80.0
    time, bit = trace.time.values[late], trace["bit_speed"].values[late]
    rises = time[:-1][(bit[:-1] < bit.max() / 2) & (bit[1:] >= bit.max() / 2)]
    assert figures["stick_slip_period"].value == pytest.approx(np.diff(rises).mean(), rel=0.04)
    assert figures["stick_slip_peak"].value == pytest.approx(bit.max(), rel=0.08)
    assert "estimate" in figures["stick_slip_period"].meaning


def test_aggressiveness_is_what_a_rig_measures():
    """36 T/(D W) in ft lbf, in and lbf; of friction alone it is the coefficient."""
    study = parse_study("operation: {wob: 25 klbf, rotary_speed: 100 rpm}\nbit: {cutting: {zeta: 0}}")
    figures = check(study).figures
    torque = (figures["mean_torque"].value - 50.0 * study.operation.rotary_speed) / 1.3558179483
    assert figures["aggressiveness"].value == pytest.approx(36 * torque / (15.0 * 25e3), rel=1e-9)
    speed, law = study.operation.rotary_speed, study.parameters.bit.friction
    coefficient = (law.static - law.dynamic) / (1 + law.decay * speed) + law.dynamic
    assert figures["aggressiveness"].value == pytest.approx(coefficient, rel=1e-3)


def test_the_rate_at_which_resonance_is_passed():
    """(pi/2) (e W / gap)^2 with the speed W at which the collar reaches the wall: 6 mm are
    passed a quarter as fast as 12.7 mm, and 2 mm at any rate, as the mud keeps the collar
    off the wall."""
    found = []
    for eccentricity in (2, 6, 12.7):
        figures = check(parse_study(f"drillstring: {{eccentricity: {eccentricity} mm}}")).figures
        speed = figures["wall_speed"].value or 0.0
        assert figures["passing_rate"].value == pytest.approx(
            math.pi / 2 * (eccentricity * 1e-3 * speed / 0.0762) ** 2, rel=1e-9
        )
        found.append(figures["passing_rate"].value)
    assert found[0] == 0.0
    assert 3.5 < found[2] / found[1] < (12.7 / 6) ** 2


@pytest.mark.parametrize(
    "drive",
    [
        "kind: ideal",
        "kind: pi, inertia: 2122 kg*m^2, damping: 425 N*m*s/rad, shaft_damping: 23.2 N*m*s/rad",
        "kind: pi, inertia: 2122 kg*m^2, stiffness: 0 N*m/rad, damping: 425 N*m*s/rad, shaft_damping: 23.2 N*m*s/rad",
    ],
)
def test_searches_together_have_the_bits_of_each_alone(drive):
    """One holds its speed, one its angle, and one droops; of a bit without weight nothing is
    found."""
    study = parse_study(f"drive: {{{drive}}}\noperation: {{depth: 2200 m, rotary_speed: 5 rad/s}}\n")
    parts = [study.parameters, with_values(study.parameters, {"bit.friction.static": 0.9})]
    settings = [(part, replace(study.operation, wob=wob)) for part in parts for wob in (0.0, 3e4, 9e4)]
    alone, together = ([replace(drilling_at(*one)) for one in settings] for _ in range(2))
    find_folds(together)
    assert [one.fold is None for one in together] == [one.wob == 0.0 for one in together]

    def bits(one: Drilling) -> list[bytes]:
        return [np.asarray(part, dtype=float).tobytes() for part in (one.rock_torque, *one.at, *one.onset, *one.fold)]

    assert [bits(one) for one in together if one.wob] == [bits(one) for one in alone if one.wob]


def test_strings_that_differ_in_weight_alone_have_one_table(monkeypatch):
    asked, values_of = [], table.values_of
    monkeypatch.setattr(table, "values_of", lambda *given: asked.append(np.unique(given[2])) or values_of(*given))
    study = parse_study("operation: {depth: 2345 m, rotary_speed: 5 rad/s}\n")
    find_folds([drilling_at(study.parameters, replace(study.operation, wob=wob)) for wob in (3e4, 6e4, 9e4)])
    assert [3e4, 6e4, 9e4] in [weights.tolist() for weights in asked]
