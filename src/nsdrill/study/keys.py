"""Every key of the study file: its default, units, range and source, taken from the
dataclasses that the run uses, and what it means.

Also how one value is read. Nothing here knows YAML or line numbers.
"""

from __future__ import annotations

import difflib
import math
import re
import typing
from collections.abc import Collection, Iterator, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass, replace
from typing import Any, Literal, TypeAlias

from nsdrill import units as si
from nsdrill.data import Resolved, value_at
from nsdrill.kernel.own_pairs import own_pair_names
from nsdrill.kernel.settings import LONGEST, Simulation
from nsdrill.models.choices import choices_of, words_of
from nsdrill.models.model_description import Description
from nsdrill.models.own import row_with_words, subclass
from nsdrill.models.registry import described, model_names, of_all, of_known_models, spoken
from nsdrill.models.sections import MEANINGS as OF_MODELS
from nsdrill.models.starts import Starts
from nsdrill.observe.thresholds import Record
from nsdrill.ranges import Follows, bound_text, range_text
from nsdrill.records import dataclass
from nsdrill.unit_table import USUAL
from nsdrill.units import QuantityError, quoted
from nsdrill.variables import MODEL, SAMPLE, short_key

MANY = 12  # choices that no message lists
# the choices that take a word of a script
OF_SCRIPTS = {
    "model": "model",
    "drive.kind": "drive",
    "simulation.pair": "pair",
    **{f"{contact}.friction.law": "law" for contact in ("bit", "well", "stabilizer")},
}
WITH = "--with its file, in Python its import"  # how a model of a script comes to be known
BARE = ("", "percent")  # units of which a bare number is

AROUND = ("sweep", "uncertain", "continue")  # sections whose keys are those of others
SLICE = "initial.slice"  # its values are ranges of states, as the axes of the sweep are: no leaf

QUANTITY = (
    r"^\s*[-+]?((\d+[ -])?\d+/\d+|(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)"
    r"\s*[A-Za-zµμ°1½¼¾⅛⅜⅝⅞\"'″′”’].*$"
)

# What each key means whose dataclass field does not say so, in one line.
MEANINGS: dict[str, str] = {
    "title": "Title of the study, for pictures and the results file",
    "units": "Units in which commands answer, unless --units says otherwise; by default those in which most is typed",
    "model": "Model of the string",
    "sweep": "The numbers and words that are varied",
    "sweep.depth": "Depths",
    "sweep.wob": "Weights on bit",
    "sweep.rotary_speed": "Rotary speeds of the top drive",
    "sweep.procedure": "Start of each point: the same state, or the final state of its "
    "neighbour, carried up, down or both ways; all: both ways and the same state",
    "sweep.along": "Axis along which the state is carried; needed with several axes",
    "sweep.refine": "Number of times that the spacing of axes {from, to, points} is halved where responses differ",
    "continue": "Motions followed along a number, stable or not",
    "continue.along": "Number that is varied: rotary_speed or any other by its key",
    "continue.from": "One end of its range",
    "continue.to": "The other end",
    "continue.seeds": "Results file whose settled points are followed, or values at which a motion settles first",
    "continue.motions": "Kinds of motion: periodic (steady drilling, bounces), rolling, stick_slip",
    "continue.lobes": "Periods to try, in lobes, the shortest first",
    "continue.direction": "In which direction of the number branches set out from their seeds: both, up or down",
    "continue.switch": "Follow also the branches that begin at doublings, branch points and Hopf points",
    "continue.points": "Largest number of points of a branch",
    "continue.curves": "Curves of special points in a second number",
    "continue.curves.over": "The second number",
    "continue.curves.from": "One end of its range",
    "continue.curves.to": "The other end",
    "continue.curves.of": "Kinds of special points",
    "continue.curves.points": "Largest number of points of a curve",
    "uncertain": "Distributions of numbers that are not known; every point is run with many samples",
    "uncertain.samples": "Number of samples; every operating point has the same ones",
    "uncertain.seed": "Random seed of the samples",
    "uncertain.design": "saltelli: samples x (unknowns + 2) runs of a point, for Sobol indices without assumptions",
    "uncertain.correlations": "Rank correlations of pairs of unknowns",
    "uncertain.table": "Joint samples in place of distributions, one in each row",
    "uncertain.doubts": "Why the fit that wrote the samples is doubtful; answers repeat it",
    "simulation": "Integration of each point",
    "classify": "Thresholds of the labels",
    "record": "What is kept of each point beside the features",
}


