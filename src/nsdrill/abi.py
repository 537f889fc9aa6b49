"""What compiled modules share: the kinds of compiled functions, the layout of the lane
buffer, and the marks of a run.

**Lanes.** The kernel integrates ``lanes`` trajectories side by side, one per element of
the processor's vector registers. All numbers of a trajectory are in a column of one
flat float64 buffer, row after row::

    buffer[row * lanes + lane]

A loop over the lanes of one or several rows then compiles to packed instructions. That
holds only if all rows are in this one buffer and ``lanes`` and the row numbers are
compile-time constants; so the compiled functions are made by small factories,
``make_...(lanes)``, and the row numbers come from :class:`Layout`.
"""

from __future__ import annotations

import hashlib
from dataclasses import field, fields
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill.compiler.functions import BUFFER, FUNCTION, INTEGER
from nsdrill.records import dataclass

# The package's folders whose sources end up in compiled code.
COMPILED = ("abi.py", "elementary.py", "compiler", "equations", "models", "kernel", "observe")

# A right-hand side reads the rows `stage`, `stage_time`, `phase` and `parameter`, and
# writes `acceleration` and `aux_now`; one with implicit friction (`Layout.implicit`) reads
# `relax`, writes `push` and `falling`, and moves the velocities among the `stage` rows.
RIGHT_HAND_SIDE = BUFFER
# An observer is called after every packed step, with the lane buffer and its store.
OBSERVER = BUFFER + BUFFER
# A stepper (buffer, right-hand side, observer, store) tries one step in every lane,
# calls the observer, and returns 1 if some lane needs attention, else 0.
STEPPER = BUFFER + FUNCTION + FUNCTION + BUFFER
# A marker is called at each mark of a run (buffer, store, lane, mark, row of the
# outbox, first column) and writes the observer's outcome to the row, from that column
# on.
MARKER = BUFFER + BUFFER + INTEGER + INTEGER + BUFFER + INTEGER

# The marks: the observation begins, is half over, ends.
OPENS, HALVES, CLOSES = range(3)


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Digest of all compiled sources and of the version of LLVM's library."""
    from importlib.metadata import version

    digest = hashlib.sha256()
    root = Path(__file__).parent
    for name in COMPILED:
        path = root / name
        for file in [path] if path.suffix else sorted(path.rglob("*.py")):
            digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    digest.update(version("llvmlite").encode())
    return digest.hexdigest()[:16]


CACHE_LINE = 8  # numbers


