"""Friction laws of the bit: the compiled equations against numpy, closed forms and
bifurcations of torsion."""

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from reference import Case, contacts, derivative, solve
from scipy.integrate import solve_ivp
from strings import STATES, pack, starts

import nsdrill
from main_model.buffers import slopes
from main_model.cases import features, parameters_of, random_case, random_state, torsion
from nsdrill.app.check import check
from nsdrill.app.running.run import run_in_memory
from nsdrill.app.simulating.trajectory import simulate
from nsdrill.models.christoforou_yigit.coefficients import bit_arm, derive, static_arm
from nsdrill.models.christoforou_yigit.derived_quantities import derived_quantities
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.friction import LAWS, LawOfBit
from nsdrill.study import parse_study
from nsdrill.text.run_text import check_lines

OTHERS = list(LAWS)[1:]


def lawful(rng: np.random.Generator, law: str) -> Case:
    u = rng.uniform
    numbers = {"b0": u(0.005, 0.05), "b1": u(0.5, 10), "b2": u(0, 20), "b3": u(1, 20)}
    return random_case(rng, bit_law=law, bit_from=10 ** u(-2, 1), lobes=3, **numbers)


@pytest.mark.parametrize("law", OTHERS)
def test_derivatives_equal_the_reference(law):
    """At 200 random states of as many random strings, on one lane and on eight."""
    rng = np.random.default_rng(11)
    cases = [lawful(rng, law).but(wall_law="linear") for _ in range(200)]
    states = np.array([random_state(rng, c) for c in cases])
    times = rng.uniform(0, 5, len(cases))
    table = np.concatenate([pack(parameters_of(c), c.depth, c.wob, c.speed) for c in cases])
    lobes = np.array([c.lobes for c in cases])
    found = slopes(8, False, table, times, states, lobes, friction=list(LAWS).index(law))
    alone = slopes(1, False, table, times, states, lobes, friction=list(LAWS).index(law))
    assert found.tobytes() == alone.tobytes()
    for c, t, s, mine in zip(cases, times, states, found, strict=True):
        exact = derivative(c, t, s)
        size = np.abs(exact)
        # Of a sum the terms lose bits against their own size.
        f = contacts(c, t, s)
        size[7] += (f["bit_torque"] + c.k_t * abs(s[6]) + abs(f["wall_friction"])) / c.J
        lateral = c.wall_stiffness * np.hypot(s[0], s[2]) / c.m_l + s[7] ** 2
        assert np.all(np.abs(mine - exact) <= 1e-11 * (size + np.array([0, lateral, 0, lateral, 0, 1e-3, 0, lateral])))


def test_every_law_has_its_word():
    assert get_args(LawOfBit) == tuple(LAWS)


@pytest.mark.parametrize("law", LAWS)
def test_the_array_form_is_odd_and_falls_as_it_says(law):
    parameters = parameters_of(Case(bit_law=law, bit_smoothing=1e9))
    k = derive(parameters, 5000.0, 22.24e3, 3.0)
    speed = np.array([0.05, 0.3, 0.9, 1.4, 3.0, 20.0])
    arm = bit_arm(parameters, k, speed)
    assert np.array_equal(bit_arm(parameters, k, -speed), -arm)
    h = 1e-5
    slope = (bit_arm(parameters, k, speed + h) - bit_arm(parameters, k, speed - h)) / (2 * h)
    assert [-bit_arm(parameters, k, v, "fall") for v in speed.tolist()] == pytest.approx(slope, rel=1e-4, abs=1e-7)
    assert np.all(arm < static_arm(parameters, k) * (1 + 1e-9))
    soft = parameters_of(Case(bit_law=law, bit_smoothing=5.0, zeta=0.0))
    near = derive(soft, 5000.0, 22.24e3, 3.0)
    assert bit_arm(soft, near, 1e-7) / 1e-7 == pytest.approx(bit_arm(soft, near, 0.0, "slope"), rel=1e-5)


