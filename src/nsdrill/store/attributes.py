"""The root attributes of a file as plain values, with their types checked, whichever
program wrote them."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from nsdrill.errors import FileError, printable
from nsdrill.models.leaves import is_further_axis, words_of
from nsdrill.models.operation import Operation
from nsdrill.models.registry import NAMES
from nsdrill.models.schedule import Ramp
from nsdrill.observe.thresholds import Thresholds
from nsdrill.variables import AXES, MODEL

# control characters but for tab and line ends
_CONTROL = dict.fromkeys([*range(9), 11, 12, *range(14, 32), *range(127, 160)])
LARGEST = 1e100  # of any number: larger ones overflow in sums and in conversions of units
_LONGEST_LIST = 1000  # numbers in an array
_LONGEST_TITLE = 500  # characters; the first versions had no limit
_TEXT = (
    "axes",
    "unknowns",
    "dimensions",
    "model",
    "title",
    "study",
    "study_source",
    "study_overrides",
    "study_resolved",
    "study_sha256",
    "classification",
    "classification_resolved",
    "border_spacing",
    "ramps",
    "at",
    "nsdrill_version",
    "model_digest",
    "created",
    "history",
    "procedure",
    "status",
    "replay_of",
    "method",
)
_NUMBERS = ("gap", *AXES, "transient", "observe", "rtol")
_REFINED = ("refine", "points_run", "points_inferred", "border_spacing")  # a file has all of them or none
_COUNTS = ("format_version", "refine", "points_run", "points_inferred", "sample", "start", "steps", "rejected")


def get_attributes(path: str | os.PathLike[str], file: Any) -> dict[str, Any]:
    """Root attributes as plain Python values; arrays stay arrays. FileError where an
    attribute of nsdrill has the wrong type. Attributes of other programs are read where
    they are text or numbers."""
    return check_attributes(path, {name: plain_attribute(file.attrs, name) for name in file.attrs})


def check_attributes(path: str | os.PathLike[str], attrs: Mapping[str, Any]) -> dict[str, Any]:
    """``attrs`` without those that are None; FileError where an attribute has the wrong
    type."""
    for name, value in attrs.items():
        if (expected := _expected_type(name, value)) is not None:
            raise FileError(f"{path}: the attribute {name} should be {expected}. Make the file again.")
    known = {name: value for name, value in attrs.items() if value is not None}
    if (model := known.get("model", MODEL)) not in NAMES:
        raise FileError(
            f"{path}: made with the model {printable(model)[:80]}, which this nsdrill does not "
            f"know; it knows "
            f"{', '.join(NAMES)}. Use the nsdrill that made it."
        )
    if lacking := [name for name in _REFINED if name not in known and not known.keys().isdisjoint(_REFINED)]:
        raise FileError(f"{path}: the attribute {lacking[0]} of a refined sweep is missing. Make the file again.")
    return known | ({"title": known["title"][:_LONGEST_TITLE]} if "title" in known else {})


def text_attribute(path: str | os.PathLike[str], item: Any, name: str) -> str:
    """The text attribute ``name`` of a file or of one of its datasets, empty where
    there is none; FileError where it is not text."""
    value = plain_attribute(item.attrs, name) if name in item.attrs else ""
    if not isinstance(value, str):
        raise FileError(f"{path}: the attribute {name} should be text. Was the file edited? Make it again.")
    return value


def plain_attribute(attrs: Any, name: str) -> Any:
    """The attribute ``name`` as one text, one number or a short array of numbers; None
    where there is none or where it is anything else, which is not read."""
    import h5py

    if name not in attrs:
        return None
    attribute = attrs.get_id(name)
    is_text = h5py.check_string_dtype(attribute.dtype) is not None
    if (
        attribute.shape is None
        or len(attribute.shape) > (0 if is_text else 1)
        or math.prod(attribute.shape) > _LONGEST_LIST
    ):
        return None
    if not is_text and attribute.dtype.kind not in "iufb":
        return None
    value = attrs[name]
    return plain_value(value.encode("utf-8", "surrogateescape") if is_text and isinstance(value, str) else value)


def plain_value(value: Any) -> Any:
    """An attribute's value as plain text, number or short array of numbers; None for
    anything else. An array with one element becomes a number, as xarray writes numbers
    as such arrays."""
    if isinstance(value, str):
        return value.translate(_CONTROL)
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace").translate(_CONTROL)
    if isinstance(value, np.ndarray | np.generic | int | float):
        array = np.asarray(value)
        if array.dtype.kind not in "iufb" or array.ndim > 1 or array.size > _LONGEST_LIST:
            return None
        return array.item() if array.size == 1 else array
    return None


def _expected_type(name: str, value: Any) -> str | None:
    """What the attribute should be, in words, where it is something else; else None."""
    if name in _TEXT or (name.endswith("_version") and name != "format_version"):
        if not isinstance(value, str):
            return "text"
    elif name in _COUNTS:
        return None if isinstance(value, int) and value >= 0 else "a whole number"
    elif name in _NUMBERS:
        return None if _is_number(value) else "a finite number"
    if name not in _JSON_CHECKS:
        return None
    expected, is_valid = _JSON_CHECKS[name]
    try:
        data = json.loads(value, parse_constant=_reject_constant)
        return None if is_valid(data) else expected
    except (ValueError, TypeError, KeyError, AttributeError, OverflowError, RecursionError):
        return expected


def _reject_constant(word: str) -> float:
    raise ValueError(word)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST


def _is_list_of_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _has_shape_of(value: Any, template: Any) -> bool:
    """Whether ``value`` has numbers and mappings where ``template`` has them; it may
    lack some."""
    if not isinstance(template, dict):
        return _is_number(value)
    return isinstance(value, dict) and all(_has_shape_of(item, template[name]) for name, item in value.items())


def _is_thresholds(value: Any) -> bool:
    return _has_shape_of(value, asdict(Thresholds()))


def _is_study(study: Any) -> bool:
    """Whether those parts of a resolved study are valid that are read without building
    it: the thresholds, the carried axis and the slice."""
    sections = [study.get(name, {}) for name in ("initial", "sweep", "simulation")]
    plane, along = sections[0].get("slice", {}), sections[1].get("along")
    return (
        isinstance(study, dict)
        and all(isinstance(section, dict) for section in sections)
        and (along is None or _is_axis(along))
        and _is_thresholds(study.get("classify", {}))
        and all(
            isinstance(name, str)
            and set(axis) == {"from", "to", "points"}
            and all(map(_is_number, axis.values()))
            and axis["from"] < axis["to"]
            and isinstance(axis["points"], int)
            and axis["points"] > 1
            for name, axis in plane.items()
        )
    )


def _is_ramps(ramps: Any) -> bool:
    for name, (times, values) in ramps.items():
        if name not in AXES or not all(map(_is_number, [*times, *values])):
            return False
        Ramp(tuple(times), tuple(values))  # ValueError where it is not a ramp
        for value in values:
            Operation(**{name: float(value)})
    return True


def _is_axis_values(values: Any) -> bool:
    return all(
        _is_axis(name) and (value in words if (words := words_of(name)) else _is_number(value))
        for name, value in values.items()
    )


def _is_axis(key: Any) -> bool:
    return isinstance(key, str) and (key in AXES or is_further_axis(key))


_JSON_CHECKS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    "study_overrides": ("a JSON list of texts", _is_list_of_texts),
    "classification": ("a JSON list of texts", _is_list_of_texts),
    "study_resolved": ("a study as JSON", _is_study),
    "classification_resolved": ("thresholds as JSON", _is_thresholds),
    "ramps": ("ramps as JSON", _is_ramps),
    "border_spacing": ("a JSON object of numbers", _is_axis_values),
    "at": ("a JSON object of numbers", _is_axis_values),
}
