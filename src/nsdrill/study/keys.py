"""Every key of the study file: its default, units, range and source, taken from the dataclasses that the run uses.

Also how one value is read. Nothing here knows YAML, pydantic or line numbers.
"""

from __future__ import annotations

import math
import re
import typing
from collections.abc import Iterator
from dataclasses import MISSING, Field, dataclass, fields, is_dataclass, replace
from functools import lru_cache
from typing import Any, Literal

from nsdrill import units as si
from nsdrill.kernel.settings import Simulation
from nsdrill.models.christoforou_yigit.parameters import Bit, Drillstring, Drive, Initial, Modes, Mud, Stabilizer, Well
from nsdrill.models.operation import Operation
from nsdrill.models.registry import DEFAULT, NAMES
from nsdrill.observe.thresholds import Record, Thresholds
from nsdrill.ranges import bound_text, range_text
from nsdrill.study.meanings import MEANINGS
from nsdrill.units import USUAL, QuantityError, quoted

SECTIONS: dict[str, type] = {
    "drillstring": Drillstring,
    "mud": Mud,
    "well": Well,
    "stabilizer": Stabilizer,
    "bit": Bit,
    "modes": Modes,
    "drive": Drive,
    "operation": Operation,
    "initial": Initial,
    "simulation": Simulation,
    "classify": Thresholds,
    "record": Record,
}
"""The sections that are dataclasses, in file order; ``sweep`` is not one."""

STIFFNESS = {"linear": "N/m", "hertz": "N/m^1.5"}
"""Units of the wall's stiffness by its contact law."""

MANY = 12  # choices that no message lists

PHYSICAL = ("drillstring", "mud", "well", "stabilizer", "bit", "drive", "operation", "initial")
"""The sections whose numbers a sweep may vary."""

SLICE = "initial.slice"  # its values are ranges of states, as the axes of the sweep are: no leaf


@dataclass(frozen=True)
class Leaf:
    """One key that takes a value. ``kind`` is quantity (with ``units``), number, whole, choice (of ``choices``) or
    switch (true or false).

    The range runs from ``low`` to ``high``, in SI; ``usual`` says what is met in the field.
    """

    key: str
    kind: Literal["quantity", "number", "whole", "choice", "switch"]
    default: Any
    units: str = ""
    choices: tuple[str, ...] = ()
    nullable: bool = False
    low: float = -math.inf
    high: float = math.inf
    source: str = ""
    confidence: str = ""
    usual: str = ""

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
            return (
                _either(self.choices)
                if len(self.choices) < MANY
                else (f"{', '.join(self.choices[:3])} or another of {len(self.choices)} keys")
            )
        if self.kind == "switch":
            return "true or false"
        what = {"quantity": si.allowed_units(self.units), "number": "a number", "whole": "a whole number"}[self.kind]
        if self.kind == "number" and self.units:
            what = f"a number in {self.units}"
        return f"{what}{', or null' if self.nullable else ''}, {self.range()}"

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
        """The end of a range, of a quantity in that of its usual units in which it is the shortest to write."""
        if self.kind != "quantity" or value == 0.0:
            return bound_text(value)
        numbers = {unit: bound_text(si.from_si(value, unit)) for unit in USUAL[self.units]}
        exact = [
            f"{number} {unit}"
            for unit, number in numbers.items()
            if si.to_si(f"{number.replace(' ', '')} {unit}", self.units) == value
        ]
        return min(exact, key=lambda text: (len(re.sub(r"[^1-9]", "", text)), len(text)))


MODEL = Leaf("model", "choice", DEFAULT, choices=NAMES)


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
    meta = dict(item.metadata)
    if key == "well.stiffness":  # of the linear law; the validation knows what the law asks for
        meta["units"] = "N/m"
    assert item.default is not MISSING, f"{key} has no default"
    if typing.get_origin(hint) is Literal:
        return Leaf(key, "choice", item.default, choices=typing.get_args(hint), **meta)
    if hint is bool:
        return Leaf(key, "switch", item.default)
    nullable = type(None) in typing.get_args(hint)
    if hint is int:
        return Leaf(key, "whole", item.default, **meta)
    bare = meta.get("units", "") in ("", "percent")
    return Leaf(key, "number" if bare else "quantity", item.default, nullable=nullable, **meta)


def axis_leaves() -> dict[str, Leaf]:
    """The numbers that a sweep may vary, by the names that they have there: those of the operation by short ones, the
    others by their dotted keys."""
    found = {
        key.removeprefix("operation."): leaf
        for key, leaf in all_leaves().items()
        if leaf.kind in ("quantity", "number") and key.partition(".")[0] in PHYSICAL
    }
    return {
        name: replace(leaf, nullable=False)
        for name, leaf in sorted(found.items(), key=lambda item: "." in item[0])
        if name not in ("initial.spread",)
    }


@lru_cache(maxsize=1)
def all_leaves() -> dict[str, Leaf]:
    """Every leaf of the study, by dotted key: the model, then those of the dataclass sections."""
    return {"model": MODEL, **{found.key: found for section, cls in SECTIONS.items() for found in leaves(cls, section)}}


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
