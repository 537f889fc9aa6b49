"""Commands made from operations: their arguments become arguments and options."""

from __future__ import annotations

import functools
import inspect
import os
import shlex
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from nsdrill.cli.overview import SCRIPTS_GIVEN
from nsdrill.errors import InputError, NsdrillError, Refusal, file_warnings
from nsdrill.late import deferred
from nsdrill.operations.argument import (
    Argument,
    Choice,
    Ends,
    File,
    Flag,
    Kind,
    Number,
    Percent,
    Text,
    Texts,
    Units,
    Whole,
    Words,
    arguments_of,
)

with deferred():
    from nsdrill import data, files, store, variables
    from nsdrill.app import conversion, datasets
    from nsdrill.models import registry
    from nsdrill.study import load as loading
    from nsdrill.study import read as texts
    from nsdrill.text import words

if TYPE_CHECKING:
    from nsdrill.data import Answer
    from nsdrill.study.study import Study


def following(command: str) -> str:
    """A further command to paste, with the scripts that this one was given."""
    files = click.get_current_context().meta.get(SCRIPTS_GIVEN, ())
    return " ".join((f"nsdrill {command}", *(f"--with {shlex.quote(file)}" for file in files)))


class FileName(click.ParamType):
    """The name of a file. The store checks whether the file exists and of what kind it
    is: its messages say more than those of click. With ``stream`` the name may be
    ``-``, standard input or output; ``hdf5`` is for a file to write in that format."""

    name = "path"

    def __init__(self, stream: bool = False, hdf5: bool = False) -> None:
        self.stream, self.hdf5 = stream, hdf5

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        if not value or "\0" in value:
            self.fail(f"found {value!r}; allowed: the name of a file.", param, ctx)
        if value == "-" and not self.stream:
            source = param.opts[0] if isinstance(param, click.Option) else "the file"
            raise InputError(
                f"{source}: found '-'; allowed: the name of a file. Standard input is for studies (check, run, "
                "simulate), standard output for a study (new) and for CSV (export). A file of that name is ./-."
            )
        if self.hdf5 and not value.lower().endswith((".h5", ".hdf5")):
            click.echo(
                f"Note: {value} will be an HDF5 file whatever its name; with the ending .h5 other "
                f"programs know it. nsdrill export writes CSV and netCDF.",
                err=True,
            )
        return str(value)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        return [CompletionItem(incomplete, type="file")]


class Word(click.ParamType):
    """A word, which a shell completes from those that ``known`` gives, or ``of_file`` of
    the file that stands before it, where that can be read. The command checks it, with
    the list in its message."""

    name = "word"

    def __init__(
        self, known: Callable[[], Iterable[str]], of_file: Callable[[str], Iterable[str]] | None = None
    ) -> None:
        self.known, self.of_file = known, of_file

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        words = dict.fromkeys(self._known(ctx))
        return [CompletionItem(word) for word in words if word.startswith(incomplete)]

    def _known(self, ctx: click.Context) -> list[str]:
        # an option without its value ends the parsing: the file is among what is left
        if self.of_file is not None and ctx.args:
            with suppress(NsdrillError):
                return list(self.of_file(ctx.args[0]))
        return list(self.known())


class PercentType(click.ParamType):
    """A percentage within a range, ``90`` or ``90 %``, as a share of one."""

    name = "percent"

    def __init__(self, low: float, high: float) -> None:
        self.low, self.high = low, high

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        option = param.opts[0] if param else "value"
        try:
            number = float(str(value).strip().removesuffix("percent").removesuffix("%"))
        except ValueError:
            number = float("nan")
        if not self.low <= number <= self.high:
            hint = f" A part of one is meant in percent: {100 * number:g}." if 0.0 < number < 1.0 else ""
            raise InputError(
                f"{option}: found {value}; allowed: a percentage from {self.low:g} to {self.high:g}.{hint}"
            )
        return number / 100.0


class WholeType(click.IntRange):
    """A whole number in the range of its ``kind``, refused as in Python."""

    def __init__(self, kind: Whole) -> None:
        super().__init__(kind.low, kind.high)
        self.kind = kind

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> int:
        number = value
        with suppress(ValueError):
            number = int(str(value))
        return self.kind.read((param and param.name) or "value", number)


class NumberType(click.ParamType):
    """A number, refused as in Python."""

    name = "float"

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> float:
        number = value
        with suppress(ValueError):
            number = float(str(value))
        return Number().read((param and param.name) or "value", number)


class OneOf(click.Choice):
    """One of the words of its ``kind``, refused as in Python."""

    def __init__(self, kind: Choice) -> None:
        super().__init__(kind.words)
        self.kind = kind

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> str:
        return str(self.kind.read((param and param.name) or "value", value))


