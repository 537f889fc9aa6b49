"""nsdrill schema."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command("schema", epilog=options.examples("schema -o study.schema.json", "schema | less"))
@options.output("Schema file to write. Default, and -: standard output.", required=False, stream=True)
@options.model
@options.overwrite
def command(output: str | None, model: str | None, overwrite: bool) -> int:
    """Print the JSON Schema of the study file, for editors and other programs."""
    from nsdrill.data import json_text
    from nsdrill.study import json_schema

    text = json_text(json_schema(options.model_name(model)), indent=2)
    options.write(output, f"{text}\n", overwrite)
    if output not in (None, "-"):
        click.echo(
            f"{output}: written. A study names it in its first line: # yaml-language-server: $schema={output}", err=True
        )
    return 0
