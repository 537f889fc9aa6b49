"""nsdrill plot."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

import click

from nsdrill.cli.building import Given, command_of, load, say
from nsdrill.cli.simulate import requested_values
from nsdrill.errors import Refusal
from nsdrill.late import deferred
from nsdrill.operations import files, pictures
from nsdrill.operations.argument import arguments_of
from nsdrill.operations.arguments import (
    OUTPUT,
    SPEED_OF_FILM,
    Begin,
    End,
    NameOfFile,
    NoTitle,
    Overlay,
    Overwrite,
    Switch,
)

with deferred():
    from nsdrill import data as forms
    from nsdrill import store
    from nsdrill.app import datasets, measured
    from nsdrill.study import study as studies
    from nsdrill.text import pictures as text
    from nsdrill.text import words

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset


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
        "What is drawn over it": ("over", "field"),
        "A trace": ("begin", "end", "animate", "speed"),
        "A study": ("along", "set"),
        "How it looks": ("xlim", "ylim", "width", "height", "font_size", "title", "no_title", "style"),
    },
)
def command(
    given: Given,
    file: NameOfFile,
    output: Annotated[str | None, OUTPUT, "Picture to write: .png, .pdf or .svg."] = None,
    list: Annotated[Switch, "Print the kinds that fit FILE, and stop."] = False,
    field: Overlay = None,
    no_title: NoTitle = False,
    begin: Begin = None,
    end: End = None,
    animate: Annotated[Switch, "With a trace: a film of the collar in the hole, .mp4 (ffmpeg) or .gif."] = False,
    speed: Annotated[float | None, SPEED_OF_FILM] = None,
    overwrite: Overwrite = False,
) -> int:
    """Draw FILE: a results file, the .part file of a run that goes on, a trace, or
    branches; or a chart of a study (.yaml), which is not run."""
    from nsdrill.plot.registry import is_study

    if no_title and "title" in given:
        raise Refusal("title", "with --no-title", "one of them")
    chosen: Given = {"title": False if no_title else None, "speed": speed}
    chosen["time"] = (begin, end) if begin or end else None
    given |= {name: value for name, value in chosen.items() if value is not None}
    if speed is not None and not animate:
        raise Refusal("speed", "without --animate", "with it")
    of_study = is_study(file)
    operation = pictures.chart if of_study else pictures.animate if animate else pictures.plot
    refuse_others(given | {"animate": animate if of_study else False, "data": field}, operation, file)
    if list or given.get("kind") == "list":
        click.echo("\n".join(text.kinds(None if of_study else _cut(file, given))))
        return 0
    if output is None:
        raise click.MissingParameter(param_type="option", param_hint="'-o' / '--output'")
    if animate:
        return _film(file, output, given, overwrite)
    files.claim_picture(output, overwrite)
    if of_study:
        given["study"] = load(file, given.pop("set", ()))
        figure = pictures.chart(**given)
    else:
        figure = pictures.plot(file, **given)
        if nearest := text.nearest(_cut(file, {}), requested_values(given)):
            say(f"At {nearest}, the nearest of the sweep.")
    if field is not None:
        say(_overlaid(figure, field, file, given))
    files.save(figure, output, overwrite=overwrite)
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


def _cut(file: str, given: Given) -> Dataset | forms.Results | forms.Trace:
    """What is in the file, without its numbers, at the chosen values."""
    from nsdrill.plot import cut

    data = store.open_branches(file) if datasets.is_branches(file) else datasets.outline(file)
    return cut(data, requested_values(given), given.get("start"))


def _film(file: str, output: str, given: Given, overwrite: bool) -> int:
    """Write a film; without ffmpeg a GIF in place of an MP4."""
    given.pop("kind", None)
    found = pictures.animate(file, output, overwrite=overwrite, **given)
    if found.name != output:
        say(f"There is no ffmpeg here, which MP4 needs: a GIF is written in place of {output}.")
    say(f"{found.name}: {found.seconds:.3g} s of the trace in {found.frames} frames.")
    return 0


def _overlaid(figure: Figure, field: str, file: str, given: Given) -> str:
    """Draw the measurements in the file ``field`` over the figure; how many there are,
    in words."""
    from nsdrill.plot.measured import overlay

    data = _cut(file, given)
    if not isinstance(data, forms.Results) or "study_resolved" not in data.attrs:
        found = "a trace" if isinstance(data, forms.Trace) else "branches"
        raise Refusal("data", f"with {found}", "with the results of a sweep")
    study = studies.study_from_resolved(json.loads(data.attrs["study_resolved"]))
    table = measured.read_measured(field, study, measured.Reading(ignore=("*",), gaps=True))
    drawn = overlay(figure, data, table, given["units"])
    beyond = ""
    if rest := table.points - drawn:
        beyond = (
            f" of {table.points}; the other {rest} lie beyond the axes of the picture, at other "
            f"settings, or have no value that it shows"
        )
    return f"{field}: {words.count(drawn, 'measurement')}{beyond} drawn."
