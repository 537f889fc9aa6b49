"""How much further stick-slip lasts by dry friction than by the smoothed friction of a model, whose
greatest torque, at which the bit breaks away, smoothing lowers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from nsdrill.models.drilling import FOLD
from nsdrill.models.friction import law_named
from nsdrill.models.numbers import FOLD_ERROR, DerivedQuantity
from nsdrill.models.operation import Values
from nsdrill.models.tree import with_values

KEY = "bit.friction.smoothing"
DRY = 1e5  # s/rad: a greater one changes stick-slip by no more than the error of its estimate

Speeds = Callable[[Sequence[Values]], Sequence[float | None]]


def by_dry(speeds: Speeds, settings: Sequence[Values]) -> tuple[list[float | None], list[float | None]]:
    """The ``speeds`` up to which stick-slip lasts at some settings, None where it does at none, NaN where that is not
    known, and the same by dry friction, which is no less: of friction that is not smoothed the same."""
    smoothed = [number for number, one in enumerate(settings) if _is_smoothed(one.parameters)]
    found = speeds([*settings, *(_dry(settings[number]) for number in smoothed)])
    now, dry = list(found[: len(settings)]), list(found[: len(settings)])
    for number, one in zip(smoothed, found[len(settings) :], strict=True):
        own, other = now[number] or 0.0, one or 0.0
        # dry friction sticks to no lower speed: where nothing of it is found, it is not known
        is_known = math.isfinite(other) or (math.isinf(other) and not math.isnan(own))
        dry[number] = math.nan if not is_known or other == 0.0 < own else max(own, other) or now[number]
    return now, dry


def told(quantities: dict[str, DerivedQuantity], checks: Any, at: Values) -> dict[str, DerivedQuantity]:
    """The ``quantities`` of a setting, with how much further stick-slip lasts by dry friction, where that is beyond
    the error that is told."""
    fold, folds = quantities.get(FOLD), getattr(checks, "stick_slip_folds", None)
    if fold is None or not fold.known or fold.everywhere or folds is None:
        return quantities
    (now,), (dry,) = by_dry(folds, [at])
    if dry and not now:  # of friction so round that nothing sticks
        some = "not known" if math.isnan(dry) else "at some speeds"
        return quantities | {FOLD: replace(fold, meaning=f"{fold.meaning.removesuffix(')')}; by dry friction {some})")}
    if not now or not dry or dry <= FOLD_ERROR * now or math.isinf(now):
        return quantities
    more = f"{100.0 * (dry / now - 1.0):.0f} % more" if math.isfinite(dry) else "every speed"
    more = f"; by dry friction, without smoothing, {'not known' if math.isnan(dry) else more})"
    return quantities | {FOLD: replace(fold, meaning=fold.meaning.removesuffix(")") + more)}


def _is_smoothed(parameters: Any) -> bool:
    """Whether the friction at the bit is smoothed, and the rock is not cut anew."""
    bit = getattr(parameters, "bit", None)
    section: Any = getattr(bit, "friction", None)
    if not hasattr(section, "law") or getattr(getattr(bit, "rock", None), "regenerative", False):
        return False
    return law_named(section.law).steep == "smoothing" and float(section.smoothing) < DRY


def _dry(one: Values) -> Values:
    return replace(one, parameters=with_values(one.parameters, {KEY: DRY}))
