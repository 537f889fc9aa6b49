"""nsdrill replay."""

from __future__ import annotations

import json

import click

from nsdrill.cli import options
from nsdrill.cli.simulate import finish


@click.command(
    "replay",
    epilog=options.examples(
        "replay out.h5 --rotary-speed 60rpm --procedure down -o trace.h5",
        "replay map.h5 --rotary-speed 60rpm --wob '15 klbf' -o trace.h5 --sample 1ms",
        "replay ensemble.h5 --rotary-speed 3rad/s --start 17 -o trace.h5",
    ),
)
@options.file_argument("results")
@options.output("Trace file to write (HDF5).", hdf5=True)
@options.point(
    "Depth of the point; the nearest one of the sweep is taken.",
    "Weight on bit of the point.",
    "Rotary speed of the point.",
)
@click.option(
    "--procedure",
    type=click.Choice(["same", "up", "down"]),
    help="Sweep of the point; needed if the file has up and down.",
)
@options.start
@options.quantity("--sample", "s", "Interval between samples. Default: 10 ms.")
@options.units
@options.overwrite
def command(
    results: str,
    output: str,
    depth: str | None,
    wob: str | None,
    rotary_speed: str | None,
    at: tuple[str, ...],
    procedure: str | None,
    start: int | None,
    sample: float | None,
    units: str,
    overwrite: bool,
) -> int:
    """Run one point of RESULTS again, from its stored initial state, and write its
    trajectory.

    It says whether the run ends in the stored final state, bit for bit, and if not,
    what differs from where the file was made. An axis along which the sweep has one
    value only may be left out. Failed points can be run again as well.
    """
    options.check_not_input(results, output)
    from nsdrill.app.trajectory import DEFAULT_SAMPLE, replay
    from nsdrill.cli.words import in_unit_of, point_text
    from nsdrill.models.leaves import as_value
    from nsdrill.progress import telling_compiling
    from nsdrill.store import claim_file
    from nsdrill.variables import SAMPLE

    claim_file(output, overwrite)
    requested = options.point_values(at, depth=depth, wob=wob, rotary_speed=rotary_speed)
    with telling_compiling(lambda text: click.echo(text, err=True)):
        result = replay(
            results, at=requested, procedure=procedure, start=start, sample=DEFAULT_SAMPLE if sample is None else sample
        )
    attrs = result.trace.attrs
    further = {key: as_value(key, word) for key, word in json.loads(attrs.get("at", "{}")).items()}
    point = {name: attrs[name] for name in ("depth", "wob", "rotary_speed")} | further
    is_nearest = any(abs(value - point[name]) > 1e-3 * abs(value) for name, value in requested.items() if name in point)
    which = "" if start is None else f", start {start}"
    which += f", sample {attrs[SAMPLE]}" if SAMPLE in attrs else ""
    shown = {name: in_unit_of(name, float(value), requested) for name, value in point.items()}
    click.echo(
        f"Point: {point_text(shown, units)}, "
        f"{attrs['procedure']}{which}{', the nearest of the sweep' if is_nearest else ''}.",
        err=True,
    )
    code = finish(result, output, overwrite)
    if result.same_bits:
        click.echo("It ends in the stored final state, bit for bit.", err=True)
    else:
        click.echo(f"Warning: it {result.warning}", err=True)
    return code
