"""A deviation by the difference of two right-hand sides, for models that are written in lanes and not linearised.

The right-hand side is evaluated at the state plus and minus a small part of the deviation, and then at the state
itself, so that the motion has the very bits that it has without a deviation. What a contact changes between the two
states the difference sees; a step in which a contact begins or ends is not made anew.
"""

from __future__ import annotations

from typing import Any

from numba import types

from nsdrill.abi import BUFFER, Rows, compiled
from nsdrill.scalar import STEP


def rows_to_keep(own: int, apart: int) -> int:
    """How many rows a difference keeps meanwhile: the ``own`` states, and two for each slope whose friction is
    ``apart``."""
    return own + 2 * apart.bit_count()


def make_differences(motion: Any, lanes: int, rows: Rows, first: int, *identity: int) -> Any:
    """The compiled right-hand side of the motion and of one deviation from it, from ``motion``, the compiled right-hand
    side in a buffer of these ``rows`` with companions. It keeps numbers in the :func:`rows_to_keep` from ``first`` on;
    ``identity`` tells models apart."""
    W, own, slopes = lanes, rows.own, rows.own_slopes
    state_, deviation_, kept_ = W * rows.stage, W * (rows.stage + own), W * first
    slope_, deviated_ = W * rows.acceleration, W * (rows.acceleration + slopes)
    pushes = tuple(p for p in rows.pushed if p < slopes)
    apart = len(pushes)
    push_, pushed_ = W * rows.push, W * (rows.push + apart)
    above_ = W * (first + own)
    # Where friction is implicit, the right-hand side solves for velocities and leaves them among the states.
    solved = tuple(W * (2 * p + 1) for p in pushes) or (0,)

    @compiled(types.void(BUFFER), W, *identity)
    def differences(b):  # type: ignore[no-untyped-def]
        for j in range(own * W):
            b[kept_ + j] = b[state_ + j]
            b[state_ + j] = b[kept_ + j] + STEP * b[deviation_ + j]
        motion(b)
        for j in range(slopes * W):
            b[deviated_ + j] = b[slope_ + j]
        for k in range(apart):
            for i in range(W):
                b[above_ + 2 * k * W + i] = b[state_ + solved[k] + i]
                b[above_ + (2 * k + 1) * W + i] = b[push_ + k * W + i]
        for j in range(own * W):
            b[state_ + j] = b[kept_ + j] - STEP * b[deviation_ + j]
        motion(b)
        for j in range(slopes * W):
            b[deviated_ + j] = (b[deviated_ + j] - b[slope_ + j]) * (0.5 / STEP)
        for k in range(apart):
            for i in range(W):
                v = (b[above_ + 2 * k * W + i] - b[state_ + solved[k] + i]) * (0.5 / STEP)
                b[deviation_ + solved[k] + i] = v
                b[pushed_ + k * W + i] = (b[above_ + (2 * k + 1) * W + i] - b[push_ + k * W + i]) * (0.5 / STEP)
        for j in range(own * W):
            b[state_ + j] = b[kept_ + j]
        motion(b)

    return differences
