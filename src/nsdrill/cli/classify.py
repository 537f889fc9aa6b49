"""nsdrill classify."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command(
    "classify",
    epilog=options.examples(
        "classify out.h5 --set classify.whirl.wall_contact_fraction=0.05", "classify out.h5"
    ),
)
@options.file_argument("results")
@options.thresholds
def command(results: str, overrides: tuple[str, ...]) -> int:
    """Give RESULTS new labels with other thresholds, in place. Nothing is run again.

    Without --set the thresholds of the study are restored. All keys of `classify` may
    change but stuck_below, which enters the run itself. What was done is added to the
    history in the file.
    """
    from nsdrill.app.summary import reclassify
    from nsdrill.cli.words import count

    for name, (changed, total) in reclassify(results, list(overrides)).items():
        click.echo(f"{name}: {changed} of {count(total, 'point')} changed.", err=True)
    return 0
