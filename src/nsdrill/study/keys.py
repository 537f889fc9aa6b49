"""Every key of the study file: its default, units, range and source, taken from the
dataclasses that the run uses, and what it means.

Also how one value is read. Nothing here knows YAML or line numbers.
"""

from __future__ import annotations

import math
import re
import typing
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass, replace
from functools import lru_cache
from typing import Any, Literal

from nsdrill import units as si
from nsdrill.kernel.settings import LONGEST, Simulation
from nsdrill.models.description import Description
from nsdrill.models.leaves import choices_of, words_of
from nsdrill.models.meanings import MEANINGS as OF_MODELS
from nsdrill.models.registry import NAMES, described, of_all
from nsdrill.models.starts import Starts
from nsdrill.observe.thresholds import Record, Thresholds
from nsdrill.ranges import bound_text, range_text
from nsdrill.units import USUAL, QuantityError, quoted
from nsdrill.variables import MODEL, SAMPLE, short_key

MANY = 12  # choices that no message lists
BARE = ("", "percent")  # units of which a bare number is

AROUND = ("sweep", "uncertain", "continue")  # sections whose keys are those of others
SLICE = "initial.slice"  # its values are ranges of states, as the axes of the sweep are: no leaf

QUANTITY = (
    r"^\s*[-+]?((\d+[ -])?\d+/\d+|(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?)"
    r"\s*[A-Za-zµμ°1½¼¾⅛⅜⅝⅞\"'″′”’].*$"
)

# What each key means that no model has a say in, in one line.
MEANINGS: dict[str, str] = {
    "title": "Title of the study, put on figures and in the results file",
    "units": "In which units commands answer unless --units says otherwise",
    "model": "The model of the string",
    "sweep": "What is varied",
    "sweep.depth": "Depths",
    "sweep.wob": "Weights on bit",
    "sweep.rotary_speed": "Speeds of the top drive",
    "sweep.procedure": "Start each point from the same state, or carry the state up, down, or "
    "both ways",
    "sweep.along": "The axis along which the state is carried; needed where several are swept",
    "sweep.refine": "How often the spacing of axes {from, to, points} is halved where the "
    "responses differ",
    "continue": "What is followed by continuation, stable or not: for nsdrill branches",
    "continue.along": "The number that is continued: rotary_speed or any other by its key",
    "continue.from": "One end of its range",
    "continue.to": "The other end",
    "continue.seeds": "A results file whose settled points are followed, or values at which a "
    "motion settles first",
    "continue.motions": "What is followed: periodic (steady drilling, bounces), rolling, "
    "stick_slip",
    "continue.lobes": "The periods that are tried, in lobes, the shortest first",
    "continue.switch": "Whether branches that spring from doublings, branch points and Hopf "
    "points are followed too",
    "continue.points": "How many points a branch has at most",
    "continue.curves": "Curves of special points in a second number",
    "continue.curves.over": "The second number",
    "continue.curves.from": "One end of its range",
    "continue.curves.to": "The other end",
    "continue.curves.of": "Which points are followed: lift_off, wall, fold, doubling, torus, hopf",
    "continue.curves.points": "How many points a curve has at most",
    "uncertain": "Numbers that are not known, each with its distribution, by key; every point is "
    "run with many samples",
    "uncertain.samples": "How many samples are drawn; every operating point is run with the same "
    "ones",
    "uncertain.seed": "Another number draws other samples",
    "uncertain.design": "saltelli: samples x (unknowns + 2), from which Sobol indices follow "
    "without assumptions",
    "uncertain.correlations": "Rank correlations of pairs of unknowns, [[KEY, KEY, 0.5], ...]",
    "uncertain.table": "Joint samples in place of distributions, {KEY: [value, ...], ...}; each "
    "row is a sample",
    "simulation": "How each point is integrated",
    "simulation.transient": "Time before the motion is observed",
    "simulation.observe": "Time observed",
    "simulation.rtol": "Relative tolerance of a step",
    "simulation.max_steps": "Steps after which a run is given up",
    "simulation.verify": "Check every point with a smaller tolerance and a longer run; takes some "
    "4 times as long",
    "simulation.pair": "Pair of the explicit method; dormand_prince is the RK45 of SciPy",
    "simulation.method": "Integration of friction; implicit for steep friction",
    "classify": "From where a response counts as critical",
    "classify.bit_bounce": "Bit-bounce; the bounds of its severity must ascend",
    "classify.bit_bounce.lift_off_fraction": "Fraction of time off the rock above which it is "
    "bit-bounce",
    "classify.bit_bounce.light_fraction": "Severity: light above this fraction of time off the "
    "rock",
    "classify.bit_bounce.moderate_fraction": "Severity: moderate above this",
    "classify.bit_bounce.strong_fraction": "Severity: strong above this",
    "classify.bit_bounce.severe_fraction": "Severity: severe above this",
    "classify.stick_slip": "Stick-slip; the bounds of its severity must ascend",
    "classify.stick_slip.stick_slip_index": "Index (max - min) / (2 mean) of bit speed above "
    "which it is stick-slip",
    "classify.stick_slip.oscillation_index": "Severity: torsional oscillation from here",
    "classify.stick_slip.medium_index": "Severity: medium from here",
    "classify.stick_slip.stall_index": "Severity: onset of full stall from here",
    "classify.stick_slip.severe_index": "Severity: severe from here",
    "classify.whirl": "Whirl; the bounds of its severity must ascend",
    "classify.whirl.wall_contact_fraction": "Fraction of time on the wall above which it is whirl",
    "classify.whirl.rolling_tolerance": "Distance of the rolling ratio from one within which it "
    "is backward rolling",
    "classify.whirl.rolling_contact": "Least fraction of time on the wall for backward rolling",
    "classify.whirl.direction": "Size of the whirl ratio below which the direction is called "
    "irregular",
    "classify.whirl.light_acceleration": "Severity: light above this r.m.s. lateral acceleration",
    "classify.whirl.moderate_acceleration": "Severity: moderate above this",
    "classify.whirl.strong_acceleration": "Severity: strong above this",
    "classify.whirl.severe_acceleration": "Severity: severe above this",
    "classify.settled": "Settled motion",
    "classify.settled.tolerance": "Largest difference between the halves of the observation, "
    "over the range",
    "classify.trust": "Trust, where points were checked",
    "classify.trust.tolerance": "Largest difference of the features between a run and its checks, "
    "in natural scales",
    "classify.motion": "Kind of motion, from the returns to the Poincare section",
    "classify.motion.absolute": "Two returns are the same within this, in natural scales of the "
    "states",
    "classify.motion.relative": "and this, in parts of the range of the returns",
    "classify.motion.longest_period": "Longest period looked for, in returns",
    "classify.motion.exponent": "Lyapunov exponent, less two errors, above which it is chaotic",
    "classify.motion.exponent_error": "Two errors of the exponent up to which zero within them is "
    "quasi-periodic",
    "classify.motion.chaotic_above": "Without an exponent: 0-1 test above which it is chaotic",
    "classify.motion.regular_below": "Without an exponent: 0-1 test below which it is regular",
    "classify.attractors": "Attractors, where every operating point has several starts",
    "classify.attractors.tolerance": "Distance of scaled features within which two starts are on "
    "the same attractor",
    "classify.attractors.matching": "Distance within which attractors of neighbouring operating "
    "points have one number",
    "classify.stuck_below": "Bit speed below which the bit counts as stuck",
    "record": "What is kept of each point beside the features",
    "record.peaks": "Last local maxima kept of bit position, bit speed (one a slip) and radius",
    "record.poincare": "Last returns kept of the Poincare section; 0 for none",
    "record.section": "What the bit turns by between returns to the section",
    "record.exponent": "Measure the largest Lyapunov exponent",
}


