"""The decorator that makes a model of a function, and what it returns: the function, and
studies of its model by the names of its own arguments."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import update_wrapper
from numbers import Real
from types import FunctionType
from typing import Any, NoReturn, overload

import numpy as np

from nsdrill.errors import InputError
from nsdrill.models.own_quantities import Measured
from nsdrill.models.registry import Scripted, register
from nsdrill.observe import channels
from nsdrill.script.described import description_of
from nsdrill.script.model import FunctionModel
from nsdrill.script.quantities import measured
from nsdrill.script.reading import Reading, read
from nsdrill.study.keys import Keys, Leaf, did_you_mean, keys_named
from nsdrill.study.load import parse_study
from nsdrill.study.study import Study

SHORT = ("parameters", "initial", "simulation", "record", "classify")  # sections whose keys go by their last word
SOURCE = "the study"  # the name in messages


class Declared:
    """A model of a function: called as that is, with numbers, it gives numbers."""

    __name__: str

    def __init__(self, function: FunctionType, title: str) -> None:
        self.function, self.title = function, title
        self.measures: tuple[Measured, ...] = ()
        update_wrapper(self, function)
        self.reading = read(function)
        self.register()

    def __call__(self, *args: Any, **named: Any) -> Any:
        return self.function(*args, **named)

    def __repr__(self) -> str:
        return f"<the model {self.__name__}>"

    def register(self) -> None:
        """Make it known under its name, as it was read."""
        reading, self.model = self.reading, FunctionModel(self.reading)
        description = description_of(reading, self.model, self.title)
        _check(reading, self.model)
        register(Scripted(description, self.model, reading.digest, self.function.__code__.co_filename))

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

        def decorated(function: FunctionType) -> FunctionType:
            ends = [end for end, wanted in {"max": greatest, "min": least, "mean": mean}.items() if wanted]
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

    def study(
        self,
        *,
        procedure: str = "same",
        along: str | None = None,
        refine: int = 0,
        continued: Mapping[str, Any] | None = None,
        slice: Mapping[str, Any] | None = None,
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

        StudyError where the study is not valid, InputError where a name is unknown."""
        reading = read(self.function, self.measures)
        if reading.digest != self.reading.digest:  # what the function reads has another value
            self.reading = reading
            self.register()
        names = _Names(self.__name__, keys_named(self.__name__), reading)
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
            axes = {name: _axis(names, name, names.leaf(name), tuple(axis)) for name, axis in slice.items()}
            _put(tree, "initial.slice", axes)
        if continued is not None:
            tree["continue"] = _continued(names, continued)
        # JSON is YAML, and has dotted keys as they are
        return parse_study(json.dumps(tree, default=float, allow_nan=False), SOURCE)


class _Names:
    """The short names of the keys of a model's studies."""

    def __init__(self, model: str, keys: Keys, reading: Reading) -> None:
        self.model, self.leaves, self.reading = model, keys.leaves, reading
        self.keys: dict[str, str] = {}
        for section in SHORT:
            for key in self.leaves:
                if key.startswith(f"{section}."):
                    self.keys.setdefault(key.rpartition(".")[2], key)

    def leaf(self, name: str) -> Leaf:
        """The key of this short name, or dotted, as ``classify.settled.tolerance``."""
        key = name if name in self.leaves else self.keys.get(name, "")
        if not key:
            self.refuse(name, self.keys)
        return self.leaves[key]

    def refuse(self, name: str, known: Iterable[str]) -> NoReturn:
        own = ", ".join((*self.reading.signature.parameters, *self.reading.states))
        hint = did_you_mean(name, known)
        raise InputError(
            f"{self.model}.study: found {name}, which is none of its names; allowed: {own}, and keys of simulation, "
            f"record and classify.{f' {hint}' if hint else ''}"
        )


def _is_axis(value: object) -> bool:
    return isinstance(value, (tuple, list, range, np.ndarray))


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


def _text(leaf: Leaf, value: Any) -> Any:
    """A value as a study has it: a number of a quantity in SI."""
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
    along = [name for name in given if name in names.keys or name in names.leaves]
    along = [name for name in along if isinstance(given[name], (tuple, list)) and len(given[name]) == 2]
    if len(along) != 1:
        raise InputError(
            f"{names.model}.study: continued: found {', '.join(given) or 'nothing'}; allowed: one number with its "
            "range, as {'force': (0.1, 0.5)}, and keys of the section continue."
        )
    leaf, (first, last) = names.leaf(along[0]), given[along[0]]
    rest = {name: value for name, value in given.items() if name != along[0]}
    if isinstance(seeds := rest.get("seeds"), Sequence) and not isinstance(seeds, str):
        rest["seeds"] = {leaf.key: [_text(leaf, one) for one in seeds]}
    return {"along": leaf.key, "from": _text(leaf, first), "to": _text(leaf, last), **rest}


def _check(reading: Reading, model: FunctionModel) -> None:
    """InputError where names of what is observed and of its arguments are one."""
    signature, declaration = reading.signature, model.declared
    named = {*reading.states, *reading.gaps, *reading.rubs}
    for one in reading.quantities:
        if one.name in named:
            one.refuse("the name of a state or of a contact", "another name")
    features = {name for name, _ in declaration.named_features}
    peaks = {f"{name}_peaks" for name in reading.states}
    given = [name for name in (*signature.start, *signature.parameters) if name in features | peaks]
    if given:
        signature.refuse(f"the name {given[0]}, which a feature of a state has", "another name")
    contacts = [*reading.gaps, *(one.name for one in reading.graph.frictions)]
    if twice := [name for k, name in enumerate(contacts) if name in contacts[:k]]:
        signature.refuse(f"two contacts with the name {twice[0]}", "one of each name")
    try:
        channels.check(model.names(model.options()), declaration)
    except ValueError as error:
        signature.refuse(str(error), "other names")


@overload
def model(function: FunctionType, *, title: str = "") -> Declared: ...
@overload
def model(*, title: str = "") -> Callable[[FunctionType], Declared]: ...
def model(function: Any = None, *, title: str = "") -> Any:
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
        return lambda one: model(one, title=title)
    return Declared(function, title)
