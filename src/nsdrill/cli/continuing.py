"""nsdrill branches."""

from __future__ import annotations

import click

from nsdrill.cli import options
from nsdrill.cli.overview import EXIT_CODES


@click.command(
    "branches",
    epilog=EXIT_CODES
    + "\n\n"
    + options.examples(
        "branches study.yaml -o branches.h5",
        "branches study.yaml -o branches.h5 --seeds out.h5",
        "branches study.yaml -o branches.h5 --resume",
        "plot branches.h5 --over out.h5 -o branches.png",
    ),
)
@options.study_argument
@options.output("File of branches to write (HDF5). Until it is there, what is finished is in FILE.part.", hdf5=True)
@click.option(
    "--seeds",
    type=options.FileName(),
    metavar="OUT.h5",
    help="Follow the settled points of this results file instead of continue.seeds.",
)
@options.workers
@options.settings
@click.option("--resume", is_flag=True, help="Continue an interrupted run.")
@options.overwrite
@options.quiet
def command(
    study: str,
    output: str,
    seeds: str | None,
    workers: int | None,
    overrides: tuple[str, ...],
    resume: bool,
    overwrite: bool,
    quiet: bool,
) -> int:
    """Follow the motions of STUDY, stable or not, along the number that its section
    continue names, and write their branches with stability and special points.

    The motions are seeded by a results file, or settle first at some values. `nsdrill
    show` says what each special point means, `nsdrill plot` draws the branches, also
    over the peaks of a sweep.
    """
    from nsdrill.cli.reading import load

    loaded = load(study, overrides)
    options.check_not_input(study, output)
    if seeds is not None:
        options.check_not_input(seeds, output)

    from nsdrill.app.continuing import continue_study
    from nsdrill.cli.words import count
    from nsdrill.progress import telling_compiling

    def print_progress(text: str) -> None:
        if not quiet:
            click.echo(f"  {text}", err=True)

    with telling_compiling(print_progress) as compiled:

        def say(text: str) -> None:
            compiled()
            print_progress(text)

        continuation = continue_study(
            loaded, output, seeds=seeds, workers=workers, overwrite=overwrite, resume=resume, say=say
        )
    if not quiet:
        branches, points = continuation.data.sizes["branch"], continuation.data.sizes["point"]
        noun = "branch" if branches == 1 else "branches"
        text = f"{output}: {branches} {noun}, {count(points, 'point')}, in {continuation.seconds:.1f} s."
        not_followed = [f"{number}: {word}" for word, number in continuation.seeds.items() if word != "followed"]
        if not_followed:
            text += (
                f" Of {count(sum(continuation.seeds.values()), 'seed')} some were not followed "
                f"({'; '.join(not_followed)})."
            )
        click.echo(text, err=True)
    return 0
