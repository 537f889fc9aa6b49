"""A model with what is compiled into it: its rows, names and equations, found once."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.abi import Layout
from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Node
from nsdrill.equations.motion import Motion
from nsdrill.errors import InputError
from nsdrill.models.base import Level, Model
from nsdrill.models.operation import Values
from nsdrill.models.own_quantities import (
    Measured,
    graph_of,
    nodes_of,
    rates_of,
    tell_of_lacking,
    with_channels,
    with_measures,
)
from nsdrill.models.responses import Thresholds
from nsdrill.observe.channels import HALF_DIFFERENCE, Declaration, Names
from nsdrill.observe.declared import make_observer, observed_rows
from nsdrill.observe.findings import measured, new_store, outcome_width, peaks_of, returns_of
from nsdrill.observe.thresholds import Record
from nsdrill.variables import MEASURED_BY_SCRIPT, OUTRUN

if TYPE_CHECKING:
    from nsdrill.kernel.batch import Runs

BIT_SPEED = "bit_speed"  # the state that may stick
LEAST_VELOCITY, SMALL_VELOCITY = 1e-15, 1e-6  # of a law that is smooth the first is nothing beside the second

# operations that make no slope steeper than their arguments and numbers are
NEVER_STEEP = frozenset({"const", "fixed", "input", "add", "sub", "mul", "neg", "fma", "sin", "cos"})


@lru_cache(maxsize=512)
def variant_of(model: Model, options: tuple[int, ...] = ()) -> Variant:
    """The variant of a model with these options, or all that begin like these."""
    whole = model.options(*options)
    return Variant(model, whole) if whole == options else variant_of(model, whole)


def variant_at(model: Model, parameters: Any) -> Variant:
    """The variant of a model for a string with these parameters."""
    return variant_of(model, model.options_of(parameters))


class Variant:
    """A ``model`` with its ``options``, which are fixed when code is compiled. There is
    one of each (:func:`variant_of`)."""

    def __init__(self, model: Model, options: Any) -> None:
        self.model, self.options = model, options

    @property
    def implicit(self) -> Variant:
        """The same with implicit friction (:class:`nsdrill.abi.Layout`), where friction can be
        integrated implicitly (``explicit_only`` of the description)."""
        return variant_of(self.model, self.options._replace(implicit=1))

    # Names.

    @cached_property
    def names(self) -> Names:
        return self.model.names(self.options)

    @cached_property
    def declaration(self) -> Declaration:
        """What is observed, with what scripts measure besides."""
        declaration, measured = self.model.declaration(self.options), self.measured
        if not measured:
            return declaration
        rates = rates_of(self.motion, self.names.slopes, self.turning, self.model.set_speed)
        return with_channels(with_measures(declaration, measured), measured, nodes_of(self.motion, measured), rates)

    @cached_property
    def measured(self) -> tuple[Measured, ...]:
        """What scripts and packages measure. It is left out, with a warning, where a string with
        these options lacks its arguments."""
        graph = graph_of(self.motion) if self.model.measured else None
        kept = []
        for one in self.model.measured:
            if graph is not None and (lacking := one.unknown(*graph)):
                tell_of_lacking(one, lacking[0])
            else:
                kept.append(one)
        return tuple(kept)

    @property
    def _lacking(self) -> list[Measured]:
        """What scripts and packages measure of other strings of the model; of this one it is no number."""
        return [one for one in self.model.measured if one not in self.measured]

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states. A state array has the phase, which is the angle of the
        drive, after them."""
        return self.names.states

    @cached_property
    def slope_names(self) -> tuple[str, ...]:
        """The states of which the equations give the slopes: velocities, then those of
        first order."""
        return self.names.moved

    @cached_property
    def pushed(self) -> tuple[str, ...]:
        """The velocities in whose slopes friction acts that is implicit; none where it is
        not."""
        return self.model.pushed(self.options) if self.options.implicit else ()

    @cached_property
    def turning(self) -> tuple[str, ...]:
        """The positions that are measured from the angle of the drive."""
        return self.model.turning(self.options)

    @cached_property
    def levels(self) -> tuple[Level, ...]:
        """The thresholds that continuation records, beside contacts."""
        grazing = [one.contact for one in self.model.description.grazing if one.contact not in self.model.contacts]
        if not grazing:
            return ()
        level = next((one.level for one in self.declaration.channels if one.value == BIT_SPEED), None)
        if level not in self.names.parameters:
            raise InputError(
                f"the model {self.model.name}: found the grazing of {grazing[0]}, which is none of its contacts; "
                f"allowed: a contact, or a channel of {BIT_SPEED} with a level that is a lane parameter, the speed "
                "below which the bit counts as stuck."
            )
        return (Level("bit", self.states.index(BIT_SPEED), self.names.parameters.index(str(level))),)

    def by_name(self, table: Array) -> dict[str, Array]:
        """The lane parameters of a table by their names."""
        # Along a ramp the table has more columns than names.
        return dict(zip(self.names.parameters, table.T, strict=False))

    # What is compiled.

    @cached_property
    def motion(self) -> Motion:
        """The equations with the names of what they read and give."""
        model, names = self.model, self.names
        return Motion(
            model.equations,
            self.options,
            names.states,
            names.parameters,
            self.slope_names,
            names.aux,
            self.pushed,
            model.contacts,
            model.solved if self.options.implicit else None,
            model.quick,
        )

    @cached_property
    def named(self) -> Mapping[str, Node]:
        """What the equations call by a name, and what scripts measure."""
        return {**self.motion.named(), **nodes_of(self.motion, self.measured)}

    def rows(self, observed: int = 0, *, tangent: bool = False, columns: int | None = None) -> Layout:
        """The layout of the lane buffer for an observer with ``observed`` rows, with a
        deviation beside the states if ``tangent``, and with ``columns`` lane parameters
        where there are more than those of the model."""
        states, slopes = len(self.states), self.slope_names
        tangent_states = states if tangent else 0
        return Layout(
            states + tangent_states,
            len(self.names.aux),
            len(self.names.parameters) if columns is None else columns,
            observed,
            tangent_states,
            self.names.first_order,
            implicit=sum(1 << slopes.index(name) for name in self.pushed),
        )

    def right_hand_side(self, lanes: int) -> Any:
        """The compiled right-hand side."""
        return self.motion.right_hand_side(lanes, self.rows())

    def tangent(self, lanes: int, place: int) -> Any:
        """The compiled right-hand side of the motion and of a deviation from it. The
        contact functions at the start of the step are in the observer's rows, from
        ``place`` on."""
        return self.motion.tangent(lanes, self.rows(tangent=True), place)

    @cached_property
    def seeks_jumps(self) -> bool:
        """Whether slopes may change in layers thinner than a step, for which deviations look: those of a script's
        model whose equations are more than polynomials and harmonics. Steps resolve those of strings that drill; of
        their explicit ones without contacts these are looked for all the same."""
        if self.model.description.drills:
            return not self.model.contacts and not self.rows(tangent=True).implicit
        return any(node.op not in NEVER_STEEP for node in graph_of(self.motion)[0].nodes)

    def contact_functions(self, lanes: int, place: int) -> Any:
        """Those of the gaps of the model's contacts."""
        if not self.model.contacts:

            @compiled(BUFFER)
            def none(b):  # type: ignore[no-untyped-def]
                pass

            return none
        return self.motion.contact_functions(lanes, self.rows(tangent=True), place)

    @cached_property
    def observed(self) -> int:
        """The number of rows of the observer, in every variant of the model."""
        widest = variant_of(self.model, self.model.widest).options
        return observed_rows(with_measures(self.model.declaration(widest), self.model.measured))

    def observer(self, lanes: int, *, tangent: bool = False, others: int = 0) -> tuple[Any, Any]:
        """The compiled (observer, marker); the buffer has a deviation beside the states
        if ``tangent``, and ``others`` rows of other observers."""
        rows = self.rows(self.observed + others, tangent=tangent)
        functions: tuple[Any, Any] = make_observer(lanes, rows, self.names, self.declaration)
        return functions

    # What differs from run to run, from the lane parameters: a table (n, columns).

    def state_scales(self, table: Array) -> Array:
        """The natural scale of each state, shape (n, states): the absolute tolerance is
        ``rtol`` times this."""
        scales = self.model.natural_scales(self.by_name(table), self.options)
        scaled = np.empty((len(table), len(scales)))
        for k, scale in enumerate(scales):
            scaled[:, k] = scale
        return scaled

    def frame_rates(self, table: Array) -> Array:
        """The rate of each position less its velocity, shape (n, slopes)."""
        rates = np.zeros((len(table), self.rows().own_slopes))
        for position, rate in self.model.frame_rates(self.by_name(table), self.options).items():
            rates[:, self.states.index(position) // 2] = rate
        return rates

    def phase_rate(self, table: Array) -> Array:
        """The rate of the phase [rad/s], shape (n,)."""
        return self.by_name(table)[self.model.set_speed]

    def first_step(self, table: Array) -> Array:
        """A first step [s], shape (n,)."""
        return np.asarray(0.01 / self.model.fastest(self.by_name(table), self.options))

    def runs(self, table: Array, initial: Array) -> Runs:
        """Runs with these lane parameters from these states."""
        from nsdrill.kernel.batch import Runs

        return Runs(
            table,
            self.state_scales(table),
            self.frame_rates(table),
            self.phase_rate(table),
            self.first_step(table),
            initial,
        )

    def dimension(self, table: Array, held: frozenset[str]) -> Array:
        """The dimension of the flow with these lane parameters, shape (n,): the states that
        move, those in ``held`` do not, with the phase where it has an effect on them
        (:meth:`nsdrill.equations.motion.Motion.dimension`)."""
        patterns, place = np.unique(table == 0.0, axis=0, return_inverse=True)
        names = self.names.parameters
        zeros = [frozenset(name for name, is_zero in zip(names, row, strict=False) if is_zero) for row in patterns]
        return np.array([self.motion.dimension(held, one) for one in zeros], dtype=int)[place.ravel()]

    # What is observed: ``outcome`` holds the observer's columns of finished runs.

    def store(self, lanes: int, record: Record, more: int = 0, parts: int = 1) -> Array:
        """The observer's store, with room for ``more`` numbers of other observers at
        its end; the section returns ``parts`` times in its spacing."""
        return new_store(lanes, self.names, self.declaration, record.peaks, record.poincare, more, parts)

    def outcome_width(self, record: Record) -> int:
        """The number of columns of an observer's outcome."""
        return outcome_width(self.names, self.declaration, record.peaks, record.poincare)

    def features(self, outcome: Array, table: Array, observe: Array | float) -> dict[str, Array]:
        """The features of finished runs by their names, each an array [n]; ``observe`` is
        the observation time [s]."""
        found = measured(self.names, self.declaration, outcome, table, self.state_scales(table), observe)
        for one in self._lacking:
            found |= {name: np.full(len(table), np.nan) for name in (*one.features, OUTRUN.format(one.name))}
        wanted = self.model.description.features
        if missing := [one.name for one in wanted if one.only is None and one.name not in found]:
            raise InputError(
                f"the model {self.model.name}: found {', '.join(missing)} among the features of its description; "
                "allowed: what its declaration measures."
            )
        # the others are steps on the way to these
        names = {HALF_DIFFERENCE, *(one.name for one in wanted)}
        return {name: values for name, values in found.items() if name in names}

    def peaks(self, outcome: Array, record: Record) -> dict[str, Array]:
        """The last local maxima by the names of their variables, each an array
        [n, peaks], NaN where fewer."""
        return peaks_of(self.declaration, outcome, record.peaks)

    def section(self, outcome: Array, record: Record, table: Array) -> dict[str, Array]:
        """The last returns to the Poincare section by the names of their variables,
        arrays [n, returns]."""
        returns = returns_of(self.names, self.declaration, outcome, record.peaks, record.poincare)
        by_name = dict(zip((*self.states, "drive_angle"), np.moveaxis(returns, -1, 0), strict=True))
        return self.model.section(by_name, self.by_name(table), self.options)

    # One trajectory.

    def outputs(self, points: Values, state: Mapping[str, Array]) -> dict[str, Array]:
        """The variables of a trace besides the states, from these with the angle of the
        drive, at one point or along time: those of the model, and what the equations call by
        the names of others that this string has."""
        about = self.model.description
        found, own = self.model.outputs(points, state), (None, MEASURED_BY_SCRIPT, *about.options(points.parameters))
        found |= {one.name: np.full_like(state["drive_angle"], np.nan) for one in self._lacking}
        known = {**state, **found}
        traced = [one.name for one in about.own_trace if one.only in own and one.name not in known]
        return {**found, **self.quantities(points, known, *traced)}

    def quantities(self, points: Values, state: Mapping[str, Array], *names: str) -> dict[str, Array]:
        """What the equations call by these ``names``, at states with the angle of the
        drive."""
        named = self.named
        if missing := [name for name in names if name not in named]:
            raise InputError(
                f"the model {self.model.name}: found {', '.join(missing)} in its traces; allowed: states, names in its "
                "equations, and what a function outputs(points, state) of its own returns."
            )
        if not names:
            return {}
        columns = self.model.columns(points, Thresholds())
        given = {"time": 0.0, "phase": state["drive_angle"]}
        given |= {f"s.{name}": state[name] for name in self.states}
        given |= {f"p.{name}": columns[name] for name in self.names.parameters}
        zero = np.zeros_like(state["drive_angle"])
        found = plain.values({name: named[name] for name in names}, given)
        return {name: value + zero for name, value in found.items()}

    def jumps(self, points: Values) -> tuple[str, ...]:
        """The velocities at whose zero the slopes jump, towards zero on either side, with all
        other states zero: where the motion stays, steps become ever shorter."""
        columns, wanted = self.model.columns(points, Thresholds()), self.motion.slopes_named()
        given: dict[str, Any] = {"time": 0.0, "phase": 0.0}
        given |= {f"s.{name}": 0.0 for name in self.states}
        given |= {f"p.{name}": np.asarray(columns[name], dtype=float).ravel()[0] for name in self.names.parameters}

        def ends(name: str, size: float) -> tuple[float, float]:
            found = (plain.values({name: wanted[name]}, given | {f"s.{name}": end})[name] for end in (-size, size))
            before, after = (float(value) for value in found)
            return before, after

        jumping = []
        for name in self.slope_names[: len(self.slope_names) - self.names.first_order]:
            (before, after), (low, high) = ends(name, LEAST_VELOCITY), ends(name, SMALL_VELOCITY)
            if after < 0.0 < before and before - after > 0.5 * abs(low - high):
                jumping.append(name)
        return tuple(jumping)
