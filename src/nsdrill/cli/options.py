"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from nsdrill.errors import InputError

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

study_argument = click.argument("study", type=click.Path())
settings = click.option(
    "--set", "overrides", multiple=True, metavar="KEY=VALUE", help="Change a key of the study, e.g. operation.wob='30 kN'.")
overwrite = click.option("--overwrite", is_flag=True, help="Replace the output if it exists.")


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


def quantity(name: str, units: str, text: str, **more: Any) -> Decorator:
    """An option whose value is a quantity in ``units``."""
    return click.option(name, type=Quantity(units), metavar="Q", help=text, **more)


def output(text: str, required: bool = True) -> Decorator:
    """The output file."""
    return click.option("-o", "--output", type=click.Path(), required=required, help=text)
