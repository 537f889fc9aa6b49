"""Frozen dataclasses that Python makes in a fifth of the time.

The decorator of the standard library compiles six functions for each frozen class from their
text; the classes that an answer imports would take a quarter of its start. Here one of them,
``__init__``, is compiled; the others do the same without.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, eq=True, repr=True, order=False, **options):
        """As that of the module ``dataclasses``."""
        if not frozen or order or not options.keys() <= {"kw_only"}:
            return dataclasses.dataclass(cls, frozen=frozen, eq=eq, repr=repr, order=order, **options)

        def made(cls):
            own = vars(cls)
            found = _with_fields(cls, options)
            fields = dataclasses.fields(found)
            if "__init__" not in own:
                found.__init__ = _init_of(found)
            found.__setattr__, found.__delattr__ = _frozen(found, frozenset(one.name for one in fields))
            if repr and "__repr__" not in own:
                found.__repr__ = _repr_of([one.name for one in fields if one.repr])
            if eq:
                compared = _values_of([one.name for one in fields if one.compare])
                hashed = [one.name for one in fields if (one.compare if one.hash is None else one.hash)]
                if "__eq__" not in own:
                    found.__eq__ = _eq_of(compared)
                if own.get("__hash__") is None:  # Python sets it to None beside an __eq__
                    found.__hash__ = _hash_of(_values_of(hashed))
            return found

        return made if cls is None else made(cls)


def _with_fields(cls: Any, options: dict[str, Any]) -> Any:
    """The class with its fields, which says of itself that it is frozen. The standard library
    would compile for that, so it is to see neither this class nor those above it as frozen."""
    above = [vars(one)["__dataclass_params__"] for one in cls.__mro__[1:] if "__dataclass_params__" in vars(one)]
    if any(not one.frozen for one in above):
        raise TypeError("cannot inherit frozen dataclass from a non-frozen one")
    try:
        for one in above:
            one.frozen = False
        found = dataclasses.dataclass(init=False, eq=False, repr=False, **options)(cls)
    finally:
        for one in above:
            one.frozen = True
    found.__dataclass_params__.frozen = True
    return found


def _init_of(cls: Any) -> Callable[..., None]:
    """The function that sets the fields of the class, compiled from its text: the arguments
    stand in it by name."""
    known: dict[str, Any] = {"__name__": cls.__module__, "_set": object.__setattr__, "_missing": dataclasses.MISSING}
    fields = dataclasses.fields(cls)
    places, by_name, lines = list[str](), list[str](), list[str]()
    for one in fields:
        name, value = one.name, one.name
        if not one.init:
            if one.default_factory is not dataclasses.MISSING:
                known[f"_make_{name}"] = one.default_factory
                lines.append(f" _set(self, {name!r}, _make_{name}())")
            continue
        if one.default is not dataclasses.MISSING:
            known[f"_default_{name}"] = one.default
            given = f"{name}=_default_{name}"
        elif one.default_factory is not dataclasses.MISSING:
            known[f"_make_{name}"] = one.default_factory
            given = f"{name}=_missing"
            value = f"_make_{name}() if {name} is _missing else {name}"
        else:
            given = name
        (by_name if one.kw_only else places).append(given)
        lines.append(f" _set(self, {name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        lines.append(" self.__post_init__()")
    listed = ", ".join(["self", *places, *(["*", *by_name] if by_name else [])])
    exec(f"def __init__({listed}):\n" + ("\n".join(lines) or " pass"), known)
    init: Callable[..., None] = known["__init__"]
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    init.__annotations__ = {one.name: one.type for one in fields if one.init} | {"return": None}
    return init


def _frozen(cls: Any, fields: frozenset[str]) -> tuple[Callable[[Any, str, Any], None], Callable[[Any, str], None]]:
    """What refuses to set and to delete the fields. A class below it that is no dataclass may
    have further attributes."""

    def __setattr__(self: Any, name: str, value: Any) -> None:
        if type(self) is cls or name in fields:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def __delattr__(self: Any, name: str) -> None:
        if type(self) is cls or name in fields:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return __setattr__, __delattr__


def _values_of(names: list[str]) -> Callable[[Any], tuple[Any, ...]]:
    """What gives the values of these attributes."""
    if len(names) > 1:
        return attrgetter(*names)
    return lambda one: tuple(getattr(one, name) for name in names)


def _repr_of(names: list[str]) -> Callable[[Any], str]:
    @recursive_repr()
    def __repr__(self: Any) -> str:
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names)})"

    return __repr__


def _eq_of(values: Callable[[Any], tuple[Any, ...]]) -> Callable[[Any, object], Any]:
    def __eq__(self: Any, other: object) -> Any:
        return values(self) == values(other) if other.__class__ is self.__class__ else NotImplemented

    return __eq__


def _hash_of(values: Callable[[Any], tuple[Any, ...]]) -> Callable[[Any], int]:
    def __hash__(self: Any) -> int:
        return hash(values(self))

    return __hash__