# What they mean in a study of a model that is no drill string.
GENERAL: dict[str, str] = {
    "model": "Model, the equations of motion",
    "operation": "The operating point; a value may be a ramp, {ramp: [[0 s, VALUE], [60 s, VALUE]]}",
    "initial": "The state at the start",
    "initial.drive_angle": "Phase at the start",
    "initial.ensemble": OF_MODELS["initial.ensemble"],
    "initial.seed": OF_MODELS["initial.seed"],
    "initial.spread": "Scatter of the drawn starts; 1: all that may happen, near 0: about the steady motion",
    "initial.slice": OF_MODELS["initial.slice"],
    "record.peaks": "Number of last local maxima that are kept of each quantity",
    "record.section": "Part of a period of the forcing between two returns",
    "continue.along": "Number that is varied, by its key",
    "continue.motions": "Kinds of motion: periodic (with the forcing, or an equilibrium), cycle",
    "continue.lobes": "Periods to try, in those of the forcing, the shortest first",
}
_SWEPT = ("sweep.depth", "sweep.wob", "sweep.rotary_speed")

Schema = Mapping[str, object]  # a part of a JSON Schema
Value: TypeAlias = Any  # of a key, as its kind says
Plain: TypeAlias = "bool | int | float | str | list[Plain] | dict[str, Plain] | None"  # what YAML has


