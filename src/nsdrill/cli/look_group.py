"""The commands of the group Look: files are summarised, drawn and explored."""

from __future__ import annotations

import os
import webbrowser
from collections.abc import Callable
from contextlib import ExitStack
from typing import TYPE_CHECKING, Annotated

import click

from nsdrill import interrupt
from nsdrill.cli.building import Given, command_of, load, print_answer, requested_values, say
from nsdrill.errors import InputError, Refusal, count
from nsdrill.late import deferred
from nsdrill.operations import pictures, questions
from nsdrill.operations.argument import Argument, Whole, arguments_of
from nsdrill.operations.arguments import (
    OUTPUT,
    AnyData,
    Begin,
    ColumnsOf,
    End,
    Json,
    NameOfFile,
    NoTitle,
    Only,
    Overlay,
    Overwrite,
    Rename,
    Settle,
    Shortest,
    Switch,
    TimesOf,
    UnitOf,
    refuse_without,
)
from nsdrill.operations.fit import Errors, SurfaceTorque
from nsdrill.operations.pictures import SPEED_OF_FILM

with deferred():
    from nsdrill import data as forms
    from nsdrill import files
    from nsdrill.app import conversion, datasets, experiment, picture_making
    from nsdrill.app.fitting import measured
    from nsdrill.text import run_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from nsdrill.app.picture_making import Drawable


@command_of(
    questions.show,
    examples=(
        "show out.h5",
        "show out.h5.part",
        "show out.h5 --json | jq .failed",
        "show out.h5 --units field",
        "show out.h5 --study > study.yaml",
    ),
)
def show(
    given: Given,
    data: AnyData,
    json: Annotated[Json, "Print JSON, with every failed point."] = False,
    study: Annotated[Switch, "Print the study as it was run, overrides applied, as a study file."] = False,
) -> int:
    """Summarise FILE: a results file, the .part file of unfinished work, a trace, or
    branches, with a sentence on every special point."""
    if study and json:
        raise InputError("--study: found with --json; allowed: one of the two.")
    if study:
        click.echo(experiment.study_of(data, datasets.attributes_for_study(data)), nl=False)
        return 0
    found = questions.show(**given)
    print_answer(found.summary, found.lines(), found.units, json)
    return 0


