"""A bare lane buffer for the right-hand side: what it reads, and what it wrote."""

import numpy as np
from main_model import MAIN

from nsdrill.models.christoforou_yigit.columns import Options

ROWS = MAIN.rows(Options())


def slopes(
    lanes: int,
    hertz: bool,
    table: np.ndarray,
    time: np.ndarray,
    states: np.ndarray,
    lobes: int | np.ndarray = 3,
    friction: int = 0,
) -> np.ndarray:
    """Derivatives [n, 8] of ``states`` [n, 8] under lane parameters [n, ...], the
    accelerations as compiled for ``lanes`` lanes. ``lobes`` may differ from state to
    state."""
    out = np.empty_like(states)
    positions, velocities = slice(0, None, 2), slice(1, None, 2)
    out[:, positions] = states[:, velocities] + MAIN.frame_rates(table, Options())
    lobes = np.broadcast_to(lobes, len(states))
    for number in np.unique(lobes):
        same = np.flatnonzero(lobes == number)
        function = MAIN.right_hand_side(lanes, Options(int(hertz), int(number), friction=friction))
        for first in range(0, len(same), lanes):
            here = same[first : first + lanes]
            filled = np.resize(here, lanes)  # the last lanes once more, where too few are left
            buffer = buffer_of(table[filled], time[filled], states[filled])
            function(buffer)
            rows = buffer.reshape(ROWS.total, lanes)[ROWS.acceleration : ROWS.acceleration + ROWS.slopes]
            out[here, velocities] = rows.T[: len(here)]
    return out


def buffer_of(table: np.ndarray, time: np.ndarray, states: np.ndarray, rest: float = 0.0) -> np.ndarray:
    """The lane buffer with these lanes, everything else filled with ``rest``."""
    rows = np.full((ROWS.total, len(states)), rest)
    rows[ROWS.stage : ROWS.stage + ROWS.states] = states.T
    rows[ROWS.stage_time] = time
    rows[ROWS.parameter : ROWS.parameter + ROWS.parameters] = table.T
    return rows.ravel()
