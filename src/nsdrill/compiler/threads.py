"""A function of the lane language for devices on which each thread has one lane: scalars
instead of vectors, and one piece of code without calls, in which the lane buffer can be
in registers.

The operations are those of the function for vectors, in the same order, so the bits are
the same. The same module is made for this processor, where threads run one after the
other, for GPUs of NVIDIA, as PTX, which their driver compiles, and for those of AMD.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from nsdrill.cache import load, save
from nsdrill.compiler import identity, native
from nsdrill.compiler.functions import BUFFERS, INTEGER, LaneFunction, anew, claim, compiling
from nsdrill.compiler.ir import TYPE, Text, Value
from nsdrill.compiler.language import Array, Refusal
from nsdrill.compiler.native import Module
from nsdrill.compiler.statements import Body
from nsdrill.records import dataclass

ENTRY = "run_thread"  # the kernel's name
BLOCK = 128  # threads that a device begins together
# Code of the oldest GPU of NVIDIA that can run it, of 2017; drivers compile it for theirs.
OLDEST = "sm_70"
_addresses: dict[str, int] = {}


class Scalars(Text):
    """Writes vectors of one lane as scalars."""

    registers = "r"  # how LLVM names those for integers

    @staticmethod
    def type_of(kind: str, lanes: int) -> str:
        return TYPE[kind]

    def constant(self, number: float, kind: str, lanes: int = 0) -> Value:
        return Value(super().constant(number, kind).ref, kind, lanes)

    def integers(self, numbers: list[int]) -> Value:
        (number,) = numbers
        return self.constant(number, "i", 1)

    def widened(self, a: Value, lanes: int) -> Value:
        return Value(a.ref, a.kind, lanes)

    def bits_of(self, mask: Value) -> Value:
        return super().bits_of(Value(mask.ref, mask.kind))

    def intrinsic(self, name: str, *operands: Value) -> Value:
        made = super().intrinsic(name, *(Value(a.ref, a.kind) for a in operands))
        return Value(made.ref, made.kind, operands[0].lanes)

    def claim(self, counter: str, count: Value) -> Value:
        """What a counter was before ``count`` was added to it, in one step."""
        return self.emit(f"atomicrmw add ptr {counter}, i64 {count.ref} monotonic", "i")

    def anew(self, a: Value) -> Value:
        """The same integer, of which LLVM does not know that it is the same."""
        return self.emit(f'call i64 asm sideeffect "", "={self.registers},0"(i64 {a.ref})', "i")

    def library(self, name: str, *operands: Value) -> Value:
        raise Refusal(
            f"{name} is a function of the C library, which a GPU does not have; allowed: the functions of "
            "nsdrill.elementary"
        )


class ThreadBody(Body):
    """Writes out all loops whose number of turns is known: a place in the lane buffer
    that is known can be a register. It knows the words of threads, ``claim`` and
    ``anew``, and calls functions that are not arguments but known."""

    unrolled = 1 << 14
    text: Scalars

    def call_argument(self, function: Any, arguments: list[object]) -> Value:
        if hasattr(function, "kinds"):
            return self.call_compiled(function, arguments)
        return super().call_argument(function, arguments)

    def _builtin(self, f: Any, arguments: list[Any]) -> object:
        if f is claim:
            counters, place, count = arguments
            if not isinstance(counters, Array) or counters.kind != INTEGER:
                raise Refusal("claim is of a counter in a buffer of integers")
            return self.text.claim(self.place(counters, place)[0], self.value(count, "i", wide=False))
        if f is anew:
            return self.text.anew(self.value(arguments[0], "i", wide=False))
        return super()._builtin(f, arguments)


class NvidiaScalars(Scalars):
    """With ``r`` an integer of 64 bits would lose half of them."""

    registers = "l"


class AmdScalars(Scalars):
    """On AMD's GPUs the stack is a memory of its own, and the registers of a thread have
    a name of their own."""

    registers = "v"

    def reserve(self, name: str, what: str) -> None:
        self._slots.append(f"  {name}.own = alloca {what}, addrspace(5)")
        self._slots.append(f"  {name} = addrspacecast ptr addrspace(5) {name}.own to ptr")


@dataclass(frozen=True)
class Target:
    """A kind of device: LLVM's triple and processor, how a kernel is declared, and the
    functions that give the number of a thread's block and its place in it."""

    triple: str
    processor: str
    kernel: str
    block: str
    place: str
    text_type: type[Scalars]
    attributes: str = ""


