"""The main model by a few words: its lane parameters and starts at operating points."""

from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.columns import PARAMETERS, STATES
from nsdrill.models.christoforou_yigit.parameters import Initial, Parameters
from nsdrill.models.operation import Values
from nsdrill.models.registry import model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.variant import variant_at
from nsdrill.variables import MODEL

MAIN = model_named(MODEL)
__all__ = ["FAILS_FIRST", "MAIN", "PARAMETERS", "STATES", "forces", "pack", "starts"]


def _values(parameters: Parameters, initial: Initial, operation: tuple[Any, ...]) -> Values:
    depth, wob, speed = (np.atleast_1d(np.asarray(value, dtype=float)) for value in operation)
    return Values(parameters, initial, (depth, wob, speed))


def pack(parameters: Parameters, depth: Any, wob: Any, rotary_speed: Any, stuck_below: float = 0.3) -> np.ndarray:
    """The lane parameters [points, columns]."""
    points = _values(parameters, Initial(), (depth, wob, rotary_speed))
    return MAIN.pack(points, Thresholds(stuck_below=stuck_below))


def forces(parameters: Parameters, operation: Any, state: Any) -> dict[str, np.ndarray]:
    """The variables of a trace besides the states, at states."""
    points = Values(parameters, Initial(), (operation.depth, operation.wob, operation.rotary_speed))
    return variant_at(MAIN, parameters).outputs(points, state)


def starts(
    parameters: Parameters, initial: Initial, depth: Any, wob: Any, rotary_speed: Any, start: Any = 0
) -> np.ndarray:
    """The initial states [points, states + 1] of the starts with these numbers."""
    return MAIN.starts(_values(parameters, initial, (depth, wob, rotary_speed)), start)


# No drive turns a string off its speed here; the first run fails where steps are few.
FAILS_FIRST = """
modes: {axial: frozen, lateral: frozen}
initial: {twist: -4.6 rad}
operation: {wob: 22 kN}
sweep: {rotary_speed: [1 rad/s, 2.9 rad/s, 3.2 rad/s, 5 rad/s], procedure: up, along: rotary_speed}
simulation: {transient: 300 s, observe: 60 s, max_steps: 2500}
"""
