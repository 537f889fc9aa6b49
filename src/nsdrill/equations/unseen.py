"""What equations ask of a value in a way that a value cannot answer: which object it is,
or which type it has.

While equations are read, a value is an object that stands for all numbers. It answers
comparisons and arithmetic as they do. Whether it is the same object as ``True``, or an
``int``, Python decides without it: the condition is then decided once, by what the value
is while it is read, and not by its number. So this is refused: in the equations themselves,
whose tree is changed (:mod:`.changes`), of values alone; in functions that they call, which
run as they are, by their text.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Container, Iterator, Mapping
from types import FunctionType

from nsdrill.equations.changes import root, stored
from nsdrill.equations.effects import known_in, value_of
from nsdrill.equations.graph import Node

BY_NUMBER = (
    "which Python decides by the object and not by its number, once for all steps and lanes; allowed: {}, and what is "
    "decided by options stands above the function"
)
COMPARED = "a comparison, as ==, < or >, or `a if x > 5.0 else b`; `is None` and `is not None`"
BOTH = "isinstance(x, (int, float)), which holds for all numbers"
NUMBERS = (1.0, 1, True)  # what a number of equations may be where Python runs them
# Functions that ask what an object is, whatever its number.
ASKING = (operator.is_, operator.is_not, locals, dir, vars)
OF_TYPE = frozenset({"__class__", "dtype"})  # attributes
OF_VALUES = (type, isinstance, hasattr, getattr)
IDENTITY = "`is` or `is not`"
MATCHED = "`case` of `match` with True, False or a class"
Question = tuple[int, str, str, str]  # its line, its source, what is found, what is allowed
SELF = frozenset({"self", "cls"})


def unseen(function: FunctionType, tree: ast.AST, *, is_changed: bool) -> tuple[int, str, str] | None:
    """(line, source, words) of the first question in the body of a ``function`` with this
    ``tree`` that no value can answer; None where there is none. One that ``is_changed`` asks
    by `is` and `match` where it runs, and its arguments are no whole numbers."""
    body = getattr(tree, "body", [])
    inner = [node for one in (body if isinstance(body, list) else [body]) for node in ast.walk(one)]
    known = known_in(function, inner)
    given = function.__code__.co_varnames[: function.__code__.co_argcount] if is_changed else ()
    floats = {*given} - set(stored(body if isinstance(body, list) else []))
    for node in inner:
        questions = _asked(node, known, floats)
        for line, source, found, allowed in questions if is_changed else (*_asked_as_it_is(node, known), *questions):
            return line, source, told(found, allowed)
    return None


def told(found: str, allowed: str = COMPARED) -> str:
    """The words of a question that no value can answer."""
    return f"found {found}, {BY_NUMBER.format(allowed)}"


def _asked_as_it_is(node: ast.AST, known: Mapping[str, object]) -> Iterator[Question]:
    """What a node asks by `is` and `match`, where no word of :mod:`.trace` stands for them."""
    if isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        for one, op, other in zip(sides[:-1], node.ops, sides[1:], strict=True):
            if isinstance(op, (ast.Is, ast.IsNot)) and not (is_none(one) or is_none(other)):
                yield node.lineno, ast.unparse(node), IDENTITY, COMPARED
    elif isinstance(node, ast.MatchSingleton) and node.value is not None:
        yield node.lineno, f"case {node.value}", MATCHED, COMPARED
    elif isinstance(node, ast.MatchClass) and _tells(value_of(node.cls, known)):
        yield node.lineno, f"case {ast.unparse(node)}", MATCHED, COMPARED


def _asked(node: ast.AST, known: Mapping[str, object], floats: Container[str]) -> Iterator[Question]:
    """What a node asks: its line, its source, what is found and what is allowed."""
    if isinstance(node, ast.Attribute) and node.attr in OF_TYPE and root(node) not in {*known, *SELF}:
        yield node.lineno, ast.unparse(node), f"`.{node.attr}` of what may be a value", COMPARED
    function = value_of(node.func, known) if isinstance(node, ast.Call) else None
    if not isinstance(node, ast.Call) or not any(function is one for one in (*ASKING, *OF_VALUES)):
        return
    source, of = ast.unparse(node), node.args[0] if node.args else None
    name = node.args[1] if len(node.args) > 1 else None
    if function is isinstance:
        if name is not None and _tells_any(name, known) and root_of(of) not in floats:
            yield node.lineno, source, "the type of a number", BOTH
    elif root_of(of) in SELF:
        return
    elif function in (hasattr, getattr):
        has_default = function is hasattr or len(node.args) > 2
        if has_default and (not isinstance(name, ast.Constant) or _differs(str(name.value))):
            yield node.lineno, source, f"`{ast.unparse(node.func)}` of what may be a value", COMPARED
    elif function is not type or len(node.args) == 1:
        yield node.lineno, source, f"`{ast.unparse(node.func)}`", COMPARED


def root_of(node: ast.AST | None) -> str:
    """The name to which an argument belongs, if it is a name or an attribute of one."""
    return "" if node is None else root(node)


def is_none(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def _tells_any(node: ast.expr, known: Mapping[str, object]) -> bool:
    """Whether the classes of a call of isinstance, together, hold of some numbers alone."""
    parts = node.elts if isinstance(node, ast.Tuple) else [node]
    kinds = [kind for one in parts if isinstance(kind := value_of(one, known), type)]
    return any(_tells(kind) for kind in kinds) and len({isinstance(one, tuple(kinds)) for one in NUMBERS}) > 1


def _tells(kind: object) -> bool:
    """Whether a class holds of some numbers and not of others."""
    return isinstance(kind, type) and len({isinstance(one, kind) for one in NUMBERS}) > 1


def _differs(name: str) -> bool:
    """Whether a value has an attribute that numbers do not have, or the other way round."""
    return hasattr(Node, name) != hasattr(float, name)
