"""Where the two directions of an up-down sweep differ, from its results file."""

from __future__ import annotations

import os
from typing import Any

from nsdrill.analysis import hysteresis as analysis
from nsdrill.store import read_results


def hysteresis(path: str | os.PathLike[str]) -> list[dict[str, Any]]:
    """The intervals in which up and down differ in the results file ``path``: see
    :func:`nsdrill.analysis.hysteresis.hysteresis`. Empty for a sweep that is not up-down."""
    return analysis.hysteresis(read_results(path, ["status", "response", "whirl_kind"]))
