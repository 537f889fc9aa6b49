"""Runs along a ramp: against plain runs, exact solutions, the energy balance, and
themselves with finer segments."""

import json
from itertools import pairwise

import numpy as np
import pytest
from energies import energy, powers
from scipy.integrate import cumulative_simpson, solve_ivp
from scipy.linalg import expm
from strings import STATES, starts

from nsdrill.app.running.run import run_in_memory
from nsdrill.app.simulating.integration import run_schedule, schedule_of
from nsdrill.app.simulating.trajectory import simulate
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.operation import Operation, Ramp, Schedule, integral
from nsdrill.models.ramp import Ramps, ahead_of
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.variant import variant_at
from nsdrill.study import Study, parse_study
from nsdrill.variables import MODEL

# In and out of the rock, the collar inside the hole; regular motion, or rounding would
# grow.
CALM = """
operation: {{depth: {depth}, wob: {wob}, rotary_speed: {speed}}}
bit: {{friction: {{smoothing: 20 s/rad}}}}
initial: {{twist: -2 rad, drive_angle: 0.7 rad}}
simulation: {{rtol: 1e-10}}
"""


def calm(depth: str = "2000 m", wob: str = "22 kN", speed: str = "4 rad/s", more: str = "") -> Study:
    return parse_study(CALM.format(depth=depth, wob=wob, speed=speed) + more)


def state_of(trace) -> dict[str, np.ndarray]:
    return {name: trace[name] for name in (*STATES, "drive_angle")}


def test_a_ramp_that_changes_nothing_is_the_plain_run():
    """Not to the bit: its middle knot cuts a step."""
    study = calm(speed="{ramp: [[0 s, 4 rad/s], [3 s, 4 rad/s], [5 s, 4 rad/s]]}")
    ramp = simulate(study).trace
    plain = simulate(study, rotary_speed=4.0, duration=5.0).trace
    assert "ramps" in ramp.attrs
    assert "ramps" not in plain.attrs
    for name, values in plain.variables.items():
        assert ramp[name] == pytest.approx(values, abs=1e-5 * max(np.max(np.abs(values)), 1e-3)), name


# The rock gives no torque and nothing is out of balance, so the twist is a damped
# oscillator whose base has the drive's speed, whatever the bit does up and down.
FREE = """
operation: {wob: 0 N, rotary_speed: {ramp: [[0 s, 3 rad/s], [12 s, 9 rad/s], [20 s, 5 rad/s]]}}
drillstring: {eccentricity: 0 mm, torsional_damping: 40 N*m*s/rad}
bit: {surface_amplitude: 0 mm, cutting: {zeta: 0}, friction: {static: 0, dynamic: 0}}
initial: {z: 20 mm, x: 0 mm}
simulation: {rtol: 1e-11}
"""


def test_the_free_string_follows_the_drive_as_the_exact_solution_does():
    """J psi'' + c psi' + k psi = -(J Omega' + c Omega) with Omega linear has a
    particular solution linear in time and free vibrations about it."""
    study = parse_study(FREE)
    trace = simulate(study, duration=30.0).trace
    k = derive(study.parameters, 5000.0, 0.0, 3.0)
    J, c, k_t = k.J, 40.0, k.k_t
    w0, decay = np.sqrt(k_t / J), c / (2 * J)
    w = np.sqrt(w0**2 - decay**2)
    exact = np.empty_like(trace.time)
    psi, rate = 0.0, 0.0  # the bit begins at the drive's speed
    for begin, end, omega, slope in ((0, 12, 3.0, 0.5), (12, 20, 9.0, -0.5), (20, 30, 5.0, 0.0)):
        # psi = a + b t + vibration
        b = -c * slope / k_t
        a = -(J * slope + c * omega + c * b) / k_t
        p, q = psi - a, (rate - b + decay * (psi - a)) / w

        def motion(t, a=a, b=b, p=p, q=q):
            return a + b * t + np.exp(-decay * t) * (p * np.cos(w * t) + q * np.sin(w * t))

        def speed(t, b=b, p=p, q=q):
            return b + np.exp(-decay * t) * (
                (-decay * p + w * q) * np.cos(w * t) + (-decay * q - w * p) * np.sin(w * t)
            )

        here = (trace.time >= begin) & (trace.time <= end)
        exact[here] = motion(trace.time[here] - begin)
        psi, rate = motion(end - begin), speed(end - begin)
    assert np.max(trace["wall_force"]) == np.max(np.abs(trace["bit_torque"])) == 0.0
    assert np.ptp(exact) > 0.5
    assert trace["twist"] == pytest.approx(exact, abs=1e-8)
    assert trace["surface_torque"] == pytest.approx(-k_t * exact, abs=1e-8 * k_t)


