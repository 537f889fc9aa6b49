"""The forms in which values stand in a study: one value, a list, a mapping, or one of
several. Each reads what stands in the file, value by value with its place, and gives its
JSON Schema. What the study is made of is in ``schema``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from functools import partial
from itertools import pairwise
from typing import Protocol, TypeVar

import numpy as np

from nsdrill.data import Resolved
from nsdrill.errors import Fault, printable
from nsdrill.models.choices import place_of, words_of
from nsdrill.ranges import MAX_POINTS, bound_text
from nsdrill.records import dataclass
from nsdrill.study.keys import RAMP, TIME, Keys, Leaf, Plain, Schema, Value, colon_hint, did_you_mean, shown
from nsdrill.study.read import Document, KeyPath, dotted
from nsdrill.units import QuantityError

T = TypeVar("T")
FAULTY: Value = object()  # in place of a value that cannot be read
RANGE = ("from", "to", "points")
ALL_OF_RANGE = "all of from, to and points"
PLACES = ("from", "to", "top", "bottom", "start", "end", "depth", "above", "below")  # of what has a length
LEAST_LEG = 1e-3  # s between knots: a shorter leg is a jump to a drill string


class Reading:
    """A study that is being read: its ``document``, the ``keys`` of its model, its
    ``faults``, and the ``faulty`` keys, whose values are left out."""

    def __init__(self, document: Document, keys: Keys) -> None:
        self.document, self.keys = document, keys
        self.faults: list[Fault] = []
        self.faulty: set[str] = set()

    def refuse(
        self, path: KeyPath, found: str, allowed: str, suggestion: str | None = None, *, of_key: bool = False
    ) -> Value:
        """Note a fault at ``path``; :data:`FAULTY`."""
        fault = self.document.fault(path, found, allowed, suggestion, of_key=of_key)
        self.faults.append(fault)
        self.faulty.add(fault.key)
        return FAULTY

    def take(self, path: KeyPath, read: Callable[[Plain], T], raw: Plain) -> T:
        """What ``read`` makes of ``raw``; a QuantityError is a fault."""
        try:
            return read(raw)
        except QuantityError as error:
            refused: T = self.refuse(path, error.found, error.allowed, error.suggestion)
            return refused

    def in_chosen_units(self, leaf: Leaf, raw: Plain) -> Value:
        """The value in the units that the word of a choice asks for, a stiffness in those
        of its contact law. Where the choice itself is at fault, a value in other units than
        those of its default is left out, and nothing is said of it."""
        choice, units = self.keys.model.units_by[leaf.key]
        word = self.document.value(choice.split("."))
        word = self.keys.leaves[choice].default if word is None else word
        known = isinstance(word, str) and word in units
        right = units[word] if known else next(iter(units.values()))
        try:
            return replace(leaf, units=right).read(raw)
        except QuantityError as error:
            other, wrong = next((name, unit) for name, unit in units.items() if unit != right)
            if not replace(leaf, units=wrong).takes(raw):
                raise
            if not known:
                return FAULTY
            what, of = leaf.key.rpartition(".")[2], choice.rpartition(".")[2]
            hint = f"With {of}: {word} the {what} is in {right}; {of}: {other} takes {wrong}."
            raise QuantityError(f"{shown(raw)}, in {wrong}", error.allowed, hint) from None


class Form(Protocol):
    """How a value stands in a study."""

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        """The value that ``raw`` stands for, or :data:`FAULTY`."""

    def schema(self, parts: dict[str, Schema]) -> Schema:
        """Its JSON Schema, which may refer to ``parts``, by name, and adds to them."""


@dataclass(frozen=True)
class One:
    """One value; ``brief`` replaces a JSON Schema that would be too long."""

    leaf: Leaf
    brief: Schema | None = None

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        decided = self.leaf.key in at.keys.model.units_by and not (raw is None and self.leaf.nullable)
        return at.take(path, partial(at.in_chosen_units, self.leaf) if decided else self.leaf.read, raw)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        return self.brief or self.leaf.schema()


@dataclass(frozen=True)
class Read:
    """A value that the function ``take`` reads; with it a QuantityError is a fault."""

    read_raw: Callable[[Plain], Value]
    plain: Schema

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        return at.take(path, self.read_raw, raw)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        return self.plain


@dataclass(frozen=True)
class Listed:
    """A list; ``least`` and ``most`` values of the form ``one`` where it is said, and
    what is ``allowed`` in words."""

    one: Form
    allowed: str = "a list"
    length: tuple[int, int] | None = None
    wrong_length: str = "{} of them"

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
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
class OrNull:
    """A value of the form ``one``, or null."""

    one: Form

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        return None if raw is None else self.one.read(at, path, raw)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        return {"anyOf": [self.one.schema(parts), {"type": "null"}]}


@dataclass(frozen=True)
class Either:
    """A mapping, a list, or one value: which, its form says."""

    one: Form
    listed: Form | None = None
    mapping: Form | None = None

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        form = self.mapping if isinstance(raw, dict) else self.listed if isinstance(raw, list) else None
        return (form or self.one).read(at, path, raw)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        forms = [form for form in (self.mapping, self.listed, self.one) if form is not None]
        return {"oneOf": [form.schema(parts) for form in forms]}


class Several(Either):
    """A list of one or more values of one form, or one of them, which is read as a list
    of it."""

    def __init__(self, one: Form) -> None:
        super().__init__(one, Listed(one, "one or more values", (1, 10**4)))

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        found = super().read(at, path, raw)
        return found if isinstance(raw, list) or found is FAULTY else [found]


class Axis(Either):
    """The values of an axis, which come out in ascending order: {from, to, points}, a
    list of values and such ranges, or one value. Words have the order of their choice."""

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        found = super().read(at, path, raw)
        if found is FAULTY or isinstance(found, dict):
            return found
        name = str(path[-1])
        given = found if isinstance(found, list) else [found]
        if any(isinstance(item, dict) for item in given):
            return self._joined(at, path, given)
        values = sorted(given, key=partial(place_of, name) if words_of(name) else None)
        if not values:
            return at.refuse(path, "an empty list", "at least one value")
        for first, second in pairwise(values):
            if first == second and isinstance(raw, list):
                second_place = [place for place, item in enumerate(given) if item == second][1]
                what = f"{shown(raw[second_place])}, which is there a second time"
                return at.refuse((*path, second_place), what, "each value once")
        return values

    def _joined(self, at: Reading, path: KeyPath, given: list[Value]) -> Value:
        """The values of a list with ranges, each once; refused by their number before they
        are made."""
        number = sum(size(item) if isinstance(item, dict) else 1 for item in given)
        if number > MOST_JOINED:
            allowed = f"at most {bound_text(MOST_JOINED)} in the ranges of a list"
            return at.refuse(path, f"{bound_text(number)} values", allowed)
        parts = [axis_values(item if isinstance(item, dict) else [item]) for item in given]
        values = np.sort(np.concatenate(parts))
        steps = np.diff(values, prepend=-np.inf)
        return values[steps > SAME * np.abs(values)].tolist()


@dataclass(frozen=True)
class Member:
    """A value of a mapping, and the meaning that its JSON Schema gives beside its form,
    or the leaf whose meaning, default and source it gives."""

    form: Form
    about: str | Leaf

    def schema(self, parts: dict[str, Schema]) -> Schema:
        about = {"description": self.about} if isinstance(self.about, str) else self.about.about()
        return {**self.form.schema(parts), **about}


def leaf_member(found: Leaf) -> Member:
    """A member of one value, the ``found`` leaf."""
    return Member(One(found), found)


@dataclass(frozen=True)
class Section:
    """A mapping, called ``name`` in the JSON Schema. One that is ``whole`` is at fault
    with any of its values; of another one these are left out. ``required`` are keys that
    it must have, ``missing`` says so; ``empty`` is what null stands for, if anything.
    ``listed`` are the keys that a message lists, all of them unless there are many."""

    name: str
    members: Mapping[str, Member]
    whole: bool = False
    required: Sequence[str] = ()
    missing: str = ""
    empty: Mapping[str, Plain] | None = field(default_factory=dict)
    listed: Sequence[str] = ()

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        if raw is None and self.empty is not None:
            raw = dict(self.empty)
        if not isinstance(raw, dict):
            hint = colon_hint(raw, self.members) or self.word_hint(raw) if isinstance(raw, str) else None
            return at.refuse(
                path, shown(raw), f"a mapping with the keys {', '.join(self.listed or self.members)}", hint
            )
        found = {
            name: self.members[name].form.read(at, (*path, name), value)
            if name in self.members
            else self.unknown(at, (*path, name))
            for name, value in raw.items()
        }
        for name in self.required:
            if name not in raw:
                found[name] = at.refuse((*path, name), "nothing", self.missing)
        bad = [name for name, value in found.items() if value is FAULTY]
        if bad and self.whole:
            return FAULTY
        at.faulty |= {dotted((*path, name)) for name in bad}
        return self.checked(at, path, raw, {name: value for name, value in found.items() if value is not FAULTY})

    def word_hint(self, word: str) -> str | None:
        """Which key takes the ``word`` that stands in place of the mapping, if one does."""
        choices = {
            name: member.about.choices for name, member in self.members.items() if isinstance(member.about, Leaf)
        }
        return next((f"Did you mean {{{name}: {word}}}?" for name, words in choices.items() if word in words), None)

    def checked(self, at: Reading, path: KeyPath, raw: dict[str, Plain], found: Resolved) -> Value:
        """The values ``found``, or :data:`FAULTY` where they do not go together."""
        return found

    def unknown(self, at: Reading, path: KeyPath) -> Value:
        """Note that there is no such key as that at ``path``, and the key that may have been
        meant: one of nearly this name here, else one of this name elsewhere."""
        *above, name = path
        suggestion = did_you_mean(str(name), self.listed or self.members, dotted(tuple(above)))
        others = at.keys.models_with(dotted(path))
        elsewhere = [key for key in at.keys.meanings if key.rpartition(".")[2] == name]
        if colon := colon_hint(str(name), self.members):
            suggestion = colon
        elif odd := next((char for char in str(name) if not char.isascii()), None):
            suggestion = f"It has the character {printable(odd)} (U+{ord(odd):04X}): type it anew, with plain spaces."
        elif dotted(path) in at.keys.leaves:  # a part of the name is a section
            parts = str(name).split(".")
            suggestion = f"In a file keys are nested: {': {'.join(parts)}: ...{'}' * (len(parts) - 1)}"
        elif any(isinstance(part, int) for part in above):  # of a record, whose names are its own
            if "length" in self.members and name in PLACES:
                suggestion = "Each has its length, and they follow one another from the top."
        elif suggestion is None and elsewhere:
            suggestion = f"Did you mean {' or '.join(elsewhere[:3])}?"
        what = "an unknown key"
        if others:
            *several, last = others
            models = f"models {', '.join(several)} and {last}" if several else f"model {last}"
            what = f"a key of the {models}, which the model {at.keys.model.name} does not have"
        return at.refuse(path, what, ", ".join(self.listed or self.members), suggestion, of_key=True)

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


class Span(Section):
    """An axis {from, to, points} in ascending order, the ends of the form ``one``; with
    ``spacing`` where it may be chosen."""

    def __init__(self, name: str, one: Form, *, spacing: bool = False) -> None:
        members = {
            "from": Member(one, "One end"),
            "to": Member(one, "The other end"),
            "points": Member(One(POINTS), "Number of equally spaced values, both ends among them"),
        }
        if spacing:
            members["spacing"] = Member(One(SPACING), "linear, or log for equal ratios")
        super().__init__(name, members, True, RANGE, ALL_OF_RANGE, empty=None)

    def checked(self, at: Reading, path: KeyPath, raw: dict[str, Plain], found: Resolved) -> Value:
        remark = "its values are taken in ascending order. To carry the state downwards, write procedure: down."
        low, high = ascending_ends(at, path, raw, found, remark)
        spacing = (high - low) / (found["points"] - 1)
        if spacing <= 4 * math.ulp(max(abs(low), abs(high))):
            return at.refuse(path, "values that are the same", "from and to that differ")
        axis = {"from": low, "to": high, "points": found["points"]}
        if found.get("spacing") != "log":
            return axis
        if low <= 0.0:
            what = f"log spacing from {low:g} in SI units" if low else "log spacing from 0"
            return at.refuse((*path, "spacing"), what, "linear, or values above 0")
        return {**axis, "spacing": "log"}


def ascending_ends(
    at: Reading, path: KeyPath, raw: Mapping[str, Plain], found: Mapping[str, float], remark: str
) -> tuple[float, float]:
    """The ends of a range in ascending order; a note where they are given in another
    one."""
    low, high = sorted((found["from"], found["to"]))
    if found["from"] > found["to"]:
        at.document.notes.append(f"{dotted(path)} goes from {raw['from']} down to {raw['to']}; {remark}")
    return low, high


def size(axis: Resolved | Sequence[Value], refine: int = 0) -> int:
    """The number of values of a resolved axis."""
    return (int(axis["points"]) - 1) * 2**refine + 1 if isinstance(axis, dict) else len(axis)


def axis_values(
    axis: Resolved | Sequence[Value], refine: int = 0, most: int = MAX_POINTS, choice: str = ""
) -> np.ndarray:
    """The values of a resolved axis: a list, or {from, to, points} with the spacing
    halved ``refine`` times. The values that the axis has without refinement keep their
    bits: halving is exact. Of an axis over the words of a ``choice``, by its key, their
    places among these. ValueError for more than ``most``."""
    if choice:
        axis = [place_of(choice, word) for word in axis]
    if isinstance(axis, dict):
        points = size(axis, refine)
        if points > most or not axis["from"] < axis["to"]:
            raise ValueError(f"sweep: found {axis}, allowed: ascending values, at most {most}")
        if axis.get("spacing") == "log":
            # a point halfway up a refinement keeps its quotient, and so its bits
            ratio = axis["to"] / axis["from"]
            inner = (axis["from"] * ratio ** (i / (points - 1)) for i in range(1, points - 1))
            return np.array([axis["from"], *np.fromiter(inner, float, points - 2), axis["to"]])
        return np.linspace(axis["from"], axis["to"], points)
    values = np.array(axis, dtype=np.float64)
    if values.ndim != 1 or not np.all(np.diff(values) > 0.0):
        raise ValueError("sweep: found values that do not ascend")
    return values


SAME = 1e-9  # relative: values of a list that ranges of different steps have in common
MOST_JOINED = 10**5
POINTS = Leaf("points", "whole", 2, low=2, high=MAX_POINTS)
SPACING = Leaf("spacing", "choice", "linear", choices=("linear", "log"))


@dataclass(frozen=True)
class Knot:
    """A knot of a ramp: [time, value]."""

    time: Form
    value: Form

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        if not isinstance(raw, list) or len(raw) != 2:
            found = f"a list of {len(raw)}" if isinstance(raw, list) else shown(raw)
            return at.refuse(path, found, "a knot: [time, value]")
        knot = tuple(one.read(at, (*path, place), raw[place]) for place, one in enumerate((self.time, self.value)))
        return FAULTY if FAULTY in knot else knot

    def schema(self, parts: dict[str, Schema]) -> Schema:
        both = [self.time.schema(parts), self.value.schema(parts)]
        return {"type": "array", "prefixItems": both, "minItems": 2, "maxItems": 2}


class Ramp(Section):
    """An operating value along a run: {ramp: [[time, value], ...]}."""

    def __init__(self, name: str, value: Form) -> None:
        knots = Listed(Knot(One(TIME), value), "a list of knots: [[0 s, VALUE], [600 s, VALUE]]")
        text = "Knots [time, value], the first at 0 s; linear between them, constant after the last"
        super().__init__(f"Ramp_{name}", {"ramp": Member(knots, text)}, True, ["ramp"], RAMP, empty=None)

    def checked(self, at: Reading, path: KeyPath, raw: Value, found: Resolved) -> Value:
        knots, path = found["ramp"], (*path, "ramp")
        if len(knots) < 2:
            what = "one knot" if knots else "an empty list"
            return at.refuse(path, what, "two knots or more; a value that does not change stands without a ramp")
        times = [shown(knot[0]) for knot in raw["ramp"]]
        if knots[0][0] != 0.0:
            return at.refuse((*path, 0, 0), times[0], "0 s, where the run begins")
        for number, ((before, _), (time, _)) in enumerate(pairwise(knots), start=1):
            if time < before + LEAST_LEG:
                least = f"at least {1e3 * LEAST_LEG:g} ms after the one before, {times[number - 1]}"
                return at.refuse((*path, number, 0), times[number], f"times that ascend, {least}")
        return found


@dataclass(frozen=True)
class Operating(Either):
    """An operating value, or {ramp: [[time, value], ...]}; ``allowed`` is said of a
    list."""

    allowed: str = ""

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        return at.refuse(path, shown(raw), self.allowed) if isinstance(raw, list) else super().read(at, path, raw)
