"""The string of segments along ramps, and a bit that creeps."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from nsdrill.app.experiment import prepare
from nsdrill.app.running.run import work_of
from nsdrill.kernel.settings import Simulation
from nsdrill.models.friction import implicit
from nsdrill.models.operation import Values
from nsdrill.models.registry import described
from nsdrill.models.responses import Thresholds
from nsdrill.models.segments.parameters import Initial
from nsdrill.models.variant import variant_at
from nsdrill.study.load import parse_study
from segments.lanes import DEPTH, MODEL, SPEED, Slopes, run, string
from segments.plain import Driven, Plain, ours, plain_of

FEW = {"segments__pipe": 2, "segments__collar": 2}


def lanes_of(states: np.ndarray, relax: float | None, **keys: Any) -> tuple[np.ndarray, Any]:
    """The lane buffer after the right-hand side at these ``states`` [8, states],
    implicit friction or not (None)."""
    parameters = string(**FEW, **keys)
    variant = variant_at(MODEL, parameters)
    variant = variant if relax is None else variant.implicit
    rows = variant.rows()
    b = np.zeros((rows.total, 8))
    points = Values(parameters, Initial(), (DEPTH, 100e3, SPEED))
    b[rows.parameter : rows.parameter + rows.parameters] = MODEL.pack(points, Thresholds())[0][:, None]
    b[: rows.states] = states.T
    if relax is not None:
        b[rows.relax] = relax
    variant.right_hand_side(8)(b.ravel())
    return b, rows


@pytest.mark.parametrize("relax", [1e-5, 1e-4, 4e-4])
@pytest.mark.parametrize("fastest", [0.1, 1.0, 20.0])
@pytest.mark.parametrize("smoothing", [50.0, 1e4])
def test_the_speed_of_a_stage_agrees_with_its_torque(relax, fastest, smoothing):
    """Stages of up to 4 ms, on the rock with up to three times the weight on bit, of
    bits of both directions: they have moved by ``relax`` times the push, and there the
    ordinary slopes are those found, to 1e-7 of the greatest push."""
    keys = {"bit__cutting__smoothing": smoothing}
    generator, n = np.random.default_rng(4), 4
    plain = Plain(pipes=2, collars=2)
    worst, greatest = 0.0, 0.0
    for _ in range(20):
        states = np.repeat([1e-5, 1e-4, 0.1, 0.5, 0.0], [n + 1] * 4 + [1]) * generator.normal(size=(8, 4 * n + 5))
        states[:, n] = -generator.uniform(0.0, 3.0, 8) * 100e3 / plain.k_c
        states[:, 4 * n + 3] = fastest * generator.uniform(-1.0, 1.0, 8)
        full = np.array([ours(state, n) for state in states])
        b, rows = lanes_of(full, relax, **keys)
        place = 2 * (2 * n + 1) + 1
        push, moved = b[rows.push], b[rows.stage + place]
        np.testing.assert_allclose(moved, full[:, place] + relax * push, rtol=1e-12, atol=1e-13)
        full[:, place] = moved
        ordinary, other = lanes_of(full, None, **keys)
        slope = 2 * n + 1
        differs = b[rows.acceleration + slope] - ordinary[other.acceleration + slope]
        worst, greatest = max(worst, np.abs(differs).max()), max(greatest, np.abs(push).max())
    assert greatest > 100.0
    assert worst < 1e-7 * greatest


@pytest.mark.parametrize("method", ["explicit", "implicit"])
def test_a_bit_from_rest_creeps_as_scipy_has_it(method):
    """A twisted string whose bit stands still, 0.3 s: the bit begins to creep and the
    string holds it. DOP853 on the plain equations at 1e-10."""
    parameters = string(**FEW)
    initial = Initial(twist=-9.0, bit_speed=0.0)
    done = run(parameters, Simulation(0.0, 0.3, rtol=1e-10, method=method, max_steps=10**7), initial)
    plain, n = Plain(pipes=2, collars=2), 4
    start = plain_of(done["initial_state"][0, :-1], n)
    absolute = 1e-10 * np.repeat([1e-4, 1e-2, 0.1, 1.0, 10.0], [n + 1] * 4 + [1])
    end = solve_ivp(plain.rates, (0.0, 0.3), start, method="DOP853", rtol=1e-10, atol=absolute).y[:, -1]
    assert 0.0198 < end[4 * n + 3] < 1.0  # it cuts, slowly
    size = plain_of(variant_at(MODEL, parameters).state_scales(Slopes(parameters).table[None])[0], n)
    assert np.max(np.abs(plain_of(done["final_state"][0, :-1], n) - end) / (size + np.abs(end))) < 2e-6


def test_both_methods_find_one_stick_slip():
    """Features of a minute, and the implicit method takes two thirds of the steps."""
    head = "model: segments\nsegments: {pipe: 2, collar: 2}\ninitial: {start: rest}\n"
    work = work_of(prepare(parse_study(f"{head}simulation: {{transient: 20 s, observe: 20 s}}\n")))
    from sweep.runs import run_work

    one, two = (
        run_work(replace(work, simulation=replace(work.simulation, method=method)))
        for method in ("explicit", "implicit")
    )
    for name in ("bit_speed_max", "stuck_fraction", "surface_torque_max"):
        assert two[name][0] == pytest.approx(one[name][0], rel=2e-3)
    assert two["steps"][0] < 0.7 * one["steps"][0]


def test_the_default_study_is_implicit():
    """`auto` follows the load: a bit creeps steeply where the depth of cut is great at
    a low speed."""
    study = parse_study("model: segments\n")
    chosen = [
        bool(implicit("auto", described("segments"), Values(study.parameters, study.initial, (DEPTH, wob, SPEED))))
        for wob in (10e3, 100e3, 200e3)
    ]
    assert chosen == [False, True, True]


STUDY = """
model: segments
segments: {{pipe: 2, collar: 2}}
operation:
  wob: {{ramp: [[0 s, 100 kN], [1.5 s, 80 kN]]}}
  rotary_speed: {{ramp: [[0 s, 13 rad/s], [1.5 s, 19 rad/s]]}}
