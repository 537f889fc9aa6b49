"""The lane language: the restricted Python in which everything that is compiled is
written, and what the two walkers over its syntax trees share.

A function of the language runs in the interpreter as it stands. Compiled, it becomes
vector instructions. Names whose values are known when the function is made (numbers,
tuples, tables, functions of its closure and module) are constants; arguments, numbers
in buffers and all that follows from them are *values*, of one of three kinds: float,
integer and truth. No kind becomes another silently: ``float(n)``, ``int(x)`` and
``n != 0`` are written down. A constant integer may stand for a float.

===============================  =======================================================
``for i in packed(W):``           vector code: ``b[row + i]`` is a row of W lanes; no
                                 branches but ``a if c else b``, which evaluates both
``s |= (1 << i) if c else 0``    the set of lanes in which c holds, as bits
``s |= 1 if c else 0``           whether c holds in some lane
``for k in range(n):``           written out where n is known and small, else a loop
``for name in (a, b):``          written out
``tuple(b[k] for k in places)``  written out, of a tuple; ``f(*parts)`` takes its parts
``if``, ``while``, ``and``       of scalars: branches, also around loops over lanes
``s = masks(n)``                 n sets of lanes, ``s[k] |= (1 << i) if c else 0``
``local(n)``                     a buffer of n floats for this call; n is known
``b[k]``, ``b[k:]``, ``b[k:n]``  of flat buffers of floats or of integers; constant
                                 tables are indexed alike
``helper(x, y)``                 a function marked ``inlined``, or any plain one: written
                                 out at its call; it returns at its end
``compiled_function(b, n)``      a function made by ``compiled``: called
``assert len(parts) == n, "m"``  of what is known: refused where it does not hold
``call(f, b)``                   the function of an argument: called
``min max abs float int len``    as in Python; also ``np.sqrt``, ``np.floor``,
                                 ``np.rint``, and, of scalars, functions of ``math``
``fma float_bits bits_float``    of :mod:`nsdrill.elementary`, with ``lowest_bit``
===============================  =======================================================

Not checked, as it is not known before it runs: a shift by less than 0 or more than 63,
``int`` of a number beyond 64 bits, a place outside a buffer, a part of it that ends
before it begins. An integer divided by zero is divided by one. No lane may read what
another writes.
"""

from __future__ import annotations

import ast
import linecache
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from types import CodeType, FunctionType
from typing import Any, TypeGuard

import numpy as np

from nsdrill.compiler.ir import Value
from nsdrill.errors import InputError

KINDS = {"d": "a float", "i": "an integer", "b": "a truth"}


class LanguageError(InputError):
    """A function that is to be compiled uses what the language does not have."""


class Refusal(Exception):
    """What is refused, before the place is known."""


# What an expression can be besides a constant and a Value.
@dataclass(slots=True)
class Array:
    """A buffer of floats, or of integers."""

    ref: str
    length: Value
    kind: str = "d"  # of its elements


@dataclass(slots=True)
class Masks(Array):
    """Sets of lanes: integers to which a loop over lanes adds, and which are read after
    it."""


@dataclass(slots=True)
class FunctionArgument:
    """A compiled function whose address is an argument."""

    address: Value


@dataclass(slots=True)
class Lane:
    """The index of the lane plus an offset, and a scalar integer if there is one."""

    offset: int
    base: Value | None = None


@dataclass(slots=True)
class Bits:
    """In each lane an integer: where ``mask`` holds ``weight`` or, without a weight,
    1 << (lane + shift); else 0."""

    mask: Value
    weight: int | None
    shift: int = 0


class Slot:
    """A variable in memory, as branches or turns of a loop assign it: its kind and
    lanes are those of its first value."""

    def __init__(self) -> None:
        self.pointer: str | None = None
        self.kind = ""
        self.lanes = 0
        self.reason = ""  # why it has no value here


@dataclass(slots=True)
class Unassigned:
    """A name without a value that can be used here, and why."""

    reason: str


@dataclass(slots=True)
class Fixed:
    """A value that a branch or a loop cannot replace, such as a tuple."""

    value: object


