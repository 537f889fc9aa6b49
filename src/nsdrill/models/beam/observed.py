"""What is observed of the elastic collar: the features of the lumped model, at a
watched place of the span and over all places where it may touch the wall.

The collar is on the wall while one of the stations is. The clearance is that of the
station with the greatest wall force, as a penetration of the well's wall under that
force. The rolling ratio is one less the slip over the speed of the collar's surface,
each summed over the stations while they are on the wall.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.compiler.functions import fma as fma_of_numbers
from nsdrill.data import Array
from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.library import choose, fma, greater, sqrt
from nsdrill.equations.plain import Rows, function_of
from nsdrill.models import top
from nsdrill.models.beam.columns import Options
from nsdrill.models.christoforou_yigit.description import DESCRIPTION as LUMPED
from nsdrill.models.christoforou_yigit.observed import SHARED, on_rock, wall_force
from nsdrill.models.friction import hyperbolic
from nsdrill.models.operation import Numeric
from nsdrill.models.turning import TURN, turning_channels, turning_features
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    Derived,
    Extremes,
    Feature,
    Mean,
    Outputs,
    Passages,
    TimeAbove,
    Winding,
    measured_by,
)

OUTPUTS = (
    "watched_x",
    "watched_y",
    "radius",
    "radius_rate",
    "clearance",
    "clearance_rate",
    "interference",
    "interference_rate",
    "lateral_square",
    "wall_slip",
    "wall_surface_speed",
    "rock_torque",
)


def fused(factors: Sequence[Node], others: Sequence[Node]) -> Node:
    """The sum of products."""
    total = factors[-1] * others[-1]
    for a, b in reversed(list(zip(factors[:-1], others[:-1], strict=True))):
        total = fma(a, b, total)
    return total


@lru_cache
def outputs_of(options: Options) -> Callable[..., Any]:
    """The function of the quantities that are computed once a step, of the watched
    place, the station with the greatest wall force, and the bit."""
    n = Rows(Graph())
    modes = range(1, options.modes + 1)
    watch = [getattr(n, f"watched_{mode}") for mode in modes]
    x, vx, y, vy, ax, ay = (
        fused(watch, [getattr(n, f"{name}_{mode}") for mode in modes]) for name in ("x", "vx", "y", "vy", "ax", "ay")
    )
    radius = sqrt(greater(fma(x, x, y * y), 1e-60))
    stations = []
    for j in range(1, options.stations + 1):
        factor, r = getattr(n, f"penetration_factor_{j}"), getattr(n, f"radius_{j}")
        stations.append((factor * (r - getattr(n, f"gap_{j}")), factor * (getattr(n, f"outward_{j}") / r)))
    clearance, rate = stations[0]
    for penetration, its_rate in stations[1:]:
        rate = choose(penetration > clearance, its_rate, rate)
        clearance = greater(clearance, penetration)
    sine, cosine, interference, _, along = on_rock(n, options.lobes, hyperbolic)
    found = (
        x, y, radius, fma(x, vx, y * vy) / radius, clearance, rate,
        interference, along.of({"": interference})[""],
        fma(ax, ax, ay * ay), n.slip_sum, n.wall_contacts * n.bit_speed * n.collar_radius, n.torque,
    )  # fmt: skip
    return function_of("outputs", found, {"sine": sine, "cosine": cosine})


def _angle(twist, set_speed, time, phase):
    return twist + fma_of_numbers(set_speed, time, phase)


def _square(az):
    return az * az


# With slopes of 0, means are by the trapezoidal rule, and extremes are taken at the
# ends of the steps.
CHANNELS = (
    *turning_channels(stuck="stuck_below", angle=_angle),
    Channel("bit position", "z", "vz", "az"),
    Channel("interference", "interference", "interference_rate", level=0.0, scale="z"),
    Channel("radius", "radius", "radius_rate", scale="gap"),
    Channel("clearance", "clearance", "clearance_rate", level=0.0, scale="gap"),
    Channel("watched_x", "watched_x", 0.0),
    Channel("watched_y", "watched_y", 0.0),
    Channel("lateral square", "lateral_square", 0.0),
    Channel("axial square", _square, 0.0),
    Channel("wall slip", "wall_slip", 0.0),
    Channel("wall surface speed", "wall_surface_speed", 0.0),
    Channel("bit torque", "rock_torque", 0.0, scale="torque_scale"),
)


def _ratio(numerator: Array, denominator: Array, otherwise: float) -> Array:
    return np.divide(numerator, denominator, out=np.full(len(denominator), otherwise), where=denominator != 0.0)


def _wall_force_max(hertz: int) -> Callable[..., Numeric]:
    return lambda wall_stiffness, clearance_max: wall_force(hertz, wall_stiffness, clearance_max)


FEATURES: tuple[Feature, ...] = (
    *turning_features(),
    Extremes("twist", greatest="twist_max", least="twist_min"),
    Extremes("bit position", greatest="axial_max", least="axial_min", peaks="axial_peaks"),
    Extremes("interference", greatest="interference_max"),
    Extremes("radius", greatest="radius_max", peaks="radius_peaks"),
    Extremes("clearance", greatest="clearance_max"),
    Extremes("bit torque", greatest="bit_torque_max"),
    TimeAbove("interference", "on_rock"),
    TimeAbove("clearance", "wall_contact_fraction"),
    Passages("clearance", "impact_rate"),
    Winding("watched_x", "watched_y", "whirl_speed_mean"),
    Mean("twist", "twist_mean"),
    Mean("radius", "radius_mean"),
    Mean("lateral square", "lateral_square_mean"),
    Mean("axial square", "axial_square_mean"),
    Mean("wall slip", "wall_slip_mean"),
    Mean("wall surface speed", "wall_surface_speed_mean"),
    Derived("whirl_ratio", lambda whirl_speed_mean, bit_speed_mean: _ratio(whirl_speed_mean, bit_speed_mean, np.nan)),
    Derived(
        "rolling_ratio",
        lambda wall_slip_mean, wall_surface_speed_mean: np.where(
            wall_surface_speed_mean != 0.0, 1.0 - _ratio(wall_slip_mean, wall_surface_speed_mean, 1.0), 0.0
        ),
    ),
    *SHARED,
    Derived("lateral_acceleration_rms", lambda lateral_square_mean: np.sqrt(lateral_square_mean)),
    Derived("axial_acceleration_rms", lambda axial_square_mean: np.sqrt(axial_square_mean)),
)


@lru_cache
def declaration_of(options: Options) -> Declaration:
    """The declaration of a collar with these options."""
    channels, features = CHANNELS, FEATURES
    if options.driven:
        channels, features = top.observed(channels, features, "drive_acceleration")
    return Declaration(
        channels=channels,
        features=(
            *features,
            *measured_by(LUMPED.features, features),
            Derived("wall_force_max", _wall_force_max(options.hertz)),
        ),
        outputs=Outputs(OUTPUTS, outputs_of(options)),
        section=TURN,
    )
