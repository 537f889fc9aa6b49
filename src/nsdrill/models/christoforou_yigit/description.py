"""The description of this model, for checks, files and pictures, with its studies of
earlier versions, which had one law of friction and an ideal drive. It does not import
the compiler.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

from nsdrill.data import Array, Attributes, Resolved
from nsdrill.models.christoforou_yigit import variables
from nsdrill.models.christoforou_yigit.coefficients import derive
from nsdrill.models.christoforou_yigit.columns import friction_rates, is_used
from nsdrill.models.christoforou_yigit.constraints import ORDERS, constraints
from nsdrill.models.christoforou_yigit.parameters import BitFriction, Initial, Parameters
from nsdrill.models.description import STICK_ONSET, Description, Drawn, Grazing, Panel
from nsdrill.models.friction import LAWS, laws_that_read
from nsdrill.models.leaves import values_at, without
from nsdrill.models.numbers import DRILLED
from nsdrill.models.sections import MEANINGS, HyperbolicFriction
from nsdrill.variables import MODEL

_FIRST = {item.name for item in fields(HyperbolicFriction)}
_LAW = {item.name: item.default for item in fields(BitFriction) if item.name not in _FIRST}
_MOTOR = ("inductance", "resistance", "torque_constant", "gear", "table_inertia", "motor_inertia")


def completed(resolved: Resolved) -> Resolved:
    """A resolved study of any version with the keys of the bit's friction law."""
    bit = resolved.get("bit", {})
    if "law" in bit.get("friction", {}):
        return dict(resolved)
    return {**resolved, "bit": {**bit, "friction": {**bit["friction"], **_LAW}}}


def as_before(parts: Resolved) -> Resolved:
    """A study without what earlier versions did not know, where it is as it was then:
    so that it keeps its digest."""
    parts = without(parts, [], "model")
    if parts.get("bit", {}).get("friction", {}).get("law") == "hyperbolic":
        for name in _LAW:
            parts = without(parts, ["bit", "friction"], name)
    if parts.get("simulation", {}).get("method") == "auto":
        parts = without(parts, ["simulation"], "method")
    if "frozen" not in parts.get("modes", {}).values():
        parts.pop("modes", None)
    if parts.get("drive", {}).get("kind") == "ideal":
        del parts["drive"]
        parts = without(without(parts, ["initial"], "lag"), ["initial"], "drive_speed")
    for name in ("torque_limit", "on_at", "gains"):
        if parts.get("drive", {name: 0.0}).get(name) is None:
            parts = without(parts, ["drive"], name)
    if parts.get("drive", {}).get("kind") != "dc_motor":
        for name in _MOTOR:
            parts = without(parts, ["drive"], name)
    if parts.get("stabilizer", {}).get("clearance") is None and "stabilizer.clearance" not in parts["sweep"]:
        parts.pop("stabilizer", None)
    return parts


def states(parameters: Parameters) -> tuple[str, ...]:
    """The names of the states of a string with this drive, the angle of the set point
    last."""
    if parameters.drive.kind == "dc_motor":
        return variables.MOTOR_STATE_NAMES
    return variables.STATE_NAMES if parameters.drive.ideal else variables.DRIVEN_STATE_NAMES


def options(parameters: Parameters) -> tuple[str, ...]:
    """The options that have features of their own: stabilisers with a clearance or
    friction, and an inclined hole."""
    # Not from the compiled options, as one of them, the number of lobes, may be an
    # axis.
    used = {
        "stabilizers": parameters.stabilizer.clearance is not None,
        "inclined": is_used(parameters.well.inclination),
    }
    return tuple(name for name, is_present in used.items() if is_present)


def attributes(parameters: Parameters, initial: Initial, axes: Mapping[str, Array]) -> Attributes:
    """The ``gap`` [m] between collar and wall, which pictures show; None where it
    differs between points."""
    axis_values = [axes.get(key, ()) for key in ("well.diameter", "drillstring.collar.outer_diameter")]
    if any(len(axis) > 1 for axis in axis_values):
        return {"gap": None}
    point = values_at(parameters, initial, {key: float(axis[0]) for key, axis in axes.items()})
    return {"gap": float(derive(point.parameters, *point.operation).gap)}


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

_BESIDE = {item.name: item.metadata["meaning"] for item in fields(BitFriction) if "meaning" in item.metadata}
BIT_FRICTION = {
    **{key: _BESIDE.get(key) or MEANINGS[f"bit.friction.{key}"] for law in LAWS.values() for key in law.keys},
    "decay": "Rate of the fall from static to dynamic",  # as short as a line of the template
}
MEANINGS_OF_LAWS = {f"bit.friction.{key}": f"{words}; {laws_that_read(key)}" for key, words in BIT_FRICTION.items()}

DESCRIPTION = Description(
    name=MODEL,
    title="The axial, torsional and lateral oscillator of Christoforou and Yigit: rock, wall, lobes",
    parameters=Parameters,
    initial=Initial,
    meanings=MEANINGS_OF_LAWS,
    states=states,
    several_states=(variables.STATE_NAMES, variables.DRIVEN_STATE_NAMES, variables.MOTOR_STATE_NAMES),
    labels=variables.LABELS,
    features=variables.FEATURES,
    derived=DRILLED,
    peaks=variables.PEAKS,
    section=variables.SECTION,
    own_trace=variables.TRACE,
    shown=variables.SHOWN,
    compared=variables.COMPARED,
    grouped=variables.GROUPED,
    distinguishing=variables.DISTINGUISHING,
    orders=ORDERS,
    constraints=constraints,
    units_by={"well.stiffness": ("well.law", {"linear": "N/m", "hertz": "N/m^1.5"})},
    grazing=(
        Grazing(101, "lift_off", "rock", "lost", "the bit begins to leave the rock: bit-bounce", "lift_off"),
        Grazing(
            102, "wall_reached", "wall", "reached", "the collar comes to touch the wall: the first impacts", "wall"
        ),
        Grazing(103, "wall_lost", "wall", "lost", "the collar begins to leave the wall that it was held against"),
        STICK_ONSET,
    ),
    compiled=("bit.lobes",),
    friction_rates=friction_rates,
    completed=completed,
    as_before=as_before,
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
