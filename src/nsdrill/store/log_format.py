"""The bytes of the run log: its header, the run and the type of its slots, and the slots.

Layout, little-endian: magic [16], format version u4, CRC-32 u4 of the body, its length
u8, the body. Slots begin at the next multiple of 4096. The checksum of the body is also
the salt of the slots. A *slot* is the record of a point, preceded by its index and a
checksum, so that an incomplete or misplaced record is detected.

The body is a JSON text, a line feed, and the axes as f8; the text has only their
lengths, as an axis of 10^8 values takes a minute and gigabytes as text.
"""

from __future__ import annotations

import json
import os
import stat
import struct
import zlib
from dataclasses import asdict
from pathlib import Path

import numpy as np

from nsdrill.data import Array, Attributes
from nsdrill.errors import FileError, option
from nsdrill.models.contents import Contents
from nsdrill.ranges import MAX_POINTS
from nsdrill.records import dataclass
from nsdrill.store.points import Header, check_header, record_dtype
from nsdrill.variables import PENDING

MAGIC = b"nsdrill run log\n"
LOG_VERSION = 1
_PREFIX = struct.Struct("<16sIIQ")
_PAGE = 4096
_MAX_SLOT = 1 << 26  # bytes of the record of a point, which has 7 MB at most


def pack_header(header: Header, n_points: int, contents: Contents) -> tuple[list[bytes | memoryview], int]:
    """The header of a log as consecutive pieces of bytes, and the salt; ``header`` is
    plain data and numpy values."""
    axes = {name: np.asarray(header["coords"][name], "<f8") for name in _binary_axes(contents)}
    coords = {**header["coords"], **{name: len(values) for name, values in axes.items()}}
    fields = {
        "header": {**header, "coords": coords},
        "n_points": n_points,
        "kept": asdict(contents),
        "fields": _fields(contents),
    }
    text = json.dumps(fields, ensure_ascii=False, default=_to_plain, allow_nan=False).encode()
    body: list[bytes | memoryview] = [
        text + b"\n",
        *(raw_bytes(np.ascontiguousarray(values)) for values in axes.values()),
    ]
    salt = 0
    for piece in body:
        salt = zlib.crc32(piece, salt)
    return [_PREFIX.pack(MAGIC, LOG_VERSION, salt, sum(map(len, body))), *body], salt


def _binary_axes(contents: Contents) -> list[str]:
    """The coordinates that are written as numbers, not as text, as they may have 10^8
    values."""
    return [name for name in contents.grid if name not in ("procedure", "sample", "start")]


