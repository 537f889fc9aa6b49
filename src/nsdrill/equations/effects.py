"""What equations do besides giving values: what they change, print, or never end.

Equations are read once for all lanes and all steps, and both sides of a condition on a
value run. So what they change would be changed at the wrong time, or for the wrong
lanes. Objects that they can reach are compared before and after.
"""

from __future__ import annotations

import ast
import builtins
import ctypes
import datetime
import importlib
import inspect
import linecache
import os
import re
import sys
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache, partial
from io import TextIOBase
from operator import length_hint
from types import CodeType, FunctionType, GeneratorType, MethodType, ModuleType
from typing import Any, ClassVar, NoReturn

import numpy as np

from nsdrill.equations.graph import TEXT, Graph, Node

SECONDS = 20.0  # the longest string takes a hundredth of one
PATIENCE = 0.25
PACKAGES = frozenset({"nsdrill", "numpy", "scipy", "builtins"})  # whose objects equations do not change


# What gives another value in another run, though often none between two readings.
AFRESH: frozenset[object] = frozenset(
    {
        *(open, input, hash, id),  # the last two differ between processes
        datetime.date.today,
        datetime.datetime.now,
        datetime.datetime.today,
        datetime.datetime.utcnow,
        *(one for name, one in vars(time).items() if callable(one) and name not in ("struct_time", "strptime")),
        *(getattr(os.path, name) for name in ("abspath", "realpath", "relpath", "expandvars", "expanduser")),
    }
)
# The modules whose functions and classes are all about files, processes, the machine and random numbers.
OUTSIDE = frozenset(
    {
        *("io", "_io", "os", "posix", "nt", "genericpath", "pathlib", "glob", "shutil", "tempfile", "mmap", "sqlite3"),
        *("subprocess", "multiprocessing", "socket", "_socket", "urllib.request", "platform", "getpass"),
        *("secrets", "uuid", "h5py._hl.files", "random"),
    }
)
# Modules of which what is no function tells of the machine, its place or its time zone, too.
OF_MACHINE = OUTSIDE | {"sys", "time", "sysconfig", "site", "locale"}
SAME_EVERYWHERE = frozenset({"float_info", "exit"})  # of these
# What a module says of where and as what it was loaded.
OF_PLACE = frozenset({"__file__", "__cached__", "__path__", "__spec__", "__loader__", "__name__", "__version__"})
DRAWS = frozenset({"rvs", "resample"})  # methods of the distributions of SciPy, not of classes of a model
SEEDED = frozenset({"random_state", "rng", "seed"})  # arguments of functions of SciPy that draw
UNREAD = frozenset({eval, exec})  # what stands in their text is not read
# What Python says of whatever uses these from within a library (PEP 578).
AUDITED = ("os.", "socket.", "subprocess.", "shutil.", "urllib.", "sqlite3.", "glob.", "tempfile.", "mmap.")
# What reads the text of programs: modules that are imported, lines that a warning shows, what is compiled.
READERS = re.compile(
    r"(linecache|warnings|traceback|inspect|tokenize|zipimport|pkgutil|_frozen_importlib\w*|importlib"
    r"|nsdrill\.(cache|compiler|equations))(\.|$)"
)
READ_ANEW = (
    "found what is read anew in every run, {}; allowed: what follows from the arguments and from constants. A value "
    "that is read once stands above the function, as a name, or is a number of the study"
)
FROM_OUTSIDE = "the time of day, a file, the environment, the machine or random numbers"


class Hanging(BaseException):
    """Equations did not end."""


def is_foreign(module: str | None) -> bool:
    """Whether a module is of a model, and not of Python or of nsdrill."""
    top = (module or "").partition(".")[0]
    return top not in PACKAGES and top not in sys.stdlib_module_names


def names_in(code: CodeType) -> set[str]:
    """The names of modules and attributes that code has, with what is defined in it."""
    inner = (names_in(constant) for constant in code.co_consts if isinstance(constant, CodeType))
    return set(code.co_names).union(*inner)


