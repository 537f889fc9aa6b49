"""A model written for one trajectory, in lanes: the torsional string with one degree of
freedom."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nsdrill.abi import Rows
from nsdrill.elementary import direction as smoothed_direction
from nsdrill.elementary import sincos
from nsdrill.kernel.batch import Batch, Compiled, FinishedRuns, Runs
from nsdrill.kernel.settings import Simulation
from nsdrill.kernel.steppers import STEPPERS
from nsdrill.scalar import in_lanes, unobserved

ROWS = Rows(2, 0, 4, 0)
INERTIA, STIFFNESS, DAMPING = 565.0, 197.0, 50.0
STATIC, DYNAMIC, SMOOTHING = 6000.0, 3000.0, 20.0


def torsion(t, y, p):  # type: ignore[no-untyped-def]
    """The twist and the bit's speed under a smoothed friction torque that falls with
    speed."""
    twist, speed = y
    inertia, stiffness, damping, torque = p
    direction = smoothed_direction(SMOOTHING * speed)
    friction = direction * (torque / (1.0 + 3.0 * abs(speed)) + 0.5 * torque)
    return ((-damping * speed - stiffness * twist - friction) / inertia,)


TORQUES = (500.0, 2000.0, 4000.0)


def run(
    lanes: int, stepper: str = "tsitouras", torques: Any = TORQUES, rtol: float = 1e-10
) -> FinishedRuns:
    """From rest behind a drive at 3 rad/s, 20 s for each friction torque."""
    n = len(torques)
    batch = Batch(lanes, n, ROWS, np.zeros(1), 0, Simulation(5.0, 15.0, rtol, pair=stepper))  # type: ignore[arg-type]
    table = np.column_stack(
        [np.full(n, INERTIA), np.full(n, STIFFNESS), np.full(n, DAMPING), torques]
    )
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
    done = batch.advance(Compiled(in_lanes(torsion, lanes, ROWS), *unobserved(lanes)), 60.0, True)
    assert batch.idle
    order = np.argsort(done.job)
    done.final, done.accepted = done.final[order], done.accepted[order]
    return done


@pytest.mark.parametrize("stepper", list(STEPPERS))
def test_a_scalar_model_follows_its_equations(stepper: str) -> None:
    """Against SciPy's DOP853 at 1e-12. Twenty seconds at rtol 1e-10, a few thousand
    steps: 1e-6."""
    done = run(1, stepper)
    for torque, final in zip(TORQUES, done.final, strict=True):

        def slopes(t: float, y: np.ndarray, torque: float = torque) -> list[float]:
            twist, speed = y
            direction = 2 / np.pi * np.arctan(SMOOTHING * speed)
            friction = direction * (torque / (1 + 3 * abs(speed)) + 0.5 * torque)
            return [speed - 3.0, (-DAMPING * speed - STIFFNESS * twist - friction) / INERTIA]

        exact = solve_ivp(
            slopes, (0.0, 20.0), [0.0, 0.0], "DOP853", rtol=1e-12, atol=1e-12, max_step=0.01
        ).y[:, -1]
        assert final[:2] == pytest.approx(exact, abs=1e-6)
        assert final[2] == 60.0


def test_a_scalar_model_has_the_same_bits_in_any_lanes() -> None:
    torques = np.linspace(100.0, 4000.0, 21)
    one = run(1, torques=torques, rtol=1e-6)
    for lanes in (8, 16):
        assert run(lanes, torques=torques, rtol=1e-6).final.tobytes() == one.final.tobytes()


def test_the_pairs_differ_in_their_steps() -> None:
    """The pair of Dormand and Prince takes more steps at the same tolerance: an eighth
    or so."""
    tsitouras, dormand = (run(1, name).accepted.sum() for name in ("tsitouras", "dormand_prince"))
    assert 1.05 < dormand / tsitouras < 1.5


def driven(t, y, p, phase):  # type: ignore[no-untyped-def]
    """A mass on a spring, shaken by a drive at the angle phase + p[0] t."""
    return (sincos(phase + p[0] * t)[0] - y[0],)


def driven_plainly(t, y, p):  # type: ignore[no-untyped-def]
    return (-y[0],)


def test_a_slope_function_may_ask_for_the_phase() -> None:
    """From the buffer's row, in every lane its own; one that does not ask is called
    without."""
    rows = Rows(2, 0, 1, 0)
    phase, time, x = np.linspace(0.0, 6.0, 8), np.linspace(0.0, 0.7, 8), np.linspace(-1.0, 1.0, 8)
    for slopes, force in ((driven, np.sin(phase + 2.0 * time)), (driven_plainly, 0.0)):
        buffer = np.zeros((rows.total, 8))
        buffer[rows.stage], buffer[rows.stage_time], buffer[rows.phase], buffer[rows.parameter] = (
            x,
            time,
            phase,
            2.0,
        )
        flat = buffer.ravel()
        in_lanes(slopes, 8, rows)(flat)
        assert flat.reshape(rows.total, 8)[rows.acceleration] == pytest.approx(force - x, abs=1e-15)