def test_twist_and_drive_angle_are_continuous_and_their_sum_turns_with_the_bit():
    speed = "{ramp: [[0 s, 2 rad/s], [1 s, 6 rad/s], [1.5 s, 6 rad/s], [3 s, 3 rad/s]]}"
    trace = simulate(calm(speed=speed), duration=4.0, sample=1e-3).trace
    angle = trace["twist"] + trace["drive_angle"]
    turned = cumulative_simpson(trace["bit_speed"], x=trace.time, initial=0.0)
    assert angle - angle[0] == pytest.approx(turned, abs=1e-7)
    assert np.diff(trace["drive_angle"]) == pytest.approx(
        0.5e-3 * (trace["drive_speed"][1:] + trace["drive_speed"][:-1]), abs=1e-12
    )
    assert trace["drive_speed"][[0, 500, 1250, 2250, 3500]] == pytest.approx([2, 4, 6, 4.5, 3], rel=1e-12)
    assert trace.attrs["final_state"][-1] == pytest.approx(trace["drive_angle"][-1], rel=1e-13)
    assert trace.attrs["final_state"][6] == pytest.approx(trace["twist"][-1], rel=1e-12)


@pytest.mark.parametrize("softening", ["live", "static"])
def test_the_energy_balance_holds_along_a_ramp(softening):
    """With the whole system: collar on the wall, bit in and out of the rock, speed and
    weight changing.

    The drive works at its speed of the moment, and the energy W z of the weight changes
    by dW/dt z besides; with static softening the energy of bending does not, as the
    softening is an agent of its own.
    """
    more = f"drillstring: {{lateral_softening: {softening}}}\n"
    study = parse_study(
        CALM.format(
            depth="3000 m",
            wob="{ramp: [[0 s, 10 kN], [4 s, 40 kN]]}",
            speed="{ramp: [[0 s, 3 rad/s], [3 s, 8 rad/s], [5 s, 4 rad/s]]}",
        ).replace("{twist: -2 rad", "{x: 75 mm, vy: -1 m/s, twist: -2 rad")
        + more
    )
    trace = simulate(study, duration=6.0, sample=2e-4).trace
    assert np.max(trace["wall_force"]) > 0
    assert np.any(trace["bit_force"] == 0)
    point = schedule_of(study, {}).at(trace.time)
    state = state_of(trace)
    e = energy(study.parameters, point, state)
    fed = powers(study.parameters, point, state)
    rate = np.where(trace.time < 4.0, 7500.0, 0.0)
    work = cumulative_simpson(sum(fed.values()) + rate * trace["z"], x=trace.time, initial=0.0)
    through = cumulative_simpson(sum(np.abs(p) for p in fed.values()), x=trace.time)[-1]
    assert np.max(np.abs(e - e[0] - work)) < 2e-6 * through


def test_a_changing_depth_is_the_equation_with_coefficients_of_the_moment():
    """Against SciPy on the torsional and axial equations, quasi-static in depth."""
    study = parse_study(FREE.replace("wob: 0 N,", "wob: 0 N, depth: {ramp: [[0 s, 1000 m], [20 s, 3000 m]]},"))
    trace = simulate(study, duration=20.0, sample=0.1).trace
    speed = Ramp((0.0, 12.0, 20.0), (3.0, 9.0, 5.0))

    def slope(t, y):
        k = derive(study.parameters, 1000.0 + 100.0 * t, 0.0, 1.0)
        return [
            y[1] - speed.at(t),
            -(40.0 * y[1] + k.k_t * y[0]) / k.J,
            y[3],
            (25e6 * max(-y[2], 0.0) - 4000 * y[3] - k.k_a * y[2]) / k.m_a,
        ]

    exact = solve_ivp(slope, (0, 20), [0.0, 3.0, 0.02, 0.0], t_eval=trace.time, rtol=1e-10, atol=1e-10, max_step=0.1)
    assert trace["twist"] == pytest.approx(exact.y[0], abs=3e-5 * np.ptp(exact.y[0]))
    assert trace["z"] == pytest.approx(exact.y[2], abs=1e-4 * 0.02)
    assert trace["depth"][[0, 100, -1]] == pytest.approx([1000, 2000, 3000])


