"""Models of scripts in other processes, which execute the script that made them here."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from typing import Any, ParamSpec, TypeVar

from nsdrill.errors import InputError, option
from nsdrill.models.registry import scripted
from nsdrill.script.executed import execute

P = ParamSpec("P")
T = TypeVar("T")
Needed = Mapping[str, tuple[str, str]]  # file and digest of models of scripts, by name


def knowing(executor: Executor | None, model: str) -> Executor | None:
    """The executor, in whose processes a model of a script is made known. InputError where
    it is of a notebook, which another process cannot read."""
    found = scripted(model)
    if executor is None or found is None:
        return executor
    if not os.path.isfile(found.file):
        raise InputError(
            f"the model {model}: found other processes that are to run it, and it is of a notebook, which they cannot "
            f"read; allowed: threads of this process ({option('engine', 'threads')}), or a model of a script in a file."
        )
    return _Knowing(executor, {model: (os.path.abspath(found.file), found.digest)})


class _Knowing(Executor):
    """Another executor, whose processes know some models."""

    def __init__(self, executor: Executor, needed: Needed) -> None:
        self._executor, self._needed = executor, needed

    def submit(self, function: Callable[P, T], /, *args: P.args, **more: P.kwargs) -> Future[T]:
        # The models that arguments hold can be read there only once they are known.
        return self._executor.submit(_call, self._needed, pickle.dumps((function, args, more)))

    def __getattr__(self, name: str) -> Any:  # its check of the connection
        return getattr(self._executor, name)


def _call(needed: Needed, packed: bytes) -> Any:
    for model, (file, digest) in needed.items():
        if scripted(model) is None:
            execute(file)
        found = scripted(model)
        if found is None or found.digest != digest:
            raise InputError(
                f"the model {model} of {file}: found other equations there than here; allowed: the same file."
            )
    function, args, more = pickle.loads(packed)
    return function(*args, **more)
