"""YAML text as plain data that remembers where every value stood.

The events of the YAML parser are read directly: scalars by the core schema of YAML 1.2
(``no`` and ``1_000`` are text, ``1e4`` is a number), and with bounds on size, depth and
aliases, because a study may come from anywhere.
"""

from __future__ import annotations

import os
import re
import stat
import unicodedata
from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from dataclasses import field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from nsdrill.errors import Fault, FileError, StudyError, printable
from nsdrill.records import dataclass
from nsdrill.study.keys import Plain, Value
from nsdrill.units import quoted
from nsdrill.variables import long_key

if TYPE_CHECKING:
    from ruamel.yaml.error import FileMark, MarkedYAMLError

LARGEST_FILE = 1_000_000  # bytes
DEEPEST = 20  # levels; a study has five
_MAX_VALUES = 50_000  # after aliases are followed

KeyPath = tuple[str | int, ...]


@dataclass(frozen=True)
class Place:
    """Where a value stands: line and column from 1, or the ``--set`` text that gave it."""

    line: int | None = None
    column: int | None = None
    override: str | None = None


@dataclass
class Document:
    """Plain data (dict, list, str, int, float, bool, None) with the places of values
    and of keys by path; ``notes`` say what is right and yet may not be meant."""

    data: Value
    values: dict[KeyPath, Place] = field(default_factory=dict)
    keys: dict[KeyPath, Place] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def place(self, path: KeyPath, of_key: bool = False) -> Place:
        """The place of a value (or of its key); of the nearest thing around it where it
        is not in the file."""
        first = self.keys if of_key else self.values
        if path in first:
            return first[path]
        for length in range(len(path), -1, -1):
            for places in (self.keys, self.values):
                if path[:length] in places and length:
                    return places[path[:length]]
        return Place()

    def fault(
        self,
        path: KeyPath,
        found: str,
        allowed: str,
        suggestion: str | None = None,
        *,
        key: str | None = None,
        of_key: bool = False,
    ) -> Fault:
        """A fault at the place of a value (or of its key), which says so where ``--set``
        gave it; ``key`` names it, by default the dotted path."""
        place = self.place(path, of_key)
        if place.override:
            found = f"{found} ({place.override})"
        name = dotted(path) if key is None else key
        return Fault(name, found, allowed, place.line, place.column, suggestion)

    def has(self, path: KeyPath) -> bool:
        """True where the file or an override gives this very key."""
        holder = self.value(path[:-1])
        return isinstance(holder, dict) and path[-1] in holder

    def value(self, path: Sequence[str | int]) -> Value:
        """The value at ``path``, as it is written; None where there is none."""
        inside = self.data
        for part in path:
            if isinstance(inside, dict):
                inside = inside.get(part)
            else:
                inside = inside[part] if isinstance(inside, list) and isinstance(part, int) else None
        return inside


def dotted(path: KeyPath) -> str:
    """``sweep.depth[3]``; an unknown has its whole key, ``uncertain.operation.wob``."""
    if path[:1] == ("uncertain",):
        path = tuple(long_key(part) if isinstance(part, str) else part for part in path)
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{printable(part)}" for part in path)
    return text.removeprefix(".")[:120]


def odd_character(text: str, allowed: str = "") -> str | None:
    """The first control character or lone surrogate in ``text``, as words: no file
    format and no terminal takes all of them. None where there is none but ``allowed``
    ones."""
    for place, char in enumerate(text, start=1):
        if unicodedata.category(char) in ("Cc", "Cs") and char not in allowed:
            return f"the character {printable(char)} (place {place} of the text)"
    return None


def read_text(path: Path) -> str:
    """The text of a study file; :class:`FileError` where it cannot be read as one."""
    try:
        if path.is_socket():
            raise FileError(f"{path}: is a socket; a study is a YAML file.")
        with open(path, "rb", opener=_open_at_once) as file:
            pipe = stat.S_ISFIFO(os.fstat(file.fileno()).st_mode)
            raw = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise FileError(f"{path}: there is no such file. `nsdrill new -o {path}` writes one to start from.") from None
    except IsADirectoryError:
        raise FileError(f"{path}: is a folder; a study is a YAML file.") from None
    except OSError as error:
        raise FileError(f"{path}: cannot be read: {error.strerror or error}.") from None
    except ValueError:
        raise FileError(f"{str(path)!r}: is not a file name.") from None
    if pipe and not raw:
        raise FileError(f"{path}: is a pipe, and nobody writes to it; a study is a YAML file.")
    return text_of(raw, path)


