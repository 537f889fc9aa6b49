"""nsdrill new."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command("new", epilog=options.examples("new -o study.yaml", "new | less", "new | nsdrill check -"))
@options.output("Study file to write. Default, and -: standard output.", required=False, stream=True)
@options.model
@options.overwrite
def command(output: str | None, model: str | None, overwrite: bool) -> int:
    """Write a commented study to start from, with every key, its unit and its default."""
    from nsdrill.study import template_text

    text = template_text(options.known_model(model))
    if output is None or output == "-":
        click.echo(text, nl=False)
        return 0
    from nsdrill.store import claim_file, write_text

    claim_file(output, overwrite)
    write_text(output, text, overwrite=overwrite)
    click.echo(f"{output}: written. Next: nsdrill check {output}; nsdrill run {output} -o out.h5", err=True)
    return 0