def test_finer_segments_change_nothing():
    """The depth makes every coefficient bend within a segment; the error falls with the
    square of its length."""
    study = calm(
        depth="{ramp: [[0 s, 2000 m], [5 s, 2200 m]]}",
        wob="{ramp: [[0 s, 20 kN], [5 s, 30 kN]]}",
        speed="{ramp: [[0 s, 4 rad/s], [5 s, 5 rad/s]]}",
    )
    schedule = schedule_of(study, {})
    initial = starts(study.parameters, study.initial, *vars(schedule.start).values())[0]
    ends = [run_schedule(study, schedule, 5.0, initial, 2, 5.0, pieces).final for pieces in (16, 64, 256, 512)]
    scale = np.maximum(np.abs(ends[-1]), [1e-3, 1e-2, 1e-3, 1e-2, 1e-4, 1e-3, 0.1, 1, 1])
    errors = [np.max(np.abs(end - ends[-1]) / scale) for end in ends[:-1]]
    assert errors[2] < 1e-5
    assert errors[1] < errors[0] / 5


def test_a_very_slow_ramp_is_the_sweep():
    """Where nothing is hysteretic: low lobes, always in contact, towards the resonance
    of the axial motion in contact at 6 rad/s."""
    text = """
operation: {depth: 2000 m, wob: 22 kN, rotary_speed: SPEED}
drillstring: {axial_damping: 60 kN*s/m}
bit: {surface_amplitude: 0.1 mm}
simulation: {transient: 400 s, observe: 10 s}
"""
    sweep = run_in_memory(
        parse_study(
            text.replace("SPEED", "4 rad/s") + "sweep: {rotary_speed: [4.5 rad/s, 5 rad/s, 5.5 rad/s], procedure: up}"
        )
    )
    ramp = simulate(
        parse_study(text.replace("SPEED", "{ramp: [[0 s, 4 rad/s], [40 s, 4 rad/s], [840 s, 6 rad/s]]}"))
    ).trace
    assert np.max(sweep["lift_off_fraction"]) == 0.0
    heights = []
    for place, speed in enumerate((4.5, 5.0, 5.5)):
        near = np.abs(ramp["drive_speed"] - speed) < 0.015
        values, low, high = (ramp["z"][near], sweep["axial_min"][0, 0, 0, place], sweep["axial_max"][0, 0, 0, place])
        heights.append(high - low)
        assert values.max() - values.min() == pytest.approx(high - low, rel=0.03), speed
    assert heights[2] > 1.5 * heights[0]


def test_the_segments():
    ramps = {"wob": Ramp((0.0, 10.0), (1e4, 1e4)), "rotary_speed": Ramp((0.0, 4.0, 8.0), (2.0, 4.0, 4.0))}
    schedule = Schedule(Operation(), ramps)
    cuts = schedule.cuts(20.0)
    assert {0.0, 4.0, 8.0, 10.0, 20.0} <= set(cuts)
    assert np.all(np.diff(cuts) > 0)
    assert np.count_nonzero(cuts < 4.0) == 256
    assert np.count_nonzero(cuts >= 4.0) == 4
    assert Schedule(Operation(), {"wob": Ramp((0.0, 1.0), (0.0, 1e4))}).cuts(1.0).size == 257
    assert Schedule(Operation(), {"wob": Ramp((0.0, 9.0), (1e4, 1.01e4))}).cuts(9.0).size == 4
    assert schedule.cuts(3.0)[-1] == 3.0
    ramps = Ramps(variant_at(model_named(MODEL), Parameters()))
    table = ramps.pack(Parameters(), Initial(), schedule, cuts, Thresholds())
    time = np.linspace(0, 20, 777)
    assert np.max(np.abs(ahead_of(table, cuts, cuts))) < 1e-15
    assert np.max(np.abs(ahead_of(table, cuts, time))) < 2e-5


