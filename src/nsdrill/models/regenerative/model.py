"""The string on a drag bit as a model. The number of states of the surface is compiled
in, and so is whether the drive is ideal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from nsdrill.models import motor, on_surface, surface, top
from nsdrill.models.base import Array, Symmetry
from nsdrill.models.driven import Driven
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.regenerative import columns, drives
from nsdrill.models.regenerative.columns import Options
from nsdrill.models.regenerative.equations import equations
from nsdrill.models.regenerative.observed import declaration_of
from nsdrill.models.regenerative.parameters import Parameters
from nsdrill.models.responses import Thresholds
from nsdrill.observe.channels import Declaration


class Regenerative(Driven[Parameters]):
    """States are position and velocity of the bit, its twist and speed, lag and speed of a
    drive that is not ideal, the coefficients of the surface, and the torque of a motor."""

    name = "regenerative"
    equations = staticmethod(equations)
    contacts = ("rock",)
    options, options_of, names = Options, staticmethod(columns.options_of), staticmethod(columns.names_of)
    columns = staticmethod(drives.values_of)
    widest = Options(driven=1)

    def declaration(self, o: Options) -> Declaration:
        return declaration_of(o.surface, o.driven)

    def symmetry(self, points: Values[Parameters]) -> Symmetry:
        """Nothing depends on the angle of the drive; with a constant hook load nothing
        depends on how deep the bit is."""
        table = self.columns(points, Thresholds())
        motor.check_holds(points.parameters.drive, table)
        held = bool(np.any(np.ravel(table["axial_stiffness"]) != 0.0))
        names = self.names(self.options_of(points.parameters)).states
        return Symmetry(folds=0, free=tuple(k for k, name in enumerate(names) if held or name != "z"))

    def natural_scales(self, table: Mapping[str, Array], o: Options) -> Sequence[Numeric]:
        """Of the bit's position and of the surface the depth of cut of a blade, of its
        velocity the rate of penetration with that depth, of angles a tenth of a radian, of
        their speeds a tenth of the set speed."""
        depth, speed = table["blade_depth"], table["set_speed"]
        rate = depth * table["per_spacing"] * speed
        turning: list[Numeric] = [0.1, 0.1 * speed] * (1 + o.driven)
        return [depth, rate, *turning, *[depth] * o.surface, *top.scales(table, o)]

    def fastest(self, table: Mapping[str, Array], o: Options) -> Array:
        rates = [
            table["cutting_force"] * table["per_mass"],
            table["set_speed"] ** 2,
            surface.fastest(o.surface, table["per_spacing"], table["set_speed"]) ** 2,
            *top.fastest(table, o),
        ]
        return np.asarray(np.sqrt(np.max(np.broadcast_arrays(*rates), axis=0)))

    # The start

    def hanging(self, points: Values[Parameters]) -> float | None:
        """Without weight nothing is cut."""
        return 0.0

    def steady(self, points: Values[Parameters]) -> Mapping[str, Numeric]:
        return {**super().steady(points), "twist": columns.steady_of(points)["twist"]}

    def complete_states(self, points: Values[Parameters], values: Mapping[str, Numeric]) -> Mapping[str, Numeric]:
        """All states from those of the start, with the surface of steady drilling."""
        depth, count = columns.steady_of(points)["depth"], columns.options_of(points.parameters).surface
        return super().complete_states(points, {**surface.steady(depth, count), **values})

    def drawn(self, points: Values[Parameters], shape: Array) -> Mapping[str, Numeric]:
        """Twists from zero to one and a half times that of steady drilling, bit speeds
        from 0 to twice the set speed, positions within a depth of cut of steady drilling
        and velocities within the rate of penetration of it; closer with a smaller
        spread."""
        q, steady, table = points.initial.spread, self.steady(points), self.columns(points, Thresholds())
        depth, speed = table["blade_depth"], points.operation[2]
        return {
            "z": q * depth * (2 * shape[:, 0] - 1),
            "vz": q * depth * table["per_spacing"] * speed * (2 * shape[:, 1] - 1),
            "twist": steady["twist"] * (1 + q * (1.5 * shape[:, 2] - 1)),
            "bit_speed": speed * (1 + q * (2 * shape[:, 3] - 1)),
            "drive_angle": 2 * math.pi * shape[:, 4],
        }

    # What is observed

    def derived(self, features: Mapping[str, Array], points: Values[Parameters]) -> dict[str, Array]:
        """The rate of penetration that the rock allows, and the energy that it takes
        (Teale 1965), infinite where the bit does not advance."""
        bit, (_, wob, speed) = points.parameters.bit, points.operation
        rate = columns.cut_of(bit, wob, speed).rate
        return on_surface.drilled(rate, bit.radius, wob, features, "bit_speed_mean")

    def labels(self, features: Mapping[str, Array], response: Array, thresholds: Thresholds) -> dict[str, Array]:
        """What takes a run beyond the validity of the model."""
        return on_surface.labels(features, thresholds)

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        """Whether neither bit speed nor axial velocity varies."""
        turning = features["bit_speed_max"] - features["bit_speed_min"]
        axial = features["axial_velocity_max"] - features["axial_velocity_min"]
        return np.asarray((turning <= absolute * state_scales[..., 3]) & (axial <= absolute * state_scales[..., 1]))

    def section(self, returns: Mapping[str, Array], table: Mapping[str, Array], o: Options) -> dict[str, Array]:
        return {
            "section_axial": returns["z"],
            "section_axial_velocity": returns["vz"],
            "section_twist": returns["twist"] - returns.get("lag", 0.0),
            "section_bit_speed": returns["bit_speed"],
        }

    def returns(self, section: Mapping[str, Array]) -> Array:
        names = ("section_axial", "section_axial_velocity", "section_twist", "section_bit_speed")
        return np.stack([section[name] for name in names], axis=-1)

    def seen(self, state_scales: Array) -> Array:
        return state_scales[..., :4]
