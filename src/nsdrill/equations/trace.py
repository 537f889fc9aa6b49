"""From the function of a model's equations to its graph.

The function is plain scalar Python. Before it runs on nodes, its syntax tree is changed
where Python cannot be told what to do with a node: ``if`` and ``a if c else b``,
``and``, ``or``, ``not``, ``max`` and ``min``; and what it assigns is remembered by its
name (:mod:`.changes`). An ``if`` on an option, and every loop, is ordinary Python and
gone in the graph. An ``if`` on a value makes a region of the graph; both sides must be
valid everywhere, as every lane may compute both.

What would mean something else in the graph than in Python is refused. The function of a
model of another package runs twice: the second time it must make the same graph, and
what the sides of conditions change is looked for (:mod:`.effects`).
"""

from __future__ import annotations

import ast
import copy
import hashlib
import inspect
import marshal
import re
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from functools import cache, lru_cache, reduce, update_wrapper
from math import isfinite
from numbers import Real
from pathlib import Path
from types import CodeType, FunctionType, SimpleNamespace
from typing import Any, NoReturn, Protocol, TypeAlias, cast
from weakref import WeakSet

from nsdrill.cache import load, save
from nsdrill.compiler.functions import route
from nsdrill.compiler.language import LanguageError, definition, parts_of
from nsdrill.equations import changes
from nsdrill.equations.changes import AROUND, REMEDY, WORD, Changes, forbidden, meanings
from nsdrill.equations.effects import (
    FROM_OUTSIDE,
    READ_ANEW,
    SECONDS,
    Hanging,
    Kept,
    is_foreign,
    read_afresh,
    refuse_keys,
    sources,
    watched,
)
from nsdrill.equations.graph import TRUTHS, Graph, Node, Refused
from nsdrill.equations.library import FUNCTIONS, OF_NUMPY
from nsdrill.equations.unseen import IDENTITY, MATCHED, told, unseen
from nsdrill.errors import InputError

KINDS = {"s": "states", "p": "lane parameters"}


Function: TypeAlias = Callable[..., Any]  # of equations, of nodes or of numbers


class Course(Protocol):
    """What equations read in place of the time, the phase, states and parameters."""

    def moved(self, t: Node, phase: Node, s: Inputs, p: Inputs) -> tuple[object, ...]: ...


class Absent:
    """The value of a name after an `if` on a value, where it is no value on a side."""

    def _used(self, *others: object) -> NoReturn:
        raise Refused(
            "found a name that only one side of an `if` on a value assigns, or to which a side gives what is no "
            "number; allowed: a value before"
        )

    __bool__ = __eq__ = __ne__ = __call__ = __iter__ = __len__ = __getitem__ = __float__ = _used
    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _used
    __neg__ = __abs__ = __pow__ = __lt__ = __le__ = __gt__ = __ge__ = __contains__ = __str__ = _used
    __hash__ = object.__hash__

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):
            raise AttributeError(name)
        self._used()


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
    foreign = is_foreign(getattr(function, "__module__", ""))
    if foreign:  # the texts of this package are checked by its tests
        check_text(function)
    given = function, tuple(states), tuple(parameters), options, course, with_slopes
    first = _run(*given, False)
    if foreign and _signature(*first) != _signature(*_run(*given, True)):
        refuse_to_change(function)
    return first


def refuse_to_change(function: Function) -> NoReturn:
    """LanguageError of a function that gives something else when it is read again."""
    raise LanguageError(
        f"{place_of(function)}: found other equations when they were read again, with the same arguments; allowed: "
        "what follows from the arguments and from constants, without random numbers and what an earlier call has left."
    )


Read: TypeAlias = tuple[Graph, dict[str, Node], dict[str, Node]]


