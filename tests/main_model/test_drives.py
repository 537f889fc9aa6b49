"""Drives: their gains against closed forms, their motion against SciPy, features and
ramps. Their energy is in ``test_energy.py``, their deviations in
``models/test_deviations.py``."""

import math
from dataclasses import replace

import numpy as np
import pytest
from reference import Case
from scipy.integrate import solve_ivp
from sweep.runs import run_work, work_for

import nsdrill
from nsdrill.app.check import check
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.derived_quantities import derived_quantities
from nsdrill.models.christoforou_yigit.drives import gains, impedance
from nsdrill.models.christoforou_yigit.parameters import Drive, Parameters
from nsdrill.models.christoforou_yigit.table import drilling_at
from nsdrill.models.drive_laws import Gains
from nsdrill.models.operation import Operation
from nsdrill.study import parse_study

DEEP = (5000.0, 22.24e3, 3.0)


def driven(**keys: object) -> Parameters:
    return replace(Parameters(), drive=Drive(**keys))


def law_of(parameters: Parameters) -> Gains:
    return gains(parameters, derive(parameters, *DEEP))


def linear(parameters: Parameters) -> np.ndarray:
    """The matrix of string and drive without the bit, for (lag, drive speed, twist, bit
    speed) less the set point."""
    k, g = derive(parameters, *DEEP), law_of(parameters)
    c_t, c_s = parameters.drillstring.torsional_damping, g.shaft_damping
    top = np.array([-g.stiffness - k.k_t + g.twist_gain, -g.damping - c_s, k.k_t - g.twist_gain, c_s - g.speed_gain])
    bottom = np.array([k.k_t, c_s, -k.k_t, -c_t - c_s])
    return np.array([[0, 1, 0, 0], top / g.inertia, [0, 0, 0, 1], bottom / k.J], float)


@pytest.mark.parametrize(
    ("keys", "modes"),
    [
        ({"kind": "stiff"}, [(0.588, 0.079)]),
        ({"kind": "soft_torque", "matching": 1.0}, [(0.475, 0.099), (0.735, 0.066)]),
        ({"kind": "soft_torque"}, [(0.496, 0.232), (0.703, 0.190)]),
        ({"kind": "equal_damping"}, [(0.522, 0.290), (0.668, 0.230)]),
        ({"kind": "z_torque"}, [(0.562, 0.222)]),
        ({"kind": "z_torque", "a": 1.0}, [(0.384, 0.522)]),
        ({"kind": "lqr"}, [(0.498, 0.671), (0.696, 0.400)]),
    ],
)
def test_modes_of_string_and_drive(keys, modes):
    """Frequency and damping ratio at 5000 m, computed beforehand from the equations by
    other code."""
    roots = np.linalg.eigvals(linear(driven(**keys)))
    found = sorted((abs(root), -root.real / abs(root)) for root in roots if root.imag > 1e-9)
    assert np.allclose(found, modes, atol=6e-4)


@pytest.mark.parametrize(
    ("keys", "held"),
    [
        ({"kind": "ideal"}, 50.0),
        ({"kind": "stiff"}, 52.2),
        ({"kind": "soft_torque", "matching": 1.0}, 86.8),
        ({"kind": "soft_torque"}, 136.4),
        ({"kind": "equal_damping"}, 122.0),
        ({"kind": "z_torque"}, 123.1),
        ({"kind": "z_torque", "a": 1.0}, 175.2),
        ({"kind": "lqr"}, 193.3),
        ({"kind": "soft_torque", "matching": 3.0, "frequency": 0.85 * 0.093996}, 149.8),
    ],
)
def test_the_slope_of_friction_that_each_drive_holds(keys, held):
    """Computed beforehand by other code; and the onset of stick-slip that follows, at
    66.72 kN."""
    parameters = driven(**keys)
    assert drilling_at(parameters, Operation(*DEEP)).withstood == pytest.approx(held, abs=0.06)
    onset = derived_quantities(parameters, Operation(5000.0, 66.72e3, 3.0))["stick_slip_onset"].value
    arm = 2 / 3 * 0.1905
    # the smoothing of friction, which this leaves out, lowers it a little
    assert onset == pytest.approx((math.sqrt(66.72e3 * arm * 0.3 * 3.0 / held) - 1) / 3.0, rel=6e-3)


