"""Results and traces as arguments of Python functions: Datasets or names of files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.app.arguments import name_in
from nsdrill.app.overrides import overrides_of
from nsdrill.app.reading import is_branches, outline, outline_of, read_any, units_in
from nsdrill.data import OVERRIDES, Results, Trace, json_text, units_of
from nsdrill.errors import InputError
from nsdrill.models.registry import model_in
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.store import kept_of, open_branches, recorded
from nsdrill.variables import Variable

if TYPE_CHECKING:
    from xarray import Dataset


def is_dataset(data: Any) -> bool:
    """Whether ``data`` is a Dataset. xarray is imported only where it may be one."""
    if isinstance(data, str | os.PathLike):
        return False
    from xarray import Dataset

    return isinstance(data, Dataset)


def units_for(units: Any, data: Any) -> str:
    """``units``, "si" or "field"; where it is None those that the study in a Dataset or
    file asks for. InputError for others."""
    if units is None:
        return units_of(data.attrs) if is_dataset(data) else units_in(name_in(data))
    if units not in ("si", "field"):
        raise InputError(f"units: found {units!r}; allowed: si or field.")
    return str(units)


def is_figure(data: Any) -> bool:
    """Whether ``data`` is a figure of matplotlib."""
    from matplotlib.figure import Figure

    return isinstance(data, Figure)


def _with_variables_only(data: Any, names: Iterable[str]) -> Dataset:
    """The Dataset ``data`` with only the variables ``names``, and all coordinates."""
    wanted = {*names}
    kept: Dataset = data.drop_vars([name for name in data.data_vars if name not in wanted])
    return kept


def data_in(data: Any, names: Iterable[str] | None) -> Results | Trace:
    """The results or trace in a Dataset or file; of results only the variables
    ``names``, if given."""
    from nsdrill.store.dataset import from_dataset

    if not is_dataset(data):
        return read_any(name_in(data), names)
    found = validated(from_dataset(data if names is None or "time" in data.dims else _with_variables_only(data, names)))
    found.attrs[OVERRIDES] = json_text(overrides_of(found.attrs))
    return found


def validated(data: Results | Trace) -> Results | Trace:
    """``data``; InputError where a selection is empty, or the time of a trace does not
    ascend."""
    if isinstance(data, Trace):
        if not len(data.time) or not np.all(np.diff(data.time) > 0.0):
            raise InputError(
                "the Dataset: found a trace whose time is empty or does not ascend; allowed: samples in order."
            )
    elif empty := [name for name, length in zip(data.grid, data.shape, strict=True) if not length]:
        raise InputError(f"the Dataset: found no values of {', '.join(empty)}; allowed: one or more of each axis.")
    return data


def with_missing_features(results: Results) -> Results:
    """``results`` with NaN for the features that their version of nsdrill lacked."""
    from nsdrill.app.provenance import model_digest  # late: the compiled sources, of which show needs none

    if results.attrs.get("model_digest") == model_digest(model_in(results.attrs).name):
        return results
    unknown = np.full(results.shape, np.nan)
    later = {v.name: unknown for v in variables_of(results) if v.room == "feature"}
    return replace(results, variables=later | results.variables)


def variables_of(results: Results) -> tuple[Variable, ...]:
    """The variables that a file of these results should have."""
    model = model_in(results.attrs).name
    return recorded(kept_of(results.coords, results.more, results.variables, model, results.drawn))


def results_in(data: Any, name: str, names: Iterable[str]) -> Results:
    """The results in a Dataset or file, which must have the variables ``names``; of a
    file only these are read. ``name`` is that of the argument in messages."""
    found = data_in(data, None if is_dataset(data) else names)
    if is_dataset(data) and isinstance(found, Results):
        found = with_missing_features(found)
    return with_variables(found, name, names)


def with_variables(data: Results | Trace, name: str, names: Iterable[str]) -> Results:
    """``data``; InputError unless they are results with the variables ``names``."""
    if isinstance(data, Trace):
        raise InputError(f"{name}: found a trace; allowed: results of a sweep.")
    if lacking := [variable for variable in dict.fromkeys(names) if variable not in data.variables]:
        raise InputError(f"{name}: found results without {_listed(lacking)}; allowed: results that have them.")
    return data


def _listed(names: Sequence[str]) -> str:
    few = 4
    return ", ".join(names) if len(names) <= few else f"{', '.join(names[:few])} and {len(names) - few} more"


@contextmanager
def missing_variable_errors(name: str) -> Iterator[None]:
    """A context in which a missing variable, a KeyError, becomes an InputError that
    names it."""
    try:
        yield
    except KeyError as error:
        if not error.args or error.args[0] not in BY_NAME:
            raise
        raise InputError(f"{name}: found results without {error.args[0]}; allowed: results that have it.") from error


def branches_in(data: Any) -> Any:
    """The Dataset of branches where ``data`` is one, or the name of a file of branches;
    else None."""
    if is_dataset(data):
        return data if "branch" in data.dims else None
    path = name_in(data)
    return open_branches(path) if is_branches(path) else None


def outline_in(data: Any) -> Results | Trace:
    """As :func:`data_in`, but the variables of results are zeros, which take no memory;
    for the names and the shape."""
    if not is_dataset(data):
        return outline(name_in(data))
    found = data_in(data, ())
    return found if isinstance(found, Trace) else outline_of(found, [str(n) for n in data.data_vars if n in BY_NAME])