@dataclass(frozen=True)
class Leaf:
    """One key that takes a value. ``kind`` is quantity (with ``units``), number, whole,
    choice (of ``choices``), switch (true or false), list (of up to ``most`` values of
    the leaf ``each``) or table (of up to ``most`` records with the leaves ``parts``).

    The range runs from ``low`` to ``high``, in SI; ``usual`` says what is met in the
    field. One of the ``words`` may stand in place of a quantity or number.
    """

    key: str
    kind: Literal["quantity", "number", "whole", "choice", "switch", "list", "table"]
    default: Any
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

    @property
    def each(self) -> Leaf:
        """The leaf of one value of a list."""
        return replace(
            self,
            kind="number" if self.units in BARE else "quantity",
            nullable=False,
            most=0,
            default=0.0,
        )

    @property
    def default_text(self) -> str:
        """The default as it would stand in the file."""
        return self.text(self.default)

    def text(self, value: Any) -> str:
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
        return (
            f"{value:g}"
            if isinstance(value, float) and float(f"{value:g}") == value
            else str(value)
        )

    def _record_text(self, record: Any) -> str:
        """A record of a table, without the values that are the defaults."""
        found = record if isinstance(record, dict) else vars(record)
        given = ((part, found[part.key.rpartition(".")[2]]) for part in self.parts)
        told = [
            f"{part.key.rpartition('.')[2]}: {part.text(value)}"
            for number, (part, value) in enumerate(given)
            if number == 0 or value != part.default
        ]
        return f"{{{', '.join(told)}}}"

    def allowed(self) -> str:
        """What may stand here, in words."""
        if self.kind == "table":
            names = ", ".join(part.key.rpartition(".")[2] for part in self.parts)
            return f"a list of one to {self.most} mappings with the keys {names}"
        if self.kind == "list":
            return (
                f"a list of one to {self.most} of "
                f"{self.each.allowed()}{', or null' if self.nullable else ''}"
            )
        if self.words:
            return f"{', '.join(self.words)} or {replace(self, words=()).allowed()}"
        if self.kind == "choice":
            return (
                _either(self.choices)
                if len(self.choices) < MANY
                else (f"{', '.join(self.choices[:3])} or another of {len(self.choices)} keys")
            )
        if self.kind == "switch":
            return "true or false"
        what = {
            "quantity": si.allowed_units(self.units),
            "number": "a number",
            "whole": "a whole number",
        }[self.kind]
        if self.kind == "number" and self.units:
            what = f"a number in {self.units}"
        return f"{what}{', or null' if self.nullable else ''}, {self.range()}"

    def schema(self) -> dict[str, Any]:
        """The JSON Schema of one value."""
        if self.kind == "choice":
            schema: dict[str, Any] = {"enum": list(self.choices)}
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
        return {"anyOf": [schema, {"type": "null"}]} if self.nullable else schema

    def read(self, raw: Any) -> Any:
        """The value of YAML scalar ``raw``; :class:`QuantityError` says what is wrong
        with it."""
        if raw is None and self.nullable:
            return None
        if self.kind == "choice":
            return self._choice(raw)
        if self.kind in ("list", "table"):
            if not isinstance(raw, list) or not 1 <= len(raw) <= self.most:
                empty = (
                    "an empty list"
                    if raw == []
                    else f"{len(raw)} of them"
                    if isinstance(raw, list)
                    else shown(raw)
                )
                raise QuantityError(empty, self.allowed())
            return raw if self.kind == "table" else [self.each.read(one) for one in raw]
        if isinstance(raw, str) and raw in self.words:
            return raw
        if self.kind == "switch":
            if not isinstance(raw, bool):
                raise QuantityError(shown(raw), self.allowed())
            return raw
        value = self._quantity(raw) if self.kind == "quantity" else self._number(raw)
        if not self.low <= value <= self.high:
            raise QuantityError(shown(raw), self.allowed())
        return value

    def _choice(self, raw: Any) -> str:
        if raw in self.choices and isinstance(raw, str):
            return raw
        raise QuantityError(shown(raw), self.allowed(), did_you_mean(str(raw), self.choices))

    def _quantity(self, raw: Any) -> float:
        if not isinstance(raw, str):
            raise QuantityError(shown(raw, "without a unit"), self.allowed())
        try:
            return si.to_si(raw, self.units)
        except QuantityError as error:
            raise QuantityError(error.found, self.allowed(), error.suggestion) from None

    def _number(self, raw: Any) -> float:
        if isinstance(raw, bool) or not isinstance(raw, int | float):
            hint = None
            if isinstance(raw, str):
                hint = "Write it bare, without quotes or unit."
            raise QuantityError(shown(raw), self.allowed(), hint)
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
        numbers = {unit: bound_text(si.from_si(value, unit)) for unit in USUAL[self.units]}
        exact = [
            f"{number} {unit}"
            for unit, number in numbers.items()
            if si.to_si(f"{number.replace(' ', '')} {unit}", self.units) == value
        ]
        return min(exact, key=lambda text: (len(re.sub(r"[^1-9]", "", text)), len(text)))


