"""What a page is given: plain data and columns of numbers in one body.

The length of the head in four bytes, little-endian; the head, JSON in UTF-8 with blanks
after it up to a multiple of four bytes; the columns one after the other as 32-bit
floats, which are for drawing. ``head["columns"]`` has of each by its name where it
begins, counted in floats, and its shape. Numbers that are to come back with all their
bits stand in the head.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.data import Array, json_text

FLOAT = np.dtype("<f4")


def packed(head: Mapping[str, Any], columns: Mapping[str, Array]) -> bytes:
    """The body for ``head`` and ``columns``; numbers of a head that are not finite
    become null."""
    places, arrays, at = {}, [], 0
    with np.errstate(over="ignore"):
        for name, values in columns.items():
            array = np.ascontiguousarray(values, dtype=FLOAT)
            places[name] = {"at": at, "shape": list(array.shape)}
            arrays.append(array)
            at += array.size
    text = json_text({**head, "columns": places}).encode()
    text += b" " * (-len(text) % 4)
    return b"".join([len(text).to_bytes(4, "little"), text, *(array.tobytes() for array in arrays)])