def referred(function: FunctionType) -> dict[str, object]:
    """What the names in a function of a model stand for."""
    found: dict[str, object] = {}
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            found[name] = cell.cell_contents
        except ValueError:  # not assigned yet
            continue
    if is_foreign(function.__globals__.get("__name__", "")):
        names = names_in(function.__code__)
        found |= {name: function.__globals__[name] for name in names & function.__globals__.keys()}
        for value in [*found.values()]:
            if isinstance(value, ModuleType) and is_foreign(value.__name__):
                found |= {f"{value.__name__}.{n}": getattr(value, n) for n in names if hasattr(value, n)}
    return found


def _contents(value: object) -> tuple[object, list[object]]:
    """(what tells whether an object has changed, the objects in it)."""
    if isinstance(value, dict):
        parts = [*value.keys(), *value.values()]
        return tuple(map(id, parts)), parts
    if isinstance(value, (list, tuple, deque)):
        parts = list(value)
        return tuple(map(id, parts)), parts
    if isinstance(value, (set, frozenset)):
        parts = list(value)
        return frozenset(map(id, parts)), parts
    if isinstance(value, np.ndarray):
        parts = value.ravel().tolist() if value.dtype == object else []
        return tuple(map(id, parts)) if parts else value.tobytes(), parts
    if isinstance(value, (bytearray, memoryview)):
        return bytes(value), []
    if isinstance(value, FunctionType):
        parts = [*referred(value).values(), *(value.__defaults__ or ()), *vars(value).values()]
        return tuple(map(id, parts)), parts
    if isinstance(value, MethodType):
        return None, [value.__self__, value.__func__]
    if isinstance(value, partial):
        return None, [value.func, value.args, value.keywords]
    if isinstance(value, GeneratorType):
        return value.gi_frame and value.gi_frame.f_lasti, []
    if hasattr(value, "__next__"):
        return (length_hint(value, -1), repr(value) if type(value).__module__ == "itertools" else ""), []
    if isinstance(value, type):
        parts = [*vars(value).values()] if is_foreign(value.__module__) else []
        return tuple(map(id, parts)), parts
    if isinstance(value, (int, float, str, bytes, complex, ModuleType, Graph)):
        return None, []
    parts = [*getattr(value, "__dict__", {}).values()]
    for kind in type(value).__mro__:
        slots = kind.__dict__.get("__slots__", ())
        for name in (slots,) if isinstance(slots, str) else slots:
            parts.append(getattr(value, name, None))
    if is_foreign(type(value).__module__):
        parts.append(type(value))
    return tuple(map(id, parts)), parts


class Kept:
    """The objects that can be reached from some names, as they are now."""

    def __init__(self, names: Mapping[str, object]) -> None:
        self.objects: dict[int, tuple[str, object, object, list[object]]] = {}
        todo = list(names.items())
        while todo:
            name, value = todo.pop()
            if type(value) is Node or value is None or id(value) in self.objects:
                continue
            state, parts = _contents(value)
            self.objects[id(value)] = name, value, state, parts
            todo += ((name, part) for part in parts)
            if isinstance(value, FunctionType):
                todo += referred(value).items()  # the last ones are taken first, under their own names

    def changed(self) -> str | None:
        """The name of something that has changed, None where nothing has."""
        for name, value, state, _ in self.objects.values():
            if _contents(value)[0] != state:
                return name
        return None


class _Routed(TextIOBase):
    """A standard output that gives what some threads write to others than ``output``."""

    output: Any = None
    writers: ClassVar[dict[int, list[Callable[[str], object]]]] = {}

    def write(self, text: str) -> int:
        mine = self.writers.get(threading.get_ident())
        (mine[-1] if mine else self.output.write)(text)
        return len(text)

    def flush(self) -> None:
        self.output.flush()

    def __getattr__(self, name: str) -> Any:
        return getattr(self.output, name)


_routed, _swapping = _Routed(), threading.Lock()


