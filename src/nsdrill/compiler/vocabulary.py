"""The words that the lane language has besides Python's, and the kinds of arguments of
compiled functions."""

from __future__ import annotations

import struct
from collections.abc import Callable

import numpy as np

# The kinds of arguments: a flat array of floats, such as the lane buffer, or of
# integers; an integer; a float; a compiled function.
BUFFER, INTEGERS, INTEGER, FLOAT, FUNCTION = "anidf"
BUFFERS = {BUFFER: FLOAT, INTEGERS: INTEGER}  # and the kind of their elements


# In the interpreter these are functions, compiled they are instructions.
def packed(first: int, stop: int | None = None) -> range:
    """The lanes of a buffer, ``packed(W)``, or places side by side from ``first`` to
    ``stop``: a loop over them is compiled to vector instructions."""
    return range(first) if stop is None else range(first, stop)


def call(function: Callable[..., int], *arguments: object) -> int:
    """Call a compiled function that is an argument."""
    return function(*arguments)


def local(size: int) -> np.ndarray:
    """A place for so many floats, a constant, during this call; their first values are
    not set."""
    return np.empty(size)


def masks(count: int) -> list[int]:
    """So many sets of lanes, a constant, which are empty: each is an integer whose bits
    are the lanes."""
    return [0] * count


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


# In the code of one thread of a device (:mod:`nsdrill.compiler.threads`) these two are
# instructions; elsewhere they are helpers.
def claim(counters: np.ndarray, place: int, count: int) -> int:
    """Add ``count`` to a counter, that at ``place``, and return what it was before: in
    one step, if several threads share the counters."""
    before = int(counters[place])
    counters[place] += count
    return before


def anew(number: int) -> int:
    """The same integer, from which the compiler computes again what it has computed
    before: what is kept needs registers."""
    return number
