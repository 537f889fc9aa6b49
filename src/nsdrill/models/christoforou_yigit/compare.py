"""How far two motions at one operating point differ, in one number. Plain numpy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.rhs import INDEX, STATES, sizes

Array = np.ndarray[Any, np.dtype[Any]]

# Each feature that is compared, and what its difference is measured in; fractions of time are taken as they are.
COMPARED = {
    "bit_speed_min": "drive_speed", "bit_speed_max": "drive_speed", "bit_speed_mean": "drive_speed",
    "whirl_speed_mean": "drive_speed",
    "axial_min": "lobe", "axial_max": "lobe",
    "radius_max": "gap", "radius_mean": "gap",
    "stuck_fraction": None, "lift_off_fraction": None, "wall_contact_fraction": None,
}  # fmt: skip


def scales(table: Array) -> dict[str, Array]:
    """What differences are measured in at operating points with the lane parameters ``table`` [points, parameters]:
    ``gap`` [m] between collar and wall, ``drive_speed`` [rad/s], ``lobe`` [m], the amplitude of the lobed surface, on a
    surface without lobes the static penetration of the rock."""
    amplitude = table[:, INDEX["surface_amplitude"]]
    return {
        "gap": table[:, INDEX["gap"]],
        "drive_speed": table[:, INDEX["drive_speed"]],
        "lobe": np.where(amplitude > 0, amplitude, sizes(table)[:, STATES.index("z")]),
    }


def difference(one: Mapping[str, Array], two: Mapping[str, Array], units: Mapping[str, Array]) -> Array:
    """The largest difference of the features :data:`COMPARED` between two runs of each point, each measured in its
    natural size (:func:`scales`, in ``units``); NaN where a run did not end well."""
    parts = [np.abs(one[name] - two[name]) / (units[scale] if scale else 1.0) for name, scale in COMPARED.items()]
    return np.asarray(np.max(parts, axis=0))
