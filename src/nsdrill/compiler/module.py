"""A module of LLVM: one function with an entry, and all that it calls.

An entry has C's calling convention, of the platform: a buffer is a pointer and a
length, integers and the addresses of functions are 64-bit integers, and the result is
an integer, 0 where a function returns nothing. Any function of this convention can be
an argument of another.
"""

from __future__ import annotations

from types import FunctionType
from typing import Any

from nsdrill.compiler.functions import BUFFERS, FLOAT, FUNCTION, INTEGER
from nsdrill.compiler.ir import TYPE, Text, Value, pointer_to
from nsdrill.compiler.language import Array, FunctionArgument
from nsdrill.compiler.statements import Body

# The types of an argument of each kind: a buffer is two.
PASSED: dict[str, tuple[str, ...]] = {
    **{kind: (pointer_to(TYPE[elements]), "i64") for kind, elements in BUFFERS.items()},
    INTEGER: ("i64",),
    FLOAT: ("double",),
    FUNCTION: ("i64",),
}


class Module:
    """Writes the text of a module; vectors have at most ``width`` lanes."""

    def __init__(self, width: int) -> None:
        self.width = width
        self.parts: list[str] = []
        self.declared: dict[str, str] = {}
        self.tables: dict[str, str] = {}
        self.known: dict[int, str] = {}

    def text(self, function: FunctionType, kinds: str, symbol: str) -> str:
        """The text of the whole module, whose entry is ``function`` under the name
        ``symbol``."""
        self._define(function, kinds, symbol, "")
        constants = [f"{name} = internal constant {content}" for content, name in self.tables.items()]
        return "\n".join([*constants, *self.declared.values(), *self.parts])

    def _define(self, function: FunctionType, kinds: str, symbol: str, linkage: str) -> None:
        text = Text(self.declared, self.tables)
        arguments: list[Any] = []
        for number, kind in enumerate(kinds):
            if kind in BUFFERS:
                length = Value(f"%n{number}", "i")
                arguments.append(Array(f"%a{number}", length, BUFFERS[kind]))
            elif kind == FUNCTION:
                arguments.append(FunctionArgument(Value(f"%a{number}", "i")))
            else:
                arguments.append(Value(f"%a{number}", kind))
        Body(self, text, self.width).write(function, arguments)
        parameters = ", ".join(
            f"{t} %{name}{number}"
            for number, kind in enumerate(kinds)
            for name, t in zip("an", PASSED[kind], strict=False)
        )
        self.parts.append(f"define {linkage}i64 @{symbol}({parameters}) nounwind {{\n{text.body()}\n}}\n")

    def call_internal(self, text: Text, function: Any, kinds: str, given: list[str]) -> Value:
        """Call a compiled function, which becomes a part of this module."""
        symbol = self.known.get(id(function))
        if symbol is None:
            symbol = self.known[id(function)] = f"internal{len(self.known)}"
            self._define(function.py_func, function.kinds, symbol, "internal ")
        return text.emit(f"call i64 @{symbol}({', '.join(given)})", "i")

    def call_address(self, text: Text, address: Value, kinds: str, given: list[str]) -> Value:
        """Call the function at an address."""
        signature = f"i64 ({', '.join(t for kind in kinds for t in PASSED[kind])})"
        pointer = text.emit(
            f"inttoptr i64 {address.ref} to {signature + '*' if pointer_to('double') != 'ptr' else 'ptr'}", "p"
        )
        return text.emit(f"call {signature} {pointer.ref}({', '.join(given)})", "i")
