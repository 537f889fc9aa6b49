"""Read whatever kind of file of ours a command was given."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from nsdrill.errors import FileError

if TYPE_CHECKING:
    from nsdrill.data import Results, Trace


def read(path: str) -> Results | Trace:
    """The results, trace or unfinished run in ``path``."""
    from nsdrill.store import kind_of, part_path, read_partial, read_results, read_trace

    part = part_path(path)
    if not os.path.lexists(path) and part.exists():
        raise FileError(f"{path}: there is no such file yet, but an unfinished run: {part} can be shown and drawn.")
    kind = kind_of(path)
    if kind == "trace":
        return read_trace(path)
    return read_partial(path) if kind == "partial" else read_results(path)
