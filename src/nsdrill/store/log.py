"""The run log ``OUT.h5.part``, which holds the points while a sweep runs.

It has a header, then one slot of fixed size per point. Every slot is written with one
``pwrite`` and has its own checksum, so a process killed at any moment leaves only
complete slots and slots with a wrong checksum, whose points run again. The results file
is written from the log when all points are in it, so a partial results file never
exists.

The file is sparse: a point that has not run takes no space.
"""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import ArrayLike

from nsdrill.data import Array, Attributes
from nsdrill.errors import FileError, NsdrillError, again, count, option
from nsdrill.files import Temporary, check_room, lock, open_plain, reason, sync_folder, write_at
from nsdrill.models.contents import Contents
from nsdrill.store.log_format import (
    LogHead,
    first_slot,
    intact,
    pack_header,
    pack_slots,
    raw_bytes,
    read_header,
    slot_dtype,
)
from nsdrill.store.points import Header, Sink, check_header, check_write, pending_records, points_in_block
from nsdrill.variables import PENDING

# of one read or write, so that memory does not grow with the sweep
_BLOCK_BYTES = 4 << 20


def part_path(path: str | os.PathLike[str]) -> Path:
    """Name of the run log of the results file ``path``. Where ``path`` is a link, the
    log is next to its target, so that two names of one file share one log."""
    return Path(f"{os.path.realpath(path) if os.path.islink(path) else os.fspath(path)}.part")


