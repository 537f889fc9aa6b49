"""Functions compiled from generated text, for regular code that must be written out for
the compiler.

Such a function belongs to its own module, named after a digest of the text and
registered before the text is executed: another process that loads the machine code from
the cache looks the module up by that name.
"""

from __future__ import annotations

import hashlib
import linecache
import sys
from types import ModuleType
from typing import Any

from nsdrill.compiler.language import call, packed


def define(name: str, text: str, **namespace: Any) -> Any:
    """The function ``name`` that the Python source ``text`` defines; ``namespace`` has
    the global names that the text uses besides ``packed`` and ``call``.

    Two texts with the same ``name`` give two functions with different qualified names,
    after which numba names machine code. The text is kept as ``__source__`` of the
    module and shown in tracebacks.
    """
    digest = hashlib.sha256(text.encode()).hexdigest()[:16]
    module = ModuleType(f"nsdrill._generated_{name}_{digest}")
    path = f"<{module.__name__}>"
    sys.modules[module.__name__] = module
    linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
    module.__dict__.update(namespace, __source__=text, packed=packed, call=call)
    exec(compile(text, path, "exec"), module.__dict__)
    function = module.__dict__[name]
    function.__name__ = function.__qualname__ = f"{name}_{digest}"
    return function


def constants(**values: Any) -> str:
    """Lines that assign these values; the text of a float reproduces its bits."""
    return "".join(f"{name} = {value!r}\n" for name, value in values.items())
