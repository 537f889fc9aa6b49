"""The section ``uncertain`` of a study: what its values must satisfy together, and its
samples."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from nsdrill.errors import Fault
from nsdrill.models.leaves import is_compiled_in
from nsdrill.sampling import (
    BOUNDS,
    DESIGNS,
    KINDS,
    MAX_SAMPLES,
    MAX_UNKNOWNS,
    NUMBERS_OF,
    Array,
    Uncertain,
    correlation_matrix,
    cut_of,
    distribution,
    draw,
    part_below,
)
from nsdrill.study.keys import MEANINGS, Keys, Leaf, shown
from nsdrill.study.read import Document, KeyPath
from nsdrill.units import QuantityError
from nsdrill.variables import short_key

SAMPLES = Leaf("uncertain.samples", "whole", 256, low=2, high=MAX_SAMPLES, meaning=MEANINGS["uncertain.samples"])
SEED = Leaf("uncertain.seed", "whole", 1, low=0, high=10**15, meaning=MEANINGS["uncertain.seed"])
DESIGN = Leaf("uncertain.design", "choice", "sobol", choices=DESIGNS, meaning=MEANINGS["uncertain.design"])
FACTOR = Leaf("factor", "number", 2.0, low=1.001, high=1e3)
CUT_WORDS = {"low": "below", "high": "above"}
HOW = ("samples", "seed", "design", "correlations", "table")  # all keys but those of unknowns
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


def correlation(raw: Any) -> tuple[str, str, float]:
    """One entry of the correlations; :class:`QuantityError` where it is none."""
    if not isinstance(raw, list) or len(raw) != 3 or not all(isinstance(key, str) for key in raw[:2]):
        raise QuantityError(shown(raw), "two keys of unknowns and their rank correlation: [KEY, KEY, 0.5]")
    return short_key(raw[0]), short_key(raw[1]), float(RANK.read(raw[2]))


def take_uncertain(
    document: Document, given: dict[str, Any], swept: dict[str, Any], keys: Keys
) -> tuple[dict[str, Any] | None, list[Fault]]:
    """The resolved section from the validated one, None where no number is uncertain;
    and its faults. ``swept`` are the axes of the sweep."""
    told = [key for key in given if key not in HOW]
    columns = given.get("table") or {}
    faults = list(_faults(document, given, swept, keys))
    if not (told or columns) or faults:
        return None, faults
    order = [key for key in keys.axes if key in told]
    table = {key: list(columns[key]) for key in keys.axes if key in columns}
    samples = len(next(iter(table.values()))) if table else given.get("samples", SAMPLES.default)
    section: dict[str, Any] = {key: _within(given[key], keys.axes[key]) for key in order}
    section |= {
        "samples": samples,
        "seed": given.get("seed", SEED.default),
        "design": given.get("design", DESIGN.default),
        "correlations": [list(one) for one in given.get("correlations") or ()],
        "table": table,
    }
    return section, []


def _within(numbers: dict[str, Any], leaf: Leaf) -> dict[str, Any]:
    """A distribution cut off at the range of its key."""
    ((kind, value),) = numbers.items()
    if kind not in NUMBERS_OF:
        return {kind: list(value)}
    ends, made = dict(zip(BOUNDS, cut_of(numbers), strict=True)), distribution(numbers)
    if ends["low"] is None and made.cdf(leaf.low) > 0.0:
        ends["low"] = leaf.low
    if ends["high"] is None and made.sf(leaf.high) > 0.0:
        ends["high"] = leaf.high
    return {kind: {name: value[name] for name in NUMBERS_OF[kind]} | {k: v for k, v in ends.items() if v is not None}}


def uncertain_of(section: dict[str, Any]) -> Uncertain:
    """What a resolved section says."""
    return Uncertain(
        {key: numbers for key, numbers in section.items() if key not in HOW},
        section["table"],
        section["samples"],
        section["seed"],
        section["design"],
        tuple((str(a), str(b), float(rank)) for a, b, rank in section["correlations"]),
    )


def draws(section: dict[str, Any], keys: Keys) -> dict[str, Array]:
    """The samples of a resolved section by key, in the order of the axes. ValueError
    where a value is none of its key."""
    unknown = uncertain_of(section)
    if not unknown.keys:
        raise ValueError("uncertain: found no unknown")
    if strange := [key for key in unknown.keys if key not in keys.axes or is_compiled_in(keys.model, key)]:
        raise ValueError(f"uncertain: found {', '.join(strange)}, which are no numbers to sample")
    drawn = draw(unknown)
    for key, values in drawn.items():
        leaf = keys.axes[key]
        if values.shape != (unknown.runs,) or not np.all((values >= leaf.low) & (values <= leaf.high)):
            raise ValueError(f"uncertain.{key}: found samples beyond {leaf.range()}, or not {unknown.runs} of them")
    return {key: drawn[key] for key in keys.axes if key in drawn}


def _faults(document: Document, given: dict[str, Any], swept: dict[str, Any], keys: Keys) -> Iterator[Fault]:
    told = [key for key in given if key not in HOW]
    columns = given.get("table") or {}
    if not told and not columns:
        raw = document.data.get("uncertain")
        if given and not any(key not in HOW or (key == "table" and raw[key]) for key in raw):
            yield document.fault(("uncertain",), "no unknown", f"one by its key, {_example(keys)}")
        return
    if len(told) + len(columns) > MAX_UNKNOWNS:
        yield document.fault(("uncertain",), f"{len(told) + len(columns)} unknowns", f"at most {MAX_UNKNOWNS}")
    for key in told:
        yield from _of_one(document, key, given[key], keys.axes[key])
    for key in (*told, *columns):
        path = ("uncertain", key) if key in told else ("uncertain", "table", key)
        if key in swept:
            yield document.fault(path, f"{key}, which the sweep varies", "a key that is swept or uncertain, not both")
        elif key in told and key in columns:
            yield document.fault(("uncertain", "table", key), f"{key} a second time", "a distribution, or a column")
    yield from _of_table(document, given, columns)
    yield from _of_correlations(document, given, told, columns)
    if given.get("design") == "saltelli" and (columns or given.get("correlations")):
        why = "a table" if columns else "correlations"
        yield document.fault(("uncertain", "design"), f"saltelli with {why}", "saltelli of independent unknowns; sobol")


def _of_one(document: Document, key: str, numbers: dict[str, Any], leaf: Leaf) -> Iterator[Fault]:
    """The faults of one distribution."""
    path: KeyPath = ("uncertain", key)
    given = {kind: value for kind, value in numbers.items() if value is not None}
    if len(given) != 1:
        found = f"{' and '.join(given)}" if given else "no distribution"
        yield document.fault(path, found, f"one of {', '.join(f'{kind}: {EXAMPLES[kind]}' for kind in KINDS)}")
        return
    ((kind, value),) = given.items()
    path = (*path, kind)
    if kind in ("uniform", "triangular"):
        count = 2 if kind == "uniform" else 3
        if len(value) != count:
            yield document.fault(path, f"a list of {len(value)}", EXAMPLES[kind])
        elif not (value[0] < value[-1] and sorted(value) == list(value)):
            yield document.fault(path, "values that do not ascend", f"{EXAMPLES[kind]}, ascending")
    elif kind == "values":
        if not value:
            yield document.fault(path, "an empty list", "at least one value")
    else:
        yield from _of_named(document, path, given, leaf)


def _of_named(document: Document, path: KeyPath, numbers: dict[str, Any], leaf: Leaf) -> Iterator[Fault]:
    """The faults of a normal or lognormal distribution: it lies within the range of its
    key, or is cut off there."""
    ((kind, value),) = numbers.items()
    middle, spread = NUMBERS_OF[kind]
    if value[spread] <= 0.0:
        yield document.fault((*path, spread), f"a {spread} of 0", "more than 0")
        return
    if kind == "lognormal" and value[middle] <= 0.0:
        yield document.fault((*path, middle), f"a {middle} that is not positive", "more than 0")
        return
    low, high = cut_of(numbers)
    below, above = part_below(numbers)
    if low is not None and high is not None and low >= high:
        yield document.fault((*path, "high"), "an end at or below low", "low below high")
        return
    if above - below < 1e-6:
        yield document.fault(path, "ends that leave nothing of the distribution", "ends near its middle")
        return
    made, inside = distribution(numbers), above - below
    parts = {"low": max(0.0, float(made.cdf(leaf.low)) - below), "high": max(0.0, above - float(made.cdf(leaf.high)))}
    for end, part in parts.items():
        if part / inside > OUTSIDE:
            found = f"a distribution of which {100 * part / inside:.2g} % lie {CUT_WORDS[end]} the range of {leaf.key}"
            hint = f"Cut it off with {end}: {leaf.text(leaf.low if end == 'low' else leaf.high)}."
            yield document.fault(path, found, f"{leaf.range()} for all but {100 * OUTSIDE:g} %", hint)


def _of_table(document: Document, given: dict[str, Any], columns: dict[str, Any]) -> Iterator[Fault]:
    lengths = {key: len(column) for key, column in columns.items()}
    if not lengths:
        return
    first, length = next(iter(lengths.items()))
    for key, count in lengths.items():
        if count != length:
            allowed = f"as many values as of {first}, {length}: each row is a sample"
            yield document.fault(("uncertain", "table", key), f"{count} values", allowed)
    if not 2 <= length <= MAX_SAMPLES:
        yield document.fault(("uncertain", "table", first), f"{length} values", f"2 to {MAX_SAMPLES}")
    if given.get("samples") not in (None, length):
        found = f"{given['samples']} beside a table of {length} rows"
        yield document.fault(("uncertain", "samples"), found, "left out: every row is a sample")


def _of_correlations(
    document: Document, given: dict[str, Any], told: list[str], columns: dict[str, Any]
) -> Iterator[Fault]:
    found = given.get("correlations") or ()
    seen: set[frozenset[str]] = set()
    for number, (one, two, _) in enumerate(found):
        path = ("uncertain", "correlations", number)
        if strange := [key for key in (one, two) if key not in told]:
            why = ", which the table gives" if strange[0] in columns else ""
            yield document.fault(path, f"{strange[0]}{why}", f"keys with a distribution: {', '.join(told)}")
            return
        if one == two or frozenset((one, two)) in seen:
            yield document.fault(path, f"{one} and {two}{' a second time' if one != two else ''}", "each pair once")
            return
        seen.add(frozenset((one, two)))
    if found and float(np.linalg.eigvalsh(correlation_matrix(told, found))[0]) < 1e-6:
        allowed = "correlations that can hold together (a positive definite matrix)"
        yield document.fault(("uncertain", "correlations"), "correlations that contradict each other", allowed)


def _example(keys: Keys) -> str:
    key, low, high = keys.model.example_axis
    return f"{key}: {{uniform: [{low}, {high}]}}"
