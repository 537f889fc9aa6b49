"""Where one may run whatever the history, from a results file."""

from __future__ import annotations

import os
from typing import Any

from nsdrill.analysis.probability import needed
from nsdrill.analysis.window import YIELDS, find_window
from nsdrill.app.overrides import with_overrides
from nsdrill.data import IN_MEMORY, Results
from nsdrill.errors import FileError, InputError
from nsdrill.store import read_results
from nsdrill.variables import TRUST


def window(
    source: Results | str | os.PathLike[str], severity: int | None = None, confidence: float | None = None
) -> dict[str, Any]:
    """The safe window of the results, or the results file, ``source`` as plain data in SI units; by severity where that
    is given, the greatest one allowed (0 to 4); of results with samples at a ``confidence`` (0 to 1)."""
    return find_window(read_for_window(source, severity), severity, confidence)


def read_for_window(source: Results | str | os.PathLike[str], severity: int | None = None) -> Results:
    """What the window of the results, or the results file, ``source`` is made from; of a file no more."""
    if severity is not None and severity not in range(5):
        raise InputError(f"severity: found {severity!r}; allowed: 0 to 4.")
    path = IN_MEMORY if isinstance(source, Results) else source
    results = source if isinstance(source, Results) else read_results(source, [*needed(severity), *YIELDS, *TRUST])
    if lacking := [name for name in needed(severity) if name not in results.variables]:
        raise FileError(
            f"{path}: found no {' and no '.join(lacking)}, which the first versions of nsdrill did not write; allowed: "
            "the window without a severity. Or run the study again."
        )
    return with_overrides(results)
