"""The few things that compiled rooms share: how they are compiled and cached, and the
layout of the lane buffer.

**Lanes.** The kernel integrates ``lanes`` trajectories side by side, one per slot of
the processor's vector registers. Everything a trajectory owns is a column of one flat
float64 buffer, row after row::

    buffer[row * lanes + lane]

A loop over the lanes of one or several rows then compiles to packed instructions. That
holds only while all rows live in this one buffer and ``lanes`` and the row numbers are
compile-time constants; so the compiled functions are made by small factories,
``make_...(lanes)``, and the row numbers come from :class:`Rows`.

**Cache.** The machine code is kept on disk (:mod:`nsdrill.cache`). There an edit in the
file of a function is noticed, one in the files of the functions inlined into it is not:
the numbers would silently be stale. So the cache directory is named after a digest of
all compiled sources and of the versions of numba and llvmlite.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba import types
from numba.core.registry import CPUDispatcher

from nsdrill.cache import cache_for
from nsdrill.compiling import compiling

# The package's folders whose sources end up in compiled code.
COMPILED = ("abi.py", "elementary.py", "models", "kernel", "observe")

# `nsz` ignores the sign of zero. Nothing that reorders sums or fuses products at the
# compiler's pleasure (the bits would depend on the number of lanes), and nothing that
# assumes away NaN (a run that blows up must be seen).
FASTMATH = {"nsz"}

_compiling = threading.RLock()

BUFFER = types.float64[::1]
# A right-hand side reads the rows `stage`, `stage_time`, `phase` and `parameter`, and
# writes `acceleration` and `aux_now`; one with friction apart (`Rows.apart`) reads
# `relax`, writes `push` and `falling`, and moves the velocities among the `stage` rows.
RIGHT_HAND_SIDE = types.FunctionType(types.void(BUFFER))
# An observer is shown every packed step: the lane buffer and a store of its own.
OBSERVER = types.FunctionType(types.void(BUFFER, BUFFER))
# A stepper tries one step in every lane, shows it to the observer, and returns whether
# some lane wants attention.
STEPPER = types.FunctionType(types.int64(BUFFER, RIGHT_HAND_SIDE, OBSERVER, BUFFER))
# The observer is told of the marks of one lane's run (lane, mark) and leaves its
# findings in a row of the outbox, from a column on.
MARKER = types.FunctionType(
    types.void(BUFFER, BUFFER, types.int64, types.int64, types.float64[::1], types.int64)
)

# The marks: the window opens, is half over, is over.
OPENS, HALVES, CLOSES = range(3)


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Digest of all compiled sources and of what compiles them: names the cache
    directory."""
    digest = hashlib.sha256()
    root = Path(__file__).parent
    for name in COMPILED:
        path = root / name
        for file in [path] if path.suffix else sorted(path.rglob("*.py")):
            digest.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    digest.update(f"{numba.__version__} {llvmlite.__version__} {sorted(FASTMATH)}".encode())
    return digest.hexdigest()[:16]


def compiled(signature: Any, *variant: int) -> Callable[[Callable[..., Any]], Any]:
    """Compile at once for ``signature``, without the GIL, cached on disk across
    processes where the disk allows it.

    ``variant`` are the numbers that tell the functions of one factory apart. They go
    into the function's name: numba names the machine code after it, and of two pieces
    loaded from the cache under one name only the first is found.
    """

    def compile_function(function: Callable[..., Any]) -> Any:
        function.__name__ = "_".join([function.__name__, *map(str, map(int, variant))])
        function.__qualname__ = function.__name__
        # numba has a lock for compiling, none for making what is then compiled.
        with _compiling, compiling():
            made = numba.njit(nogil=True, fastmath=FASTMATH, error_model="numpy", _nrt=False)(
                function
            )
            if hasattr(made, "compile"):  # not where compilation is switched off
                made._cache = cache_for(function, source_digest())
                made.compile(signature)
                made.disable_compile()
        return lasting(made, function.__name__)

    return compile_function


class Inlined(CPUDispatcher):
    """A helper that is compiled for its compiled callers alone: making an entry for
    Python too would cost as much as a sixth of all compiling. A call from Python goes
    through a compiled caller, made at the first of them."""

    def __call__(self, *arguments: Any) -> Any:
        if not hasattr(self, "_caller"):
            helper = self

            def caller(*arguments):  # type: ignore[no-untyped-def]
                return helper(*arguments)

            self._caller = numba.njit(caller)
        return self._caller(*arguments)