def test_closed_forms_of_the_gains():
    k = derive(Parameters(), *DEEP)
    assert impedance(Parameters()) == pytest.approx(297.061, abs=1e-3)
    equal = law_of(driven(kind="equal_damping"))
    # With no damping at the bit both modes have one frequency and one damping: a
    # square.
    undamped = driven(kind="equal_damping")
    undamped = replace(undamped, drillstring=replace(undamped.drillstring, torsional_damping=0.0))
    w, z = math.sqrt(k.k_t / k.J), math.sqrt(k.J / 2900.0) / 2
    pair = [1, 2 * z * w, w * w]
    assert np.poly(linear(undamped)) == pytest.approx(np.polymul(pair, pair), rel=1e-9)
    assert equal.damping == pytest.approx(5.09 * 297.061, rel=1e-3)
    lqr = law_of(driven(kind="lqr"))
    assert (lqr.stiffness, lqr.damping, lqr.twist_gain, lqr.speed_gain) == pytest.approx(
        (1000.0, 3300.0, -705.2, 61.7), rel=1e-3
    )
    soft = law_of(driven(kind="soft_torque", matching=1.0, compensated_inertia=900.0))
    assert (soft.inertia, soft.damping) == pytest.approx((2000.0, 297.061), rel=1e-5)
    assert math.sqrt(soft.stiffness / soft.inertia) == pytest.approx(w, rel=1e-12)


def test_an_lqr_without_gains_is_told():
    """A pipe of no length is as stiff as any number, and the string as light as its
    collars."""
    parameters = driven(kind="lqr")
    short = derive(parameters, np.nextafter(200.0, 300.0), 22.24e3, 3.0)
    with pytest.raises(nsdrill.InputError, match=r"lqr finds no gains.*torque_weight"):
        gains(parameters, short)


def test_without_a_bit_the_motion_is_that_of_the_linear_system():
    """Off the rock string and drive are linear: against the matrix exponential's twin,
    DOP853."""
    parameters = driven(kind="soft_torque", matching=2.0)
    study = parse_study(
        "operation: {wob: 0 kN}\ndrive: {kind: soft_torque, matching: 2}\n"
        "drillstring: {eccentricity: 0 mm}\nbit: {surface_amplitude: 0 mm}\n"
        "initial: {x: 0 mm, z: 1 m, lag: 2 rad, drive_speed: 1 rad/s, twist: 5 rad}\n"
        "simulation: {rtol: 1.0e-10}"
    )
    found = nsdrill.simulate(study, duration=0.4, sample=0.05)  # it falls on the rock later
    assert np.all(found["bit_force"].values == 0.0)
    matrix = linear(parameters)
    push = np.array([0, 0, 0, -50.0 * DEEP[2] / derive(parameters, *DEEP).J])
    exact = solve_ivp(
        lambda t, y: matrix @ y + push,
        (0, 0.4),
        [2.0, -2.0, 5.0, 0.0],
        "DOP853",
        rtol=1e-12,
        atol=1e-12,
        t_eval=found.time.values,
    )
    assert found["drive_speed"].values == pytest.approx(exact.y[1] + DEEP[2], abs=1e-8)
    assert found["twist"].values == pytest.approx(exact.y[2], abs=1e-8)
    k_t = derive(parameters, *DEEP).k_t
    assert found["surface_torque"].values == pytest.approx(k_t * (exact.y[0] - exact.y[2]), rel=1e-7)


