"""Calls of the lane language, as instructions: of its own functions, of compiled ones and
of helpers, which are written out."""

from __future__ import annotations

import ast
import inspect
import math
from collections.abc import Hashable
from functools import lru_cache
from types import FunctionType
from typing import Any, NamedTuple, Protocol

import numpy as np

from nsdrill.compiler.definitions import Definition
from nsdrill.compiler.expressions import OPERATIONS, SUM, Expressions, described
from nsdrill.compiler.ir import Text, Value
from nsdrill.compiler.language import RUNTIME, Array, FunctionArgument, Masks, Refusal, Scope, definition, plain
from nsdrill.compiler.vocabulary import (
    BUFFER,
    FLOAT,
    FUNCTION,
    INTEGER,
    INTEGERS,
    bits_float,
    call,
    float_bits,
    fma,
    local,
    lowest_bit,
    masks,
)

CALLS = (
    "arithmetic, np.sqrt, np.floor, np.rint, min, max, abs, the functions of nsdrill.elementary and plain "
    "functions of this language; of scalars also sin, cos, exp, log, atan2, hypot and fmod of math"
)
# Functions of one number that are instructions of LLVM, with the kind of that number; and
# functions of the C library, for scalars.
INSTRUCTIONS = {
    np.sqrt: ("sqrt", "d"), math.sqrt: ("sqrt", "d"), np.floor: ("floor", "d"), np.rint: ("rint", "d"),
    abs: ("fabs", "d"), lowest_bit: ("cttz", "i"),
}  # fmt: skip
LIBRARY = {
    math.atan2: "atan2", np.arctan2: "atan2", math.hypot: "hypot", np.hypot: "hypot",
    math.sin: "sin", np.sin: "sin", math.cos: "cos", np.cos: "cos", math.exp: "exp", np.exp: "exp",
    math.log: "log", np.log: "log", math.fmod: "fmod", np.fmod: "fmod",
}  # fmt: skip


class Callees(Protocol):
    """The module of which a text is a part: it calls other functions."""

    def call_internal(self, text: Text, function: Definition, given: list[str]) -> Value: ...

    def call_address(self, text: Text, address: Value, kinds: str, given: list[str]) -> Value: ...


class Returned(NamedTuple):
    """How a body ended: by a return with this value, or (``jumped``) by an instruction
    that goes elsewhere."""

    value: object = None
    jumped: bool = False


JUMPED = Returned(jumped=True)


