"""nsdrill window."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import click

from nsdrill.cli.building import Given, command_of, print_json, say
from nsdrill.errors import printable
from nsdrill.late import deferred
from nsdrill.operations import answers, files
from nsdrill.operations.arguments import Json, Other, Overwrite, Picture, ResultsLike, Units

with deferred():
    from nsdrill.app import contrast
    from nsdrill.app import window as windows
    from nsdrill.text import window as text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from nsdrill.data import Answer, Results


@command_of(
    answers.window,
    examples=(
        "window map.h5",
        "window map.h5 --units field --picture window.png",
        "window ideal.h5 soft_torque.h5 --units field",
        "window map.h5 --severity 1",
        "window uncertain.h5 --confidence 95",
        "window map.h5 --json | jq .maps[0].recommended",
    ),
)
def command(
    given: Given,
    results: ResultsLike,
    other: Other = None,
    units: Units = None,
    json: Annotated[Json, "Print JSON, with every map and region."] = False,
    picture: Annotated[Picture, "Picture to write as well: .png, .pdf or .svg."] = None,
    overwrite: Overwrite = False,
) -> int:
    """Find the operating window: where every run is safe, whatever its history.

    RESULTS is a map over weight on bit, speed or depth, or a sweep along one of them.
    The answer has the points that are safe in every procedure, their largest region,
    the point with the largest margin, how far each number may change from there and
    what stops it, and how the window changes with depth. With uncertain numbers a point
    is safe if a run is safe with a stated probability.

    With OTHER, results over the same axes, it compares the two windows: points gained
    and lost, how far every border moved, where the responses begin, and the rate of
    penetration.
    """
    assert units is not None
    if picture is not None:
        files.claim_picture(picture, overwrite)
    chosen = {"severity": given.get("severity"), "confidence": given.get("confidence")}
    names = [results] if other is None else [results, other]
    data = [answers.results_for_window(name, **chosen) for name in names]
    found: Answer
    if other is None:
        found = windows.window_of(data[0], **chosen)
        title = printable(f"{results}: operating window. {found['title']}".rstrip())
        lines = [title, *text.lines(found, units)]
    else:
        found = contrast.contrast(results, other, **chosen)
        titles = [f"{file}: {one['title']}" for file, one in zip(names, found["windows"], strict=True)]
        lines = [printable(line) for line in text.contrast_lines(found, units, titles)]
    if json:
        print_json(found, units)
    else:
        click.echo("\n".join(lines))
    if picture is not None:
        files.save(_drawn(data, names, units, chosen), picture, overwrite=overwrite)
        say(f"{picture}: drawn.")
    return 0


def _drawn(data: list[Results], names: list[str], units: str, chosen: Given) -> Figure:
    """The picture of one window, or of two side by side."""
    from nsdrill.plot import draw
    from nsdrill.plot.kinds.window import draw_two

    if len(data) == 1:
        return draw(data[0], "window", units=units, **chosen)
    return draw_two(data[0], data[1], (names[0], names[1]), units, chosen["severity"], chosen["confidence"])
