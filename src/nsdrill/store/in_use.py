"""HDF5 files that another program has open to write, or left open when it ended: the
status flag in their superblock, the programs that have them open, and a reader that
gives their bytes as they are without the flag.

HDF5 sets the flag when a program opens a file to write and clears it when that closes
the file, and opens no file to read whose flag is set. Superblocks have it from version
3 on, which is that of HDF5 1.10. It is byte 11, and the last four bytes are a checksum
(https://docs.hdfgroup.org/hdf5/develop/_f_m_t3.html, section II.A).
"""

from __future__ import annotations

import io
import os
import shlex
from collections.abc import Iterator
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

SUPERBLOCK = 48  # bytes, with offsets of 8 bytes
_SIGNATURE, _VERSION, _OFFSETS, _FLAGS = b"\x89HDF\r\n\x1a\n", 8, 9, 11
_MASK = 0xFFFFFFFF


def without_flag(first: bytes) -> bytes | None:
    """The superblock ``first`` with its status flag cleared; None where it is not set, or
    where the superblock has none or is damaged."""
    block = bytearray(first[:SUPERBLOCK])
    if len(block) < SUPERBLOCK or not block.startswith(_SIGNATURE) or block[_VERSION] < 3 or block[_OFFSETS] != 8:
        return None
    if not block[_FLAGS] or int.from_bytes(block[-4:], "little") != _checksum(bytes(block[:-4])):
        return None
    block[_FLAGS] = 0
    block[-4:] = _checksum(bytes(block[:-4])).to_bytes(4, "little")
    return bytes(block)


def _checksum(data: bytes) -> int:
    """The checksum of metadata in HDF5: lookup3 of Bob Jenkins (hashlittle, from 0)."""

    def turned(value: int, bits: int) -> int:
        return ((value << bits) | (value >> (32 - bits))) & _MASK

    a = b = c = (0xDEADBEEF + len(data)) & _MASK
    words = [int.from_bytes(data[i : i + 4], "little") for i in range(0, len(data), 4)]
    while len(words) > 3:
        a, b, c = (a + words[0]) & _MASK, (b + words[1]) & _MASK, (c + words[2]) & _MASK
        a, c = ((a - c) & _MASK) ^ turned(c, 4), (c + b) & _MASK
        b, a = ((b - a) & _MASK) ^ turned(a, 6), (a + c) & _MASK
        c, b = ((c - b) & _MASK) ^ turned(b, 8), (b + a) & _MASK
        a, c = ((a - c) & _MASK) ^ turned(c, 16), (c + b) & _MASK
        b, a = ((b - a) & _MASK) ^ turned(a, 19), (a + c) & _MASK
        c, b = ((c - b) & _MASK) ^ turned(b, 4), (b + a) & _MASK
        del words[:3]
    words += [0] * (3 - len(words))
    a, b, c = (a + words[0]) & _MASK, (b + words[1]) & _MASK, (c + words[2]) & _MASK
    c = ((c ^ b) - turned(b, 14)) & _MASK
    a = ((a ^ c) - turned(c, 11)) & _MASK
    b = ((b ^ a) - turned(a, 25)) & _MASK
    c = ((c ^ b) - turned(b, 16)) & _MASK
    a = ((a ^ c) - turned(c, 4)) & _MASK
    b = ((b ^ a) - turned(a, 14)) & _MASK
    return ((c ^ b) - turned(b, 24)) & _MASK


def is_flagged(path: str | os.PathLike[str]) -> bool:
    """Whether the status flag of the HDF5 file ``path`` is set."""
    with open(path, "rb") as file:
        return without_flag(file.read(SUPERBLOCK)) is not None


def refuses_lock(error: Exception) -> bool:
    """Whether the ``error`` of HDF5 says that the file could not be locked."""
    return "unable to lock file" in str(error)


class Reader(io.RawIOBase):
    """The file ``path`` to read, without the lock that HDF5 takes, which some network
    file systems refuse, and without the flag."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self._file = open(path, "rb", buffering=0)  # noqa: SIM115, closed by close
        first = os.pread(self._file.fileno(), SUPERBLOCK, 0)
        self._first = without_flag(first) or first

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, position: int, whence: int = os.SEEK_SET) -> int:
        return self._file.seek(position, whence)

    def readinto(self, buffer: WriteableBuffer) -> int:
        """Fill ``buffer`` as far as the file goes; return the number of bytes."""
        view, start = memoryview(buffer).cast("B"), self._file.tell()
        filled = 0
        while filled < len(view) and (count := self._file.readinto(view[filled:])):
            filled += count
        ours = self._first[start : start + filled]
        view[: len(ours)] = ours
        return filled

    def close(self) -> None:
        self._file.close()
        super().close()


def told(path: str | os.PathLike[str]) -> str:
    """Who has set the flag of the file ``path``, in words."""
    found = [f"{name} (process {number})" for number, name in _writers(path)]
    if found:
        return f"its status flag is set, as {' and '.join(found[:3])} has it open to write"
    return (
        "its status flag is set: a program has it open to write, on another machine or as another user, "
        "or left it open when it was killed"
    )


def remedy(path: str | os.PathLike[str]) -> str:
    """What clears the flag of the file ``path``."""
    return (
        f"Close it in that program; where none has it open, h5clear -s {shlex.quote(os.fspath(path))}, "
        "of the HDF5 tools, clears the flag."
    )


def _writers(path: str | os.PathLike[str]) -> Iterator[tuple[int, str]]:
    """The numbers and names of the processes that have the file ``path`` open to write,
    as far as this user may see them. None on systems without /proc."""
    with suppress(OSError):
        target = os.stat(path)
        for number in sorted(int(name) for name in os.listdir("/proc") if name.isdigit()):
            with suppress(OSError, ValueError):
                if any(_writes(number, name, target) for name in os.listdir(f"/proc/{number}/fd")):
                    with open(f"/proc/{number}/comm", encoding="utf-8", errors="replace") as file:
                        name = file.read().strip()
                    yield number, "this program" if number == os.getpid() else name


def _writes(number: int, descriptor: str, target: os.stat_result) -> bool:
    with suppress(OSError, StopIteration, ValueError):
        found = os.stat(f"/proc/{number}/fd/{descriptor}")
        if (found.st_dev, found.st_ino) == (target.st_dev, target.st_ino):
            with open(f"/proc/{number}/fdinfo/{descriptor}", encoding="ascii") as file:
                flags = next(line.split()[1] for line in file if line.startswith("flags:"))
            return int(flags, 8) & os.O_ACCMODE != os.O_RDONLY
    return False
