"""Read whatever kind of file of ours a command was given."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nsdrill.data import Results, Trace


def read(path: str) -> Results | Trace:
    """The results, trace or unfinished run in ``path``."""
    from nsdrill.store import kind_of, read_partial, read_results, read_trace

    kind = kind_of(path)
    if kind == "trace":
        return read_trace(path)
    return read_partial(path) if kind == "partial" else read_results(path)