NVIDIA = Target(
    "nvptx64-nvidia-cuda", OLDEST, "ptx_kernel", "llvm.nvvm.read.ptx.sreg.ctaid.x", "llvm.nvvm.read.ptx.sreg.tid.x",
    NvidiaScalars,
)  # fmt: skip
AMD = Target(
    "amdgcn-amd-amdhsa", "gfx90a", "amdgpu_kernel", "llvm.amdgcn.workgroup.id.x", "llvm.amdgcn.workitem.id.x",
    AmdScalars, f'"amdgpu-flat-work-group-size"="{BLOCK},{BLOCK}"',
)  # fmt: skip


class ThreadModule(Module):
    """Writes the module of a function with one lane, of which LLVM makes one piece: for
    this processor, unless it is for a ``target``."""

    body_type, attributes = ThreadBody, "nounwind alwaysinline"

    def __init__(self, target: Target | None = None) -> None:
        super().__init__(1)
        self.target = target
        self.text_type = target.text_type if target else Scalars

    def kernel(self, function: LaneFunction) -> str:
        """The text of the module of a kernel whose threads run ``function``. Its last
        argument is the number of the thread, which the device knows; that before it
        is the number of threads."""
        assert self.target is not None
        self._define(function.py_func, function.kinds, "thread", "internal ")
        constants = [f"{name} = internal constant {content}" for content, name in self.tables.items()]
        return "\n".join([*constants, *self.declared.values(), *self.parts, _kernel(function.kinds, self.target)])


def _kernel(kinds: str, target: Target) -> str:
    """The kernel: its arguments are those of the function without the last."""
    taken, cast, given = [], [], []
    for number, kind in enumerate(kinds[:-1]):
        if kind in BUFFERS:
            taken += [f"ptr addrspace(1) %g{number}", f"i64 %n{number}"]
            cast.append(f"  %a{number} = addrspacecast ptr addrspace(1) %g{number} to ptr")
            given += [f"ptr %a{number}", f"i64 %n{number}"]
        else:
            taken.append(f"i64 %a{number}")
            given.append(f"i64 %a{number}")
    return "\n".join(
        [
            f"declare i32 @{target.block}()",
            f"declare i32 @{target.place}()",
            f"define {target.kernel} void @{ENTRY}({', '.join(taken)}) nounwind {target.attributes} {{",
            "entry:",
            *cast,
            f"  %block = call i32 @{target.block}()",
            f"  %first = mul i32 %block, {BLOCK}",
            f"  %place = call i32 @{target.place}()",
            "  %small = add i32 %first, %place",
            "  %number = zext i32 %small to i64",
            f"  %is_one = icmp slt i64 %number, %a{len(kinds) - 2}",
            "  br i1 %is_one, label %work, label %done",
            "work:",
            f"  %nothing = call i64 @thread({', '.join([*given, 'i64 %number'])})",
            "  br label %done",
            "done:",
            "  ret void",
            "}",
        ]
    )


@cache
def _machine(target: Target) -> llvm.TargetMachine:
    for name in ("initialize_all_targets", "initialize_all_asmprinters"):
        getattr(llvm, name)()
    return llvm.Target.from_triple(target.triple).create_target_machine(cpu=target.processor, opt=3)


def _optimised(text: str, machine: llvm.TargetMachine, level: int) -> llvm.ModuleRef:
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    module.verify()
    options = llvm.create_pipeline_tuning_options(level)
    options.loop_vectorization = options.slp_vectorization = False
    options.loop_unrolling = False  # the code is short of room in the cache of instructions
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return module


def assembly(function: LaneFunction, target: Target = NVIDIA) -> str:
    """The text of the kernel of ``function`` in the language of a target's assembler:
    for GPUs of NVIDIA in PTX, which their driver compiles."""
    with native.lock:
        key = identity.key(function, llvmlite.__version__, *llvm.llvm_version_info, target)
        name = f"{function.__name__[:60]}-{key}"
        if (found := load(name, bytes.decode)) is None:
            with compiling.function():
                machine = _machine(target)
                found = machine.emit_assembly(_optimised(ThreadModule(target).kernel(function), machine, 3))
            save(name, found.encode())
    return str(found)


def address(function: LaneFunction) -> int:
    """The address of ``function``, of one thread, as machine code of this processor."""
    with native.lock:
        key = identity.key(function, native.versions(), "threads")
        name, symbol = f"{function.__name__[:60]}-{key}", f"threads_{key}"
        if (found := _addresses.get(key) or load(name, lambda code: native.address_of(code, symbol))) is None:
            with compiling.function():
                text = ThreadModule().text(function.py_func, function.kinds, symbol)
                code = bytes(native.host_machine().emit_object(_optimised(text, native.host_machine(), 1)))
                save(name, code)
            found = native.address_of(code, symbol)
        _addresses[key] = found
        return int(found)