initial: {{bit_speed: 10 rad/s}}
drive: {{{}}}
simulation: {{rtol: 1.0e-9}}
"""
GAINS = (0.029333, 41.716072, 2.158996, -32.539385, 13.552175)


REGULATED, TORQUE = f"kind: dc_motor, gains: {list(GAINS)}", {"kind": "soft_torque", "limit": 6000.0}


@pytest.mark.parametrize(
    ("drive", "string", "keys"),
    [
        ("kind: dc_motor", Plain, {}),
        (f"{REGULATED}, on_at: 0.7 s", Plain, {"gains": GAINS, "on_at": 0.7}),
        ("kind: ideal", Plain, {"stiff": True}),
        ("kind: soft_torque, torque_limit: 6 kN*m, on_at: 0.7 s", Driven, {**TORQUE, "on_at": 0.7}),
    ],
    ids=["motor", "regulated", "ideal", "torque"],
)
def test_a_ramp_is_the_motion_of_moving_numbers(drive, string, keys):
    """The drive, the mud's pulsation and the moment at which control begins go by the
    time of the run."""
    found = nsdrill.simulate(STUDY.format(drive), sample=0.1)

    def rates(t, y):
        moment = string(pipes=2, collars=2, speed=13.0 + 4.0 * t, wob=100e3 - 20e3 / 1.5 * t, **keys)
        moment.turned = lambda t: 13.0 * t + 2.0 * t * t
        made = np.array(moment.rates(t, y))
        if keys.get("stiff") or (string is Driven and t < keys["on_at"]):  # the top follows the set point
            made[3 * 5] = 4.0
        return made

    start = plain_of(found.attrs["initial_state"][:-1], 4)
    at = found.time.values
    pieces, y = [start[:, None]], start
    for first, last in ((0.0, 0.7), (0.7, 1.5)):  # the law begins with a jump
        end = last - 1e-12
        times = np.minimum(at[(at > first + 1e-9) & (at <= last + 1e-9)], end)
        one = solve_ivp(rates, (first, end), y, "DOP853", rtol=1e-9, atol=1e-9, t_eval=times, max_step=0.01)
        pieces, y = [*pieces, one.y], one.y[:, -1]
    rows = {"z": 4, "twist": 14, "bit_speed": 19, "drive_speed": 15, "current": 20, "lag": 10}
    exact = {name: np.concatenate(pieces, axis=1)[row] for name, row in rows.items()}
    for name, within in {"z": 2e-6, "twist": 2e-4, "bit_speed": 5e-3, "drive_speed": 1e-4, "lag": 1e-4}.items():
        if name in found:
            assert found[name].values == pytest.approx(exact[name], abs=within), name
    if "dc_motor" in drive:
        assert found["current"].values == pytest.approx(exact["current"], abs=0.1)
    if string is Driven:
        assert found["drive_speed"].values[6] == pytest.approx(13 + 4 * 0.6, abs=1e-9)
