"""Files that are complete or absent: written under a temporary name, synced, then
renamed.

A temporary file is new, has a random name, and is locked while it is written. So a
later process can distinguish a file left by a killed process, which is removed, from
one that a living process is writing. Process numbers do not allow that: every container
has a process 1.
"""

from __future__ import annotations

import errno
import io
import os
import re
import secrets
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Self

from nsdrill import interrupt
from nsdrill.errors import FileError, InputError, NsdrillError

_LOCKS_UNSUPPORTED = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EBADF)
_FOLDER_LOCK_SECONDS = 2.0  # to wait for others that create a file in the same folder


class Temporary:
    """A new, empty, locked file beside ``target``. As a context manager it is removed
    at the end, unless it has taken the name of the target.

    FileError if another process or thread is writing ``target`` in the same way,
    OSError if the disk refuses.
    """

    def __init__(self, target: Path) -> None:
        self.target = target
        self.path = target.with_name(f".{target.name}.tmp-{secrets.token_hex(4)}")
        self.file: io.FileIO
        try:
            _exclusively(target.parent, self._begin)
        except BaseException:
            self.remove()
            raise

    def _begin(self) -> None:
        if _remove_leftovers(self.target):
            raise FileError(
                f"{self.target}: another process is writing this file now. Wait for it, or choose "
                f"another -o."
            )
        interrupt.unfinished_files.add(str(self.path))
        self.file = io.FileIO(self.path, "x+")  # fails on anything that is there, a link too
        lock(self.file, self.target)

    def replace(self) -> None:
        """Take the name of the target, replacing an existing file."""
        os.replace(self.path, self.target)
        interrupt.unfinished_files.discard(str(self.path))

    def publish(self) -> None:
        """Take the name of the target; FileExistsError if that exists."""
        try:
            os.link(self.path, self.target)
        except OSError as error:
            if error.errno not in (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK):
                raise
            # a file system without links: the check and the rename are two steps
            if os.path.lexists(self.target):
                raise FileExistsError(
                    errno.EEXIST, os.strerror(errno.EEXIST), str(self.target)
                ) from error
            os.rename(self.path, self.target)
        else:
            # another process may have removed it meanwhile, as a link to the target
            with suppress(FileNotFoundError):
                os.unlink(self.path)
        interrupt.unfinished_files.discard(str(self.path))

    def remove(self) -> None:
        """Close the file, which releases its lock, and remove it if it still has its
        temporary name."""
        if str(self.path) in interrupt.unfinished_files:
            with suppress(OSError):
                os.unlink(self.path)
            interrupt.unfinished_files.discard(str(self.path))
        if hasattr(self, "file"):
            self.file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.remove()


@contextmanager
def replacing(
    path: str | os.PathLike[str],
    remedy: Callable[[], str] = lambda: "Make room or choose another folder.",
    *,
    overwrite: bool = True,
) -> Iterator[Path]:
    """Yield the name of an empty file in the folder of ``path``, which is renamed to
    ``path`` at the end. If ``path`` is a link, it stays one, and its target is
    replaced.

    After any error ``path`` is unchanged and the temporary file is removed. FileError
    if another process or thread is writing ``path``, or, without ``overwrite``, if it
    has been created meanwhile. System errors, such as a full disk, become an
    NsdrillError whose message ends with ``remedy``.
    """
    target = Path(os.path.realpath(path))
    try:
        with Temporary(target) as temporary:
            yield temporary.path
            with open(temporary.path, "rb") as file:
                os.fsync(file.fileno())
            with interrupt.completing():
                (temporary.replace if overwrite else temporary.publish)()
            sync_folder(target.parent)
    except InputError:
        raise
    except FileExistsError as error:
        raise FileError(
            f"{path}: another process has just made this file. Choose another name, or replace it "
            "by --overwrite."
        ) from error
    except (OSError, RuntimeError) as error:  # h5py reports a failed flush as either
        raise NsdrillError(
            f"{path}: could not be written: {reason(error)}. Nothing was changed. {remedy()}"
        ) from error


