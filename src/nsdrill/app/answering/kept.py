"""What the study of results says of them, on disk for the next answer: beside compiled code,
under a name of all that it follows from. It is never old: another study, other files of
nsdrill, or another Python or numpy give another name."""

from __future__ import annotations

import hashlib
import json
import marshal
import os
import sys
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any, TypeVar

import numpy as np

from nsdrill import version
from nsdrill.cache import load, save
from nsdrill.data import USED_SCRIPTS, Results
from nsdrill.models.registry import NAMES
from nsdrill.variables import MODEL

T = TypeVar("T")

NO_SOURCES = frozenset({"__pycache__", "examples", "static"})


def kept(what: str, results: Results, asked: object, find: Callable[[], T]) -> T:
    """What ``find`` gives, plain data: of these ``results``, of which it reads no variable, and of
    what is ``asked`` besides. It is that of an earlier process, where that found it; never where
    a script or another package makes a part of the model, as that may have other code now."""
    attrs = results.attrs
    own = str(attrs.get("model") or MODEL) in NAMES and not json.loads(attrs.get(USED_SCRIPTS) or "{}")
    if not own or results.part_of is not None:
        return find()
    name = f"answer-{hashlib.sha256(b''.join(_parts(what, results, asked))).hexdigest()}"
    known = load(name, marshal.loads)
    if known is None:
        known = [_plain(find())]
        save(name, marshal.dumps(known))
    found: T = known[0]
    return found


def _plain(found: object) -> object:
    """Data without numbers of numpy."""
    if isinstance(found, dict):
        return {name: _plain(value) for name, value in found.items()}
    if isinstance(found, list | tuple):
        return type(found)(map(_plain, found))
    return found.item() if isinstance(found, np.generic) else found


def _parts(what: str, results: Results, asked: object) -> Iterator[bytes]:
    """All that an answer follows from, each part with its end."""
    yield repr((what, asked, sys.version, np.__version__, results.attrs, results.more)).encode() + b"\0"
    arrays: list[tuple[Any, np.ndarray]] = [*results.coords.items(), *results.drawn.items()]
    for name, values in arrays:
        yield repr((name, values.tolist())).encode() + b"\0"
    yield sources().encode()


@cache
def sources() -> str:
    """Where the files of nsdrill lie, and of each how long it is and when it was written: all by
    which Python itself tells that the byte code of a file is old."""
    root = os.path.dirname(version.__file__)
    return repr((root, version.__version__, sorted(_written(root))))


def _written(folder: str) -> Iterator[tuple[str, int, int]]:
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith(".py"):
                info = entry.stat()
                yield entry.path, info.st_size, info.st_mtime_ns
            elif entry.is_dir() and entry.name not in NO_SOURCES:
                yield from _written(entry.path)
