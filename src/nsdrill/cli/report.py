"""nsdrill report."""

from __future__ import annotations

import shlex
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated

from nsdrill.cli.building import Given, command_of, say
from nsdrill.errors import InputError, NsdrillError, option
from nsdrill.late import deferred
from nsdrill.operations.argument import Argument, Whole
from nsdrill.operations.arguments import Confidence, ManyResults, Output, Overwrite, Severity, Units

with deferred():
    from nsdrill import files, store
    from nsdrill.analysis import probability
    from nsdrill.app import datasets, summary
    from nsdrill.app import window as windows
    from nsdrill.text import show as text
    from nsdrill.text import window as window_text
    from nsdrill.web import report as pages
    from nsdrill.web import session as sessions

if TYPE_CHECKING:
    from nsdrill.web.session import Session

Motions = Annotated[
    int, Argument("Number of example motions to include, one of each kind of response.", metavar="N", kind=Whole(0, 8))
]


@command_of(examples=("report out.h5 -o report.html", "report up.h5 down.h5 -o report.html --units field --motions 6"))
def command(
    given: Given,
    results: ManyResults,
    output: Annotated[Output, "Page to write: .html."],
    motions: Motions = 4,
    units: Units = None,
    severity: Severity = None,
    confidence: Confidence = None,
    overwrite: Overwrite = False,
) -> int:
    """Write RESULTS, files of sweeps or branches, as one page of HTML that opens
    without a network: what was run, diagrams with numbers, where history matters, the
    operating window, motions, and the command lines that reproduce it."""
    assert units is not None
    if not output.lower().endswith((".html", ".htm")):
        raise InputError(f"{output}: found another ending; allowed: .html.")
    store.claim_file(output, overwrite)
    branches = [file for file in results if datasets.is_branches(file)]
    # drawn over the sweeps along the same number
    over = branches[0] if len(branches) == 1 else None
    opened = [_session(file, units, None if file in branches else over) for file in results]
    parts = [pages.Part(one, _summaries(one, units, severity, confidence)) for one in opened]
    words = ["nsdrill", "report", *results, "-o", output]
    words += ["--motions", str(motions)] if motions != 4 else []
    words += ["--units", units] if units != "si" else []
    words += ["--severity", str(severity)] if severity is not None else []
    words += ["--confidence", f"{100 * confidence:g}"] if confidence is not None else []
    text = pages.report(parts, shlex.join(words), motions, severity, confidence)
    files.write_text(output, text, overwrite=overwrite)
    say(f"{output}: written, {files.amount(len(text.encode()))}.")
    return 0


def _session(file: str, units: str, over: str | None) -> Session:
    """A session of ``file``, with the branches ``over`` if they are of the same
    model."""
    if over is not None:
        with suppress(InputError):
            return sessions.Session(file, units, over=over)
    return sessions.Session(file, units)


def _summaries(
    session: Session, units: str, severity: int | None, confidence: float | None
) -> list[tuple[str, list[str]]]:
    """The summaries that ``nsdrill show`` and ``nsdrill window`` print of the file; not
    the answer of the window and its warnings, with which the page begins."""
    if session.branches is not None and session.results is None:
        return []
    if session.results is None:
        raise InputError(f"{session.path}: found a study; allowed: results. Run it first: nsdrill run.")
    if confidence is not None:
        probability.check_samples(session.results, f"{session.path}: {option('confidence')}")
    windows.check_severity(session.results, severity, session.path)
    summaries = [("Numbers", list(text.lines(session.path, summary.summarize(session.results), units)))]
    with suppress(NsdrillError):  # of a single point, or of four axes, there is no window
        window = windows.window_of(session.results, severity, confidence)
        summaries.append(("Operating window", list(window_text.number_lines(window, units))))
    return summaries
