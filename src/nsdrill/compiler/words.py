"""The words that the lane language has besides Python's: in the interpreter functions,
compiled instructions (:mod:`nsdrill.compiler.language`)."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np


def packed(first: int, stop: int | None = None) -> range:
    """The lanes of a buffer, ``packed(W)``, or places side by side from ``first`` to
    ``stop``: a loop over them is compiled to vector instructions."""
    return range(first) if stop is None else range(first, stop)


def call(function: Any, *arguments: Any) -> Any:
    """Call a compiled function that is an argument."""
    return function(*arguments)


def local(size: int) -> Any:
    """A place for so many floats, a constant, during this call; their first values are
    not set."""
    return np.empty(size)


def float_bits(value: float) -> int:
    """The 64 bits of a float, as an integer."""
    return int(struct.unpack("<q", struct.pack("<d", value))[0])


def bits_float(bits: int) -> float:
    """The float that has these 64 bits."""
    return float(struct.unpack("<d", struct.pack("<Q", int(bits) & 0xFFFFFFFFFFFFFFFF))[0])


def fma(a: float, b: float, c: float) -> float:
    """a * b + c; in one rounding when compiled."""
    return a * b + c


def lowest_bit(bits: int) -> int:
    """The position of the lowest bit that is set; there must be one."""
    return (bits & -bits).bit_length() - 1
