"""Whether bytes are an object file that can be loaded: LLVM does not survive another.

The symbols of an object are read from its tables: of ELF (Tool Interface Standard,
Executable and Linking Format, version 1.2; also on Windows) and of Mach-O (Apple, OS X
ABI Mach-O File Format Reference).
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

ELF, MACH_O = b"\x7fELF", b"\xcf\xfa\xed\xfe"
HEADER = {ELF: 20, MACH_O: 16}  # bytes with the format, the machine and the kind of file
_NO_BYTES, _SYMBOLS, _EXECUTABLE, _FUNCTION = 8, 2, 4, 2
_SEGMENT, _SYMBOL_TABLE, _IN_SECTION, _EXTERNAL = 0x19, 2, 0x0E, 0


class Symbol(NamedTuple):
    """A name in the table of symbols; whether the object has code for it, and whether
    another has to."""

    name: str
    has_code: bool
    is_missing: bool


def check(code: bytes, symbol: str, like: bytes) -> list[str]:
    """The names that an object with a function ``symbol`` needs from elsewhere.
    ValueError if ``code`` is no such object, or one of another format or machine than
    the object ``like``."""
    read = {ELF: _elf, MACH_O: _mach_o}.get(code[:4])
    if read is None:
        raise ValueError("it is no object file")
    if code[: HEADER[code[:4]]] != like[: HEADER[code[:4]]]:
        raise ValueError("it is the code of another processor or system")
    try:
        symbols = list(read(code))
    except (struct.error, IndexError, OverflowError, ValueError):
        raise ValueError("it is a part of an object file") from None
    if not any(found.name == symbol and found.has_code for found in symbols):
        raise ValueError("it is the code of no function of this name")
    return [found.name for found in symbols if found.is_missing]


def _elf(code: bytes) -> Iterator[Symbol]:
    order = "<" if code[5] == 1 else ">"
    (at,) = struct.unpack_from(f"{order}Q", code, 40)
    size, count = struct.unpack_from(f"{order}HH", code, 58)
    sections = [struct.unpack_from(f"{order}IIQQQQIIQQ", code, at + size * k) for k in range(count)]
    for _, kind, _, _, offset, length, *_ in sections:
        _check_inside(code, offset, 0 if kind == _NO_BYTES else length)
    for _, kind, _, _, offset, length, link, *_ in sections:
        if kind != _SYMBOLS:
            continue
        names = sections[link][4]
        for place in range(offset, offset + length, 24):
            name, info, _, section, value, extent = struct.unpack_from(f"{order}IBBHQQ", code, place)
            has_code = False
            if info & 15 == _FUNCTION and 0 < section < count:
                has_code = bool(sections[section][2] & _EXECUTABLE) and value + extent <= sections[section][5]
            yield Symbol(_text(code, names + name), has_code, section == 0 and name != 0)


def _mach_o(code: bytes) -> Iterator[Symbol]:
    commands, at, sections = struct.unpack_from("<I", code, 16)[0], 32, 0
    table = None
    for _ in range(commands):
        kind, size = struct.unpack_from("<II", code, at)
        if size < 8:
            raise IndexError
        if kind == _SEGMENT:
            (count,) = struct.unpack_from("<I", code, at + 64)
            for k in range(count):
                length, offset = struct.unpack_from("<QI", code, at + 72 + 80 * k + 40)
                _check_inside(code, offset, length)
            sections += count
        elif kind == _SYMBOL_TABLE:
            table = struct.unpack_from("<IIII", code, at + 8)
        at += size
    first, count, names, length = table or (0, 0, 0, 0)
    _check_inside(code, names, length)
    for k in range(count):
        name, kind, section, _, _ = struct.unpack_from("<IBBHQ", code, first + 16 * k)
        has_code = kind & _IN_SECTION == _IN_SECTION and 0 < section <= sections
        yield Symbol(_text(code, names + name).removeprefix("_"), has_code, kind & _IN_SECTION == _EXTERNAL)


def _check_inside(code: bytes, offset: int, length: int) -> None:
    if offset + length > len(code):
        raise IndexError


def _text(code: bytes, at: int) -> str:
    return code[at : code.index(b"\0", at)].decode()
