"""The section ``continue`` of a study: what is followed by continuation, from where to
where, from which seeds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial, reduce
from operator import getitem
from typing import Any

from nsdrill.errors import Fault
from nsdrill.models.leaves import is_compiled_in, words_of
from nsdrill.study.forms import FAULTY, Either, Form, Listed, One, Read, Reading, Schema, Section, member
from nsdrill.study.keys import MEANINGS, QUANTITY, Keys, Leaf, did_you_mean, shown
from nsdrill.study.read import Document, KeyPath
from nsdrill.units import QuantityError
from nsdrill.variables import short_key

SECTION = "continue"
MOTIONS = ("periodic", "rolling", "stick_slip")
BORDERS = ("lift_off", "wall", "fold", "doubling", "torus", "hopf")
LOBES = (1, 2, 3, 4, 6)
MAX_LOBES = 24
POINTS = Leaf("continue.points", "whole", 400, low=2, high=100_000)
CURVE_POINTS = Leaf("continue.curves.points", "whole", 120, low=2, high=100_000)
SEEDS = 7  # values of the range from which a study without seeds starts
LONGEST_NAME = 4096


@dataclass(frozen=True)
class Curves:
    """Curves of special points in two numbers: ``over`` the second one, from ``low`` to
    ``high`` in SI, ``of`` which borders, with at most so many ``points`` each."""

    over: str
    low: float
    high: float
    of: tuple[str, ...]
    points: int


@dataclass(frozen=True)
class Continuation:
    """What is continued: the number ``along``, by its key, from ``low`` to ``high`` in
    SI; ``seeds`` from the results file of this name, or motions that settle at these
    values of a number, by its key; the ``motions`` that are followed, the ``lobes``
    that are tried as periods; whether to ``switch`` at doublings and branch points;
    ``points`` of a branch at most; ``curves`` in a second number, if any."""

    along: str
    low: float
    high: float
    seeds: str | Mapping[str, list[float]]
    motions: tuple[str, ...]
    lobes: tuple[int, ...]
    switch: bool
    points: int
    curves: Curves | None


def continuation_of(resolved: Mapping[str, Any]) -> Continuation | None:
    """The continuation in a resolved study, None where it has none. KeyError, TypeError
    or ValueError for what is no resolved section."""
    found = resolved.get(SECTION)
    if found is None:
        return None
    curves = found["curves"]
    made = curves and Curves(
        str(curves["over"]), float(curves["from"]), float(curves["to"]), tuple(curves["of"]), int(curves["points"])
    )
    seeds = found["seeds"]
    if not isinstance(seeds, str):
        seeds = {str(key): [float(value) for value in values] for key, values in seeds.items()}
    return Continuation(
        str(found["along"]),
        float(found["from"]),
        float(found["to"]),
        seeds,
        tuple(map(str, found["motions"])),
        tuple(map(int, found["lobes"])),
        bool(found["switch"]),
        int(found["points"]),
        made,
    )


def take_continuation(document: Document, keys: Keys) -> tuple[dict[str, Any] | None, list[Fault]]:
    """The section ``continue`` of the document as plain data in SI, defaults filled in,
    and its faults."""
    if SECTION not in document.data:
        return None, []
    raw, at = document.data[SECTION], Reading(document, keys)
    path: KeyPath = (SECTION,)
    curves = raw.get("curves") if isinstance(raw, dict) else None
    form = continuation_form(keys, _given(keys, raw, "along"), _given(keys, curves, "over"))
    found = form.read(at, path, raw)
    if at.faults:
        return None, at.faults
    along, (low, high) = found["along"], _ends(at, path, found)
    made = {
        "along": along,
        "from": low,
        "to": high,
        "seeds": _seeds(at, found.get("seeds"), along, low, high),
        "motions": [word for word in MOTIONS if word in found.get("motions", MOTIONS)],
        "lobes": sorted(set(found.get("lobes", LOBES))),
        "switch": found.get("switch", True),
        "points": found.get("points", POINTS.default),
        "curves": None,
    }
    if inner := found.get("curves"):
        if inner["over"] == along:
            said = f"{along}, which is continued already"
            at.refuse((*path, "curves", "over"), said, "another number than along")
        first, last = _ends(at, (*path, "curves"), inner)
        made["curves"] = {
            "over": inner["over"],
            "from": first,
            "to": last,
            "of": [word for word in BORDERS if word in inner.get("of", BORDERS)],
            "points": inner.get("points", CURVE_POINTS.default),
        }
    return (None if at.faults else made), at.faults


def continuation_form(keys: Keys, along: Leaf | None = None, over: Leaf | None = None) -> Section:
    """The form of the section; the ends of its ranges are values of the numbers
    ``along`` and ``over``, where these are known."""
    axis = Read(partial(_axis, keys), {"enum": list(_axes(keys))})
    inner = {
        "over": axis,
        "from": _number(over),
        "to": _number(over),
        "of": _several(_words("of", BORDERS)),
        "points": One(CURVE_POINTS),
    }
    members = {
        "along": axis,
        "from": _number(along),
        "to": _number(along),
        "seeds": _Seeds(along),
        "motions": _several(_words("motions", MOTIONS)),
        "lobes": _several(One(Leaf("continue.lobes", "whole", 1, low=1, high=MAX_LOBES))),
        "switch": One(Leaf("continue.switch", "switch", True)),
        "points": One(POINTS),
        "curves": Either(Read(_nothing, {"type": "null"}), mapping=_section("curves", inner)),
    }
    return _section("continue", members)


def _section(name: str, members: Mapping[str, Form]) -> Section:
    """A mapping whose first key names a number, and the next two its range."""
    prefix = name if name == SECTION else f"{SECTION}.{name}"
    told = {key: member(form, MEANINGS[f"{prefix}.{key}"]) for key, form in members.items()}
    number, *ends = required = tuple(members)[:3]
    missing = f"{number}, a number by its key, and the ends of its range, {' and '.join(ends)}"
    return Section(name.capitalize(), told, True, required, missing)


def _several(one: Form) -> Either:
    """A list of one or more values, or one of them."""
    return _OrOne(one, Listed(one, "one or more values", (1, 10**4), "{} of them"))


class _OrOne(Either):
    """A list of values of one form, or one of them, which is read as a list of it."""

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        found = super().read(at, path, raw)
        return found if isinstance(raw, list) or found is FAULTY else [found]


@dataclass(frozen=True)
class _Seeds:
    """The name of a results file, or values of the number ``along``."""

    along: Leaf | None

    def read(self, at: Reading, path: KeyPath, raw: Any) -> Any:
        key = "KEY" if self.along is None else short_key(self.along.key)
        if isinstance(raw, dict) and list(raw) == [key]:
            return _several(_number(self.along)).read(at, (*path, key), raw[key])
        is_name = isinstance(raw, str) and raw.strip() and "\0" not in raw
        unknown = self.along is None and isinstance(raw, dict)
        if raw is None or unknown or (is_name and len(raw) <= LONGEST_NAME):
            return raw
        allowed = f"the name of a results file, or values at which a motion settles: {{{key}: [..]}}"
        other = isinstance(raw, dict) and len(raw) == 1
        found = "another number than that which is continued" if other else shown(raw)
        return at.refuse(path, found, allowed)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        return {"type": ["string", "null", "object"], "maxProperties": 1}


def _seeds(at: Reading, found: Any, along: str, low: float, high: float) -> Any:
    """The seeds: the name of a file, or values between the ends, by default some that
    divide the range."""
    if isinstance(found, str):
        return found
    if found is None:
        return {along: [low + (high - low) * (k + 0.5) / SEEDS for k in range(SEEDS)]}
    if outside := [value for value in found if not low <= value <= high]:
        said = f"{at.keys.axes[along].text(outside[0])}, outside the range"
        at.refuse((SECTION, "seeds", along), said, "values between from and to")
    return {along: found}


def _ends(at: Reading, path: KeyPath, found: Mapping[str, float]) -> tuple[float, float]:
    """The ends of a range, ascending."""
    low, high = sorted((found["from"], found["to"]))
    if found["from"] > found["to"]:
        raw = reduce(getitem, path, at.document.data)
        at.document.notes.append(
            f"{'.'.join(map(str, path))} goes from {raw['from']} down to {raw['to']}; the range is "
            f"taken in ascending order. Branches are followed both up and down."
        )
    if high - low <= 1e-6 * max(abs(low), abs(high)):
        at.refuse((*path, "to"), "the same value as in from", "from and to that differ")
    return low, high


def _axes(keys: Keys) -> dict[str, Leaf]:
    """The numbers along which motions may be continued."""
    return {
        name: leaf
        for name, leaf in keys.axes.items()
        if not name.startswith("initial.") and not is_compiled_in(keys.model, name)
    }


def _given(keys: Keys, raw: Any, name: str) -> Leaf | None:
    """The number that the mapping ``raw`` names; None where it names none."""
    key = raw.get(name) if isinstance(raw, dict) else None
    return _axes(keys).get(short_key(key)) if isinstance(key, str) else None


def _axis(keys: Keys, raw: Any) -> str:
    """The number with the key ``raw``; QuantityError where there is none."""
    name, axes = short_key(raw) if isinstance(raw, str) else "", _axes(keys)
    if name in axes:
        return name
    if name in keys.axes and is_compiled_in(keys.model, name):
        what = "a choice" if words_of(name) else "a whole number that is compiled in"
        hint = f"Make a file for each of its values, with --set {name}=..."
        raise QuantityError(f"{name}, {what}", "a number that varies continuously", hint)
    example = keys.model.example_axis[0]
    allowed = f"depth, wob, rotary_speed or another number by its key, as {example}"
    raise QuantityError(shown(raw), allowed, did_you_mean(raw, axes) if name else None)


def _number(leaf: Leaf | None) -> Form:
    """A value of the number ``leaf``; of one that is not known any value."""
    number = {"anyOf": [{"type": "string", "pattern": QUANTITY}, {"type": "number"}]}
    return Read(lambda raw: raw, number) if leaf is None else One(leaf)


def _words(name: str, words: Sequence[str]) -> One:
    return One(Leaf(f"continue.{name}", "choice", words[0], choices=tuple(words)))


def _nothing(raw: Any) -> None:
    if raw is not None:
        raise QuantityError(shown(raw), "a mapping, or null")
