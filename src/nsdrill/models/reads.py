"""Which keys of a study a choice reads: the law of a friction, the kind of a drive."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from functools import reduce
from typing import Any

from nsdrill.errors import Fault


@dataclass(frozen=True)
class Reads:
    """The ``keys`` of its section that each word of a ``choice`` reads; the others are
    left out of a study with that word. ``the`` and ``of`` begin what messages say: the
    drive stiff, what a drive of the kind stiff reads."""

    choice: str
    the: str
    of: str
    keys: Mapping[str, tuple[str, ...]]

    @property
    def section(self) -> str:
        return self.choice.rpartition(".")[0]

    def unread(self, parameters: Any) -> set[str]:
        """The keys that these parameters do not read."""
        section = reduce(getattr, self.section.split("."), parameters)
        name = self.choice.rpartition(".")[2]
        read = (name, *self.keys[getattr(section, name)])
        return {f"{self.section}.{item.name}" for item in fields(section) if item.name not in read}

    def faults(self, check: Any, also: Iterable[str] = ()) -> Iterator[Fault]:
        """The faults of a study that gives what its word does not read, those keys and
        ``also`` these; ``check`` is its Checker."""
        word = check.value(self.choice)
        read = {self.choice, *(f"{self.section}.{name}" for name in self.keys[word])}
        allowed = f"what {self.of} {word} reads: {', '.join(self.keys[word]) or 'nothing'}"
        for key in check.leaves:
            if key in also or (key.startswith(f"{self.section}.") and key not in read):
                yield from check.unread(key, f"which {self.the} {word} does not read", allowed)
