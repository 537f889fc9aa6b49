"""The string of segments as a model. The numbers of segments of pipe and of collars are
compiled in."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import reduce

import numpy as np

from nsdrill.models.base import Array, Model, Variant
from nsdrill.models.leaves import Values
from nsdrill.models.numbers import drilled
from nsdrill.models.operation import Numeric
from nsdrill.models.own_drives import numbered, own_drive, rows_of
from nsdrill.models.responses import Thresholds
from nsdrill.models.segments import columns
from nsdrill.models.segments.columns import Options
from nsdrill.models.segments.equations import equations
from nsdrill.models.segments.observed import DECLARATION, by_torque
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.string import lag_of, steady_of, string_of
from nsdrill.observe.channels import Declaration, Names
from nsdrill.observe.thresholds import Record

# The variables of the section, and the states that they are.
SECTION = {
    "axial": "z",
    "axial_velocity": "vz",
    "twist": "twist",
    "bit_speed": "bit_speed",
    "drive_speed": "drive_speed",
    "current": "current",
}


class Segments(Model[Parameters]):
    """States are pairs of position and velocity from the surface to the bit, then pairs
    of angle and speed, then the motor's current, which stays 0 with a drive by
    torque."""

    name = "segments"
    equations = staticmethod(equations)
    contacts = ("rock",)
    singles = 1
    set_speed = "set_speed"
    options = Options

    def turning(self, variant: Variant) -> tuple[str, ...]:
        """All angles of the string."""
        return columns.nodes_of(Options(*variant).nodes).angles

    def variant(self, parameters: Parameters) -> Variant:
        return columns.options_of(parameters)

    def names(self, variant: Variant) -> Names:
        return columns.names_of(Options(*variant))

    def declaration(self, variant: Variant) -> Declaration:
        options = Options(*variant)
        return by_torque(options.drive) if options.by_torque else DECLARATION

    def first_order(self, variant: Variant) -> int:
        return self.singles + len(rows_of(Options(*variant).drive))

    def pushed(self, variant: Variant) -> tuple[str, ...]:
        options = Options(*variant)
        nodes = columns.nodes_of(options.nodes)
        along = nodes.velocities[1:-1] if options.axial_friction else ()
        return (*along, *nodes.speeds[1:]) if options.wall else ("bit_speed",)

    def columns(self, points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
        return columns.columns(points, thresholds)

    def natural_scales(self, table: Mapping[str, Array], o: Options) -> Sequence[Numeric]:
        """The natural scales are

        - of positions, the rock's penetration under the weight on bit, at least a tenth
          of the lobes;
        - of velocities, that length times the frequency of a segment, at a bit on bottom
          that of the contact;
        - of angles a tenth of a radian, of angular speeds a tenth of the set speed;
        - of the current a tenth of that of steady drilling."""
        length = table["wob"] / (table["chain_stiffness"] + table["rock_stiffness"])
        length = np.maximum(length, np.maximum(0.1 * table["surface_amplitude"], 1e-6))
        speeds = [length * np.sqrt(table[f"{tube.name}_axial"]) for tube in o.tubes]
        contact = table["rock_stiffness"] * table["per_bit_mass"]
        bit = length * np.sqrt(np.where(contact > 0.0, contact, table[f"{o.tubes[-1].name}_axial"]))
        speed = 0.1 * table["set_speed"]
        # a joint has that of the part above it
        counts = [tube.last - tube.first + (place == 0) for place, tube in enumerate(o.tubes)]
        counts[-1] -= 1
        axial = [x for v, count in zip(speeds, counts, strict=True) for x in [length, v] * count] + [length, bit]
        current = 1.0 if o.by_torque else np.maximum(0.1 * table["steady_current"], 1.0)
        own = numbered(o.drive).scales(table, np.maximum(0.1 * table["steady_torque"], 1.0)) if o.drive else []
        return [*axial, *[0.1, speed] * (o.nodes + 1), current, *own]

    def fastest(self, table: Mapping[str, Array], o: Options) -> Array:
        below = [table[f"{tube.name}_axial"] for tube in (o.tubes if o.sections else o.tubes[1:])]
        square = np.maximum(table["rock_stiffness"] * table["per_bit_mass"], 4 * reduce(np.maximum, below))
        return np.sqrt(np.maximum(square, table["set_speed"] ** 2))

    # Starts

    def start_names(self, variant: Variant) -> tuple[str, ...]:
        return "z", "twist", "bit_speed", "drive_angle"

    def steady(self, points: Values[Parameters]) -> Mapping[str, Numeric]:
        depth, wob, speed = points.operation
        steady = steady_of(points.parameters, string_of(points.parameters, depth), wob, speed)
        return {"z": steady.z, "twist": steady.angles[-1], "bit_speed": speed}

    def initial_values(self, points: Values[Parameters], names: Sequence[str]) -> dict[str, Numeric]:
        """A string at rest has neither twist nor bit speed."""
        values = super().initial_values(points, names)
        if points.initial.start == "rest":  # type: ignore[attr-defined]
            values |= {name: 0.0 for name in ("twist", "bit_speed") if getattr(points.initial, name) is None}
        return values

    def drawn(self, points: Values[Parameters], shape: Array) -> Mapping[str, Numeric]:
        """Twists from zero to one and a half times that of steady drilling, bit speeds
        from 0 to twice the set speed, bit positions within the amplitude of the lobes
        of the static one; closer to steady drilling with a smaller spread."""
        q, steady = points.initial.spread, self.steady(points)
        return {
            "z": steady["z"] + q * points.parameters.bit.surface_amplitude * (2 * shape[:, 0] - 1),
            "twist": steady["twist"] * (1 + q * (1.5 * shape[:, 1] - 1)),
            "bit_speed": steady["bit_speed"] * (1 + q * (2 * shape[:, 2] - 1)),
            "drive_angle": 2 * math.pi * shape[:, 3],
        }

    def complete_states(self, points: Values[Parameters], values: Mapping[str, Numeric]) -> Mapping[str, Numeric]:
        """All states from those of the start."""
        depth, wob, speed = points.operation
        parameters = points.parameters
        string = string_of(parameters, depth)
        steady = steady_of(parameters, string, wob, speed)
        lag = 0.0 if points.initial.start == "rest" else lag_of(parameters, string, steady, speed)  # type: ignore[attr-defined]
        states: dict[str, Numeric] = dict.fromkeys(self.states(self.variant(parameters)), 0.0)
        axial_compliance: Numeric = 1 / parameters.segments.top.stiffness
        twist_compliance: Numeric = 0.0
        last = len(string.torsional_stiffnesses)
        for node in range(last + 1):
            u, angle, angular_speed = (
                ("z", "twist", "bit_speed")
                if node == last
                else (f"u_{node}", f"angle_{node}" if node else "lag", f"speed_{node}" if node else "drive_speed")
            )
            # The compliance above the node, as a share of the whole string's.
            share = twist_compliance * string.torsional
            states[u] = values["z"] * axial_compliance * string.axial
            # The twist of steady drilling is added node by node: the part of it that
            # the drag to the wall makes is not proportional to the compliance.
            extra = values["twist"] - steady.angles[-1]
            states[angle] = lag + (steady.angles[node] + extra * share)
            states[angular_speed] = speed + (values["bit_speed"] - speed) * share
            if node < last:
                axial_compliance, twist_compliance = (
                    axial_compliance + 1 / string.axial_stiffnesses[node],
                    twist_compliance + 1 / string.torsional_stiffnesses[node],
                )
        current = 0.0 if parameters.drive.by_torque else steady.current
        drive = own_drive(parameters.drive.kind)
        own = {} if drive is None else drive.start
        return {**states, **values, "twist": lag + values["twist"], "current": current, **own}

    def held(self, parameters: Parameters) -> tuple[str, ...]:
        if not parameters.drive.by_torque:
            return ()
        return ("drive_speed", "current") if parameters.drive.kind == "ideal" else ("current",)

    def undeviated(self, parameters: Parameters) -> tuple[str, ...]:
        """Beside the held states the lag that an ideal drive keeps."""
        held = self.held(parameters)
        return ("lag", *held) if parameters.drive.kind == "ideal" else held

    # What is observed

    def derived(self, features: Mapping[str, Array], points: Values[Parameters]) -> dict[str, Array]:
        bit, (_, wob, _) = points.parameters.bit, points.operation
        return drilled(features["surface_torque_mean"], features["bit_speed_mean"], bit.cutting, wob, bit.radius)

    def section(self, outcome: Array, record: Record, table: Array, variant: Variant) -> dict[str, Array]:
        section = super().section(outcome, record, table, variant)
        # The twist is relative to the drive here: the drive may deviate from the set
        # point, and the twist relative to that would not repeat.
        section["section_twist"] = section["section_twist"] - section["section_lag"]
        return {f"section_{name}": section[f"section_{state}"] for name, state in SECTION.items()}

    def returns(self, section: Mapping[str, Array]) -> Array:
        return np.stack([section[f"section_{name}"] for name in SECTION], axis=-1)

    def seen(self, state_scales: Array) -> Array:
        last = (state_scales.shape[-1] - 5) // 4  # a drive has at most three states of its own
        return state_scales[..., [2 * last, 2 * last + 1, 4 * last + 2, 4 * last + 3, 2 * last + 3, 4 * last + 4]]

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        """Whether neither bit speed nor bit position varies."""
        scales = self.seen(state_scales)
        swings = (features["axial_max"] - features["axial_min"], features["bit_speed_max"] - features["bit_speed_min"])
        return np.asarray((swings[0] <= absolute * scales[..., 0]) & (swings[1] <= absolute * scales[..., 3]))
