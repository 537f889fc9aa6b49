"""How a run is integrated and for how long."""

from __future__ import annotations

from typing import Literal

from nsdrill.ranges import option, parameter
from nsdrill.records import dataclass

LONGEST = 1e7  # s, four months


@dataclass(frozen=True)
class Simulation:
    """``transient`` and ``observe`` in seconds; ``rtol`` relative tolerance per step;
    ``max_steps`` bounds the number of accepted and rejected steps of one run; with
    ``verify`` every point of a sweep is checked by two more runs; ``pair`` names the
    embedded Runge-Kutta pair of the explicit method. ``method``: ``implicit`` treats
    friction implicitly; ``auto`` does so only where friction is steep
    (:mod:`nsdrill.models.friction`), and is ``explicit`` in runs for which that is not
    decided.

    The ranges are those of a study. They are not checked here, as the checks of a point
    and the pieces of a ramp go beyond them."""

    transient: float = parameter(300.0, "s", high=LONGEST, usual="100 to 5000 s", meaning="Time before the observation")
    observe: float = parameter(
        200.0, "s", low=1e-3, high=LONGEST, usual="50 to 2000 s", meaning="Time of the observation"
    )
    rtol: float = parameter(
        1e-6,
        low=1e-13,
        high=1e-2,
        usual="1e-9 to 1e-4",
        meaning="Relative tolerance of a step; smaller is more accurate and slower",
    )
    max_steps: int = parameter(
        50_000_000,
        low=1000,
        high=10**15,
        usual="1000 to 5000 for a second",
        meaning="Number of steps after which a run ends with status 3",
    )
    verify: bool = option(
        False, "Check every point with a smaller tolerance and a longer run; takes about 4 times as long"
    )
    pair: Literal["tsitouras", "dormand_prince"] = option(
        "tsitouras", "Formulas of the explicit method; dormand_prince is SciPy's RK45"
    )
    method: Literal["auto", "explicit", "implicit"] = option(
        "auto", "Integration of friction; implicit for steep friction"
    )

    @property
    def stepper(self) -> str:
        """The name of the stepper, among those of :mod:`nsdrill.kernel.steppers`."""
        return "kennedy_carpenter" if self.method == "implicit" else self.pair
