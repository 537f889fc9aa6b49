"""Values and the text of LLVM's intermediate representation.

A value has a kind, ``d`` (double), ``i`` (64-bit integer) or ``b`` (truth), and a
number of lanes: 0 for a scalar, else the length of a vector. No floating-point
operation has a flag, so LLVM neither reorders nor fuses: the text decides on the bits.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

TYPE = {"d": "double", "i": "i64", "b": "i1"}


@dataclass(slots=True)
class Value:
    """What an instruction gave, or a constant: its name in the text, kind and lanes."""

    ref: str
    kind: str
    lanes: int = 0


def _constant(number: float, kind: str) -> str:
    if kind == "d":
        return f"0x{struct.unpack('<Q', struct.pack('<d', number))[0]:016X}"
    if kind == "b":
        return "true" if number else "false"
    return str((int(number) + (1 << 63)) % (1 << 64) - (1 << 63))


class Text:
    """The body of one function, written instruction by instruction. ``declared`` and
    ``tables`` belong to the module, which several functions share."""

    def __init__(self, declared: dict[str, str], tables: dict[str, str]) -> None:
        self.declared, self.tables = declared, tables
        self._slots: list[str] = []
        self._lines: list[str] = []
        self._count = 0
        self.at = "entry"  # the block that is being written

    def body(self) -> str:
        return "\n".join(["entry:", *self._slots, *self._lines])

    def _name(self, prefix: str) -> str:
        self._count += 1
        return f"{prefix}{self._count}"

    def line(self, text: str) -> None:
        self._lines.append(f"  {text}")

    def emit(self, text: str, kind: str, lanes: int = 0) -> Value:
        name = self._name("%v")
        self._lines.append(f"  {name} = {text}")
        return Value(name, kind, lanes)

    # Values.
    @staticmethod
    def type_of(kind: str, lanes: int) -> str:
        return f"<{lanes} x {TYPE[kind]}>" if lanes else TYPE[kind]

    def constant(self, number: float, kind: str, lanes: int = 0) -> Value:
        one = _constant(number, kind)
        if not lanes:
            return Value(one, kind)
        return Value(f"<{', '.join([f'{TYPE[kind]} {one}'] * lanes)}>", kind, lanes)

    def integers(self, numbers: list[int]) -> Value:
        """A vector of these integers."""
        inside = ", ".join(f"i64 {_constant(number, 'i')}" for number in numbers)
        return Value(f"<{inside}>", "i", len(numbers))

    def widened(self, a: Value, lanes: int) -> Value:
        """The scalar ``a`` in every lane."""
        t = self.type_of(a.kind, lanes)
        first = self.emit(f"insertelement {t} poison, {TYPE[a.kind]} {a.ref}, i64 0", a.kind, lanes)
        return self.emit(f"shufflevector {t} {first.ref}, {t} poison, <{lanes} x i32> zeroinitializer", a.kind, lanes)

    def operation(self, name: str, *operands: Value) -> Value:
        """An instruction whose operands and result have one type."""
        a = operands[0]
        refs = ", ".join(operand.ref for operand in operands)
        return self.emit(f"{name} {self.type_of(a.kind, a.lanes)} {refs}", a.kind, a.lanes)

    def comparison(self, name: str, a: Value, b: Value) -> Value:
        instruction = "fcmp" if a.kind == "d" else "icmp"
        return self.emit(f"{instruction} {name} {self.type_of(a.kind, a.lanes)} {a.ref}, {b.ref}", "b", a.lanes)

    def selection(self, mask: Value, a: Value, b: Value) -> Value:
        t = self.type_of(a.kind, a.lanes)
        return self.emit(
            f"select {self.type_of('b', mask.lanes)} {mask.ref}, {t} {a.ref}, {t} {b.ref}", a.kind, a.lanes
        )

    def conversion(self, name: str, a: Value, kind: str) -> Value:
        return self.emit(
            f"{name} {self.type_of(a.kind, a.lanes)} {a.ref} to {self.type_of(kind, a.lanes)}", kind, a.lanes
        )

    def intrinsic(self, name: str, *operands: Value) -> Value:
        """An operation of LLVM's that is written as a call."""
        a = operands[0]
        t = self.type_of(a.kind, a.lanes)
        short = "f64" if a.kind == "d" else "i64"
        full = f"@llvm.{name}.{f'v{a.lanes}' if a.lanes else ''}{short}"
        poison = ["i1 true"] if name == "cttz" else []  # its operand is never zero
        kinds = [t] * len(operands) + [text.split()[0] for text in poison]
        self.declared[full] = f"declare {t} {full}({', '.join(kinds)})"
        given = [f"{t} {operand.ref}" for operand in operands] + poison
        return self.emit(f"call {t} {full}({', '.join(given)})", a.kind, a.lanes)

    def library(self, name: str, *operands: Value) -> Value:
        """A call of the C library, of scalars."""
        self.declared[f"@{name}"] = f"declare double @{name}({', '.join(['double'] * len(operands))})"
        given = ", ".join(f"double {operand.ref}" for operand in operands)
        return self.emit(f"call double @{name}({given})", "d")

    def bits_of(self, mask: Value) -> Value:
        """The truths of a vector as the bits of an integer, the first lane's lowest."""
        if not mask.lanes:
            return self.conversion("zext", mask, "i")
        narrow = f"i{mask.lanes}"
        bits = self.emit(f"bitcast {self.type_of('b', mask.lanes)} {mask.ref} to {narrow}", "i")
        return bits if mask.lanes == 64 else self.emit(f"zext {narrow} {bits.ref} to i64", "i")

    def merged(self, a: Value, first: str, b: Value, second: str) -> Value:
        """``a`` if the block before was ``first``, ``b`` if it was ``second``."""
        t = self.type_of(a.kind, a.lanes)
        ways = f"[ {a.ref}, %{first} ], [ {b.ref}, %{second} ]"
        return self.emit(f"phi {t} {ways}", a.kind, a.lanes)

    # Memory.
    def reserve(self, name: str, what: str) -> None:
        """Let ``name`` be the address of a place on the stack."""
        self._slots.append(f"  {name} = alloca {what}")

    def slot(self, kind: str, lanes: int = 0) -> str:
        """A place for a value on the stack, for the whole function."""
        name, t = self._name("%s"), self.type_of(kind, lanes)
        self.reserve(name, f"{t}, align {8 * max(lanes, 1)}")
        return name

    def local(self, size: int) -> str:
        """A place for so many floats, which stays in memory: it holds what there are
        too few registers for."""
        name = self._name("%s")
        self.reserve(name, f"double, i64 {size}, align 64")
        return name

    def masks(self, count: int) -> str:
        """A place for so many integers, which are 0, that can be in registers."""
        name, t = self._name("%s"), f"[{count} x i64]"
        self.reserve(name, f"{t}, align 8")
        first = self.emit(f"getelementptr inbounds {t}, ptr {name}, i64 0, i64 0", "p").ref
        for k in range(count):
            self.store(self.constant(0, "i"), self.address(first, self.constant(k, "i"), "i"))
        return first

    def address(self, pointer: str, index: Value, kind: str) -> str:
        return self.emit(f"getelementptr inbounds {TYPE[kind]}, ptr {pointer}, i64 {index.ref}", "p").ref

    def load(self, pointer: str, kind: str, lanes: int = 0) -> Value:
        align = 8 if kind != "b" else 1
        return self.emit(f"load {self.type_of(kind, lanes)}, ptr {pointer}, align {align}", kind, lanes)

    def store(self, value: Value, pointer: str) -> None:
        t = self.type_of(value.kind, value.lanes)
        self.line(f"store {t} {value.ref}, ptr {pointer}, align {8 if value.kind != 'b' else 1}")

    def table(self, numbers: list[float], kind: str, index: Value) -> Value:
        """The number at ``index`` of a table that is known."""
        t = f"[{len(numbers)} x {TYPE[kind]}]"
        content = f"{t} [{', '.join(f'{TYPE[kind]} {_constant(x, kind)}' for x in numbers)}]"
        name = self.tables.setdefault(content, f"@table{len(self.tables)}")
        where = self.emit(f"getelementptr inbounds {t}, ptr {name}, i64 0, i64 {index.ref}", "p")
        return self.load(where.ref, kind)

    # Control.
    def block(self, name: str) -> str:
        return self._name(name)

    def begin(self, label: str) -> None:
        self.at = label
        self._lines.append(f"{label}:")

    def branch(self, label: str) -> None:
        self.line(f"br label %{label}")

    def branch_if(self, condition: Value, then: str, other: str) -> None:
        self.line(f"br i1 {condition.ref}, label %{then}, label %{other}")
