"""The dimensions of what a model's function computes, where its numbers have units: what
is added, compared or chosen must have one, a slope that of its state over time, and an
angle, as of a sine, none. A number without a unit, in the signature or in the text, may
have any."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from itertools import pairwise

from nsdrill.equations.graph import Node
from nsdrill.equations.library import direction, expm1, sincos, tanh
from nsdrill.script.signature import Signature
from nsdrill.units import dimensions_of, plain_units

Dimensions = dict[str, Fraction]
SYMBOLS = {"[mass]": "kg", "[length]": "m", "[time]": "s", "[current]": "A"}
SECOND: Dimensions = {"[time]": Fraction(1)}
PURE = (sincos, direction, expm1, tanh)  # functions of numbers without a unit
ALIKE = {"add": "sum", "sub": "difference", "max": "maximum", "min": "minimum"}
COMPARED = ("lt", "le", "gt", "ge", "eq")


def check_dimensions(read: Signature, slopes: Mapping[str, Node]) -> None:
    """InputError where dimensions do not go together."""
    given = {f"s.{name}": _of(value.units) for name, value in read.start.items()}
    given |= {f"p.{name}": _of(value.units) for name, value in read.parameters.items()}
    if not any(given.values()):
        return
    given["time"] = SECOND
    found: dict[Node, Dimensions | None] = {}
    nodes = next(iter(slopes.values())).graph.live(slopes.values())
    for node in nodes:
        found[node] = _made(read, node, found, given)
    for name, slope in slopes.items():
        wanted, have = given[f"s.{name}"], found.get(slope)
        if wanted is None or have is None:
            continue
        if have != (rate := _product(wanted, SECOND, -1)):
            read.refuse(
                f"the slope of {name} in {_text(have)}, of {_names(slope)}",
                f"{_text(rate)}, as {name} is in {_text(wanted)}",
            )


def _of(units: str) -> Dimensions | None:
    """The dimensions of a number with these units, None where it may have any; a radian is
    none."""
    if not units:
        return None
    return {name: power for name, power in dimensions_of(plain_units(units)).items() if name != "[angle]"}


def _product(one: Dimensions, other: Dimensions, sign: int) -> Dimensions:
    powers = {name: one.get(name, Fraction(0)) + sign * other.get(name, Fraction(0)) for name in {**one, **other}}
    return {name: power for name, power in powers.items() if power}


def _made(
    read: Signature, node: Node, found: Mapping[Node, Dimensions | None], given: Mapping[str, Dimensions | None]
) -> Dimensions | None:
    args = [found.get(arg) for arg in node.args]
    if node.op == "input":
        return given.get(str(node.extra))
    if node.op in ("neg", "abs", "fixed"):
        return args[0]
    if node.op in ("mul", "div"):
        one, other = args
        return None if one is None or other is None else _product(one, other, 1 if node.op == "mul" else -1)
    if node.op == "sqrt":
        return None if args[0] is None else {name: power / 2 for name, power in args[0].items()}
    if node.op in ALIKE:
        return _alike(read, f"the {ALIKE[node.op]}", node.args, found)
    if node.op in ("select", "join") and len(args) == 3:
        return _alike(read, "a choice", node.args[1:], found)
    if node.op in COMPARED:
        _alike(read, "a comparison", node.args, found)
    if node.op == "result" and any(node.extra[0] is one for one in PURE):
        if args[0]:
            read.refuse(
                f"{node.extra[0].name} of {_text(args[0])}, of {_names(node.args[0])}",
                "an angle, or a number without a unit",
            )
        return {}
    return None


def _alike(
    read: Signature, what: str, values: tuple[Node, ...], found: Mapping[Node, Dimensions | None]
) -> Dimensions | None:
    """The dimensions of values that must be alike."""
    known = [(one, have) for one in values if (have := found.get(one)) is not None]
    for (one, have), (other, wanted) in pairwise(known):
        if have != wanted:
            told = f"{_text(have)}, of {_names(one)}, and {_text(wanted)}, of {_names(other)}"
            read.refuse(f"{what} of {told}", "one unit on both sides; a number without a unit may have any")
    return known[0][1] if known else None


def _text(dimensions: Dimensions) -> str:
    """``kg m s^-2``."""
    parts = [(symbol, dimensions[name]) for name, symbol in SYMBOLS.items() if name in dimensions]
    return " ".join(f"{symbol}^{power}" if power != 1 else symbol for symbol, power in parts) or "no unit"


def _names(value: Node) -> str:
    """The states and numbers that a value is of."""
    inputs = [str(node.extra).rpartition(".")[2] for node in value.graph.live([value]) if node.op == "input"]
    return " and ".join(dict.fromkeys(inputs)) or "a number"
