"""Models and drives of scripts in other processes, which execute the script that made them
here."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from typing import Any, NamedTuple, ParamSpec, TypeVar

from nsdrill.errors import InputError, option
from nsdrill.models.own_drives import OwnDrive, own_drive, own_kinds_in
from nsdrill.models.own_features import digest_of
from nsdrill.models.registry import Scripted, own_features, scripted
from nsdrill.script.executed import execute
from nsdrill.study.study import Study

P = ParamSpec("P")
T = TypeVar("T")
Needed = Mapping[tuple[str, str], tuple[str, str]]  # file and digest of what scripts made, by what it is and its name


class _Made(NamedTuple):
    """What a script made: its file, and the digest of what it computes."""

    file: str
    digest: str


def _measures(model: str) -> _Made | None:
    """What a script measures of a model of nsdrill or of a package."""
    found = own_features(model)
    return _Made(found[-1].function.__code__.co_filename, digest_of(model)) if found else None


FOUND: dict[str, Callable[[str], Scripted | OwnDrive | _Made | None]] = {
    "model": scripted,
    "drive": own_drive,
    "features of the model": _measures,
}


def knowing(executor: Executor | None, study: Study) -> Executor | None:
    """The executor, in whose processes the model and the drives of a study that are of
    scripts are made known. InputError where one is of a notebook, which another process
    cannot read."""
    model = study.model.name
    names = [("model", model), ("features of the model", model)]
    names += [("drive", kind) for kind in own_kinds_in(study.resolved)]
    needed: dict[tuple[str, str], tuple[str, str]] = {}
    for what, name in names if executor is not None else ():
        if (found := FOUND[what](name)) is None:
            continue
        if not os.path.isfile(found.file):
            raise InputError(
                f"the {what} {name}: found other processes that are to run it, and it is of a notebook, which they "
                f"cannot read; allowed: threads of this process ({option('engine', 'threads')}), or a {what} of a "
                "script in a file."
            )
        needed[what, name] = os.path.abspath(found.file), found.digest
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
    for (what, name), (file, digest) in needed.items():
        if FOUND[what](name) is None:
            execute(file)
        found = FOUND[what](name)
        if found is None or found.digest != digest:
            raise InputError(
                f"the {what} {name} of {file}: found other equations there than here; allowed: the same file."
            )
    function, args, more = pickle.loads(packed)
    return function(*args, **more)
