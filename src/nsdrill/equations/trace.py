"""From the function of a model's equations to its graph.

The function is plain scalar Python. Before it runs on nodes, its syntax tree is changed
where Python cannot be told what to do with a node: ``if`` and ``a if c else b``,
``and``, ``or``, ``not``, ``max`` and ``min``; and what it assigns is remembered by its
name. An ``if`` on an option, and every loop, is ordinary Python and gone in the graph.
An ``if`` on a value makes a region of the graph; both sides must be valid everywhere,
as every lane may compute both.
"""

from __future__ import annotations

import ast
import copy
import hashlib
import inspect
import marshal
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from functools import cache, lru_cache, reduce, update_wrapper
from numbers import Real
from pathlib import Path
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any, Protocol, TypeAlias, cast

from nsdrill.cache import load, save
from nsdrill.compiler.functions import route
from nsdrill.compiler.language import LanguageError, definition, parts_of
from nsdrill.equations.graph import Graph, Node
from nsdrill.equations.library import FUNCTIONS

KINDS = {"s": "states", "p": "lane parameters"}


Function: TypeAlias = Callable[..., Any]  # of equations, of nodes or of numbers


class Course(Protocol):
    """What equations read in place of the time, the phase, states and parameters."""

    def moved(self, t: Node, phase: Node, s: Inputs, p: Inputs) -> tuple[object, ...]: ...


class Absent:
    """The value of a name that is not assigned before an `if`."""


ABSENT = Absent()


class Named(SimpleNamespace):
    """States, parameters or options by their names."""


class Inputs(Named):
    """The inputs of these names; ``kind`` precedes them, as a state and a parameter may
    have one name."""

    def __init__(self, graph: Graph, names: Iterable[str], kind: str) -> None:
        super().__init__(**{name: graph.input(f"{kind}.{name}") for name in names})
        self._kind = kind

    def __setattr__(self, name: str, value: object) -> None:
        if name != "_kind":
            raise AttributeError(
                f"found a new value of {name}, one of the {KINDS[self._kind]}, which are given; "
                "allowed: another name for it"
            )
        super().__setattr__(name, value)

    def __getattr__(self, name: str) -> Any:
        known = [known for known in vars(self) if known != "_kind"]
        near = get_close_matches(name, known, 1)
        raise AttributeError(
            f"found {name}, which is none of the {KINDS[self._kind]}; "
            + (f"did you mean {near[0]}? " if near else "")
            + f"allowed: {', '.join(known)}"
        )


def traced(
    function: Function,
    states: Iterable[str],
    parameters: Iterable[str],
    options: object,
    course: Course | None = None,
    *,
    with_slopes: bool = False,
) -> tuple[Graph, dict[str, Node], dict[str, Node]]:
    """(graph, slopes, outputs) of the equations ``function(t, phase, s, p, o)``,
    which read what ``course`` makes of these, if there is one;
    ``with_slopes`` if the slopes of the laws of friction will be needed."""
    graph = Graph(with_slopes=with_slopes)
    s, p = Inputs(graph, states, "s"), Inputs(graph, parameters, "p")
    given: tuple[Any, ...] = (graph.input("time"), graph.input("phase"), s, p)
    if course is not None:
        given = course.moved(*given)
    try:
        found = prepared(function)(*given, options)
    except LanguageError:
        raise
    except Exception as error:
        raise LanguageError(_placed(error, function)) from error
    slopes, outputs = found if isinstance(found, tuple) and len(found) == 2 else (found, {})
    return graph, _nodes(graph, slopes, function), _nodes(graph, outputs, function)


def _nodes(graph: Graph, found: object, function: Function) -> dict[str, Node]:
    """The values that equations return, by name."""
    if not isinstance(found, Mapping):
        raise LanguageError(
            f"{place_of(function)}: found {found!r} as what it returns; allowed: a dictionary of the slopes by the "
            "names of their velocities and states of first order, or a pair of it and a dictionary of further outputs."
        )
    for name, value in found.items():
        if not isinstance(value, (Node, Real)):
            raise LanguageError(f"{place_of(function)}: found {value!r} as {name}; allowed: a number or a value.")
    return {name: graph.node(value) for name, value in found.items()}


def place_of(function: Function) -> str:
    """File, line and name of a function."""
    code = function.__code__
    return f"{code.co_filename}, line {code.co_firstlineno}: {code.co_name}"