def first_slot(header_bytes: int) -> int:
    """Offset of the first slot after a header of this many bytes."""
    return -(-header_bytes // _PAGE) * _PAGE


@dataclass(frozen=True)
class LogHead:
    """What the header of a log says: the ``header`` of the run, of how many points, and
    what is ``kept`` of each; the ``offset`` of the first slot, and the ``salt`` of all."""

    header: Header
    n_points: int
    contents: Contents
    offset: int
    salt: int


def read_header(fd: int, path: Path) -> LogHead:
    """The header of the open log; FileError if it is not a run log."""
    info = os.fstat(fd)
    if not stat.S_ISREG(info.st_mode):
        raise FileError(f"{path}: not a file, so no run log.")
    prefix = os.pread(fd, _PREFIX.size, 0)
    if len(prefix) < _PREFIX.size or not prefix.startswith(MAGIC):
        raise FileError(
            f"{path}: this is no run log of nsdrill, though it has the name of one. Move it "
            f"away or choose another {option('path')}."
        )
    _, version, salt, length = _PREFIX.unpack(prefix)
    if version != LOG_VERSION:
        raise FileError(
            f"{path}: run log of format {version}; this nsdrill knows format {LOG_VERSION}. Go on with the version of "
            f"nsdrill that began the run, or start anew by {option('overwrite')}."
        )
    damaged = FileError(
        f"{path}: the header of the run log is damaged, its points are lost. Start anew: {option('overwrite')}."
    )
    body = _read(fd, length, _PREFIX.size) if length <= info.st_size else b""
    if len(body) != length or zlib.crc32(body) != salt:
        raise damaged
    try:
        end = body.index(b"\n")
        fields = json.loads(body[:end])
        header, n_points = fields["header"], int(fields["n_points"])
        coords, attrs = dict(header["coords"]), dict(header["attrs"])
    except (KeyError, TypeError, ValueError, OverflowError, RecursionError) as error:
        raise damaged from error
    contents = _readable(fields)
    if contents is None:
        raise FileError(
            f"{path}: the run log holds other variables than this nsdrill writes. Go on with the version of nsdrill "
            f"that began the run, or start anew by {option('overwrite')}."
        )
    try:
        position = end + 1
        for name in _binary_axes(contents):
            coords[name] = np.frombuffer(body, "<f8", coords[name], position)
            position += coords[name].nbytes
        head: Header = {**header, "coords": coords, "attrs": attrs}
        check_header(head, n_points, contents)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise damaged from error
    if n_points > MAX_POINTS or slot_dtype(contents).itemsize > _MAX_SLOT:
        raise damaged
    return LogHead(head, n_points, contents, first_slot(_PREFIX.size + length), salt)


def _read(fd: int, length: int, position: int) -> bytes:
    """``length`` bytes, or fewer where the file ends, in several reads, as one read
    returns at most 2 GB."""
    pieces = []
    while length > 0 and (piece := os.pread(fd, length, position)):
        pieces.append(piece)
        length, position = length - len(piece), position + len(piece)
    return b"".join(pieces)


def _readable(fields: Attributes) -> Contents | None:
    """What is kept of each point; None unless the records of this log have the type that
    this version writes."""
    try:
        contents = Contents(**fields["kept"])
        return contents if fields["fields"] == _fields(contents) else None
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, MemoryError, StopIteration, FileError):
        return None


def _fields(contents: Contents) -> list[list[str]]:
    """Names and types of the fields of a record, as text: two versions with the same
    list can read each other's logs."""
    kind = record_dtype(contents)
    return [[name, str(kind[name])] for name in kind.names or ()]


def _to_plain(value: object) -> object:
    """numpy values in a header as plain ones."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a header holds plain data; found {type(value).__name__}")


def slot_dtype(contents: Contents) -> np.dtype:
    """Type of a slot of the run log: checksum, index of the point, record."""
    return np.dtype([("crc", "<u4"), ("index", "<u8"), ("record", record_dtype(contents))])


def pack_slots(indices: Array, records: Array, salt: int) -> Array:
    """Slots [n] for ``records`` [n] of the points ``indices`` [n]. ``salt`` ties them
    to one log."""
    slots = np.zeros(len(records), np.dtype([("crc", "<u4"), ("index", "<u8"), ("record", records.dtype)]))
    slots["index"] = indices
    slots["record"] = records
    slots["crc"] = _checksums(slots, salt)
    return slots


def intact(slots: Array, start: int, salt: int) -> Array:
    """Which of ``slots`` [n] hold a complete record of the points ``start``,
    ``start + 1``, ... : bool [n].

    Slots that were never written are all zero, hence pending; checksums are computed
    for the other slots only.
    """
    good = slots["record"]["status"] != PENDING
    good &= slots["index"] == np.arange(start, start + len(slots), dtype=np.uint64)
    candidates = np.flatnonzero(good)
    good[candidates] = slots["crc"][candidates] == _checksums(slots[candidates], salt)
    return np.asarray(good)


def raw_bytes(array: Array) -> memoryview:
    """The bytes of a contiguous ``array``, not copied."""
    return memoryview(array.view(np.uint8).reshape(-1)) if array.size else memoryview(b"")  # type: ignore[arg-type]


def _checksums(slots: Array, salt: int) -> Array:
    """CRC-32 of every slot without its checksum field: uint32 [n], by one call of zlib
    per slot (1 us)."""
    data = raw_bytes(np.ascontiguousarray(slots))
    size = slots.dtype.itemsize
    ends = range(size, len(slots) * size + 1, size)
    return np.fromiter((zlib.crc32(data[end - size + 4 : end], salt) for end in ends), np.uint32, len(slots))
