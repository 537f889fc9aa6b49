"""Deviations, against neighbouring runs: of the main model with stabilisers and with
friction along the axis, of a string of segments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deviations import followed_and_quotient

import nsdrill
from nsdrill.abi import RATES, Rows
from nsdrill.app.experiment import prepare
from nsdrill.app.run import work_of
from nsdrill.models.leaves import Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.observe.thresholds import Record
from nsdrill.store import from_dataset
from nsdrill.study import parse_study

STABILIZERS = """
operation: {wob: 40 kN, rotary_speed: 5 rad/s}
stabilizer: {clearance: 5 mm, friction: {static: 0.3, dynamic: 0.2, smoothing: 50 s/m}}
initial: {x: 6 mm, vx: 0.1 m/s, vy: 0.2 m/s}
"""
ALONG = """
operation: {wob: 40 kN, rotary_speed: 4 rad/s}
well: {inclination: 60 deg, axial_friction: true, friction: {smoothing: 20 s/m}}
initial: {x: 5 mm, y: -76 mm, vx: 0.3 m/s}
"""
SEGMENTS = """
model: segments
segments: {pipe: 2, collar: 2}
operation: {wob: 100 kN, rotary_speed: 13 rad/s}
initial: {bit_speed: 9 rad/s}
"""
IDEAL = SEGMENTS + "drive: {kind: ideal}\n"


# Steps land on rock and wall, but not where the cutters begin to bite: in half a second
# of a bouncing bit on segments a deviation misses by 1e-2 at 1e-8, the neighbouring runs
# themselves by 2e-3.
@pytest.mark.parametrize(
    ("text", "seconds", "rtol", "within"),
    [
        (STABILIZERS, 2.0, "1.0e-8", 1e-3),
        (ALONG, 2.0, "1.0e-8", 1e-3),
        (SEGMENTS, 0.1, "1.0e-8", 5e-4),
        (SEGMENTS, 0.5, "1.0e-10", 1e-2),
        (IDEAL, 0.5, "1.0e-10", 1e-2),
    ],
    ids=["stabilizers", "along", "touch", "segments", "ideal"],
)
def test_the_deviation_is_the_derivative_of_the_motion(text: str, seconds: float, rtol: str, within: float) -> None:
    study = parse_study(f"{text}simulation: {{transient: 0 s, observe: {seconds} s, rtol: {rtol}}}\n")
    followed, quotient = followed_and_quotient(work_of(prepare(study)), 1e-11)
    assert np.linalg.norm(followed - quotient) < within * np.linalg.norm(quotient)


@pytest.mark.parametrize("cut", ["c2: -0.00019", "c2: 0.001", "speed: mean"])
@pytest.mark.parametrize("drive", ["dc_motor", "soft_torque"])
@pytest.mark.parametrize("implicit", [False, True])
def test_the_tangent_of_segments_is_the_derivative_of_their_slopes(cut: str, drive: str, implicit: bool) -> None:
    """At random states, on the rock and off it, after the rock's side at the start of a
    step: slopes, pushes and moved velocities, against differences of fourth order."""
    study = parse_study(
        "model: segments\nsegments: {pipe: 2, collar: 3}\noperation: {wob: 100 kN}\n"
        f"bit: {{lobes: 3, cutting: {{{cut}}}}}\ndrive: {{kind: {drive}}}\n"
    )
    model, at, lanes, step = model_named("segments"), study.operation, 16, 1e-4
    variant = model.variant(study.parameters)
    variant = model.implicit(variant) if implicit else variant
    speeds = tuple(np.full(lanes, v) for v in (at.depth, at.wob, at.rotary_speed))
    points = Values(study.parameters, study.initial, speeds)
    table, rng = model.pack(points, Thresholds()), np.random.default_rng(7)
    rows, plain = model.rows(variant, RATES, tangent=True), model.rows(variant)
    size = model.state_scales(table, variant).T
    state = model.starts(points, 0)[:, : rows.own].T + rng.normal(size=size.shape) * size
    z = model.states(variant).index("z")
    state[z] += np.where(np.arange(lanes) % 2, 15.0, -15.0) * size[z]
    deviation = rng.normal(size=size.shape) * size
    phase, time = rng.uniform(0.0, 6.0, lanes), rng.uniform(0.0, 3.0, lanes)

    def buffer(of: Rows, states: np.ndarray) -> np.ndarray:
        b = np.zeros((of.total, lanes))
        b[of.parameter : of.parameter + of.parameters] = table.T
        b[of.phase], b[of.stage_time], b[: of.own] = phase, time, states
        if implicit:
            b[of.relax] = 1e-4
        return b

    def slopes(shift: float) -> np.ndarray:
        b = buffer(plain, state + shift * step * deviation)
        model.right_hand_side(lanes, variant)(b.ravel())
        own, push = plain.own, len(plain.pushed)
        made = b[plain.acceleration :][: plain.slopes], b[plain.push :][:push], b[:own]
        return np.concatenate(made[: 3 if implicit else 1])

    b = buffer(rows, state)
    b[rows.own : 2 * rows.own] = deviation
    angle = state[model.states(variant).index("twist")] + at.rotary_speed * time + phase
    b[rows.observer] = study.parameters.bit.surface_amplitude * np.sin(3 * angle) - state[z]
    assert 0 < np.sum(b[rows.observer] > 0.0) < lanes
    model.tangent(lanes, variant, 0)(b.ravel())
    push = len(rows.pushed) // 2
    found = b[rows.acceleration + rows.own_slopes :][: rows.own_slopes]
    parts = found, b[rows.push + push :][:push], b[rows.own : 2 * rows.own]
    found = np.concatenate(parts[: 3 if implicit else 1])
    exact = (8 * (slopes(1) - slopes(-1)) - (slopes(2) - slopes(-2))) / (12 * step)
    # Newton's method leaves 1e-10 of a load, and a difference in the last bits of slopes.
    bound = (1e-6 if implicit else 1e-9) * np.abs(exact).max(axis=1, keepdims=True)
    assert np.all(np.abs(found - exact) <= bound)


@pytest.mark.parametrize("text", [STABILIZERS, SEGMENTS], ids=["stabilizers", "segments"])
def test_a_run_has_the_same_bits_with_its_exponent(text: str) -> None:
    study = f"{text}sweep: {{wob: [40 kN, 60 kN, 90 kN]}}\nsimulation: {{transient: 0.5 s, observe: 1 s}}\n"
    plain, told = (nsdrill.run(study, set={"record.exponent": switch}) for switch in (False, True))
    for name in plain.data_vars:
        assert np.array_equal(plain[name].values, told[name].values, equal_nan=True), name
    assert np.all(np.isfinite(told.lyapunov_exponent))
    assert from_dataset(told).variables["lyapunov_error"].shape[-1] > 0


def test_steady_rotation_of_segments_decays_as_its_slowest_eigenvalue() -> None:
    """On low lobes and without pulsation a string that begins a little slower swings
    about steady drilling and comes to rest; its deviations decay with the slowest
    eigenvalue of the string on flat rock, linear about steady drilling."""
    text = """
