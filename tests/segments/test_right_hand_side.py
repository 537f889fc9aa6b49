"""The lanes of the string of segments against its equations in plain numpy, and against
closed forms."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nsdrill.kernel.settings import Simulation
from nsdrill.models.segments.parameters import Initial, SurveyStation, WallFriction
from nsdrill.models.segments.string import regulator, string_of
from segments.lanes import DEPTH, QUIET, RINGING, Slopes, frequencies, run, string
from segments.plain import Plain, ours, plain_of

GAINS = (0.029333, 41.716072, 2.158996, -32.539385, 13.552175)  # of another program, R = 950

SURVEY = ((0.0, 0.0), (300.0, 0.0), (900.0, 0.8), (2500.0, 1.1))

CASES = [
    ({}, {}),
    ({"segments__pipe": 1, "segments__collar": 1}, {"pipes": 1, "collars": 1}),
    ({"segments__pipe": 5, "segments__collar": 2, "drive__kind": "ideal"}, {"pipes": 5, "collars": 2, "stiff": True}),
    (
        {
            "segments__pipe": 2,
            "segments__collar": 3,
            "drive__kind": "lqr",
            "drive__on_at": 2.0,
            "drive__table_damping": 70.0,
            "segments__top__damping": 9e3,
            "bit__lobes": 3,
        },
        {"pipes": 2, "collars": 3, "on_at": 2.0, "c_rt": 70.0, "c_top": 9e3, "lobes": 3},
    ),
    (
        {
            "segments__pipe": 2,
            "segments__collar": 1,
            "drive__gains": (0.3, 40.0, 2.0, -30.0, 13.0),
            "drive__on_at": 2.0,
            "segments__hydraulics__annulus_factor": 0.0,
            "segments__hydraulics__bore_factor": 0.0,
        },
        {"pipes": 2, "collars": 1, "gains": (0.3, 40.0, 2.0, -30.0, 13.0), "on_at": 2.0, "f_out": 0.0, "f_in": 0.0},
    ),
    (
        {"segments__pipe": 2, "segments__collar": 3, "bit__cutting__speed": "mean", "segments__rock_damping": 0.0},
        {"pipes": 2, "collars": 3, "live": False, "c_c": 0.0},
    ),
    (
        {
            "segments__pipe": 4,
            "segments__collar": 2,
            "well__survey": tuple(SurveyStation(*station) for station in SURVEY),
            "well__friction_along": WallFriction(0.5, 0.2, 0.9, 80.0),
        },
        {"pipes": 4, "collars": 2, "survey": SURVEY, "wall": (0.5, 0.2, 0.9, 80.0)},
    ),
    (
        {
            "segments__pipe": 4,
            "segments__collar": 2,
            "well__survey": tuple(SurveyStation(*station) for station in SURVEY),
            "well__friction_along": WallFriction(0.5, 0.2, 0.9, 80.0),
            "well__axial_friction": True,
        },
        {"pipes": 4, "collars": 2, "survey": SURVEY, "wall": (0.5, 0.2, 0.9, 80.0), "along": True},
    ),
    (
        {
            "segments__pipe": 2,
            "segments__collar": 3,
            "bit__friction__static_torque": 9e3,
            "bit__friction__dynamic_torque": 4e3,
            "bit__friction__smoothing": 70.0,
            "bit__friction__decay": 0.5,
        },
        {"pipes": 2, "collars": 3, "given": (9e3, 4e3, 70.0, 0.5)},
    ),
]


@pytest.mark.parametrize(("keys", "fields"), CASES)
def test_the_lanes_have_the_rates_of_the_equations(keys, fields):
    """Random states, on the rock and off it, stuck and turning backward; before and
    after the control begins. The lanes sum in another order and have an exponential
    good to 1e-9: equal to 1e-8 of the largest force on the node."""
    parameters = string(**keys)
    slopes, plain = Slopes(parameters), Plain(**fields)
    if keys.get("drive__kind") == "lqr":
        plain.gains = tuple(regulator(parameters, string_of(parameters, DEPTH))[0])
    generator, n = np.random.default_rng(1), plain.n
    state_scales = np.repeat([1e-3, 0.05, 2.0, 10.0, 100.0], [n + 1] * 4 + [1])
    for t in (0.0, 1.7, 2.3):
        states = state_scales * generator.normal(size=(8, 4 * n + 5))
        states[:, 3 * n + 3 : 4 * n + 4] += plain.speed
        states[0, 4 * n + 3] = 0.01  # nearly stuck
        states[1, 3 * n + 4 : 4 * n + 3] *= 0.1  # where friction along the wall falls
        found = slopes(t, np.array([ours(state, n) for state in states]))
        for state, mine in zip(states, found, strict=True):
            rates = plain.rates(t, state)
            exact = np.concatenate([rates[n + 1 : 2 * n + 2], rates[3 * n + 3 : 4 * n + 4], rates[-1:]])
            u, v, th, _, _ = plain.parts(state)
            moved = np.max(plain.k) * np.ptp(u) + plain.k_c * abs(u).max() * (1 + plain.c_c / plain.wob * abs(v).max())
            turned = np.max(plain.kt) * np.ptp(th) + plain.nK * 300 + plain.k_c * abs(u).max()
            bound = np.concatenate([moved / plain.m, turned / plain.J, [max(abs(exact[-1]), 1.0)]])
            assert np.max(np.abs(mine - exact) / bound) < 1e-9


def test_a_uniform_string_has_the_frequencies_of_equal_lumps():
    """(2c/h) sin((2j - 1) pi / 4n) of n equal lumps below a held end, exact; n = 10,
    2000 m."""
    same = {"outer_diameter": 0.101, "inner_diameter": 0.0848}
    parameters = string(
        **RINGING,
        drive__kind="ideal",
        segments__pipe=5,
        segments__collar=5,
        drillstring__collar__length=1000.0,
        bit__mass=0.0,
        **{f"drillstring__collar__{name}": value for name, value in same.items()},
    )
    slopes = Slopes(parameters, depth=2000.0)
    matrix = slopes.torsional(slopes.jacobian(slopes.steady()))
    c, h = math.sqrt(79.6e9 / 7850), 200.0
    exact = 2 * c / h * np.sin((2 * np.arange(1, 11) - 1) * np.pi / 40)
    np.testing.assert_allclose(exact[:3], [2.49841745, 7.43373301, 12.18600540], rtol=5e-9)
    np.testing.assert_allclose(frequencies(matrix), exact, rtol=1e-9)


@pytest.mark.parametrize(
    ("segments", "errors"), [(5, (-1.53e-3, -0.24)), (10, (-3.84e-4, -0.065)), (20, (-9.60e-5, -0.016))]
)
def test_pipe_and_collars_come_nearer_to_the_continuous_string(segments, errors):
    """tan(w L_p/c) tan(w L_c/c) = Ip_p/Ip_c of two uniform rods below a held end:
    1.13697632 rad/s and, the fifth, 20.03975275. The error falls with the square of the
    segment's length."""
    c, ratio = math.sqrt(79.6e9 / 7850), (0.101**4 - 0.0848**4) / (0.171**4 - 0.0571**4)
    for w in (1.13697632, 20.03975275):
        assert math.tan(w * 2000 / c) * math.tan(w * 200 / c) == pytest.approx(ratio, rel=1e-6)
    parameters = string(
        **RINGING, drive__kind="ideal", bit__mass=0.0, segments__pipe=segments, segments__collar=segments
    )
    slopes = Slopes(parameters)
    found = frequencies(slopes.torsional(slopes.jacobian(slopes.steady())))
    assert found[0] / 1.13697632 - 1 == pytest.approx(errors[0], rel=5e-3)
    assert found[4] / 20.03975275 - 1 == pytest.approx(errors[1], rel=3e-2)