@dataclass(frozen=True)
class Leaf:
    """One key that takes a value. ``kind`` is quantity (with ``units``), number, whole,
    choice (of ``choices``), switch (true or false), list (of up to ``most`` values of
    the leaf ``each``) or table (of up to ``most`` records with the leaves ``parts``).

    The range runs from ``low`` to ``high``, in SI; ``usual`` says what is met in the
    field. One of the ``words`` may stand in place of a quantity or number. The default of
    a study that leaves the key out ``follows`` another one, at whose default it is
    ``default``. The records of a table have the ``required`` keys. A value of a number that
    has a unit is that of the key ``with_unit``.
    """

    key: str
    kind: Literal["quantity", "number", "whole", "choice", "switch", "list", "table"]
    default: Value
    units: str = ""
    choices: tuple[str, ...] = ()
    nullable: bool = False
    low: float = -math.inf
    high: float = math.inf
    source: str = ""
    confidence: str = ""
    usual: str = ""
    meaning: str = ""
    words: tuple[str, ...] = ()
    most: int = 0
    parts: tuple[Leaf, ...] = ()
    required: tuple[str, ...] = ()
    follows: Follows | None = None
    with_unit: str = ""

    @property
    def each(self) -> Leaf:
        """The leaf of one value of a list."""
        return replace(self, kind="number" if self.units in BARE else "quantity", nullable=False, most=0, default=0.0)

    @property
    def default_text(self) -> str:
        """The default as it would stand in the file."""
        return self.text(self.default)

    @property
    def other_defaults(self) -> str:
        """The defaults at other values of the key that it follows, in words; empty where
        there are none."""
        if self.follows is None:
            return ""
        name, values = self.follows.of.rpartition(".")[2], self.follows.values
        told = [f"{self.text(default)} with {name} {value}" for value, default in values]
        if self.follows.otherwise != self.default:
            return f"{self.text(self.follows.otherwise)} with other {name}"
        return " and ".join(told)

    def default_in(self, resolved: Resolved, sweep: Resolved | None = None) -> Value:
        """The default in a study with these ``resolved`` values; along an axis of ``sweep``
        over words that of the first word that reads it."""
        if self.follows is None:
            return self.default
        along = (sweep or {}).get(self.follows.of, [])
        words = [word for word in along if isinstance(word, str)] if isinstance(along, list) else []
        reads = [word for word in words if self.follows.has(word)]
        return self.follows.at((*reads, value_at(resolved, self.follows.of))[0])

    def text(self, value: Value) -> str:
        """A value of this key as YAML text that :meth:`read` turns into the very same
        value."""
        if value is None:
            return "null"
        if self.kind == "switch":
            return str(value).lower()
        if self.kind == "list":
            return f"[{', '.join(map(self.each.text, value))}]"
        if self.kind == "table":
            return f"[{', '.join(map(self._record_text, value))}]"
        if isinstance(value, str):
            return value
        if self.kind == "quantity":
            return si.exact_text(value, self.units)
        return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)

    def _record_text(self, record: Value) -> str:
        """A record of a table, without the values that are the defaults."""
        found = record if isinstance(record, dict) else vars(record)
        given = ((part, found[part.key.rpartition(".")[2]]) for part in self.parts)
        told = [
            f"{part.key.rpartition('.')[2]}: {part.text(value)}"
            for number, (part, value) in enumerate(given)
            if value != part.default or (number == 0 and not self.required)
        ]
        return f"{{{', '.join(told)}}}"

    def allowed(self) -> str:
        """What may stand here, in words."""
        if self.kind == "table":
            names = ", ".join(part.key.rpartition(".")[2] for part in self.parts)
            return f"a list of one to {self.most} mappings with the keys {names}{', or null' if self.nullable else ''}"
        if self.kind == "list":
            return f"a list of one to {self.most} of {self.each.allowed()}{', or null' if self.nullable else ''}"
        if self.words:
            return f"{', '.join(self.words)} or {replace(self, words=()).allowed()}"
        if self.kind == "choice" and len(self.choices) >= MANY:
            return f"{', '.join(self.choices[:3])} or another of {len(self.choices)} keys"
        if self.kind == "choice":
            words = " or ".join(filter(None, (", ".join(self.choices[:-1]), self.choices[-1])))
            what = OF_SCRIPTS.get(self.key)
            return (
                words
                if what is None
                else f"{words}, or the {what} of an installed package or of a script that is given ({WITH})"
            )
        if self.kind == "switch":
            return "true or false"
        what = {"quantity": si.allowed_units(self.units), "number": "a number", "whole": "a whole number"}[self.kind]
        if self.kind == "number" and self.units:
            what = f"a number in {self.units}"
        return f"{what}{', or null' if self.nullable else ''}, {self.range()}"

    def about(self) -> Schema:
        """What the JSON Schema of the key says beside the form of its value: meaning, unit,
        default and source in one paragraph."""
        parts = [self.meaning]
        if self.units and self.kind != "table":
            parts.append(f"In {self.units}")
        if self.kind in ("quantity", "number", "whole"):
            parts.append(f"Range: {self.range()}" + (f" (in the field: {self.usual})" if self.usual else ""))
        parts.append(", ".join(filter(None, (f"Default {self.default_text}", self.other_defaults))))
        if self.source:
            parts.append(f"Source: {self.source}" + (f" (confidence: {self.confidence})" if self.confidence else ""))
        default = self.default_text if self.kind in ("list", "table", "quantity") else self.default
        return {"description": ". ".join(parts) + "."} | ({} if self.default is None else {"default": default})

    def schema(self) -> Schema:
        """The JSON Schema of one value."""
        if self.kind == "choice":
            schema: Schema = {"enum": list(self.choices)}
        elif self.kind == "switch":
            schema = {"type": "boolean"}
        elif self.kind == "list":
            items = {"type": "array", "items": self.each.schema()}
            schema = {**items, "minItems": 1, "maxItems": self.most}
        elif self.words:
            plain = replace(self, words=(), default=None).schema()
            return {"anyOf": [{"enum": list(self.words)}, plain]}
        elif self.kind == "quantity":
            usual = USUAL.get(self.units, USUAL["N/m"])
            example = self.text(self.default if self.default is not None else 1.0)
            examples = list(dict.fromkeys([example, f"1 {usual[0]}"]))
            schema = {"type": "string", "pattern": QUANTITY, "examples": examples}
        else:
            kind = "integer" if self.kind == "whole" else "number"
            schema = {"type": kind, "minimum": self.low, "maximum": self.high}
        if self.with_unit:  # a value with the unit of another key is that of it
            schema = {"anyOf": [schema, {"type": "string", "pattern": QUANTITY}]}
        return {"anyOf": [schema, {"type": "null"}]} if self.nullable else schema

    def read(self, raw: Plain) -> Value:
        """The value of ``raw``, in SI; :class:`QuantityError` says what is wrong with
        it."""
        if raw is None and self.nullable:
            return self.default
        if isinstance(raw, str) and raw in self.words:
            return raw
        if self.kind in ("list", "table"):
            if not isinstance(raw, list) or not 1 <= len(raw) <= self.most:
                empty = "an empty list" if raw == [] else f"{len(raw)} of them" if isinstance(raw, list) else shown(raw)
                raise QuantityError(empty, self.allowed())
            return raw if self.kind == "table" else [self.each.read(one) for one in raw]
        if self.kind == "choice":
            if isinstance(raw, str) and raw in self.choices:
                return raw
            raise QuantityError(shown(raw), self.allowed(), did_you_mean(str(raw), self.choices))
        if self.kind == "switch" and isinstance(raw, bool):
            return raw
        if self.kind == "quantity" and isinstance(raw, str):
            value = self._quantity(raw)
        elif self.kind in ("number", "whole") and not isinstance(raw, bool) and isinstance(raw, int | float):
            value = self._number(raw)
        else:
            bare = "Write it bare, without quotes or unit."
            if isinstance(raw, str) and self.units == "" and (percent := re.fullmatch(r"(\d+\.?\d*) ?%", raw)):
                bare = f"Write {float(percent[1]) / 100:g}."
            hint = si.form_hint(raw, self.units) or bare if isinstance(raw, str) and self.kind != "switch" else None
            remark = "without a unit" if self.kind == "quantity" else ""
            raise QuantityError(shown(raw, remark), self.allowed(), hint)
        if not self.low <= value <= self.high:
            raise QuantityError(shown(raw), self.allowed())
        return value

    def takes(self, raw: Plain) -> bool:
        """Whether ``raw`` can be read."""
        try:
            self.read(raw)
        except QuantityError:
            return False
        return True

    def _quantity(self, raw: str) -> float:
        try:
            return si.to_si(raw, self.units)
        except QuantityError as error:
            raise QuantityError(error.found, self.allowed(), error.suggestion) from None

    def _number(self, raw: float) -> float:
        if not math.isfinite(raw) or (self.kind == "whole" and raw != int(raw)):
            raise QuantityError(shown(raw), self.allowed())
        return int(raw) if self.kind == "whole" else float(raw) + 0.0

    def range(self) -> str:
        """The range in words."""
        return range_text(self.low, self.high, self.bound)

    def bound(self, value: float) -> str:
        """The end of a range, of a quantity in that of its usual units in which it is
        the shortest to write."""
        if self.kind != "quantity" or value == 0.0:
            return bound_text(value)
        numbers = {unit: bound_text(si.from_si(value, unit)) for unit in USUAL.get(self.units, (self.units,))}
        exact = [
            f"{number} {unit}"
            for unit, number in numbers.items()
            if si.to_si(f"{number.replace(' ', '')} {unit}", self.units) == value
        ]
        # the end of a spread, of which a rounded number may lie outside
        exact = exact or [f"{value!r} {self.units.replace(' ', '*')}"]
        return min(exact, key=lambda text: (len(re.sub(r"[^1-9]", "", text)), len(text)))