def write_text(path: str | os.PathLike[str], text: str, *, overwrite: bool = True) -> None:
    """Write ``text`` to ``path``, in one step."""
    with replacing(path, overwrite=overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8")


def sweep_away(target: Path) -> None:
    """Remove the temporary files of ``target`` that killed processes left."""
    with suppress(OSError):
        _exclusively(target.parent, lambda: _remove_leftovers(target))


def lock(file: io.FileIO, path: Path) -> None:
    """Lock the open ``file`` until it is closed or the process ends in any way;
    FileError, about ``path``, if another process or thread has the lock."""
    try:
        _try_lock(file.fileno())
    except BlockingIOError as error:
        raise FileError(
            f"{path}: another process is writing these results now. Wait for it, stop it, or "
            f"choose another -o."
        ) from error
    except OSError as error:
        # Some cluster file systems have no locks: the run then continues without one.
        if error.errno not in _LOCKS_UNSUPPORTED:
            raise
    if os.fstat(file.fileno()).st_nlink == 0:  # removed between opening and locking
        raise FileError(
            f"{path}: another process has just removed or replaced this file. Try again."
        )


def open_plain(path: str | os.PathLike[str], mode: str) -> io.FileIO:
    """Open an existing file, without waiting if it is a pipe. OSError if it is a link
    and is opened for writing."""
    extra_flags = os.O_NONBLOCK | (os.O_NOFOLLOW if "+" in mode else 0)
    try:
        return io.FileIO(path, mode, opener=lambda name, flags: os.open(name, flags | extra_flags))
    except OSError as error:
        if error.errno == errno.ELOOP and os.path.islink(path):
            raise OSError(errno.ELOOP, "it is a link, which is not followed here") from error
        raise


def sync_folder(folder: Path) -> None:
    """Sync ``folder``, so that a new name in it survives a crash."""
    fd = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(fd)
    except OSError:
        pass  # some network file systems refuse this; the file itself is safe
    finally:
        os.close(fd)


def check_room(path: Path, size: int) -> None:
    """OSError if the disk has no room for the finished log of ``size`` bytes, rather
    than hours later."""
    disk = os.statvfs(path.parent)
    free = disk.f_bavail * disk.f_frsize
    if free < size:
        raise OSError(
            errno.ENOSPC, f"the points need {amount(size)}, the disk has {amount(free)} free"
        )


def amount(size: float) -> str:
    """A number of bytes as text."""
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"


def write_at(fd: int, data: bytes | memoryview, position: int) -> None:
    """Write all of ``data`` at ``position``, in several writes if necessary."""
    view = memoryview(data)
    while len(view):
        written = os.pwrite(fd, view, position)
        view, position = view[written:], position + written


def reason(error: BaseException) -> str:
    """The system's message, as part of a sentence."""
    text = getattr(error, "strerror", None) or str(error)
    return text[:1].lower() + text[1:]


def _remove_leftovers(target: Path) -> bool:
    """Remove the temporary files of ``target`` that killed processes left, and return
    whether a living process is writing it."""
    name, busy = re.compile(re.escape(f".{target.name}.tmp-") + "[0-9a-f]+"), False
    for leftover in os.scandir(target.parent):
        if not name.fullmatch(leftover.name) or not leftover.is_file(follow_symlinks=False):
            continue
        # OSError: the file belongs to another user, or was removed
        with suppress(OSError), open_plain(leftover.path, "r+") as file:
            try:
                # If a process was killed while its file had both names, this is the
                # target itself, which may be locked.
                if not (target.exists() and os.path.samefile(leftover.path, target)):
                    _try_lock(file.fileno())
            except BlockingIOError:
                busy = True
            else:
                os.unlink(leftover.path)
    return busy


def _exclusively(folder: Path, work: Callable[[], object]) -> None:
    """Do ``work`` while no other process creates a file in ``folder``, or without that
    guarantee if the folder cannot be locked.

    The folder is closed in the same function without a call in between, so that an
    interrupt cannot leave it locked.
    """
    fd = -1
    try:
        fd = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
        _wait_for_lock(fd)
        work()
    finally:
        if fd >= 0:
            os.close(fd)


def _wait_for_lock(fd: int) -> None:
    until = time.monotonic() + _FOLDER_LOCK_SECONDS
    while time.monotonic() < until:
        try:
            return _try_lock(fd)
        except BlockingIOError:
            time.sleep(0.01)
        except OSError:
            return


def _try_lock(fd: int) -> None:
    import fcntl  # not on Windows, where finished files can still be read

    fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