def test_the_drive_angle_is_the_integral_of_its_speed():
    schedule = Schedule(Operation(), {"rotary_speed": Ramp((0.0, 4.0, 9.0), (2.0, 6.0, 1.0))})
    time = np.linspace(0, 15, 1501)
    exact = cumulative_simpson(schedule.at(time).rotary_speed, x=time, initial=0.0)
    knots = schedule.knots("rotary_speed")
    assert integral(knots, schedule.at(knots).rotary_speed, time) == pytest.approx(exact, rel=1e-13)
    assert schedule.end == 9.0


def test_ramps_outside_the_model_are_refused():
    for times, values in (((0.0,), (1.0,)), ((1.0, 2.0), (1.0, 2.0)), ((0.0, 0.0), (1.0, 2.0)), ((0.0, 1.0), (1.0,))):
        with pytest.raises(ValueError, match="ramp: found"):
            Ramp(times, values)
    with pytest.raises(ValueError, match="rotary_speed: found 0"):
        Schedule(Operation(), {"rotary_speed": Ramp((0.0, 1.0), (1.0, 0.0))})


def test_a_ramp_that_stops_early_gives_the_samples_it_reached():

    limited = parse_study(
        CALM.format(depth="2000 m", wob="22 kN", speed="{ramp: [[0 s, 4 rad/s], [50 s, 8 rad/s]]}").replace(
            "rtol: 1e-10", "rtol: 1e-12, max_steps: 1000"
        )
    )
    result = simulate(limited)
    assert result.trace.attrs["status"] == "step_limit"
    assert result.trace.attrs["steps"] + result.trace.attrs["rejected"] == 1000
    assert 0 < len(result.trace.time) < 5001
    assert json.loads(result.trace.attrs["ramps"]) == {"rotary_speed": [[0.0, 50.0], [4.0, 8.0]]}


def logged(samples: int, interval: float) -> str:
    """A logged speed about 7 rad/s with noise, as a ramp."""
    rng = np.random.default_rng(1)
    speeds = 7.0 + np.sin(0.3 * np.arange(samples)) + 0.05 * rng.standard_normal(samples)
    knots = ", ".join(f"[{i * interval:g} s, {speed:.4f} rad/s]" for i, speed in enumerate(speeds))
    return f"{{ramp: [{knots}]}}"


@pytest.mark.parametrize("method", ["explicit", "implicit"])
@pytest.mark.parametrize("max_steps", [50_000_000, 1000])
def test_segments_in_one_call_have_the_bits_of_single_ones(monkeypatch, method, max_steps):
    """Also where the steps run out within the call."""
    more = f"simulation: {{method: {method}, max_steps: {max_steps}}}\nmodes: {{axial: frozen, lateral: frozen}}\n"
    study = parse_study(f"operation: {{rotary_speed: {logged(400, 0.1)}}}\n{more}")
    together = simulate(study)
    monkeypatch.setattr("nsdrill.app.simulating.integration.CHAINED", 1)
    alone = simulate(study)
    for one in ("steps", "rejected", "status"):
        assert together.trace.attrs.get(one) == alone.trace.attrs.get(one)
    for name, values in alone.trace.variables.items():
        np.testing.assert_array_equal(together.trace[name], values, err_msg=name)
    ended = int(alone.trace.attrs["steps"]) + int(alone.trace.attrs["rejected"]) < max_steps
    assert ended == (max_steps > 1000)


@pytest.mark.parametrize("model", ["christoforou_yigit", "torsion", "segments"])
def test_a_log_costs_few_steps_more_than_a_plain_run(model):
    """A step ends at each knot, and the next one is as long as the controller proposed:
    where plain steps are longer than the legs, as in torsion, there is one in each. (When
    each leg began with a small step there were 6.6 in the main model, 4 in torsion.)"""
    text = f"model: {model}\noperation: {{{{depth: 2000 m, wob: 60 kN, rotary_speed: {{}}}}}}\n"
    legs, interval = 500, 0.02

    def tried(speed: str) -> int:
        attrs = simulate(parse_study(text.format(speed)), duration=legs * interval).trace.attrs
        assert attrs["status"] == "ok"
        return int(attrs["steps"]) + int(attrs["rejected"])

    knots = ", ".join(f"[{i * interval:g} s, {8 + 1.5 * np.sin(0.03 * i):.6f} rad/s]" for i in range(legs + 1))
    most = {"torsion": 1.1 * legs, "christoforou_yigit": 2.5 * legs}
    found = tried(f"{{ramp: [{knots}]}}")
    assert legs <= found <= most.get(model, tried("8 rad/s") + 2.5 * legs)


