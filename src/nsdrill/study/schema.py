"""What a study is made of: its sections with their keys, units, ranges and defaults,
from the dataclasses that the run uses; and its JSON Schema, for editors that complete
and check YAML while it is written.

One value at a time is checked here; what constrains several values together is in
``constraints.py``. Values come out in SI.
"""

from __future__ import annotations

import typing
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from functools import lru_cache
from typing import Any

from nsdrill.models.leaves import is_compiled_in
from nsdrill.sampling import BOUNDS, NUMBERS_OF
from nsdrill.study.continuation import continuation_form
from nsdrill.study.forms import (
    RANGE,
    Briefly,
    Either,
    Form,
    Knot,
    Listed,
    Member,
    One,
    Read,
    Schema,
    Section,
    Unread,
    member,
)
from nsdrill.study.keys import MEANINGS, MODEL_LEAF, RAMP, SLICE, TIME, UNITS_LEAF, Keys, Leaf, keys_named, shown
from nsdrill.study.read import odd_character
from nsdrill.study.study import Procedure
from nsdrill.study.uncertain import CUT_WORDS, DESIGN, EXAMPLES, FACTOR, SAMPLES, SEED, correlation
from nsdrill.units import QuantityError
from nsdrill.variables import MODEL

LONGEST_TITLE = 500  # characters

POINTS = Leaf("points", "whole", 2, low=2, high=10**8)
PROCEDURE = Leaf(
    "sweep.procedure", "choice", "same", choices=typing.get_args(Procedure), meaning=MEANINGS["sweep.procedure"]
)
REFINE = Leaf("sweep.refine", "whole", 0, low=0, high=6, meaning=MEANINGS["sweep.refine"])
SPACING = Leaf("spacing", "choice", "linear", choices=("linear", "log"))

# a value in the JSON Schema of an unknown, whose key tells the rest elsewhere
SHORT = {"type": ["string", "number"]}
DISTRIBUTION = {
    "type": "object",
    "additionalProperties": False,
    "minProperties": 1,
    "maxProperties": 1,
    "properties": {
        kind: {"type": "object" if kind in NUMBERS_OF else "array", "description": form}
        for kind, form in EXAMPLES.items()
    },
}
ALL_OF_RANGE = "all of from, to and points"


@lru_cache(maxsize=8)
def study_form(model: str = MODEL) -> Section:
    """The form of a whole study file of the model of this name."""
    keys = keys_named(model)
    title = Read(_title, {"type": "string", "maxLength": LONGEST_TITLE})
    members = {"title": member(title, MEANINGS["title"]), "units": _leaf(UNITS_LEAF), "model": _leaf(MODEL_LEAF)}
    for name, cls in keys.sections.items():
        if name == "simulation":  # these two stand before it in the file
            members["sweep"] = member(_sweep(keys), MEANINGS["sweep"])
            members["uncertain"] = member(_uncertain(keys), MEANINGS["uncertain"])
        members[name] = _section(name, cls, keys)
    # its units depend on its own values: study/continuation.py reads it
    members["continue"] = member(Unread(continuation_form(keys)), MEANINGS["continue"])
    return Section("Study", members)


def description(found: Leaf) -> str:
    """Meaning, unit, default and source in one paragraph."""
    parts = [found.meaning]
    if found.units and found.kind != "table":
        parts.append(f"In {found.units}")
    if found.kind in ("quantity", "number", "whole"):
        parts.append(f"Range: {found.range()}" + (f" (in the field: {found.usual})" if found.usual else ""))
    parts.append(f"Default {found.default_text}")
    if found.source:
        parts.append(f"Source: {found.source}" + (f" (confidence: {found.confidence})" if found.confidence else ""))
    return ". ".join(parts) + "."


def _section(prefix: str, cls: type, keys: Keys, off: Mapping[str, Any] | None = None) -> Member:
    """A section: an empty one (null) is one with all its defaults, or with the values
    ``off``."""
    hints = typing.get_type_hints(cls)
    members: dict[str, Member] = {}
    for item in fields(cls):
        key, hint = f"{prefix}.{item.name}", hints[item.name]
        if key == SLICE:
            members[item.name] = member(_slice(keys), keys.meanings[SLICE])
        elif is_dataclass(hint) and isinstance(hint, type):
            members[item.name] = _section(key, hint, keys, item.metadata.get("off"))
        elif "record" in item.metadata:
            members[item.name] = _table(keys.leaves[key])
        elif prefix == "operation":
            members[item.name] = _operating(keys.leaves[key])
        else:
            members[item.name] = _leaf(keys.leaves[key])
    return member(Section(cls.__name__, members, empty=off or {}), keys.meanings[prefix])


def _besides(found: Leaf) -> Schema:
    """What the JSON Schema of a key says beside the form of its value."""
    default = None if found.default is None else found.default_text
    if found.kind not in ("list", "table", "quantity"):
        default = found.default
    return {"description": description(found), "default": default}


def _leaf(found: Leaf) -> Member:
    return Member(One(found), lambda: _besides(found))


def _table(found: Leaf) -> Member:
    """A list of records, each with its defaults."""
    name = "".join(word.title() for word in found.key.split("."))
    members = {part.key.rpartition(".")[2]: _leaf(part) for part in found.parts}
    record = Section(name, members, whole=True, empty=None)
    many = Listed(record, found.allowed(), (1, found.most), "{} of them")
    return Member(many, lambda: _besides(found))


