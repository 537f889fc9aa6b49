"""The decorator that makes a model of a function, and what it returns: the function, and
studies of its model by the names of its own arguments."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import update_wrapper
from numbers import Real
from types import FunctionType
from typing import Any, NoReturn, overload

import numpy as np

from nsdrill.errors import InputError
from nsdrill.models.own_parts import read_again, remember
from nsdrill.models.own_quantities import Measured
from nsdrill.models.registry import Scripted, described, register
from nsdrill.models.responses import Response
from nsdrill.observe import channels
from nsdrill.origin import origin_of
from nsdrill.script.critical import FORM, check_again, digest_with, parts_with, response_of
from nsdrill.script.described import description_of
from nsdrill.script.function_channels import ENDS
from nsdrill.script.function_model import FunctionModel
from nsdrill.script.quantities import ends_of, measured
from nsdrill.script.reading import Reading, read
from nsdrill.study.keys import Keys, Leaf, did_you_mean, keys_named
from nsdrill.study.load import parse_study
from nsdrill.study.study import Studied, Study
from nsdrill.study.uncertain import HOW

# sections whose keys go by their last word, those of the first before those of the second
SHORT = ("parameters", "initial", "simulation", "record"), ("classify",)
SOURCE = "the study"  # the name in messages


class Declared(Studied):
    """A model of a function: called as that is, with numbers, it gives numbers."""

    __name__: str

    def __init__(
        self, function: FunctionType, title: str, responses: Mapping[str, Any] | None = None, orders: Sequence[str] = ()
    ) -> None:
        self.function, self.title, self.orders = function, title, orders
        self.measures: tuple[Measured, ...] = ()
        update_wrapper(self, function)
        self.reading = read(function)
        self.responses = _short(self.reading, {} if responses is None else responses)
        self.origin = origin_of(function)
        self.is_current = False  # while it makes a study, for which it has been read
        self.register()
        remember(f"model {self.__name__}", self.read_again)

    def __call__(self, *args: Any, **named: Any) -> Any:
        return self.function(*args, **named)

    def __repr__(self) -> str:
        return f"<the model {self.__name__}>"

    def read_again(self) -> None:
        """Read the function again, where what it reads has another value."""
        if self.is_current:
            return
        reading = read(self.function, self.measures)
        if reading.digest != self.reading.digest:
            self.reading = reading
            self.register()

    def register(self) -> None:
        """Make it known under its name, as it was read."""
        about = {one.feature for one in self.responses}
        judged = (name for name in self.reading.states if about & {f"{name}_{end}" for end in ENDS})
        reading = replace(self.reading, judged=frozenset(judged))
        self.model = FunctionModel(reading)
        description = description_of(reading, self.model, self.title, self.responses, self.orders)
        _check(reading, self.model)
        digest = digest_with(reading, description.critical.values(), self.orders)
        parts = parts_with(reading, tuple(description.critical.values()), self.orders)
        register(Scripted(description, self.model, digest, self.origin, parts))

    def feature(
        self,
        name: str,
        units: str = "",
        meaning: str = "",
        *,
        greatest: bool = False,
        least: bool = False,
        mean: bool = False,
    ) -> Callable[[FunctionType], FunctionType]:
        """Measure what a function gives, as a decorator above its ``def``: of states, of
        parameters, and of what the equations give a name to, by the names of its arguments.
        Features are ``name_max``, ``name_min`` and ``name_mean``, of the ends that are true,
        or all. InputError where it reads another name, or the name is one of a feature."""

        ends = ends_of(f"{self.__name__}.feature", name, greatest=greatest, least=least, mean=mean)

        def decorated(function: FunctionType) -> FunctionType:
            new = measured(function, name, units, meaning, ends, self.measures)
            before = self.reading
            measures = (*self.measures, new)
            self.reading = read(self.function, measures)
            try:
                self.register()
            except BaseException:
                self.reading = before
                self.register()
                raise
            self.measures = measures
            return function

        return decorated

    def response(
        self,
        name: str,
        feature: str,
        threshold: float | str,
        *,
        limits: Mapping[str, float | str] | None = None,
        words: str = "",
        letter: str = "",
        colour: str = "",
        marker: str = "",
    ) -> None:
        """Call a motion critical where a feature of the model, also one of its own, is
        above a threshold: a number [SI] or a text with a unit. ``limits`` are words with
        the lower bounds of up to four bands of severity; a response without them is never
        safe. ``words``, a capital ``letter``, a ``colour`` (#AA3377) and a ``marker`` stand
        for it on pictures. In a notebook a response of this name is replaced, in a file one
        with these numbers. InputError where it cannot be one."""
        looks = {"words": words, "letter": letter, "colour": colour, "marker": marker}
        new = response_of(self.reading.signature, name, feature, threshold, limits or {}, looks)
        before, known = self.responses, self._registered(name)
        self.responses = tuple({**{one.name: one for one in before}, name: new}.values())  # in its place
        try:
            self.register()
            if known is not None and os.path.isfile(self.function.__code__.co_filename):  # a notebook makes it anew
                check_again(self.reading.signature, known, described(self.__name__).critical[name])
        except BaseException:
            self.responses = before
            self.register()
            raise

    def _registered(self, name: str) -> Response | None:
        """The response of this name that it has, with its numbers in SI."""
        return described(self.__name__).critical[name] if any(one.name == name for one in self.responses) else None

    def study(
        self,
        *,
        procedure: str = "same",
        along: str | None = None,
        refine: int = 0,
        continued: Mapping[str, Any] | None = None,
        slice: Mapping[str, Any] | None = None,
        uncertain: Mapping[str, Any] | None = None,
        title: str = "",
        **values: Any,
    ) -> Study:
        """A study of the model. ``values`` are those of its parameters, of its states at
        the start and of the settings of simulation, record and classify, by their names: a
        number [SI], a text with a unit, an axis (from, to, points), or a list of values.
        ``procedure``, ``along`` and ``refine`` are those of a sweep over the axes.
        ``continued`` is what is followed: a name with its range (from, to), and keys of the
        section ``continue``, of which ``seeds`` may be a list of values. ``slice`` starts each
        point from a plane of two states, each with its axis (from, to, points).
        ``uncertain`` has numbers that are not known: a name with (low, high) of a uniform
        distribution, a list of values, or a distribution as the section ``uncertain`` has
        it, and keys of that section, as ``samples``.

        StudyError where the study is not valid, InputError where a name is unknown."""
        read_again(self.__name__, ())
        names = _Names(self.__name__, keys_named(self.__name__), self.reading)
        tree: dict[str, Any] = {"title": title, "model": self.__name__}
        sweep: dict[str, Any] = {}
        for name, value in values.items():
            leaf = names.leaf(name)
            if _is_axis(value):
                sweep[leaf.key] = _axis(names, name, leaf, value)
            else:
                _put(tree, leaf.key, _text(leaf, value))
        if sweep:
            extra = {"along": names.leaf(along).key if along else None, "refine": refine or None}
            tree["sweep"] = {**sweep, "procedure": procedure, **{k: v for k, v in extra.items() if v is not None}}
        elif procedure != "same" or along or refine:
            raise InputError(f"{self.__name__}.study: found no axis; allowed: one, as name=(from, to, points).")
        if slice is not None:
            _put(tree, "initial.slice", _slice(names, slice))
        if continued is not None:
            tree["continue"] = _continued(names, continued)
        if uncertain is not None:
            tree["uncertain"] = _uncertain(names, uncertain)
        self.is_current = True
        try:  # JSON is YAML, and has dotted keys as they are
            return parse_study(json.dumps(tree, default=float, allow_nan=False), SOURCE)
        finally:
            self.is_current = False


class _Names:
    """The short names of the keys of a model's studies."""

    def __init__(self, model: str, keys: Keys, reading: Reading) -> None:
        self.model, self.leaves, self.reading = model, keys.leaves, reading
        self.keys: dict[str, list[str]] = {}
        for sections in SHORT:
            found: dict[str, list[str]] = {}
            for key in self.leaves:
                if key.partition(".")[0] in sections:
                    found.setdefault(key.rpartition(".")[2], []).append(key)
            self.keys = {**found, **self.keys}

    def leaf(self, name: str) -> Leaf:
        """The key of this short name, or dotted, as ``classify.settled.tolerance``."""
        if name in self.leaves:
            return self.leaves[name]
        if not isinstance(name, str) or name not in self.keys:
            self.refuse(name, self.keys)
        key, *others = self.keys[name]
        if others:
            raise InputError(
                f"{self.model}.study: found {name}, which several keys have; allowed: one of them in full, "
                f"**{{{key!r}: ...}}, or {', '.join(others)}."
            )
        return self.leaves[key]

    def refuse(self, name: str, known: Iterable[str]) -> NoReturn:
        own = ", ".join((*self.reading.signature.parameters, *self.reading.states))
        hint = did_you_mean(str(name), known)
        raise InputError(
            f"{self.model}.study: found {name}, which is none of its names; allowed: {own}, and keys of simulation, "
            f"record and classify.{f' {hint}' if hint else ''}"
        )


def _is_axis(value: object) -> bool:
    return isinstance(value, (tuple, list, range)) or (isinstance(value, np.ndarray) and value.ndim > 0)


def _axis(names: _Names, name: str, leaf: Leaf, value: Any) -> Any:
    """An axis of a sweep: a range, or values."""
    if not isinstance(value, tuple):
        return [_text(leaf, one) for one in (value.tolist() if isinstance(value, np.ndarray) else value)]
    if len(value) != 3:
        raise InputError(
            f"{names.model}.study: found {name}={value!r}; allowed: a number, an axis (from, to, points), or a list of "
            "values."
        )
    first, last, points = value
    return {"from": _text(leaf, first), "to": _text(leaf, last), "points": points}


def _slice(names: _Names, given: Any) -> dict[str, Any]:
    """The section ``initial.slice`` of a study."""
    form = "two states, each with its axis (from, to, points), as {'x': (-1.0, 1.0, 20), 'v': (0.0, 1.0, 10)}"
    axes = _mapping(names, "slice", given, form)
    for name, axis in axes.items():
        if not _is_axis(axis):
            raise InputError(f"{names.model}.study: slice: found {name}={axis!r:.60}; allowed: {form}.")
    return {name: _axis(names, name, names.leaf(name), tuple(axis)) for name, axis in axes.items()}


def _mapping(names: _Names, what: str, given: Any, form: str) -> Mapping[str, Any]:
    """What is given as ``what``; InputError where it is none by name."""
    if not isinstance(given, Mapping):
        raise InputError(f"{names.model}.study: {what}: found {given!r:.60}; allowed: {form}.")
    return given


def _is_plain(value: object) -> bool:
    """Whether a study may hold a value, so that it can say what is allowed in its place."""
    return value is None or isinstance(value, (Real, str, Sequence, Mapping, np.ndarray, np.bool_))


def _text(leaf: Leaf, value: Any) -> Any:
    """A value as a study has it: a number of a quantity in SI."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if not _is_plain(value):
        raise InputError(f"{leaf.key}: found {value!r:.60}; allowed: {leaf.allowed()}.")
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if is_number and not math.isfinite(value):
        raise InputError(f"{leaf.key}: found {value}; allowed: {leaf.allowed()}.")
    if is_number and leaf.kind == "quantity":
        return leaf.text(float(value))
    return int(value) if is_number and leaf.kind == "whole" and value == int(value) else value


def _put(tree: dict[str, Any], key: str, value: Any) -> None:
    *sections, last = key.split(".")
    for section in sections:
        tree = tree.setdefault(section, {})
    tree[last] = value


def _continued(names: _Names, given: Mapping[str, Any]) -> dict[str, Any]:
    """The section ``continue`` of a study."""
    form = "one number with its range, as {'force': (0.1, 0.5)}, and keys of the section continue"
    given = _mapping(names, "continued", given, form)
    along = [name for name in given if name in names.keys or name in names.leaves]
    along = [name for name in along if isinstance(given[name], (tuple, list)) and len(given[name]) == 2]
    if len(along) != 1:
        raise InputError(
            f"{names.model}.study: continued: found {', '.join(map(str, given)) or 'nothing'}; allowed: {form}."
        )
    leaf, (first, last) = names.leaf(along[0]), given[along[0]]
    rest = {name: value for name, value in given.items() if name != along[0]}
    if isinstance(seeds := rest.get("seeds"), (Sequence, np.ndarray)) and not isinstance(seeds, str):
        rest["seeds"] = {leaf.key: _each(leaf, seeds)}
    return {"along": leaf.key, "from": _text(leaf, first), "to": _text(leaf, last), **rest}


def _uncertain(names: _Names, given: Mapping[str, Any]) -> dict[str, Any]:
    """The section ``uncertain`` of a study."""
    found: dict[str, Any] = {}
    form = "numbers by name, each with (low, high), a list of values or a distribution, and keys of the section"
    for name, value in _mapping(names, "uncertain", given, form).items():
        if name == "correlations":
            if not isinstance(value, Sequence) or not all(isinstance(one, Sequence) and len(one) > 1 for one in value):
                allowed = "two names and their rank correlation each, as [('k', 'c', 0.5)]"
                raise InputError(f"{names.model}.study: uncertain: found {name}={value!r:.60}; allowed: {allowed}.")
            found[name] = [[*(names.leaf(one).key for one in pair), rank] for *pair, rank in value]
        elif name == "table":
            value = _mapping(names, "uncertain: table", value, "a list of values of each name, as {'k': [1.0, 2.0]}")
            found[name] = {(leaf := names.leaf(one)).key: _each(leaf, column) for one, column in value.items()}
        elif name in HOW:
            found[name] = value
        else:
            leaf = names.leaf(name)
            found[leaf.key] = _distribution(names, name, leaf, value)
    return found


def _distribution(names: _Names, name: str, leaf: Leaf, value: Any) -> dict[str, Any]:
    if isinstance(value, tuple) and len(value) == 2:
        return {"uniform": _each(leaf, value)}
    if isinstance(value, (list, np.ndarray)):
        return {"values": _each(leaf, value)}
    if not isinstance(value, Mapping):
        raise InputError(
            f"{names.model}.study: uncertain: found {name}={value!r:.60}; allowed: (low, high), a list of values, or a "
            "distribution, as {'normal': {'mean': 0.1, 'deviation': 0.02}}."
        )
    return {
        kind: {end: one if end == "factor" else _text(leaf, one) for end, one in numbers.items()}
        if isinstance(numbers, Mapping)
        else _each(leaf, numbers)
        for kind, numbers in value.items()
    }


def _each(leaf: Leaf, values: Any) -> list[Any]:
    listed = values.tolist() if isinstance(values, np.ndarray) else values
    if not isinstance(listed, (tuple, list)):
        raise InputError(f"{leaf.key}: found {listed!r:.60}; allowed: a list of values.")
    return [_text(leaf, one) for one in listed]


def _short(reading: Reading, given: Mapping[str, Any]) -> tuple[Response, ...]:
    """The responses of a decorator, each a feature and its threshold."""
    read, looks = reading.signature, {"words": "", "letter": "", "colour": "", "marker": ""}
    if not isinstance(given, Mapping):
        read.refuse(f"responses={given!r:.80}", FORM)
    for name, one in given.items():
        if not isinstance(one, (tuple, list)) or len(one) != 2:
            more = f"; words, colours and limits are those of {read.name}.response(...) below the function"
            read.refuse(f"the response {name!r}: {one!r:.60}", f"{FORM}{more}")
    return tuple(response_of(read, name, one[0], one[1], {}, looks) for name, one in given.items())


def _check(reading: Reading, model: FunctionModel) -> None:
    """InputError where names of what is observed and of its arguments are one."""
    signature, declaration = reading.signature, model.declared
    named = {*reading.states, *reading.gaps, *reading.rubs, *signature.parameters}
    for one in reading.quantities:
        if one.name in named:
            one.refuse("the name of a state, a parameter or a contact", "another name")
    features = {name for name, _ in declaration.named_features}
    peaks = {f"{name}_peaks" for name in reading.states}
    given = [name for name in (*signature.start, *signature.parameters) if name in features | peaks]
    if given:
        signature.refuse(f"the name {given[0]}, which a feature of a state has", "another name")
    loose, numbers = reading.consequences.unread_loads, {k: float(v) for k, v in signature.parameters.items()}
    if loose:
        signature.refuse(f"the friction {loose[0]!r}, whose load no slope reads", "its load in the slope of a velocity")
    if driving := reading.consequences.driven(lambda states: reading.given(states, numbers)):
        signature.refuse(
            f"the friction {driving[0]!r}, whose load makes its slip grow",
            "one that brakes: with slip=v - belt it is subtracted from the slope of v, with slip=belt - v added",
        )
    contacts = [*reading.gaps, *(one.name for one in reading.graph.frictions)]
    if twice := [name for k, name in enumerate(contacts) if name in contacts[:k]]:
        signature.refuse(f"two contacts with the name {twice[0]}", "one of each name")
    try:
        channels.check(model.names(model.options()), declaration)
    except ValueError as error:
        signature.refuse(str(error), "other names")


@overload
def model(
    function: FunctionType, *, title: str = "", responses: Mapping[str, Any] | None = None, orders: Sequence[str] = ()
) -> Declared: ...
@overload
def model(
    *, title: str = "", responses: Mapping[str, Any] | None = None, orders: Sequence[str] = ()
) -> Callable[[FunctionType], Declared]: ...
def model(
    function: Any = None, *, title: str = "", responses: Mapping[str, Any] | None = None, orders: Sequence[str] = ()
) -> Any:
    """Make a model of a function, as a decorator above its ``def``. Its name is that of the
    function, which is called as before.

    Parameters
    ----------
    function : function
        Of the time ``t`` [s] if it reads that, the states with their values at the
        start, and after ``*`` the parameters with their defaults. It returns the slopes
        of the states, by their names or in their order.
    title : str, optional
        What the model is; by default the first line of the docstring.
    responses : dict, optional
        The critical responses by name, each a feature and the threshold above which it is
        there [SI], as ``{"sticking": ("belt_stuck_fraction", 0.5)}``. One with words,
        colours and severities, or of a feature of its own, is declared with the method
        ``response``.
    orders : tuple of str, optional
        What must hold of the parameters in every study and sample, as ``("dynamic <=
        static", "low < 2 * high")``.

    Returns
    -------
    Declared
        The function with a method ``study``, whose arguments are the names of states,
        parameters and settings: a number, an axis (from, to, points), or a list.

    Raises
    ------
    InputError
        Where the signature is another one, or a model of another file has its name.
    NsdrillError
        Where the equations do what cannot be read once for all steps, with the line.

    Examples
    --------
    >>> @nsdrill.model
    ... def pendulum(angle=1.0, speed=0.0, *, damping=0.2):
    ...     'A pendulum'
    ...     return speed, -damping * speed - angle
    >>> pendulum(1.0, 0.5)
    (0.5, -1.1)
    >>> study = pendulum.study(damping=[0.1, 0.2], transient=0, observe=5)
    >>> nsdrill.run(study, progress=False).angle_max.values.tolist()
    [1.0, 1.0]
    """
    if function is None:
        return lambda one: model(one, title=title, responses=responses, orders=orders)
    return Declared(function, title, responses, orders)