@contextmanager
def output_to(write: Callable[[str], object]) -> Iterator[None]:
    """A context in which what this thread prints is given to ``write``; other threads
    print as before, and may be in such a context too."""
    thread = threading.get_ident()
    with _swapping:
        if not _routed.writers:
            _routed.output, sys.stdout = sys.stdout, _routed
        _routed.writers.setdefault(thread, []).append(write)
    try:
        yield
    finally:
        with _swapping:
            _routed.writers[thread].pop()
            if not _routed.writers[thread]:
                del _routed.writers[thread]
            if not _routed.writers:
                sys.stdout = _routed.output


_reading: dict[int, Graph] = {}  # the graph of the equations that a thread runs


def _audit(event: str, given: tuple[object, ...]) -> None:
    """Refuse what uses a file, a process or the net in equations that run, however deep in a
    library: what it gives would be kept for all runs."""
    if not _reading or not (event == "open" or event.startswith(AUDITED)):
        return
    graph, frame = _reading.get(threading.get_ident()), sys._getframe(1)
    while graph is not None and frame is not None:
        name = frame.f_globals.get("__name__") or ""
        if READERS.match(name):
            return
        if is_foreign(name):
            what = given[0] if given else ""
            graph.refuse(READ_ANEW.format(f"{'a file' if event == 'open' else event}, {what!r:.60}"), frame.f_lineno)
        frame = frame.f_back  # type: ignore[assignment]  # None at the outermost


sys.addaudithook(_audit)


def _hash(node: Node) -> int:
    """The hash of a node, refused where equations of a script look a value up: two nodes are one
    key only where they are one object, whatever their numbers."""
    if node.graph.is_open and is_foreign(sys._getframe(1).f_globals.get("__name__")):
        node.graph.refuse(
            "found a value that is looked up in a dictionary or a set, or by a function with a cache, and it has no "
            "number while equations are read; allowed: comparisons, as `a if 0.5 < x < 1.5 else b`"
        )
    return object.__hash__(node)


def _text(node: Node) -> str:
    """The text of a node, refused where equations of a script ask for it."""
    if node.graph.is_open and is_foreign(sys._getframe(1).f_globals.get("__name__")):
        node.graph.refuse(TEXT)
    return _plain_text(node)


_plain_text = Node.__repr__
_refusing = False  # values as keys, while equations run: from the first script on


def refuse_keys() -> None:
    """Refuse values as keys of equations from now on: where a script is read, as this takes longer
    than the hash that a node has."""
    global _refusing
    _refusing = True


@contextmanager
def watched(graph: Graph, name: str) -> Iterator[None]:
    """A context in which the equations of ``name`` run: what they print is refused, and
    :class:`Hanging` is raised in them where they do not end."""
    ended, thread = threading.Event(), threading.get_ident()

    def refuse(text: str) -> NoReturn:
        graph.refuse(
            f"found output, {text.strip()[:40]!r}, and equations are read once, not at every step; allowed: nothing "
            "that is printed. A trace has what the equations give a name to"
        )

    def watch() -> None:
        for _ in range(round(SECONDS / PATIENCE)):  # not by the clock, as the machine may sleep
            if ended.wait(PATIENCE):
                return
        while not ended.wait(4 * PATIENCE):  # equations may catch it
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), ctypes.py_object(Hanging))

    watcher = threading.Thread(target=watch, daemon=True, name=f"watching {name}")
    watcher.start()
    outer, _reading[thread] = _reading.get(thread), graph
    if _refusing:
        Node.__hash__, Node.__repr__ = _hash, _text  # type: ignore[assignment,method-assign]
    try:
        with output_to(refuse):
            yield
    finally:
        del _reading[thread]
        if outer is not None:
            _reading[thread] = outer
        if not _reading:  # another thread may still read
            Node.__hash__, Node.__repr__ = object.__hash__, _plain_text  # type: ignore[assignment,method-assign]
        ended.set()
        watcher.join()


