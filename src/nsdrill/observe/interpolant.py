"""The continuous solution between steps: two-point Hermite polynomials.

The velocities and accelerations of positions are known at both ends of a step, so the
quintic Hermite polynomial through these six numbers is of sixth order in the step: more
accurate than the dense output of the pair, and the same for any stepper. All
polynomials are in theta from 0 to 1 over the step, ``p`` the coefficients of their six
rising powers.
"""

from __future__ import annotations

import numpy as np

from nsdrill.compiler.functions import fma, inlined


@inlined
def quintic(g0, d0, c0, g1, d1, c1):  # type: ignore[no-untyped-def]
    """Coefficients p0..p5 from value g, slope times step d and second derivative times
    step squared c at both ends."""
    rise = g1 - g0
    half0, half1 = 0.5 * c0, 0.5 * c1
    p3 = fma(10.0, rise, fma(-6.0, d0, fma(-4.0, d1, fma(-3.0, half0, half1))))
    p4 = fma(-15.0, rise, fma(8.0, d0, fma(7.0, d1, fma(3.0, half0, -c1))))
    p5 = fma(6.0, rise, fma(-3.0, d0 + d1, half1 - half0))
    return g0, d0, half0, p3, p4, p5


@inlined
def rate_of(p, begin, h):  # type: ignore[no-untyped-def]
    """Coefficients of the rate of a polynomial over a step of length h, whose value at
    the beginning is known."""
    _, _, p2, p3, p4, p5 = p
    return begin, 2.0 * p2 / h, 3.0 * p3 / h, 4.0 * p4 / h, 5.0 * p5 / h, 0.0


@inlined
def lowered(p, level):  # type: ignore[no-untyped-def]
    """The polynomial less ``level``."""
    p0, p1, p2, p3, p4, p5 = p
    return p0 - level, p1, p2, p3, p4, p5


@inlined
def value(p, theta):  # type: ignore[no-untyped-def]
    """The polynomial at theta."""
    p0, p1, p2, p3, p4, p5 = p
    return fma(theta, fma(theta, fma(theta, fma(theta, fma(theta, p5, p4), p3), p2), p1), p0)


@inlined
def slope(p, theta):  # type: ignore[no-untyped-def]
    """The derivative of the polynomial by theta, at theta."""
    _, p1, p2, p3, p4, p5 = p
    return fma(theta, fma(theta, fma(theta, fma(theta, 5.0 * p5, 4.0 * p4), 3.0 * p3), 2.0 * p2), p1)


@inlined
def extreme(p, end_slope):  # type: ignore[no-untyped-def]
    """The theta of the extremum: where the slope, which has opposite signs at both
    ends, vanishes. The zero of the secant and two Newton steps.

    At an extremum the value depends on theta to second order, so an error of 1e-4 in
    theta is 1e-8 of the variation. Branch-free.
    """
    _, p1, p2, p3, p4, p5 = p
    theta = p1 / (p1 - end_slope)
    for _ in range(2):
        curvature = fma(theta, fma(theta, fma(theta, 20.0 * p5, 12.0 * p4), 6.0 * p3), 2.0 * p2)
        theta = theta - slope(p, theta) / curvature
        # In this order NaN, where the second derivative vanishes, gives a bound.
        theta = max(min(1.0, theta), 0.0)
    return theta


@inlined
def crossing(p, low, high):  # type: ignore[no-untyped-def]
    """Where the polynomial vanishes between ``low`` and ``high``, where its values have
    opposite signs.

    Newton's method, kept inside a shrinking bracket by bisection, to 1e-13.
    """
    below_at_start = value(p, low) < 0.0
    theta = 0.5 * (low + high)
    for _ in range(60):
        residual = value(p, theta)
        if (residual < 0.0) == below_at_start:
            low = theta
        else:
            high = theta
        gradient = slope(p, theta)
        next_theta = theta - residual / gradient if gradient != 0.0 else 0.5 * (low + high)
        if not (low < next_theta < high):
            next_theta = 0.5 * (low + high)
        if abs(next_theta - theta) < 1e-13:
            break
        theta = next_theta
    return theta


@inlined
def above(at_first, at_second, at_end, above_start, above_inside, above_end):  # type: ignore[no-untyped-def]
    """The part of an integral over the step that belongs to the times above a level,
    from the integrals from the start to the first and to the second place that divide
    the step there, and to the end; and whether the polynomial is above the level before
    the first, between the two and after the second. With theta in place of the
    integrals it is the fraction of the step."""
    total = at_first if above_start else 0.0
    total += at_second - at_first if above_inside else 0.0
    return total + (at_end - at_second if above_end else 0.0)


