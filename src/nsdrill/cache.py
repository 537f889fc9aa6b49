"""Compiled functions on disk, for the next process: one file per function, with a
SHA-256 and the pickled machine code.

The files of numba's own cache are not verified: a truncated or changed one can crash
the unpickler or LLVM. Here a file is unpickled and loaded only if its checksum is right
and no other user can have written it, since a pickle can run any code. A fault of the
cache never stops a run: the function is compiled again, with one :class:`CacheWarning`
per process.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import pickle
import stat
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba.core import serialize
from numba.core.caching import FunctionCache, NullCache
from numba.core.compiler import CompileResult

from nsdrill.errors import CacheWarning, FileError
from nsdrill.files import reason, whole

_DIGEST = hashlib.sha256().digest_size
DYNAMIC_MODULE = "<dynamic>"  # numba's name for the module of a function that no import can find
_has_warned = False


def cache_for(function: Callable[..., Any], digest: str) -> Any:
    """The cache for the compiled ``function`` of sources with this ``digest``; a null
    cache if there can be none."""
    try:
        folder = cache_directory(digest)
        _make_private(folder)
        return CodeCache(function, folder)
    except (OSError, RuntimeError) as error:
        _warn_not_cached(getattr(error, "filename", None) or "The cache folder", error)
        return NullCache()


def cache_directory(digest: str) -> Path:
    """``$NUMBA_CACHE_DIR`` where set, else the user's cache folder; in it one folder
    per ``digest`` of the sources. RuntimeError if the user's home folder is
    unknown."""
    if configured := os.environ.get("NUMBA_CACHE_DIR"):
        root = Path(configured)
    elif os.name == "nt":
        root = Path(os.environ.get("LOCALAPPDATA") or Path.home()) / "nsdrill" / "cache"
    else:
        root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "nsdrill"
    return root.absolute() / digest


class CodeCache(FunctionCache):
    """The cache from which numba loads the machine code of a function, and in which it
    saves it."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._py_func = function
        self._name = repr(function)
        self._cache_path = str(folder)
        # present for functions generated from text
        text = getattr(function, "__globals__", {}).get("__source__")
        self._source = text.encode() if text else Path(inspect.getfile(function)).read_bytes()

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function, or None if it has to be compiled."""
        target_context.refresh()
        path = self._path(sig, target_context.codegen())
        try:
            content = _read(path)
            if hashlib.sha256(content[_DIGEST:]).digest() != content[:_DIGEST]:
                raise ValueError("its checksum is wrong")
            return CompileResult._rebuild(target_context, *pickle.loads(content[_DIGEST:]))
        except FileNotFoundError:
            return None
        except Exception as error:  # whatever the reason, the function can be compiled
            with suppress(OSError):
                path.unlink()
            _warn(
                f"{path}: this file of compiled code is not used ({reason(error)}); the function "
                "is compiled again, which takes some seconds. If this recurs, remove the folder "
                "and check its disk."
            )
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save the compiled function ``data``; other processes see a complete file or
        none."""
        if data.library.has_dynamic_globals:  # addresses of this process
            return
        if data.fndesc.modname == DYNAMIC_MODULE:  # no other process could find the function
            return
        path = self._path(sig, data.codegen)
        code = serialize.dumps(data._reduce())
        try:
            with whole(path) as file:
                os.chmod(file.name, 0o600)  # for its owner only
                file.write(hashlib.sha256(code).digest() + code)
        except FileError:
            pass  # another process is writing the same code
        except OSError as error:
            _warn_not_cached(str(path.parent), error)

    def _path(self, sig: Any, codegen: Any) -> Path:
        """The file, named after all that determines the machine code: signature,
        processor, byte code and closure, the Python, the function's own file, and all
        compiled sources, whose digest is the name of the folder."""
        folder = Path(self._cache_path)
        key = (
            repr(
                (self._index_key(sig, codegen), sys.implementation.cache_tag, folder.name)
            ).encode()
            + self._source
        )
        return (
            folder / f"{self._py_func.__name__[:100]}-{hashlib.sha256(key).hexdigest()[:32]}.code"
        )


def _make_private(folder: Path) -> None:
    """Make ``folder``, for its owner only. OSError if that fails, or if others may have
    written there.

    A user who may write in the parent folders can replace it, but not by a folder that
    belongs to this user.
    """
    for directory in (*reversed(folder.parents), folder):
        if not directory.is_dir():
            try:
                directory.mkdir(0o700, exist_ok=True)
            except FileExistsError as error:
                raise NotADirectoryError(0, "it is no folder", str(directory)) from error
    info = folder.stat()
    if _writable_by_others(info) and info.st_uid == os.geteuid():
        # made with a permissive umask; files of other users are rejected one by one
        folder.chmod(0o700)
        info = folder.stat()
    _check_owner(info, folder)


def _read(path: Path) -> bytes:
    """The bytes of a file that no other user may have written, else OSError. Does not
    follow links or wait for pipes."""
    flags = [getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY")]
    with open(os.open(path, os.O_RDONLY | sum(flags)), "rb") as file:
        info = os.fstat(file.fileno())
        if not stat.S_ISREG(info.st_mode):
            raise OSError("it is not a regular file")
        _check_owner(info, path)
        return file.read()


def _writable_by_others(info: os.stat_result) -> bool:
    return os.name != "nt" and bool(info.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def _check_owner(info: os.stat_result, path: Path) -> None:
    """PermissionError if another user than this one or root may have written the file
    or folder ``path``, whose status is ``info``."""
    if os.name != "nt" and info.st_uid not in (0, os.geteuid()):
        raise PermissionError(0, "it belongs to another user", str(path))
    if _writable_by_others(info):
        raise PermissionError(0, "other users may write it", str(path))


def _warn_not_cached(directory: str, error: Exception) -> None:
    _warn(
        f"{directory}: compiled code cannot be kept there ({reason(error)}), so every run compiles "
        "again, which takes some seconds. Correct that, or set NUMBA_CACHE_DIR to another folder that "
        "only you may write."
    )


def _warn(text: str) -> None:
    global _has_warned
    if not _has_warned:
        _has_warned = True
        warnings.warn(text, CacheWarning, stacklevel=2)
