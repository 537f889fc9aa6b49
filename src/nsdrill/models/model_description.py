"""The description of a model, for the parts of the package that do not compute with it:
its sections of a study, its variables, its pictures.

A description does not import the compiler, so a study is checked and a file is shown
without waiting for it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from nsdrill.data import Array, Attributes
from nsdrill.models import of_results
from nsdrill.models.operation import Numeric, OperatingPoint, Values
from nsdrill.models.responses import (
    BIT_SPEEDS,
    RESPONSES,
    General,
    Response,
    Thresholds,
    made_of,
    misread,
    own,
    severity_labels,
    with_sections,
)
from nsdrill.models.rules import Order, Reads, Rule
from nsdrill.models.starts import Starts
from nsdrill.records import dataclass
from nsdrill.sampling import Pair
from nsdrill.units import cf_units
from nsdrill.variables import AXES, CHECKS, OK, UNMEASURED, Variable, declare_operated, in_trace, short_key

_OPERATION = {
    "rotary_speed": in_trace("drive_speed", "rad s-1", "speed of the drive", label="Drive speed"),
    "wob": in_trace("wob", "N", "weight on bit", label="Weight on bit"),
    "depth": in_trace("depth", "m", "measured depth", label="Measured depth"),
}


_OPEN: Any = None  # follows from the rest of a description


def _thresholds_again(model: Description, numbers: Mapping[str, Any]) -> Any:
    return made_of(model.thresholds, numbers)


@dataclass(frozen=True)
class Grazing:
    """A special point of a branch at which a motion begins to touch a ``contact`` of
    the model, or to leave it: ``when`` is "reached" (the motion does not touch it on
    one side of the point) or "lost" (it never leaves it on one side). ``code`` (above
    100), ``name`` and ``words``, the meaning for drilling, are those of files and of
    ``show``; ``border`` is the word for its curve in a study."""

    code: int
    name: str
    contact: str
    when: str
    words: str
    border: str = ""


STICK_ONSET = Grazing(
    104, "stick_onset", "bit", "reached", "the bit begins to stick, or ceases to: a threshold and no bifurcation"
)


@dataclass(frozen=True)
class Panel:
    """The motion of one ``mode`` (axial, torsional, lateral) along an axis: the
    variable ``trace`` of a trace, its last ``peaks`` in results, and the feature
    ``greatest``, which is the constant value where there are no peaks."""

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
    ``attractors``: features of attractors, each (least or None, greatest, words);
    ``values``: the features that are first in the list of kinds, by the names of these
    kinds; ``signed``: those with a line at zero. The set speed is drawn where ``speed``
    is, the wall of the hole where ``radius`` is, the path of the collar centre where
    ``x`` and ``y`` are among the variables; the angle of the bit is the sum of
    ``angle``.

    ``modes`` gives the mode to which a variable belongs, where a study may freeze
    modes; the variable is not drawn while that mode is frozen. A panel has its own
    mode. ``collar`` is the key of the outer diameter of the collar whose centre is at
    ``x`` and ``y``, where it may be drawn in the hole to scale.
    """

    panels: tuple[Panel, ...] = ()
    histories: tuple[str, ...] = ()
    planes: tuple[tuple[str, str], ...] = ()
    section: tuple[str, ...] = ()
    section_planes: tuple[tuple[str, str], ...] = ()
    summary: tuple[str, ...] = ()
    attractors: tuple[tuple[str | None, str, str], ...] = ()
    values: Mapping[str, str] = field(default_factory=dict)
    signed: tuple[str, ...] = ()
    speed: str = "bit_speed"
    angle: tuple[str, ...] = ("twist", "drive_angle")
    radius: str = "radius"
    modes: Mapping[str, str] = field(default_factory=dict)
    collar: str | None = None

    def without(self, frozen: Collection[str]) -> Drawn:
        """The same for a string whose modes ``frozen`` are frozen."""
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
            attractors=tuple(entry for entry in self.attractors if moves(entry[1])),
        )

    @property
    def peaks(self) -> tuple[str, ...]:
        """The variables of last maxima."""
        return tuple(panel.peaks for panel in self.panels)


