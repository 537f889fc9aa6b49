"""What a model of a drill string is to the rest of the package.

A model is stateless, and says what it is: what differs from run to run is in arrays over
the points, what is fixed when code is compiled in its *options*. What follows from model
and options is a :class:`nsdrill.models.variant.Variant`. The sweep, the simulation and
the results use these two alone: the names of states, parameters and contacts stay inside
the model's own folder.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, Generic, NamedTuple, NoReturn, Protocol

import numpy as np

from nsdrill.data import Array
from nsdrill.errors import InputError
from nsdrill.models.operation import History, Numeric, P, Values
from nsdrill.models.own_quantities import Measured
from nsdrill.models.responses import Response, Thresholds, label_type, present, severities
from nsdrill.models.starts import Starts, hypercube, slice_points
from nsdrill.observe.channels import HALF_DIFFERENCE, Declaration, Extremes, Names, moved
from nsdrill.observe.motion_kinds import LEAST_RISE, keeps_rising, motions
from nsdrill.observe.thresholds import Record
from nsdrill.records import dataclass
from nsdrill.variables import OK, Variable

if TYPE_CHECKING:
    from nsdrill.equations.consequences import Consequences


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


class Described(Protocol):
    """What a model reads of its :class:`nsdrill.models.model_description.Description`."""

    @property
    def features(self) -> tuple[Variable, ...]: ...
    @property
    def own_trace(self) -> tuple[Variable, ...]: ...
    @property
    def options(self) -> Callable[[Any], tuple[str, ...]]: ...
    @property
    def compared(self) -> Mapping[str, str | None]: ...
    @property
    def critical(self) -> Mapping[str, Response]: ...
    @property
    def grazing(self) -> tuple[Any, ...]: ...
    @property
    def parameters(self) -> type: ...
    @property
    def initial(self) -> type[Starts]: ...
    @property
    def operation(self) -> type: ...
    @property
    def drills(self) -> bool: ...


SMOOTH = (
    "forces that begin at zero there, as a stiffness times nsdrill.touching, and a law or a drive that bends instead, "
    "as with 0.5 * (1.0 - np.tanh((abs(v) - corner) / width))"
)
REPEATED = 1e-9  # slopes that differ by less, over the greatest of them, are the same
LEAST_RATE = 1e-6  # rad/s, of equations in which nothing moves


def _given(columns: Mapping[str, Any], states: Mapping[str, Any], **angles: Any) -> dict[str, Any]:
    """The inputs of a graph; time and phase are zero unless given."""
    inputs = {f"s.{name}": value for name, value in states.items()}
    inputs |= {f"p.{name}": value for name, value in columns.items()}
    return {"time": 0.0, "phase": 0.0, **inputs, **angles}


class Plain(NamedTuple):
    """What is compiled in of a model without options of its own."""

    implicit: int = 0


class Model(Generic[P]):
    """A model made from its equations (:mod:`nsdrill.equations.motion`) and a declaration
    of what is observed; the rest has defaults, and may be replaced.

    States are pairs of position and velocity, then states of first order;
    arrays are in SI, over n points. The compiler is imported when a model computes, so
    that the file of a model can hold its description, too.
    """

    name: str
    description: Described
    """Its description, once the registry knows the model."""
    measured: tuple[Measured, ...] = ()
    """What scripts measure of it besides its declaration."""
    idle: tuple[str, ...] = ()
    """Parameters of a script that nothing reads."""
    uncounted: tuple[str, ...] = ()
    """States of a script that nothing reads, and that are no angles."""
    contacts: tuple[str, ...] = ()
    """Names of the contacts at which the Jacobian jumps; each has a function that is
    positive while the contact is closed."""

    singles: int = 0
    """How many states of first order follow the pairs, where the names follow from the
    start."""
    set_speed: str = "drive_speed"
    """The lane parameter that is the speed of the drive, the rate of its angle."""
    relative: ClassVar[tuple[str, ...]] = ()
    """The positions that are measured from the angle of the drive, as a twist is: their
    rates are less than the velocities by the set speed."""
    options: ClassVar[Callable[..., Any]] = Plain
    """A NamedTuple of whole numbers, all with defaults, which are compiled in and which
    the equations read as ``o``; one is ``implicit``, whether friction is."""
    equations: Callable[..., Any]
    """The equations of motion, as a static method: slopes, and outputs for the observer,
    from ``(t, phase, s, p, o)``."""
    quick: ClassVar[int] = 2
    """For how many slips two tangents of Newton's method are enough in an implicit stage;
    of more of them it goes on until the loads are exact."""
    is_naming: bool = False
    """While its names are made of what :meth:`columns` gives."""
    rows_named: Names | None = None
    """The :meth:`names` of a model without options where they are not those that follow
    from its start and its lane parameters."""
    declared: Declaration
    """The :meth:`declaration` of a model without options."""
    solved: ClassVar[Any] = None
    """Further outputs for the observer where friction is solved for
    (:mod:`nsdrill.equations.stage`), as a static method."""

    # What a model declares, besides names, declaration and outputs

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
        hundredth of its inverse. By default the fastest rate of the linear equations where
        each state has its natural scale, at least that of the drive."""
        states = dict(zip(self.names(o).states, self.natural_scales(table, o), strict=True))
        fastest = self.consequences(o).rates(_given(table, states)).max(axis=-1)
        return np.maximum(np.maximum(fastest, np.abs(table[self.set_speed])), LEAST_RATE)

    def steady(self, points: Values[P]) -> Mapping[str, Numeric]:
        """The natural values of the states that a start may leave open (None); by
        default the set speed for bit and drive, which does not lag."""
        values = dict(zip(points.parameters.point.names(), points.operation, strict=True))
        if (speed := values.get("rotary_speed")) is None:
            return {}
        return {"bit_speed": speed, "drive_speed": speed, "lag": 0.0}

    def hanging(self, points: Values[P]) -> float | None:
        """The weight on bit [N], zero or below, with which the bit hangs clear of the rock and
        turns without it; None where no weight is known to do so."""
        return None

    def drawn(self, points: Values[P], shape: Array) -> Mapping[str, Numeric]:
        """The states of an ensemble's starts, from numbers ``shape`` (n, states + 1)
        that are uniform in [0, 1), in the order of the states with the phase last.
        InputError where the model does not define them."""
        raise InputError(
            f"initial.ensemble: found with the model {self.name}, which does not say from which states an ensemble "
            "starts; allowed: initial.slice, or a sweep over the start."
        )

    # What follows from it

    def shortest_pulse(self, points: Values[P], duration: float) -> tuple[float, float] | None:
        """Of a model of a script, how long the shortest pulse of what forces it lasts at a
        point, and the time in which there is one [s], in a run of this ``duration``; None where
        there is none that steps may jump over."""
        return None

    def resting_pulse(self, points: Values[P]) -> tuple[float, str] | None:
        """Likewise the shortest pulse of an angle that rests at the start, so that its duration is
        not known: how far the angle turns in it [rad], and its name; None where there is none."""
        return None

    def consequences(self, o: Any) -> Consequences:
        """What follows from the slopes of all states, with these options."""
        from nsdrill.equations.consequences import consequences_of

        names, turning = self.names(o), self.turning(o)
        return consequences_of(self.equations, names.states, names.moved, turning, self.set_speed, names.parameters, o)

    def pushed(self, o: Any) -> tuple[str, ...]:
        """The velocities in whose slopes friction acts, where it can be implicit: those in the
        slips of ``friction``."""
        return self.consequences(o).rubbing

    def friction_rates(self, points: Values[P]) -> dict[str, Numeric]:
        """How fast friction brakes a slip at rest [1/s], by the key of a study that makes it
        steep, else by the contact."""
        o, columns = self.options_of(points.parameters), self.columns(points, Thresholds())
        rates = self.consequences(o).braking(lambda states: _given(columns, states))
        sections = {name: getattr(points.parameters, name, None) for name in rates}
        steep = {name: hasattr(getattr(one, "friction", None), "smoothing") for name, one in sections.items()}
        return {f"{name}.friction.smoothing" if steep[name] else name: rate for name, rate in rates.items()}

    def jumping(self, points: Values[P], parts: Sequence[str] = ()) -> tuple[str, ...]:
        """The conditions at which slopes jump, across which a deviation is not followed, in
        words. Of a string with ``parts`` of scripts these are where they stand: a model of
        nsdrill itself has no such condition."""
        from nsdrill.equations.jumps import jumps_in

        columns, states, angles = self._probes(points)
        code = self.equations.__code__
        where = " or ".join(parts) or f"{code.co_filename}, line {code.co_firstlineno}: {code.co_name}"
        slopes = self.consequences(self.options_of(points.parameters))
        return jumps_in(slopes, _given(columns, states, **angles), where)

    def _probes(self, points: Values[P]) -> tuple[Mapping[str, Numeric], dict[str, Array], dict[str, Array]]:
        """(lane parameters, states, phase and time) around the start of a point."""
        from nsdrill.equations.jumps import probes_around

        names = self.names(self.options_of(points.parameters)).states
        start = dict(zip(names, map(float, self.starts(points, 0)[0]), strict=False))
        return self.columns(points, Thresholds()), *probes_around(start)

    def start_names(self, o: Any) -> tuple[str, ...]:
        """The names of the states that a start gives: fields of the study's section, in
        the order in which they are drawn."""
        return (*self.names(o).states, "drive_angle")

    def complete_states(self, points: Values[P], values: Mapping[str, Numeric]) -> Mapping[str, Numeric]:
        """All states and the drive's angle by their names, from those of the start."""
        return values

    def sliced(self, points: Values[P], number: Array) -> dict[str, Array]:
        """The two states that the study's slice varies, at the starts of these
        numbers."""
        return slice_points(points.initial, self.start_names(self.options_of(points.parameters)), number)

    def initial_values(self, points: Values[P], names: Sequence[str]) -> dict[str, Numeric]:
        """The states of the study's start by these names, with the natural values where
        the study leaves them open."""
        steady, initial = self.steady(points), points.initial
        return {name: steady[name] if getattr(initial, name) is None else getattr(initial, name) for name in names}

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        """Whether no state varies by more than ``absolute`` times its natural scale,
        judged here by the range of the bit speed."""
        if "bit_speed_max" not in features or "bit_speed" not in self.names(self.options()).states:
            raise InputError(
                f"the model {self.name}: found a Poincare section, and no bit speed whose swing tells whether the "
                "string stands still; allowed: a function still(features, state_scales, absolute) of the model."
            )
        scale = state_scales[..., self.names(self.options()).states.index("bit_speed")]
        return np.asarray(features["bit_speed_max"] - features["bit_speed_min"] <= absolute * scale)

    # What is fixed when code is compiled

    def options_of(self, parameters: P) -> Any:
        """The options of a string with these parameters: what is compiled in."""
        return self.options()

    def by_name(self, table: Array) -> dict[str, Array]:
        """The lane parameters that a string with any options has, by their names."""
        return dict(zip(self.names(self.options()).parameters, table.T, strict=False))

    def released(self, table: Array, contact: str) -> Array | None:
        """These lane parameters with a contact that bears no force, so that a motion
        that grazes it obeys smooth equations; None where the model has no such
        parameters."""
        return None

    def symmetry(self, points: Values[P]) -> Symmetry:
        """The rotational symmetry of the equations of these points: by default any angle
        where they do not read that of the drive, and a revolution where they do. InputError
        where they read the time otherwise, or slopes jump; NotImplementedError where a model
        has none."""
        found = self.consequences(self.options_of(points.parameters))
        turns = not found.read.isdisjoint(("time", "phase"))
        if turns and not self._repeats(points):
            self._refuse_branches(
                "equations that read the time otherwise than as a forcing that repeats, so that no motion does",
                "a forcing of one frequency, as np.cos(omega * t), or none",
            )
        self.refuse_jumps(points)
        return Symmetry(folds=int(turns), free=found.free)

    def refuse_jumps(self, points: Values[P], parts: Sequence[str] = ()) -> None:
        """InputError for branches where slopes jump; ``parts`` as of :meth:`jumping`."""
        if jumping := self.jumping(points, parts):
            self._refuse_branches(f"slopes that jump at {jumping[0]}", SMOOTH)

    def _repeats(self, points: Values[P]) -> bool:
        """Whether the slopes read the time as a part of the angle of the drive alone, and
        repeat after a revolution of it."""
        from nsdrill.equations import plain

        columns, states, angles = self._probes(points)
        slopes = self.consequences(self.options_of(points.parameters)).slopes
        turned = angles["phase"] + columns[self.set_speed] * angles["time"]
        found = [
            plain.values(slopes, _given(columns, states, **one))
            for one in (angles, {"phase": turned}, {"phase": turned + 2.0 * np.pi})
        ]
        first, *others = [np.stack(np.broadcast_arrays(*one.values(), turned)) for one in found]
        size = np.abs(first).max(axis=-1, keepdims=True)
        return all(np.all(np.abs(other - first)[:-1] <= REPEATED * size[:-1] + REPEATED) for other in others)

    def _refuse_branches(self, found: str, allowed: str) -> NoReturn:
        raise InputError(
            f"the model {self.name}: found {found}; allowed: {allowed}. A sweep up and down (sweep.procedure: up-down) "
            "follows the stable motions of any model."
        )

    # What differs from run to run

    def pack(self, points: Values[P], thresholds: Thresholds, number: int = 1) -> Array:
        """The lane parameters, shape (n, columns), of so many points where no lane
        parameter differs between them."""
        values = self.columns(points, thresholds)
        names = self.names(self.options_of(points.parameters)).parameters
        sizes = {np.size(values[name]) for name in names}
        packed = np.empty((max(sizes - {1}, default=number), len(names)))
        for k, name in enumerate(names):
            packed[:, k] = values[name]
        return packed

    def starts(self, points: Values[P], number: Array | int) -> Array:
        """The initial states with the phase last, shape (n, states + 1), of the starts
        with these numbers."""
        o, initial = self.options_of(points.parameters), points.initial
        names = self.start_names(o)
        values = self.initial_values(points, names)
        number = np.atleast_1d(np.asarray(number))
        if initial.starts and number.size and not 0 <= number.min() <= number.max() < initial.starts:
            raise ValueError(f"start: found {number.min()} to {number.max()}, allowed: 0 to {initial.starts - 1}")
        if initial.slice:
            values |= self.sliced(points, number)
        elif initial.starts:
            values |= self.drawn(points, hypercube(initial.seed, initial.starts, len(names))[number])
        complete, names = (self.complete_states(points, values), (*self.names(o).states, "drive_angle"))
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

    def resting(self, parameters: P, operation: History) -> Mapping[str, Array]:
        """Where held positions stand at the points of a history, for those that depend on
        the point."""
        return {}

    # What is observed

    widest: ClassVar[tuple[int, ...]] = ()
    """The options with which the observer has the most rows."""

    def names(self, o: Any) -> Names:
        """The names of the states (without the phase), the slopes, the lane parameters
        and auxiliary outputs, for equations and declaration. By default the states are those
        of the start, the slope of ``bit_speed`` is ``bit_speed_rate``, and the lane
        parameters are those of :meth:`columns`."""
        return self.rows_named or self._names

    @cached_property
    def _names(self) -> Names:
        about = self.description
        states = about.initial.states()[:-1]
        operation = tuple(vars(about.operation()).values())
        self.is_naming = True
        try:
            columns = self.columns(Values(about.parameters(), about.initial(), operation), Thresholds())
        finally:
            self.is_naming = False
        return Names(states, tuple(f"{name}_rate" for name in moved(states, self.singles)), tuple(columns))

    def declaration(self, o: Any) -> Declaration:
        """The channels and features that are observed."""
        return self.declared

    def section_parts(self, parameters: P, record: Record) -> int:
        """Into how many parts the section of a ``record`` divides its spacing."""
        return 1

    def section(self, returns: Mapping[str, Array], table: Mapping[str, Array], o: Any) -> dict[str, Array]:
        """The last returns to the Poincare section by the names of their variables, from the
        states at them, arrays [n, returns], and the lane parameters by name [n]."""
        return {f"section_{name}": returns[name] for name in self.names(o).states}

    def derived(self, features: Mapping[str, Array], points: Values[P]) -> dict[str, Array]:
        """The ``derived`` variables of the description by name, from these features and
        the numbers of the study at the points, each an array [n]; by default there are
        none."""
        return {}

    def returns(self, section: Mapping[str, Array]) -> Array:
        """The states at the returns, shape (n, returns, states), in a frame in which
        periodic motions are periodic."""
        return np.stack([section[f"section_{name}"] for name in self.names(self.options()).states], axis=-1)

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
        ``dimension`` (:meth:`nsdrill.models.variant.Variant.dimension`)."""
        response = self.responses(features, thresholds)
        labels = {"response": response, **self.labels(features, response, thresholds)}
        critical = self.description.critical
        labels |= severities(features, response, thresholds, critical)
        grows = self.grows(features, thresholds.settled.tolerance)
        labels["settled"] = (features["half_difference"] <= thresholds.settled.tolerance) & ~grows
        types = {"response": label_type(critical.values())}
        labels = {
            name: np.where(status == OK, value, 0).astype(types.get(name, "i1")) for name, value in labels.items()
        }
        if any(name.startswith("section_") for name in features):
            still, scales = (self.still(features, state_scales, thresholds.motion.absolute), self.seen(state_scales))
            returns = self.returns(features)
            settled = labels["settled"]
            labels |= motions(features, status, settled, grows, returns, scales, still, dimension, thresholds.motion)
        return labels

    def grows(self, features: Mapping[str, Array], tolerance: float) -> Array:
        """Whether the peaks of a quantity whose halves are compared keep rising, of runs with
        these features and, where they were kept, peaks; not of an angle that turns."""
        found = np.zeros(np.shape(features[HALF_DIFFERENCE]), dtype=bool)
        for one in self.declaration(self.options()).of_kind(Extremes):
            peaks, greatest, least = (features.get(name or "") for name in (one.peaks, one.greatest, one.least))
            if peaks is None or greatest is None or one.compared is None:
                continue
            least = np.zeros_like(greatest) if least is None else least
            rises = keeps_rising(peaks, greatest, least, tolerance)
            found |= rises if one.revolution is None else rises & (greatest - least <= one.revolution)
        return found & (features[HALF_DIFFERENCE] > LEAST_RISE)  # else it is the error of the steps

    def labels(self, features: Mapping[str, Array], response: Array, thresholds: Thresholds) -> dict[str, Array]:
        """Further labels of runs with these features and critical responses."""
        return {}

    def responses(self, features: Mapping[str, Array], thresholds: Thresholds) -> Array:
        """The critical responses as a sum of bits, from the features that define
        them."""
        return present(features, thresholds, self.description.critical)

    def scales(self, table: Array) -> dict[str, Array]:
        """The units in which differences of features are measured, by name, arrays
        [n]."""
        columns = self.by_name(table)
        return {name: columns[name] for name in self.description.compared.values() if name}

    def coordinates(self, features: Mapping[str, Array], table: Array) -> tuple[Array, Array]:
        """The coordinates of starts, each (points, starts, coordinates): the scaled
        features that distinguish the starts of one point, and those by which attractors
        of neighbouring points are matched. ``features`` are arrays (points, starts) at
        points with the lane parameters ``table``. A difference of a few hundredths is
        significant."""
        units = self.scales(table)
        compared = [
            features[name] / units[scale][:, None] if scale else features[name]
            for name, scale in self.description.compared.items()
        ]
        scaled = np.stack(compared, axis=-1)
        return scaled, scaled

    def difference(self, first: Mapping[str, Array], second: Mapping[str, Array], units: Mapping[str, Array]) -> Array:
        """The largest difference between two runs of each point, over the ``compared``
        features of the description, each in its natural scale (:meth:`scales`, in
        ``units``); NaN where a run did not end well."""
        compared = self.description.compared
        parts = [
            np.abs(first[name] - second[name]) / (units[scale] if scale else 1.0) for name, scale in compared.items()
        ]
        return np.asarray(np.max(parts, axis=0))

    # One trajectory

    def turning(self, o: Any) -> tuple[str, ...]:
        """The positions that are measured from the angle of the drive."""
        states = self.names(o).states
        return tuple(name for name in self.relative if name in states)

    def frame_rates(self, table: Mapping[str, Array], o: Any) -> Mapping[str, Numeric]:
        """The rate of a position less its velocity, for those of which it is not zero, from
        the lane parameters by name."""
        return {name: -table[self.set_speed] for name in self.turning(o)}

    def outputs(self, points: Values[P], state: Mapping[str, Array]) -> dict[str, Array]:
        """The variables of a trace besides the states and what the equations call by name,
        from these, at one point or along time."""
        return {}