def _placed(error: Exception, function: Function) -> str:
    """What is wrong with equations, with file, line and source of the innermost place
    that is not the compiler's."""
    here = str(Path(__file__).parent)
    places = [
        place for place in traceback.extract_tb(error.__traceback__) if not place.filename.startswith((here, "<"))
    ]
    text = str(error) or type(error).__name__
    if not places:
        return f"{place_of(function)}: {text}."
    last = places[-1]
    if "'Absent'" in text:
        text = "found a name that only one side of an `if` on a value assigns; allowed: a value before"
    elif isinstance(error, TypeError) and "allowed:" not in text:
        text += (
            "; allowed on values: + - * / **, comparisons, abs, max, min, and of "
            f"nsdrill.equations.library {', '.join(FUNCTIONS)}"
        )
    elif isinstance(error, AttributeError) and hasattr(error.obj, "_fields"):  # options
        near = get_close_matches(error.name or "", error.obj._fields, 1)
        text = (
            f"found {error.name}, which is none of the options; "
            + (f"did you mean {near[0]}? " if near else "")
            + f"allowed: {', '.join(error.obj._fields)}"
        )
    elif not isinstance(error, (TypeError, AttributeError)):
        text = f"{type(error).__name__}: {text}"
    source = (last.line or "").rstrip(":")
    return f"{last.filename}, line {last.lineno}: {last.name}: {source}: {text}."


class Part:
    def __init__(self, function: Function) -> None:
        self.py_func = function  # what identifies it
        update_wrapper(self, function)

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        return _prepared(self.py_func, False)(*arguments, **named)


def part(function: Function) -> Part:
    """A function that equations call and that has conditions itself, such as a law."""
    return Part(function)


def prepared(function: Function) -> Function:
    """The function of the equations, for nodes as well as for numbers."""
    return _prepared(function, True)


@lru_cache
def _prepared(function: Function, remember: bool) -> Function:
    assert isinstance(function, FunctionType)
    scope = {**function.__globals__, **inspect.getclosurevars(function).nonlocals, **_WORDS}
    exec(_changed(function, remember), scope)
    made = scope[function.__name__]
    made.__defaults__, made.__kwdefaults__ = function.__defaults__, function.__kwdefaults__
    return made


def _changed(function: FunctionType, remember: bool) -> CodeType:
    """The code of a module that defines the function with the changes, without its
    defaults. To make it takes longer than all tracing, and it depends on the code of
    the function alone, so that it is kept on disk."""
    code = function.__code__
    place = code.co_filename, code.co_firstlineno, code.co_linetable  # for messages
    text = repr((parts_of(code), place, remember, _own_digest()))
    name = f"changed-{hashlib.sha256(text.encode()).hexdigest()[:32]}"
    is_kept = route() == "native"
    if is_kept and (found := load(name, _loaded)) is not None:
        return cast(CodeType, found)
    body = copy.deepcopy(definition(function))
    body.decorator_list, body.returns = [], None
    body.args.defaults, body.args.kw_defaults = [], [None] * len(body.args.kwonlyargs)
    for argument in ast.walk(body.args):
        if isinstance(argument, ast.arg):
            argument.annotation = None  # would be evaluated
    tree = ast.fix_missing_locations(_Changes(remember).visit(ast.Module([body], [])))
    made = cast(CodeType, compile(tree, inspect.getfile(function), "exec"))
    if is_kept:
        save(name, marshal.dumps(made))
    return made


def _loaded(content: bytes) -> CodeType:
    made = marshal.loads(content)
    if not isinstance(made, CodeType):
        raise ValueError("it is no code of Python")
    return made


@cache
def _own_digest() -> bytes:
    """A digest of what makes the changes."""
    text = f"{sys.version} {sys.flags.optimize}".encode() + Path(__file__).read_bytes()
    return hashlib.sha256(text).digest()


