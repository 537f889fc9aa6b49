"""What a model tells those who do not compute with it: its sections of a study, its
variables, its pictures.

A description imports nothing that compiles, so a study is checked and a file is shown
without waiting for a compiler.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

from nsdrill.models.operation import Operation
from nsdrill.variables import CHECKS, POINT, RESPONSES, Variable, feature, flag, in_trace, responses

_OPERATION = (
    in_trace("drive_speed", "rad s-1", "top-drive speed"),
    in_trace("wob", "N", "weight on bit"),
    in_trace("depth", "m", "measured depth"),
)
_CHECKED = {"tight": "with a smaller tolerance", "long": "when continued for longer"}


@dataclass(frozen=True)
class Order:
    """Of two keys the value of ``lower`` is less than that of ``upper`` times
    ``factor``, or ``equal`` to it; where a study gives both, ``blamed`` says which of
    them is at fault. ``words`` say what ``lower`` is, in a message."""

    lower: str
    upper: str
    equal: bool = False
    blamed: str = "upper"
    factor: float = 1.0
    words: str = ""


@dataclass(frozen=True)
class Grazing:
    """A special point of a branch at which a motion begins to touch a ``contact`` of
    the model, or to leave it: ``when`` is "reached" (it did not touch before) or "lost"
    (it never left it before). ``code`` (above 100), ``name`` and ``words``, what it
    means for drilling, are those of files and of ``show``; ``border`` is the word by
    which a study asks for its curve."""

    code: int
    name: str
    contact: str
    when: str
    words: str
    border: str = ""


STICK_ONSET = Grazing(
    104,
    "stick_onset",
    "bit",
    "reached",
    "the bit begins to stick, or ceases to: a threshold and no bifurcation",
)


@dataclass(frozen=True)
class Panel:
    """The motion of one ``mode`` (axial, torsional, lateral) along an axis: the
    variable ``trace`` of a trace, its last ``peaks`` in results, and the feature
    ``greatest``, which is the constant value where there are none."""

    mode: str
    trace: str
    peaks: str
    greatest: str


@dataclass(frozen=True)
class Drawn:
    """What pictures show of a model, by the names of its variables.

    ``panels`` of a bifurcation diagram; ``histories`` of a trace against time;
    ``planes`` of a trace, pairs (position, velocity); ``section`` variables along an
    axis and ``section_planes``, pairs of them; ``summary``: features along one axis;
    ``attractors``: features of attractors, each (least or None, greatest, words). The
    set speed is drawn where ``bit_speed`` is, the wall of the hole where ``radius`` is,
    the path of the collar centre where ``x`` and ``y`` are among the variables.

    ``modes`` says to which mode a variable belongs, where a study may freeze modes; it
    is not drawn of a string without that mode. A panel names its own. ``collar`` is the
    key of the outer diameter of the collar whose centre is at ``x`` and ``y``, where it
    may be drawn in the hole to scale.
    """

    panels: tuple[Panel, ...] = ()
    histories: tuple[str, ...] = ()
    planes: tuple[tuple[str, str], ...] = ()
    section: tuple[str, ...] = ()
    section_planes: tuple[tuple[str, str], ...] = ()
    summary: tuple[str, ...] = ()
    attractors: tuple[tuple[str | None, str, str], ...] = ()
    modes: Mapping[str, str] = field(default_factory=dict)
    collar: str | None = None

    def without(self, frozen: Collection[str]) -> Drawn:
        """The same of a string whose modes ``frozen`` stand still."""
        if not frozen:
            return self

        def moves(name: str) -> bool:
            return self.modes.get(name) not in frozen

        return replace(
            self,
            panels=tuple(panel for panel in self.panels if panel.mode not in frozen),
            histories=tuple(filter(moves, self.histories)),
            planes=tuple(plane for plane in self.planes if all(map(moves, plane))),
            section=tuple(filter(moves, self.section)),
            section_planes=tuple(plane for plane in self.section_planes if all(map(moves, plane))),
            summary=tuple(filter(moves, self.summary)),
            attractors=tuple(one for one in self.attractors if moves(one[1])),
        )

    @property
    def peaks(self) -> tuple[str, ...]:
        """The variables of last maxima."""
        return tuple(panel.peaks for panel in self.panels)


@dataclass(frozen=True)
class Description:
    """The words and tables of a model.

    ``parameters`` is the dataclass tree of its numbers, each field a section of the
    study; ``initial`` that of its start, ``operation`` the operating point with the
    model's own defaults; ``meanings`` says in one line what each key of these means.
    ``states`` gives the names of the states that a string with these parameters has,
    the angle of the drive last: one of ``several_states``, where not all strings have
    the same; where their number depends on the parameters, ``states_allowed`` tells
    whether a file may have such states. A slice of starts may vary all, or those that
    are ``sliced``. ``own_trace`` has the variables of a trace, ``untraced`` the states
    that a trace leaves out. ``options`` gives the words of what such a string has
    beside the usual: a feature whose ``only`` is one of them is there only then.

    ``labels`` stand after ``response``, which has a bit for each of ``responses``,
    those that the model can show; ``check_features`` are the features from which the
    responses are made, ``shown`` those whose range ``show`` prints, ``told`` those that
    are told of an attractor. By the features ``compared`` two runs of a point are
    compared, and the starts of a point told apart, each in the scale of this name
    (:meth:`nsdrill.models.base.Model.scales`), None for a fraction of time; ``grouped``
    are more features by which starts are told apart. ``derived`` are variables made
    from the features and the numbers of the study
    (:meth:`nsdrill.models.base.Model.derived`).

    ``orders`` and ``constraints`` say what values must satisfy together:
    ``constraints(check)`` yields the faults of a study, ``check`` is a
    :class:`nsdrill.study.constraints.Checker`. ``units_by`` has the keys whose units
    depend on a choice: (key of the choice, its words with their units). ``grazing`` are
    special points of continuation at the model's contacts. ``compiled`` are keys of
    whole numbers that are fixed when the model is compiled, and may be an axis all the
    same. The template of a study shows ``example_axis``, a key with a least and a
    greatest value, and ``example_slice``. ``attributes`` gives root attributes of a
    file from parameters, initial state and axes. ``hole`` gives the radii [m] of the
    hole and of the collar in it, where the path of the collar centre is that in a round
    hole. ``friction_rates`` gives of points (:class:`nsdrill.models.leaves.Values`) how
    fast friction at its steepest brakes a slip [1/s], a number or an array by the key
    that makes it steep; ``explicit_only`` says of parameters why their friction cannot
    be integrated implicitly, None where it can.
    """

    name: str
    title: str
    parameters: type
    initial: type
    meanings: Mapping[str, str]
    states: Callable[[Any], tuple[str, ...]]
    features: tuple[Variable, ...]
    own_trace: tuple[Variable, ...]
    states_allowed: Callable[[tuple[str, ...]], bool] | None = None
    sliced: tuple[str, ...] = ()
    untraced: tuple[Variable, ...] = ()
    operation: type[Operation] = Operation
    labels: tuple[Variable, ...] = ()
    derived: tuple[Variable, ...] = ()
    peaks: tuple[Variable, ...] = ()
    section: tuple[Variable, ...] = ()
    responses: tuple[str, ...] = RESPONSES
    check_features: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    several_states: tuple[tuple[str, ...], ...] = ()
    compared: Mapping[str, str | None] = field(default_factory=dict)
    grouped: tuple[str, ...] = ()
    told: tuple[str, ...] = ()
    orders: tuple[Order, ...] = ()
    constraints: Callable[[Any], Iterator[Any]] | None = None
    units_by: Mapping[str, tuple[str, Mapping[str, str]]] = field(default_factory=dict)
    compiled: tuple[str, ...] = ()
    grazing: tuple[Grazing, ...] = ()
    example_axis: tuple[str, str, str] = ("", "", "")
    example_slice: str = ""
    attributes: Callable[[Any, Any, Mapping[str, Any]], dict[str, Any]] | None = None
    hole: Callable[[Any], tuple[float, float]] | None = None
    options: Callable[[Any], tuple[str, ...]] = lambda _: ()
    friction_rates: Callable[[Any], Mapping[str, Any]] = lambda _: {}
    explicit_only: Callable[[Any], str | None] = lambda _: "this model does not keep friction apart"
    checks: str = ""
    charts: str = ""
    drawn: Drawn = field(default_factory=Drawn)

    def unknown(self) -> list[str]:
        """What it names that is none of its own variables: ``drawn.panels:
        twist_max``."""
        drawn, names = self.drawn, {variable.name for variable in self.variables}
        traced = {variable.name for variable in self.trace}
        named: dict[str, tuple[Iterable[str], set[str]]] = {
            "check_features": (self.check_features, names),
            "shown": (self.shown, names),
            "told": (self.told, names),
            "compared": (self.compared, names),
            "drawn.panels": (
                (name for one in drawn.panels for name in (one.peaks, one.greatest)),
                names,
            ),
            "drawn.panels of a trace": ((one.trace for one in drawn.panels), traced),
            "drawn.histories": (drawn.histories, traced),
            "drawn.planes": ((name for plane in drawn.planes for name in plane), traced),
            "drawn.section": (drawn.section, names),
            "drawn.section_planes": (
                (name for plane in drawn.section_planes for name in plane),
                names,
            ),
            "drawn.summary": (drawn.summary, names),
            "drawn.attractors": (
                (name for one in drawn.attractors for name in one[:2] if name),
                names,
            ),
        }
        return [
            f"{where}: {name}"
            for where, (those, own) in named.items()
            for name in those
            if name not in own
        ]

    @property
    def deciding(self) -> frozenset[str]:
        """The keys of the choices that decide the units of another key."""
        return frozenset(choice for choice, _ in self.units_by.values())

    @property
    def sections(self) -> dict[str, type]:
        """The sections of the study that hold the parameters, in file order."""
        return {item.name: item.default_factory for item in fields(self.parameters)}  # type: ignore[misc]

    @cached_property
    def state_sets(self) -> tuple[tuple[str, ...], ...]:
        """The states that strings of this model may have, the usual ones first."""
        return self.several_states or (self.states(self.parameters()),)

    @property
    def all_states(self) -> tuple[str, ...]:
        """Every state that a string of this model may have."""
        return max(self.state_sets, key=len)

    def may_have(self, states: tuple[str, ...]) -> bool:
        """Whether a string of this model may have these states, by their names in
        order."""
        return states in self.state_sets or (
            self.states_allowed is not None and self.states_allowed(states)
        )

    @property
    def trace(self) -> tuple[Variable, ...]:
        """Every variable of a trace, in the order of files: those of the model, then
        the operating point."""
        own = {variable.name for variable in self.own_trace}
        return (*self.own_trace, *(variable for variable in _OPERATION if variable.name not in own))

    @property
    def trace_and_states(self) -> tuple[Variable, ...]:
        """Every variable of a trace, then the states that it leaves out."""
        return (*self.trace, *self.untraced)

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """Every variable of a results file, in its order."""
        return (
            Variable(
                "status",
                "i1",
                "1",
                "how the run ended",
                "run",
                flag_values=(0, 1, 2, 3, 4, 5),
                flag_meanings="pending ok diverged step_limit step_underflow inferred",
            ),
            responses("response", "critical responses present", self.responses),
            *self.labels,
            flag("settled", "both halves of the observed window agree", "unsettled settled"),
            flag(
                "motion",
                "kind of motion",
                "undetermined equilibrium periodic quasi_periodic chaotic unsettled",
                "returns",
            ),
            Variable(
                "period",
                "i2",
                "1",
                "period in returns to the Poincare section, 0 where there is none",
                "label",
                only="returns",
            ),
            Variable(
                "attractor",
                "i2",
                "1",
                "attractor of the start, numbered alike along the axes: 1 has most starts, 0 none",
                "label",
                only="starts",
            ),
            *self.features,
            *self.derived,
            feature(
                "half_difference",
                "1",
                "largest disagreement between the halves of the observed window",
            ),
            feature(
                "zero_one",
                "1",
                "0-1 test for chaos on the returns: near 0 regular, near 1 chaotic",
                "returns",
            ),
            feature("lyapunov_exponent", "s-1", "largest Lyapunov exponent", "exponent"),
            feature(
                "lyapunov_error",
                "s-1",
                "standard error of the largest Lyapunov exponent",
                "exponent",
            ),
            flag(
                "trusted",
                "both checks find the same response and nearly the same features",
                "untrusted trusted",
                "verify",
            ),
            *(variable for check in CHECKS for variable in self._check(check)),
            Variable(
                "method",
                "i1",
                "1",
                "how friction was integrated",
                "run",
                flag_values=(0, 1),
                flag_meanings="explicit implicit",
                only="method",
            ),
            Variable("steps", "i8", "1", "accepted steps", "run"),
            Variable("rejected", "i8", "1", "rejected steps", "run"),
            *self.peaks,
            *self.section,
            Variable(
                "initial_state",
                "f8",
                "",
                "state at the start of the run",
                "states",
                (*POINT, "state"),
            ),
            Variable(
                "final_state", "f8", "", "state at the end of the run", "states", (*POINT, "state")
            ),
        )

    def _check(self, name: str) -> tuple[Variable, ...]:
        """What is known of the point from one of its checks."""
        how = _CHECKED[name]
        units = {variable.name: variable.units for variable in self.features}
        return (
            responses(f"{name}_response", f"critical responses {how}", self.responses, "verify"),
            Variable(
                f"{name}_difference",
                "f8",
                "1",
                f"largest difference of the features {how}, in natural scales",
                "trust",
                only="verify",
            ),
            Variable(
                f"{name}_status",
                "i1",
                "1",
                f"how the run ended {how}",
                "trust",
                flag_values=(0, 1, 2, 3, 4),
                flag_meanings="unchecked ok diverged step_limit step_underflow",
                only="verify",
            ),
            *(
                Variable(f"{name}_{one}", "f8", units[one], f"{one} {how}", "trust", only="verify")
                for one in self.check_features
            ),
        )

    @property
    def severities(self) -> tuple[str, ...]:
        """The labels that grade a response."""
        return tuple(v.name for v in self.labels if v.name.endswith("_severity"))
