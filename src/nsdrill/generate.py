"""Functions made from text: what is regular but has to be spelt out for the compiler, a program writes.

The text of a function is kept in a file of the cache folder, named after a digest of the text, because numba caches
machine code only of functions that stand in a file. The function belongs to a module of that name, which is registered
before the text is executed: another process that loads the machine code looks the module up by its name.
"""

from __future__ import annotations

import contextlib
import hashlib
import linecache
import os
import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

from nsdrill.abi import cache_directory, cache_is_writable


def define(name: str, text: str, **known: Any) -> Any:
    """The function ``name`` that the Python source ``text`` defines; ``known`` are the names that it may use.

    Two texts of one name give two functions whose qualified names differ, as numba names machine code after them.
    """
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    module_name = f"nsdrill._generated_{name}_{digest}"
    module = ModuleType(module_name)
    sys.modules[module_name] = module
    path = _kept(f"{name}_{digest}.py", text)
    module.__dict__.update(known, __file__=path)
    exec(compile(text, path, "exec"), module.__dict__)
    function = module.__dict__[name]
    function.__name__ = function.__qualname__ = f"{name}_{digest}"
    return function


def constants(**values: Any) -> str:
    """Lines that assign these values, each by a text that gives back its bits."""
    return "".join(f"{name} = {value!r}\n" for name, value in values.items())


def _kept(name: str, text: str) -> str:
    """Where the text stands: in the cache folder, else in memory only, for tracebacks."""
    if cache_is_writable():
        with contextlib.suppress(OSError):
            return str(_written(cache_directory() / "generated", name, text))
    path = f"<generated {name}>"
    linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
    return path


def _written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    folder.mkdir(mode=0o700, exist_ok=True)
    if not path.exists() or path.read_text() != text:
        handle, temporary = tempfile.mkstemp(dir=folder, prefix=f".{name}.")
        with open(handle, "w") as file:
            file.write(text)
        # Of the same age whenever it is written: numba up to 0.62 compares the time with that of its cache.
        os.utime(temporary, (0, 0))
        os.replace(temporary, path)
    return path
