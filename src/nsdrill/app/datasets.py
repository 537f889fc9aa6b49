"""Results and traces as arguments of Python functions, Datasets or names of files; how files
of any kind are read and saved."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import TYPE_CHECKING, TypeAlias, TypeGuard, TypeVar

import numpy as np

from nsdrill.analysis.counts import AFTER_FAILURE
from nsdrill.app.conversion import name_in
from nsdrill.app.experiment import check_coordinates, overrides_of, with_overrides
from nsdrill.data import IN_MEMORY, OVERRIDES, Attributes, Results, Trace, edited_together, json_text, units_of
from nsdrill.errors import FileError, InputError, NsdrillError, option
from nsdrill.late import deferred
from nsdrill.models.registry import BY_NAME
from nsdrill.store import (
    contents_in,
    from_dataset,
    is_log,
    kind_of,
    open_branches,
    part_path,
    read_attributes,
    read_partial,
    read_results,
    read_trace,
    variables_in,
)
from nsdrill.variables import Variable

with deferred():  # they import the compiler
    from nsdrill.app import labelling
    from nsdrill.app.following import continuing
    from nsdrill.app.running import unfinished

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset

    from nsdrill.store.results import NamesIn

    Source: TypeAlias = Results | Dataset | str | os.PathLike[str]


Data = TypeVar("Data", bound=Results | Trace)


def is_dataset(data: object) -> TypeGuard[Dataset]:
    """Whether ``data`` is a Dataset. There is none before xarray is imported."""
    return "xarray" in sys.modules and isinstance(data, sys.modules["xarray"].Dataset)


def units_for(units: str | None, data: object) -> str:
    """``units``; where it is None those that the study in a Dataset or file asks for."""
    if units is None:
        return units_of(data.attrs) if is_dataset(data) else units_in(name_in(data))
    return units


def is_figure(data: object) -> TypeGuard[Figure]:
    """Whether ``data`` is a figure of matplotlib."""
    return "matplotlib.figure" in sys.modules and isinstance(data, sys.modules["matplotlib.figure"].Figure)


def data_in(data: object, names: Iterable[str] | None) -> Results | Trace:
    """The results or trace in a Dataset or file; of results only the variables
    ``names``, if given."""
    if not is_dataset(data):
        return read_any(name_in(data), names)
    if "branch" in data.dims:
        raise InputError(
            "the Dataset: found branches; allowed here: results of a sweep or a trace. show, plot and save take "
            "branches."
        )
    found = validated(from_dataset(data, None if names is None else {*names}))
    found.attrs |= _edited(data, found)
    found.attrs[OVERRIDES] = json_text(overrides_of(found.attrs))
    return with_own_axes(IN_MEMORY, found)


def _edited(data: Dataset, found: Results | Trace) -> Attributes:
    """The root attribute that says which labels of a Dataset do not follow from its features,
    of the results ``found`` in it; empty where they do. Of labels that are still in a file, as
    of :func:`nsdrill.open_results`, its seal says so."""
    if isinstance(found, Trace) or "response" not in data or not data["response"].variable._in_memory:
        return {}
    whole = from_dataset(data)
    assert isinstance(whole, Results)
    return edited_together(labelling.marked(whole).attrs)


def with_own_axes(where: str | os.PathLike[str], data: Data) -> Data:
    """``data``; FileError where they are results at other values than their study has."""
    if isinstance(data, Results):
        check_coordinates(where, data)
    return data


def validated(data: Results | Trace) -> Results | Trace:
    """``data``; InputError where a selection is empty, where an axis or the time of a trace
    does not ascend, or where a run is there twice, which would count as two."""
    if isinstance(data, Trace):
        if not len(data.time) or not np.all(np.diff(data.time) > 0.0):
            raise InputError(
                "the Dataset: found a trace whose time is empty or does not ascend; allowed: samples in order."
            )
    elif empty := [name for name, length in zip(data.grid, data.shape, strict=True) if not length]:
        raise InputError(f"the Dataset: found no values of {', '.join(empty)}; allowed: one or more of each axis.")
    else:
        _check_order(data)
    return data


def _check_order(results: Results) -> None:
    """InputError where an axis does not ascend, or a run is there more than once."""
    for name in results.axes:
        if not np.all(np.diff(results.coords[name]) > 0):
            raise InputError(
                f"the Dataset: found values of {name} that do not ascend; allowed: each once and sorted (sortby, "
                "drop_duplicates)."
            )
    for name in set(results.grid) - set(results.axes):
        values = results.coords[name]
        if len(np.unique(values)) < len(values):
            raise InputError(
                f"the Dataset: found some values of {name} more than once, which would count as independent runs; "
                "allowed: each once (drop_duplicates)."
            )


def variables_of(results: Results) -> tuple[Variable, ...]:
    """The variables that a file of these results should have."""
    return contents_in(results).variables


def sweep_in(source: Source, name: str, names: Sequence[str], more: Sequence[str] | NamesIn | None = ()) -> Results:
    """The results of a sweep: in memory, in a Dataset, which must have the variables
    ``names``, or in a results file, each with only these and ``more`` of its variables (None: all),
    which may follow from its root attributes. What is in memory has no more of them than what is read
    of a file, so that both answer the same. ``name`` is that of the operation in messages."""

    def wanted(attrs: Attributes) -> tuple[str, ...]:
        return (*names, *(more(attrs) if callable(more) else more or ()))

    if isinstance(source, Results) or is_dataset(source):
        found = source if isinstance(source, Results) else results_in(source, name, names)
        return found if more is None else _only(found, wanted(found.attrs))
    path = name_in(source)
    return with_own_axes(path, read_results(path, None if more is None else wanted))


def _only(results: Results, names: Iterable[str]) -> Results:
    """The ``results`` with those of their variables that are among the ``names``, and what says which runs follow one
    that failed."""
    kept, part = {*names, AFTER_FAILURE.name}, results.part_of
    if part is not None:
        part = (_only(part[0], kept), *part[1:])
    return replace(results, variables={n: v for n, v in results.variables.items() if n in kept}, part_of=part)


def results_in(data: object, name: str, names: Iterable[str]) -> Results:
    """The results in a Dataset or file, which must have the variables ``names``; of a
    file only these are read. ``name`` is that of the argument in messages."""
    found = data_in(data, None if is_dataset(data) else names)
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


def branches_in(data: object) -> Dataset | None:
    """The Dataset of branches where ``data`` is one, or the name of a file of branches or
    of what an unfinished continuation has; else None."""
    if is_dataset(data):
        return data if "branch" in data.dims else None
    path = name_in(data)
    if is_unfinished(path) and (kept := continuing.branches_kept(path)) is not None:
        return kept
    return open_branches(path) if is_branches(path) else None


def outline_in(data: object) -> Results | Trace:
    """As :func:`data_in`, but the variables of results are zeros, which take no memory;
    for the names and the shape."""
    if not is_dataset(data):
        return outline(name_in(data))
    found = data_in(data, ())
    return found if isinstance(found, Trace) else outline_of(found, [str(n) for n in data.data_vars if n in BY_NAME])


# Reading files of nsdrill of any kind.


def read_any(path: str | os.PathLike[str], names: Iterable[str] | None = None) -> Results | Trace:
    """The results, trace or unfinished run in ``path``; of a sweep only the variables
    ``names``, if given. The overrides are in its root attributes for all versions.
    FileError if it cannot be read."""
    kind = _kind_there(path)
    if kind == "branches":
        raise FileError(
            f"{path}: found a file of branches; allowed here: results of a sweep or a trace. show, plot and export "
            f"take branches, and simulate {option('orbit')} runs one of their points."
        )
    if kind == "trace":
        return with_overrides(read_trace(path))
    results = read_partial(path, names) if kind == "partial" else read_results(path, names)
    return with_own_axes(path, with_overrides(results))


def attributes_for_study(path: str | os.PathLike[str]) -> Attributes:
    """The root attributes of a file of any kind, for the study in it: also where what its runs
    were made with was changed since, as the study is then run again."""
    _kind_there(path)
    return read_attributes(path, changed=True)


def _kind_there(path: str | os.PathLike[str]) -> str:
    """The kind of a file; FileError where there is an unfinished run in its place."""
    part = part_path(path)
    if not os.path.lexists(path) and part.exists():
        kind_of(part)  # FileError for that of a fit or a continuation
        raise FileError(f"{path}: there is no such file yet, but an unfinished run: {part} can be shown and drawn.")
    return kind_of(path)


def units_in(path: str | os.PathLike[str]) -> str:
    """The system of units in which the study in the file ``path`` wants answers: "si"
    also where there is no such file, which others say."""
    with suppress(NsdrillError):
        return units_of(read_partial(path, ()).attrs if is_log(path) else read_attributes(path, changed=True))
    return "si"


def is_study(path: object) -> bool:
    """Whether ``path`` is the name of a study, of which charts are drawn, and not that
    of a results file."""
    return isinstance(path, str | os.PathLike) and str(os.fspath(path)).lower().endswith((".yaml", ".yml"))


def is_branches(path: str | os.PathLike[str]) -> bool:
    """Whether ``path`` is a file of branches; FileError if it is not a file of
    nsdrill."""
    return os.path.lexists(path) and kind_of(path) == "branches"


def is_unfinished(path: str | os.PathLike[str]) -> bool:
    """Whether ``path`` is the part file of a continuation or a fit."""
    return unfinished.summary(path) is not None


def outline(path: str | os.PathLike[str]) -> Results | Trace:
    """As :func:`read_any`, but the variables of a sweep are zeros, which take no
    memory; for the names and the shape."""
    data = read_any(path, ())
    return data if isinstance(data, Trace) else outline_of(data, (v.name for v in variables_in(path)))


def outline_of(results: Results, names: Iterable[str]) -> Results:
    """``results`` with the variables ``names`` as zeros, which take no memory."""
    zeros = np.broadcast_to(np.int8(0), results.shape)
    return replace(results, variables={name: zeros for name in names})