def _run(
    function: Function,
    states: tuple[str, ...],
    parameters: tuple[str, ...],
    options: object,
    course: Course | None,
    with_slopes: bool,
    again: bool,
) -> Read:
    graph = Graph(with_slopes=with_slopes, checks_effects=again)
    s, p = Inputs(graph, states, "s"), Inputs(graph, parameters, "p")
    given: tuple[Any, ...] = (graph.input("time"), graph.input("phase"), s, p)
    if course is not None:
        given = course.moved(*given)
    found = evaluated(graph, function, *given, options)
    slopes, outputs = found if isinstance(found, tuple) and len(found) == 2 else (found, {})
    return graph, _nodes(graph, slopes, function), _nodes(graph, outputs, function)


def evaluated(graph: Graph, function: Function, *given: Any, **numbers: Any) -> Any:
    """What equations give on the nodes of a graph. LanguageError, with the place, where
    they do what lanes cannot."""
    try:
        kept = Kept({function.__name__: function}) if graph.checks_effects else None
        graph.is_open = True
        with watched(graph, function.__name__):
            found = prepared(function)(*given, **numbers)
        if is_foreign(function.__module__):
            check_questions(function)
        if kept is not None and (name := kept.changed()) is not None:
            graph.refuse(
                f"found a change of `{name}`, which is there before and after a call; allowed: values that are "
                "returned, as equations are read once for all steps and lanes"
            )
        if graph.refused is not None:  # the equations have caught it
            raise graph.refused
    except LanguageError:
        raise
    except BaseException as error:  # also SystemExit
        if isinstance(error, KeyboardInterrupt) and not _is_raised_by_equations(error):
            raise
        first = graph.refused or error  # a library may have caught it, and raised another
        raise LanguageError(_placed(first, function)) from first
    finally:
        graph.is_open = False
    return found


def _signature(graph: Graph, slopes: dict[str, Node], outputs: dict[str, Node]) -> object:
    """What tells whether two graphs are the same."""
    nodes = [(node.op, [arg.id for arg in node.args], node.region, node.extra) for node in graph.nodes]
    named = [{name: node.id for name, node in named.items()} for named in (slopes, outputs, graph.names, graph.gaps)]
    return nodes, named, [contact.name for contact in graph.frictions]


@lru_cache(maxsize=256)
def check_text(function: Function) -> None:
    """LanguageError where the text of equations, or of a function of the model that they
    call, has what neither may have."""
    if not isinstance(function, FunctionType):
        raise LanguageError(
            f"found {function!r:.80} as the equations of a model; allowed: a plain function of (t, phase, s, p, o), in "
            "a class as `equations = staticmethod(equations)`."
        )
    if not is_foreign(function.__module__):
        return  # ours are tested
    refuse_keys()
    for each in (function, *sources(function)):
        try:
            tree = definition(each)
        except LanguageError:
            if each is function:
                raise
            continue  # without a text, as one of another compiler
        try:
            forbidden(tree, each.__code__.co_freevars)
        except Refused as error:
            raise LanguageError(
                _told(each.__code__.co_filename, error.line, each.__name__, error.source, error)
            ) from error
        if (read := read_afresh(each, tree)) is not None:
            words = READ_ANEW.format(FROM_OUTSIDE)
            raise LanguageError(_told(each.__code__.co_filename, read[0], each.__name__, read[1], words))


@lru_cache(maxsize=256)
def check_questions(function: Function) -> None:
    """LanguageError where equations that have been run, or a function of the model that they
    call, ask of a value what it cannot answer."""
    assert isinstance(function, FunctionType)
    for each in (function, *sources(function)):
        try:
            tree = definition(each)
        except LanguageError:
            continue  # without a text, or as check_text has refused it
        if (asked := unseen(each, tree, is_changed=each in _run_changed)) is not None:
            raise LanguageError(_told(each.__code__.co_filename, asked[0], each.__name__, *asked[1:]))


def _is_raised_by_equations(error: KeyboardInterrupt) -> bool:
    line = traceback.extract_tb(error.__traceback__)[-1].line or ""
    return line.startswith("raise KeyboardInterrupt")


