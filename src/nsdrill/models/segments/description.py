"""The description of the model: its study keys, what their values must satisfy together,
its variables and pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields
from itertools import pairwise
from typing import Any

import numpy as np

from nsdrill.errors import Fault
from nsdrill.models import surface
from nsdrill.models.blades import MOST_STATES, of_the_rock, of_wear_flats
from nsdrill.models.drive_laws import COMPENSATED, goes_by_torque
from nsdrill.models.model_description import Description
from nsdrill.models.numbers import DRILLED
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.own_drives import number_of
from nsdrill.models.registry import known, known_in_trace
from nsdrill.models.rules import Order, Rule
from nsdrill.models.sections import WIDEST_BORE
from nsdrill.models.segments import wall
from nsdrill.models.segments.columns import states_of
from nsdrill.models.segments.parameters import (
    DRIVE,
    LOBED,
    MAX_SEGMENTS,
    HumpedFriction,
    Initial,
    Parameters,
    SegmentsOperation,
)
from nsdrill.models.segments.rock import SPEEDS, root_at
from nsdrill.models.segments.string import string_of
from nsdrill.models.turning import ABOVE, ALONG, CYCLES, ON_SURFACE, SWING, TURNING, drawn_along
from nsdrill.models.whole_string import STATIC, TORQUE_ORDER, WHOLE_STRING, has_sections, is_measured
from nsdrill.variables import at_section, feature, in_trace


def states(parameters: Parameters) -> tuple[str, ...]:
    """The names of the states of a string, the angle of the drive last."""
    rock, nodes = parameters.bit.rock, parameters.segments
    count = rock.states if rock.regenerative else 0
    own = number_of(parameters.drive.kind)
    return (*states_of(nodes.pipe + nodes.collar, count, own), "drive_angle")


def are_states(names: tuple[str, ...]) -> bool:
    """Whether these are the states of a string with any allowed numbers of segments and of
    states of the surface."""
    count = sum(name.startswith("surface_") for name in names)
    last = (len(names) - 2 - count) // 4 - 1
    allowed = 2 <= last <= 2 * MAX_SEGMENTS and (count == 0 or 2 <= count <= MOST_STATES)
    return allowed and names == (*states_of(last, count), "drive_angle")


# The states between surface and bit, which a trace leaves out.
_INNER = (
    in_trace("u_0", "m", "position of the top, from that in steady drilling, positive up"),
    in_trace("v_0", "m s-1", "axial velocity of the top"),
    *(
        variable
        for node in range(1, 2 * MAX_SEGMENTS)
        for variable in (
            in_trace(f"u_{node}", "m", f"position of node {node}, from where it is in steady drilling, positive up"),
            in_trace(f"v_{node}", "m s-1", f"axial velocity of node {node}"),
            in_trace(f"angle_{node}", "rad", f"angle of node {node} less that of the set speed"),
            in_trace(f"speed_{node}", "rad s-1", f"turning speed of node {node}"),
        )
    ),
)


def friction_rates(points: Values) -> dict[str, Numeric]:
    """The rates [1/s] at which friction along the wall brakes a node at rest, and at which
    the cutting torque under the weight on bit brakes the bit, at its steepest: at rest,
    or, where the depth of cut follows the bit speed, between two of the speeds
    :data:`.rock.SPEEDS` of a bit that creeps. (The slope is infinite where such a bit
    begins to cut, but finite between speeds that differ by a fifth.) See
    :mod:`nsdrill.models.segments.rock`."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    return {**_rates_at_bit(parameters, depth, wob, speed), **_rates_at_wall(parameters, depth)}