def test_the_free_string_follows_a_log_as_the_exact_solution_does():
    """The oscillator of FREE along 600 knots, from knot to knot with the propagator of the
    linear system, at the default tolerance: its steps are as short as the legs."""
    rng = np.random.default_rng(4)
    times = 0.02 * np.arange(601)
    speeds = np.round(6.0 + np.sin(2.0 * times) + 0.1 * rng.standard_normal(601), 4)
    knots = ", ".join(f"[{t:g} s, {speed:.4f} rad/s]" for t, speed in zip(times, speeds, strict=True))
    text = FREE.replace("[0 s, 3 rad/s], [12 s, 9 rad/s], [20 s, 5 rad/s]", knots)
    k = derive(parse_study(text).parameters, 5000.0, 0.0, 6.0)
    # states: twist, bit speed, drive speed, its slope
    rates = np.zeros((4, 4))
    rates[0, [1, 2]], rates[1, [0, 1]], rates[2, 3] = (1.0, -1.0), (-k.k_t / k.J, -40.0 / k.J), 1.0
    step, exact, state = expm(0.02 * rates), [0.0], np.array([0.0, speeds[0], 0.0, 0.0])
    for first, second in pairwise(speeds):
        state = step @ [*state[:2], first, (second - first) / 0.02]
        exact.append(state[0])
    twist = simulate(parse_study(text.replace("1e-11", "1e-6")), sample=0.02).trace["twist"]
    assert twist == pytest.approx(np.array(exact), abs=1e-10 * np.ptp(exact))


def test_a_step_that_is_kept_over_a_knot_is_as_accurate():
    """Rolling, bouncing, with friction: the error of a log falls with the tolerance, and is
    of the size of that of a plain run."""

    def errors(speed: str) -> np.ndarray:
        text = CALM.format(depth="2000 m", wob="22 kN", speed=speed)
        studies = (parse_study(text.replace("1e-10", rtol)) for rtol in ("1e-6", "1e-8", "1e-12"))
        traces = [simulate(study, duration=4.0).trace for study in studies]
        ends = [np.array([trace[name] for name in ("x", "z", "twist", "bit_speed")]) for trace in traces]
        return np.array([np.max(np.abs(end - ends[-1]) / np.ptp(ends[-1], axis=1)[:, None]) for end in ends[:-1]])

    log, plain = errors(logged(200, 0.02)), errors("7 rad/s")
    assert log[0] < 10 * plain[0]
    assert log[1] < 0.1 * log[0]


def test_a_leg_between_two_samples_of_a_log_is_one_segment():
    """And a slow leg is cut as finely as before."""
    study = parse_study(f"operation: {{rotary_speed: {logged(500, 0.02)}}}")
    assert len(schedule_of(study, {}).cuts(500 * 0.02)) == 501
    slow = parse_study("operation: {rotary_speed: {ramp: [[0 s, 4 rad/s], [10 s, 8 rad/s]]}}")
    assert len(schedule_of(slow, {}).cuts(10.0)) == 257


def test_a_weight_ramp_is_followed_by_a_bit_that_does_not_bounce():
    """Without axial motion the force on the rock is the weight at every moment, and the
    torque of steady drilling that of a plain run."""
    text = "modes: {{axial: frozen, lateral: frozen}}\noperation: {{depth: 1000 m, rotary_speed: 12 rad/s, wob: {}}}"
    ramp = simulate(
        parse_study(text.format("{ramp: [[0 s, 40 kN], [60 s, 40 kN], [80 s, 80 kN], [200 s, 80 kN]]}")), sample=0.1
    ).trace
    time, force = ramp["time"], ramp["bit_force"]
    np.testing.assert_allclose(force, np.interp(time, [0, 60, 80, 200], [4e4, 4e4, 8e4, 8e4]), rtol=1e-9)
    for wob, part in ((40, slice(500, 600)), (80, slice(-200, None))):
        plain = simulate(parse_study(text.format(f"{wob} kN")), duration=200.0, sample=0.1).trace
        assert np.mean(ramp["surface_torque"][part]) == pytest.approx(np.mean(plain["surface_torque"][part]), rel=1e-4)
