"""nsdrill plot."""

from __future__ import annotations

import click

from nsdrill.cli import options


@click.command("plot")
@click.argument("file", type=click.Path())
@options.output("Picture to write: .png, .pdf or .svg.")
@click.option("--kind", metavar="KIND", help="What to draw; default: the picture that fits the file. `--kind list` lists.")
@click.option("--units", type=click.Choice(["si", "field"]), default="si", show_default=True)
@options.quantity("--depth", "m", "Cut a sweep of several axes at this depth.")
@options.quantity("--wob", "N", "Cut at this weight on bit.")
@options.quantity("--rotary-speed", "rad/s", "Cut at this speed.")
@options.overwrite
def command(
    file: str, output: str, kind: str | None, units: str, depth: float | None, wob: float | None,
    rotary_speed: float | None, overwrite: bool,
) -> int:  # fmt: skip
    """Draw FILE, a results or a trace file."""
    from nsdrill.plot import DESCRIPTIONS, check_suffix, draw, kinds_for, save

    if kind != "list":
        from nsdrill.store import claim_file

        check_suffix(output)
        claim_file(output, overwrite)
    from nsdrill.cli.reading import read

    data = read(file)
    if kind == "list":
        for name in kinds_for(data):
            click.echo(f"{name}: {DESCRIPTIONS.get(name, 'values of this variable')}")
        return 0
    given = {"depth": depth, "wob": wob, "rotary_speed": rotary_speed}
    at = {name: value for name, value in given.items() if value is not None}
    save(draw(data, kind, units=units, at=at or None), output)
    click.echo(f"{output}: drawn.", err=True)
    return 0
