"""What Python users give, in whatever form: studies, changes of them, names of files,
quantities, numbers."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from nsdrill.errors import InputError, StudyError

if TYPE_CHECKING:
    from nsdrill.study.keys import Leaf
    from nsdrill.study.study import Study

THE_STUDY = "the study"  # what messages call one that is no file


def study_in(study: Any, set: Any, name: str = THE_STUDY) -> Study:
    """The study in whatever form, with keys changed."""
    from nsdrill.study.load import load_study, parse_study
    from nsdrill.study.read import yaml_text
    from nsdrill.study.study import Study

    texts = texts_in(set, "set")
    if isinstance(study, Study):
        if not texts:
            return study
        if study.text:
            return parse_study(study.text, study.source or name, [*study.overrides, *texts])
        from nsdrill.study.write import study_text

        return parse_study(study_text(study.resolved), study.source or name, texts)
    if isinstance(study, Mapping):
        try:
            return parse_study(yaml_text(study, name), name, texts)
        except StudyError as error:  # whose lines are those of a text that nobody has seen
            raise StudyError(
                name, [replace(fault, line=None, column=None) for fault in error.faults]
            ) from None
    if (
        isinstance(study, str)
        and (not study.strip() or "\n" in study or ": " in study)
        and not os.path.exists(study)
    ):
        return parse_study(study, name, texts)
    if isinstance(study, str | os.PathLike):
        return load_study(name_in(study, "study"), texts)
    raise InputError(
        f"study: found a value of the type {type(study).__name__}; allowed: a Study, the name of "
        f"a YAML file, YAML "
        "text, or a mapping."
    )


def texts_in(changes: Any, name: str) -> list[str]:
    """Keys to change as texts ``key=value``."""
    from nsdrill.study.read import override_texts

    if changes is None:
        return []
    if isinstance(changes, Mapping):
        return override_texts(changes, name)
    if not isinstance(changes, list | tuple) or not all(isinstance(text, str) for text in changes):
        found = repr(changes)[:80]
        raise InputError(
            f"{name}: found {found}; allowed: a mapping by dotted keys, or a list of "
            f"texts 'key=value'."
        )
    return list(changes)


def name_in(path: Any, name: str = "results") -> str:
    """The name of a file, given as the argument ``name``."""
    if isinstance(path, str | os.PathLike) and isinstance(os.fspath(path), str):
        if not os.fspath(path):
            raise InputError(f"{name}: found an empty text; allowed: the name of a file.")
        return os.fspath(path)
    allowed = "the name of a file, or a Dataset" if name == "results" else "the name of a file"
    raise InputError(
        f"{name}: found a value of the type {type(path).__name__}; allowed: {allowed}."
    )


def keep_apart(study: Any, path: str) -> None:
    """InputError where the results would replace the study that they are made from."""
    try:
        same = isinstance(study, str | os.PathLike) and os.path.samefile(study, path)
    except (OSError, ValueError):
        return
    if same:
        raise InputError(f"{path}: this is the study. Choose another path for the results.")


def values_in(at: Any, study: Study | None, **apart: Any) -> dict[str, float]:
    """The values of axes by their keys, in SI: those of ``at``, and those given apart;
    the axes are those of the ``study``, else of any model. ``at`` may have the number
    of a sample, too."""
    from nsdrill.study.keys import SAMPLE_LEAF, axes_of_all, did_you_mean, keys_of
    from nsdrill.variables import dimension_of

    leaves = axes_of_all()
    if study is not None:
        keys_there = keys_of(study.model)
        leaves = {
            name: keys_there.leaf(leaf.key, study.resolved)
            for name, leaf in keys_there.axes.items()
        }
    leaves = {**leaves, SAMPLE_LEAF.key: SAMPLE_LEAF}
    keys = {dimension_of(key): key for key in leaves}
    found = {
        key: _quantity(key, value, leaves[key]) for key, value in apart.items() if value is not None
    }
    if not isinstance(at, Mapping) and at is not None:
        raise InputError(
            f"at: found {at!r}; allowed: a mapping, as {{'bit.rock_stiffness': '25 MN/m'}}."
        )
    for name, value in (at or {}).items():
        key = keys.get(str(name), str(name).removeprefix("operation."))
        if key not in leaves:
            hint = did_you_mean(key, leaves)
            raise InputError(
                f"at: found the key {name!r}; allowed: the key of an "
                f"axis.{f' {hint}' if hint else ''}"
            )
        if key in found:
            raise InputError(f"at: found a second value of {key}; allowed: each key once.")
        found[key] = _quantity(f"at[{name!r}]", value, leaves[key])
    return found


def _quantity(name: str, value: Any, leaf: Leaf) -> float:
    """A quantity in SI, within the range of its key."""
    from nsdrill.study.keys import shown
    from nsdrill.units import QuantityError

    try:
        if isinstance(value, str) and leaf.kind == "quantity":
            return float(leaf.read(value))
        number = _float(value)
        if number is None or not leaf.low <= number <= leaf.high:
            odd = number is None and not isinstance(value, str | bool | list | dict | None)
            found = (
                f"a value of the type {type(value).__name__}"
                if odd
                else shown(value if number is None else number)
            )
            raise QuantityError(found, leaf.allowed())
    except QuantityError as error:
        si = f"; a number is in {leaf.units}" if leaf.units else ""
        raise InputError(f"{name}: {str(error).rstrip('.')}{si}.") from None
    return number


def seconds_in(name: str, value: Any) -> float:
    """A time [s]."""
    from nsdrill.units import QuantityError, to_si

    try:
        number = to_si(value, "s") if isinstance(value, str) else _float(value)
    except QuantityError as error:
        raise InputError(f"{name}: {error}") from None
    if number is None:
        raise InputError(
            f"{name}: found {value!r}; allowed: a number of seconds, or a text with "
            f"a unit, '10 ms'."
        )
    return number


def _float(value: Any) -> float | None:
    """A number of Python, numpy or xarray as a float, None where it is none."""
    import numpy as np

    if getattr(value, "ndim", None) == 0:
        value = value.item()
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    return None


def is_whole(value: Any) -> bool:
    """Whether ``value`` is a whole number."""
    import numpy as np

    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def number_in(name: str, value: Any) -> int | None:
    """A number that counts, or None."""
    if value is None:
        return None
    if getattr(value, "ndim", None) == 0:
        value = value.item()
    if not is_whole(value):
        raise InputError(f"{name}: found {value!r}; allowed: a whole number, from 0.")
    return int(value)
