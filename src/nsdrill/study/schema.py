"""What a study is made of: its sections with their keys, units, ranges and defaults,
from the dataclasses that the run uses; and its JSON Schema, for editors that complete
and check YAML while it is written. Values come out in SI.
"""

from __future__ import annotations

import typing
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace

from nsdrill.models.choices import is_compiled_in, words_of
from nsdrill.models.registry import of_known_models
from nsdrill.study.continuation import Continue
from nsdrill.study.forms import (
    Axis,
    Either,
    Form,
    Listed,
    Member,
    One,
    Operating,
    OrNull,
    Ramp,
    Read,
    Reading,
    Section,
    Span,
    leaf_member,
)
from nsdrill.study.keys import (
    MEANINGS,
    RAMP,
    SLICE,
    UNITS_LEAF,
    Keys,
    Leaf,
    Plain,
    Schema,
    Value,
    did_you_mean,
    keys_named,
    model_leaf,
    shown,
)
from nsdrill.study.read import KeyPath, odd_character
from nsdrill.study.study import Procedure
from nsdrill.study.uncertain import DESIGN, DOUBT, HOW, SAMPLES, SEED, Distribution, correlation
from nsdrill.units import QuantityError
from nsdrill.variables import MODEL

LONGEST_TITLE = 500  # characters

PROCEDURE = Leaf(
    "sweep.procedure", "choice", "same", choices=typing.get_args(Procedure), meaning=MEANINGS["sweep.procedure"]
)
REFINE = Leaf("sweep.refine", "whole", 0, low=0, high=6, meaning=MEANINGS["sweep.refine"])
SHORT: Schema = {"type": ["string", "number"]}  # of an unknown, whose key has the rest elsewhere
THREE: Schema = {"type": "array", "minItems": 3, "maxItems": 3}


@of_known_models
def study_form(model: str = MODEL) -> Section:
    """The form of a whole study file of the model of this name."""
    keys = keys_named(model)
    title = Read(_title, {"type": "string", "maxLength": LONGEST_TITLE})
    members = {
        "title": Member(title, MEANINGS["title"]),
        "units": leaf_member(UNITS_LEAF),
        "model": leaf_member(model_leaf()),
    }
    for name, cls in keys.sections.items():
        if name == "simulation":  # these two stand before it in the file
            members["sweep"] = Member(_sweep(keys), MEANINGS["sweep"])
            members["uncertain"] = Member(_uncertain(keys), MEANINGS["uncertain"])
        members[name] = _section(name, cls, keys)
    members["continue"] = Member(Continue(keys), MEANINGS["continue"])
    return Section("Study", members, listed=[key for key in keys.meanings if "." not in key])


def _section(prefix: str, cls: type, keys: Keys, off: Mapping[str, Plain] | None = None) -> Member:
    """A section: an empty one (null) is one with all its defaults, or with the values
    ``off``."""
    hints = typing.get_type_hints(cls)
    members: dict[str, Member] = {}
    for item in fields(cls):
        key, hint = f"{prefix}.{item.name}", hints[item.name]
        if key == SLICE:
            members[item.name] = Member(_slice(keys), keys.meanings[SLICE])
        elif is_dataclass(hint) and isinstance(hint, type):
            members[item.name] = _section(key, hint, keys, item.metadata.get("off"))
        else:
            members[item.name] = Member(_form_of(keys.leaves[key]), keys.leaves[key])
    return Member(Section(cls.__name__, members, empty=off or {}), keys.meanings[prefix])


def _form_of(found: Leaf) -> Form:
    """The form of a key: a list of records, each with its defaults; an operating value;
    or one value."""
    section, _, name = found.key.rpartition(".")
    if found.kind == "table":
        members = {part.key.rpartition(".")[2]: leaf_member(part) for part in found.parts}
        name = "".join(word.title() for word in found.key.split("."))
        must = f"a value: every one has {' and '.join(found.required)}"
        record = Section(name, members, True, found.required, must, empty=None)
        listed = Listed(record, found.allowed(), (1, found.most))
        return OrNull(listed) if found.nullable else listed
    if section == "operation":
        allowed = f"{found.allowed()}; a ramp, for nsdrill simulate, is {RAMP}"
        return Operating(One(found), mapping=Ramp(name, One(found)), allowed=allowed)
    return One(found)


