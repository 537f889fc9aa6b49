"""The drives of the model of its own whose numbers follow from its string: the regulator, and
the motor with its circuit, whose torque is a state."""

import math

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are
from scipy.optimize import brentq

import nsdrill
from nsdrill.analysis.bifurcations import HOPF
from nsdrill.equations import plain
from nsdrill.errors import InputError
from nsdrill.models.drive_laws import motor_torque
from nsdrill.models.operation import Operation, Values
from nsdrill.models.regenerative import drives
from nsdrill.models.regenerative.checks import drilling_at
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.variant import variant_at
from nsdrill.study import parse_study
from regenerative.test_main_model import OWN
from regenerative.test_main_model import text as main_text
from regenerative.test_surface import RPM, text

GAINS = "gains: [0.03, 42.0, 2.2, -33.0, 14.0]"
KINDS = {
    "lqr": "kind: lqr",
    "lqr with a damped shaft": "kind: lqr, shaft_damping: 40 N*m*s/rad",
    "limited lqr": "kind: lqr, torque_limit: 5.9 kN*m",
    "motor": "kind: dc_motor",
    "regulated motor": f"kind: dc_motor, {GAINS}, shaft_damping: 20 N*m*s/rad",
    "pi with a damped shaft": "kind: pi, shaft_damping: 40 N*m*s/rad",
}


@pytest.mark.parametrize("name", KINDS)
def test_a_drive_is_that_of_the_main_model(name):
    """Where both reduce to the same axial and torsional motion: what ``check`` says of small
    deviations, and a motion in which the bit nearly stops."""
    drive = f"drive: {{{KINDS[name]}}}\n"
    main, own = nsdrill.check(main_text(95, lines=drive)), nsdrill.check(OWN.format(rpm=95, wob=44.48, lines=drive))
    names = ("growth", "growth_frequency", "steady_threshold", "drive_mode_1", "drive_damping_1", "balance_speed")
    for one in (*names, "mean_torque", "drive_reflection", "torque_reserve"):
        found, wanted = (report.figures[one].value if one in report.figures else None for report in (own, main))
        assert found == (None if wanted is None else pytest.approx(wanted, rel=1e-7)), one
    lines = f"{drive}initial: {{twist: -29 rad, vz: 1 mm/s}}\n"
    lines += "simulation: {transient: 0 s, observe: 6 s, rtol: 1.0e-10}\n"
    main = nsdrill.run(main_text(60, lines=lines), progress=False)
    own = nsdrill.run(OWN.format(rpm=60, wob=44.48, lines=lines), progress=False)
    for one in ("axial_min", "bit_speed_max", "drive_speed_min", "drive_speed_max", "surface_torque_max"):
        assert float(own[one].squeeze()) == pytest.approx(float(main[one].squeeze()), rel=1e-6), one
    assert float(own["drive_speed_min"].squeeze()) < 6.1  # of 6.283 rad/s: it yields


