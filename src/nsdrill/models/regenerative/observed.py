"""What is observed of a string on a drag bit."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from types import FunctionType

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Graph
from nsdrill.equations.library import touching
from nsdrill.equations.passes import Tangents
from nsdrill.equations.plain import Rows, followed, function_of
from nsdrill.models.surface import loads, names, sums_of
from nsdrill.models.turning import SURFACE_TORQUES, turning_channels, turning_features
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    Derived,
    Extremes,
    Mean,
    MeanAbove,
    Outputs,
    Section,
    TimeAbove,
)


def _outputs(count: int) -> FunctionType:
    """The function of the interference of blade and rock [m] with its rate, and of the
    force of the rock [N] with its rate."""
    n = Rows(Graph())
    *_, front = sums_of([getattr(n, name) for name in names(count)])
    *_, closing = sums_of([getattr(n, f"{name}_rate") for name in names(count)])
    force = n.graph.node(loads(touching("rock", front), n.vz, n.bit_speed, n)[0])
    change = Tangents(n.graph, {front: closing, n.vz: n.bit_axial_acceleration}).of({"": force})[""]
    return function_of("outputs", [front, closing, force, change])


def _turned_back(
    forward_speed: Array, bit_speed_mean: Array, stick_slip_period: Array, set_speed: Array, per_spacing: Array
) -> Array:
    """The angle by which the bit turns back in a cycle of stick-slip, in a revolution where
    there are none, over that between two blades."""
    period = np.where(np.isfinite(stick_slip_period), stick_slip_period, 2.0 * math.pi / set_speed)
    return np.maximum(forward_speed - bit_speed_mean, 0.0) * period * per_spacing


CHANNELS = (
    Channel("bit position", "z", "vz", "bit_axial_acceleration"),
    Channel("axial velocity", "vz", "bit_axial_acceleration", rate_of="bit position"),
    Channel("interference", "interference", "closing", level=0.0, scale="depth_of_cut"),
    Channel("force", "force", "force_rate", scale="wob"),
    *turning_channels("set_speed", "stuck", lambda twist, set_speed, time, phase: twist + (phase + set_speed * time)),
)
FEATURES = (
    Extremes("bit position", "axial_max", "axial_min", "axial_peaks", compared=None),
    Extremes("axial velocity", "axial_velocity_max", "axial_velocity_min", compared=None),
    Mean("axial velocity", "axial_velocity_mean"),
    Extremes("interference", "blade_depth_max", compared=None),
    TimeAbove("interference", "touching"),
    # without a weight on bit it is off bottom, where nothing lifts it off
    Derived("lift_off_fraction", lambda touching, wob: np.where(wob > 0.0, 1.0 - touching, 0.0)),
    Extremes("force", "bit_force_max", compared=None),
    *turning_features("set_speed"),
    TimeAbove("bit speed", "forward", level=0.0),
    MeanAbove("bit speed", "forward", "forward_speed"),
    Derived("turned_back", _turned_back),
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
        pipe = Channel(
            "pipe twist",
            *followed(lambda n: n.twist - n.lag, lambda n: {"twist": n.bit_speed, "lag": n.drive_speed}),
            scale=0.1,
        )
        channels += (pipe, Channel("drive speed", "drive_speed", "drive_acceleration"))
        features = tuple(
            replace(feature, channel="pipe twist")
            if isinstance(feature, Extremes | Mean) and feature.channel == "twist"
            else feature
            for feature in features
        )
        features += (
            Extremes("drive speed", "drive_speed_max", "drive_speed_min", compared=None),
            Mean("drive speed", "drive_speed_mean"),
        )
    return Declaration(
        outputs=Outputs(("interference", "closing", "force", "force_rate"), _outputs(count)),
        channels=channels,
        features=features,
        section=Section("bit angle", 2.0 * math.pi),
    )
