"""What equations are before they run on nodes: their syntax tree, changed where Python
cannot be told what to do with a node.

Both sides of a condition on a value run, as some lanes need the one and some the other.
So there a side may choose values, and nothing else: a statement that does more
(:func:`acting`) leaves its ``if`` as Python has it, for conditions on options only.
"""

from __future__ import annotations

import ast
import builtins
import copy
from collections.abc import Container, Iterable, Iterator
from typing import Any

from nsdrill.equations.graph import Refused

WORD = "_nsdrill_"  # begins the names that are put into equations
AROUND = "both sides of a condition on a value are run, each for the lanes that need it"
REMEDY = (
    f"{AROUND}; allowed there: names for values, which are then chosen lane by lane, in an `if` without `return`, "
    "`break` and `continue`. Give the value a name on both sides, and use it after the `if`"
)
EXCEPTIONS = (
    "no lane raises an exception, a division by zero gives infinity there; allowed: a condition, or a bound such as "
    "max(x, 1e-9)"
)
# What a function of equations may not have anywhere, and what to write instead.
NOWHERE: dict[type[ast.AST], str] = {
    ast.Try: f"`try`: {EXCEPTIONS}",
    ast.TryStar: f"`try`: {EXCEPTIONS}",
    ast.With: "`with`; allowed: equations without it",
}
KEPT = (
    "`{}`: equations are read once for all steps and lanes, so that nothing is kept from one step to the next; "
    "allowed: what changes in time as a state with its slope. To read a name no such statement is needed"
)
# Statements that a side of a condition on a value may have, if what is in them may be there.
CHOOSING = (ast.Assign, ast.AugAssign, ast.AnnAssign, ast.If, ast.For, ast.While, ast.Expr, ast.Pass)
# Functions that take all of a generator at once.
TAKING = frozenset({"sum", "max", "min", "any", "all", "tuple", "list", "dict", "set", "sorted", "zip", "enumerate"})
LEAVING = (ast.Break, ast.Continue)


def forbidden(tree: ast.AST, around: Container[str]) -> None:
    """Refused where the tree has what equations may not have anywhere; ``around`` are the
    names that it has from functions around it."""
    for node in ast.walk(tree):
        words = NOWHERE.get(type(node), "")
        if isinstance(node, ast.Global):
            words = KEPT.format("global")
        if isinstance(node, ast.Nonlocal) and any(name in around for name in node.names):
            words = KEPT.format("nonlocal")
        if words:
            raise Refused(f"found {words}", getattr(node, "lineno", 0), _source(node))


def _source(node: ast.AST) -> str:
    return ast.unparse(node).splitlines()[0].rstrip(":")


def acting(statements: Iterable[ast.stmt]) -> tuple[int, str, str] | None:
    """(line, source, words) of the first of these statements, or of what is in them, that
    does more than to choose values; None where none does."""
    return next(_acting(statements, set(), False), None)


def _acting(statements: Iterable[ast.stmt], made: set[str], in_loop: bool) -> Iterator[tuple[int, str, str]]:
    """``made`` are the names of what the side has made itself."""
    for node in statements:
        own = [child for child in ast.iter_child_nodes(node) if not isinstance(child, ast.stmt)]
        if not isinstance(node, CHOOSING) and not (in_loop and isinstance(node, LEAVING)):
            yield node.lineno, _source(node), "this statement"
        if isinstance(node, ast.Expr) and not isinstance(node.value, ast.Constant):
            called = node.value.func if isinstance(node.value, ast.Call) else None
            if not (isinstance(called, ast.Attribute) and root(called) in made):
                yield node.lineno, _source(node), "a call for its effect"
        for inner in (part for child in own for part in ast.walk(child)):
            stores = isinstance(inner, (ast.Attribute, ast.Subscript)) and isinstance(inner.ctx, ast.Store)
            if stores and root(inner) not in made:
                yield node.lineno, _source(node), "a store to an element or an attribute"
            if isinstance(inner, (ast.Yield, ast.YieldFrom, ast.Await, ast.Lambda)) or _is_late(inner, own):
                yield node.lineno, _source(node), "this statement"
        if isinstance(node, ast.Assign):
            fresh = isinstance(node.value, (ast.List, ast.Dict, ast.Set, ast.ListComp, ast.DictComp, ast.Call))
            for target in node.targets:
                if isinstance(target, ast.Name):
                    (made.add if fresh else made.discard)(target.id)
        for name in ("body", "orelse"):
            inside = in_loop or (name == "body" and isinstance(node, (ast.For, ast.While)))
            yield from _acting(getattr(node, name, None) or (), made, inside)