def text_of(raw: bytes, path: str | Path) -> str:
    """The text of a study in the bytes ``raw`` of ``path``; :class:`FileError` where
    they are not those of one."""
    if len(raw) > LARGEST_FILE:
        raise FileError(f"{path}: is larger than {LARGEST_FILE // 1_000_000} MB, which no study is.")
    if raw.startswith(b"\x89HDF\r\n\x1a\n"):
        raise FileError(f"{path}: is an HDF5 file (results or a trace?), not a study; a study is a YAML file.")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        byte = raw[error.start]
        raise FileError(
            f"{path}, line {line}: found the byte 0x{byte:02x}, which is not UTF-8; allowed: text in UTF-8. Save the "
            "file with that encoding."
        ) from None


def _open_at_once(path: str, flags: int) -> int:
    """Open a pipe without waiting for a writer, who may never come; what a writer has
    to say is waited for."""
    fd = os.open(path, flags | getattr(os, "O_NONBLOCK", 0))
    os.set_blocking(fd, True)
    return fd


def parse(text: str, source: str) -> Document:
    """The document in ``text``. :class:`StudyError` where it is not one plain YAML
    document; doubled keys and the like are left in ``faults``, to be told with the
    others."""
    return deepcopy(_parsed(text, source))


# While a slider of the explorer moves, one study is read with one number changed after
# another: reading the text would take most of the time until the motion is drawn.
@lru_cache(maxsize=8)
def _parsed(text: str, source: str) -> Document:
    from ruamel import yaml

    if len(text) > LARGEST_FILE:
        raise FileError(f"{source}: is larger than {LARGEST_FILE // 1_000_000} MB, which no study is.")
    builder = _Builder(iter(yaml.YAML(typ="safe", pure=True).parse(text.removeprefix("\ufeff"))), source)
    try:
        return builder.build()
    except yaml.error.MarkedYAMLError as error:
        raise StudyError(source, [_syntax_fault(error, builder.open, text.splitlines())]) from None
    except yaml.error.YAMLError as error:  # the reader: characters that YAML forbids
        line = text.count("\n", 0, getattr(error, "position", None) or 0) + 1
        raise StudyError(source, [Fault("", str(error).splitlines()[0][:200], YAML, line)]) from None
    except (RecursionError, ValueError, AttributeError, IndexError, KeyError, TypeError, AssertionError) as error:
        # ruamel.yaml's own slips on broken input, found by fuzzing: they too are the
        # file's fault
        found = f"text that the YAML parser cannot take ({type(error).__name__})"
        raise StudyError(source, [Fault("", found, YAML)]) from None


# What the parser says, in words that say what to write: the beginning of its problem, what
# was found, what is allowed.
YAML = "one plain YAML document"
_NO_COLON = "could not find expected ':'"
_SYNTAX = (
    ("mapping values are", "a colon where no key can be", "one key: value in a line, or the text in quotes"),
    (r"character '\\t'", "a tab", "an indentation with spaces, not tabs"),
    (r"character ('.')", "a value that begins with {}", "it in quotes"),
    (r"expected .* '([]}])'$", "a closing {} for which there is no opening one", "brackets in pairs"),
    (r"expected .* '<block \w+ start>'$", "another indentation than above", "keys of one section in one column"),
    (_NO_COLON, "a line without a colon", "key: value, or - value, in each line"),
    (r"expected <block end>, .* '(?:<scalar>|,)'$", "text behind a value", "a key: value in each line, or quotes"),
    (r"expected .* ','$", "a comma without a value before it", "values between commas"),
    (r"expected '<document start>'", "text behind the end of the document", YAML),
    (r"expected .* '(?:<stream end>|<document end>|\\x00)'$", "the end of the text in place of a value", "a value"),
)


def _syntax_fault(error: MarkedYAMLError, opened: list[Event], lines: list[str]) -> Fault:
    """The fault of a text with these ``lines`` that is no YAML. ``opened`` are the
    brackets that are not closed before it."""
    problem, mark = (error.problem or error.context or "a syntax error").removeprefix("found "), error.problem_mark
    line = mark.line + 1 if mark else None
    if problem == "unexpected end of stream" and error.context_mark:  # of a text in quotes
        return Fault("", "a quote that is not closed", "a quote at both ends of a text", error.context_mark.line + 1)
    if opened and (problem.startswith("expected ',' or") or "<stream end>" in problem):
        kind, place = type(opened[-1]).__name__, _place(opened[-1])
        bracket, end = ("[", "]") if kind == "SequenceStartEvent" else ("{", "}")
        before = f" before line {line}" if line and line != place.line else ""
        found = f"a bracket {bracket} that is not closed{before}"
        return Fault("", found, f"commas between values, and {end} behind the last", place.line, place.column)
    if mark and re.match(_AFTER_PROSE, problem) and (first := _prose_above(lines, mark)):
        problem, line = _NO_COLON, first
    for pattern, found, allowed in _SYNTAX:
        if match := re.match(pattern, problem):
            return Fault("", found.format(*match.groups()), allowed, line)
    expected = re.fullmatch("expected (.*), but (?:found|got) (.*)", problem)
    allowed, found = expected.groups() if expected else (YAML, problem)
    return Fault("", found[:200], allowed, line)


