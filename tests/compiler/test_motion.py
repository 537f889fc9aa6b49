"""Equations in lanes, with their tangent: the torsional string with one degree of
freedom, and small systems."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nsdrill.abi import RATES, Rows
from nsdrill.equations.library import direction, sincos, tanh, touching
from nsdrill.equations.motion import Motion
from nsdrill.kernel.batch import Batch, Compiled, FinishedRuns, Runs, unobserved
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS

ROWS = Rows(2, 0, 4, 0)
INERTIA, STIFFNESS, DAMPING = 565.0, 197.0, 50.0
STATIC, DYNAMIC, SMOOTHING = 6000.0, 3000.0, 20.0


def torsion(t, phase, s, p, o):
    """The twist and the bit's speed under a smoothed friction torque that falls with
    speed."""
    falling = p.torque / (1.0 + 3.0 * abs(s.speed)) + 0.5 * p.torque
    friction = direction(SMOOTHING * s.speed) * falling
    return {"speed": (-p.damping * s.speed - p.stiffness * s.twist - friction) / p.inertia}


TORSION = Motion(torsion, None, ("twist", "speed"), ("inertia", "stiffness", "damping", "torque"), ("speed",))


TORQUES = (500.0, 2000.0, 4000.0)


def run(lanes: int, stepper: str = "tsitouras", torques: Any = TORQUES, rtol: float = 1e-10) -> FinishedRuns:
    """From rest behind a drive at 3 rad/s, 20 s for each friction torque."""
    n = len(torques)
    batch = Batch(lanes, n, ROWS, np.zeros(1), 0, Simulation(5.0, 15.0, rtol, pair=stepper))
    table = np.column_stack([np.full(n, INERTIA), np.full(n, STIFFNESS), np.full(n, DAMPING), torques])
    batch.add_many(
        np.arange(n),
        Runs(
            table,
            state_scales=np.ones((n, 2)),
            frame_rates=np.full((n, 1), -3.0),
            phase_rate=np.full(n, 3.0),
            first_step=np.full(n, 1e-3),
            initial=np.zeros((n, 3)),
        ),
    )
    done = batch.advance(Compiled(TORSION.right_hand_side(lanes, ROWS), *unobserved(lanes)), 60.0, True)
    assert batch.idle
    order = np.argsort(done.job)
    done.final, done.accepted = done.final[order], done.accepted[order]
    return done


@pytest.mark.parametrize("stepper", list(STEPPERS))
def test_a_scalar_model_follows_its_equations(stepper):
    """Against SciPy's DOP853 at 1e-12. Twenty seconds at rtol 1e-10, a few thousand
    steps: 1e-6."""
    done = run(1, stepper)
    for torque, final in zip(TORQUES, done.final, strict=True):

        def slopes(t, y, torque=torque):
            twist, speed = y
            direction = 2 / np.pi * np.arctan(SMOOTHING * speed)
            friction = direction * (torque / (1 + 3 * abs(speed)) + 0.5 * torque)
            return [speed - 3.0, (-DAMPING * speed - STIFFNESS * twist - friction) / INERTIA]

        exact = solve_ivp(slopes, (0.0, 20.0), [0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-12, max_step=0.01).y[:, -1]
        assert final[:2] == pytest.approx(exact, abs=1e-6)
        assert final[2] == 60.0


def test_a_scalar_model_has_the_same_bits_in_any_lanes():
    torques = np.linspace(100.0, 4000.0, 21)
    one = run(1, torques=torques, rtol=1e-6)
    for lanes in (8, 16):
        assert run(lanes, torques=torques, rtol=1e-6).final.tobytes() == one.final.tobytes()


def test_the_pairs_differ_in_their_steps():
    """The pair of Dormand and Prince takes more steps at the same tolerance: an eighth
    or so."""
    tsitouras, dormand = (run(1, name).accepted.sum() for name in ("tsitouras", "dormand_prince"))
    assert 1.05 < dormand / tsitouras < 1.5


def driven(t, phase, s, p, o):
    """A mass on a spring, shaken by a drive, that meets a stop."""
    force = sincos(phase + p.speed * t)[0]
    return {"v": force - s.x - tanh(s.v) - p.stop * touching("stop", s.x - 0.2)}


def test_the_slopes_and_the_deviation_of_every_lane_are_its_own():
    """Of time, phase, states and parameters of the lane; against numpy. In every other
    lane the stop counts as it does not now."""
    motion = Motion(driven, None, ("x", "v"), ("speed", "stop"), ("v",), sides=("stop",))
    rows = Rows(4, 0, 2, 2 * RATES, 2)
    phase, time, x = np.linspace(0.0, 6.0, 8), np.linspace(0.0, 0.7, 8), np.linspace(-1.0, 1.0, 8)
    v, dx, dv = np.linspace(-30.0, 30.0, 8), np.linspace(1.0, 2.0, 8), np.linspace(2.0, -1.0, 8)
    buffer = np.zeros((rows.total, 8))
    buffer[rows.stage : rows.stage + 4] = x, v, dx, dv
    buffer[rows.stage_time], buffer[rows.phase] = time, phase
    buffer[rows.parameter], buffer[rows.parameter + 1] = 2.0, 3.0
    closed = np.where(np.arange(8) % 2, 1.0, -1.0) * (x - 0.2)
    buffer[rows.observer] = closed
    flat = buffer.ravel()
    motion.tangent(8, rows, 0)(flat)
    found = flat.reshape(rows.total, 8)
    force = np.sin(phase + 2.0 * time) - x - np.tanh(v) - 3.0 * np.maximum(x - 0.2, 0.0)
    assert found[rows.acceleration] == pytest.approx(force, abs=1e-8)
    deviation = -dx - dv / np.cosh(v) ** 2 - np.where(closed > 0.0, 3.0 * dx, 0.0)
    assert found[rows.acceleration + 1] == pytest.approx(deviation, abs=1e-8)


def test_the_function_of_a_contact_has_its_rates_along_the_motion():
    """Of a position in the frame of a drive, with a lobed surface that passes; against
    the closed form of value, rate and second derivative."""

    def lobes(t, phase, s, p, o):
        height = sincos(3.0 * (s.angle + (p.speed * t + phase)))[0]
        return {"turn": 0.0, "v": touching("rock", height - s.z)}

    motion = Motion(lobes, None, ("angle", "turn", "z", "v"), ("speed",), ("turn", "v"), sides=("rock",))
    rows = Rows(4, 0, 1, RATES)
    rng = np.random.default_rng(2)
    buffer = rng.normal(size=(rows.total, 8))
    flat = buffer.ravel().copy()
    motion.contact_functions(8, rows, 0)(flat)
    angle, turn, z, v = buffer[rows.stage : rows.stage + 4]
    speed, time, phase = buffer[rows.parameter], buffer[rows.stage_time], buffer[rows.phase]
    faster, falling = buffer[rows.acceleration : rows.acceleration + 2]
    frame = buffer[rows.frame_rate : rows.frame_rate + 2]
    at, rate = 3.0 * (angle + speed * time + phase), 3.0 * (turn + frame[0] + speed)
    found = flat.reshape(rows.total, 8)[rows.observer : rows.observer + RATES]
    assert found[0] == pytest.approx(np.sin(at) - z, abs=1e-14)
    assert found[1] == pytest.approx(np.cos(at) * rate - (v + frame[1]), abs=1e-13)
    wanted = -np.sin(at) * rate**2 + np.cos(at) * 3.0 * faster - falling
    assert found[2] == pytest.approx(wanted, abs=1e-12)
