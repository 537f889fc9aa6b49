"""Functions made from text: what is regular but has to be spelt out for the compiler, a
program writes.

Such a function belongs to a module of its own, named after a digest of the text and
registered before the text is executed: another process that loads the machine code from
the cache looks the module up by that name.
"""

from __future__ import annotations

import hashlib
import linecache
import sys
from types import ModuleType
from typing import Any


def define(name: str, text: str, **known: Any) -> Any:
    """The function ``name`` that the Python source ``text`` defines; ``known`` are the
    names that it may use.

    Two texts of one name give two functions whose qualified names differ, as numba
    names machine code after them. The text is kept as ``__source__`` of the module and
    shown in tracebacks.
    """
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    module = ModuleType(f"nsdrill._generated_{name}_{digest}")
    path = f"<{module.__name__}>"
    sys.modules[module.__name__] = module
    linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
    module.__dict__.update(known, __source__=text)
    exec(compile(text, path, "exec"), module.__dict__)
    function = module.__dict__[name]
    function.__name__ = function.__qualname__ = f"{name}_{digest}"
    return function


def constants(**values: Any) -> str:
    """Lines that assign these values, each by a text that gives back its bits."""
    return "".join(f"{name} = {value!r}\n" for name, value in values.items())
