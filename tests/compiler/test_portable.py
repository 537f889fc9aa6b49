"""The same text becomes machine code of other platforms, and of other processors the
same bits."""

import platform
from itertools import count

import llvmlite.binding as llvm
import pytest
from machine_code import machine, text_of

from nsdrill.compiler import native
from nsdrill.compiler.functions import LaneFunction
from nsdrill.compiler.native import Module
from nsdrill.kernel.loop import make_advance
from nsdrill.observe import motion

from .oracle import functions_of, outcomes, works
from .running import bits

LINUX = "x86_64-unknown-linux-gnu"
# The triple, the processor, and what the object files begin with.
PLATFORMS = {
    "arm, Linux": ("aarch64-unknown-linux-gnu", "cortex-a72", b"\x7fELF"),
    "arm, macOS": ("arm64-apple-darwin", "apple-m1", b"\xcf\xfa\xed\xfe"),
    "x86, Windows": ("x86_64-pc-windows-msvc-elf", "x86-64-v3", b"\x7fELF"),
    "any x86": (LINUX, "x86-64", b"\x7fELF"),
    "x86 with AVX2": (LINUX, "x86-64-v3", b"\x7fELF"),
    "x86 with AVX-512": (LINUX, "x86-64-v4", b"\x7fELF"),
}
NEEDED = {"x86-64": (), "x86-64-v3": ("avx2", "fma"), "x86-64-v4": ("avx512f", "avx512dq", "avx512vl")}
# Loops over arrays.
PLAIN = {"advance": make_advance(), "period": motion._make_period(), "displacement": motion._make_displacement()}
_numbers = count()


@pytest.mark.parametrize("name", PLATFORMS)
def test_there_is_code_for_every_platform(name):
    triple, processor, start = PLATFORMS[name]
    try:
        target = machine(triple, processor)
    except RuntimeError as error:  # LLVM may be built without it
        pytest.skip(str(error))
    ((work, _),) = works("torsional_speed")
    for kind, function in {**functions_of(work, 8), **PLAIN}.items():
        code = native.object_code(text_of(function), target)
        assert code.startswith(start), kind
        assert b"entry" in code


@pytest.mark.skipif(
    platform.machine().lower() not in ("x86_64", "amd64") or platform.system() != "Linux",
    reason="code of x86 for Linux is run",
)
@pytest.mark.parametrize("processor", NEEDED)
def test_every_processor_has_the_same_bits(processor):
    """Also one without a fused multiply-add, for which there is a function."""
    features = llvm.get_host_cpu_features()
    if missing := [name for name in NEEDED[processor] if not features.get(name)]:
        pytest.skip(f"this processor has no {missing[0]}")

    def made(function, target):
        symbol = f"portable_{next(_numbers)}"
        text = Module(native.WIDTH).text(function.py_func, function.kinds, symbol)
        one = LaneFunction(function.py_func, function.kinds)
        one._address = native.address_of(native.object_code(text, target), symbol)
        return one

    target = machine(LINUX, processor)
    ((work, points),) = works("torsional_speed")
    here = outcomes(work, points, 8, lambda function: made(function, None))
    there = outcomes(work, points, 8, lambda function: made(function, target))
    for number, (one, other) in enumerate(zip(here, there, strict=True)):
        assert bits(one) == bits(other), number
