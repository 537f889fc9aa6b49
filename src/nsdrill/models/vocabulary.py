"""The variables of all models by their names. A name means the same in every model that
has it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from nsdrill.models.description import Description
from nsdrill.models.registry import of_all
from nsdrill.variables import Variable


class _ByName(Mapping[str, Variable]):
    """Variables by name, each from the first model that has it. The other models are
    imported only for a name that this one lacks."""

    def __init__(self, attribute: str) -> None:
        self._attribute = attribute
        self._by_model: dict[str, dict[str, Variable]] = {}

    def _of(self, model: Description) -> dict[str, Variable]:
        if model.name not in self._by_model:
            self._by_model[model.name] = {variable.name: variable for variable in getattr(model, self._attribute)}
        return self._by_model[model.name]

    def __getitem__(self, name: str) -> Variable:
        for _, variables in of_all(self._of):
            if name in variables:
                return variables[name]
        raise KeyError(name)

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys(name for _, variables in of_all(self._of) for name in variables))

    def __len__(self) -> int:
        return len(list(iter(self)))


BY_NAME: Mapping[str, Variable] = _ByName("variables")
IN_TRACE: Mapping[str, Variable] = _ByName("trace_and_states")


def known(*names: str) -> tuple[Variable, ...]:
    """The variables of a results file by these names, for a model that has some of
    another."""
    return tuple(BY_NAME[name] for name in names)


def known_in_trace(*names: str) -> tuple[Variable, ...]:
    """As :func:`known`, of a trace."""
    return tuple(IN_TRACE[name] for name in names)
