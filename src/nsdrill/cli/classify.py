"""nsdrill classify."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command("classify")
@click.argument("results", type=click.Path())
@options.settings
def command(results: str, overrides: tuple[str, ...]) -> int:
    """Give RESULTS new labels with other thresholds, e.g. --set classify.whirl.wall_contact_fraction=0.05.

    Without --set the thresholds of the study are restored. Nothing is run again.
    """
    from nsdrill.app.report import reclassify

    for name, (changed, total) in reclassify(results, list(overrides)).items():
        click.echo(f"{name}: {changed} of {total} points changed.", err=True)
    return 0
