"""From YAML to a :class:`Study`: parse, override, validate each value, check what
constrains several, fill in the defaults, build.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial, reduce
from itertools import pairwise
from operator import getitem
from pathlib import Path
from typing import Any

from nsdrill.errors import Fault, StudyError
from nsdrill.models.leaves import is_compiled_in, place_of, words_of
from nsdrill.observe.thresholds import Thresholds
from nsdrill.study.constraints import Checker
from nsdrill.study.continuation import SECTION as CONTINUE
from nsdrill.study.continuation import take_continuation
from nsdrill.study.forms import Reading, keys_below
from nsdrill.study.keys import MODEL_LEAF, Keys, keys_named, shown
from nsdrill.study.read import Document, KeyPath, apply_overrides, dotted, parse, read_text
from nsdrill.study.schema import study_form
from nsdrill.study.study import Study, build, study_from_resolved
from nsdrill.study.uncertain import draws, take_uncertain
from nsdrill.variables import AXES

LEAST_LEG = 1e-3  # s between knots: a shorter leg is a jump to a drill string
Knots = list[list[float]]
_MAX_FAULTS = 100  # told of one file; nobody reads more


def load_study(source: str | Path, overrides: Sequence[str] = ()) -> Study:
    """The study in the file ``source``, with ``key=value`` overrides applied.

    :class:`FileError` where the file cannot be read as text, :class:`StudyError` with
    all its faults where it is not a valid study.
    """
    path = Path(source)
    return parse_study(read_text(path), str(path), overrides)


def parse_study(text: str, name: str = "<study>", overrides: Sequence[str] = ()) -> Study:
    """The study in YAML ``text``; ``name`` stands for the file in messages."""
    document = parse(text, name)
    if (document.data is None or document.data == {}) and not overrides and not document.faults:
        raise StudyError(name, [Fault("", "an empty document", "a study, as nsdrill new writes one", 1, 1)])
    document.data = {} if document.data is None else document.data
    if not isinstance(document.data, dict):
        found = f"{shown(document.data)} as the whole document"
        raise StudyError(
            name, [Fault("", found, f"a mapping with the keys {', '.join(keys_below('', keys_named()))}", 1, 1)]
        )
    apply_overrides(document, overrides)
    keys = _keys(document)
    given, faults, faulty = _validate(document, keys)
    resolved, axis_faults = _resolve(document, given, keys)
    faulty |= {fault.key for fault in axis_faults}
    drawn = draws(resolved["uncertain"], keys) if "uncertain" in resolved else {}
    faults += axis_faults
    faults += Checker(keys.model, document, resolved, keys.leaves, faulty, drawn).faults()
    faults += document.faults
    if faults:
        raise StudyError(name, _in_file_order(faults))
    study = study_from_resolved(resolved, text, name, overrides)
    return replace(study, notes=tuple(document.notes))


def change_thresholds(thresholds: Thresholds, overrides: Sequence[str]) -> Thresholds:
    """``thresholds`` with ``classify.key=value`` overrides, for labels on a finished
    file.

    ``classify.stuck_below`` enters the run itself and is refused.
    """
    source = "--set"
    document = Document({})
    apply_overrides(document, overrides)
    faults = list(document.faults)
    for section in document.data:
        if section != "classify":
            found = f"a change of something else ({document.place((section,)).override})"
            faults.append(Fault(section, found, "keys of classify, on a finished file"))
    classify = document.data.get("classify")
    if isinstance(classify, dict) and "stuck_below" in classify:
        found, hint = ("a change on a finished file", "It enters the run itself, and needs a new one.")
        faults.append(Fault("classify.stuck_below", found, "the other keys of classify", suggestion=hint))
    partial = Document({"classify": classify}, document.values, document.keys)
    keys = keys_named()  # the thresholds are those of every model
    given, more, faulty = _validate(partial, keys)
    resolved = {"classify": _merged(asdict(thresholds), given.get("classify", {}))}
    more += Checker(keys.model, document, resolved, keys.leaves, faulty).order("classify")
    if faults + more:
        raise StudyError(source, faults + more)
    made: Thresholds = build(Thresholds, resolved["classify"])
    return made


def _keys(document: Document) -> Keys:
    """The keys of the study's model, of the default one where it names none that there
    is."""
    named = document.data.get("model")
    return keys_named(named if isinstance(named, str) and named in MODEL_LEAF.choices else MODEL_LEAF.default)


def _validate(document: Document, keys: Keys) -> tuple[dict[str, Any], list[Fault], set[str]]:
    """The values given, in SI; the faults; and the keys at fault, which are left out of
    the values."""
    at = Reading(document, keys)
    given = study_form(keys.model.name).read(at, (), document.data)
    return given, at.faults[:_MAX_FAULTS], at.faulty


def _resolve(document: Document, given: dict[str, Any], keys: Keys) -> tuple[dict[str, Any], list[Fault]]:
    """The complete study as plain data, defaults filled in, axes ascending."""
    ramps, faults = _ramps(document, given.get("operation", {}))
    resolved: dict[str, Any] = {"title": given.get("title", ""), "model": keys.model.name}
    if "units" in given:
        resolved["units"] = given["units"]
    for section, cls in keys.sections.items():
        resolved[section] = _merged(_plain(asdict(cls())), given.get(section, {}))
    for leaf in keys.leaves.values():
        if leaf.kind == "table":  # a record that is given has the defaults of a record
            *sections, name = leaf.key.split(".")
            holder = reduce(getitem, sections, resolved)
            empty = {part.key.rpartition(".")[2]: part.default for part in leaf.parts}
            holder[name] = [{**empty, **record} for record in holder[name]]
    if ramps:
        resolved["ramps"] = ramps
    sweep = given.get("sweep", {})
    axes, more = _swept_axes(document, sweep, resolved, keys)
    faults += more
    uncertain, more = take_uncertain(document, given.get("uncertain", {}), axes, keys)
    faults += more
    if uncertain is not None:
        resolved["uncertain"] = uncertain
    ranges = given.get("initial", {}).get("slice", {})
    states = [state for state in keys.slices if state in ranges]
    resolved["initial"]["slice"], more = _ascending_axes(
        document, ("initial", "slice"), {state: ranges[state] for state in states}
    )
    faults += more
    procedure, along = sweep.get("procedure", "same"), sweep.get("along")
    if procedure == "same":
        along = None  # nothing is carried
    elif along is None and not faults:
        numbers = [key for key in axes if not is_compiled_in(keys.model, key)]
        along = next(iter(numbers if len(numbers) == 1 else axes if len(axes) == 1 else []), None)
    resolved["sweep"] = {**axes, "procedure": procedure, "along": along, "refine": sweep.get("refine", 0)}
    continuation, more = take_continuation(document, keys)
    faults += more
    if continuation is not None:
        resolved[CONTINUE] = continuation
    return resolved, faults


def _swept_axes(
    document: Document, sweep: dict[str, Any], resolved: dict[str, Any], keys: Keys
) -> tuple[dict[str, Any], list[Fault]]:
    """The axes of the sweep in the order of the file, which is that of the dimensions
    of the results, and their faults."""
    written = document.data.get("sweep")
    order = [axis for axis in (written if isinstance(written, dict) else ()) if axis in keys.axes and axis in sweep]
    axes, faults = _ascending_axes(document, ("sweep",), {axis: sweep[axis] for axis in order})
    for key, (choice, _) in keys.model.units_by.items():
        if key in axes and keys.leaf(key, resolved).units != keys.leaves[key].units:
            # The name of an axis does not tell that its units are others.
            name, default = choice.rpartition(".")[2], keys.leaves[choice].default
            found = reduce(getitem, choice.split("."), resolved)
            allowed = f"it with {name}: {default}; else run a study for each value, with --set {key}=..."
            path: KeyPath = ("sweep", key)
            words = f"an axis with {name}: {found}"
            faults.append(document.fault(path, words, allowed, key=f"sweep.{key}", of_key=True))
    return axes, faults


def _ascending_axes(document: Document, section: KeyPath, given: dict[str, Any]) -> tuple[dict[str, Any], list[Fault]]:
    """The axes of a section in ascending order, without those that are at fault."""
    axes: dict[str, Any] = {}
    faults = []
    for name, value in given.items():
        ascending = _ascending(document, (*section, name), value)
        if isinstance(ascending, Fault):
            faults.append(ascending)
        else:
            axes[name] = ascending
    return axes, faults


def _plain(value: Any) -> Any:
    """Nested data with lists in place of tuples, as a file gives it back."""
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def _merged(defaults: dict[str, Any], given: dict[str, Any]) -> dict[str, Any]:
    return {
        name: _merged(value, given.get(name, {})) if value and isinstance(value, dict) else given.get(name, value)
        for name, value in defaults.items()
    }


def _ascending(document: Document, path: KeyPath, value: Any) -> Any:
    """An axis in ascending order: a list, or {from, to, points} as that, however many
    points it has; a :class:`Fault` where it cannot be one."""
    if isinstance(value, dict):
        return _ascending_range(document, path, value)
    choice = str(path[-1]) if words_of(str(path[-1])) else ""
    order = partial(place_of, choice) if choice else None
    values = sorted(value, key=order) if isinstance(value, list) else [value]
    if not values:
        return document.fault(path, "an empty list", "at least one value")
    for first, second in pairwise(values):
        if first == second:
            at = [index for index, item in enumerate(value) if item == second][1]
            raw = document.data["sweep"][path[-1]][at]
            found = f"{shown(raw)}, which is there a second time"
            return document.fault((*path, at), found, "each value once")
    return values


def _ascending_range(document: Document, path: KeyPath, value: dict[str, Any]) -> Any:
    """An axis {from, to, points} in ascending order, or its :class:`Fault`."""
    low, high = sorted((value["from"], value["to"]))
    if value["from"] > value["to"]:
        raw = reduce(getitem, path, document.data)
        document.notes.append(
            f"{dotted(path)} goes from {raw['from']} down to {raw['to']}; its values are taken in "
            f"ascending order. To carry the state downwards, write procedure: down."
        )
    spacing = (high - low) / (value["points"] - 1)
    if spacing <= 4 * math.ulp(max(abs(low), abs(high))):
        return document.fault(path, "values that are the same", "from and to that differ")
    if value.get("spacing") != "log":
        return {"from": low, "to": high, "points": value["points"]}
    if low <= 0.0:
        found = f"log spacing from {low:g} in SI units" if low else "log spacing from 0"
        return document.fault((*path, "spacing"), found, "linear, or values above 0")
    return {"from": low, "to": high, "points": value["points"], "spacing": "log"}


def _in_file_order(faults: list[Fault]) -> list[Fault]:
    """By place in the file; those without one (``--set``) last. The same fault once."""
    unique = list(dict.fromkeys(faults))
    unique.sort(key=lambda fault: (fault.line is None, fault.line or 0, fault.column or 0))
    return unique[:_MAX_FAULTS]


def _ramps(document: Document, operation: dict[str, Any]) -> tuple[dict[str, Knots], list[Fault]]:
    """The ramps of the validated section ``operation`` as [times, values], each
    replaced there by its value at time zero; and the faults of their knots."""
    ramps: dict[str, Knots] = {}
    faults: list[Fault] = []
    for name in AXES:
        given = operation.get(name)
        if not isinstance(given, dict):
            continue
        fault = _fault_of_ramp(document, name, given["ramp"])
        if fault is None:
            times, values = (list(column) for column in zip(*given["ramp"], strict=True))
            ramps[name] = [times, values]
            operation[name] = values[0]
        else:
            faults.append(fault)
            del operation[name]
    return ramps, faults


def _fault_of_ramp(document: Document, name: str, found: list[tuple[float, float]]) -> Fault | None:
    path: KeyPath = ("operation", name, "ramp")
    if len(found) < 2:
        words = "one knot" if found else "an empty list"
        return document.fault(path, words, "two knots or more; a value that does not change stands without a ramp")
    for i, (time, _) in enumerate(found):
        if i == 0 and time != 0.0:
            return document.fault((*path, 0, 0), _raw_time(document, name, 0), "0 s, where the run begins")
        if i > 0 and time < found[i - 1][0] + LEAST_LEG:
            before = _raw_time(document, name, i - 1)
            allowed = f"times that ascend, at least {1e3 * LEAST_LEG:g} ms after the one before, {before}"
            return document.fault((*path, i, 0), _raw_time(document, name, i), allowed)
    return None


def _raw_time(document: Document, name: str, i: int) -> str:
    return shown(document.data["operation"][name]["ramp"][i][0])
