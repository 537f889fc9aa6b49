"""The chart of the drives that a string of segments may have: it needs no
integration."""

from __future__ import annotations

import numpy as np

from nsdrill.models import drives
from nsdrill.models.drives import LAWS, reflection
from nsdrill.models.leaves import with_values
from nsdrill.models.numbers import DriveCard
from nsdrill.models.operation import Operation
from nsdrill.models.segments.drive import impedance
from nsdrill.models.segments.linear import drive_impedance, slope_held, string_at, torsional_frequencies
from nsdrill.models.segments.parameters import Parameters

WAVES = 4


def drive_card(parameters: Parameters, operation: Operation) -> DriveCard:
    """The chart ``drive-card``: every kind of drive with the numbers of the study."""
    study_kind, pipe = parameters.drive.kind, float(impedance(parameters))

    def slope_and_reflection(kind: str, frequency: np.ndarray) -> tuple[float, np.ndarray | None]:
        with_kind = with_values(parameters, {"drive.kind": kind})
        if kind == "dc_motor" != study_kind:
            with_kind = with_values(with_kind, {"drive.gains": None})
        string = string_at(with_kind, operation)
        slope = slope_held(with_kind, string)
        if kind == "ideal":
            return slope, None
        law, circuit = drive_impedance(with_kind, string)
        return slope, reflection(law, pipe, frequency, circuit)

    waves = torsional_frequencies(string_at(parameters, operation), WAVES)
    return drives.drive_card(("ideal", *LAWS, "dc_motor", "lqr"), study_kind, waves, slope_and_reflection)
