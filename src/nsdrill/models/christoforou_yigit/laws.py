"""The friction of the bit: its torque over its force, an arm [m], as a function of its
speed, by the laws of :mod:`nsdrill.models.friction`.

The arm of friction is 2/3 r_h, with the radius r_h of the bit, that of the cutting
torque a_c (:mod:`.coefficients`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models import friction
from nsdrill.models.christoforou_yigit.coefficients import Coefficients
from nsdrill.models.christoforou_yigit.parameters import Parameters


def law_of_bit(parameters: Parameters) -> friction.KeyedLaw:
    """The law of the bit."""
    return friction.LAWS[parameters.bit.friction.law]


def bit_numbers(parameters: Parameters, k: Coefficients) -> friction.Numbers:
    """The numbers of the law of the bit at operating points with the coefficients
    ``k``: eps [s/rad], tau or 1/V0 [s/rad], the falling and the constant part of the
    arm [m]; of the rational law b1, b3, b0 b2 and b0."""
    return law_of_bit(parameters).numbers(parameters.bit.friction, 2 / 3 * k.bit_radius, k.cutting_arm)


def bit_arm(parameters: Parameters, k: Coefficients, speed: Any) -> Any:
    """The torque of the bit over its force [m], with its sign, at bit speeds
    [rad/s]."""
    return _arm("coefficient", parameters, k, speed)


def _arm(which: str, parameters: Parameters, k: Coefficients, speed: Any) -> Any:
    return friction.values(law_of_bit(parameters), which, speed, bit_numbers(parameters, k))


def running_arm(parameters: Parameters, k: Coefficients, speed: Any) -> Any:
    """The arm [m] at positive bit speeds [rad/s] without smoothing."""
    return _arm("unsmoothed", parameters, k, speed)


def static_arm(parameters: Parameters, k: Coefficients) -> Any:
    """The greatest arm [m] at rest, or a bound of it."""
    return law_of_bit(parameters).at_rest(parameters.bit.friction, 2 / 3 * k.bit_radius, k.cutting_arm)


def slope_at_rest(parameters: Parameters, k: Coefficients) -> Any:
    """The slope of the arm at rest [m s/rad]."""
    return _arm("slope", parameters, k, 0.0)


def fall(parameters: Parameters, k: Coefficients, speed: Any) -> Any:
    """The rate at which the torque over the force falls with bit speed [m s/rad],
    without smoothing, at positive speeds."""
    return _arm("fall", parameters, k, speed)


FASTEST = 1e4  # rad/s


def onset(parameters: Parameters, k: Coefficients, slope: float) -> float | None:
    """The greatest bit speed [rad/s] at which the torque over the force falls as
    steeply as ``slope`` [m s/rad], which is positive; None where it does so nowhere.
    Above that speed the fall of every law becomes less steep."""
    # from the steepest fall on: most laws fall most steeply at rest, others rise first
    trial = np.append(0.0, np.geomspace(1e-3, FASTEST, 7001))
    start = float(trial[int(np.argmax(fall(parameters, k, trial)))])
    return _last(lambda speeds: fall(parameters, k, speeds) > slope, start, FASTEST, 14)


def _last(holds: Callable[[Array], Array], low: float, high: float, rounds: int) -> float | None:
    """The greatest number from ``low`` to ``high`` at which ``holds``, in ``rounds`` of
    41 points between the neighbours found before; None where it holds nowhere, and
    where it still holds at ``high``."""
    for _ in range(rounds):
        trial = np.linspace(low, high, 41)
        true = np.flatnonzero(holds(trial))
        if len(true) == 0 or true[-1] + 1 == len(trial):
            return None
        low, high = trial[true[-1] : true[-1] + 2].tolist()
    return low


# cos(theta) at the midpoints of equal parts of half a cycle
_PHASE = np.cos((np.arange(1500) + 0.5) * math.pi / 1500)


def averaged_fold(parameters: Parameters, k: Coefficients, damping: float, wob: float) -> float | None:
    """The greatest mean bit speed [rad/s] at which friction sustains a cycle that just
    comes to rest, v = Omega (1 + cos theta), against the ``damping`` of string and
    drive [N m s/rad]; None where it does so nowhere. First-order averaging of the
    energy over a cycle gives damping Omega / 2 = -W <arm(v) cos theta>."""
    if damping <= 0.0 or wob <= 0.0:
        return None

    def grows(logarithms: Array) -> Array:
        speeds = np.exp(logarithms)
        work = wob * (bit_arm(parameters, k, speeds[:, None] * (1 + _PHASE)) * _PHASE).mean(axis=1)
        grown: Array = work + 0.5 * damping * speeds < 0.0
        return grown

    last = _last(grows, math.log(1e-3), math.log(FASTEST), 5)
    return None if last is None else math.exp(last)
