"""nsdrill classify."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command(
    "classify",
    epilog=options.examples(
        "classify out.h5 --set classify.whirl.wall_contact_fraction=0.05 -o relabelled.h5",
        "classify out.h5 --set classify.whirl.wall_contact_fraction=0.05",
        "classify out.h5",
    ),
)
@options.file_argument("results")
@options.output("Results file to write. Default: RESULTS itself.", required=False, hdf5=True)
@options.thresholds
@options.overwrite
def command(results: str, output: str | None, overrides: tuple[str, ...], overwrite: bool) -> int:
    """Give RESULTS new labels with other thresholds, in place or as a new file. Nothing
    is run again.

    Without --set the thresholds of the study are restored. All keys of `classify` may
    change but stuck_below, which enters the run itself. The attribute `history` of the
    file records the change.
    """
    from nsdrill.app.summary import reclassify
    from nsdrill.cli.words import count
    from nsdrill.store import claim_file

    if output is not None:
        options.check_not_input(results, output)
        claim_file(output, overwrite)
    changes = reclassify(results, list(overrides), output, overwrite=overwrite or output is None)
    for name, (changed, total) in changes.items():
        click.echo(f"{name}: {changed} of {count(total, 'point')} changed.", err=True)
    if output is not None:
        click.echo(f"{output}: written.", err=True)
    return 0
