"""Errors for users. Each message says what was found, where, what is allowed and what
to do.

The command line prints them as one paragraph on stderr and ends with the exit code of
the class; a traceback is a bug.
"""

from __future__ import annotations

import os
import shlex
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType

from nsdrill.records import dataclass

# How a run can end early, and the remedy.
ENDINGS = {
    "diverged": "the motion grew without bound; the values of the study are far from any drill string",
    "step_limit": "the run took more than simulation.max_steps steps",
    "step_underflow": "the step became too small to move time on; raise simulation.rtol, or lower the stiffnesses",
    "unmeasured": "a feature that decides on the response is no number, so that nothing is known of it",
}
# Why a run that ended well may not have a value, by the name of the value.
WITHOUT = {"stick_slip_period": "as it rotates steadily, or has fewer than three cycles in simulation.observe"}

# Arguments that are named apart from their options, and those that are on or off.
_OPTIONS = {
    "path": "-o",
    "time": "--from and --to",
    "errors": "--error",
    "times": "--time",
    "trace": "--animate",
    "changes": "--set",
}
# whose values have the heads of a file, or a blank before a unit
_OF_TABLES = ("rename", "unit", "ignore", "times", "columns", "errors", "only")
_FLAGS = ("overwrite", "resume", "retry_failed", "large", "skip_gaps")
_commanded = False  # whether messages are for a command line


@contextmanager
def naming_options() -> Iterator[None]:
    """A context in which messages name the options of commands, and not the arguments of
    functions."""
    global _commanded
    before, _commanded = _commanded, True
    try:
        yield
    finally:
        _commanded = before


def on_command_line() -> bool:
    """Whether messages are for a command line."""
    return _commanded


def option(name: str, value: object = None) -> str:
    """How a message names an argument of an operation, with a ``value`` if given: as the
    option of a command or as the argument of a function, whichever was called. The value
    of an argument by key is a text ``key=value``, or (key, value) where the key may have an
    equals sign."""
    pair = value if isinstance(value, tuple) else None
    if pair is not None:
        value = "=".join(pair)
    if name in ("ignore", "times") and value is not None and not _commanded:
        return f"{name}=[{value!r}]"
    if _commanded:
        text = _OPTIONS.get(name, f"--{name.replace('_', '-')}")
        of_table = name in _OF_TABLES and value is not None
        return text if value is None else f"{text} {_pasted(str(value)) if of_table else value}"
    if name == "columns" and value is not None:
        return f"columns={value!r}"
    if value is None:
        return f"{name}=True" if name in _FLAGS else name
    key, equals, part = (pair[0], "=", pair[1]) if pair is not None else str(value).partition("=")
    if not equals:
        return f"{name}={value!r}"
    bare = {"true": "True", "false": "False", "null": "None", "...": "..."}.get(part)
    with suppress(ValueError):
        bare = str(float(part)) and part
    return f"{name}={{{key!r}: {bare or repr(part)}}}"


def _pasted(value: str) -> str:
    """A value in quotes, as a shell takes it."""
    return f"'{value}'" if "'" not in value else shlex.quote(value)


def again(name: str) -> str:
    """The same command or call with one argument more: ``the same command and
    --resume``."""
    return f"the same {'command' if _commanded else 'call'} and {option(name)}"


def count(number: int, noun: str) -> str:
    """``1 point``, ``2 points``, ``2 branches``."""
    return f"{number} {noun}{'' if number == 1 else 'es' if noun.endswith('ch') else 's'}"


def from_to(ends: Iterable[str]) -> str:
    """``60 to 90 rpm`` of the texts of two ends, ``60 rpm`` where they are the same."""
    return " to ".join(dict.fromkeys(ends))


def printable(text: str) -> str:
    """``text`` with escapes for unprintable characters, such as control characters and
    lone surrogates; a byte of a file name that is not UTF-8 as that byte."""
    if text.isprintable():
        return text
    return "".join(char if char.isprintable() else _escape(char) for char in text)


def brief(text: str, most: int = 80) -> str:
    """``text`` as :func:`printable`, of which the middle is left out beyond ``most``
    characters."""
    if len(text) > most:
        text = f"{text[: most * 2 // 3]} ... {text[len(text) - most // 4 :]}"
    return printable(text)


def _escape(char: str) -> str:
    byte = ord(char) - 0xDC00  # how Python keeps a byte that it cannot decode
    return f"\\x{byte:02x}" if 0x80 <= byte <= 0xFF else ascii(char)[1:-1]


_LONGEST_LINE = 1500  # characters of a line of a message


def message(text: str) -> str:
    """``text`` as a message: its lines :func:`brief`."""
    return "\n".join(brief(line, _LONGEST_LINE) for line in text.split("\n"))


class NsdrillError(Exception):
    """The run failed for a reason other than its input, such as a full disk or a dead
    worker (exit code 1); and what all errors of nsdrill are.

    Examples
    --------
    >>> issubclass(nsdrill.InputError, nsdrill.NsdrillError)
    True
    """

    exit_code = 1

    def __str__(self) -> str:
        return message(super().__str__())


