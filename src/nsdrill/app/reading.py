"""Read whatever kind of file of ours is given."""

from __future__ import annotations

import os
from collections.abc import Iterable

from nsdrill.app.overrides import with_overrides
from nsdrill.data import Results, Trace
from nsdrill.errors import FileError
from nsdrill.store import kind_of, part_path, read_partial, read_results, read_trace


def read_any(path: str | os.PathLike[str], names: Iterable[str] | None = None) -> Results | Trace:
    """The results, trace or unfinished run in ``path``; of a sweep only the variables ``names``, if given. Its root
    attributes say the overrides, whatever its age. FileError if it cannot be read."""
    part = part_path(path)
    if not os.path.lexists(path) and part.exists():
        raise FileError(f"{path}: there is no such file yet, but an unfinished run: {part} can be shown and drawn.")
    kind = kind_of(path)
    if kind == "trace":
        return with_overrides(read_trace(path))
    return with_overrides(read_partial(path, names) if kind == "partial" else read_results(path, names))
