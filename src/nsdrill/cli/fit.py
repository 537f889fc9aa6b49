"""nsdrill fit."""

from __future__ import annotations

from typing import Annotated

import click

from nsdrill.cli.building import Given, command_of, say
from nsdrill.late import deferred
from nsdrill.operations import runs
from nsdrill.operations.arguments import Json, PictureOfFit, Reported, StudyPath

with deferred():
    from nsdrill import data as forms
    from nsdrill.text import fit as text

Progress = Annotated[Reported, "No progress; the summary, warnings and errors only."]


@command_of(
    runs.fit,
    examples=(
        "fit study.yaml --data field.csv",
        "fit study.yaml --data field.csv -o adjusted.yaml --picture fit.png --units field",
        "fit study.yaml --data rig.csv --rename 'TQA=surface_torque' --ignore '*' --skip-gaps",
        "run adjusted.yaml -o out.h5",
    ),
)
def command(
    given: Given, path: StudyPath = None, picture: PictureOfFit = None, json: Json = False, progress: Progress = True
) -> int:
    """Adjust the unknowns of STUDY, the numbers of its section `uncertain`, to
    measurements.

    Their distributions are the prior. The model is run at the operating points of the
    data for many values of the unknowns, and each is weighed by how well its features
    agree. The summary says which unknowns the data determine and which not; the written
    study has samples that agree with the data.

    With -o, every round is kept in FILE.part until the study is written. After an
    interruption --resume gives the same study as an uninterrupted fit.
    """
    note, units = runs.fit(**given).note, given["units"]
    if json:
        click.echo(forms.json_text(text.summary_in(note, units), indent=2))
    else:
        click.echo("\n".join(text.lines(note, units)))
    if picture is not None:
        say(f"{picture}: drawn.")
    if path is not None:
        say(f"{path}: written. Next: nsdrill run {path} -o out.h5")
    return 0
