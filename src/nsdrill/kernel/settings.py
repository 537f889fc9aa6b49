"""How a run is integrated and for how long."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Simulation:
    """``transient`` and ``observe`` in seconds; ``rtol`` relative tolerance per step, from 1e-13 to 1e-2; ``max_steps``
    counts accepted and rejected steps of one run; ``verify`` asks for every point of a sweep to be checked by two more
    runs; ``pair`` names the embedded Runge-Kutta pair."""

    transient: float = 300.0
    observe: float = 200.0
    rtol: float = 1e-6
    max_steps: int = 50_000_000
    verify: bool = False
    pair: Literal["tsitouras", "dormand_prince"] = "tsitouras"
