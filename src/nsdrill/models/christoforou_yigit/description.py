"""The description of this model, for checks, files and pictures: its variables in
results and traces. It does not import the compiler.
"""

from __future__ import annotations

from collections.abc import Mapping

from nsdrill.data import Array, Attributes
from nsdrill.models import surface, top
from nsdrill.models.blades import MOST_STATES, SURFACES
from nsdrill.models.christoforou_yigit.columns import (
    DRIVEN_STATE_NAMES,
    MOTOR_STATE_NAMES,
    STATE_NAMES,
    Options,
    friction_rates,
    is_used,
    options_of,
    states_of,
)
from nsdrill.models.christoforou_yigit.constraints import ORDERS, RULES
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.friction import LAWS, TORQUES, laws_that_read
from nsdrill.models.model_description import STICK_ONSET, Description, Drawn, Grazing, Panel
from nsdrill.models.numbers import DRILLED
from nsdrill.models.parts import values_at
from nsdrill.models.responses import RESPONSES
from nsdrill.models.sections import MEANINGS
from nsdrill.observe.channels import Mean, RmsOfSlopes, TimeAbove, Winding
from nsdrill.variables import MODEL, Variable, at_section, feature, flag, fraction, in_trace, last_peaks

STATE_SETS = (STATE_NAMES, DRIVEN_STATE_NAMES, MOTOR_STATE_NAMES)


def options(parameters: Parameters) -> tuple[str, ...]:
    """The options that have features of their own: stabilisers with a clearance or
    friction, an inclined hole, and a bit on the surface that its blades leave."""
    # Not from the compiled options, as one of them, the number of lobes, may be an
    # axis.
    used = {
        "stabilizers": parameters.stabilizer.clearance is not None,
        "inclined": is_used(parameters.well.inclination),
        REGENERATIVE: parameters.bit.rock.regenerative,
    }
    return tuple(name for name, is_present in used.items() if is_present)


def attributes(parameters: Parameters, initial: Initial, axes: Mapping[str, Array]) -> Attributes:
    """The ``gap`` [m] between collar and wall, which pictures show; None where it
    differs between points."""
    axis_values = [axes.get(key, ()) for key in ("well.diameter", "drillstring.collar.outer_diameter")]
    if any(len(axis) > 1 for axis in axis_values):
        return {"gap": None}
    point = values_at(parameters, initial, {key: float(axis[0]) for key, axis in axes.items()})
    within = point.parameters  # of the elastic collar too
    return {"gap": float((within.well.diameter - within.drillstring.collar.outer_diameter) / 2)}


def hole(parameters: Parameters) -> tuple[float, float]:
    """The radii [m] of the hole and of the collar."""
    return parameters.well.diameter / 2, parameters.drillstring.collar.outer_diameter / 2


# The variables of pictures that are constant where a mode is frozen. (The torque on the
# bit depends on both its force and its speed, so it belongs to no single mode.)
MODES = {
    "axial": ("z", "vz", "bit_force", "section_axial", "section_axial_velocity", "axial_max", "lift_off_fraction"),
    "torsional": ("twist", "bit_speed", "section_twist", "section_bit_speed", "stick_slip_index"),
    "lateral": (
        "x",
        "y",
        "radius",
        "radial_velocity",
        "wall_force",
        "section_radius",
        "section_radial_velocity",
        "section_whirl_angle",
        "radius_max",
        "wall_contact_fraction",
        "whirl_ratio",
    ),
}

BIT_FRICTION = {
    **{key: MEANINGS[f"bit.friction.{key}"] for law in LAWS.values() for key in law.keys if key not in TORQUES},
    "decay": "Rate of the fall from static to dynamic",  # as short as a line of the template
}
MEANINGS_OF_LAWS = {f"bit.friction.{key}": f"{words}; {laws_that_read(key)}" for key, words in BIT_FRICTION.items()}

