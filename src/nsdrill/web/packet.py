"""The binary format of a reply to a page: plain data and columns of numbers in one
body.

1. the length of the head in four bytes, little-endian;
2. the head, JSON in UTF-8, padded with blanks to a multiple of four bytes;
3. the columns one after the other as 32-bit floats, precise enough for drawing.

``head["columns"]`` maps the name of each column to its offset ``at``, counted in
floats, and its ``shape``. Numbers that a page sends back with all their bits are in the
head."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.data import Array, json_text

FLOAT = np.dtype("<f4")


def packed(head: Mapping[str, Any], columns: Mapping[str, Array]) -> bytes:
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
