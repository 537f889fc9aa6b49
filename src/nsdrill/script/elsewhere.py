"""What scripts made, in other processes, which execute the script that made it here."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from typing import Any, NamedTuple, ParamSpec, TypeVar

from nsdrill.errors import InputError, option
from nsdrill.models.own_features import digest_of
from nsdrill.models.own_parts import Part, own_part, parts_in
from nsdrill.models.registry import import_modules, own_features, scripted
from nsdrill.origin import Origin
from nsdrill.script.executed import execute
from nsdrill.study.study import Study

P = ParamSpec("P")
T = TypeVar("T")
Needed = Mapping[str, tuple[str, str]]  # file and digest of what scripts made, by what it is and its name


class _Made(NamedTuple):
    """What a script made: its origin, and the digest of what it computes."""

    origin: Origin
    digest: str


def _known(name: str) -> Part | None:
    """What a script made by this name: ``model duffing``, ``features torsion`` for what is
    measured of that model, or a part (:mod:`nsdrill.models.own_parts`)."""
    what, _, model = name.partition(" ")
    if what == "model":
        return scripted(model)
    if what == "features":
        found = own_features(model)
        return _Made(found[-1].origin, digest_of(model)) if found else None
    return own_part(name)


def knowing(executor: Executor | None, study: Study) -> Executor | None:
    """The executor, in whose processes what a study uses of scripts is made known. InputError
    where it is of a notebook, which another process cannot read."""
    model = study.model.name
    needed: dict[str, tuple[str, str]] = {}
    for name in (f"model {model}", f"features {model}", *parts_in(study.resolved)) if executor is not None else ():
        if (found := _known(name)) is None:
            continue
        if not os.path.isfile(found.origin.file):
            raise InputError(
                f"the {name}: found other processes that are to run it, and it is of a notebook, which they cannot "
                f"read; allowed: threads of this process ({option('engine', 'threads')}), or one of a script in a file."
            )
        needed[name] = os.path.abspath(found.origin.file), found.digest
    return _Knowing(executor, needed) if executor is not None and needed else executor


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
    for name, (file, digest) in needed.items():
        if _known(name) is None:
            import_modules()  # of a package
        if _known(name) is None:
            execute(file)
        found = _known(name)
        if found is None or found.digest != digest:
            raise InputError(f"the {name} of {file}: found other equations there than here; allowed: the same file.")
    function, args, more = pickle.loads(packed)
    return function(*args, **more)
