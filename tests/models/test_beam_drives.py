"""The elastic collar below a drive that is not ideal: against plain numpy and an independent
integration, the main model, the string that only twists, and linear theory."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_are

import nsdrill
from models.collar import Collar, Top, law
from models.tops import DRIVES
from nsdrill.analysis.bifurcations import HOPF
from nsdrill.equations import plain
from nsdrill.errors import InputError
from nsdrill.models.operation import Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.variant import variant_at

OMEGA, WOB, J_D = 5.0, 40e3, 2900.0
POINT = "operation: {wob: 40 kN, rotary_speed: 5 rad/s}\n"
THREE = f"model: beam\n{POINT}beam: {{modes: 3, stations: [{{at: 0.2}}, {{at: 0.55}}]}}\n"
THREE += "drillstring: {eccentricity_shape: uniform}\n"
PER_VOLT = 7.2 * 6.0 / 0.01  # of the motor: n K/R, (n K)^2/R, and the inertia of table and motor
MOTOR, TABLE = 7.2 * 6.0 * PER_VOLT, 930.0 + 7.2**2 * 23.0
K_I, K_1, K_2, K_3, K_4 = 0.03, 42.0, 2.2, -33.0, 14.0


def linear(inertia, integral, damping, twist=0.0, bit=0.0, *, shaft=0.0, most=None):
    """A drive whose torque is linear, up to a limit."""

    def torque(lag, off, psi, bit_off):
        asked = -(integral * lag + damping * off + twist * (psi - lag) + bit * bit_off)
        return asked if most is None else min(max(asked, 0.0), most)

    return Top(inertia, shaft, torque)


def top_of(name: str, collar: Collar) -> Top:
    """A drive by the formulas of its page, above this collar."""
    J, k_t, (outer, inner) = collar.J, collar.k_t, collar.pipe
    zeta = math.pi / 32 * (outer**4 - inner**4) * math.sqrt(collar.rho * collar.G)
    # lag, drive speed, twist below the drive and bit speed, less those of steady drilling
    system = [[0, 1, 0, 0], [0, 0, k_t / J_D, 0], [0, -1, 0, 1], [0, 0, -k_t / J, -collar.c_t / J]]
    column = np.array([[0.0], [1 / J_D], [0.0], [0.0]])
    cost = solve_continuous_are(np.array(system), column, np.eye(4), np.array([[1e-6]]))
    arm = 2 / 3 * collar.r_h * law(OMEGA, *collar.mu_b) + collar.arm * 2 / math.pi * math.atan(500 * OMEGA)
    steady = collar.W * arm + collar.c_t * OMEGA

    def regulated(lag, off, psi, bit_off, torque):
        volts = K_1 * lag + K_2 * off + K_3 * (psi + steady / k_t) + K_4 * bit_off
        return (steady - torque - MOTOR * off - K_I / 0.01 * (torque - steady) - PER_VOLT * volts) / 0.5

    return {
        "stiff": linear(J_D, 5 * J_D, 50 * zeta, shaft=30.0),
        "soft_torque": linear(J_D, k_t / J * J_D, 4 * zeta),
        "equal_damping": linear(J_D, k_t * J_D / J, 2 * math.sqrt(k_t * J_D), most=5e3),
        "z_torque": linear(J_D / 13.5, 50 * zeta / 13.5 / (20 / (2 * math.pi)), 50 * zeta / 13.5),
        "lqr": linear(J_D, *(column.T @ cost / 1e-6)[0]),
        "pi": linear(J_D, 14500.0, 14853.0, 50.0, 30.0, most=5e3),
        "motor": Top(TABLE, rate=lambda lag, off, psi, bit_off, torque: (-MOTOR * off - torque) / 0.5),
        "regulated motor": Top(TABLE, rate=regulated),
    }[name]


def below(name: str, more: str = "") -> tuple[Any, Collar]:
    """(a study of three modes, of which two are eccentric, and two stations with a drive, the
    same in plain numpy)."""
    e = 4 * 0.0127 / math.pi
    collar = Collar(N=3, at=[0.2, 0.55], e=[e, 0.0, e / 3], Omega=OMEGA, W=WOB)
    collar.top = top_of(name, collar)
    return nsdrill.load_study(f"{THREE}drive: {{{DRIVES[name]}}}\n{more}"), collar


OF_NSDRILL = [name for name in DRIVES if name != "of a script"]


@pytest.mark.parametrize("name", OF_NSDRILL)
def test_the_slopes_are_those_of_the_equations(name):
    """At random states, on the wall and off it, and with a limit below and beyond it: to 1e-11
    of each slope's size over the states; an LQR has nine digits of its gains."""
    study, collar = below(name)
    model = model_named("beam")
    variant, points = variant_at(model, study.parameters), Values(study.parameters, study.initial, (5000.0, WOB, OMEGA))
    rng, N, count = np.random.default_rng(7), collar.N, 40
    of_modes = np.repeat([0.08, 0.5, 0.08, 0.5], N) / np.tile(collar.n, 4)
    scales = np.concatenate([of_modes, [2e-3, 0.05, 5.0, 3.0, 0.3, 0.5], [3e3] if collar.top.rate else []])
    states, t = rng.normal(size=(count, len(scales))) * scales, rng.uniform(0, 5, count)
    states[:, 4 * N + 3] += 2.0
    states[:, 4 * N + 5] += OMEGA - 0.2
    assert set(collar.by_name(states[0])) == set(variant.states)
    given = {"time": t, "phase": 0.0, **{f"s.{k}": v for k, v in collar.by_name(states.T).items()}}
    given |= {f"p.{lane}": value for lane, value in model.columns(points, Thresholds()).items()}
    found = plain.values(model.consequences(variant.options).slopes, given)
    wanted = collar.by_name(np.array([collar.slopes(*one) for one in zip(t, states, strict=True)]).T)
    for state, values in wanted.items():
        off = np.abs(found[state] - values).max() / np.abs(values).max()
        assert off < (1e-8 if name == "lqr" else 1e-11), state
    if "limit" in DRIVES[name]:
        torques = np.array([collar.top.torque(s[-2], s[-1] - OMEGA, s[-4], s[-3] - OMEGA) for s in states])
        assert 0 < np.sum((torques > 0.0) & (torques < 5e3)) < count


