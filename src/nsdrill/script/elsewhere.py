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
from nsdrill.models.registry import import_modules, own_features, package_with, scripted
from nsdrill.origin import Origin
from nsdrill.script.executed import execute
from nsdrill.study.study import Study

P = ParamSpec("P")
T = TypeVar("T")
# Files and digest of what scripts made, by what it is and its name.
Needed = Mapping[str, tuple[tuple[str, ...], str]]


class _Made(NamedTuple):
    """What scripts made: where, and the digest of what it computes."""

    origins: tuple[Origin, ...]
    digest: str


def _known(name: str) -> _Made | None:
    """What scripts made by this name: ``model duffing``, ``features torsion`` for what is
    measured of that model, or a part (:mod:`nsdrill.models.own_parts`)."""
    what, _, model = name.partition(" ")
    if what == "features":
        found = own_features(model)
        return _Made(tuple(one.origin for one in found), digest_of(model)) if found else None
    made: Part | None = scripted(model) if what == "model" else own_part(name)
    return None if made is None else _Made((made.origin,), made.digest)


def knowing(executor: Executor | None, study: Study) -> Executor | None:
    """The executor, in whose processes what a study uses of scripts is made known. InputError
    where it is of a notebook, which another process cannot read."""
    model = study.model.name
    needed: dict[str, tuple[tuple[str, ...], str]] = {}
    for name in (f"model {model}", f"features {model}", *parts_in(study.resolved)) if executor is not None else ():
        if (found := _known(name)) is None:
            continue
        files = tuple(dict.fromkeys(one.file for one in found.origins))
        if not all(map(os.path.isfile, files)):
            raise InputError(
                f"the {name}: found other processes that are to run it, and it is of a notebook, which they cannot "
                f"read; allowed: threads of this process ({option('engine', 'threads')}), or one of a script in a file."
            )
        # those of packages are imported there
        needed[name] = tuple(os.path.abspath(file) for file in files if not package_with(file)), found.digest
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
    for name, (files, digest) in needed.items():
        found = _known(name)
        if found is None or found.digest != digest:
            import_modules()  # of packages
            for file in files:
                execute(file)
            found = _known(name)
        if found is None or found.digest != digest:
            of = ", ".join(files) or "a package"
            raise InputError(f"the {name} of {of}: found other equations there than here; allowed: the same file.")
    function, args, more = pickle.loads(packed)
    return function(*args, **more)
