"""The lane language compiled by numba: the reference for the machine code that
:mod:`nsdrill.compiler.native` makes, and the way where that is not to be had."""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, reduce
from types import FunctionType
from typing import Any, cast

import numba
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.base import BaseContext
from numba.core.registry import CPUDispatcher
from numba.core.typing.templates import AbstractTemplate, Signature, infer_global, signature
from numba.extending import intrinsic, lower_builtin, overload
from numba.np.arrayobj import populate_array

from nsdrill.compiler.language import definition
from nsdrill.compiler.vocabulary import (
    BUFFER,
    BUFFERS,
    FLOAT,
    FUNCTION,
    INTEGER,
    INTEGERS,
    bits_float,
    call,
    float_bits,
    fma,
    local,
    lowest_bit,
    masks,
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
    dispatcher = numba.njit(nogil=True, error_model="numpy", _nrt=False)(written_out(function, len(kinds)))
    dispatcher.__class__ = Compiled
    dispatcher.kinds = kinds
    dispatcher.compile(tuple(_TYPES[kind] for kind in kinds))
    dispatcher.disable_compile()
    return dispatcher


def inlined(function: Any) -> Any:
    if hasattr(function, "py_func"):  # compiled by numba already
        return function
    return numba.njit(forceinline=True, error_model="numpy", _nrt=False)(written_out(function))


def written_out(function: FunctionType, arguments: int = 0) -> FunctionType:
    """The function with what the lane language writes out and numba does not know: loops
    over a known tuple of functions, ``tuple(... for ... in ...)`` of a known tuple, and
    stars, one before an argument where there are so many ``arguments``."""
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    space = function.__globals__ | {name: cell.cell_contents for name, cell in cells}
    writer = _Writer(space, {*function.__code__.co_varnames, *function.__code__.co_cellvars})
    tree = writer.visit(copy.deepcopy(definition(function)))
    if arguments and tree.args.vararg:
        writer.take(tree, arguments - len(tree.args.args))
    if not writer.changes:
        return function
    tree.decorator_list = []
    code = compile(ast.fix_missing_locations(ast.Module([tree], [])), function.__code__.co_filename, "exec")
    exec(code, space)
    return cast(FunctionType, space[tree.name])


class _Writer(ast.NodeTransformer):
    """``space`` has what is known by its name, and takes the items of tuples; it does
    not have the ``own`` names of the function."""

    def __init__(self, space: dict[str, Any], own: set[str]) -> None:
        self.space, self.own, self.changes = space, own, 0

    def take(self, tree: ast.FunctionDef, count: int) -> None:
        """Let the argument with a star be so many arguments."""
        self.changes += 1
        assert tree.args.vararg is not None
        name, tree.args.vararg = tree.args.vararg.arg, None
        names = [f"{name}__{k}" for k in range(count)]
        tree.args.args += [ast.arg(one) for one in names]
        parts = ast.Tuple([ast.Name(one, ast.Load()) for one in names], ast.Load())
        tree.body.insert(0, ast.Assign([ast.Name(name, ast.Store())], parts))

    def visit_For(self, node: ast.For) -> ast.AST | list[ast.stmt]:
        items = self._items(node.iter)
        if items is None or (items and not _has_function(items)):
            return self.generic_visit(node)
        return [ast.Pass()] + [
            self.visit(named.visit(s)) for named in self._named(node, items) for s in copy.deepcopy(node.body)
        ]

    def visit_Call(self, node: ast.Call) -> ast.AST:
        inner = node.args[0] if node.args else None
        if isinstance(node.func, ast.Name) and node.func.id == "tuple" and isinstance(inner, ast.GeneratorExp):
            items = self._items(inner.generators[0].iter)
            if items is not None:
                named = self._named(inner.generators[0], items)
                return ast.Tuple([self.visit(each.visit(copy.deepcopy(inner.elt))) for each in named], ast.Load())
        self.generic_visit(node)
        node.args = [part for one in node.args for part in _spread(one)]
        if len(node.args) > 1 and any(isinstance(part, ast.Starred) for part in node.args):
            node.args = [ast.Starred(self._sum(node.args), ast.Load())]
        return node

    def visit_Tuple(self, node: ast.Tuple) -> ast.AST:
        self.generic_visit(node)
        is_read = isinstance(node.ctx, ast.Load)
        return self._sum(node.elts) if is_read and any(isinstance(part, ast.Starred) for part in node.elts) else node

    def _sum(self, parts: list[ast.expr]) -> ast.expr:
        """A tuple of parts of which some have a star, as a sum of tuples."""
        self.changes += 1
        tuples = [p.value if isinstance(p, ast.Starred) else ast.Tuple([p], ast.Load()) for p in parts]
        return reduce(lambda a, b: ast.BinOp(a, ast.Add(), b), tuples)

    def _items(self, node: ast.expr) -> tuple[Any, ...] | None:
        found = self.space.get(node.id) if isinstance(node, ast.Name) and node.id not in self.own else None
        return found if isinstance(found, tuple) else None

    def _named(self, loop: ast.For | ast.comprehension, items: tuple[Any, ...]) -> list[_Renamed]:
        """For each of the items, the names of the loop as other names, which are known."""
        self.changes += 1
        found = []
        for item in items:
            targets = loop.target.elts if isinstance(loop.target, ast.Tuple) else [loop.target]
            parts = item if isinstance(loop.target, ast.Tuple) else (item,)
            fresh = {
                cast(ast.Name, t).id: f"{cast(ast.Name, t).id}__{len(self.space)}_{k}" for k, t in enumerate(targets)
            }
            self.space.update(zip(fresh.values(), parts, strict=True))
            found.append(_Renamed(fresh))
        return found


class _Renamed(ast.NodeTransformer):
    def __init__(self, names: dict[str, str]) -> None:
        self.names = names

    def visit_Name(self, node: ast.Name) -> ast.Name:
        return ast.copy_location(ast.Name(self.names.get(node.id, node.id), node.ctx), node)


def _spread(node: ast.expr) -> list[ast.expr]:
    """The parts of a tuple with a star, where it is written out."""
    return node.value.elts if isinstance(node, ast.Starred) and isinstance(node.value, ast.Tuple) else [node]


def _has_function(item: object) -> bool:
    return callable(item) or (isinstance(item, tuple) and any(map(_has_function, item)))


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
    """``local(size)`` gives an array of floats."""

    def generic(self, arguments: Sequence[types.Type], keywords: Mapping[str, types.Type]) -> Signature:
        return signature(_TYPES[BUFFER], *arguments)


@infer_global(masks)
class _Masks(AbstractTemplate):
    """``masks(count)`` gives an array of integers."""

    def generic(self, arguments: Sequence[types.Type], keywords: Mapping[str, types.Type]) -> Signature:
        return signature(_TYPES[INTEGERS], *arguments)


@lower_builtin(local, types.Integer)
@lower_builtin(masks, types.Integer)
def _on_the_stack(
    context: BaseContext, builder: ir.IRBuilder, signature: Signature, values: Sequence[ir.Value]
) -> ir.Value:
    array = context.make_array(signature.return_type)(context, builder)
    size = context.cast(builder, values[0], signature.args[0], types.intp)
    number = context.get_constant(types.intp, 8)
    place = builder.alloca(context.get_value_type(signature.return_type.dtype), size)
    if signature.return_type.dtype == types.int64:
        cgutils.memset(builder, place, builder.mul(size, number), 0)
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
