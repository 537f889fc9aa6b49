"""Frozen dataclasses that Python makes in half the time.

The decorator of the standard library compiles six functions for each frozen class from their
text; the classes that an answer imports would take a quarter of its start. Here three of
them, ``__repr__``, ``__eq__`` and ``__hash__``, are made without, and do the same.
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
        if not frozen or order:
            return dataclasses.dataclass(cls, frozen=frozen, eq=eq, repr=repr, order=order, **options)

        def made(cls):
            own = vars(cls)
            found = dataclasses.dataclass(frozen=True, eq=False, repr=False, **options)(cls)
            fields = dataclasses.fields(found)
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
