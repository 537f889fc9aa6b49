"""Studies that nobody would write: each is checked, as text and as JSON, or refused in
words.

Mutated are the studies in configs/ and the template, mostly with a drive that droops or
stalls, limits of a stalled bit, sweeps of any size and procedure, and uncertain numbers:
keys deleted, doubled, misspelt or moved; values of other units, types and sizes, up to
the ends of their ranges; broken YAML; odd characters; and the same by ``--set``.
"""

import collections
import os
import random
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill.models.parts import values_at
from nsdrill.models.registry import NAMES, model_named
from nsdrill.models.variant import variant_at
from nsdrill.sampling import MAX_SAMPLES
from nsdrill.study import load_study, template_text
from nsdrill.study.forms import MAX_POINTS
from nsdrill.study.keys import Keys, keys_named
from nsdrill.study.read import parse
from nsdrill.unit_table import USUAL
from nsdrill.variables import AXES, MODEL, long_key, short_key

from .common import Broken, arguments, check_json, command, time_limit

ROOT = Path(__file__).parents[2]
SECONDS = 60.0  # of one study; the machine may be busy
NUMBERS = (
    "0",
    "-0.0",
    "1",
    "-1",
    "1e308",
    "-1e308",
    "1e309",
    "5e-324",
    "1e-300",
    ".nan",
    ".inf",
    "-.inf",
    "1e16",
    "3",
    "0x1F",
    "0o17",
    "1_000",
    "1,5",
    "٣",
    "1e",
    "99999999999999999999999",
    "1e-17",
)
TEXTS = (
    '"a\\0b"',
    '"a\\ud800b"',
    '"\\udfff"',
    '"\\x1b[31m"',
    "'日本語'",
    '"\\u202e"',
    "'é'",
    '"\\n\\t"',
    '"\\uffff"',
    "|\n  a\n  b\n",
    "''",
    "'$\\frac{'",
    "!!python/object:os.system x",
    "&a 1",
    "*a",
    "<<",
    "null",
    "~",
    "no",
    "Yes",
    "[]",
    "{}",
    "[[]]",
    "{a: 1}",
    "[1, 2",
    "}",
    "'",
    '"',
    "? x",
    "- -",
    "%TAG",
    "@",
    "`",
    "\t",
    "\x00",
    "\x85",
    "\u2028",
    "#",
    ": :",
    "x" * 300,
    "'\U0001f600'",
    '"\\U0001F600"',
    '"\\ud83d\\ude00"',
)


@lru_cache(maxsize=1)
def bases() -> list[dict[str, Any]]:
    """The studies to begin with, as plain data."""
    texts = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "configs").glob("*.yaml"))]
    return [parse(text, "base").data for text in (*texts, template_text())]


LEAVES = {key: leaf for model in NAMES for key, leaf in keys_named(model).leaves.items()}
UNITS = [unit for units in USUAL.values() for unit in units]


def example(seed: int, number: int) -> tuple[str, list[str]]:
    """The text and the overrides of one example."""
    chance = random.Random(f"{seed} {number}")
    data = _copy(chance.choice(bases()))
    if len(data) > 4:  # the template: some of its sections only, which is faster and reaches as far
        data = {name: data[name] for name in data if name == "sweep" or chance.random() < 0.4}
    if chance.random() < 0.4:
        _to_the_ends(data, chance)
    else:
        for add in chance.sample((_drive, _limits, _sweep, _uncertain), chance.choice((0, 1, 1, 1, 2))):
            add(data, chance)
    for _ in range(chance.choice((0, 0, 0, 0, 0, 0, 1, 1, 2, 3, 6))):
        _mutate(data, chance)
    text = _block(data, chance)
    for _ in range(chance.choice((0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 3))):
        text = _scratch(text, chance)
    overrides = []
    while chance.random() < 0.2:
        others = ("sweep.depth", "sweep.wob.from", "title", "initial.slice.x")
        key = chance.choice((*chance.sample(list(LEAVES), 3), *others))
        overrides.append(f"{key}={_value(chance, key)}")
    return text, overrides


def _copy(data: Any) -> Any:
    if isinstance(data, dict):
        return {name: _copy(value) for name, value in data.items()}
    return [_copy(value) for value in data] if isinstance(data, list) else data


