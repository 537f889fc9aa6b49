"""Proportional-integral step-size control (Gustafsson 1991; Hairer, Norsett & Wanner,
Solving ODEs II, IV.2).

The next step is h * 0.9 * err^-a * err_before^b, after a rejection h * 0.9 *
err^-(1/order). All is done in binary logarithms of the squared error, where it
vectorises. A step that gives NaN or infinity is rejected and shrunk like one of very
large error; if that continues down to the least step, the run has diverged.
"""

from __future__ import annotations

from nsdrill.abi import LIMIT, NONFINITE, NOTHING, UNDERFLOW
from nsdrill.compiler.functions import fma, inlined
from nsdrill.elementary import exp2, log2

INTEGRAL = 0.04  # b above; a = 1/order - 3/4 b (Hairer's choice for pairs of order 5)
# log2 of 0.9, written out: math.log2 may give another last bit elsewhere
SAFETY = -0.15200309344504995
GROWTH = 3.0  # at most 2^3 times the step
SHRINK = -3.0  # at least 2^-3 times the step
SMALLEST, LARGEST = 1e-16, 1e16  # bounds of the squared error for the logarithm


@inlined
def decide(  # type: ignore[no-untyped-def]
    squared_error: float,
    step: float,
    last_level: float,
    growth: float,
    least_step: float,
    exhausted: bool,
    proportional: float,
    per_order: float,
):
    """The decision on a step of length ``step`` from its squared error (1 is the
    tolerance): (accepted, next step, level, growth, attention).

    ``last_level`` and ``level`` are log2 of the last accepted squared error; ``growth``
    is log2 of the largest factor by which the step may grow, 0 just after a rejection.
    A proposal below ``least_step`` after a rejection, and ``exhausted``, the last
    allowed try, ask for attention. ``proportional`` is a above, ``per_order`` one over
    the order of the method. All are floats, so that lanes stay packed.
    """
    accepted = squared_error <= 1.0  # False for NaN
    finite = squared_error < LARGEST
    bounded = max(squared_error if finite else LARGEST, SMALLEST)
    level = log2(bounded)
    if_accepted = fma(-0.5 * proportional, level, fma(0.5 * INTEGRAL, last_level, SAFETY))
    if_rejected = fma(-0.5 * per_order, level, SAFETY)
    log2_factor = max(if_accepted if accepted else if_rejected, SHRINK)
    log2_factor = min(log2_factor, growth if accepted else -0.1)
    proposed = step * exp2(log2_factor)
    too_small = (not accepted) and proposed < least_step
    attention = (UNDERFLOW if finite else NONFINITE) if too_small else (LIMIT if exhausted else NOTHING)
    return (accepted, proposed, level if accepted else last_level, GROWTH if accepted else 0.0, attention)
