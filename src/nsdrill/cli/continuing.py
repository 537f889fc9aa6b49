"""nsdrill branches."""

from __future__ import annotations

from nsdrill.cli.building import Given, command_of, say
from nsdrill.cli.overview import EXIT_CODES
from nsdrill.late import deferred
from nsdrill.operations import runs
from nsdrill.operations.arguments import BranchesPath

with deferred():
    from nsdrill.text import runs as text


@command_of(
    runs.continue_branches,
    before=EXIT_CODES,
    examples=(
        "branches study.yaml -o branches.h5",
        "branches study.yaml -o branches.h5 --seeds out.h5",
        "branches study.yaml -o branches.h5 --resume",
        "plot branches.h5 --over out.h5 -o branches.png",
    ),
)
def command(given: Given, path: BranchesPath) -> int:
    """Follow the motions of STUDY, stable or not, along the number that its section
    continue names, and write their branches with stability and special points.

    The motions are seeded by a results file, or settle first at some values. `nsdrill
    show` says what each special point means, `nsdrill plot` draws the branches, also
    over the peaks of a sweep.
    """
    continuation = runs.continue_branches(**given)
    if given["progress"]:
        say(f"{path}: {text.continuation_text(continuation)}")
    return 0