@pytest.mark.parametrize("law", OTHERS)
def test_a_trace_equals_scipy(law):
    """Every state and the bit torque for 3 s, against DOP853 with the equations in
    plain Python."""
    case = Case(depth=2000.0, wob=40e3, speed=1.0, bit_smoothing=20.0, bit_law=law)
    study = parse_study(
        "operation: {depth: 2000 m, wob: 40 kN, rotary_speed: 1 rad/s}\n"
        + (
            "bit: {friction: {law: rational}}"
            if law == "rational"
            else f"bit: {{friction: {{law: {law}, smoothing: 20 s/rad}}}}"
        )
        + "\ninitial: {x: 30 mm, vy: 0.2 m/s, twist: -2 rad, bit_speed: 3 rad/s}\nsimulation: "
        "{rtol: 1e-11}"
    )
    trace = simulate(study, duration=3.0).trace
    start = [0.03, 0.0, 0.0, 0.2, -case.wob / (case.k_a + case.rock_stiffness), 0.0, -2.0, 3.0]
    exact = solve(case, start, 3.0, dense=True).sol(trace.time)
    # on both sides of the speed at which the linear law has its kink
    assert exact[7].min() < 1.0 < exact[7].max()
    for name, values in zip(STATES, exact, strict=True):
        assert trace[name] == pytest.approx(values, abs=1e-6 * np.max(np.abs(values))), name
    torque = contacts(case, trace.time, exact)["bit_torque"]
    assert trace["bit_torque"] == pytest.approx(torque, abs=1e-5 * np.max(np.abs(torque)))


@pytest.mark.parametrize("law", OTHERS)
def test_torque_tops_are_those_of_the_trace(law):
    text = f"operation: {{wob: 40 kN, rotary_speed: 1 rad/s}}\nbit: {{friction: {{law: {law}}}}}\n"
    study = parse_study(f"{text}simulation: {{transient: 5 s, observe: 15 s, rtol: 1e-8}}")
    kept = run_in_memory(study, workers=1).variables
    trace = simulate(study, duration=20.0, sample=0.0005).trace
    late = trace.time >= 5.0
    assert np.ravel(kept["bit_torque_max"]) == pytest.approx([trace["bit_torque"][late].max()], rel=2e-5)
    assert np.ravel(kept["bit_speed_max"]) == pytest.approx([trace["bit_speed"][late].max()], rel=1e-6)


# The torsional model: the axial and the lateral motion are frozen.

# c_t, T_s, T_d, V0, Omega: times of the three phases of slip, time at rest, period,
# peak speed. Computed beforehand by other code from the closed solution of each phase;
# collars of 150 m on 2000 m of pipe.
CYCLES = [
    ((20, 3000, 2000, 1, 4), (0.499970, 3.940275, 0.205622, 1.142113, 5.787980, 9.012733)),
    ((0, 3000, 2000, 1, 4), (0.497769, 3.848395, 0.169033, 1.371236, 5.886433, 9.367359)),
    ((20, 3000, 2000, 0.1, 4), (0.108284, 4.693121, 0.036438, 0.827463, 5.665307, 8.503411)),
    ((60, 3000, 1500, 0.5, 3), (0.312854, 3.939415, 0.116609, 1.663928, 6.032806, 7.321596)),
]
INERTIA, STIFFNESS = 373.99, 472.97


def sharp_cycle(case: tuple[float, ...]) -> tuple[float, ...]:
    """The cycle of the linear law without smoothing, phase by phase: from rest, where
    the spring overcomes the torque at rest, up to V0, above it, down to rest; and the
    rest, while the drive winds the string up again."""
    c_t, T_s, T_d, v0, drive = case
    state, times, peak = np.array([-T_s / STIFFNESS, 0.0]), [], 0.0
    for phase, level in enumerate((v0, v0, 0.0)):

        def rate(t: float, y: np.ndarray, phase: int = phase) -> list[float]:
            torque = T_d if phase == 1 else T_s - (T_s - T_d) * y[1] / v0
            return [y[1] - drive, -(STIFFNESS * y[0] + c_t * y[1] + torque) / INERTIA]

        def ends(t: float, y: np.ndarray, level: float = level, phase: int = phase) -> float:
            return y[1] - level if t > 1e-6 else 1.0 if phase else -1.0

        ends.terminal, ends.direction = True, -1 if phase else 1
        found = solve_ivp(rate, (0, 50), state, "DOP853", events=ends, rtol=1e-11, atol=1e-12, dense_output=True)
        times.append(found.t[-1])
        peak = max(peak, found.sol(np.linspace(0, found.t[-1], 20001))[1].max())
        state = found.y[:, -1]
    rest = (state[0] + T_s / STIFFNESS) / drive
    return (*times, rest, sum(times) + rest, peak)


