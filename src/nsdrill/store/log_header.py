"""The header of the run log: what the run is, and what its slots look like.

Layout, little-endian: magic [16], format version u4, CRC-32 u4 of the JSON text, its length u8, the JSON text. Slots
begin at the next multiple of 4096. The checksum of the text is also the salt of the slots.
"""

from __future__ import annotations

import json
import os
import stat
import struct
import zlib
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill.errors import FileError
from nsdrill.store.records import record_dtype
from nsdrill.variables import Kept

MAGIC = b"nsdrill run log\n"
LOG_VERSION = 2
_PREFIX = struct.Struct("<16sIIQ")
_PAGE = 4096


def pack_header(header: dict[str, Any], n_points: int, kept: Kept) -> bytes:
    """The header of a log as bytes; ``header`` is plain data and numpy values."""
    fields = {"header": header, "n_points": n_points, "kept": asdict(kept), "fields": _fields(kept)}
    text = json.dumps(fields, ensure_ascii=False, default=_plain, allow_nan=False).encode()
    return _PREFIX.pack(MAGIC, LOG_VERSION, zlib.crc32(text), len(text)) + text


def first_slot(header_bytes: int) -> int:
    """Offset of the first slot after a header of this many bytes."""
    return -(-header_bytes // _PAGE) * _PAGE


def read_header(fd: int, path: Path) -> tuple[dict[str, Any], int, int]:
    """Fields, offset of the first slot and salt of the open log; FileError if it is none."""
    info = os.fstat(fd)
    if not stat.S_ISREG(info.st_mode):
        raise FileError(f"{path}: not a file, so no run log.")
    prefix = os.pread(fd, _PREFIX.size, 0)
    if len(prefix) < _PREFIX.size or not prefix.startswith(MAGIC):
        raise FileError(
            f"{path}: this is no run log of nsdrill, though it has the name of one. Move it away or choose another -o."
        )
    _, version, salt, length = _PREFIX.unpack(prefix)
    if version != LOG_VERSION:
        raise FileError(
            f"{path}: run log of format {version}; this nsdrill knows format {LOG_VERSION}. Go on with the version of "
            "nsdrill that began the run, or start anew by --overwrite."
        )
    text = os.pread(fd, length, _PREFIX.size) if length <= info.st_size else b""
    if len(text) != length or zlib.crc32(text) != salt:
        raise FileError(f"{path}: the header of the run log is damaged, its points are lost. Start anew: --overwrite.")
    fields = json.loads(text)
    if not _known(fields):
        raise FileError(
            f"{path}: the run log holds other variables than this nsdrill writes. Go on with the version of nsdrill "
            "that began the run, or start anew by --overwrite."
        )
    return fields, first_slot(_PREFIX.size + length), salt


def _known(fields: dict[str, Any]) -> bool:
    """Whether records of this log are such as this version writes."""
    try:
        return bool(fields["fields"] == _fields(Kept(**fields["kept"])))
    except (KeyError, TypeError, ValueError):
        return False


def _fields(kept: Kept) -> list[list[str]]:
    """Names and types of a record, as text: two versions with the same list can read each other's logs."""
    kind = record_dtype(kept)
    return [[name, str(kind[name])] for name in kind.names or ()]


def _plain(value: Any) -> Any:
    """numpy values in a header as plain ones."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a header holds plain data; found {type(value).__name__}")
