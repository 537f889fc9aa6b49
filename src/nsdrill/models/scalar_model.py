"""A model written for one trajectory: its slopes as a plain function of time, states
and parameters, and what is observed of it as a declaration. Everything that a
:class:`nsdrill.models.base.Model` needs is made from these.

What compiles is imported when a model computes, so that a file with a model can hold
its description, too.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nsdrill.errors import InputError
from nsdrill.models.base import Array, Model, Ramps, Variant
from nsdrill.models.leaves import Values
from nsdrill.models.registry import described
from nsdrill.models.starts import Starts, checked_starts, hypercube, slice_points
from nsdrill.observe.channels import Declaration, Names
from nsdrill.observe.thresholds import Record, Thresholds

if TYPE_CHECKING:
    from nsdrill.abi import Rows
    from nsdrill.models.scalar_apart import Contact


class ScalarModel(Model):
    """States are pairs of position and velocity in turn, then those of first order
    (``singles``); the names of a pair's position and of the lane parameter that its
    rate has beyond the velocity stand in ``frames``. The lane parameter ``drive_speed``
    is how fast the phase, the angle of the drive, advances."""

    singles: ClassVar[int] = 0
    frames: ClassVar[Mapping[str, str]] = {}
    """Position -> lane parameter that is taken off its rate: a twist counted from the
    drive has {"twist": "drive_speed"}."""
    # What a model says

    @abstractmethod
    def names(self, variant: Variant) -> Names:
        """The names of the states (without the phase), the slopes, the lane parameters
        and auxiliary outputs."""

    @abstractmethod
    def slopes(self, variant: Variant) -> Callable[..., Sequence[float]]:
        """The function ``slopes(t, y, p)`` or ``slopes(t, y, p, phase)`` of
        :func:`nsdrill.scalar.in_lanes`."""

    @abstractmethod
    def declaration(self, variant: Variant) -> Declaration:
        """What is observed."""

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
        InputError of a model that gives no starts of its own."""
        raise InputError(
            f"initial.ensemble: found with the model {self.name}, which does not say from which "
            f"states an ensemble "
            "starts; allowed: initial.slice, or a sweep over the start."
        )

    def deviation(self, variant: Variant) -> Callable[..., Sequence[float]] | None:
        """The function ``deviation(t, y, d, p)`` of :func:`nsdrill.scalar.in_lanes`,
        for a Lyapunov exponent; None for the difference of two slopes."""
        return None

    def contact(self, variant: Variant) -> Contact | None:
        """The friction contact of the model, where it can be integrated implicitly;
        then the description says at what rate it brakes and that nothing hinders."""
        return None

    # What follows

    fixed: ClassVar[int] = 0
    """How many numbers :meth:`variant` has; one more says that friction is apart."""

    def apart(self, variant: Variant) -> Variant:
        return (*variant, 1)

    @property
    def ramps(self) -> Ramps:  # type: ignore[override]
        from nsdrill.models.scalar_ramp import ScalarRamps

        return ScalarRamps(self)

    def initial(self) -> Starts:
        """A start as it is by default."""
        made: Starts = described(self.name).initial()
        return made

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
        apart = self.pushed(variant) if len(variant) > self.fixed else 0
        aux = len(names.aux) + (self.kept_meanwhile(states, apart) if tangent else 0)
        return Rows(
            states + tangent_states, aux, width, observed, tangent_states, self.singles, apart=apart
        )

    def kept_meanwhile(self, states: int, apart: int) -> int:
        """How many rows more the tangent dynamics has, for a right-hand side of lanes
        that is not linearised."""
        return 0

    def pushed(self, variant: Variant) -> int:
        """A bit for the slope in which friction acts."""
        contact = self.contact(variant)
        return (
            0 if contact is None else 1 << self.names(variant).states.index(contact.velocity) // 2
        )

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        from nsdrill.scalar import in_lanes

        if len(variant) > self.fixed:
            return self._apart_in_lanes(lanes, variant, self.rows(variant))
        return in_lanes(self.slopes(variant), lanes, self.rows(variant))

    def _apart_in_lanes(self, lanes: int, variant: Variant, rows: Rows) -> Any:
        from nsdrill.models.scalar_apart import apart_in_lanes

        contact = self.contact(variant)
        assert contact is not None
        return apart_in_lanes(self.slopes(variant), contact, self.names(variant), lanes, rows)

    def tangent(self, lanes: int, variant: Variant, place: int) -> Any:
        from nsdrill.scalar import in_lanes

        rows = self.rows(variant, tangent=True)
        if len(variant) > self.fixed:
            return self._apart_in_lanes(lanes, variant, rows)
        return in_lanes(self.slopes(variant), lanes, rows, self.deviation(variant))

    def contact_functions(self, lanes: int, variant: Variant, place: int) -> Any:
        """Of no contact: the slopes at two states see what changes between them."""
        from numba import types

        from nsdrill.abi import BUFFER, compiled

        @compiled(types.void(BUFFER), lanes, place)
        def none(b):  # type: ignore[no-untyped-def]
            pass

        return none

    def pack(self, points: Values, thresholds: Thresholds) -> Array:
        values = self.columns(points, thresholds)
        names = self.names(self.variant(points.parameters)).parameters
        columns = np.broadcast_arrays(
            *(np.atleast_1d(np.asarray(values[name], dtype=float)) for name in names)
        )
        return np.stack(columns, axis=1)

    def start_names(self, variant: Variant) -> tuple[str, ...]:
        """The names of what a start gives: fields of the study's section, in the order
        in which they are drawn."""
        return (*self.states(variant), "drive_angle")

    def started(self, points: Values, values: Mapping[str, Any]) -> Mapping[str, Any]:
        """All states by their names and the drive's angle, from what a start gives."""
        return values

    def starts(self, points: Values, number: Array | int) -> Array:
        variant, initial = self.variant(points.parameters), points.initial
        names = self.start_names(variant)
        values = self.given(points, names)
        number = np.atleast_1d(np.asarray(number))
        if initial.starts:
            checked_starts(initial, number)
        if initial.slice:
            values |= self.sliced(points, number)
        elif initial.starts:
            values |= self.drawn(
                points, hypercube(initial.seed, initial.starts, len(names))[number]
            )
        full, names = self.started(points, values), (*self.states(variant), "drive_angle")
        columns = [np.atleast_1d(np.asarray(full[name], dtype=float)) for name in names]
        points_of = np.broadcast_arrays(
            *columns, *(np.atleast_1d(value) for value in points.operation), number
        )
        return np.stack(points_of[: len(names)], axis=1)

    def sliced(self, points: Values, number: Array) -> dict[str, Array]:
        """The two states that the study's slice varies, at the starts of these
        numbers."""
        return slice_points(
            points.initial, self.start_names(self.variant(points.parameters)), number
        )

    def given(self, points: Values, names: Sequence[str]) -> dict[str, Any]:
        """The states of the start that the study gives, by these names."""
        steady, initial = self.steady(points), points.initial
        return {
            name: steady[name] if getattr(initial, name) is None else getattr(initial, name)
            for name in names
        }

    def state_scales(self, table: Array, variant: Variant) -> Array:
        state_scales = (
            np.broadcast_to(size, len(table))
            for size in self.natural_scales(self._by_name(table, variant))
        )
        return np.stack([np.asarray(size, dtype=float) for size in state_scales], axis=1)

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
        # along a ramp there are more
        return dict(zip(self.names(variant).parameters, table.T, strict=False))

    @property
    def observed(self) -> int:
        from nsdrill.observe.declared import observed_rows

        return observed_rows(self.declaration(()))

    def observer(
        self, lanes: int, variant: Variant, *, tangent: bool = False, others: int = 0
    ) -> tuple[Any, Any]:
        from nsdrill.observe.declared import make_observer

        rows = self.rows(variant, self.observed + others, tangent=tangent)
        made: tuple[Any, Any] = make_observer(
            lanes, rows, self.names(variant), self.declaration(variant)
        )
        return made

    def store(self, lanes: int, parameters: Any, record: Record, more: int = 0) -> Array:
        from nsdrill.observe.findings import new_store

        variant = self.variant(parameters)
        returns = record.poincare
        return new_store(
            lanes, self.names(variant), self.declaration(variant), record.peaks, returns, more
        )

    def report_width(self, record: Record, variant: Variant) -> int:
        from nsdrill.observe.findings import report_width

        return report_width(
            self.names(variant), self.declaration(variant), record.peaks, record.poincare
        )

    def features(
        self, report: Array, table: Array, observe: float, variant: Variant
    ) -> dict[str, Array]:
        from nsdrill.observe.findings import measured

        state_scales = self.state_scales(table, variant)
        found = measured(
            self.names(variant), self.declaration(variant), report, table, state_scales, observe
        )
        if lacking := [
            one.name
            for one in described(self.name).features
            if one.only is None and one.name not in found
        ]:
            raise InputError(
                f"the model {self.name}: found {', '.join(lacking)} among the features of its "
                f"description; allowed: "
                "what its declaration measures."
            )
        return found

    def peaks(self, report: Array, record: Record) -> dict[str, Array]:
        from nsdrill.observe.findings import peaks_of

        return peaks_of(self.declaration(()), report, record.peaks)

    def section(
        self, report: Array, record: Record, table: Array, variant: Variant
    ) -> dict[str, Array]:
        from nsdrill.observe.findings import returns_of

        names, declaration = self.names(variant), self.declaration(variant)
        found = returns_of(names, declaration, report, record.peaks, record.poincare)
        return {f"section_{name}": found[..., number] for number, name in enumerate(names.states)}

    def returns(self, section: Mapping[str, Array]) -> Array:
        return np.stack([section[f"section_{name}"] for name in self.names(()).states], axis=-1)

    def responses(self, features: Mapping[str, Array], thresholds: Thresholds) -> Array:
        from nsdrill.observe.labels import responses

        return responses(features, thresholds)

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        """Whether no state moves beyond ``absolute`` times its natural scale: by the
        swing of the bit speed, where the model measures it."""
        if "bit_speed_max" not in features or "bit_speed" not in self.names(()).states:
            raise InputError(
                f"the model {self.name}: found a Poincare section, and no bit speed whose swing "
                f"tells whether the "
                "string stands still; allowed: a function still(features, state_scales, absolute) of the "
                "model."
            )
        size = state_scales[..., self.names(()).states.index("bit_speed")]
        return np.asarray(features["bit_speed_max"] - features["bit_speed_min"] <= absolute * size)

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
            still, seen = (
                self.still(features, state_scales, thresholds.motion.absolute),
                self.seen(state_scales),
            )
            returns = self.returns(features)
            labels |= motions(features, status, labels["settled"], returns, seen, still, thresholds)
        return labels

    def scales(self, table: Array) -> dict[str, Array]:
        found = self._by_name(table, ())
        return {name: found[name] for name in described(self.name).compared.values() if name}

    def coordinates(
        self, features: Mapping[str, Array], table: Array, variant: Variant
    ) -> tuple[Array, Array]:
        units = self.scales(table)
        columns = [
            features[name] / units[scale][:, None] if scale else features[name]
            for name, scale in described(self.name).compared.items()
        ]
        apart = np.stack(columns, axis=-1)
        return apart, apart