RUNTIME = (Value, Lane, Bits, Array, FunctionArgument)


class Scope:
    """The names of one function, or of the turn of one loop over lanes inside it."""

    def __init__(self, function: FunctionType, parent: Scope | None = None) -> None:
        self.function, self.parent = function, parent
        self.names: dict[str, object] = {}
        self.read: set[str] = set()  # names of the scope around it
        self.summed: set[str] = set()  # sets of lanes

    def holder(self, name: str) -> Scope | None:
        """This scope or the one around it that has ``name``."""
        at: Scope | None = self
        while at is not None and name not in at.names:
            at = at.parent
        return at


def plain(value: object) -> Any:
    """A constant as Python has it: numpy's scalars as numbers."""
    return value.item() if isinstance(value, np.generic) else value


def is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float))


# Definitions.
def definition(function: FunctionType) -> ast.FunctionDef:
    """The syntax tree of ``function``."""
    code = function.__code__
    known = _trees.get(id(code))
    if known is None:
        known = _trees[id(code)] = code, _definition(function, code)
    return known[1]


# By the code, which is kept so that no other has its place.
_trees: dict[int, tuple[CodeType, ast.FunctionDef]] = {}


def _definition(function: FunctionType, code: CodeType) -> ast.FunctionDef:
    text = function.__globals__.get("__source__")  # of a generated function
    for is_read_again, by_statement in ((False, False), (False, True), (True, False)):
        if is_read_again:  # the file may have changed, and the module with it
            linecache.checkcache(code.co_filename)
        nodes, codes = _definitions(text or "".join(linecache.getlines(code.co_filename)), by_statement)
        key = code.co_firstlineno, code.co_name
        if any(_parts(code) == _parts(other) for other in codes.get(key, [])):
            for node in (found := nodes.get(key, [])):
                if len(found) == 1 or _same_code(node, function):
                    return node
    raise LanguageError(
        f"{code.co_filename}, line {code.co_firstlineno}: {code.co_name}: the source of this function is not "
        "found, or has changed since it was imported; allowed: a function that is written in a file."
    )


def _parts(code: CodeType) -> tuple[object, ...]:
    # 1, 1.0 and True are equal, and not the same code
    return code.co_code, code.co_names, [repr(c) for c in code.co_consts if not isinstance(c, CodeType)]


def parts_of(code: CodeType) -> tuple[object, ...]:
    """All that a code does, in plain data whose text identifies it."""
    constants = [parts_of(c) if isinstance(c, CodeType) else c for c in code.co_consts]
    variables = code.co_varnames, code.co_freevars, code.co_cellvars
    arguments = code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags
    return code.co_name, code.co_code, code.co_exceptiontable, constants, code.co_names, *variables, *arguments


@lru_cache
def _definitions(
    text: str, by_statement: bool = False
) -> tuple[dict[tuple[int, str], list[ast.FunctionDef]], dict[tuple[int, str], list[CodeType]]]:
    """The syntax trees of the functions of a module, and their codes, by the line and
    the name. A notebook compiles a cell ``by_statement``: its functions call what the cell
    imports by other instructions than those of a module do."""
    nodes: dict[tuple[int, str], list[ast.FunctionDef]] = {}
    codes: dict[tuple[int, str], list[CodeType]] = {}
    try:
        tree = ast.parse(text)
        parts = [ast.Module([one], []) for one in tree.body] if by_statement else [tree]
        modules = [compile(one, "", "exec", dont_inherit=True) for one in parts]
    except SyntaxError:
        return nodes, codes
    for code in modules:
        codes.setdefault((code.co_firstlineno, code.co_name), []).append(code)
        modules.extend(c for c in code.co_consts if isinstance(c, CodeType))
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            first = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)])
            nodes.setdefault((first, node.name), []).append(node)
        elif isinstance(node, ast.Lambda):
            made = ast.FunctionDef("<lambda>", node.args, [ast.Return(node.body)], [])
            ast.copy_location(made, node)
            ast.copy_location(made.body[0], node.body)
            nodes.setdefault((node.lineno, "<lambda>"), []).append(made)
    return nodes, codes


