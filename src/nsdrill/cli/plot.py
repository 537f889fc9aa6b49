"""nsdrill plot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from nsdrill.cli import options
from nsdrill.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from nsdrill.data import Results, Trace


@click.command(
    "plot",
    epilog=options.examples(
        "plot out.h5 -o out.png",
        "plot out.h5 --kind list",
        "plot map.h5 --wob 20kN -o cut.pdf --units field",
        "plot trace.h5 --kind orbit -o orbit.svg",
        "plot trace.h5 --kind ramp --over out.h5 -o ramp.png",
        "plot out.h5 --kind surface_torque_max --data field.csv -o measured.png",
        "plot ensemble.h5 --kind basin --rotary-speed 3rad/s --states z,vz -o basin.png",
        "plot study.yaml --kind critical-speeds -o speeds.png",
        "plot study.yaml --kind drive-tuning --set drive.kind=soft_torque -o tuning.png",
    ),
)
@options.file_argument("file")
@options.output("Picture to write: .png, .pdf or .svg.", required=False)
@click.option("--kind", metavar="KIND", help="What to draw; `--kind list` says what fits FILE. Default: its first.")
@options.units
@options.quantity("--depth", "m", "Cut a sweep of several axes at this depth.")
@options.quantity("--wob", "N", "Cut at this weight on bit.")
@options.quantity("--rotary-speed", "rad/s", "Cut at this top-drive speed.")
@options.at
@options.start
@click.option("--states", metavar="A,B", help="The two states of a basin drawn from an ensemble: z,vz say.")
@options.confidence
@click.option(
    "--over", type=options.FileName(), metavar="OUT.h5",
    help="With the trace of a ramp and --kind ramp: draw it over the peaks of this sweep.",
)  # fmt: skip
@click.option(
    "--data", "field", type=options.FileName(), metavar="FIELD.csv",
    help="Measurements to draw over a picture along one axis, or over a map: see nsdrill fit.",
)  # fmt: skip
@click.option(
    "--along", metavar="KEY",
    help="With a study and --kind critical-speeds or buckling: the axis, one that the study sweeps.",
)  # fmt: skip
@click.option(
    "--set", "overrides", multiple=True, metavar="KEY=VALUE",
    help="With a study: change a key of it, e.g. --set 'operation.wob=30 kN'. May be given more than once.",
)  # fmt: skip
@options.overwrite
def command(
    file: str, output: str | None, kind: str | None, units: str, depth: float | None, wob: float | None,
    rotary_speed: float | None, at: tuple[str, ...], start: int | None, states: str | None,
    confidence: float | None, over: str | None, field: str | None,
    along: str | None, overrides: tuple[str, ...], overwrite: bool,
) -> int:  # fmt: skip
    """Draw FILE: a results file, the .part file of a run that goes on, or a trace; or a chart of a study (.yaml), which
    is not run."""
    from nsdrill.cli.reading import outline, read
    from nsdrill.data import Trace
    from nsdrill.plot import all_kinds, check_suffix, cut, draw, kinds_for, needed, save
    from nsdrill.plot.registry import is_study

    if is_study(file):
        unused = {"--at": at, "--depth": depth, "--wob": wob, "--rotary-speed": rotary_speed, "--start": start,
                  "--states": states, "--over": over, "--confidence": confidence,
                  "--data": field}  # fmt: skip
        return _chart(file, output, kind, units, along, overrides, unused, overwrite)
    for option, found in (("--along", along), ("--set", overrides)):
        if found:
            raise InputError(f"{option}: found with {file}; allowed: with a study, a file that ends in .yaml or .yml.")
    chosen = options.values(at, depth=depth, wob=wob, rotary_speed=rotary_speed)
    if kind == "list":
        data = outline(file)
        for name in kinds_for(data if isinstance(data, Trace) else cut(data, chosen, start)):
            click.echo(f"{name:<24} {all_kinds()[name].words}")
        return 0
    if output is None:
        raise click.MissingParameter(param_type="option", param_hint="'-o' / '--output'")
    from nsdrill.store import claim_file

    check_suffix(output)
    options.keep_apart(file, output)
    claim_file(output, overwrite)
    data = outline(file)
    if chosen and isinstance(data, Trace):
        option = "--at" if at else "--" + next(iter(chosen)).replace("_", "-")
        raise InputError(f"{option}: found with a trace, which is of one point; allowed: with a results file.")
    if isinstance(data, Trace):
        for option, value in (("--start", start), ("--states", states), ("--confidence", confidence)):
            if value is not None:
                of = "samples" if option == "--confidence" else "several starts"
                raise InputError(f"{option}: found with a trace; allowed: with the results of {of}.")
    else:
        data = read(file, needed(data, kind, chosen, start))
    behind = None if over is None else _sweep(over, output, data)
    pair = None if states is None else [name.strip() for name in states.split(",")]
    if chosen and not isinstance(data, Trace):
        _say_nearest(data, chosen)
    part = None if confidence is None else confidence / 100.0
    more = {"over": behind, "states": pair, "confidence": part}
    figure = draw(data, kind, units=units, at=chosen or None, start=start, **more)
    if field is not None:
        _overlay(figure, field, data, chosen, start, units)
    save(figure, output, overwrite=overwrite)
    click.echo(f"{output}: drawn.", err=True)
    return 0


def _overlay(
    figure: Figure, field: str, data: Results | Trace, chosen: dict[str, float], start: int | None, units: str
) -> None:
    """Put the measurements in the file ``field`` over the figure."""
    import json

    from nsdrill.app.measured import Reading, read_measured
    from nsdrill.cli.words import count
    from nsdrill.data import Trace
    from nsdrill.plot import cut
    from nsdrill.plot.overlay import overlay
    from nsdrill.study.resolved import study_from_resolved

    if isinstance(data, Trace) or "study_resolved" not in data.attrs:
        raise InputError("--data: found with a trace; allowed: with the results of a sweep.")
    study = study_from_resolved(json.loads(data.attrs["study_resolved"]))
    measured = read_measured(field, study, Reading(ignore=("*",), gaps=True))
    drawn = overlay(figure, cut(data, chosen or None, start), measured, units)
    click.echo(f"{field}: {count(drawn, 'measurement')} drawn.", err=True)


def _chart(
    file: str, output: str | None, kind: str | None, units: str, along: str | None, overrides: tuple[str, ...],
    unused: Mapping[str, Any], overwrite: bool,
) -> int:  # fmt: skip
    """A chart of the study in ``file``."""
    from nsdrill.cli.reading import load
    from nsdrill.plot import check_suffix, save
    from nsdrill.plot.registry import STUDY, kinds_of

    if kind == "list":
        for name, one in kinds_of(STUDY).items():
            click.echo(f"{name:<24} {one.words}")
        return 0
    if output is None:
        raise click.MissingParameter(param_type="option", param_hint="'-o' / '--output'")
    for option, found in unused.items():
        if found not in (None, ()):
            raise InputError(f"{option}: found with a study; allowed: with results. --set changes keys of the study.")
    from nsdrill.app.charts import draw_chart
    from nsdrill.store import claim_file

    check_suffix(output)
    options.keep_apart(file, output)
    claim_file(output, overwrite)
    save(draw_chart(load(file, overrides), kind, along, units=units), output, overwrite=overwrite)
    click.echo(f"{output}: drawn.", err=True)
    return 0


def _say_nearest(data: Results, chosen: dict[str, float]) -> None:
    """Where a value was asked for that is not one of the sweep, which one is drawn."""
    import numpy as np

    from nsdrill.cli.words import as_asked, point_text
    from nsdrill.variables import dimension_of

    drawn = {}
    for key, value in chosen.items():
        name = dimension_of(key)
        values = np.asarray(data.coords.get(name, [value]), dtype=float)
        nearest = float(values[np.argmin(np.abs(values - value))])
        if abs(nearest - value) > 1e-3 * abs(value):
            drawn[name] = as_asked(key, nearest, chosen)
    if drawn:
        click.echo(f"At {point_text(drawn)}, the nearest of the sweep.", err=True)


def _sweep(file: str, output: str, trace: Results | Trace) -> Results:
    """The peaks of the sweep to draw a ramp over."""
    from nsdrill.cli.reading import read
    from nsdrill.data import Trace
    from nsdrill.models.registry import drawn_in

    options.keep_apart(file, output)
    peaks = drawn_in(trace.attrs).peaks
    data = read(file, ("status", *peaks))
    if isinstance(data, Trace):
        raise InputError(f"{file}: this is a trace; --over takes the results of a sweep.")
    if missing := [name for name in peaks if name not in data.variables]:
        raise InputError(f"{file}: found no {', '.join(missing)}; allowed: a sweep with record.peaks above 0.")
    return data