def _to_the_ends(data: dict[str, Any], chance: random.Random) -> None:
    """Many keys within their ranges, and mostly at the ends of them; mostly such as go
    together."""
    keys = list(_keys_of(data).leaves)
    if chance.random() < 0.8:
        keys = [key for key in keys if not key.startswith(TIED)]
        if chance.random() < 0.5:
            _geometry(data, chance)
    for key in chance.sample(keys, chance.randrange(1, 25)):
        _put(data, key, _within(chance, key))


def _keys_of(data: dict[str, Any]) -> Keys:
    """The keys of the model of the study."""
    name = data.get("model", MODEL)
    return keys_named(name if name in NAMES else MODEL)


def _drive(data: dict[str, Any], chance: random.Random) -> None:
    """A drive of any kind that may droop, or be too weak to turn the bit."""
    data["drive"] = {"kind": chance.choice(LEAVES["drive.kind"].choices)}
    own = [key for key in LEAVES if key.startswith("drive.") and key != "drive.kind"]
    for key in chance.sample(own, chance.choice((0, 0, 1, 2))):
        _put(data, key, _near(chance, key))
    if data["drive"]["kind"] != "ideal" and chance.random() < 0.5:
        _put(data, "drive.torque_limit", f"{10 ** chance.uniform(-1.0, 5.0)!r} N*m")
    if chance.random() < 0.5:
        _put(data, "operation.rotary_speed", f"{10 ** chance.uniform(-3.0, 2.0)!r} rad/s")
        _put(data, "operation.wob", f"{chance.choice((0.0, 10 ** chance.uniform(2.0, 6.0)))!r} N")


def _near(chance: random.Random, key: str) -> Any:
    """A value of the size of the default, within some powers of ten, mostly."""
    leaf = LEAVES[key]
    if not isinstance(leaf.default, float) or leaf.default == 0.0 or chance.random() < 0.2:
        return _within(chance, key)
    value = leaf.default * 10 ** chance.choice((0.0, chance.uniform(-0.3, 0.3), chance.uniform(-4.0, 4.0)))
    return f"{value!r} {leaf.units.replace(' ', '*')}" if leaf.kind == "quantity" else value


def _limits(data: dict[str, Any], chance: random.Random) -> None:
    """Thresholds, those of a stalled bit among them."""
    _put(data, "classify.stalled.stuck_fraction", chance.choice((0, 1, 0.5, 0.99, 1e-300, 1.01)))
    for key in chance.sample([key for key in LEAVES if key.startswith("classify.")], chance.randrange(3)):
        _put(data, key, _near(chance, key))


def _sweep(data: dict[str, Any], chance: random.Random) -> None:
    """Axes of any size, up to more points than a study may have, and how they are
    followed."""
    keys = list(_keys_of(data).axes if chance.random() < 0.9 else LEAVES)
    chosen = chance.sample(keys, chance.choice((0, 0, 1, 2))) + chance.sample(AXES, chance.choice((1, 1, 2, 3)))
    axes = list(dict.fromkeys(short_key(key) for key in chosen))
    data["sweep"] = sweep = {name: _axis(chance, long_key(name)) for name in axes}
    if chance.random() < 0.7:
        sweep["procedure"] = chance.choice(("up", "down", "up-down", *(("all",) if chance.random() < 0.1 else ())))
        sweep["along"] = chance.choice(axes)
    if chance.random() < 0.1:
        sweep["refine"] = chance.choice((0, 1, 2, 6, 7))


def _axis(chance: random.Random, key: str) -> Any:
    """The values of an axis: a list, a range, or a list of ranges."""
    leaf = LEAVES[key]
    if leaf.kind == "choice":
        return [*leaf.choices]
    if leaf.kind not in ("quantity", "number", "whole") or chance.random() < 0.2:
        return [_near(chance, key) for _ in range(chance.choice((1, 2, 5)))]
    units = f" {leaf.units.replace(' ', '*')}" if leaf.kind == "quantity" else ""
    middle = leaf.default if isinstance(leaf.default, float) and leaf.default > 0.0 else min(leaf.high, 1e3)
    ends = sorted(chance.choice((middle, chance.uniform(0.3, 3.0) * middle, leaf.low, leaf.high)) for _ in range(2))
    if leaf.kind == "whole":
        ends = [int(min(end, 10**9)) for end in ends]
    size = chance.choice((2, 2, 3, 3, 5, 50, 1000, MAX_POINTS, MAX_POINTS + 1, 10**12, 10**400))
    one = {"from": f"{ends[0]!r}{units}", "to": f"{ends[1]!r}{units}", "points": size}
    if chance.random() < 0.2:
        one["spacing"] = "log"
    return [one, {**one, "points": 2}] if chance.random() < 0.1 else one


