"""The elastic collar: against plain numpy, an independent integration, closed forms,
energy and the lumped model."""

import math
from typing import Any

import numpy as np
import pytest
from beam_energies import energy, powers, stations_of
from scipy.integrate import simpson, solve_ivp

from models.collar import Collar
from nsdrill.app.simulating.trajectory import simulate
from nsdrill.models.beam.columns import bent_against_wall, coefficients, of_string, shape, stiffnesses
from nsdrill.models.beam.model import at_place
from nsdrill.models.operation import Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.variant import variant_at
from nsdrill.study import parse_study

PAPER = """
model: beam
drillstring:
  collar: {outer_diameter: 0.2 m, inner_diameter: 0 m, span: 20 m}
  material: {density: 7860 kg/m^3, young_modulus: 200 GPa}
  eccentricity: 0 m
  torsional_damping: 0 N*m*s/rad
beam: {stations: [{at: 0.1}], axial_load: static}
mud: {density: 0 kg/m^3}
well: {diameter: 0.22 m, law: hertz, stiffness: 6.78e11 N/m^1.5, friction: {static: 0, dynamic: 0}}
bit: {surface_amplitude: 0 m, friction: {static: 0, dynamic: 0}, cutting: {zeta: 0}}
"""


def study(text: str = "model: beam", **changes: Any) -> Any:
    return parse_study(text, overrides=[f"{key.replace('__', '.')}={value}" for key, value in changes.items()])


def points(of: Any) -> Values:
    at = of.operation
    return Values(of.parameters, of.initial, (at.depth, at.wob, at.rotary_speed))


def slopes(of: Any, t: np.ndarray, states: np.ndarray, lanes: int) -> np.ndarray:
    """The derivatives of states [n, 4 N + 4] at times [n], n at most the number of
    lanes, as compiled."""
    model = model_named("beam")
    variant = variant_at(model, of.parameters)
    rows, table = variant.rows(), model.pack(points(of), Thresholds())
    buffer = np.zeros((rows.total, lanes))
    filled = np.resize(np.arange(len(states)), lanes)
    buffer[rows.stage : rows.stage + rows.states] = states[filled].T
    buffer[rows.stage_time] = t[filled]
    buffer[rows.parameter : rows.parameter + rows.parameters] = table.T
    flat = buffer.ravel()
    variant.right_hand_side(lanes)(flat)
    out = np.empty_like(states)
    out[:, ::2] = states[:, 1::2] + variant.frame_rates(table)
    out[:, 1::2] = flat.reshape(rows.total, lanes)[rows.acceleration : rows.acceleration + rows.slopes].T[: len(states)]
    return out


CASES = {
    "default": ({}, Collar()),
    "one mode": (
        {"beam.modes": 1, "beam.stations": "[{at: 0.5}]", "beam.torque": "cy"},
        Collar(N=1, at=[0.5], e=[0.0127], softening="live"),
    ),
    "everything": (
        {
            "beam.modes": 3,
            "beam.stations": "[{at: 0.2}, {at: 0.55}]",
            "well.law": "hertz",
            "well.stiffness": "25e7 N/m^1.5",
            "drillstring.eccentricity_shape": "uniform",
            "beam.damping_ratio": 0.01,
            "beam.torque": "cy",
            "drillstring.eccentric_mass": "steel",
            "beam.modal_mass_factor": 2,
            "bit.lobes": 4,
        },
        Collar(
            N=3,
            at=[0.2, 0.55],
            a=1.5,
            k_w=25e7,
            zeta=0.01,
            softening="live",
            steel_only=True,
            factor=2.0,
            n_b=4,
            e=[4 * 0.0127 / math.pi, 0.0, 4 * 0.0127 / (3 * math.pi)],
        ),
    ),
    "static load": (
        {"beam.modes": 2, "beam.stations": "[{at: 0.3}]", "beam.axial_load": "static"},
        Collar(N=2, at=[0.3], e=[0.0127, 0.0], softening="static"),
    ),
    "stations of their own": (
        {
            "beam.modes": 4,
            "beam.axial_load": "50 kN",
            "beam.eccentricity_modes": "[12.7 mm, -4 mm, 0 mm, 3 mm]",
            "beam.stations": "[{at: 0.2, gap: 40 mm}, {at: 0.45, stiffness: 80 MN/m, drag: 900 "
            "N*s^2/m^2}, "
            "{at: 0.8, stiffness: 0 N/m, drag: 0 N*s^2/m^2}]",
        },
        Collar(
            N=4,
            at=[0.2, 0.45, 0.8],
            e=[0.0127, -0.004, 0.0, 0.003],
            softening=50e3,
            walls=[
                (0.04, 25e6, Collar(N=4, at=[0.2, 0.45, 0.8], e=[0.0] * 4).d),
                (0.0762, 80e6, 900.0),
                (0.0762, 0.0, 0.0),
            ],
        ),
    ),
}


