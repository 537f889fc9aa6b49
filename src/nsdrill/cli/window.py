"""nsdrill window."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command(
    "window",
    epilog=options.examples(
        "window map.h5",
        "window map.h5 --units field --picture window.png",
        "window ideal.h5 soft_torque.h5 --units field",
        "window map.h5 --severity 1",
        "window uncertain.h5 --confidence 95",
        "window map.h5 --json | jq .maps[0].recommended",
    ),
)
@options.file_argument("results")
@click.argument("other", type=options.FileName(), required=False)
@options.units
@click.option("--json", "as_json", is_flag=True, help="Print JSON, with every map and region.")
@options.picture("Picture to write as well: .png, .pdf or .svg.")
@options.severity
@options.confidence
@options.overwrite
def command(
    results: str,
    other: str | None,
    units: str,
    as_json: bool,
    output: str | None,
    severity: int | None,
    confidence: float | None,
    overwrite: bool,
) -> int:
    """Find the operating window: where every run is safe, whatever its history.

    RESULTS is a map over weight on bit, speed or depth, or a sweep along one of them.
    The answer has the points that are safe in every procedure, their largest region,
    the point with the largest margin, how far each number may change from there and
    what stops it, and how the window changes with depth. With uncertain numbers a point
    is safe if a run is safe with a stated probability.

    With OTHER, results over the same axes, it compares the two windows: points gained
    and lost, how far every border moved, where the responses begin, and the rate of
    penetration.
    """
    for file in (results, other):
        if output is not None and file is not None:
            options.claim_picture(file, output, overwrite)
    probability = None if confidence is None else confidence / 100.0
    if other is not None:
        return _compare((results, other), units, as_json, output, severity, probability, overwrite)

    from nsdrill.app.window import read_for_window, window_of
    from nsdrill.cli.window_note import lines
    from nsdrill.cli.words import in_units
    from nsdrill.data import json_text
    from nsdrill.errors import printable

    data = read_for_window(results, severity)
    summary = window_of(data, severity, probability)
    if as_json:
        click.echo(json_text(in_units(summary, units), indent=2))
    else:
        click.echo(printable(f"{results}: operating window. {summary['title']}".rstrip()))
        for line in lines(summary, units):
            click.echo(line)
    if output is not None:
        from nsdrill.plot import draw, save

        save(draw(data, "window", units=units, severity=severity, confidence=probability), output, overwrite=overwrite)
        click.echo(f"{output}: drawn.", err=True)
    return 0


def _compare(
    files: tuple[str, str],
    units: str,
    as_json: bool,
    picture: str | None,
    severity: int | None,
    confidence: float | None,
    overwrite: bool,
) -> int:
    """The windows of two files against each other."""
    from nsdrill.app.contrast import contrast
    from nsdrill.cli.window_note import contrast_lines
    from nsdrill.cli.words import in_units
    from nsdrill.data import json_text
    from nsdrill.errors import printable

    found = contrast(*files, severity, confidence)
    if as_json:
        click.echo(json_text(in_units(found, units), indent=2))
    else:
        names = [f"{file}: {window['title']}" for file, window in zip(files, found["windows"], strict=True)]
        for line in contrast_lines(found, units, names):
            click.echo(printable(line))
    if picture is not None:
        from nsdrill.app.window import read_for_window
        from nsdrill.plot import save
        from nsdrill.plot.kinds.window import draw_two

        data = [read_for_window(file, severity) for file in files]
        save(draw_two(data[0], data[1], files, units, severity, confidence), picture, overwrite=overwrite)
        click.echo(f"{picture}: drawn.", err=True)
    return 0
