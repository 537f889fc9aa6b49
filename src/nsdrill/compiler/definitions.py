"""What a compiled function is made of: a function of the lane language, or generated text
that defines one."""

from __future__ import annotations

import hashlib
import linecache
from collections.abc import Callable, Mapping
from functools import cached_property
from types import FunctionType
from typing import Any, cast

from nsdrill.compiler.vocabulary import call, packed
from nsdrill.records import dataclass


@dataclass(frozen=True, eq=False)
class Source:
    """What defines a function (:func:`define`)."""

    name: str
    text: str
    namespace: Mapping[str, object]

    def function(self) -> FunctionType:
        return define(self.name, self.text, **self.namespace)


def define(name: str, text: str, **namespace: object) -> FunctionType:
    """The function ``name`` that the Python source ``text`` defines; ``namespace`` has
    the global names that the text uses besides ``packed`` and ``call``. Tracebacks and
    messages of the compiler show its lines."""
    path = f"<{name} {hashlib.sha256(text.encode()).hexdigest()[:16]}>"
    linecache.cache[path] = (len(text), None, text.splitlines(keepends=True), path)
    # The source is kept beside the function too: others may empty the cache of lines.
    space: dict[str, Any] = {"packed": packed, "call": call, "__source__": text, **namespace}
    exec(compile(text, path, "exec"), space)
    return cast(FunctionType, space[name])


class Definition:
    """A function of the lane language with arguments of these ``kinds``, or the text from
    which it is made when it is needed."""

    def __init__(
        self, function: FunctionType | None, kinds: str, name: str = "", make: Callable[[], Source] | None = None
    ) -> None:
        self._function, self._make = function, make
        self.kinds, self.__name__ = kinds, name if function is None else function.__name__

    @cached_property
    def source(self) -> Source | None:
        """The text of a generated function."""
        return None if self._make is None else self._make()

    @property
    def py_func(self) -> Any:
        """What the interpreter would run."""
        if self._function is None:
            assert self.source is not None
            self._function = self.source.function()
        return self._function

    __wrapped__ = py_func
