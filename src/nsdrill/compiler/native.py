"""Machine code: from the text of a module to an address, by LLVM.

Few passes are better than many: LLVM's usual ones carry numbers of one loop over lanes
to the next in registers, of which there are too few. No pass reorders or fuses
floating-point operations, so neither passes nor processor nor the width of vectors
change a bit of a result.
"""

from __future__ import annotations

import os
import threading
from functools import lru_cache
from types import FunctionType

import llvmlite
import llvmlite.binding as llvm

from nsdrill.compiler import objects
from nsdrill.compiler.definitions import Definition
from nsdrill.compiler.ir import Text, Value
from nsdrill.compiler.language import Array, FunctionArgument
from nsdrill.compiler.statements import Body
from nsdrill.compiler.vocabulary import BUFFERS, FLOAT, FUNCTION, INTEGER

# Lanes in a vector. LLVM divides it into registers, whose instructions then alternate.
WIDTH = 16
lock = threading.RLock()  # the engine's
_engine: llvm.ExecutionEngine | None = None


def initialize() -> None:
    for name in ("initialize", "initialize_native_target", "initialize_native_asmprinter"):
        try:
            getattr(llvm, name)()
        except (AttributeError, RuntimeError):  # newer ones need or have no initialize()
            continue


@lru_cache(maxsize=1)
def host() -> tuple[str, str, str]:
    """The triple of this platform, its processor and the features of that."""
    initialize()
    triple = llvm.get_process_triple()
    if os.name == "nt":  # the loader of objects knows no other format there
        triple += "-elf"
    return triple, llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


def target_machine(triple: str, processor: str, features: str) -> llvm.TargetMachine:
    return llvm.Target.from_triple(triple).create_target_machine(
        cpu=processor, features=features, opt=2, reloc="static", codemodel="jitdefault"
    )


@lru_cache(maxsize=1)
def host_machine() -> llvm.TargetMachine:
    return target_machine(*host())


def versions() -> str:
    """All that determines the machine code besides the text."""
    return " ".join((llvmlite.__version__, *map(str, llvm.llvm_version_info), *host()))


def object_code(text: str, machine: llvm.TargetMachine | None = None) -> bytes:
    """The object file of a module, for this processor unless another ``machine`` is
    given."""
    with lock:
        machine = machine or host_machine()
        module = llvm.parse_assembly(text)
        module.triple, module.data_layout = machine.triple, str(machine.target_data)
        module.verify()  # a pass ends the process where something is wrong
        _optimise(module, machine)
        return bytes(machine.emit_object(module))


def _optimise(module: llvm.ModuleRef, machine: llvm.TargetMachine) -> None:
    options = llvm.create_pipeline_tuning_options(1)
    options.loop_vectorization = options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    manager = llvm.create_new_module_pass_manager()
    manager.add_sroa_pass()
    manager.add_instruction_combine_pass()
    manager.add_simplify_cfg_pass()
    manager.run(module, builder)


@lru_cache(maxsize=1)
def _nothing() -> bytes:
    """An object of this processor and system without any function."""
    with lock:
        module = llvm.parse_assembly("")
        module.triple = host_machine().triple
        return bytes(host_machine().emit_object(module))


def address_of(code: bytes, symbol: str) -> int:
    """Load an object file into this process; the address of its function ``symbol``.
    ValueError if it is no such object."""
    global _engine
    with lock:
        if _engine is None:
            _engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), host_machine())
        for name in objects.check(code, symbol, _nothing()):
            if llvm.address_of_symbol(name) is None:
                raise ValueError(f"it needs {name}, which this system does not have")
        _engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        _engine.finalize_object()
        return int(_engine.get_function_address(symbol))


# A module of LLVM: one function with an entry, and all that it calls.
# An entry has C's calling convention, of the platform: a buffer is a pointer and a
# length, integers and the addresses of functions are 64-bit integers, and the result is
# an integer, 0 where a function returns nothing. Any function of this convention can be
# an argument of another.


# The types of an argument of each kind: a buffer is two.
PASSED: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(BUFFERS, ("ptr", "i64")),
    INTEGER: ("i64",),
    FLOAT: ("double",),
    FUNCTION: ("i64",),
}


class Module:
    """Writes the text of a module; vectors have at most ``width`` lanes."""

    text_type, body_type, attributes = Text, Body, "nounwind"

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
        text = self.text_type(self.declared, self.tables)
        arguments: list[object] = []
        for number, kind in enumerate(kinds):
            if kind in BUFFERS:
                length = Value(f"%n{number}", "i")
                arguments.append(Array(f"%a{number}", length, BUFFERS[kind]))
            elif kind == FUNCTION:
                arguments.append(FunctionArgument(Value(f"%a{number}", "i")))
            else:
                arguments.append(Value(f"%a{number}", kind))
        self.body_type(self, text, self.width).write(function, arguments)
        parameters = ", ".join(
            f"{t} %{name}{number}"
            for number, kind in enumerate(kinds)
            for name, t in zip("an", PASSED[kind], strict=False)
        )
        self.parts.append(f"define {linkage}i64 @{symbol}({parameters}) {self.attributes} {{\n{text.body()}\n}}\n")

    def call_internal(self, text: Text, function: Definition, given: list[str]) -> Value:
        """Call a compiled function, which becomes a part of this module."""
        symbol = self.known.get(id(function))
        if symbol is None:
            symbol = self.known[id(function)] = f"internal{len(self.known)}"
            self._define(function.py_func, function.kinds, symbol, "internal ")
        return text.emit(f"call i64 @{symbol}({', '.join(given)})", "i")

    def call_address(self, text: Text, address: Value, kinds: str, given: list[str]) -> Value:
        """Call the function at an address."""
        signature = f"i64 ({', '.join(t for kind in kinds for t in PASSED[kind])})"
        pointer = text.emit(f"inttoptr i64 {address.ref} to ptr", "p")
        return text.emit(f"call {signature} {pointer.ref}({', '.join(given)})", "i")
