"""No function has a parameter that it never reads, unless somebody else says what it is
called with."""

import ast
from collections.abc import Iterator, Mapping
from pathlib import Path

import nsdrill

ROOT = Path(nsdrill.__file__).parent
# The rules of the passes are found by the operation of a node.
BY_NAME = {"equations/passes.py: _mul(node)"}
Function = ast.FunctionDef | ast.AsyncFunctionDef
# Decorators of functions that have the parameters of a protocol: those of the compiled
# language, and a command, whose options are made from its parameters. What is cached is
# cached by all that it is given.
OF_A_PROTOCOL = {"compiled", "inlined", "command_of", "cache", "lru_cache"}


def parameters_without_use(sources: Mapping[str, str]) -> Iterator[str]:
    """``file: function(parameter)`` of each parameter that is not read in the body of a
    function that is called by its name and never handed on as a value; a public one is the
    only one of its name, a method that of one class, without a base from elsewhere."""
    walked = {file: list(ast.walk(ast.parse(text))) for file, text in sources.items()}
    nodes = [node for tree in walked.values() for node in tree]
    called = {_name(node.func) for node in nodes if isinstance(node, ast.Call)}
    classes = [node for node in nodes if isinstance(node, ast.ClassDef)]
    own = {one.name for one in classes} | {"Generic", "Protocol", "NamedTuple", "object"}
    methods = [item.name for one in classes for item in one.body if isinstance(item, Function)]
    public = [item.name for module, *_ in walked.values() for item in module.body if isinstance(item, Function)]
    within = {item: one for one in classes for item in one.body}
    read = {file: _handed_on(tree) for file, tree in walked.items()}
    taken = set().union(*(_taken(tree, read[file]) for file, tree in walked.items()))
    for file, tree in walked.items():
        values = {name for _, name in read[file]}
        for function in tree:
            if not isinstance(function, Function) or function.name not in called or function.name in values:
                continue
            owner = within.get(function)
            if owner is not None and (
                methods.count(function.name) > 1 or any(_name(base) not in own for base in owner.bases)
            ):
                continue
            hook = public.count(function.name) > 1 or (Path(file).stem, function.name) in taken
            if owner is None and hook and not function.name.startswith("_"):
                continue
            if not {_name(one) for one in function.decorator_list} & OF_A_PROTOCOL:
                yield from (f"{file}: {function.name}({name})" for name in _unread(function))


def _name(node: ast.expr) -> str:
    """The last name of an expression such as ``a.b``, ``a.b(c)`` or ``a[b]``."""
    if isinstance(node, ast.Call):
        return _name(node.func)
    if isinstance(node, ast.Subscript):
        return _name(node.value)
    return node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""


def _handed_on(tree: list[ast.AST]) -> set[tuple[str, str]]:
    """What is read in other places than that of what is called: what stands before the
    last dot, if there is one, and the name."""
    called = {id(node.func) for node in tree if isinstance(node, ast.Call)}
    read = [node for node in tree if id(node) not in called]
    names = {("", node.id) for node in read if isinstance(node, ast.Name)}
    return names | {(_name(node.value), node.attr) for node in read if isinstance(node, ast.Attribute)}


def _taken(tree: list[ast.AST], read: set[tuple[str, str]]) -> set[tuple[str, str]]:
    """The module and the name of each function of another module that this one hands on, of
    all that it reads."""
    imported = [node for node in tree if isinstance(node, ast.ImportFrom)]
    by_name = {((one.module or "").rpartition(".")[2], alias.name) for one in imported for alias in one.names}
    return {(module, name) for module, name in read if module} | {one for one in by_name if ("", one[1]) in read}


def _unread(function: Function) -> list[str]:
    given = function.args
    every = (*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg)
    names = [one.arg for one in every if one is not None and one.arg not in ("self", "cls")]
    text = [item for item in function.body if not (isinstance(item, ast.Expr) and isinstance(item.value, ast.Constant))]
    if all(isinstance(item, ast.Pass | ast.Raise) for item in text):
        return []
    read = {node.id for item in text for node in ast.walk(item) if isinstance(node, ast.Name)}
    return [name for name in names if name not in read]


MADE_UP = {
    "a.py": """
def rows(path, notes):
    return path

class Panel:
    def size(self, page, name):
        return name

    def place(self, page):
        return 0

class Map(Panel):
    def place(self, page):
        return page

class Shown(Elsewhere):
    def format(self, form):
        return 1

def stiff(drive):
    return 1

LAWS = [stiff]
print(rows(1, 2), Panel().size(1, 2), Panel().place(1), Shown().format(1), stiff(2))
""",
    "b.py": """
from made.a import rows

def mark(b):
    return 1

def idle(b):
    return 1

@compiled(BUFFER)
def watch(b):
    return 1

print(rows(1, 2), mark(1), watch(1))
""",
}


def test_parameters_without_use_are_found():
    assert list(parameters_without_use(MADE_UP)) == ["a.py: rows(notes)", "a.py: size(page)", "b.py: mark(b)"]


def test_no_function_has_a_parameter_that_it_never_reads():
    sources = {str(file.relative_to(ROOT)): file.read_text(encoding="utf-8") for file in sorted(ROOT.rglob("*.py"))}
    assert set(parameters_without_use(sources)) == BY_NAME