TIME = Leaf("time", "quantity", 0.0, "s", low=0.0, high=LONGEST)  # of the knots of a ramp
RAMP = "{ramp: [[0 s, VALUE], [600 s, VALUE]]}"
UNITS_LEAF = Leaf("units", "choice", "si", choices=("si", "field"), meaning=MEANINGS["units"])


@of_known_models
def model_leaf() -> Leaf:
    """The key ``model``, with the models that are known now."""
    return Leaf("model", "choice", MODEL, choices=model_names(), meaning=MEANINGS["model"])


def colon_hint(text: str, names: Collection[str]) -> str | None:
    """What to write in place of a ``text`` that begins with one of the ``names`` of keys
    and has no colon with a blank after it."""
    parts = re.match(r"(\w+)(?:\s*[=:]|\s)\s*(\S.*)", text[:80])
    if parts is None or parts[1] not in names:
        return None
    return f"A colon and a blank stand after a key: {parts[1]}: {parts[2]}"


def entries(cls: type, prefix: str) -> Iterator[tuple[str, Field[Value], type]]:
    """The keys of a dataclass tree in the order of the file, each with its field and the
    type of its value: a group, which is a dataclass, before what is in it."""
    hints = typing.get_type_hints(cls)
    for item in in_file_order(cls):
        key, kind = f"{prefix}.{item.name}", hints[item.name]
        yield key, item, kind
        if is_dataclass(kind) and isinstance(kind, type):
            yield from entries(kind, key)