class _Axes(Section):
    """A mapping with the keys of axes, or of unknowns: too many for a message."""

    def unknown(self, at: Reading, path: KeyPath) -> Value:
        """Note what is wrong with a key that is no axis, or no unknown."""
        name, keys, model = str(path[-1]), at.keys, at.keys.model
        others = HOW if path[0] == "uncertain" else ("procedure", "along", "refine")
        allowed = (
            f"{keys.numbers('another number of ' + ', '.join(keys.physical))}, as {keys.example_axis[0]}; "
            f"{', '.join(others)}"
        )
        last = name.rpartition(".")[2]
        ends = [key for key in keys.axes if key.rpartition(".")[2] == last and key != name]
        hint = did_you_mean(name, keys.axes) or (f"Did you mean {' or '.join(ends[:3])}?" if ends else None)
        leaf = keys.leaves.get(name)
        if before := self._word_before(at, path):
            key, word = before
            found, hint = "an unknown key", f"A list of words stands in brackets: {key}: [{word}, {name}]."
        elif path[0] == "uncertain" and is_compiled_in(model, name):
            found = f"{name}, which is {'a choice' if words_of(name) else 'compiled in'}"
            hint = f"Sweep it: sweep.{name}."
        elif numbers := [key for key, (choice, _) in model.units_by.items() if choice == name]:
            found = f"a choice on which the units of {' and '.join(numbers)} depend"
            hint = "Run a study for each word."
        elif leaf is None:
            found, hint = "an unknown key", did_you_mean(name, others) or hint
            inside = at.document.value(path)
            whole = (
                [f"{name}.{key}" for key in inside if f"{name}.{key}" in keys.axes] if isinstance(inside, dict) else []
            )
            hint = f"Here a key stands as a whole: {whole[0]}." if whole else hint
        elif leaf.kind in ("quantity", "number", "whole"):
            found = "a number that is not of the string or its operation"
        else:
            found = "a key that is no number"
        return at.refuse(path, found, allowed, hint, of_key=True)

    def _word_before(self, at: Reading, path: KeyPath) -> tuple[str, Plain] | None:
        """The key before this one and its value, a word, where this one is another word of
        the same choice: ``{drive.kind: ideal, stiff}``."""
        around = at.document.value(path[:-1])
        written = [*around]
        key = written[written.index(path[-1]) - 1]
        is_word = around[path[-1]] is None and path[-1] in words_of(key) and around[key] in words_of(key)
        return (key, around[key]) if is_word else None


def _sweep(keys: Keys) -> Section:
    members = {name: _axis(name, found) for name, found in keys.axes.items()}
    members |= {"procedure": leaf_member(PROCEDURE), "along": leaf_member(along(keys)), "refine": leaf_member(REFINE)}
    return _Axes("Sweep", members, listed=(*keys.operated, "procedure", "along", "refine"))


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
        return Member(Axis(one, Listed(one)), f"{meaning}: a list of words.")
    units = f", in {value.units}" if value.units else ""
    span = Span(f"Range_{name.replace('.', '_')}", one, spacing=True)
    listed = Listed(Either(one, mapping=span))
    meaning = f"{meaning}{units}: {{from, to, points}}, a list of these or of values, or one value."
    return Member(Axis(one, listed, span), meaning)


def _uncertain(keys: Keys) -> Section:
    """The section of the unknowns: their distributions by key, a joint table of
    samples, and how they are drawn."""
    numbers = {name: leaf for name, leaf in keys.axes.items() if not is_compiled_in(keys.model, name)}
    members = {}
    for name, leaf in numbers.items():
        units = f", in {leaf.units}" if leaf.units else ""
        members[name] = Member(Distribution(leaf), f"{leaf.meaning} ({name}){units}: its distribution.")
    columns = {name: Member(Listed(One(leaf, SHORT)), leaf.meaning) for name, leaf in numbers.items()}
    members["table"] = Member(_Axes("Table", columns), MEANINGS["uncertain.table"])
    members["correlations"] = Member(Listed(Read(correlation, THREE)), MEANINGS["uncertain.correlations"])
    members["doubts"] = Member(Listed(One(DOUBT)), MEANINGS["uncertain.doubts"])
    members |= {found.key.partition(".")[2]: leaf_member(found) for found in (SAMPLES, SEED, DESIGN)}
    return _Axes("Uncertain", members, listed=HOW)


def _slice(keys: Keys) -> Section:
    """The slice: ranges of states by their names."""
    members: dict[str, Member] = {}
    for key, found in keys.leaves.items():
        name = key.removeprefix("initial.")
        if name != key and name in keys.slices:
            members[name] = Member(Span(f"Slice_{name}", One(replace(found, nullable=False))), found.meaning)
    return Section("Slice", members, listed=keys.slices)


def _title(raw: Plain) -> str:
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
    keys = keys_named(model)
    whole = study_form(model).own_schema(parts)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$id": "urn:nsdrill:study",
        "title": "nsdrill study",
        "description": "A sweep of the coupled axial, torsional and lateral vibration of a drill string."
        if keys.model.drills
        else f"A sweep of {keys.model.title}.",
        **whole,
        "$defs": parts,
    }
