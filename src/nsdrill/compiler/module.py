"""A module of LLVM: one function with an entry, and all that it calls.

An entry has C's calling convention, of the platform: a buffer is a pointer and a
length, integers and the addresses of functions are 64-bit integers, and the result is
an integer, 0 where a function returns nothing. Any function of this convention can be
an argument of another.
"""

from __future__ import annotations

from types import FunctionType
from typing import Any

from nsdrill.compiler.functions import BUFFER, FLOAT, FUNCTION, INTEGER
from nsdrill.compiler.ir import Text, Value, pointer_to
from nsdrill.compiler.language import Array, FunctionArgument
from nsdrill.compiler.statements import Body

PARAMETERS = {BUFFER: f"{pointer_to('double')} %a{{0}}, i64 %n{{0}}", INTEGER: "i64 %a{0}",
              FLOAT: "double %a{0}", FUNCTION: "i64 %a{0}"}  # fmt: skip
PASSED = {BUFFER: f"{pointer_to('double')}, i64", INTEGER: "i64", FLOAT: "double", FUNCTION: "i64"}
C_TYPES = {"d": "double", "i": "i64"}


class Module:
    """Writes the text of a module; vectors have at most ``width`` lanes."""

    def __init__(self, width: int) -> None:
        self.width, self.pointer = width, pointer_to("double")
        self.parts: list[str] = []
        self.declared: dict[str, str] = {}
        self.tables: dict[str, str] = {}
        self.known: dict[int, str] = {}

    def text(self, function: FunctionType, kinds: str, symbol: str) -> str:
        """The text of the whole module, whose entry is ``function`` under the name
        ``symbol``."""
        self._define(function, kinds, symbol, "")
        constants = [
            f"{name} = internal constant {content}" for content, name in self.tables.items()
        ]
        return "\n".join([*constants, *self.declared.values(), *self.parts])

    def _define(self, function: FunctionType, kinds: str, symbol: str, linkage: str) -> None:
        text = Text(self.declared, self.tables)
        arguments: list[Any] = []
        for number, kind in enumerate(kinds):
            if kind == BUFFER:
                arguments.append(Array(f"%a{number}", Value(f"%n{number}", "i")))
            elif kind == FUNCTION:
                arguments.append(FunctionArgument(Value(f"%a{number}", "i")))
            else:
                arguments.append(Value(f"%a{number}", kind))
        Body(self, text, self.width).write(function, arguments)
        parameters = ", ".join(PARAMETERS[kind].format(number) for number, kind in enumerate(kinds))
        self.parts.append(
            f"define {linkage}i64 @{symbol}({parameters}) nounwind {{\n{text.body()}\n}}\n"
        )

    def call_internal(self, text: Text, function: Any, kinds: str, given: list[str]) -> Value:
        """Call a compiled function, which becomes a part of this module."""
        symbol = self.known.get(id(function))
        if symbol is None:
            symbol = self.known[id(function)] = f"internal{len(self.known)}"
            self._define(function.py_func, function.kinds, symbol, "internal ")
        return text.emit(f"call i64 @{symbol}({', '.join(given)})", "i")

    def call_address(self, text: Text, address: Value, kinds: str, given: list[str]) -> Value:
        """Call the function at an address."""
        signature = f"i64 ({', '.join(PASSED[kind] for kind in kinds)})"
        pointer = text.emit(
            f"inttoptr i64 {address.ref} to {signature + '*' if pointer_to('double') != 'ptr' else 'ptr'}",
            "p",
        )
        return text.emit(f"call {signature} {pointer.ref}({', '.join(given)})", "i")
