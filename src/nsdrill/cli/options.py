"""Options that several commands share."""

from __future__ import annotations

import functools
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from nsdrill.errors import InputError, Refusal

if TYPE_CHECKING:
    from nsdrill.study.keys import Leaf

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


class FileName(click.ParamType):
    """The name of a file. The store checks whether the file exists and of what kind it
    is: its messages say more than those of click. With ``stream`` the name may be
    ``-``, standard input or output; ``hdf5`` is for a file to write in that format."""

    name = "path"

    def __init__(self, stream: bool = False, hdf5: bool = False) -> None:
        self.stream, self.hdf5 = stream, hdf5

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
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


def _models() -> Iterable[str]:
    from nsdrill.models.registry import NAMES

    return NAMES


def kinds() -> Iterable[str]:
    """The kinds of picture."""
    from nsdrill.plot import all_kinds

    return ("list", *all_kinds())


def changes() -> Iterable[str]:
    """The keys of studies with the sign that follows them, and of a choice each word."""
    from nsdrill.models.registry import of_all
    from nsdrill.study.keys import keys_of

    for _, keys in of_all(keys_of):
        yield from _assignments(keys.leaves)


def _points() -> Iterable[str]:
    """The keys of axes, as :func:`changes`."""
    from nsdrill.study.keys import SAMPLE, axes_of_all

    yield from _assignments(axes_of_all())
    yield f"{SAMPLE}="


def _assignments(leaves: Mapping[str, Leaf]) -> Iterator[str]:
    for key, leaf in leaves.items():
        yield f"{key}="
        yield from (f"{key}={word}" for word in leaf.choices)


class Quantity(click.ParamType):
    """A number with a unit, converted to SI."""

    name = "quantity"

    def __init__(self, units: str) -> None:
        self.units = units

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, float):
            return value
        from nsdrill.units import QuantityError, parse_with_unit

        option = param.opts[0] if param else "value"
        try:
            number = parse_with_unit(str(value), self.units)
        except QuantityError as error:
            raise InputError(f"{option}: {error}") from error
        return number


class Percent(click.ParamType):
    """A percentage within a range, ``90`` or ``90 %``."""

    name = "percent"

    def __init__(self, low: float, high: float) -> None:
        self.low, self.high = low, high

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
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
        return number