def ordered(names: tuple[str, ...], collar: Collar, s: np.ndarray) -> np.ndarray:
    """States or derivatives of the reference in the order of ``names``."""
    by_name = collar.by_name(s)
    return np.array([by_name[name] for name in names])


@pytest.mark.parametrize("case", CASES)
def test_the_compiled_slopes_are_those_of_the_equations(case):
    """At random states, most of them on the wall at some station and off it at another;
    to rounding, 1e-13 of each slope's size over the states. In one lane and in eight
    the bits are the same."""
    changes, collar = CASES[case]
    of = study(**{key.replace(".", "__"): value for key, value in changes.items()})
    names = variant_at(model_named("beam"), of.parameters).states
    rng = np.random.default_rng(7)
    N = collar.N
    state_scales = np.concatenate([np.repeat(q, N) / np.tile(collar.n, 4) for q in [[0.08, 0.5, 0.08, 0.5]]])
    state_scales = np.concatenate([state_scales, [2e-3, 0.05, 5.0, 3.0]])
    states = rng.normal(size=(40, len(state_scales))) * state_scales
    states[:, -1] += 2.0
    t = rng.uniform(0, 5, 40)
    expected = np.array([ordered(names, collar, collar.slopes(*one)) for one in zip(t, states, strict=True)])
    given = np.array([ordered(names, collar, one) for one in states])
    found = np.concatenate([slopes(of, t[k : k + 8], given[k : k + 8], 8) for k in range(0, 40, 8)])
    single = np.concatenate([slopes(of, t[k : k + 1], given[k : k + 1], 1) for k in range(40)])
    assert found.tobytes() == single.tobytes()
    assert np.max(np.abs(found - expected) / np.abs(expected).max(axis=0)) < 1e-13
    gaps = np.array([gap for gap, _, _ in collar.walls])
    touching = np.array([np.hypot(collar.phi @ s[:N], collar.phi @ s[2 * N : 3 * N]) > gaps for s in states])
    assert 0.1 < touching.mean() < 0.9


@pytest.mark.parametrize(
    ("changes", "collar", "x", "within", "names"),
    [
        ({"operation__rotary_speed": "7 rad/s"}, Collar(Omega=7.0), 0.08, 1e-8, ("x_1", "y_1", "x_3", "y_5", "z")),
        (
            {"operation__rotary_speed": "{ramp: [[0 s, 5 rad/s], [4 s, 7 rad/s]]}", "bit__cutting__zeta": 0},
            Collar(Omega=5.0, ramp=0.5, cutting=0.0),
            0.078,
            1e-7,
            ("x_1", "y_1", "x_3", "z"),
        ),
    ],
    ids=["rolling", "ramp"],
)
def test_a_trace_is_that_of_another_integrator(changes, collar, x, within, names):
    """DOP853 of the plain equations, 4 s that begin near the wall, at rtol 1e-11: of
    backward rolling at 7 rad/s, and of a ramp, which is made of segments, each with its
    own drive, without cutting torque, which does not follow the speed linearly.

    Friction at the wall is steep, and the errors of either side grow with the whirl:
    found 1.6e-9 of the gap. The other integrator does not stop where the collar meets
    the wall, so it needs small steps: at the absolute tolerance 1e-12 its error there
    is 2e-8 to 3e-7, by chance.
    """
    of = study(**changes, initial__x=f"{x} m", initial__vy="-0.3 m/s", simulation__rtol=1e-11)
    trace = simulate(of, duration=4.0, sample=0.05).trace
    start = np.zeros(24)
    start[0], start[15], start[23] = x, -0.3, collar.Omega
    start[20] = -collar.W / (collar.k_a + collar.k_c)
    done = solve_ivp(collar.slopes, (0, 4), start, "DOP853", trace.time, rtol=1e-12, atol=1e-14)
    expected = collar.by_name(done.y)
    for name in names:
        assert np.abs(trace[name] - expected[name]).max() < within * collar.gap, name
    for name in ("twist",) if collar.ramp else ("bit_speed",):
        assert np.abs(trace[name] - expected[name]).max() < 1e-6
    assert np.any(trace["wall_force"] > 0)
    assert np.abs(expected["x_3"]).max() > 1e-5