def test_features_are_those_of_the_trace():
    """Extremes and means of surface torque and drive speed, in stick-slip, from a dense
    trace of the same run."""
    text = (
        "operation: {wob: 66.72 kN, rotary_speed: 2 rad/s}\ndrive: {kind: stiff}\n"
        "simulation: {transient: 20 s, observe: 40 s, rtol: 1.0e-8}"
    )
    study = parse_study(text)
    work = replace(work_for(Case(wob=66.72e3, speed=2.0), study.simulation), parameters=study.parameters)
    found = run_work(work)
    trace = nsdrill.simulate(study, duration=60.0, sample=0.001)
    late = trace.time.values >= 20.0
    assert found["bit_speed_max"][0] > 5.0
    for name in ("surface_torque", "drive_speed"):
        values = trace[name].values[late]
        span = values.max() - values.min()
        assert found[f"{name}_max"][0] == pytest.approx(values.max(), abs=1e-4 * span)
        assert found[f"{name}_min"][0] == pytest.approx(values.min(), abs=1e-4 * span)
        assert found[f"{name}_mean"][0] == pytest.approx(np.trapezoid(values, dx=0.001) / 40.0, abs=1e-4 * span)
    assert 0.01 < found["drive_speed_max"][0] - 2.0 < 0.5  # a stiff drive nearly keeps its speed


def test_a_very_stiff_drive_is_an_ideal_one():
    keys = {"kind": "pi", "inertia": 1e6, "stiffness": 1e8, "damping": 1e7}
    smooth = Simulation(transient=5.0, observe=20.0, rtol=1e-8)
    ideal = work_for(Case(amplitude=0.0, speed=6.0), smooth)
    stiff = replace(ideal, parameters=replace(ideal.parameters, drive=Drive(**keys)))
    a, b = run_work(ideal), run_work(stiff)
    for name in ("bit_speed_max", "bit_speed_mean", "surface_torque_mean", "axial_max"):
        assert b[name] == pytest.approx(a[name], rel=2e-3)


OFF_THE_ROCK = """
operation: {{wob: 0 kN, rotary_speed: {speed}}}
drive: {{kind: stiff, torque_limit: 8 kN*m}}
drillstring: {{eccentricity: 0 mm}}
bit: {{surface_amplitude: 0 mm}}
initial: {{x: 0 mm, z: {z} mm, drive_speed: 1 rad/s, bit_speed: 2 rad/s}}
simulation: {{rtol: 1.0e-10}}
"""


