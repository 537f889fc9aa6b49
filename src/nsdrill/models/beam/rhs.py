"""The rows of the elastic collar in the lane buffer, and the names of what the
equations (:mod:`.equations`) read and give."""

from __future__ import annotations

from nsdrill.models.beam.options import Options

# Auxiliary outputs for the observer: cosine and sine of the bit angle and torque of the
# rock; the number of stations on the wall, and the sum of their slips; of each station,
# its radius, and that times the radial velocity.
AUX = ("cosine", "sine", "torque", "wall_contacts", "slip_sum")
LOCAL_AUX = ("radius", "outward")
PARAMETERS = (
    "drive_speed",
    "wob",
    "per_lateral_mass",
    "per_inertia",
    "per_axial_mass",
    "bending",
    "softening_constant",
    "softening_force",
    "softening_torque",
    "structural",
    "axial_damping",
    "axial_stiffness",
    "torsional_damping",
    "torsional_stiffness",
    "gap",
    "wall_stiffness",
    "collar_radius",
    "wall_smoothing",
    "wall_decay",
    "wall_rise",
    "wall_dynamic",
    "rock_stiffness",
    "surface_amplitude",
    "bit_smoothing",
    "bit_decay",
    "bit_rise",
    "bit_dynamic",
    "stuck_below",
    "torque_scale",
)
# Lane parameters of each station: the gap, the stiffness of the wall, the drag, and the
# factor from a penetration of this wall to that of the well's wall under the same
# force, for comparing penetrations of different walls.
STATION = ("gap", "wall_stiffness", "drag", "penetration_factor")


def columns_of(options: Options) -> tuple[str, ...]:
    """The names of the lane parameters: those of every collar, the arms of unbalanced
    modes, the mode shapes at the watched place, the parameters of each station, and the
    mode shapes there."""
    modes, stations = range(1, options.modes + 1), range(1, options.stations + 1)
    arms = (f"unbalance_arm_{n}" for n in options.eccentric)
    of_stations = (f"{name}_{j}" for j in stations for name in STATION)
    shapes = (f"phi_{j}_{n}" for j in stations for n in modes)
    return (*PARAMETERS, *arms, *(f"watched_{n}" for n in modes), *of_stations, *shapes)


def aux_of(options: Options) -> tuple[str, ...]:
    """The names of the auxiliary outputs."""
    return (*AUX, *(f"{name}_{j}" for j in range(1, options.stations + 1) for name in LOCAL_AUX))