class Calls(Expressions):
    """Writes calls into the text of a function of ``module``."""

    def __init__(self, module: Callees, text: Text) -> None:
        self.module, self.text = module, text
        self.lane_count = 0
        self.loops: list[tuple[str, str] | None] = []  # labels of the next turn and of the end
        self.outermost: FunctionType | None = None
        self.inlining: list[FunctionType] = []

    def run(self, body: list[ast.stmt], scope: Scope) -> Returned | None:
        """Write statements: None where the next one follows, or how the body ended."""
        raise NotImplementedError

    def eval_Call(self, node: ast.Call, scope: Scope) -> object:
        function: Any = self.eval(node.func, scope)
        if function is tuple and len(node.args) == 1 and isinstance(node.args[0], ast.GeneratorExp):
            return self.each(node.args[0], scope)
        arguments = list(self.parts(node.args, scope))
        named = {str(k.arg): self.eval(k.value, scope) for k in node.keywords}
        if function is call:
            return self.call_argument(arguments[0], arguments[1:])
        found = self._builtin(function, arguments)
        if found is not NotImplemented:
            return found
        if hasattr(function, "kinds"):  # made by ``compiled``
            return self.call_compiled(function, arguments)
        source = getattr(function, "py_func", function)
        if isinstance(source, FunctionType):
            return self.inline(source, arguments, named)
        if any(_has_runtime(a) for a in (*arguments, *named.values())):
            raise Refusal(
                f"a call of {described(function)} is not in the language of compiled functions; "
                f"allowed: {SUM if function is sum else CALLS}"
            )
        return plain(function(*arguments, **named))

    def _builtin(self, f: Any, arguments: list[Any]) -> object:
        """The result of a function of the language, or NotImplemented."""
        known = not any(_has_runtime(a) for a in arguments)
        if f is fma:
            wide = any(isinstance(a, Value) and a.lanes for a in arguments)
            return self.text.intrinsic("fma", *(self.value(a, "d", wide=wide) for a in arguments))
        if f is local and known:
            return Array(self.text.local(arguments[0]), self.value(arguments[0], "i"))
        if f is masks:
            if not known:
                raise Refusal("masks(n) has a number that is known")
            return Masks(self.text.masks(arguments[0]), self.text.constant(arguments[0], "i"), INTEGER)
        if f in (min, max) and len(arguments) > 1 and not known:
            return self._extreme(ast.Gt if f is max else ast.Lt, arguments)
        if known:
            return NotImplemented
        first = arguments[0]
        if f is len:
            if not isinstance(first, (Array, tuple)):
                raise Refusal("one value has no length; allowed: a buffer or a tuple")
            return first.length if isinstance(first, Array) else len(first)
        if f is float_bits:
            return self.text.conversion("bitcast", self.value(first, "d", wide=False), "i")
        if f is bits_float:
            return self.text.conversion("bitcast", self.value(first, "i", wide=False), "d")
        if f in (float, np.float64, int):
            return self._converted(first, "i" if f is int else "d")
        is_hashable = isinstance(f, Hashable)
        if is_hashable and f in INSTRUCTIONS:
            name, kind = INSTRUCTIONS[f]
            return self.text.intrinsic(name, self.value(first, kind, wide=False))
        if is_hashable and f in LIBRARY:
            values = [self.value(a, "d", wide=False) for a in arguments]
            if any(v.lanes for v in values) or self.lane_count:
                raise Refusal(
                    f"{f.__name__} is a call of the C library, one lane at a time; allowed: the functions of "
                    "nsdrill.elementary, or a loop over range(W)"
                )
            return self.text.library(LIBRARY[f], *values)
        return NotImplemented

    def _extreme(self, op: type, arguments: list[object]) -> object:
        best = arguments[0]
        for other in arguments[1:]:
            other, best = self.pair(other, best)
            best = self.text.selection(
                self.text.comparison(OPERATIONS[op].instructions[best.kind], other, best), other, best
            )
        return best

    def _converted(self, v: object, kind: str) -> Value:
        made = self.value(v, wide=False)
        if made.kind == kind:
            return made
        name = {("i", "d"): "sitofp", ("b", "d"): "uitofp", ("d", "i"): "fptosi", ("b", "i"): "zext"}
        return self.text.conversion(name[made.kind, kind], made, kind)

    def inline(self, function: FunctionType, arguments: list[object], named: dict[str, object]) -> object:
        if function in self.inlining:
            raise Refusal(f"{function.__name__} calls itself; allowed: a loop")
        outermost, loops = self.outermost, self.loops
        self.outermost, self.loops = None, []
        self.inlining.append(function)
        result = self.entered(function, arguments, named)
        self.inlining.pop()
        self.outermost, self.loops = outermost, loops
        return result.value if result is not None else None

    def entered(self, function: FunctionType, arguments: list[object], named: dict[str, object]) -> Returned | None:
        scope, code = Scope(function), function.__code__
        if (
            len(arguments) == code.co_argcount
            and not named
            and not code.co_flags & _STARS
            and not code.co_kwonlyargcount
        ):
            scope.names.update(zip(code.co_varnames, arguments, strict=False))
        else:
            try:
                bound = _signature(function).bind(*arguments, **named)
            except TypeError as error:
                raise Refusal(f"{function.__name__} is called with other arguments: {error}") from None
            bound.apply_defaults()
            scope.names.update(bound.arguments)
        return self.run(definition(function).body, scope)

    def call_argument(self, function: object, arguments: list[object]) -> Value:
        if not isinstance(function, FunctionArgument):
            raise Refusal("the first argument of call is a function that is an argument")
        if self.lane_count:
            raise Refusal("a function is called in a loop over lanes, where helpers are inlined")
        kinds, given = self._passed(arguments, None)
        return self.module.call_address(self.text, function.address, kinds, given)

    def call_compiled(self, function: Definition, arguments: list[object]) -> Value:
        if self.lane_count:
            raise Refusal(f"{function.__name__} is called in a loop over lanes, where helpers are inlined")
        _, given = self._passed(arguments, function)
        return self.module.call_internal(self.text, function, given)

    def _passed(self, arguments: list[object], function: Definition | None) -> tuple[str, list[str]]:
        """Arguments of a call: their kinds, and their text."""
        name, wanted = (function.__name__, function.kinds) if function else ("", "?" * len(arguments))
        if len(wanted) != len(arguments):
            raise Refusal(f"{name} takes {len(wanted)} arguments and is given {len(arguments)}")
        kinds, given = "", []
        for argument, kind in zip(arguments, wanted, strict=True):
            if isinstance(argument, Array):
                found = BUFFER if argument.kind == FLOAT else INTEGERS
                texts = [f"ptr {argument.ref}", f"i64 {argument.length.ref}"]
            elif isinstance(argument, FunctionArgument):
                found, texts = FUNCTION, [f"i64 {argument.address.ref}"]
            else:
                value = self.value(argument, kind if kind in (INTEGER, FLOAT) else "", wide=False)
                if value.kind == "b":
                    raise Refusal("a truth is no argument of a function; allowed: int(x)")
                found, texts = (value.kind, [f"{'double' if value.kind == 'd' else 'i64'} {value.ref}"])
            if kind != "?" and found != kind:
                raise Refusal(f"{name} is called with another kind of argument than it has")
            kinds += found
            given += texts
        return kinds, given


def _has_runtime(v: object) -> bool:
    return isinstance(v, RUNTIME) or (isinstance(v, tuple) and any(_has_runtime(part) for part in v))


_STARS = inspect.CO_VARARGS | inspect.CO_VARKEYWORDS
_signature = lru_cache(maxsize=4096)(inspect.signature)
