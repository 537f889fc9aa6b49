"""The peers of the race, each behind the same small protocol; those that are not
installed say so."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from benchmarks.workload import Array, Problem


class MissingPeer(Exception):
    """This peer cannot take part; the message says what it needs."""


@dataclass(frozen=True)
class Result:
    """What one run through a problem took: wall and processor seconds, calls of the
    right-hand side for one state, tried steps (None where the peer does not tell), and
    the states [n, 8] at the end."""

    seconds: float
    cpu_seconds: float
    evaluations: int | None
    steps: int | None
    end: Array


class Peer(Protocol):
    """``name`` and what it leaves out (``lacks``), which the reader of a ratio must
    know."""

    name: str
    lacks: str

    def run(self, problem: Problem, rtol: float) -> Result: ...


class Stopwatch:
    """Wall and processor seconds of a block."""

    def __enter__(self) -> Stopwatch:
        self._wall, self._cpu = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_: object) -> None:
        self.wall = time.perf_counter() - self._wall
        self.cpu = time.process_time() - self._cpu


NO_OBSERVERS = "no observers, no classification"
SCALAR_TOLERANCE = "one scalar tolerance (vector one emulated by scaling the states)"


def everybody() -> tuple[list[Peer], dict[str, str]]:
    """All peers that can take part, and why the others cannot."""
    from benchmarks.peers.clode_peer import Clode
    from benchmarks.peers.diffrax_peer import Diffrax
    from benchmarks.peers.numbalsoda_peer import NumbaLsoda
    from benchmarks.peers.odeint_peer import Odeint
    from benchmarks.peers.scipy_peer import Scipy

    makers: dict[str, Callable[[], Peer]] = {
        "SciPy RK45, numba right-hand side": lambda: Scipy("RK45"),
        "numbalsoda dop853": lambda: NumbaLsoda("dop853"),
        "numbalsoda lsoda": lambda: NumbaLsoda("lsoda"),
        "Odeint": lambda: Odeint(fast=False, skip=False),
        "Odeint, fast-math": lambda: Odeint(fast=True, skip=False),
        "Odeint, skips contacts": lambda: Odeint(fast=False, skip=True),
        "Odeint, fast-math, skips contacts": lambda: Odeint(fast=True, skip=True),
        "diffrax": Diffrax,
        "clODE": Clode,
    }
    present: list[Peer] = []
    absent: dict[str, str] = {}
    for name, make in makers.items():
        try:
            present.append(make())
        except MissingPeer as reason:
            absent[name] = str(reason)
    return present, absent
