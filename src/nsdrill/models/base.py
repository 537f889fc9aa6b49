"""What a model of a drill string is to the rest of the package.

A model is stateless: what differs from run to run is in arrays over the points, and
what is fixed when code is compiled is in its *variant*. The sweep, the simulation and
the results use this interface alone: the names of states, parameters and contacts stay
inside the model's own folder.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from nsdrill.errors import InputError
from nsdrill.models.leaves import Values
from nsdrill.models.ramp import Ramps
from nsdrill.models.registry import described
from nsdrill.observe.thresholds import Record, Thresholds

if TYPE_CHECKING:
    from nsdrill.abi import Rows
    from nsdrill.equations.motion import Motion
    from nsdrill.kernel.batch import Runs
    from nsdrill.observe.channels import Declaration, Names

Array = np.ndarray[Any, np.dtype[Any]]
Variant = tuple[int, ...]


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


class Model(ABC):
    """States are pairs of position and velocity, then those of first order; arrays are
    in SI, over n points."""

    name: ClassVar[str]
    contacts: ClassVar[tuple[str, ...]] = ()
    """Names of the contacts at which the Jacobian jumps; each has a function that is
    positive while the contact is closed."""

    # What is fixed when code is compiled

    @abstractmethod
    def variant(self, parameters: Any) -> Variant:
        """The part of these parameters that is compiled in."""

    @abstractmethod
    def states(self, variant: Variant) -> tuple[str, ...]:
        """Names of the states. A state array has the phase, which is the angle of the
        drive, after them."""

    @abstractmethod
    def rows(
        self,
        variant: Variant,
        observed: int = 0,
        *,
        tangent: bool = False,
        columns: int | None = None,
    ) -> Rows:
        """The layout of the lane buffer for an observer with ``observed`` rows, with a
        deviation beside the states if ``tangent``, and with ``columns`` lane parameters
        where there are more than those of the model."""

    @abstractmethod
    def right_hand_side(self, lanes: int, variant: Variant) -> Any:
        """The compiled right-hand side."""

    def tangent(self, lanes: int, variant: Variant, place: int) -> Any:
        """The compiled right-hand side of the motion and of a deviation from it. The
        contact functions at the start of the step are in the observer's rows, from
        ``place`` on."""
        raise NotImplementedError

    def contact_functions(self, lanes: int, variant: Variant, place: int) -> Any:
        """The compiled function that stores value, slope and second derivative of each
        contact function at the end of the step in the observer's rows, from ``place``
        on."""
        raise NotImplementedError

    def released(self, table: Array, contact: str) -> Array | None:
        """These lane parameters with a contact that bears no force, so that a motion
        that grazes it obeys smooth equations; None where the model has no such
        parameters."""
        return None

    def levels(self, variant: Variant) -> tuple[Level, ...]:
        """The thresholds that continuation records, beside contacts."""
        return ()

    def symmetry(self, points: Values) -> Symmetry:
        """The rotational symmetry of the equations of these points. NotImplementedError
        where the model does not define it."""
        raise NotImplementedError

    def implicit(self, variant: Variant) -> Variant:
        """The variant with implicit friction (:class:`nsdrill.abi.Rows`), where
        friction can be integrated implicitly (``explicit_only`` of the description)."""
        raise NotImplementedError

    # What differs from run to run

    @abstractmethod
    def pack(self, points: Values, thresholds: Thresholds) -> Array:
        """The lane parameters, shape (n, columns)."""

    def switches(self, parameters: Any) -> float | None:
        """The time at which something is switched on in the simulation of one operating
        point [s], or None."""
        return None

    def pack_before(self, points: Values, thresholds: Thresholds) -> Array:
        """The lane parameters before :meth:`switches`, as :meth:`pack` gives them after
        it."""
        raise NotImplementedError

    @abstractmethod
    def starts(self, points: Values, number: Array | int) -> Array:
        """The initial states with the phase last, shape (n, states + 1), of the starts
        with these numbers."""

    def held(self, parameters: Any) -> tuple[str, ...]:
        """The names of states that do not move. In a chain of runs they are not carried
        over: each run has the values of its own operating point."""
        return ()

    def undeviated(self, parameters: Any) -> tuple[str, ...]:
        """The names of the states in which the initial deviation of a Lyapunov exponent
        is zero. A deviation of a state that does not move would never decay, and would
        hide one that does."""
        return self.held(parameters)

    @abstractmethod
    def state_scales(self, table: Array, variant: Variant) -> Array:
        """The natural scale of each state, shape (n, states): the absolute tolerance is
        ``rtol`` times this."""

    @abstractmethod
    def frame_rates(self, table: Array, variant: Variant) -> Array:
        """The rate of each position less its velocity, shape (n, slopes)."""

    @abstractmethod
    def phase_rate(self, table: Array) -> Array:
        """The rate of the phase [rad/s], shape (n,)."""

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

    widest: ClassVar[Variant] = ()
    """The variant whose observer has the most rows."""

    @abstractmethod
    def names(self, variant: Variant) -> Names:
        """The names of the states (without the phase), the slopes, the lane parameters
        and auxiliary outputs, for the declaration."""

    @abstractmethod
    def declaration(self, variant: Variant) -> Declaration:
        """The channels and features that are observed."""

    @property
    def observed(self) -> int:
        """The number of rows of the observer, in every variant."""
        from nsdrill.observe.channel_text import observed_rows

        return observed_rows(self.declaration(self.widest))

    def observer(
        self, lanes: int, variant: Variant, *, tangent: bool = False, others: int = 0
    ) -> tuple[Any, Any]:
        """The compiled (observer, marker); the buffer has a deviation beside the states
        if ``tangent``, and ``others`` rows of other observers."""
        from nsdrill.observe.declared import make_observer

        rows = self.rows(variant, self.observed + others, tangent=tangent)
        functions: tuple[Any, Any] = make_observer(
            lanes, rows, self.names(variant), self.declaration(variant)
        )
        return functions

    def section_parts(self, parameters: Any, record: Record) -> int:
        """Into how many parts the section of a ``record`` divides its spacing."""
        return 1

    def store(self, lanes: int, parameters: Any, record: Record, more: int = 0) -> Array:
        """The observer's store, with room for ``more`` numbers of other observers at
        its end."""
        from nsdrill.observe.findings import new_store

        variant, parts = self.variant(parameters), self.section_parts(parameters, record)
        names, declaration = self.names(variant), self.declaration(variant)
        return new_store(lanes, names, declaration, record.peaks, record.poincare, more, parts)

    def outcome_width(self, record: Record, variant: Variant) -> int:
        """The number of columns of an observer's outcome."""
        from nsdrill.observe.findings import outcome_width

        names, declaration = self.names(variant), self.declaration(variant)
        return outcome_width(names, declaration, record.peaks, record.poincare)

    def features(
        self, outcome: Array, table: Array, observe: float, variant: Variant
    ) -> dict[str, Array]:
        """The features of finished runs by their names, each an array [n]: ``outcome``
        holds the observer's columns, ``table`` the lane parameters, ``observe`` is the
        observation time [s]."""
        from nsdrill.observe.channels import HALF_DIFFERENCE
        from nsdrill.observe.findings import measured

        state_scales = self.state_scales(table, variant)
        features = measured(
            self.names(variant), self.declaration(variant), outcome, table, state_scales, observe
        )
        described_features = described(self.name).features
        if missing := [
            variable.name
            for variable in described_features
            if variable.only is None and variable.name not in features
        ]:
            raise InputError(
                f"the model {self.name}: found {', '.join(missing)} among the features of its "
                f"description; allowed: "
                "what its declaration measures."
            )
        # the others are steps on the way to these
        names = {HALF_DIFFERENCE, *(variable.name for variable in described_features)}
        return {name: values for name, values in features.items() if name in names}

    def derived(self, features: Mapping[str, Array], points: Values) -> dict[str, Array]:
        """The ``derived`` variables of the description by name, from these features and
        the numbers of the study at the points, each an array [n]; by default there are
        none."""
        return {}

    def peaks(self, outcome: Array, record: Record, variant: Variant) -> dict[str, Array]:
        """The last local maxima by the names of their variables, each an array
        [n, peaks], NaN where fewer."""
        from nsdrill.observe.findings import peaks_of

        return peaks_of(self.declaration(variant), outcome, record.peaks)

    @abstractmethod
    def section(
        self, outcome: Array, record: Record, table: Array, variant: Variant
    ) -> dict[str, Array]:
        """The last returns to the Poincare section by the names of their variables,
        arrays [n, returns]: ``outcome`` and ``table`` as for the features."""

    @abstractmethod
    def returns(self, section: Mapping[str, Array]) -> Array:
        """The states at the returns, shape (n, returns, states), in a frame in which
        periodic motions are periodic."""

    def seen(self, state_scales: Array) -> Array:
        """The natural scales of the columns of :meth:`returns`, from those of the
        states; by default all of these, of which the first ones are used."""
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
        """The critical responses as a sum of bits, from the features that define
        them."""

    @abstractmethod
    def scales(self, table: Array) -> dict[str, Array]:
        """The units in which differences of features are measured, by name, arrays
        [n]."""

    @abstractmethod
    def coordinates(
        self, features: Mapping[str, Array], table: Array, variant: Variant
    ) -> tuple[Array, Array]:
        """The coordinates of starts, each (points, starts, coordinates): the scaled
        features that distinguish the starts of one point, and those by which attractors
        of neighbouring points are matched. ``features`` are arrays (points, starts) at
        points with the lane parameters ``table``. A difference of a few hundredths is
        significant."""

    def difference(
        self, first: Mapping[str, Array], second: Mapping[str, Array], units: Mapping[str, Array]
    ) -> Array:
        """The largest difference between two runs of each point, over the ``compared``
        features of the description, each in its natural scale (:meth:`scales`, in
        ``units``); NaN where a run did not end well."""
        compared = described(self.name).compared
        parts = [
            np.abs(first[name] - second[name]) / (units[scale] if scale else 1.0)
            for name, scale in compared.items()
        ]
        return np.asarray(np.max(parts, axis=0))

    # One trajectory

    set_speed: ClassVar[str] = "drive_speed"
    """The lane parameter that is the speed of the drive."""

    @abstractmethod
    def motion(self, variant: Variant) -> Motion:
        """The equations with the names of what they read and give."""

    @abstractmethod
    def turning(self, variant: Variant) -> tuple[str, ...]:
        """The positions that are measured from the angle of the drive."""

    def parameter_names(self, variant: Variant) -> tuple[str, ...]:
        """The lane parameters, as the equations call them."""
        return self.motion(variant).parameters

    @property
    def ramps(self) -> Ramps:
        """The model along operating values that vary in time."""
        return Ramps(self)

    @abstractmethod
    def outputs(self, parameters: Any, point: Any, state: Mapping[str, Array]) -> dict[str, Array]:
        """The variables of a trace besides the states, from these: forces, polar
        coordinates. ``point`` is the operating point, numbers or arrays over time."""