def test_one_mode_with_a_wall_at_mid_span_is_the_lumped_model():
    """With the softening torque. 10 s at 3 rad/s, rtol 1e-11: to 1e-8 of a metre and of
    a radian."""
    body = "operation: {rotary_speed: 3 rad/s}\nsimulation: {rtol: 1.0e-11}\n"
    lumped = simulate(parse_study(body), duration=10.0).trace
    changes, _ = CASES["one mode"]
    collar = simulate(
        parse_study(body, overrides=["model=beam", *(f"{k}={v}" for k, v in changes.items())]), duration=10.0
    ).trace
    for name in ("x", "y", "z", "twist", "radius"):
        assert np.abs(collar[name] - lumped[name]).max() < 1e-8, name
    assert np.abs(collar["x_1"] - collar["x"]).max() == 0.0


LOADED = {
    0.0: [6.223196, 24.892784, 56.008764, 99.571137, 155.579901],
    150e3: [4.872336, 23.657909, 54.791286, 98.359519, 154.370959],
    350e3: [1.937774, 21.903377, 53.124598, 96.720422, 152.744151],
}


@pytest.mark.parametrize("wob", LOADED)
def test_frequencies_under_load(wob):
    """w_n = (pi/l)^2 sqrt(EI / rho A) sqrt(n^4 - n^2 P / P_cr), Ghasemloonia et al.;
    six digits of their beam."""
    of = study(PAPER)
    k = coefficients(of.parameters, 5000.0, wob, 3.0)
    assert k.m_l == pytest.approx(2469.291826, rel=1e-9)
    assert k.buckling_load == pytest.approx(387578.458, abs=1e-3)
    found = np.sqrt(np.array(stiffnesses(of.parameters, 5000.0, wob, 3.0)) / k.m_l)
    assert found == pytest.approx(LOADED[wob], abs=6e-7)
    n, second = np.arange(1, 6), math.pi * 0.1**4 / 4
    bare = (math.pi / 20) ** 2 * math.sqrt(200e9 * second / (7860 * math.pi * 0.1**2))
    assert found == pytest.approx(bare * np.sqrt(n**4 - n**2 * wob / k.buckling_load), rel=1e-12)


def test_static_deflection_tends_to_that_of_the_beam():
    """1 kN at mid-span: F l^3 / (48 E I) = 10.610330 mm, the first mode 96 / pi^4 of
    it; under 150 kN times 3 (tan u - u) / u^3 with u = (pi / 2) sqrt(P / P_cr)
    (Timoshenko & Gere, Theory of Elastic Stability)."""
    exact = 1e3 * 20**3 / (48 * 200e9 * math.pi * 0.1**4 / 4)
    assert exact == pytest.approx(10.610330e-3, rel=1e-6)
    u = math.pi / 2 * math.sqrt(150e3 / 387578.458)
    for wob, limit, known in (
        (0.0, exact, {1: 10.456844, 3: 10.585940, 5: 10.602671}),
        (150e3, exact * 3 * (math.tan(u) - u) / u**3, {5: 17.210877}),
    ):
        for modes, expected in known.items():
            of = study(PAPER, beam__modes=modes)
            stiff = stiffnesses(of.parameters, 5000.0, wob, 3.0)
            found = sum(1e3 * shape(0.5, n) ** 2 / stiff[n - 1] for n in range(1, modes + 1))
            assert found == pytest.approx(expected * 1e-3, rel=1e-6)
            assert found < limit


