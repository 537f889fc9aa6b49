"""The run log ``OUT.h5.part``: where points go while a sweep runs.

A header, then one slot of fixed size per point. Every slot is written with one ``pwrite`` and carries its own checksum,
so a process killed at any moment leaves whole slots and slots that are seen to be damaged, nothing in between; those
run again. The results file is made from the log when all points are there, so half a results file never exists.

The file is sparse: a point that has not run takes no space.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NoReturn, Self

import numpy as np

from nsdrill.data import Array
from nsdrill.errors import FileError, NsdrillError
from nsdrill.store.files import check_room, publish, reason, sync_folder, temporary_name, write_at
from nsdrill.store.log_header import first_slot, pack_header, read_header
from nsdrill.store.records import check_write, pending_records, raw, seal, slot_dtype, sound
from nsdrill.store.sink import check_header
from nsdrill.variables import PENDING, Kept

_BLOCK_BYTES = 4 << 20  # read and write in pieces of this size, so that memory does not grow with the sweep


def part_path(path: str | os.PathLike[str]) -> Path:
    """Name of the run log of the results file ``path``."""
    return Path(f"{os.fspath(path)}.part")


class RunLog:
    """An open run log. Make one with :meth:`create` or :meth:`open`.

    It is locked while it is open, so that two processes never write the same results. One thread may use it at a time.
    """

    def __init__(self, path: Path, fd: int, fields: dict[str, Any], offset: int, salt: int, *, writable: bool) -> None:
        self.path = path
        self.header: dict[str, Any] = fields["header"]
        self.n_points: int = fields["n_points"]
        self.kept = Kept(**fields["kept"])
        self._fd = fd
        self._offset = offset
        self._salt = salt
        self._writable = writable
        self._slot = slot_dtype(self.kept)
        self._block = max(1, _BLOCK_BYTES // self._slot.itemsize)
        self._lost = False
        self._status: Array = np.zeros(self.n_points, np.int8)
        for start in range(0, self.n_points, self._block):
            stop = min(start + self._block, self.n_points)
            if self._stored(start, stop):
                self._status[start:stop] = self.read(start, stop)["status"]
        self._safe = int(np.count_nonzero(self._status))

    @classmethod
    def create(cls, path: str | os.PathLike[str], header: dict[str, Any], n_points: int, kept: Kept) -> RunLog:
        """A new, empty log at ``path``, which must not exist.

        ``header`` is plain data: ``coords`` (the four axes) and ``attrs`` (the root attributes of the results), and
        whatever else a resumed run needs. FileError if the name is taken, NsdrillError if the disk has no room for
        the points that are to come.
        """
        path = Path(path)
        check_header(header, n_points, kept)
        head = pack_header(header, n_points, kept)
        size = first_slot(len(head)) + n_points * slot_dtype(kept).itemsize
        # Under a name of its own until the header is whole; the link then fails if another process was quicker.
        temporary = temporary_name(path)
        try:
            check_room(path, size)
            fd = os.open(temporary, os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC, 0o666)
            try:
                _lock(fd, path)
                write_at(fd, head, 0)
                os.ftruncate(fd, size)
                os.fsync(fd)
                publish(temporary, path)
                sync_folder(path.parent)
            except BaseException:
                os.close(fd)
                raise
            finally:
                temporary.unlink(missing_ok=True)
        except FileExistsError as error:
            raise FileError(
                f"{path}: an unfinished run is already there. Go on with it by --resume, or start anew by --overwrite."
            ) from error
        except OSError as error:
            raise NsdrillError(
                f"{path}: the run log could not be made: {reason(error)}. Nothing has run. Make room or choose "
                "another folder with -o."
            ) from error
        fields, offset, salt = read_header(fd, path)
        return cls(path, fd, fields, offset, salt, writable=True)

    @classmethod
    def open(cls, path: str | os.PathLike[str], *, writable: bool = True) -> RunLog:
        """An existing log, to go on with it, or just to look (``writable=False``; then no lock is taken).

        FileError if there is none, if another process is writing it, or if it is no run log of this version. Damaged
        slots are no error: their points are pending.
        """
        path = Path(path)
        try:
            fd = os.open(path, (os.O_RDWR if writable else os.O_RDONLY) | os.O_CLOEXEC | os.O_NONBLOCK)
        except (OSError, ValueError) as error:
            raise FileError(f"{path}: the run log cannot be opened: {reason(error)}.") from error
        try:
            if writable:
                _lock(fd, path)
            fields, offset, salt = read_header(fd, path)
            if writable:
                # A log cut short has lost slots, no more; as long as its header is whole they run again.
                size = offset + fields["n_points"] * slot_dtype(Kept(**fields["kept"])).itemsize
                os.ftruncate(fd, max(size, os.fstat(fd).st_size))
            return cls(path, fd, fields, offset, salt, writable=writable)
        except OSError as error:
            os.close(fd)
            raise FileError(f"{path}: the run log cannot be read: {reason(error)}.") from error
        except BaseException:
            os.close(fd)
            raise

    @staticmethod
    def remove(path: str | os.PathLike[str]) -> None:
        """Remove the log at ``path`` without reading it, damaged or not; FileError if a process is writing it."""
        fd = os.open(path, os.O_RDWR | os.O_CLOEXEC | os.O_NONBLOCK)
        try:
            _lock(fd, Path(path))
            os.unlink(path)
        finally:
            os.close(fd)

    def write(self, indices: Any, records: Array) -> None:
        """Put ``records`` [n] at the points ``indices`` [n]; they are safe after the next :meth:`sync`.

        NsdrillError if the disk refuses. The other points are not touched by that, and the call may be repeated.
        """
        places = check_write(indices, records, self.n_points, self.kept)
        order = np.argsort(places, kind="stable")
        for run in _runs(places[order], self._block):
            chosen = order[run]
            self._status[places[chosen]] = PENDING  # until the slot is whole again
            self._put(places[chosen], seal(places[chosen], records[chosen], self._salt))
            self._status[places[chosen]] = records["status"][chosen]

    def clear(self, indices: Any) -> None:
        """Make the points ``indices`` [n] pending again, to run them once more."""
        places = np.unique(np.asarray(indices, np.int64))
        for run in _runs(places, self._block):
            self._put(places[run], np.zeros(run.stop - run.start, self._slot))
            self._status[places[run]] = PENDING

    def sync(self) -> None:
        """Return when everything written is on the disk; NsdrillError if it will not go there."""
        try:
            if self._lost:
                raise OSError(errno.EIO, os.strerror(errno.EIO))
            os.fsync(self._fd)
        except OSError as error:
            # After a failed fsync the kernel forgets what it could not write, and a second fsync may claim success.
            self._lost = True
            self._fail(error)
        self._safe = int(np.count_nonzero(self._status))

    def status(self) -> Array:
        """Status of every point: int8 [n_points]."""
        return self._status.copy()

    def done(self) -> Array:
        """Which points have a result, good or failed: bool [n_points]."""
        return np.asarray(self._status != PENDING)

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start] of the points from ``start``; pending ones have status 0 and NaN features."""
        if not self._stored(start, stop):
            return pending_records(stop - start, self.kept)
        slots = np.zeros(stop - start, self._slot)
        buffer = raw(slots)
        position = self._offset + start * self._slot.itemsize
        try:
            while len(buffer):
                piece = os.preadv(self._fd, [buffer], position)
                if piece == 0:
                    break  # cut short: what is missing is pending
                buffer, position = buffer[piece:], position + piece
        except OSError as error:
            raise FileError(f"{self.path}: the run log cannot be read: {reason(error)}.") from error
        good = sound(slots, start, self._salt)
        records = pending_records(stop - start, self.kept)
        records[good] = slots["record"][good]
        return records

    def _stored(self, start: int, stop: int) -> bool:
        """Whether the file has anything between these points, or a hole only: with many returns to the Poincare section
        it takes long to read zeros."""
        begin, end = (self._offset + point * self._slot.itemsize for point in (start, stop))
        try:
            return os.lseek(self._fd, begin, os.SEEK_DATA) < end
        except OSError as error:
            return error.errno != errno.ENXIO  # nothing after the hole; or a system that does not tell

    def close(self) -> None:
        """Let go of the file and its lock; it stays, to be resumed."""
        fd, self._fd = self._fd, -1
        if fd >= 0:
            os.close(fd)

    def discard(self) -> None:
        """Remove the log; for when the results file is in place."""
        self.path.unlink(missing_ok=True)  # before the lock goes, so that nobody can take it up in between
        self.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()

    def _put(self, places: Array, slots: Array) -> None:
        """Write ``slots`` of consecutive ``places``."""
        try:
            if not self._writable:
                raise OSError(errno.EROFS, "the run log was opened to be read")
            write_at(self._fd, raw(slots), self._offset + int(places[0]) * self._slot.itemsize)
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> NoReturn:
        remedy = "Make room on that disk" if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG) else "Mend that"
        raise NsdrillError(
            f"{self.path}: a result could not be written: {reason(error)}. {self._safe} of {self.n_points} points are "
            f"safe there. {remedy} and give the same command with --resume; only the missing points will run."
        ) from error


def _runs(places: Array, longest: int) -> Iterator[slice]:
    """Slices of ascending ``places`` that are consecutive and at most ``longest`` long: each is one write."""
    breaks = (np.flatnonzero(np.diff(places) != 1) + 1).tolist()
    for start, stop in zip([0, *breaks], [*breaks, len(places)], strict=True):
        for begin in range(start, stop, longest):
            yield slice(begin, min(begin + longest, stop))


def _lock(fd: int, path: Path) -> None:
    """Lock the open log for this process, until it is closed or the process ends, however it ends."""
    import fcntl  # not on Windows, where finished files can still be read

    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise FileError(
            f"{path}: another process is writing these results now. Wait for it, stop it, or choose another -o."
        ) from error
    except OSError as error:
        # Some cluster file systems have no locks (ENOLCK, EOPNOTSUPP, ENOSYS): better a run without one than no run.
        if error.errno not in (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS):
            raise
    if os.fstat(fd).st_nlink == 0:  # its name went away between opening and locking
        raise FileError(f"{path}: another process has just begun anew with these results. Try again.")
