"""The elastic collar: several modes in two planes, walls at stations, on a string that twists and bounces."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nsdrill.models.base import Array, Variant
from nsdrill.models.beam import columns
from nsdrill.models.beam.forces import forces
from nsdrill.models.beam.observed import declaration_of, names_of
from nsdrill.models.beam.options import Options, options_of
from nsdrill.models.beam.parameters import Parameters
from nsdrill.models.beam.rhs import PARAMETERS, make_right_hand_side, rows_of
from nsdrill.models.christoforou_yigit import classify, compare, section
from nsdrill.models.christoforou_yigit.variables import STATE_NAMES
from nsdrill.models.leaves import Values
from nsdrill.models.scalar_model import ScalarModel
from nsdrill.observe.channels import Declaration, Names
from nsdrill.observe.findings import returns_of
from nsdrill.observe.thresholds import Record, Thresholds

if TYPE_CHECKING:
    from nsdrill.abi import Rows


class ElasticCollar(ScalarModel):
    """The variant are the :class:`Options`. States and lane parameters that every collar has come first."""

    name = "beam"
    frames: ClassVar = {"twist": "drive_speed"}

    def variant(self, parameters: Parameters) -> Variant:
        return options_of(parameters)

    def names(self, variant: Variant) -> Names:
        return names_of(Options(*variant))

    def declaration(self, variant: Variant) -> Declaration:
        return declaration_of(Options(*variant))

    def rows(self, variant: Variant, observed: int = 0, *, tangent: bool = False, columns: int | None = None) -> Rows:
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

    def sizes(self, table: Array, variant: Variant) -> Array:
        found = columns.sizes(self._by_name(table, variant), Options(*variant))
        return np.stack([np.broadcast_to(np.asarray(size, dtype=float), len(table)) for size in found], axis=1)

    def natural(self, table: Mapping[str, Array]) -> Sequence[Any]:
        """See :meth:`sizes`, which know the modes."""
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
        found = {name: getattr(initial, name, 0.0) for name in names}
        found |= {name: steady[name] for name in steady if found[name] is None}
        if initial.wall_force is not None:  # type: ignore[attr-defined]
            found |= {name: 0.0 for name in ("vx_1", "y_1", "vy_1")} | columns.bent(points)
        return found

    def drawn(self, points: Values, shape: Array) -> Mapping[str, Any]:
        """As those of the lumped model, the first mode in place of its lateral motion; mode n within 1/n^2 of the first
        in place and of the same speed."""
        parameters, (depth, wob, speed), q = points.parameters, points.operation, points.initial.spread
        names = (*self.states(self.variant(parameters)), "drive_angle")
        u = dict(zip(names, shape.T, strict=True))
        k = columns.coefficients(parameters, depth, wob, speed)
        bit, law, arm = parameters.bit, parameters.bit.friction, 2 / 3 * k.bit_radius
        damping = parameters.drillstring.torsional_damping * speed
        running = (law.static - law.dynamic) / (1 + law.decay * speed) + law.dynamic
        static = (wob * (arm * law.static + k.cutting_arm) + damping) / k.k_t
        steady = (wob * (arm * running + k.cutting_arm) + damping) / k.k_t
        rest = wob / (k.k_a + bit.rock_stiffness)
        lobes = bit.lobes * speed * bit.surface_amplitude
        fastest = q * np.maximum(k.gap * np.sqrt(k.k_bend / k.m_l), k.collar_radius * speed)
        found = {
            "z": q * 2 * (rest + bit.surface_amplitude) * (2 * u["z"] - 1) - rest,
            "vz": q * 2 * lobes * (2 * u["vz"] - 1),
            "twist": -((1 - q) * steady + q * 1.5 * static * u["twist"]),
            "bit_speed": speed * (1 + q * (2 * u["bit_speed"] - 1)),
            "drive_angle": 2 * math.pi * u["drive_angle"],
        }
        for n in range(1, parameters.beam.modes + 1):
            for x, y, reach in ((f"x_{n}", f"y_{n}", q * k.gap / n**2), (f"vx_{n}", f"vy_{n}", fastest)):
                along, around = _in_the_disc(u[x], u[y])
                found |= {x: reach * along, y: reach * around}
        return found

    # What is found

    def section(self, report: Array, record: Record, table: Array, variant: Variant) -> dict[str, Array]:
        """The section of the lumped model, of the watched place."""
        names = self.names(variant)
        found = returns_of(names, self.declaration(variant), report, record.peaks, record.poincare)
        by_name = self._by_name(table, variant)
        modes = range(1, Options(*variant).modes + 1)
        state = dict(zip((*names.states, "drive_angle"), np.moveaxis(found, -1, 0), strict=True))
        for name in ("x", "vx", "y", "vy"):
            state[name] = sum(by_name[f"watched_{n}"][:, None] * state[f"{name}_{n}"] for n in modes)
        return section.coordinates(np.stack([state[name] for name in STATE_NAMES], axis=-1))

    def returns(self, section_: Mapping[str, Array]) -> Array:
        return section.in_the_bit_frame(section_)

    def classify(
        self, features: Mapping[str, Array], status: Array, thresholds: Thresholds, sizes: Array
    ) -> dict[str, Array]:
        return classify.classify(features, status, thresholds, sizes[..., : len(STATE_NAMES) - 1])

    def phase_rate(self, table: Array) -> Array:
        return self._common(table)["drive_speed"]

    def scales(self, table: Array) -> dict[str, Array]:
        common = self._common(table)
        rest = common["wob"] / (common["axial_stiffness"] + common["rock_stiffness"])
        lobe = np.where(common["surface_amplitude"] > 0.0, common["surface_amplitude"], rest)
        return {"gap": common["gap"], "drive_speed": common["drive_speed"], "lobe": lobe}

    def coordinates(self, features: Mapping[str, Array], table: Array, variant: Variant) -> tuple[Array, Array]:
        """Those of the lumped model."""
        scale = self.scales(table)
        axial = self.sizes(table, variant)[:, self.states(variant).index("z"), None]
        speed, gap = scale["drive_speed"][:, None], scale["gap"][:, None]
        apart = compare.scaled(features, speed, gap)
        return apart, np.concatenate([apart * compare.WEIGHTS, compare.extent(features, speed, gap, axial)], axis=-1)

    def _common(self, table: Array) -> dict[str, Array]:
        """The lane parameters of every collar, by name."""
        return dict(zip(PARAMETERS, table[:, : len(PARAMETERS)].T, strict=True))

    def outputs(self, parameters: Parameters, point: Any, state: Mapping[str, Array]) -> dict[str, Array]:
        return forces(parameters, point, state)


def _in_the_disc(a: Array, b: Array) -> tuple[Array, Array]:
    """Points of the unit disc from numbers in [0, 1), one by one: numpy's own functions depend on the processor."""
    pairs = [
        (math.sqrt(p) * math.cos(2 * math.pi * q), math.sqrt(p) * math.sin(2 * math.pi * q))
        for p, q in zip(a.tolist(), b.tolist(), strict=True)
    ]
    along, around = np.array(pairs).reshape(-1, 2).T
    return along, around