class InputError(NsdrillError):
    """The command line, an argument, the study or an input file is wrong; nothing was
    written (exit code 2).

    Examples
    --------
    >>> try:
    ...     nsdrill.plot("out.h5", "mapp")
    ... except nsdrill.InputError as error:
    ...     print(str(error).splitlines()[0])
    plot kind: found 'mapp', which is not known. Allowed for a sweep over rotary_speed (5 values):
    """

    exit_code = 2


class Refusal(InputError):
    """A value of an ``argument`` that is refused, as data: what was ``found``, what is
    ``allowed``, and possibly a ``hint``. ``key`` is that of a value by key, ``bare`` the
    unit of a number without one, as Python may give it."""

    def __init__(
        self, argument: str, found: str, allowed: str, hint: str | None = None, *, key: str = "", bare: str = ""
    ) -> None:
        self.argument, self.key, self.bare = argument, key, bare
        self.found, self.allowed, self.hint = found, allowed, hint
        name = option(argument) if _commanded else argument
        if key:
            name += f" {key}" if _commanded else f"[{key!r}]"
        number = f"; a number is in {bare}" if bare and not _commanded else ""
        text = f"{name}: found {found}; allowed: {allowed}{number}."
        super().__init__(f"{text} {hint}" if hint else text)


class DeviceError(NsdrillError):
    """A GPU that cannot be used, or that failed; the results so far are kept."""


class DeviceMemoryError(DeviceError):
    """The memory of a GPU is too small for what was asked."""


class FileError(InputError):
    """A file that cannot be used as requested: missing, damaged, of another program, or
    already existing.

    Examples
    --------
    >>> try:
    ...     nsdrill.open_results("nowhere.h5")
    ... except nsdrill.FileError as error:
    ...     print(error)
    nowhere.h5: there is no such file.
    """


class CacheWarning(UserWarning):
    """Compiled code cannot be cached, or cached code is not used. A run takes longer;
    its results are the same."""


class FileWarning(UserWarning):
    """A file is read that another program has open to write, or left open when it was
    killed. Its data are whole.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", nsdrill.FileWarning)  # stop there
    ...     results = nsdrill.open_results("out.h5")
    """


def warn(text: str, category: type[Warning]) -> None:
    """Warn at the line of the user that led here, through however many calls of nsdrill and of
    what is called between them: the innermost one of a script, a notebook or another
    package."""
    frame: FrameType | None = sys._getframe(1)
    while frame is not None and _is_between(frame):
        frame = frame.f_back
    if frame is None:  # on a thread of nsdrill
        warnings.warn(text, category, stacklevel=2)
        return
    known = frame.f_globals.setdefault("__warningregistry__", {})
    module = str(frame.f_globals.get("__name__") or "<string>")
    warnings.warn_explicit(text, category, frame.f_code.co_filename, frame.f_lineno, module, known)


_PACKAGE, _PYTHON = (os.path.dirname(os.path.abspath(file)) + os.sep for file in (__file__, os.__file__))


def _is_between(frame: FrameType) -> bool:
    """Whether a frame is of nsdrill, or of a library that calls it for its user: of Python, as
    where contexts are entered, of xarray or of click."""
    file, root = frame.f_code.co_filename, str(frame.f_globals.get("__name__")).partition(".")[0]
    if file.startswith((_PACKAGE, "<frozen ")) or root in ("xarray", "click"):
        return True
    return file.startswith(_PYTHON) and "site-packages" not in file


file_warnings: list[str] = []  # of this command, for its JSON


class RunWarning(UserWarning):
    """About a run from Python: points failed, or the run ended early, or in another
    state than it did before.

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("error", nsdrill.RunWarning)  # stop there
    ...     results = nsdrill.run("study.yaml", progress=False)
    """


@dataclass(frozen=True)
class Fault:
    """One error in a study file.

    ``line`` and ``column`` count from 1 and are None if the fault has no place in the
    file (a ``--set`` value, a missing file). ``key`` is the dotted path, such as
    ``well.friction.static``.
    """

    key: str
    found: str
    allowed: str
    line: int | None = None
    column: int | None = None
    suggestion: str | None = None


class StudyError(InputError):
    """All faults of one study, in the order of the file.

    Attributes
    ----------
    source : str
        The name of the file, or what else the study was read from.
    faults : list
        Each with its ``key``, what was ``found``, what is ``allowed``, and ``line`` and
        ``column`` in the file.

    Examples
    --------
    >>> try:
    ...     nsdrill.load_study("study.yaml", {"bit.lobes": -1})
    ... except nsdrill.StudyError as error:
    ...     print(error.faults[0].key)
    bit.lobes
    """

    def __init__(self, source: str, faults: list[Fault]) -> None:
        self.source = source
        self.faults = faults
        super().__init__("\n".join(self._sentence(fault) for fault in faults))

    def _sentence(self, fault: Fault) -> str:
        place = self.source if fault.line is None else f"{self.source}, line {fault.line}"
        key = f": {fault.key}" if fault.key else ""
        text = f"{place}{key}: found {fault.found}; allowed: {fault.allowed}."
        return f"{text} {fault.suggestion}" if fault.suggestion else text
