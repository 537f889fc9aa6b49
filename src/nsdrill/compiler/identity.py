"""What a compiled function is: a text that determines its machine code.

A function of the lane language is identified by what Python has made of it and of all
that it refers to, which costs less than writing its code, as long as all of that is
*plain*: numbers, texts, tuples, lists, dictionaries and tables of them, plain
functions, modules, and functions of Python and numpy that have no state. Anything else,
such as an object with methods, can hide a number where only the compiler finds it.
Such a function is identified by its module of LLVM, which is written for that purpose.

Nothing found here is remembered: what a function refers to may change.
"""

from __future__ import annotations

import builtins
import hashlib
import math
import re
import sys
from collections import namedtuple
from collections.abc import Set
from functools import cache
from pathlib import Path
from types import BuiltinFunctionType, CodeType, FunctionType, ModuleType

import numpy as np

from nsdrill.compiler import native, vocabulary
from nsdrill.compiler.definitions import Definition, Source
from nsdrill.compiler.language import parts_of
from nsdrill.errors import InputError

# Functions of Python whose result depends on their arguments alone, and types that are
# called like them.
PURE = (
    *(abs, all, any, bool, divmod, enumerate, float, int, len, list, max, min, pow, range, reversed, round, sum),
    *(tuple, zip, np.float64, np.int64, np.empty, np.zeros, np.max, np.min, np.sum, np.any, np.all, np.round),
)
_NUMBERS = (bool, int, float, complex, str, bytes, range)
_OF_NAMEDTUPLES = set(vars(namedtuple("_", ())))


class Unidentified(Exception):
    """Something that is not plain."""


def key(function: Definition, *others: object) -> str:
    """A digest of all that determines the machine code of ``function``: what it is, the
    compiler with its versions, and ``others``."""
    try:
        found: object = Identities().of(function)
    except (Unidentified, RecursionError):
        found = native.Module(native.WIDTH).text(function.py_func, function.kinds, "entry")
    text = repr((_compiler(), function.kinds, found, *others))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


@cache
def _compiler() -> str:
    """A digest of the compiler and of the versions that change what it is given."""
    digest = hashlib.sha256(f"{sys.version} numpy {np.__version__}".encode())
    for file in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(file.read_bytes())
    return digest.hexdigest()


class Identities:
    """The identities of functions at one time."""

    def __init__(self) -> None:
        self._known: dict[FunctionType, str] = {}
        self._begun: list[FunctionType] = []

    def of(self, function: Definition | FunctionType) -> tuple[str, str]:
        """The kinds of the arguments and a digest of the function and of all that it
        refers to. :class:`Unidentified` where some of that is not plain."""
        if isinstance(function, Definition):
            if function.source is not None:
                return function.kinds, self._digest_of_text(function.source)
            return function.kinds, self._digest(function.py_func)
        return "", self._digest(function)

    def _digest_of_text(self, source: Source) -> str:
        words = set(re.findall(r"\w+", source.text)) & source.namespace.keys()
        called = set(re.findall(r"\b(\w+)\(", source.text)) - source.namespace.keys()
        attributes = set(re.findall(r"\.(\w+)", source.text))
        space = {**vars(builtins), **source.namespace}
        referred = [
            (name, self._content(space[name], attributes)) for name in sorted(words | called & vars(builtins).keys())
        ]
        return hashlib.sha256(repr((source.name, source.text, referred)).encode()).hexdigest()

    def _digest(self, function: FunctionType) -> str:
        if function in self._known:
            return self._known[function]
        if function in self._begun:
            raise InputError(f"{function.__name__} calls itself through another function; allowed: a loop.")
        self._begun.append(function)
        names, parts = _of_code(function.__code__)
        space = function.__globals__
        referred = {name: space[name] for name in names if name in space}
        cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
        referred |= {name: cell.cell_contents for name, cell in cells}
        referred |= {name: vars(builtins)[name] for name in names if name not in referred and name in vars(builtins)}
        found = (
            parts,
            [
                (name, self._content(value, names))
                for name, value in sorted(referred.items())
                if getattr(value, "_function", value) is not function  # its own name
            ],
            self._content((function.__defaults__, function.__kwdefaults__), names),
        )
        self._begun.pop()
        self._known[function] = hashlib.sha256(repr(found).encode()).hexdigest()
        return self._known[function]

    def _content(self, value: object, names: Set[str]) -> object:
        """All of a value that may matter to code with these ``names``, as texts in
        tuples."""
        kind = type(value)
        if value is None or kind in _NUMBERS:
            return repr(value)
        if isinstance(value, FunctionType):
            if value.__globals__ is vars(vocabulary):
                return "a word of the language", value.__name__
            return self.of(value), self._content(vars(value), names)
        if isinstance(value, Definition):
            return self.of(value)
        if kind in (tuple, list) or _is_plain_namedtuple(kind):
            return getattr(kind, "_fields", ""), [self._content(part, names) for part in value]  # type: ignore[attr-defined]
        if kind is frozenset:
            return sorted(repr(self._content(part, names)) for part in value)  # type: ignore[attr-defined]
        if kind is dict:
            return [(self._content(k, names), self._content(v, names)) for k, v in value.items()]  # type: ignore[attr-defined]
        if isinstance(value, (np.ndarray, np.generic)) and kind.__module__ == "numpy" and value.dtype.kind in "biufc":
            return kind.__name__, value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest()
        if isinstance(value, ModuleType):
            return [(name, self._content(vars(value)[name], names)) for name in sorted(names & vars(value).keys())]
        if _is_stateless(value):
            return "stateless", value.__name__  # type: ignore[attr-defined]
        raise Unidentified


_codes: dict[int, tuple[CodeType, frozenset[str], str]] = {}  # by the code, which is kept


def _of_code(code: CodeType) -> tuple[frozenset[str], str]:
    """The names in a code, and all that it does, as a text; neither changes."""
    known = _codes.get(id(code))
    if known is None:
        text = hashlib.sha256(repr(parts_of(code)).encode()).hexdigest()
        known = _codes[id(code)] = code, frozenset(_names(code)), text
    return known[1:]


def _names(code: CodeType) -> set[str]:
    inner = (constant for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*map(_names, inner))


def _is_plain_namedtuple(kind: type) -> bool:
    """Whether a tuple's fields are all that its class adds."""
    fields = getattr(kind, "_fields", None)
    return kind.__base__ is tuple and fields is not None and vars(kind).keys() - set(fields) <= _OF_NAMEDTUPLES


def _is_stateless(value: object) -> bool:
    """Whether this is a function of Python or numpy that always does the same."""
    if isinstance(value, BuiltinFunctionType) and value.__module__ == "math":
        return getattr(math, value.__name__, None) is value
    if isinstance(value, np.ufunc):
        return getattr(np, value.__name__, None) is value
    return any(value is one for one in PURE)
