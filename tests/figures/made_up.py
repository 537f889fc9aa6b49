"""Made-up sweeps and traces that look like real ones, so that the pictures can be
judged as well as counted."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from model_tables import TRACE_VARIABLES, VARIABLES

from nsdrill.data import Results, Trace
from nsdrill.models.christoforou_yigit.columns import STATE_NAMES
from nsdrill.models.responses import BIT_BOUNCE, STICK_SLIP, WHIRL
from nsdrill.variables import DIVERGED, OK, PENDING, STEP_LIMIT

GAP = 0.0762  # (15 in - 9 in) / 2, the default well and collar
PEAKS = 32

# (procedure, depth, wob, rotary_speed) -> response bits
Rule = Callable[[str, float, float, float], int]


def carried_rule(procedure: str, depth: float, wob: float, speed: float) -> int:
    """In kind what the paper shows: trouble below about 3 rad/s, wall contact at high
    speed, both with hysteresis."""
    shift = 0.4 if procedure == "down" else 0.0
    response = 0
    if 1.2 + shift < speed < 2.6 + shift + 1e-6 * (wob - 22240):
        response |= BIT_BOUNCE
    if speed < (1.9 if procedure == "down" else 1.3) + 1.5e-5 * (wob - 22240):
        response |= STICK_SLIP
    if speed < 2.1 or speed > (5.1 if procedure == "down" else 6.1) - 1e-4 * (depth - 5000):
        response |= WHIRL
    return response


def make_results(
    depth: Sequence[float] = (5000.0,),
    wob: Sequence[float] = (22240.0,),
    rotary_speed: Sequence[float] = (3.0,),
    procedures: Sequence[str] = ("same",),
    rule: Rule = carried_rule,
    seed: int = 1,
) -> Results:
    """A finished sweep: period-1 where nothing happens, clouds of peaks where something
    does."""
    rng = np.random.default_rng(seed)
    coords = {
        "procedure": np.array(procedures),
        "depth": np.array(depth, dtype=float),
        "wob": np.array(wob, dtype=float),
        "rotary_speed": np.array(rotary_speed, dtype=float),
        "peak": np.arange(PEAKS),
        "state": np.array(STATE_NAMES),
    }
    sizes = {name: len(values) for name, values in coords.items()}
    variables = {
        v.name: np.zeros([sizes[d] for d in v.dims], dtype=v.dtype)
        if v.dtype[0] == "i"
        else np.full([sizes[d] for d in v.dims], 0.5)
        for v in VARIABLES
        if v.only in (None, "peaks")
    }
    for place in np.ndindex(*variables["status"].shape):
        speed = coords["rotary_speed"][place[3]]
        response = rule(procedures[place[0]], coords["depth"][place[1]], coords["wob"][place[2]], speed)
        variables["status"][place] = OK
        variables["response"][place], variables["settled"][place] = response, 1
        wild = rng.normal(size=(3, PEAKS))
        bounce, stick, whirl = (bool(response & bit) for bit in (BIT_BOUNCE, STICK_SLIP, WHIRL))
        z = 1e-3 * (0.9 + (2.5 * np.abs(wild[0]) * (1 + stick) if bounce else 0.0)) * np.ones(PEAKS)
        w = speed * (1.02 + 0.02 * speed) + (speed * np.abs(0.9 + 0.25 * wild[1]) if stick else 0.0) * np.ones(PEAKS)
        free = 0.004 + 0.003 * speed + 0.002 * bounce * wild[2]
        r = (GAP + 4e-4 * np.abs(wild[2]) if whirl else free) * np.ones(PEAKS)
        z[-int(rng.integers(1, 9)) :] = np.nan
        variables["axial_peaks"][place], variables["bit_speed_peaks"][place] = z, w
        variables["radius_peaks"][place] = r
        variables["axial_max"][place] = np.nanmax(z)
        variables["bit_speed_max"][place], variables["radius_max"][place] = w.max(), r.max()
        variables["stick_slip_index"][place] = 95 + 30 * abs(wild[1, 0]) if stick else 22 + 4 * wild[1, 0] + 25 * bounce
        variables["lift_off_fraction"][place] = 0.12 + 0.05 * abs(wild[0, 0]) if bounce else 0.0
        variables["wall_contact_fraction"][place] = (0.97 if speed > 4 else 0.3 + 0.1 * wild[2, 0]) if whirl else 0.0
        variables["whirl_ratio"][place] = (-1.48 if speed > 4 else -0.6 + 0.3 * wild[2, 0]) if whirl else 1.0
        variables["whirl_kind"][place] = (3 if speed > 4 else 4) if whirl else 0
    return Results(coords, variables, {"title": "Speed sweep, state carried", "gap": GAP})


def covered(collection: Any, x: Sequence[float], y: Sequence[float]) -> np.ndarray:
    """Which points of a map [y, x] lie in the area of a pattern."""
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside = np.any([path.contains_points(points) for path in collection.get_paths()], axis=0)
    return np.asarray(inside.reshape(len(y), len(x)))


def spoil(results: Results, diverged: int = 2, step_limit: int = 1, pending: int = 0) -> Results:
    """Mark some points as not ended well, their features as missing; the same points
    every time."""
    flat = np.random.default_rng(3).permutation(results["status"].size)
    for number, place in enumerate(flat[: diverged + step_limit + pending]):
        index = np.unravel_index(place, results["status"].shape)
        bad = number < diverged + step_limit
        results["status"][index] = (DIVERGED if number < diverged else STEP_LIMIT) if bad else PENDING
        for v in (v for v in VARIABLES if v.name in results.variables):
            if v.dtype == "f8":
                results[v.name][index] = np.nan
            elif v.name != "status":
                results[v.name][index] = 0
    return results


def make_trace(duration: float = 60.0, sample: float = 0.005, speed: float = 3.0) -> Trace:
    """Stick-slip with bit-bounce while the collar rolls backward along the wall now and
    then."""
    t = np.arange(0.0, duration, sample)
    w = 1.05
    bit_speed = np.maximum(speed * (1 - 1.35 * np.cos(w * t)), 0.0)
    twist = -0.8 - 2.6 * np.sin(w * t)
    drive = speed * t
    z = -8.9e-4 + 1.6e-3 * np.sin(3 * (drive + twist)) + 1.2e-3 * np.sin(7.3 * t) * np.sin(0.3 * t)
    contact = np.maximum(1e-3 * np.sin(3 * (drive + twist)) - z, 0.0)
    radius = GAP * (0.62 + 0.39 * np.sin(0.31 * t) ** 2 + 0.012 * np.sin(11 * t))
    angle = -1.48 * drive * 0.6 + 0.4 * np.sin(2 * t)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    wall = 25e6 * np.maximum(radius - GAP, 0.0)
    values = {
        "x": x,
        "y": y,
        "z": z,
        "twist": twist,
        "bit_speed": bit_speed,
        "drive_angle": drive,
        "radius": radius,
        "vx": np.gradient(x, t),
        "vy": np.gradient(y, t),
        "vz": np.gradient(z, t),
        "whirl_angle": angle,
        "radial_velocity": np.gradient(radius, t),
        "whirl_speed": np.gradient(angle, t),
        "bit_force": 25e6 * contact,
        "bit_torque": 25e6 * contact * 0.045,
        "wall_force": wall,
        "wall_friction": 0.3 * wall,
        "surface_torque": 200 * (drive - twist),
        "drive_speed": np.full_like(t, speed),
        "wob": np.full_like(t, 66720.0),
        "depth": np.full_like(t, 5000.0),
    }
    assert set(values) == {v.name for v in TRACE_VARIABLES}
    attrs = {
        "title": "Speed sweep, state carried",
        "gap": GAP,
        "depth": 5000.0,
        "wob": 66720.0,
        "rotary_speed": speed,
        "procedure": "down",
        "transient": 300.0,
    }
    return Trace(t, values, attrs)