class UnitSystem(click.Choice):
    """A system of units. The error for a word from the environment variable names that
    variable."""

    name = "units"

    def __init__(self, variable: str) -> None:
        super().__init__(Units.words, case_sensitive=False)
        self.variable = variable

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> str:
        word = str(value).strip().lower()
        if word in self.choices:
            return word
        environment = click.core.ParameterSource.ENVIRONMENT
        if ctx and param and param.name and ctx.get_parameter_source(param.name) == environment:
            raise InputError(f"{self.variable}: found {value!r}; allowed: {' or '.join(Units.words)}.")
        return str(Units().read("units", value))


UNITS_VARIABLE = "NSDRILL_UNITS"
Given = dict[str, Any]  # the arguments of an operation


def command_of(
    *operations: Callable[..., object],
    examples: Sequence[str],
    before: str = "",
    less: Iterable[str] = (),
    notes: bool = True,
    groups: Mapping[str, Sequence[str]] | None = None,
) -> Callable[[Callable[..., int]], click.Command]:
    """The command that a function is called by. It has the arguments of the
    ``operations``, but for those in ``less``, and those of the function itself, which is
    given the first ones together. ``before`` stands above the ``examples`` in its help,
    which lists the options of each of the ``groups`` by themselves; with ``notes`` those
    of a study are printed."""

    def decorate(function: Callable[..., int]) -> click.Command:
        own = arguments_of(function)
        taken: dict[str, Argument] = {}
        defaults: Given = {}
        for one in (function, *operations):
            parameters = inspect.signature(one).parameters
            for name, argument in arguments_of(one).items():
                if name not in taken and (one is function or name not in less):
                    taken[name] = argument
                    defaults[name] = parameters[name].default
        passed = {name for one in operations for name in arguments_of(one) if name not in less}

        @functools.wraps(function)
        def call(**values: Any) -> int:
            values = _converted(values, taken)
            _check_outputs(values, taken)
            given = {name: values[name] for name in passed if name in values and values[name] not in (None, [])}
            if "study" in given and "set" in taken:
                given["study"] = load(given["study"], given.pop("set", ()), notes)
            if "units" in values and values["units"] is None:
                values["units"] = _units_of_input(given.get("study"), values, taken)
                if "units" in passed and values["units"] is not None:
                    given["units"] = values["units"]
            return function(given, **{name: values[name] for name in own})

        lines = "\b\nExamples:\n" + "\n".join(f"  nsdrill {line}" for line in examples)
        return Command(
            function.__name__,
            groups or {},
            callback=call,
            params=_parameters(taken, defaults, passed),
            help=inspect.getdoc(function),
            epilog=f"{before}\n\n{lines}" if before else lines,
        )

    return decorate


class Command(click.Command):
    """A command whose help lists the options of ``groups``, given by their names, below
    the others."""

    def __init__(self, name: str, groups: Mapping[str, Sequence[str]], **given: Any) -> None:
        super().__init__(name, **given)
        self.groups = groups

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        options = [one for one in self.get_params(ctx) if isinstance(one, click.Option)]
        lines = {one.name: line for one in options if (line := one.get_help_record(ctx)) is not None}
        of_groups = {name for names in self.groups.values() for name in names}
        listed = {"Options": [name for name in lines if name not in of_groups], **self.groups}
        for title, names in listed.items():
            with formatter.section(title):
                formatter.write_dl([lines[name] for name in names])


def _parameters(taken: dict[str, Argument], defaults: Given, passed: set[str]) -> list[click.Parameter]:
    """What precedes options, the output, then the options of the operations and those of
    the command."""
    made = [
        _parameter(name, argument, defaults[name])
        for name, argument in taken.items()
        if argument.option or not argument.form
    ]

    def order(one: click.Parameter) -> int:
        if isinstance(one, click.Argument):
            return 0
        if "-o" in one.opts and "--picture" not in one.opts:
            return 1
        return 2 if one.name in passed else 3

    return sorted(made, key=order)


def _parameter(name: str, argument: Argument, default: object) -> click.Parameter:
    required = default is inspect.Parameter.empty
    kind = argument.kind
    option = argument.option or f"--{name.replace('_', '-')}"
    if not option.startswith("-"):
        several = isinstance(kind, File) and kind.several
        return click.Argument(
            [name], type=_type(kind), nargs=-1 if several else 1, required=required, metavar=None if several else option
        )
    more: Given = {"help": argument.help or argument.says, "metavar": argument.metavar}
    match kind:
        case Flag():
            return click.Option([*option.split(), name], is_flag=True, help=more["help"])
        case Texts():
            more["multiple"] = True
        case Ends():
            more["nargs"] = 2
        case Units():
            more["envvar"] = UNITS_VARIABLE
            more["default"] = None if required else default
        case Whole() | Number() | Choice() if default is not None and not required and "default" not in more["help"]:
            more |= {"default": default, "show_default": True}
    return click.Option([*option.split(), name], type=_type(kind), required=required, **more)