def _rates_at_bit(parameters: Parameters, depth: Numeric, wob: Numeric, speed: Numeric) -> dict[str, Numeric]:
    bit, string = parameters.bit, string_of(parameters, depth)
    if bit.rock.regenerative:
        inertias = 1.0 / string.bit_mass, 1.0 / string.bit_inertia
        found = surface.friction_rates(bit.rock, bit.radius, wob, speed, *inertias)
        return {f"bit.rock.{key}": rate for key, rate in found.items()}
    bit, cutting = parameters.bit, parameters.bit.cutting
    # The speed of the depth of cut, for a bit at rest.
    cutting_speed = speed if cutting.speed == "mean" else 0.0 * np.asarray(speed)
    steepest = 2 / math.pi * cutting.smoothing * root_at(parameters, wob, cutting_speed)
    if cutting.speed == "live":
        scaled = [cutting.smoothing * slow for slow in SPEEDS]  # x / (0.8 + x) stands for (2/pi) atan x
        torques = [x / (0.8 + x) * root_at(parameters, wob, slow) for x, slow in zip(scaled, SPEEDS, strict=True)]
        for before, after, a, b in zip(torques, torques[1:], SPEEDS, SPEEDS[1:], strict=False):
            steepest = np.maximum(steepest, (after - before) / (b - a))
    if bit.friction.by_torque:
        torque: Numeric = bit.friction.static_torque  # type: ignore[assignment]  # by torque it has one
        return {"bit.friction.smoothing": 2 / math.pi * bit.friction.smoothing * torque / string.bit_inertia}
    return {"bit.cutting.smoothing": wob * bit.radius * cutting.zeta * steepest / string.bit_inertia}


def _rates_at_wall(parameters: Parameters, depth: Numeric) -> dict[str, Numeric]:
    rates: dict[str, Numeric] = {}
    if wall.is_used(parameters):
        law, string = parameters.well.friction_along, string_of(parameters, depth)
        levers = zip(wall.levers(parameters, string.rubbing_parts), string.inertias, strict=False)
        steepest = np.max(np.broadcast_arrays(*(lever / inertia for lever, inertia in levers)), axis=0)
        greatest = np.maximum(law.static, law.dynamic)
        rates["well.friction_along.smoothing"] = 2 / math.pi * law.smoothing * greatest * steepest
    return rates


def options(parameters: Parameters) -> tuple[str, ...]:
    """The options that add features: an electric motor, or a drive by torque; and a bit on
    the surface that its blades leave."""
    drive = "by_torque" if parameters.drive.by_torque else "motor"
    return (drive, "regenerative") if parameters.bit.rock.regenerative else (drive,)


ORDERS = (
    Order("drillstring.collar.inner_diameter", "drillstring.collar.outer_diameter", True, "lower", WIDEST_BORE),
    Order("drillstring.pipe.inner_diameter", "drillstring.pipe.outer_diameter", True, "lower", WIDEST_BORE),
    Order("segments.kelly.inner_diameter", "segments.kelly.outer_diameter", True, "lower", WIDEST_BORE),
    Order("drillstring.collar.outer_diameter", "well.diameter", unless=has_sections),
    Order("drillstring.pipe.outer_diameter", "well.diameter", unless=has_sections),
    Order("drillstring.collar.length", "operation.depth", words="the length of the collars", unless=has_sections),
    Order("well.friction_along.dynamic", "well.friction_along.static", True, "lower"),
    TORQUE_ORDER,
)
# N. The rock's damping is given under the weight on bit, so it needs a load to refer
# to; a bit off bottom has none.
LEAST_LOAD = 1e3


def _load(check: Any) -> Iterator[Fault]:
    """The weight on bit is large enough to refer the rock's damping to it, or none."""
    key = "operation.wob"
    if check.value("bit.rock.law") != "lobed" or check.ends("segments.rock_damping")[1] == 0.0:
        return
    least, greatest = check.ends(key)
    if least < LEAST_LOAD and greatest > 0.0:
        found = f"{check.text(key, 0)}, and segments.rock_damping is the damping under the weight on bit"
        allowed = "at least 1 kN, 0 kN for a bit off bottom, or segments.rock_damping: 0 N*s/m"
        yield check.fault(check.swept(key), found, allowed)