TIME = Leaf("time", "quantity", 0.0, "s", low=0.0, high=LONGEST)  # of the knots of a ramp
RAMP = "{ramp: [[0 s, VALUE], [600 s, VALUE]]}"
MODEL_LEAF = Leaf("model", "choice", MODEL, choices=NAMES, meaning=MEANINGS["model"])
UNITS_LEAF = Leaf("units", "choice", "si", choices=("si", "field"), meaning=MEANINGS["units"])


def leaves(
    cls: type, prefix: str, meanings: Mapping[str, str], model: Description
) -> Iterator[Leaf]:
    """The leaves of a dataclass tree, in the order of the file."""
    hints = typing.get_type_hints(cls)
    for item in in_file_order(cls):
        kind = hints[item.name]
        key = f"{prefix}.{item.name}"
        if key == SLICE:
            continue
        if is_dataclass(kind) and isinstance(kind, type):
            yield from leaves(kind, key, meanings, model)
        else:
            yield leaf(key, item, kind, meanings.get(key, ""), model)


def in_file_order(cls: type) -> list[Field[Any]]:
    """The fields of a section: how many starts there are stands after the states."""
    last = {item.name for item in fields(Starts)} if issubclass(cls, Starts) else set()
    return sorted(fields(cls), key=lambda item: item.name in last)


