"""The friction of the bit: its torque over its force, an arm [m], as a function of its
speed, by the laws of :mod:`nsdrill.models.friction`.

With the radius r_h of the bit and the arm a_c of the cutting torque
(:mod:`.coefficients`), rise and dynamic of a law are (2/3) r_h (mu_s - mu_d) and (2/3)
r_h mu_d + a_c; the key ``dynamic_from`` of the linear law is V0, its decay 1/V0. The
rational law describes the whole torque, b0 [tanh(b1 v) + b2 v / (1 + b3 v^2)], without
a_c.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from nsdrill.models import friction
from nsdrill.models.christoforou_yigit.coefficients import Coefficients
from nsdrill.models.christoforou_yigit.parameters import Parameters


class BitNumbers(NamedTuple):
    """The four numbers of a law in the lane loops, or arrays over operating points: eps
    [s/rad]; tau or 1/V0 [s/rad]; the falling and the constant part of the arm [m]. For
    the rational law b1, b3, b0 b2 and b0."""

    bit_smoothing: Any
    bit_decay: Any
    bit_rise: Any
    bit_dynamic: Any


def bit_numbers(parameters: Parameters, k: Coefficients) -> BitNumbers:
    """The numbers of the law of the bit at operating points with the coefficients
    ``k``."""
    law = parameters.bit.friction
    if law.law == "rational":
        return BitNumbers(law.b1, law.b3, law.b0 * law.b2, law.b0)
    # Both parts of the torque, (2/3) r_h f(omega) + arm g(omega), share g: they are one
    # law with shifted coefficients.
    friction_arm = 2 / 3 * k.bit_radius
    decay = 1 / law.dynamic_from if law.law == "linear" else law.decay
    rise, dynamic = (friction_arm * (law.static - law.dynamic), friction_arm * law.dynamic + k.cutting_arm)
    return BitNumbers(law.smoothing, decay, rise, dynamic)


def bit_arm(parameters: Parameters, k: Coefficients, speed: Any) -> Any:
    """The torque of the bit over its force [m], with its sign, at bit speeds
    [rad/s]."""
    return _arm("coefficient", parameters, k, speed)


def _arm(which: str, parameters: Parameters, k: Coefficients, speed: Any) -> Any:
    law = friction.LAWS[parameters.bit.friction.law]
    return friction.values(law, which, speed, bit_numbers(parameters, k))


def running_arm(parameters: Parameters, k: Coefficients, speed: Any) -> Any:
    """The arm [m] at positive bit speeds [rad/s] without smoothing."""
    return _arm("unsmoothed", parameters, k, speed)


def static_arm(parameters: Parameters, k: Coefficients) -> Any:
    """The arm [m] at rest; for the rational law the bound b0 (1 + b2 / (2 sqrt(b3))),
    the sum of the greatest values of its terms."""
    law = parameters.bit.friction
    if law.law == "rational":
        return law.b0 * (1 + law.b2 / (2 * np.sqrt(law.b3)))
    return 2 / 3 * k.bit_radius * law.static + k.cutting_arm


def slope_at_rest(parameters: Parameters, k: Coefficients) -> Any:
    """The slope at rest of the friction torque over the force [m s/rad], without the
    torque of cutting."""
    law = parameters.bit.friction
    if law.law == "rational":
        return law.b0 * (law.b1 + law.b2)
    return 2 / math.pi * law.smoothing * law.static * 2 / 3 * k.bit_radius


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
    if not fall(parameters, k, start) > slope:
        return None
    low, high = start, FASTEST
    if fall(parameters, k, high) > slope:
        return None
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if fall(parameters, k, middle) > slope else (low, middle)
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
    low, high = math.log(1e-3), math.log(FASTEST)
    for _ in range(5):
        speeds = np.exp(np.linspace(low, high, 41))
        work = wob * (bit_arm(parameters, k, speeds[:, None] * (1 + _PHASE)) * _PHASE).mean(axis=1)
        growing = np.flatnonzero(work + 0.5 * damping * speeds < 0.0)
        if len(growing) == 0 or growing[-1] + 1 == len(speeds):
            return None
        low, high = np.log(speeds[growing[-1] : growing[-1] + 2]).tolist()
    return math.exp(low)
