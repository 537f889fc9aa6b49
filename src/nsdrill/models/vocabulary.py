"""The variables of all models by their names. A name means the same in every model that
has it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from nsdrill.models.registry import NAMES, described
from nsdrill.variables import Variable


class _ByName(Mapping[str, Variable]):
    """By name, those of the first model that has it. The others are looked at only for
    a name that it has not."""

    def __init__(self, room: str) -> None:
        self._room = room
        self._found: dict[str, dict[str, Variable]] = {}

    def _of(self, model: str) -> dict[str, Variable]:
        if model not in self._found:
            self._found[model] = {
                variable.name: variable for variable in getattr(described(model), self._room)
            }
        return self._found[model]

    def __getitem__(self, name: str) -> Variable:
        for model in NAMES:
            if name in self._of(model):
                return self._of(model)[name]
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(name for model in NAMES for name in self._of(model)))

    def __len__(self) -> int:
        return len(list(iter(self)))


BY_NAME: Mapping[str, Variable] = _ByName("variables")
IN_TRACE: Mapping[str, Variable] = _ByName("trace_and_states")
