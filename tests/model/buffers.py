"""A bare lane buffer for the right-hand side: what it reads, and what it wrote."""

from __future__ import annotations

import numpy as np

from nsdrill.abi import Rows
from nsdrill.model.rhs import AUX, PARAMETERS, STATES, make_right_hand_side

ROWS = Rows(len(STATES), len(AUX), len(PARAMETERS), 0)


def slopes(lanes: int, hertz: bool, table: np.ndarray, time: np.ndarray, states: np.ndarray) -> np.ndarray:
    """Compiled derivatives [n, 8] of ``states`` [n, 8] under lane parameters [n, ...], ``lanes`` at a time.

    ``n`` is a multiple of ``lanes``.
    """
    out = np.empty_like(states)
    function = make_right_hand_side(lanes, hertz)
    for first in range(0, len(states), lanes):
        rows = np.zeros((ROWS.total, lanes))
        here = slice(first, first + lanes)
        rows[ROWS.stage : ROWS.stage + ROWS.states] = states[here].T
        rows[ROWS.stage_time] = time[here]
        rows[ROWS.parameter : ROWS.parameter + ROWS.parameters] = table[here].T
        buffer = rows.ravel()
        function(buffer)
        out[here] = buffer.reshape(rows.shape)[ROWS.slope : ROWS.slope + ROWS.states].T
    return out
