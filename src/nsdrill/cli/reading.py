"""Read whatever kind of file of ours a command was given."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from nsdrill.errors import FileError

if TYPE_CHECKING:
    from nsdrill.data import Results, Trace


def read(path: str, names: Iterable[str] | None = None) -> Results | Trace:
    """The results, trace or unfinished run in ``path``; of a sweep only the variables ``names``, if given. Its root
    attributes say the overrides, whatever its age."""
    from nsdrill.app.overrides import with_overrides
    from nsdrill.store import kind_of, part_path, read_partial, read_results, read_trace

    part = part_path(path)
    if not os.path.lexists(path) and part.exists():
        raise FileError(f"{path}: there is no such file yet, but an unfinished run: {part} can be shown and drawn.")
    kind = kind_of(path)
    if kind == "trace":
        return with_overrides(read_trace(path))
    return with_overrides(read_partial(path, names) if kind == "partial" else read_results(path, names))


MOST_KNOTS = 6


def knots_text(times: Sequence[float], values: Sequence[float], units: str) -> str:
    """The knots of a ramp in words: ``3 rad/s at 0 s, 8 rad/s at 600 s``; of a long one its first and last ones."""
    from nsdrill.units import format_quantity

    texts = [f"{format_quantity(value, units)} at {time:g} s" for time, value in zip(times, values, strict=True)]
    if len(texts) > MOST_KNOTS:
        half = MOST_KNOTS // 2
        texts = [*texts[:half], f"... {len(texts) - 2 * half} knots more ...", *texts[-half:]]
    return ", ".join(texts)


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
