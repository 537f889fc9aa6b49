"""What the equations of the string of segments read and give: the names of states, lane
parameters and auxiliary outputs, and the values of the lane parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from nsdrill.models import on_surface, surface
from nsdrill.models.drive_laws import columns_of_law
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.own_drives import number_of, numbered, rows_of
from nsdrill.models.responses import Thresholds
from nsdrill.models.sections import Section
from nsdrill.models.segments import rock, wall
from nsdrill.models.segments.parameters import Initial, Parameters, SegmentsOperation
from nsdrill.models.segments.string import (
    NEVER,
    Steady,
    String,
    coefficients_along,
    counts_of,
    gains_of,
    law_of,
    steady_of,
    string_of,
)
from nsdrill.models.tree import lane_values, with_values
from nsdrill.observe.channels import Names

# Outputs of the equations for the observer: sine and cosine of the lobes, the
# interference of bit and rock with its rate, the force of the rock.
AUX = ("sine_", "cosine_", "interference_", "closing_", "force_")


class Options(NamedTuple):
    """The numbers of segments of pipe and of collars, whether the drive is one by torque
    in place of the electric motor, whether the string rubs on the wall, whether
    friction is implicit, the numbers of segments of sections as one, whether the friction of
    the bit is given as ``torques``, whether the wall brakes motion along the hole, the
    number of states of the surface that the blades leave, 0 where the rock is lobed, and
    the number of the drive of a script."""

    pipes: int = 10
    collars: int = 10
    by_torque: int = 0
    wall: int = 0
    implicit: int = 0
    sections: int = 0
    torques: int = 0
    axial_friction: int = 0
    surface: int = 0
    drive: int = 0

    @property
    def nodes(self) -> int:
        """The number of the bit's node, counted from the surface, which is 0."""
        return self.pipes + self.collars

    @property
    def tubes(self) -> list[Tube]:
        """The parts of the string from the top."""
        counts = (self.pipes, self.collars) if not self.sections else counts_in(self.sections)
        names = ("pipe", "collar") if not self.sections else tuple(f"section_{k}" for k in range(len(counts)))
        joints = [_joint(*both) for both in pairwise(names)]
        above = [("top_share", "drive_share"), *(lower for _, lower in joints)]
        below = [*(upper for upper, _ in joints), ("bit_share", "bit_inertia_share")]
        tubes, first = [], 0
        for name, count, upper, lower in zip(names, counts, above, below, strict=True):
            tubes.append(Tube(name, first, first + count, (upper[0], lower[0]), (upper[1], lower[1])))
            first += count
        return tubes


class Tube(NamedTuple):
    """A part of the string: its ``name`` among the lane parameters, its first and last
    node, and the names of its shares of the mass and of the inertia of these."""

    name: str
    first: int
    last: int
    shares: tuple[str, str]
    inertia_shares: tuple[str, str]


def _joint(above: str, below: str) -> tuple[tuple[str, str], tuple[str, str]]:
    """The names of the shares of the parts above and below a joint, in its mass and its
    inertia."""
    joint = "joint" if above == "pipe" else f"joint_{below.rpartition('_')[2]}"
    upper, lower = ((f"{joint}_{name}_share", f"{joint}_{name}_inertia_share") for name in (above, below))
    return upper, lower


BASE = 128  # above the number of segments of a section


def as_number(counts: Sequence[int]) -> int:
    """The numbers of segments of all sections as one, an option."""
    return sum(count * BASE**place for place, count in enumerate(counts))


def counts_in(number: int) -> tuple[int, ...]:
    """The inverse of :func:`as_number`."""
    counts = []
    while number:
        number, count = divmod(number, BASE)
        counts.append(count)
    return tuple(counts)


class Nodes(NamedTuple):
    """The names of the states of the nodes, from the surface to the bit."""

    positions: tuple[str, ...]
    velocities: tuple[str, ...]
    angles: tuple[str, ...]
    speeds: tuple[str, ...]


@lru_cache
def nodes_of(last: int) -> Nodes:
    """The names for a string whose bit is the node ``last``."""
    inner = range(1, last)
    return Nodes(
        ("u_0", *(f"u_{node}" for node in inner), "z"),
        ("v_0", *(f"v_{node}" for node in inner), "vz"),
        ("lag", *(f"angle_{node}" for node in inner), "twist"),
        ("drive_speed", *(f"speed_{node}" for node in inner), "bit_speed"),
    )


