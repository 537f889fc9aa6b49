"""Where a sweep is to begin."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any


def begin_below(over: Iterable[Mapping[str, Any]]) -> float:
    """The speed [rad/s] below which a sweep is to begin that passes ``over`` these critical
    speeds, entries as those of
    :func:`nsdrill.models.christoforou_yigit.critical_speeds.lasting_motions`: the one answer of
    check and window."""
    return float(min(one["min"] for one in over))