def aligned_zeros(size: int) -> np.ndarray:
    """Zeros that begin on a cache line: a packed load or store that straddles two lines
    costs twice."""
    raw = np.zeros(size + CACHE_LINE)
    offset = -(raw.ctypes.data // raw.itemsize) % CACHE_LINE
    return raw[offset : offset + size]


def _row() -> Any:
    return field(init=False, repr=False, compare=False)


@dataclass(frozen=True)
class Layout:
    """Row numbers of the lane buffer for a model of ``states`` states, ``aux``
    auxiliary outputs and ``parameters`` parameters, an observer with ``observed`` rows
    of its own and a stepper with ``private`` ones.

    **States.** Positions and velocities alternate: position' = velocity + frame rate,
    velocity' = slope, where the frame of a position may rotate with the drive. After
    these pairs come ``singles`` states of first order, state' = slope. The model reads
    ``stage``, ``stage_time``, ``phase`` and ``parameter`` and writes ``acceleration``
    and ``aux_now``; the observer also reads the ends of the step; the other rows belong
    to the kernel.

    **Tangent states.** The last ``tangent_states`` of the states follow the others,
    which are the model's own, like the tangent vector of a Lyapunov exponent. There are
    none or as many as own states. They do not influence the step size and start again
    in every run of a chain, so the own states have the same bits with tangent states as
    without. If ``judged``, the errors of tangent states do count: a monodromy matrix is
    then as accurate as the motion, also where the motion is at rest.

    **Phase.** An angle that advances at a constant rate and is carried from run to run
    along a chain, that of a drive. Its row holds its value at the run's time zero, less
    whole revolutions.

    **Friction.** ``implicit`` has bit k set where friction acts in own slope k and is
    evaluated separately, for a stepper that treats it implicitly. The part of such a slope that
    is due to friction is its *push*, in a row of ``push``; the slope includes it. With
    ``relax`` [s] above zero, the right-hand side first solves for velocities that are
    the given ones plus ``relax`` times the push, and stores them in ``stage``. The
    solution is unique while ``relax`` times ``falling`` [1/s] is below 1, where
    ``falling`` is the growth rate of the slip where friction falls with speed.
    """

    states: int
    aux: int
    parameters: int
    observed: int
    tangent_states: int = 0
    singles: int = 0
    private: int = 0
    judged: bool = False
    implicit: int = 0

    @property
    def own(self) -> int:
        """How many states are not tangent states."""
        return self.states - self.tangent_states

    @property
    def pairs(self) -> int:
        """How many pairs of position and velocity the own states have."""
        return (self.own - self.singles) // 2

    @property
    def own_slopes(self) -> int:
        """How many slopes the own states have: one per pair and one per state of first
        order."""
        return self.pairs + self.singles

    @property
    def slopes(self) -> int:
        """How many slopes all states have."""
        return self.own_slopes * (2 if self.tangent_states else 1)

    @property
    def pushed(self) -> tuple[int, ...]:
        """The slopes that have a push, in the order of its rows."""
        own = tuple(k for k in range(self.own_slopes) if self.implicit >> k & 1)
        return own + (tuple(self.own_slopes + k for k in own) if self.tangent_states else ())

    @property
    def blocks(self) -> tuple[tuple[int, int, int, int], ...]:
        """The states as blocks of one order: (order, number of pairs or single states,
        first state, first slope)."""
        blocks = []
        for copy in range(2 if self.tangent_states else 1):
            state, slope = copy * self.own, copy * self.own_slopes
            blocks.append((2, self.pairs, state, slope))
            blocks.append((1, self.singles, state + 2 * self.pairs, slope + self.pairs))
        return tuple(block for block in blocks if block[1])

    # The first of the rows of each kind, in their order in the buffer. The model reads
    # `stage`, `stage_time` and `phase` and writes `acceleration`: the slopes, which are
    # accelerations except for states of first order.
    stage: int = _row()
    acceleration: int = _row()
    push: int = _row()
    stage_time: int = _row()
    relax: int = _row()
    falling: int = _row()
    phase: int = _row()
    # The observer also reads these: the step goes from (`time`, `start`) to (`time` +
    # `step`, `stage`), with the accelerations `start_acceleration` and `acceleration`
    # at its ends; `moves` is 1.0 where it is accepted, `observing` is 1.0 during the
    # observation, else 0.0.
    start: int = _row()
    start_acceleration: int = _row()
    start_push: int = _row()
    frame_rate: int = _row()
    time: int = _row()
    step: int = _row()
    moves: int = _row()
    observing: int = _row()
    # The rows of the kernel, of which an observer may read `scale`, the natural scales
    # of the states, and the tolerance.
    scale: int = _row()
    control: int = _row()
    # Further rows of the model, which writes `aux_now` and reads `parameter`.
    aux_now: int = _row()
    parameter: int = _row()
    observer: int = _row()
    stepper: int = _row()
    total: int = _row()

    def __post_init__(self) -> None:
        # How many rows of a kind there are, where not one.
        pushed = len(self.pushed)
        counts = {
            "stage": self.states,
            "acceleration": self.slopes,
            "push": pushed,
            "relax": int(pushed > 0),
            "falling": int(pushed > 0),
            "start": self.states,
            "start_acceleration": self.slopes,
            "start_push": pushed,
            "frame_rate": self.slopes,
            "scale": self.states,
            "control": len(CONTROL),
            "aux_now": self.aux,
            "parameter": self.parameters,
            "observer": self.observed,
            "stepper": self.private,
        }
        first = 0
        for kind in fields(self):
            if not kind.init:
                object.__setattr__(self, kind.name, first)
                first += counts.get(kind.name, 1)


# The kernel's control variables of a lane, one row each.
CONTROL = (
    "proposed",  # the step that the controller proposes [s]
    "mark_time",  # when the next mark is due [s]
    "last_error",  # log2 of the last accepted squared error
    "growth",  # log2 of how much the step may grow
    "per_rtol",  # 1 / relative tolerance
    "least_step",  # [s]
    "accepted",  # steps so far
    "rejected",
    "limit",  # of accepted and rejected steps together
    "running",  # 1.0 where the lane has a run, else 0.0
    "attention",  # the reason why the lane needs attention, one of the following
)
NOTHING, MARK, NONFINITE, UNDERFLOW, LIMIT = 0.0, 1.0, 2.0, 3.0, 4.0
RATES = 3  # rows of the function of a contact: its value, slope and second derivative
