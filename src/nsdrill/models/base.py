"""What a model of a drill string is to the rest of the package.

A model is stateless: what differs from run to run stands in arrays over the points,
what is fixed when code is compiled in its *variant*. The sweep, the simulation and the
results ask for nothing else; no name of a state, a parameter or a contact is known
outside the model's own folder.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nsdrill.models.leaves import Values
from nsdrill.models.registry import described
from nsdrill.models.schedule import Schedule
from nsdrill.observe.thresholds import Record, Thresholds

if TYPE_CHECKING:
    from nsdrill.abi import Rows
    from nsdrill.kernel.batch import Runs

Array = np.ndarray[Any, np.dtype[Any]]
Variant = tuple[int, ...]


@dataclass(frozen=True)
class Symmetry:
    """How the equations of a model repeat as the drive turns, for the continuation of
    motions.

    With the drive turned by a revolution over ``folds``, and the pairs of states
    ``turned`` turned by as much, the equations are the same; ``folds`` 0: turned by any
    angle. ``free`` are the places of the states that move and that something depends
    on; ``turned`` holds pairs of places (of x, of y).
    """

    folds: int
    free: tuple[int, ...]
    turned: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class Level:
    """A velocity that falls below a parameter, with the ``name`` of what does so (a bit
    that sticks): the places of the ``velocity`` among the states and of the
    ``parameter`` among those of a lane. It is a threshold: nothing jumps."""

    name: str
    velocity: int
    parameter: int


class Ramps(ABC):
    """A model along a ramp: a chain of short segments in each of which every lane
    parameter moves linearly."""

    @abstractmethod
    def columns(self, variant: Variant) -> tuple[str, ...]:
        """Names of the lane parameters: those of the model, then those that tell how
        they move."""

    @abstractmethod
    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        """The compiled right-hand side."""

    @abstractmethod
    def pack(
        self, parameters: Any, schedule: Schedule, cuts: Array, thresholds: Thresholds
    ) -> Array:
        """Lane parameters of the segments between ``cuts`` [s], shape (segments,
        columns)."""

    @abstractmethod
    def mend(
        self, samples: Array, table: Array, cuts: Array, time: Array, variant: Variant
    ) -> None:
        """Make the true states of those that the kernel has sampled at ``time`` [s],
        shape (samples, states)."""


class Model(ABC):
    """States are pairs of position and velocity in turn, then those of first order;
    arrays are in SI, over n points."""

    name: ClassVar[str]
    contacts: ClassVar[tuple[str, ...]] = ()
    """Names of the contacts at which the Jacobian jumps; each has a function that is
    positive where it touches."""

    # What is fixed when code is compiled

    @abstractmethod
    def variant(self, parameters: Any) -> Variant:
        """What of these parameters is compiled in."""

    @abstractmethod
    def states(self, variant: Variant) -> tuple[str, ...]:
        """Names of the states. A state array has the phase, the angle of the drive,
        after them."""

    @abstractmethod
    def rows(
        self,
        variant: Variant,
        observed: int = 0,
        *,
        tangent: bool = False,
        columns: int | None = None,
    ) -> Rows:
        """The lane buffer for an observer with so many rows, with a deviation beside
        the states or without, and with so many ``columns`` of lane parameters where
        there are more than those of the model."""

    @abstractmethod
    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        """The compiled right-hand side."""

    def tangent(self, lanes: int, variant: Variant, place: int) -> Any:
        """The compiled right-hand side of the motion and of a deviation from it. The
        functions of the contacts at the start of the step stand among the observer's
        rows, at ``place``."""
        raise NotImplementedError

    def contact_functions(self, lanes: int, variant: Variant, place: int) -> Any:
        """The compiled function that puts value, slope and second derivative of each
        contact's function at the end of the step among the observer's rows, at
        ``place``."""
        raise NotImplementedError

    def released(self, table: Array, contact: str) -> Array | None:
        """These lane parameters with a contact that holds nothing, so that a motion
        which just reaches it is followed by smooth equations; None where the model has
        no such parameters."""
        return None

    def levels(self, variant: Variant) -> tuple[Level, ...]:
        """The thresholds that continuation tells of, beside contacts."""
        return ()

    def symmetry(self, points: Values) -> Symmetry:
        """How the equations of these points repeat as the drive turns.
        NotImplementedError where the model does not say."""
        raise NotImplementedError

    def apart(self, variant: Variant) -> Variant:
        """The variant whose friction is kept apart (:class:`nsdrill.abi.Rows`), of a
        string whose friction can be integrated implicitly, as the description's
        ``explicit_only`` says."""
        raise NotImplementedError

    # What differs from run to run

    @abstractmethod
    def pack(self, points: Values, thresholds: Thresholds) -> Array:
        """The lane parameters, shape (n, columns)."""

    def switches(self, parameters: Any) -> float | None:
        """When, in the simulation of one operating point, something is switched on [s],
        if it is."""
        return None

    def pack_before(self, points: Values, thresholds: Thresholds) -> Array:
        """The lane parameters until then, as :meth:`pack` has them after it."""
        raise NotImplementedError

    @abstractmethod
    def starts(self, points: Values, number: Array | int) -> Array:
        """The initial states with the phase last, shape (n, states + 1), of the starts
        of these numbers."""

    def held(self, parameters: Any) -> tuple[str, ...]:
        """The names of states that do not move. In a chain of runs each has its own
        values of them: what the run before ended in is that of another operating
        point."""
        return ()

    def undeviated(self, parameters: Any) -> tuple[str, ...]:
        """The names of the states in which the deviation of a Lyapunov exponent begins
        without a part."""
        return ()

    @abstractmethod
    def state_scales(self, table: Array, variant: Variant) -> Array:
        """The natural scale of each state, shape (n, states): the absolute tolerance is
        ``rtol`` times this."""

    @abstractmethod
    def frame_rates(self, table: Array, variant: Variant) -> Array:
        """What the rate of each position has beyond its velocity, shape (n, slopes)."""

    @abstractmethod
    def phase_rate(self, table: Array) -> Array:
        """How fast the phase advances [rad/s], shape (n,)."""

    @abstractmethod
    def first_step(self, table: Array, variant: Variant) -> Array:
        """A first step [s], shape (n,)."""

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

    @property
    @abstractmethod
    def observed(self) -> int:
        """How many rows the observer has."""

    @abstractmethod
    def observer(
        self, lanes: int, variant: Variant, *, tangent: bool = False, others: int = 0
    ) -> tuple[Any, Any]:
        """The compiled (observer, marker), beside a deviation and so many ``others``
        rows of other observers."""

    @abstractmethod
    def store(self, lanes: int, parameters: Any, record: Record, more: int = 0) -> Array:
        """The observer's store, with room for ``more`` numbers of other observers at
        its end."""

    @abstractmethod
    def report_width(self, record: Record, variant: Variant) -> int:
        """How many columns the observer reports."""

    @abstractmethod
    def features(
        self, report: Array, table: Array, observe: float, variant: Variant
    ) -> dict[str, Array]:
        """The features of finished runs by their names, each an array [n]: ``report``
        holds the observer's columns, ``table`` the lane parameters, ``observe`` is the
        length of the window [s]."""

    def derived(self, features: Mapping[str, Array], points: Values) -> dict[str, Array]:
        """What follows from these features and the numbers of the study at the points,
        by name: the ``derived`` variables of the description, each an array [n]. None
        here."""
        return {}

    @abstractmethod
    def peaks(self, report: Array, record: Record) -> dict[str, Array]:
        """The last local maxima by the names of their variables, each an array
        [n, peaks], NaN where fewer."""

    @abstractmethod
    def section(
        self, report: Array, record: Record, table: Array, variant: Variant
    ) -> dict[str, Array]:
        """The last returns to the Poincare section by the names of their variables,
        arrays [n, returns]: ``report`` and ``table`` as for the features."""

    @abstractmethod
    def returns(self, section: Mapping[str, Array]) -> Array:
        """The states at the returns, shape (n, returns, states), in a frame in which
        what repeats is seen to."""

    def seen(self, state_scales: Array) -> Array:
        """The natural scales of what :meth:`returns` gives, from those of the states:
        of the first ones, here."""
        return state_scales

    @abstractmethod
    def classify(
        self,
        features: Mapping[str, Array],
        status: Array,
        thresholds: Thresholds,
        state_scales: Array,
    ) -> dict[str, Array]:
        """The labels of runs with these features."""

    @abstractmethod
    def responses(self, features: Mapping[str, Array], thresholds: Thresholds) -> Array:
        """The critical responses as a sum of bits, from the features that decide on
        them."""

    @abstractmethod
    def scales(self, table: Array) -> dict[str, Array]:
        """What differences of features are measured in, by name, arrays [n]."""

    @abstractmethod
    def coordinates(
        self, features: Mapping[str, Array], table: Array, variant: Variant
    ) -> tuple[Array, Array]:
        """Of starts with these features, arrays (points, starts), at points with the
        lane parameters ``table``: the scaled features by which starts of one point are
        told apart, and the coordinates by which attractors of neighbouring points are
        matched, each (points, starts, coordinates). A difference of a few hundredths
        counts."""

    def difference(
        self, one: Mapping[str, Array], two: Mapping[str, Array], units: Mapping[str, Array]
    ) -> Array:
        """The largest difference of the features of two runs of each point by which
        runs are compared, each measured in its natural scale (:meth:`scales`, in
        ``units``); NaN where a run did not end well."""
        compared = described(self.name).compared
        parts = [
            np.abs(one[name] - two[name]) / (units[scale] if scale else 1.0)
            for name, scale in compared.items()
        ]
        return np.asarray(np.max(parts, axis=0))

    # One trajectory

    ramps: ClassVar[Ramps | None] = None
    """How the model follows values that move in time, if it does."""

    @abstractmethod
    def outputs(self, parameters: Any, point: Any, state: Mapping[str, Array]) -> dict[str, Array]:
        """What a trace has besides the states, from these: forces, polar coordinates.
        ``point`` is the operating point, of numbers or of arrays over time."""