model: segments
segments: {pipe: 1, collar: 1, material_damping: {axial: 5 ms, torsional: 20 ms}, hydraulics: {pulsation: 0 L/s}}
bit: {surface_amplitude: 0.1 mm}
drive: {kind: ideal}
operation: {wob: 50 kN, rotary_speed: 30 rad/s}
initial: {bit_speed: 29 rad/s}
simulation: {transient: 5 s, observe: 60 s}
record: {exponent: true}
"""
    found = nsdrill.run(text)
    steady = text.replace("initial: {bit_speed: 29 rad/s}\n", "").replace("0.1 mm", "0 mm")
    work = replace(work_of(prepare(parse_study(steady))), record=Record())
    model, fixed = work.kind, work.variant.fixed
    runs, rows = work.prepare(np.array([0])), model.rows(fixed)
    slopes = model.right_hand_side(8, fixed)
    n, names = work.state_count, model.states(fixed)
    free = [i for i, name in enumerate(names) if name not in ("lag", "drive_speed", "current")]

    def rates(state: np.ndarray) -> np.ndarray:
        lanes = np.zeros((rows.total, 8))
        lanes[:n] = state[:, None]
        lanes[rows.parameter : rows.parameter + rows.parameters] = runs.parameters[0][:, None]
        slopes(lanes.reshape(-1))
        b = lanes[:, 0]
        made = np.empty(n)
        for order, count, first, slope in rows.blocks:
            for k in range(count):
                if order == 2:
                    made[first + 2 * k] = state[first + 2 * k + 1]
                    made[first + 2 * k + 1] = b[rows.acceleration + slope + k]
                else:
                    made[first + k] = b[rows.acceleration + slope + k]
        return made

    rest = runs.initial[0, :n]
    matrix = np.empty((len(free), len(free)))
    for j, i in enumerate(free):
        step = 1e-6 * runs.state_scales[0, i]
        up, down = rest.copy(), rest.copy()
        up[i], down[i] = rest[i] + step, rest[i] - step
        matrix[:, j] = (rates(up) - rates(down))[free] / (2 * step)
    slowest = np.linalg.eigvals(matrix).real.max()
    assert slowest < -0.01
    assert float(found.lyapunov_exponent) == pytest.approx(slowest, rel=0.05)
