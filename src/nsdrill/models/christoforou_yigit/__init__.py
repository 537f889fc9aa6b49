"""The axial, torsional and lateral oscillator of Christoforou and Yigit: four degrees of freedom, rock, wall, lobes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.model import ramp, rhs, tangent
from nsdrill.model.ensemble import starting_states
from nsdrill.model.forces import forces
from nsdrill.model.leaves import Values
from nsdrill.model.parameters import Parameters
from nsdrill.model.schedule import Schedule
from nsdrill.models.base import Array, Model, Ramps, Variant
from nsdrill.observe import classify, compare, features, layout, motion, reduce, section
from nsdrill.observe.thresholds import Record, Thresholds
from nsdrill.variables import PEAKS


class Ramped(Ramps):
    """The drive that moves: see :mod:`nsdrill.model.ramp`."""

    columns = ramp.RAMPED

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        hertz, lobes = variant
        return ramp.make_ramped(lanes, bool(hertz), lobes)

    def pack(self, parameters: Parameters, schedule: Schedule, cuts: Array, thresholds: Thresholds) -> Array:
        return ramp.pack_ramp(parameters, schedule, cuts, thresholds.stuck_below)

    def mend(self, samples: Array, table: Array, cuts: Array, time: Array) -> None:
        samples[:, rhs.STATES.index("twist")] -= ramp.ahead(table, cuts, time)


class ChristoforouYigit(Model):
    """The variant is (Hertz wall or not, number of lobes)."""

    name = "christoforou_yigit"
    states, aux, columns = rhs.STATES, rhs.AUX, rhs.PARAMETERS
    contacts = tangent.CONTACTS
    has_tangent = True
    ramps = Ramped()

    def variant(self, parameters: Parameters) -> Variant:
        return int(parameters.well.law == "hertz"), parameters.bit.lobes

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        hertz, lobes = variant
        return rhs.make_right_hand_side(lanes, bool(hertz), lobes)

    def tangent(self, lanes: int, variant: Variant, place: int) -> Any:
        hertz, lobes = variant
        return tangent.make_tangent(lanes, bool(hertz), lobes, place)

    def contact_functions(self, lanes: int, variant: Variant, place: int) -> Any:
        return tangent.make_contacts(lanes, variant[1], place)

    def pack(self, points: Values, thresholds: Thresholds) -> Array:
        return rhs.pack(points.parameters, *points.operation, thresholds.stuck_below)

    def starts(self, points: Values, number: Array | int) -> Array:
        return starting_states(points.parameters, points.initial, *points.operation, number)

    def sizes(self, table: Array) -> Array:
        return rhs.sizes(table)

    def drifts(self, table: Array) -> Array:
        return rhs.drifts(table)

    def phase_rate(self, table: Array) -> Array:
        return rhs.phase_rate(table)

    def first_step(self, table: Array) -> Array:
        return rhs.first_step(table)

    @property
    def observed(self) -> int:
        return len(layout.OBSERVED)

    def observer(self, lanes: int, variant: Variant, *, tangent: bool = False, others: int = 0) -> tuple[Any, Any]:
        made: tuple[Any, Any] = features.make_observer(lanes, variant[1], len(self.states) if tangent else 0, others)
        return made

    def store(self, lanes: int, parameters: Parameters, record: Record, more: int = 0) -> Array:
        spacing = section.REVOLUTION / (parameters.bit.lobes if record.section == "lobe" else 1)
        return layout.new_store(lanes, record.peaks, record.poincare, spacing, more)

    def report_width(self, record: Record) -> int:
        return layout.report_width(record.peaks, record.poincare)

    def features(self, report: Array, table: Array, observe: float, variant: Variant) -> dict[str, Array]:
        return reduce.features(report, table, observe, bool(variant[0]))

    def peaks(self, report: Array, record: Record) -> dict[str, Array]:
        heights = reduce.peaks(report, record.peaks)
        return {name: heights[:, i] for i, name in enumerate(PEAKS)}

    def section(self, report: Array, record: Record) -> dict[str, Array]:
        return section.coordinates(reduce.section(report, record.peaks, record.poincare))

    def returns(self, section: Mapping[str, Array]) -> Array:
        return motion.in_the_bit_frame(section)

    def classify(
        self, features: Mapping[str, Array], status: Array, thresholds: Thresholds, sizes: Array
    ) -> dict[str, Array]:
        return classify.classify(features, status, thresholds, sizes)

    def scales(self, table: Array) -> dict[str, Array]:
        return compare.scales(table)

    def outputs(self, parameters: Parameters, point: Any, state: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        return forces(parameters, point, state)