def limited_motion(times: np.ndarray, speed: float, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """String and stiff drive with at most 8 kN m, off the rock, by DOP853: (lag, drive
    speed, twist, bit speed) and the torque of the motor. The set point begins at
    ``speed`` and grows at ``rate``."""
    k = derive(driven(kind="stiff"), 5000.0, 0.0, 3.0)
    law = gains(driven(kind="stiff"), k)

    def motor(t: float, y: np.ndarray) -> float:
        asked = -law.stiffness * y[0] - law.damping * (y[1] - speed - rate * t)
        return float(np.clip(asked, 0.0, 8e3))

    def slope(t: float, y: np.ndarray) -> list[float]:
        pipe, target = k.k_t * (y[0] - y[2]), speed + rate * t
        return [y[1] - target, (motor(t, y) - pipe) / law.inertia, y[3] - target, (pipe - 50.0 * y[3]) / k.J]

    found = solve_ivp(
        slope, (0, times[-1]), [0.0, 1.0, 0.0, 2.0], "DOP853", rtol=1e-11, atol=1e-11, t_eval=times, max_step=0.01
    )
    return found.y, np.array([motor(t, y) for t, y in zip(times, found.y.T, strict=True)])


def test_a_motor_stays_within_its_limits():
    """Against DOP853: the drive speeds up at its upper limit, before the bit falls on
    the rock."""
    study = parse_study(OFF_THE_ROCK.format(speed="6 rad/s", z=1000))
    found = nsdrill.simulate(study, duration=0.4, sample=0.05)
    exact, torque = limited_motion(found.time.values, 6.0, 0.0)
    assert found["bit_force"].values.max() == 0.0
    assert np.all(torque == 8e3)
    assert found["drive_speed"].values == pytest.approx(exact[1], abs=1e-7)
    assert found["twist"].values == pytest.approx(exact[2], abs=1e-7)


def test_a_ramp_keeps_to_the_limits_of_the_motor():
    """The bit hangs on the string, and the set point rises faster than the motor can
    follow, then does not."""
    study = parse_study(OFF_THE_ROCK.format(speed="{ramp: [[0 s, 3 rad/s], [20 s, 7 rad/s]]}", z=0))
    found = nsdrill.simulate(study, sample=0.05)
    exact, torque = limited_motion(found.time.values, 3.0, 0.2)
    assert min(np.sum(torque == 8e3), np.sum(torque == 0.0), np.sum((torque > 0) & (torque < 8e3))) > 5
    assert found["drive_speed"].values == pytest.approx(exact[1], abs=2e-5)
    assert found["twist"].values == pytest.approx(exact[2], abs=2e-5)


def test_a_motor_too_weak_for_the_rock_stalls_and_check_says_so():
    text = "operation: {{wob: 66.72 kN, rotary_speed: 6 rad/s}}\ndrive: {{kind: stiff, torque_limit: {} kN*m}}"
    weak, strong = (parse_study(text.format(limit)) for limit in (2, 60))
    told = [any(warning.startswith("Overloaded: ") for warning in check(study).warnings) for study in (weak, strong)]
    assert told == [True, False]
    reserve = derived_quantities(strong.parameters, strong.operation)["torque_reserve"].value
    assert reserve == pytest.approx(60e3 - derived_quantities(strong.parameters, strong.operation)["mean_torque"].value)
    found = nsdrill.simulate(weak, duration=120.0, sample=0.1)
    late = found.time.values > 100.0
    assert found["surface_torque"].values[late].mean() == pytest.approx(2e3, rel=0.05)
    assert found["drive_speed"].values[late].mean() < 1.0


RAMP = """
operation: {{wob: 0 kN, rotary_speed: {{ramp: [[0 s, 2 rad/s], [40 s, 6 rad/s]]}}}}
bit: {{surface_amplitude: 0 mm}}
drillstring: {{eccentricity: 0 mm}}
initial: {{x: 0 mm}}
drive: {{{}}}
simulation: {{rtol: 1.0e-9}}
"""


def test_a_ramp_with_a_drive_keeps_the_set_point():
    """A very stiff drive follows the ramp; a soft one lags behind it by what its law
    says."""
    text = RAMP.format("kind: pi, inertia: 100 kg*m^2, stiffness: 100 kN*m/rad, damping: 5 kN*m*s/rad")
    stiff = nsdrill.simulate(parse_study(text), sample=0.1)
    assert stiff["drive_speed"].values == pytest.approx(2.0 + 0.1 * stiff.time.values, abs=0.01)
    soft = nsdrill.simulate(parse_study(RAMP.format("kind: soft_torque, matching: 1")), sample=0.1)
    parameters = driven(kind="soft_torque", matching=1.0)
    k = derive(parameters, 5000.0, 0.0, 3.0)
    matrix = linear(parameters)
    push = np.array([0, -0.1, 0, -0.1])  # in a frame that the set point accelerates

    def rate(t, y):
        return matrix @ y + push + np.array([0, 0, 0, -50.0 * (2.0 + 0.1 * t) / k.J])

    exact = solve_ivp(rate, (0, 40), [0, 0, 0, 0], "DOP853", rtol=1e-11, atol=1e-11, t_eval=soft.time.values)
    assert soft["drive_speed"].values == pytest.approx(exact.y[1] + 2.0 + 0.1 * soft.time.values, abs=2e-6)
    assert soft["twist"].values == pytest.approx(exact.y[2], abs=2e-6)


def test_a_drive_that_swings_is_no_ramp():
    from nsdrill.figures.traces import moving_values, operating_point_text
    from nsdrill.store import from_dataset

    study = "drive: {kind: soft_torque}\noperation: {wob: 66.72 kN, rotary_speed: 2 rad/s}"
    trace = from_dataset(nsdrill.simulate(study, duration=5.0, sample=0.1))
    assert np.ptp(trace["drive_speed"]) > 0.0
    assert moving_values(trace) == []
    assert operating_point_text(trace, "si").endswith("2 rad/s")
    with pytest.raises(nsdrill.StudyError, match=r"initial.lag.*with an ensemble"):
        parse_study(study + "\ninitial: {ensemble: 4, lag: 1 rad}")


# The motor of Christoforou and Yigit as reported: 930 kg m^2 at the table and 23 behind
# a gear of 7.2; 6 V s, 0.01 ohm, 0.005 H.
MOTOR = {"kind": "dc_motor"}


def test_the_dc_motor_has_the_droop_the_modes_and_the_reflection_of_its_circuit():
    """Computed beforehand by other code from the circuit: droop 5.358e-6 rad/s per N m,
    eigenvalues, reflection of a torsional wave at the frequency of the string."""
    parameters = driven(**MOTOR)
    k = derive(parameters, *DEEP)
    assert 1 / parameters.drive.motor_damping == pytest.approx(0.01 / (7.2 * 6.0) ** 2, rel=1e-12)
    assert 1 / parameters.drive.motor_damping == pytest.approx(5.358e-6, abs=1e-9)
    found = np.linalg.eigvals(drilling_at(parameters, Operation(*DEEP)).matrix)
    above = sorted((root for root in found if root.imag > 0), key=abs)
    assert above == pytest.approx([-0.0448 + 0.5888j, -1.000 + 13.227j], abs=6e-4)
    w = math.sqrt(k.k_t / k.J)
    drive = parameters.drive
    met = 1j * w * drive.top_inertia + drive.motor_damping / (1 + 1j * w * drive.circuit_time)
    zeta = float(impedance(parameters))
    assert abs((zeta - met) / (zeta + met)) == pytest.approx(0.9968, abs=1e-4)
    shown = derived_quantities(parameters, Operation(*DEEP))
    assert shown["drive_reflection"].value == pytest.approx(0.9968, abs=1e-4)
    assert shown["droop"].value == pytest.approx(5.358e-6 * shown["mean_torque"].value, rel=1e-4)


MOVING = """
operation: {{wob: 0 kN, rotary_speed: {speed}}}
drive: {{kind: dc_motor{gains}}}
drillstring: {{eccentricity: 0 mm}}
bit: {{surface_amplitude: 0 mm}}
initial: {{x: 0 mm, z: 0 mm, twist: 5 rad}}
simulation: {{rtol: 1.0e-10}}
"""


# K_I, K_1, K_2, K_3, K_4 of the regulator of motor and string, with the weights that
# segments have.
GAINS = (0.0272, 22.2, 1.138, -13.03, 15.6)


@pytest.mark.parametrize("gains", [None, GAINS], ids=["constant", "regulated"])
@pytest.mark.parametrize(("speed", "rate"), [("3 rad/s", 0.0), ("{ramp: [[0 s, 3 rad/s], [20 s, 7 rad/s]]}", 0.2)])
def test_string_and_motor_move_as_circuit_and_springs_say(speed, rate, gains):
    """Off the rock, at a constant and at a rising voltage, without gains and with such
    on the deviations from steady drilling, against DOP853 on current, speeds and
    angles."""
    text = MOVING.format(speed=speed, gains="" if gains is None else f", gains: {list(gains)}")
    found = nsdrill.simulate(parse_study(text), duration=20.0, sample=0.05)
    k = derive(driven(**MOTOR), 5000.0, 0.0, 3.0)
    L, R, n_K = 0.005, 0.01, 7.2 * 6.0

    def slope(t, y):
        top, top_speed, bit, bit_speed, current = y
        pipe = k.k_t * (top - bit)
        target, turned = 3.0 + rate * t, 3.0 * t + 0.5 * rate * t * t
        voltage = n_K * target
        if gains is not None:
            steady = 50.0 * target
            deviations = (
                current - steady / n_K,
                top - turned,
                top_speed - target,
                bit - turned + steady / k.k_t,
                bit_speed - target,
            )
            voltage += R * steady / n_K - sum(K * one for K, one in zip(gains, deviations, strict=True))
        return [
            top_speed,
            (n_K * current - pipe) / 2122.32,
            bit_speed,
            (pipe - 50.0 * bit_speed) / k.J,
            (voltage - n_K * top_speed - R * current) / L,
        ]

    exact = solve_ivp(
        slope, (0, 20), [0.0, 3.0, 5.0, 3.0, 0.0], "DOP853", rtol=1e-11, atol=1e-11, t_eval=found.time.values
    ).y
    turned = 3.0 * found.time.values + 0.5 * rate * found.time.values**2
    assert found["drive_speed"].values == pytest.approx(exact[1], abs=2e-5)
    assert found["lag"].values == pytest.approx(exact[0] - turned, abs=2e-5)
    assert found["twist"].values == pytest.approx(exact[2] - turned, abs=2e-5)
    assert found["motor_torque"].values == pytest.approx(n_K * exact[4], abs=0.05)
    assert found["bit_force"].values.max() == 0.0


def test_a_regulated_motor_turns_with_the_set_speed_and_ends_stick_slip():
    """Gains of a regulator: no droop, the eigenvalues of circuit and string, and steady
    drilling from a stuck bit where the motor at constant voltage leaves it to stick and
    slip."""
    study = "operation: {wob: 66.72 kN, rotary_speed: 4 rad/s}\nmodes: {axial: frozen, lateral: frozen}\n"
    study += "initial: {bit_speed: 0 rad/s}\ndrive: {kind: dc_motor%s}\n"
    free, held = (parse_study(study % more) for more in ("", f", gains: {list(GAINS)}"))
    k = derive(held.parameters, 5000.0, 66.72e3, 4.0)
    L, R, n_K, J_d = 0.005, 0.01, 7.2 * 6.0, 2122.32
    K_I, K_1, K_2, K_3, K_4 = GAINS
    matrix = [  # of current, lag, drive speed, twist, bit speed
        [-(R + K_I) / L, -K_1 / L, -(n_K + K_2) / L, -K_3 / L, -K_4 / L],
        [0, 0, 1, 0, 0],
        [n_K / J_d, -k.k_t / J_d, 0, k.k_t / J_d, 0],
        [0, 0, 0, 0, 1],
        [0, k.k_t / k.J, 0, -k.k_t / k.J, -50.0 / k.J],
    ]
    found = np.linalg.eigvals(drilling_at(held.parameters, held.operation).matrix)
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(np.linalg.eigvals(matrix)), rel=1e-9)
    shown = derived_quantities(held.parameters, held.operation)
    assert "droop" not in shown
    assert shown["slope_held"].value > 2 * derived_quantities(free.parameters, free.operation)["slope_held"].value
    ends = [nsdrill.simulate(one, duration=250.0, sample=0.1) for one in (free, held)]
    late = ends[0].time.values > 200.0
    swings = [np.ptp(one["bit_speed"].values[late]) for one in ends]
    assert swings[0] > 4.0
    assert swings[1] < 0.05
    assert ends[1]["drive_speed"].values[-1] == pytest.approx(4.0, abs=1e-3)
    assert ends[1]["lag"].values[-1] == pytest.approx(0.0, abs=2e-3)


