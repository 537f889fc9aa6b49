"""The names of states, lane parameters and auxiliary outputs, and what stands in the
lane parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.models.leaves import Values
from nsdrill.models.segments.drive import NEVER, UNLIMITED, gains_of, law_of
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.string import Steady, String, creeping, steady_of, string_of
from nsdrill.observe.channels import Names
from nsdrill.observe.thresholds import Thresholds

DEFAULT = (10, 10, 0)  # segments of pipe and of collars, and the electric motor

# Left by the right-hand side: speeds of the mud past a string that stands still, sine
# and cosine of the lobes, the interference of bit and rock with its rate, force and
# torque of the rock.
AUX = (
    "pipe_up",
    "pipe_down",
    "collar_up",
    "collar_down",
    "sine_",
    "cosine_",
    "interference_",
    "closing_",
    "force_",
    "torque_",
)
PARAMETERS = (
    "set_speed",
    "wob",
    "stuck",
    # In these lines all is over the mass or the inertia of a whole segment; at the ends
    # the share tells how much of one such mass half a segment brings to the node.
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
    "joint_pipe_turn",
    "joint_collar_turn",
    "bit_turn",
    "axial_time",
    "torsional_time",
    "flow_",
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
    "lobes_",
    "friction_arm",
    "hump",
    "narrowing",
    "viscous",
    "cutting_arm",
    "cutting_factor",
    "advance_",
    "advance_offset",
    "slow_square",
    "smoothing",
    "live_",
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
    # By the implicit method, of a bit that creeps: the root of the speed at which it
    # begins to cut (0: there is none such), r over tau and over the root of its speed,
    # how steeply r falls at most, and twice the slow speed. Of any other bit r at the
    # set speed or at rest.
    "creep_start",
    "creep_root",
    "creep_fall",
    "creep_speed",
    "flat_root",
)
# What the electric motor reads, and a drive by torque in its place.
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
    "per_drive_inertia",
    "half_inertia",
    "drive_stiffness",
    "drive_damping",
    "twist_gain",
    "speed_gain",
    "torque_least",
    "torque_most",
    "top_drag",
    "on_at",
)
BY_TORQUE = (*(name for name in PARAMETERS if name not in MOTOR), *TORQUE)


@lru_cache
def names_of(pipes: int, collars: int, by_torque: int = 0) -> Names:
    """The names of the rows with so many segments, of a drive by torque or of the
    electric motor. Nodes are counted from the surface; the last one is the bit."""
    last = pipes + collars
    inner = range(1, last)
    axial = ["u_0", "v_0", *(f"{word}_{node}" for node in inner for word in "uv"), "z", "vz"]
    turning = [
        "lag",
        "drive_speed",
        *(f"{word}_{node}" for node in inner for word in ("angle", "speed")),
    ]
    return Names(
        states=(*axial, *turning, "twist", "bit_speed", "current"),
        slopes=(
            "top_acceleration",
            *(f"acceleration_{node}" for node in inner),
            "bit_axial_acceleration",
            "drive_acceleration",
            *(f"turn_{node}" for node in inner),
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
    bit, chain = parameters.bit, parameters.segments
    mud = chain.hydraulics
    law, cut = bit.friction, bit.cutting
    found: dict[str, Any] = {}
    for name, ring in (("pipe", pipe), ("collar", collar)):
        annulus, bore = ring.annulus / ring.mass, ring.bore / ring.mass
        up, down = mud.flow / ring.annulus_area, over(mud.flow, ring.bore_area)
        found |= {
            f"{name}_axial": ring.axial / ring.mass,
            f"{name}_torsional": ring.torsional / ring.inertia,
            f"{name}_drag": ring.drag / ring.inertia,
            f"{name}_annulus": annulus,
            f"{name}_bore": bore,
            f"{name}_mean": annulus * up * up - bore * down * down,
            f"per_{name}_annulus": 1 / ring.annulus_area,
            f"per_{name}_bore": over(1.0, ring.bore_area),
        }
    top = (
        _torque(parameters, string)
        if parameters.drive.by_torque
        else _motor(parameters, string, steady)
    )
    return (
        found
        | top
        | {
            "set_speed": speed,
            "wob": wob,
            "stuck": thresholds.stuck_below,
            "top_share": pipe.mass / (2 * string.top_mass),
            "joint_pipe_share": pipe.mass / (2 * string.joint_mass),
            "joint_collar_share": collar.mass / (2 * string.joint_mass),
            "bit_share": collar.mass / (2 * string.bit_mass),
            "joint_pipe_turn": pipe.inertia / (2 * string.joint_inertia),
            "joint_collar_turn": collar.inertia / (2 * string.joint_inertia),
            "bit_turn": collar.inertia / (2 * string.bit_inertia),
            "axial_time": chain.material_damping.axial,
            "torsional_time": chain.material_damping.torsional,
            "flow_": mud.flow,
            "pulsation": mud.pulsation,
            "pulsation_rate": mud.pulsation_rate,
            "top_stiffness": chain.top.stiffness,
            "top_damping": chain.top.damping,
            "per_top_mass": 1 / string.top_mass,
            "per_bit_mass": 1 / string.bit_mass,
            "per_bit_inertia": 1 / string.bit_inertia,
            "rock_stiffness": bit.rock_stiffness,
            "closing_factor": over(chain.rock_damping, wob),
            "surface_amplitude": bit.surface_amplitude,
            "lobes_": float(bit.lobes),
            "friction_arm": bit.radius * law.level,
            "hump": law.hump,
            "narrowing": law.narrowing,
            "viscous": law.viscous,
            "cutting_arm": bit.radius * cut.zeta,
            "cutting_factor": 2 * math.pi / bit.radius,
            "advance_": cut.c1 * wob,
            "advance_offset": cut.c2,
            "slow_square": cut.slow * cut.slow,
            "smoothing": cut.smoothing,
            "live_": float(cut.speed == "live"),
            "threshold": chain.threshold_force,
            "per_threshold_width": 10 / chain.threshold_force,
            "surface_stiffness": pipe.torsional,
            "steady_torque": steady.table_torque,
            "chain_stiffness": string.axial,
            **creeping(parameters, wob, speed),
        }
    )


def _motor(parameters: Parameters, string: String, steady: Steady) -> dict[str, Any]:
    """Those of the electric motor."""
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
    """Those of a drive by torque. An ideal one is never switched on."""
    drive, law = parameters.drive, law_of(parameters, string)
    limit = drive.torque_limit
    half = string.pipe.inertia / 2
    return {
        "per_drive_inertia": 1.0 / (law.inertia + half),
        "half_inertia": half,
        "drive_stiffness": law.stiffness,
        "drive_damping": law.damping,
        "twist_gain": law.twist_gain,
        "speed_gain": law.speed_gain,
        "torque_least": -UNLIMITED if limit is None else 0.0,
        "torque_most": UNLIMITED if limit is None else limit,
        "top_drag": string.pipe.drag / 2,
        "on_at": NEVER if drive.kind == "ideal" else drive.on_at,
    }


def over(above: Any, below: Any) -> Any:
    """The quotient, and 0 where there is nothing below: a bore that is not there, a bit
    without load."""
    above, below = np.broadcast_arrays(
        np.asarray(above, dtype=float), np.asarray(below, dtype=float)
    )
    return np.divide(above, below, out=np.zeros(below.shape), where=below != 0.0)