def _uncertain(data: dict[str, Any], chance: random.Random) -> None:
    """Distributions of numbers, and many samples."""
    axes = _keys_of(data).axes
    numbers = [key for key in axes if axes[key].kind in ("quantity", "number")]
    found: dict[str, Any] = {}
    for key in chance.sample(numbers, chance.choice((1, 2, 4))):
        values = [_near(chance, long_key(key)) for _ in range(3)]
        found[key] = chance.choice(
            (
                {"uniform": values[:2]},
                {"triangular": values},
                {"normal": {"mean": values[0], "deviation": values[1]}},
                {"lognormal": {"median": values[0], "factor": chance.choice((1, 1.5, 2, 1e9))}},
            )
        )
    found["samples"] = chance.choice((1, 2, 3, 64, MAX_SAMPLES, MAX_SAMPLES + 1))
    if chance.random() < 0.2:
        found["design"] = "saltelli"
    data["uncertain"] = found


TIED = (
    "drillstring.collar",
    "drillstring.pipe",
    "well.diameter",
    "operation.depth",
    "classify",
    "initial",
    "record",
    "well.friction.static",
    "well.friction.dynamic",
    "bit.friction.static",
    "bit.friction.dynamic",
    "well.stiffness",
)


def _geometry(data: dict[str, Any], chance: random.Random) -> None:
    """Lengths and diameters of any size in the order that they must have."""

    def ascending(*least: float, most: float, gap: float) -> list[str]:
        values = [low * (most / low) ** chance.choice((0.0, chance.random(), 1.0)) for low in least]
        for i in reversed(range(len(values) - 1)):
            values[i] = min(values[i], values[i + 1] * chance.choice((gap, 0.5)))
        return [f"{value!r} m" for value in values]

    bore, outer, hole = ascending(1e-4, 1e-3, 2e-3, most=10.0, gap=0.998)
    span, length = ascending(1e-2, 1e-2, most=1e3, gap=1.0)
    _put(data, "drillstring.collar", {"inner_diameter": bore, "outer_diameter": outer, "span": span, "length": length})
    inner, pipe = ascending(1e-4, 1e-3, most=10.0, gap=0.998)
    _put(data, "drillstring.pipe", {"inner_diameter": inner, "outer_diameter": pipe})
    _put(data, "well.diameter", hole)
    _put(data, "initial", {"x": "0 m"})
    _put(data, "operation.depth", chance.choice((f"{float(length.split()[0]) * (1 + 1e-15)!r} m", "100000 m")))
    data["sweep"] = {"wob": chance.choice(("0 N", "10000 kN", ["0 N", "10000 kN"]))}


def _put(data: dict[str, Any], key: str, value: Any) -> None:
    *sections, name = key.split(".")
    inside = data
    for section in sections:
        if not isinstance(inside.get(section), dict):
            inside[section] = {}
        inside = inside[section]
    inside[name] = value


def _within(chance: random.Random, key: str) -> Any:
    leaf = LEAVES[key]
    if leaf.kind == "choice":
        return chance.choice(leaf.choices)
    if leaf.kind == "switch":
        return chance.random() < 0.5
    value = chance.choice((leaf.low, leaf.high, 1e-3 * leaf.high, chance.uniform(leaf.low, leaf.high)))
    if leaf.kind == "whole":
        return int(min(value, 100_000))
    return f"{value!r} {leaf.units.replace(' ', '*')}" if leaf.kind == "quantity" else value


def _value(chance: random.Random, key: str = "") -> Any:
    kind = chance.random()
    if key in LEAVES and kind < 0.5:
        return _within(chance, key)
    if kind < 0.65:
        return f"{chance.choice(NUMBERS)} {chance.choice(UNITS)}"
    return chance.choice(NUMBERS if kind < 0.8 else TEXTS)


class Raw(str):
    """Text that goes into the YAML as it is."""