def _type(kind: Kind) -> click.ParamType | type | None:
    match kind:
        case File():
            return FileName(kind.stream, kind.hdf5)
        case Text():
            return None if kind.known is None else Word(kind.known, kind.of_file)
        case Choice():
            return OneOf(kind)
        case Units():
            return UnitSystem(UNITS_VARIABLE)
        case Percent():
            return PercentType(kind.low, kind.high)
        case Whole():
            return WholeType(kind)
        case Number():
            return NumberType()
    return None


def _converted(values: Given, taken: dict[str, Argument]) -> Given:
    """The ``values`` of the command line as the operations take them."""
    found = dict(values)
    for name, value in values.items():
        match taken[name].kind:
            case Texts(pairs=True):
                found[name] = [_pair(taken[name], text) for text in value]
            case Texts():
                found[name] = list(value)
            case Words() if value is not None:
                found[name] = [word.strip() for word in value.split(",")]
            case Flag(off=True):
                found[name] = not value
    return found


def _pair(argument: Argument, text: str) -> tuple[str, str]:
    key, equals, value = (part.strip() for part in text.partition("="))
    if not (key and equals and value):
        option = argument.option.strip("-").replace("-", "_")
        raise Refusal(option, repr(text), f"{argument.metavar}, two names or values with = between them")
    return key, value


def _inputs(values: Given, taken: dict[str, Argument]) -> list[str]:
    """The names of the files that are read."""
    found: list[str] = []
    for name, value in values.items():
        kind = taken[name].kind
        if isinstance(kind, File) and not kind.writes and value:
            found += value if kind.several else [value]
    return found


def _check_outputs(values: Given, taken: dict[str, Argument]) -> None:
    """InputError where an output is an input, also with ``--overwrite``."""
    for name, output in values.items():
        kind = taken[name].kind
        if output is None or not (isinstance(kind, File) and kind.writes):
            continue
        for source in _inputs(values, taken):
            if _same_file(source, output):
                raise InputError(f"{output}: this is the input. Choose another name with -o.")


def _same_file(source: str, output: str) -> bool:
    try:
        return "-" not in (source, output) and os.path.samefile(source, output)
    except (OSError, ValueError):
        return False


def _units_of_input(study: Study | str | None, values: Given, taken: dict[str, Argument]) -> str | None:
    """The units of the study, or of the study in the first file that is read; None of a
    study that is not read yet, by a command that takes one."""
    if study is not None and not isinstance(study, str):
        return str(study.units)
    inputs = _inputs(values, taken)
    if inputs and inputs[0].lower().endswith((".yaml", ".yml")):
        return None if "set" in taken else "si"
    return datasets.units_in(inputs[0]) if inputs else None


def load(study: str, overrides: Sequence[str], notes: bool = True) -> Study:
    """The study in the file ``study``, or on standard input where that is ``-``; its
    ``notes`` are printed."""
    if study == "-":
        name = "standard input"
        text = texts.text_of(sys.stdin.buffer.read(texts.LARGEST_FILE + 1), name)
        loaded = loading.parse_study(text, name, overrides)
    else:
        loaded = loading.load_study(study, overrides)
    for note in loaded.notes if notes else ():
        say(f"Note: {note}")
    return loaded


def say(text: str) -> None:
    """Print a message."""
    click.echo(text, err=True)


def print_json(answer: Answer, units: str) -> None:
    """Print plain data in SI as JSON in ``units``, with the warnings about its files."""
    told = {"file_warnings": list(file_warnings)} if file_warnings else {}
    click.echo(data.json_text({**words.in_units(answer, units), **told}, indent=2))


def write(output: str | None, text: str, overwrite: bool) -> None:
    """Write ``text`` to the file ``output``, or to standard output without one."""
    if output in (None, "-"):
        click.echo(text, nl=False)
        return
    assert output is not None
    store.claim_file(output, overwrite)
    files.write_text(output, text, overwrite=overwrite)


def print_answer(answer: Answer, lines: Iterable[str], units: str, json: bool) -> None:
    """Print what was found, plain data in SI, as JSON in ``units`` or as ``lines``."""
    if json:
        print_json(answer, units)
    else:
        click.echo("\n".join(lines))


def requested_values(given: Given) -> dict[str, float]:
    """The values of the operating point that were asked for, in SI, with their units."""
    values: dict[str, float | None] = {name: given.get(name) for name in ("depth", "wob", "rotary_speed")}
    return conversion.values_in(given.get("at"), None, **values)


def model_name(name: str | None) -> str:
    """The name of the model, by default that of the model of all motions; a Refusal of
    an unknown ``name``."""
    if name is not None and name not in registry.model_names():
        registry.import_modules()
    if name is not None and name not in registry.model_names():
        raise Refusal("model", name, ", ".join(registry.model_names()))
    return name or variables.MODEL
