"""Elementary functions that vectorise: branch-free, free of library calls, accurate to 2 ulp over the range used.

A call of ``math.sin`` inside a lane loop keeps it scalar. These are the classical algorithms (Cody & Waite 1980;
fdlibm's kernel polynomials; Cephes' three intervals of the arctangent) with selects instead of branches.

Fused multiply-adds are written out, ``fma(a, b, c)`` for a * b + c in one rounding. Were the compiler free to fuse
where it likes (the ``contract`` flag), it would choose differently for one lane and for eight, and the bits would
differ.
"""

from __future__ import annotations

import math
import struct
from typing import Any

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.extending import intrinsic as numba_intrinsic

from nsdrill.abi import inlined, lasting

# Adding and subtracting this rounds to the nearest whole number in the default rounding mode.
ROUNDER = 6755399441055744.0  # 1.5 * 2^52

# pi/2 in three parts; a whole number below 2^20 times either of the first two is exact (fdlibm e_rem_pio2.c).
PIO2_1 = 1.57079632673412561417e00
PIO2_2 = 6.07710050630396597660e-11
PIO2_3 = 2.02226624879595063154e-21
TWO_OVER_PI = 0.63661977236758134308


def intrinsic(function: Any) -> Any:
    """An instruction of LLVM, with the identity that the cache needs."""
    return lasting(numba_intrinsic(function), function.__name__)


if config.DISABLE_JIT:

    def float_bits(value: float) -> int:
        """The 64 bits of a float, as an integer."""
        return int(struct.unpack("<q", struct.pack("<d", value))[0])

    def bits_float(bits: int) -> float:
        """The float that has these 64 bits."""
        return float(struct.unpack("<d", struct.pack("<Q", int(bits) & 0xFFFFFFFFFFFFFFFF))[0])

    def fma(a: float, b: float, c: float) -> float:
        """a * b + c; in one rounding when compiled."""
        return a * b + c

    def lowest_bit(bits: int) -> int:
        """The place of the lowest bit that is set; there must be one."""
        return (bits & -bits).bit_length() - 1

else:

    @intrinsic
    def float_bits(context: Any, value: Any) -> Any:
        """The 64 bits of a float, as an integer."""

        def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.bitcast(args[0], ir.IntType(64))

        return types.int64(types.float64), build

    @intrinsic
    def bits_float(context: Any, bits: Any) -> Any:
        """The float that has these 64 bits."""

        def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.bitcast(args[0], ir.DoubleType())

        return types.float64(types.int64), build

    @intrinsic
    def fma(context: Any, a: Any, b: Any, c: Any) -> Any:
        """a * b + c in one rounding."""

        def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.fma(*args)

        return types.float64(types.float64, types.float64, types.float64), build

    @intrinsic
    def lowest_bit(context: Any, bits: Any) -> Any:
        """The place of the lowest bit that is set; there must be one."""

        def build(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            return builder.cttz(args[0], ir.Constant(ir.IntType(1), 1))

        return types.int64(types.int64), build


@inlined
def sincos(angle: float) -> tuple[float, float]:
    """Sine and cosine of an angle [rad] of at most 10^6 in size."""
    shifted = fma(angle, TWO_OVER_PI, ROUNDER)
    quarters = shifted - ROUNDER
    r = fma(-quarters, PIO2_3, fma(-quarters, PIO2_2, fma(-quarters, PIO2_1, angle)))
    r2 = r * r
    p = fma(r2, 1.58969099521155010221e-10, -2.50507602534068634195e-08)
    p = fma(r2, p, 2.75573137070700676789e-06)
    p = fma(r2, p, -1.98412698298579493134e-04)
    p = fma(r2, p, 8.33333333332248946124e-03)
    p = fma(r2, p, -1.66666666666666324348e-01)
    sine = fma(r * r2, p, r)
    q = fma(r2, -1.13596475577881948265e-11, 2.08757232129817482790e-09)
    q = fma(r2, q, -2.75573143513906633035e-07)
    q = fma(r2, q, 2.48015872894767294178e-05)
    q = fma(r2, q, -1.38888888888741095749e-03)
    q = fma(r2, q, 4.16666666666666019037e-02)
    cosine = fma(r2, fma(r2, q, -0.5), 1.0)
    # The last two bits of the shifted number are the quadrant: swap on odd ones, then set the signs by flipping the
    # sign bit, which is cheaper than a select.
    quadrant = float_bits(shifted)
    odd = (quadrant & 1) != 0
    s = cosine if odd else sine
    c = sine if odd else cosine
    sine_sign = (quadrant & 2) << 62
    cosine_sign = ((quadrant + 1) & 2) << 62
    return bits_float(float_bits(s) ^ sine_sign), bits_float(float_bits(c) ^ cosine_sign)


@inlined
def arctan_reduced(x: float) -> tuple[float, float, float, float]:
    """The three intervals of the arctangent: (above, below, base, rest) with atan |x| = base + rest + atan(above/below)
    and |above/below| at most tan(pi/8). The quotient is left to the caller, who may have another division to share."""
    size = abs(x)
    middle = size > 0.41421356237309504880
    large = size > 2.41421356237309504880
    above = -1.0 if large else (size - 1.0 if middle else size)
    below = size if large else (size + 1.0 if middle else 1.0)
    base = math.pi / 2 if large else (math.pi / 4 if middle else 0.0)
    rest = 6.123233995736765886130e-17 if large else (3.061616997868382943065e-17 if middle else 0.0)
    return above, below, base, rest


@inlined
def arctan_joined(x: float, t: float, base: float, rest: float) -> float:
    """The arctangent of x from its reduced argument t; the polynomial is a minimax one, to 2e-18 on the interval."""
    z = t * t
    p = fma(z, -0.017803896394812563193, 0.037963903161110833033)
    p = fma(z, p, -0.050350497953124393166)
    p = fma(z, p, 0.058468667522751389837)
    p = fma(z, p, -0.06662950246036791267)
    p = fma(z, p, 0.07692045194561481467)
    p = fma(z, p, -0.090908968014728134434)
    p = fma(z, p, 0.11111110744657099602)
    p = fma(z, p, -0.14285714279244968487)
    p = fma(z, p, 0.19999999999940837328)
    p = fma(z, p, -0.33333333333333120948)
    angle = base + (t + fma(t * z, p, rest))
    return bits_float(float_bits(angle) ^ (float_bits(x) & -9223372036854775808))


@inlined
def arctan(x: float) -> float:
    """Arctangent of any finite x."""
    above, below, base, rest = arctan_reduced(x)
    return arctan_joined(x, above / below, base, rest)


@inlined
def log2(x: float) -> float:
    """Binary logarithm of a positive normal number, to 1e-9 absolute: for the step-size controller."""
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
    """2 to the power x for x within +-1000, to 1e-9 relative: for the step-size controller."""
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