def _gains(check: Any) -> Iterator[Fault]:
    """There are five gains, and a time of switching on only with them."""
    if check.value("drive.kind") != "dc_motor":
        return
    gains, key = check.value("drive.gains"), "drive.on_at"
    if gains is not None and len(gains) != 5:
        yield check.fault("drive.gains", f"{len(gains)} of them", "five: K_I, K_1, K_2, K_3, K_4, or null")
    if gains is None and (check.axis(key) or check.value(key) != check.leaves[key].default):
        found = "a time without drive.gains, which would begin then"
        yield check.idle(check.fault(check.swept(key), found, "drive.gains, or no time"))


def _torque(check: Any) -> Iterator[Fault]:
    """A drive by torque is on from the beginning of a sweep that carries the state."""
    carried = check.resolved["sweep"].get("procedure", "same") != "same"
    if carried and goes_by_torque(check.value("drive.kind")) and check.value("drive.on_at") > 0.0:
        found = f"{check.text('drive.on_at')} with a sweep that carries the state, in which the drive is on"
        yield check.fault("drive.on_at", found, "0 s, or sweep.procedure: same")


def _survey(check: Any) -> Iterator[Fault]:
    """The stations of the survey go down."""
    key = "well.survey"
    depths = [station["depth"] for station in check.resolved["well"]["survey"]]
    for number, (above, below) in enumerate(pairwise(depths), 1):
        if not below > above:
            found = f"the depth {below:g} m of station {number + 1} after {above:g} m"
            yield check.fault(key, found, "stations whose depths ascend", ("well", "survey", number, "depth"))
            return


def _friction(check: Any) -> Iterator[Fault]:
    """No value and no axis that the friction of the bit does not read."""
    if check.value("bit.rock.law") == "regenerative":
        return
    if not is_measured(check, STATIC):
        for name in ("smoothing", "decay"):
            allowed = "static and dynamic friction as torques beside it, or left out"
            yield from check.unread(f"bit.friction.{name}", "which only friction as torques reads", allowed)
        return
    allowed = "what friction as torques reads: static, dynamic, smoothing, decay"
    for key in (f"bit.friction.{item.name}" for item in fields(HumpedFriction)):
        yield from check.unread(key, "which friction as torques does not read", allowed)
    for key in check.leaves:
        if key.startswith("bit.cutting.") and check.axis(key):
            yield from check.unread(key, "which friction as torques does not read", allowed)


def _axial_friction(check: Any) -> Iterator[Fault]:
    """Friction along the hole is that of a string that rubs."""
    law, key = "well.friction_along", "well.axial_friction"
    names = [f"{law}.{name}" for name in ("static", "dynamic")]
    if check.value(key) and not any(check.axis(name) or check.value(name) for name in names):
        allowed = f"true beside {law}, or left out"
        yield from check.unread(key, f"which a string without {law} does not read", allowed)


RULES = (
    *WHOLE_STRING,
    *of_the_rock(LOBED),
    of_wear_flats("bit.rock.wear_length", "bit.radius", 3.0),
    Rule(_load, ("bit.rock.law", "operation.wob", "segments.rock_damping")),
    DRIVE,
    Rule(_gains, DRIVE.needs),
    COMPENSATED,
    Rule(_torque, DRIVE.needs),
    Rule(_survey, ("well.survey",)),
    Rule(_friction, ("bit.friction", "bit.rock.law")),
    Rule(_axial_friction, ("well",)),
)


