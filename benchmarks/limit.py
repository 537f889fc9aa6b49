"""Features of stick-slip and of rolling against the steepness of friction, beside the
limit of Coulomb's friction.

    python -m benchmarks.limit

Stick-slip: the main model with frozen axial and lateral motion. Its limit is a Filippov
system, which SciPy integrates here with events: in stick the bit stands and the string
winds up until the torque at rest is reached, in slip friction is a function of a
positive speed. Rolling: the whole model; in the limit a collar that is pressed to the
wall rolls without slip.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.coefficients import bit_numbers, derive
from nsdrill.models.christoforou_yigit.parameters import Parameters

SMOOTHINGS = (1e1, 1e2, 1e3, 1e4, 1e5, 1e6)
DEPTH, WOB, SPEED = 5000.0, 66.72e3, 1.0
STUCK_BELOW = 0.5235987755982988  # rad/s, 5 rpm
STICK_SLIP = ("bit_speed_max", "stuck_fraction", "bit_torque_max", "surface_torque_min", "surface_torque_max")
ROLLING = ("rolling_ratio", "whirl_ratio", "wall_force_max", "bit_speed_mean")


def filippov(depth: float = DEPTH, wob: float = WOB, speed: float = SPEED) -> dict[str, float]:
    """Features of the limit cycle of the string that only twists under Coulomb's
    friction that falls with speed; the keys are those of :data:`STICK_SLIP`, the
    fraction of time below ``STUCK_BELOW``."""
    from scipy.integrate import solve_ivp

    parameters = Parameters()
    k = derive(parameters, depth, wob, speed)
    law, damping = bit_numbers(parameters, k), parameters.drillstring.torsional_damping
    rest = wob * float(law.rise + law.dynamic)

    def slip(_: float, y: np.ndarray) -> list[float]:
        friction = wob * (law.rise / (1 + law.decay * abs(y[1])) + law.dynamic)
        return [y[1] - speed, float(-k.k_t * y[0] - damping * y[1] - friction) / float(k.J)]

    def stands(_: float, y: np.ndarray) -> float:
        return float(y[1])

    def slow(_: float, y: np.ndarray) -> float:
        return float(y[1]) - STUCK_BELOW

    stands.terminal, stands.direction = True, -1  # type: ignore[attr-defined]
    twist, cycle = -rest / float(k.k_t), {}
    for _ in range(2):  # the second begins where the first has ended, at break-away
        found = solve_ivp(
            slip, (0.0, 1e3), [twist, 1e-9], "DOP853", events=[stands, slow], rtol=1e-11, atol=1e-12, dense_output=True
        )
        end, caught = found.t[-1], found.y[0, -1]
        if abs(k.k_t * caught) > rest:
            raise ValueError("the bit does not come to rest where it turns: no limit cycle of this kind")
        stuck = (caught - twist) / speed
        times = np.linspace(0.0, end, 200_001)
        psi, omega = found.sol(times)
        fast = float(found.t_events[1][-1] - found.t_events[1][0])
        cycle = {
            "bit_speed_max": float(omega.max()),
            "stuck_fraction": 1.0 - fast / (end + stuck),
            "bit_torque_max": rest,
            "surface_torque_min": float(-k.k_t * psi.max()),
            "surface_torque_max": float(-k.k_t * psi.min()),
        }
    return cycle


def stick_slip(smoothing: float, rtol: float = 1e-7) -> dict[str, float]:
    """The same features by nsdrill at a smoothing [s/rad]."""
    base = Parameters()
    bit = replace(base.bit, surface_amplitude=0.0, friction=replace(base.bit.friction, smoothing=smoothing))
    modes = replace(base.modes, axial="frozen", lateral="frozen")
    return _features(replace(base, bit=bit, modes=modes), (DEPTH, WOB, SPEED), (100.0, 1000.0), rtol, STICK_SLIP)


def rolling(smoothing: float, rtol: float = 1e-6) -> dict[str, float]:
    """Features of the whole string, its collar rolling along the wall, at a smoothing
    of the wall [s/m]."""
    base = Parameters()
    well = replace(base.well, friction=replace(base.well.friction, smoothing=smoothing))
    bit = replace(base.bit, surface_amplitude=0.0)
    return _features(replace(base, well=well, bit=bit), (2000.0, 22.24e3, 8.0), (60.0, 20.0), rtol, ROLLING)


def _features(
    parameters: Parameters,
    point: tuple[float, float, float],
    times: tuple[float, float],
    rtol: float,
    names: tuple[str, ...],
) -> dict[str, float]:
    from nsdrill.kernel.settings import Simulation
    from nsdrill.models.christoforou_yigit.parameters import Initial
    from nsdrill.models.registry import described
    from nsdrill.models.responses import Thresholds
    from nsdrill.observe.thresholds import Record
    from nsdrill.sweep.plan import Plan
    from nsdrill.sweep.work import Work, compiled_parts
    from nsdrill.variables import MODEL

    axes = {name: np.array([value]) for name, value in zip(("depth", "wob", "rotary_speed"), point, strict=True)}
    simulation = Simulation(*times, rtol=rtol, method="implicit")
    model = described(MODEL)
    work = Work(Plan(axes, "same", None), parameters, Initial(x=0.0), simulation, Thresholds(), Record(), model)
    batch = work.new_batch(1, 1)
    batch.add_many(np.arange(1), work.prepare(np.arange(1)))
    columns: dict[str, Any] = work.columns(batch.advance(compiled_parts(1, work.program), 1e9, True))
    return {name: float(columns[name][0]) for name in names}


def main() -> None:
    for title, names, function, limit in (
        ("Stick-slip", STICK_SLIP, stick_slip, filippov()),
        ("Rolling", ROLLING, rolling, None),
    ):
        print(f"## {title}\n\n| smoothing | {' | '.join(names)} |\n|---{'|---' * len(names)}|")
        for smoothing in SMOOTHINGS:
            found = function(smoothing)
            print(f"| {smoothing:.0e} | {' | '.join(f'{found[name]:.6g}' for name in names)} |")
        if limit is not None:
            print(f"| limit | {' | '.join(f'{limit[name]:.6g}' for name in names)} |\n")


if __name__ == "__main__":
    main()