def states_of(last: int, count: int = 0, drive: int = 0) -> tuple[str, ...]:
    """The names of the states of a string whose bit is the node ``last``: from the
    surface to the bit pairs of position and velocity, then of angle and speed, and those of
    first order, with so many of the surface that blades leave, and those of the ``drive``
    of a script with this number last."""
    nodes = nodes_of(last)
    axial = (name for pair in zip(nodes.positions, nodes.velocities, strict=True) for name in pair)
    rotary = (name for pair in zip(nodes.angles, nodes.speeds, strict=True) for name in pair)
    return (*axial, *rotary, "current", *surface.names(count), *rows_of(drive))


@lru_cache
def parameters_of(kind: str, sections: int = 0, law: str = "lobed") -> tuple[str, ...]:
    """The names of the lane parameters of a string with this kind of drive, of so many
    sections if it has any, on a rock with this law: the :func:`columns` of the default
    string."""
    parameters = with_values(Parameters(), {"drive.kind": kind, "bit.rock.law": law})
    if sections:
        some = tuple(Section(1.0, 0.1, 0.05) for _ in range(sections))
        parameters = with_values(parameters, {"drillstring.sections": some})
    operation = SegmentsOperation()
    points = Values(parameters, Initial(), (operation.depth, operation.wob, operation.rotary_speed))
    return tuple(columns(points, Thresholds()))


@lru_cache
def names_of(options: Options) -> Names:
    """The names of the rows of a string."""
    inner = range(1, options.nodes)
    slopes = (
        "top_acceleration",
        *(f"acceleration_{node}" for node in inner),
        "bit_axial_acceleration",
        "drive_acceleration",
        *(f"angular_acceleration_{node}" for node in inner),
        "bit_acceleration",
        "current_rate",
        *on_surface.rates(options.surface),
        *(numbered(options.drive).slopes if options.drive else ()),
    )
    number = len(options.tubes) if options.sections else 0
    kind, law = "ideal" if options.by_torque else "dc_motor", "regenerative" if options.surface else "lobed"
    parameters = parameters_of(kind, number, law)
    if options.wall:
        parameters += wall.names_of(options.nodes, bool(options.axial_friction))
    if options.torques:
        parameters += rock.OF_TORQUES
    if options.drive:
        parameters += numbered(options.drive).lanes
    states = states_of(options.nodes, options.surface, options.drive)
    return Names(states, slopes, parameters, () if options.surface else AUX)


def columns(points: Values, thresholds: Thresholds, *, implicit: bool = True) -> Mapping[str, Numeric]:
    """The lane parameters by name, numbers or arrays over the points, with what only an
    ``implicit`` stage reads, which takes the longest; those of the drive come last.
    Those of pipe and collars are divided by the mass or the inertia of a whole segment.
    At the ends and at the junction, a share is half such a mass or inertia over that of
    the node."""
    parameters, (depth, wob, speed) = points.parameters, points.operation
    string = string_of(parameters, depth)
    steady, tubes = steady_of(parameters, string, wob, speed), options_of(parameters).tubes
    segments = parameters.segments
    mud = segments.hydraulics
    values: dict[str, Numeric] = {}
    for (name, *_), (part, _) in zip(tubes, string.parts, strict=True):
        annulus, bore = part.annulus / part.mass, part.bore / part.mass
        up, down = mud.flow / part.annulus_area, rock.quotient(mud.flow, part.bore_area)
        values |= {
            f"{name}_axial": part.axial / part.mass,
            f"{name}_torsional": part.torsional / part.inertia,
            f"{name}_drag": part.drag / part.inertia,
            f"{name}_annulus": annulus,
            f"{name}_bore": bore,
            f"{name}_mean": annulus * up * up - bore * down * down,
            f"per_{name}_annulus": 1 / part.annulus_area,
            f"per_{name}_bore": rock.quotient(1.0, part.bore_area),
        }
    drive = _torque(parameters, string) if parameters.drive.by_torque else _motor(parameters, string, steady)
    return {
        **lane_values(parameters),
        # off bottom the bit does not touch the rock
        "rock_stiffness": np.where(np.greater(wob, 0.0), parameters.bit.rock_stiffness, 0.0),
        **values,
        "wob": wob,
        "stuck": thresholds.stuck_below,
        **_shares(tubes, string),
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
        "surface_stiffness": string.first.torsional,
        "steady_torque": steady.table_torque,
        "chain_stiffness": string.axial,
        **_rock(parameters, wob, speed, implicit=implicit),
        **drive,
        **(_wall(parameters, string, wob, speed) if wall.is_used(parameters) else {}),
    }