def _same_code(node: ast.FunctionDef, function: FunctionType) -> bool:
    """Whether this lambda is that of ``function``, of several in one line."""
    returned = node.body[0]
    if not (isinstance(returned, ast.Return) and returned.value):
        return False
    tree = ast.Expression(ast.copy_location(ast.Lambda(node.args, returned.value), node))
    code, mine = eval(compile(tree, "", "eval"), {}).__code__, function.__code__
    return bool((code.co_code, code.co_consts, code.co_names) == (mine.co_code, mine.co_consts, mine.co_names))


def constant_of(function: FunctionType, name: str) -> object:
    """What a name that the function does not assign stands for."""
    if name in function.__code__.co_varnames or name in function.__code__.co_cellvars:
        raise Refusal(f"{name} has no value here; allowed: a name that is assigned on every way here")
    if name in function.__code__.co_freevars:
        assert function.__closure__ is not None
        return function.__closure__[function.__code__.co_freevars.index(name)].cell_contents
    if name in function.__globals__:
        return function.__globals__[name]
    builtins = function.__globals__["__builtins__"]
    found = builtins.get(name) if isinstance(builtins, dict) else getattr(builtins, name, None)
    if found is None:
        raise Refusal(f"the name {name} is not defined")
    return found


def assigned(body: list[ast.stmt], *, in_lanes: bool = False) -> Iterator[str]:
    """The names that statements assign, but for those of the turn of a loop over lanes
    (``in_lanes``): there only what is accumulated outside it."""
    for node in body:
        if isinstance(node, ast.For):
            over_lanes = in_lanes or is_over_lanes(node)
            if not over_lanes:
                yield from targets(node.target)
            yield from assigned(node.body, in_lanes=over_lanes)
        elif isinstance(node, ast.AugAssign):
            yield from targets(node.target)
        elif isinstance(node, ast.Assign) and not in_lanes:
            for target in node.targets:
                yield from targets(target)
        elif isinstance(node, (ast.If, ast.While)):
            yield from assigned([*node.body, *node.orelse], in_lanes=in_lanes)


def carried(body: list[ast.stmt]) -> set[str]:
    """The names that a turn of a loop reads before it assigns them, and assigns: sums,
    for example."""
    new: set[str] = set()
    found: set[str] = set()

    def read(node: ast.AST) -> None:
        names = {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
        found.update(names - new)

    for node in body:
        if isinstance(node, ast.For):
            read(node.iter)
            new.update(targets(node.target))
            found |= carried(node.body) - new
        elif isinstance(node, ast.If):
            read(node.test)
            found |= (carried(node.body) | carried(node.orelse)) - new
        else:
            if isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
                found.update({node.target.id} - new)
            read(node)
            if isinstance(node, ast.Assign):
                for target in node.targets:
                    new.update(targets(target))
    return found & set(assigned(body))


def is_over_lanes(node: ast.For) -> bool:
    head = node.iter
    return isinstance(head, ast.Call) and isinstance(head.func, ast.Name) and head.func.id == "packed"


def targets(node: ast.expr) -> Iterator[str]:
    """The names to which a target of an assignment or a loop refers."""
    for part in ast.walk(node):
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
            yield part.id


def hold(target: ast.expr, item: object, scope: Scope) -> None:
    """Let the names of a loop stand for one of its items, which is known."""
    if isinstance(target, ast.Name):
        scope.names[target.id] = item
    elif isinstance(target, ast.Tuple) and isinstance(item, tuple) and len(target.elts) == len(item):
        for part, single in zip(target.elts, item, strict=True):
            hold(part, plain(single), scope)
    else:
        raise Refusal("the items of a loop do not fit its names")


def leaves_loop(body: list[ast.stmt]) -> bool:
    """Whether a statement of a loop's body, not of a loop inside it, ends a turn."""
    return any(
        isinstance(node, (ast.Break, ast.Continue))
        or (isinstance(node, ast.If) and leaves_loop([*node.body, *node.orelse]))
        for node in body
    )
