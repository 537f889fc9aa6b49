"""nsdrill new."""

from __future__ import annotations

import click

from nsdrill.cli import options
from nsdrill.errors import InputError


@click.command(
    "new",
    epilog=options.examples(
        "new -o study.yaml",
        "new --example torsional_speed -o study.yaml",
        "new | less",
        "new | nsdrill check -",
    ),
)
@options.output(
    "Study file to write. Default, and -: standard output.", required=False, stream=True
)
@options.model
@click.option(
    "--example",
    metavar="NAME",
    help="A study that comes with nsdrill, as it is; a wrong name lists all.",
)
@options.overwrite
def command(output: str | None, model: str | None, example: str | None, overwrite: bool) -> int:
    """Write a commented study to start from, with every key, its unit and its default."""
    from nsdrill.study import template_text

    if example is not None:
        if model is not None:
            raise InputError("--example: found with --model; allowed: one of the two.")
        text = _example(example)
    else:
        text = template_text(options.model_name(model))
    if output is None or output == "-":
        click.echo(text, nl=False)
        return 0
    from nsdrill.store import claim_file, write_text

    claim_file(output, overwrite)
    write_text(output, text, overwrite=overwrite)
    click.echo(
        f"{output}: written. Next: nsdrill check {output}; nsdrill run {output} -o out.h5", err=True
    )
    return 0


def _example(name: str) -> str:
    """The text of the example ``name``; InputError with the list of all for an unknown
    name."""
    import difflib

    from nsdrill.study.write import examples, title_of

    paths = examples()
    stem = name.replace("-", "_")
    match = next((example for example in paths if example.replace("-", "_") == stem), None)
    if match is not None:
        return paths[match].read_text(encoding="utf-8")
    listing = "\n".join(f"  {example:<26} {title_of(path)}" for example, path in paths.items())
    near = difflib.get_close_matches(name, paths, n=1)
    hint = f" Did you mean {near[0]}?" if near else ""
    raise InputError(f"--example: found {name};{hint} allowed:\n{listing}")