def _rock(parameters: Parameters, wob: Numeric, speed: Numeric, *, implicit: bool) -> dict[str, Numeric]:
    """The lane parameters of the rock."""
    bit = parameters.bit
    if bit.rock.regenerative:
        values = surface.columns(bit.rock, bit.radius, wob, speed)
        # what a spring in place of the rock has
        as_spring = {"rock_stiffness": values["cutting_force"], "surface_amplitude": 0.0}
        return {"set_speed": speed, **values, **as_spring}
    fall = rock.fall_of_root(parameters, wob) if implicit else 0.0
    return {**rock.columns(parameters, wob, speed), "creep_fall": fall}


def _wall(parameters: Parameters, string: String, wob: Numeric, speed: Numeric) -> dict[str, Numeric]:
    """The lane parameters of friction along the wall: those of the law, and the lever of
    each node over its inertia; those of friction along the hole."""
    levers = wall.levers(parameters, string.rubbing_parts)
    nodes = {f"wall_{node}": lever / string.inertias[node - 1] for node, lever in enumerate(levers, 1)}
    values = {**wall.columns(parameters.well.friction_along), **nodes}
    if not parameters.well.axial_friction:
        return values
    values["penetration_rate"] = rock.penetration_rate(parameters, wob, speed)
    coefficients = coefficients_along(parameters, string, wob, speed)
    radii = wall.radii(parameters, string.lying_parts, string.rubbing_parts)
    for node, (radius, (_, along)) in enumerate(zip(radii, coefficients, strict=True), 1):
        force = string.inertias[node - 1] / (radius * string.masses[node])
        values |= {
            f"wall_per_radius_{node}": 1 / radius,
            f"wall_along_{node}": force,
            f"wall_steady_{node}": force * nodes[f"wall_{node}"] * along,
        }
    return values


def _shares(tubes: list[Tube], string: String) -> dict[str, Numeric]:
    """The shares of the segments in the masses and inertias of the nodes at the ends of
    the parts, those of masses first; that in the inertia of the drive's is the drive's."""
    masses = (string.top_mass, *string.joint_masses, string.bit_mass)
    inertias = (1.0, *string.joint_inertias, string.bit_inertia)
    of_masses: dict[str, Numeric] = {}
    of_inertias: dict[str, Numeric] = {}
    for place, (tube, (part, _)) in enumerate(zip(tubes, string.parts, strict=True)):
        for end in (0, 1):
            of_masses[tube.shares[end]] = part.mass / (2 * masses[place + end])
            of_inertias[tube.inertia_shares[end]] = part.inertia / (2 * inertias[place + end])
    del of_inertias["drive_share"]
    return of_masses | of_inertias


def options_of(parameters: Parameters) -> Options:
    """The options of a string."""
    counts, sections = counts_of(parameters), parameters.drillstring.sections
    number = 0 if sections is None else as_number(counts)
    by_torque, rubs = int(parameters.drive.by_torque), int(wall.is_used(parameters))
    on_surface = parameters.bit.rock.regenerative
    return Options(
        counts[0],
        sum(counts[1:]),
        by_torque,
        rubs,
        sections=number,
        torques=int(parameters.bit.friction.by_torque and not on_surface),
        axial_friction=int(rubs and parameters.well.axial_friction),
        surface=parameters.bit.rock.states if on_surface else 0,
        drive=number_of(parameters.drive.kind),
    )


def _motor(parameters: Parameters, string: String, steady: Steady) -> dict[str, Numeric]:
    """The lane parameters of the electric motor."""
    drive, gains = parameters.drive, gains_of(parameters, string).T
    names = ("gain_current", "gain_lag", "gain_drive_speed", "gain_twist", "gain_bit_speed")
    return {
        "drive_share": string.first.inertia / (2 * string.drive_inertia),
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


def _torque(parameters: Parameters, string: String) -> dict[str, Numeric]:
    """The lane parameters of a drive by torque. An ideal one is never switched on."""
    drive, law = parameters.drive, law_of(parameters, string)
    half = string.first.inertia / 2
    return {
        "drive_share": half / (law.inertia + half),
        "per_drive_inertia": 1.0 / (law.inertia + half),
        **columns_of_law(law, drive.torque_limit),
        "top_drag": string.first.drag / 2,
        "on_at": NEVER if drive.kind == "ideal" else drive.on_at,
        "set_acceleration": 0.0,
    }
