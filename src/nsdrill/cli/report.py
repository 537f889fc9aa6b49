"""nsdrill report."""

from __future__ import annotations

import shlex
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from nsdrill.cli import options
from nsdrill.errors import InputError, NsdrillError

if TYPE_CHECKING:
    from nsdrill.web.session import Session


@click.command(
    "report",
    epilog=options.examples(
        "report out.h5 -o report.html", "report up.h5 down.h5 -o report.html --units field --motions 6"
    ),
)
@click.argument("results", type=options.FileName(), nargs=-1, required=True)
@options.output("Page to write: .html.")
@click.option(
    "--motions",
    type=click.IntRange(0, 8),
    default=4,
    show_default=True,
    metavar="N",
    help="Number of example motions to include, one of each kind of response.",
)
@options.units
@options.severity
@options.confidence
@options.overwrite
def command(
    results: tuple[str, ...],
    output: str,
    motions: int,
    units: str,
    severity: int | None,
    confidence: float | None,
    overwrite: bool,
) -> int:
    """Write RESULTS, files of sweeps or branches, as one page of HTML that opens
    without a network: what was run, diagrams with numbers, where history matters, the
    operating window, motions, and the command lines that reproduce it."""
    if not output.lower().endswith((".html", ".htm")):
        raise InputError(f"{output}: found another ending; allowed: .html.")
    for file in results:
        options.check_not_input(file, output)
    from nsdrill.store import claim_file

    claim_file(output, overwrite)
    from nsdrill.app.reading import is_branches
    from nsdrill.files import amount, write_text
    from nsdrill.web.report import Part, report

    branches = [file for file in results if is_branches(file)]
    # drawn over the sweeps along the same number
    over = branches[0] if len(branches) == 1 else None
    sessions = [_session(file, units, None if file in branches else over) for file in results]
    probability = None if confidence is None else confidence / 100.0
    parts = [Part(one, _summaries(one, units, severity, probability)) for one in sessions]
    words = ["nsdrill", "report", *results, "-o", output]
    words += ["--motions", str(motions)] if motions != 4 else []
    words += ["--units", units] if units != "si" else []
    words += ["--severity", str(severity)] if severity is not None else []
    words += ["--confidence", f"{confidence:g}"] if confidence is not None else []
    text = report(parts, shlex.join(words), motions, severity, probability)
    write_text(output, text, overwrite=overwrite)
    click.echo(f"{output}: written, {amount(len(text.encode()))}.", err=True)
    return 0


def _session(file: str, units: str, over: str | None) -> Session:
    """A session of ``file``, with the branches ``over`` if they are of the same
    model."""
    from nsdrill.web.session import Session

    if over is not None:
        with suppress(InputError):
            return Session(file, units, over=over)
    return Session(file, units)


def _summaries(
    session: Session, units: str, severity: int | None, confidence: float | None
) -> list[tuple[str, list[str]]]:
    """The summaries that ``nsdrill show`` and ``nsdrill window`` print of the file; not
    the answer of the window and its warnings, with which the page begins."""
    from nsdrill.analysis.probability import check_samples
    from nsdrill.app.summary import summarize
    from nsdrill.app.window import check_severity, window_of
    from nsdrill.cli.show import lines
    from nsdrill.cli.window_note import number_lines

    if session.branches is not None and session.results is None:
        return []
    if session.results is None:
        raise InputError(f"{session.path}: found a study; allowed: results. Run it first: nsdrill run.")
    if confidence is not None:
        check_samples(session.results, f"{session.path}: --confidence")
    check_severity(session.results, severity, session.path)
    summaries = [("Numbers", list(lines(session.path, summarize(session.results), units)))]
    with suppress(NsdrillError):  # of a single point, or of four axes, there is no window
        window = window_of(session.results, severity, confidence)
        summaries.append(("Operating window", list(number_lines(window, units))))
    return summaries