class RunLog(Sink):
    """An open run log, from :meth:`create` or :meth:`open`.

    It is locked while it is open, so that two processes never write the same results.
    One thread may use it at a time. The lock ends with the object at the latest, so
    that it does not outlive an interrupt in an interactive session.
    """

    def __init__(self, path: Path, file: io.FileIO, head: LogHead, *, writable: bool) -> None:
        super().__init__(head.header, head.n_points, head.contents)
        self.path = path
        self._file = file
        self._fd = file.fileno()
        self._offset, self._salt = head.offset, head.salt
        self._writable = writable
        self._slot = slot_dtype(self.contents)
        self._block = max(1, _BLOCK_BYTES // self._slot.itemsize)
        self._sync_failed = False
        for start in range(0, self.n_points, self._block):
            stop = min(start + self._block, self.n_points)
            if self._has_data(start, stop):
                self._status[start:stop] = self.read(start, stop)["status"]
        self._synced_count = int(np.count_nonzero(self._status))

    @classmethod
    def create(cls, path: str | os.PathLike[str], header: Header, n_points: int, contents: Contents) -> RunLog:
        """A new, empty log at ``path``, which must not exist.

        ``header`` is plain data: ``coords`` (the four axes) and ``attrs`` (the root
        attributes of the results), and anything else that a resumed run needs.
        FileError if the name is taken, NsdrillError if the disk has no room for all
        points.
        """
        path, temporary = Path(path), None
        try:
            temporary, log = cls.begin(path, header, n_points, contents)
            temporary.publish()
            log.path = path
            sync_folder(path.parent)
            return log
        except BaseException as error:
            if temporary is not None:
                temporary.remove()
            if isinstance(error, FileExistsError):
                # raises the FileError of a log that another process is writing, or of a
                # file that is not a run log
                cls.open(path).close()
                raise FileError(
                    f"{path}: an unfinished run is already there. Go on with it by "
                    f"{option('resume')}, or start anew by {option('overwrite')}."
                ) from error
            if isinstance(error, OSError):
                raise NsdrillError(
                    f"{path}: the run log could not be made: {reason(error)}. Nothing has run. Make room or choose "
                    f"another folder with {option('path')}."
                ) from error
            raise

    @classmethod
    def begin(cls, path: Path, header: Header, n_points: int, contents: Contents) -> tuple[Temporary, RunLog]:
        """A log without points that still has a temporary name; OSError if the disk has
        no room for the points."""
        check_header(header, n_points, contents)
        points = n_points * slot_dtype(contents).itemsize
        check_room(path, points)  # before any file is created
        temporary = None
        try:
            head, salt = pack_header(header, n_points, contents)
            temporary, end = Temporary(path), 0
            fd = temporary.file.fileno()
            for piece in head:
                write_at(fd, piece, end)
                end += len(piece)
            os.ftruncate(fd, first_slot(end) + points)
            os.fsync(fd)
            begun = LogHead(header, n_points, contents, first_slot(end), salt)
            return temporary, cls(temporary.path, temporary.file, begun, writable=True)
        except BaseException:
            if temporary is not None:
                temporary.remove()
            raise

    @classmethod
    def open(cls, path: str | os.PathLike[str], *, writable: bool = True) -> RunLog:
        """An existing log, to resume its run, or with ``writable=False`` to read it
        without a lock.

        FileError if it does not exist, is a link, is being written by another process,
        or is not a run log of a supported version. Damaged slots are not an error:
        their points are pending.
        """
        path, file = Path(path), None
        try:
            try:
                file = open_plain(path, "r+" if writable else "r")
            except (OSError, ValueError) as error:
                raise FileError(f"{path}: the run log cannot be opened: {reason(error)}.") from error
            if writable:
                lock(file, path)
            log = cls(path, file, read_header(file.fileno(), path), writable=writable)
            if writable:
                # A truncated log has lost slots only; with a complete header they run
                # again.
                size = log._offset + log.n_points * log._slot.itemsize
                os.ftruncate(file.fileno(), max(size, os.fstat(file.fileno()).st_size))
            return log
        except BaseException as error:
            if file is not None:
                file.close()
            if isinstance(error, OSError):
                raise FileError(f"{path}: the run log cannot be read: {reason(error)}.") from error
            raise

    @staticmethod
    def remove(path: str | os.PathLike[str]) -> None:
        """Remove the log at ``path`` without reading it, damaged or not; FileError if a
        process is writing it."""
        with open_plain(path, "r+") as file:
            lock(file, Path(path))
            os.unlink(path)

    def write(self, indices: ArrayLike, records: Array) -> None:
        """Store ``records`` [n] of the points ``indices`` [n]; they are on the disk after
        the next :meth:`sync`.

        NsdrillError if the disk rejects the write; this leaves the other points
        unchanged, and the call may be repeated.
        """
        places = check_write(indices, records, self.n_points, self.contents)
        order = np.argsort(places, kind="stable")
        for run in _consecutive_slices(places[order], self._block):
            chosen = order[run]
            self._status[places[chosen]] = PENDING  # until the slot is complete again
            self._write_slots(places[chosen], pack_slots(places[chosen], records[chosen], self._salt))
            self._status[places[chosen]] = records["status"][chosen]

    def clear(self, indices: ArrayLike) -> None:
        """Make the points ``indices`` [n] pending, so that they run again."""
        places = np.unique(np.asarray(indices, np.int64))
        for run in _consecutive_slices(places, self._block):
            self._write_slots(places[run], np.zeros(run.stop - run.start, self._slot))
            self._status[places[run]] = PENDING

    def sync(self) -> None:
        """Return when everything written is on the disk; NsdrillError if the disk
        rejects it."""
        try:
            if self._sync_failed:
                raise OSError(errno.EIO, os.strerror(errno.EIO))
            os.fsync(self._fd)
            if not self.is_in_place:
                raise NsdrillError(f"{self.recovery_text()} Nothing more is run.")
        except OSError as error:
            # After a failed fsync the kernel drops the data that it could not write, so
            # a second fsync may succeed.
            self._sync_failed = True
            self._raise_write_error(error)
        self._synced_count = int(np.count_nonzero(self._status))

    def read(self, start: int, stop: int) -> Array:
        """Records [stop - start] of the points from ``start``; pending ones have status
        0 and NaN features."""
        if not self._has_data(start, stop):
            return pending_records(stop - start, self.contents)
        slots = np.zeros(stop - start, self._slot)
        buffer = raw_bytes(slots)
        position = self._offset + start * self._slot.itemsize
        try:
            while len(buffer):
                piece = os.preadv(self._fd, [buffer], position)
                if piece == 0:
                    break  # a truncated log: the missing points are pending
                buffer, position = buffer[piece:], position + piece
        except OSError as error:
            raise FileError(f"{self.path}: the run log cannot be read: {reason(error)}.") from error
        good = intact(slots, start, self._salt)
        records = pending_records(stop - start, self.contents)
        records[good] = slots["record"][good]
        return records

    def _has_data(self, start: int, stop: int) -> bool:
        """Whether the file has data between these points, or only a hole, whose zeros
        would take long to read where records have many returns to the Poincare
        section."""
        begin, end = (self._offset + point * self._slot.itemsize for point in (start, stop))
        try:
            return os.lseek(self._fd, begin, os.SEEK_DATA) < end
        except OSError as error:
            # ENXIO: no data after ``begin``; other errors: the system has no SEEK_DATA
            return error.errno != errno.ENXIO

    @property
    def is_in_place(self) -> bool:
        """Whether the open file is still the one at ``path``, which a deleted folder or
        an unmounted disk changes."""
        try:
            return os.path.samestat(os.fstat(self._fd), os.stat(self.path))
        except (FileNotFoundError, NotADirectoryError):
            return False
        except OSError:
            return True  # a network file system that is briefly unreachable

    def recovery_text(self) -> str:
        """Where the points are and how to resume, in a sentence or two."""
        done = f"{np.count_nonzero(self._status)} of {count(self.n_points, 'point')}"
        if self.is_in_place:
            return f"{done} are kept in {self.path}. Go on with {again('resume')}."
        if os.fstat(self._fd).st_nlink == 0:
            return f"{self.path} was deleted while the run wrote it, and its {done} are lost."
        return (
            f"{self.path} is no longer there: its folder was moved or its disk unmounted. {done} are in that file, "
            f"wherever it is now; when it is back, run {again('resume')}."
        )

    def close(self) -> None:
        """Close the file and release its lock; the log stays, to be resumed."""
        self._fd = -1
        self._file.close()

    def discard(self) -> None:
        """Remove the log, once the results file is in place."""
        if self._fd >= 0 and self.is_in_place:
            # before the lock is released, so that no process opens it in between
            self.path.unlink(missing_ok=True)
        self.close()

    def _write_slots(self, places: Array, slots: Array) -> None:
        """Write ``slots`` of consecutive ``places``."""
        try:
            if not self._writable:
                raise OSError(errno.EROFS, "the run log was opened to be read")
            write_at(self._fd, raw_bytes(slots), self._offset + int(places[0]) * self._slot.itemsize)
        except OSError as error:
            self._raise_write_error(error)

    def _raise_write_error(self, error: OSError) -> NoReturn:
        if not self.is_in_place:
            raise NsdrillError(
                f"{self.path}: a result could not be written: {reason(error)}. {self.recovery_text()}"
            ) from error
        remedy = (
            "Make room on that disk" if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG) else "Fix the cause"
        )
        raise NsdrillError(
            f"{self.path}: a result could not be written: {reason(error)}. {self._synced_count} of {self.n_points} "
            f"points are kept there. {remedy} and run {again('resume')}; only the missing points will run."
        ) from error


