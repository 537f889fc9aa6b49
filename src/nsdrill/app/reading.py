"""Reading files of nsdrill of any kind."""

from __future__ import annotations

import os
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from nsdrill.app.overrides import with_overrides
from nsdrill.data import Results, Trace, units_of
from nsdrill.errors import FileError, NsdrillError, option
from nsdrill.store import kind_of, part_path, read_attributes, read_partial, read_results, read_trace, variables_in


def read_any(path: str | os.PathLike[str], names: Iterable[str] | None = None) -> Results | Trace:
    """The results, trace or unfinished run in ``path``; of a sweep only the variables
    ``names``, if given. The overrides are in its root attributes for all versions.
    FileError if it cannot be read."""
    part = part_path(path)
    if not os.path.lexists(path) and part.exists():
        kind_of(part)  # FileError for that of a fit or a continuation
        raise FileError(f"{path}: there is no such file yet, but an unfinished run: {part} can be shown and drawn.")
    kind = kind_of(path)
    if kind == "branches":
        raise FileError(
            f"{path}: found a file of branches; allowed here: results of a sweep or a trace. "
            f"show, plot and export "
            f"take branches, and simulate {option('orbit')} runs one of their points."
        )
    if kind == "trace":
        return with_overrides(read_trace(path))
    return with_overrides(read_partial(path, names) if kind == "partial" else read_results(path, names))


def units_in(path: str | os.PathLike[str]) -> str:
    """The system of units in which the study in the file ``path`` wants answers: "si"
    also where there is no such file, which others say."""
    with suppress(NsdrillError):
        if kind_of(path) == "partial":
            return units_of(read_partial(path, ()).attrs)
        return units_of(read_attributes(path))
    return "si"


def is_branches(path: str | os.PathLike[str]) -> bool:
    """Whether ``path`` is a file of branches; FileError if it is not a file of
    nsdrill."""
    return os.path.lexists(path) and kind_of(path) == "branches"


def outline(path: str | os.PathLike[str]) -> Results | Trace:
    """As :func:`read_any`, but the variables of a sweep are zeros, which take no
    memory; for the names and the shape."""
    data = read_any(path, ())
    return data if isinstance(data, Trace) else outline_of(data, (v.name for v in variables_in(path)))


def outline_of(results: Results, names: Iterable[str]) -> Results:
    """``results`` with the variables ``names`` as zeros, which take no memory."""
    zeros = np.broadcast_to(np.int8(0), results.shape)
    return replace(results, variables={name: zeros for name in names})
