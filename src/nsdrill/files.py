"""Files that are complete or absent: written under a temporary name, synced, then
renamed. All files are written here, but for the run log, whose points are written in
place.

A temporary file is new, has a random name, and is locked while it is written. So a
later process can distinguish a file left by a killed process, which is removed, from
one that a living process is writing. Process numbers do not allow that: every container
has a process 1.
"""

from __future__ import annotations

import errno
import fcntl
import io
import os
import re
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Self, TextIO

from nsdrill import interrupt
from nsdrill.errors import FileError, InputError, NsdrillError, option

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer, WriteableBuffer

_LOCKS_UNSUPPORTED = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS, errno.EBADF)
MAKE_ROOM = "Make room or choose another folder."


class CheckedFile(io.FileIO):
    """A new binary file, written in full or with an error: the system may write a part
    of what it is given, on a full disk or beyond 2 GiB, and report no error.

    The first error stays, and nothing is written after it. With ``deferring`` every
    write succeeds as far as its caller is concerned, for the HDF5 library, which does
    not survive a full disk: while it closes the file it writes again, raises errors
    from destructors and may crash."""

    deferring = False
    error: OSError | None = None

    def raise_error(self) -> None:
        """Raise the first error of writing, if there was one."""
        if self.error is not None:
            raise self.error

    def write(self, data: ReadableBuffer) -> int:
        """Write all of ``data``; return its size."""
        view = memoryview(data).cast("B")
        size = len(view)
        self._attempt(lambda: write_all(lambda rest: os.write(self.fileno(), rest), view))
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the length; return it."""
        self._attempt(lambda: super(CheckedFile, self).truncate(size))
        return size or 0

    def readinto(self, buffer: WriteableBuffer) -> int:
        """Fill ``buffer``, with zeros beyond the end of the file, where an earlier
        write may have failed."""
        view = memoryview(buffer).cast("B")
        size = len(view)
        while len(view):
            count = super().readinto(view) or 0
            if count == 0:
                view[:] = bytes(len(view))
            view = view[count or len(view) :]
        return size

    @contextmanager
    def text(self) -> Iterator[TextIO]:
        """The file as text in UTF-8, with the line ends that are written."""
        buffer = io.BufferedWriter(self)
        text = io.TextIOWrapper(buffer, encoding="utf-8", newline="")
        yield text
        text.detach().flush()
        buffer.detach()

    def _attempt(self, work: Callable[[], object]) -> None:
        if self.error is None:
            try:
                work()
            except OSError as error:
                self.error = error
        if not self.deferring:
            self.raise_error()


class Temporary:
    """A new, empty, locked file beside ``target``. As a context manager it is removed
    at the end, unless it has taken the name of the target.

    FileError if another process or thread is writing ``target`` in the same way,
    OSError if the disk refuses.
    """

    def __init__(self, target: Path) -> None:
        self.target = target
        self.path = target.with_name(f".{target.name}.tmp-{os.urandom(4).hex()}")
        self.file: CheckedFile
        try:
            self._begin()
        except BaseException:
            self.remove()
            raise

    def _begin(self) -> None:
        if _remove_leftovers(self.target):
            raise FileError(
                f"{self.target}: another process is writing this file now. Wait for it, or "
                f"choose another {option('path')}."
            )
        interrupt.unfinished_files.add(str(self.path))
        self.file = CheckedFile(self.path, "x+")  # fails on anything that is there, a link too
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
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(self.target)) from error
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
def whole(
    path: str | os.PathLike[str], *, overwrite: bool = True, renaming: AbstractContextManager[None] | None = None
) -> Iterator[CheckedFile]:
    """Yield an empty file in the folder of ``path``, which is renamed to ``path`` at the
    end, in the context ``renaming``. If ``path`` is a link, it stays one, and its
    target is replaced.

    After any error ``path`` is unchanged and the temporary file is removed. FileError
    if another process or thread is writing ``path``; FileExistsError if, without
    ``overwrite``, it has been created meanwhile; OSError if the disk refuses.
    """
    target = Path(os.path.realpath(path))
    with Temporary(target) as temporary:
        try:
            yield temporary.file
        finally:
            temporary.file.raise_error()  # replaces what a library made of it
        os.fsync(temporary.file.fileno())
        with renaming or nullcontext():
            (temporary.replace if overwrite else temporary.publish)()
        sync_folder(target.parent)


@contextmanager
def replacing(
    path: str | os.PathLike[str], remedy: Callable[[], str] = lambda: MAKE_ROOM, *, overwrite: bool = True
) -> Iterator[CheckedFile]:
    """As :func:`whole`, for the file that completes the work of a command. System
    errors, such as a full disk, become an NsdrillError whose message ends with
    ``remedy``, and an existing file a FileError.
    """
    try:
        with whole(path, overwrite=overwrite, renaming=interrupt.completing()) as file:
            yield file
    except InputError:
        raise
    except FileExistsError as error:
        raise FileError(
            f"{path}: another process has just made this file. Choose another name, or replace "
            f"it by {option('overwrite')}."
        ) from error
    except (OSError, RuntimeError) as error:  # h5py reports a failed flush as either
        raise NsdrillError(f"{path}: could not be written: {reason(error)}. Nothing was changed. {remedy()}") from error


def write_text(
    path: str | os.PathLike[str], text: str, remedy: Callable[[], str] = lambda: MAKE_ROOM, *, overwrite: bool = True
) -> None:
    """Write ``text`` to ``path``, in one step."""
    with replacing(path, remedy, overwrite=overwrite) as file:
        file.write(text.encode())


def sweep_away(target: Path) -> None:
    """Remove the temporary files of ``target`` that killed processes left."""
    with suppress(OSError):
        _remove_leftovers(target)


def lock(file: io.FileIO, path: Path) -> None:
    """Lock the open ``file`` until it is closed or the process ends in any way;
    FileError, about ``path``, if another process or thread has the lock."""
    try:
        _try_lock(file.fileno())
    except BlockingIOError as error:
        raise FileError(
            f"{path}: another process is writing these results now. Wait for it, stop it, or "
            f"choose another {option('path')}."
        ) from error
    except OSError as error:
        # Some cluster file systems have no locks: the run then continues without one.
        if error.errno not in _LOCKS_UNSUPPORTED:
            raise
    if os.fstat(file.fileno()).st_nlink == 0:  # removed between opening and locking
        raise FileError(f"{path}: another process has just removed or replaced this file. Try again.")


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
        pass  # some network file systems refuse this; the file itself is synced
    finally:
        os.close(fd)


def check_room(path: Path, size: int) -> None:
    """OSError if the disk has no room for the finished log of ``size`` bytes, rather
    than hours later."""
    disk = os.statvfs(path.parent)
    free = disk.f_bavail * disk.f_frsize
    if free < size:
        raise OSError(errno.ENOSPC, f"the points need {amount(size)}, the disk has {amount(free)} free")


def amount(size: float) -> str:
    """A number of bytes as text."""
    return f"{size / 1e9:.3g} GB" if size >= 1e9 else f"{size / 1e6:.3g} MB"


def write_at(fd: int, data: bytes | memoryview, position: int) -> None:
    """Write all of ``data`` at ``position``."""
    view = memoryview(data)
    end = position + len(view)
    write_all(lambda rest: os.pwrite(fd, rest, end - len(rest)), view)


def write_all(write: Callable[[memoryview], int], view: memoryview) -> None:
    """Pass the bytes of ``view`` to ``write``, which says how many it has taken, until
    all are taken."""
    while len(view):
        view = view[write(view) :]


def reason(error: BaseException) -> str:
    """The system's message, as part of a sentence."""
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    if getattr(error, "errno", None) == errno.EFBIG:
        text += " (for the limit of this process, ulimit -f, or for the file system)"
    return text[:1].lower() + text[1:].rstrip(".")


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


def _try_lock(fd: int) -> None:
    fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
