"""nsdrill combine."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command(
    "combine",
    epilog=options.examples("combine soft.h5 medium.h5 hard.h5 -o rock.h5", "combine 1000m.h5 2000m.h5 -o depths.h5"),
)
@click.argument("results", nargs=-1, required=True, type=options.FileName())
@options.output("Results file to write.", hdf5=True)
@options.overwrite
def command(results: tuple[str, ...], output: str, overwrite: bool) -> int:
    """Join RESULTS whose studies differ in one number into one file, in which it is an
    axis.

    The file is the one that a sweep of that axis would have made, to the bit; nothing
    is run again. The files may also have other values of an axis that they all sweep.
    """
    from nsdrill.app.combine import combine
    from nsdrill.app.saving import save
    from nsdrill.cli.words import count, label_of
    from nsdrill.store import claim_file
    from nsdrill.variables import dimension_of

    for name in results:
        options.check_not_input(name, output)
    claim_file(output, overwrite)
    combined, key = combine(results)
    save(combined, output, overwrite=overwrite)
    values = len(combined.coords[dimension_of(key)])
    click.echo(
        f"{output}: {count(len(results), 'file')} along the {label_of(key)} ({key}), "
        f"{count(values, 'value')}; "
        f"{count(combined.variables['status'].size, 'point')}.",
        err=True,
    )
    return 0