@inlined
def integral_of_cubic(g0, d0, g1, d1, theta):  # type: ignore[no-untyped-def]
    """The integral from 0 to theta of the cubic with these values and slopes by theta
    at 0 and 1."""
    rise = g1 - g0
    p2 = fma(3.0, rise, -fma(2.0, d0, d1))
    p3 = fma(-2.0, rise, d0 + d1)
    return theta * fma(theta, fma(theta, fma(theta, 0.25 * p3, p2 * (1.0 / 3.0)), 0.5 * d0), g0)


@inlined
def top_of_cubic(g0, d0, g1, d1):  # type: ignore[no-untyped-def]
    """The theta of the maximum of the cubic with these values and slopes, if it rises
    at 0 and falls at 1; else 0.5."""
    rise = g1 - g0
    p2 = fma(3.0, rise, -fma(2.0, d0, d1))
    p3 = fma(-2.0, rise, d0 + d1)
    theta = d0 / (np.sqrt(max(fma(p2, p2, -3.0 * p3 * d0), 0.0)) - p2)
    return theta if theta > 0.0 and theta < 1.0 else 0.5


@inlined
def cubic(g0, d0, g1, d1):  # type: ignore[no-untyped-def]
    """Coefficients p0..p5, the last two zero, from value g and slope times step d at
    both ends."""
    rise = g1 - g0
    return g0, d0, fma(3.0, rise, -fma(2.0, d0, d1)), fma(-2.0, rise, d0 + d1), 0.0, 0.0


@inlined
def middle_of_quintic(g0, d0, c0, g1, d1, c1):  # type: ignore[no-untyped-def]
    """Coefficients of the quintic (see :func:`quintic`) about the middle of the step,
    in s from -1 to 1: those of 1, s^2, s^4, then those of s, s^3, s^5."""
    even, odd = 0.5 * (g0 + g1), 0.5 * (g1 - g0)
    even_slope, odd_slope = 0.25 * (d1 - d0), 0.25 * (d0 + d1)
    even_bend, odd_bend = 0.125 * (c0 + c1), 0.125 * (c1 - c0)
    less = odd_slope - odd
    e4, o5 = 0.125 * (even_bend - even_slope), 0.125 * fma(-3.0, less, odd_bend)
    e2, o3 = fma(0.5, even_slope, -2.0 * e4), fma(0.5, less, -2.0 * o5)
    return even - e2 - e4, e2, e4, odd - o3 - o5, o3, o5


@inlined
def mean_square(e0, e2, e4, o1, o3, o5):  # type: ignore[no-untyped-def]
    """The mean square over the step of a polynomial about the middle of the step;
    exact."""
    even = fma(e0, fma(2.0 / 3.0, e2, e0), fma(e2, 0.2 * e2, e4 * fma(0.4, e0, fma(2.0 / 7.0, e2, (1.0 / 9.0) * e4))))
    odd = fma(
        o1,
        fma(0.4, o3, (1.0 / 3.0) * o1),
        fma(o3, (1.0 / 7.0) * o3, o5 * fma(2.0 / 7.0, o1, fma(2.0 / 9.0, o3, (1.0 / 11.0) * o5))),
    )
    return even + odd


@inlined
def middle_of_cubic(g0, d0, g1, d1):  # type: ignore[no-untyped-def]
    """As :func:`middle_of_quintic`, for the cubic through values and slopes."""
    even, odd, half_even_slope = 0.5 * (g0 + g1), 0.5 * (g1 - g0), 0.125 * (d1 - d0)
    less = 0.5 * fma(0.25, d0 + d1, -odd)
    return even - half_even_slope, half_even_slope, 0.0, odd - less, less, 0.0


@inlined
def middle_of_rate(e2, e4, o1, o3, o5, per_h, frame):  # type: ignore[no-untyped-def]
    """As :func:`middle_of_quintic`, for the rate of a quintic with these coefficients,
    plus ``frame``; ``per_h`` is one over the length of the step."""
    twice = 2.0 * per_h
    return (fma(twice, o1, frame), twice * (3.0 * o3), twice * (5.0 * o5), twice * (2.0 * e2), twice * (4.0 * e4), 0.0)


@inlined
def position_and_velocity(b, i, theta, h, frame_rate, x0_, v0_, a0_, x1_, v1_, a1_):  # type: ignore[no-untyped-def]
    """Position and velocity of a pair of states of lane i at theta inside the step.
    The last arguments are the offsets of the rows of position, velocity and
    acceleration at the start (0) and at the end (1) of the step."""
    p = quintic(
        b[x0_ + i],
        h * (b[v0_ + i] + frame_rate),
        h * h * b[a0_ + i],
        b[x1_ + i],
        h * (b[v1_ + i] + frame_rate),
        h * h * b[a1_ + i],
    )
    return value(p, theta), slope(p, theta) / h - frame_rate
