"""What is observed of a string on a drag bit."""

from __future__ import annotations

from functools import lru_cache
from types import FunctionType

import numpy as np

from nsdrill.equations.graph import Graph
from nsdrill.equations.plain import Rows, function_of
from nsdrill.models import on_surface, top
from nsdrill.models.turning import SURFACE_TORQUES, TURN, turning_channels, turning_features
from nsdrill.observe.channels import Channel, Declaration, Derived, Extremes, Mean, Outputs, TimeAbove


def _outputs(count: int) -> FunctionType:
    """The function of the interference of blade and rock [m] with its rate, and of the
    force of the rock [N] with its rate."""
    n = Rows(Graph())
    found = on_surface.on_surface(n, count, {n.vz: n.bit_axial_acceleration})
    return function_of("outputs", found[:4])


CHANNELS = (
    Channel("bit position", "z", "vz", "bit_axial_acceleration"),
    Channel("axial velocity", "vz", "bit_axial_acceleration", rate_of="bit position"),
    *on_surface.CHANNELS,
    *turning_channels(),
)
FEATURES = (
    Extremes("bit position", "axial_max", "axial_min", "axial_peaks", compared=None),
    *on_surface.axial_velocity("axial velocity"),
    TimeAbove("interference", "touching"),
    # without a weight on bit it is off bottom, where nothing lifts it off
    Derived("lift_off_fraction", lambda touching, wob: np.where(wob > 0.0, 1.0 - touching, 0.0)),
    *turning_features(),
    *on_surface.FEATURES,
    Extremes("twist", "twist_max", "twist_min", compared=None),
    Mean("twist", "twist_mean"),
    *SURFACE_TORQUES,
)


@lru_cache
def declaration_of(count: int, driven: int) -> Declaration:
    """The declaration of a string with so many states of the surface, with a drive that is
    not ideal or one that is."""
    channels, features = CHANNELS, FEATURES
    if driven:
        channels, features = top.observed(channels, features, "drive_acceleration")
    return Declaration(
        outputs=Outputs(("interference", "closing", "force", "force_rate"), _outputs(count)),
        channels=channels,
        features=features,
        section=TURN,
    )