# What the parser says of a key below lines that are prose, as a comment without its #.
_AFTER_PROSE = f"mapping values are|{_NO_COLON}|expected '<document start>'"


def _prose_above(lines: list[str], mark: FileMark) -> int | None:
    """The first of the lines without a key or a dash that end above the first key of the
    line of ``mark``; None where there is none."""
    first = None
    if ":" in "".join(lines[mark.line : mark.line + 1])[: mark.column]:
        return None
    for number, line in reversed([*enumerate(map(str.strip, lines[: mark.line]), start=1)]):
        if line and not line.startswith("#"):
            if re.search(r":(\s|$)|^(-|\.\.\.)", line):
                break
            first = number
    return first


class Event(Protocol):
    """What is asked of an event of the parser; some kinds lack the later ones."""

    start_mark: FileMark
    end_mark: FileMark
    anchor: str | None
    tag: object
    value: str
    style: str | None
    flow_style: bool | None


class _Builder:
    """Builds a :class:`Document` from the events of the parser."""

    def __init__(self, events: Iterator[Event], source: str) -> None:
        self.events, self.source = events, source
        self.document = Document({})
        self.anchors: dict[str, tuple[Plain, int]] = {}
        self.open: list[Event] = []  # the brackets around the present value
        self.count = 0

    def build(self) -> Document:
        """The document, of which there is one."""
        documents = 0
        for event in self.events:
            kind = type(event).__name__
            if kind == "DocumentStartEvent":
                documents += 1
                if documents > 1:
                    raise self.fault(event, (), "a second document", "one document in a study")
            elif kind not in ("StreamStartEvent", "DocumentEndEvent", "StreamEndEvent"):
                self.document.data = self.value(event, ())
        return self.document

    def value(self, event: Event, path: KeyPath) -> Plain:
        """The value at ``path`` that begins with ``event``."""
        if type(event).__name__ == "AliasEvent":
            if event.anchor not in self.anchors:
                raise self.fault(event, path[:-1], f"the alias *{event.anchor}"[:60], "an alias of an earlier anchor")
            value, size = self.anchors[event.anchor]
            self.counted(event, path, size)
            self.document.values[path] = _place(event)
            return value
        before = self.count
        self.counted(event, path, 1)
        value = self.content(event, path)
        # the parser places an empty value where the next thing begins
        empty = value is None and path in self.document.keys
        self.document.values[path] = self.document.keys[path] if empty else _place(event)
        if event.anchor:
            self.anchors[event.anchor] = (value, self.count - before)
        return value

    def counted(self, event: Event, path: KeyPath, size: int) -> None:
        self.count += size
        if self.count > _MAX_VALUES:
            raise self.fault(event, path[:-1], f"more than {_MAX_VALUES} values (aliases counted)", "a smaller study")

    def content(self, event: Event, path: KeyPath) -> Plain:
        """A scalar, a list or a mapping."""
        self.check_tag(event, path[:-1])
        if type(event).__name__ == "ScalarEvent":
            return event.value if event.style else _scalar(event.value)
        if len(path) >= DEEPEST:
            raise self.fault(event, path[:-1], f"more than {DEEPEST} levels", "the five levels of a study")
        in_brackets = bool(event.flow_style)
        if in_brackets:
            self.open.append(event)
        is_list = type(event).__name__ == "SequenceStartEvent"
        found = self.items(path) if is_list else self.members(path, in_brackets)
        if in_brackets:
            self.open.pop()
        return found

    def items(self, path: KeyPath) -> list[Plain]:
        """The values of the list at ``path``."""
        items: list[Plain] = []
        texts: list[_Text | None] = []
        while type(event := next(self.events)).__name__ != "SequenceEndEvent":
            items.append(self.value(event, (*path, len(items))))
            texts.append(_Text.of(event))
            while len(items) > 1 and (whole := _split_number(*texts[-2:])):
                texts[-2:], items[-2:] = [whole], [whole.text]
        return items

    def members(self, path: KeyPath, in_braces: bool) -> dict[str, Plain]:
        """The values of the mapping at ``path`` by their names."""
        found: dict[str, Plain] = {}
        name, text = "", None
        while type(key := next(self.events)).__name__ != "MappingEndEvent":
            value = next(self.events)
            if in_braces and text and (whole := _split_value(text, key, value)):
                text, found[name] = whole, whole.text
                continue
            name, text = self.key(key, path, found), _Text.of(value)
            found[name] = self.value(value, (*path, name))
        return found

    def key(self, event: Event, above: KeyPath, found: dict[str, Plain]) -> str:
        """The name of a key of the mapping at ``above``."""
        kind = type(event).__name__
        if kind == "AliasEvent":
            raise self.fault(event, above, f"the alias *{event.anchor}"[:60], "an alias of an earlier anchor")
        self.check_tag(event, above)
        if kind != "ScalarEvent":
            raise self.fault(event, above, "a collection as a key", "a name")
        name = str(event.value)
        if odd := odd_character(name):
            raise self.fault(event, above, f"{odd} in the name {quoted(name)}", "names in letters that can be printed")
        path = (*above, name)
        if name in found and len(self.document.faults) < 100:
            what = f"the key a second time (first in line {self.document.keys[path].line})"
            place = _place(event)
            self.document.faults.append(Fault(dotted(path), what, "each key once", place.line, place.column))
        self.document.keys[path] = _place(event)
        return name

    def check_tag(self, event: Event, above: KeyPath) -> None:
        if event.tag:
            raise self.fault(event, above, f"the tag {str(event.tag)[:60]}", "plain YAML without tags")

    def fault(self, event: Event, above: KeyPath, found: str, allowed: str) -> StudyError:
        place = _place(event)
        return StudyError(self.source, [Fault(dotted(above), found, allowed, place.line, place.column)])


