"""The string of segments along ramps of speed and weight, against DOP853 on the plain
equations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nsdrill
from segments.plain import Plain, plain_of

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


@dataclass
class Turned(Plain):
    """At one moment of the ramp: ``angle`` of the set point."""

    angle: float = 0.0

    def turned(self, t: float) -> float:
        return self.angle


@pytest.mark.parametrize(
    ("drive", "keys"),
    [
        ("kind: dc_motor", {}),
        (f"kind: dc_motor, gains: {list(GAINS)}, on_at: 0.7 s", {"gains": GAINS, "on_at": 0.7}),
        ("kind: ideal", {"stiff": True}),
    ],
    ids=["motor", "regulated", "ideal"],
)
def test_a_ramp_is_the_motion_of_moving_numbers(drive: str, keys: dict) -> None:
    """The drive, the mud's pulsation and the moment at which control begins go by the
    time of the run."""
    found = nsdrill.simulate(STUDY.format(drive), sample=0.1)

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        speed, load = 13.0 + 4.0 * t, 100e3 - 20e3 / 1.5 * t
        moment = Turned(pipes=2, collars=2, speed=speed, wob=load, angle=13.0 * t + 2.0 * t * t, **keys)
        made = np.array(moment.rates(t, y))
        if keys.get("stiff"):  # the table follows the set point
            made[3 * 5] = 4.0
        return made

    start = plain_of(found.attrs["initial_state"][:-1], 4)
    at = found.time.values
    pieces, y = [start[:, None]], start
    for first, last in ((0.0, 0.7), (0.7, 1.5)):  # the law begins with a jump
        times = np.minimum(at[(at > first + 1e-9) & (at <= last + 1e-9)], last)
        one = solve_ivp(rates, (first, last), y, "DOP853", rtol=1e-9, atol=1e-9, t_eval=times, max_step=0.01)
        pieces, y = [*pieces, one.y], one.y[:, -1]
    exact = dict(
        zip(
            ("z", "twist", "bit_speed", "drive_speed", "current", "lag"),
            np.concatenate(pieces, axis=1)[[4, 14, 19, 15, 20, 10]],
            strict=True,
        )
    )
    for name, within in {"z": 2e-6, "twist": 2e-4, "bit_speed": 5e-3, "drive_speed": 1e-4, "lag": 1e-4}.items():
        if name in found:
            assert found[name].values == pytest.approx(exact[name], abs=within), name
    if not keys.get("stiff"):
        assert found["current"].values == pytest.approx(exact["current"], abs=0.1)
