"""Models made from equations, observed as declared, through the real kernel."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.abi import Layout
from nsdrill.equations.motion import Motion
from nsdrill.kernel.batch import Batch, Compiled, FinishedRuns, Runs
from nsdrill.kernel.settings import Simulation
from nsdrill.observe.channels import Declaration, Names
from nsdrill.observe.declared import make_observer, observed_rows
from nsdrill.observe.findings import measured, new_store, outcome_width, peaks_of, returns_of

# Rows for the observer, more than most declarations here want: models of one size share
# the compiled loop.
ROOM = 40


@dataclass(frozen=True)
class Model:
    """The equations of ``names``, with so many states of first order."""

    equations: Callable[..., Any]
    names: Names
    singles: int = 0

    def rows(self, declaration: Declaration) -> Layout:
        observed = max(ROOM, observed_rows(declaration))
        return Layout(len(self.names.states), 0, len(self.names.parameters), observed, singles=self.singles)

    def right_hand_side(self, lanes: int, rows: Layout) -> Any:
        states = self.names.states
        pairs = len(states) - self.singles
        slopes = (*states[1:pairs:2], *states[pairs:])
        motion = Motion(self.equations, None, states, self.names.parameters, slopes)
        return motion.right_hand_side(lanes, rows)


@dataclass
class Observed:
    """What came out, arrays over the runs in their order."""

    found: dict[str, np.ndarray]
    peaks: dict[str, np.ndarray]
    returns: np.ndarray
    report: np.ndarray
    final: np.ndarray


def observe(
    model: Model,
    declaration: Declaration,
    parameters: Any,
    start: Any,
    simulation: Simulation,
    lanes: int = 8,
    *,
    peaks: int = 8,
    returns: int = 0,
    frame_rates: Any = 0.0,
    first_step: float = 1e-3,
    order: Any = None,
    chained: bool = False,
) -> Observed:
    """All runs side by side, queued in ``order``, or each from where the one before
    ended. ``start`` is [states], with the phase [states + 1], or [runs, states]. All
    natural scales are 1."""
    parameters = np.atleast_2d(np.asarray(parameters, dtype=float))
    count, rows, names = len(parameters), model.rows(declaration), model.names
    batch = Batch(
        lanes,
        count,
        rows,
        new_store(lanes, names, declaration, peaks, returns),
        outcome_width(names, declaration, peaks, returns),
        simulation,
    )
    initial = np.zeros((count, rows.states + 1))
    initial[:, : np.shape(start)[-1]] = start
    state_scales = np.ones((count, rows.states))
    order = np.arange(count) if order is None else np.asarray(order)
    frame_rate = np.broadcast_to(np.asarray(frame_rates, dtype=float), (count, rows.slopes))
    (batch.add if chained else batch.add_many)(
        order,
        Runs(
            parameters[order],
            state_scales[order],
            frame_rate[order],
            np.zeros(count),
            np.full(count, first_step),
            initial[order],
        ),
    )
    parts = Compiled(model.right_hand_side(lanes, rows), *make_observer(lanes, rows, names, declaration))
    done: list[FinishedRuns] = []
    while not batch.idle:
        done.append(batch.advance(parts, 60.0, True))
    back = np.argsort(np.concatenate([part.job for part in done]))
    status, report, final = (
        np.concatenate([getattr(part, name) for part in done])[back] for name in ("status", "outcome", "final")
    )
    assert (status == 1).all()
    return Observed(
        measured(names, declaration, report, parameters, state_scales, simulation.observe),
        peaks_of(declaration, report, peaks),
        returns_of(names, declaration, report, peaks, returns),
        report,
        final,
    )


def with_feature(declaration: Declaration, *features: Any) -> Declaration:
    return replace(declaration, features=(*declaration.features, *features))
