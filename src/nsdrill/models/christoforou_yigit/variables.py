"""The variables of this model in results and traces."""

from __future__ import annotations

from nsdrill.models.responses import RESPONSES
from nsdrill.observe.channels import Mean, RmsOfSlopes, TimeAbove, Winding
from nsdrill.variables import at_section, feature, in_trace, last_peaks

STATE_NAMES = ("x", "vx", "y", "vy", "z", "vz", "twist", "bit_speed", "drive_angle")
# with a drive that is not ideal
DRIVEN_STATE_NAMES = (*STATE_NAMES[:-1], "lag", "drive_speed", STATE_NAMES[-1])
# with a DC motor
MOTOR_STATE_NAMES = (*DRIVEN_STATE_NAMES[:-1], "motor_impulse", "motor_torque", STATE_NAMES[-1])

LABELS = tuple(
    label
    for label in (
        RESPONSES["whirl"].kind,
        *(RESPONSES[name].severity for name in ("stick_slip", "bit_bounce", "whirl")),
    )
    if label
)
FEATURES = (
    feature("bit_speed_min", "rad s-1", "least bit speed"),
    feature("bit_speed_max", "rad s-1", "greatest bit speed"),
    feature("bit_speed_mean", "rad s-1", "mean bit speed", measure=Mean("bit speed", compared="set_speed")),
    feature(
        "stick_slip_index", "percent", "stick-slip index (max - min) / (2 mean) of bit speed", label="Stick-slip index"
    ),
    feature("stuck_fraction", "1", "fraction of time with the bit stuck", label="Time stuck"),
    feature("axial_min", "m", "lowest bit position"),
    feature("axial_max", "m", "highest bit position"),
    feature("lift_off_fraction", "1", "fraction of time with the bit off the rock", label="Time off the rock"),
    feature("bit_force_max", "N", "greatest force on the bit"),
    feature("bit_torque_max", "N m", "greatest torque on the bit"),
    feature("radius_max", "m", "greatest radial displacement of the collar", label="Greatest radius"),
    feature("radius_mean", "m", "mean radial displacement of the collar", label="Mean radius", measure=Mean("radius")),
    feature(
        "wall_contact_fraction",
        "1",
        "fraction of time with the collar on the wall",
        label="Time on the wall",
        measure=TimeAbove("reach"),
    ),
    feature("wall_force_max", "N", "greatest normal force on the wall"),
    feature(
        "stabilizer_contact_fraction",
        "1",
        "fraction of time with the stabilisers on the wall",
        "stabilizers",
        label="Time on the stabilisers",
        measure=TimeAbove("reach", level="clearance"),
    ),
    feature(
        "x_mean", "m", "mean displacement of the collar in an inclined hole, x, across it", "inclined", label="Mean $x$"
    ),
    feature(
        "y_mean",
        "m",
        "mean displacement of the collar in an inclined hole, y, the low side at -y",
        "inclined",
        label="Mean $y$",
    ),
    feature("whirl_speed_mean", "rad s-1", "mean whirl speed", measure=Winding("x", "y", counted=True)),
    feature("whirl_ratio", "1", "mean whirl speed over mean bit speed", label="Whirl ratio"),
    feature(
        "rolling_ratio",
        "1",
        "rolling ratio while on the wall: 1 rolls backward without slip, 0 does not roll",
        label="Rolling ratio",
    ),
    feature("surface_torque_min", "N m", "least torque at the surface"),
    feature("surface_torque_max", "N m", "greatest torque at the surface"),
    feature("surface_torque_mean", "N m", "mean torque at the surface"),
    feature("drive_speed_min", "rad s-1", "least speed of the drive", "drive_speed"),
    feature("drive_speed_max", "rad s-1", "greatest speed of the drive", "drive_speed"),
    feature("drive_speed_mean", "rad s-1", "mean speed of the drive", "drive_speed", measure=Mean("drive speed")),
    feature(
        "lateral_acceleration_rms",
        "m s-2",
        "r.m.s. lateral acceleration of the collar centre",
        label="Lateral acceleration, r.m.s.",
        measure=RmsOfSlopes(("vx", "vy")),
    ),
    feature(
        "axial_acceleration_rms",
        "m s-2",
        "r.m.s. axial acceleration of the bit",
        label="Axial acceleration, r.m.s.",
        measure=RmsOfSlopes(("vz",)),
    ),
)
SHOWN = (
    "stick_slip_index",
    "stuck_fraction",
    "lift_off_fraction",
    "wall_contact_fraction",
    "whirl_ratio",
    "bit_force_max",
    "bit_torque_max",
    "wall_force_max",
    "surface_torque_max",
    "lateral_acceleration_rms",
    "rate_of_penetration",
    "mechanical_specific_energy",
)
# The features that are compared, each with the scale of its difference; fractions of
# time have none.
COMPARED = {
    "bit_speed_min": "drive_speed",
    "bit_speed_max": "drive_speed",
    "bit_speed_mean": "drive_speed",
    "whirl_speed_mean": "drive_speed",
    "axial_min": "lobe",
    "axial_max": "lobe",
    "radius_max": "gap",
    "radius_mean": "gap",
    "stuck_fraction": None,
    "lift_off_fraction": None,
    "wall_contact_fraction": None,
}
# The features that distinguish starts and match attractors along a sweep.
GROUPED = (
    "lift_off_fraction",
    "wall_contact_fraction",
    "stuck_fraction",
    "stick_slip_index",
    "radius_mean",
    "whirl_speed_mean",
    "axial_acceleration_rms",
    "axial_min",
    "axial_max",
    "radius_max",
    "bit_speed_min",
    "bit_speed_max",
)
# The features that are listed for an attractor.
DISTINGUISHING = (
    "stick_slip_index",
    "stuck_fraction",
    "lift_off_fraction",
    "axial_min",
    "axial_max",
    "bit_force_max",
    "radius_mean",
    "radius_max",
    "wall_contact_fraction",
    "whirl_ratio",
)
PEAKS = (
    last_peaks("axial_peaks", "m", "last local maxima of the bit position", label="Axial peaks $z$"),
    last_peaks(
        "bit_speed_peaks",
        "rad s-1",
        "last local maxima of the bit speed, one a slip where the bit sticks",
        label="Bit speed peaks",
    ),
    last_peaks("radius_peaks", "m", "last local maxima of the radial displacement", label="Radial peaks $r$"),
)
SECTION = (
    at_section("radius", "m", "radial displacement", label="$r$"),
    at_section("radial_velocity", "m s-1", "radial velocity", label="$\\dot r$"),
    at_section("whirl_angle", "rad", "whirl angle relative to the bit angle", label="Whirl angle from bit"),
    at_section("whirl_speed", "rad s-1", "whirl speed", label="Whirl speed"),
    at_section("axial", "m", "bit position", label="$z$"),
    at_section("axial_velocity", "m s-1", "axial velocity", label="$\\dot z$"),
    at_section("twist", "rad", "twist of the string", label="Twist"),
    at_section("bit_speed", "rad s-1", "bit speed", label="Bit speed"),
)
TRACE = (
    in_trace("x", "m", "lateral position of the collar centre, x", label="$x$"),
    in_trace("vx", "m s-1", "lateral velocity, x", label="$\\dot x$"),
    in_trace("y", "m", "lateral position of the collar centre, y", label="$y$"),
    in_trace("vy", "m s-1", "lateral velocity, y", label="$\\dot y$"),
    in_trace("z", "m", "bit position above its mean cutting surface, positive up", label="$z$"),
    in_trace("vz", "m s-1", "axial velocity of the bit", label="$\\dot z$"),
    in_trace("twist", "rad", "twist of the string: bit angle less drive angle", label="Twist"),
    in_trace("bit_speed", "rad s-1", "bit speed", label="Bit speed"),
    in_trace("lag", "rad", "lag of the drive: its angle less that of the set speed", "lag"),
    in_trace("motor_impulse", "N m s", "integral of the torque of a DC motor", "motor_torque"),
    in_trace("motor_torque", "N m", "torque of a DC motor, felt at the string", "motor_torque"),
    in_trace("drive_angle", "rad", "drive angle at the top", label="Drive angle"),
    in_trace("radius", "m", "radial displacement of the collar centre", label="$r$"),
    in_trace("radial_velocity", "m s-1", "radial velocity of the collar centre", label="$\\dot r$"),
    in_trace("whirl_angle", "rad", "whirl angle of the collar centre, unwrapped"),
    in_trace("whirl_speed", "rad s-1", "whirl speed of the collar centre"),
    in_trace("bit_force", "N", "force of the rock on the bit", label="Bit force"),
    in_trace("bit_torque", "N m", "torque of the rock on the bit", label="Bit torque"),
    in_trace("wall_force", "N", "normal force of the wall on the collar", label="Wall force"),
    in_trace("wall_friction", "N", "friction force of the wall on the collar"),
    in_trace("surface_torque", "N m", "torque at the surface"),
)
