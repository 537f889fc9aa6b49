"""Proportional-integral step-size control (Gustafsson 1991; Hairer, Norsett & Wanner,
Solving ODEs II, IV.2).

The next step is h * 0.9 * err^-a * err_before^b, after a rejection h * 0.9 *
err^-(1/order). All is done in binary logarithms of the squared error, where it
vectorises. A step that gives NaN or infinity is rejected and shrunk like one of very
large error; should that go on down to the least step, the run has diverged.
"""

from __future__ import annotations

from nsdrill.abi import LIMIT, NONFINITE, NOTHING, UNDERFLOW, inlined
from nsdrill.elementary import exp2, fma, log2

INTEGRAL = 0.04  # b above; a = 1/order - 3/4 b (Hairer's choice for pairs of order 5)
# log2 of 0.9, written out: math.log2 may give another last bit elsewhere
SAFETY = -0.15200309344504995
GROWTH = 3.0  # at most 2^3 times the step
SHRINK = -3.0  # at least 2^-3 times the step
SMALLEST, LARGEST = 1e-16, 1e16  # bounds of the squared error for the logarithm


@inlined
def decide(  # type: ignore[no-untyped-def]
    square: float,
    step: float,
    last: float,
    growth: float,
    least: float,
    exhausted: bool,
    proportional: float,
    per_order: float,
):
    """From the squared error of a step (1 is the tolerance): (accepted, next step,
    memory, growth, attention).

    ``last`` and ``memory`` are log2 of the last accepted squared error; ``growth`` is
    log2 of how much the step may grow: not at all just after a rejection.
    ``proportional`` is a above, ``per_order`` one over the order of the method. All are
    floats, so that lanes stay packed.
    """
    accepted = square <= 1.0  # False for NaN
    finite = square < LARGEST
    bounded = max(square if finite else LARGEST, SMALLEST)
    level = log2(bounded)
    if_accepted = fma(-0.5 * proportional, level, fma(0.5 * INTEGRAL, last, SAFETY))
    if_rejected = fma(-0.5 * per_order, level, SAFETY)
    power = max(if_accepted if accepted else if_rejected, SHRINK)
    power = min(power, growth if accepted else -0.1)
    proposed = step * exp2(power)
    too_small = (not accepted) and proposed < least
    attention = (
        (UNDERFLOW if finite else NONFINITE) if too_small else (LIMIT if exhausted else NOTHING)
    )
    return accepted, proposed, level if accepted else last, GROWTH if accepted else 0.0, attention
