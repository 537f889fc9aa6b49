"""Whether friction is so steep that it is better integrated implicitly, from the
parameters alone.

Friction of steepness eps brakes a slip at a rate of about (2/pi) eps mu N / m, which
bounds the steps of an explicit method. An implicit step costs about three explicit ones
and is bounded by accuracy alone: measured on stick-slip and on rolling, the two methods
take the same time where that rate is about 3000 1/s. The threshold is twice that, so
that a string with the default smoothing is explicit under usual loads.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from nsdrill.data import Array
from nsdrill.models.description import Description
from nsdrill.models.leaves import Values

STEEP = 6000.0  # 1/s
# in the order of the values of the variable ``method``
METHODS: tuple[Literal["explicit", "implicit"], ...] = ("explicit", "implicit")


def implicit(method: str, model: Description, points: Values) -> Array:
    """Whether each point is integrated implicitly, shape (n,) or (), by a study's
    ``method``. False for every method where the model supports only the explicit
    one."""
    if method == "explicit" or model.explicit_only(points.parameters) is not None:
        return np.zeros(np.broadcast_shapes(*map(np.shape, points.operation)), dtype=bool)
    rates = [np.asarray(rate, dtype=float) for rate in model.friction_rates(points).values()]
    rate = np.broadcast_arrays(np.max(np.broadcast_arrays(0.0, *rates), axis=0), *points.operation)[0]
    return np.full(rate.shape, True) if method == "implicit" else rate > STEEP


def advice(method: str, model: Description, points: Values) -> str:
    """The advice about runs that reach the limit of their steps: a sentence without its
    full stop."""
    rates = {key: float(np.max(rate)) for key, rate in model.friction_rates(points).items()}
    key, rate = max(rates.items(), key=lambda item: item[1], default=("", 0.0))
    if rate <= STEEP or method == "implicit":
        return "raise simulation.max_steps"
    cause = f"the friction of {key} brakes the slip at up to {rate:.3g} 1/s, which bounds the length of explicit steps"
    if (reason := model.explicit_only(points.parameters)) is not None:
        return f"{cause}; it cannot be integrated implicitly, as {reason}: lower {key}, or raise simulation.max_steps"
    return f"{cause}; set simulation.method: auto, or raise simulation.max_steps"
