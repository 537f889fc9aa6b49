"""The values of a request, which come from outside: each is checked, and a wrong one
raises :class:`InputError`; and the binary format of a reply."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.data import Answer, Array, json_text
from nsdrill.errors import InputError

Request = Mapping[str, Any]  # of a page, read from JSON that may hold anything
DEFAULT_SECONDS, MAX_SECONDS = 20.0, 2000.0  # of a motion
SAMPLE = 0.005  # s
MAX_SAMPLES = 40_000  # of one motion on a page


def name(request: Request, key: str) -> str:
    """A name; "" where the request has none."""
    value = request.get(key, "")
    if not isinstance(value, str) or len(value) > 100:
        raise InputError(f"{key}: found {str(value)[:60]}; allowed: a name.")
    return value


def integer(request: Request, key: str, default: int) -> int:
    """A whole number."""
    value = request.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{key}: found {str(value)[:60]}; allowed: a whole number.")
    return value


def number(request: Request, key: str, low: float, high: float, default: float) -> float:
    """A number from ``low`` to ``high``."""
    value = request.get(key, default)
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise InputError(f"{key}: found {str(value)[:60]}; allowed: {low:g} to {high:g}.")
    return float(value)


def seconds(request: Request) -> float:
    """How much of a motion is shown [s]."""
    return number(request, "seconds", 0.1, 1e6, DEFAULT_SECONDS)


def sample(duration: float) -> float:
    """The interval [s] between the samples of a motion of this ``duration`` [s]."""
    return max(SAMPLE, duration / MAX_SAMPLES)


def held(request: Request) -> dict[str, int]:
    """The indices of the values at which axes are held, by axis."""
    indices = request.get("held") or {}
    if not isinstance(indices, dict):
        raise InputError("held: found something else; allowed: a mapping of axes to numbers.")
    return indices


def place(request: Request, shape: tuple[int, ...]) -> tuple[int, ...]:
    """The place of a point in a grid of this ``shape``."""
    found = request.get("place")
    if (
        not isinstance(found, list)
        or len(found) != len(shape)
        or not all(
            isinstance(i, int) and not isinstance(i, bool) and 0 <= i < n for i, n in zip(found, shape, strict=True)
        )
    ):
        raise InputError(f"place: found {str(found)[:60]}; allowed: a point of {' x '.join(map(str, shape))}.")
    return tuple(found)


def state(request: Request) -> Array | None:
    """A state in SI; None where the request has none."""
    given = request.get("state")
    if given is None:
        return None
    numbers = [*map(finite, given)] if isinstance(given, list) and len(given) <= 1000 else [None]
    if None in numbers:
        raise InputError("state: found something else; allowed: a list of finite numbers.")
    return np.array(numbers, dtype=float)


def finite(value: object) -> float | None:
    """A number as a float; None for what is none, or has no finite float."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value) if math.isfinite(value) else None
    except OverflowError:  # a whole number of hundreds of digits
        return None


# The binary format of a reply to a page: plain data and columns of numbers in one
# body.
# 1. the length of the head in four bytes, little-endian;
# 2. the head, JSON in UTF-8, padded with blanks to a multiple of four bytes;
# 3. the columns one after the other as 32-bit floats, precise enough for drawing.
# ``head["columns"]`` maps the name of each column to its offset ``at``, counted in
# floats, and its ``shape``. Numbers that a page sends back with all their bits are in the
# head.


FLOAT = np.dtype("<f4")


def packed(head: Answer, columns: Mapping[str, Array]) -> bytes:
    """The body for ``head`` and ``columns``; numbers of a head that are not finite
    become null."""
    layout, arrays, offset = {}, [], 0
    with np.errstate(over="ignore"):
        for name, values in columns.items():
            array = np.ascontiguousarray(values, dtype=FLOAT)
            layout[name] = {"at": offset, "shape": list(array.shape)}
            arrays.append(array)
            offset += array.size
    text = json_text({**head, "columns": layout}).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([len(text).to_bytes(4, "little"), text, *(array.tobytes() for array in arrays)])
