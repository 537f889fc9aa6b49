"""nsdrill new."""

from __future__ import annotations

import re
from pathlib import Path

import click

from nsdrill.cli import options
from nsdrill.errors import InputError


def examples() -> dict[str, Path]:
    """The files of the examples by name."""
    from nsdrill.study.write import examples

    return examples()


@click.command(
    "new",
    epilog=options.examples(
        "new -o study.yaml",
        "new --units field -o study.yaml",
        "new --all | less",
        "new --list",
        "new --example torsional_speed -o study.yaml",
        "new | nsdrill check -",
    ),
)
@options.output("Study file to write. Default, and -: standard output.", required=False, stream=True)
@options.model
@click.option(
    "--example",
    metavar="NAME",
    type=options.Word(examples),
    help="Write one of the studies that come with nsdrill; --list prints their names.",
)
@click.option("--list", "listed", is_flag=True, help="Print the examples with their titles.")
@click.option("--all", "every", is_flag=True, help="Write every key with its meaning and default.")
@options.units
@options.overwrite
def command(
    output: str | None,
    model: str | None,
    example: str | None,
    listed: bool,
    every: bool,
    units: str | None,
    overwrite: bool,
) -> int:
    """Write a short study to start from: the numbers that differ from well to well, and
    a sweep of the rotary speed up and down."""
    from nsdrill.study import short_text, template_text

    if listed:
        click.echo(_listing())
        return 0
    if example is not None:
        if model is not None or every:
            other = "--all" if every else "--model"
            raise InputError(f"--example: found with {other}; allowed: one of the two.")
        text = _example(example)
    elif every:
        text = template_text(options.model_name(model), units or "si")
    else:
        text = short_text(options.model_name(model), units or "si")
    options.write(output, text, overwrite)
    if output not in (None, "-"):
        follows = re.search(r"^continue:", text, re.MULTILINE)
        command = "branches" if follows and not re.search(r"^sweep:", text, re.MULTILINE) else "run"
        click.echo(f"{output}: written. Next: nsdrill check {output}; nsdrill {command} {output} -o out.h5", err=True)
    return 0


def _example(name: str) -> str:
    """The text of the example ``name``; InputError with the list of all for an unknown
    name."""
    import difflib

    paths = examples()
    stem = name.replace("-", "_")
    match = next((example for example in paths if example.replace("-", "_") == stem), None)
    if match is not None:
        return paths[match].read_text(encoding="utf-8")
    near = difflib.get_close_matches(name, paths, n=1)
    hint = f" Did you mean {near[0]}?" if near else ""
    raise InputError(f"--example: found {name};{hint} allowed:\n{_listing()}")


def _listing() -> str:
    """The names and titles of the examples."""
    from nsdrill.study.write import title_of

    return "\n".join(f"  {name:<26} {title_of(path)}" for name, path in examples().items())