def in_file_order(cls: type) -> list[Field[Value]]:
    """The fields of a section: how many starts there are stands after the states."""
    last = {item.name for item in fields(Starts)} if issubclass(cls, Starts) else set()
    return sorted(fields(cls), key=lambda item: item.name in last)


def leaf(key: str, item: Field[Value], hint: type, meaning: str, model: Description) -> Leaf:
    """One leaf from the dataclass field ``item`` with the type ``hint``."""
    meta = {"meaning": meaning, **item.metadata}
    for of_models in ("lane", "read_by"):
        meta.pop(of_models, None)
    # those of the first choice; the validation knows what the choice asks for
    if key in model.units_by:
        meta["units"] = next(iter(model.units_by[key][1].values()))
    if "with_unit" in meta:
        meta["with_unit"] = f"{key.rpartition('.')[0]}.{meta['with_unit']}"
    if meta.get("follows"):
        meta["follows"] = replace(meta["follows"], of=f"{key.rpartition('.')[0]}.{meta['follows'].of}")
    assert item.default is not MISSING, f"{key} has no default"
    if "record" in meta:
        kind = meta.pop("record")
        hints = typing.get_type_hints(kind)
        parts = tuple(leaf(f"{key}.{of.name}", of, hints[of.name], "", model) for of in fields(kind))
        return Leaf(key, "table", item.default, parts=parts, nullable=item.default is None, **meta)
    if typing.get_origin(hint) is Literal:
        return Leaf(key, "choice", item.default, choices=typing.get_args(hint), **meta)
    if hint is bool:
        return Leaf(key, "switch", item.default, meaning=meta["meaning"])
    nullable = type(None) in typing.get_args(hint)
    if hint is int:
        return Leaf(key, "whole", item.default, **meta)
    if "most" in meta:
        return Leaf(key, "list", item.default, nullable=nullable, **meta)
    bare = meta.get("units", "") in BARE
    return Leaf(key, "number" if bare else "quantity", item.default, nullable=nullable, **meta)


