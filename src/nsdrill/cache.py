"""Compiled functions on disk, for the next process: one file per function, named after
all that determines its machine code, with a SHA-256 of name and code.

A file is used only if its checksum is right and no other user can have written it. A
fault of the cache never stops a run: the function is compiled again, with one
:class:`CacheWarning` per process.

The folder holds :data:`LIMIT` bytes at most, and files that were used within
:data:`AGE`: a process that writes into it looks through it first, unless another did so
within an :data:`HOUR`, and again after each eighth of that size. The time of a file is that of its last use, to a day.
"""

from __future__ import annotations

import hashlib
import os
import stat
import time
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from nsdrill.errors import CacheWarning, FileError, warn
from nsdrill.files import reason, whole

_DIGEST = hashlib.sha256().digest_size
_SUFFIX = ".code"
HOUR, DAY = 3600.0, 86400.0  # [s]
AGE = 90 * DAY
LIMIT = 128 << 20  # bytes; a function has some 20 kB
KEPT = 0.75  # of the limit, where it is exceeded: then the next look is not near
_has_warned = False
_allowed: dict[Path, float] = {}  # bytes to be written before the folder is looked through


def cache_directory() -> Path:
    """``$NUMBA_CACHE_DIR`` where set, else the user's cache folder. RuntimeError if the
    user's home folder is unknown."""
    if configured := os.environ.get("NUMBA_CACHE_DIR"):
        root = Path(configured)
    elif os.name == "nt":
        root = Path(os.environ.get("LOCALAPPDATA") or Path.home()) / "nsdrill" / "cache"
    else:
        root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "nsdrill"
    return root.absolute() / "compiled"


@cache
def _folder(configured: str | None) -> Path | None:
    """The folder of the cache, made if need be; None, with a warning, if there can be
    none."""
    try:
        folder = cache_directory()
        _make_private(folder)
        return folder
    except (OSError, RuntimeError) as error:
        _warn_not_cached(getattr(error, "filename", None) or "The cache folder", error)
        return None


def load(name: str, use: Callable[[bytes], Any] = bytes) -> Any:
    """What ``use`` makes of the content saved under this name; None if there is none
    that can be used."""
    if (folder := _folder(os.environ.get("NUMBA_CACHE_DIR"))) is None:
        return None
    path = folder / f"{name}{_SUFFIX}"
    try:
        content = _read(path)
        if _digest(name, content[_DIGEST:]) != content[:_DIGEST]:
            raise ValueError("its checksum is wrong")
        return use(content[_DIGEST:])
    except FileNotFoundError:
        return None
    except Exception as error:  # whatever the reason, the function can be compiled
        with suppress(OSError):
            path.unlink()
        _warn(
            f"{path}: this file of compiled code is not used ({reason(error)}); the function is compiled "
            "again. If this recurs, remove the folder and check its disk."
        )
        return None


def save(name: str, content: bytes) -> None:
    """Save ``content`` for the next process; other processes see a complete file or
    none."""
    if (folder := _folder(os.environ.get("NUMBA_CACHE_DIR"))) is not None:
        try:
            with whole(folder / f"{name}{_SUFFIX}") as file:
                os.chmod(file.name, 0o600)  # for its owner only
                file.write(_digest(name, content) + content)
            _bound(folder, _DIGEST + len(content))
        except FileError:
            pass  # another process is writing the same code
        except OSError as error:
            _warn_not_cached(str(folder), error)


def _digest(name: str, content: bytes) -> bytes:
    return hashlib.sha256(name.encode() + b"\0" + content).digest()


def _bound(folder: Path, written: int) -> None:
    """Look through the folder if need be, after so many bytes were written."""
    looked = folder.with_suffix(".looked")  # its time is that of the last look
    if folder not in _allowed:
        _allowed[folder] = LIMIT / 8 if _is_recent(looked) else 0.0
    _allowed[folder] -= written
    if _allowed[folder] < 0.0:
        left = LIMIT - _remove_unused(folder)
        _allowed[folder] = min(left, LIMIT / 8)
        with suppress(OSError):  # where only the folder itself may be written, each process looks
            looked.touch(0o600)


def _is_recent(path: Path) -> bool:
    try:
        return abs(time.time() - path.stat().st_mtime) < HOUR
    except OSError:
        return False


def _remove_unused(folder: Path) -> int:
    """Remove what was not used for long and, where the folder is too large, what was not
    used for longest; the bytes that stay. Another process may do the same at the same
    time, or need what is removed: it then compiles."""
    now, files = time.time(), []
    with os.scandir(folder) as entries:
        for entry in entries:
            is_left = f"{_SUFFIX}.tmp-" in entry.name  # by a process that was killed
            if is_left or entry.name.endswith(_SUFFIX):
                with suppress(OSError):
                    info = entry.stat(follow_symlinks=False)
                    files.append((now - info.st_mtime, info.st_size, DAY if is_left else AGE, entry.path))
    room = LIMIT if sum(size for _, size, _, _ in files) <= LIMIT else int(KEPT * LIMIT)
    total = 0
    for unused, size, longest, path in sorted(files):
        if unused > longest or total + size > room:
            with suppress(OSError):
                os.unlink(path)
        else:
            total += size
    return total


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
    follow links or wait for pipes. The file is marked as used."""
    flags = [getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY")]
    with open(os.open(path, os.O_RDONLY | sum(flags)), "rb") as file:
        info = os.fstat(file.fileno())
        if not stat.S_ISREG(info.st_mode):
            raise OSError("it is not a regular file")
        _check_owner(info, path)
        if time.time() - info.st_mtime > DAY:
            with suppress(OSError):  # a folder that is only read
                os.utime(path)
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
        f"{directory}: compiled code cannot be kept there ({reason(error)}), so every run compiles again, which takes "
        "about half a second. Correct that, or set NUMBA_CACHE_DIR to another folder that only you may write."
    )


def _warn(text: str) -> None:
    global _has_warned
    if not _has_warned:
        _has_warned = True
        warn(text, CacheWarning)
