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
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from nsdrill.errors import Fault, FileError, StudyError, printable
from nsdrill.study.keys import Plain, Value
from nsdrill.units import quoted
from nsdrill.variables import long_key

if TYPE_CHECKING:
    from ruamel.yaml.error import FileMark

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
            f"{path}, line {line}: found the byte 0x{byte:02x}, which is not UTF-8; allowed: text "
            f"in UTF-8. "
            "Save the file with that encoding."
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
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    if len(text) > LARGEST_FILE:
        raise FileError(f"{source}: is larger than {LARGEST_FILE // 1_000_000} MB, which no study is.")
    try:
        return _Builder(iter(YAML(typ="safe", pure=True).parse(text.removeprefix("\ufeff"))), source).build()
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        problem = (error.problem or error.context or "a syntax error").removeprefix("found ")
        hint = "Indent with spaces, not tabs." if "\\t" in problem else None
        raise _not_yaml(source, problem, mark.line + 1 if mark else None, hint) from None
    except YAMLError as error:  # the reader: characters that YAML forbids
        line = text.count("\n", 0, getattr(error, "position", None) or 0) + 1
        raise _not_yaml(source, str(error).splitlines()[0], line) from None
    except (RecursionError, ValueError, AttributeError, IndexError, KeyError, TypeError, AssertionError) as error:
        # ruamel.yaml's own slips on broken input, found by fuzzing: they too are the
        # file's fault
        raise _not_yaml(source, f"text that the YAML parser cannot take ({type(error).__name__})", None) from None


def _not_yaml(source: str, found: str, line: int | None, hint: str | None = None) -> StudyError:
    allowed = "one plain YAML document"
    expected = re.fullmatch(r"expected (.*), but (?:found|got) (.*)", found)
    if expected:
        allowed, found = (group.strip("(),") for group in expected.groups())
    return StudyError(source, [Fault("", found[:200], allowed, line, None, hint)])


class Event(Protocol):
    """What is asked of an event of the parser; some kinds lack the later ones."""

    start_mark: FileMark
    anchor: str | None
    tag: object
    value: str
    style: str | None


class _Builder:
    """Builds a :class:`Document` from the events of the parser."""

    def __init__(self, events: Iterator[Event], source: str) -> None:
        self.events, self.source = events, source
        self.document = Document({})
        self.anchors: dict[str, tuple[Plain, int]] = {}
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
        if type(event).__name__ == "SequenceStartEvent":
            items: list[Plain] = []
            while type(item := next(self.events)).__name__ != "SequenceEndEvent":
                items.append(self.value(item, (*path, len(items))))
            return items
        found: dict[str, Plain] = {}
        while type(key := next(self.events)).__name__ != "MappingEndEvent":
            name = self.key(key, path, found)
            found[name] = self.value(next(self.events), (*path, name))
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
