"""The outcome of each point: its critical responses where they are known."""

from __future__ import annotations

import numpy as np

from nsdrill.data import Array
from nsdrill.variables import INFERRED, OK, PENDING

PENDING_POINT, FAILED_POINT = -1, -2  # outcomes beside the response bits, which are never negative
_KNOWN = (OK, INFERRED)


def known(status: Array) -> Array:
    """Whether the response of a point is known: it was run to its end, or inferred from
    its neighbours."""
    return np.isin(status, _KNOWN)


def outcome(status: Array, response: Array) -> Array:
    """The response bits where they are known, else :data:`PENDING_POINT` or
    :data:`FAILED_POINT`."""
    failed = np.where(status == PENDING, PENDING_POINT, FAILED_POINT)
    return np.where(known(status), response.astype(int), failed)


def text(value: object) -> str:
    """A procedure name as a string, which HDF5 returns as bytes and numpy as a
    scalar."""
    return value.decode() if isinstance(value, bytes) else str(value)
