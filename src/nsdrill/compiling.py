"""Compiling in less time, to the same machine code.

Half of the time that numba takes goes to questions that it asks again and again. They
are answered once here, while functions of this package are compiled and only then.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from numba.core.types.functions import BaseFunction

_ask = getattr(BaseFunction, "get_call_type", None)
# by the identity of a function type: the type, which is kept alive, and its signatures
_signatures: dict[int, tuple[Any, dict[Any, Any]]] = {}


@contextmanager
def compiling() -> Iterator[None]:
    """Compile without passes of the collector of cyclic garbage over all that a
    compiler makes (an eighth of the time), and with the signatures of operators and
    functions remembered (a quarter). For one thread at a time."""
    collects = gc.isenabled()
    gc.disable()
    if _ask is not None:
        BaseFunction.get_call_type = _call_type  # type: ignore[method-assign]
    try:
        yield
    finally:
        if _ask is not None:
            BaseFunction.get_call_type = _ask  # type: ignore[method-assign]
        if collects:
            gc.enable()


def _call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
    """The signature of a call of the function ``self`` with arguments of these types.

    For a sum of two floats numba tries a dozen templates, those of strings, sets and
    arrays among them, and words an error for each that does not fit. Signatures of
    overloads are not remembered: which machine code they stand for depends on the
    options of the caller.
    """
    _, known = _signatures.setdefault(id(self), (self, {}))
    asked = (context, args, tuple(kws.items()))
    if (signature := known.get(asked)) is None:
        signature = _ask(self, context, args, kws)  # type: ignore[misc]
        if self._impl_keys.get(signature.args) is self.typing_key:
            known[asked] = signature
    return signature
