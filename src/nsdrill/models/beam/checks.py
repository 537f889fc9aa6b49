"""What ``check`` finds of a study of an elastic collar: coefficients, frequencies under
load, and warnings."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.models.beam.columns import as_lumped, shape, stiffnesses
from nsdrill.models.beam.columns import coefficients as lumped_coefficients
from nsdrill.models.beam.parameters import Parameters
from nsdrill.models.christoforou_yigit import derived_quantities as lumped
from nsdrill.models.christoforou_yigit.checks import COEFFICIENTS as LUMPED
from nsdrill.models.christoforou_yigit.checks import Told
from nsdrill.models.christoforou_yigit.coefficients import Coefficients
from nsdrill.models.christoforou_yigit.derived_quantities import DerivedQuantity
from nsdrill.models.leaves import Values
from nsdrill.models.operation import Operation

COEFFICIENTS = LUMPED
# Those of the lumped model that are of the string above the collar and of the bit.
SHARED = (
    "axial_free",
    "axial_contact",
    "torsional",
    "buckling_margin",
    "lobe_resonance",
    "lift_off_wob",
    "mean_torque",
    "static_twist",
    "slope_held",
    "stick_slip_onset",
    "stick_slip_fold",
)
NODE = 1e-9


def coefficients(parameters: Parameters, operation: Operation) -> Coefficients:
    """Those at an operating point, of the first mode, without the factor of the modal
    mass."""
    return lumped_coefficients(parameters, operation.depth, operation.wob, operation.rotary_speed)


def every_derived_quantity(
    parameters: Parameters, operation: Operation
) -> dict[str, DerivedQuantity]:
    """The derived quantities at an operating point: those of string and bit, and the
    frequency of each bending mode under the weight on bit, None where that buckles
    it."""
    shared = lumped.derived_quantities(as_lumped(parameters), operation)
    mass = parameters.beam.modal_mass_factor * coefficients(parameters, operation).m_l
    found = {name: shared[name] for name in SHARED if name in shared}
    for n, stiffness in enumerate(stiffnesses(parameters, *_at(operation)), start=1):
        value = math.sqrt(stiffness / mass) if stiffness > 0 else None
        found[f"bending_{n}"] = DerivedQuantity(
            value, "rad/s", f"frequency of bending mode {n} at this WOB", "lateral"
        )
    return found


def _at(operation: Operation) -> tuple[float, float, float]:
    return operation.depth, operation.wob, operation.rotary_speed


def warnings(study: Any, corners: list[Values], told: Told) -> list[str | None]:
    """Warnings of a study, with what its points have at the ends of all axes in
    ``corners``; None where there is nothing to warn of."""
    return [_buckled(corners, told), _undamped(study.parameters)]


def _buckled(corners: list[Values], told: Told) -> str | None:
    """The modes that the weight on bit buckles."""
    worst = max(corners, key=lambda at: float(at.operation[1]))
    buckled = [
        n for n, k in enumerate(stiffnesses(worst.parameters, *worst.operation), start=1) if k < 0
    ]
    if not buckled:
        return None
    load = lumped_coefficients(worst.parameters, *worst.operation).buckling_load
    return (
        f"Buckled: at {told(worst.operation[1], 'N', 'kN')} the stiffness of bending mode "
        f"{' and '.join(map(str, buckled))} is negative (Euler load "
        f"{told(float(load), 'N', 'kN')}). The collar leans "
        "on its walls there; that is allowed. Shorten the span or lower the weight on bit if it "
        "is not meant."
    )


def _undamped(parameters: Parameters) -> str | None:
    """The modes that nothing damps: their nodes are at all stations, where the mud
    drags."""
    if np.any(np.asarray(parameters.beam.damping_ratio) > 0):
        return None
    drags = (
        parameters.mud.density * parameters.mud.drag if not np.ndim(parameters.mud.density) else 1.0
    )
    along = [
        station.at
        for station in parameters.beam.stations
        if station.drag or (station.drag is None and drags)
    ]
    drags = len(along) > 0
    free = [
        n
        for n in range(1, parameters.beam.modes + 1)
        if all(np.all(np.abs(shape(place, n)) < NODE) for place in along)
    ]
    if not free or not drags:  # without mud nothing is meant to be damped
        return None
    return (
        f"Undamped: the stations are at nodes of bending mode {' and '.join(map(str, free))}, so "
        f"neither mud nor wall "
        "acts on it, and what it has at the start it keeps. Give beam.damping_ratio, or stations "
        "elsewhere."
    )
