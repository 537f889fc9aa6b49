"""nsdrill report."""

from __future__ import annotations

import shlex
from contextlib import suppress

import click

from nsdrill.cli import options
from nsdrill.errors import InputError, NsdrillError


@click.command(
    "report",
    epilog=options.examples(
        "report out.h5 -o report.html", "report up.h5 down.h5 -o report.html --units field --motions 6"
    ),
)
@click.argument("results", type=options.FileName(), nargs=-1, required=True)
@options.output("Page to write: .html.")
@click.option(
    "--motions", type=click.IntRange(0, 8), default=4, show_default=True,
    help="Of so many kinds of response a point is run again, and its motion drawn.",
)  # fmt: skip
@options.units
@options.overwrite
def command(results: tuple[str, ...], output: str, motions: int, units: str, overwrite: bool) -> int:
    """Write RESULTS, one file or several, as one page of HTML that opens without a network: what was asked, diagrams
    with numbers, where history matters, the safe window, motions, and the command lines that make it again."""
    if not output.lower().endswith((".html", ".htm")):
        raise InputError(f"{output}: found another ending; allowed: .html.")
    for file in results:
        options.keep_apart(file, output)
    from nsdrill.store import claim_file

    claim_file(output, overwrite)
    from nsdrill.files import amount, write_text
    from nsdrill.web.report import Part, report
    from nsdrill.web.session import Session

    parts = [Part(session, _notes(session, units)) for session in (Session(file, units) for file in results)]
    words = ["nsdrill", "report", *results, "-o", output]
    words += ["--motions", str(motions)] if motions != 4 else []
    words += ["--units", units] if units != "si" else []
    text = report(parts, shlex.join(words), motions)
    write_text(output, text, overwrite=overwrite)
    click.echo(f"{output}: written, {amount(len(text.encode()))}.", err=True)
    return 0


def _notes(session, units: str) -> list[tuple[str, list[str]]]:  # type: ignore[no-untyped-def]
    """What ``nsdrill show`` and ``nsdrill window`` say of the file."""
    from nsdrill.analysis.window import find_window
    from nsdrill.app.report import summarize
    from nsdrill.cli.show import lines
    from nsdrill.cli.window_note import lines as window_lines

    if session.results is None:
        raise InputError(f"{session.path}: found a study; allowed: results. Run it first: nsdrill run.")
    notes = [("Numbers", list(lines(session.path, summarize(session.results), units)))]
    with suppress(NsdrillError):  # of a single point, or of four axes, there is no window
        notes.append(("Safe window", list(window_lines(find_window(session.results), units))))
    return notes
