"""The root attributes of a file as plain values, with their types checked, whichever
program wrote them."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.errors import FileError, printable
from nsdrill.models.registry import NAMES
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
    "study_sha256",
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
_JSON = {
    "study_overrides": list,
    "classification": list,
    "study_resolved": dict,
    "classification_resolved": dict,
    "ramps": dict,
    "border_spacing": dict,
    "at": dict,
}


def plain_attributes(where: str | os.PathLike[str], attrs: Mapping[str, Any]) -> dict[str, Any]:
    """Root attributes of a file or a Dataset as plain Python values; arrays stay arrays.
    FileError, about ``where``, if an attribute of nsdrill has the wrong type. Attributes
    of other programs are taken where they are text or numbers."""
    plain = {name: plain_attribute(attrs, name) for name in attrs}
    for name, value in plain.items():
        if (expected := _expected_type(name, value)) is not None:
            raise FileError(f"{where}: the attribute {name} should be {expected}. Make the file again.")
    known = {name: value for name, value in plain.items() if value is not None}
    if (model := known.get("model", MODEL)) not in NAMES:
        raise FileError(
            f"{where}: made with the model {printable(model)[:80]}, which this nsdrill does not know; it knows "
            f"{', '.join(NAMES)}. Use the nsdrill that made it."
        )
    if lacking := [name for name in _REFINED if name not in known and not known.keys().isdisjoint(_REFINED)]:
        raise FileError(f"{where}: the attribute {lacking[0]} of a refined sweep is missing. Make the file again.")
    return known | ({"title": known["title"][:_LONGEST_TITLE]} if "title" in known else {})


def plain_attribute(attrs: Mapping[str, Any], name: str) -> Any:
    """The attribute ``name`` as plain text, one number or a short array of numbers; None
    where there is none or where it is anything else. An array with one element becomes a
    number, as xarray writes numbers as such arrays."""
    value = attrs.get(name)
    if isinstance(value, str):  # h5py keeps the bytes that are no UTF-8
        value = value.encode("utf-8", "surrogateescape")
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace").translate(_CONTROL)
    if isinstance(value, np.ndarray | np.generic | int | float):
        array = np.asarray(value)
        if array.dtype.kind in "iufb" and array.ndim < 2 and array.size <= _LONGEST_LIST:
            return array.item() if array.size == 1 else array
    return None


def _expected_type(name: str, value: Any) -> str | None:
    """What the attribute should be, in words, where it is something else; else None."""
    if name in _JSON:
        words = "a JSON list" if _JSON[name] is list else "a JSON object"
        try:
            return None if isinstance(json.loads(value), _JSON[name]) else words
        except (ValueError, TypeError, RecursionError):
            return words
    if name in _TEXT or (name.endswith("_version") and name != "format_version"):
        return None if isinstance(value, str) else "text"
    if name in _COUNTS:
        return None if isinstance(value, int) and value >= 0 else "a whole number"
    if name in _NUMBERS:
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST
        return None if is_number else "a finite number"
    return None
