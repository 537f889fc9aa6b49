"""The layout of a file, which a Dataset of xarray shares: its
dimensions, their order, and all attributes.

In memory, results have every dimension of the grid: the procedure, all axes in a fixed
order, the starts. A file has the dimensions that vary, in the order in which the study
names the axes; the others are scalar coordinates.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nsdrill.data import (
    EDITED_SOURCE,
    MEASURED_BY,
    MODEL_PARTS,
    USED_SCRIPTS,
    Array,
    Attributes,
    flat,
    json_text,
    resolved_study,
)
from nsdrill.errors import FileError, FileWarning, InputError, NsdrillError, on_command_line, option, printable, warn
from nsdrill.late import deferred
from nsdrill.models.choices import words_along
from nsdrill.models.contents import Contents
from nsdrill.models.model_description import Description
from nsdrill.models.registry import (
    IN_TRACE,
    described,
    import_additions,
    import_modules,
    model_names,
    own_features,
    package_digest,
    scripted,
    speak_of,
)
from nsdrill.origin import origin_in_words
from nsdrill.units import cf_units
from nsdrill.variables import (
    AXES,
    COORDINATES,
    FORMAT_VERSION,
    MODEL,
    NOTEBOOK,
    PACKAGE,
    Axis,
    Unknown,
    Variable,
    dimension_of,
    long_key,
)

with deferred():
    from nsdrill.models.own_parts import own_part, read_again

CONVENTIONS = f"nsdrill-{FORMAT_VERSION}"
Stored = tuple[tuple[str, ...], ArrayLike, Attributes]  # dimensions, values and attributes of an array


def file_order(lengths: Mapping[str, int], attrs: Attributes) -> tuple[str, ...]:
    """The dimensions of the grid in a file with the root attributes ``attrs``: those with
    more than one value, in the order procedure, the axes as the study names them,
    sample, start. ``lengths`` has the length of every dimension in memory."""
    sweep = resolved_study(attrs).get("sweep")
    named = map(dimension_of, sweep if isinstance(sweep, dict) else ())
    axes = [name for name in lengths if name not in ("procedure", "sample", "start")]
    ordered = ["procedure", *(name for name in dict.fromkeys([*named, *axes]) if name in axes), "sample", "start"]
    return tuple(name for name in ordered if lengths.get(name, 1) > 1)


def to_file(values: Array, grid: Sequence[str], order: Sequence[str]) -> Array:
    """``values`` [grid, ...] as in a file, [order, ...]. Dimensions of the grid that
    ``order`` lacks have one value."""
    dropped = [axis for axis, name in enumerate(grid) if name not in order]
    own = range(len(grid), values.ndim)
    transposed = np.transpose(values, (*dropped, *map(grid.index, order), *own))
    return transposed.reshape(transposed.shape[len(dropped) :])


def to_memory(values: Array, dims: Sequence[str], grid: Sequence[str]) -> Array:
    """``values`` [dims], in any order, as in memory: [grid, ...], contiguous."""
    own = [name for name in dims if name not in grid]
    order = [*(name for name in grid if name in dims), *own]
    absent = [axis for axis, name in enumerate(grid) if name not in dims]
    return np.asarray(np.expand_dims(np.transpose(values, [dims.index(name) for name in order]), absent), order="C")


def stored_coordinates(
    coords: Mapping[str, Array], order: Sequence[str], contents: Contents, samples: Mapping[Unknown, Array]
) -> dict[str, Stored]:
    """The coordinates of results as a file has them, in its order: the dimensions
    ``order`` of the grid, the scalars, those that only some variables have, and the
    ``samples`` of the unknowns, in place of the scalar of an uncertain operating value,
    which no run has."""
    axes = {axis.name: axis for axis in contents.axes}
    own = (*(name for name in ("peak", "crossing") if contents.length(name)), "state")
    uncertain = {unknown.short for unknown in samples}
    scalars = [name for name in contents.grid if name not in order and name not in uncertain]
    stored: dict[str, Stored] = {}
    for name in (*order, *scalars, *own):
        values, attributes = in_words(name, coords[name]), coordinate_attributes(name, axes.get(name))
        stored[name] = ((), values[0], attributes) if name in scalars else ((name,), values, attributes)
    for unknown, values in samples.items():
        stored[unknown.name] = (("sample",), values, coordinate_attributes(unknown.name, unknown))
    return stored


def in_words(name: str, values: Array) -> Array:
    """The values of a coordinate in memory [n] as a file has them: a choice as its
    words."""
    words = words_along(name)
    return np.array([words[int(value)] for value in values]) if words else values


def coordinate_attributes(name: str, axis: Axis | None = None) -> dict[str, str]:
    """The attributes of the coordinate ``name``. ``axis`` is the swept axis, if it is
    not one of the operation, or the unknown."""
    units, long_name = (cf_units(axis.units), axis.long_name) if axis else COORDINATES[name]
    text = name in ("procedure", "state") or bool(words_along(name))
    key = long_key(axis.key) if axis else f"operation.{name}" if name in AXES else None
    return {"long_name": long_name, **({"key": key} if key else {}), **({} if text else {"units": units})}


def variable_attributes(variable: Variable, states: Sequence[str] = (), model: str = MODEL) -> Attributes:
    """The attributes of ``variable``, with flags as in CF, of the type of the variable.
    For a variable over states, ``states`` of the
    ``model`` are their names."""
    attributes: Attributes = {"units": variable.units}
    if not variable.units:
        named = IN_TRACE.beside(described(model))
        attributes = {"state_units": ", ".join(named[name].units for name in states)}
    attributes["long_name"] = variable.long_name
    for name in ("flag_values", "flag_masks"):
        if getattr(variable, name) is not None:
            attributes[name] = np.array(getattr(variable, name), variable.dtype)
    if variable.flag_meanings is not None:
        attributes["flag_meanings"] = variable.flag_meanings
    return attributes


def root_attributes(
    kind: str,
    attrs: Attributes,
    axes: Sequence[Axis] = (),
    lengths: Mapping[str, int] | None = None,
    unknowns: Sequence[Axis] = (),
) -> Attributes:
    """``attrs`` and the attributes that every file of nsdrill has. Results, with the
    ``lengths`` of their dimensions in memory, also have the names of the dimensions of
    the file, of the ``axes`` other than those of the operation, and of the
    ``unknowns``.

    The attribute Conventions does not name CF, which requires numeric coordinates, one
    unit per variable, a vertical depth and a time with a date."""
    return {
        "history": "",
        "model": MODEL,
        **attrs,
        "Conventions": CONVENTIONS,
        "nsdrill_kind": kind,
        "format_version": FORMAT_VERSION,
        "axes": " ".join(axis.name for axis in axes) or None,
        "unknowns": " ".join(unknown.name for unknown in unknowns) or None,
        "dimensions": None if lengths is None else " ".join(file_order(lengths, attrs)),
    }


def stored_attributes(attrs: Attributes) -> Attributes:
    """Attributes as a file stores them: text, numbers and arrays of numbers unchanged,
    booleans as 0 or 1, None left out, all else as JSON text. Text that HDF5 cannot
    store, such as a null character, is escaped, so that writing the file does not
    fail."""
    stored: Attributes = {}
    for name, value in attrs.items():
        if value is None:
            continue
        if isinstance(value, bool | np.bool_):
            value = np.int8(value)
        elif not isinstance(value, str | int | float | np.number | np.ndarray) or (
            isinstance(value, np.ndarray) and value.dtype.kind not in "iuf"
        ):
            value = json_text(value)
        stored[name] = printable(value) if isinstance(value, str) and not _is_storable(value) else value
    return stored


def _is_storable(text: str) -> bool:
    try:
        return b"\0" not in text.encode()
    except UnicodeEncodeError:
        return False


# The root attributes of a file as plain values, with their types checked, whichever
# program wrote them.


# control characters but for tab and line ends, and those that turn the order of others
_CONTROL = dict.fromkeys(
    [*range(9), 11, 12, *range(14, 32), *range(127, 160)]
    + [ord(one) for one in "\u061c\u200e\u200f\u2028\u2029\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069"]
)
LARGEST = 1e100  # of any number: larger ones overflow in sums and in conversions of units
_MOST_PARTS = 4  # of a changed model that a message names
_LONGEST_LIST = 1000  # numbers in an array
_LONGEST_TITLE = 500  # characters that are shown
_LONGEST_TEXT, _LONGEST_PATH = 500, 5000  # characters of a text that is shown
_PATHS = ("study_source", "replay_of")
_ANY_LENGTH = (EDITED_SOURCE, "title", "study", "history", "axes", "unknowns", "dimensions")
_TEXT = (
    EDITED_SOURCE,
    "axes",
    "unknowns",
    "dimensions",
    "model",
    "title",
    "study",
    "study_source",
    "study_sha256",
    "model_digest",
    "model_script",
    "model_graph",
    "model_package",
    "created",
    "history",
    "procedure",
    "status",
    "replay_of",
    "method",
    "along",
    "along_key",
    "over",
    "over_key",
    "followed",
)
_NUMBERS = ("gap", *AXES, "transient", "observe", "rtol", "held_from", "continue_from", "continue_to")
_REFINED = ("refine", "points_run", "points_inferred", "border_spacing")  # a file has all of them or none
_COUNTS = ("format_version", "refine", "points_run", "points_inferred", "sample", "start", "steps", "rejected")
# attributes that hold JSON, and what it is made of
_JSON = {
    "study_overrides": (list, "of texts"),
    "classification": (list, "of texts"),
    "study_resolved": (dict, "whose classify has finite numbers"),
    "classification_resolved": (dict, "of sections with finite numbers"),
    "ramps": (dict, "of times and values"),
    "border_spacing": (dict, "of finite numbers"),
    "at": (dict, "of words and finite numbers"),
    "seeds": (dict, "of whole numbers"),
    USED_SCRIPTS: (dict, "of scripts and digests"),
    MEASURED_BY: (dict, "of scripts and digests"),
    MODEL_PARTS: (dict, "of texts"),
}


_told_of: set[tuple[str, str]] = set()  # files of which something is left out, each of which is told of once


def plain_attributes(where: str | os.PathLike[str], attrs: Attributes, *, changed: bool = False) -> Attributes:
    """Root attributes of a file or a Dataset as plain Python values; arrays stay arrays.
    FileError, about ``where``, if an attribute of nsdrill has the wrong type, and where the
    model of a script or a package, or a drive or a law of a script, is not the one that the
    runs were made with: labels, words and all that is computed of it would be those of
    another one, unless ``changed`` ones are taken. Attributes of other programs are taken
    where they are text or numbers."""
    plain: Attributes = {name: plain_attribute(attrs, name) for name in attrs}
    for name, value in plain.items():
        if (expected := _expected_type(name, value)) is not None:
            raise FileError(f"{where}: the attribute {name} should be {expected}. Make the file again.")
    known = {name: value for name, value in plain.items() if value is not None}
    used = json.loads(str(known.get(USED_SCRIPTS, "{}")))
    if known.get("model", MODEL) not in model_names() or any(own_part(name) is None for name in used):
        import_modules()
    if (model := known.get("model", MODEL)) not in model_names():
        if script := known.get("model_script"):
            raise FileError(f"{where}: {_made_with(model, script)}, {_lacking(script)}.")
        raise FileError(
            f"{where}: made with the model {printable(model)[:80]}, which this nsdrill does not know; it knows "
            f"{', '.join(model_names())}. Use the nsdrill that made it."
        )
    import_additions(str(model))
    with suppress(NsdrillError):  # what is wrong with it is told where it is used
        read_again(str(model), used)
    for name, (script, _) in used.items():
        if own_part(name) is None:
            raise FileError(f"{where}: {_made_with(name, script, '')}, {_lacking(script)}.")
    if not changed and (found := _changed_since(str(model), known, used)):
        raise changed_since(where, found)
    speak_of(str(model))
    if lacking := [name for name in _REFINED if name not in known and not known.keys().isdisjoint(_REFINED)]:
        raise FileError(f"{where}: the attribute {lacking[0]} of a refined sweep is missing. Make the file again.")
    if "refine" in known and known["points_run"] == 0:
        raise FileError(f"{where}: the attribute points_run should be above 0. Make the file again.")
    return known | ({"title": known["title"][:_LONGEST_TITLE]} if "title" in known else {})


def changed_since(where: str | os.PathLike[str], found: str) -> FileError:
    """The error for results that were made with something that is another one here, which
    ``found`` says in words."""
    study = " (nsdrill show FILE --study prints it)" if on_command_line() else ""
    both = " (--with OLD.py --with NEW.py)" if on_command_line() else ""
    return FileError(
        f"{where}: CHANGED SINCE THE RUNS: {found}. Answers would be of another one than the runs; allowed: what they "
        f"were made with, as it was, or the study run again{study}. To compare both versions, give one a name of its "
        f"own and run it: diff takes files of two models{both}."
    )


def check_words(where: str | os.PathLike[str], arrays: Mapping[str, Any], variables: Iterable[Variable]) -> None:
    """FileError where what a script measures has other units or another meaning in ``arrays``
    than among the ``variables`` here: a number of one would be told as one of the other.
    Arithmetic with xarray drops the attributes, of which nothing is known then."""
    for variable in variables:
        if variable.name not in arrays:
            continue
        told = [plain_attribute(arrays[variable.name].attrs, item) for item in ("long_name", "units")]
        here = [variable.long_name, variable.units]
        if any(old is not None and old != new for old, new in zip(told, here, strict=True)):
            there, now = (f"{printable(str(words))[:80]} [{printable(str(unit))[:40]}]" for words, unit in (told, here))
            raise changed_since(where, f"{variable.name}, which a script measures, is {there} there and {now} here")


def check_measured(where: str | os.PathLike[str], model: str, attrs: Attributes) -> None:
    """FileError where the function of what a script measures of a model is another one here than in a
    file with these root attributes. One that is not here is left out, with a warning."""
    here = {one.name: one.digest for one in own_features(model)}
    for name, (script, digest) in json.loads(str(attrs.get(MEASURED_BY, "{}"))).items():
        if here.get(name, digest) != digest:
            raise changed_since(where, f"{_made_with(name, script, 'feature ')}, which computes something else here")


def _changed_since(model: str, attrs: Attributes, used: Mapping[str, Sequence[str]]) -> str:
    """What computes something else here, or speaks of it in other words, than what a file with
    these root attributes was made with, in words; empty where nothing does. ``used`` has the
    script and the digest of each drive and law of a script by name. A package that cannot be
    imported is told of where the model is asked for."""
    for name, (script, digest) in used.items():
        here = own_part(name)
        if here is not None and here.digest != digest:
            return f"{_made_with(name, script, '')}, which computes something else here"
    graph, scripted_here = attrs.get("model_graph"), scripted(model)
    if graph is not None and (scripted_here is None or scripted_here.digest != graph):
        made = _made_with(model, attrs.get("model_script"))
        parts = {} if scripted_here is None else scripted_here.parts
        return f"{made}, which {_other_parts(json.loads(str(attrs.get(MODEL_PARTS, '{}'))), parts)}"
    if (package := attrs.get("model_package")) is not None:
        with suppress(InputError):
            described(model)
            if package_digest(model) != package:
                return (
                    f"made with the model {printable(model)[:80]} of another package, whose files or data are others "
                    "here"
                )
    return ""


def _other_parts(there: Mapping[str, str], here: Mapping[str, str]) -> str:
    """What differs between the parts of a model there and here, in words; of a file without
    them what may."""
    if not there or not here:
        return "has other equations, defaults, ranges, responses or words here"
    parts = [
        *(f"{part} (not there)" for part in here if part not in there),
        *(f"{part} (not here)" for part in there if part not in here),
        *(part for part in there if here.get(part, there[part]) != there[part]),
    ]
    named = ", ".join(printable(part)[:80] for part in parts[:_MOST_PARTS])
    more = f" and {len(parts) - _MOST_PARTS} more" if len(parts) > _MOST_PARTS else ""
    return f"differs here: {named or 'the order of its parts'}{more}"


def tell_of_left_out(where: str | os.PathLike[str], model: Description, names: Sequence[str]) -> None:
    """Warn, once, of variables in a file of results or of a trace that the ``model`` does not
    have here, as one that a script measures has where its script is not given."""
    if not names or (str(where), " ".join(names)) in _told_of:
        return
    _told_of.add((str(where), " ".join(names)))
    listed, given = ", ".join(printable(name)[:80] for name in names[:8]), "with its import before"
    if on_command_line():
        given = f"with {option('with')} FILE"
    warn(
        f"{where}: has variables that the model {model.name} does not have here, and that are left out: {listed}"
        f"{' and others' if len(names) > 8 else ''}. What a script measures is shown {given}, "
        "what a package measures where that is installed.",
        FileWarning,
    )


def _made_with(name: object, script: object, what: str = "model ") -> str:
    """By which model, or another part, of which script a file was made, in words."""
    return f"made with the {what}{printable(str(name))[:80]} of {origin_in_words(script)}"


def _lacking(script: object) -> str:
    """That what made a part is not here, and how it is given."""
    if str(script).startswith(PACKAGE):
        return "which is not installed here or has it no more; allowed: the package installed"
    is_not = "which is executed only where it is given"
    if script == NOTEBOOK:
        return is_not
    if on_command_line():
        return f"{is_not}; allowed: {option('with')} {printable(str(script))[:80]}"
    return f"{is_not}; allowed: its import before"


def plain_attribute(attrs: Attributes, name: str) -> str | int | float | Array | None:
    """The attribute ``name`` as plain text, one number or a short array of numbers; None
    where there is none or where it is anything else. An array with one element becomes a
    number, as xarray writes numbers as such arrays."""
    value = attrs.get(name)
    if isinstance(value, str | bytes):
        return clean_text(value)
    if isinstance(value, np.ndarray | np.generic | int | float):
        array = np.asarray(value)
        if array.dtype.kind in "iufb" and array.ndim < 2 and array.size <= _LONGEST_LIST:
            return array.item() if array.size == 1 else array
    return None


def _is_ramp(knots: object) -> bool:
    """Whether ``knots`` are two lists of numbers, as many times as values."""
    times, values = np.asarray(knots, dtype=float)
    return times.ndim == 1 and times.size > 0 and bool(np.all(np.abs(values) <= LARGEST) and np.all(np.diff(times) > 0))


def _is_finite(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= LARGEST


def _are_thresholds(section: object) -> bool:
    return all(_is_finite(value) for _, value in flat({"": section}))


# what the elements of JSON are, by the words of _JSON
_ELEMENTS: dict[str, Callable[[object], bool]] = {
    "of texts": _is_text,
    "of times and values": _is_ramp,
    "of finite numbers": _is_finite,
    "of sections with finite numbers": _are_thresholds,
    "whose classify has finite numbers": _are_thresholds,
    "of words and finite numbers": lambda value: _is_text(value) or _is_finite(value),
    "of whole numbers": _is_count,
    "of scripts and digests": lambda value: isinstance(value, list) and len(value) == 2 and all(map(_is_text, value)),
}


def clean_text(value: str | bytes) -> str:
    """A text of a file without the characters that a terminal would obey."""
    if isinstance(value, str):  # h5py keeps the bytes that are no UTF-8
        value = value.encode("utf-8", "surrogateescape")
    return value.decode("utf-8", "replace").translate(_CONTROL)


def _expected_type(name: str, value: object) -> str | None:
    """What the attribute should be, in words, where it is something else; else None."""
    if name in _JSON:
        kind, of = _JSON[name]
        words = f"a JSON {'list' if kind is list else 'object'} {of}"
        try:
            found = json.loads(value) if isinstance(value, str) else None
            if not isinstance(found, kind):
                return words
            json.dumps(found, allow_nan=False)  # which loads takes, and JSON is without
            if name == "study_resolved":
                found = [found.get("classify", {})]
            elements = found if isinstance(found, list) else found.values()
            return None if all(map(_ELEMENTS[of], elements)) else words
        except (ValueError, TypeError, RecursionError):
            return words
    if name in _TEXT or (name.endswith("_version") and name != "format_version"):
        most = _LONGEST_PATH if name in _PATHS else _LONGEST_TEXT
        if isinstance(value, str) and (name in _ANY_LENGTH or len(value) <= most):
            return None
        return f"text of at most {most} characters" if isinstance(value, str) else "text"
    if name in _COUNTS:
        return None if isinstance(value, int) and value >= 0 else "a whole number"
    if name in _NUMBERS:
        return None if _is_finite(value) else "a finite number"
    return None
