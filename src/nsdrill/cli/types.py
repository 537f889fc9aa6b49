"""Values of the command line."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import click
from click.shell_completion import CompletionItem

from nsdrill.errors import InputError


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
                f"{source}: found '-'; allowed: the name of a file. Standard input is for studies "
                f"(check, run, "
                "simulate), standard output for a study (new) and for CSV (export). A file of "
                "that name is ./-."
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
    """A word, which a shell completes from those that ``known`` gives. The command
    checks it, with the list in its message."""

    name = "word"

    def __init__(self, known: Callable[[], Iterable[str]]) -> None:
        self.known = known

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        words = dict.fromkeys(self.known())
        return [CompletionItem(word) for word in words if word.startswith(incomplete)]


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


class UnitSystem(click.Choice):
    """A system of units. The error for a word from the environment variable names that
    variable."""

    name = "units"

    def __init__(self, variable: str) -> None:
        super().__init__(["si", "field"], case_sensitive=False)
        self.variable = variable

    def convert(self, value: object, param: click.Parameter | None, ctx: click.Context | None) -> str:
        word = str(value).strip().lower()
        if word in self.choices:
            return word
        environment = click.core.ParameterSource.ENVIRONMENT
        from_environment = ctx and param and param.name and ctx.get_parameter_source(param.name) == environment
        raise InputError(f"{self.variable if from_environment else '--units'}: found {value!r}; allowed: si or field.")