def leaf(key: str, item: Field[Any], hint: Any, meaning: str, model: Description) -> Leaf:
    """One leaf from the dataclass field ``item`` with the type ``hint``."""
    meta = {"meaning": meaning, **item.metadata}
    # those of the first choice; the validation knows what the choice asks for
    if key in model.units_by:
        meta["units"] = next(iter(model.units_by[key][1].values()))
    assert item.default is not MISSING, f"{key} has no default"
    if "record" in meta:
        kind = meta.pop("record")
        hints = typing.get_type_hints(kind)
        parts = tuple(
            leaf(f"{key}.{of.name}", of, hints[of.name], "", model) for of in fields(kind)
        )
        return Leaf(key, "table", item.default, parts=parts, **meta)
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
    def slices(self) -> tuple[str, ...]:
        """The states that a slice of starts may vary."""
        return self.model.sliced or self.model.state_sets[0]

    def of(self, section: str) -> list[Leaf]:
        """The leaves of a section."""
        return [leaf for key, leaf in self.leaves.items() if key.startswith(f"{section}.")]

    def leaf(self, key: str, resolved: Mapping[str, Any]) -> Leaf:
        """The leaf of ``key``, whose units may depend on a choice of the ``resolved``
        study."""
        found = self.leaves[key]
        return self._in_its_units(
            replace(found, parts=tuple(self._in_its_units(part, resolved) for part in found.parts)),
            resolved,
        )

    def _in_its_units(self, found: Leaf, resolved: Mapping[str, Any]) -> Leaf:
        if found.key not in self.model.units_by:
            return found
        choice, units = self.model.units_by[found.key]
        value: Any = resolved
        for part in choice.split("."):
            value = value[part]
        return replace(found, units=units[value])


@lru_cache
def keys_of(model: str = MODEL) -> Keys:
    """The keys of the studies of the model of this name."""
    found = described(model)
    sections = {
        **found.sections,
        "operation": found.operation,
        "initial": found.initial,
        "simulation": Simulation,
        "classify": Thresholds,
        "record": Record,
    }
    head = {key: MEANINGS[key] for key in ("title", "units", "model")}  # in the order of the file
    told = {**head, **OF_MODELS, **MEANINGS, **found.meanings}
    every = {"model": MODEL_LEAF}
    every |= {
        one.key: one
        for section, cls in sections.items()
        for one in leaves(cls, section, told, found)
    }
    numbers = {
        key.partition(".")[0] for key, one in every.items() if one.kind in ("quantity", "number")
    }
    physical = tuple(name for name in (*found.sections, "operation", "initial") if name in numbers)
    axes = {
        short_key(key): replace(one, nullable=False, words=())
        for key, one in every.items()
        if (
            one.kind in ("quantity", "number")
            and key.partition(".")[0] in physical
            and key != "initial.spread"
        )
        or key in found.compiled
        or key in choices_of(model)
    }
    axes = dict(sorted(axes.items(), key=lambda item: "." in item[0]))
    groups = {
        ".".join(parts[:end])
        for key in every
        for parts in [key.split(".")]
        for end in range(1, len(parts))
    }
    there = {"title", "units", *every, *groups, SLICE}
    meanings = {
        key: words for key, words in told.items() if key in there or key.partition(".")[0] in AROUND
    }
    meanings |= {key: one.meaning for key, one in every.items() if key not in meanings}
    meanings |= {part.key: part.meaning for one in every.values() for part in one.parts}
    return Keys(found, sections, every, axes, physical, meanings)


SAMPLE_LEAF = Leaf(
    SAMPLE, "whole", 0, low=0, high=10**6, meaning="Number of a sample of the uncertain numbers"
)


@lru_cache
def axes_of_all() -> dict[str, Leaf]:
    """The axes of the studies of all models; a key means the same in every model that
    has it."""
    found: dict[str, Leaf] = {}
    for _, keys in of_all(keys_of):
        found = {**keys.axes, **found}
    return {
        name: replace(leaf, choices=words_of(name)) if leaf.kind == "choice" else leaf
        for name, leaf in found.items()
    }


def shown(raw: Any, remark: str = "") -> str:
    """A value as found, for a message."""
    if isinstance(raw, dict):
        return "a mapping"
    if isinstance(raw, list):
        return "a list"
    if raw is None:
        return "nothing (null)"
    if isinstance(raw, bool):
        return f"{str(raw).lower()}, which is neither text nor number"
    if isinstance(raw, str):
        return quoted(raw)
    return (
        f"the number {raw:g}{' ' + remark if remark else ''}"
        if isinstance(raw, float)
        else (f"the number {raw}{' ' + remark if remark else ''}")
    )


def did_you_mean(name: str, candidates: typing.Iterable[str]) -> str | None:
    """ "Did you mean ...?" for the nearest candidate, None where nothing is near."""
    import difflib

    near = difflib.get_close_matches(name[:80], list(candidates), n=1)
    return f"Did you mean {near[0]}?" if near else None


def _either(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"
