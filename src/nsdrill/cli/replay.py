"""nsdrill replay."""

from __future__ import annotations

import click

from nsdrill.cli import options
from nsdrill.cli.simulate import finish


@click.command("replay")
@click.argument("results", type=click.Path())
@options.output("Trace file to write (HDF5).")
@options.quantity("--depth", "m", "Depth of the point (the nearest is taken).")
@options.quantity("--wob", "N", "Weight on bit of the point.")
@options.quantity("--rotary-speed", "rad/s", "Top-drive speed of the point.")
@click.option("--procedure", type=click.Choice(["same", "up", "down"]), help="Needed where the sweep has two.")
@options.quantity("--sample", "s", "Interval between samples; default: 10 ms.")
@options.overwrite
def command(
    results: str, output: str, depth: float | None, wob: float | None, rotary_speed: float | None,
    procedure: str | None, sample: float | None, overwrite: bool,
) -> int:  # fmt: skip
    """Run one point of RESULTS again, from its stored initial state and bit for bit, and write its trajectory."""
    from nsdrill.app.trajectory import DEFAULT_SAMPLE, replay
    from nsdrill.store import claim_file
    from nsdrill.units import format_quantity

    claim_file(output, overwrite)
    result = replay(
        results, depth=depth, wob=wob, rotary_speed=rotary_speed, procedure=procedure,
        sample=DEFAULT_SAMPLE if sample is None else sample,
    )  # fmt: skip
    attrs = result.trace.attrs
    click.echo(
        f"Point: {format_quantity(attrs['depth'], 'm')}, {format_quantity(attrs['wob'], 'kN')}, "
        f"{format_quantity(attrs['rotary_speed'], 'rad/s')}, {attrs['procedure']}.",
        err=True,
    )
    code = finish(result, output)
    if result.same_bits:
        click.echo("The final state has the bits that are stored.", err=True)
    else:
        click.echo(
            "Warning: the final state differs from the stored one. The file was made on another kind of machine or by "
            "another version; where the motion is chaotic the trajectory is then another one of the same kind.",
            err=True,
        )
    return code
