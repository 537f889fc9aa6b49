"""nsdrill diff."""

from __future__ import annotations

from typing import Annotated

import click

from nsdrill.cli.building import Given, command_of, print_json
from nsdrill.errors import printable
from nsdrill.late import deferred
from nsdrill.operations import answers
from nsdrill.operations.arguments import Json, Switch, Units

with deferred():
    from nsdrill.text import diff as text


@command_of(
    answers.diff,
    examples=(
        "diff ideal.h5 soft_torque.h5 --units field",
        "diff a.h5 b.h5 --bits",
        "diff a.h5 b.h5 --json | jq .study",
        "diff --exit-code before.h5 after.h5 && echo reproduced",
    ),
)
def command(
    given: Given,
    bits: Annotated[Switch, "Print which numbers differ, to the bit, and the versions and machines."] = False,
    json: Annotated[Json, "Print JSON, with --bits included."] = False,
    units: Units = None,
    exit_code: Annotated[Switch, "Exit with 1 if the studies or any numbers differ."] = False,
) -> int:
    """Compare the files A and B: results, .part files of runs that go
    on, or traces.

    First the keys of the studies, and what changed for the driller: the safe points,
    the borders of the window, the responses; then whether the numbers are the same.
    With --bits also versions and machines, and every variable that differs, to the bit.
    With --exit-code the exit code is 1 where anything differs but titles, times,
    versions and machines; without it 0.
    """
    assert units is not None
    differences = answers.diff(**given)
    differences["run"] = [
        {**row, **{side: text.attribute_text(row["name"], row[side], units) for side in ("a", "b")}}
        for row in differences["run"]
    ]
    if json:
        print_json(differences, units)
    else:
        click.echo("\n".join(map(printable, text.lines(differences, units, bits))))
    return int(exit_code and not (differences["same_study"] and differences["same_numbers"]))