def test_a_force_of_the_wall_at_the_start():
    """The collar stands where the wall presses it so, bent as a force there bends it:
    every mode has the same force."""
    of = study(PAPER, initial__wall_force="1 MN", operation__wob="150 kN")
    modes = bent_against_wall(points(of))
    found = [
        stiff * modes[f"x_{n}"] / shape(0.1, n)
        for n, stiff in enumerate(stiffnesses(of.parameters, 5000.0, 150e3, 3.0), start=1)
    ]
    assert found == pytest.approx([found[0]] * 5, rel=1e-12)
    trace = simulate(of, duration=0.01).trace
    assert trace["wall_force"][0] == pytest.approx(1e6, rel=1e-9)
    assert trace["radius"][0] == pytest.approx(0.01 + (1e6 / 6.78e11) ** (2 / 3), rel=1e-12)


def test_a_free_mode_rebounds_as_hertz_says():
    """One mode that nothing bends, 2469.3 kg at 0.1 m/s: it goes (5 m v^2 / (4
    k))^(2/5) = 72.996 um deep, is in contact for 2.94321 of that over v = 2.148 ms, and
    leaves as fast as it came (Johnson, Contact Mechanics, 11.4)."""
    of = study(
        PAPER,
        beam__modes=1,
        beam__stations="[{at: 0.5}]",
        beam__axial_load="0 N",
        simulation__rtol=1e-11,
        drillstring__material__young_modulus="1 MPa",
        initial__x="9.9 mm",
        initial__vx="0.1 m/s",
    )
    trace = simulate(of, duration=4e-3, sample=1e-6).trace
    mass = 2469.291826
    depth = (5 * mass * 0.1**2 / (4 * 6.78e11)) ** 0.4
    assert depth == pytest.approx(7.2996e-5, rel=1e-4)
    assert trace["radius"].max() - 0.01 == pytest.approx(depth, rel=1e-6)
    on = trace.time[trace["wall_force"] > 0]
    assert on[-1] - on[0] == pytest.approx(2.94321 * depth / 0.1, abs=2e-6)
    assert trace["vx_1"][-1] == pytest.approx(-0.1, rel=1e-6)


def states(trace: Any, of: Any) -> dict[str, np.ndarray]:
    names = (*variant_at(model_named("beam"), of.parameters).states, "drive_angle")
    return {name: trace[name] for name in names}


def defect(of: Any, trace: Any) -> tuple[float, float]:
    """How far energy and work part at the worst, and how much work went through."""
    state = states(trace, of)
    held = energy(of.parameters, of.operation, state)
    fed = powers(of.parameters, of.operation, state)
    stations = stations_of(of.parameters, of.operation, state)
    for name in ("wall_force", "wall_friction"):
        assert trace[name] == pytest.approx(sum(station[name] for station in stations), rel=1e-12, abs=1e-6)
    total, t = sum(fed.values()), trace.time
    work = np.concatenate([[0.0], np.cumsum((t[2::2] - t[:-2:2]) / 6 * (total[:-2:2] + 4 * total[1::2] + total[2::2]))])
    return float(np.max(np.abs(held[::2] - held[0] - work))), float(simpson(sum(np.abs(p) for p in fed.values()), x=t))


OWN = "[{at: 0.2, gap: 60 mm}, {at: 0.5, stiffness: 40 MN/m, drag: 900 N*s^2/m^2}, {at: 0.8, stiffness: 0 N/m}]"


@pytest.mark.parametrize(
    ("load", "torque", "stations"),
    [
        ("live", "none", "[{at: 0.1}, {at: 0.5}, {at: 0.9}]"),
        ("live", "cy", "[{at: 0.1}, {at: 0.5}, {at: 0.9}]"),
        ("static", "none", OWN),
        ("0 N", "none", OWN),
        ("150 kN", "cy", OWN),
    ],
)
def test_energy_balances_through_all_contacts(load, torque, stations):
    """What drive and rock feed in, less what mud, walls and damping take, is what the
    collar holds: 6 s at 66.72 kN and 7 rad/s with an eccentricity of the odd modes.
    Simpson's rule over the kinks of the contacts leaves some 1e-8."""
    of = study(
        beam__modes=3,
        beam__stations=stations,
        drillstring__eccentricity_shape="uniform",
        beam__damping_ratio=0.005,
        beam__axial_load=load,
        beam__torque=torque,
        operation__wob="66.72 kN",
        operation__rotary_speed="7 rad/s",
        simulation__rtol=1e-10,
        initial__x="70 mm",
        initial__vx="0.5 m/s",
        initial__vz="0.3 m/s",
    )
    trace = simulate(of, duration=6.0, sample=1.25e-4).trace
    off, through = defect(of, trace)
    assert off < 1e-7 * through
    assert np.any(trace["wall_force"] > 0)
    assert np.any(trace["bit_force"] == 0)


