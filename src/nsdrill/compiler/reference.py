"""The lane language compiled by numba: the reference for the machine code that
:mod:`nsdrill.compiler.native` makes, and the way where that is not to be had."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.core.registry import CPUDispatcher
from numba.extending import intrinsic, overload

from nsdrill.compiler import driver, words

_TYPES = {
    "a": (types.float64[::1],),
    "i": (types.int64,),
    "d": (types.float64,),
    "f": (types.int64,),
}
_C_TYPES = {**_TYPES, "a": (types.CPointer(types.float64), types.int64)}
assert driver  # it teaches numba to call addresses


class Compiled(CPUDispatcher):
    """A compiled function with an address, like
    :class:`nsdrill.compiler.functions.LaneFunction`."""

    kinds: str

    @cached_property
    def address(self) -> int:
        names = [
            (f"a{k}", f"n{k}") if kind == "a" else (f"a{k}",) for k, kind in enumerate(self.kinds)
        ]
        given = [f"carray({', '.join(pair)})" if len(pair) == 2 else pair[0] for pair in names]
        returns = "" if self.nopython_signatures[0].return_type == types.void else "result = "
        text = (
            f"def entry({', '.join(name for pair in names for name in pair)}):\n"
            f"    {returns}function({', '.join(given)})\n    return {'result' if returns else '0'}\n"
        )
        space = {"function": self, "carray": numba.carray}
        exec(text, space)
        signature = types.int64(*(part for kind in self.kinds for part in _C_TYPES[kind]))
        self.entry = numba.cfunc(signature, error_model="numpy")(space["entry"])
        return int(self.entry.address)


def compiled(function: Any, kinds: str) -> Any:
    dispatcher = numba.njit(nogil=True, error_model="numpy", _nrt=False)(function)
    dispatcher.__class__ = Compiled
    dispatcher.kinds = kinds
    dispatcher.compile(tuple(part for kind in kinds for part in _TYPES[kind]))
    dispatcher.disable_compile()
    return dispatcher


def inlined(function: Any) -> Any:
    if hasattr(function, "py_func"):  # compiled by numba already
        return function
    return numba.njit(forceinline=True, error_model="numpy", _nrt=False)(function)


@overload(words.packed)
def _packed(first, stop=None):  # type: ignore[no-untyped-def]
    if stop is None or isinstance(stop, (types.NoneType, types.Omitted)):
        return lambda first, stop=None: range(first)
    return lambda first, stop=None: range(first, stop)


@overload(words.local)
def _local(size):  # type: ignore[no-untyped-def]
    return lambda size: numba.carray(_place(size), size)


@intrinsic
def _place(context, size):  # type: ignore[no-untyped-def]
    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return builder.alloca(ir.DoubleType(), values[0])

    return types.CPointer(types.float64)(types.int64), build


def _instruction(function: Any, signature: Any, build: Any) -> None:
    """Let numba write ``function`` as the instruction that ``build`` gives."""

    def emit(context: Any, *arguments: Any) -> Any:
        return signature, lambda context, builder, signature, values: build(builder, *values)

    names = ", ".join(f"x{k}" for k in range(len(signature.args)))
    space = {"emit": emit, "signature": signature}
    exec(f"def typed(context, {names}):\n    return emit(context, {names})\n", space)
    space["made"] = intrinsic(space["typed"])
    exec(f"def called({names}):\n    return lambda {names}: made({names})\n", space)
    overload(function)(space["called"])


_float, _int = types.float64, types.int64
_instruction(words.fma, _float(_float, _float, _float), lambda b, x, y, z: b.fma(x, y, z))
_instruction(words.float_bits, _int(_float), lambda b, x: b.bitcast(x, ir.IntType(64)))
_instruction(words.bits_float, _float(_int), lambda b, x: b.bitcast(x, ir.DoubleType()))
_instruction(words.lowest_bit, _int(_int), lambda b, x: b.cttz(x, ir.Constant(ir.IntType(1), 1)))