def test_states_of_a_motor_are_in_the_results_and_returns_need_its_regulator():
    study = "drive: {kind: dc_motor}\ninitial: {ensemble: 3}\nsimulation: {transient: 1 s, observe: 2 s}"
    swept = nsdrill.run(study, workers=1)
    assert list(swept["state"].values[-3:]) == ["motor_impulse", "motor_torque", "drive_angle"]
    assert np.all(swept["final_state"].sel(state="motor_torque") > 100.0)
    with pytest.raises(nsdrill.StudyError, match="falls behind its set point"):
        parse_study("drive: {kind: dc_motor}\nrecord: {poincare: 20}")
    parse_study(f"drive: {{kind: dc_motor, gains: {list(GAINS)}}}\nrecord: {{poincare: 20}}")
    pi = "drive: {{kind: pi, inertia: 500 kg*m^2, stiffness: {}, damping: 900 N*m*s/rad}}\nrecord: {{poincare: 20}}"
    with pytest.raises(nsdrill.StudyError, match=r"drive\.stiffness 0: the drive falls behind its set point"):
        parse_study(pi.format("0 N*m/rad"))
    parse_study(pi.format("300 N*m/rad"))
    with pytest.raises(nsdrill.StudyError, match=r"drive\.gains: found 2 of them; allowed: five"):
        parse_study("drive: {kind: dc_motor, gains: [1, 2]}")
