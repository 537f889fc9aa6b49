"""What is observed of the elastic collar: the features of the lumped model, at a
watched place of the span and over all places where it may touch the wall.

The collar is on the wall where one of the stations is. The clearance is the penetration
of the well's wall that has the greatest force at a station. The rolling ratio is one
less the slip over the speed of the collar's surface, of the stations on the wall while
they are.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.elementary import fma
from nsdrill.generate import define
from nsdrill.models.beam.options import Options, lateral, slopes_of, states_of
from nsdrill.models.beam.rhs import aux_of, columns_of, total
from nsdrill.models.christoforou_yigit.lobes import multiple_cosine, multiple_sine
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    Derived,
    Extremes,
    Mean,
    Names,
    Outputs,
    Passages,
    Section,
    TimeAbove,
    Winding,
)

OUTPUTS = (
    "across",
    "aside",
    "radius",
    "radius_rate",
    "clearance",
    "clearance_rate",
    "interference",
    "interference_rate",
    "lateral_square",
    "wall_slip",
    "wall_turn",
    "rock_torque",
)


def names_of(options: Options) -> Names:
    """The names of the rows."""
    return Names(
        states_of(options.modes), slopes_of(options.modes), columns_of(options), aux_of(options)
    )


@lru_cache
def outputs_of(options: Options) -> Any:
    """The function of what is computed once a step: of the watched place, of the
    deepest station, of the bit."""
    modes, stations = range(1, options.modes + 1), range(1, options.stations + 1)
    watch = [f"watched_{n}" for n in modes]
    shaken = [[f"a{axis}_{n}" for n in modes] for axis in "xy"]
    moves = [[lateral(n)[k] for n in modes] for k in range(4)]
    told = [name for names in (watch, *moves, *shaken) for name in names]
    told += [f"{name}_{j}" for j in stations for name in ("reach", "inward", "gap", "yield")]
    told += ["collar_radius", "surface_amplitude", "z", "vz", "bit_speed"]
    told += ["cosine", "sine", "torque", "pressed", "slipping"]
    sums = {
        word: total(list(zip(watch, names, strict=True)))
        for word, names in zip(("x", "vx", "y", "vy", "ax", "ay"), (*moves, *shaken), strict=True)
    }
    lines = [
        f"def outputs({', '.join(told)}):",
        *(f"    {word} = {text}" for word, text in sums.items()),
        "    radius = np.sqrt(max(fma(x, x, y * y), 1e-60))",
        "    clearance, inward = yield_1 * (reach_1 - gap_1), yield_1 * (inward_1 / reach_1)",
    ]
    for j in range(2, options.stations + 1):
        lines += [
            f"    own = yield_{j} * (reach_{j} - gap_{j})",
            f"    inward = yield_{j} * (inward_{j} / reach_{j}) if own > clearance else inward",
            "    clearance = max(clearance, own)",
        ]
    lines += [
        f"    lobe = multiple_sine(sine, cosine, {options.lobes})",
        f"    slope = {float(options.lobes)!r} * multiple_cosine(cosine, {options.lobes})",
        "    return (",
        "        x, y, radius, fma(x, vx, y * vy) / radius, clearance, inward,",
        "        fma(surface_amplitude, lobe, -z), fma(surface_amplitude * slope, bit_speed, -vz),",
        "        fma(ax, ax, ay * ay), slipping, pressed * bit_speed * collar_radius, torque,",
        "    )",
    ]
    known = {
        "np": np,
        "fma": fma,
        "multiple_sine": multiple_sine,
        "multiple_cosine": multiple_cosine,
    }
    return define("outputs", "\n".join(lines) + "\n", **known)


def _angle(twist, drive_speed, time, phase):  # type: ignore[no-untyped-def]
    return twist + fma(drive_speed, time, phase)


def _square(az):  # type: ignore[no-untyped-def]
    return az * az


# Slopes that are 0 make a mean the sum of trapezia, and leave an extreme to the ends of
# the steps.
CHANNELS = (
    Channel("twist", "twist", "bit_speed", "bit_acceleration", frame="drive_speed"),
    Channel("bit speed", "bit_speed", "bit_acceleration", rate_of="twist", level="stuck_below"),
    Channel("bit angle", _angle, "bit_speed", "bit_acceleration"),
    Channel("bit position", "z", "vz", "az"),
    Channel("interference", "interference", "interference_rate", level=0.0, scale="z"),
    Channel("radius", "radius", "radius_rate", scale="gap"),
    Channel("clearance", "clearance", "clearance_rate", level=0.0, scale="gap"),
    Channel("across", "across", 0.0),
    Channel("aside", "aside", 0.0),
    Channel("lateral square", "lateral_square", 0.0),
    Channel("axial square", _square, 0.0),
    Channel("wall slip", "wall_slip", 0.0),
    Channel("wall turn", "wall_turn", 0.0),
    Channel("bit torque", "rock_torque", 0.0, scale="torque_scale"),
)


def _ratio(above: Any, below: Any, otherwise: float) -> Any:
    return np.divide(above, below, out=np.full(len(below), otherwise), where=below != 0.0)


def _wall_force(hertz: int) -> Any:
    def wall_force_max(wall_stiffness: Any, clearance_max: Any) -> Any:
        depth = np.maximum(clearance_max, 0.0)
        return wall_stiffness * depth * (np.sqrt(depth) if hertz else 1.0)

    return wall_force_max


FEATURES = (
    Extremes("bit speed", greatest="bit_speed_max", least="bit_speed_min", peaks="bit_speed_peaks"),
    Extremes("twist", greatest="twist_max", least="twist_min"),
    Extremes("bit position", greatest="axial_max", least="axial_min", peaks="axial_peaks"),
    Extremes("interference", greatest="interference_max"),
    Extremes("radius", greatest="radius_max", peaks="radius_peaks"),
    Extremes("clearance", greatest="clearance_max"),
    Extremes("bit torque", greatest="bit_torque_max"),
    TimeAbove("bit speed", "unstuck"),
    TimeAbove("interference", "on_rock"),
    TimeAbove("clearance", "wall_contact_fraction"),
    Passages("clearance", "impact_rate"),
    Winding("across", "aside", "whirl_speed_mean"),
    Mean("bit speed", "bit_speed_mean"),
    Mean("twist", "twist_mean"),
    Mean("radius", "radius_mean"),
    Mean("lateral square", "lateral_square_mean"),
    Mean("axial square", "axial_square_mean"),
    Mean("wall slip", "wall_slip_mean"),
    Mean("wall turn", "wall_turn_mean"),
    Derived(
        "stick_slip_index",
        lambda bit_speed_max, bit_speed_min, bit_speed_mean: _ratio(
            50.0 * (bit_speed_max - bit_speed_min), np.abs(bit_speed_mean), np.inf
        ),
    ),
    Derived("stuck_fraction", lambda unstuck: 1.0 - unstuck),
    Derived("lift_off_fraction", lambda on_rock: 1.0 - on_rock),
    Derived(
        "bit_force_max",
        lambda rock_stiffness, interference_max: rock_stiffness * np.maximum(interference_max, 0.0),
    ),
    Derived(
        "whirl_ratio",
        lambda whirl_speed_mean, bit_speed_mean: _ratio(whirl_speed_mean, bit_speed_mean, np.nan),
    ),
    Derived(
        "rolling_ratio",
        lambda wall_slip_mean, wall_turn_mean: np.where(
            wall_turn_mean != 0.0, 1.0 - _ratio(wall_slip_mean, wall_turn_mean, 1.0), 0.0
        ),
    ),
    Derived(
        "surface_torque_min",
        lambda torsional_stiffness, twist_max: -torsional_stiffness * twist_max,
    ),
    Derived(
        "surface_torque_max",
        lambda torsional_stiffness, twist_min: -torsional_stiffness * twist_min,
    ),
    Derived(
        "surface_torque_mean",
        lambda torsional_stiffness, twist_mean: -torsional_stiffness * twist_mean,
    ),
    Derived("lateral_acceleration_rms", lambda lateral_square_mean: np.sqrt(lateral_square_mean)),
    Derived("axial_acceleration_rms", lambda axial_square_mean: np.sqrt(axial_square_mean)),
)


@lru_cache
def declaration_of(options: Options) -> Declaration:
    """What is observed of a collar with these options."""
    return Declaration(
        channels=CHANNELS,
        features=(*FEATURES, Derived("wall_force_max", _wall_force(options.hertz))),
        outputs=Outputs(OUTPUTS, outputs_of(options)),
        section=Section("bit angle", 2.0 * math.pi),
    )