def smoothed(case: tuple[float, ...], smoothing: float) -> nsdrill.study.Study:
    c_t, T_s, T_d, v0, drive = case
    arm = 60e3 * 2 / 3 * 0.1905
    return torsion(
        string=f"collar: {{length: 150 m}}, torsional_damping: {c_t} N*m*s/rad",
        zeta=0,
        depth=2150,
        wob=60,
        speed=drive,
        friction=f"law: linear, static: {T_s / arm!r}, dynamic: {T_d / arm!r}, dynamic_from: {v0} "
        f"rad/s, "
        f"smoothing: {smoothing} s/rad",
        transient=60,
        observe=60,
    )


@pytest.mark.parametrize(("case", "known"), CYCLES)
def test_the_cycle_of_the_linear_law(case, known):
    """The exact cycle, and the smoothed law that tends to it as its smoothing grows."""
    exact = sharp_cycle(case)
    assert exact == pytest.approx(known, abs=2e-5)
    sharp = 20000 / min(case[3], 1.0) ** 0.5
    found = features(smoothed(case, sharp))
    assert found["bit_speed_max"] == pytest.approx(exact[5], rel=4e-3)
    assert found["bit_torque_max"] == pytest.approx(case[1], rel=2e-2)


def test_smoothing_takes_the_peak_off_the_linear_law():
    """Peaks computed beforehand by other code; with a fall within 0.1 rad/s the cycle
    is lost, and check warns."""
    row = CYCLES[0][0]
    assert features(smoothed(row, 500))["bit_speed_max"] == pytest.approx(8.857, abs=1e-3)
    assert features(smoothed(row, 5000))["bit_speed_max"] == pytest.approx(8.974, abs=1e-3)
    steep = smoothed(CYCLES[2][0], 500)
    late = replace(steep, simulation=replace(steep.simulation, transient=300.0))
    assert features(late)["bit_speed_max"] == pytest.approx(4.0, abs=5e-3)
    assert any(warning.startswith("Rounded: ") and "5e+03 s/rad" in warning for warning in check(steep).warnings)
    assert not any(warning.startswith("Rounded: ") for warning in check(smoothed(row, 500)).warnings)


@pytest.mark.parametrize(
    ("friction", "wob", "known"),
    [
        ("law: hyperbolic, smoothing: 1.0e+7 s/rad", 22.24, 2.043),
        ("law: hyperbolic, smoothing: 1.0e+7 s/rad", 66.72, 3.783),
        ("law: rational", 22.24, 3.995),
        ("law: rational", 66.72, 7.000),
        ("law: rational", 135, 9.986),
    ],
)
def test_onset_of_stick_slip(friction, wob, known):
    """Computed beforehand by other code, without smoothing; whatever the depth."""
    for depth in (1000, 5000, 8000):
        study = torsion(friction=friction, wob=wob, speed=3, depth=depth, zeta=1 if "hyper" in friction else 0)
        found = derived_quantities(study.parameters, study.operation)["stick_slip_onset"].value
        assert found == pytest.approx(known, abs=2e-3)


@pytest.mark.parametrize(
    ("friction", "wob"),
    [
        *((f"law: {law}", wob) for law in LAWS for wob in (22.24, 66.72)),
        ("law: linear, dynamic_from: 10 rad/s", 66.72),
        ("law: exponential, decay: 10 s/rad", 66.72),
    ],
)
def test_stick_slip_of_every_law_lasts_to_the_fold_of_its_cycle(friction, wob):
    """From a stuck bit, by integration of the equations: it sticks at 0.98 of the fold, and
    no longer at 1.02."""
    one = torsion(friction=friction, wob=wob, speed=3)
    fold = derived_quantities(one.parameters, one.operation)["stick_slip_fold"].value
    swings = [
        features(torsion(friction=friction, wob=wob, speed=share * fold, transient=800))["stick_slip_index"]
        for share in (0.98, 1.02)
    ]
    assert swings[0] > 80
    assert swings[1] < 40