def _consecutive_slices(places: Array, longest: int) -> Iterator[slice]:
    """Slices in which the ascending ``places`` are consecutive, each at most
    ``longest`` long: each slice is one write."""
    breaks = (np.flatnonzero(np.diff(places) != 1) + 1).tolist()
    for start, stop in zip([0, *breaks], [*breaks, len(places)], strict=True):
        for begin in range(start, stop, longest):
            yield slice(begin, min(begin + longest, stop))


def rewrite_log(
    log: RunLog, attrs: Attributes, rerun: Array, change: Callable[[Array], None] = lambda records: None
) -> RunLog:
    """Replace ``log``, in one step, by one with the root attributes ``attrs`` in which
    the points ``rerun`` (bool [n_points]) are pending; ``change`` edits the records of
    the other points in place.

    Return the new log and close ``log``. NsdrillError, with ``log`` unchanged, if the
    disk rejects the write. A kill leaves the old log or the new one."""
    try:
        temporary, new = RunLog.begin(log.path, {**log.header, "attrs": dict(attrs)}, log.n_points, log.contents)
        try:
            step = points_in_block(log.contents)
            for start in range(0, log.n_points, step):
                records = log.read(start, min(start + step, log.n_points))
                kept = np.flatnonzero((records["status"] != PENDING) & ~rerun[start : start + step])
                records = records[kept]
                change(records)
                new.write(start + kept, records)
            new.sync()
            temporary.replace()
            new.path = log.path
            sync_folder(log.path.parent)
            log.close()
            return new
        except BaseException:
            temporary.remove()
            raise
    except FileError:
        raise
    except (OSError, NsdrillError) as error:  # of the new log, which is gone
        raise NsdrillError(
            f"{log.path}: could not be rewritten: {reason(error.__cause__ or error)}. Nothing was "
            f"changed. Make room first."
        ) from error