REGENERATIVE = "regenerative"  # a bit on the surface that its blades leave
LABELS: tuple[Variable, ...] = tuple(
    label
    for label in (
        RESPONSES["whirl"].kind,
        *(RESPONSES[name].severity for name in ("stick_slip", "bit_bounce", "whirl")),
    )
    if label
)
LABELS += (
    flag(
        "beyond_validity",
        "what takes the run beyond the model",
        "nothing off_bottom turned_back_past_a_blade both_of_these",
        REGENERATIVE,
    ),
)
FEATURES = (
    feature("bit_speed_min", "rad s-1", "least bit speed", signal="bit_speed"),
    feature("bit_speed_max", "rad s-1", "greatest bit speed", signal="bit_speed"),
    feature(
        "bit_speed_mean",
        "rad s-1",
        "mean bit speed",
        measure=Mean("bit speed", compared="set_speed"),
        signal="bit_speed",
    ),
    feature(
        "stick_slip_index",
        "percent",
        "stick-slip index (max - min) / (2 mean) of bit speed",
        label="Stick-slip index",
        low=0.0,
        scale=100.0,
    ),
    fraction("stuck_fraction", "fraction of time with the bit stuck", label="Time stuck"),
    feature(
        "stick_slip_period",
        "s",
        "period of stick-slip: mean time between two rises of bit speed",
        label="Period of stick-slip",
        low=0.0,
    ),
    feature(
        "peak_ratio", "1", "greatest bit speed over the set speed", label="Greatest bit speed over set speed", scale=1.0
    ),
    feature("axial_min", "m", "lowest bit position", signal="axial"),
    feature("axial_max", "m", "highest bit position", signal="axial"),
    fraction("lift_off_fraction", "fraction of time with the bit off the rock", label="Time off the rock"),
    feature("bit_force_max", "N", "greatest force on the bit", signal="bit_force", low=0.0),
    feature("bit_torque_max", "N m", "greatest torque on the bit", signal="bit_torque"),
    feature(
        "radius_max",
        "m",
        "greatest radial displacement of the collar",
        label="Greatest radius",
        signal="radius",
        low=0.0,
    ),
    feature(
        "radius_mean",
        "m",
        "mean radial displacement of the collar",
        label="Mean radius",
        measure=Mean("radius"),
        signal="radius",
        low=0.0,
    ),
    fraction(
        "wall_contact_fraction",
        "fraction of time with the collar on the wall",
        label="Time on the wall",
        measure=TimeAbove("reach"),
    ),
    feature("wall_force_max", "N", "greatest normal force on the wall", signal="wall_force", low=0.0),
    fraction(
        "stabilizer_contact_fraction",
        "fraction of time with the stabilisers on the wall",
        "stabilizers",
        label="Time on the stabilisers",
        measure=TimeAbove("reach", level="clearance"),
    ),
    feature(
        "x_mean",
        "m",
        "mean displacement of the collar in an inclined hole, x, across it",
        "inclined",
        label="Mean $x$",
        signal="x",
    ),
    feature(
        "y_mean",
        "m",
        "mean displacement of the collar in an inclined hole, y, the low side at -y",
        "inclined",
        label="Mean $y$",
        signal="y",
    ),
    feature(
        "whirl_speed_mean", "rad s-1", "mean whirl speed", measure=Winding("x", "y", counted=True), signal="whirl_speed"
    ),
    feature("whirl_ratio", "1", "mean whirl speed over mean bit speed", label="Whirl ratio"),
    feature(
        "rolling_ratio",
        "1",
        "rolling ratio while on the wall: 1 rolls backward without slip, 0 does not roll",
        label="Rolling ratio",
    ),
    feature("surface_torque_min", "N m", "least torque at the surface", signal="surface_torque"),
    feature("surface_torque_max", "N m", "greatest torque at the surface", signal="surface_torque"),
    feature("surface_torque_mean", "N m", "mean torque at the surface", signal="surface_torque"),
    feature("drive_speed_min", "rad s-1", "least speed of the drive", "drive_speed", signal="drive_speed"),
    feature("drive_speed_max", "rad s-1", "greatest speed of the drive", "drive_speed", signal="drive_speed"),
    feature(
        "drive_speed_mean",
        "rad s-1",
        "mean speed of the drive",
        "drive_speed",
        measure=Mean("drive speed"),
        signal="drive_speed",
    ),
    feature(
        "lateral_acceleration_rms",
        "m s-2",
        "r.m.s. lateral acceleration of the collar centre",
        label="Lateral acceleration, r.m.s.",
        measure=RmsOfSlopes(("vx", "vy")),
        low=0.0,
    ),
    feature(
        "axial_acceleration_rms",
        "m s-2",
        "r.m.s. axial acceleration of the bit",
        label="Axial acceleration, r.m.s.",
        measure=RmsOfSlopes(("vz",)),
        low=0.0,
    ),
    feature(
        "axial_velocity_min",
        "m s-1",
        "least axial velocity of the bit, less steady drilling",
        REGENERATIVE,
        signal="vz",
    ),
    feature(
        "axial_velocity_max",
        "m s-1",
        "greatest axial velocity of the bit, less steady drilling",
        REGENERATIVE,
        signal="vz",
    ),
    feature(
        "axial_velocity_mean",
        "m s-1",
        "mean axial velocity of the bit, less steady drilling",
        REGENERATIVE,
        signal="vz",
    ),
    feature("blade_depth_max", "m", "greatest depth of cut of a blade", REGENERATIVE),
    feature(
        "turned_back",
        "1",
        "angle by which the bit turns back in a cycle, in spacings of the blades",
        REGENERATIVE,
        low=0.0,
    ),
)
SHOWN = (
    "stick_slip_index",
    "stuck_fraction",
    "stick_slip_period",
    "lift_off_fraction",
    "turned_back",
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
    in_trace("z", "m", "bit position, positive up: above the mean of lobes, or above steady drilling", label="$z$"),
    in_trace("vz", "m s-1", "axial velocity of the bit", label="$\\dot z$"),
    in_trace(
        "twist", "rad", "bit angle less the set angle: the twist of the string below an ideal drive", label="Twist"
    ),
    in_trace("bit_speed", "rad s-1", "bit speed", label="Bit speed"),
    in_trace("lag", "rad", "lag of the drive: its angle less that of the set speed", "lag"),
    in_trace("motor_impulse", "N m s", "integral of the torque of a DC motor", "motor_torque"),
    in_trace("motor_torque", "N m", "torque of a DC motor, felt at the string", "motor_torque"),
    in_trace("drive_angle", "rad", "set angle: that of a drive that keeps the set speed", label="Drive angle"),
    in_trace("radius", "m", "radial displacement of the collar centre", label="$r$"),
    in_trace("radial_velocity", "m s-1", "radial velocity of the collar centre", label="$\\dot r$"),
    in_trace("whirl_angle", "rad", "whirl angle of the collar centre, unwrapped"),
    in_trace("whirl_speed", "rad s-1", "whirl speed of the collar centre"),
    in_trace("bit_force", "N", "force of the rock on the bit", label="Bit force"),
    in_trace("bit_torque", "N m", "torque of the rock on the bit", label="Bit torque"),
    in_trace("interference", "m", "depth of cut of a blade; negative: its height above the surface", REGENERATIVE),
    in_trace("wall_force", "N", "normal force of the wall on the collar", label="Wall force"),
    in_trace("wall_friction", "N", "friction force of the wall on the collar"),
    in_trace("surface_torque", "N m", "torque at the surface"),
)