@dataclass(frozen=True, eq=False)
class Description:
    """The words and tables of a model.

    Study
        ``parameters`` is the dataclass tree of the model's numbers, each field a
        section of the study; ``initial`` that of its start; ``operation`` the operating
        point with the model's own defaults, by default that of the parameters.
        ``meanings`` describes each key of these in one line. ``orders`` and
        ``rules`` are what values must satisfy together. ``units_by`` has the keys whose
        units depend on a choice: (key of the choice, its words with their units).
        ``compiled`` are keys of whole numbers that are fixed when the model is
        compiled, and may still be an axis. The template of a study shows
        ``example_axis``, a key with a least and a greatest value, and
        ``example_slice``.
    States
        ``states`` gives the names of the states of a string with these parameters, the
        angle of the drive last; by default those of the start. They are one of
        ``several_states``, where not all strings have the same; where their number
        depends on the parameters, ``states_allowed`` says whether a file may have such
        states. A slice of starts may vary the states ``sliced``, or where there are none those
        that the start gives.
    Variables
        ``labels`` follow ``response``; the severities of the responses that are not among
        them come after. ``response`` has a bit for each of ``responses``, those that the
        model can show: names of those of a drill string, of which ``stalled`` is
        among them wherever a bit that turns is measured, and
        :class:`nsdrill.models.responses.Response` for its own; :attr:`critical` has them
        by name. ``check_features`` are the features from which the
        responses are made, by default all of those that are measured, ``shown`` those whose range ``show`` prints,
        ``distinguishing`` those that are printed for an attractor. ``derived`` are
        variables made from the features and the numbers of the study
        (:meth:`nsdrill.models.base.Model.derived`). ``own_trace`` has the variables of
        a trace, ``untraced`` the states that a trace leaves out. ``options`` gives
        words for what such a string has beside the usual: a feature whose ``only`` is
        one of them exists only then. ``attributes`` gives root attributes of a file
        from parameters, initial state and axes. ``clocked`` is that the time is a value of
        its equations, or of what is measured, and no forcing that repeats.
    Comparison
        The features ``compared`` are those by which two runs of a point are compared,
        and the starts of a point distinguished, each in the scale of this name
        (:meth:`nsdrill.models.base.Model.scales`), None for a fraction of time;
        ``grouped`` are more features that distinguish starts.
    Friction
        ``friction_rates`` gives, for points (:class:`nsdrill.models.operation.Values`),
        the rate at which friction at its steepest brakes a slip [1/s], a number or an
        array by the key that makes it steep. ``explicit_only`` gives, for parameters,
        the reason why their friction cannot be integrated implicitly, None where it
        can. Both follow from the equations by default.
    Pictures and modules
        ``drawn`` is what pictures show; ``hole`` gives the radii [m] of the hole and of
        the collar in it, where the path of the collar centre is that in a round hole.
        ``grazing`` are special points of continuation at the model's contacts.
        ``checks`` and ``charts`` are the names of the modules for ``nsdrill check`` and
        for charts.
    """

    name: str
    title: str
    parameters: type
    initial: type[Starts]
    meanings: Mapping[str, str]
    features: tuple[Variable, ...]
    own_trace: tuple[Variable, ...]
    states: Callable[[Any], tuple[str, ...]] = _OPEN
    states_allowed: Callable[[tuple[str, ...]], bool] | None = None
    sliced: tuple[str, ...] = ()
    untraced: tuple[Variable, ...] = ()
    operation: type[OperatingPoint] = _OPEN
    labels: tuple[Variable, ...] = ()
    derived: tuple[Variable, ...] = ()
    peaks: tuple[Variable, ...] = ()
    section: tuple[Variable, ...] = ()
    responses: tuple[str | Response, ...] = _OPEN
    check_features: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    several_states: tuple[tuple[str, ...], ...] = ()
    compared: Mapping[str, str | None] = field(default_factory=dict)
    grouped: tuple[str, ...] = ()
    distinguishing: tuple[str, ...] = ()
    orders: tuple[Order, ...] = ()
    rules: tuple[Rule | Reads, ...] = ()
    units_by: Mapping[str, tuple[str, Mapping[str, str]]] = field(default_factory=dict)
    compiled: tuple[str, ...] = ()
    grazing: tuple[Grazing, ...] = ()
    example_axis: tuple[str, str, str] = ("", "", "")
    example_slice: str = ""
    attributes: Callable[[Any, Any, Mapping[str, Array]], Attributes] | None = None
    clocked: bool = False
    hole: Callable[[Any], tuple[float, float]] | None = None
    options: Callable[[Any], tuple[str, ...]] = lambda _: ()
    friction_rates: Callable[[Values], Mapping[str, Numeric]] | None = None
    explicit_only: Callable[[Any], str | None] | None = None
    checks: str = ""
    charts: str = ""
    drawn: Drawn = field(default_factory=Drawn)

    def __post_init__(self) -> None:
        if self.states is _OPEN:
            self._set("states", lambda parameters: self.initial.states())
        if self.operation is _OPEN:
            self._set("operation", self.point)
        if self.responses is _OPEN:
            self._set("responses", tuple(RESPONSES) if self.drills else ())
        declare_operated(self.operation.names())
        if unknown := [one for one in self.responses if isinstance(one, str) and one not in RESPONSES]:
            raise ValueError(
                f"responses: found {', '.join(map(str, unknown))}; allowed: {', '.join(RESPONSES)}, or a Response of "
                "its own"
            )
        measured = {variable.name for variable in self.features}
        if "stalled" not in self.responses and measured & {RESPONSES[one].feature for one in ("stalled", "stick_slip")}:
            self._set("responses", (*self.responses, "stalled"))
        labelled = {variable.name for variable in self.labels}
        graded = (one.severity for one in self.critical.values() if one.severity is not None)
        self._set("labels", (*self.labels, *(one for one in graded if one.name not in labelled)))
        if not self.check_features:
            found = (one.feature for one in self.critical.values() if one.feature in measured)
            self._set("check_features", tuple(dict.fromkeys(found)))

    def _set(self, attribute: str, value: object) -> None:
        object.__setattr__(self, attribute, value)

    @cached_property
    def critical(self) -> dict[str, Response]:
        """The critical responses that it can show, by name, its own complete. ValueError
        where one of these cannot be one."""
        features = {variable.name: variable for variable in self.features}
        found: dict[str, Response] = {}
        letters = {RESPONSES[one].letter if isinstance(one, str) else one.letter for one in self.responses}
        for one in self.responses:
            if isinstance(one, str):
                found[one] = RESPONSES[one]
            elif one.feature not in features:
                raise ValueError(
                    f"responses: found {one.name}, and no feature {one.feature}, which tells whether it is there; "
                    "allowed: that feature in the declaration and the description"
                )
            else:
                place = sum(other.is_own for other in found.values())
                found[one.name] = own(one, features[one.feature], place, letters)
                letters.add(found[one.name].letter)
        if len({one.bit for one in found.values()}) != len(found):
            raise ValueError(f"responses: found a bit twice among {', '.join(found)}; allowed: each once")
        return found

    def __str__(self) -> str:
        return self.name

    def unknown(self) -> list[str]:
        """The names in it that are not among its own variables, as ``drawn.panels:
        twist_max``."""
        drawn, names = self.drawn, {variable.name for variable in self.variables}
        measured = {variable.name for variable in self.features}
        traced = {variable.name for variable in self.trace}
        uses: dict[str, tuple[Iterable[str], set[str]]] = {
            "check_features": (self.check_features, names),
            "shown": (self.shown, names),
            "distinguishing": (self.distinguishing, names),
            "compared": (self.compared, measured),
            "grouped": (self.grouped, measured),
            "drawn.panels": ((name for panel in drawn.panels for name in (panel.peaks, panel.greatest)), names),
            "drawn.panels of a trace": ((panel.trace for panel in drawn.panels), traced),
            "drawn.histories": (drawn.histories, traced),
            "drawn.planes": ((name for plane in drawn.planes for name in plane), traced),
            "drawn.section": (drawn.section, names),
            "drawn.section_planes": ((name for plane in drawn.section_planes for name in plane), names),
            "drawn.summary": (drawn.summary, names),
            "drawn.attractors": ((name for entry in drawn.attractors for name in entry[:2] if name), names),
        }
        return [f"{where}: {name}" for where, (used, defined) in uses.items() for name in used if name not in defined]

    @cached_property
    def labelled(self) -> tuple[str, ...]:
        """The features from which the responses and their severities are made."""
        measured = {variable.name for variable in self.features}
        graded = (one.graded for one in self.critical.values())
        return tuple(dict.fromkeys(name for name in (*self.check_features, *graded) if name in measured))

    def status_of(self, status: Array, features: Mapping[str, Array], prefix: str = "") -> Array:
        """The ``status`` of runs with these ``features``, whose names may have a
        ``prefix``. A run that ended well is unmeasured, so that nothing is known of its
        response, where one of those that decide on it is no number (NaN), or none that can
        be measured (:func:`nsdrill.models.responses.misread`)."""
        found = [features[prefix + name] for name in self.labelled if prefix + name in features]
        lacks = np.any([np.isnan(values) for values in found], axis=0) if found else False
        here = {name.removeprefix(prefix): one for name, one in features.items() if name.startswith(prefix)}
        # of a check the mean bit speed is not kept
        if prefix:
            here = {**here, "bit_speed_mean": np.zeros(np.shape(status))}
        lacks = lacks | misread(here, self.critical.values())
        return np.where((status == OK) & lacks, UNMEASURED, status).astype(status.dtype)

    @cached_property
    def status_features(self) -> tuple[str, ...]:
        """The features that :meth:`status_of` reads."""
        measured = {variable.name for variable in self.features}
        return (*self.labelled, *(name for name in BIT_SPEEDS if name in measured and name not in self.labelled))

    @cached_property
    def pairs(self) -> tuple[Pair, ...]:
        """The :attr:`orders` as those of unknowns."""
        return tuple(Pair(short_key(one.lower), short_key(one.upper), one.equal, one.factor) for one in self.orders)

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
        """The sets of states that strings of this model may have, the usual one
        first."""
        return self.several_states or (self.states(self.parameters()),)

    @property
    def all_states(self) -> tuple[str, ...]:
        """The largest of the :attr:`state_sets`."""
        return max(self.state_sets, key=len)

    def may_have(self, states: tuple[str, ...]) -> bool:
        """Whether a string of this model may have these states, by their names in
        order."""
        return states in self.state_sets or (self.states_allowed is not None and self.states_allowed(states))

    @cached_property
    def axes(self) -> tuple[str, ...]:
        """Those of :data:`nsdrill.variables.AXES` that its operating point has."""
        names = self.operation.names()
        return tuple(name for name in AXES if name in names)

    @cached_property
    def _operated(self) -> tuple[Variable, ...]:
        """The variables of a trace that are the operating point."""
        own = [item for item in fields(self.operation) if item.name not in AXES]
        return (
            *(variable for name, variable in _OPERATION.items() if name in self.axes),
            *(
                in_trace(one.name, cf_units(one.metadata["units"]), self.words_of(f"operation.{one.name}"))
                for one in own
            ),
        )

    @property
    def point(self) -> type[OperatingPoint]:
        """The class of an operating point."""
        return getattr(self.parameters, "point", OperatingPoint)

    @property
    def drills(self) -> bool:
        """Whether it is a string that drills: its operating point has depth, weight on bit
        and rotary speed."""
        return self.axes == AXES

    @cached_property
    def thresholds(self) -> type:
        """The thresholds of its labels, the section ``classify`` of a study."""
        built_in = self.drills or not RESPONSES.keys().isdisjoint(self.critical)
        base = Thresholds if built_in else General
        found = [one for one in self.critical.values() if one.is_own]
        return with_sections(base, found, _thresholds_again, self) if found else base

    def words_of(self, key: str) -> str:
        """What a key of its operating point means, in words: its name where nothing says
        more."""
        name = key.removeprefix("operation.")
        about = {item.name: item.metadata.get("meaning", "") for item in fields(self.operation)}
        words = self.meanings.get(key) or about.get(name) or name.replace("_", " ")
        return words[:1].lower() + words[1:]

    @property
    def trace(self) -> tuple[Variable, ...]:
        """Every variable of a trace, in the order of files: those of the model, then
        the operating point."""
        own = {variable.name for variable in self.own_trace}
        return (*self.own_trace, *(variable for variable in self._operated if variable.name not in own))

    @property
    def trace_and_states(self) -> tuple[Variable, ...]:
        """Every variable of a trace, then the states that it leaves out."""
        return (*self.trace, *self.untraced)

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """Every variable of a results file, in its order."""
        checks = (
            of_results.variables_of_check(check, self.critical, self.features, self.check_features) for check in CHECKS
        )
        return (
            of_results.STATUS,
            of_results.responses_label(self.critical),
            *self.labels,
            *of_results.LABELS,
            *self.features,
            *self.derived,
            *of_results.MEASURED,
            *(variable for check in checks for variable in check),
            *of_results.RUN,
            *self.peaks,
            *self.section,
            *of_results.STATES,
        )

    @property
    def severities(self) -> tuple[str, ...]:
        """The labels that grade a response."""
        graded = severity_labels(self.critical.values())
        return tuple(variable.name for variable in self.labels if variable.name in graded)
