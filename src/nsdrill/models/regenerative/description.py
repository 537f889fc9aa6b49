"""The description of the model: its study keys, what their values must satisfy together,
its variables and pictures."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from nsdrill.models import surface, top
from nsdrill.models.blades import MOST_STATES, SURFACES, of_wear_flats
from nsdrill.models.drive_rules import DRIVE_RULES
from nsdrill.models.model_description import STICK_ONSET, Description
from nsdrill.models.numbers import DRILLED
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.regenerative.columns import Options, names_of, options_of, string_of
from nsdrill.models.regenerative.parameters import Initial, Parameters
from nsdrill.models.registry import known, known_in_trace
from nsdrill.models.rules import Order
from nsdrill.models.sections import WIDEST_BORE
from nsdrill.models.turning import ABOVE, ALONG, CYCLES, ON_SURFACE, SWING, TURNING, drawn_along
from nsdrill.models.whole_string import MEASURED, WHOLE_STRING, has_sections, is_measured

AXIAL = ("drillstring.axial_mass", "drillstring.axial_stiffness")


def friction_rates(points: Values[Parameters]) -> dict[str, Numeric]:
    """The rates [1/s] at which friction at rest brakes the bit: that of its torque, and that
    under the wear flats along the hole."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    whole, bit = string_of(parameters.drillstring, depth), parameters.bit
    rates = surface.friction_rates(bit, bit.radius, wob, speed, 1.0 / whole.mass, 1.0 / whole.inertia)
    return {f"bit.{key}": rate for key, rate in rates.items()}


def without_length(check: Any) -> bool:
    """Whether no length of the collars counts."""
    return has_sections(check) or all(is_measured(check, key) for key in (*MEASURED, *AXIAL))


DESCRIPTION = Description(
    name="regenerative",
    title="A string on a drag bit that cuts what its last blade left: axial and torsional motion",
    parameters=Parameters,
    initial=Initial,
    friction_rates=friction_rates,
    meanings={
        "bit": "The drag bit: its blades, and the rock that they cut",
        "initial.bit_speed": "Bit speed; null: the set speed",
    },
    states=lambda parameters: (*names_of(options_of(parameters)).states, "drive_angle"),
    states_allowed=lambda found: top.have_states(found, lambda o: names_of(o).states, map(Options, SURFACES)),
    checks="nsdrill.models.regenerative.checks",
    responses=("bit_bounce", "stick_slip"),
    grazing=(STICK_ONSET,),
    labels=(*known("stick_slip_severity", "bounce_severity"), replace(known("beyond_validity")[0], only=None)),
    features=(*known(*TURNING, *CYCLES, *ALONG, *ABOVE), *(replace(one, only=None) for one in known(*ON_SURFACE))),
    derived=DRILLED,
    peaks=known("bit_speed_peaks", "axial_peaks"),
    section=known("section_axial", "section_axial_velocity", "section_twist", "section_bit_speed"),
    own_trace=(
        *known_in_trace("z", "vz", "twist", "bit_speed", "lag", "motor_torque"),
        *known_in_trace("drive_angle", "bit_force", "bit_torque", "surface_torque"),
        replace(known_in_trace("interference")[0], only=None),
    ),
    untraced=known_in_trace(*surface.names(MOST_STATES)),
    shown=(
        *TURNING[3:],
        *("stick_slip_period", "lift_off_fraction", "turned_back"),
        *(one.name for one in DRILLED),
        "surface_torque_max",
    ),
    compared={**SWING, "lift_off_fraction": None},
    distinguishing=(*TURNING, "lift_off_fraction"),
    orders=(
        Order("drillstring.collar.inner_diameter", "drillstring.collar.outer_diameter", True, "lower", WIDEST_BORE),
        Order("drillstring.pipe.inner_diameter", "drillstring.pipe.outer_diameter", True, "lower", WIDEST_BORE),
        Order("drillstring.collar.length", "operation.depth", words="the length of the collars", unless=without_length),
    ),
    rules=(*WHOLE_STRING, *DRIVE_RULES, of_wear_flats("bit.wear_length", "bit.radius", 3.0)),
    compiled=("bit.blades",),
    example_axis=("bit.wear_length", "1 mm", "6 mm"),
    example_slice="{twist: {from: -20 rad, to: 0 rad, points: 9}, bit_speed: {from: 0 rad/s, to: 9 rad/s, points: 9}}",
    drawn=drawn_along("z", "interference", "bit_speed", "bit_force", "bit_torque"),
)