def _is_late(node: ast.AST, own: list[ast.AST]) -> bool:
    """Whether this is a generator that is not taken at once: it would read its names
    later."""
    if not isinstance(node, ast.GeneratorExp):
        return False
    calls = (inner for child in own for inner in ast.walk(child) if isinstance(inner, ast.Call))
    return not any(node in call.args and isinstance(call.func, ast.Name) and call.func.id in TAKING for call in calls)


def root(node: ast.AST) -> str:
    """The name to which an attribute or an element belongs."""
    while isinstance(node, (ast.Attribute, ast.Subscript)):
        node = node.value
    return node.id if isinstance(node, ast.Name) else ""


class Changes(ast.NodeTransformer):
    """The changed tree; ``remember`` says whether names are remembered, and ``own`` are
    the names that the module or the closure of the function gives another meaning than
    Python does."""

    def __init__(self, remember: bool, own: Iterable[str]) -> None:
        self.remember, self.own, self.count = remember, set(own), 0

    def visit(self, node: ast.AST) -> Any:
        made = super().visit(node)
        return ast.copy_location(made, node) if isinstance(made, ast.expr) else made

    # Expressions.

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        binds = _binding(node.body) or _binding(node.orelse)
        self.generic_visit(node)
        if binds:
            node.test = self._on_options(node.test, binds)
            return node
        return call("select", node.test, _lambda(node.body), _lambda(node.orelse))

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        binds = next(filter(None, map(_binding, node.values[1:])), None)
        self.generic_visit(node)
        if binds:
            node.values[:-1] = [self._on_options(value, binds) for value in node.values[:-1]]
            return node
        name = "and" if isinstance(node.op, ast.And) else "or"
        value = node.values[0]
        for other in node.values[1:]:
            value = call(name, value, _lambda(other))
        return value

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        self.generic_visit(node)
        return call("not", node.operand) if isinstance(node.op, ast.Not) else node

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        """``==`` and ``!=``, which Python answers for nodes that are not of open
        equations, as in a law that is called again; ``a < b < c`` is ``a < b and b < c``."""
        if len(node.ops) > 1 and not _binding(node):
            sides = [node.left, *node.comparators]
            pairs = zip(sides[:-1], node.ops, sides[1:], strict=True)
            return self.visit(
                ast.BoolOp(ast.And(), [ast.Compare(copy.deepcopy(a), [op], [copy.deepcopy(b)]) for a, op, b in pairs])
            )
        self.generic_visit(node)
        if len(node.ops) == 1 and isinstance(node.ops[0], (ast.Eq, ast.NotEq)):
            same = call("equal", node.left, node.comparators[0])
            return same if isinstance(node.ops[0], ast.Eq) else call("not", same)
        if len(node.ops) == 1 and isinstance(node.ops[0], (ast.Is, ast.IsNot)):
            sides = [node.left, node.comparators[0]]
            if not any(isinstance(one, ast.Constant) and one.value is None for one in sides):
                same = call("is", *sides)
                return same if isinstance(node.ops[0], ast.Is) else call("not", same)
        return node

    def visit_Match(self, node: ast.Match) -> ast.AST:
        """``match`` with True, False or a class, which Python does not ask a value."""
        asked = [inner for case in node.cases for inner in ast.walk(case.pattern)]
        self.generic_visit(node)
        if any(isinstance(one, ast.MatchClass) or _is_truth(one) for one in asked):
            node.subject = call("matched", node.subject)
        return node

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id in ("max", "min") and isinstance(node.ctx, ast.Load) and node.id not in self.own:
            return name_of(node.id)
        return node

    def visit_NamedExpr(self, node: ast.NamedExpr) -> ast.AST:
        self.generic_visit(node)
        if self.remember:
            node.value = call("named", ast.Constant(node.target.id), node.value)
        return node

    # Statements.

    def visit_Assign(self, node: ast.Assign) -> ast.AST | list[ast.stmt]:
        return self._remembered(node)

    def visit_AugAssign(self, node: ast.AugAssign) -> ast.AST | list[ast.stmt]:
        return self._remembered(node)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> ast.AST | list[ast.stmt]:
        return self._remembered(node) if node.value else node

    def visit_For(self, node: ast.For) -> ast.AST:
        names = stored([node.target])
        self.generic_visit(node)
        node.body = [*self._memory(names), *node.body]
        return node

    def _remembered(self, node: ast.Assign | ast.AugAssign | ast.AnnAssign) -> ast.AST | list[ast.stmt]:
        names = stored([node])
        self.generic_visit(node)
        return [node, *self._memory(names)]

    def _memory(self, names: Iterable[str]) -> list[ast.stmt]:
        if not self.remember:
            return []
        return [ast.Expr(call("remember", ast.Constant(n), ast.Name(n, ast.Load()))) for n in names]

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt]:
        names = stored([*node.body, *node.orelse])
        does_more = acting([*node.body, *node.orelse])
        self.generic_visit(node)
        if does_more:
            node.test = self._on_options(node.test, does_more)
            return node
        self.count += 1
        sides = {f"{WORD}side_{self.count}": node.body, f"{WORD}other_{self.count}": node.orelse}
        back = ast.Return(ast.Tuple([ast.Name(n, ast.Load()) for n in names], ast.Load()))
        functions = []
        for name, body in sides.items():
            function = ast.parse(f"def {name}({', '.join(names)}): pass").body[0]
            assert isinstance(function, ast.FunctionDef)
            # a name that neither side knows stays absent
            function.body = [*body, back]
            functions.append(function)
        made = call(
            "branch",
            node.test,
            *(ast.Name(name, ast.Load()) for name in sides),
            ast.Tuple([ast.Constant(n) for n in names], ast.Load()),
            call("locals"),
        )
        targets = ast.Tuple([ast.Name(n, ast.Store()) for n in names], ast.Store())
        # an error in a side, which is found here, is at the condition
        return [*functions, ast.copy_location(ast.Assign([targets], made), node.test), *self._memory(names)]

    def _on_options(self, test: ast.expr, does_more: tuple[int, str, str]) -> ast.expr:
        return call("option", test, *(ast.Constant(part) for part in does_more))


