"""From YAML to a :class:`Study`: parse, override, read each value, check what constrains
several, fill in the defaults, build. A Python mapping becomes the YAML that says the
same. Overrides, ``--set key=value``, are put in before anything is validated, so that
they meet the same checks.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields, replace
from functools import reduce
from io import StringIO
from operator import getitem
from pathlib import Path

from nsdrill.data import Resolved, value_at
from nsdrill.errors import Fault, StudyError, option
from nsdrill.models.choices import is_compiled_in
from nsdrill.models.own_parts import find_words
from nsdrill.models.registry import speak_of
from nsdrill.models.responses import Thresholds
from nsdrill.study.assembly import take_sections
from nsdrill.study.checker import Checker
from nsdrill.study.continuation import SECTION as CONTINUE
from nsdrill.study.forms import Reading
from nsdrill.study.keys import AROUND, Plain, Value, axes_of_all, colon_hint, keys_named, model_leaf, shown
from nsdrill.study.read import DEEPEST, Document, KeyPath, Place, dotted, odd_character, parse, read_text
from nsdrill.study.schema import study_form
from nsdrill.study.study import Study, build, study_from_resolved
from nsdrill.study.torques import path_with_unit, take_torques, use_keys_with_units
from nsdrill.study.uncertain import draws, say_doubts, say_what_is_left_out, take_uncertain
from nsdrill.study.weight import weigh
from nsdrill.units import system_of
from nsdrill.variables import AXES, MODEL, OPERATED, short_key

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
        hint = colon_hint(document.data, study_form().listed) if isinstance(document.data, str) else None
        allowed = f"a mapping with the keys {', '.join(study_form().listed)}"
        raise StudyError(name, [Fault("", found, allowed, 1, 1, hint)])
    return _study_in(document, text, name, overrides)


def default_study(model: str) -> Study:
    """The study that has the name of its ``model`` alone."""
    return _study_in(Document({"model": model}))


def _study_in(document: Document, text: str = "", name: str = "<study>", overrides: Sequence[str] = ()) -> Study:
    """The study in a ``document`` of the ``text``."""
    apply_overrides(document, overrides)
    find_words(document.data)
    named = document.data.get("model")
    speak_of(str(named))
    at = Reading(document, keys_named(named if named in model_leaf().choices else model_leaf().default))
    given = study_form(at.keys.model.name).read(at, (), document.data)
    del at.faults[_MAX_FAULTS:]
    resolved = _resolve(at, given)
    drawn = {}
    if "uncertain" in resolved:
        before = len(at.faults)
        say_what_is_left_out(at, resolved["uncertain"])
        say_doubts(at, resolved["uncertain"])
        drawn = draws(resolved["uncertain"], at.keys) if len(at.faults) == before else {}
    check = Checker(at, resolved, drawn)
    if faults := [*at.faults, *check.faults(), *document.faults]:
        raise StudyError(name, _in_file_order(faults))
    for key, value in check.replaced().items():
        *sections, last = key.split(".")
        reduce(getitem, sections, resolved)[last] = value
    study = study_from_resolved(resolved, text, name, overrides)
    return replace(study, notes=tuple(document.notes))


def change_thresholds(thresholds: Thresholds, overrides: Sequence[str], model: str = MODEL) -> Thresholds:
    """``thresholds`` of a ``model`` with ``classify.key=value`` overrides, for labels on a
    finished file.

    ``classify.stuck_below`` enters the run itself and is refused.
    """
    document = Document({})
    apply_overrides(document, overrides)
    faults = list(document.faults)
    for section in document.data:
        if section != "classify":
            found = f"a change of something else ({document.place((section,)).override})"
            known = section in {item.name for item in fields(thresholds)}
            hint = f"Did you mean classify.{section}?" if known else None
            faults.append(Fault(section, found, "keys of classify, on a finished file", suggestion=hint))
    classify = document.data.get("classify")
    if isinstance(classify, dict) and "stuck_below" in classify:
        found, hint = ("a change on a finished file", "It enters the run itself, and needs a new one.")
        faults.append(Fault("classify.stuck_below", found, "the other keys of classify", suggestion=hint))
    at = Reading(document, keys_named(model))
    given = study_form(model).read(at, (), {"classify": classify})
    resolved = {"classify": _merged(asdict(thresholds), given.get("classify", {}))}
    if faults := [*faults, *at.faults, *Checker(at, resolved).order("classify")]:
        raise StudyError(option("set"), faults)
    made = build(type(thresholds), resolved["classify"])
    return made


def _resolve(at: Reading, given: Resolved) -> Resolved:
    """The complete study as plain data, from the values ``given``: defaults filled in,
    axes ascending."""
    keys, ramps = at.keys, _take_ramps(given.get("operation", {}), at.keys.operated)
    resolved: Resolved = {"title": given.get("title", ""), "model": keys.model.name}
    resolved["units"] = given.get("units") or units_typed(at.document.data)
    for section, cls in keys.sections.items():
        resolved[section] = _merged(_plain(asdict(cls())), given.get(section, {}))
    for leaf in keys.leaves.values():
        if leaf.kind == "table":  # a record that is given has the defaults of a record
            *sections, name = leaf.key.split(".")
            holder = reduce(getitem, sections, resolved)
            if holder[name] is None:
                continue
            empty = {part.key.rpartition(".")[2]: part.default for part in leaf.parts}
            holder[name] = [{**empty, **record} for record in holder[name]]
        if leaf.follows and leaf.key not in at.faulty and not at.document.has(tuple(leaf.key.split("."))):
            *sections, name = leaf.key.split(".")
            reduce(getitem, sections, resolved)[name] = leaf.default_in(resolved, given.get("sweep", {}))
    weigh(at, resolved)
    if ramps:
        resolved["ramps"] = ramps
    take_sections(at, resolved)
    take_torques(at, resolved, given)
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


def units_typed(data: Plain) -> str:
    """The system of units, "si" or "field", in which a study was typed: that of the field
    if more of the quantities in its ``data`` are in such units than in SI."""
    found: Counter[str | None] = Counter()

    def count(value: Plain) -> None:
        if isinstance(value, str):
            found[system_of(value)] += 1
        elif isinstance(value, dict | list):
            for one in value.values() if isinstance(value, dict) else value:
                count(one)

    count({key: value for key, value in data.items() if key != "title"} if isinstance(data, dict) else data)
    return "field" if found["field"] > found["si"] else "si"


def _take_ramps(operation: Resolved, names: Sequence[str]) -> dict[str, list[list[float]]]:
    """The ramps of the section ``operation`` as [times, values], each replaced there by
    its value at time zero."""
    ramps = {}
    for name in names:
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


def apply_overrides(document: Document, overrides: Sequence[str]) -> None:
    """Applies each ``key=value``, the value as YAML, in order; what cannot be applied
    becomes a fault."""
    if document.data is None:
        document.data = {}
    _use_short_keys(document)
    use_keys_with_units(document)
    for text in overrides:
        key, equals, value = text.partition("=")
        path = path_of(key.strip())
        if not equals or not all(path) or odd_character(key):
            document.faults.append(
                Fault(
                    "",
                    f"{option('set')} {text[:80]}",
                    f"{option('set', 'key=value')}, as in {option('set', 'operation.wob=30kN')}",
                )
            )
            continue
        label = option("set", text[:80])
        try:
            parsed = parse(value, label)
        except StudyError as error:
            found = f"{error.faults[0].found} ({label})"
            document.faults.append(Fault(dotted(path), found, "a value in YAML"))
            continue
        document.faults.extend(parsed.faults)
        path = path_with_unit(document, path, parsed.data)
        _put(document, path, parsed.data if value.strip() else None, Place(override=label))
        _use_short_keys(document)
        use_keys_with_units(document)


def _use_short_keys(document: Document) -> None:
    """Among the axes and the unknowns ``operation.wob`` and ``wob`` are one key: the
    short one from here on."""
    for around in (("sweep",), ("uncertain",), ("uncertain", "table")):
        found = document.value(around)
        if not isinstance(found, dict):
            continue
        for key in [key for key in found if short_key(key) != key]:
            if short_key(key) in found:
                words = f"the key a second time, as {short_key(key)}"
                document.faults.append(document.fault((*around, key), words, "each key once", of_key=True))
            for places in (document.values, document.keys):
                for path in [path for path in places if path[: len(around) + 1] == (*around, key)]:
                    places[(*around, short_key(key), *path[len(around) + 1 :])] = places.pop(path)
        short = {short_key(key): value for key, value in found.items()}
        if around == ("sweep",) and isinstance(short.get("along"), str):
            short["along"] = short_key(short["along"])
        document.value(around[:-1])[around[-1]] = short


def path_of(key: str) -> KeyPath:
    """The place of a dotted key; an axis of the sweep, or an unknown, is one part,
    however many dots it has."""
    first, *rest = key.split(".")
    if first in AXES or (first in OPERATED and not rest):  # of the operating point, in short
        first, rest = "operation", [first, *rest]
    before: KeyPath = (first,)
    if first == "uncertain" and rest[:1] == ["table"]:
        before, rest = (first, "table"), rest[1:]
    for length in range(len(rest), 1, -1):
        name = short_key(".".join(rest[:length]))
        if first in AROUND and name in axes_of_all():
            return (*before, name, *rest[length:])
    if before == ("uncertain",) and len(rest) > 1 and rest[0] not in axes_of_all():
        return (*before, ".".join(rest))  # no such key, which is said of the whole of it
    return (*before, *rest)


def _put(document: Document, path: KeyPath, value: Plain, place: Place) -> None:
    """Set a value; sections on the way to it that are not there, or empty, are made."""
    inside = document.data
    for depth, part in enumerate(path[:-1], start=1):
        if not isinstance(inside, dict):
            break
        if inside.get(part) is None:
            inside[part] = {}
            document.values[path[:depth]] = document.keys[path[:depth]] = place
        inside = inside[part]
    if not isinstance(inside, dict):
        given = f" ({place.override})" if place.override else ""
        found = f"{shown(inside)}, which has no keys to set{given}"
        document.faults.append(Fault(dotted(path[:-1]), found, f"a mapping, or {option('set')} of the whole value"))
        return
    for places in (document.values, document.keys):
        for old in [known for known in places if known[: len(path)] == path]:
            del places[old]
        places[path] = place
    inside[path[-1]] = value


TAKEN = "text, numbers, True, False, None, and lists and mappings of these"


def yaml_text(mapping: Mapping[str, object], name: str) -> str:
    """The study ``mapping`` as YAML; its keys may be nested or dotted, as
    ``well.friction.static``, or both. StudyError about the study ``name`` where a key
    is given twice or a value is none that a study has."""
    document = Document({})
    try:
        _take_mapping(mapping, (), document)
    except RecursionError:
        document.faults.append(Fault("", "a list or mapping that holds itself", TAKEN))
    if document.faults:
        raise StudyError(name, document.faults)
    return _dumped(document.data)


def override_texts(changes: Mapping[str, object], name: str) -> list[str]:
    """``changes`` by dotted keys as texts ``key=value``, the values in YAML."""
    faults: list[Fault] = []
    texts = []
    for key, value in changes.items():
        plain = _plain_value(value, (str(key),), faults)
        if not isinstance(key, str) or not key.strip() or "=" in key:
            faults.append(Fault("", f"{key!r} as a key", "dotted keys, as in {'operation.wob': '30 kN'}"))
        elif not faults:
            on_one_line = _dumped({"v": plain}, lines=False).removeprefix("{v: ").removesuffix("}\n")
            texts.append(f"{key}={on_one_line}")
    if faults:
        raise StudyError(name, faults)
    return texts


def _take_mapping(mapping: Mapping[str, object], above: KeyPath, document: Document) -> None:
    """Put the values of a mapping, nested or dotted, where they belong."""
    for key, value in mapping.items():
        if not isinstance(key, str) or not all(key.split(".")):
            found, allowed = f"{key!r} as a key", "names, nested or dotted, as 'operation.wob'"
            document.faults.append(Fault(dotted(above), found, allowed))
            continue
        path = path_of(".".join(map(str, (*above, key))))
        if len(path) > DEEPEST:
            found = f"more than {DEEPEST} levels"
            document.faults.append(Fault(dotted(path), found, "the five levels of a study"))
        elif isinstance(value, Mapping) and value:
            _take_mapping(value, path, document)
        elif document.has(path) or not isinstance(document.value(path[:-1]) or {}, dict):
            document.faults.append(Fault(dotted(path), "the key a second time", "each key once, nested or dotted"))
        else:
            _put(document, path, _plain_value(value, path, document.faults), Place())


def _plain_value(value: object, path: KeyPath, faults: list[Fault]) -> Plain:
    """``value`` as YAML has it; what numpy made becomes Python's own."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, str):
        return str(value)
    if value is None or isinstance(value, bool | int | float):
        return value
    if isinstance(value, list | tuple):
        return [_plain_value(item, path, faults) for item in value]
    if isinstance(value, Mapping):
        return {str(name): _plain_value(item, (*path, str(name)), faults) for name, item in value.items()}
    faults.append(Fault(dotted(path), f"a value of the type {type(value).__name__}", TAKEN))
    return None


def _dumped(nested: Plain, *, lines: bool = True) -> str:
    from ruamel.yaml import YAML

    yaml = YAML()
    # None: the innermost lists and mappings on lines of their own
    yaml.default_flow_style = None if lines else True
    yaml.width = 120 if lines else 1_000_000
    out = StringIO()
    yaml.dump(nested, out)
    return out.getvalue()
