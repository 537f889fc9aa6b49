"""The axial, torsional and lateral oscillator of Christoforou and Yigit: four degrees
of freedom, rock, wall, lobes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import numpy as np

from nsdrill.abi import Rows
from nsdrill.equations.motion import Motion
from nsdrill.errors import InputError
from nsdrill.models.base import Array, Level, Model, Symmetry, Variant
from nsdrill.models.christoforou_yigit import classify, compare, observed, rhs
from nsdrill.models.christoforou_yigit.ensemble import starting_states
from nsdrill.models.christoforou_yigit.forces import forces
from nsdrill.models.christoforou_yigit.options import Options, is_used, options_of
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.drilling import drilled
from nsdrill.models.leaves import Values
from nsdrill.observe.channels import Declaration, Names
from nsdrill.observe.findings import returns_of
from nsdrill.observe.thresholds import Record, Thresholds


class ChristoforouYigit(Model):
    """The main model; a variant is a tuple of :class:`Options`."""

    name = "christoforou_yigit"
    contacts = rhs.SIDES

    def variant(self, parameters: Parameters) -> Variant:
        return options_of(parameters)

    def implicit(self, variant: Variant) -> Variant:
        return Options(*variant)._replace(implicit=1)

    def states(self, variant: Variant) -> tuple[str, ...]:
        return rhs.states_of(Options(*variant))

    def rows(self, variant: Variant, observed: int = 0, *, tangent: bool = False, columns: int | None = None) -> Rows:
        return rhs.rows_of(Options(*variant), observed, tangent=tangent, columns=columns)

    def motion(self, variant: Variant) -> Motion:
        return rhs.motion_of(Options(*variant))

    def turning(self, variant: Variant) -> tuple[str, ...]:
        return ("twist", "lag")[: 1 + Options(*variant).driven]

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        return rhs.make_right_hand_side(lanes, Options(*variant))

    def tangent(self, lanes: int, variant: Variant, place: int) -> Any:
        return rhs.make_tangent(lanes, Options(*variant), place)

    def contact_functions(self, lanes: int, variant: Variant, place: int) -> Any:
        return rhs.make_contacts(lanes, Options(*variant), place)

    def released(self, table: Array, contact: str) -> Array | None:
        if contact != "wall":
            return None
        changed = table.copy()
        changed[:, rhs.PARAMETERS.index("wall_stiffness")] = 0.0
        return changed

    def levels(self, variant: Variant) -> tuple[Level, ...]:
        states = self.states(variant)
        return (Level("bit", states.index("bit_speed"), rhs.PARAMETERS.index("stuck_below")),)

    def symmetry(self, points: Values) -> Symmetry:
        """The lobes repeat after a revolution over their number, the weight of an
        inclined collar after a whole revolution; without either the equations are the
        same at every angle."""
        parameters = points.parameters
        options = options_of(parameters)
        if options.driven:
            gain_name = "regulator_lag" if options.regulated else "drive_stiffness"
            gain = rhs.pack(parameters, *points.operation)[0, rhs.columns_of(options).index(gain_name)]
            if gain == 0.0:
                raise InputError(
                    f"drive.kind: found {parameters.drive.kind}, a motor or a drive whose angle "
                    "nothing holds to that of the set speed, so that no motion repeats in that "
                    "frame; allowed in a continuation: ideal, a drive with an integral gain, or a "
                    "dc_motor whose drive.gains hold the lag (K_1, the second one). A sweep up "
                    "and down (sweep.procedure: up-down) takes any drive."
                )
        smooth = parameters.modes.axial == "frozen" or not is_used(parameters.bit.surface_amplitude)
        folds = 1 if options.weight else 0 if smooth else options.lobes
        constant = {*rhs.frozen_states(parameters), "motor_impulse"}
        names = rhs.states_of(options)
        free = tuple(index for index, name in enumerate(names) if name not in constant)
        return Symmetry(folds, free, ((0, 2), (1, 3)))

    def pack(self, points: Values, thresholds: Thresholds) -> Array:
        return rhs.pack(points.parameters, *points.operation, thresholds.stuck_below)

    def switches(self, parameters: Any) -> float | None:
        on_at: float | None = None if parameters.drive.ideal else parameters.drive.on_at
        return on_at

    def pack_before(self, points: Values, thresholds: Thresholds) -> Array:
        table = self.pack(points, thresholds)
        names = rhs.columns_of(options_of(points.parameters))
        table[:, names.index("per_drive_inertia")] = 0.0  # the top keeps its speed
        return table

    def starts(self, points: Values, number: Array | int) -> Array:
        return starting_states(points.parameters, cast("Initial", points.initial), *points.operation, number)

    def held(self, parameters: Parameters) -> tuple[str, ...]:
        return rhs.frozen_states(parameters)

    def state_scales(self, table: Array, variant: Variant) -> Array:
        return rhs.state_scales(table, Options(*variant))

    def frame_rates(self, table: Array, variant: Variant) -> Array:
        return rhs.frame_rates(table, Options(*variant))

    def phase_rate(self, table: Array) -> Array:
        return rhs.phase_rate(table)

    def first_step(self, table: Array, variant: Variant) -> Array:
        return rhs.first_step(table, Options(*variant))

    widest = Options(driven=1, stabilizer=1, weight=1, implicit=1)

    def names(self, variant: Variant) -> Names:
        return observed.names_of(Options(*variant))

    def declaration(self, variant: Variant) -> Declaration:
        return observed.declaration_of(Options(*variant))

    def section_parts(self, parameters: Parameters, record: Record) -> int:
        return parameters.bit.lobes if record.section == "lobe" else 1

    def derived(self, features: Mapping[str, Array], points: Values) -> dict[str, Array]:
        parameters, (_, wob, speed) = points.parameters, points.operation
        torque, speed = features["surface_torque_mean"], features.get("drive_speed_mean", speed)
        derived = drilled(torque, speed, parameters.bit.cutting, wob, parameters.well.diameter / 2)
        if parameters.modes.torsional == "frozen":  # the torque at the surface is not known
            derived["mechanical_specific_energy"] = np.full(len(derived["mechanical_specific_energy"]), np.nan)
        return derived

    def section(self, outcome: Array, record: Record, table: Array, variant: Variant) -> dict[str, Array]:
        names, declaration = self.names(variant), self.declaration(variant)
        returns = returns_of(names, declaration, outcome, record.peaks, record.poincare)
        own = [*range(len(rhs.STATES)), -1]  # without those of a drive
        return observed.coordinates(returns[..., own])

    def returns(self, section: Mapping[str, Array]) -> Array:
        return observed.in_the_bit_frame(section)

    def classify(
        self, features: Mapping[str, Array], status: Array, thresholds: Thresholds, state_scales: Array
    ) -> dict[str, Array]:
        # of string and bit
        return classify.classify(features, status, thresholds, state_scales[..., : len(rhs.STATES)])

    def responses(self, features: Mapping[str, Array], thresholds: Thresholds) -> Array:
        return classify.responses(features, thresholds)

    def scales(self, table: Array) -> dict[str, Array]:
        return compare.scales(table)

    def coordinates(self, features: Mapping[str, Array], table: Array, variant: Variant) -> tuple[Array, Array]:
        return compare.coordinates(
            features, self.scales(table), self.state_scales(table, variant)[:, rhs.STATES.index("z")]
        )

    def outputs(self, parameters: Parameters, point: Any, state: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
        return forces(parameters, point, state)