def test_energy_is_kept_without_losses():
    """The paper's collar at 150 kN, pressed into the wall by 1 MN: what it holds stays,
    to the tolerance."""
    lost = []
    for rtol in (1e-6, 1e-8, 1e-10):
        of = study(
            PAPER,
            beam__modal_mass_factor=10,
            initial__wall_force="1 MN",
            operation__wob="150 kN",
            simulation__rtol=rtol,
        )
        trace = simulate(of, duration=20.0, sample=0.01).trace
        bending = energy(of.parameters, of.operation, states(trace, of))
        force = 10 * np.arange(1, 6) ** 2 * math.pi**2 / (2 * 20.0) * 150e3
        held = bending - 0.5 * sum(force[n - 1] * trace[f"x_{n}"] ** 2 for n in range(1, 6))
        lost.append(np.abs(held - held[0]).max())
    assert lost[2] < 1e-4 < lost[1] < 1e-2 < lost[0] < 1.0


def test_synchronous_whirl_without_drag():
    """x_n = q_n W^2 / (k_n / m - W^2) with the eccentricities 4 e0 / (n pi) of the odd
    modes turns with the string: the derivative of this state is what turning it makes
    of it."""
    of = study(
        mud__drag=0,
        drillstring__eccentricity_shape="uniform",
        beam__axial_load="0 N",
        bit__friction__static=0,
        bit__friction__dynamic=0,
        bit__cutting__zeta=0,
        bit__surface_amplitude="0 m",
    )
    k = coefficients(of.parameters, 5000.0, 22.24e3, 3.0)
    stiff = stiffnesses(of.parameters, 5000.0, 22.24e3, 3.0)
    names = variant_at(model_named("beam"), of.parameters).states
    angle, speed = 0.7, 3.0
    twist = -50.0 * speed / k.k_t
    state, expected = dict.fromkeys(names, 0.0), dict.fromkeys(names, 0.0)
    state |= {"z": -22.24e3 / (k.k_a + 25e6), "twist": twist, "bit_speed": speed}
    for n in (1, 3, 5):
        r = 4 * 0.0127 / (n * math.pi) * speed**2 / (stiff[n - 1] / k.m_l - speed**2)
        c, s = r * math.cos(angle), r * math.sin(angle)
        state |= {f"x_{n}": c, f"vx_{n}": -speed * s, f"y_{n}": s, f"vy_{n}": speed * c}
        expected |= {f"x_{n}": -speed * s, f"vx_{n}": -(speed**2) * c, f"y_{n}": speed * c, f"vy_{n}": -(speed**2) * s}
    t = np.array([(angle - twist) / speed])
    found = slopes(of, t, np.array([[state[name] for name in names]]), 1)[0]
    assert found == pytest.approx([expected[name] for name in names], abs=1e-12)


def test_ten_times_the_mass_is_a_tenth_of_the_wall():
    """The factor of the modal mass leaves the motion as it is where the wall is stiffer
    by as much."""
    one = study(
        PAPER,
        initial__wall_force="100 kN",
        operation__wob="350 kN",
        simulation__rtol=1e-10,
        well__stiffness="6.78e10 N/m^1.5",
    )
    ten = study(
        PAPER, initial__wall_force="1 MN", operation__wob="350 kN", simulation__rtol=1e-10, beam__modal_mass_factor=10
    )
    light, heavy = (simulate(of, duration=2.0, sample=0.01).trace for of in (one, ten))
    assert np.abs(light["radius"] - heavy["radius"]).max() < 1e-10
    assert 10 * light["wall_force"] == pytest.approx(heavy["wall_force"], rel=1e-6, abs=1.0)


def test_the_watched_place_is_the_station_nearest_to_the_middle():
    of = study(beam__stations="[{at: 0.2}, {at: 0.45}, {at: 0.7}, {at: 0.95}]")
    trace = simulate(of, duration=1.0, sample=0.1).trace
    state = states(trace, of)
    assert trace["x"] == pytest.approx(at_place(of.parameters, state, 0.45)["x"], abs=1e-15)
    values = of_string(points(of), Thresholds())
    assert values["watched_1"] == pytest.approx(math.sin(0.45 * math.pi), rel=1e-14)
