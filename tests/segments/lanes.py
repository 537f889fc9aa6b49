"""The compiled right-hand side of the string of segments at single states, and runs of
it, for the tests."""

from dataclasses import replace
from typing import Any

import numpy as np
from sweep.runs import run_work

from nsdrill.kernel.settings import Simulation
from nsdrill.models.operation import Values
from nsdrill.models.registry import described, model_named
from nsdrill.models.responses import Thresholds
from nsdrill.models.segments.parameters import Initial, Parameters
from nsdrill.models.tree import with_values
from nsdrill.models.variant import variant_at
from nsdrill.observe.thresholds import Record
from nsdrill.sweep.plan import Plan
from nsdrill.sweep.work import Work

MODEL = model_named("segments")
DEPTH, WOB, SPEED = 2200.0, 100e3, 13.0


def string(**values: Any) -> Parameters:
    """Parameters with some ``values``, by dotted keys with two underscores for a dot."""
    return with_values(Parameters(), {key.replace("__", "."): value for key, value in values.items()})


QUIET = {"bit__surface_amplitude": 0.0, "segments__hydraulics__pulsation": 0.0}
RINGING = {
    **QUIET,
    "segments__hydraulics__flow": 0.0,
    "mud__viscosity": 0.0,
    "mud__density": 0.0,
    "bit__friction__level": 0.0,
    "bit__cutting__zeta": 0.0,
    "segments__material_damping__axial": 0.0,
    "segments__material_damping__torsional": 0.0,
}


class Slopes:
    """``slopes(t, states)`` of the compiled right-hand side, states and result (n,
    columns) in the model's order."""

    def __init__(self, parameters: Parameters, wob: float = WOB, speed: float = SPEED, depth: float = DEPTH) -> None:
        self.points = Values(parameters, Initial(), (depth, wob, speed))
        self.variant = variant_at(MODEL, parameters)
        self.rows = self.variant.rows()
        self.function = self.variant.right_hand_side(8)
        self.table = MODEL.pack(self.points, Thresholds())[0]
        self.names = self.variant.names
        self.nodes = sum(self.variant.options[:2]) + 1

    def __call__(self, t: float, states: Any, phase: float = 0.0) -> Any:
        found = []
        states = np.atleast_2d(states)
        for first in range(0, len(states), 8):
            some = states[first : first + 8]
            buffer = np.zeros((self.rows.total, 8))
            buffer[self.rows.parameter : self.rows.parameter + self.rows.parameters] = self.table[:, None]
            buffer[self.rows.stage_time], buffer[self.rows.phase] = t, phase
            buffer[: self.rows.states, : len(some)] = some.T
            self.function(buffer.ravel())
            slopes = buffer[self.rows.acceleration :][: self.rows.slopes, : len(some)].T
            found.append(slopes)
        return np.concatenate(found)

    def steady(self) -> Any:
        """The state of steady drilling."""
        return MODEL.starts(self.points, 0)[0, :-1]

    def jacobian(self, at: Any, size: float = 1.0) -> Any:
        """d(rate of state)/d(state), by central differences of ``size``: exact where
        the rates are linear."""
        n = len(at)
        up, down = (self(0.0, at[None] + sign * size * np.eye(n)) for sign in (1, -1))
        slopes = ((up - down) / (2 * size)).T
        full = np.zeros((n, n))
        for pair in range(2 * self.nodes):
            full[2 * pair, 2 * pair + 1] = 1.0
            full[2 * pair + 1] = slopes[pair]
        full[-1] = slopes[-1]
        return full

    def axial(self, matrix: Any) -> Any:
        return matrix[: 2 * self.nodes, : 2 * self.nodes]

    def torsional(self, matrix: Any) -> Any:
        """The block of angles and speeds, with the current."""
        return matrix[2 * self.nodes :, 2 * self.nodes :]


def frequencies(matrix: Any) -> Any:
    """The imaginary parts of the eigenvalues that are above zero, ascending."""
    found = np.linalg.eigvals(matrix).imag
    return np.sort(found[found > 1e-6])


def run(
    parameters: Parameters,
    simulation: Simulation,
    initial: Initial = Initial(),  # noqa: B008  (frozen)
    depth: float = DEPTH,
    record: Record = Record(peaks=0),
    **axes: Any,
) -> dict[str, Any]:
    """The columns of a sweep over ``wob`` or ``rotary_speed``."""
    values = {"depth": depth, "wob": WOB, "rotary_speed": SPEED} | axes
    plan = Plan({name: np.atleast_1d(np.asarray(value, dtype=float)) for name, value in values.items()}, "same", None)
    thresholds = replace(Thresholds())
    return run_work(Work(plan, parameters, initial, simulation, thresholds, record, described("segments")))
