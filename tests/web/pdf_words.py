"""The words of a PDF as a search finds them, page by page: enough of the format for what
Chromium writes (text of embedded fonts with a table to Unicode)."""

import re
import unicodedata
import zlib
from pathlib import Path

OBJECT = re.compile(rb"(\d+) 0 obj\s(.*?)\sendobj", re.S)
SHOWN = re.compile(rb"/(F\d+) [\d.]+ Tf|<([0-9A-Fa-f]+)>|\bDo\b|/(X\d+) Do", re.S)


def pages(path: Path) -> list[str]:
    """The words of each page, without spaces, in the order of drawing."""
    objects = {int(number): body for number, body in OBJECT.findall(path.read_bytes())}
    streams = {number: _stream(body) for number, body in objects.items()}
    tables = {
        number: _to_unicode(streams[int(found[1])])
        for number, body in objects.items()
        if (found := re.search(rb"/ToUnicode (\d+) 0 R", body))
    }
    texts = []
    for body in objects.values():
        if re.search(rb"/Type\s*/Page\b", body):
            found = re.search(rb"/Contents (\d+) 0 R", body)
            assert found
            texts.append(_words(streams[int(found[1])], objects, streams, tables))
    return texts


def _stream(body: bytes) -> bytes:
    found = re.search(rb"stream\r?\n(.*)\r?\nendstream", body, re.S)
    if not found:
        return b""
    return zlib.decompress(found[1]) if b"/FlateDecode" in body else found[1]


def _to_unicode(text: bytes) -> dict[int, str]:
    table: dict[int, str] = {}
    for block in re.findall(rb"beginbfchar(.*?)endbfchar", text, re.S):
        for code, shown in re.findall(rb"<([0-9A-Fa-f]+)>\s*<([0-9A-Fa-f]+)>", block):
            table[int(code, 16)] = bytes.fromhex(shown.decode()).decode("utf-16-be")
    for block in re.findall(rb"beginbfrange(.*?)endbfrange", text, re.S):
        for low, high, shown in re.findall(rb"<([0-9A-Fa-f]+)>\s*<([0-9A-Fa-f]+)>\s*<([0-9A-Fa-f]+)>", block):
            for step in range(int(high, 16) - int(low, 16) + 1):
                table[int(low, 16) + step] = chr(int(shown, 16) + step)
    return table


def _words(
    content: bytes, objects: dict[int, bytes], streams: dict[int, bytes], tables: dict[int, dict[int, str]]
) -> str:
    """The words of a content stream and of the forms that it draws. Chromium names fonts
    and forms by the numbers of their objects."""
    words, table = [], {}
    for font, shown, form in SHOWN.findall(content):
        if font:
            table = tables.get(int(font[1:]), {})
        elif shown:
            codes = bytes.fromhex(shown.decode())
            words += [table.get(code, "") for (code,) in zip(_pairs(codes), strict=True)]
        elif form and b"/Subtype /Form" in objects.get(int(form[1:]), b""):
            words.append(_words(streams[int(form[1:])], objects, streams, tables))
    return unicodedata.normalize("NFKC", "".join(words)).replace(" ", "")


def _pairs(codes: bytes) -> list[int]:
    return [int.from_bytes(codes[i : i + 2], "big") for i in range(0, len(codes), 2)]
