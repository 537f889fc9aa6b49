"""Elementary functions, free of library calls. Those that vectorise are branch-free, and
accurate to 2 ulp over the range used.

A call of ``math.sin`` inside a lane loop keeps it scalar. These are the classical
algorithms (Cody & Waite 1980; fdlibm's kernel polynomials; Cephes' three intervals of
the arctangent) with selects instead of branches.

Fused multiply-adds are written out, ``fma(a, b, c)`` for a * b + c in one rounding.
If the compiler were allowed to fuse (the ``contract`` flag), it would do so
differently for one lane and for eight, and the bits would differ.
"""

from __future__ import annotations

import numpy as np

from nsdrill.compiler.functions import bits_float, float_bits, fma, inlined

# Adding and subtracting this rounds to the nearest whole number in the default rounding
# mode.
ROUNDER = 6755399441055744.0  # 1.5 * 2^52

# pi/2 in two parts. A fused multiply-add subtracts a whole number below 2^20 times the
# first from the angle without rounding, as the remainder is a multiple of 2^-53 and
# below 1.
PIO2_HIGH = 1.57079632679489655800e00
PIO2_LOW = 6.12323399573676603587e-17
TWO_OVER_PI = 0.63661977236758134308


@inlined
def sincos(angle: float) -> tuple[float, float]:
    """Sine and cosine of an angle [rad] of at most 10^6 in size."""
    shifted = fma(angle, TWO_OVER_PI, ROUNDER)
    quarters = shifted - ROUNDER
    r = fma(-quarters, PIO2_LOW, fma(-quarters, PIO2_HIGH, angle))
    r2 = r * r
    r4 = r2 * r2
    # fdlibm's polynomials, in pairs of terms: a chain half as long as Horner's for one
    # product more.
    p = fma(
        r4,
        fma(r2, 1.58969099521155010221e-10, -2.50507602534068634195e-08),
        fma(r2, 2.75573137070700676789e-06, -1.98412698298579493134e-04),
    )
    p = fma(r4, p, fma(r2, 8.33333333332248946124e-03, -1.66666666666666324348e-01))
    sine = fma(r * r2, p, r)
    q = fma(
        r4,
        fma(r2, -1.13596475577881948265e-11, 2.08757232129817482790e-09),
        fma(r2, -2.75573143513906633035e-07, 2.48015872894767294178e-05),
    )
    q = fma(r4, q, fma(r2, -1.38888888888741095749e-03, 4.16666666666666019037e-02))
    cosine = fma(r4, q, fma(r2, -0.5, 1.0))
    # The last two bits of the shifted number are the quadrant: swap on odd ones, then
    # set the signs by flipping the sign bit, which is cheaper than a select.
    quadrant = float_bits(shifted)
    odd = (quadrant & 1) != 0
    s = cosine if odd else sine
    c = sine if odd else cosine
    sine_sign = (quadrant & 2) << 62
    cosine_sign = ((quadrant + 1) & 2) << 62
    return bits_float(float_bits(s) ^ sine_sign), bits_float(float_bits(c) ^ cosine_sign)


@inlined
def direction_reduced(x: float, unit: float) -> tuple[float, float, float]:
    """The reduction of the arctangent to three intervals: (above, below, base) with
    (2/pi) atan |x / unit| = base + (2/pi) atan t, where t = above / below is at most
    tan(pi/8) in size; ``unit`` is positive. The caller divides, as it may combine this
    with another division."""
    size = abs(x)
    middle = size > 0.41421356237309504880 * unit
    large = size > 2.41421356237309504880 * unit
    above = -unit if large else (size - unit if middle else size)
    below = size if large else (size + unit if middle else unit)
    base = 1.0 if large else (0.5 if middle else 0.0)
    return above, below, base


@inlined
def direction_joined(x: float, t: float, base: float) -> float:
    """(2/pi) atan from the sign of x and the reduced argument t; a minimax polynomial
    whose even and odd terms are evaluated in parallel."""
    z = t * t
    z2 = z * z
    even = fma(z2, 0.013708989435972764, 0.03629911913777127)
    odd = fma(z2, -0.027906424924285377, -0.04229130186977311)
    even = fma(z2, even, 0.048958133471783176)
    odd = fma(z2, odd, -0.057873851902722526)
    even = fma(z2, even, 0.07073550865626)
    odd = fma(z2, odd, -0.09094568139431153)
    even = fma(z2, even, 0.127323954470988)
    odd = fma(z2, odd, -0.21220659078919635)
    fraction = fma(t, fma(z, fma(z, even, odd), TWO_OVER_PI), base)
    return bits_float(float_bits(fraction) ^ (float_bits(x) & -9223372036854775808))