DESCRIPTION = Description(
    name=MODEL,
    title="The axial, torsional and lateral oscillator of Christoforou and Yigit: rock, wall, lobes",
    parameters=Parameters,
    initial=Initial,
    meanings={**MEANINGS_OF_LAWS},
    states=lambda parameters: (*states_of(options_of(parameters)), "drive_angle"),
    several_states=STATE_SETS,
    states_allowed=lambda found: top.have_states(found, states_of, (Options(surface=count) for count in SURFACES)),
    labels=LABELS,
    features=FEATURES,
    derived=DRILLED,
    peaks=PEAKS,
    section=SECTION,
    own_trace=TRACE,
    untraced=tuple(
        in_trace(name, "m", f"coefficient {k} of the surface between two blades")
        for k, name in enumerate(surface.names(MOST_STATES))
    ),
    shown=SHOWN,
    compared=COMPARED,
    grouped=GROUPED,
    distinguishing=DISTINGUISHING,
    orders=ORDERS,
    rules=RULES,
    units_by={"well.stiffness": ("well.law", {"linear": "N/m", "hertz": "N/m^1.5"})},
    grazing=(
        Grazing(101, "lift_off", "rock", "lost", "the bit begins to leave the rock: bit-bounce", "lift_off"),
        Grazing(
            102, "wall_reached", "wall", "reached", "the collar comes to touch the wall: the first impacts", "wall"
        ),
        Grazing(103, "wall_lost", "wall", "lost", "the collar begins to leave the wall that it was held against"),
        STICK_ONSET,
    ),
    compiled=("bit.lobes", "bit.rock.blades"),
    friction_rates=friction_rates,
    checks="nsdrill.models.christoforou_yigit.checks",
    charts="nsdrill.models.christoforou_yigit.charts",
    example_axis=("bit.rock_stiffness", "10 MN/m", "100 MN/m"),
    example_slice="{x: {from: -70 mm, to: 70 mm, points: 60}, vx: {from: -1 m/s, to: 1 m/s, points: 60}}",
    attributes=attributes,
    hole=hole,
    options=options,
    drawn=Drawn(
        panels=(
            Panel("axial", "z", "axial_peaks", "axial_max"),
            Panel("torsional", "bit_speed", "bit_speed_peaks", "bit_speed_max"),
            Panel("lateral", "radius", "radius_peaks", "radius_max"),
        ),
        histories=("z", "bit_speed", "radius", "bit_force", "bit_torque", "wall_force"),
        planes=(("z", "vz"), ("twist", "bit_speed"), ("radius", "radial_velocity")),
        section=("section_radius", "section_whirl_angle", "section_axial", "section_bit_speed"),
        section_planes=(
            ("section_axial", "section_axial_velocity"),
            ("section_twist", "section_bit_speed"),
            ("section_radius", "section_radial_velocity"),
        ),
        summary=("stick_slip_index", "lift_off_fraction", "wall_contact_fraction", "whirl_ratio"),
        attractors=(
            (None, "radius_max", "Greatest radius"),
            ("axial_min", "axial_max", "Axial range"),
            (None, "stick_slip_index", "Stick-slip index"),
        ),
        values={
            "stick_slip_index": "stick_slip_index",
            "lift_off": "lift_off_fraction",
            "wall_contact": "wall_contact_fraction",
            "radius": "radius_max",
            "whirl_ratio": "whirl_ratio",
        },
        signed=("whirl_ratio",),
        modes={name: mode for mode, names in MODES.items() for name in names},
        collar="drillstring.collar.outer_diameter",
    ),
)