@pytest.mark.parametrize(
    ("drive", "wob", "fold"),
    [
        ("ideal", 22.24, 4.09),
        ("ideal", 66.72, 9.47),
        ("stiff", 66.72, 9.13),
        ("soft_torque", 66.72, 4.35),
        ("equal_damping", 22.24, 1.92),
        ("z_torque", 66.72, 4.43),
        ("lqr", 66.72, 2.70),
    ],
)
def test_the_fold_is_near_that_of_runs(drive, wob, fold):
    """Where stick-slip of the torsional model ended, from a stuck start, up in small
    steps, which end it up to 4 % too early, by other code."""
    study = parse_study(
        f"modes: {{axial: frozen, lateral: frozen}}\noperation: {{wob: {wob} kN, rotary_speed: 3 rad/s}}\n"
        f"drive: {{kind: {drive}}}"
    )
    assert derived_quantities(study.parameters, study.operation)["stick_slip_fold"].value == pytest.approx(
        fold, rel=0.05
    )


@pytest.mark.parametrize(
    ("drive", "wob", "fold"),
    [
        ("kind: ideal", 22.24, 4.0987),
        ("kind: ideal", 44.48, 6.9946),
        ("kind: ideal", 66.72, 9.587),
        ("kind: stiff", 66.72, 9.278),
        ("kind: soft_torque, matching: 1", 66.72, 6.303),
        ("kind: soft_torque, matching: 4", 66.72, 4.471),
        ("kind: equal_damping", 66.72, 4.662),
        ("kind: z_torque", 66.72, 4.445),
    ],
)
def test_the_fold_is_that_of_continuation_within_what_its_description_says(drive, wob, fold):
    """Folds by continuation, of docs/drives.md."""
    study = parse_study(
        f"modes: {{axial: frozen, lateral: frozen}}\noperation: {{wob: {wob} kN, rotary_speed: 3 "
        f"rad/s}}\ndrive: {{{drive}}}"
    )
    found = derived_quantities(study.parameters, study.operation)["stick_slip_fold"]
    assert found.meaning.endswith("persists (by its cycle, to 2 %)")
    assert found.value == pytest.approx(fold, rel=0.02)


def test_below_the_onset_a_swing_lasts_that_does_not_stop_the_bit():
    """Friction falls evenly up to 10 rad/s, and there steady drilling becomes stable; the bit
    comes to rest up to 8.7 rad/s only."""
    one = torsion(friction="law: linear, dynamic_from: 10 rad/s", wob=22.24, speed=3)
    figures = derived_quantities(one.parameters, one.operation)
    assert figures["stick_slip_fold"].value == figures["stick_slip_onset"].value == pytest.approx(10.0, rel=1e-3)


def test_without_damping_there_is_no_speed_at_which_stick_slip_ends():
    study = parse_study(
        "modes: {axial: frozen, lateral: frozen}\noperation: {wob: 66.72 kN, rotary_speed: 3 rad/s}\n"
        "drillstring: {torsional_damping: 0 N*m*s/rad}"
    )
    figures = derived_quantities(study.parameters, study.operation)
    for name in ("stick_slip_onset", "stick_slip_fold"):
        assert figures[name].value is None
        assert figures[name].everywhere
    report = check(study)
    assert report.as_json()["figures"]["stick_slip_onset"]["everywhere"] is True
    assert "stick_slip_onset   every speed" in "\n".join(check_lines(study, report, "study.yaml", "si", False))


def test_stick_slip_that_is_supercritical_has_a_fold_too():
    """Of a fall that is small: it sticks at 1.7 rad/s, above the onset, by integration."""
    one = torsion(friction="law: hyperbolic, dynamic: 0.45", wob=66.72, speed=3)
    figures = derived_quantities(one.parameters, one.operation)
    assert figures["stick_slip_fold"].value > figures["stick_slip_onset"].value
    at = features(
        torsion(
            friction="law: hyperbolic, dynamic: 0.45",
            wob=66.72,
            speed=0.97 * figures["stick_slip_fold"].value,
            transient=800,
        )
    )
    assert at["stick_slip_index"] > 80


