"""Functions from generated text, for regular code that must be written out."""

from __future__ import annotations

import hashlib
import linecache
from typing import Any

from nsdrill.compiler.words import call, packed


def define(name: str, text: str, **namespace: Any) -> Any:
    """The function ``name`` that the Python source ``text`` defines; ``namespace`` has
    the global names that the text uses besides ``packed`` and ``call``. Tracebacks and
    messages of the compiler show its lines."""
    path = f"<{name} {hashlib.sha256(text.encode()).hexdigest()[:16]}>"
    linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
    # The source is kept beside the function too: others may empty the cache of lines.
    space = {"packed": packed, "call": call, "__source__": text, **namespace}
    exec(compile(text, path, "exec"), space)
    return space[name]


def constants(**values: Any) -> str:
    """Lines that assign these values; the text of a float reproduces its bits."""
    return "".join(f"{name} = {value!r}\n" for name, value in values.items())
