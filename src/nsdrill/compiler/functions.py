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
import hashlib
import linecache
import os
import struct
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from types import FunctionType
from typing import Any, TypeVar, cast

import numpy as np

from nsdrill.cache import load, save
from nsdrill.errors import InputError

# The kinds of arguments: a flat array of floats, such as the lane buffer, or of
# integers; an integer; a float; a compiled function.
BUFFER, INTEGERS, INTEGER, FLOAT, FUNCTION = "anidf"
BUFFERS = {BUFFER: FLOAT, INTEGERS: INTEGER}  # and the kind of their elements
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


# The words that the lane language has besides Python's: in the interpreter functions,
# compiled instructions.
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


def masks(count: int) -> np.ndarray:
    """So many sets of lanes, a constant, which are empty: each is an integer whose bits
    are the lanes."""
    return np.zeros(count, np.int64)


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


# Functions from generated text, for regular code that must be written out.
@dataclass(frozen=True, eq=False)
class Source:
    """What defines a function (:func:`define`)."""

    name: str
    text: str
    namespace: Mapping[str, object]

    def function(self) -> FunctionType:
        return define(self.name, self.text, **self.namespace)


def define(name: str, text: str, **namespace: object) -> FunctionType:
    """The function ``name`` that the Python source ``text`` defines; ``namespace`` has
    the global names that the text uses besides ``packed`` and ``call``. Tracebacks and
    messages of the compiler show its lines."""
    path = f"<{name} {hashlib.sha256(text.encode()).hexdigest()[:16]}>"
    linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
    # The source is kept beside the function too: others may empty the cache of lines.
    space: dict[str, Any] = {"packed": packed, "call": call, "__source__": text, **namespace}
    exec(compile(text, path, "exec"), space)
    return cast(FunctionType, space[name])


def constants(**values: object) -> str:
    """Lines that assign these values; the text of a float reproduces its bits."""
    return "".join(f"{name} = {value!r}\n" for name, value in values.items())


def address(function: LaneFunction) -> int | LaneFunction:
    """What stands for a compiled function when it is an argument of another: its
    address, or in the interpreter the function itself."""
    return function if route() == "interpreter" else function.address


class LaneFunction:
    """A function of the lane language, and its machine code once that is needed."""

    def __init__(
        self, function: FunctionType | None, kinds: str, name: str = "", make: Callable[[], Source] | None = None
    ) -> None:
        self._function, self._make = function, make
        self.kinds, self.__name__ = kinds, name if function is None else function.__name__
        self._address = 0

    @cached_property
    def source(self) -> Source | None:
        """The text of a generated function."""
        return None if self._make is None else self._make()

    @property
    def py_func(self) -> Any:
        """What the interpreter would run."""
        if self._function is None:
            assert self.source is not None
            self._function = self.source.function()
        return self._function

    __wrapped__ = py_func

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
