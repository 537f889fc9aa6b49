"""nsdrill run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nsdrill.cli.building import Given, command_of, say
from nsdrill.cli.overview import EXIT_CODES
from nsdrill.late import deferred
from nsdrill.operations import runs
from nsdrill.operations.arguments import ResultsPath, StudyLike, Units

with deferred():
    from nsdrill.text import runs as text

if TYPE_CHECKING:
    from nsdrill.app.run import RunResult


@command_of(
    runs.run,
    before=EXIT_CODES,
    examples=(
        "run study.yaml -o out.h5",
        "run study.yaml -o out.h5 --resume",
        "run study.yaml -o out.h5 --retry-failed --set simulation.max_steps=1000000",
        "run study.yaml -o heavy.h5 --set 'operation.wob=30 klbf' --set sweep.procedure=up",
    ),
)
def command(given: Given, study: StudyLike, path: ResultsPath, units: Units = None) -> int:
    """Run STUDY and write the results file.

    The file appears when all points are finished. After an interruption, by Ctrl-C or a
    signal of the batch system, finished points are kept, and --resume gives the same
    file as an uninterrupted run.
    """
    loaded = given["study"]
    if loaded.continuation is not None and not loaded.swept:
        say(f"{study} has no sweep: one point is run. nsdrill branches {study} -o {path} follows its section continue.")
    outcome: RunResult = runs.run(**given)  # type: ignore[assignment]
    if given["progress"]:
        say(text.outcome_text(outcome, units or loaded.units))
    return 3 if outcome.failed else 0
