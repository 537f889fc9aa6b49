"""A bare lane buffer for the right-hand side: what it reads, and what it wrote."""

import numpy as np
from strings import MAIN

from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.variant import variant_of

ROWS = variant_of(MAIN, Options()).rows()


def slopes_with(
    options: Options, tables: np.ndarray, times: np.ndarray, states: np.ndarray, lanes: int = 8
) -> np.ndarray:
    """Derivatives [n, states] of ``states`` under lane parameters [n, ...] as compiled
    with these options; the last lanes are filled with others once more."""
    rows = variant_of(MAIN, options).rows()
    out = np.empty_like(states)
    out[:, 0::2] = states[:, 1::2] + variant_of(MAIN, options).frame_rates(tables)
    for first in range(0, len(states), lanes):
        here = np.resize(np.arange(first, min(first + lanes, len(states))), lanes)
        buffer = np.zeros((rows.total, lanes))
        buffer[rows.stage : rows.stage + rows.states] = states[here].T
        buffer[rows.stage_time] = times[here]
        buffer[rows.parameter : rows.parameter + rows.parameters] = tables[here].T
        flat = buffer.ravel()
        variant_of(MAIN, options).right_hand_side(lanes)(flat)
        made = flat.reshape(rows.total, lanes)[rows.acceleration : rows.acceleration + rows.slopes]
        out[here, 1::2] = made.T
    return out


def slopes(
    lanes: int,
    hertz: bool,
    table: np.ndarray,
    time: np.ndarray,
    states: np.ndarray,
    lobes: int | np.ndarray = 3,
    friction: int = 0,
) -> np.ndarray:
    """The same of the plain string, whose ``lobes`` may differ from state to state."""
    out = np.empty_like(states)
    lobes = np.broadcast_to(lobes, len(states))
    for number in np.unique(lobes):
        same = np.flatnonzero(lobes == number)
        options = Options(int(hertz), int(number), friction=friction)
        out[same] = slopes_with(options, table[same], time[same], states[same], lanes)
    return out


def buffer_of(table: np.ndarray, time: np.ndarray, states: np.ndarray, rest: float = 0.0) -> np.ndarray:
    """The lane buffer with these lanes, everything else filled with ``rest``."""
    rows = np.full((ROWS.total, len(states)), rest)
    rows[ROWS.stage : ROWS.stage + ROWS.states] = states.T
    rows[ROWS.stage_time] = time
    rows[ROWS.parameter : ROWS.parameter + ROWS.parameters] = table.T
    return rows.ravel()
