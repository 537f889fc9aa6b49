"""Compiled functions on disk, for the next process: one file a function, a SHA-256 and
the pickled machine code.

numba's own files are not checked: an empty or a changed one ends the process in
whatever way the unpickler or LLVM does. Here nothing is unpickled or loaded that has
another checksum than it was written with, nor anything that another user may have
written, since a pickle can run any code. What is wrong with the cache never stops a
run: the function is compiled anew, and a :class:`CacheWarning` says so, once in a
process.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import pickle
import stat
import sys
import tempfile
import warnings
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from numba.core import serialize
from numba.core.caching import FunctionCache, NullCache
from numba.core.compiler import CompileResult

from nsdrill.errors import CacheWarning

_DIGEST = hashlib.sha256().digest_size
NOWHERE = "<dynamic>"  # what numba calls the module of a function that is in none that is imported
_told = False


def cache_for(function: Callable[..., Any], digest: str) -> Any:
    """The cache for the compiled ``function`` of sources with this ``digest``; one that
    stays empty where there can be none."""
    try:
        folder = cache_directory(digest)
        _make_private(folder)
        return CodeCache(function, folder)
    except (OSError, RuntimeError) as error:
        _tell_unkept(getattr(error, "filename", None) or "The cache folder", error)
        return NullCache()


def cache_directory(digest: str) -> Path:
    """``$NUMBA_CACHE_DIR`` where set, else the user's cache folder; in it one folder
    per ``digest`` of the sources. RuntimeError where nothing says which folder is the
    user's."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        root = Path(chosen)
    elif os.name == "nt":
        root = Path(os.environ.get("LOCALAPPDATA") or Path.home()) / "nsdrill" / "cache"
    else:
        root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "nsdrill"
    return root.absolute() / digest


class CodeCache(FunctionCache):
    """What numba asks for the machine code of a function, and gives it to."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        self._py_func = function
        self._name = repr(function)
        self._cache_path = str(folder)
        # of a function made from text
        made_from = getattr(function, "__globals__", {}).get("__source__")
        self._source = (
            made_from.encode() if made_from else Path(inspect.getfile(function)).read_bytes()
        )

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function, or None where it has to be compiled."""
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
            _tell(
                f"{path}: this file of compiled code is not used ({_reason(error)}); the function "
                f"is compiled anew, "
                "which takes some seconds. If this comes back, remove the folder and check its "
                "disk."
            )
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the compiled function ``data``; other processes see a whole file or
        none."""
        if data.library.has_dynamic_globals:  # addresses of this process
            return
        if data.fndesc.modname == NOWHERE:  # no other process could find the function
            return
        path = self._path(sig, data.codegen)
        code = serialize.dumps(data._reduce())
        try:
            _write(path, hashlib.sha256(code).digest() + code)
        except OSError as error:
            _tell_unkept(str(path.parent), error)

    def _path(self, sig: Any, codegen: Any) -> Path:
        """Named after all that decides the machine code: signature, processor, byte
        code and closure, the Python, the function's own file, and all compiled sources,
        whose digest is the name of the folder."""
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
    """Make ``folder``, for its owner alone. OSError where that cannot be, or others may
    have put something there.

    Who may write in the folders above can put another one in its place, but none that
    belongs to this user.
    """
    for place in (*reversed(folder.parents), folder):
        if not place.is_dir():
            try:
                place.mkdir(0o700, exist_ok=True)
            except FileExistsError as error:
                raise NotADirectoryError(0, "it is no folder", str(place)) from error
    found = folder.stat()
    if _lax(found) and found.st_uid == os.geteuid():
        # made with a lax umask; what was put there by others is found file by file
        folder.chmod(0o700)
        found = folder.stat()
    _check_owner(found, folder)


def _read(path: Path) -> bytes:
    """The bytes of a file that nobody else may have written, else OSError. Follows no
    link, waits for no pipe."""
    flags = [getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY")]
    with open(os.open(path, os.O_RDONLY | sum(flags)), "rb") as file:
        found = os.fstat(file.fileno())
        if not stat.S_ISREG(found.st_mode):
            raise OSError("it is no file")
        _check_owner(found, path)
        return file.read()


def _write(path: Path, content: bytes) -> None:
    with tempfile.NamedTemporaryFile(dir=path.parent, delete=False) as file:  # for its owner alone
        try:
            file.write(content)
            file.close()
            os.replace(file.name, path)
        except BaseException:
            with suppress(OSError):
                os.unlink(file.name)
            raise


def _lax(found: os.stat_result) -> bool:
    return os.name != "nt" and bool(found.st_mode & (stat.S_IWGRP | stat.S_IWOTH))


def _check_owner(found: os.stat_result, path: Path) -> None:
    """PermissionError where somebody else than the user or root may have written what
    is ``found``."""
    if os.name != "nt" and found.st_uid not in (0, os.geteuid()):
        raise PermissionError(0, "it belongs to another user", str(path))
    if _lax(found):
        raise PermissionError(0, "other users may write it", str(path))


def _reason(error: BaseException) -> str:
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return text[:1].lower() + text[1:].rstrip(".")


def _tell_unkept(place: str, error: Exception) -> None:
    _tell(
        f"{place}: compiled code cannot be kept there ({_reason(error)}), so every run compiles "
        f"anew, which takes "
        "some seconds. Mend that, or set NUMBA_CACHE_DIR to another folder that only you may write."
    )


def _tell(text: str) -> None:
    global _told
    if not _told:
        _told = True
        warnings.warn(text, CacheWarning, stacklevel=2)
