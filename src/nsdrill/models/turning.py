"""What is observed of every string that turns: its twist, the speed of its bit."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models.model_description import Drawn, Panel
from nsdrill.models.starts import Starts, state
from nsdrill.observe.channels import Channel, Derived, Extremes, Feature, Mean, Period, Section, TimeAbove
from nsdrill.records import dataclass


def _index(bit_speed_max: Array, bit_speed_min: Array, bit_speed_mean: Array) -> Array:
    """The stick-slip index, infinite for a bit that does not rotate at all."""
    infinite, mean = np.full(len(bit_speed_mean), np.inf), np.abs(bit_speed_mean)
    return np.divide(50.0 * (bit_speed_max - bit_speed_min), mean, out=infinite, where=mean != 0.0)


STICK_SLIP_INDEX = Derived("stick_slip_index", _index)
STICK_SLIP_PERIOD = Period("bit speed", "stick_slip_period")
STUCK_FRACTION = Derived("stuck_fraction", lambda unstuck: 1.0 - unstuck)
PEAK_RATIO = Derived("peak_ratio", lambda bit_speed_max, set_speed: bit_speed_max / set_speed)
# By the lane parameter ``torsional_stiffness`` of a massless pipe.
SURFACE_TORQUES = (
    Derived("surface_torque_min", lambda torsional_stiffness, twist_max: -torsional_stiffness * twist_max),
    Derived("surface_torque_max", lambda torsional_stiffness, twist_min: -torsional_stiffness * twist_min),
    Derived("surface_torque_mean", lambda torsional_stiffness, twist_mean: -torsional_stiffness * twist_mean),
)


TURN = Section("bit angle", 2.0 * math.pi)


def _angle(twist: Any, set_speed: Any, time: Any, phase: Any) -> Any:
    return twist + (phase + set_speed * time)


def turning_channels(
    rate: str = "bit_acceleration", stuck: str = "stuck", angle: Callable[..., Any] = _angle
) -> tuple[Channel, ...]:
    """Twist, bit speed and the ``angle`` of the bit, a function of rows; ``stuck`` is the
    lane parameter of the bit speed below which the bit is stuck, and ``rate`` the row of
    the slope of the bit speed."""
    return (
        Channel("twist", "twist", "bit_speed", rate, frame="set_speed"),
        Channel("bit speed", "bit_speed", rate, rate_of="twist", level=stuck),
        Channel("bit angle", angle, "bit_speed", rate),
    )


def turning_features() -> tuple[Feature, ...]:
    """The features of the bit speed."""
    return (
        Extremes(
            "bit speed", greatest="bit_speed_max", least="bit_speed_min", peaks="bit_speed_peaks", slip="set_speed"
        ),
        TimeAbove("bit speed", "unstuck"),
        Mean("bit speed", "bit_speed_mean"),
        STICK_SLIP_INDEX,
        STUCK_FRACTION,
        STICK_SLIP_PERIOD,
        PEAK_RATIO,
    )


# Those of the features of the bit speed that files keep.
TURNING = ("bit_speed_min", "bit_speed_max", "bit_speed_mean", "stick_slip_index", "stuck_fraction")
# By which two runs of a string that turns are compared.
SWING = {**dict.fromkeys(TURNING[:3], "set_speed"), "stuck_fraction": None}
CYCLES = ("stick_slip_period", "peak_ratio")
# Those of a bit that also moves along the hole, and of the string and the drive above it.
ALONG = ("axial_min", "axial_max", "lift_off_fraction", "bit_force_max")
ABOVE = (
    *("surface_torque_min", "surface_torque_max", "surface_torque_mean"),
    *("drive_speed_min", "drive_speed_max", "drive_speed_mean"),
)
# Those of a bit on the surface that its blades leave.
ON_SURFACE = (*("axial_velocity_min", "axial_velocity_max", "axial_velocity_mean"), *("blade_depth_max", "turned_back"))

# What a string that does nothing but turn is started from, and what pictures show of it.


@dataclass(frozen=True)
class TurningStart(Starts):
    """The state at the start; ``bit_speed`` None is the set speed."""

    twist: float = state(0.0, "rad", 1e5, "-150 to 0 rad: some 20 turns")
    bit_speed: float | None = state(None, "rad/s", 1e4, "-10 to 60 rad/s")
    drive_angle: float = state(0.0, "rad", 1e9, "any")


DRAWN = Drawn(
    panels=(Panel("torsional", "bit_speed", "bit_speed_peaks", "bit_speed_max"),),
    histories=("twist", "bit_speed", "bit_torque"),
    planes=(("twist", "bit_speed"),),
    section=("section_twist", "section_bit_speed"),
    section_planes=(("section_twist", "section_bit_speed"),),
    summary=("stick_slip_index", "stuck_fraction"),
    attractors=(("bit_speed_min", "bit_speed_max", "Swing of the bit"), (None, "stick_slip_index", "Index")),
)


def drawn_along(*histories: str) -> Drawn:
    """What pictures show where the bit also moves along the hole, with these histories."""
    return Drawn(
        panels=(Panel("axial", "z", "axial_peaks", "axial_max"), *DRAWN.panels),
        histories=histories,
        planes=(("z", "vz"), *DRAWN.planes),
        section=("section_axial", *DRAWN.section),
        section_planes=(("section_axial", "section_axial_velocity"), *DRAWN.section_planes),
        summary=(*DRAWN.summary, "lift_off_fraction"),
        attractors=(
            DRAWN.attractors[0],
            (None, "lift_off_fraction", "Time off the rock"),
            (None, "stick_slip_index", "Stick-slip index"),
        ),
    )
