"""A model made from its equations (:mod:`nsdrill.equations.motion`) and a declaration of
what is observed. Everything that a :class:`nsdrill.models.base.Model` needs follows.

The compiler is imported when a model computes, so that the file of a model can hold its
description, too.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nsdrill.errors import InputError
from nsdrill.models.base import Array, Model, Variant
from nsdrill.models.leaves import Values
from nsdrill.models.registry import described
from nsdrill.models.starts import Starts, checked_starts, hypercube, slice_points
from nsdrill.observe.thresholds import Record, Thresholds

if TYPE_CHECKING:
    from nsdrill.abi import Rows
    from nsdrill.equations.motion import Motion


class ScalarModel(Model):
    """States are pairs of position and velocity, then ``singles`` states of first
    order. The lane parameter ``drive_speed`` is the rate of the phase, the angle of the
    drive."""

    singles: ClassVar[int] = 0
    frames: ClassVar[Mapping[str, str]] = {}
    """Position -> lane parameter by which its rate is less than the velocity: a twist
    relative to the drive has {"twist": "drive_speed"}."""

    # What a model declares

    equations: ClassVar[Callable[..., Any]]
    """The equations of motion, as a static method: slopes, and outputs for the observer,
    from ``(t, phase, s, p, o)``."""
    quick: ClassVar[int] = 2
    """For how many slips two tangents of Newton's method are enough in an implicit stage;
    of more of them it goes on until the loads are exact."""

    def options(self, variant: Variant) -> Any:
        """The options ``o`` of the equations: hashable, and all that they are."""
        return variant

    def pushed(self, variant: Variant) -> tuple[str, ...]:
        """The velocities in whose slopes friction acts, where it can be implicit; the
        description then has ``friction_rates``."""
        return ()

    @abstractmethod
    def columns(self, points: Values, thresholds: Thresholds) -> Mapping[str, Any]:
        """The lane parameters by name, numbers or arrays over the points."""

    @abstractmethod
    def natural_scales(self, table: Mapping[str, Array]) -> Sequence[Any]:
        """The natural scale of each state, from the lane parameters by name."""

    @abstractmethod
    def fastest(self, table: Mapping[str, Array]) -> Array:
        """The greatest natural frequency [rad/s], shape (n,): the first step is a
        hundredth of its inverse."""

    @abstractmethod
    def steady(self, points: Values) -> Mapping[str, Any]:
        """The natural values of the states that a start may leave open (None)."""

    def drawn(self, points: Values, shape: Array) -> Mapping[str, Any]:
        """The states of an ensemble's starts, from numbers ``shape`` (n, states + 1)
        that are uniform in [0, 1), in the order of the states with the phase last.
        InputError where the model does not define them."""
        raise InputError(
            f"initial.ensemble: found with the model {self.name}, which does not say from which "
            f"states an ensemble "
            "starts; allowed: initial.slice, or a sweep over the start."
        )

    # What follows from these

    fixed: ClassVar[int] = 0
    """The length of :meth:`variant`; one number more means implicit friction."""

    def implicit(self, variant: Variant) -> Variant:
        return (*variant, 1)

    def initial(self) -> Starts:
        """The default start."""
        start: Starts = described(self.name).initial()
        return start

    def variant(self, parameters: Any) -> Variant:
        return ()

    def states(self, variant: Variant) -> tuple[str, ...]:
        return self.names(variant).states

    def rows(
        self,
        variant: Variant,
        observed: int = 0,
        *,
        tangent: bool = False,
        columns: int | None = None,
    ) -> Rows:
        from nsdrill.abi import Rows

        names = self.names(variant)
        states = len(names.states)
        tangent_states = states if tangent else 0
        width = len(names.parameters) if columns is None else columns
        pushed = self.pushed(variant) if self.is_implicit(variant) else ()
        slopes = self.slope_names(variant)
        return Rows(
            states + tangent_states,
            len(names.aux),
            width,
            observed,
            tangent_states,
            self.singles,
            implicit=sum(1 << slopes.index(name) for name in pushed),
        )

    def is_implicit(self, variant: Variant) -> bool:
        return len(variant) > self.fixed

    def slope_names(self, variant: Variant) -> tuple[str, ...]:
        """The states of which the equations give the slopes: velocities, then those of
        first order."""
        states = self.names(variant).states
        pairs = len(states) - self.singles
        return (*states[1:pairs:2], *states[pairs:])

    def turning(self, variant: Variant) -> tuple[str, ...]:
        return tuple(self.frames)

    def motion(self, variant: Variant) -> Motion:
        """The equations with the names of what they read and give."""
        from nsdrill.equations.motion import Motion

        names = self.names(variant)
        return Motion(
            self.equations,
            self.options(variant),
            names.states,
            names.parameters,
            self.slope_names(variant),
            names.aux,
            self.pushed(variant) if self.is_implicit(variant) else (),
            self.contacts,
            quick=self.quick,
        )

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        return self.motion(variant).right_hand_side(lanes, self.rows(variant))

    def tangent(self, lanes: int, variant: Variant, place: int) -> Any:
        return self.motion(variant).tangent(lanes, self.rows(variant, tangent=True), place)

    def contact_functions(self, lanes: int, variant: Variant, place: int) -> Any:
        """Those of the gaps of ``contacts``."""
        if not self.contacts:
            from nsdrill.compiler.functions import BUFFER, compiled

            @compiled(BUFFER)
            def none(b):  # type: ignore[no-untyped-def]
                pass

            return none
        rows = self.rows(variant, tangent=True)
        return self.motion(variant).contact_functions(lanes, rows, place)

    def pack(self, points: Values, thresholds: Thresholds) -> Array:
        values = self.columns(points, thresholds)
        names = self.names(self.variant(points.parameters)).parameters
        columns = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(values[name], dtype=float)) for name in names)
        )
        return np.stack(columns, axis=1)

    def start_names(self, variant: Variant) -> tuple[str, ...]:
        """The names of the states that a start gives: fields of the study's section, in
        the order in which they are drawn."""
        return (*self.states(variant), "drive_angle")

    def complete_states(self, points: Values, values: Mapping[str, Any]) -> Mapping[str, Any]:
        """All states and the drive's angle by their names, from those of the start."""
        return values

    def starts(self, points: Values, number: Array | int) -> Array:
        variant, initial = self.variant(points.parameters), points.initial
        names = self.start_names(variant)
        values = self.initial_values(points, names)
        number = np.atleast_1d(np.asarray(number))
        if initial.starts:
            checked_starts(initial, number)
        if initial.slice:
            values |= self.sliced(points, number)
        elif initial.starts:
            values |= self.drawn(
                points, hypercube(initial.seed, initial.starts, len(names))[number]
            )
        complete, names = (
            self.complete_states(points, values),
            (*self.states(variant), "drive_angle"),
        )
        columns = [np.atleast_1d(np.asarray(complete[name], dtype=float)) for name in names]
        columns_of_points = np.broadcast_arrays(
            *columns, *(np.atleast_1d(value) for value in points.operation), number
        )
        return np.stack(columns_of_points[: len(names)], axis=1)

    def sliced(self, points: Values, number: Array) -> dict[str, Array]:
        """The two states that the study's slice varies, at the starts of these
        numbers."""
        return slice_points(
            points.initial, self.start_names(self.variant(points.parameters)), number
        )

    def initial_values(self, points: Values, names: Sequence[str]) -> dict[str, Any]:
        """The states of the study's start by these names, with the natural values where
        the study leaves them open."""
        steady, initial = self.steady(points), points.initial
        return {
            name: steady[name] if getattr(initial, name) is None else getattr(initial, name)
            for name in names
        }

    def state_scales(self, table: Array, variant: Variant) -> Array:
        state_scales = (
            np.broadcast_to(scale, len(table))
            for scale in self.natural_scales(self._by_name(table, variant))
        )
        return np.stack([np.asarray(scale, dtype=float) for scale in state_scales], axis=1)

    def frame_rates(self, table: Array, variant: Variant) -> Array:
        names, rows = self.names(variant), self.rows(variant)
        frame_rate = np.zeros((len(table), rows.own_slopes))
        for position, column in self.frames.items():
            frame_rate[:, names.states.index(position) // 2] = -table[
                :, names.parameters.index(column)
            ]
        return frame_rate

    def phase_rate(self, table: Array) -> Array:
        return self._by_name(table, ())["drive_speed"]

    def first_step(self, table: Array, variant: Variant) -> Array:
        return np.asarray(0.01 / self.fastest(self._by_name(table, variant)))

    def _by_name(self, table: Array, variant: Variant) -> dict[str, Array]:
        # Along a ramp the table has more columns than names.
        return dict(zip(self.names(variant).parameters, table.T, strict=False))

    def section(
        self, outcome: Array, record: Record, table: Array, variant: Variant
    ) -> dict[str, Array]:
        from nsdrill.observe.findings import returns_of

        names, declaration = self.names(variant), self.declaration(variant)
        states = returns_of(names, declaration, outcome, record.peaks, record.poincare)
        return {f"section_{name}": states[..., number] for number, name in enumerate(names.states)}

    def returns(self, section: Mapping[str, Array]) -> Array:
        return np.stack([section[f"section_{name}"] for name in self.names(()).states], axis=-1)

    def responses(self, features: Mapping[str, Array], thresholds: Thresholds) -> Array:
        from nsdrill.observe.labels import responses

        return responses(features, thresholds)

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        """Whether no state varies by more than ``absolute`` times its natural scale,
        judged here by the range of the bit speed."""
        if "bit_speed_max" not in features or "bit_speed" not in self.names(()).states:
            raise InputError(
                f"the model {self.name}: found a Poincare section, and no bit speed whose swing "
                f"tells whether the "
                "string stands still; allowed: a function still(features, state_scales, absolute) of the "
                "model."
            )
        scale = state_scales[..., self.names(()).states.index("bit_speed")]
        return np.asarray(features["bit_speed_max"] - features["bit_speed_min"] <= absolute * scale)

    def classify(
        self,
        features: Mapping[str, Array],
        status: Array,
        thresholds: Thresholds,
        state_scales: Array,
    ) -> dict[str, Array]:
        from nsdrill.observe.labels import motions, severities
        from nsdrill.variables import OK

        response = self.responses(features, thresholds)
        settled = features["half_difference"] <= thresholds.settled.tolerance
        labels = {
            "response": response,
            **severities(features, response, thresholds),
            "settled": settled,
        }
        labels = {
            name: np.where(status == OK, value, 0).astype(np.int8) for name, value in labels.items()
        }
        if any(name.startswith("section_") for name in features):
            still, scales = (
                self.still(features, state_scales, thresholds.motion.absolute),
                self.seen(state_scales),
            )
            returns = self.returns(features)
            labels |= motions(
                features, status, labels["settled"], returns, scales, still, thresholds
            )
        return labels

    def scales(self, table: Array) -> dict[str, Array]:
        columns = self._by_name(table, ())
        return {name: columns[name] for name in described(self.name).compared.values() if name}

    def coordinates(
        self, features: Mapping[str, Array], table: Array, variant: Variant
    ) -> tuple[Array, Array]:
        units = self.scales(table)
        compared = [
            features[name] / units[scale][:, None] if scale else features[name]
            for name, scale in described(self.name).compared.items()
        ]
        scaled = np.stack(compared, axis=-1)
        return scaled, scaled
