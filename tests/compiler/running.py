"""A function of the lane language as machine code, and in the interpreter."""

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import count
from types import FunctionType
from typing import Any

import numpy as np

from nsdrill import elementary
from nsdrill.compiler import native
from nsdrill.compiler.functions import LaneFunction
from nsdrill.compiler.native import Module

LANES = (1, 8, 12, 16, 32)
WIDTHS = (2, 4, 8, 16)
_numbers = count()


def machine_code(function: Any, kinds: str = "a", width: int = native.WIDTH) -> LaneFunction:
    """Compiled for vectors of at most ``width`` lanes, without a cache."""
    symbol = f"tested_{next(_numbers)}"
    made = LaneFunction(function, kinds)
    code = native.object_code(Module(width).text(function, kinds, symbol))
    made._address = native.address_of(code, symbol)
    return made


def exact_fma(a: float, b: float, c: float) -> float:
    """Rounded once, as compiled."""
    if not np.isfinite([a, b, c]).all():
        return c if np.isfinite([a, b]).all() else a * b + c
    exact = Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c))
    try:
        return np.float64(exact) if exact else a * b + c
    except OverflowError:
        return np.float64(np.inf if exact > 0 else -np.inf)


def interpreted(function: FunctionType) -> Callable[..., Any]:
    """The function as Python runs it, but with a multiply-add that rounds once."""
    names = {**function.__globals__, "fma": exact_fma} if "fma" in function.__globals__ else None
    plain = FunctionType(
        function.__code__, names or function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )

    def run(*arguments: Any) -> Any:
        with np.errstate(all="ignore"):
            return plain(*arguments)

    return run


def bits(buffer: np.ndarray) -> list[int]:
    """The bits of these numbers; those of all NaN are the same, as the processor is
    free to choose them."""
    return np.where(np.isnan(buffer), np.nan, buffer).view(np.int64).tolist()


SPECIAL = (0.0, -0.0, np.inf, -np.inf, np.nan, 1.0, -1.0, 5e-324, 1e308, 0.1)


def floats(rng: np.random.Generator, size: int) -> np.ndarray:
    """Of all magnitudes, some of them special."""
    made = rng.choice([-1.0, 1.0], size) * 10.0 ** rng.uniform(-3, 3, size)
    return np.where(rng.random(size) < 0.25, rng.choice(SPECIAL, size), made)


def whole(rng: np.random.Generator, size: int) -> np.ndarray:
    """Whole numbers of both signs, not zero."""
    return rng.choice([-9, -7, -4, -3, -2, -1, 1, 2, 3, 5, 8, 9], size).astype(float)


def same(function: FunctionType, buffers: Iterator[np.ndarray], widths: tuple[int, ...] = WIDTHS) -> None:
    """Assert that machine code of every width leaves the bits of the interpreter in
    these buffers."""
    compiled = [machine_code(function, width=width) for width in widths]
    run = interpreted(function)
    for before in buffers:
        wanted = before.copy()
        run(wanted)
        for width, one in zip(widths, compiled, strict=True):
            found = before.copy()
            one(found)
            assert bits(found) == bits(wanted), (function.__name__, width)


assert elementary  # its fma is what exact_fma stands for