def sources(function: FunctionType, seen: set[object] | None = None) -> Iterable[FunctionType]:
    """The functions of a model that ``function`` refers to, with those they refer to."""
    seen = set() if seen is None else seen
    todo: list[Any] = [*referred(function).values()]
    held: dict[int, object] = {}  # what contains others, by its identity; it is kept, so that this is its own
    while todo:
        value = todo.pop()
        kind = value if isinstance(value, type) else type(value)
        if id(value) not in held and (inner_values := _held(value, kind)):
            held[id(value)] = value
            todo += inner_values
        if is_foreign(kind.__module__) and kind not in seen:
            seen.add(kind)
            todo += vars(kind).values()  # its methods
        for inner in ("py_func", "__wrapped__", "func", "__func__", "fget"):  # parts, cached and partial ones, ...
            if isinstance(getattr(value, inner, None), FunctionType):
                todo.append(getattr(value, inner))
        # what a decorator of Python made, as the methods of a dataclass, is not a model's
        if isinstance(value, FunctionType) and value not in seen and is_foreign(value.__globals__.get("__name__")):
            seen.add(value)
            yield value
            yield from sources(value, seen)


def _held(value: object, kind: type) -> list[Any]:
    """What a container holds, or an object of a model: functions among it are called too."""
    if isinstance(value, Mapping):
        return [*value.values()]
    if isinstance(value, (list, tuple, set, frozenset)):
        return [*value]
    if not isinstance(value, type) and is_foreign(kind.__module__):
        return [*getattr(value, "__dict__", {}).values()]
    return []


def read_afresh(function: FunctionType, tree: ast.AST) -> tuple[int, str] | None:
    """(line, source) of the first value from outside in the body of a ``function`` with this
    ``tree``: the time of day, a file, the environment, the machine or random numbers; None
    where there is none."""
    body = getattr(tree, "body", [])
    inner = [node for one in (body if isinstance(body, list) else [body]) for node in ast.walk(one)]
    known = known_in(function, inner)
    own = {*function.__code__.co_varnames, *function.__code__.co_cellvars}
    of_machine = {name: value for name, value in _imported_above(function).items() if name not in own}
    for node in inner:  # a call before what is called in it; what is not called here may be so under another name
        called = [node.func] if isinstance(node, ast.Call) else []
        is_afresh = any(_is_afresh(value_of(one, known)) for one in (*called, node))
        if is_afresh or _is_today(node, known) or _is_of_machine(node, known) or _is_drawn(node, known):
            return getattr(node, "lineno", 0), ast.unparse(node)
        if isinstance(node, ast.Name) and node.id in of_machine:
            return node.lineno, f"{node.id}, which is {of_machine[node.id]}"
    return None


def _imported_above(function: FunctionType) -> dict[str, str]:
    """The names that the text around a function imports of what a module says of the machine, as
    ``from sys import platform``, each with what it is: its value tells nothing of where it is from. In
    a notebook of all cells. One that is given another value, or is named in a line of its own, as
    ``PLATFORM = sys.platform``, is a constant of the model. Modules of the model are followed, from which
    the text has such a name."""
    names = function.__globals__
    cells = names.get("In") if names.get("__name__") == "__main__" else None
    texts = [one for one in cells if isinstance(one, str)] if isinstance(cells, list) else []
    found: dict[str, str] = {}
    for text in ("".join(linecache.getlines(function.__code__.co_filename)), *texts):
        found |= _of_machine_in(text) | _through_modules(text, str(names.get("__package__") or ""))
    return {name: told for name, told in found.items() if _is_still(names.get(name), told)}


def _is_still(value: object, told: str) -> bool:
    """Whether a name has the value of what it is told to be, as ``sys.platform``, and no other one since."""
    module, _, name = told.rpartition(".")
    return value is getattr(sys.modules.get(module), name, sys)


def _through_modules(text: str, package: str, seen: frozenset[str] = frozenset()) -> dict[str, str]:
    """The names that a text, of a module in a ``package``, imports from modules of the model, but for those ``seen``,
    which have them from one that tells of the machine."""
    found: dict[str, str] = {}
    for node in _imports_in(text):
        parents = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
        name = ".".join(filter(None, (*parents, node.module)))
        if name not in seen and (given := _of_machine_from(sys.modules.get(name), seen)):
            names = {one.name: one.asname or one.name for one in node.names}
            chosen = {one: one for one in given} if "*" in names else names
            found |= {own: given[one] for one, own in chosen.items() if one in given}
    return found