@pytest.mark.parametrize("name", ["soft_torque", "pi", "regulated motor"])
def test_a_trace_is_that_of_another_integrator(name):
    """DOP853 of the plain equations, 4 s that begin near the wall. The other integrator does
    not stop where the collar meets the wall or the motor its limit, so that it needs small steps."""
    start = (
        "initial: {x: 78 mm, vy: -0.3 m/s, twist: -9 rad, bit_speed: 2 rad/s, lag: -0.1 rad, drive_speed: 4 rad/s}\n"
    )
    study, collar = below(name, start + "simulation: {rtol: 1.0e-11}\n")
    trace = nsdrill.simulate(study, duration=4.0, sample=0.05)
    N = collar.N
    begin = np.zeros(4 * N + 6 + (collar.top.rate is not None))
    begin[0], begin[2 * N + N] = 0.078, -0.3
    begin[4 * N] = -WOB / (collar.k_a + collar.k_c)
    begin[4 * N + 2 : 4 * N + 6] = -9.0, 2.0, -0.1, 4.0
    done = solve_ivp(collar.slopes, (0, 4), begin, "DOP853", trace.time.values, rtol=1e-12, atol=1e-13, max_step=1e-3)
    expected = collar.by_name(done.y)
    for state in ("x_1", "y_1", "x_3", "z"):
        assert np.abs(trace[state].values - expected[state]).max() < 1e-7 * collar.gap, state
    for state in ("twist", "bit_speed", "lag", "drive_speed"):
        assert np.abs(trace[state].values - expected[state]).max() < 1e-6, state
    if collar.top.rate:
        assert trace.motor_torque.values == pytest.approx(expected["motor_torque"], rel=1e-6)
    assert float(trace.wall_force.max()) > 0
    assert np.ptp(expected["drive_speed"]) > 0.1


ONE = "model: beam\nbeam: {modes: 1, stations: [{at: 0.5}], torque: cy}\n"