def _nodes(graph: Graph, found: object, function: Function) -> dict[str, Node]:
    """The values that equations return, by name."""
    if not isinstance(found, Mapping):
        raise LanguageError(
            f"{place_of(function)}: found {found!r} as what it returns; allowed: a dictionary of the slopes by the "
            "names of their velocities and states of first order, or a pair of it and a dictionary of further outputs."
        )
    for name, value in found.items():
        if value is ABSENT:
            raise LanguageError(
                f"{place_of(function)}: found as {name} what only one side of an `if` on a value assigns; allowed: a "
                "value before."
            )
        if not isinstance(value, (Node, Real)) or not (isinstance(value, Node) or isfinite(value)):
            raise LanguageError(
                f"{place_of(function)}: found {value!r} as {name}; allowed: a number or a value that is finite."
            )
    return {name: graph.number(value) for name, value in found.items()}


def check_given(function: Function, what: str, found: Iterable[str], wanted: Iterable[str]) -> None:
    """LanguageError where equations give ``what`` of other names than is wanted."""
    if set(found) != set(wanted):
        first, second = (", ".join(sorted(names)) or "nothing" for names in (found, wanted))
        raise LanguageError(f"{place_of(function)}: found {what} of {first}; allowed: of {second}, all of them.")


def place_of(function: Function) -> str:
    """File, line and name of a function, or of the one of a script that is ``written`` and
    that it calls."""
    code = getattr(function, "written", function).__code__
    return f"{code.co_filename}, line {code.co_firstlineno}: {code.co_name}"


def _told(file: str, line: int | None, name: str, source: str, error: BaseException | str) -> str:
    return f"{file}, line {line}: {name}: {f'{source}: ' * bool(source)}{str(error).rstrip('.')}."


# Python's words of a call that gives an argument that is not there, or not all of them.
WRONG_CALL = re.compile(r"\(\) (got |takes |missing )|missing a required|too many positional|unexpected keyword")


def _placed(error: BaseException, function: Function) -> str:
    """What is wrong with equations, with file, line and source of the innermost place
    that is their author's: of a script none of nsdrill, of nsdrill none of the compiler."""
    here = str(Path(__file__).parent)
    walked = list(traceback.walk_tb(error.__traceback__))
    modules = [str(frame.f_globals.get("__name__", "")) for frame, _ in walked]
    is_script = any(map(is_foreign, modules)) or hasattr(function, "written")
    places = [
        place
        for place, module in zip(traceback.extract_tb(error.__traceback__), modules, strict=True)
        if not place.filename.startswith((here, "<")) and "/contextlib.py" not in place.filename
        if is_foreign(module) or not is_script
    ]
    text = str(error) or type(error).__name__
    if isinstance(error, Hanging):
        text = f"found equations that do not end: after {SECONDS:g} s they are here; allowed: loops that end"
    elif isinstance(error, TypeError) and "allowed" not in text and not WRONG_CALL.search(text):
        text += (
            f"; allowed on values: + - * / **, comparisons, abs, max, min, of numpy {', '.join(OF_NUMPY)}, and of "
            f"nsdrill.equations.library {', '.join(FUNCTIONS)}"
        )
    elif isinstance(error, AttributeError) and hasattr(error.obj, "_fields"):  # options
        near = get_close_matches(error.name or "", error.obj._fields, 1)
        text = (
            f"found {error.name}, which is none of the options; "
            + (f"did you mean {near[0]}? " if near else "")
            + f"allowed: {', '.join(error.obj._fields)}"
        )
    elif not isinstance(error, Exception):
        said = f": {error}" if str(error) else ""
        text = (
            f"found {type(error).__name__}{said} while the equations are read; allowed: equations that end by returning"
        )
    elif not isinstance(error, (TypeError, AttributeError, InputError)):
        text = f"{type(error).__name__}: {text}"
    if not places:  # an error of what is returned says its place
        return text if isinstance(error, InputError) else f"{place_of(function)}: {text.rstrip('.')}."
    last = places[-1]
    line, source = last.lineno, (last.line or "").rstrip(":")
    if isinstance(error, Refused) and error.line:
        line, source = error.line, error.source
    return _told(last.filename, line, last.name, source, text)


_run_changed: WeakSet[Function] = WeakSet()  # the functions that have run as their changed trees


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


