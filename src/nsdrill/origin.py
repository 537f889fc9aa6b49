"""Where a script made what it adds, so that two things of one name are told from one that
was made anew."""

from __future__ import annotations

import os
import sys
from types import CodeType, FrameType, FunctionType
from typing import Any

from nsdrill.errors import InputError, printable
from nsdrill.records import dataclass
from nsdrill.variables import NOTEBOOK, PACKAGE


@dataclass(frozen=True, eq=False)
class Origin:
    """A ``line`` of a ``file``, which in a notebook is no file, and the ``execution`` of that
    file: its code, which is another one each time that it is executed; None in a notebook,
    or where it was made after the file had been executed."""

    file: str
    line: int
    execution: CodeType | None

    def __str__(self) -> str:
        return f"{self.file}, line {self.line}"


def origin_of(function: FunctionType) -> Origin:
    """The origin of a function, while its file is executed."""
    code = function.__code__
    return Origin(code.co_filename, code.co_firstlineno, _execution(function.__globals__))


def origin_at(frame: FrameType) -> Origin:
    """The origin of what is made in this frame now."""
    return Origin(frame.f_code.co_filename, frame.f_lineno, _execution(frame.f_globals))


def _execution(module: dict[str, Any]) -> CodeType | None:
    """The code of the file that is being executed and has these globals; None elsewhere."""
    frame: FrameType | None = sys._getframe()
    while frame is not None and not (frame.f_globals is module and frame.f_code.co_name == "<module>"):
        frame = frame.f_back
    return frame.f_code if frame is not None and os.path.isfile(frame.f_code.co_filename) else None


def origin_in_words(script: object) -> str:
    """What a file names as the ``script`` that made a part, in words."""
    name = printable(str(script))[:80]
    return name if name == NOTEBOOK or name.startswith(PACKAGE) else f"the script {name}"


def check_new_name(what: str, name: str, before: Origin, now: Origin) -> None:
    """InputError where two files, or two places of one execution of a file, make what has one
    name; a notebook, and a file that is executed again, make it anew."""
    if before is now:
        return
    if before.file != now.file:
        is_another = os.path.isfile(before.file) and os.path.isfile(now.file)
    else:
        is_another = now.execution is not None and before.execution is now.execution
    if is_another:
        where = f"{before}" if before.file != now.file else f"line {before.line}"
        raise InputError(f"{now}: found {what} with the name {name}, as in {where}; allowed: one of each name.")
