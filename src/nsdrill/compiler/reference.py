"""The lane language compiled by numba: the reference for the machine code that
:mod:`nsdrill.compiler.native` makes, and the way where that is not to be had."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from types import FunctionType
from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.core.base import BaseContext
from numba.core.registry import CPUDispatcher
from numba.core.typing.templates import AbstractTemplate, Signature, infer_global, signature
from numba.extending import intrinsic, lower_builtin, overload
from numba.np.arrayobj import populate_array

from nsdrill.compiler.functions import (
    BUFFER,
    BUFFERS,
    FLOAT,
    FUNCTION,
    INTEGER,
    F,
    bits_float,
    call,
    float_bits,
    fma,
    local,
    lowest_bit,
    packed,
)

_NUMBERS = {FLOAT: types.float64, INTEGER: types.int64, FUNCTION: types.int64}
_ELEMENTS = {kind: _NUMBERS[elements] for kind, elements in BUFFERS.items()}
_TYPES = _NUMBERS | {kind: number[::1] for kind, number in _ELEMENTS.items()}
_C_TYPES: dict[str, tuple[types.Type, ...]] = {kind: (number,) for kind, number in _NUMBERS.items()}
_C_TYPES |= {kind: (types.CPointer(number), types.int64) for kind, number in _ELEMENTS.items()}


class Compiled(CPUDispatcher):
    """A compiled function with an address, like
    :class:`nsdrill.compiler.functions.LaneFunction`."""

    kinds: str

    def __call__(self, *arguments: Any) -> int:
        pairs = zip(arguments, self.kinds, strict=True)
        return super().__call__(*(a.address if kind == FUNCTION else a for a, kind in pairs))

    @cached_property
    def address(self) -> int:
        names = [(f"a{k}", f"n{k}") if kind in BUFFERS else (f"a{k}",) for k, kind in enumerate(self.kinds)]
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


def compiled(function: FunctionType, kinds: str) -> Compiled:
    dispatcher = numba.njit(nogil=True, error_model="numpy", _nrt=False)(function)
    dispatcher.__class__ = Compiled
    dispatcher.kinds = kinds
    dispatcher.compile(tuple(_TYPES[kind] for kind in kinds))
    dispatcher.disable_compile()
    return dispatcher


def inlined(function: F) -> F:
    if hasattr(function, "py_func"):  # compiled by numba already
        return function
    return numba.njit(forceinline=True, error_model="numpy", _nrt=False)(function)


@infer_global(call)
class _Call(AbstractTemplate):
    """``call(address, *arguments)`` gives an integer."""

    def generic(self, arguments: Sequence[types.Type], keywords: Mapping[str, types.Type]) -> Signature:
        return signature(types.int64, *arguments)


@lower_builtin(call, types.VarArg(types.Any))
def _call_address(
    context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: Sequence[ir.Value]
) -> ir.Value:
    """Call the function at an address with C's calling convention: an array is passed
    as its data and its size."""
    given: list[ir.Value] = []
    for kind, value in zip(signature.args[1:], values[1:], strict=True):
        if isinstance(kind, types.Array):
            array = context.make_array(kind)(context, builder, value)
            given += [array.data, array.nitems]
        else:
            given.append(context.cast(builder, value, kind, types.int64))
    kind = ir.FunctionType(ir.IntType(64), [value.type for value in given])
    return builder.call(builder.inttoptr(values[0], kind.as_pointer()), given)


@overload(packed)
def _packed(first, stop=None):  # type: ignore[no-untyped-def]
    if stop is None or isinstance(stop, (types.NoneType, types.Omitted)):
        return lambda first, stop=None: range(first)
    return lambda first, stop=None: range(first, stop)


@infer_global(local)
class _Local(AbstractTemplate):
    """``local(size)`` gives an array."""

    def generic(self, arguments: Sequence[types.Type], keywords: Mapping[str, types.Type]) -> Signature:
        return signature(_TYPES[BUFFER], *arguments)


@lower_builtin(local, types.Integer)
def _on_the_stack(
    context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: Sequence[ir.Value]
) -> ir.Value:
    array = context.make_array(signature.return_type)(context, builder)
    size = context.cast(builder, values[0], signature.args[0], types.intp)
    number, place = context.get_constant(types.intp, 8), builder.alloca(ir.DoubleType(), size)
    populate_array(array, data=place, shape=[size], strides=[number], itemsize=number, meminfo=None)
    return array._getvalue()


def _instruction(function: Callable[..., object], signature: Signature, build: Callable[..., ir.Value]) -> None:
    """Let numba write ``function`` as the instruction that ``build`` gives."""

    def emit(context: BaseContext, *arguments: types.Type) -> tuple[Signature, Callable[..., ir.Value]]:
        return signature, lambda context, builder, signature, values: build(builder, *values)

    names = ", ".join(f"x{k}" for k in range(len(signature.args)))
    space = {"emit": emit, "signature": signature}
    exec(f"def typed(context, {names}):\n    return emit(context, {names})\n", space)
    space["made"] = intrinsic(space["typed"])
    exec(f"def called({names}):\n    return lambda {names}: made({names})\n", space)
    overload(function)(space["called"])


_float, _int = types.float64, types.int64
_instruction(fma, _float(_float, _float, _float), lambda b, x, y, z: b.fma(x, y, z))
_instruction(float_bits, _int(_float), lambda b, x: b.bitcast(x, ir.IntType(64)))
_instruction(bits_float, _float(_int), lambda b, x: b.bitcast(x, ir.DoubleType()))
_instruction(lowest_bit, _int(_int), lambda b, x: b.cttz(x, ir.Constant(ir.IntType(1), 1)))
