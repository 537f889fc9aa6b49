"""The rules that values of a study keep together. A rule is asked where the keys that it
``needs`` are sound, and yields its faults, each at the key that the user wrote; ``check`` is
the :class:`nsdrill.study.checker.Checker` of the study."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field, fields
from functools import cached_property, reduce
from typing import Any

from nsdrill.errors import Fault
from nsdrill.models.operation import ModelParameters
from nsdrill.records import dataclass


@dataclass(frozen=True)
class Rule:
    """What ``faults`` finds wrong in a study."""

    faults: Callable[[Any], Iterator[Fault]]
    needs: tuple[str, ...] = ()


@dataclass(frozen=True)
class Order:
    """A constraint on two keys: the value of ``lower`` is less than that of ``upper``
    times ``factor``, or equal to it where ``equal`` is set. Where a study gives both,
    the fault is at ``blamed``, "lower" or "upper". ``words`` name ``lower`` in a
    message. It is not asked for where ``unless``, a function of the study, is true."""

    lower: str
    upper: str
    equal: bool = False
    blamed: str = "upper"
    factor: float = 1.0
    words: str = ""
    unless: Callable[[Any], bool] | None = None


@dataclass(frozen=True)
class Reads:
    """The ``keys`` of its section that each word of a ``choice`` reads; the others are
    left out of a study with that word, and so are those ``elsewhere`` that a word does not
    read. ``the`` and ``of`` begin what messages say: the drive stiff, what a drive of the
    kind stiff reads."""

    choice: str
    the: str
    of: str
    keys: Mapping[str, tuple[str, ...]]
    elsewhere: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def needs(self) -> tuple[str, ...]:
        return (self.choice,)

    @cached_property
    def section(self) -> str:
        return self.choice.rpartition(".")[0]

    def unread(self, parameters: ModelParameters) -> set[str]:
        """The keys that these parameters do not read."""
        section = reduce(getattr, self.section.split("."), parameters)
        name = self.choice.rpartition(".")[2]
        word = getattr(section, name)
        read = (name, *self.keys[word])
        unread = {f"{self.section}.{item.name}" for item in fields(section) if item.name not in read}
        return unread.union(self.elsewhere.get(word, ()))

    def faults(self, check: Any, also: Iterable[str] = ()) -> Iterator[Fault]:
        """The faults of a study that gives what its word does not read, those keys and
        ``also`` these."""
        word = check.value(self.choice)
        read = {self.choice, *(f"{self.section}.{name}" for name in self.keys[word])}
        also = (*also, *self.elsewhere.get(word, ()))
        allowed = f"what {self.of} {word} reads: {', '.join(self.keys[word]) or 'nothing'}"
        for key in check.leaves:
            if key in also or (key.startswith(f"{self.section}.") and key not in read):
                yield from check.unread(key, f"which {self.the} {word} does not read", allowed)