def _is_truth(pattern: ast.AST) -> bool:
    return isinstance(pattern, ast.MatchSingleton) and pattern.value is not None


def _binding(node: ast.AST) -> tuple[int, str, str] | None:
    """Where an expression gives something a name."""
    for inner in ast.walk(node):
        if isinstance(inner, (ast.NamedExpr, ast.Yield, ast.YieldFrom, ast.Await)):
            return inner.lineno, _source(inner), "a name given in an expression"
    return None


def stored(statements: Iterable[ast.AST]) -> list[str]:
    """The names that statements assign, less those of comprehensions."""
    names, todo = set(), list(statements)
    while todo:
        node = todo.pop()
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        if not isinstance(node, (ast.comprehension, ast.FunctionDef, ast.Lambda, ast.ClassDef)):
            todo += ast.iter_child_nodes(node)
    return sorted(names)


def meanings(names: Iterable[str], known: dict[str, object]) -> set[str]:
    """Those of the names that mean something else than in Python."""
    return {name for name in names if name in known and known[name] is not getattr(builtins, name, None)}


def name_of(word: str) -> ast.Name:
    return ast.Name(f"{WORD}{word}", ast.Load())


def call(word: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(name_of(word), list(arguments), [])


def _lambda(body: ast.expr) -> ast.Lambda:
    return ast.Lambda(ast.arguments([], [], None, [], [], None, []), body)
