"""Files that are there whole or not at all: written under a temporary name, synced,
then renamed.

A temporary file is new, has a random name, and is locked while it is written. So
whoever comes later can tell one that a killed process left, which is removed, from one
that a living process writes. Numbers of processes cannot tell: every container has a
process 1.
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

_NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EBADF)
_FOLDER_SECONDS = 2.0  # to wait for others who begin a file in the same folder


class Temporary:
    """A new, empty, locked file beside ``target``; with ``with`` it is removed unless
    it got that name.

    FileError if another process or thread is writing ``target`` in the same way,
    OSError if the disk refuses.
    """

    def __init__(self, target: Path) -> None:
        self.target = target
        self.path = target.with_name(f".{target.name}.tmp-{secrets.token_hex(4)}")
        self.file: io.FileIO
        try:
            _in_turn(target.parent, self._begin)
        except BaseException:
            self.remove()
            raise

    def _begin(self) -> None:
        if _clear(self.target):
            raise FileError(
                f"{self.target}: another process is writing this file now. Wait for it, or choose "
                f"another -o."
            )
        interrupt.doomed.add(str(self.path))
        self.file = io.FileIO(self.path, "x+")  # fails on anything that is there, a link too
        lock(self.file, self.target)

    def replace(self) -> None:
        """Take the name of the target, in place of what has it."""
        os.replace(self.path, self.target)
        interrupt.doomed.discard(str(self.path))

    def publish(self) -> None:
        """Take the name of the target; FileExistsError if that is taken."""
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
            # whoever looked meanwhile saw it to be the target, and removed it
            with suppress(FileNotFoundError):
                os.unlink(self.path)
        interrupt.doomed.discard(str(self.path))

    def remove(self) -> None:
        """Close the file, which ends its lock, and remove it where it still has its
        temporary name."""
        if str(self.path) in interrupt.doomed:
            with suppress(OSError):
                os.unlink(self.path)
            interrupt.doomed.discard(str(self.path))
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
    """Yield the name of an empty file in the folder of ``path``; what is written there
    takes the name ``path`` at the end. A ``path`` that is a link stays one, and its
    target is replaced.

    Whatever goes wrong, ``path`` is untouched and the temporary file is removed.
    FileError if another process or thread is writing ``path``, or, without
    ``overwrite``, if it has come into being meanwhile. Errors of the system, of a full
    disk say, become NsdrillError that ends with ``remedy``.
    """
    target = Path(os.path.realpath(path))
    try:
        with Temporary(target) as temporary:
            yield temporary.path
            with open(temporary.path, "rb") as file:
                os.fsync(file.fileno())
            with interrupt.settling():
                (temporary.replace if overwrite else temporary.publish)()
            sync_folder(target.parent)
    except InputError:
        raise
    except FileExistsError as error:
        raise FileError(
            f"{path}: another process has just made this file. Choose another name, or replace it "
            f"by --overwrite."
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
        _in_turn(target.parent, lambda: _clear(target))


def lock(file: io.FileIO, path: Path) -> None:
    """Lock the open ``file`` until it is closed or the process ends, however it ends;
    FileError, about ``path``, where another process or thread has the lock."""
    try:
        _flock(file.fileno())
    except BlockingIOError as error:
        raise FileError(
            f"{path}: another process is writing these results now. Wait for it, stop it, or "
            f"choose another -o."
        ) from error
    except OSError as error:
        # Some cluster file systems have no locks: better a run without one than no run.
        if error.errno not in _NO_LOCKS:
            raise
    if os.fstat(file.fileno()).st_nlink == 0:  # its name went away between opening and locking
        raise FileError(
            f"{path}: another process has just begun anew with these results. Try again."
        )


def open_plain(path: str | os.PathLike[str], mode: str) -> io.FileIO:
    """Open a file that is there, without waiting where it is a pipe; OSError where it
    is a link and may be written."""
    more = os.O_NONBLOCK | (os.O_NOFOLLOW if "+" in mode else 0)
    try:
        return io.FileIO(path, mode, opener=lambda name, flags: os.open(name, flags | more))
    except OSError as error:
        if error.errno == errno.ELOOP and os.path.islink(path):
            raise OSError(errno.ELOOP, "it is a link, which is not followed here") from error
        raise


def sync_folder(folder: Path) -> None:
    """Make a new name in ``folder`` last through a crash."""
    fd = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(fd)
    except OSError:
        pass  # some network file systems refuse this; the file itself is safe
    finally:
        os.close(fd)


def check_room(path: Path, size: int) -> None:
    """OSError now rather than hours later if the disk cannot hold the finished log."""
    disk = os.statvfs(path.parent)
    free = disk.f_bavail * disk.f_frsize
    if free < size:
        raise OSError(
            errno.ENOSPC, f"the points need {amount(size)}, the disk has {amount(free)} free"
        )


def amount(size: float) -> str:
    """A number of bytes in words."""
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"


def write_at(fd: int, data: bytes | memoryview, position: int) -> None:
    """Write all of ``data`` at ``position``; a short write goes on where it stopped."""
    view = memoryview(data)
    while len(view):
        written = os.pwrite(fd, view, position)
        view, position = view[written:], position + written


def reason(error: BaseException) -> str:
    """What the system said, to be put in a sentence."""
    text = getattr(error, "strerror", None) or str(error)
    return text[:1].lower() + text[1:]


def _clear(target: Path) -> bool:
    """Remove what killed processes left of ``target``; whether a living one is writing
    it."""
    name, busy = re.compile(re.escape(f".{target.name}.tmp-") + "[0-9a-f]+"), False
    for leftover in os.scandir(target.parent):
        if not name.fullmatch(leftover.name) or not leftover.is_file(follow_symlinks=False):
            continue
        # OSError: of others, or gone
        with suppress(OSError), open_plain(leftover.path, "r+") as file:
            try:
                # Of a process killed while its file had both names, it is the target
                # itself, which may be locked.
                if not (target.exists() and os.path.samefile(leftover.path, target)):
                    _flock(file.fileno())
            except BlockingIOError:
                busy = True
            else:
                os.unlink(leftover.path)
    return busy


def _in_turn(folder: Path, work: Callable[[], object]) -> None:
    """Do ``work`` alone, of all that begin a file in ``folder``. Where its lock cannot
    be had, do it all the same.

    The closing follows without a call in between, in the same function, so that no
    interrupt can keep the lock.
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
    until = time.monotonic() + _FOLDER_SECONDS
    while time.monotonic() < until:
        try:
            return _flock(fd)
        except BlockingIOError:
            time.sleep(0.01)
        except OSError:
            return


def _flock(fd: int) -> None:
    import fcntl  # not on Windows, where finished files can still be read

    fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