def _prepared(function: Function, remember: bool) -> Function:
    _run_changed.add(function)
    code = _compiled(function, remember)
    space = {**function.__globals__, **inspect.getclosurevars(function).nonlocals, **_WORDS}
    made = FunctionType(code, space, function.__name__, function.__defaults__)
    made.__kwdefaults__ = function.__kwdefaults__
    if space.get(function.__name__, function) is function:
        space[function.__name__] = made  # it may call itself
    return made


@lru_cache(maxsize=1024)
def _compiled(function: Function, remember: bool) -> CodeType:
    """The code of the changed function, without its defaults and its closure."""
    assert isinstance(function, FunctionType)
    module = _changed(function, remember)
    name = function.__code__.co_name  # that of its text, whatever it is called since
    return next(part for part in module.co_consts if isinstance(part, CodeType) and part.co_name == name)


def _changed(function: FunctionType, remember: bool) -> CodeType:
    """The code of a module that defines the function with the changes, without its
    defaults. To make it takes longer than all tracing, and it depends on the code of
    the function alone, so that it is kept on disk."""
    code = function.__code__
    own = {*code.co_varnames, *code.co_cellvars}
    own |= meanings(("max", "min"), {**function.__globals__, **inspect.getclosurevars(function).nonlocals})
    place = code.co_filename, code.co_firstlineno, code.co_linetable  # for messages
    text = repr((parts_of(code), place, remember, sorted(own), _own_digest()))
    name = f"changed-{hashlib.sha256(text.encode()).hexdigest()[:32]}"
    is_kept = route() == "native"
    if is_kept and (found := load(name, _loaded)) is not None:
        return cast(CodeType, found)
    body = copy.deepcopy(definition(function))
    body.name, body.decorator_list, body.returns = code.co_name, [], None
    none = ast.Constant(None)
    body.args.defaults = [none for _ in body.args.defaults]
    body.args.kw_defaults = [value and none for value in body.args.kw_defaults]
    for argument in ast.walk(body.args):
        if isinstance(argument, ast.arg):
            argument.annotation = None  # would be evaluated
    try:
        tree = ast.fix_missing_locations(ast.Module([Changes(remember, own).visit(body)], []))
        made = cast(CodeType, compile(tree, code.co_filename, "exec"))
    except SyntaxError as error:
        raise LanguageError(
            _told(code.co_filename, error.lineno, function.__name__, "", f"{error.msg}; {AROUND}")
        ) from error
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
    sources_of_changes = [Path(file).read_bytes() for file in (__file__, str(changes.__file__))]
    return hashlib.sha256(b"".join([f"{sys.version} {sys.flags.optimize}".encode(), *sources_of_changes])).digest()


# What the changed tree calls.


def _option(test: Any, line: int, source: str, what: str) -> Any:
    """The ``test`` of a condition on options, under which stands more than a choice of
    values."""
    if isinstance(test, Node):
        test.graph.refuse(f"found {what} under a condition on a value; {REMEDY}", line, source)
    return test


def _quietly(graph: Graph, side: Callable[..., Any], before: Mapping[str, Any]) -> Any:
    """What a side of a condition on a value gives, which changes nothing."""
    if not graph.checks_effects:
        return side(**before)
    kept = Kept({"": side, **before})
    found = side(**before)
    if (name := kept.changed()) is not None:
        graph.refuse(f"found a change of `{name}` under a condition on a value; {REMEDY}")
    return found


def _select(condition: Any, a: Callable[[], Any], b: Callable[[], Any]) -> Any:
    if not isinstance(condition, Node):
        return a() if condition else b()
    graph = condition.graph
    return _chosen(graph, graph.truth(condition), _quietly(graph, a, {}), _quietly(graph, b, {}))


def _chosen(graph: Graph, condition: Node, one: Any, two: Any) -> Any:
    if isinstance(one, tuple) and isinstance(two, tuple) and len(one) == len(two):
        made = [_chosen(graph, condition, *pair) for pair in zip(one, two, strict=True)]
        return type(one)(*made) if hasattr(one, "_fields") else tuple(made)
    return graph.select(condition, one, two)


