"""nsdrill schema."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command("schema", epilog=options.examples("schema > study.schema.json"))
def command() -> int:
    """Print the JSON Schema of the study file, for editors and other programs."""
    from nsdrill.data import json_text
    from nsdrill.study import json_schema

    click.echo(json_text(json_schema(), indent=2))
    return 0