class _Changes(ast.NodeTransformer):
    def __init__(self, remember: bool) -> None:
        self.remember, self.count = remember, 0

    def visit_IfExp(self, node: ast.IfExp) -> ast.AST:
        self.generic_visit(node)
        return _call("_select", node.test, _lambda(node.body), _lambda(node.orelse))

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        self.generic_visit(node)
        name = "_and" if isinstance(node.op, ast.And) else "_or"
        value = node.values[0]
        for other in node.values[1:]:
            value = _call(name, value, _lambda(other))
        return value

    def visit_UnaryOp(self, node: ast.UnaryOp) -> ast.AST:
        self.generic_visit(node)
        return _call("_not", node.operand) if isinstance(node.op, ast.Not) else node

    def visit_Assign(self, node: ast.Assign) -> ast.AST | list[ast.stmt]:
        self.generic_visit(node)
        remembered = [ast.Expr(_call("_remember", ast.Constant(n), _name(n))) for n in _stored([node])]
        return [node, *remembered] if self.remember else node

    def visit_If(self, node: ast.If) -> ast.AST | list[ast.stmt]:
        names = _stored([*node.body, *node.orelse])
        returns = any(isinstance(inner, ast.Return) for inner in ast.walk(node))
        self.generic_visit(node)
        if returns:
            return node  # on options only: a node has no truth
        self.count += 1
        sides = {f"_side_{self.count}": node.body, f"_other_{self.count}": node.orelse}
        back = ast.Return(ast.Tuple([_name(n) for n in names], ast.Load()))
        functions = []
        for name, body in sides.items():
            function = ast.parse(f"def {name}({', '.join(names)}): pass").body[0]
            assert isinstance(function, ast.FunctionDef)
            # a name that neither side knows stays absent
            function.body = [*body, back]
            functions.append(function)
        call = _call(
            "_branch",
            node.test,
            *map(_name, sides),
            ast.Tuple([ast.Constant(n) for n in names], ast.Load()),
            _call("locals"),
        )
        targets = ast.Tuple([ast.Name(n, ast.Store()) for n in names], ast.Store())
        return [*functions, ast.Assign([targets], call)]


def _stored(statements: Iterable[ast.AST]) -> list[str]:
    """The names that statements assign, less those of comprehensions."""
    names, todo = set(), list(statements)
    while todo:
        node = todo.pop()
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            names.add(node.id)
        if not isinstance(node, ast.comprehension):
            todo += ast.iter_child_nodes(node)
    return sorted(names)


def _name(name: str) -> ast.Name:
    return ast.Name(name, ast.Load())


def _call(name: str, *arguments: ast.expr) -> ast.Call:
    return ast.Call(_name(name), list(arguments), [])


def _lambda(body: ast.expr) -> ast.Lambda:
    return ast.Lambda(ast.arguments([], [], None, [], [], None, []), body)


# What the changed tree calls.


def _select(condition: Any, a: Callable[[], Any], b: Callable[[], Any]) -> Any:
    if not isinstance(condition, Node):
        return a() if condition else b()
    one, two = a(), b()
    if isinstance(one, tuple):
        return tuple(condition.graph.select(condition, *pair) for pair in zip(one, two, strict=True))
    return condition.graph.select(condition, one, two)


def _branch(condition: Any, side: Any, other: Any, names: tuple[str, ...], scope: Mapping[str, Any]) -> tuple[Any, ...]:
    """The values of ``names`` after an ``if``."""
    before = {name: scope.get(name, ABSENT) for name in names}
    if not isinstance(condition, Node):
        return tuple((side if condition else other)(**before))
    graph = condition.graph
    region = graph.new_region(condition)
    with graph.inside(region):
        inner = side(**before)
    outer = other(**before)
    return tuple(
        a
        if a is b
        else ABSENT  # what one side alone assigns is not known afterwards
        if a is ABSENT or b is ABSENT
        else graph.make("join", condition, a, b, extra=region)
        for a, b in zip(inner, outer, strict=True)
    )


def _remember(name: str, value: Any) -> None:
    if isinstance(value, Node):
        value.graph.names[name] = value


def _and(a: Any, b: Callable[[], Any]) -> Any:
    if not isinstance(a, Node):
        return a and b()
    other = b()
    return (a & other) if isinstance(other, Node) else (other and a)


def _or(a: Any, b: Callable[[], Any]) -> Any:
    if not isinstance(a, Node):
        return a or b()
    other = b()
    return (a | other) if isinstance(other, Node) else (other or a)


def _not(a: Any) -> Any:
    return a.graph.make("not", a) if isinstance(a, Node) else not a


def _extreme(op: str, plain: Callable[..., Any]) -> Callable[..., Any]:
    def extreme(*values: Any) -> Any:
        graph = next((value.graph for value in values if isinstance(value, Node)), None)
        if graph is None:
            return plain(*values)
        return reduce(lambda a, b: graph.make(op, a, b), values)

    return extreme


_WORDS = {
    "_select": _select, "_branch": _branch, "_remember": _remember, "_and": _and, "_or": _or,
    "_not": _not, "max": _extreme("max", max), "min": _extreme("min", min),
}  # fmt: skip
