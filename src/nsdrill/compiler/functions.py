"""Compiled functions: made by a decorator, compiled when they are first needed, kept on
disk for the next process.

Three ways lead to the same bits. Machine code comes from the lane language
(:mod:`nsdrill.compiler.language`); with ``NSDRILL_COMPILER=numba`` in the environment
it comes from numba, which is slower to compile, the reference; with
``NUMBA_DISABLE_JIT=1`` everything runs in the interpreter, where a fused multiply-add
rounds twice.
"""

from __future__ import annotations

import ctypes
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np

from nsdrill.cache import load, save
from nsdrill.compiler.definitions import Definition, Source, define
from nsdrill.compiler.vocabulary import (
    BUFFER,
    BUFFERS,
    FLOAT,
    FUNCTION,
    INTEGER,
    INTEGERS,
    anew,
    bits_float,
    call,
    claim,
    float_bits,
    fma,
    local,
    lowest_bit,
    masks,
    packed,
)
from nsdrill.errors import InputError

__all__ = [
    "BUFFER", "BUFFERS", "FLOAT", "FUNCTION", "INTEGER", "INTEGERS", "LaneFunction", "Source", "address", "anew",
    "bits_float", "call", "claim", "compiled", "compiling", "define", "float_bits", "fma", "generated",
    "inlined", "local", "lowest_bit", "masks", "packed", "route",
]  # fmt: skip

ROUTES = ("native", "numba", "interpreter")
_DTYPES = {BUFFER: np.float64, INTEGERS: np.int64}
_C_TYPES: dict[str, tuple[type[ctypes.c_void_p | ctypes.c_int64 | ctypes.c_double], ...]] = {
    **dict.fromkeys(BUFFERS, (ctypes.c_void_p, ctypes.c_int64)),
    INTEGER: (ctypes.c_int64,),
    FLOAT: (ctypes.c_double,),
    FUNCTION: (ctypes.c_int64,),
}
_addresses: dict[str, int] = {}
F = TypeVar("F", bound=Callable[..., object])


class Compiling:
    """How long this process has compiled machine code, ``seconds``. Each of
    ``watchers`` is called with True where a function begins to be compiled, and with
    False where it is made."""

    def __init__(self) -> None:
        self.seconds = 0.0
        self.watchers: list[Callable[[bool], None]] = []

    @contextmanager
    def function(self) -> Iterator[None]:
        """The compilation of one function, of one thread at a time."""
        began = time.monotonic()
        for watch in self.watchers:
            watch(True)
        try:
            yield
        finally:
            self.seconds += time.monotonic() - began
            for watch in self.watchers:
                watch(False)


compiling = Compiling()


@cache
def route() -> str:
    """How functions are compiled in this process, one of ROUTES."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return "interpreter"
    found = os.environ.get("NSDRILL_COMPILER") or "native"
    if found not in ROUTES:
        raise InputError(f"NSDRILL_COMPILER: found {found}; allowed: native, numba or interpreter.")
    return found


def compiled(*kinds: str) -> Callable[[Callable[..., object]], LaneFunction]:
    """Compile a function of the lane language whose arguments are of these kinds
    (BUFFER, INTEGERS, INTEGER, FLOAT, FUNCTION). Where it returns something, that is an
    integer."""

    def make(function: Any) -> LaneFunction:
        if route() == "interpreter":
            function.kinds = "".join(kinds)
            return cast(LaneFunction, function)
        if route() == "numba":
            from nsdrill.compiler import reference

            return reference.compiled(function, "".join(kinds))
        return LaneFunction(function, "".join(kinds))

    return make


def generated(name: str, kinds: str, make: Callable[[], Source]) -> LaneFunction:
    """A compiled function whose text ``make()`` writes when it is needed; Python reads
    that text only where its machine code is not known."""
    if route() != "native":
        return compiled(*kinds)(make().function())
    return LaneFunction(None, kinds, name, make)


def inlined(function: F) -> F:
    """A helper that is written out where it is called."""
    if route() == "numba":
        from nsdrill.compiler import reference

        return reference.inlined(function)
    return function


def address(function: LaneFunction) -> int | LaneFunction:
    """What stands for a compiled function when it is an argument of another: its
    address, or in the interpreter the function itself."""
    return function if route() == "interpreter" else function.address


class LaneFunction(Definition):
    """A function of the lane language, and its machine code once that is needed."""

    def __init__(
        self, function: FunctionType | None, kinds: str, name: str = "", make: Callable[[], Source] | None = None
    ) -> None:
        super().__init__(function, kinds, name, make)
        self._address = 0

    @property
    def address(self) -> int:
        """Of the entry with C's calling convention (:mod:`nsdrill.compiler.native`)."""
        if not self._address:
            self._address = _address(self)
        return self._address

    def __call__(self, *arguments: Any) -> int:
        given: list[Any] = []
        for argument, kind in zip(arguments, self.kinds, strict=True):
            if kind in BUFFERS:
                wanted = np.dtype(_DTYPES[kind])
                if argument.dtype != wanted or not argument.flags.c_contiguous:
                    raise TypeError(f"{self.__name__}: a buffer is a contiguous array of {wanted}")
                given += (argument.ctypes.data, argument.size)
            else:
                given.append(argument.address if kind == FUNCTION else argument)
        return int(_prototype(self.kinds)(self.address)(*given))


@cache
def _prototype(kinds: str) -> Callable[[int], Callable[..., int]]:
    return ctypes.CFUNCTYPE(ctypes.c_int64, *(part for kind in kinds for part in _C_TYPES[kind]))


def _address(function: LaneFunction) -> int:
    """Compile the function, or load it from the disk."""
    from nsdrill.compiler import identity, native

    with native.lock:
        key = identity.key(function, native.versions(), native.WIDTH)
        if key in _addresses:
            return _addresses[key]
        name, symbol = f"{function.__name__[:60]}-{key}", f"lanes_{key}"
        found = load(name, lambda code: native.address_of(code, symbol))
        if found is None:
            with compiling.function():
                code = _made(function, symbol)
                save(name, code)
            found = native.address_of(code, symbol)
        _addresses[key] = found
        return int(found)


def _made(function: LaneFunction, symbol: str) -> bytes:
    """The object file of the function, under the name ``symbol``."""
    from nsdrill.compiler import native
    from nsdrill.compiler.native import Module

    text = Module(native.WIDTH).text(function.py_func, function.kinds, symbol)
    return native.object_code(text)
