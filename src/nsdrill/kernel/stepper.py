"""One step of the embedded Runge-Kutta pair in every lane at once, each lane with its own time and step size.

A step runs from (``time``, ``start``, ``start_slope``) to (``time`` + ``step``, ``stage``, ``slope``). The controller
judges it, the observer is shown it, and then the lanes whose step was accepted move on.
"""

from __future__ import annotations

from dataclasses import astuple
from functools import lru_cache
from typing import Any

from numba import types

from nsdrill.abi import BUFFER, CONTROL, MARK, OBSERVER, RIGHT_HAND_SIDE, Rows, compiled
from nsdrill.elementary import fma
from nsdrill.kernel.controller import decide
from nsdrill.kernel.tableau import DORMAND_PRINCE


@lru_cache
def make_stepper(lanes: int, rows: Rows) -> Any:
    """The compiled Dormand-Prince stepper for a number of lanes and a row layout."""
    W, N = lanes, rows.states
    stage_, slope_, t_stage_ = W * rows.stage, W * rows.slope, W * rows.stage_time
    y_, k1_, t_, h_, moves_ = W * rows.start, W * rows.start_slope, W * rows.time, W * rows.step, W * rows.moves
    k2_, k3_, k4_, k5_, k6_ = (W * (rows.inner_slope + i * N) for i in range(5))
    size_ = W * rows.size
    proposed_, mark_, last_, growth_, per_rtol_, least_, accepted_, rejected_, limit_, running_, attention_ = (
        W * (rows.control + i) for i in range(len(CONTROL)))
    _, c2, c3, c4, c5, _, _ = DORMAND_PRINCE.nodes
    (a21,), (a31, a32), (a41, a42, a43), (a51, a52, a53, a54), (a61, a62, a63, a64, a65), last_row = (
        DORMAND_PRINCE.matrix)
    b1, _, b3, b4, b5, b6 = last_row
    e1, _, e3, e4, e5, e6, e7 = DORMAND_PRINCE.error
    V = N * W

    @compiled(types.int64(BUFFER, RIGHT_HAND_SIDE, OBSERVER, BUFFER), W, *astuple(rows))
    def stepper(b, right_hand_side, observer, store):  # type: ignore[no-untyped-def]
        # Stage by stage: keep the slope just computed and form the next stage, in one pass over the states.
        for i in range(W):
            h = min(b[proposed_ + i], b[mark_ + i] - b[t_ + i])
            b[h_ + i] = h
            b[t_stage_ + i] = fma(c2, h, b[t_ + i])
            for j in range(i, V + i, W):
                b[stage_ + j] = fma(h, a21 * b[k1_ + j], b[y_ + j])
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            b[t_stage_ + i] = fma(c3, h, b[t_ + i])
            for j in range(i, V + i, W):
                k2 = b[slope_ + j]
                b[k2_ + j] = k2
                b[stage_ + j] = fma(h, fma(a31, b[k1_ + j], a32 * k2), b[y_ + j])
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            b[t_stage_ + i] = fma(c4, h, b[t_ + i])
            for j in range(i, V + i, W):
                k3 = b[slope_ + j]
                b[k3_ + j] = k3
                b[stage_ + j] = fma(h, fma(a41, b[k1_ + j], fma(a42, b[k2_ + j], a43 * k3)), b[y_ + j])
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            b[t_stage_ + i] = fma(c5, h, b[t_ + i])
            for j in range(i, V + i, W):
                k4 = b[slope_ + j]
                b[k4_ + j] = k4
                rate = fma(a51, b[k1_ + j], fma(a52, b[k2_ + j], fma(a53, b[k3_ + j], a54 * k4)))
                b[stage_ + j] = fma(h, rate, b[y_ + j])
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            b[t_stage_ + i] = b[t_ + i] + h
            for j in range(i, V + i, W):
                k5 = b[slope_ + j]
                b[k5_ + j] = k5
                rate = fma(a61, b[k1_ + j], fma(a62, b[k2_ + j], fma(a63, b[k3_ + j], fma(a64, b[k4_ + j], a65 * k5))))
                b[stage_ + j] = fma(h, rate, b[y_ + j])
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            for j in range(i, V + i, W):
                k6 = b[slope_ + j]
                b[k6_ + j] = k6
                rate = fma(b1, b[k1_ + j], fma(b3, b[k3_ + j], fma(b4, b[k4_ + j], fma(b5, b[k5_ + j], b6 * k6))))
                b[stage_ + j] = fma(h, rate, b[y_ + j])
        right_hand_side(b)

        # The error of each state against its own tolerance rtol (size + |y|), squared and summed. The quotients of a
        # pair of states share one division.
        wanted = 0
        for i in range(W):
            total = 0.0
            for j in range(i, V + i, 2 * W):
                m = j + W
                error_1 = fma(e1, b[k1_ + j], fma(e3, b[k3_ + j], fma(e4, b[k4_ + j], fma(
                    e5, b[k5_ + j], fma(e6, b[k6_ + j], e7 * b[slope_ + j])))))
                error_2 = fma(e1, b[k1_ + m], fma(e3, b[k3_ + m], fma(e4, b[k4_ + m], fma(
                    e5, b[k5_ + m], fma(e6, b[k6_ + m], e7 * b[slope_ + m])))))
                scale_1 = b[size_ + j] + max(abs(b[y_ + j]), abs(b[stage_ + j]))
                scale_2 = b[size_ + m] + max(abs(b[y_ + m]), abs(b[stage_ + m]))
                cross_1, cross_2, both = error_1 * scale_2, error_2 * scale_1, scale_1 * scale_2
                total += fma(cross_1, cross_1, cross_2 * cross_2) / (both * both)
            h, proposal = b[h_ + i], b[proposed_ + i]
            ratio = h * b[per_rtol_ + i]
            tries = b[accepted_ + i] + b[rejected_ + i] + 1.0
            accepted, proposed, last, growth, attention = decide(
                total * (1.0 / N) * (ratio * ratio), h, b[last_ + i], b[growth_ + i], b[least_ + i],
                tries >= b[limit_ + i])
            # A step cut short by a mark says little about the next one: the earlier proposal stands.
            cut = h < proposal
            at_mark = accepted and h >= b[mark_ + i] - b[t_ + i]
            proposed = max(proposed, proposal) if (accepted and cut) else proposed
            attention = MARK if at_mark else attention
            running = b[running_ + i]
            b[proposed_ + i] = proposed
            b[last_ + i] = last
            b[growth_ + i] = growth
            b[accepted_ + i] += running if accepted else 0.0
            b[rejected_ + i] += 0.0 if accepted else running
            b[moves_ + i] = 1.0 if accepted else 0.0
            b[attention_ + i] = attention * running
            wanted |= 0 if attention * running == 0.0 else 1

        observer(b, store)

        # Commit: the accepted lanes move on.
        for i in range(W):
            accepted = b[moves_ + i] != 0.0
            for j in range(i, V + i, W):
                b[y_ + j] = b[stage_ + j] if accepted else b[y_ + j]
                b[k1_ + j] = b[slope_ + j] if accepted else b[k1_ + j]
            moved = b[t_ + i] + b[h_ + i]
            now = b[mark_ + i] if b[attention_ + i] == MARK else moved
            b[t_ + i] = now if accepted else b[t_ + i]
        return wanted

    return stepper
