"""What numba compiles: the loop over steps and other plain loops over arrays, and calls
of lane functions from them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.extending import intrinsic, overload, register_jitable

from nsdrill.cache import numba_cache
from nsdrill.compiler.functions import identity
from nsdrill.compiler.language import call

helper = register_jitable  # a function that a driver calls


def driver(signature: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile for a ``signature`` of numba, without the interpreter's lock, cached on
    disk. The arguments of ``call`` are addresses of lane functions."""

    def make(function: Any) -> Any:
        dispatcher = numba.njit(nogil=True, error_model="numpy", _nrt=False)(function)
        if hasattr(dispatcher, "compile"):  # not where compilation is switched off
            dispatcher._cache = numba_cache(function, identity(function))
            dispatcher.compile(signature)
            dispatcher.disable_compile()
        return dispatcher

    return make


@overload(call)
def _call(function, *arguments):  # type: ignore[no-untyped-def]
    def implementation(function, *arguments):  # type: ignore[no-untyped-def]
        return _call_address(function, arguments)

    return implementation


@intrinsic
def _call_address(context: Any, address: Any, arguments: Any) -> Any:
    """Call the function at an address with C's calling convention: an array is passed
    as its data and its size."""
    kinds = list(arguments)

    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        given: list[Any] = []
        for number, kind in enumerate(kinds):
            value = builder.extract_value(values[1], number)
            if isinstance(kind, types.Array):
                array = context.make_array(kind)(context, builder, value)
                given += [array.data, array.nitems]
            else:
                given.append(context.cast(builder, value, kind, types.int64))
        kind = ir.FunctionType(ir.IntType(64), [value.type for value in given])
        pointer = builder.inttoptr(values[0], kind.as_pointer())
        return builder.call(pointer, given)

    return types.int64(address, arguments), build
