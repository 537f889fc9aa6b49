"""nsdrill run."""

from __future__ import annotations

from typing import Any

import click

from nsdrill.cli import options
from nsdrill.cli.overview import EXIT_CODES


@click.command(
    "run",
    epilog=EXIT_CODES
    + "\n\n"
    + options.examples(
        "run study.yaml -o out.h5",
        "run study.yaml -o out.h5 --resume",
        "run study.yaml -o out.h5 --retry-failed --set simulation.max_steps=1000000",
        "run study.yaml -o heavy.h5 --set 'operation.wob=30 klbf' --set sweep.procedure=up",
    ),
)
@options.study_argument
@options.output("Results file to write (HDF5). While the run goes on, its points are in FILE.part.", hdf5=True)
@options.workers
@click.option(
    "--engine",
    type=click.Choice(["threads", "dask"]),
    default="threads",
    show_default=True,
    help="Threads of this process, or workers of a Dask cluster. The numbers are the same.",
)
@click.option(
    "--scheduler",
    metavar="ADDR",
    help="With --engine dask: address of a running scheduler, tcp://host:8786. Default: a cluster on this machine.",
)
@options.settings
@click.option("--resume", is_flag=True, help="Continue an interrupted run: only missing points are run.")
@click.option(
    "--retry-failed",
    is_flag=True,
    help="Like --resume, and run failed points again, in a carried sweep with those that follow "
    "them. "
    "simulation.max_steps may be larger than before.",
)
@options.units
@options.large
@options.overwrite
@options.quiet
def command(
    study: str,
    output: str,
    workers: int | None,
    engine: str,
    scheduler: str | None,
    overrides: tuple[str, ...],
    resume: bool,
    retry_failed: bool,
    units: str | None,
    large: bool,
    overwrite: bool,
    quiet: bool,
) -> int:
    """Run STUDY and write the results file.

    The file appears when all points are finished. After an interruption, by Ctrl-C or a
    signal of the batch system, finished points are kept, and --resume gives the same
    file as an uninterrupted run.
    """
    from nsdrill.cli.reading import load

    loaded = load(study, overrides)
    options.check_not_input(study, output)

    from nsdrill.app.cluster import executor_of
    from nsdrill.app.run import check_sweep, run_study
    from nsdrill.progress import reporting
    from nsdrill.store import check_target

    check_sweep(loaded)
    if loaded.continuation is not None and not loaded.swept:
        click.echo(
            f"{study} has no sweep: one point is run. nsdrill branches {study} -o {output} follows "
            f"its section continue.",
            err=True,
        )
    check_target(output)  # before a cluster is started for nothing
    executing = executor_of(engine, scheduler, workers)
    with executing as (executor, count), reporting(not quiet) as watch:
        outcome = run_study(
            loaded,
            output,
            workers=count,
            resume=resume,
            retry_failed=retry_failed,
            overwrite=overwrite,
            watch=watch,
            executor=executor,
            large=large,
        )
    if not quiet:
        _print_outcome(outcome, units or loaded.units)
    return 3 if outcome.failed else 0


def _print_outcome(outcome: Any, units: str) -> None:
    """Print how many points were run, how many failed, and what to do about them."""
    from nsdrill.cli.words import count

    text = f"{outcome.path}: {count(outcome.points, 'point')}"
    if outcome.refinement:
        from nsdrill.cli.refined import refinement_text

        text = f"{outcome.path}: {refinement_text(outcome.refinement, units)}"
    if outcome.already:
        text += f" ({outcome.already} were there already)"
    if outcome.steps:
        text += f", {outcome.steps:,} steps in {outcome.seconds:.1f} s"
    text += "."
    if outcome.failed:
        failed = f"{count(outcome.failed, 'point')} failed and {'is' if outcome.failed == 1 else 'are'} marked"
        text += f" {failed}; `nsdrill show {outcome.path}` lists them, and `nsdrill replay` runs one again."
    if outcome.advice:
        text += f" Where the limit of steps was reached: {outcome.advice}."
    click.echo(text, err=True)
