"""The section ``continue`` of a study: what is followed by continuation, from where to
where, from which seeds."""

from __future__ import annotations

from collections.abc import Container, Mapping
from functools import partial

from nsdrill.data import Resolved
from nsdrill.errors import option
from nsdrill.models.choices import is_compiled_in, words_of
from nsdrill.records import dataclass
from nsdrill.study.forms import FAULTY, Either, Form, Member, One, Read, Reading, Section, Several, ascending_ends
from nsdrill.study.keys import MEANINGS, QUANTITY, Keys, Leaf, Plain, Schema, Value, did_you_mean, shown
from nsdrill.study.read import KeyPath
from nsdrill.units import QuantityError
from nsdrill.variables import short_key

SECTION = "continue"
MOTIONS = ("periodic", "rolling", "stick_slip")
MOTIONS_OF_ANY = ("periodic", "cycle")  # of a model that is no drill string
DIRECTIONS = ("both", "up", "down")
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
    values of a number, by its key; in which ``direction`` of the number branches set out
    from seeds; the ``motions`` that are followed, the ``lobes`` that are tried as
    periods; whether to ``switch`` at doublings and branch points; ``points`` of a branch at
    most; ``curves`` in a second number, if any."""

    along: str
    low: float
    high: float
    seeds: str | Mapping[str, list[float]]
    direction: str
    motions: tuple[str, ...]
    lobes: tuple[int, ...]
    switch: bool
    points: int
    curves: Curves | None


def continuation_of(resolved: Resolved, axes: Container[str]) -> Continuation | None:
    """The continuation in a resolved study whose numbers are ``axes``, None where it has none. KeyError,
    TypeError or ValueError for what is no resolved section."""
    found = resolved.get(SECTION)
    if found is None:
        return None
    curves = found["curves"]
    for key in (found["along"], *((curves["over"],) if curves else ())):
        if key not in axes:
            raise ValueError(f"{SECTION}: found {key!r}, which is no axis")
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
        str(found["direction"]),
        tuple(map(str, found["motions"])),
        tuple(map(int, found["lobes"])),
        bool(found["switch"]),
        int(found["points"]),
        made,
    )


class _Range(Section):
    """A mapping of which the first key names a number, and the next two its range."""

    def __init__(self, prefix: str, members: Mapping[str, Form], meanings: Mapping[str, str] = MEANINGS) -> None:
        number, *ends = required = tuple(members)[:3]
        missing = f"{number}, a number by its key, and the ends of its range, {' and '.join(ends)}"
        told = {key: Member(form, meanings[f"{prefix}.{key}"]) for key, form in members.items()}
        super().__init__(prefix.rpartition(".")[2].capitalize(), told, True, required, missing)

    def checked(self, at: Reading, path: KeyPath, raw: Mapping[str, Plain], found: Resolved) -> Value:
        remark = "the range is taken in ascending order. Branches are followed both up and down."
        low, high = ascending_ends(at, path, raw, found, remark)
        if high - low <= 1e-6 * max(abs(low), abs(high)):
            return at.refuse((*path, "to"), "the same value as in from", "from and to that differ")
        return {**found, "from": low, "to": high}


class _Curves(_Range):
    """Curves of special points in a second number."""

    def __init__(self, axis: Form, over: Leaf | None) -> None:
        members = {"over": axis, "from": _number(over), "to": _number(over), "of": _words(BORDERS)}
        super().__init__("continue.curves", {**members, "points": One(CURVE_POINTS)})

    def checked(self, at: Reading, path: KeyPath, raw: Mapping[str, Plain], found: Resolved) -> Value:
        made = super().checked(at, path, raw, found)
        if made is FAULTY:
            return FAULTY
        of = [word for word in BORDERS if word in found.get("of", BORDERS)]
        ends = {"over": made["over"], "from": made["from"], "to": made["to"]}
        return {**ends, "of": of, "points": found.get("points", CURVE_POINTS.default)}


class Continue(_Range):
    """The section; the ends of its ranges are values of the numbers ``along`` and
    ``over``, where these are known. It comes out as plain data, defaults filled in."""

    def __init__(self, keys: Keys, along: Leaf | None = None, over: Leaf | None = None) -> None:
        axis = Read(partial(_axis, keys), {"enum": list(_axes(keys))})
        super().__init__(
            SECTION,
            {
                "along": axis,
                "from": _number(along),
                "to": _number(along),
                "seeds": _Seeds(along),
                "direction": One(Leaf("continue.direction", "choice", DIRECTIONS[0], choices=DIRECTIONS)),
                "motions": _words(_motions(keys)),
                "lobes": Several(One(Leaf("continue.lobes", "whole", 1, low=1, high=MAX_LOBES))),
                "switch": One(Leaf("continue.switch", "switch", True)),
                "points": One(POINTS),
                "curves": Either(Read(_nothing, {"type": "null"}), mapping=_Curves(axis, over)),
            },
            keys.meanings,
        )

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        curves = raw.get("curves") if isinstance(raw, dict) else None
        known = Continue(at.keys, _given(at.keys, raw, "along"), _given(at.keys, curves, "over"))
        return super(Continue, known).read(at, path, raw)

    def checked(self, at: Reading, path: KeyPath, raw: Mapping[str, Plain], found: Resolved) -> Value:
        made = super().checked(at, path, raw, found)
        if made is FAULTY:
            return FAULTY
        along, low, high = made["along"], made["from"], made["to"]
        seeds, curves = found.get("seeds"), found.get("curves")
        if curves is not None and curves["over"] == along:
            said = f"{along}, which is continued already"
            return at.refuse((*path, "curves", "over"), said, "another number than along")
        if seeds is None:  # some that divide the range
            seeds = [low + (high - low) * (k + 0.5) / SEEDS for k in range(SEEDS)]
        elif not isinstance(seeds, str) and (outside := [one for one in seeds if not low <= one <= high]):
            said = f"{at.keys.axes[along].text(outside[0])}, outside the range"
            return at.refuse((*path, "seeds", along), said, "values between from and to")
        return {
            "along": along,
            "from": low,
            "to": high,
            "seeds": seeds if isinstance(seeds, str) else {along: seeds},
            "direction": found.get("direction", DIRECTIONS[0]),
            "motions": [word for word in _motions(at.keys) if word in found.get("motions", _motions(at.keys))],
            "lobes": sorted(set(found.get("lobes", LOBES))),
            "switch": found.get("switch", True),
            "points": found.get("points", POINTS.default),
            "curves": curves,
        }


@dataclass(frozen=True)
class _Seeds:
    """The name of a results file, or values of the number ``along``."""

    along: Leaf | None

    def read(self, at: Reading, path: KeyPath, raw: Plain) -> Value:
        key = "KEY" if self.along is None else short_key(self.along.key)
        if isinstance(raw, dict) and list(raw) == [key]:
            return Several(_number(self.along)).read(at, (*path, key), raw[key])
        is_name = isinstance(raw, str) and raw.strip() and "\0" not in raw and len(raw) <= LONGEST_NAME
        if raw is None or is_name or (self.along is None and isinstance(raw, dict)):
            return raw
        allowed = f"the name of a results file, or values at which a motion settles: {{{key}: [..]}}"
        other = isinstance(raw, dict) and len(raw) == 1
        found = "another number than that which is continued" if other else shown(raw)
        return at.refuse(path, found, allowed)

    def schema(self, parts: dict[str, Schema]) -> Schema:
        return {"type": ["string", "null", "object"], "maxProperties": 1}


def _axes(keys: Keys) -> dict[str, Leaf]:
    """The numbers along which motions may be continued."""
    return {
        name: leaf
        for name, leaf in keys.axes.items()
        if not name.startswith("initial.") and not is_compiled_in(keys.model, name)
    }


def _given(keys: Keys, raw: Plain, name: str) -> Leaf | None:
    """The number that the mapping ``raw`` names; None where it names none."""
    key = raw.get(name) if isinstance(raw, dict) else None
    return _axes(keys).get(short_key(key)) if isinstance(key, str) else None


def _axis(keys: Keys, raw: Plain) -> str:
    """The number with the key ``raw``; QuantityError where there is none."""
    name, axes = short_key(raw) if isinstance(raw, str) else "", _axes(keys)
    if name in axes:
        return name
    if name in keys.axes and is_compiled_in(keys.model, name):
        what = "a choice" if words_of(name) else "a whole number that is compiled in"
        hint = f"Make a file for each of its values, with {option('set', f'{name}=...')}"
        raise QuantityError(f"{name}, {what}", "a number that varies continuously", hint)
    allowed = f"{keys.numbers()}, as {keys.example_axis[0]}"
    raise QuantityError(shown(raw), allowed, did_you_mean(str(raw), axes) if name else None)


def _motions(keys: Keys) -> tuple[str, ...]:
    return MOTIONS if keys.model.drills else MOTIONS_OF_ANY


def example_of(keys: Keys) -> str:
    """A section ``continue`` of these studies, in flow style."""
    if keys.model.drills:
        return "continue: {along: rotary_speed, from: 2 rad/s, to: 8 rad/s}"
    name, low, high = keys.example_axis
    return f"continue: {{along: {name}, from: {low}, to: {high}}}"


def _number(leaf: Leaf | None) -> Form:
    """A value of the number ``leaf``; of one that is not known any value."""
    number = {"anyOf": [{"type": "string", "pattern": QUANTITY}, {"type": "number"}]}
    return Read(lambda raw: raw, number) if leaf is None else One(leaf)


def _words(words: tuple[str, ...]) -> Several:
    return Several(One(Leaf("word", "choice", words[0], choices=words)))


def _nothing(raw: Plain) -> None:
    if raw is not None:
        raise QuantityError(shown(raw), "a mapping, or null")
