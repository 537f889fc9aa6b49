"""What an argument of an operation is, in Python and on the command line."""

from __future__ import annotations

import functools
import inspect
import sys
import textwrap
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from numbers import Real
from typing import Annotated, Any, ClassVar, ParamSpec, TypeVar, get_args, get_origin, overload

from nsdrill.errors import Refusal
from nsdrill.late import deferred
from nsdrill.ranges import bound_text
from nsdrill.records import dataclass

with deferred():
    from nsdrill.app import conversion

P = ParamSpec("P")
R = TypeVar("R")
S = TypeVar("S")


@dataclass(frozen=True)
class Text:
    """A text. A shell completes it from ``known``, or from what is known ``of_file``, the
    file that the command line names before it; its meaning is checked by what takes it,
    with the list in its message."""

    known: Callable[[], Iterable[str]] | None = None
    of_file: Callable[[str], Iterable[str]] | None = None


@dataclass(frozen=True)
class Texts(Text):
    """Texts, one for each time that the option is given; with ``pairs`` pairs of a key
    and a value."""

    pairs: bool = False


@dataclass(frozen=True)
class Words:
    """Texts, with commas between them in one option."""


@dataclass(frozen=True)
class Choice:
    words: tuple[str, ...]

    def read(self, name: str, value: object) -> object:
        """The value of the argument ``name``, as all kinds read theirs; a Refusal of what is none
        of the words."""
        if value not in self.words:
            raise Refusal(name, repr(value), ", ".join(self.words))
        return value


@dataclass(frozen=True)
class Units:
    """A system of units, of the environment where it is not given, else of the study."""

    words: ClassVar = ("si", "field")

    def read(self, name: str, value: object) -> object:
        if value not in self.words:
            raise Refusal(name, repr(value), " or ".join(self.words))
        return value


@dataclass(frozen=True)
class Flag:
    """On or off; the option of one with ``off`` turns it off, and may be something else in
    Python."""

    off: bool = False

    def read(self, name: str, value: object) -> object:
        if not self.off and type(value).__name__ not in ("bool", "bool_"):  # of Python or numpy
            raise Refusal(name, repr(value), "True or False")
        return value


@dataclass(frozen=True)
class Whole:
    """A whole number, from ``low`` to ``high`` where these are given; without ``low``
    it is from 0, and what takes it knows its range."""

    low: int | None = None
    high: int | None = None

    def read(self, name: str, value: object) -> int:
        number, low, high = conversion.scalar(value), self.low, self.high
        if conversion.is_whole(number) and (low is None or low <= number) and (high is None or number <= high):
            return int(number)
        allowed = "a whole number, from 0" if low is None else f"a whole number, {low} or more"
        raise Refusal(name, repr(value), allowed if high is None else f"{low} to {bound_text(high)}, a whole number")


@dataclass(frozen=True)
class Number:
    def read(self, name: str, value: object) -> float:
        if not isinstance(value, Real) or isinstance(value, bool):
            raise Refusal(name, repr(value), "a number")
        return float(value)


@dataclass(frozen=True)
class Percent:
    """A share of one, in percent on the command line; the range is in percent."""

    low: float
    high: float

    def read(self, name: str, value: object) -> float:
        low, high = self.low / 100.0, self.high / 100.0
        if not isinstance(value, Real) or isinstance(value, bool) or not low <= float(value) <= high:
            raise Refusal(name, repr(value), f"{low:g} to {high:g}, as 0.9")
        return float(value)


@dataclass(frozen=True)
class Ends:
    """Two texts."""


@dataclass(frozen=True)
class File:
    """The name of a file to read, or with ``writes`` to write. ``stream``: it may be
    ``-``, standard input or output; ``hdf5``: it is written in that format; ``several``:
    one or more."""

    writes: bool = False
    stream: bool = False
    hdf5: bool = False
    several: bool = False


Kind = Text | Words | Choice | Units | Flag | Whole | Number | Percent | Ends | File

READ = (Choice, Units, Flag, Whole, Number, Percent)  # of which Python has one value, too


@dataclass(frozen=True)
class Argument:
    """An argument, which every operation that takes it has from here.

    ``says`` is its meaning, ``form`` what it is in Python; ``option`` its names on the
    command line, where ``metavar`` stands for its value and ``help`` is its meaning in
    place of ``says``. Without an ``option`` only Python has it, without a ``form`` only
    the command line. The ``option`` of one that has no name there is in capitals.
    """

    says: str
    form: str = ""
    option: str = ""
    metavar: str | None = None
    kind: Kind = Text()
    help: str = ""


@functools.cache
def arguments_of(function: Callable[..., object]) -> dict[str, Argument]:
    """The arguments of an operation by their names. A text beside the argument in an
    annotation is its meaning there."""
    found: dict[str, Argument] = {}
    for name, parameter in inspect.signature(function).parameters.items():
        annotation = parameter.annotation
        if isinstance(annotation, str):
            annotation = eval(annotation, function.__globals__)
        if get_origin(annotation) is not Annotated:
            continue
        for one in get_args(annotation)[1:]:
            found[name] = replace(found[name], says=one, help="") if isinstance(one, str) else one
    return found


def documented(function: Callable[..., object]) -> str:
    """The docstring of an operation with its parameters, as the argument types have
    them."""
    lines = []
    parameters = inspect.signature(function).parameters
    for name, argument in arguments_of(function).items():
        default = parameters[name].default
        form = argument.form
        if default is None:
            form += ", optional"
        elif default is not inspect.Parameter.empty:
            form += f", default {default!r}"
        says = textwrap.fill(argument.says, 84, initial_indent="    ", subsequent_indent="    ")
        lines.append(f"{name} : {form}\n{says}")
    text = inspect.cleandoc(function.__doc__ or "")
    described = "\n".join(("Parameters", "----------", *lines))
    return text.replace("\nReturns\n-------\n", f"\n{described}\n\nReturns\n-------\n", 1)


@overload
def public(operation: Callable[P, R]) -> Callable[P, R]: ...


@overload
def public(operation: Callable[P, R], gives: Callable[[R], S]) -> Callable[P, S]: ...


def public(operation: Callable[P, Any], gives: Callable[[Any], Any] | None = None) -> Callable[P, Any]:
    """The function for Python of an ``operation``, which returns what ``gives`` makes of
    its result."""

    signature = inspect.signature(operation)

    @functools.wraps(operation)
    def call(*args: Any, **more: Any) -> Any:
        with suppress(TypeError):  # the operation itself says which argument is wrong
            given = signature.bind(*args, **more)
            _read(operation, given)
            args, more = given.args, given.kwargs
        found = operation(*args, **more)
        if gives is not None:
            found = gives(found)
        if "xarray" in sys.modules:  # the result may be a Dataset
            import_module("nsdrill.accessor")
        return found

    shown = signature
    if gives is not None:
        shown = signature.replace(return_annotation=inspect.signature(gives).return_annotation)
    call.__signature__ = shown  # type: ignore[attr-defined]
    call.__doc__ = documented(operation)
    return call


def _read(operation: Callable[..., object], given: inspect.BoundArguments) -> None:
    """Reads what is given as the command line does; a Refusal of an argument outside its
    range. A default is as it is."""
    of, parameters = arguments_of(operation), given.signature.parameters
    for name, value in given.arguments.items():
        kind = of[name].kind if name in of else None
        if isinstance(kind, READ) and value is not parameters[name].default:
            given.arguments[name] = kind.read(name, value)
