"""The chart of the drives that a string of segments may have: it needs no integration."""

from __future__ import annotations

import numpy as np

from nsdrill.errors import InputError
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
    own = parameters.drive.kind
    waves = waves_of(of_point(parameters, operation), WAVES)
    frequency = np.geomspace(0.2 * waves[0], 1.3 * waves[-1], 400)
    pipe = float(impedance(parameters))
    reflected, held = {}, {}
    for kind in dict.fromkeys(("ideal", *LAWS, "dc_motor", "lqr", own)):
        if kind == "pi" != own:
            continue  # it is whatever its numbers are, so the study has to give them
        driven = with_values(parameters, {"drive.kind": kind})
        if kind == "dc_motor" != own:
            driven = with_values(driven, {"drive.gains": None})
        string = of_point(driven, operation)
        try:
            held[kind] = slope_held(driven, string)
        except InputError:  # no gains for this string
            if kind == own:
                raise
            continue
        if kind == "ideal":
            reflected[kind] = np.ones_like(frequency)
            continue
        seen, circuit = seen_from_below(driven, string)
        if (found := reflection(seen, pipe, frequency, circuit)) is not None:
            reflected[kind] = np.abs(found)
    return DriveCard(frequency, reflected, held, waves, own)
