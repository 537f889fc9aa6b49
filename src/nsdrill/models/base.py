"""What a model of a drill string is to the rest of the package.

A model is stateless: what differs from run to run is in arrays over the points, and
what is fixed when code is compiled is in its *variant*. The sweep, the simulation and
the results use this interface alone: the names of states, parameters and contacts stay
inside the model's own folder.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple

import numpy as np

from nsdrill.abi import Rows
from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Node
from nsdrill.equations.motion import Motion
from nsdrill.errors import InputError
from nsdrill.models.leaves import P, Values
from nsdrill.models.operation import History, Numeric
from nsdrill.models.ramp import Ramps
from nsdrill.models.registry import described, measuring, own_features
from nsdrill.models.responses import Thresholds, label_type, present, severities
from nsdrill.models.starts import Starts, hypercube, slice_points
from nsdrill.observe.channels import HALF_DIFFERENCE, Declaration, Names
from nsdrill.observe.declared import make_observer, observed_rows
from nsdrill.observe.findings import measured, new_store, outcome_width, peaks_of, returns_of
from nsdrill.observe.motion import motions
from nsdrill.observe.thresholds import Record
from nsdrill.variables import OK

if TYPE_CHECKING:
    from nsdrill.kernel.batch import Runs

Variant = tuple[int, ...]
LEAST_VELOCITY, SMALL_VELOCITY = 1e-15, 1e-6  # of a law that is smooth the first is nothing beside the second


@dataclass(frozen=True)
class Symmetry:
    """The rotational symmetry of the equations of a model, for the continuation of
    motions.

    The equations are unchanged when the angle of the drive grows by a revolution over
    ``folds`` and the pairs of states ``turned`` are rotated by the same angle; with
    ``folds`` 0, by any angle. ``free`` are the indices of the states that move and that
    the equations depend on; ``turned`` holds pairs of indices (of x, of y).
    """

    folds: int
    free: tuple[int, ...]
    turned: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Level:
    """A threshold below which a velocity may fall, with the ``name`` of what moves with
    it (a bit that sticks): the indices of the ``velocity`` among the states and of the
    ``parameter`` among the lane parameters. The equations are smooth there."""

    name: str
    velocity: int
    parameter: int


class Plain(NamedTuple):
    """What is compiled in of a model without options of its own."""

    implicit: int = 0


class Model(Generic[P]):
    """A model made from its equations (:mod:`nsdrill.equations.motion`) and a declaration
    of what is observed; everything else follows, and may be replaced.

    States are pairs of position and velocity, then states of first order (:meth:`first_order`);
    arrays are in SI, over n points. The compiler is imported when a model computes, so
    that the file of a model can hold its description, too.
    """

    name: ClassVar[str]
    contacts: ClassVar[tuple[str, ...]] = ()
    """Names of the contacts at which the Jacobian jumps; each has a function that is
    positive while the contact is closed."""

    singles: ClassVar[int] = 0
    """How many states of first order follow the pairs, in all variants."""
    set_speed: ClassVar[str] = "drive_speed"
    """The lane parameter that is the speed of the drive, the rate of its angle."""
    sticking: ClassVar[str] = ""
    """The lane parameter that is the bit speed below which the bit counts as stuck, where
    continuation is to find the threshold."""
    relative: ClassVar[tuple[str, ...]] = ()
    """The positions that are measured from the angle of the drive, as a twist is: their
    rates are less than the velocities by the set speed."""
    options: ClassVar[Callable[..., Any]] = Plain
    """A NamedTuple of whole numbers, all with defaults, which are compiled in and which
    the equations read as ``o``; the last one is ``implicit``, whether friction is. A
    variant is one of these or a tuple that begins like it."""
    equations: ClassVar[Callable[..., Any]]
    """The equations of motion, as a static method: slopes, and outputs for the observer,
    from ``(t, phase, s, p, o)``."""
    quick: ClassVar[int] = 2
    """For how many slips two tangents of Newton's method are enough in an implicit stage;
    of more of them it goes on until the loads are exact."""
    rubbing: ClassVar[tuple[str, ...]] = ()
    """The :meth:`pushed` of a model in all variants."""
    rows_named: ClassVar[Names]
    declared: ClassVar[Declaration]
    """The :meth:`names` and the :meth:`declaration` of a model that has one variant."""
    solved: ClassVar[Any] = None
    """Further outputs for the observer where friction is solved for
    (:mod:`nsdrill.equations.stage`), as a static method."""

    # What a model declares, besides names, declaration and outputs

    def pushed(self, variant: Variant) -> tuple[str, ...]:
        """The velocities in whose slopes friction acts, where it can be implicit; the
        description then has ``friction_rates``."""
        return self.rubbing

    def columns(self, points: Values[P], thresholds: Thresholds) -> Mapping[str, Numeric]:
        """The lane parameters by name, numbers or arrays over the points."""
        raise NotImplementedError

    def natural_scales(self, table: Mapping[str, Array], o: Any) -> Sequence[Numeric]:
        """The natural scale of each state, from the lane parameters by name, with these
        options; by default those of a string that only turns, a tenth of a radian and a
        tenth of the set speed."""
        return 0.1, 0.1 * table[self.set_speed]

    def fastest(self, table: Mapping[str, Array], o: Any) -> Array:
        """The greatest natural frequency [rad/s], shape (n,): the first step is a
        hundredth of its inverse."""
        raise NotImplementedError

    def steady(self, points: Values[P]) -> Mapping[str, Numeric]:
        """The natural values of the states that a start may leave open (None); by
        default the set speed for the bit."""
        values = dict(zip(points.parameters.point.names(), points.operation, strict=True))
        return {"bit_speed": values["rotary_speed"]} if "rotary_speed" in values else {}

    def drawn(self, points: Values[P], shape: Array) -> Mapping[str, Numeric]:
        """The states of an ensemble's starts, from numbers ``shape`` (n, states + 1)
        that are uniform in [0, 1), in the order of the states with the phase last.
        InputError where the model does not define them."""
        raise InputError(
            f"initial.ensemble: found with the model {self.name}, which does not say from which states an ensemble "
            "starts; allowed: initial.slice, or a sweep over the start."
        )

    # What follows from it

    def initial(self) -> Starts:
        """The default start."""
        start: Starts = described(self.name).initial()
        return start

    def is_implicit(self, variant: Variant) -> bool:
        return bool(self.options(*variant).implicit)

    def first_order(self, variant: Variant) -> int:
        """How many states of first order follow the pairs."""
        return self.singles

    def slope_names(self, variant: Variant) -> tuple[str, ...]:
        """The states of which the equations give the slopes: velocities, then those of
        first order."""
        states = self.names(variant).states
        pairs = len(states) - self.first_order(variant)
        return (*states[1:pairs:2], *states[pairs:])

    def start_names(self, variant: Variant) -> tuple[str, ...]:
        """The names of the states that a start gives: fields of the study's section, in
        the order in which they are drawn."""
        return (*self.states(variant), "drive_angle")

    def complete_states(self, points: Values[P], values: Mapping[str, Numeric]) -> Mapping[str, Numeric]:
        """All states and the drive's angle by their names, from those of the start."""
        return values

    def sliced(self, points: Values[P], number: Array) -> dict[str, Array]:
        """The two states that the study's slice varies, at the starts of these
        numbers."""
        return slice_points(points.initial, self.start_names(self.variant(points.parameters)), number)

    def initial_values(self, points: Values[P], names: Sequence[str]) -> dict[str, Numeric]:
        """The states of the study's start by these names, with the natural values where
        the study leaves them open."""
        steady, initial = self.steady(points), points.initial
        return {name: steady[name] if getattr(initial, name) is None else getattr(initial, name) for name in names}

    def by_name(self, table: Array, variant: Variant = ()) -> dict[str, Array]:
        """The lane parameters of a table by their names; without a variant those are
        right that every string has."""
        # Along a ramp the table has more columns than names.
        return dict(zip(self.names(variant).parameters, table.T, strict=False))

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        """Whether no state varies by more than ``absolute`` times its natural scale,
        judged here by the range of the bit speed."""
        if "bit_speed_max" not in features or "bit_speed" not in self.names(()).states:
            raise InputError(
                f"the model {self.name}: found a Poincare section, and no bit speed whose swing tells whether the "
                "string stands still; allowed: a function still(features, state_scales, absolute) of the model."
            )
        scale = state_scales[..., self.names(()).states.index("bit_speed")]
        return np.asarray(features["bit_speed_max"] - features["bit_speed_min"] <= absolute * scale)

    # What is fixed when code is compiled

    def variant(self, parameters: P) -> Variant:
        """The part of these parameters that is compiled in."""
        return ()

    def states(self, variant: Variant) -> tuple[str, ...]:
        """Names of the states. A state array has the phase, which is the angle of the
        drive, after them."""
        return self.names(variant).states

    def rows(self, variant: Variant, observed: int = 0, *, tangent: bool = False, columns: int | None = None) -> Rows:
        """The layout of the lane buffer for an observer with ``observed`` rows, with a
        deviation beside the states if ``tangent``, and with ``columns`` lane parameters
        where there are more than those of the model."""
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
            self.first_order(variant),
            implicit=sum(1 << slopes.index(name) for name in pushed),
        )

    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        """The compiled right-hand side."""
        return self.motion(variant).right_hand_side(lanes, self.rows(variant))

    def tangent(self, lanes: int, variant: Variant, place: int) -> Any:
        """The compiled right-hand side of the motion and of a deviation from it. The
        contact functions at the start of the step are in the observer's rows, from
        ``place`` on."""
        return self.motion(variant).tangent(lanes, self.rows(variant, tangent=True), place)

    def contact_functions(self, lanes: int, variant: Variant, place: int) -> Any:
        """Those of the gaps of ``contacts``."""
        if not self.contacts:

            @compiled(BUFFER)
            def none(b):  # type: ignore[no-untyped-def]
                pass

            return none
        rows = self.rows(variant, tangent=True)
        return self.motion(variant).contact_functions(lanes, rows, place)

    def released(self, table: Array, contact: str) -> Array | None:
        """These lane parameters with a contact that bears no force, so that a motion
        that grazes it obeys smooth equations; None where the model has no such
        parameters."""
        return None

    def levels(self, variant: Variant) -> tuple[Level, ...]:
        """The thresholds that continuation records, beside contacts."""
        names = self.names(variant)
        if not self.sticking:
            return ()
        return (Level("bit", names.states.index("bit_speed"), names.parameters.index(self.sticking)),)

    def symmetry(self, points: Values[P]) -> Symmetry:
        """The rotational symmetry of the equations of these points. NotImplementedError
        where the model does not define it."""
        raise NotImplementedError

    def implicit(self, variant: Variant) -> Variant:
        """The variant with implicit friction (:class:`nsdrill.abi.Rows`), where
        friction can be integrated implicitly (``explicit_only`` of the description)."""
        changed: Variant = self.options(*variant)._replace(implicit=1)
        return changed

    # What differs from run to run

    def pack(self, points: Values[P], thresholds: Thresholds, number: int = 1) -> Array:
        """The lane parameters, shape (n, columns), of so many points where no lane
        parameter differs between them."""
        values = self.columns(points, thresholds)
        names = self.names(self.variant(points.parameters)).parameters
        sizes = {np.size(values[name]) for name in names}
        packed = np.empty((max(sizes - {1}, default=number), len(names)))
        for k, name in enumerate(names):
            packed[:, k] = values[name]
        return packed

    def starts(self, points: Values[P], number: Array | int) -> Array:
        """The initial states with the phase last, shape (n, states + 1), of the starts
        with these numbers."""
        variant, initial = self.variant(points.parameters), points.initial
        names = self.start_names(variant)
        values = self.initial_values(points, names)
        number = np.atleast_1d(np.asarray(number))
        if initial.starts and number.size and not 0 <= number.min() <= number.max() < initial.starts:
            raise ValueError(f"start: found {number.min()} to {number.max()}, allowed: 0 to {initial.starts - 1}")
        if initial.slice:
            values |= self.sliced(points, number)
        elif initial.starts:
            values |= self.drawn(points, hypercube(initial.seed, initial.starts, len(names))[number])
        complete, names = (self.complete_states(points, values), (*self.states(variant), "drive_angle"))
        columns = [np.atleast_1d(np.asarray(complete[name], dtype=float)) for name in names]
        columns_of_points = np.broadcast_arrays(*columns, *(np.atleast_1d(value) for value in points.operation), number)
        return np.stack(columns_of_points[: len(names)], axis=1)

    def held(self, parameters: P) -> tuple[str, ...]:
        """The names of states that do not move. In a chain of runs they are not carried
        over: each run has the values of its own operating point."""
        return ()

    def undeviated(self, parameters: P) -> tuple[str, ...]:
        """The names of the states in which the initial deviation of a Lyapunov exponent
        is zero. A deviation of a state that does not move would never decay, and would
        hide one that does."""
        return self.held(parameters)

    def dimension(self, table: Array, parameters: P) -> Array:
        """The dimension of the flow with these lane parameters, shape (n,): the states
        that move, with the phase where it has an effect on them
        (:meth:`nsdrill.equations.motion.Motion.dimension`)."""
        variant, held = self.variant(parameters), frozenset(self.undeviated(parameters))
        names, motion = self.names(variant).parameters, self.motion(variant)
        patterns, place = np.unique(table == 0.0, axis=0, return_inverse=True)
        zeros = [frozenset(name for name, is_zero in zip(names, row, strict=False) if is_zero) for row in patterns]
        return np.array([motion.dimension(held, one) for one in zeros], dtype=int)[place.ravel()]

    def state_scales(self, table: Array, variant: Variant) -> Array:
        """The natural scale of each state, shape (n, states): the absolute tolerance is
        ``rtol`` times this."""
        scales = self.natural_scales(self.by_name(table, variant), self.options(*variant))
        scaled = np.empty((len(table), len(scales)))
        for k, scale in enumerate(scales):
            scaled[:, k] = scale
        return scaled

    def resting(self, parameters: P, operation: History) -> Mapping[str, Array]:
        """Where held positions stand at the points of a history, for those that depend on
        the point."""
        return {}

    def frame_rates(self, table: Array, variant: Variant) -> Array:
        """The rate of each position less its velocity, shape (n, slopes)."""
        states, frame_rate = self.states(variant), np.zeros((len(table), self.rows(variant).own_slopes))
        for position in self.turning(variant):
            frame_rate[:, states.index(position) // 2] = -self.phase_rate(table)
        return frame_rate

    def phase_rate(self, table: Array) -> Array:
        """The rate of the phase [rad/s], shape (n,)."""
        return self.by_name(table)[self.set_speed]

    def first_step(self, table: Array, variant: Variant) -> Array:
        """A first step [s], shape (n,)."""
        return np.asarray(0.01 / self.fastest(self.by_name(table, variant), self.options(*variant)))

    def runs(self, table: Array, variant: Variant, initial: Array) -> Runs:
        """Runs with these lane parameters from these states."""
        from nsdrill.kernel.batch import Runs

        return Runs(
            table,
            self.state_scales(table, variant),
            self.frame_rates(table, variant),
            self.phase_rate(table),
            self.first_step(table, variant),
            initial,
        )

    # What is observed

    widest: ClassVar[Variant] = ()
    """The variant whose observer has the most rows."""

    def names(self, variant: Variant) -> Names:
        """The names of the states (without the phase), the slopes, the lane parameters
        and auxiliary outputs, for equations and declaration."""
        return self.rows_named

    def declaration(self, variant: Variant) -> Declaration:
        """The channels and features that are observed."""
        return self.declared

    def watched(self, variant: Variant) -> Declaration:
        """The declaration with what scripts measure besides."""
        if not own_features(self.name):
            return self.declaration(variant)
        declaration: Declaration = measuring["watched"](self, variant)
        return declaration

    @property
    def observed(self) -> int:
        """The number of rows of the observer, in every variant."""
        return observed_rows(self.watched(self.widest))

    def observer(self, lanes: int, variant: Variant, *, tangent: bool = False, others: int = 0) -> tuple[Any, Any]:
        """The compiled (observer, marker); the buffer has a deviation beside the states
        if ``tangent``, and ``others`` rows of other observers."""
        rows = self.rows(variant, self.observed + others, tangent=tangent)
        functions: tuple[Any, Any] = make_observer(lanes, rows, self.names(variant), self.watched(variant))
        return functions

    def section_parts(self, parameters: P, record: Record) -> int:
        """Into how many parts the section of a ``record`` divides its spacing."""
        return 1

    def store(self, lanes: int, parameters: P, record: Record, more: int = 0) -> Array:
        """The observer's store, with room for ``more`` numbers of other observers at
        its end."""
        variant, parts = self.variant(parameters), self.section_parts(parameters, record)
        names, declaration = self.names(variant), self.watched(variant)
        return new_store(lanes, names, declaration, record.peaks, record.poincare, more, parts)

    def outcome_width(self, record: Record, variant: Variant) -> int:
        """The number of columns of an observer's outcome."""
        names, declaration = self.names(variant), self.watched(variant)
        return outcome_width(names, declaration, record.peaks, record.poincare)

    def features(self, outcome: Array, table: Array, observe: float, variant: Variant) -> dict[str, Array]:
        """The features of finished runs by their names, each an array [n]: ``outcome``
        holds the observer's columns, ``table`` the lane parameters, ``observe`` is the
        observation time [s]."""
        state_scales = self.state_scales(table, variant)
        features = measured(self.names(variant), self.watched(variant), outcome, table, state_scales, observe)
        described_features = described(self.name).features
        if missing := [
            variable.name for variable in described_features if variable.only is None and variable.name not in features
        ]:
            raise InputError(
                f"the model {self.name}: found {', '.join(missing)} among the features of its description; allowed: "
                "what its declaration measures."
            )
        # the others are steps on the way to these
        names = {HALF_DIFFERENCE, *(variable.name for variable in described_features)}
        return {name: values for name, values in features.items() if name in names}

    def derived(self, features: Mapping[str, Array], points: Values[P]) -> dict[str, Array]:
        """The ``derived`` variables of the description by name, from these features and
        the numbers of the study at the points, each an array [n]; by default there are
        none."""
        return {}

    def peaks(self, outcome: Array, record: Record, variant: Variant) -> dict[str, Array]:
        """The last local maxima by the names of their variables, each an array
        [n, peaks], NaN where fewer."""
        return peaks_of(self.watched(variant), outcome, record.peaks)

    def section(self, outcome: Array, record: Record, table: Array, variant: Variant) -> dict[str, Array]:
        """The last returns to the Poincare section by the names of their variables,
        arrays [n, returns]: ``outcome`` and ``table`` as for the features."""
        names, declaration = self.names(variant), self.watched(variant)
        states = returns_of(names, declaration, outcome, record.peaks, record.poincare)
        return {f"section_{name}": states[..., number] for number, name in enumerate(names.states)}

    def returns(self, section: Mapping[str, Array]) -> Array:
        """The states at the returns, shape (n, returns, states), in a frame in which
        periodic motions are periodic."""
        return np.stack([section[f"section_{name}"] for name in self.names(()).states], axis=-1)

    def seen(self, state_scales: Array) -> Array:
        """The natural scales of the columns of :meth:`returns`, from those of the
        states; by default all of these, of which the first ones are used."""
        return state_scales

    def classify(
        self,
        features: Mapping[str, Array],
        status: Array,
        thresholds: Thresholds,
        state_scales: Array,
        dimension: Array,
    ) -> dict[str, Array]:
        """The labels of runs with these features, whose flows have this
        :meth:`dimension`."""
        response = self.responses(features, thresholds)
        labels = {"response": response, **self.labels(features, response, thresholds)}
        critical = described(self.name).critical
        labels |= severities(features, response, thresholds, critical)
        labels["settled"] = features["half_difference"] <= thresholds.settled.tolerance
        types = {"response": label_type(critical.values())}
        labels = {
            name: np.where(status == OK, value, 0).astype(types.get(name, "i1")) for name, value in labels.items()
        }
        if any(name.startswith("section_") for name in features):
            still, scales = (self.still(features, state_scales, thresholds.motion.absolute), self.seen(state_scales))
            returns = self.returns(features)
            settled = labels["settled"]
            labels |= motions(features, status, settled, returns, scales, still, dimension, thresholds.motion)
        return labels

    def labels(self, features: Mapping[str, Array], response: Array, thresholds: Thresholds) -> dict[str, Array]:
        """Further labels of runs with these features and critical responses."""
        return {}

    def responses(self, features: Mapping[str, Array], thresholds: Thresholds) -> Array:
        """The critical responses as a sum of bits, from the features that define
        them."""
        return present(features, thresholds, described(self.name).critical)

    def scales(self, table: Array) -> dict[str, Array]:
        """The units in which differences of features are measured, by name, arrays
        [n]."""
        columns = self.by_name(table)
        return {name: columns[name] for name in described(self.name).compared.values() if name}

    def coordinates(self, features: Mapping[str, Array], table: Array, variant: Variant) -> tuple[Array, Array]:
        """The coordinates of starts, each (points, starts, coordinates): the scaled
        features that distinguish the starts of one point, and those by which attractors
        of neighbouring points are matched. ``features`` are arrays (points, starts) at
        points with the lane parameters ``table``. A difference of a few hundredths is
        significant."""
        units = self.scales(table)
        compared = [
            features[name] / units[scale][:, None] if scale else features[name]
            for name, scale in described(self.name).compared.items()
        ]
        scaled = np.stack(compared, axis=-1)
        return scaled, scaled

    def difference(self, first: Mapping[str, Array], second: Mapping[str, Array], units: Mapping[str, Array]) -> Array:
        """The largest difference between two runs of each point, over the ``compared``
        features of the description, each in its natural scale (:meth:`scales`, in
        ``units``); NaN where a run did not end well."""
        compared = described(self.name).compared
        parts = [
            np.abs(first[name] - second[name]) / (units[scale] if scale else 1.0) for name, scale in compared.items()
        ]
        return np.asarray(np.max(parts, axis=0))

    # One trajectory

    def motion(self, variant: Variant) -> Motion:
        """The equations with the names of what they read and give."""
        names = self.names(variant)
        return Motion(
            self.equations,
            self.options(*variant),
            names.states,
            names.parameters,
            self.slope_names(variant),
            names.aux,
            self.pushed(variant) if self.is_implicit(variant) else (),
            self.contacts,
            self.solved if self.is_implicit(variant) else None,
            self.quick,
        )

    def jumps(self, points: Values[P]) -> tuple[str, ...]:
        """The velocities at whose zero the slopes jump, towards zero on either side, with all
        other states zero: where the motion stays, steps become ever shorter."""
        variant = self.variant(points.parameters)
        own, columns, slopes = self.names(variant), self.columns(points, Thresholds()), self.slope_names(variant)
        wanted = self.motion(variant).slopes_named()
        given: dict[str, Any] = {"time": 0.0, "phase": 0.0}
        given |= {f"s.{name}": 0.0 for name in own.states}
        given |= {f"p.{name}": np.asarray(columns[name], dtype=float).ravel()[0] for name in own.parameters}

        def ends(name: str, size: float) -> tuple[float, float]:
            found = (plain.values({name: wanted[name]}, given | {f"s.{name}": end})[name] for end in (-size, size))
            before, after = (float(value) for value in found)
            return before, after

        jumping = []
        for name in slopes[: len(slopes) - self.first_order(variant)]:
            (before, after), (low, high) = ends(name, LEAST_VELOCITY), ends(name, SMALL_VELOCITY)
            if after < 0.0 < before and before - after > 0.5 * abs(low - high):
                jumping.append(name)
        return tuple(jumping)

    def named(self, variant: Variant) -> Mapping[str, Node]:
        """What the equations call by a name, and what scripts measure."""
        motion, features = self.motion(variant), own_features(self.name)
        if not features:
            return motion.named()
        return {**motion.named(), **measuring["nodes_of"](motion, features)}

    def turning(self, variant: Variant) -> tuple[str, ...]:
        """The positions that are measured from the angle of the drive."""
        states = self.states(variant)
        return tuple(name for name in self.relative if name in states)

    @property
    def ramps(self) -> Ramps:
        """The model along operating values that vary in time."""
        return Ramps(self)

    def outputs(self, points: Values[P], state: Mapping[str, Array]) -> dict[str, Array]:
        """The variables of a trace besides the states, from these, at one point or along
        time: by default those of every string that the equations call by their names."""
        traced = [variable.name for variable in described(self.name).own_trace if variable.only is None]
        return self.quantities(points, state, *(name for name in traced if name not in state))

    def quantities(self, points: Values[P], state: Mapping[str, Array], *names: str) -> dict[str, Array]:
        """What the equations call by these ``names``, at states with the angle of the
        drive."""
        variant = self.variant(points.parameters)
        named, own, columns = self.named(variant), self.names(variant), self.columns(points, Thresholds())
        if missing := [name for name in names if name not in named]:
            raise InputError(
                f"the model {self.name}: found {', '.join(missing)} in its traces; allowed: states, names in its "
                "equations, and what a function outputs(points, state) of its own returns."
            )
        given = {"time": 0.0, "phase": state["drive_angle"]}
        given |= {f"s.{name}": state[name] for name in own.states}
        given |= {f"p.{name}": columns[name] for name in own.parameters}
        zero = np.zeros_like(state["drive_angle"])
        if not names:
            return {}
        found = plain.values({name: named[name] for name in names}, given)
        return {name: value + zero for name, value in found.items()}