def _operating(found: Leaf) -> Member:
    """An operating value, or {ramp: [[time, value], ...]}."""
    one = One(found)
    knots = Listed(Knot(One(TIME), one), "a list of knots: [[0 s, VALUE], [600 s, VALUE]]")
    text = "Knots [time, value], the first at 0 s; linear between them, constant after the last"
    name = found.key.rpartition(".")[2]
    ramp = Section(f"Ramp_{name}", {"ramp": member(knots, text)}, True, ["ramp"], missing=RAMP, empty=None)
    return Member(Either(one, mapping=ramp), lambda: _besides(found))


def _sweep(keys: Keys) -> Section:
    members = {name: _axis(name, found) for name, found in keys.axes.items()}
    members |= {"procedure": _leaf(PROCEDURE), "along": _leaf(along(keys)), "refine": _leaf(REFINE)}
    return Section("Sweep", members)


def along(keys: Keys) -> Leaf:
    """The key that names the axis along which the state is carried."""
    meaning = keys.meanings["sweep.along"]
    return Leaf("sweep.along", "choice", None, choices=tuple(keys.axes), nullable=True, meaning=meaning)


def _axis(name: str, value: Leaf) -> Member:
    """An axis: {from, to, points}, a list of quantities, or one quantity; of words a
    list of these."""
    one = One(value)
    meaning = MEANINGS.get(f"sweep.{name}") or f"{value.meaning} ({name})"
    if value.kind in ("choice", "switch"):
        return member(Either(one, Listed(one)), f"{meaning}: a list of words.")
    units = f", in {value.units}" if value.units else ""
    span = _range(f"Range_{name.replace('.', '_')}", one, spacing=True)
    text = f"{meaning}{units}: {{from, to, points}}, a list, or one value."
    return member(Either(one, Listed(one), span), text)


def _range(name: str, one: Form, spacing: bool = False) -> Section:
    """{from, to, points}, the ends of the form ``one``; with ``spacing`` where it may
    be chosen."""
    members = {
        "from": member(one, "One end"),
        "to": member(one, "The other end"),
        "points": member(One(POINTS), "Number of equally spaced values, both ends among them"),
    }
    if spacing:
        members["spacing"] = member(One(SPACING), "linear, or log for equal ratios")
    return Section(name, members, True, RANGE, ALL_OF_RANGE, empty=None)


def _uncertain(keys: Keys) -> Section:
    """The section of the unknowns: their distributions by key, a joint table of
    samples, and how they are drawn."""
    numbers = {name: leaf for name, leaf in keys.axes.items() if not is_compiled_in(keys.model, name)}
    columns = {name: member(Listed(Briefly(One(leaf), SHORT)), leaf.meaning) for name, leaf in numbers.items()}
    members = {}
    for name, leaf in numbers.items():
        units = f", in {leaf.units}" if leaf.units else ""
        members[name] = member(_distribution(leaf), f"{leaf.meaning} ({name}){units}: its distribution.")
    members["table"] = member(Section("Table", columns), MEANINGS["uncertain.table"])
    three = {"type": "array", "minItems": 3, "maxItems": 3}
    pairs = Listed(Read(correlation, three))
    members["correlations"] = member(pairs, MEANINGS["uncertain.correlations"])
    members |= {found.key.partition(".")[2]: _leaf(found) for found in (SAMPLES, SEED, DESIGN)}
    return Section("Uncertain", members)


def _distribution(value: Leaf) -> Form:
    one, spread = One(value), One(replace(value, low=0.0, high=value.high - value.low))
    numbers = {"mean": one, "deviation": spread, "median": one, "factor": One(FACTOR)}
    kinds: dict[str, Member] = {}
    for kind, form in EXAMPLES.items():
        made: Form = Listed(one)
        if kind in NUMBERS_OF:
            given = {name: member(numbers[name], name) for name in NUMBERS_OF[kind]}
            given |= {end: member(one, f"Cut off {CUT_WORDS[end]} this") for end in BOUNDS}
            required = NUMBERS_OF[kind]
            missing = f"all of {' and '.join(required)}"
            made = Section(kind, given, True, required, missing, empty=None)
        kinds[kind] = member(made, form)
    return Briefly(Section("Distribution", kinds, whole=True, empty=None), DISTRIBUTION)


def _slice(keys: Keys) -> Section:
    """The slice: ranges of states by their names."""
    members: dict[str, Member] = {}
    for key, found in keys.leaves.items():
        name = key.removeprefix("initial.")
        if name != key and name in keys.slices:
            one = One(replace(found, nullable=False))
            members[name] = member(_range(f"Slice_{name}", one), found.meaning)
    return Section("Slice", members)


def _title(raw: Any) -> str:
    if raw is None:
        return ""
    if not isinstance(raw, str):
        raise QuantityError(shown(raw), "text; put it in quotes")
    if odd := odd_character(raw, allowed="\t\n"):
        raise QuantityError(odd, "text that can be printed")
    if len(raw) > LONGEST_TITLE:
        raise QuantityError(f"{len(raw)} characters", f"at most {LONGEST_TITLE}")
    return raw


def json_schema(model: str = MODEL) -> Schema:
    """JSON Schema (draft 2020-12) of a study of the model of this name, as plain data
    for ``json.dumps``."""
    parts: dict[str, Schema] = {}
    whole = study_form(model).own_schema(parts)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "urn:nsdrill:study",
        "title": "nsdrill study",
        "description": "A sweep of the coupled axial, torsional and lateral vibration of a drill string.",
        **whole,
        "$defs": parts,
    }