def _branch(condition: Any, side: Any, other: Any, names: tuple[str, ...], scope: Mapping[str, Any]) -> tuple[Any, ...]:
    """The values of ``names`` after an ``if``."""
    before = {name: scope.get(name, ABSENT) for name in names}
    if not isinstance(condition, Node):
        return tuple((side if condition else other)(**before))
    graph = condition.graph
    condition = graph.truth(condition)
    region = graph.new_region(condition)
    with graph.inside(region):
        inner = [_number(value) for value in _quietly(graph, side, before)]
    outer = [_number(value) for value in _quietly(graph, other, before)]
    return tuple(_joined(graph, condition, region, a, b) for a, b in zip(inner, outer, strict=True))


def _number(value: Any) -> Any:
    return value.graph.number(value) if isinstance(value, Node) else value


def _joined(graph: Graph, condition: Node, region: int, a: Any, b: Any) -> Any:
    """A value that is ``a`` where the condition holds, else ``b``."""
    if a is b:
        return a
    if all(isinstance(one, (Node, Real)) for one in (a, b)):
        return graph.make("join", condition, a, b, extra=region)
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        made = [_joined(graph, condition, region, *pair) for pair in zip(a, b, strict=True)]
        return type(a)(*made) if hasattr(a, "_fields") else tuple(made)
    return ABSENT  # what one side alone assigns is not known afterwards


def _remember(name: str, value: Any) -> None:
    if isinstance(value, Node):
        value.graph.names[name] = value


def _named(name: str, value: Any) -> Any:
    _remember(name, value)
    return value


def _and(a: Any, b: Callable[[], Any]) -> Any:
    if not isinstance(a, Node):
        return a and b()
    graph = a.graph
    return _joint(a, _quietly(graph, b, {}), "and", lambda two: graph.select(graph.truth(a), two, a))


def _or(a: Any, b: Callable[[], Any]) -> Any:
    if not isinstance(a, Node):
        return a or b()
    graph = a.graph
    return _joint(a, _quietly(graph, b, {}), "or", lambda two: graph.select(graph.truth(a), a, two))


def _joint(a: Node, b: Any, op: str, choice: Callable[[Any], Node]) -> Any:
    """``a and b`` or ``a or b``: of truths a truth, else one of the two."""
    if isinstance(b, bool):
        return a if b == (op == "and") else b if a.op in TRUTHS else choice(b)
    if isinstance(b, Node) and a.op in TRUTHS and b.op in TRUTHS:
        return a.graph.make(op, a, b)
    return choice(b)


def _not(a: Any) -> Any:
    return a.graph.make("not", a.graph.truth(a)) if isinstance(a, Node) else not a


def _equal(a: Any, b: Any) -> Any:
    for one, other in ((a, b), (b, a)):
        if isinstance(one, Node):
            return one.graph.equal(one, other)
    return a == b


def _is(a: Any, b: Any) -> bool:
    for one in (a, b):
        if isinstance(one, Node):
            one.graph.refuse(told(IDENTITY))
    return a is b


def _matched(subject: Any) -> Any:
    for one in subject if isinstance(subject, (tuple, list)) else (subject,):
        if isinstance(one, Node):
            one.graph.refuse(told(MATCHED))
    return subject


def _extreme(op: str, plain: Callable[..., Any]) -> Callable[..., Any]:
    def extreme(*given: Any, **named: Any) -> Any:
        values = tuple(given[0]) if len(given) == 1 and not named else given
        graph = next((value.graph for value in values if isinstance(value, Node)), None)
        if graph is None or named:
            return plain(*(given if named else (values,)), **named)
        return reduce(lambda a, b: graph.make(op, a, b), values)

    return extreme


_WORDS: dict[str, Any] = {
    f"{WORD}{name}": word
    for name, word in {
        "select": _select, "branch": _branch, "option": _option, "remember": _remember, "named": _named, "and": _and,
        "or": _or, "not": _not, "equal": _equal, "is": _is, "matched": _matched,
        "max": _extreme("max", max), "min": _extreme("min", min),
        "locals": locals,
    }.items()
}  # fmt: skip
