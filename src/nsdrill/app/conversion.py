"""Conversion of the arguments of Python functions: studies, changes of them, names of
files, quantities, numbers."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import NoReturn, TypeGuard

import numpy as np

from nsdrill.errors import InputError, Refusal, StudyError, option
from nsdrill.models.choices import as_value, words_of
from nsdrill.models.model_description import Description
from nsdrill.models.own_parts import parts_in, read_again
from nsdrill.models.registry import described, scripted, speak_of
from nsdrill.study.keys import SAMPLE_LEAF, WITH, Leaf, axes_of_all, did_you_mean, shown
from nsdrill.study.load import load_study, override_texts, parse_study, yaml_text
from nsdrill.study.study import Studied, Study
from nsdrill.study.torques import has_unit, keys_with_units
from nsdrill.study.write import study_text
from nsdrill.units import QuantityError, WithUnit, parse_with_unit, to_si
from nsdrill.variables import MODEL, dimension_of, short_key

THE_STUDY = "the study"  # the name in messages of a study that is not a file


def study_in(study: object, set: object) -> Study:
    """``study`` as a Study: a Study, the name of a file, YAML text or a mapping.
    ``set`` changes keys."""
    texts = texts_in(set, "set")
    if isinstance(study, Studied):
        study = study.study()
    if isinstance(study, Study):
        name = study.model.name
        speak_of(name)
        read_again(name, parts_in(study.resolved))
        made = scripted(name)
        if not texts and (made is None or made.description is study.model):
            return study
        if study.text:
            return parse_study(study.text, study.source or THE_STUDY, [*study.overrides, *texts])
        return parse_study(study_text(study.resolved), study.source or THE_STUDY, texts)
    if isinstance(study, Mapping):
        try:
            return parse_study(yaml_text(study, THE_STUDY), THE_STUDY, texts)
        except StudyError as error:  # without lines of the generated text
            raise StudyError(THE_STUDY, [replace(fault, line=None, column=None) for fault in error.faults]) from None
    if isinstance(study, str) and (not study.strip() or "\n" in study or ": " in study) and not os.path.exists(study):
        return parse_study(study, THE_STUDY, texts)
    if isinstance(study, str | os.PathLike):
        return load_study(name_in(study, "study"), texts)
    raise InputError(
        f"study: found a value of the type {type(study).__name__}; allowed: a Study, the name of a YAML file, YAML "
        "text, or a mapping."
    )


def texts_in(changes: object, name: str) -> list[str]:
    """Changes of keys as texts ``key=value``; ``name`` is that of the argument."""
    if changes is None:
        return []
    if isinstance(changes, Mapping):
        return override_texts(changes, name)
    if not isinstance(changes, list | tuple) or not all(isinstance(text, str) for text in changes):
        found = repr(changes)[:80]
        raise InputError(f"{name}: found {found}; allowed: a mapping by dotted keys, or a list of texts 'key=value'.")
    return list(changes)


def name_in(path: object, name: str = "results") -> str:
    """The name of a file, given as the argument ``name``."""
    if isinstance(path, str | os.PathLike) and isinstance(os.fspath(path), str):
        if not os.fspath(path):
            raise InputError(f"{name}: found an empty text; allowed: the name of a file.")
        return os.fspath(path)
    allowed = "the name of a file, or a Dataset" if name in ("results", "seeds") else "the name of a file"
    raise InputError(f"{name}: found a value of the type {type(path).__name__}; allowed: {allowed}.")


def output_in(path: object, *inputs: object, **meant: bool) -> str | None:
    """The name of the file to write, or None; a Refusal of what is ``meant`` of a file
    where none is written, InputError where it is that of one of the ``inputs``."""
    if path is None:
        for name, on in meant.items():
            if on:
                raise Refusal(name, f"without {option('path')}", "with the name of a file")
        return None
    output = name_in(path, "path")
    for one in inputs:
        with suppress(OSError, ValueError):
            if isinstance(one, str | os.PathLike) and os.path.samefile(one, output):
                raise InputError(f"{output}: this is the study. Choose another path for the results.")
    return output


def values_in(at: object, study: Study | None, **apart: object) -> dict[str, float]:
    """The values of axes by key, in SI: those of ``at``, a mapping or pairs, and those
    given as arguments (``apart``). The axes are those of the ``study``, else of any model;
    ``at`` may also have the number of a sample."""
    leaves = axes_of_all()
    if study is not None:
        leaves = {name: study.keys.leaf(leaf.key, study.resolved) for name, leaf in study.keys.axes.items()}
    leaves = {**leaves, SAMPLE_LEAF.key: SAMPLE_LEAF}
    keys = {dimension_of(key): key for key in leaves}
    with_units = keys_with_units(MODEL if study is None else study.model.name)
    given = {name: value for name, value in apart.items() if value is not None}
    if lacking := [name for name in given if name not in leaves]:
        model = study.model if study is not None else described(MODEL)
        refuse_lacking(lacking[0], model)
    values = {name: _value(value, leaves[name], name) for name, value in given.items()}
    if not isinstance(at, Mapping | list) and at is not None:
        raise Refusal("at", repr(at), "a mapping, as {'bit.rock_stiffness': '25 MN/m'}")
    for name, value in at.items() if isinstance(at, Mapping) else at or ():
        key = keys.get(str(name), short_key(str(name)))
        other, units = with_units.get(key, ("", ""))
        if other in leaves and has_unit(value, units):
            key = other
        if key not in leaves:
            same = [known for known in leaves if known.rpartition(".")[2] == key]
            hint = f"Did you mean {same[0]}?" if same else did_you_mean(key, leaves)
            swept = [keys.get(axis, axis) for axis in study.axes] if study is not None else []
            of_scripts = [known for known in leaves if known.startswith("parameters.")]
            some = ", ".join(swept or of_scripts)
            allowed = f"the key of an axis{f', as {some}' if some else ''}"
            if key.startswith("parameters."):
                allowed += f", or a number of the model of an installed package or of a script that is given ({WITH})"
            raise Refusal("at", f"the key {name!r}", allowed, hint)
        if key in values:
            raise Refusal("at", f"a second value of {key}", "each key once")
        values[key] = _value(value, leaves[key], "at", name)
    return values


def ranges_in(within: object, swept: Sequence[str]) -> dict[str, tuple[float, float]]:
    """The least and the greatest value between which one drills [SI], by the names of
    ``swept`` axes: ``within`` is a mapping or pairs, of each axis two values, or a text as
    ``100 rpm..180 rpm``. A Refusal of another axis, or of ends that are no range."""
    if within is None:
        return {}
    if not isinstance(within, Mapping | list | tuple):
        raise Refusal("within", repr(within), "a mapping, as {'rotary_speed': ('100 rpm', '180 rpm')}")
    axes = [axis for axis in ("wob", "rotary_speed") if axis in swept]
    leaves, found = axes_of_all(), {}
    for name, value in within.items() if isinstance(within, Mapping) else within:
        key = short_key(str(name))
        if key not in axes:
            allowed = " or ".join(axes) or "results of a sweep of one of them"
            raise Refusal("within", f"the key {str(name)!r}", f"what is set and was swept: {allowed}")
        ends = value.split("..") if isinstance(value, str) else value
        if not isinstance(ends, list | tuple) or len(ends) != 2:
            raise Refusal("within", repr(value), "two values, as 100 rpm..180 rpm", key=key)
        low, high = (_value(one.strip() if isinstance(one, str) else one, leaves[key], "within", key) for one in ends)
        if not low <= high:
            raise Refusal("within", repr(value), "the lower end first", key=key)
        found[key] = (float(low), float(high))
    return found


def refuse_lacking(name: str, model: Description) -> NoReturn:
    """A Refusal of a value that the operating point of the model does not have."""
    others = ", ".join(option("at", f"{key}=...") for key in model.operation.names())
    found = f"with the model {model.name}, which has no such value"
    raise Refusal(name, found, others or f"a number of the study, as {option('at', 'KEY=VALUE')}")


def _value(value: object, leaf: Leaf, argument: str, key: str = "") -> float:
    """A value of an axis in SI, which remembers the unit of a text; a Refusal outside
    the range of its key."""
    try:
        if isinstance(value, str) and leaf.kind == "quantity":
            leaf.read(value)  # within its range
            return parse_with_unit(value, leaf.units)
        if isinstance(value, str | bool) and (words := words_of(leaf.key)):
            word = str(value).lower() if isinstance(value, bool) else value
            if word in words:
                return as_value(leaf.key, word)
            choices = leaf.choices or words
            raise QuantityError(shown(value), ", ".join(choices), did_you_mean(word, choices))
        if isinstance(value, str):
            with suppress(ValueError):
                value = float(value)
        number = _float(value)
        if number is None or not leaf.low <= number <= leaf.high:
            found = f"a value of the type {type(value).__name__}"
            if number is not None:
                found = shown(number)
            elif isinstance(value, str | bool | list | dict | None):
                found = shown(value)
            raise QuantityError(found, leaf.allowed())
        if isinstance(value, WithUnit):
            return value
        return float(leaf.read(number)) if leaf.kind == "whole" else number
    except QuantityError as error:
        raise Refusal(argument, error.found, error.allowed, error.suggestion, key=key, bare=leaf.units) from None


def seconds_in(name: str, value: object) -> float:
    """A time [s]."""
    try:
        number = to_si(value, "s") if isinstance(value, str) else _float(value)
    except QuantityError as error:
        raise Refusal(name, error.found, error.allowed, error.suggestion, bare="s") from None
    if number is None:
        raise InputError(f"{name}: found {value!r}; allowed: a number of seconds, or a text with a unit, '10 ms'.")
    return number


def scalar(value: object) -> object:
    """``value``, of an array without dimensions its element."""
    item: Callable[[], object] | None = getattr(value, "item", None)
    return item() if item is not None and getattr(value, "ndim", None) == 0 else value


def _float(value: object) -> float | None:
    """A number of Python, numpy or xarray as a float; None for anything else."""
    value = scalar(value)
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    return None


def is_whole(value: object) -> TypeGuard[int]:
    """Whether ``value`` is a whole number."""
    return isinstance(value, int | np.integer) and not isinstance(value, bool)
