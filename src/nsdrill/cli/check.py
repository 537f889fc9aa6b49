"""nsdrill check."""

from __future__ import annotations

import textwrap
from typing import Annotated

import click

from nsdrill.cli.building import Given, command_of, print_json, say
from nsdrill.errors import printable
from nsdrill.late import deferred
from nsdrill.operations import answers
from nsdrill.operations.arguments import Everything, Json, StudyLike

with deferred():
    from nsdrill.text import check as text

WIDTH = 100  # characters of a line of a warning


@command_of(
    answers.check,
    examples=(
        "check study.yaml",
        "check study.yaml --set 'operation.depth=2000 m' --json | jq .coefficients.k_t.value",
        "check study.yaml --units field",
        "check study.yaml --all",
        "new | nsdrill check -",
    ),
    notes=False,
)
def command(
    given: Given,
    study: StudyLike,
    json: Annotated[Json, "Print JSON, with all quantities and warnings."] = False,
    everything: Annotated[
        Everything, "Print further quantities: buckling, higher lateral modes, standing waves, damping by the mud."
    ] = False,
) -> int:
    """Validate STUDY and print its derived coefficients, what follows from them, and
    warnings. Runs nothing.

    The coefficients are those at the point `operation` of the study, at the start of
    its ramps; warnings are about its whole sweep and its ramps. The JSON has the
    further quantities in any case.
    """
    report, units = answers.check(**given), given["units"]
    if json:
        print_json(report.as_json(), units)
        return 0
    source = "standard input" if study == "-" else printable(str(study))
    for line in text.lines(given["study"], report, source, units, everything):
        click.echo(line)
    for warning in report.warnings:
        say(textwrap.fill(f"Warning: {warning}", WIDTH, break_on_hyphens=False))
    return 0
