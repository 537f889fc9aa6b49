"""nsdrill plot."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from nsdrill.cli import options
from nsdrill.errors import InputError, printable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from nsdrill.data import Results, Trace
    from nsdrill.plot.look import Look


@click.command(
    "plot",
    epilog=options.examples(
        "plot out.h5 -o out.png",
        "plot out.h5 --list",
        "plot out.h5 --panel bit_speed --ylim 0rpm 200rpm -o speed.png",
        "plot map.h5 --wob 20kN -o cut.pdf --units field",
        "plot out.h5 -o column.pdf --width 3.3in --font-size 7 --no-title",
        "plot trace.h5 --animate --from 40s --to 50s -o whirl.gif",
        "plot trace.h5 --panel orbit --from 20s --to 30s -o orbit.pdf",
        "plot trace.h5 --kind ramp --over out.h5 -o ramp.png",
        "plot out.h5 --kind surface_torque_max --data field.csv -o measured.png",
        "plot ensemble.h5 --kind basin --rotary-speed 3rad/s --states z,vz -o basin.png",
        "plot study.yaml --kind critical-speeds -o speeds.png",
        "plot study.yaml --kind drive-tuning --set drive.kind=soft_torque -o tuning.png",
    ),
)
@options.file_argument("file")
@options.output("Picture to write: .png, .pdf or .svg.", required=False)
@click.option(
    "--kind",
    type=options.Word(options.kinds),
    metavar="KIND",
    help="What to draw; --list prints the kinds that fit FILE. Default: the first of them.",
)
@click.option("--panel", metavar="NAME", help="Draw one panel alone, by its name or a part of it: --panel radius.")
@click.option("--list", "listing", is_flag=True, help="Print the kinds that fit FILE, and stop.")
@options.units
@options.quantity("--depth", "m", "Cut a sweep of several axes at this depth.")
@options.quantity("--wob", "N", "Cut at this weight on bit.")
@options.quantity("--rotary-speed", "rad/s", "Cut at this rotary speed.")
@options.at
@options.start
@click.option("--states", metavar="A,B", help="Two states over which to draw the basin of an ensemble, such as z,vz.")
@options.confidence
@click.option(
    "--over",
    type=options.FileName(),
    metavar="FILE.h5",
    help="With branches, or with a ramp and --kind ramp: sweep whose peaks are drawn below. With a "
    "map over two axes: file of branches whose curves are drawn over it.",
)
@click.option(
    "--data",
    "field",
    type=options.FileName(),
    metavar="FIELD.csv",
    help="CSV of measurements to draw over a picture along one axis or over a map; nsdrill fit reads the same.",
)
@click.option(
    "--along", metavar="KEY", help="With a study and --kind critical-speeds or buckling: a swept axis to draw along."
)
@click.option(
    "--set",
    "overrides",
    multiple=True,
    type=options.Word(options.changes),
    metavar="KEY=VALUE",
    help="With a study: change a key of it, e.g. --set 'operation.wob=30 kN'. May be given more than once.",
)
@click.option("--width", metavar="Q", help="Width of the picture; 3.3in is a column of a journal. Default: 7in.")
@click.option("--height", metavar="Q", help="Height of the picture. Default: depends on the kind.")
@click.option("--font-size", metavar="POINTS", help="Size of the type. Default: 8.")
@click.option("--title", metavar="TEXT", help="Title. Default: that of the study, and the operating point.")
@click.option("--no-title", is_flag=True, help="No title, and no headings of panels: for a picture with a caption.")
@click.option("--style", metavar="FILE", help="Style file of matplotlib (.mplstyle), or the name of one of its styles.")
@click.option("--xlim", nargs=2, metavar="Q Q", help="Ends of the x axis: --xlim 3rad/s 6rad/s.")
@click.option("--ylim", nargs=2, metavar="Q Q", help="Ends of the y axis: --ylim 0mm 80mm.")
@click.option("--from", "begin", metavar="Q", help="With a trace: first time to draw.")
@click.option("--to", "end", metavar="Q", help="With a trace: last time to draw.")
@click.option("--animate", is_flag=True, help="With a trace: a film of the collar in the hole, .mp4 (ffmpeg) or .gif.")
@click.option(
    "--speed",
    type=float,
    metavar="FACTOR",
    help="With --animate: speed of the film, 1 for real time (default), 0.5 for half as fast.",
)
@options.overwrite
def command(
    file: str,
    output: str | None,
    kind: str | None,
    panel: str | None,
    listing: bool,
    units: str | None,
    depth: float | None,
    wob: float | None,
    rotary_speed: float | None,
    at: tuple[str, ...],
    start: int | None,
    states: str | None,
    confidence: float | None,
    over: str | None,
    field: str | None,
    along: str | None,
    overrides: tuple[str, ...],
    width: str | None,
    height: str | None,
    font_size: str | None,
    title: str | None,
    no_title: bool,
    style: str | None,
    xlim: tuple[str, str] | None,
    ylim: tuple[str, str] | None,
    begin: str | None,
    end: str | None,
    animate: bool,
    speed: float | None,
    overwrite: bool,
) -> int:
    """Draw FILE: a results file, the .part file of a run that goes on, a trace, or
    branches; or a chart of a study (.yaml), which is not run."""
    from nsdrill.app.reading import is_branches
    from nsdrill.cli.reading import outline, read
    from nsdrill.data import Trace
    from nsdrill.plot import cut, draw, look_of, needed, save
    from nsdrill.plot.registry import is_study
    from nsdrill.store import open_branches

    if no_title and title is not None:
        raise InputError("--title: found with --no-title; allowed: one of them.")
    time = None if begin is end is None else (begin, end)
    look = look_of(width, height, font_size, False if no_title else title, style, xlim, time, ylim)
    if speed is not None and not animate:
        raise InputError("--speed: found without --animate; allowed: with it.")
    if animate and kind not in (None, "hole"):
        raise InputError(f"--animate: found with --kind {kind}; allowed: without a kind.")
    listing = listing or kind == "list"
    point = options.point_values(at, depth=depth, wob=wob, rotary_speed=rotary_speed)
    if is_study(file):
        _refuse(
            {
                "--animate": animate or None,
                "--panel": panel,
                "--at": at,
                **{f"--{name.replace('_', '-')}": value for name, value in point.items()},
                "--start": start,
                "--states": states,
                "--over": over,
                "--confidence": confidence,
                "--data": field,
                "--xlim": xlim,
                "--ylim": ylim,
                "--from": begin,
                "--to": end,
            }
        )
        return _draw_chart(file, output, kind, units, along, overrides, listing, overwrite, look)
    assert units is not None
    for option, study_value in (("--along", along), ("--set", overrides)):
        if study_value:
            raise InputError(f"{option}: found with {file}; allowed: with a study, a file that ends in .yaml or .yml.")
    if not listing:
        output = _require_output(output)
        if animate:
            options.check_not_input(file, output)
        else:
            options.claim_picture(file, output, overwrite)
    data: Any = open_branches(file) if is_branches(file) else outline(file)
    if output is None or listing:
        _list_kinds(cut(data, point, start))
        return 0
    if animate:
        return _draw_animation(data, output, units, look, speed, overwrite)
    background: Any = None
    if over is not None:
        options.check_not_input(over, output)
        if isinstance(data, Trace):
            background = _read_sweep(over, data)
        else:
            background = open_branches(over) if is_branches(over) else read(over)
            if isinstance(background, Trace):
                raise InputError(f"{over}: this is a trace; --over takes the results of a sweep.")
    if not (isinstance(data, Trace) or is_branches(file)):
        data = read(file, needed(data, kind, point, start, panel))
        if kind == "window":
            from nsdrill.app.window import with_passed_over

            data = with_passed_over(data)
        if point:
            _print_nearest(data, point)
    figure = draw(
        data,
        kind,
        units=units,
        at=point or None,
        start=start,
        look=look,
        panel=panel,
        over=background,
        states=None if states is None else [name.strip() for name in states.split(",")],
        confidence=None if confidence is None else confidence / 100.0,
    )
    if field is not None:
        _overlay(figure, field, data, point, start, units)
    save(figure, output, overwrite=overwrite)
    _warn_missing_characters(figure)
    click.echo(f"{output}: drawn.", err=True)
    return 0


def _list_kinds(data: Any) -> None:
    """Print the kinds in which ``data`` can be drawn, and the panels of theirs that are
    drawn by name."""
    import textwrap

    from nsdrill.plot import all_kinds, kinds_for

    names = kinds_for(data)
    for name in names:
        click.echo(f"{name:<24} {all_kinds()[name].words}")
    for name in names:
        panels = [part.name for part in all_kinds().values() if part.part_of == name and part.place(data) is not None]
        if panels:
            text = f"{name} --panel: {', '.join(panels)}"
            click.echo(textwrap.fill(text, 100, subsequent_indent="  "))


def _require_output(output: str | None) -> str:
    """The name of the picture; click.MissingParameter without one."""
    if output is None:
        raise click.MissingParameter(param_type="option", param_hint="'-o' / '--output'")
    return output


def _refuse(unused: Mapping[str, Any]) -> None:
    """InputError for an option with a value, for which a chart has no use."""
    for option, value in unused.items():
        if value not in (None, ()):
            raise InputError(f"{option}: found with a study; allowed: with results. --set changes keys of the study")


def _draw_animation(
    trace: Results | Trace, output: str, units: str, look: Look, speed: float | None, overwrite: bool
) -> int:
    """Draw the animation of a trace; without ffmpeg a GIF in place of an MP4, with the
    file name of a GIF."""
    from nsdrill.plot.animation import animate, film_name
    from nsdrill.store import claim_file

    name = film_name(output)
    if name != output:
        click.echo(f"There is no ffmpeg here, which MP4 needs: a GIF is written in place of {output}.", err=True)
    claim_file(name, overwrite)
    frames, seconds = animate(
        trace,  # type: ignore[arg-type]
        name,
        units=units,
        look=look,
        speed=speed or 1.0,
        overwrite=overwrite,
    )
    click.echo(f"{name}: {seconds:.3g} s of the trace in {frames} frames.", err=True)
    return 0


def _overlay(
    figure: Figure, field: str, data: Results | Trace, point: dict[str, float], start: int | None, units: str
) -> None:
    """Draw the measurements in the file ``field`` over the figure."""
    import json

    from nsdrill.app.measured import Reading, read_measured
    from nsdrill.cli.words import count
    from nsdrill.data import Results, Trace
    from nsdrill.plot import cut
    from nsdrill.plot.measured import overlay
    from nsdrill.study.study import study_from_resolved

    if not isinstance(data, Results) or "study_resolved" not in data.attrs:
        found = "a trace" if isinstance(data, Trace) else "branches"
        raise InputError(f"--data: found with {found}; allowed: with the results of a sweep.")
    study = study_from_resolved(json.loads(data.attrs["study_resolved"]))
    measured = read_measured(field, study, Reading(ignore=("*",), gaps=True))
    drawn = overlay(figure, cut(data, point or None, start), measured, units)
    rest = measured.points - drawn
    beyond = (
        f" of {measured.points}; the other {rest} lie beyond the axes of the picture, at other "
        f"settings, or have no "
        "value that it shows"
    )
    click.echo(f"{field}: {count(drawn, 'measurement')}{beyond if rest > 0 else ''} drawn.", err=True)


def _draw_chart(
    file: str,
    output: str | None,
    kind: str | None,
    units: str | None,
    along: str | None,
    overrides: tuple[str, ...],
    listing: bool,
    overwrite: bool,
    look: Look,
) -> int:
    """Draw a chart of the study in ``file``."""
    from nsdrill.cli.reading import load
    from nsdrill.plot import save
    from nsdrill.plot.registry import STUDY, kinds_of

    if listing:
        for name, chart in kinds_of(STUDY).items():
            click.echo(f"{name:<24} {chart.words}")
        return 0
    output = _require_output(output)
    options.claim_picture(file, output, overwrite)
    from nsdrill.app.charts import draw_chart

    study = load(file, overrides)
    save(draw_chart(study, kind, along, units=units or study.units, look=look), output, overwrite=overwrite)
    click.echo(f"{output}: drawn.", err=True)
    return 0


def _warn_missing_characters(figure: Any) -> None:
    """Warn of characters of the title that no font has, which are drawn as boxes."""
    if missing := getattr(figure, "missing", ""):
        click.echo(
            f"The title has characters that no font here has: {printable(missing[:20])}. Install "
            f"one that has them, "
            "Noto Sans CJK say, or give a --title.",
            err=True,
        )


def _print_nearest(data: Results, point: dict[str, float]) -> None:
    """Print the values of the sweep that are drawn in place of requested ones."""
    import numpy as np

    from nsdrill.cli.words import in_unit_of, point_text
    from nsdrill.variables import dimension_of

    drawn = {}
    for key, value in point.items():
        name = dimension_of(key)
        values = np.asarray(data.coords.get(name, [value]), dtype=float)
        nearest = float(values[np.argmin(np.abs(values - value))])
        if abs(nearest - value) > 1e-3 * abs(value):
            drawn[name] = in_unit_of(key, nearest, point)
    if drawn:
        click.echo(f"At {point_text(drawn)}, the nearest of the sweep.", err=True)


def _read_sweep(file: str, trace: Trace) -> Results:
    """The sweep in ``file`` with the peaks over which the ramp ``trace`` is drawn."""
    from nsdrill.cli.reading import read
    from nsdrill.data import Trace
    from nsdrill.models.registry import drawn_in

    peaks = drawn_in(trace.attrs).peaks
    data = read(file, ("status", *peaks))
    if isinstance(data, Trace):
        raise InputError(f"{file}: this is a trace; --over takes the results of a sweep.")
    if missing := [name for name in peaks if name not in data.variables]:
        raise InputError(f"{file}: found no {', '.join(missing)}; allowed: a sweep with record.peaks above 0.")
    return data