def test_axial_frequencies_with_the_bit_free_and_held():
    """Of another program, 10 + 10 segments; the continuous string (transfer matrices)
    has 2.30074107, 8.67773072 and 7.79335656, 15.26854860 rad/s."""
    slopes = Slopes(string(**RINGING))
    lifted = slopes.steady()
    lifted[2 * slopes.nodes - 2] = 1.0  # the bit, a metre above the rock
    matrix = slopes.axial(slopes.jacobian(lifted, 0.5))
    np.testing.assert_allclose(frequencies(matrix)[:3], [2.2995176, 8.6359015, 15.6158300], rtol=1e-7)
    held = matrix[:-2, :-2]
    np.testing.assert_allclose(frequencies(held)[:3], [7.7688304, 15.1094544, 20.6420172], rtol=1e-7)


def test_steady_drilling():
    """100 kN, 13 rad/s, of another program; nothing accelerates."""
    slopes = Slopes(string(**QUIET))
    state, value = slopes.steady(), dict(zip(slopes.names.parameters, slopes.table, strict=True))
    assert np.abs(slopes(0.0, state)).max() < 1e-10
    by_name = dict(zip(slopes.names.states, state, strict=True))
    assert by_name["z"] == pytest.approx(-8.618913e-5, rel=1e-6)
    assert by_name["twist"] == pytest.approx(-11.308085, rel=1e-7)
    assert by_name["current"] == pytest.approx(53.362710, rel=1e-7)
    assert value["steady_torque"] == pytest.approx(2271.3927 + 13 * 2.605875, rel=1e-7)
    made = string_of(string(), DEPTH)
    assert made.axial == pytest.approx(239071.121, rel=1e-8)
    assert made.torsional == pytest.approx(203.287230, rel=1e-8)
    assert made.drive_inertia == pytest.approx(2364.334969, rel=1e-9)
    assert sum(made.drags) == pytest.approx(2.605875, rel=1e-6)


