"""nsdrill sensitivity."""

from __future__ import annotations

from typing import Annotated

import click

from nsdrill.cli.building import Given, command_of, print_json, say
from nsdrill.cli.simulate import requested_values
from nsdrill.errors import printable
from nsdrill.late import deferred
from nsdrill.operations import answers, files
from nsdrill.operations.arguments import Json, Overwrite, Picture, ResultsLike, Severity, Units

with deferred():
    from nsdrill.analysis import sensitivity as indices
    from nsdrill.text import sensitivity as text


@command_of(
    answers.sensitivity,
    examples=(
        "sensitivity uncertain.h5",
        "sensitivity uncertain.h5 --wob 40kN --rotary-speed 100rpm --picture tornado.png",
        "sensitivity uncertain.h5 --json | jq .measure_first",
    ),
)
def command(
    given: Given,
    results: ResultsLike,
    severity: Severity = None,
    units: Units = None,
    json: Json = False,
    picture: Annotated[Picture, "Tornado picture to write as well: .png, .pdf or .svg."] = None,
    overwrite: Overwrite = False,
) -> int:
    """Rank the uncertain numbers: which matters most, and which to measure first.

    RESULTS is of a study with the section uncertain. For the safe run, stick-slip,
    lift-off and wall contact it prints the share of the variance that each unknown
    causes by itself (first) and together with the others (total), over all operating
    points or at the chosen ones.
    """
    assert units is not None
    if picture is not None:
        files.claim_picture(picture, overwrite)
    data = answers.results_for_sensitivity(results, severity, requested_values(given))
    summary = indices.sensitivity(data, severity)
    if json:
        print_json(summary, units)
    else:
        click.echo(printable(f"{results}: sensitivity. {summary['title']}".rstrip()))
        click.echo("\n".join(text.lines(summary, units)))
    if picture is not None:
        from nsdrill.plot import draw

        files.save(draw(data, "tornado", units=units, severity=severity), picture, overwrite=overwrite)
        say(f"{picture}: drawn.")
    return 0