@inlined
def direction(x: float) -> float:
    """(2/pi) atan(x), a smoothed sign, of any finite x."""
    above, below, base = direction_reduced(x, 1.0)
    return direction_joined(x, above / below, base)


@inlined
def slip_factors(speed: float, unit: float, smoothing: float, decay: float) -> tuple[float, float, float]:
    """(g(v), 1 / (1 + decay |v|), 1 / unit) at a slip v = speed / unit, with unit
    positive, where g(v) = (2/pi) atan(smoothing v). One division, by the product of all
    denominators, serves every quotient."""
    scaled = smoothing * speed
    numerator, denominator, base = direction_reduced(scaled, unit)
    decayed = fma(decay, abs(speed), unit)
    product = denominator * decayed
    inverse = 1.0 / (product * unit)
    per_both = unit * inverse
    g = direction_joined(scaled, numerator * decayed * per_both, base)
    return g, denominator * unit * per_both, product * inverse


@inlined
def angle_between(x0: float, y0: float, x1: float, y1: float) -> float:
    """The angle [rad] of the rotation of the vector (x0, y0) to the direction of (x1,
    y1), between -pi and pi; 0 if the vectors are parallel or antiparallel, where the
    sense of the rotation is undetermined."""
    cross, dot = fma(x0, y1, -(y0 * x1)), fma(x0, x1, y0 * y1)
    above, below, base = direction_reduced(cross, max(abs(dot), 1e-300))
    quarters = direction_joined(cross, above / below, base)
    back = (-2.0 if cross < 0.0 else 2.0) - quarters
    angle_in_quarters = back if dot < 0.0 else quarters
    return 1.57079632679489661923 * (0.0 if cross == 0.0 else angle_in_quarters)


@inlined
def log2(x: float) -> float:
    """Binary logarithm of a positive normal number, to 1e-9 absolute: for the step-size
    controller."""
    bits = float_bits(x)
    # Mantissa in [sqrt(1/2), sqrt(2)): take the exponent of x / sqrt(1/2).
    exponent = (bits - 4604544271217802189) >> 52
    mantissa = bits_float(bits - (exponent << 52))
    t = (mantissa - 1.0) / (mantissa + 1.0)
    t2 = t * t
    p = fma(t2, 1 / 13, 1 / 11)
    p = fma(t2, p, 1 / 9)
    p = fma(t2, p, 1 / 7)
    p = fma(t2, p, 1 / 5)
    p = fma(t2, p, 1 / 3)
    p = fma(t2, p, 1.0)
    return fma(2.885390081777926814719849 * t, p, np.float64(exponent))


@inlined
def exp2(x: float) -> float:
    """2 to the power x for x within +-1000, to 1e-9 relative: for the step-size
    controller."""
    shifted = x + ROUNDER
    f = (x - (shifted - ROUNDER)) * 0.693147180559945309417232
    p = fma(f, 1 / 40320, 1 / 5040)
    p = fma(f, p, 1 / 720)
    p = fma(f, p, 1 / 120)
    p = fma(f, p, 1 / 24)
    p = fma(f, p, 1 / 6)
    p = fma(f, p, 1 / 2)
    p = fma(f, p, 1.0)
    p = fma(f, p, 1.0)
    return bits_float(float_bits(p) + (float_bits(shifted) << 52))


@inlined
def expm1(x: float) -> float:
    """e to the power x, minus 1, for x at most 0, to 2 ulp. Values below -700 are
    replaced by -700.

    With x = n ln 2 + r, |r| at most (ln 2)/2, e^x - 1 = 2^n (e^r - 1) + (2^n - 1), so
    nothing cancels near 0. ln 2 is in two parts, as pi/2 for the sine; the Taylor
    polynomial of e^r - 1 to the 13th power leaves 1e-17 of it.
    """
    x = max(x, -700.0)
    shifted = fma(x, 1.44269504088896340736, ROUNDER)
    n = shifted - ROUNDER
    r = fma(-n, 2.31904681384629955842e-17, fma(-n, 6.93147180559945286227e-01, x))
    r2 = r * r
    even = fma(r2, 1 / 479001600, 1 / 3628800)
    odd = fma(r2, 1 / 6227020800, 1 / 39916800)
    even = fma(r2, even, 1 / 40320)
    odd = fma(r2, odd, 1 / 362880)
    even = fma(r2, even, 1 / 720)
    odd = fma(r2, odd, 1 / 5040)
    even = fma(r2, even, 1 / 24)
    odd = fma(r2, odd, 1 / 120)
    even = fma(r2, even, 1 / 2)
    odd = fma(r2, odd, 1 / 6)
    power = bits_float(4607182418800017408 + (float_bits(shifted) << 52))
    return fma(power, fma(r2, fma(r, odd, even), r), power - 1.0)


