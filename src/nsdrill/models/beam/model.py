"""The elastic collar: several modes in two planes, walls at stations, on a string that
twists and bounces."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nsdrill.models.base import Array, Symmetry, Variant
from nsdrill.models.beam import columns
from nsdrill.models.beam.forces import forces
from nsdrill.models.beam.observed import declaration_of, names_of
from nsdrill.models.beam.options import COMMON, STARTED, Options, options_of, states_of
from nsdrill.models.beam.parameters import Parameters
from nsdrill.models.beam.rhs import PARAMETERS, make_right_hand_side, rows_of
from nsdrill.models.christoforou_yigit import classify, compare, section
from nsdrill.models.christoforou_yigit.ensemble import reach_of_collar, string_and_bit
from nsdrill.models.christoforou_yigit.variables import STATE_NAMES
from nsdrill.models.drilling import drilled
from nsdrill.models.leaves import Values
from nsdrill.models.scalar_model import ScalarModel
from nsdrill.models.starts import in_the_disc, slice_points
from nsdrill.observe.channels import Declaration, Names
from nsdrill.observe.findings import returns_of
from nsdrill.observe.thresholds import Record, Thresholds

if TYPE_CHECKING:
    from nsdrill.abi import Rows


class ElasticCollar(ScalarModel):
    """The variant are the :class:`Options`. States and lane parameters that every
    collar has come first."""

    name = "beam"
    frames: ClassVar = {"twist": "drive_speed"}

    def variant(self, parameters: Parameters) -> Variant:
        return options_of(parameters)

    def apart(self, variant: Variant) -> Variant:
        return Options(*variant)._replace(apart=1)

    def symmetry(self, points: Values) -> Symmetry:
        """The lobes alone tell directions apart."""
        options = options_of(points.parameters)
        names = states_of(options.modes)
        used = (
            np.ndim(points.parameters.bit.surface_amplitude) > 0
            or points.parameters.bit.surface_amplitude != 0.0
        )
        pairs = (
            (names.index(f"{x}_{n}"), names.index(f"{y}_{n}"))
            for n in range(1, options.modes + 1)
            for x, y in (("x", "y"), ("vx", "vy"))
        )
        return Symmetry(options.lobes if used else 0, tuple(range(len(names))), tuple(pairs))

    def names(self, variant: Variant) -> Names:
        return names_of(Options(*variant))

    def declaration(self, variant: Variant) -> Declaration:
        return declaration_of(Options(*variant))

    def rows(
        self,
        variant: Variant,
        observed: int = 0,
        *,
        tangent: bool = False,
        columns: int | None = None,
    ) -> Rows:
        return rows_of(Options(*variant), observed, tangent=tangent, columns=columns)

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        return make_right_hand_side(lanes, Options(*variant))

    def tangent(self, lanes: int, variant: Variant, place: int) -> Any:
        return make_right_hand_side(lanes, Options(*variant), tangent=True)

    def slopes(self, variant: Variant) -> Callable[..., Sequence[float]]:
        """None for one lane: the right-hand side is written for many."""
        raise NotImplementedError

    def columns(self, points: Values, thresholds: Thresholds) -> Mapping[str, Any]:
        return columns.values_of(points, thresholds.stuck_below)

    def state_scales(self, table: Array, variant: Variant) -> Array:
        found = columns.state_scales(self._by_name(table, variant), Options(*variant))
        return np.stack(
            [np.broadcast_to(np.asarray(size, dtype=float), len(table)) for size in found], axis=1
        )

    def natural_scales(self, table: Mapping[str, Array]) -> Sequence[Any]:
        """See :meth:`state_scales`, which know the modes."""
        raise NotImplementedError

    def fastest(self, table: Mapping[str, Array]) -> Array:
        """See :meth:`first_step`, which knows the modes."""
        raise NotImplementedError

    def first_step(self, table: Array, variant: Variant) -> Array:
        return np.asarray(0.01 / columns.fastest(self._by_name(table, variant), Options(*variant)))

    # The start

    def steady(self, points: Values) -> Mapping[str, Any]:
        k = columns.coefficients(points.parameters, *points.operation)
        rest = -np.asarray(points.operation[1]) / (k.k_a + points.parameters.bit.rock_stiffness)
        return {"z": rest, "bit_speed": points.operation[2]}

    def given(self, points: Values, names: Sequence[str]) -> dict[str, Any]:
        steady, initial = self.steady(points), points.initial
        found = {name: getattr(initial, name.removesuffix("_1"), 0.0) for name in names}
        found |= {name: steady[name] for name in steady if found[name] is None}
        if initial.wall_force is not None:  # type: ignore[attr-defined]
            found |= {name: 0.0 for name in ("vx_1", "y_1", "vy_1")} | columns.bent(points)
        return found

    def sliced(self, points: Values, number: Array) -> dict[str, Array]:
        """The start names the states of the first mode without its number."""
        found = slice_points(points.initial, (*STARTED, *COMMON, "drive_angle"), number)
        return {f"{name}_1" if name in STARTED else name: value for name, value in found.items()}

    def drawn(self, points: Values, shape: Array) -> Mapping[str, Any]:
        """As those of the lumped model, the first mode in place of its lateral motion;
        mode n within 1/n^2 of the first in place and of the same speed."""
        parameters, (depth, wob, speed), q = (
            points.parameters,
            points.operation,
            points.initial.spread,
        )
        names = (*self.states(self.variant(parameters)), "drive_angle")
        u = dict(zip(names, shape.T, strict=True))
        k = columns.coefficients(parameters, depth, wob, speed)
        around = (2 * u["z"] - 1, 2 * u["vz"] - 1, u["twist"], 2 * u["bit_speed"] - 1)
        gap, fastest = reach_of_collar(k, speed, q)
        found = {
            **string_and_bit(columns.as_lumped(parameters), k, wob, speed, q, *around),
            "drive_angle": 2 * math.pi * u["drive_angle"],
        }
        for n in range(1, parameters.beam.modes + 1):
            for x, y, reach in ((f"x_{n}", f"y_{n}", gap / n**2), (f"vx_{n}", f"vy_{n}", fastest)):
                place = in_the_disc(np.stack([u[x], u[y]], axis=1))
                found |= {x: reach * place[:, 0], y: reach * place[:, 1]}
        return found

    # What is found

    def derived(self, features: Mapping[str, Array], points: Values) -> dict[str, Array]:
        parameters, (_, wob, speed) = points.parameters, points.operation
        bit_radius = parameters.well.diameter / 2
        return drilled(
            features["surface_torque_mean"], speed, parameters.bit.cutting, wob, bit_radius
        )

    def section(
        self, report: Array, record: Record, table: Array, variant: Variant
    ) -> dict[str, Array]:
        """The section of the lumped model, of the watched place."""
        names = self.names(variant)
        found = returns_of(names, self.declaration(variant), report, record.peaks, record.poincare)
        by_name = self._by_name(table, variant)
        modes = range(1, Options(*variant).modes + 1)
        state = dict(zip((*names.states, "drive_angle"), np.moveaxis(found, -1, 0), strict=True))
        for name in ("x", "vx", "y", "vy"):
            state[name] = sum(
                by_name[f"watched_{n}"][:, None] * state[f"{name}_{n}"] for n in modes
            )
        return section.coordinates(np.stack([state[name] for name in STATE_NAMES], axis=-1))

    def returns(self, section_: Mapping[str, Array]) -> Array:
        return section.in_the_bit_frame(section_)

    def classify(
        self,
        features: Mapping[str, Array],
        status: Array,
        thresholds: Thresholds,
        state_scales: Array,
    ) -> dict[str, Array]:
        return classify.classify(
            features, status, thresholds, state_scales[..., : len(STATE_NAMES) - 1]
        )

    def phase_rate(self, table: Array) -> Array:
        return self._common(table)["drive_speed"]

    def scales(self, table: Array) -> dict[str, Array]:
        common = self._common(table)
        rest = common["wob"] / (common["axial_stiffness"] + common["rock_stiffness"])
        lobe = np.where(common["surface_amplitude"] > 0.0, common["surface_amplitude"], rest)
        return {"gap": common["gap"], "drive_speed": common["drive_speed"], "lobe": lobe}

    def coordinates(
        self, features: Mapping[str, Array], table: Array, variant: Variant
    ) -> tuple[Array, Array]:
        """Those of the lumped model."""
        axial = self.state_scales(table, variant)[:, self.states(variant).index("z")]
        return compare.coordinates(features, self.scales(table), axial)

    def _common(self, table: Array) -> dict[str, Array]:
        """The lane parameters of every collar, by name."""
        return dict(zip(PARAMETERS, table[:, : len(PARAMETERS)].T, strict=True))

    def outputs(
        self, parameters: Parameters, point: Any, state: Mapping[str, Array]
    ) -> dict[str, Array]:
        return forces(parameters, point, state)
