"""Errors made for people. Every one says what was found, where, what is allowed and
what to do.

The command line turns them into one paragraph on stderr and the exit code of the class;
a traceback is a bug.
"""

from __future__ import annotations

from dataclasses import dataclass


def printable(text: str) -> str:
    """``text`` with what cannot be shown, control characters and lone surrogates, as
    escapes; a byte of a file name that is not UTF-8 as that byte."""
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else _escape(char) for char in text)


def _escape(char: str) -> str:
    byte = ord(char) - 0xDC00  # how Python keeps a byte that it cannot decode
    return f"\\x{byte:02x}" if 0x80 <= byte <= 0xFF else ascii(char)[1:-1]


class NsdrillError(Exception):
    """The run failed, and not through the input: a full disk, a dead worker (exit code
    1)."""

    exit_code = 1

    def __str__(self) -> str:
        return "\n".join(map(printable, super().__str__().split("\n")))


class InputError(NsdrillError):
    """The command line, the study or an input file is wrong; nothing was written (exit
    code 2)."""

    exit_code = 2


class FileError(InputError):
    """A file that cannot be used as asked: missing, damaged, of another program,
    already there."""


class CacheWarning(UserWarning):
    """Compiled code cannot be kept, or what was kept is not used. A run takes longer;
    its numbers are the same."""


class RunWarning(UserWarning):
    """A run that was asked for from Python is not all that it might be: points failed,
    or the run ended early, or not in the state that it ended in before."""


@dataclass(frozen=True)
class Fault:
    """One thing wrong with a study file.

    ``line`` and ``column`` count from 1 and are None where the fault has no place (a
    ``--set`` value, a missing file). ``key`` is the dotted path,
    ``well.friction.static``.
    """

    key: str
    found: str
    allowed: str
    line: int | None = None
    column: int | None = None
    suggestion: str | None = None


class StudyError(InputError):
    """All the faults found in one study, in the order in which they stand in the file."""

    def __init__(self, source: str, faults: list[Fault]) -> None:
        self.source = source
        self.faults = faults
        super().__init__("\n".join(self._sentence(fault) for fault in faults))

    def _sentence(self, fault: Fault) -> str:
        place = self.source if fault.line is None else f"{self.source}, line {fault.line}"
        key = f": {fault.key}" if fault.key else ""
        text = f"{place}{key}: found {fault.found}; allowed: {fault.allowed}."
        return f"{text} {fault.suggestion}" if fault.suggestion else text
