"""nsdrill show."""

from __future__ import annotations

from typing import Annotated

import click

from nsdrill.cli.building import Given, command_of, print_json
from nsdrill.errors import InputError
from nsdrill.late import deferred
from nsdrill.operations import answers
from nsdrill.operations.arguments import AnyData, Json, Switch

with deferred():
    from nsdrill import store
    from nsdrill.app import datasets, experiment


@command_of(
    answers.show,
    examples=(
        "show out.h5",
        "show out.h5.part",
        "show out.h5 --json | jq .failed",
        "show out.h5 --units field",
        "show out.h5 --study > study.yaml",
    ),
)
def command(
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
        attrs = store.read_attributes(data) if datasets.is_branches(data) else datasets.read_any(data, ()).attrs
        click.echo(experiment.study_of(data, attrs), nl=False)
        return 0
    found = answers.show(**given)
    if json:
        print_json(found.summary, found.units)
    else:
        click.echo(found.text())
    return 0
