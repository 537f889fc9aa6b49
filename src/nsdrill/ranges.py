"""The range of every value of a study, defined once, with the field of the dataclass
that holds the value.

Validation, messages, the JSON Schema and the tables of the documentation read it from
the field. A range extends a decade or more beyond the values in practice, as far as all
numbers derived from the values are finite.
"""

from __future__ import annotations

import inspect
import typing
from collections.abc import Callable, Mapping
from dataclasses import field, fields
from functools import lru_cache
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from nsdrill.records import dataclass

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T")
MAX_POINTS = 10**7  # of a study, over all axes, starts and samples: its results take 10 GB


@dataclass(frozen=True)
class Follows:
    """A default that depends on another number or choice: the ``values``, pairs of one of
    the other key and the default there, and ``otherwise``. The other key is named in ``of``,
    by its field in the same dataclass, by its dotted key among the keys of a study. Of a
    choice the words that are not among the ``values`` do not read the number."""

    of: str
    values: tuple[tuple[object, object], ...]
    otherwise: object

    def has(self, value: object) -> bool:
        """Whether this value of the other key has its own default."""
        return any(value == one for one, _ in self.values)

    def at(self, value: object) -> object:
        """The default where the other key has this value."""
        return dict(self.values).get(value, self.otherwise)


def parameter(
    default: object,
    units: str = "",
    source: str = "",
    confidence: str = "",
    *,
    low: float = 0.0,
    high: float,
    usual: str = "",
    meaning: str = "",
    words: tuple[str, ...] = (),
    most: int = 0,
    lane: str = "",
    follows: Follows | None = None,
    with_unit: str = "",
) -> Any:
    """A field with its units, source and confidence, its range from ``low`` to
    ``high``, both inclusive, in SI, and in words what is ``usual`` in practice.
    ``meaning`` describes it if no table of meanings does. One of the ``words`` may be
    given in place of a number. With ``most`` the value is a tuple of up to so many
    numbers. ``lane`` is its name among what the equations of a model read, for one that they
    read as it is. The default of a study that leaves it out ``follows`` another key, at whose
    default it is ``default``. A value of a plain number that has a unit all the same is that
    of the field ``with_unit``."""
    return field(
        default=default,
        metadata={
            "units": units,
            "source": source,
            "confidence": confidence,
            "low": low,
            "high": high,
            "usual": usual,
            **({"meaning": meaning} if meaning else {}),
            **({"words": words} if words else {}),
            **({"most": most} if most else {}),
            **({"lane": lane} if lane else {}),
            **({"follows": follows} if follows else {}),
            **({"with_unit": with_unit} if with_unit else {}),
        },
    )


def records(
    kind: type,
    default: tuple[object, ...] | None,
    source: str,
    confidence: str,
    *,
    most: int,
    meaning: str,
    required: tuple[str, ...] = (),
) -> Any:
    """A field that is a list of one to ``most`` records of the dataclass ``kind``, a
    tuple, or None where that is the ``default``. Every record has the ``required`` keys."""
    meta = {"units": "", "source": source, "confidence": confidence, "meaning": meaning, "most": most, "record": kind}
    meta |= {"required": required} if required else {}
    return field(default=default, metadata=meta)


def choice(default: str, source: str) -> Any:
    """A field that takes one of the words of its type."""
    return field(default=default, metadata={"units": "", "source": source, "confidence": "modelling choice"})


def option(default: object, meaning: str) -> Any:
    """A field that is a switch, or one of the words of its type."""
    return field(default=default, metadata={"meaning": meaning})


def computed(units: str, meaning: str = "") -> Any:
    """A field with a number that is computed, without a range; ``meaning`` is what
    ``check`` prints of it."""
    return field(metadata={"units": units, "meaning": meaning})


def meanings_of(cls: type[DataclassInstance]) -> dict[str, tuple[str, str]]:
    """Units and meaning of the :func:`computed` fields of a dataclass that have one."""
    about = {item.name: (item.metadata["units"], item.metadata["meaning"]) for item in fields(cls)}
    return {name: (units, meaning) for name, (units, meaning) in about.items() if meaning}


def section(kind: type, meaning: str) -> Any:
    """A field with a dataclass of its own."""
    return field(default_factory=kind, metadata={"meaning": meaning})


