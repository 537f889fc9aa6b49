"""The names of states, lane parameters and auxiliary outputs, and the values of the
lane parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from nsdrill.models.leaves import Values
from nsdrill.models.segments.drive import NEVER, UNLIMITED, gains_of, law_of
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.string import Steady, String, creep_parameters, steady_of, string_of
from nsdrill.observe.channels import Names
from nsdrill.observe.thresholds import Thresholds

DEFAULT = (10, 10, 0)  # segments of pipe and of collars, and the electric motor

# Outputs of the equations for the observer: sine and cosine of the lobes, the
# interference of bit and rock with its rate, the force of the rock.
AUX = ("sine_", "cosine_", "interference_", "closing_", "force_")
PARAMETERS = (
    "set_speed",
    "wob",
    "stuck",
    # The next rows are divided by the mass or the inertia of a whole segment. At the
    # ends and at the junction, a share is half such a mass or inertia over that of the
    # node.
    "pipe_axial",
    "collar_axial",
    "pipe_torsional",
    "collar_torsional",
    "pipe_drag",
    "collar_drag",
    "pipe_annulus",
    "pipe_bore",
    "pipe_mean",
    "collar_annulus",
    "collar_bore",
    "collar_mean",
    "top_share",
    "joint_pipe_share",
    "joint_collar_share",
    "bit_share",
    "drive_share",
    "joint_pipe_inertia_share",
    "joint_collar_inertia_share",
    "bit_inertia_share",
    "axial_time",
    "torsional_time",
    "flow",
    "pulsation",
    "pulsation_rate",
    "per_pipe_annulus",
    "per_pipe_bore",
    "per_collar_annulus",
    "per_collar_bore",
    "top_stiffness",
    "top_damping",
    "per_top_mass",
    "per_bit_mass",
    "per_bit_inertia",
    "rock_stiffness",
    "closing_factor",
    "surface_amplitude",
    "lobes",
    "friction_arm",
    "hump",
    "narrowing",
    "viscous",
    "cutting_arm",
    "cutting_factor",
    "advance",
    "advance_offset",
    "slow_square",
    "smoothing",
    "live",
    "threshold",
    "per_threshold_width",
    "motor",
    "table_damping",
    "per_drive_inertia",
    "per_inductance",
    "resistance",
    "steady_current",
    "steady_twist",
    "gain_current",
    "gain_lag",
    "gain_drive_speed",
    "gain_twist",
    "gain_bit_speed",
    "on_at",
    # Read by the observer and by the natural scales.
    "surface_stiffness",
    "steady_torque",
    "chain_stiffness",
    # Read by the law of cutting (cutting.py). For a bit that creeps: the root of the speed
    # at which it begins to cut (0 for any other bit), r over tau and over the root of
    # its speed, the steepest fall of r, and twice the slow speed. For any other bit: r
    # at the set speed or at rest.
    "creep_start",
    "creep_root",
    "creep_fall",
    "creep_speed",
    "flat_root",
)
# What the electric motor reads, and what a drive by torque reads in its place.
MOTOR = (
    "drive_share",
    "motor",
    "table_damping",
    "per_drive_inertia",
    "per_inductance",
    "resistance",
    "steady_current",
    "steady_twist",
    "gain_current",
    "gain_lag",
    "gain_drive_speed",
    "gain_twist",
    "gain_bit_speed",
    "on_at",
)
TORQUE = (
    "drive_share",
    "per_drive_inertia",
    "drive_stiffness",
    "drive_damping",
    "twist_gain",
    "speed_gain",
    "torque_least",
    "torque_most",
    "top_drag",
    "on_at",
    "set_acceleration",
)
BY_TORQUE = (*(name for name in PARAMETERS if name not in MOTOR), *TORQUE)


class Nodes(NamedTuple):
    """The names of the states of the nodes, from the surface to the bit."""

    positions: tuple[str, ...]
    velocities: tuple[str, ...]
    angles: tuple[str, ...]
    speeds: tuple[str, ...]


def nodes_of(last: int) -> Nodes:
    """The names for a string whose bit is the node ``last``."""
    inner = range(1, last)
    return Nodes(
        ("u_0", *(f"u_{node}" for node in inner), "z"),
        ("v_0", *(f"v_{node}" for node in inner), "vz"),
        ("lag", *(f"angle_{node}" for node in inner), "twist"),
        ("drive_speed", *(f"speed_{node}" for node in inner), "bit_speed"),
    )


@lru_cache
def names_of(pipes: int, collars: int, by_torque: int = 0) -> Names:
    """The names of the rows of a string with these numbers of segments, with a drive by
    torque or with the electric motor. Nodes are counted from the surface; the last one
    is the bit."""
    last = pipes + collars
    inner, nodes = range(1, last), nodes_of(last)
    axial = (name for pair in zip(nodes.positions, nodes.velocities, strict=True) for name in pair)
    rotary = (name for pair in zip(nodes.angles, nodes.speeds, strict=True) for name in pair)
    return Names(
        states=(*axial, *rotary, "current"),
        slopes=(
            "top_acceleration",
            *(f"acceleration_{node}" for node in inner),
            "bit_axial_acceleration",
            "drive_acceleration",
            *(f"angular_acceleration_{node}" for node in inner),
            "bit_acceleration",
            "current_rate",
        ),
        parameters=BY_TORQUE if by_torque else PARAMETERS,
        aux=AUX,
    )


def columns(points: Values, thresholds: Thresholds) -> Mapping[str, Any]:
    """The lane parameters by name, numbers or arrays over the points."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    string = string_of(parameters, depth)
    pipe, collar, steady = string.pipe, string.collar, steady_of(parameters, string, wob, speed)
    bit, segments = parameters.bit, parameters.segments
    mud = segments.hydraulics
    friction, cutting = bit.friction, bit.cutting
    values: dict[str, Any] = {}
    for name, part in (("pipe", pipe), ("collar", collar)):
        annulus, bore = part.annulus / part.mass, part.bore / part.mass
        up, down = mud.flow / part.annulus_area, quotient(mud.flow, part.bore_area)
        values |= {
            f"{name}_axial": part.axial / part.mass,
            f"{name}_torsional": part.torsional / part.inertia,
            f"{name}_drag": part.drag / part.inertia,
            f"{name}_annulus": annulus,
            f"{name}_bore": bore,
            f"{name}_mean": annulus * up * up - bore * down * down,
            f"per_{name}_annulus": 1 / part.annulus_area,
            f"per_{name}_bore": quotient(1.0, part.bore_area),
        }
    top = _torque(parameters, string) if parameters.drive.by_torque else _motor(parameters, string, steady)
    return (
        values
        | top
        | {
            "set_speed": speed,
            "wob": wob,
            "stuck": thresholds.stuck_below,
            "top_share": pipe.mass / (2 * string.top_mass),
            "joint_pipe_share": pipe.mass / (2 * string.joint_mass),
            "joint_collar_share": collar.mass / (2 * string.joint_mass),
            "bit_share": collar.mass / (2 * string.bit_mass),
            "joint_pipe_inertia_share": pipe.inertia / (2 * string.joint_inertia),
            "joint_collar_inertia_share": collar.inertia / (2 * string.joint_inertia),
            "bit_inertia_share": collar.inertia / (2 * string.bit_inertia),
            "axial_time": segments.material_damping.axial,
            "torsional_time": segments.material_damping.torsional,
            "flow": mud.flow,
            "pulsation": mud.pulsation,
            "pulsation_rate": mud.pulsation_rate,
            "top_stiffness": segments.top.stiffness,
            "top_damping": segments.top.damping,
            "per_top_mass": 1 / string.top_mass,
            "per_bit_mass": 1 / string.bit_mass,
            "per_bit_inertia": 1 / string.bit_inertia,
            "rock_stiffness": bit.rock_stiffness,
            "closing_factor": quotient(segments.rock_damping, wob),
            "surface_amplitude": bit.surface_amplitude,
            "lobes": float(bit.lobes),
            "friction_arm": bit.radius * friction.level,
            "hump": friction.hump,
            "narrowing": friction.narrowing,
            "viscous": friction.viscous,
            "cutting_arm": bit.radius * cutting.zeta,
            "cutting_factor": 2 * math.pi / bit.radius,
            "advance": cutting.c1 * wob,
            "advance_offset": cutting.c2,
            "slow_square": cutting.slow * cutting.slow,
            "smoothing": cutting.smoothing,
            "live": float(cutting.speed == "live"),
            "threshold": segments.threshold_force,
            "per_threshold_width": 10 / segments.threshold_force,
            "surface_stiffness": pipe.torsional,
            "steady_torque": steady.table_torque,
            "chain_stiffness": string.axial,
            **creep_parameters(parameters, wob, speed),
        }
    )