DESCRIPTION = Description(
    name="segments",
    title="A string of segments in the axial and the torsional direction, with mud, hoist and an electric motor",
    parameters=Parameters,
    initial=Initial,
    operation=SegmentsOperation,
    friction_rates=friction_rates,
    meanings={
        "segments": "The division of the string, and what is at its ends",
        "segments.top": "Cable, derrick and travelling block, on which the string hangs",
        "segments.kelly": "The kelly, a rigid body",
        "segments.material_damping": "Damping of a segment over its stiffness",
        "segments.hydraulics": "The flow of the mud and its drag on the string as it moves; null: none",
        "initial.start": "What null stands for below: steady drilling, or a string at rest below a table that turns",
        "well": "The hole",
        "well.friction_along": "Friction of the string along the wall, where the hole is inclined; null: none",
        "bit": "The bit on its lobed surface, or on the surface that its blades leave",
        "bit.cutting": "Cutting torque and rate of penetration, ROP [m/s] = c1 W[N] sqrt(w[rad/s]) + c2",
        "bit.cutting.speed": "The speed in the ROP law: live, that of the bit, or mean, the set speed",
        "bit.friction": "Friction of the bit, mu0 (tanh w + alpha w / (1 + beta w^2) + nu w)",
        "drive": "The drive at the top of the string; each kind reads its own keys",
        "drive.kind": "A motor at constant voltage, with gains or a regulator; a top that keeps "
        "its speed; or a drive "
        "whose torque a controller sets",
        "initial.z": "Bit above its mean cutting surface; null: where it rests under the weight on bit",
        "initial.bit_speed": "Bit speed; null: as start says, the set speed or 0",
    },
    states=states,
    options=options,
    checks="nsdrill.models.segments.checks",
    charts="nsdrill.models.segments.checks",
    states_allowed=are_states,
    responses=("bit_bounce", "stick_slip"),
    labels=known("stick_slip_severity", "bounce_severity", "beyond_validity"),
    features=(
        *known(*TURNING, *CYCLES, *ALONG, *ABOVE),
        feature("current_min", "A", "least current of the motor", "motor", signal="current"),
        feature("current_max", "A", "greatest current of the motor", "motor", signal="current"),
        feature("drive_torque_min", "N m", "least torque of the drive", "by_torque", signal="drive_torque"),
        feature("drive_torque_max", "N m", "greatest torque of the drive", "by_torque", signal="drive_torque"),
        feature("hook_load_change_min", "N", "least hook load, less that of steady drilling", signal="hook_load"),
        feature("hook_load_change_max", "N", "greatest hook load, less that of steady drilling", signal="hook_load"),
        *known(*ON_SURFACE),
    ),
    derived=DRILLED,
    peaks=known("axial_peaks", "bit_speed_peaks"),
    section=(
        *known("section_axial", "section_axial_velocity", "section_twist", "section_bit_speed"),
        at_section("drive_speed", "rad s-1", "speed of the drive"),
        at_section("current", "A", "current of the motor, 0 where the drive goes by torque,", label="Motor current"),
    ),
    own_trace=(
        *known_in_trace("z", "vz", "twist", "bit_speed", "lag"),
        in_trace("drive_speed", "rad s-1", "speed of the drive", label="Drive speed"),
        in_trace("current", "A", "current of the motor; 0 where the drive goes by torque", label="Motor current"),
        *known_in_trace("drive_angle", "bit_force", "bit_torque", "interference", "surface_torque"),
        in_trace("hook_load_change", "N", "hook load less that of steady drilling"),
    ),
    untraced=(*_INNER, *known_in_trace(*surface.names(MOST_STATES))),
    shown=(
        *TURNING[3:],
        *("stick_slip_period", "lift_off_fraction", "turned_back", "bit_force_max", "surface_torque_max"),
        *(one.name for one in DRILLED),
    ),
    compared={**SWING, "lift_off_fraction": None},
    distinguishing=(*TURNING[:2], *TURNING[3:], "lift_off_fraction"),
    orders=ORDERS,
    rules=RULES,
    compiled=("bit.lobes", "bit.rock.blades"),
    example_axis=("segments.material_damping.torsional", "1 ms", "10 ms"),
    example_slice="{twist: {from: -20 rad, to: 0 rad, points: 9}, bit_speed: {from: 0 rad/s, to: 26 rad/s, points: 9}}",
    drawn=drawn_along("z", "bit_speed", "drive_speed", "bit_force", "bit_torque", "current"),
)
