"""A deviation by the difference of two right-hand sides, for models that are written in
lanes and not linearised.

The right-hand side is evaluated at the state plus and minus a small part of the
deviation, and then at the state itself, so that the motion has the same bits as without
a deviation. Where a contact is open at one of the two states and closed at the other,
the difference is one-sided: between the state itself and that one of the two at which
the contact is as it was at the start of the step. So steps that land on contacts
(:mod:`nsdrill.observe.landing`) have the slopes of one side of the contact.
"""

from __future__ import annotations

from typing import Any

from nsdrill.abi import RATES, Rows
from nsdrill.compiler.functions import BUFFER, compiled
from nsdrill.compiler.words import packed
from nsdrill.scalar import STEP

Touch = tuple[int, int]


def rows_to_keep(own: int, slopes: int, implicit: int, contacts: int = 0) -> int:
    """The number of rows in which a difference keeps intermediate results, with ``own``
    states and ``slopes`` of the motion; ``implicit`` has a bit for each slope with
    implicit friction."""
    return own + slopes + 4 * implicit.bit_count() + contacts + 1


def make_differences(
    motion: Any,
    lanes: int,
    rows: Rows,
    first: int,
    *identity: int,
    touches: tuple[Touch, ...] = (),
    place: int = 0,
) -> Any:
    """The compiled right-hand side of the motion and of one deviation from it, from
    ``motion``, the compiled right-hand side in a buffer of these ``rows`` with tangent
    states. Intermediate results are in the :func:`rows_to_keep` from ``first`` on;
    ``identity`` are whole numbers that distinguish models and variants.

    Each of the ``touches`` is a contact, given by two rows: it is closed where the
    value in the first row, which ``motion`` writes, is above that in the second one, or
    above zero where this is -1. The contact functions at the start of the step are in
    the observer's rows, from ``place`` on."""
    W, own, slopes = lanes, rows.own, rows.own_slopes
    state_, deviation_, kept_ = W * rows.stage, W * (rows.stage + own), W * first
    slope_, above_, below_ = (
        W * rows.acceleration,
        W * (rows.acceleration + slopes),
        W * (first + own),
    )
    pushes = tuple(p for p in rows.pushed if p < slopes)
    pushed, contacts = len(pushes), len(touches)
    push_, pushed_ = W * rows.push, W * (rows.push + pushed)
    solved_ = below_ + W * slopes  # for each push: velocity and push above, then below
    closed_ = solved_ + 4 * W * pushed
    side_ = closed_ + W * contacts
    start_ = W * (rows.observer + place)
    # Where friction is implicit, the right-hand side solves for velocities and stores
    # them among the states.
    velocity = tuple(W * (2 * p + 1) for p in pushes) or (0,)
    value = tuple(W * row for row, _ in touches) or (0,)
    limit = tuple(W * row if row >= 0 else -1 for _, row in touches) or (0,)

    @compiled(BUFFER)
    def differences(b):  # type: ignore[no-untyped-def]
        for j in packed(own * W):
            b[kept_ + j] = b[state_ + j]
            b[state_ + j] = b[kept_ + j] + STEP * b[deviation_ + j]
        motion(b)
        for j in packed(slopes * W):
            b[above_ + j] = b[slope_ + j]
        for k in range(pushed):
            for i in packed(W):
                b[solved_ + 4 * k * W + i] = b[state_ + velocity[k] + i]
                b[solved_ + (4 * k + 1) * W + i] = b[push_ + k * W + i]
        for c in range(contacts):
            for i in packed(W):
                threshold = b[limit[c] + i] if limit[c] >= 0 else 0.0
                b[closed_ + c * W + i] = 1.0 if b[value[c] + i] > threshold else 0.0
        for j in packed(own * W):
            b[state_ + j] = b[kept_ + j] - STEP * b[deviation_ + j]
        motion(b)
        for j in packed(slopes * W):
            b[below_ + j] = b[slope_ + j]
        for k in range(pushed):
            for i in packed(W):
                b[solved_ + (4 * k + 2) * W + i] = b[state_ + velocity[k] + i]
                b[solved_ + (4 * k + 3) * W + i] = b[push_ + k * W + i]
        for i in packed(W):
            b[side_ + i] = 0.0
        for c in range(contacts):
            for i in packed(W):
                threshold = b[limit[c] + i] if limit[c] >= 0 else 0.0
                closed_below = 1.0 if b[value[c] + i] > threshold else 0.0
                closed_above, closed_at_start = (
                    b[closed_ + c * W + i],
                    1.0 if b[start_ + RATES * c * W + i] > 0.0 else 0.0,
                )
                one_sided = 1.0 if closed_above == closed_at_start else -1.0
                b[side_ + i] = one_sided if closed_above != closed_below else b[side_ + i]
        for j in packed(own * W):
            b[state_ + j] = b[kept_ + j]
        motion(b)
        for k in range(slopes):
            for i in packed(W):
                j, side = k * W + i, b[side_ + i]
                upper = b[slope_ + j] if side < 0.0 else b[above_ + j]
                lower = b[slope_ + j] if side > 0.0 else b[below_ + j]
                b[above_ + j] = (upper - lower) * ((0.5 if side == 0.0 else 1.0) / STEP)
        for k in range(pushed):
            for i in packed(W):
                side, velocity_ = b[side_ + i], state_ + velocity[k] + i
                scale = (0.5 if side == 0.0 else 1.0) / STEP
                upper = b[velocity_] if side < 0.0 else b[solved_ + 4 * k * W + i]
                lower = b[velocity_] if side > 0.0 else b[solved_ + (4 * k + 2) * W + i]
                b[deviation_ + velocity[k] + i] = (upper - lower) * scale
                upper = b[push_ + k * W + i] if side < 0.0 else b[solved_ + (4 * k + 1) * W + i]
                lower = b[push_ + k * W + i] if side > 0.0 else b[solved_ + (4 * k + 3) * W + i]
                b[pushed_ + k * W + i] = (upper - lower) * scale

    return differences
