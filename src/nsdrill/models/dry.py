"""How much further stick-slip lasts by dry friction than by the smoothed friction of a model, whose
greatest torque, at which the bit breaks away, smoothing lowers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

from nsdrill.data import evenly_spaced
from nsdrill.models.drilling import FOLD
from nsdrill.models.friction import law_named
from nsdrill.models.numbers import FOLD_ERROR, DerivedQuantity
from nsdrill.models.operation import Values
from nsdrill.models.tree import with_values

KEY = "bit.friction.smoothing"
DRY = 1e5  # s/rad: a greater one changes stick-slip by no more than the error of its estimate
MOST_SETTINGS = 4  # of which it is asked

Folds = Callable[[Sequence[Values]], Sequence[float | None]]


def dry_friction(folds: Folds | None, settings: Sequence[Values]) -> float | None:
    """How many times as high the ``folds``, the speeds up to which stick-slip lasts, are by dry friction: the most
    over some of the ``settings``. None where that is not known, as of friction that is not smoothed."""
    if folds is None:
        return None
    alike = {(one.parameters, *map(float, one.operation[:2])): one for one in settings if _is_smoothed(one.parameters)}
    now = evenly_spaced([*alike.values()], MOST_SETTINGS)
    found = folds([*now, *map(_dry, now)])
    pairs = zip(found[: len(now)], found[len(now) :], strict=True)
    return max((dry / one for one, dry in pairs if one and dry and math.isfinite(one + dry)), default=None)


def told(quantities: dict[str, DerivedQuantity], checks: Any, at: Values) -> dict[str, DerivedQuantity]:
    """The ``quantities`` of a setting, with how much further stick-slip lasts by dry friction, where that is beyond
    the error that is told."""
    fold = quantities.get(FOLD)
    if fold is None or fold.value is None or not math.isfinite(fold.value):
        return quantities
    ratio = dry_friction(getattr(checks, "stick_slip_folds", None), [at])
    if ratio is None or ratio <= FOLD_ERROR:
        return quantities
    more = f"; by dry friction, without smoothing, {100.0 * (ratio - 1.0):.0f} % more)"
    return quantities | {FOLD: replace(fold, meaning=fold.meaning.removesuffix(")") + more)}


def _is_smoothed(parameters: Any) -> bool:
    """Whether the friction at the bit is smoothed, and the rock is not cut anew."""
    bit = getattr(parameters, "bit", None)
    section = getattr(bit, "friction", None)
    if section is None or getattr(getattr(bit, "rock", None), "regenerative", False):
        return False
    return law_named(section.law).steep == "smoothing" and float(section.smoothing) < DRY


def _dry(one: Values) -> Values:
    return replace(one, parameters=with_values(one.parameters, {KEY: DRY}))
