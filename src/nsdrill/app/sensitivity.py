"""The sensitivity to each uncertain number, from a results file."""

from __future__ import annotations

import os

from nsdrill.analysis.probability import check_samples
from nsdrill.analysis.sensitivity import needed
from nsdrill.analysis.sensitivity import sensitivity as analysis
from nsdrill.app.experiment import with_overrides
from nsdrill.data import Answer, Results
from nsdrill.store import read_results
from nsdrill.variables import TRUST


def sensitivity(source: Results | str | os.PathLike[str], severity: int | None = None) -> Answer:
    """The result of :func:`nsdrill.analysis.sensitivity.sensitivity` for the results,
    or the results file, ``source``."""
    return analysis(read_for_sensitivity(source, severity), severity)


def read_for_sensitivity(source: Results | str | os.PathLike[str], severity: int | None = None) -> Results:
    """The results, or the results file, ``source``; of a file only the variables on
    which the sensitivity depends are read."""
    if not isinstance(source, Results):
        outline = read_results(source, ())
        check_samples(outline, os.fspath(source))
        source = read_results(source, [*needed(outline, severity), *TRUST])
    check_samples(source, "sensitivity")
    return with_overrides(source)
