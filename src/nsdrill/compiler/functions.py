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
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType
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


def generated(name: str, kinds: str, key: object, make: Callable[[], FunctionType]) -> LaneFunction:
    """A compiled function whose code ``make()`` writes, where it is not known: ``key``
    determines the code."""
    if route() != "native":
        return compiled(*kinds)(make())
    return LaneFunction(None, kinds, name, key, make)


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


# Functions from generated text, for regular code that must be written out.
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
        self,
        function: FunctionType | None,
        kinds: str,
        name: str = "",
        key: object = None,
        make: Callable[[], FunctionType] | None = None,
    ) -> None:
        self._function, self._make, self._key = function, make, key
        self.kinds, self.__name__ = kinds, name if function is None else function.__name__
        self._address = 0

    @property
    def py_func(self) -> Any:
        """What the interpreter would run."""
        if self._function is None:
            assert self._make is not None
            self._function = self._make()
        return self._function

    __wrapped__ = py_func

    @property
    def identity(self) -> str:
        """What determines the code."""
        return repr(self._key) if self._make else identity(self.py_func)

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
    from nsdrill.compiler import native

    with native.lock:
        key = _key(function, native.versions(), native.WIDTH)
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


# What determines the machine code of a function: not its text, which would have to be
# read and parsed, but what Python has made of it.
def _key(function: LaneFunction, *others: object) -> str:
    text = repr((_compiler_digest(), function.kinds, function.identity, *others))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


@cache
def _compiler_digest() -> str:
    digest = hashlib.sha256()
    here = Path(__file__).parent
    sources = [*here.glob("*.py"), *(here.parent / "equations").glob("*.py")]
    for file in [*sorted(sources), here.parent / "elementary.py"]:
        digest.update(file.read_bytes())
    return digest.hexdigest()


@cache
def identity(function: FunctionType) -> str:
    """A digest of the code of ``function`` and of all that it refers to."""
    if function in _identified:
        raise InputError(f"{function.__name__} calls itself through another function; allowed: a loop.")
    _identified.append(function)
    try:
        names = _names(function.__code__)
        referred = {name: function.__globals__[name] for name in names if name in function.__globals__}
        cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
        referred |= {name: cell.cell_contents for name, cell in cells}
        found = (
            _code(function.__code__),
            [
                (name, _content(value, names))
                for name, value in sorted(referred.items())
                if _source(value) is not function
            ],
            _content((function.__defaults__, function.__kwdefaults__), names),
        )
    finally:
        _identified.pop()
    return hashlib.sha256(repr(found).encode()).hexdigest()


def _source(value: object) -> object:
    """The plain function of a compiled one, if it is known; else the value."""
    if isinstance(value, LaneFunction):
        return value._function
    return getattr(value, "py_func", value)


_identified: list[FunctionType] = []  # whose identity is being found


def _names(code: CodeType) -> set[str]:
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*map(_names, inner))


def _code(code: CodeType) -> tuple[object, ...]:
    constants = [_code(c) if isinstance(c, CodeType) else c for c in code.co_consts]
    if constants and isinstance(constants[0], str):
        constants[0] = ""  # the docstring
    return code.co_name, code.co_code, constants, code.co_names, code.co_varnames, code.co_freevars


def _content(value: object, names: set[str], depth: int = 4) -> object:
    """All of a value that may matter to code with these ``names``, as texts in tuples:
    of modules, classes and objects, the attributes that may be asked for."""
    if isinstance(value, LaneFunction):
        return value.kinds, value.identity
    source = _source(value)
    if isinstance(source, FunctionType):
        return getattr(value, "kinds", ""), identity(source)
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest()
    if isinstance(value, (tuple, list)):
        return getattr(value, "_fields", ""), [_content(part, names, depth) for part in value]
    if isinstance(value, dict):
        return [(repr(key), _content(part, names, depth)) for key, part in value.items()]
    if value is None or isinstance(value, (int, float, str, np.generic)):
        return repr(value)
    if is_dataclass(value) and not isinstance(value, type):
        parts = {field.name: getattr(value, field.name) for field in fields(value)}
        return type(value).__qualname__, _content(parts, names, depth)
    kind = value if isinstance(value, type) or callable(value) else type(value)
    return (
        getattr(value, "__name__", ""),
        getattr(kind, "__module__", ""),
        getattr(kind, "__qualname__", ""),
        [
            (name, _content(getattr(value, name), names, depth - 1))
            for name in sorted(names)
            if depth and hasattr(value, name)
        ],
    )