def _of_machine_from(module: ModuleType | None, seen: frozenset[str] = frozenset()) -> dict[str, str]:
    """The names of a module of the model that it has from one that tells of the machine."""
    file = getattr(module, "__file__", None)
    if module is None or not file or not is_foreign(module.__name__) or "site-packages" in file:
        return {}
    text = "".join(linecache.getlines(file))
    found = _of_machine_in(text) | _through_modules(text, module.__package__ or "", seen | {module.__name__})
    return {name: told for name, told in found.items() if _is_still(vars(module).get(name), told)}


@lru_cache(maxsize=64)
def _imports_in(text: str) -> tuple[ast.ImportFrom, ...]:
    """The imports of names in a text."""
    with suppress(SyntaxError, ValueError):  # a cell may have what is no Python
        return tuple(node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom))
    return ()


@lru_cache(maxsize=64)
def _of_machine_in(text: str) -> dict[str, str]:
    """The names of imports of a text that stand for what a module says of the machine."""
    found: dict[str, str] = {}
    for node in _imports_in(text):
        if node.level or node.module is None or node.module not in OF_MACHINE:
            continue
        with suppress(ImportError):  # of another system
            module = importlib.import_module(node.module)
            names = {one.name: one.asname or one.name for one in node.names}
            given = {name: name for name in vars(module)} if "*" in names else names
            for name, own in given.items():
                if _tells_of_machine(module, name):
                    found[own] = f"{node.module}.{name}"
    return found


def _tells_of_machine(module: ModuleType, name: str) -> bool:
    """Whether a name of a module is a value that tells of the machine: no function, but for those of ``sys``."""
    value = getattr(module, name, None)
    is_told = module.__name__ in OF_MACHINE and not isinstance(value, ModuleType) and value is not os.fspath
    return is_told and name not in SAME_EVERYWHERE and (not callable(value) or module is sys)


def known_in(function: FunctionType, inner: Iterable[ast.AST]) -> dict[str, object]:
    """What the names in a function stand for that are not its own, with what the nodes
    ``inner`` of its body import."""
    known = {**vars(builtins), **function.__globals__, **referred(function)}
    own = {*function.__code__.co_varnames, *function.__code__.co_cellvars}
    known = {name: value for name, value in known.items() if name not in own}
    for node in inner:
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            known |= _imported(node)
    return known


def _imported(node: ast.Import | ast.ImportFrom) -> dict[str, object]:
    """What the names of an import in equations stand for, of modules of Python."""
    names = [one.name for one in node.names] if isinstance(node, ast.Import) else [node.module or ""]
    if not all(name in sys.stdlib_module_names for name in names):
        return {}
    if isinstance(node, ast.Import):
        return {one.asname or one.name: importlib.import_module(one.name) for one in node.names}
    module = importlib.import_module(names[0])
    return {one.asname or one.name: getattr(module, one.name, None) for one in node.names}


def value_of(node: ast.AST, known: Mapping[str, object]) -> object:
    """What a name, an attribute of a module or a class of Python, or a module that is
    imported by its name stands for; None of another expression."""
    if isinstance(node, ast.Name):
        return known.get(node.id)
    if isinstance(node, ast.Attribute):
        of = value_of(node.value, known)
        return getattr(of, node.attr, None) if isinstance(of, (ModuleType, type)) else None
    if isinstance(attribute := _as_attribute(node, known), ast.Attribute):
        return value_of(attribute, known)
    if isinstance(node, ast.Call) and node.args and isinstance(last := node.args[-1], ast.Constant):
        called, name = value_of(node.func, known), str(last.value)
        if called in (__import__, importlib.import_module) and name in sys.stdlib_module_names:
            return importlib.import_module(name)
    return None