@inlined
def root(x: float) -> float:
    """The square root."""
    return np.sqrt(x)


@inlined
def tanh(x: float) -> float:
    """Hyperbolic tangent: -e / (2 + e) with e = exp(-2 |x|) - 1, and the sign of x."""
    e = expm1(-2.0 * abs(x))
    size = -e / (2.0 + e)
    return -size if x < 0.0 else size


# Of scalars, with branches: for what is computed once a run or an event. In their place
# the C library would give other last bits on other systems, and a GPU has none.
SIGN = -9223372036854775808  # the bit
PI_HIGH, PI_LOW = 3.14159265358979311600e00, 1.22464679914735317720e-16
LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10  # the first ends in 32 zeros
TWO_54 = 18014398509481984.0


@inlined
def fmod(x: float, y: float) -> float:
    """x less the multiple of y, towards zero, that leaves less than y: exact, with the
    sign of x. NaN where x is infinite or y is zero. Each difference is exact, as its
    terms are within a factor of two."""
    rest, size = abs(x), abs(y)
    rest = rest if rest < np.inf and size > 0.0 else np.nan
    part = size
    while rest - part >= part:
        part += part
    while 0.0 < size <= part < np.inf:
        rest = rest - part if rest >= part else rest
        part *= 0.5
    return bits_float(float_bits(rest) ^ (float_bits(x) & SIGN))


@inlined
def atan2(y: float, x: float) -> float:
    """The angle [rad] of the vector (x, y), from -pi to pi, to 1 ulp; of zeros and
    infinities as the C library has it. fdlibm's polynomial, with three intervals."""
    size, unit = abs(y), abs(x)
    if size == np.inf and unit == np.inf:
        size, unit = 1.0, 1.0
    if max(size, unit) > 2.0**1020:  # where a sum would overflow
        size, unit = 0.0625 * size, 0.0625 * unit
    above, below, base = direction_reduced(size, unit)
    below = 1.0 if size == 0.0 and unit == 0.0 else below
    t = above / below
    # what the quotient lost, and the difference and the sum if it is one of these
    lost = fma(-t, below, above)
    if base == 0.5:
        greater, less = max(size, unit), min(size, unit)
        of_sum = less - (below - greater)
        of_difference = (greater - abs(above)) - less
        lost += (of_difference if size > unit else -of_difference) - t * of_sum
    lost = lost / below if abs(t) > 1e-200 else 0.0
    z = t * t
    w = z * z
    even = fma(w, 1.62858201153657823623e-02, 4.97687799461593236017e-02)
    even = fma(w, even, 6.66107313738753120669e-02)
    even = fma(w, even, 9.09088713343650656196e-02)
    even = fma(w, even, 1.42857142725034663711e-01)
    even = z * fma(w, even, 3.33333333333329318027e-01)
    odd = fma(w, -3.65315727442169155270e-02, -5.83357013379057348645e-02)
    odd = fma(w, odd, -7.69187620504482999495e-02)
    odd = fma(w, odd, -1.11111104054623557880e-01)
    odd = w * fma(w, odd, -1.99999999998764832476e-01)
    # the angle of the first quadrant in two parts
    high = 0.5 * PI_HIGH * base
    low = fma(-t, even + odd, fma(0.5 * PI_LOW, base, lost))
    angle = high + (t + low)
    if float_bits(x) < 0:
        other = PI_HIGH - high
        low = low - PI_LOW - ((PI_HIGH - other) - high)
        angle = other - (t + low)
    return bits_float(float_bits(angle) | (float_bits(y) & SIGN))


@inlined
def log(x: float) -> float:
    """The natural logarithm, to 1 ulp, by fdlibm's polynomial: -inf of zero, NaN of
    numbers below it."""
    is_tiny = x < 2.2250738585072014e-308
    scaled = TWO_54 * x if is_tiny else x
    bits = float_bits(scaled)
    exponent = (bits - 4604544271217802189) >> 52
    f = bits_float(bits - (exponent << 52)) - 1.0
    k = float(exponent - (54 if is_tiny else 0))
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    odd = fma(w, fma(w, 1.531383769920937332e-01, 2.222219843214978396e-01), 3.999999999940941908e-01)
    even = fma(w, fma(w, 1.479819860511658591e-01, 1.818357216161805012e-01), 2.857142874366239149e-01)
    rest = fma(w, odd, z * fma(w, even, 6.666666666666735130e-01))
    half = 0.5 * f * f
    found = fma(k, LN2_HIGH, -((half - fma(s, half + rest, k * LN2_LOW)) - f))
    if not 0.0 < x < np.inf:
        found = -np.inf if x == 0.0 else x if x > 0.0 else np.nan
    return found