def test_the_mud_damps_axial_motion_as_the_derivative_of_its_drag():
    """2 a Q/A_o + 2 b Q/A_b, summed over all segments: 36797 N s/m."""
    parameters = string(**{**RINGING, "segments__hydraulics__flow": 0.022, "mud__density": 1198.0})
    slopes, plain = Slopes(parameters), Plain(pulsation=0.0)
    lifted = slopes.steady()
    lifted[2 * slopes.nodes - 2] = 1.0
    matrix = slopes.jacobian(lifted, 1e-3)
    velocities = np.arange(1, 2 * slopes.nodes, 2)
    pushed = matrix[velocities][:, velocities].sum(axis=1)
    exact = sum(2 * 0.022 * (a / A_o + b / A_b) for _, a, b, A_o, A_b in plain.halves)
    assert -float(plain.m @ pushed) == pytest.approx(exact, rel=1e-8)


def test_the_motor_has_its_two_poles():
    """L J s^2 + R J s + nK^2 = 0 with J = 2364.334969 kg m^2: -1 +- 12.524614i. The
    string has hardly any stiffness."""
    slopes = Slopes(string(**RINGING, drillstring__material__shear_modulus=1e6))
    matrix = slopes.torsional(slopes.jacobian(slopes.steady()))
    drive = matrix[np.ix_([1, -1], [1, -1])]
    poles = np.linalg.eigvals(drive)
    np.testing.assert_allclose(poles.real, -1.0, rtol=1e-9)
    np.testing.assert_allclose(abs(poles.imag), 12.524614, rtol=1e-7)


def test_gains_of_the_regulator():
    """Of another program, two weights of the voltage."""
    made = string_of(string(), DEPTH)
    np.testing.assert_allclose(regulator(string(), made)[0], GAINS, rtol=2e-5)
    strong = string(drive__control_weight=1.0)
    found = regulator(strong, made)[0]
    np.testing.assert_allclose(found, [1.017862, 911.214943, 308.681585, -628.370463, 823.064767], rtol=1e-6)


@pytest.mark.parametrize(("damping", "real"), [(0.2e-3, 0.0254), (10e-3, -0.103)])
def test_the_regulator_needs_a_string_with_damping(damping, real):
    """The worst pole of the whole string without friction at the bit, of another
    program: at 5.15 rad/s."""
    parameters = string(
        drive__kind="lqr",
        segments__material_damping__torsional=damping,
        bit__friction__level=0.0,
        bit__cutting__zeta=0.0,
        **QUIET,
    )
    slopes = Slopes(parameters)
    poles = np.linalg.eigvals(slopes.torsional(slopes.jacobian(slopes.steady())))
    worst = poles[np.argmax(poles.real)]
    assert worst.real == pytest.approx(real, rel=1e-2)
    assert abs(worst.imag) == pytest.approx(5.15, abs=0.01)