@dataclass(frozen=True)
class _Text:
    """A scalar without quotes as it is written, and where it begins and ends."""

    text: str
    start: FileMark
    end: FileMark

    @classmethod
    def of(cls, event: Event) -> _Text | None:
        """The text of an ``event``; None where it is no such scalar."""
        if type(event).__name__ != "ScalarEvent" or event.style or event.anchor or event.tag:
            return None
        return cls(event.value, event.start_mark, event.end_mark)

    def touches(self, after: _Text) -> bool:
        """Whether there is but a comma between this text and the one ``after`` it."""
        return self.end.line == after.start.line and self.end.column + 1 == after.start.column

    def joined(self, after: _Text) -> _Text:
        return _Text(f"{self.text},{'' if self.touches(after) else ' '}{after.text}", self.start, after.end)


# In braces and brackets YAML ends a value at a comma. What was written is put together
# again, so that it is refused as a whole, with the remedy.


def _split_number(before: _Text | None, after: _Text | None) -> _Text | None:
    """The quantity of which two items of a list are the parts, ``11`` and ``482 ft``; None
    where they are not."""
    parts = (
        before and after and re.fullmatch(r"[-+]?\d+", before.text) and re.match(r"\d[\d.,]*\s*[^\s\d.,]", after.text)
    )
    return before.joined(after) if before and after and parts and before.touches(after) else None


def _split_value(before: _Text, key: Event, value: Event) -> _Text | None:
    """The value of which a value and the key after it are the parts, as in ``{depth:
    11,482 ft}`` or ``{wob: 5 kN, 6 kN}``; None where they are not."""
    after, empty = _Text.of(key), _Text.of(value)
    begins = re.compile(r"[-+]?\.?\d")
    split = after and empty and not empty.text and begins.match(before.text) and begins.match(after.text)
    return before.joined(after) if after and split else None


def _place(event: Event) -> Place:
    return Place(event.start_mark.line + 1, event.start_mark.column + 1)


_WORDS = dict.fromkeys(("null", "Null", "NULL", "~", ""))
_WORDS |= dict.fromkeys(("true", "True", "TRUE"), True) | dict.fromkeys(("false", "False", "FALSE"), False)
_NUMBERS: dict[str, Callable[[str], int | float]] = {
    r"[-+]?[0-9]+": int,
    r"0o[0-7]+": lambda text: int(text[2:], 8),
    r"0x[0-9a-fA-F]+": lambda text: int(text[2:], 16),
    r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?": float,
    r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)": lambda text: float(text.replace(".", "", 1)),
}


def _scalar(text: str) -> str | int | float | bool | None:
    """A scalar without quotes by the core schema of YAML 1.2, except that an endless
    number stays text."""
    if text in _WORDS:
        return _WORDS[text]
    made = (number for form, number in _NUMBERS.items() if len(text) <= 60 and re.fullmatch(form, text))
    return next(made, str)(text)
