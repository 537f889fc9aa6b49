"""The forms in which values stand in a study: one value, a list, a mapping, or one of
several. Each reads what stands in the file, value by value with its place, and gives its
JSON Schema. What the study is made of is in ``schema``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from typing import Any, Protocol

from nsdrill.errors import Fault
from nsdrill.models.leaves import is_compiled_in, words_of
from nsdrill.sampling import BOUNDS, KINDS, NUMBERS_OF
from nsdrill.study.keys import RAMP, SLICE, Keys, Leaf, did_you_mean, shown
from nsdrill.study.read import Document, KeyPath, dotted
from nsdrill.study.uncertain import HOW
from nsdrill.units import QuantityError
from nsdrill.variables import AXES

FAULTY: Any = object()  # in place of a value that cannot be read
RANGE = ("from", "to", "points")
Schema = dict[str, Any]


class Reading:
    """A study that is being read: its ``document``, the ``keys`` of its model, its
    ``faults``, and the ``faulty`` keys, whose values are left out."""

    def __init__(self, document: Document, keys: Keys) -> None:
        self.document, self.keys = document, keys
        self.faults: list[Fault] = []
        self.faulty: set[str] = set()
        # The words on which units depend; None for a word that is at fault itself.
        self.chosen: dict[str, str | None] = {}
        for choice, units in keys.model.units_by.values():
            word = reduce(
                lambda inside, part: inside.get(part) if isinstance(inside, dict) else None,
                choice.split("."),
                document.data,
            )
            word = keys.leaves[choice].default if word is None else word
            self.chosen[choice] = word if isinstance(word, str) and word in units else None

    def refuse(
        self, path: KeyPath, found: str, allowed: str, suggestion: str | None = None, *, of_key: bool = False
    ) -> Any:
        """Note a fault at ``path``; :data:`FAULTY`."""
        fault = self.document.fault(path, found, allowed, suggestion, of_key=of_key)
        self.faults.append(fault)
        self.faulty.add(fault.key)
        return FAULTY

    def value(self, path: KeyPath, leaf: Leaf, raw: Any) -> Any:
        """The value ``raw`` of ``leaf``, in SI."""
        try:
            if leaf.key in self.keys.model.units_by and not (raw is None and leaf.nullable):
                choice, units = self.keys.model.units_by[leaf.key]
                return _in_units_of(leaf, raw, self.chosen[choice], choice, units)
            return leaf.read(raw)
        except QuantityError as error:
            is_ramp = isinstance(raw, list) and path[:1] == ("operation",) and path[-1] in AXES
            ramp = f"; a ramp, for nsdrill simulate, is {RAMP}" if is_ramp else ""
            return self.refuse(path, error.found, error.allowed + ramp, error.suggestion)

    def listed(self, path: KeyPath) -> str:
        """The keys that may stand in the mapping at ``path``."""
        return ", ".join(keys_below(dotted(path), self.keys))

    def unknown(self, path: KeyPath) -> Any:
        """Note that there is no such key as that at ``path``."""
        found, allowed = "an unknown key", self.listed(path[:-1])
        suggestion = _nearest(path, self.keys)
        if path[0] == "sweep" and len(path) == 2:
            found, allowed, suggestion = _no_axis(str(path[1]), self.keys)
        elif path[0] == "uncertain" and len(path) == 2 + (path[1] == "table"):
            found, allowed, suggestion = _no_axis(str(path[-1]), self.keys, HOW)
        return self.refuse(path, found, allowed, suggestion, of_key=True)


def _in_units_of(leaf: Leaf, raw: Any, word: str | None, choice: str, units: Mapping[str, str]) -> Any:
    """The value in the units that the ``word`` at the key ``choice`` asks for, a
    stiffness in those of its contact law. Where the choice itself is at fault, a value
    in other units than those of its default is left out, and nothing is said of it."""
    right = units[word or next(iter(units))]
    wrong = next(other for other in units.values() if other != right)
    try:
        return Leaf(**{**vars(leaf), "units": right}).read(raw)
    except QuantityError as error:
        try:
            Leaf(**{**vars(leaf), "units": wrong}).read(raw)
        except QuantityError:
            raise error from None
        if word is None:
            return FAULTY
        other = next(name for name, unit in units.items() if unit == wrong)
        what, of = leaf.key.rpartition(".")[2], choice.rpartition(".")[2]
        hint = f"With {of}: {word} the {what} is in {right}; {of}: {other} takes {wrong}."
        raise QuantityError(f"{shown(raw)}, in {wrong}", error.allowed, hint) from None


class Form(Protocol):
    """How a value stands in a study."""

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        """The value that ``raw`` stands for, or :data:`FAULTY`."""

    def schema(self, parts: dict[str, Schema]) -> Schema:
        """Its JSON Schema, which may refer to ``parts``, by name, and adds to them."""


@dataclass(frozen=True)
class One:
    """One value."""

    leaf: Leaf

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        return at.value(path, self.leaf, raw)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        return self.leaf.schema()


@dataclass(frozen=True)
class Read:
    """A value that the function ``take`` reads; with it a QuantityError is a fault."""

    take: Callable[[Any], Any]
    plain: Schema

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        try:
            return self.take(raw)
        except QuantityError as error:
            return at.refuse(path, error.found, error.allowed, error.suggestion)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        return self.plain


@dataclass(frozen=True)
class Briefly:
    """A form whose JSON Schema is ``plain``, as its own would be too long."""

    form: Form
    plain: Schema

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        return self.form.read(at, path, raw)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        return self.plain


@dataclass(frozen=True)
class Unread:
    """A form that is read later, whose JSON Schema is known."""

    form: Form

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        return raw

    def schema(self, parts: dict[str, Schema]) -> Schema:
        return self.form.schema(parts)


@dataclass(frozen=True)
class Listed:
    """A list; ``least`` and ``most`` values of the form ``one`` where it is said, and
    what is ``allowed`` in words."""

    one: Form
    allowed: str = "a list"
    length: tuple[int, int] | None = None
    wrong_length: str = ""

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        if not isinstance(raw, list):
            return at.refuse(path, shown(raw), self.allowed)
        if self.length and not self.length[0] <= len(raw) <= self.length[1]:
            found = "an empty list" if not raw else self.wrong_length.format(len(raw))
            return at.refuse(path, found, self.allowed)
        values = [self.one.read(at, (*path, place), item) for place, item in enumerate(raw)]
        return FAULTY if any(value is FAULTY for value in values) else values

    def schema(self, parts: dict[str, Schema]) -> Schema:
        bounds = dict(zip(("minItems", "maxItems"), self.length or (), strict=False))
        return {"type": "array", "items": self.one.schema(parts), **bounds}


@dataclass(frozen=True)
class Knot:
    """A knot of a ramp: [time, value]."""

    time: Form
    value: Form

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        if not isinstance(raw, list) or len(raw) != 2:
            found = f"a list of {len(raw)}" if isinstance(raw, list) else shown(raw)
            return at.refuse(path, found, "a knot: [time, value]")
        knot = tuple(one.read(at, (*path, place), raw[place]) for place, one in enumerate((self.time, self.value)))
        return FAULTY if FAULTY in knot else knot

    def schema(self, parts: dict[str, Schema]) -> Schema:
        both = [self.time.schema(parts), self.value.schema(parts)]
        return {"type": "array", "prefixItems": both, "minItems": 2, "maxItems": 2}


@dataclass(frozen=True)
class Either:
    """A mapping, a list, or one value: which, its form says."""

    one: Form
    listed: Form | None = None
    mapping: Form | None = None

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        form = self.mapping if isinstance(raw, dict) else None
        form = self.listed if isinstance(raw, list) else form
        return (form or self.one).read(at, path, raw)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        forms = [form for form in (self.mapping, self.listed, self.one) if form is not None]
        return {"oneOf": [form.schema(parts) for form in forms]}


@dataclass(frozen=True)
class Member:
    """A value of a mapping, and what its JSON Schema says beside its form."""

    form: Form
    words: Callable[[], Schema] = dict

    def schema(self, parts: dict[str, Schema]) -> Schema:
        told = {name: value for name, value in self.words().items() if value is not None}
        return {**self.form.schema(parts), **told}


def member(form: Form, description: str) -> Member:
    """A member with its ``description``."""
    return Member(form, lambda: {"description": description})


@dataclass(frozen=True)
class Section:
    """A mapping, called ``name`` in the JSON Schema. One that is ``whole`` is at fault
    with any of its values; of another one these are left out. ``required`` are keys that
    it must have, ``missing`` says so; ``empty`` is what null stands for, if anything."""

    name: str
    members: Mapping[str, Member]
    whole: bool = False
    required: Sequence[str] = ()
    missing: str = ""
    empty: Mapping[str, Any] | None = field(default_factory=dict)

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        if raw is None and self.empty is not None:
            raw = self.empty
        if not isinstance(raw, dict):
            return at.refuse(path, shown(raw), f"a mapping with the keys {at.listed(path)}")
        found = {
            name: self.members[name].form.read(at, (*path, name), value)
            if name in self.members
            else at.unknown((*path, name))
            for name, value in raw.items()
        }
        for name in self.required:
            if name not in raw:
                found[name] = at.refuse((*path, name), "nothing", self.missing)
        bad = [name for name, value in found.items() if value is FAULTY]
        if bad and self.whole:
            return FAULTY
        at.faulty |= {dotted((*path, name)) for name in bad}
        return {name: value for name, value in found.items() if value is not FAULTY}

    def own_schema(self, parts: dict[str, Schema]) -> Schema:
        """The JSON Schema of the mapping itself."""
        properties = {name: one.schema(parts) for name, one in self.members.items()}
        required = {"required": list(self.required)} if self.required else {}
        return {"type": "object", "additionalProperties": False, "properties": properties, **required}

    def schema(self, parts: dict[str, Schema]) -> Schema:
        if self.name not in parts:
            parts[self.name] = {}  # so that the parts have the order of the file
            parts[self.name] = self.own_schema(parts)
        reference = {"$ref": f"#/$defs/{self.name}"}
        return reference if self.empty is None else {"anyOf": [reference, {"type": "null"}]}


def keys_below(prefix: str, keys: Keys) -> list[str]:
    """The keys that may stand below the dotted ``prefix``."""
    if prefix.startswith(("sweep.", f"{SLICE}.")):
        return [*RANGE, *(["spacing"] if prefix.startswith("sweep.") else [])]
    if prefix.startswith("operation."):
        return ["ramp"]
    if prefix.startswith("uncertain.") and prefix != "uncertain.table":
        kind = prefix.rpartition(".")[2]
        return [*NUMBERS_OF[kind], *BOUNDS] if kind in NUMBERS_OF else list(KINDS)
    if prefix == SLICE:
        return list(keys.slices)
    prefix = re.sub(r"\[\d+\]", "", prefix)  # of a record of a list
    start = f"{prefix}." if prefix else ""
    return [key[len(start) :] for key in keys.meanings if key.startswith(start) and "." not in key[len(start) :]]


def _nearest(path: KeyPath, keys: Keys) -> str | None:
    """The key that may have been meant: a sibling with nearly this name, else one of
    this name elsewhere."""
    parent, name = dotted(path[:-1]), str(path[-1])
    start = f"{parent}." if parent else ""
    near = did_you_mean(name, keys_below(parent, keys))
    if near:
        return near.replace("Did you mean ", f"Did you mean {start}")
    elsewhere = [key for key in keys.meanings if key.rpartition(".")[2] == name]
    return f"Did you mean {' or '.join(elsewhere[:3])}?" if elsewhere else None


def _no_axis(
    name: str, keys: Keys, others: Sequence[str] = ("procedure", "along", "refine")
) -> tuple[str, str, str | None]:
    """What is wrong with a key that is no axis of the sweep, or no unknown: what was
    found, what is allowed beside the ``others``, what may be meant."""
    leaf = keys.leaves.get(name)
    allowed = (
        f"{', '.join(AXES)} or another number of {', '.join(keys.physical)} by its key, as "
        f"{keys.model.example_axis[0]}; {', '.join(others)}"
    )
    if others == HOW and is_compiled_in(keys.model, name):
        found = "which is a choice" if words_of(name) else "which is compiled in"
        return f"{name}, {found}", allowed, f"Sweep it: sweep.{name}."
    if numbers := [key for key, (choice, _) in keys.model.units_by.items() if choice == name]:
        return (f"a choice on which the units of {' and '.join(numbers)} depend", allowed, "Run a study for each word.")
    if leaf is None:
        return "an unknown key", allowed, did_you_mean(name, others) or _near_axis(name, keys)
    what = (
        "a number that is not of the string or its operation"
        if leaf.kind in ("quantity", "number", "whole")
        else ("a key that is no number")
    )
    return what, allowed, _near_axis(name, keys)


def _near_axis(name: str, keys: Keys) -> str | None:
    """The axis that may have been meant: one of nearly this key, or whose key ends like
    it."""
    last = name.rpartition(".")[2]
    ends = [key for key in keys.axes if key.rpartition(".")[2] == last and key != name]
    return did_you_mean(name, keys.axes) or (f"Did you mean {' or '.join(ends[:3])}?" if ends else None)