def _mutate(data: Any, chance: random.Random) -> None:
    """One change somewhere in the tree."""
    places = list(_places(data))
    if not places:
        return
    inside, name, key = chance.choice(places)
    kind = chance.randrange(7)
    if kind == 0:
        del inside[name]
    elif kind == 1:
        inside[name] = Raw(_value(chance, key))
    elif kind == 2:
        there, other, _ = chance.choice(places)
        inside[name] = _copy(there[other])
    elif kind == 3 and isinstance(inside, dict):
        word = str(name)
        odd = chance.choice((word[:-1], word + "s", word.upper(), *chance.sample(list(LEAVES), 2), "", '"\\ud800"'))
        inside[Raw(odd)] = inside.pop(name)
    elif kind == 4 and isinstance(inside, dict):
        inside[Raw(f"{name} ")] = Raw(_value(chance, key))  # the same key again
    elif kind == 5:
        inside[name] = chance.choice(([], {}, [inside[name]] * 3, {name: inside[name]}, None, True, 5, 1.5))
    elif key in LEAVES:
        inside[name] = _within(chance, key)


def _places(data: Any, prefix: str = "") -> Any:
    if isinstance(data, dict | list):
        for name in data if isinstance(data, dict) else range(len(data)):
            key = f"{prefix}{name}"
            yield data, name, key
            yield from _places(data[name], f"{key}.")


def _block(data: Any, chance: random.Random) -> str:
    """The tree as YAML: the sections as a block, what is in them mostly in braces."""
    return "".join(f"{name}: {_flow(value, chance)}\n" for name, value in data.items())


def _flow(value: Any, chance: random.Random) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name}: {_flow(item, chance)}" for name, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(_flow(item, chance) for item in value) + "]"
    if isinstance(value, Raw):
        return str(value)
    if value is None:
        return "null"
    if isinstance(value, str) and chance.random() < 0.3:
        return "'" + value.replace("'", "''") + "'"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _scratch(text: str, chance: random.Random) -> str:
    """A few characters taken out, put in or moved."""
    start = chance.randrange(len(text) + 1)
    end = min(len(text), start + chance.choice((0, 0, 1, 2, 10)))
    put = chance.choice(("", "\n", " ", "  ", ":", "{", "]", "\t", "-", chance.choice(TEXTS), chance.choice(NUMBERS)))
    return text[:start] + put + text[end:]


def attempt(folder: Path, seed: int, number: int) -> bool:
    """Broken unless the example is checked or refused in words; True where it was
    valid."""
    text, overrides = example(seed, number)
    name = (b"s.yaml", b"\xff\xfe.yaml", "é.yaml".encode(), b"a\nb.yaml")[number % 4 if number % 16 < 4 else 0]
    path = folder / os.fsdecode(name)
    raw = text.encode("utf-8", "surrogatepass")
    path.write_bytes(raw if number % 50 else raw + b"\xff")
    words = [word for override in overrides for word in ("--set", override)]
    with time_limit(SECONDS):
        out = command("check", path, "--json", *words)
        if out is None:
            return False
        check_json(out)
        command("check", path, *words)
        study = load_study(path, overrides)
        if study.initial.starts > 1000:
            return True
        model = model_named(study.model.name)
        for end in (0, -1):
            at = values_at(study.parameters, study.initial, {key: axis[[end]] for key, axis in study.axes.items()})
            runs = variant_at(model, at.parameters).runs(model.pack(at, study.thresholds), model.starts(at, 0))
            for what, values in vars(runs).items():
                if values is not None and not np.all(np.isfinite(values)):
                    raise Broken(f"the {what} of the lanes are not finite")
    return True


def run(examples: int, seed: int, first: int = 0, keep_going: bool = False) -> dict[str, int]:
    """How many of the examples were valid and refused; Broken at the first one that is
    neither, or all of them counted by their kind."""
    found: dict[str, int] = collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        for number in range(first, first + examples):
            try:
                found["valid" if attempt(Path(folder), seed, number) else "refused"] += 1
            except Broken as error:
                text, overrides = example(seed, number)
                said = f"example {number}: {error}\n--set {overrides}\n{text}"
                if not keep_going:
                    raise Broken(said) from error
                kind = ascii(str(error).split("'")[0])[:150]
                if not found[kind]:
                    print(ascii(said), file=sys.stderr)
                found[kind] += 1
            if (number + 1) % 1000 == 0:
                print(f"{number + 1} examples: {dict(found)}", file=sys.stderr)
    return dict(found)


if __name__ == "__main__":
    given = arguments(__doc__)
    print(run(given.examples, given.seed, given.first, given.keep_going))
