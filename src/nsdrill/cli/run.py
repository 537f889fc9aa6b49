"""nsdrill run."""

from __future__ import annotations

import sys
from typing import Any

import click

from nsdrill.cli import options


@click.command("run")
@options.study_argument
@options.output("Results file to write (HDF5).")
@click.option("--workers", type=click.IntRange(min=1), help="Threads, one gang of lanes each. Default: all processors.")
@click.option("--engine", type=click.Choice(["threads", "dask"]), default="threads", show_default=True)
@click.option("--scheduler", metavar="ADDR", help="Address of a running Dask scheduler (with --engine dask).")
@options.settings
@click.option("--resume", is_flag=True, help="Go on with an interrupted run.")
@options.overwrite
@click.option("--quiet", is_flag=True, help="No progress and no summary.")
def command(
    study: str, output: str, workers: int | None, engine: str, scheduler: str | None, overrides: tuple[str, ...],
    resume: bool, overwrite: bool, quiet: bool,
) -> int:  # fmt: skip
    """Run STUDY and write the results file.

    Exit codes: 0 done; 2 the study or command line is wrong; 3 finished, but some points failed (they are marked);
    130 interrupted, go on with --resume.
    """
    from nsdrill.errors import InputError
    from nsdrill.study import load_study

    if engine == "dask" or scheduler:
        raise InputError("--engine dask: not available in this version; allowed: --engine threads.")
    loaded = load_study(study, overrides)

    from nsdrill.app.run import run_study
    from nsdrill.cli.progress import progress_bar

    with progress_bar(enabled=not quiet and sys.stderr.isatty()) as watch:
        outcome = run_study(loaded, output, workers=workers, resume=resume, overwrite=overwrite, watch=watch)
    if not quiet:
        _say(outcome)
    return 3 if outcome.failed else 0


def _say(outcome: Any) -> None:
    ran = outcome.points - outcome.already
    text = f"{outcome.path}: {outcome.points} points"
    if outcome.already:
        text += f" ({outcome.already} were there already)"
    if ran:
        text += f", {outcome.steps:,} steps in {outcome.seconds:.1f} s"
    text += "."
    if outcome.failed:
        text += (
            f" {outcome.failed} points failed and are marked; `nsdrill show {outcome.path}` lists them, and `nsdrill "
            "replay` runs one again."
        )
    click.echo(text, err=True)