@dataclass(frozen=True)
class Keys:
    """The keys of a study of one ``model``, by their dotted names.

    ``sections`` are dataclasses, in file order; ``sweep`` is not among them. ``leaves``
    are the keys that take a value, the model's name first. ``axes`` are the numbers and
    choices that a sweep may vary, by the names that they have there: those of the
    operation by short ones, the others by their dotted keys; numbers are of the
    sections ``physical``. ``meanings`` says what each key is, sections and groups among
    them.
    """

    model: Description
    sections: dict[str, type]
    leaves: dict[str, Leaf]
    axes: dict[str, Leaf]
    physical: tuple[str, ...]
    meanings: dict[str, str]

    @property
    def operated(self) -> tuple[str, ...]:
        """The axes of the operating point, by their short keys."""
        return self.model.operation.names()

    def numbers(self, another: str = "another number") -> str:
        """What an axis may be, in words."""
        named = ", ".join(self.operated)
        return f"{named} or {another} by its key" if named else f"{another.replace('another', 'a')} by its key"

    @property
    def example_axis(self) -> tuple[str, str, str]:
        """A number for examples, with a least and a greatest value as texts: that of the
        model, or the first that there is."""
        if self.model.example_axis[0]:
            return self.model.example_axis
        ordered = {key for order in self.model.orders for key in (order.lower, order.upper)}
        for name in sorted(self.axes, key=ordered.__contains__):  # others than those that one may not pass
            found = self.axes[name]
            if found.kind in ("quantity", "number"):
                low, high = sorted((0.5 * found.default, 1.5 * found.default)) if found.default else (0.0, 1.0)
                ends = max(float(f"{low:.3g}"), found.low), min(float(f"{high:.3g}"), found.high)
                least, greatest = map(found.text, ends)
                return name, least, greatest
        return "KEY", "LOW", "HIGH"

    @property
    def example_slice(self) -> str:
        """A slice of starts for examples: that of the model, or over its first two states."""
        if self.model.example_slice or len(self.slices) < 2:
            return self.model.example_slice
        states = {name: self.leaves[f"initial.{name}"] for name in self.slices[:2]}
        spans = (f"{name}: {{from: {one.text(-1.0)}, to: {one.text(1.0)}, points: 21}}" for name, one in states.items())
        return f"{{{', '.join(spans)}}}"

    @property
    def slices(self) -> tuple[str, ...]:
        """The states that a slice of starts may vary."""
        return self.model.sliced or tuple(n for n in self.model.state_sets[0] if f"initial.{n}" in self.leaves)

    def models_with(self, key: str) -> list[str]:
        """The names of the other models that have a ``key``."""
        return [name for name, there in of_all(lambda model: key in keys_of(model).meanings) if there]

    def of(self, section: str) -> list[Leaf]:
        """The leaves of a section."""
        return [leaf for key, leaf in self.leaves.items() if key.startswith(f"{section}.")]

    def leaf(self, key: str, resolved: Resolved) -> Leaf:
        """The leaf of ``key``, whose units may depend on a choice of the ``resolved``
        study."""
        found = self.leaves[key]
        return self._in_its_units(
            replace(found, parts=tuple(self._in_its_units(part, resolved) for part in found.parts)), resolved
        )

    def _in_its_units(self, found: Leaf, resolved: Resolved) -> Leaf:
        if found.key not in self.model.units_by:
            return found
        choice, units = self.model.units_by[found.key]
        return replace(found, units=units[value_at(resolved, choice)])


def keys_named(model: str = MODEL) -> Keys:
    """The keys of the studies of the model of this name."""
    return keys_of(described(model))


def _simulation() -> type:
    """The section ``simulation``, with the pairs of scripts among its words."""
    words = own_pair_names()
    return subclass(Simulation, [row_with_words(Simulation, "pair", words)]) if words else Simulation


