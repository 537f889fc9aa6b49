"""Options that several commands share."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import click

from nsdrill.errors import InputError

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


class FileName(click.ParamType):
    """The name of a file; whether it is there, and what it is, the store says better than click."""

    name = "path"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        if not value or "\0" in value:
            self.fail(f"found {value!r}; allowed: the name of a file.", param, ctx)
        return str(value)


class Quantity(click.ParamType):
    """A number with a unit, read into SI."""

    name = "quantity"

    def __init__(self, units: str) -> None:
        self.units = units

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        if isinstance(value, float):
            return value
        from nsdrill.units import QuantityError, to_si

        option = param.opts[0] if param else "value"
        try:
            number = to_si(str(value), self.units)
        except QuantityError as error:
            raise InputError(f"{option}: {error}") from error
        return number


study_argument = click.argument("study", type=FileName())
settings = click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Change a key of the study, e.g. --set 'operation.wob=30 kN'. May be given more than once.",
)
thresholds = click.option(
    "--set",
    "overrides",
    multiple=True,
    metavar="KEY=VALUE",
    help="Change a threshold, e.g. --set classify.stick_slip.stick_slip_index=60. May be given more than once.",
)
overwrite = click.option("--overwrite", is_flag=True, help="Replace the output if it exists.")


def quantity(name: str, units: str, text: str, **more: Any) -> Decorator:
    """An option whose value is a quantity in ``units``."""
    return click.option(name, type=Quantity(units), metavar="Q", help=text, **more)


at = click.option(
    "--at", "at", multiple=True, metavar="KEY=VALUE",
    help="The value of any axis by its key, e.g. --at 'bit.rock_stiffness=25 MN/m'. May be given more than once.",
)


def values(at: tuple[str, ...], **apart: float | None) -> dict[str, float]:
    """The values of ``--at``, and those of the options for the operation where they were given, in SI by their keys."""
    from nsdrill.study.keys import axis_leaves, did_you_mean
    from nsdrill.units import QuantityError

    leaves = axis_leaves()
    found: dict[str, float] = {name: value for name, value in apart.items() if value is not None}
    for text in at:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not value:
            raise InputError(f"--at: found {text!r}; allowed: KEY=VALUE, as --at 'bit.rock_stiffness=25 MN/m'.")
        key = key.removeprefix("operation.")
        if key not in leaves:
            hint = did_you_mean(key, leaves)
            raise InputError(f"--at: found the key {key}; allowed: the key of an axis.{f' {hint}' if hint else ''}")
        if key in found:
            raise InputError(f"--at {key}: found a second value of {key}; allowed: each key once.")
        try:
            found[key] = float(leaves[key].read(value if leaves[key].kind == "quantity" else float(value)))
        except (QuantityError, ValueError) as error:
            said = error if isinstance(error, QuantityError) else f"found {value!r}; allowed: {leaves[key].allowed()}."
            raise InputError(f"--at {key}: {said}") from error
    return found


start = click.option(
    "--start", type=int, metavar="K", help="Number of the start, from 0, where every operating point has several.")


def file_argument(name: str) -> Decorator:
    """A file to read."""
    return click.argument(name, type=FileName())


def output(text: str, required: bool = True) -> Decorator:
    """The output file."""
    return click.option("-o", "--output", type=FileName(), metavar="FILE", required=required, help=text)


def keep_apart(source: str, output: str) -> None:
    """InputError where the output would replace the file that it is made from, whatever ``--overwrite`` says."""
    try:
        same = os.path.samefile(source, output)
    except (OSError, ValueError):
        return
    if same:
        raise InputError(f"{output}: this is the input. Choose another name with -o.")


def examples(*lines: str) -> str:
    """Examples for the end of a help text, each on a line of its own."""
    return "\b\nExamples:\n" + "\n".join(f"  nsdrill {line}" for line in lines)
