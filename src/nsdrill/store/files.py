"""Files that are there whole or not at all: written under a temporary name, synced, then renamed."""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from nsdrill.errors import InputError, NsdrillError

_STALE_SECONDS = 600.0


@contextmanager
def replacing(path: str | os.PathLike[str], remedy: str = "Make room or choose another folder.") -> Iterator[Path]:
    """Yield a temporary name in the folder of ``path``; what was written there takes the name ``path`` at the end.

    Whatever goes wrong, ``path`` is untouched and the temporary file is removed. Errors of the system, of a full disk
    say, become NsdrillError that ends with ``remedy``.
    """
    target = Path(os.path.realpath(path))  # a link stays a link; its target is replaced
    sweep_away(target)
    temporary = temporary_name(target)
    try:
        yield temporary
        fd = os.open(temporary, os.O_RDONLY)
        try:
            os.fsync(fd)
        finally:
            os.close(fd)
        os.replace(temporary, target)
        sync_folder(target.parent)
    except InputError:
        raise
    except (OSError, RuntimeError) as error:  # h5py reports a failed flush as either
        raise NsdrillError(f"{path}: could not be written: {reason(error)}. Nothing was changed. {remedy}") from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write ``text`` to ``path``, which is replaced in one step."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def temporary_name(path: Path) -> Path:
    """Hidden name beside ``path`` that no other process uses."""
    return path.with_name(f".{path.name}.tmp-{os.getpid()}")


def sync_folder(folder: Path) -> None:
    """Make a new name in ``folder`` last through a crash."""
    fd = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(fd)
    except OSError:
        pass  # some network file systems refuse this; the file itself is safe
    finally:
        os.close(fd)


def publish(temporary: Path, path: Path) -> None:
    """Give the finished ``temporary`` its name; FileExistsError if that is taken."""
    try:
        os.link(temporary, path)
    except OSError as error:
        if error.errno not in (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK):
            raise
        if path.exists():  # a file system without links: the check and the rename are two steps
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(path)) from error
        os.rename(temporary, path)


def check_room(path: Path, size: int) -> None:
    """OSError now rather than hours later if the disk cannot hold the finished log."""
    disk = os.statvfs(path.parent)
    if disk.f_bavail * disk.f_frsize < size:
        free = disk.f_bavail * disk.f_frsize / 1e6
        raise OSError(errno.ENOSPC, f"the points need {size / 1e6:.3g} MB, the disk has {free:.3g} MB free")


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


def sweep_away(target: Path) -> None:
    """Remove temporary files of ``target`` that a killed process left: its number is free and nothing grows there.

    The age protects a file that is being written from another computer, whose process numbers are not ours.
    """
    prefix = f".{target.name}.tmp-"
    with suppress(OSError):
        for leftover in os.scandir(target.parent):
            number = leftover.name.removeprefix(prefix)
            if not leftover.name.startswith(prefix) or not number.isdecimal() or _alive(int(number)):
                continue
            if time.time() - leftover.stat().st_mtime > _STALE_SECONDS:
                os.unlink(leftover.path)


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True
