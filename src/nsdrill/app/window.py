"""Where one may run whatever the history, from a results file."""

from __future__ import annotations

import os
from contextlib import suppress
from typing import Any

from nsdrill.analysis.probability import needed
from nsdrill.analysis.window import YIELDS, find_window
from nsdrill.app.check import passed_over
from nsdrill.app.overrides import with_overrides
from nsdrill.data import IN_MEMORY, Results, resolved_study
from nsdrill.errors import FileError, InputError, NsdrillError
from nsdrill.store import read_results
from nsdrill.study.study import study_from_resolved
from nsdrill.variables import TRUST


def window(
    source: Results | str | os.PathLike[str],
    severity: int | None = None,
    confidence: float | None = None,
) -> dict[str, Any]:
    """The safe window of the results, or the results file, ``source`` as plain data in
    SI units; by severity where that is given, the greatest one allowed (0 to 4); of
    results with samples at a ``confidence`` (0 to 1)."""
    return window_of(read_for_window(source, severity), severity, confidence)


def window_of(
    results: Results, severity: int | None = None, confidence: float | None = None
) -> dict[str, Any]:
    """As :func:`nsdrill.analysis.window.find_window`, with the critical speeds
    ``passed_over``, which lie below the speed at which the sweep begins; empty where
    there is none, and where the file does not tell."""
    note = find_window(results, severity, confidence)
    note["passed_over"] = []
    with suppress(NsdrillError):  # no study in it, or one of another version
        note["passed_over"] = passed_over(study_from_resolved(resolved_study(results.attrs)))
    return note


def read_for_window(
    source: Results | str | os.PathLike[str], severity: int | None = None
) -> Results:
    """What the window of the results, or the results file, ``source`` is made from; of
    a file no more."""
    if severity is not None and severity not in range(5):
        raise InputError(f"severity: found {severity!r}; allowed: 0 to 4.")
    path = IN_MEMORY if isinstance(source, Results) else source
    results = (
        source
        if isinstance(source, Results)
        else read_results(source, [*needed(severity), *YIELDS, *TRUST])
    )
    if lacking := [name for name in needed(severity) if name not in results.variables]:
        raise FileError(
            f"{path}: found no {' and no '.join(lacking)}, which the first versions of nsdrill "
            f"did not write; allowed: "
            "the window without a severity. Or run the study again."
        )
    return with_overrides(results)
