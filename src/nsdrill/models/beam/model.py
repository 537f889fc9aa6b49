"""The elastic collar: several modes in two planes, walls at stations, on a string that
twists and bounces."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from nsdrill.models import motor, top
from nsdrill.models.base import Array, Symmetry
from nsdrill.models.beam.columns import (
    COMMON,
    FIRST_MODE,
    Options,
    as_lumped,
    bent_against_wall,
    coefficients,
    names_of,
    options_of,
    shape,
    states_below,
    watched,
)
from nsdrill.models.beam.drives import values_of
from nsdrill.models.beam.equations import equations
from nsdrill.models.beam.observed import declaration_of
from nsdrill.models.beam.parameters import Parameters
from nsdrill.models.christoforou_yigit.collar import (
    CollarInHole,
    hanging,
    reach_of_collar,
    resting_height,
    string_and_bit,
)
from nsdrill.models.christoforou_yigit.columns import STATE_NAMES, axial_scale, is_used
from nsdrill.models.christoforou_yigit.observed import coordinates
from nsdrill.models.operation import Numeric, Values
from nsdrill.models.responses import Thresholds
from nsdrill.models.starts import in_the_disc, slice_points

State = Mapping[str, Array]


def at_place(parameters: Parameters, state: State, place: Numeric) -> dict[str, Array]:
    """x, vx, y, vy [m, m/s] of the collar at a fraction of its span."""
    modes = range(1, parameters.beam.modes + 1)
    return {
        name: np.asarray(sum(shape(place, n) * state[f"{name}_{n}"] for n in modes)) for name in ("x", "vx", "y", "vy")
    }


class ElasticCollar(CollarInHole[Parameters]):
    """The states and lane parameters that every collar has come first."""

    name = "beam"
    equations = staticmethod(equations)
    options, options_of, names = Options, staticmethod(options_of), staticmethod(names_of)
    declaration, columns = staticmethod(declaration_of), staticmethod(values_of)
    widest = Options(driven=1)
    quick: ClassVar = 1  # steps are long: with two tangents 0.06 % of a wall's load were left

    def symmetry(self, points: Values[Parameters]) -> Symmetry:
        """The equations depend on the direction only through the lobes."""
        options = options_of(points.parameters)
        names = self.names(options).states
        motor.check_holds(points.parameters.drive, self.columns(points, Thresholds()))
        pairs = (
            (names.index(f"{x}_{n}"), names.index(f"{y}_{n}"))
            for n in range(1, options.modes + 1)
            for x, y in (("x", "y"), ("vx", "vy"))
        )
        return Symmetry(
            options.lobes if is_used(points.parameters.bit.surface_amplitude) else 0,
            tuple(range(len(names))),
            tuple(pairs),
        )

    def natural_scales(self, table: Mapping[str, Array], o: Options) -> Sequence[Numeric]:
        """The natural scale of each state: of a mode a tenth of the gap, and that times its
        frequency without load; the others as in the lumped model, lag and speed of a drive
        as twist and bit speed."""
        lateral = 0.1 * table["gap"]
        frequency = np.sqrt(table["bending"] * table["per_lateral_mass"])
        contact = table["axial_stiffness"] + table["rock_stiffness"]
        axial = axial_scale(table)
        turning: list[Numeric] = [0.1, 0.1 * table["set_speed"]]
        common = [axial, axial * np.sqrt(contact * table["per_axial_mass"]), *turning]
        modes = [[lateral, lateral * n**2 * frequency] * 2 for n in range(1, o.modes + 1)]
        higher = (scale for mode in modes[1:] for scale in mode)
        return [*modes[0], *common, *higher, *turning * o.driven, *top.scales(table, o)]

    def fastest(self, table: Mapping[str, Array], o: Options) -> Array:
        """The greatest natural frequency [rad/s]: of a mode, of the first one on the wall,
        of the bit on the rock, and the rates of a drive."""
        per_mass = table["per_lateral_mass"]
        wall = np.max([table[f"wall_stiffness_{j}"] for j in range(1, o.stations + 1)], axis=0)
        square = np.maximum(o.modes**4 * table["bending"] * per_mass, wall * per_mass)
        contact = (table["axial_stiffness"] + table["rock_stiffness"]) * table["per_axial_mass"]
        rates = [np.maximum(np.maximum(square, contact), table["set_speed"] ** 2), *top.fastest(table, o)]
        return np.asarray(np.sqrt(np.max(np.broadcast_arrays(*rates), axis=0)))

    # The start

    def start_names(self, o: Options) -> tuple[str, ...]:
        return (*states_below(o.modes), "drive_angle")

    def steady(self, points: Values[Parameters]) -> Mapping[str, Numeric]:
        k = coefficients(points.parameters, *points.operation)
        rest = resting_height(points.operation[1], k.k_a, points.parameters.bit.rock_stiffness)
        return {**super().steady(points), "z": rest}

    def hanging(self, points: Values[Parameters]) -> float | None:
        k = coefficients(points.parameters, *points.operation)
        return hanging(as_lumped(points.parameters), k.k_a)

    def initial_values(self, points: Values[Parameters], names: Sequence[str]) -> dict[str, Numeric]:
        steady, initial = self.steady(points), points.initial
        values = {name: getattr(initial, name.removesuffix("_1"), 0.0) for name in names}
        values |= {name: steady[name] for name, value in values.items() if value is None}
        if initial.wall_force is not None:  # type: ignore[attr-defined]
            values |= {name: 0.0 for name in ("vx_1", "y_1", "vy_1")} | bent_against_wall(points)
        return values

    def sliced(self, points: Values[Parameters], number: Array) -> dict[str, Array]:
        """In the study's start, the states of the first mode have no number."""
        values = slice_points(points.initial, (*FIRST_MODE, *COMMON, "drive_angle"), number)
        return {f"{name}_1" if name in FIRST_MODE else name: value for name, value in values.items()}

    def drawn(self, points: Values[Parameters], shape: Array) -> Mapping[str, Numeric]:
        """The starts of the lumped model, with the first mode for its lateral motion;
        mode n has positions within 1/n^2 of those of the first, and the same
        speeds."""
        parameters, (depth, wob, speed), q = (points.parameters, points.operation, points.initial.spread)
        names = (*states_below(parameters.beam.modes), "drive_angle")
        u = dict(zip(names, shape.T, strict=True))
        k = coefficients(parameters, depth, wob, speed)
        around = (2 * u["z"] - 1, 2 * u["vz"] - 1, u["twist"], 2 * u["bit_speed"] - 1)
        gap, fastest = reach_of_collar(k, speed, q)
        states = {
            **string_and_bit(as_lumped(parameters), k, wob, speed, q, *around),
            "drive_angle": 2 * math.pi * u["drive_angle"],
        }
        for n in range(1, parameters.beam.modes + 1):
            for x, y, reach in ((f"x_{n}", f"y_{n}", gap / n**2), (f"vx_{n}", f"vy_{n}", fastest)):
                place = in_the_disc(np.stack([u[x], u[y]], axis=1))
                states |= {x: reach * place[:, 0], y: reach * place[:, 1]}
        return states

    # Results

    def section(self, returns: Mapping[str, Array], table: Mapping[str, Array], o: Options) -> dict[str, Array]:
        """The section of the lumped model, at the watched place."""
        state, modes = dict(returns), range(1, o.modes + 1)
        for name in ("x", "vx", "y", "vy"):
            state[name] = np.asarray(sum(table[f"watched_{n}"][:, None] * state[f"{name}_{n}"] for n in modes))
        return coordinates(np.stack([state[name] for name in STATE_NAMES], axis=-1))

    def outputs(self, points: Values[Parameters], state: State) -> dict[str, Array]:
        motion = at_place(points.parameters, state, watched(points.parameters.beam))
        return {**motion, **super().outputs(points, {**state, **motion})}
