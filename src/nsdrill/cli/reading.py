"""Read whatever kind of file of ours a command was given."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING

from nsdrill.errors import FileError

if TYPE_CHECKING:
    from nsdrill.data import Results, Trace


def read(path: str, names: Iterable[str] | None = None) -> Results | Trace:
    """The results, trace or unfinished run in ``path``; of a sweep only the variables ``names``, if given."""
    from nsdrill.store import kind_of, part_path, read_partial, read_results, read_trace

    part = part_path(path)
    if not os.path.lexists(path) and part.exists():
        raise FileError(f"{path}: there is no such file yet, but an unfinished run: {part} can be shown and drawn.")
    kind = kind_of(path)
    if kind == "trace":
        return read_trace(path)
    return read_partial(path, names) if kind == "partial" else read_results(path, names)


def outline(path: str) -> Results | Trace:
    """As :func:`read`, but a sweep has zeros for its variables, which take no memory: to see what there is."""
    import numpy as np

    from nsdrill.data import Results, Trace
    from nsdrill.store import variables_in

    data = read(path, ())
    if isinstance(data, Trace):
        return data
    zeros = np.broadcast_to(np.int8(0), data.shape)
    return Results(data.coords, {v.name: zeros for v in variables_in(path)}, data.attrs)
