"""Read whatever kind of file of ours a command was given."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nsdrill.data import Results, Trace


def read(path: str, names: Iterable[str] | None = None) -> Results | Trace:
    """The results, trace or unfinished run in ``path``; of a sweep only the variables ``names``, if given. Its root
    attributes say the overrides, whatever its age."""
    from nsdrill.app.reading import read_any

    return read_any(path, names)


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
    from nsdrill.app.reading import outline

    return outline(path)