@of_known_models
def keys_of(found: Description) -> Keys:
    """The keys of the studies of a model."""
    sections = {
        **found.sections,
        **({"operation": found.operation} if found.operation.names() else {}),
        "initial": found.initial,
        "simulation": _simulation(),
        "classify": found.thresholds,
        "record": Record,
    }
    head = {key: MEANINGS[key] for key in ("title", "units", "model")}  # in the order of the file
    there = [entry for section, cls in sections.items() for entry in entries(cls, section)]
    grouped = {key: item.metadata.get("meaning", "") for key, item, kind in there if is_dataclass(kind)}
    general = {} if found.drills else GENERAL
    told = {**head, **grouped, **({} if general else OF_MODELS), **MEANINGS, **general, **found.meanings}
    told = {key: words for key, words in told.items() if key not in _SWEPT or key.partition(".")[2] in found.axes}
    every = {"model": model_leaf()}
    every |= {
        key: leaf(key, item, kind, told.get(key, ""), found)
        for key, item, kind in there
        if not is_dataclass(kind) and key != SLICE
    }
    every |= {key: replace(every[key], meaning=words) for key, words in general.items() if key in every}
    if general:  # others have lobes
        every["record.section"] = replace(every["record.section"], choices=("revolution",))
    numbers = {key.partition(".")[0] for key, one in every.items() if one.kind in ("quantity", "number")}
    physical = tuple(name for name in (*found.sections, "operation", "initial") if name in numbers)
    axes = {
        short_key(key): replace(one, nullable=False, words=())
        for key, one in every.items()
        if (one.kind in ("quantity", "number") and key.partition(".")[0] in physical and key != "initial.spread")
        or key in found.compiled
        or key in choices_of(found)
    }
    axes = dict(sorted(axes.items(), key=lambda item: "." in item[0]))
    known = {"title", "units", *sections, *grouped, *every, SLICE}
    meanings = {key: words for key, words in told.items() if key in known or key.partition(".")[0] in AROUND}
    meanings |= {key: one.meaning for key, one in every.items()}
    meanings |= {part.key: part.meaning for one in every.values() for part in one.parts}
    return Keys(found, sections, every, axes, physical, meanings)


SAMPLE_LEAF = Leaf(SAMPLE, "whole", 0, low=0, high=10**6, meaning="Number of a sample of the uncertain numbers")


def axes_of_all() -> dict[str, Leaf]:
    """The axes of the studies of all models; a key means the same in every model of nsdrill
    that has it, and in a script or a package what it means there."""
    own = spoken()
    return _axes_of_all() if own is None else {**_axes_of_all(), **keys_of(own).axes}


@of_known_models
def _axes_of_all() -> dict[str, Leaf]:
    found: dict[str, Leaf] = {}
    for _, keys in of_all(keys_of):
        found = {**keys.axes, **found}
    return {
        name: replace(leaf, choices=words_of(name)) if leaf.kind == "choice" else leaf for name, leaf in found.items()
    }


def shown(raw: Plain, remark: str = "") -> str:
    """A value as found, for a message."""
    if isinstance(raw, dict | list):
        return "a mapping" if isinstance(raw, dict) else "a list"
    if raw is None:
        return "nothing (null)"
    if isinstance(raw, bool):
        return f"{str(raw).lower()}, which is neither text nor number"
    if isinstance(raw, str):
        return quoted(raw)
    number = f"{raw:g}" if isinstance(raw, float) else str(raw)
    return f"the number {number} {remark}".rstrip()


# What a key may be called elsewhere, and the key here.
OTHER_WORDS = (
    ("speed", "rotary_speed"),
    ("rpm", "rotary_speed"),
    ("lyapunov", "exponent"),
    ("damping", "torsional_damping"),
    ("time", "transient (and observe)"),
    ("time", "simulation (transient and observe)"),
    ("duration", "transient (and observe)"),
    ("duration", "simulation (transient and observe)"),
    ("weight", "wob"),
    ("weight", "density"),
    ("weight", "outer_diameter (and inner_diameter: the sheet has both)"),
    ("type", "kind"),
    ("type", "lobes (1 for a PDC bit, 3 for a roller cone)"),
)


def did_you_mean(name: str, candidates: typing.Iterable[str], section: str = "") -> str | None:
    """ "Did you mean ...?" for the nearest candidate in ``section``, None where nothing is
    near."""
    known = list(candidates)
    usual = [key for word, key in OTHER_WORDS if word == name.lower() and key.partition(" ")[0] in known]
    capitals = [key for key in known if key.lower() == name.lower()]
    near = usual or capitals or difflib.get_close_matches(name[:80], known, n=1)
    return f"Did you mean {section}{'.' if section else ''}{near[0]}?" if near else None
