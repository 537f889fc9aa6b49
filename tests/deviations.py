"""The deviation that a run follows, beside the difference of two neighbouring runs."""

from dataclasses import replace

import numpy as np
from sweep.runs import finish

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