@command_of(
    pictures.plot,
    pictures.chart,
    pictures.animate,
    less=("data", "study", "trace", "path", "time", "severity", "ax", "speed", "overwrite"),
    examples=(
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
    groups={
        "Which part of a sweep": ("depth", "wob", "rotary_speed", "at", "start", "states", "confidence"),
        "What is drawn over it": (
            "over",
            "field",
            "rename",
            "unit",
            "times",
            "columns",
            "only",
            "errors",
            "surface_torque",
            "shortest",
            "settle",
        ),
        "A trace": ("begin", "end", "animate", "speed"),
        "A study": ("along", "set"),
        "How it looks": ("xlim", "ylim", "width", "height", "font_size", "title", "no_title", "style"),
    },
)
def plot(
    given: Given,
    file: NameOfFile,
    output: Annotated[str | None, OUTPUT, "Picture to write: .png, .pdf or .svg."] = None,
    list: Annotated[Switch, "Print the kinds that fit FILE, and stop."] = False,
    field: Overlay = None,
    rename: Rename = None,
    unit: UnitOf = None,
    times: TimesOf = (),
    columns: ColumnsOf = (),
    only: Only = None,
    errors: Errors = None,
    surface_torque: SurfaceTorque = "string",
    shortest: Shortest = "120 s",
    settle: Settle = "60 s",
    no_title: NoTitle = False,
    begin: Begin = None,
    end: End = None,
    animate: Annotated[Switch, "With a trace: a film of the collar in the hole, .mp4 (ffmpeg) or .gif."] = False,
    speed: Annotated[float | None, SPEED_OF_FILM] = None,
    overwrite: Overwrite = False,
) -> int:
    """Draw FILE: a results file, the .part file of a run that goes on, a trace, or
    branches; or a chart of a study (.yaml), which is not run."""
    shortest, settle = shortest or "120 s", settle or "60 s"
    reads = {"rename": rename, "unit": unit, "times": times, "columns": columns, "errors": errors}
    reads["only"] = only
    refuse_without("data", field, reads)
    if no_title and "title" in given:
        raise Refusal("title", "with --no-title", "one of them")
    chosen: Given = {"title": False if no_title else None, "speed": speed}
    chosen["time"] = (begin, end) if begin or end else None
    given |= {name: value for name, value in chosen.items() if value is not None}
    if speed is not None and not animate:
        raise Refusal("speed", "without --animate", "with it")
    of_study = datasets.is_study(file)
    operation = pictures.chart if of_study else pictures.animate if animate else pictures.plot
    refuse_others(given | {"animate": animate if of_study else False, "data": field}, operation, file)
    taken = arguments_of(operation)
    given = {name: value for name, value in given.items() if value is not False or name in taken}
    if list or given.get("kind") == "list":
        click.echo("\n".join(picture_making.kinds(conversion.study_in(file, None) if of_study else _cut(file, given))))
        return 0
    if output is None:
        raise click.MissingParameter(param_type="option", param_hint="'-o' / '--output'")
    if animate:
        return _film(file, output, given, overwrite)
    picture_making.claim_picture(output, overwrite)
    if of_study:
        given["study"] = load(file, given.pop("set", ()))
        figure = pictures.chart(**given)
    else:
        figure = pictures.plot(file, **given)
        requested = requested_values(given)
        outline = _cut(file, {})
        if isinstance(outline, forms.Results) and (nearest := run_text.nearest_text(outline.coords, requested)):
            say(f"At {nearest}, the nearest of the sweep.")
    if field is not None:
        lasting = conversion.seconds_in("shortest", shortest), conversion.seconds_in("settle", settle)
        reading = measured.Reading(
            dict(rename or {}),
            ("*",),
            dict(errors or {}),
            True,
            *lasting,
            dict(unit or {}),
            tuple(times),
            columns or (),
            surface_torque or "string",
            dict(only or {}),
        )
        say(_overlaid(figure, field, file, given, reading))
    picture_making.save_picture(figure, output, overwrite)
    say(f"{output}: drawn.")
    return 0


def refuse_others(given: Given, operation: Callable[..., object], file: str) -> None:
    """A Refusal of an option that the operation for this file does not take."""
    taken = arguments_of(operation)
    for name, value in given.items():
        if name in taken or value is None or value is False or (name == "data" and operation is pictures.plot):
            continue
        if operation is pictures.chart:
            raise Refusal(name, "with a study", "with results", "--set changes keys of the study.")
        if operation is pictures.animate and name == "kind":
            if value == "hole":
                continue
            raise Refusal("animate", f"with --kind {value}", "without a kind")
        if name in arguments_of(pictures.chart) and operation is pictures.plot:
            raise Refusal(name, f"with {file}", "with a study, a file that ends in .yaml or .yml")
        raise Refusal(name, "with --animate", "without it")


def _cut(file: str, given: Given) -> Drawable:
    """What is in the file, without its numbers, at the chosen values."""
    return picture_making.cut_of(file, requested_values(given), given.get("start"))


def _film(file: str, output: str, given: Given, overwrite: bool) -> int:
    """Write a film; without ffmpeg a GIF in place of an MP4."""
    given.pop("kind", None)
    found = pictures.animate(file, output, overwrite=overwrite, **given)
    if found.name != output:
        say(f"There is no ffmpeg here, which MP4 needs: a GIF is written in place of {output}.")
    say(f"{found.name}: {found.seconds:.3g} s of the trace in {found.frames} frames.")
    return 0


def _overlaid(figure: Figure, field: str, file: str, given: Given, reading: measured.Reading) -> str:
    """Draw the measurements in the file ``field`` over the figure; how many there are,
    in words."""
    drawn, table = picture_making.overlaid(figure, field, _cut(file, given), given["units"], reading)
    points = table.points
    for note in table.notes:
        say(f"{field}: {note}.")
    beyond = ""
    if rest := points - drawn:
        beyond = (
            f" of {points} drawn; the other {rest} lie beyond the axes of the picture, at other settings, or have no "
            "value that it shows"
        )
    return f"{field}: {count(drawn, 'measurement')}{beyond or ' drawn'}."


@command_of(
    pictures.view,
    examples=("view out.h5", "view study.yaml --set 'operation.wob=30 kN'", "view out.h5 --no-browser --port 8123"),
)
def view(
    given: Given,
    port: Annotated[
        int | None, Argument("Port to listen on. Default: any that is free.", metavar="N", kind=Whole())
    ] = None,
    no_browser: Annotated[Switch, "Print the address only; open no browser."] = False,
) -> int:
    """Explore FILE in the browser: results, the .part file of a run that goes on,
    branches, or a study.

    A click on a point runs it again, bit for bit, and shows its motion; sliders run on
    from there. The page is served on this machine only, to those who have its address,
    and ends with its tab or with Ctrl-C; without an open page also with the shell or
    program that started it, but not under nohup, setsid or tmux.
    """
    left_alone = interrupt.orphaned()
    explorer = pictures.explorer(**given, port=port or 0)
    try:
        with interrupt.interruptible(), ExitStack() as stack:
            explorer.start()
            click.echo(explorer.url)
            say("The explorer stops with its page, or with Ctrl-C.")
            if not no_browser and not webbrowser.open(stack.enter_context(explorer.private_page())):
                say("No browser could be opened: open the address above in one.")
            reason = explorer.wait(interrupt.check, left_alone)
    except KeyboardInterrupt:
        reason = "Stopped."
    finally:
        explorer.close()
    say(reason)
    return 0


@command_of(
    questions.report,
    examples=("report out.h5 -o report.html", "report up.h5 down.h5 -o report.html --units field --motions 6"),
)
def report(given: Given) -> int:
    """Write RESULTS, files of sweeps or branches, as one file of HTML that opens
    without a network: the answer on its first printed page, then diagrams, motions,
    numbers, and the command lines that reproduce it. Two sweeps are compared, other
    files stand side by side."""
    path = questions.report(**given)
    say(f"{path}: written, {files.amount(os.path.getsize(path))}.")
    return 0
