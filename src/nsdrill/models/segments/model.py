"""The string of segments as a model. The numbers of segments of pipe and of collars are
compiled in."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import reduce

import numpy as np

from nsdrill.errors import InputError
from nsdrill.models import on_surface, surface
from nsdrill.models.base import Array, Model, Symmetry
from nsdrill.models.drive_laws import linear_drive
from nsdrill.models.numbers import drilled
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.own_drives import numbered, own_drive
from nsdrill.models.responses import Thresholds
from nsdrill.models.segments import columns
from nsdrill.models.segments.columns import Options
from nsdrill.models.segments.equations import equations
from nsdrill.models.segments.observed import declaration_of
from nsdrill.models.segments.parameters import Parameters
from nsdrill.models.segments.rock import cut_of
from nsdrill.models.segments.string import lag_of, steady_of, string_of
from nsdrill.observe.channels import Declaration, Names

# The variables of the section, and the states that they are.
SECTION = {
    "axial": "z",
    "axial_velocity": "vz",
    "twist": "twist",
    "bit_speed": "bit_speed",
    "drive_speed": "drive_speed",
    "current": "current",
}
ANGLE = 0.1  # rad, the natural scale of angles


class Segments(Model[Parameters]):
    """States are pairs of position and velocity from the surface to the bit, then pairs
    of angle and speed, then the motor's current, which stays 0 with a drive by
    torque, the coefficients of the surface that the blades leave, and the states of a
    drive of a script."""

    name = "segments"
    equations = staticmethod(equations)
    contacts = ("rock",)
    set_speed = "set_speed"
    options = Options
    widest = Options(surface=2)

    def turning(self, o: Options) -> tuple[str, ...]:
        """All angles of the string."""
        return columns.nodes_of(o.nodes).angles

    def options_of(self, parameters: Parameters) -> Options:
        return columns.options_of(parameters)

    def names(self, o: Options) -> Names:
        return columns.names_of(o)

    def declaration(self, o: Options) -> Declaration:
        return declaration_of(o.by_torque, o.surface, o.drive)

    def symmetry(self, points: Values[Parameters]) -> Symmetry:
        """On the surface that the blades leave nothing depends on the angle of the drive.
        InputError where the equations depend on time, or nothing holds the angle of the
        top; motions on lobes are not followed."""
        o = self.options_of(points.parameters)
        if not o.surface:
            raise NotImplementedError
        drive, table = points.parameters.drive, self.columns(points, Thresholds())
        mud, gains = points.parameters.segments.hydraulics, ("drive_stiffness", "twist_gain")
        if not o.by_torque:
            gains = "gain_lag", "gain_twist"
        pulses = (mud.annulus_factor or mud.bore_factor) and mud.pulsation
        for key, found, allowed in (
            ("segments.hydraulics.pulsation", pulses, "0 m^3/s"),
            ("drive.on_at", drive.on_at, "0 s"),
        ):
            if np.any(np.ravel(found) != 0.0):
                raise InputError(f"{key}: found one that is not zero in a continuation; allowed: {allowed}.")
        linear = linear_drive(drive, {"set_speed": table["set_speed"]}, table)
        holds = any(np.ravel(table[name])[0] != 0.0 for name in gains) if linear is None else linear.holds
        if drive.kind != "ideal" and not holds:
            raise InputError(
                f"drive.kind: found {drive.kind}, a motor or a drive whose angle nothing holds to that of the set "
                "speed, so that no motion repeats in that frame; allowed in a continuation: ideal, or one with an "
                "integral gain. A sweep up and down (sweep.procedure: up-down) takes any drive."
            )
        still = self.undeviated(points.parameters)
        names = self.names(o).states
        return Symmetry(folds=0, free=tuple(k for k, name in enumerate(names) if name not in still))

    def columns(self, points: Values[Parameters], thresholds: Thresholds) -> Mapping[str, Numeric]:
        return columns.columns(points, thresholds)

    def natural_scales(self, table: Mapping[str, Array], o: Options) -> Sequence[Numeric]:
        """The natural scales are

        - of positions, the rock's penetration under the weight on bit, at least a tenth
          of the lobes, and of the surface that the blades leave;
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
        return [*axial, *[ANGLE, speed] * (o.nodes + 1), current, *[length] * o.surface, *own]

    def fastest(self, table: Mapping[str, Array], o: Options) -> Array:
        below = [table[f"{tube.name}_axial"] for tube in (o.tubes if o.sections else o.tubes[1:])]
        square = np.maximum(table["rock_stiffness"] * table["per_bit_mass"], 4 * reduce(np.maximum, below))
        if o.surface:
            square = np.maximum(square, surface.fastest(o.surface, table["per_spacing"], table["set_speed"]) ** 2)
        return np.sqrt(np.maximum(square, table["set_speed"] ** 2))

    # Starts

    def start_names(self, o: Options) -> tuple[str, ...]:
        return "z", "twist", "bit_speed", "drive_angle"

    def steady(self, points: Values[Parameters]) -> Mapping[str, Numeric]:
        depth, wob, speed = points.operation
        steady = steady_of(points.parameters, string_of(points.parameters, depth), wob, speed)
        return {**super().steady(points), "z": steady.z, "twist": steady.angles[-1]}

    def hanging(self, points: Values[Parameters]) -> float | None:
        """Without weight, where there is no rock, unless friction is given as torques, which stay."""
        return None if points.parameters.bit.friction.by_torque else 0.0

    def initial_values(self, points: Values[Parameters], names: Sequence[str]) -> dict[str, Numeric]:
        """A string at rest has neither twist nor bit speed."""
        values = super().initial_values(points, names)
        if points.initial.start == "rest":  # type: ignore[attr-defined]
            values |= {name: 0.0 for name in ("twist", "bit_speed") if getattr(points.initial, name) is None}
        return values

    def drawn(self, points: Values[Parameters], shape: Array) -> Mapping[str, Numeric]:
        """Twists from zero to one and a half times that of steady drilling, bit speeds
        from 0 to twice the set speed, bit positions within the amplitude of the lobes
        of the static one, or within a depth of cut of a blade of steady drilling; closer to
        steady drilling with a smaller spread."""
        q, steady, bit = points.initial.spread, self.steady(points), points.parameters.bit
        reach: Numeric = bit.surface_amplitude
        if bit.rock.regenerative:
            reach = cut_of(points.parameters, *points.operation[1:]).depth
        return {
            "z": steady["z"] + q * reach * (2 * shape[:, 0] - 1),
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
        states: dict[str, Numeric] = dict.fromkeys(self.names(self.options_of(parameters)).states, 0.0)
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
        if parameters.bit.rock.regenerative:
            blade_depth = cut_of(parameters, wob, speed).depth
            states |= surface.steady(blade_depth, self.options_of(parameters).surface)
        if (own := own_drive(parameters.drive.kind)) is not None:
            states |= own.start
        return {**states, **values, "twist": lag + values["twist"], "current": current}

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
        bit, (_, wob, speed) = points.parameters.bit, points.operation
        if bit.rock.regenerative:
            rate = cut_of(points.parameters, wob, speed).rate
            return on_surface.drilled(rate, bit.radius, wob, features, "drive_speed_mean")
        return drilled(features["surface_torque_mean"], features["bit_speed_mean"], bit.cutting, wob, bit.radius)

    def labels(self, features: Mapping[str, Array], response: Array, thresholds: Thresholds) -> dict[str, Array]:
        """On the surface that the blades leave what takes a run beyond the model."""
        return on_surface.labels(features, thresholds)

    def section(self, returns: Mapping[str, Array], table: Mapping[str, Array], o: Options) -> dict[str, Array]:
        # The twist is relative to the drive here: the drive may deviate from the set
        # point, and the twist relative to that would not repeat.
        returns = {**returns, "twist": returns["twist"] - returns["lag"]}
        return {f"section_{name}": returns[state] for name, state in SECTION.items()}

    def returns(self, section: Mapping[str, Array]) -> Array:
        return np.stack([section[f"section_{name}"] for name in SECTION], axis=-1)

    def seen(self, state_scales: Array) -> Array:
        """The current is the first of the states in the places of positions and angles with
        another scale than these; those of the surface and of a drive come after it."""
        flat = state_scales.reshape(-1, state_scales.shape[-1])[:, ::2]
        # NaN where a string lacks a state
        others = np.any((flat != flat[:, :1]) & (flat != ANGLE) & ~np.isnan(flat), axis=0)
        current = 2 * int(np.argmax(others)) if np.any(others) else (state_scales.shape[-1] - 1) // 4 * 4
        half = current // 2
        return state_scales[..., [half - 2, half - 1, current - 2, current - 1, half + 1, current]]

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        """Whether neither bit speed nor bit position varies."""
        scales = self.seen(state_scales)
        swings = (features["axial_max"] - features["axial_min"], features["bit_speed_max"] - features["bit_speed_min"])
        return np.asarray((swings[0] <= absolute * scales[..., 0]) & (swings[1] <= absolute * scales[..., 3]))