@pytest.mark.parametrize("name", KINDS)
def test_energy_changes_by_the_powers_at_any_state(name):
    """Its derivative along the slopes, by central differences, against the powers of rock,
    dampers and drive; that of a motor is V i - R i^2, with L i^2/2 among the energies."""
    study = parse_study(OWN.format(rpm=60, wob=44.48, lines=f"drive: {{{KINDS[name]}}}\n"))
    parameters, at = study.parameters, study.operation
    points = Values(parameters, study.initial, (at.depth, at.wob, at.rotary_speed))
    model, drive, speed = model_named("regenerative"), parameters.drive, at.rotary_speed
    variant, p = variant_at(model, parameters), dict(model.columns(points, Thresholds()))
    law = drives.below(parameters, at.depth).law(speed)
    voltage = drives.below(parameters, at.depth).regulator(at.wob, speed)

    def energy(s):
        found = 0.5 * s["vz"] ** 2 / p["per_mass"] + 0.5 * s["bit_speed"] ** 2 / p["per_inertia"] + at.wob * s["z"]
        found += (
            0.5 * p["axial_stiffness"] * s["z"] ** 2 + 0.5 * p["torsional_stiffness"] * (s["twist"] - s["lag"]) ** 2
        )
        found += 0.5 * law.inertia * s["drive_speed"] ** 2
        if drive.kind == "dc_motor":
            found += 0.5 * drive.circuit_time / drive.motor_damping * s["motor_torque"] ** 2
        return found

    def fed(s, force, torque):
        turned = s["drive_speed"]
        found = force * s["vz"] - torque * s["bit_speed"] - drive.shaft_damping * (turned - s["bit_speed"]) ** 2
        found -= p["axial_damping"] * s["vz"] ** 2 + p["torsional_damping"] * s["bit_speed"] ** 2
        if drive.kind != "dc_motor":
            given = motor_torque(law, drive.torque_limit, s["lag"], turned, s["twist"], s["bit_speed"], speed)
            return found + float(given) * turned
        idle = speed
        if drive.gains:
            feedback = voltage.torque * (s["motor_torque"] - voltage.steady_motor_torque) + voltage.lag * s["lag"]
            feedback += voltage.drive_speed * (turned - speed) + voltage.bit_speed * (s["bit_speed"] - speed)
            feedback += voltage.twist * (s["twist"] - voltage.steady_twist)
            idle += (voltage.steady_motor_torque - feedback) / drive.motor_damping
        return found + s["motor_torque"] * (idle - s["motor_torque"] / drive.motor_damping)

    rng, scales = np.random.default_rng(3), model.natural_scales(p, variant.options)
    start = {"surface_0": p["blade_depth"] / 2, "surface_1": p["blade_depth"] / 2, "twist": -29.0}
    start |= {"bit_speed": speed, "drive_speed": speed, "motor_torque": 5e3}
    if law.stiffness:  # the motor gives 5.9 kN m there, which is the limit of one
        lag = -(5.9e3 - 29.0 * law.twist_gain) / law.stiffness
        start |= {"lag": lag, "twist": lag - 29.0}
    wanted = {**variant.motion.slopes_named(), "force": variant.motion.named()["bit_force"]}
    wanted["torque"] = variant.motion.named()["bit_torque"]
    limited = 0
    for _ in range(20):
        s = {name: start.get(name, 0.0) + 2 * rng.normal() * float(scale)
             for name, scale in zip(variant.states, scales, strict=True)}  # fmt: skip
        given = {"time": 0.0, "phase": 0.0} | {f"s.{name}": value for name, value in s.items()}
        rates = plain.values(wanted, given | {f"p.{name}": value for name, value in p.items()})
        rates |= {"z": s["vz"], "twist": s["bit_speed"] - speed, "lag": s["drive_speed"] - speed}
        low, high = (energy({name: value + h * rates[name] for name, value in s.items()}) for h in (-1e-6, 1e-6))
        power = fed(s, rates["force"], rates["torque"])
        assert (high - low) / 2e-6 == pytest.approx(power, abs=1e-8 * energy(s))
        limited += (
            drive.torque_limit is not None
            and float(motor_torque(law, None, s["lag"], s["drive_speed"], s["twist"], s["bit_speed"], speed))
            > drive.torque_limit
        )
    assert limited > 0 or drive.torque_limit is None


def exact_growth(speed, wob, drive, guess):
    """The least stable root of axial and torsional motion with the exact delay, of the string
    of ``test_surface``, below a motor: an impedance K/(1 + s T) beside its inertia."""
    force, torque = 4 * 0.6 * 60e6 * 0.108, 4 * 60e6 * 0.108**2 / 2
    advance = (wob - 60e6 * 0.108 * 1.2e-3) / force * 4 / (2 * math.pi)

    def determinant(s):
        top = drive.top_inertia * s * s + s * drive.motor_damping / (1 + s * drive.circuit_time)
        back = 1 - np.exp(-s * 2 * math.pi / (4 * speed))
        axial = 34000 * s * s + 15600.0 * s + 7e5
        torsional = 116 * s * s + 32.9 * s + 938 * top / (938 + top)
        return (axial + force * back) * torsional - axial * torque * advance * back

    for _ in range(60):
        h = 1e-6
        guess -= determinant(guess) * 2 * h / (determinant(guess + h) - determinant(guess - h))
    return guess


def test_the_thresholds_below_a_motor_are_those_of_the_exact_delay():
    """The speed of the bit, as a motor droops, at which the deviation neither grows nor decays,
    and how fast it grows below it."""
    study = nsdrill.load_study(text(lines="drive: {kind: dc_motor, resistance: 5 ohm}\n"))
    drive, wob = study.parameters.drive, 15876.0
    exact = brentq(lambda v: exact_growth(v, wob, drive, 30.5j).real, 14.5, 15.7, xtol=1e-12)
    drilling = drilling_at(study.parameters, Operation(1000.0, wob, 120 * RPM))
    figures = nsdrill.check(study).figures
    assert drilling.speed < 0.97 * 120 * RPM
    assert figures["growth"].value == pytest.approx(exact_growth(120 * RPM, wob, drive, 30.5j).real, rel=0.05)
    assert figures["steady_threshold"].value == pytest.approx(exact, rel=1e-3)