@pytest.mark.parametrize("name", ["ideal", *DRIVES])
def test_one_mode_with_a_wall_at_mid_span_is_the_main_model(name, forgets):
    """What ``check`` says, and 8 s from a bit that nearly rests, with lobes and whirl."""
    text = (
        f"drive: {{{DRIVES.get(name, 'kind: ideal')}}}\noperation: {{wob: 60 kN, rotary_speed: 6 rad/s}}\n"
        "initial: {twist: -10 rad, bit_speed: 1 rad/s}\nsimulation: {transient: 0 s, observe: 8 s, rtol: 1.0e-11}\n"
    )
    own, main = (nsdrill.load_study(f"{model}{text}") for model in (ONE, ""))
    figures, wanted = (nsdrill.check(study).figures for study in (own, main))
    shared = figures.keys() & wanted.keys()
    assert {one: figures[one].value for one in shared} == pytest.approx({one: wanted[one].value for one in shared})
    assert figures.keys() - wanted.keys() == {"bending_1"}
    assert {"stick_slip_onset", "stick_slip_fold", "slope_held", "balance_speed"} <= shared
    if name != "ideal":
        of_drive = {one for one in wanted if one.startswith(("drive", "torque_reserve", "pipe_impedance", "droop"))}
        assert {"drive_reflection", "drive_mode_1", "pipe_impedance"} <= of_drive <= shared
    traces = [nsdrill.simulate(study, duration=8.0, sample=0.1) for study in (own, main)]
    for state in ("x", "y", "z", "twist", "bit_speed", *(("lag", "drive_speed") if name != "ideal" else ())):
        found, wanted = (trace[state].values for trace in traces)
        assert np.abs(found - wanted).max() < 1e-6 * np.abs(wanted).max(), state
    data = [nsdrill.run(study, progress=False) for study in (own, main)]
    names = ["bit_speed_max", "bit_speed_min", "bit_speed_mean", "surface_torque_max", "surface_torque_mean"]
    names += ["drive_speed_min", "drive_speed_max", "drive_speed_mean"] if name != "ideal" else []
    for one in names:
        assert float(data[0][one].squeeze()) == pytest.approx(float(data[1][one].squeeze()), rel=1e-7), one
    assert int(data[0].response.squeeze()) == int(data[1].response.squeeze())


QUIET = """
drillstring: {torsional_stiffness: 473 N*m/rad, rotary_inertia: 374 kg*m^2}
bit: {friction: {static: 8 kN*m, dynamic: 3.2 kN*m}}
operation: {wob: 60 kN, rotary_speed: 6 rad/s}
initial: {twist: -10 rad, bit_speed: 1 rad/s}
simulation: {transient: 5 s, observe: 15 s, rtol: 1.0e-11}
"""
STILL = {"initial.x": "0 mm", "drillstring.eccentricity": "0 mm", "bit.surface_amplitude": "0 mm"}


@pytest.mark.parametrize("name", DRIVES)
def test_a_collar_that_is_quiet_is_the_string_that_only_twists(name, forgets):
    """With the same stiffness, inertia and torque of the bit, in stick-slip. Both are tuned to
    the same pipe."""
    text = f"{QUIET}drive: {{{DRIVES[name]}}}\n"
    collar = nsdrill.run(f"model: beam\n{text}", set=STILL, progress=False)
    twisting = nsdrill.run(f"model: torsion\n{text}", progress=False)
    assert int(collar.response.squeeze()) == int(twisting.response.squeeze())
    names = ("bit_speed_min", "bit_speed_max", "bit_speed_mean", "stick_slip_index", "peak_ratio")
    for one in (*names, "surface_torque_max", "drive_speed_min", "drive_speed_max", "drive_speed_mean"):
        found, wanted = (float(data[one].squeeze()) for data in (collar, twisting))
        assert found == pytest.approx(wanted, rel=1e-6, abs=1e-6), one
    # a bit that breaks away is found between two steps, which differ
    assert float(collar.stuck_fraction) == pytest.approx(float(twisting.stuck_fraction), abs=1e-5)
    assert float(collar.radius_max.squeeze()) < 1e-20
    assert float(collar.final_state.sel(state="lag").squeeze()) == pytest.approx(
        float(twisting.final_state.sel(state="lag").squeeze()), rel=1e-6
    )


@pytest.mark.parametrize("name", ["stiff", "motor", "of a script"])
def test_implicit_friction_is_the_explicit_one(name, forgets):
    text = f"{THREE}drive: {{{DRIVES[name]}}}\ninitial: {{x: 78 mm, vy: -0.3 m/s, twist: -9 rad}}\n"
    text += "simulation: {transient: 0 s, observe: 2 s, rtol: 1.0e-11}\n"
    found = [nsdrill.run(text, set={"simulation.method": way}, progress=False) for way in ("explicit", "implicit")]
    one, other = (data.final_state.squeeze() for data in found)
    assert one.values == pytest.approx(other.values, rel=1e-5, abs=1e-6)
    assert float(found[0].wall_contact_fraction.squeeze()) > 0.0