class UnitSystem(click.Choice):
    """A system of units. The error for a word from the environment variable names that
    variable."""

    name = "units"

    def __init__(self) -> None:
        super().__init__(["si", "field"], case_sensitive=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        word = str(value).strip().lower()
        if word in self.choices:
            return word
        from_environment = (
            ctx is not None
            and param is not None
            and param.name is not None
            and (ctx.get_parameter_source(param.name) == click.core.ParameterSource.ENVIRONMENT)
        )
        raise InputError(f"{UNITS_VARIABLE if from_environment else '--units'}: found {value!r}; allowed: si or field.")


UNITS_VARIABLE = "NSDRILL_UNITS"


def _units(otherwise: str, **more: Any) -> Decorator:
    text = f"Units of the answer: m, kN, rad/s (si) or ft, klbf, rpm (field). Default: {otherwise}."
    return click.option("--units", type=UnitSystem(), envvar=UNITS_VARIABLE, help=text, **more)


units_of_table = _units("NSDRILL_UNITS, else si", default="si")


def units(command: Callable[..., Any]) -> Callable[..., Any]:
    """The option --units. Where it is not given, the study in the file that ``command``
    takes decides; of a command that takes a study itself, ``units`` is then None."""

    @functools.wraps(command)
    def in_units(**values: Any) -> Any:
        names = [values[name] for name in ("results", "file", "a") if name in values]
        if values["units"] is None and names:
            from nsdrill.app.reading import units_in

            first = names[0][0] if isinstance(names[0], tuple) else names[0]
            is_study = first.lower().endswith((".yaml", ".yml"))
            values["units"] = None if is_study else units_in(first)
        return command(**values)

    return _units("NSDRILL_UNITS, else the key units of the study, else si")(in_units)


study_argument = click.argument("study", type=FileName(stream=True))
settings = click.option(
    "--set",
    "overrides",
    multiple=True,
    type=Word(changes),
    metavar="KEY=VALUE",
    help="Change a key of the study, e.g. --set 'operation.wob=30 kN'. May be given more than once.",
)
thresholds = click.option(
    "--set",
    "overrides",
    multiple=True,
    type=Word(lambda: (key for key in changes() if key.startswith("classify."))),
    metavar="KEY=VALUE",
    help="Change a threshold, e.g. --set classify.stick_slip.stick_slip_index=60. May be given more than once.",
)
large = click.option(
    "--large", is_flag=True, help="Allow more than a million runs, which are refused with their cost otherwise."
)
workers = click.option(
    "-j",
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="Number of parallel workers. Default: all processors.",
)
quiet = click.option("-q", "--quiet", is_flag=True, help="No progress and no summary; warnings and errors only.")
overwrite = click.option("--overwrite", is_flag=True, help="Replace the output if it exists.")


def quantity(name: str, units: str, text: str, **attributes: Any) -> Decorator:
    """An option whose value is a quantity in ``units``."""
    return click.option(name, type=Quantity(units), metavar="Q", help=text, **attributes)


at = click.option(
    "--at",
    "at",
    multiple=True,
    type=Word(_points),
    metavar="KEY=VALUE",
    help="Value of any axis by its key, e.g. --at 'bit.rock_stiffness=25 MN/m', or --at sample=17 "
    "with uncertain numbers. May be given more than once.",
)


def point_values(at: tuple[str, ...], **operation: Any) -> dict[str, float]:
    """The values of ``--at``, and those of the options for the ``operation`` that are
    not None, in SI by their keys."""
    from nsdrill.app.arguments import values_in

    pairs = [tuple(part.strip() for part in text.partition("=")[::2]) for text in at]
    for text, pair in zip(at, pairs, strict=True):
        if not all(pair):
            raise Refusal("at", repr(text), "KEY=VALUE, as --at 'bit.rock_stiffness=25 MN/m'")
    return values_in(pairs, None, **operation)


def point(depth: str, wob: str, rotary_speed: str) -> Decorator:
    """The options that choose an operating point, with their helps."""
    helps = {"--depth": depth, "--wob": wob, "--rotary-speed": rotary_speed}

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        command = at(command)
        for name, text in reversed(helps.items()):
            command = click.option(name, metavar="Q", help=text)(command)
        return command

    return decorate


model = click.option(
    "--model", metavar="NAME", type=Word(_models), help="Model of the string. Default: christoforou_yigit."
)


def model_name(name: str | None) -> str:
    """The name of the model, by default that of the model of all motions; InputError
    for an unknown ``name``."""
    from nsdrill.models.registry import NAMES
    from nsdrill.variables import MODEL

    if name is not None and name not in NAMES:
        raise InputError(f"--model: found {name}; allowed: {', '.join(NAMES)}.")
    return name or MODEL


start = click.option(
    "--start", type=int, metavar="K", help="Number of the start, from 0, if operating points have several."
)


confidence = click.option(
    "--confidence",
    type=Percent(1.0, 99.99),
    default=None,
    metavar="PERCENT",
    help="With uncertain numbers: least probability of a safe run at a safe point. Default: 90.",
)


severity = click.option(
    "--severity",
    type=click.IntRange(0, 4),
    default=None,
    metavar="N",
    help="Call a run safe if no severity exceeds N. Default: if no response is critical.",
)


def file_argument(name: str) -> Decorator:
    """A file to read."""
    return click.argument(name, type=FileName())


def output(text: str, required: bool = True, stream: bool = False, hdf5: bool = False) -> Decorator:
    """The output file, as :class:`FileName`."""
    kind = FileName(stream, hdf5)
    return click.option("-o", "--output", type=kind, metavar="FILE", required=required, help=text)


def picture(text: str) -> Decorator:
    """A picture beside the answer: --picture, or -o as in earlier versions."""
    names = ("--picture", "-o", "--output", "output")
    return click.option(*names, type=FileName(), metavar="FILE", help=text)


def write(output: str | None, text: str, overwrite: bool) -> None:
    """Write ``text`` to the file ``output``, or to standard output without one."""
    if output in (None, "-"):
        click.echo(text, nl=False)
        return
    from nsdrill.store import claim_file, write_text

    assert output is not None
    claim_file(output, overwrite)
    write_text(output, text, overwrite=overwrite)


def check_not_input(source: str, output: str) -> None:
    """InputError where the output is the input file, also with ``--overwrite``."""
    if "-" in (source, output):
        return
    try:
        same = os.path.samefile(source, output)
    except (OSError, ValueError):
        return
    if same:
        raise InputError(f"{output}: this is the input. Choose another name with -o.")


def claim_picture(file: str, output: str, overwrite: bool) -> None:
    """Check, before anything is computed, that a picture of ``file`` may be written as
    ``output``."""
    from nsdrill.plot.saving import check_suffix
    from nsdrill.store import claim_file

    check_suffix(output)
    check_not_input(file, output)
    claim_file(output, overwrite)


def examples(*lines: str) -> str:
    """Examples for the end of a help text, one on each line."""
    return "\b\nExamples:\n" + "\n".join(f"  nsdrill {line}" for line in lines)
