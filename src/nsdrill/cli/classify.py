"""nsdrill classify."""

from __future__ import annotations

from typing import Annotated

from nsdrill.cli.building import Given, command_of, say
from nsdrill.late import deferred
from nsdrill.operations import runs
from nsdrill.operations.arguments import HDF5Path

with deferred():
    from nsdrill.text import words


@command_of(
    runs.classify,
    examples=(
        "classify out.h5 --set classify.whirl.wall_contact_fraction=0.05 -o relabelled.h5",
        "classify out.h5 --set classify.whirl.wall_contact_fraction=0.05",
        "classify out.h5",
    ),
)
def command(given: Given, path: Annotated[HDF5Path, "Results file to write. Default: RESULTS itself."] = None) -> int:
    """Give RESULTS new labels with other thresholds, in place or as a new file. Nothing
    is run again.

    Without --set the thresholds of the study are restored. All keys of `classify` may
    change but stuck_below, which enters the run itself. The attribute `history` of the
    file records the change.
    """
    for name, (changed, total) in runs.classify(**given).changes.items():
        say(f"{name}: {changed} of {words.count(total, 'point')} changed.")
    if path is not None:
        say(f"{path}: written.")
    return 0
