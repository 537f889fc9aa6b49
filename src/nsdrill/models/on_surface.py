"""What is observed of a drag bit on the surface that its blades leave
(:mod:`nsdrill.models.surface`), for every model that has one."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Node
from nsdrill.equations.library import touching
from nsdrill.equations.passes import Tangents
from nsdrill.equations.plain import Rows
from nsdrill.models.operation import Numeric
from nsdrill.models.responses import Thresholds
from nsdrill.models.surface import loads, names, sums_of
from nsdrill.observe.channels import Channel, Derived, Extremes, Feature, Mean, MeanAbove, TimeAbove

OFF_BOTTOM, TURNED_BACK = 1, 2  # bits of beyond_validity


def rates(count: int) -> tuple[str, ...]:
    """The names of the rates of so many states of the surface."""
    return tuple(f"{name}_rate" for name in names(count))


def on_surface(n: Rows, count: int, accelerations: Mapping[Node, Node]) -> tuple[Node, ...]:
    """(interference of blade and rock [m], force [N] and torque [N m] of the rock), each
    followed by its rate; with the ``accelerations`` of the axial velocity and of the bit
    speed."""
    *_, front = sums_of([getattr(n, name) for name in names(count)])
    *_, closing = sums_of([getattr(n, name) for name in rates(count)])
    force, torque = map(n.graph.node, loads(touching("rock", front), n.vz, n.bit_speed, n))
    changes = Tangents(n.graph, {front: closing, **accelerations}).of({"force": force, "torque": torque})
    return front, closing, force, changes["force"], torque, changes["torque"]


def _turned_back(
    forward_speed: Array, bit_speed_mean: Array, stick_slip_period: Array, set_speed: Array, per_spacing: Array
) -> Array:
    """The angle by which the bit turns back in a cycle of stick-slip, in a revolution where
    there are none, over that between two blades."""
    period = np.where(np.isfinite(stick_slip_period), stick_slip_period, 2.0 * math.pi / set_speed)
    return np.maximum(forward_speed - bit_speed_mean, 0.0) * period * per_spacing


CHANNELS = (
    Channel("interference", "interference", "closing", level=0.0, scale="blade_depth"),
    Channel("force", "force", "force_rate", scale="wob"),
)
FEATURES: tuple[Feature, ...] = (
    Extremes("interference", "blade_depth_max", compared=None),
    Extremes("force", "bit_force_max", compared=None),
    TimeAbove("bit speed", "forward", level=0.0),
    MeanAbove("bit speed", "forward", "forward_speed"),
    Derived("turned_back", _turned_back),
)


def axial_velocity(channel: str) -> tuple[Feature, ...]:
    """The features of the axial velocity, which a ``channel`` follows."""
    return (
        Extremes(channel, "axial_velocity_max", "axial_velocity_min", compared=None),
        Mean(channel, "axial_velocity_mean"),
    )


def drilled(
    rate: Numeric, radius: Numeric, wob: Numeric, features: Mapping[str, Array], speed: str
) -> dict[str, Array]:
    """The rate of penetration that the rock allows, from that of steady drilling [m/s], and
    the energy that it takes (Teale 1965) with the mean ``speed`` at which the torque at
    the surface works; infinite where the bit does not advance."""
    advance = rate - features["axial_velocity_mean"]
    power = wob * advance + features[speed] * features["surface_torque_mean"]
    area = math.pi * radius * radius
    energy = np.divide(power, advance * area, out=np.full(np.shape(advance), np.inf), where=advance > 0.0)
    return {"rate_of_penetration": np.maximum(advance, 0.0), "mechanical_specific_energy": energy}


def labels(features: Mapping[str, Array], thresholds: Thresholds) -> dict[str, Array]:
    """What takes a run beyond the model: a bit that is off bottom for so long that it
    bounces, or turns back past a blade. None of runs on another rock."""
    if "turned_back" not in features:
        return {}
    flies = features["lift_off_fraction"] > thresholds.bit_bounce.lift_off_fraction
    back = features["turned_back"] > 1.0
    return {"beyond_validity": np.asarray(OFF_BOTTOM * flies + TURNED_BACK * back)}
