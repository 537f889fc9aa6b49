"""The deviation that a run follows, and the tangent, beside differences of neighbours."""

from dataclasses import replace
from typing import Any

import numpy as np
from sweep.runs import finish

from nsdrill.abi import RATES
from nsdrill.models.variant import Variant
from nsdrill.observe.exponent import GROWTH_HEADER
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.work import Work

APART = 1e-5  # of the start of the neighbours, in natural scales


def followed_and_quotient(work: Work, rtol: float = 1e-12) -> tuple[np.ndarray, np.ndarray]:
    """The deviation at the end of the run of ``work`` at its own tolerance, and the
    quotient of two runs whose starts are moved along it, at ``rtol``; both in natural
    state_scales."""
    work = replace(work, record=Record(exponent=True))
    n = work.state_count
    size = work.prepare(np.array([0])).state_scales[0, :n]
    after, before = (_end(work, shift, rtol)[:n] for shift in (APART, -APART))
    followed = _end(work, 0.0, work.simulation.rtol)[n : 2 * n]
    return followed / size, (after - before) / (2 * APART) / size


def _end(work: Work, shift: float, rtol: float) -> np.ndarray:
    one = replace(work, simulation=replace(work.simulation, rtol=rtol))
    runs, batch, n = one.prepare(np.array([0])), one.new_batch(8, 1), one.state_count
    runs.initial[0, :n] += shift * runs.initial[0, n : 2 * n]
    batch._store[GROWTH_HEADER] = np.inf  # the deviation keeps its length
    batch.add(np.array([0]), runs)
    return finish(one, batch)[-1].final[0]


def tangent_and_difference(
    variant: Variant,
    table: np.ndarray,
    state: np.ndarray,
    deviation: np.ndarray,
    contact: np.ndarray,
    *,
    step: float,
    implicit: bool,
    phase: np.ndarray | float = 0.0,
    time: np.ndarray | float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """The tangent along the ``deviation`` at the states in the columns of ``state``, with
    the row ``contact`` of the observer, and the difference of fourth order: of the slopes,
    and of an ``implicit`` stage of pushes and moved velocities too."""
    lanes, parts_of_stage = state.shape[1], 3 if implicit else 1
    rows, plain = variant.rows(RATES, tangent=True), variant.rows()

    def buffer(of: Any, states: np.ndarray) -> np.ndarray:
        b = np.zeros((of.total, lanes))
        b[of.parameter : of.parameter + of.parameters] = table.T
        b[of.phase], b[of.stage_time], b[: of.own] = phase, time, states
        if implicit:
            b[of.relax] = 1e-4
        return b

    def slopes(shift: float) -> np.ndarray:
        b = buffer(plain, state + shift * step * deviation)
        variant.right_hand_side(lanes)(b.ravel())
        own, push = plain.own, len(plain.pushed)
        made = b[plain.acceleration :][: plain.slopes], b[plain.push :][:push], b[:own]
        return np.concatenate(made[:parts_of_stage])

    b = buffer(rows, state)
    b[rows.own : 2 * rows.own] = deviation
    b[rows.observer] = contact
    assert 0 < np.sum(b[rows.observer] > 0.0) < lanes
    variant.tangent(lanes, 0)(b.ravel())
    push = len(rows.pushed) // 2
    found = b[rows.acceleration + rows.own_slopes :][: rows.own_slopes]
    parts = found, b[rows.push + push :][:push], b[rows.own : 2 * rows.own]
    exact = (8 * (slopes(1) - slopes(-1)) - (slopes(2) - slopes(-2))) / (12 * step)
    return np.concatenate(parts[:parts_of_stage]), exact
