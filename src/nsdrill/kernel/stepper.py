"""One step of the embedded Runge-Kutta pair in every lane at once, each lane with its own time and step size.

States are positions and velocities in turn, so the stages of the positions follow from those of the velocities: only
accelerations are computed and kept (see :class:`nsdrill.kernel.tableau.Tableau`). The result is the pair's own, with
half the memory traffic, which is what limits a packed step.

A step runs from (``time``, ``start``, ``start_acceleration``) to (``time`` + ``step``, ``stage``, ``acceleration``).
The controller judges it and the observer is shown it. The lanes whose step was accepted (``moves``) move on when the
next step begins, or earlier by the loop's hand.
"""

from __future__ import annotations

from dataclasses import astuple
from functools import lru_cache
from typing import Any

from numba import types

from nsdrill.abi import BUFFER, CONTROL, MARK, OBSERVER, RIGHT_HAND_SIDE, Rows, compiled
from nsdrill.elementary import fma
from nsdrill.kernel.controller import decide
from nsdrill.kernel.tableau import TSITOURAS


@lru_cache
def make_stepper(lanes: int, rows: Rows) -> Any:
    """The compiled Tsitouras stepper for a number of lanes and a row layout."""
    W, N, M = lanes, rows.own, rows.pairs
    judged = N // 2  # pairs that have a say in the step size
    stage_, a7_, t_stage_ = W * rows.stage, W * rows.acceleration, W * rows.stage_time
    y_, a1_, drift_, lead_, size_ = (
        W * rows.start, W * rows.start_acceleration, W * rows.drift, W * rows.lead, W * rows.size)
    t_, h_, moves_ = W * rows.time, W * rows.step, W * rows.moves
    a2_, a3_, a4_, a5_, a6_ = (W * (rows.inner + i * M) for i in range(5))
    proposed_, mark_, last_, growth_, per_rtol_, least_, accepted_, rejected_, limit_, running_, attention_ = (
        W * (rows.control + i) for i in range(len(CONTROL)))
    pair = TSITOURAS
    _, c2, c3, c4, c5, _, _ = pair.nodes
    # Velocities v, positions x, errors e and d: weights of the accelerations at the stages before.
    (v21,), (v31, v32), (v41, v42, v43), (v51, v52, v53, v54), (v61, v62, v63, v64, v65), last_row = pair.matrix
    v71, v72, v73, v74, v75, v76 = last_row
    _, (x31,), (x41, x42), (x51, x52, x53), (x61, x62, x63, x64), (x71, x72, x73, x74, x75) = pair.positions
    e1, e2, e3, e4, e5, e6, e7 = pair.error
    d1, d2, d3, d4, d5, d6 = pair.position_error

    @compiled(types.int64(BUFFER, RIGHT_HAND_SIDE, OBSERVER, BUFFER), W, *astuple(rows))
    def stepper(b, right_hand_side, observer, store):  # type: ignore[no-untyped-def]
        # Stage by stage, in one pass over the pairs of position (row x) and velocity (row v): keep the acceleration
        # just computed and form the next stage. First of all, the lanes whose last step was accepted move on. (Both
        # values are loaded and one is selected: a masked store could not be forwarded to the loads that follow.)
        for i in range(W):
            moves = b[moves_ + i] != 0.0
            before, after = b[t_ + i], b[t_ + i] + b[h_ + i]
            t = after if moves else before
            h = min(b[proposed_ + i], b[mark_ + i] - t)
            b[t_ + i] = t
            b[h_ + i] = h
            b[t_stage_ + i] = fma(c2, h, t)
            for p in range(M):
                x, v, j = 2 * p * W + i, (2 * p + 1) * W + i, p * W + i
                x_before, x_after = b[y_ + x], b[stage_ + x]
                v_before, v_after = b[y_ + v], b[stage_ + v]
                a_before, a_after = b[a1_ + j], b[a7_ + j]
                position = x_after if moves else x_before
                velocity = v_after if moves else v_before
                a1 = a_after if moves else a_before
                lead = h * (velocity + b[drift_ + j])
                b[y_ + x] = position
                b[y_ + v] = velocity
                b[a1_ + j] = a1
                b[lead_ + j] = lead
                b[stage_ + x] = fma(c2, lead, position)
                b[stage_ + v] = fma(h, v21 * a1, velocity)
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            hh, newest = h * h, h * v32
            b[t_stage_ + i] = fma(c3, h, b[t_ + i])
            for p in range(M):
                x, v, j = 2 * p * W + i, (2 * p + 1) * W + i, p * W + i
                a1, a2 = b[a1_ + j], b[a7_ + j]
                b[a2_ + j] = a2
                b[stage_ + x] = fma(hh, x31 * a1, fma(c3, b[lead_ + j], b[y_ + x]))
                b[stage_ + v] = fma(newest, a2, fma(h, v31 * a1, b[y_ + v]))
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            hh, newest = h * h, h * v43
            b[t_stage_ + i] = fma(c4, h, b[t_ + i])
            for p in range(M):
                x, v, j = 2 * p * W + i, (2 * p + 1) * W + i, p * W + i
                a1, a2, a3 = b[a1_ + j], b[a2_ + j], b[a7_ + j]
                b[a3_ + j] = a3
                b[stage_ + x] = fma(hh, fma(x41, a1, x42 * a2), fma(c4, b[lead_ + j], b[y_ + x]))
                b[stage_ + v] = fma(newest, a3, fma(h, fma(v41, a1, v42 * a2), b[y_ + v]))
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            hh, newest = h * h, h * v54
            b[t_stage_ + i] = fma(c5, h, b[t_ + i])
            for p in range(M):
                x, v, j = 2 * p * W + i, (2 * p + 1) * W + i, p * W + i
                a1, a2, a3, a4 = b[a1_ + j], b[a2_ + j], b[a3_ + j], b[a7_ + j]
                b[a4_ + j] = a4
                b[stage_ + x] = fma(hh, fma(x51, a1, fma(x52, a2, x53 * a3)), fma(c5, b[lead_ + j], b[y_ + x]))
                b[stage_ + v] = fma(newest, a4, fma(h, fma(v51, a1, fma(v52, a2, v53 * a3)), b[y_ + v]))
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            hh, newest = h * h, h * v65
            b[t_stage_ + i] = b[t_ + i] + h
            for p in range(M):
                x, v, j = 2 * p * W + i, (2 * p + 1) * W + i, p * W + i
                a1, a2, a3, a4, a5 = b[a1_ + j], b[a2_ + j], b[a3_ + j], b[a4_ + j], b[a7_ + j]
                b[a5_ + j] = a5
                bend = fma(x61, a1, fma(x62, a2, fma(x63, a3, x64 * a4)))
                b[stage_ + x] = fma(hh, bend, b[lead_ + j] + b[y_ + x])
                rate = fma(v61, a1, fma(v62, a2, fma(v63, a3, v64 * a4)))
                b[stage_ + v] = fma(newest, a5, fma(h, rate, b[y_ + v]))
        right_hand_side(b)

        for i in range(W):
            h = b[h_ + i]
            hh, newest = h * h, h * v76
            for p in range(M):
                x, v, j = 2 * p * W + i, (2 * p + 1) * W + i, p * W + i
                a1, a2, a3, a4, a5, a6 = b[a1_ + j], b[a2_ + j], b[a3_ + j], b[a4_ + j], b[a5_ + j], b[a7_ + j]
                b[a6_ + j] = a6
                bend = fma(x71, a1, fma(x72, a2, fma(x73, a3, fma(x74, a4, x75 * a5))))
                b[stage_ + x] = fma(hh, bend, b[lead_ + j] + b[y_ + x])
                rate = fma(v71, a1, fma(v72, a2, fma(v73, a3, fma(v74, a4, v75 * a5))))
                b[stage_ + v] = fma(newest, a6, fma(h, rate, b[y_ + v]))
        right_hand_side(b)

        # The error of each state against its own tolerance rtol (size + |y|), squared and summed. The quotients of a
        # pair share one division.
        wanted = 0
        for i in range(W):
            h, proposal = b[h_ + i], b[proposed_ + i]
            total = 0.0
            for p in range(judged):
                x, v, j = 2 * p * W + i, (2 * p + 1) * W + i, p * W + i
                a1, a2, a3, a4, a5, a6 = b[a1_ + j], b[a2_ + j], b[a3_ + j], b[a4_ + j], b[a5_ + j], b[a6_ + j]
                error_x = h * fma(d1, a1, fma(d2, a2, fma(d3, a3, fma(d4, a4, fma(d5, a5, d6 * a6)))))
                error_v = fma(e1, a1, fma(e2, a2, fma(e3, a3, fma(e4, a4, fma(e5, a5, fma(e6, a6, e7 * b[a7_ + j]))))))
                scale_x = b[size_ + x] + max(abs(b[y_ + x]), abs(b[stage_ + x]))
                scale_v = b[size_ + v] + max(abs(b[y_ + v]), abs(b[stage_ + v]))
                cross_x, cross_v, both = error_x * scale_v, error_v * scale_x, scale_x * scale_v
                total += fma(cross_x, cross_x, cross_v * cross_v) / (both * both)
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

        return wanted

    return stepper
