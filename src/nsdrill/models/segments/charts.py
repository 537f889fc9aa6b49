"""The chart of the drives that a string of segments may have: it needs no integration."""

from __future__ import annotations

import numpy as np

from nsdrill.models import drives
from nsdrill.models.drives import LAWS, reflection
from nsdrill.models.leaves import with_values
from nsdrill.models.numbers import DriveCard
from nsdrill.models.operation import Operation
from nsdrill.models.segments.drive import impedance
from nsdrill.models.segments.linear import of_point, seen_from_below, slope_held, waves_of
from nsdrill.models.segments.parameters import Parameters

WAVES = 4


def drive_card(parameters: Parameters, operation: Operation) -> DriveCard:
    """The chart ``drive-card``: every kind of drive with the numbers of the study."""
    own, pipe = parameters.drive.kind, float(impedance(parameters))

    def seen(kind: str, frequency: np.ndarray) -> tuple[float, np.ndarray | None]:
        driven = with_values(parameters, {"drive.kind": kind})
        if kind == "dc_motor" != own:
            driven = with_values(driven, {"drive.gains": None})
        string = of_point(driven, operation)
        held = slope_held(driven, string)
        if kind == "ideal":
            return held, None
        law, circuit = seen_from_below(driven, string)
        return held, reflection(law, pipe, frequency, circuit)

    waves = waves_of(of_point(parameters, operation), WAVES)
    return drives.drive_card(("ideal", *LAWS, "dc_motor", "lqr"), own, waves, seen)