@pytest.mark.parametrize("kind", ["soft_torque", "lqr", "dc_motor"])
def test_the_exponent_of_a_decaying_motion_is_that_of_linear_theory(kind):
    """The torque of the bit does not fall with its speed here, and what does not turn decays
    faster than the slowest of the modes of string and drive. A motor does not hold its angle,
    so that its exponent is that of a turn of the whole string, which keeps its size."""
    study = nsdrill.load_study(
        f"model: beam\n{POINT}beam: {{modes: 2, damping_ratio: 0.5}}\ndrive: {{kind: {kind}}}\n"
        "bit: {surface_amplitude: 0 mm, friction: {static: 3 kN*m, dynamic: 3 kN*m}}\n"
        "drillstring: {axial_damping: 1 MN*s/m, eccentricity: 0 mm}\ninitial: {x: 0 mm}\n"
        "record: {exponent: true}\nsimulation: {transient: 100 s, observe: 1500 s, rtol: 1.0e-8}\n"
    )
    figures = nsdrill.check(study).figures
    modes = [figures[f"drive_mode_{k}"].value * figures[f"drive_damping_{k}"].value for k in (1, 2)]
    found = float(nsdrill.run(study, progress=False).lyapunov_exponent.squeeze())
    assert found == pytest.approx(0.0 if kind == "dc_motor" else -min(modes), rel=0.01, abs=1e-3)


def test_branches_lose_their_stability_where_check_says():
    """Steady drilling at the onset of stick-slip, with drives that hold the angle; one that does
    not is refused by its name."""
    text = (
        "model: beam\nbeam: {modes: 2, stations: [{at: 0.3}], damping_ratio: 0.05}\n"
        "drillstring: {eccentricity: 0 mm}\noperation: {rotary_speed: 3.1 rad/s}\n"
        "bit: {surface_amplitude: 0 mm, friction: {static: 6 kN*m, dynamic: 2 kN*m}}\n"
        "simulation: {transient: 100 s, observe: 20 s, rtol: 1.0e-8}\ncontinue: {along: rotary_speed, "
        "from: 3.1 rad/s, to: 1.8 rad/s, points: 90, seeds: {rotary_speed: [3.1 rad/s]}, switch: false}\n"
    )
    for kind in ("dc_motor", "pi, stiffness: 0 N*m/rad"):
        with pytest.raises(InputError, match=f"found {kind.partition(',')[0]}, .*whose angle nothing holds"):
            nsdrill.continue_branches(f"{text}drive: {{kind: {kind}}}\n")
    for name in ("soft_torque", "regulated motor"):
        figures = nsdrill.check(f"{text}drive: {{{DRIVES[name]}}}\n").figures
        lag = -figures["mean_torque"].value / figures["drive_stiffness"].value if name == "soft_torque" else 0.0
        twist = figures["static_twist"].value + lag
        start = f"initial: {{x: 0 mm, twist: {twist!r} rad, lag: {lag!r} rad}}\n"
        branch = nsdrill.continue_branches(f"{text}drive: {{{DRIVES[name]}}}\n{start}", progress=False)
        found = branch.rotary_speed.values[branch.label.values == HOPF]
        assert found == pytest.approx([figures["stick_slip_onset"].value], rel=1e-5), name


def test_a_branch_is_that_of_the_main_model():
    """A bounce over lobes below soft torque, of which one mode is another form."""
    text = (
        "drive: {kind: soft_torque}\nsimulation: {transient: 200 s, observe: 20 s}\ncontinue: {along: rotary_speed, "
        "from: 3 rad/s, to: 4 rad/s, points: 5, seeds: {rotary_speed: [3.5 rad/s]}, switch: false}\n"
    )
    own, main = (nsdrill.continue_branches(f"{model}{text}", progress=False) for model in (ONE, ""))
    for one in ("rotary_speed", "bit_speed_max", "axial_max", "radius_max"):
        assert own[one].values == pytest.approx(main[one].values, rel=1e-5), one
    assert own.sizes["point"] >= 5


