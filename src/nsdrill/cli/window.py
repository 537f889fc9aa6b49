"""nsdrill window."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command(
    "window",
    epilog=options.examples(
        "window map.h5",
        "window map.h5 --units field --picture window.png",
        "window map.h5 --severity 1",
        "window uncertain.h5 --confidence 95",
        "window map.h5 --json | jq .maps[0].recommended",
    ),
)
@options.file_argument("results")
@options.units
@click.option(
    "--json", "as_json", is_flag=True, help="The same for programs, with every map and region."
)
@options.picture("Picture to write as well: .png, .pdf or .svg.")
@options.severity
@options.confidence
@options.overwrite
def command(
    results: str,
    units: str,
    as_json: bool,
    output: str | None,
    severity: int | None,
    confidence: float | None,
    overwrite: bool,
) -> int:
    """Say where one may run whatever the history.

    Of a map over weight on bit, speed or depth, or of a sweep along one of them: the
    points that are safe in every procedure of RESULTS, their largest region, the point
    with the most room around it and how far one may go from there, and how the window
    changes with depth. Where the study has uncertain numbers, a point is safe where a
    run is so with a stated probability.
    """
    if output is not None:
        options.claim_picture(results, output, overwrite)

    from nsdrill.app.window import read_for_window, window_of
    from nsdrill.cli.window_note import lines
    from nsdrill.cli.words import in_units
    from nsdrill.data import json_text
    from nsdrill.errors import printable

    data = read_for_window(results, severity)
    probability = None if confidence is None else confidence / 100.0
    summary = window_of(data, severity, probability)
    if as_json:
        click.echo(json_text(in_units(summary, units), indent=2))
    else:
        click.echo(printable(f"{results}: safe window. {summary['title']}".rstrip()))
        for line in lines(summary, units):
            click.echo(line)
    if output is not None:
        from nsdrill.plot import draw, save

        save(
            draw(data, "window", units=units, severity=severity, confidence=probability),
            output,
            overwrite=overwrite,
        )
        click.echo(f"{output}: drawn.", err=True)
    return 0