@pytest.mark.parametrize(
    ("law", "wob", "hopf", "apart"),
    [
        *((f"law: {law}, smoothing: 100000 s/rad", 22.24, None, 0.03) for law in ("linear", "exponential")),
        ("law: rational", 22.24, None, 0.03),
        ("law: hyperbolic", 22.24, 2.036, 0.02),
        ("law: hyperbolic", 66.72, 3.770, 0.013),
    ],
)
def test_steady_drilling_loses_its_stability_at_the_onset(law, wob, hopf, apart):
    """A small swing about steady drilling grows below the onset of linear theory, where
    the slope of the torque, smoothing included, is the torsional damping, and dies out
    above it."""
    one = torsion(wob=wob, speed=3, friction=law)
    onset_speed = hopf or derived_quantities(one.parameters, one.operation)["stick_slip_onset"].value
    assert onset_speed is not None
    for speed, grows in ((onset_speed * (1 - apart), True), (onset_speed * (1 + apart), False)):
        study = torsion(wob=wob, speed=speed, friction=law)
        k = derive(study.parameters, 5000.0, wob * 1e3, speed)
        steady = -(wob * 1e3 * float(bit_arm(study.parameters, k, speed)) + 50.0 * speed) / k.k_t
        near = {"wob": wob, "speed": speed, "friction": law, "twist": steady + 0.01, "bit_speed": speed}
        first, later = (features(torsion(**near, transient=t, observe=30)) for t in (0, 570 if hopf else 300))
        swing = [found["bit_speed_max"] - found["bit_speed_min"] for found in (first, later)]
        assert (swing[1] > swing[0]) is grows


def test_peaks_of_the_rational_law():
    """The greatest torque stands at 0.542 rad/s; computed beforehand by other code."""
    parameters = torsion(friction="law: rational", wob=22.24, speed=3).parameters
    k = derive(parameters, 5000.0, 22.24e3, 3.0)
    speed = np.linspace(0.0, 2.0, 20001)
    torque = 22.24e3 * bit_arm(parameters, k, speed)
    assert torque.max() == pytest.approx(1351.8, abs=0.05)
    assert speed[np.argmax(torque)] == pytest.approx(0.542, abs=1e-3)
    assert 66.72e3 * bit_arm(parameters, k, 10.0) == pytest.approx(1841.9, abs=0.05)
    light = torsion(friction="law: rational", wob=0.1, speed=3)  # nowhere as steep as the damping
    assert derived_quantities(light.parameters, light.operation)["stick_slip_onset"].value is None


@pytest.mark.parametrize(("wob", "below", "above"), [(22.24, 4.1, 4.15), (66.72, 9.55, 9.62)])
def test_stick_slip_of_the_default_law_ends_at_its_fold(wob, below, above):
    """From a stuck bit: between 4.10 and 4.15, and between 9.55 and 9.62 rad/s by
    SciPy's Radau."""
    assert features(torsion(wob=wob, speed=below))["stuck_fraction"] > 0.05
    assert features(torsion(wob=wob, speed=above, transient=800))["stuck_fraction"] == 0.0


def test_an_ensemble_winds_up_to_the_torque_at_rest():
    """With spread 1 the twist reaches from 0 to 1.5 times that of the torque at rest,
    whatever the law."""
    for law in LAWS:
        parameters = Parameters(bit=replace(parameters_of(Case(bit_law=law)).bit))
        k = derive(parameters, 5000.0, 22.24e3, 3.0)
        states = starts(parameters, Initial(ensemble=400), 5000.0, 22.24e3, 3.0, np.arange(400))
        most = -1.5 * (22.24e3 * static_arm(parameters, k) + 150.0) / k.k_t
        assert most < states[:, 6].min() < 0.98 * most
        tight = starts(parameters, Initial(ensemble=4, spread=1e-6), 5000.0, 22.24e3, 3.0, np.arange(4))
        steady = -(22.24e3 * float(bit_arm(parameters, k, 3.0)) + 150.0) / k.k_t
        assert tight[:, 6] == pytest.approx(np.full(4, steady), rel=1e-3)
