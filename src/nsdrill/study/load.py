"""From YAML to a :class:`Study`: parse, override, read each value, check what constrains
several, fill in the defaults, build.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import reduce
from operator import getitem
from pathlib import Path

from nsdrill.data import Resolved, value_at
from nsdrill.errors import Fault, StudyError, option
from nsdrill.models.leaves import is_compiled_in
from nsdrill.models.responses import Thresholds
from nsdrill.study.constraints import Checker
from nsdrill.study.continuation import SECTION as CONTINUE
from nsdrill.study.forms import Reading
from nsdrill.study.keys import MODEL_LEAF, Value, keys_named, shown
from nsdrill.study.read import Document, apply_overrides, parse, read_text
from nsdrill.study.schema import study_form
from nsdrill.study.study import Study, build, study_from_resolved
from nsdrill.study.uncertain import draws, take_uncertain
from nsdrill.variables import AXES

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
        raise StudyError(name, [Fault("", found, f"a mapping with the keys {', '.join(study_form().listed)}", 1, 1)])
    apply_overrides(document, overrides)
    named = document.data.get("model")
    at = Reading(document, keys_named(named if named in MODEL_LEAF.choices else MODEL_LEAF.default))
    given = study_form(at.keys.model.name).read(at, (), document.data)
    del at.faults[_MAX_FAULTS:]
    resolved = _resolve(at, given)
    drawn = draws(resolved["uncertain"], at.keys) if "uncertain" in resolved else {}
    if faults := [*at.faults, *Checker(at, resolved, drawn).faults(), *document.faults]:
        raise StudyError(name, _in_file_order(faults))
    study = study_from_resolved(resolved, text, name, overrides)
    return replace(study, notes=tuple(document.notes))


def change_thresholds(thresholds: Thresholds, overrides: Sequence[str]) -> Thresholds:
    """``thresholds`` with ``classify.key=value`` overrides, for labels on a finished
    file.

    ``classify.stuck_below`` enters the run itself and is refused.
    """
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
    at = Reading(document, keys_named())  # the thresholds are those of every model
    given = study_form().read(at, (), {"classify": classify})
    resolved = {"classify": _merged(asdict(thresholds), given.get("classify", {}))}
    if faults := [*faults, *at.faults, *Checker(at, resolved).order("classify")]:
        raise StudyError(option("set"), faults)
    made: Thresholds = build(Thresholds, resolved["classify"])
    return made


def _resolve(at: Reading, given: Resolved) -> Resolved:
    """The complete study as plain data, from the values ``given``: defaults filled in,
    axes ascending."""
    keys, ramps = at.keys, _take_ramps(given.get("operation", {}))
    resolved: Resolved = {"title": given.get("title", ""), "model": keys.model.name}
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
    axes = _swept_axes(at, sweep, resolved)
    uncertain = take_uncertain(at, given.get("uncertain", {}), axes)
    if uncertain is not None:
        resolved["uncertain"] = uncertain
    ranges = given.get("initial", {}).get("slice", {})
    resolved["initial"]["slice"] = {state: ranges[state] for state in keys.slices if state in ranges}
    procedure, along = sweep.get("procedure", "same"), sweep.get("along")
    if procedure == "same":
        along = None  # nothing is carried
    elif along is None:
        numbers = [key for key in axes if not is_compiled_in(keys.model, key)]
        along = next(iter(numbers if len(numbers) == 1 else axes if len(axes) == 1 else []), None)
    resolved["sweep"] = {**axes, "procedure": procedure, "along": along, "refine": sweep.get("refine", 0)}
    if CONTINUE in given:
        resolved[CONTINUE] = given[CONTINUE]
    return resolved


def _take_ramps(operation: Resolved) -> dict[str, list[list[float]]]:
    """The ramps of the section ``operation`` as [times, values], each replaced there by
    its value at time zero."""
    ramps = {}
    for name in AXES:
        if isinstance(operation.get(name), dict):
            times, values = (list(column) for column in zip(*operation[name]["ramp"], strict=True))
            ramps[name], operation[name] = [times, values], values[0]
    return ramps


def _swept_axes(at: Reading, sweep: Resolved, resolved: Resolved) -> Resolved:
    """The axes of the sweep in the order of the file, which is that of the dimensions
    of the results."""
    keys = at.keys
    for key, (choice, _) in keys.model.units_by.items():
        if key in sweep and keys.leaf(key, resolved).units != keys.leaves[key].units:
            # The name of an axis does not tell that its units are others.
            name, default = choice.rpartition(".")[2], keys.leaves[choice].default
            found = value_at(resolved, choice)
            allowed = f"it with {name}: {default}; else run a study for each value, with {option('set', f'{key}=...')}"
            at.refuse(("sweep", key), f"an axis with {name}: {found}", allowed, of_key=True)
    return {axis: values for axis, values in sweep.items() if axis in keys.axes}


def _plain(value: Value) -> Value:
    """Nested data with lists in place of tuples, as a file gives it back."""
    if isinstance(value, dict):
        return {name: _plain(one) for name, one in value.items()}
    return [_plain(one) for one in value] if isinstance(value, list | tuple) else value


def _merged(defaults: Resolved, given: Resolved) -> Resolved:
    return {
        name: _merged(value, given.get(name, {})) if value and isinstance(value, dict) else given.get(name, value)
        for name, value in defaults.items()
    }


def _in_file_order(faults: list[Fault]) -> list[Fault]:
    """By place in the file; those without one (``--set``) last. The same fault once."""
    unique = list(dict.fromkeys(faults))
    unique.sort(key=lambda fault: (fault.line is None, fault.line or 0, fault.column or 0))
    return unique[:_MAX_FAULTS]
