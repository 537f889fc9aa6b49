"""The files and the data of a model of another package, and of what it imports: whether
these are those that a file of results was made with."""

from __future__ import annotations

import ast
import hashlib
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

# what has its version in files of results, or does not compute
_OTHERS = frozenset({*sys.stdlib_module_names, "nsdrill", "numpy", "scipy", "numba", "llvmlite"})
_LONGEST = 10**6  # numbers of a module, of which data are a part of a model


def files_digest(top: str) -> str:
    """Digest of the Python files of the package or module ``top`` and of the modules that it
    imports: of installed ones those that it names, of others all, with what they import.
    "unknown" where it is not installed."""
    digest, found = hashlib.sha256(), False
    for module in _followed(top):
        for path, file in _files(module):
            found = True
            digest.update(path.encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()[:16] if found else "unknown"


def data_digest(top: str) -> str:
    """Digest of the numbers that the imported modules of ``top`` hold, and those that it
    imports: they may be of a data file or of the environment."""
    tops = {name.partition(".")[0] for name in _followed(top) if name == top or not _is_installed(name)}
    digest = hashlib.sha256()
    for name in sorted(sys.modules):
        if name.partition(".")[0] in tops:
            for key, value in sorted(vars(sys.modules[name]).items()):
                if not key.startswith("__") and (text := _numbers(value)) is not None:
                    digest.update(f"{name}.{key}={text}\0".encode())
    return digest.hexdigest()[:16]


def _followed(top: str) -> Iterator[str]:
    """``top`` and the names of the modules that are imported from there."""
    todo, seen = [top], set[str]()
    while todo:
        name = todo.pop()
        if name in seen or name.partition(".")[0] in _OTHERS:
            continue
        seen.add(name)
        yield name
        if name == top or not _is_installed(name):
            todo += sorted({one for _, file in _files(name) for one in _imports(file)}, reverse=True)


def _imports(file: Path) -> Iterator[str]:
    """The modules that a Python file may import: ``from a import b`` may mean the module a.b."""
    with suppress(SyntaxError, ValueError):
        for node in ast.walk(ast.parse(file.read_bytes())):
            if isinstance(node, ast.Import):
                yield from (one.name for one in node.names)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
                yield node.module
                yield from (f"{node.module}.{one.name}" for one in node.names)


def _files(name: str) -> list[tuple[str, Path]]:
    """The Python files of a module, all of the package where it is one at the top."""
    if "." in name:
        file = getattr(sys.modules.get(name), "__file__", None)
        return [(name, Path(file))] if file and file.endswith(".py") and Path(file).is_file() else []
    try:
        spec = find_spec(name)
    except (ImportError, ValueError):
        return []
    if spec is None:
        return []
    roots = [Path(location) for location in spec.submodule_search_locations or ()]
    if roots and not _is_within_libraries(roots[0]):
        return [(file.relative_to(root).as_posix(), file) for root in roots for file in sorted(root.rglob("*.py"))]
    origin = Path(spec.origin or "")
    return [(origin.name, origin)] if origin.suffix == ".py" and origin.is_file() else []


def _is_installed(name: str) -> bool:
    """Whether a module lies in a folder of installed packages."""
    return any(_is_within_libraries(file) for _, file in _files(name))


def _is_within_libraries(path: Path) -> bool:
    return any(path.is_relative_to(sysconfig.get_path(which)) for which in ("purelib", "platlib"))


def _numbers(value: Any, depth: int = 0) -> str | None:
    """Plain numbers, and lists, tables and arrays of them, as text; None of anything else."""
    if isinstance(value, bool | int | float | complex):
        return repr(value)
    if isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "biufc" and value.size <= _LONGEST:
        return f"{value.dtype} {np.shape(value)} {hashlib.sha256(np.ascontiguousarray(value).tobytes()).hexdigest()}"
    if depth > 8 or not isinstance(value, list | tuple | dict) or len(value) > _LONGEST:
        return None
    items = value.items() if isinstance(value, dict) else enumerate(value)
    texts = [(str(key), _numbers(item, depth + 1)) for key, item in items]
    known = [f"{key}:{text}" for key, text in texts if text is not None]
    return f"({','.join(known)})" if known else None
