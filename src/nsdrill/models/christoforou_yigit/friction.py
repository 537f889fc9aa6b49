"""The friction laws, as functions that are inlined into the lane loops.

At the wall f(v) = g(v) [(mu_s - mu_d) / (1 + tau |v|) + mu_d] with the smoothed
direction g(v) = (2/pi) atan(eps v); at the bit also the other laws of :mod:`.laws`,
each given by four numbers. The number of the law is a compile-time constant.
"""

from __future__ import annotations

import numpy as np

from nsdrill.compiler.functions import inlined
from nsdrill.compiler.words import bits_float, float_bits, fma
from nsdrill.elementary import TWO_OVER_PI, direction, expm1, slip_factors
from nsdrill.models.christoforou_yigit.laws import HYPERBOLIC, LINEAR, RATIONAL


@inlined
def coefficient(
    speed: float,
    g: float,
    decayed: float,
    per_flat: float,
    smoothing: float,
    decay: float,
    rise: float,
    dynamic: float,
) -> tuple[float, float]:
    """(f(v), f'(v)) from the results of :func:`slip_factors` and ``per_flat``, 1 / (1 +
    (eps v)^2); ``rise`` is mu_s - mu_d."""
    m = fma(rise, decayed, dynamic)
    fall = rise * decay * decayed * decayed
    return g * m, fma(TWO_OVER_PI * smoothing * per_flat, m, g * (fall if speed < 0.0 else -fall))


@inlined
def friction_per_slip(
    slip: float,
    along: float,
    unit: float,
    smoothing: float,
    decay: float,
    rise: float,
    dynamic: float,
) -> tuple[float, float]:
    """(f(|v|) / (|v| unit), 1 / unit) at a slip v = (slip, along) / unit in two
    directions, with unit positive. The first, times ``slip`` or ``along``, is the
    component of the coefficient against that slip."""
    # The floor has an effect at rest only, where the quotient has a limit.
    speed = np.sqrt(fma(slip, slip, fma(along, along, 1e-60)))
    g, decayed, per_unit = slip_factors(speed, unit, smoothing, decay)
    return g * fma(rise, decayed, dynamic) / speed, per_unit


@inlined
def bit_factors(law: int, speed: float, smoothing: float, decay: float) -> tuple[float, float]:
    """The most expensive terms of the ``law`` of the bit, which the observer needs too:
    the direction and the factor of the falling part; for the rational law tanh(b1 v)
    and 1 / (1 + b3 v^2)."""
    if law == HYPERBOLIC:
        g, decayed, _ = slip_factors(speed, 1.0, smoothing, decay)
    elif law == RATIONAL:  # one division for both quotients
        minus_one = expm1(-2.0 * abs(smoothing * speed))
        denominator = fma(decay * speed, speed, 1.0)
        inverse = 1.0 / ((2.0 + minus_one) * denominator)
        g = bits_float(
            float_bits(-minus_one * denominator * inverse)
            ^ (float_bits(speed) & -9223372036854775808)
        )
        decayed = (2.0 + minus_one) * inverse
    else:
        g = direction(smoothing * speed)
        decayed_speed = decay * abs(speed)
        decayed = max(1.0 - decayed_speed, 0.0) if law == LINEAR else 1.0 + expm1(-decayed_speed)
    return g, decayed


@inlined
def bit_arm(law: int, speed: float, g: float, decayed: float, rise: float, dynamic: float) -> float:
    """The torque of the bit over its force [m], from the results of
    :func:`bit_factors`."""
    if law == RATIONAL:
        return fma(rise * speed, decayed, dynamic * g)
    return g * fma(rise, decayed, dynamic)


@inlined
def bit_slope(
    law: int,
    speed: float,
    g: float,
    decayed: float,
    per_flat: float,
    smoothing: float,
    decay: float,
    rise: float,
    dynamic: float,
) -> tuple[float, float]:
    """(arm, d arm / d speed) from the results of :func:`bit_factors` and ``per_flat``,
    1 / (1 + (eps v)^2)."""
    if law == HYPERBOLIC:
        return coefficient(speed, g, decayed, per_flat, smoothing, decay, rise, dynamic)
    arm = bit_arm(law, speed, g, decayed, rise, dynamic)
    if law == RATIONAL:
        hump = rise * decayed * fma(-2.0 * decay * speed * speed, decayed, 1.0)
        return arm, fma(dynamic * smoothing, fma(-g, g, 1.0), hump)
    fall = rise * decay * ((1.0 if decayed > 0.0 else 0.0) if law == LINEAR else decayed)
    steep = TWO_OVER_PI * smoothing * per_flat
    return arm, fma(steep, fma(rise, decayed, dynamic), g * (fall if speed < 0.0 else -fall))


@inlined
def bit_parts(law: int, speed: float, smoothing: float, decay: float) -> tuple[float, float, float]:
    """The results of :func:`bit_factors` at a bit speed, and 1 / (1 + (eps v)^2)."""
    scaled = smoothing * speed
    flat = fma(scaled, scaled, 1.0)
    if law == HYPERBOLIC:
        return slip_factors(speed * flat, flat, smoothing, decay)
    g, decayed = bit_factors(law, speed, smoothing, decay)
    return g, decayed, 1.0 / flat


@inlined
def bit_law(
    law: int, speed: float, smoothing: float, decay: float, rise: float, dynamic: float
) -> tuple[float, float]:
    """(arm, d arm / d speed) at a bit speed."""
    g, decayed, per_flat = bit_parts(law, speed, smoothing, decay)
    return bit_slope(law, speed, g, decayed, per_flat, smoothing, decay, rise, dynamic)