def inlined(function: Callable[..., Any]) -> Any:
    """A helper that disappears into its caller, so that the caller's lane loop still
    vectorises."""
    made = numba.njit(
        forceinline=True,
        fastmath=FASTMATH,
        error_model="numpy",
        _nrt=False,
        no_cfunc_wrapper=True,
        no_cpython_wrapper=True,
    )(function)
    if isinstance(made, CPUDispatcher):  # not where compilation is switched off
        made.__class__ = Inlined
    return lasting(made, f"{function.__module__}.{function.__name__}")


def lasting(made: Any, name: str) -> Any:
    """Give a function of numba an identity that lasts: numba draws one anew in every
    process, and the cache of a function that calls it through a closure would never be
    hit."""
    if hasattr(made, "_set_uuid"):  # not where compilation is switched off
        made._set_uuid(f"nsdrill.{name}.{source_digest()}")
    return made


CACHE_LINE = 8  # numbers


def aligned_zeros(size: int) -> np.ndarray:
    """Zeros that begin on a cache line: a packed load or store that straddles two lines
    costs twice."""
    raw = np.zeros(size + CACHE_LINE)
    offset = -(raw.ctypes.data // raw.itemsize) % CACHE_LINE
    return raw[offset : offset + size]


@dataclass(frozen=True)
class Rows:
    """Row numbers of the lane buffer for a model of ``states`` states, ``aux``
    auxiliary outputs and ``parameters`` parameters, an observer with ``observed`` rows
    of its own and a stepper with ``private`` ones.

    States are positions and velocities in turn, position' = velocity + frame rate,
    velocity' = slope; the frame of a position may turn with the drive; after these
    pairs come ``singles`` states of first order, state' = slope. The model reads
    ``stage``, ``stage_time``, ``phase`` and ``parameter`` and writes ``slope`` and
    ``aux_now``; the observer also reads the ends of the step; the rest is the kernel's.

    The last ``tangent_states`` of the states, none or as many as the others, only
    follow them, like the tangent vector of a Lyapunov exponent: they have no say in the
    step size and begin anew in every run of a chain. So the others keep their bits,
    with tangent states or without. Where they are ``judged``, their errors count as
    those of the others do: a monodromy is then as good as the motion, also where the
    motion stands still.

    The ``phase`` is an angle that advances at a constant rate and is carried from run
    to run along a chain, the angle of a drive: its row holds its value, less whole
    turns, when the clock of the run stands at zero.

    ``apart`` has a bit for every own slope in which friction acts and is kept apart,
    for a stepper that treats friction implicitly: bit k for slope k. What friction adds
    to such a slope is its *push*, which stands in a row of ``push`` beside the whole
    slope. With ``relax`` [s] above zero, the right-hand side first solves for
    velocities that are the given ones plus ``relax`` times the push, and leaves them in
    ``stage``. They are the only ones while ``relax`` times ``falling`` [1/s] is below
    1: how fast the slip grows where friction falls with speed.
    """

    states: int
    aux: int
    parameters: int
    observed: int
    tangent_states: int = 0
    singles: int = 0
    private: int = 0
    judged: bool = False
    apart: int = 0

    @property
    def own(self) -> int:
        """How many states are no tangent states."""
        return self.states - self.tangent_states

    @property
    def pairs(self) -> int:
        """How many pairs of position and velocity the own states have."""
        return (self.own - self.singles) // 2

    @property
    def own_slopes(self) -> int:
        """How many slopes the own states have: one a pair, one a state of first
        order."""
        return self.pairs + self.singles

    @property
    def slopes(self) -> int:
        """How many slopes all states have."""
        return self.own_slopes * (2 if self.tangent_states else 1)

    @property
    def pushed(self) -> tuple[int, ...]:
        """The slopes that have a push, in the order of its rows."""
        own = tuple(k for k in range(self.own_slopes) if self.apart >> k & 1)
        return own + (tuple(self.own_slopes + k for k in own) if self.tangent_states else ())

    @property
    def blocks(self) -> tuple[tuple[int, int, int, int], ...]:
        """The states as blocks of one order: (order, how many, first state, first
        slope)."""
        found = []
        for copy in range(2 if self.tangent_states else 1):
            state, slope = copy * self.own, copy * self.own_slopes
            found.append((2, self.pairs, state, slope))
            found.append((1, self.singles, state + 2 * self.pairs, slope + self.pairs))
        return tuple(block for block in found if block[1])

    # First what follows from the states alone. What the model reads (`stage`,
    # `stage_time`, `phase`) and writes (`acceleration`): the slopes are accelerations,
    # but for states of first order.
    @property
    def stage(self) -> int:
        return 0

    @property
    def acceleration(self) -> int:
        return self.states

    @property
    def push(self) -> int:
        return self.acceleration + self.slopes

    @property
    def stage_time(self) -> int:
        return self.push + len(self.pushed)

    @property
    def relax(self) -> int:
        return self.stage_time + 1

    @property
    def falling(self) -> int:
        return self.stage_time + 2

    @property
    def phase(self) -> int:
        return self.stage_time + (3 if self.apart else 1)

    # What the observer reads besides: the step goes from (`time`, `start`) to (`time` +
    # `step`, `stage`), with the accelerations `start_acceleration` and `acceleration`
    # at its ends; `moves` is 1.0 where it is accepted, `window` where it is observed,
    # else 0.0.
    @property
    def start(self) -> int:
        return self.phase + 1

    @property
    def start_acceleration(self) -> int:
        return self.start + self.states

    @property
    def start_push(self) -> int:
        return self.start_acceleration + self.slopes

    @property
    def frame_rate(self) -> int:
        return self.start_push + len(self.pushed)

    @property
    def time(self) -> int:
        return self.frame_rate + self.slopes

    @property
    def step(self) -> int:
        return self.time + 1

    @property
    def moves(self) -> int:
        return self.time + 2

    @property
    def window(self) -> int:
        return self.time + 3

    # The kernel's own rows, of which an observer may read `scale` and the tolerance.
    @property
    def scale(self) -> int:
        """The natural scales of the states."""
        return self.time + 4

    @property
    def control(self) -> int:
        return self.scale + self.states

    # Then what the model has besides: it writes `aux_now` and reads `parameter`.
    @property
    def aux_now(self) -> int:
        return self.control + len(CONTROL)

    @property
    def parameter(self) -> int:
        return self.aux_now + self.aux

    # Then the rows of the observer and those of the stepper. Both begin at multiples,
    # so that models which differ by a few numbers share their machine code.
    @property
    def observer(self) -> int:
        return self.aux_now + _up(self.aux + self.parameters, 64)

    @property
    def stepper(self) -> int:
        return self.observer + _up(self.observed, 32)

    @property
    def total(self) -> int:
        return self.stepper + self.private

    @property
    def used(self) -> int:
        """How many rows there are without those that are left out."""
        known = self.aux + self.parameters + self.observed
        return self.aux_now + known + self.private

    @property
    def of_states(self) -> Rows:
        """The rows without what a tracer never sees: all but those that follow from the
        states."""
        return replace(self, aux=0, parameters=0, observed=0, private=0, judged=False)

    @property
    def of_observer(self) -> Rows:
        """The same rows for all layouts between which an observer cannot tell."""
        room = self.observer - self.parameter
        return replace(self, parameters=room, private=0, judged=False)

    @property
    def of_stepper(self) -> Rows:
        """The same rows for all layouts between which a stepper cannot tell."""
        return replace(self, aux=0, parameters=0, observed=self.stepper - self.aux_now)


def _up(count: int, unit: int) -> int:
    return -(-count // unit) * unit


# The kernel's bookkeeping of a lane, one row each.
CONTROL = (
    "proposed",  # the step that the controller proposes [s]
    "mark_time",  # when the next mark is due [s]
    "last_error",  # log2 of the last accepted squared error
    "growth",  # log2 of how much the step may grow
    "per_rtol",  # 1 / relative tolerance
    "least_step",  # [s]
    "accepted",  # steps so far
    "rejected",
    "limit",  # of the tries
    "running",  # 1.0 where the lane has a run, else 0.0
    "attention",  # what the lane wants attention for
)
NOTHING, MARK, NONFINITE, UNDERFLOW, LIMIT = 0.0, 1.0, 2.0, 3.0, 4.0
RATES = 3  # rows of the function of a contact: its value, slope and second derivative
