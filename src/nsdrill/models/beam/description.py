"""The description of the model: its study keys, variables and pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from nsdrill.models import top
from nsdrill.models.beam.columns import COMMON, FIRST_MODE, STATE_SETS, Options, as_lumped, options_of, states_of
from nsdrill.models.beam.parameters import MAX_MODES, ORDERS, RULES, Initial, Parameters
from nsdrill.models.christoforou_yigit import columns as lumped
from nsdrill.models.christoforou_yigit.description import DESCRIPTION as LUMPED
from nsdrill.models.christoforou_yigit.description import attributes
from nsdrill.models.model_description import Description
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.turning import ON_SURFACE
from nsdrill.variables import feature, in_trace

USUAL = 5  # modes
# Stations whose friction is solved for together. With 5 modes, machine code for 12 takes
# 5 s to make, for 16 three times and for 21 ten times as long.
MAX_RUBBING = 12

MEANINGS = {
    "beam": "The collar between the stabilisers, an elastic beam",
    "beam.torque": "Whether the torque softens the collar in bending, as Christoforou and Yigit have it",
    "drillstring.eccentricity_shape": "Which modes the mass centre's distance is of: the first, or a uniform one",
}


MODE_VARIABLES = tuple(
    in_trace(name, units, words, f"{axis}_{n}")
    for n in range(1, MAX_MODES + 1)
    for axis in "xy"
    for name, units, words in (
        (f"{axis}_{n}", "m", f"bending mode {n}, {axis}"),
        (f"v{axis}_{n}", "m s-1", f"velocity of bending mode {n}, {axis}"),
    )
)


def friction_rates(points: Values) -> Mapping[str, Numeric]:
    """The rates of the lumped model with the same numbers."""
    return lumped.friction_rates(replace(points, parameters=as_lumped(points.parameters)))


def explicit_only(parameters: Parameters) -> str | None:
    """Why the friction of this collar cannot be integrated implicitly, None where it
    can."""
    count = len(parameters.beam.stations)
    if count <= MAX_RUBBING:
        return None
    return f"{count} stations rub on the same modes, of which {MAX_RUBBING} are solved for together (beam.stations)"


DESCRIPTION = Description(
    name="beam",
    title="An elastic drill collar: several bending modes, walls at stations, rock, lobes",
    parameters=Parameters,
    initial=Initial,
    meanings=MEANINGS,
    states=lambda parameters: (*states_of(options_of(parameters)), "drive_angle"),
    friction_rates=friction_rates,
    explicit_only=explicit_only,
    sliced=(*FIRST_MODE, *COMMON, "drive_angle"),
    states_allowed=lambda found: top.have_states(found, states_of, map(Options, STATE_SETS)),
    several_states=(STATE_SETS[USUAL], *(names for n, names in STATE_SETS.items() if n != USUAL)),
    labels=LUMPED.labels,
    features=(
        *(variable for variable in LUMPED.features if variable.only in (None, "drive_speed")),
        feature("impact_rate", "s-1", "wall contacts per second", low=0.0),
    ),
    derived=LUMPED.derived,
    peaks=LUMPED.peaks,
    section=LUMPED.section,
    own_trace=(
        *MODE_VARIABLES,
        *(one for one in LUMPED.own_trace if one.only is None or one.name in ("lag", "motor_torque")),
    ),
    shown=tuple(name for name in LUMPED.shown if name not in ON_SURFACE),
    compared=LUMPED.compared,
    grouped=LUMPED.grouped,
    distinguishing=LUMPED.distinguishing,
    orders=ORDERS,
    compiled=("bit.lobes",),
    rules=RULES,
    units_by={**LUMPED.units_by, "beam.stations.stiffness": LUMPED.units_by["well.stiffness"]},
    checks="nsdrill.models.beam.checks",
    example_axis=LUMPED.example_axis,
    example_slice="{x: {from: -70 mm, to: 70 mm, points: 60}, vx: {from: -1 m/s, to: 1 m/s, points: 60}}",
    attributes=attributes,
    hole=LUMPED.hole,
    drawn=replace(LUMPED.drawn, summary=(*LUMPED.drawn.summary, "impact_rate")),
)
