"""The intervals in which the two directions of an up-down sweep differ, from its
results file."""

from __future__ import annotations

import os

from nsdrill.analysis import hysteresis as analysis
from nsdrill.data import Answer, Results
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.store import read_results

NEEDED = ("status", "response", *RESPONSE_KINDS)


def hysteresis(source: Results | str | os.PathLike[str]) -> list[Answer]:
    """The intervals in which up and down differ in the results, or the results file,
    ``source``: see :func:`nsdrill.analysis.hysteresis.hysteresis`. Empty for a sweep
    that is not up-down."""
    return analysis.hysteresis(source if isinstance(source, Results) else read_results(source, NEEDED))