def test_the_regulator_minimises_its_cost():
    """The gains are those at which another string's Riccati equation of this string, written
    out, has no residual: states lag, drive speed, twist below the drive, bit speed."""
    study = nsdrill.load_study(OWN.format(rpm=95, wob=44.48, lines="drive: {kind: lqr, shaft_damping: 40 N*m*s/rad}\n"))
    own = nsdrill.check(study).coefficients
    law, drive = drives.below(study.parameters, study.operation.depth).law(9.9), study.parameters.drive
    J, k, D, c, top = own.J, own.k_t, 50.0, 40.0, drive.inertia
    system = np.array([
        [0, 1, 0, 0], [0, -c / top, k / top, c / top], [0, -1, 0, 1], [0, c / J, -k / J, -(c + D) / J],
    ])  # fmt: skip
    column = np.array([[0], [1 / top], [0], [0]])
    cost = solve_continuous_are(system, column, np.eye(4), np.array([[1e-6]]))
    wanted = (column.T @ cost / 1e-6)[0]
    found = np.array([law.stiffness, law.damping, law.twist_gain, law.speed_gain])
    assert found == pytest.approx(wanted, rel=1e-6)


def test_a_motor_droops_and_one_with_gains_keeps_the_set_speed():
    steady = text(rpm=200, states=4, lines="simulation: {transient: 60 s, observe: 20 s}\n")
    torque = nsdrill.check(steady).figures["mean_torque"].value
    for drive, droops in (("kind: dc_motor", True), (f"kind: dc_motor, {GAINS}", False), ("kind: lqr", False)):
        data = nsdrill.run(f"{steady}drive: {{{drive}}}\n", progress=False)
        damping = nsdrill.load_study(f"{steady}drive: {{{drive}}}\n").parameters.drive.motor_damping
        wanted = 200 * RPM - (torque / damping if droops else 0.0)
        for name in ("bit_speed_mean", "drive_speed_mean"):
            assert float(data[name].squeeze()) == pytest.approx(wanted, rel=1e-6), drive
        assert int(data["response"].squeeze()) == 0


def test_kinds_are_an_axis_and_a_trace_has_the_torque_of_the_motor():
    lines = "simulation: {transient: 5 s, observe: 5 s}\nsweep: {drive.kind: [ideal, lqr, dc_motor], procedure: same}\n"
    data = nsdrill.run(text(rpm=200, states=4, lines=lines), progress=False)
    torque = data["final_state"].sel(state="motor_torque").values.squeeze()
    assert np.isnan(torque[:2]).all()
    assert torque[2] > 100.0
    assert np.isfinite(data["final_state"].sel(state="lag").values.squeeze()[1:]).all()
    trace = nsdrill.simulate(text(rpm=200, states=4, lines="drive: {kind: dc_motor}\n"), duration="10 s")
    assert float(trace["motor_torque"][-1]) == pytest.approx(torque[2], rel=1e-3)
    assert trace["motor_torque"].attrs["units"] == "N m"


def test_continuation_takes_a_motor_that_holds_its_angle():
    lines = "simulation: {transient: 20 s, observe: 10 s, rtol: 1.0e-8}\n"
    lines += "continue: {along: rotary_speed, from: 160 rpm, to: 140 rpm, points: 40}\n"
    with pytest.raises(InputError, match="found dc_motor"):
        nsdrill.continue_branches(text(states=8, lines=lines) + "drive: {kind: dc_motor}\n")
    study = text(states=8, lines=lines) + f"drive: {{kind: dc_motor, {GAINS}}}\n"
    threshold = nsdrill.check(study).figures["steady_threshold"].value
    branch = nsdrill.continue_branches(study, progress=False)
    found = branch["rotary_speed"].values[branch["label"].values == HOPF]
    assert found == pytest.approx([threshold], rel=1e-5)


def test_what_a_motor_does_not_read_is_refused():
    for drive, words in (
        ("kind: dc_motor, torque_limit: 20 kN*m", "torque_limit"),
        ("kind: dc_motor, gains: [1, 2]", "2 of them"),
        ("kind: lqr, gains: [1, 2, 3, 4, 5]", "gains"),
        ("kind: soft_torque, torque_weight: 1.0e-5", "torque_weight"),
    ):
        with pytest.raises(InputError, match=words):
            parse_study(text(lines=f"drive: {{{drive}}}\n"))
    with pytest.raises(InputError, match="falls behind its set point"):
        parse_study(text(lines="drive: {kind: dc_motor}\nrecord: {poincare: 20}\n"))
