"""The section ``uncertain`` of a study: what its values must satisfy together, and its
samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from nsdrill.analysis.counts import FIT_DOUBTS, fit_words
from nsdrill.data import Resolved
from nsdrill.errors import count
from nsdrill.models.choices import is_compiled_in
from nsdrill.sampling import (
    BOUNDS,
    DESIGNS,
    KINDS,
    LEAST_IN_ORDER,
    MAX_SAMPLES,
    MAX_UNKNOWNS,
    NUMBERS_OF,
    Array,
    Uncertain,
    correlation_matrix,
    cut_of,
    distribution,
    draw,
    drawn_in_order,
    may_be_out_of_order,
    part_below,
)
from nsdrill.study.forms import Form, Listed, Member, One, Reading, Section
from nsdrill.study.keys import MEANINGS, Keys, Leaf, Plain, Schema, Value, shown
from nsdrill.study.read import KeyPath
from nsdrill.units import QuantityError
from nsdrill.variables import short_key

SAMPLES = Leaf("uncertain.samples", "whole", 256, low=2, high=MAX_SAMPLES, meaning=MEANINGS["uncertain.samples"])
SEED = Leaf("uncertain.seed", "whole", 1, low=0, high=10**15, meaning=MEANINGS["uncertain.seed"])
DESIGN = Leaf("uncertain.design", "choice", "sobol", choices=DESIGNS, meaning=MEANINGS["uncertain.design"])
DOUBT = Leaf("uncertain.doubts", "choice", "failed", choices=tuple(FIT_DOUBTS))
FACTOR = Leaf("factor", "number", 2.0, low=1.001, high=1e3)
CUT_WORDS = {"low": "below", "high": "above"}
HOW = ("samples", "seed", "design", "correlations", "table", "doubts")  # all keys but those of unknowns
# the part of a distribution that may lie outside the range of its key; nothing is drawn
# there
OUTSIDE = 1e-3
RANK = Leaf("correlation", "number", 0.0, low=-0.999, high=0.999)
EXAMPLES = {
    "uniform": "[low, high]",
    "normal": "{mean: .., deviation: ..}",
    "lognormal": "{median: .., factor: ..}",
    "triangular": "[low, mode, high]",
    "values": "[value, ...]",
}


def correlation(raw: Plain) -> tuple[str, str, float]:
    """One entry of the correlations; :class:`QuantityError` where it is none."""
    match raw:
        case [str(one), str(other), rank]:
            return short_key(one), short_key(other), float(RANK.read(rank))
    raise QuantityError(shown(raw), "two keys of unknowns and their rank correlation: [KEY, KEY, 0.5]")


def uncertain_of(section: Resolved) -> Uncertain:
    """What a resolved section says."""
    return Uncertain(
        {key: numbers for key, numbers in section.items() if key not in HOW},
        section["table"],
        section["samples"],
        section["seed"],
        section["design"],
        tuple((str(a), str(b), float(rank)) for a, b, rank in section["correlations"]),
    )


def unknown_keys(section: Resolved, keys: Keys) -> list[str]:
    """The keys of the unknowns of a resolved section, in the order of the axes. ValueError
    where there are none, or others."""
    unknown = uncertain_of(section)
    if not unknown.keys:
        raise ValueError("uncertain: found no unknown")
    if strange := [key for key in unknown.keys if key not in keys.axes or is_compiled_in(keys.model, key)]:
        raise ValueError(f"uncertain: found {', '.join(strange)}, which are no numbers to sample")
    return [key for key in keys.axes if key in unknown.keys]


def draws(section: Resolved, keys: Keys) -> dict[str, Array]:
    """The samples of a resolved section by key, in the order of the axes. ValueError
    where a value is none of its key."""
    unknown, in_order = uncertain_of(section), unknown_keys(section, keys)
    drawn = draw(unknown, keys.model.pairs)
    for key, values in drawn.items():
        leaf = keys.axes[key]
        if values.shape != (unknown.runs,) or not np.all((values >= leaf.low) & (values <= leaf.high)):
            raise ValueError(f"uncertain.{key}: found samples beyond {leaf.range()}, or not {unknown.runs} of them")
    return {key: drawn[key] for key in in_order}


def say_what_is_left_out(at: Reading, section: Resolved) -> None:
    """A note of the draws that are left out as they are against an order, or a fault where
    nearly all of them are, and with the design saltelli."""
    unknown, pairs = uncertain_of(section), at.keys.model.pairs
    known = [pair for pair in pairs if may_be_out_of_order(unknown.distributions, [pair])]
    if not known:
        return
    told = " and ".join(f"{pair.lower} {'at most' if pair.equal else 'below'} {pair.upper}" for pair in known)
    path = ("uncertain", known[0].lower)
    if unknown.design == "saltelli":
        found = f"ranges that overlap, of numbers in order ({told}), with the design saltelli"
        at.refuse(path, found, "design: sobol, which leaves out draws against the order; or ranges apart")
        return
    try:
        _, left_out = drawn_in_order(unknown, pairs)
    except ValueError:
        found = f"ranges with hardly any draw in order: {told}"
        at.refuse(path, found, f"ranges of which at least one draw in {1 / LEAST_IN_ORDER:g} is in order")
        return
    if left_out:
        at.document.notes.append(
            f"uncertain: {count(left_out, 'draw')} of {unknown.samples + left_out} against the order ({told}) left "
            f"out; the {unknown.samples} samples are the first in order, and these numbers depend on each other."
        )


class Distribution(Section):
    """The distribution of an unknown with the key ``leaf``."""

    def __init__(self, leaf: Leaf) -> None:
        one, spread = One(leaf), One(replace(leaf, low=0.0, high=leaf.high - leaf.low))
        numbers = {"mean": one, "deviation": spread, "median": one, "factor": One(FACTOR)}
        kinds: dict[str, Member] = {}
        for kind, form in EXAMPLES.items():
            made: Form = Listed(one)
            if kind in NUMBERS_OF:
                required = NUMBERS_OF[kind]
                given = {name: Member(numbers[name], name) for name in required}
                given |= {end: Member(one, f"Cut off {CUT_WORDS[end]} this") for end in BOUNDS}
                made = Section(kind, given, True, required, f"all of {' and '.join(required)}", empty=None)
            kinds[kind] = Member(made, form)
        super().__init__("Distribution", kinds, whole=True, empty=None)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        kinds = {kind: "object" if kind in NUMBERS_OF else "array" for kind in EXAMPLES}
        properties = {kind: {"type": kinds[kind], "description": form} for kind, form in EXAMPLES.items()}
        one = {"type": "object", "additionalProperties": False, "minProperties": 1, "maxProperties": 1}
        return {**one, "properties": properties}

    def checked(self, at: Reading, path: KeyPath, raw: Mapping[str, Plain], found: Resolved) -> Value:
        if len(found) != 1:
            what = " and ".join(found) or "no distribution"
            return at.refuse(path, what, f"one of {', '.join(f'{kind}: {EXAMPLES[kind]}' for kind in KINDS)}")
        ((kind, value),) = found.items()
        path = (*path, kind)
        if kind in NUMBERS_OF:
            return _named(at, path, found, at.keys.axes[str(path[-2])])
        count = {"uniform": 2, "triangular": 3}.get(kind)
        if count is not None and len(value) != count:
            hint = (
                "In brackets a comma begins the next value: write decimal points." if len(value) == 2 * count else None
            )
            return at.refuse(path, f"a list of {len(value)}", EXAMPLES[kind], hint)
        if count is not None and not (value[0] < value[-1] and sorted(value) == value):
            return at.refuse(path, "values that do not ascend", f"{EXAMPLES[kind]}, ascending")
        return found if value else at.refuse(path, "an empty list", "at least one value")


def _named(at: Reading, path: KeyPath, numbers: Resolved, leaf: Leaf) -> Value:
    """A normal or lognormal distribution, which lies within the range of its key, and is
    cut off there."""
    ((kind, value),) = numbers.items()
    middle, spread = NUMBERS_OF[kind]
    if value[spread] <= 0.0:
        return at.refuse((*path, spread), f"a {spread} of 0", "more than 0")
    if kind == "lognormal" and value[middle] <= 0.0:
        return at.refuse((*path, middle), f"a {middle} that is not positive", "more than 0")
    low, high = cut_of(numbers)
    below, above = part_below(numbers)
    if low is not None and high is not None and low >= high:
        return at.refuse((*path, "high"), "an end at or below low", "low below high")
    if above - below < 1e-6:
        return at.refuse(path, "ends that leave nothing of the distribution", "ends near its middle")
    made, inside = distribution(numbers), above - below
    parts = {"low": max(0.0, float(made.cdf(leaf.low)) - below), "high": max(0.0, above - float(made.cdf(leaf.high)))}
    for end, part in parts.items():
        if part / inside > OUTSIDE:
            found = f"a distribution of which {100 * part / inside:.2g} % lie {CUT_WORDS[end]} the range of {leaf.key}"
            hint = f"Cut it off with {end}: {leaf.text(leaf.low if end == 'low' else leaf.high)}."
            return at.refuse(path, found, f"{leaf.range()} for all but {100 * OUTSIDE:g} %", hint)
    ends = {"low": low, "high": high}
    for end, bound, outside in (("low", leaf.low, made.cdf(leaf.low)), ("high", leaf.high, made.sf(leaf.high))):
        if ends[end] in (None, bound):  # written or not
            ends[end] = bound if outside > 0.0 else None
    return {kind: {name: value[name] for name in NUMBERS_OF[kind]} | {k: v for k, v in ends.items() if v is not None}}


def take_uncertain(at: Reading, given: Resolved, swept: Resolved) -> Resolved | None:
    """The resolved section from the values ``given``, None where no number is uncertain
    or where the section is at fault. ``swept`` are the axes of the sweep."""
    keys, faults_before = at.keys, len(at.faults)
    told = [key for key in keys.axes if key in given]
    table = {key: list(given["table"][key]) for key in keys.axes if key in given.get("table", {})}
    if not told and not table:
        raw = at.document.value(("uncertain",))
        if given and isinstance(raw, dict) and all(key in HOW and not (key == "table" and raw[key]) for key in raw):
            key, low, high = keys.example_axis
            at.refuse(("uncertain",), "no unknown", f"one by its key, {key}: {{uniform: [{low}, {high}]}}")
        return None
    _check_unknowns(at, told, table, swept)
    _check_table(at, given, table)
    correlations = given.get("correlations", [])
    _check_correlations(at, told, table, correlations)
    if given.get("design") == "saltelli" and (table or correlations):
        why = "a table" if table else "correlations"
        at.refuse(("uncertain", "design"), f"saltelli with {why}", "saltelli of independent unknowns; sobol")
    if len(at.faults) > faults_before:
        return None
    return {
        **{key: given[key] for key in told},
        "samples": len(next(iter(table.values()))) if table else given.get("samples", SAMPLES.default),
        "seed": given.get("seed", SEED.default),
        "design": given.get("design", DESIGN.default),
        "correlations": [list(one) for one in correlations if {*one[:2]} <= {*told}],  # others may be at fault
        "table": table,
        **({"doubts": doubts} if (doubts := given.get("doubts")) else {}),  # of a fit only
    }


def say_doubts(at: Reading, section: Resolved) -> None:
    """A note of the doubts of the fit that the section is from."""
    if doubts := section.get("doubts"):
        at.document.notes.append(f"Doubtful fit: {fit_words(doubts)}.")


def _check_unknowns(at: Reading, told: list[str], table: Resolved, swept: Resolved) -> None:
    """Not too many of them, each once, and none that is swept."""
    if len(told) + len(table) > MAX_UNKNOWNS:
        at.refuse(("uncertain",), f"{len(told) + len(table)} unknowns", f"at most {MAX_UNKNOWNS}")
    for path in (*(("uncertain", key) for key in told), *(("uncertain", "table", key) for key in table)):
        key = path[-1]
        if key in swept:
            at.refuse(path, f"{key}, which the sweep varies", "a key that is swept or uncertain, not both")
        elif key in told and path[1] == "table":
            at.refuse(path, f"{key} a second time", "a distribution, or a column")


def _check_table(at: Reading, given: Resolved, table: Resolved) -> None:
    """Columns of one length, which is the number of samples."""
    if not table:
        return
    first, length = next((key, len(column)) for key, column in table.items())
    for key, column in table.items():
        if len(column) != length:
            allowed = f"as many values as of {first}, {length}: each row is a sample"
            at.refuse(("uncertain", "table", key), count(len(column), "value"), allowed)
    if not 2 <= length <= MAX_SAMPLES:
        at.refuse(("uncertain", "table", first), count(length, "value"), f"2 to {MAX_SAMPLES}")
    if given.get("samples") not in (None, length):
        found = f"{given['samples']} beside a table of {length} rows"
        at.refuse(("uncertain", "samples"), found, "left out: every row is a sample")


def _check_correlations(at: Reading, told: list[str], table: Resolved, found: Sequence[tuple[str, str, float]]) -> None:
    """Each pair once, of unknowns with distributions, and all of them together possible."""
    written = [*(at.document.value(("uncertain",)) or ())]
    seen: set[frozenset[str]] = set()
    for number, (one, two, _) in enumerate(found):
        path = ("uncertain", "correlations", number)
        if strange := [key for key in (one, two) if key not in written or key in HOW]:
            why = ", which the table gives" if strange[0] in table else ""
            at.refuse(
                path,
                f"{strange[0]}{why}",
                f"keys with a distribution: {', '.join(key for key in written if key in told)}",
            )
            return
        if one == two or frozenset((one, two)) in seen:
            at.refuse(path, f"{one} and {two}{' a second time' if one != two else ''}", "each pair once")
            return
        seen.add(frozenset((one, two)))
    if seen and set().union(*seen) <= {*told} and float(np.linalg.eigvalsh(correlation_matrix(told, found))[0]) < 1e-6:
        allowed = "correlations that can hold together (a positive definite matrix)"
        at.refuse(("uncertain", "correlations"), "correlations that contradict each other", allowed)
