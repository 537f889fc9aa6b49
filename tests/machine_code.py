"""What a lane function is compiled to: the text of its module and its assembly; and
helpers compiled as functions of numbers."""

import inspect
import re
from collections.abc import Callable
from functools import cache
from typing import Any

import llvmlite.binding as llvm
import numpy as np

from nsdrill.compiler import native
from nsdrill.compiler.functions import BUFFER, compiled, define
from nsdrill.compiler.native import Module

_ARITHMETIC = r"= (?:f(?:add|sub|mul|div)|call) {} (?:@llvm\.(?:fma|sqrt)|%v|0x|<double)"
_INSTRUCTION = r"\bv(?:fn?m(?:add|sub)\d+|mul|add|sub|div|sqrt)"


def text_of(function: Any, width: int = native.WIDTH) -> str:
    """The module of a compiled function, as LLVM gets it."""
    return Module(width).text(function.py_func, function.kinds, "entry")


@cache
def machine(triple: str, processor: str = "", features: str = "") -> Any:
    """One of any platform, whatever this one is."""
    native.initialize()
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    return native.target_machine(triple, processor, features)


def assembly_of(text: str) -> str:
    """For the third version of x86, which has AVX2 and FMA."""
    target = machine("x86_64-unknown-linux-gnu", "x86-64-v3")
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = target.triple, str(target.target_data)
    native._optimise(module, target)
    return str(target.emit_assembly(module))


def packed_and_single(text: str) -> tuple[int, int]:
    """How many floating-point operations of this text work on all lanes, and how many
    on one number."""
    packed, single = (len(re.findall(_ARITHMETIC.format(kind), text)) for kind in (r"<\d+ x double>", "double"))
    return packed, single


def instructions(text: str) -> tuple[int, int]:
    """How many instructions of the machine code of a module work on registers of four
    numbers, and how many on one number."""
    assembly = assembly_of(text)
    return (
        len(re.findall(rf"{_INSTRUCTION}pd\b[^\n]*%ymm", assembly)),
        len(re.findall(rf"{_INSTRUCTION}sd\b", assembly)),
    )


def of_numbers(helper: Callable[..., Any], results: int = 1) -> Callable[..., Any]:
    """``helper``, compiled, as a function of numbers."""
    count = len(inspect.signature(helper).parameters)
    given = ", ".join(f"b[{k}]" for k in range(count))
    taken = ", ".join(f"b[{count + k}]" for k in range(results))
    text = f"def applied(b):\n    {taken} = helper({given})\n"
    function = compiled(BUFFER)(define("applied", text, helper=helper))
    b = np.zeros(count + results)

    def call(*arguments: float) -> Any:
        b[:count] = arguments
        function(b)
        return tuple(b[count:].tolist()) if results > 1 else float(b[-1])

    return call