def test_kinds_are_an_axis_and_the_drive_is_in_files_and_traces(tmp_path):
    short = {"simulation": {"transient": "2 s", "observe": "2 s"}}
    kinds = ["ideal", "stiff", "dc_motor"]
    data = nsdrill.run(
        {"model": "beam", **short, "sweep": {"drive.kind": kinds}}, tmp_path / "kinds.h5", progress=False
    )
    ideal = nsdrill.run({"model": "beam", **short}, progress=False)
    own = ideal.state.values.tolist()
    assert data.state.values.tolist() == [*own[:-1], "lag", "drive_speed", "motor_torque", "drive_angle"]
    again = nsdrill.open_results(tmp_path / "kinds.h5")
    for one in (data, again):
        assert np.isnan(one.final_state.sel(state="motor_torque").values.ravel()).tolist() == [True, True, False]
        assert np.isnan(one.drive_speed_max.values.ravel()).tolist() == [True, False, False]
    assert np.array_equal(data.final_state.sel(state=own).values.reshape(3, -1)[0], ideal.final_state.values.ravel())
    trace = nsdrill.simulate({"model": "beam", "drive": {"kind": "dc_motor"}}, duration="4 s")
    assert trace.motor_torque.attrs["units"] == "N m"
    assert float(trace.motor_torque[-1]) == pytest.approx(
        float(data.final_state.sel(state="motor_torque").values.ravel()[2]), rel=1e-3
    )
    replayed = nsdrill.replay(tmp_path / "kinds.h5", at={"drive.kind": "stiff"})
    assert float(replayed.lag[-1]) == float(data.final_state.sel(state="lag").values.ravel()[1])


def test_starts_are_those_below_an_ideal_drive():
    """Drawn starts have the same states of string and collar below any drive, which begins with
    the set speed; a start may say otherwise."""
    starts = {"model": "beam", "initial": {"ensemble": 3}, "simulation": {"transient": "0 s", "observe": "0.1 s"}}
    ideal, driven = (nsdrill.run({**starts, "drive": {"kind": kind}}, progress=False) for kind in ("ideal", "lqr"))
    own = ideal.state.values.tolist()
    assert np.array_equal(driven.initial_state.sel(state=own), ideal.initial_state)
    assert np.all(driven.initial_state.sel(state="lag") == 0.0)
    assert np.all(driven.initial_state.sel(state="drive_speed") == 3.0)
    given = {"lag": "-0.2 rad", "drive_speed": "2 rad/s", "wall_force": "1 kN"}
    pressed = nsdrill.simulate({"model": "beam", "drive": {"kind": "stiff"}, "initial": given}, duration="0.1 s")
    assert (float(pressed.lag[0]), float(pressed.drive_speed[0])) == (-0.2, 2.0)
    assert float(pressed.wall_force[0]) == pytest.approx(1e3, rel=1e-9)


def test_a_ramp_is_followed_by_the_drive():
    """As by that of the main model, of which one mode is another form."""
    text = "drive: {kind: z_torque}\noperation: {rotary_speed: {ramp: [[0 s, 3 rad/s], [3 s, 5 rad/s]]}}\n"
    text += "simulation: {rtol: 1.0e-10}\nbit: {cutting: {zeta: 0}}\n"
    own, main = (nsdrill.simulate(f"{model}{text}", duration=5.0, sample=0.1) for model in (ONE, ""))
    for state in ("x", "z", "twist", "lag", "drive_speed", "bit_speed"):
        assert np.abs(own[state].values - main[state].values).max() < 1e-6, state
    assert float(own.drive_speed[-1]) > 4.0


def test_what_a_drive_does_not_read_is_refused():
    for text, words in (
        ("drive: {matching: 3}", "drive.matching: found the number 3, which the drive ideal does not read"),
        ("initial: {lag: 1 rad}", "initial.lag"),
        ("drive: {kind: dc_motor, torque_limit: 20 kN*m}", "torque_limit"),
        ("drive: {kind: dc_motor}\nrecord: {poincare: 20}", "falls behind its set point"),
    ):
        with pytest.raises(InputError, match=words):
            nsdrill.load_study(f"model: beam\n{text}\n")


@pytest.mark.parametrize(
    ("drive", "words"),
    [
        ("kind: stiff, torque_limit: 1 kN*m", "Overloaded"),
        ("kind: pi, stiffness: 0 N*m/rad, damping: 100 N*m*s/rad", "At rest"),
        ("kind: stiff, torque_limit: 3.2 kN*m", "Stalls"),
        ("kind: pi, stiffness: 900 N m/rad, damping: 1500 N m s/rad, speed_gain: -3000 N m s/rad", "Unstable"),
    ],
)
def test_a_drive_that_is_too_weak_or_of_the_wrong_sign_is_warned_of(drive, words):
    report = nsdrill.check(f"model: beam\noperation: {{wob: 60 kN, rotary_speed: 6 rad/s}}\ndrive: {{{drive}}}\n")
    assert any(one.startswith(words) for one in report.warnings)
