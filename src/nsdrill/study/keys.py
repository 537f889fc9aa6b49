"""Every key of the study file: its default, units, range and source, taken from the dataclasses that the run uses.

Also how one value is read. Nothing here knows YAML, pydantic or line numbers.
"""

from __future__ import annotations

import math
import typing
from collections.abc import Iterator
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass
from typing import Any, Literal

from nsdrill import units as si
from nsdrill.kernel.settings import Simulation
from nsdrill.model.parameters import Bit, Drillstring, Initial, Mud, Operation, Well
from nsdrill.observe.thresholds import Record, Thresholds
from nsdrill.study.meanings import MEANINGS
from nsdrill.units import QuantityError, quoted

SECTIONS: dict[str, type] = {
    "drillstring": Drillstring, "mud": Mud, "well": Well, "bit": Bit, "operation": Operation, "initial": Initial,
    "simulation": Simulation, "classify": Thresholds, "record": Record,
}
"""The sections that are dataclasses, in file order; ``sweep`` is not one."""

_ANYWHERE = {"low": -math.inf, "strict": False}
_LIMITS: dict[str, dict[str, Any]] = {
    "initial.x": {"units": "m", **_ANYWHERE},
    "initial.y": {"units": "m", **_ANYWHERE},
    "initial.vx": {"units": "m/s", **_ANYWHERE},
    "initial.vy": {"units": "m/s", **_ANYWHERE},
    "initial.z": {"units": "m", **_ANYWHERE},
    "initial.vz": {"units": "m/s", **_ANYWHERE},
    "initial.twist": {"units": "rad", **_ANYWHERE},
    "initial.bit_speed": {"units": "rad/s", **_ANYWHERE},
    "initial.drive_angle": {"units": "rad", **_ANYWHERE},
    "initial.ensemble": {"low": 0, "strict": False, "high": 100_000},
    "initial.seed": {"low": 0, "strict": False, "high": 10**15},
    "initial.spread": {"low": 0.0, "strict": True, "high": 1.0},
    "simulation.transient": {"units": "s", "low": 0.0, "strict": False},
    "simulation.observe": {"units": "s", "low": 0.0, "strict": True},
    "simulation.rtol": {"low": 1e-13, "strict": False, "high": 1e-2},
    "simulation.max_steps": {"low": 1000, "strict": False, "high": 10**15},
    "record.peaks": {"low": 0, "strict": False, "high": 1000},
    "record.poincare": {"low": 0, "strict": False, "high": 10_000},
    "classify.motion.longest_period": {"low": 1, "strict": False, "high": 1000},
}
"""Units and ranges of the keys whose dataclasses do not carry them."""

SLICE = "initial.slice"  # its values are ranges of states, as the axes of the sweep are: no leaf


@dataclass(frozen=True)
class Leaf:
    """One key that takes a value. ``kind`` is quantity (with ``units``), number, whole, choice (of ``choices``) or
    switch (true or false).

    The range runs from ``low`` (excluded where ``strict``) to ``high``, in SI.
    """

    key: str
    kind: Literal["quantity", "number", "whole", "choice", "switch"]
    default: Any
    units: str = ""
    choices: tuple[str, ...] = ()
    nullable: bool = False
    low: float = -math.inf
    strict: bool = False
    high: float = math.inf
    source: str = ""
    confidence: str = ""

    @property
    def meaning(self) -> str:
        return MEANINGS[self.key]

    @property
    def default_text(self) -> str:
        """The default as it would stand in the file."""
        return self.text(self.default)

    def text(self, value: Any) -> str:
        """A value of this key as YAML text that :meth:`read` turns into the very same value."""
        if value is None:
            return "null"
        if self.kind == "switch":
            return str(value).lower()
        if self.kind == "quantity":
            return si.exact_text(value, self.units)
        return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)

    def allowed(self) -> str:
        """What may stand here, in words."""
        if self.kind == "choice":
            return _either(self.choices)
        if self.kind == "switch":
            return "true or false"
        what = {"quantity": si.allowed_units(self.units), "number": "a number", "whole": "a whole number"}[self.kind]
        if self.kind == "number" and self.units:
            what = f"a number in {self.units}"
        return f"{what}{', or null' if self.nullable else ''}{self._range()}"

    def read(self, raw: Any) -> Any:
        """The value of YAML scalar ``raw``; :class:`QuantityError` says what is wrong with it."""
        if raw is None and self.nullable:
            return None
        if self.kind == "choice":
            return self._choice(raw)
        if self.kind == "switch":
            if not isinstance(raw, bool):
                raise QuantityError(shown(raw), self.allowed())
            return raw
        value = self._quantity(raw) if self.kind == "quantity" else self._number(raw)
        if value < self.low or (self.strict and value == self.low) or value > self.high:
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

    def _range(self) -> str:
        if self.low == self.high:
            return f", {bound_text(self.low)}"
        low = "" if self.low == -math.inf else f"{'above' if self.strict else 'at least'} {bound_text(self.low)}"
        high = "" if self.high == math.inf else f"at most {bound_text(self.high)}"
        if low and high:
            return f", {low} and {high}"
        return f", {low or high}" if low or high else ""


def leaves(cls: type, prefix: str) -> Iterator[Leaf]:
    """The leaves of a dataclass tree, in the order of the file."""
    hints = typing.get_type_hints(cls)
    for item in fields(cls):
        kind = hints[item.name]
        key = f"{prefix}.{item.name}"
        if key == SLICE:
            continue
        if is_dataclass(kind) and isinstance(kind, type):
            yield from leaves(kind, key)
        else:
            yield leaf(key, item, kind)


def leaf(key: str, item: Field[Any], hint: Any) -> Leaf:
    """One leaf from the dataclass field ``item`` with the type ``hint``."""
    meta = {**_LIMITS.get(key, {}), **item.metadata}
    if key == "well.stiffness":  # of the linear law; the validation knows what the law asks for
        meta["units"] = "N/m"
    assert item.default is not MISSING, f"{key} has no default"
    limits = {name: meta[name] for name in ("units", "low", "strict", "high", "source", "confidence") if name in meta}
    if typing.get_origin(hint) is Literal:
        return Leaf(key, "choice", item.default, choices=typing.get_args(hint), **limits)
    if hint is bool:
        return Leaf(key, "switch", item.default)
    nullable = type(None) in typing.get_args(hint)
    if hint is int:
        return Leaf(key, "whole", item.default, **limits)
    bare = limits.get("units", "") in ("", "percent")
    return Leaf(key, "number" if bare else "quantity", item.default, nullable=nullable, **limits)


def all_leaves() -> dict[str, Leaf]:
    """Every leaf of the dataclass sections, by dotted key."""
    return {found.key: found for section, cls in SECTIONS.items() for found in leaves(cls, section)}


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
    return f"the number {raw:g}{' ' + remark if remark else ''}" if isinstance(raw, float) else (
        f"the number {raw}{' ' + remark if remark else ''}"
    )


def did_you_mean(name: str, candidates: typing.Iterable[str]) -> str | None:
    """"Did you mean ...?" for the nearest candidate, None where nothing is near."""
    import difflib

    near = difflib.get_close_matches(name[:80], list(candidates), n=1)
    return f"Did you mean {near[0]}?" if near else None


def _either(names: tuple[str, ...]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"


def bound_text(value: float) -> str:
    """The end of a range, in words: 100 000 000 rather than 1e+08."""
    return f"{value:,.0f}".replace(",", " ") if abs(value) >= 1e4 else f"{value:g}"