def given(default: object, source: str, confidence: str, **others: str) -> dict[str, object]:
    """Another default of a number, with its source and confidence; ``others`` are its
    units, its meaning or what is usual, where these differ too."""
    return {"default": default, "source": source, "confidence": confidence, **others}


def like(section: type[DataclassInstance], name: str, **others: object) -> Any:
    """A field with unit and range of that of another ``section``, and with its default
    unless the ``others`` (:func:`given`) have one. ValueError where it has none of this
    ``name``."""
    originals = {item.name: item for item in fields(section)}
    if name not in originals:
        raise ValueError(
            f"like: found {name!r}, which is no field of {section.__name__}; allowed: {', '.join(originals)}"
        )
    original = originals[name]
    metadata = {**original.metadata, **others}
    return field(default=metadata.pop("default", original.default), metadata=metadata)


def defaults(**numbers: dict[str, object]) -> Callable[[type[T]], type[T]]:
    """A decorator below that of a dataclass, which has the fields of its base with
    other defaults (:func:`given`) of some."""

    def changed(cls: type[T]) -> type[T]:
        base: Any = cls.__base__
        types = {item.name: item.type for item in fields(base)}
        for name, other in numbers.items():
            setattr(cls, name, like(base, name, **other))
            cls.__annotations__ = {**inspect.get_annotations(cls), name: types[name]}
        return cls

    return changed


class Checked:
    """A dataclass that raises ValueError for values outside their ranges."""

    def __post_init__(self) -> None:
        check_fields(self)


def check_fields(record: Any) -> None:
    """ValueError if a field of the dataclass ``record`` has a value of another type or
    outside its range."""
    hints = _hints(record.__class__)
    for item in fields(record):
        value, hint = getattr(record, item.name), hints[item.name]
        if value is None and type(None) in typing.get_args(hint):
            continue
        if typing.get_origin(hint) is Literal:
            if value not in typing.get_args(hint):
                raise ValueError(f"{item.name}: found {value!r:.60}, allowed: {', '.join(typing.get_args(hint))}")
        elif hint is bool:
            if not isinstance(value, bool):
                raise ValueError(f"{item.name}: found {value!r:.60}, allowed: true or false")
        elif "record" in item.metadata:
            _check_length(item.name, value, item.metadata["most"])
            for element in value:
                check_fields(element)
        elif "most" in item.metadata:
            _check_length(item.name, value, item.metadata["most"])
            for element in value:
                _check_number(item.name, element, Real, item.metadata)
        elif value in item.metadata.get("words", ()):
            continue
        elif "low" in item.metadata:
            meta = item.metadata
            # the common case at once: a study has hundreds of numbers
            if hint is int or type(value) is not float or not meta["low"] <= value <= meta["high"]:
                _check_number(item.name, value, Integral if hint is int else Real, meta)


def _check_length(name: str, value: object, most: int) -> None:
    if not isinstance(value, tuple) or not 1 <= len(value) <= most:
        raise ValueError(f"{name}: found {value!r:.60}, allowed: one to {most} of them")


def _check_number(name: str, value: Any, kind: type, meta: Mapping[str, Any]) -> None:
    low, high = meta["low"], meta["high"]
    # false for NaN
    if isinstance(value, bool) or not isinstance(value, kind) or not low <= value <= high:
        found = f"{value:g}" if isinstance(value, float) else f"{value!r:.60}"
        what = "a whole number, " if kind is Integral else ""
        raise ValueError(f"{name}: found {found}, allowed: {what}{range_text(low, high)} {meta['units']}".rstrip())


def range_text(low: float, high: float, text: Callable[[float], str] | None = None) -> str:
    """A range in words; ``text`` formats a bound."""
    text = text or bound_text
    return text(low) if low == high else f"at least {text(low)} and at most {text(high)}"


def bound_text(value: float) -> str:
    """The text of a bound: 100 000 000 rather than 1e+08."""
    return f"{value:,.0f}".replace(",", " ") if abs(value) >= 1e4 else f"{value:g}"


@lru_cache
def _hints(cls: type) -> dict[str, object]:
    return typing.get_type_hints(cls)