def _motor(parameters: Parameters, string: String, steady: Steady) -> dict[str, Any]:
    """The lane parameters of the electric motor."""
    drive, gains = parameters.drive, gains_of(parameters, string).T
    names = ("gain_current", "gain_lag", "gain_drive_speed", "gain_twist", "gain_bit_speed")
    return {
        "drive_share": string.pipe.inertia / (2 * string.drive_inertia),
        "motor": drive.gear * drive.torque_constant,
        "table_damping": drive.table_damping,
        "per_drive_inertia": 1.0 / string.drive_inertia,
        "per_inductance": 1.0 / drive.inductance,
        "resistance": drive.resistance,
        "steady_current": steady.current,
        "steady_twist": steady.angles[-1],
        **dict(zip(names, gains, strict=True)),
        "on_at": drive.on_at,
    }


def _torque(parameters: Parameters, string: String) -> dict[str, Any]:
    """The lane parameters of a drive by torque. An ideal one is never switched on."""
    drive, law = parameters.drive, law_of(parameters, string)
    limit = drive.torque_limit
    half = string.pipe.inertia / 2
    return {
        "drive_share": half / (law.inertia + half),
        "per_drive_inertia": 1.0 / (law.inertia + half),
        "drive_stiffness": law.stiffness,
        "drive_damping": law.damping,
        "twist_gain": law.twist_gain,
        "speed_gain": law.speed_gain,
        "torque_least": -UNLIMITED if limit is None else 0.0,
        "torque_most": UNLIMITED if limit is None else limit,
        "top_drag": string.pipe.drag / 2,
        "on_at": NEVER if drive.kind == "ideal" else drive.on_at,
        "set_acceleration": 0.0,
    }


def quotient(numerator: Any, denominator: Any) -> Any:
    """The quotient, and 0 where the denominator is 0: a string without bore, a bit
    without load."""
    numerator, denominator = np.broadcast_arrays(
        np.asarray(numerator, dtype=float), np.asarray(denominator, dtype=float)
    )
    return np.divide(numerator, denominator, out=np.zeros(denominator.shape), where=denominator != 0.0)
