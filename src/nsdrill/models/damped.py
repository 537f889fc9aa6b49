"""Damping of torsion that is unusual of a string. The range is that of measured strings; the
value decides where stick-slip ends and is on no sheet of an assembly."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from nsdrill.models.numbers import FormatValue
from nsdrill.models.operation import Operation, Values
from nsdrill.models.tree import with_values

KEY = "drillstring.torsional_damping"
LOW, HIGH, USUAL = 0.02, 0.05, 0.03  # damping ratios of the torsional mode of strings


class Damping(NamedTuple):
    """The damping of a string [N m s/rad], its ratio, and what has a usual ratio."""

    value: float
    ratio: float
    usual: float

    @property
    def is_low(self) -> bool:
        """Whether no lower ratio is usual, to the two digits that are shown."""
        return float(f"{self.ratio:.2g}") <= LOW

    @property
    def low(self) -> float:
        """The damping [N m s/rad] with the least ratio that is usual, with which stick-slip lasts farthest."""
        return self.usual * LOW / USUAL

    @property
    def is_usual(self) -> bool:
        """Whether the ratio is one of strings, to the two digits that are shown."""
        return LOW <= float(f"{self.ratio:.2g}") <= HIGH


def unusual_damping(
    study: Any, corners: Sequence[Values], coefficients: Callable[[Any, Operation], Any]
) -> Damping | None:
    """The damping whose ratio over the corners of a study is farthest from what is usual;
    None where it is usual everywhere, is swept or drawn, or nothing twists."""
    found = dampings(study, corners, coefficients)
    unusual = [one for one in found if not one.is_usual]
    return max(unusual, key=lambda one: max(one.ratio / HIGH, 1.0 - one.ratio / LOW), default=None)


def dampings(study: Any, corners: Sequence[Values], coefficients: Callable[[Any, Operation], Any]) -> list[Damping]:
    """The damping at each of the corners of a study; none where it is swept or drawn, or nothing twists."""
    found = []
    for one in corners:
        value = getattr(getattr(one.parameters, "drillstring", None), "torsional_damping", None)
        modes = getattr(one.parameters, "modes", None)
        if value is None or KEY in (*study.axes, *study.drawn) or getattr(modes, "torsional", "free") == "frozen":
            return []
        k = coefficients(one.parameters, one.point)
        critical = 2.0 * math.sqrt(float(k.k_t) * float(k.J))
        found.append(Damping(float(value), float(value) / critical, USUAL * critical))
    return found


def damped(found: Damping | None, format_value: FormatValue) -> str | None:
    """The warning of ``check``; None where the damping is usual."""
    if found is None:
        return None
    now, usual = (format_value(value, "N m s/rad", "N*m*s/rad") for value in (found.value, found.usual))
    much, low = ("much", "low") if found.ratio > USUAL else ("little", "high")
    return (
        f"Damped: with {KEY} {now} the torsional mode has a damping ratio of {found.ratio:.2g}, and strings have "
        f"{LOW:g} to {HIGH:g}: {USUAL:g} would be {usual}. With too {much} damping stick-slip ends at speeds that are "
        f"too {low}."
    )


def with_usual(values: Values, found: Damping) -> Values:
    """The ``values`` with the damping that is usual."""
    return replace(values, parameters=with_values(values.parameters, {KEY: found.usual}))
