"""nsdrill new."""

from __future__ import annotations

import difflib
import re
from typing import Annotated

import click

from nsdrill.cli.building import Given, command_of, model_name, say, write
from nsdrill.errors import InputError
from nsdrill.late import deferred
from nsdrill.operations.argument import Argument, Text
from nsdrill.operations.arguments import Model, Overwrite, Stream, Switch, Units, examples

with deferred():
    from nsdrill import study
    from nsdrill.study import write as writing


@command_of(
    examples=(
        "new -o study.yaml",
        "new --units field -o study.yaml",
        "new --all | less",
        "new --list",
        "new --example torsional_speed -o study.yaml",
        "new | nsdrill check -",
    )
)
def command(
    given: Given,
    output: Annotated[Stream, "Study file to write. Default, and -: standard output."] = None,
    model: Model = None,
    example: Annotated[
        str | None,
        Argument(
            "Write one of the studies that come with nsdrill; --list prints their names.",
            metavar="NAME",
            kind=Text(examples),
        ),
    ] = None,
    list: Annotated[Switch, "Print the examples with their titles."] = False,
    all: Annotated[Switch, "Write every key with its meaning and default."] = False,
    units: Units = None,
    overwrite: Overwrite = False,
) -> int:
    """Write a short study to start from: the numbers that differ from well to well, and
    a sweep of the rotary speed up and down."""
    if list:
        click.echo(_listing())
        return 0
    if example is not None:
        if model is not None or all:
            other = "--all" if all else "--model"
            raise InputError(f"--example: found with {other}; allowed: one of the two.")
        text = _example(example)
    elif all:
        text = study.template_text(model_name(model), units or "si")
    else:
        text = study.short_text(model_name(model), units or "si")
    write(output, text, overwrite)
    if output not in (None, "-"):
        follows = re.search(r"^continue:", text, re.MULTILINE)
        command = "branches" if follows and not re.search(r"^sweep:", text, re.MULTILINE) else "run"
        say(f"{output}: written. Next: nsdrill check {output}; nsdrill {command} {output} -o out.h5")
    return 0


def _example(name: str) -> str:
    """The text of the example ``name``; InputError with the list of all for an unknown
    name."""
    paths = writing.examples()
    stem = name.replace("-", "_")
    match = next((example for example in paths if example.replace("-", "_") == stem), None)
    if match is not None:
        return paths[match].read_text(encoding="utf-8")
    near = difflib.get_close_matches(name, paths, n=1)
    hint = f" Did you mean {near[0]}?" if near else ""
    raise InputError(f"--example: found {name};{hint} allowed:\n{_listing()}")


def _listing() -> str:
    """The names and titles of the examples."""
    return "\n".join(f"  {name:<26} {writing.title_of(path)}" for name, path in writing.examples().items())
