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
from typing import Any

import llvmlite
import llvmlite.binding as llvm

from nsdrill.compiler.ir import TYPED_POINTERS

# Lanes in a vector. LLVM divides it into registers, whose instructions then alternate.
WIDTH = 16
lock = threading.RLock()  # the engine's
_engine: Any = None


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


def target_machine(triple: str, processor: str, features: str) -> Any:
    return llvm.Target.from_triple(triple).create_target_machine(
        cpu=processor, features=features, opt=2, reloc="static", codemodel="jitdefault"
    )


@lru_cache(maxsize=1)
def host_machine() -> Any:
    return target_machine(*host())


def versions() -> str:
    """All that determines the machine code besides the text."""
    return " ".join((llvmlite.__version__, *map(str, llvm.llvm_version_info), *host()))


def object_code(text: str, machine: Any = None) -> bytes:
    """The object file of a module, for this processor unless another ``machine`` is
    given."""
    with lock:
        machine = machine or host_machine()
        module = llvm.parse_assembly(text)
        module.triple, module.data_layout = machine.triple, str(machine.target_data)
        module.verify()  # a pass ends the process where something is wrong
        _optimise(module, machine)
        return bytes(machine.emit_object(module))


def _optimise(module: Any, machine: Any) -> None:
    options = llvm.create_pipeline_tuning_options(1)
    options.loop_vectorization = options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    if TYPED_POINTERS or not hasattr(llvm.ModulePassManager, "add_sroa_pass"):
        manager = builder.getModulePassManager()
    else:
        manager = llvm.create_new_module_pass_manager()
        manager.add_sroa_pass()
        manager.add_instruction_combine_pass()
        manager.add_simplify_cfg_pass()
    manager.run(module, builder)


def address_of(code: bytes, symbol: str) -> int:
    """Load an object file into this process; the address of its function ``symbol``.
    ValueError if it is no such object."""
    global _engine
    if symbol.encode() not in code:  # nor may it be an object: LLVM does not check that
        raise ValueError("it is the code of no function of this name")
    with lock:
        if _engine is None:
            _engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), host_machine())
        _engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        _engine.finalize_object()
        return int(_engine.get_function_address(symbol))