@pytest.mark.parametrize(("wob", "onset"), [(50e3, 19.46), (75e3, 26.40), (100e3, 32.30), (150e3, 42.02)])
def test_steady_drilling_is_unstable_below_a_speed(wob, onset):
    """The speed at which the torsional motion about steady drilling loses stability at
    constant voltage, of another program to four digits."""
    growth = []
    for speed in (onset - 0.02, onset + 0.02):
        slopes = Slopes(string(**QUIET), wob=wob, speed=speed)
        matrix = slopes.torsional(slopes.jacobian(slopes.steady(), 1e-3))
        # The angle of all nodes together has no spring, hence a pole at zero.
        poles = np.linalg.eigvals(matrix)
        growth.append(poles.real[abs(poles) > 1e-3].max())
    assert growth[0] > 0.0 > growth[1]


def along(plain: Plain, start: np.ndarray, until: float, rtol: float = 1e-10) -> tuple[np.ndarray, float]:
    """SciPy's state at the end, and the energy that came in."""

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        return np.append(plain.rates(t, y[:-1]), plain.power(t, y[:-1]))

    absolute = np.append(rtol * np.repeat([1e-4, 1e-2, 0.1, 1.0, 10.0], [plain.n + 1] * 4 + [1]), 1e-4)
    found = solve_ivp(rates, (0.0, until), np.append(start, 0.0), method="DOP853", rtol=rtol, atol=absolute)
    return found.y[:-1, -1], float(found.y[-1, -1])


def test_a_run_ends_where_scipy_does_and_energy_balances():
    """Half a second from a bit that turns too slowly, on its lobes; DOP853 on the plain
    equations at 1e-10. Both of our tolerances of 1e-10 leave errors of about 1e-8 of
    the natural scales. Energy: 200 kJ in all, to the integral's tolerance."""
    parameters = string(segments__pipe=4, segments__collar=4)
    plain, initial = Plain(pipes=4, collars=4), Initial(bit_speed=6.0)
    slopes = Slopes(parameters)
    done = run(parameters, Simulation(0.0, 0.5, rtol=1e-10), initial)
    start = plain_of(done["initial_state"][0, :-1], 8)
    end, gained = along(plain, start, 0.5)
    size = plain_of(slopes.variant.state_scales(slopes.table[None])[0], 8)
    difference = np.abs(plain_of(done["final_state"][0, :-1], 8) - end) / (size + np.abs(end))
    assert difference.max() < 1e-6
    assert plain.energy(end) - plain.energy(start) == pytest.approx(gained, abs=1e-6 * plain.energy(start))
    assert abs(gained) > 10.0


@pytest.mark.parametrize(("speed", "load"), [(5.0, 1037.2), (13.0, 6971.3), (20.0, 20072.4)])
def test_the_bit_lifts_off_below_a_load(speed, load):
    """Without friction and rock damping the motion is linear until contact is lost:
    below W_c = s0 |k_c / (1 + k_c H)| (1 + k_a / k_c), where H is the string's
    receptance at the bit at the frequency of the lobes; loads of another program."""
    quiet = {
        **RINGING,
        "bit__surface_amplitude": 1e-3,
        "segments__rock_damping": 0.0,
        "drive__kind": "ideal",
        "segments__material_damping__axial": 5e-3,
    }
    plain = Plain(beta_a=5e-3, flow=0.0, pulsation=0.0)
    n = plain.n
    D = np.diff(np.eye(n + 1), axis=0)
    stiffness = D.T @ np.diag(plain.k * (1 + 1j * speed * plain.beta_a)) @ D
    stiffness[0, 0] += plain.k_top
    dynamic = stiffness - speed**2 * np.diag(plain.m)
    receptance = np.linalg.inv(dynamic)[-1, -1]
    critical = 1e-3 * abs(plain.k_c / (1 + plain.k_c * receptance)) * (1 + plain.k_a / plain.k_c)
    assert critical == pytest.approx(load, rel=1e-4)
    # 800 s take the first mode, which decays with 0.013 /s, below a thousandth.
    done = run(string(**quiet), Simulation(800.0, 20.0), wob=[0.98 * load, 1.02 * load], rotary_speed=speed)
    assert done["lift_off_fraction"][0] > 0.0
    assert done["lift_off_fraction"][1] == 0.0