def _as_attribute(node: ast.AST, known: Mapping[str, object]) -> ast.AST:
    """A call of ``getattr`` with the name of an attribute as that attribute; another node as it is."""
    if not isinstance(node, ast.Call) or len(node.args) != 2 or value_of(node.func, known) is not getattr:
        return node
    of, name = node.args
    return ast.Attribute(of, str(name.value)) if isinstance(name, ast.Constant) else node


def _is_afresh(value: object) -> bool:
    if any(value is one for one in (os.environ, getattr(os, "environb", os.environ), sys.argv, sys.stdin)):
        return True
    if not callable(value) or value is os.fspath:
        return False
    with suppress(TypeError):  # one without a hash is none of these
        if value in AFRESH or value in UNREAD:
            return True
    places = str(getattr(value, "__module__", None)), type(getattr(value, "__self__", None)).__module__
    # numpy.random itself takes long to import
    return any(place in OUTSIDE or place.startswith("numpy.random") for place in places)


def _is_of_machine(node: ast.AST, known: Mapping[str, object]) -> bool:
    """Whether this is what a module says of the machine, or of its place and its version, as
    ``sys.platform`` and ``__file__``: no function, so that nothing is called."""
    if isinstance(node, ast.Name):
        return node.id in OF_PLACE and node.id in known
    node = _as_attribute(node, known)
    if not isinstance(node, ast.Attribute) or not isinstance(of := value_of(node.value, known), ModuleType):
        return False
    return node.attr in OF_PLACE or _tells_of_machine(of, node.attr) or node.attr in _of_machine_from(of)


def _is_drawn(node: ast.AST, known: Mapping[str, object]) -> bool:
    """Whether this draws numbers with SciPy, whose distributions do so by their methods."""
    if not isinstance(node, ast.Call):
        return False
    if isinstance(node.func, ast.Attribute) and node.func.attr in DRAWS:
        return _is_of_scipy(node.func, known)
    value = value_of(node.func, known)
    if value is None or not str(getattr(value, "__module__", "")).startswith("scipy."):
        return False
    if getattr(value, "__name__", "") in DRAWS:
        return True
    with suppress(TypeError, ValueError):  # one without a signature
        return not SEEDED.isdisjoint(inspect.signature(value).parameters)  # type: ignore[arg-type]
    return False


def _is_of_scipy(method: ast.Attribute, known: Mapping[str, object]) -> bool:
    """Whether a method with a name of :data:`DRAWS` may be one of SciPy: not where it is found, or
    where what has it is not known and a class of the model has one of this name."""
    kind = _kind_of(method.value, known)
    if isinstance(kind, ModuleType):
        return str(getattr(getattr(kind, method.attr, None), "__module__", "")).startswith("scipy.")
    if kind is not None:
        own = next((vars(one)[method.attr] for one in kind.__mro__ if method.attr in vars(one)), None)
        return own is None or not is_foreign(getattr(inspect.unwrap(getattr(own, "__func__", own)), "__module__", ""))
    classes = [one if isinstance(one, type) else type(one) for one in known.values()]
    return not any(is_foreign(one.__module__) and method.attr in vars(one) for one in classes)


def _kind_of(node: ast.AST, known: Mapping[str, object]) -> type | ModuleType | None:
    """The class of what an expression gives: of a name, of an attribute of an object that is known,
    of a call of a class; a module or a class as it is; None where it is not known."""
    if isinstance(node, ast.Call):
        called = value_of(node.func, known)
        if isinstance(called, type):
            return called
        # a distribution of SciPy gives one of numbers
        return type(called) if called is not None and type(called).__module__.startswith("scipy.") else None
    value = value_of(node, known)
    if value is None and isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        value = inspect.getattr_static(known.get(node.value.id), node.attr, None)
    if value is None:
        return None
    return value if isinstance(value, (type, ModuleType)) else type(value)


def _is_today(node: ast.AST, known: Mapping[str, object]) -> bool:
    """Whether this asks numpy for the day or the time."""
    if not isinstance(node, ast.Call) or value_of(node.func, known) is not np.datetime64:
        return False
    return any(isinstance(one, ast.Constant) and one.value in ("now", "today") for one in node.args)
