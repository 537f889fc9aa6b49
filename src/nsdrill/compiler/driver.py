"""What numba compiles: the loop over steps and other plain loops over arrays, and calls
of lane functions from them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba
from llvmlite import ir
from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, register_jitable

from nsdrill.cache import numba_cache
from nsdrill.compiler.functions import identity
from nsdrill.compiler.words import call

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


@infer_global(call)
class _Call(AbstractTemplate):
    """``call(address, *arguments)`` gives an integer."""

    def generic(self, arguments: Any, keywords: Any) -> Any:
        return signature(types.int64, *arguments)


@lower_builtin(call, types.VarArg(types.Any))
def _call_address(context: Any, builder: Any, signature: Any, values: Any) -> Any:
    """Call the function at an address with C's calling convention: an array is passed
    as its data and its size."""
    given: list[Any] = []
    for kind, value in zip(signature.args[1:], values[1:], strict=True):
        if isinstance(kind, types.Array):
            array = context.make_array(kind)(context, builder, value)
            given += [array.data, array.nitems]
        else:
            given.append(context.cast(builder, value, kind, types.int64))
    kind = ir.FunctionType(ir.IntType(64), [value.type for value in given])
    return builder.call(builder.inttoptr(values[0], kind.as_pointer()), given)
