"""What is observed of the main model.

Values, slopes and second derivatives of what is no state are functions of the rows; the
interference, the torque and the radius are computed once a step, as they share terms
with the right-hand side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.compiler.functions import fma
from nsdrill.data import Array
from nsdrill.models.christoforou_yigit import variables
from nsdrill.models.christoforou_yigit.columns import Options, aux_of, columns_of, states_of
from nsdrill.models.christoforou_yigit.equations import lobed
from nsdrill.models.friction import LAWS, with_slope, with_slope_from_factors
from nsdrill.models.operation import Numeric
from nsdrill.models.turning import STICK_SLIP_INDEX, STUCK_FRACTION, SURFACE_TORQUES
from nsdrill.observe.channels import (
    Channel,
    Declaration,
    Derived,
    Extremes,
    Feature,
    Mean,
    MeanAbove,
    Names,
    Outputs,
    Section,
    TimeAbove,
    measured_by,
)

LEAST_HOLD = 1.0  # least c f', stage length over the time constant of friction, of a held bit
CREEP_RANGE = 20.0  # of eps |v|; at lower speeds friction has not reached its full size
REVOLUTION = 2.0 * math.pi
# The last bit of numpy's arctan2 differs between processors with and without AVX-512.
_arctan2 = np.vectorize(math.atan2, otypes=[float])
SLOPES = ("ax", "ay", "az", "alpha", "drive_acceleration", "motor_torque_rate")
OUTPUTS = (
    "interference",
    "interference_rate",
    "interference_curvature",
    "torque",
    "torque_rate",
    "r",
    "r_rate",
    "per_r",
)


def names_of(options: Options) -> Names:
    """The names of the rows."""
    states = states_of(options)
    return Names(states, SLOPES[: len(states) // 2], columns_of(options), aux_of(options))


# Values, slopes and second derivatives of the channels.
def _outputs(lobes: int, friction: int) -> Callable[..., Any]:
    multiple, slope = lobed(lobes), with_slope_from_factors(list(LAWS.values())[friction])

    def outputs(  # type: ignore[no-untyped-def]
        cosine_now, sine_now, direction_now, decay_now, radius_now,
        x, vx, y, vy, z, vz, az, bit_speed, alpha, surface_amplitude, rock_stiffness,
        bit_smoothing, bit_decay, bit_rise, bit_dynamic,
    ):  # fmt: skip
        sine, sine_slope = multiple(sine_now, cosine_now)  # of a multiple of the bit angle
        speed = surface_amplitude * bit_speed
        u, du = fma(surface_amplitude, sine, -z), fma(speed, sine_slope, -vz)
        ddu = fma(surface_amplitude, alpha * sine_slope, fma(-speed * bit_speed, lobes * lobes * sine, -az))
        # The bit torque is force times arm; the arm changes with the bit speed. One
        # division serves two quotients, torsional and lateral.
        force = rock_stiffness * max(u, 0.0)
        dforce = rock_stiffness * du if u > 0.0 else 0.0
        scaled = bit_smoothing * bit_speed
        flat = fma(scaled, scaled, 1.0)
        inverse = 1.0 / (flat * radius_now)
        arm, darm = slope(
            bit_speed, direction_now, decay_now, radius_now * inverse,
            bit_smoothing, bit_decay, bit_rise, bit_dynamic,
        )  # fmt: skip
        per_r = flat * inverse
        torque, torque_rate = force * arm, fma(dforce, arm, force * darm * alpha)
        return u, du, ddu, torque, torque_rate, radius_now, fma(x, vx, y * vy) * per_r, per_r

    return outputs


def _torque_inside(friction: int) -> Callable[..., Any]:
    law = with_slope(list(LAWS.values())[friction])

    def torque(  # type: ignore[no-untyped-def]
        u, du, omega, alpha, rock_stiffness, bit_smoothing, bit_decay, bit_rise, bit_dynamic
    ):
        arm, darm = law(omega, bit_smoothing, bit_decay, bit_rise, bit_dynamic)
        force = rock_stiffness * max(u, 0.0)
        dforce = rock_stiffness * (du if u > 0.0 else max(du, 0.0))
        return force * arm, fma(dforce, arm, force * darm * alpha)

    return torque


def _hold(bb_now, slope_now):  # type: ignore[no-untyped-def]
    return bb_now * slope_now - LEAST_HOLD


def _slowness(bit_smoothing, bit_speed):  # type: ignore[no-untyped-def]
    return CREEP_RANGE - abs(bit_smoothing * bit_speed)


def _bit_angle(twist, set_speed, time, phase):  # type: ignore[no-untyped-def]
    return twist + fma(set_speed, time, phase)


def _square(x, y):  # type: ignore[no-untyped-def]
    return fma(x, x, y * y)


def _square_slope(x, vx, y, vy):  # type: ignore[no-untyped-def]
    return 2.0 * fma(x, vx, y * vy)


def _square_curvature(x, vx, ax, y, vy, ay):  # type: ignore[no-untyped-def]
    return 2.0 * fma(vx, vx, fma(vy, vy, fma(x, ax, y * ay)))


def _rolling(x, vx, y, vy, per_r):  # type: ignore[no-untyped-def]
    """The tangential speed of the collar's centre around the hole [m/s]."""
    return fma(x, vy, -(y * vx)) * per_r


def _rolling_rate(x, vx, ax, y, vy, ay, per_r, r_rate):  # type: ignore[no-untyped-def]
    speed = fma(x, vy, -(y * vx)) * per_r
    return fma(-speed, r_rate, fma(x, ay, -(y * ax))) * per_r


def _pipe_twist(twist, lag):  # type: ignore[no-untyped-def]
    return twist - lag


def _pipe_rate(bit_speed, drive_speed):  # type: ignore[no-untyped-def]
    return bit_speed - drive_speed


def _pipe_curvature(alpha, drive_acceleration):  # type: ignore[no-untyped-def]
    return alpha - drive_acceleration


CHANNELS: tuple[Channel, ...] = (
    Channel("twist", "twist", "bit_speed", "alpha", frame="set_speed"),
    Channel("bit speed", "bit_speed", "alpha", rate_of="twist", level="stuck_below"),
    Channel("bit angle", _bit_angle, "bit_speed", "alpha"),
    Channel("bit position", "z", "vz", "az"),
    Channel("interference", "interference", "interference_rate", "interference_curvature", level=0.0, scale="z"),
    Channel("reach", _square, _square_slope, _square_curvature, level="gap", scale="gap", squared=True),
    Channel("radius", "r", "r_rate"),
    Channel("x", "x", "vx"),
    Channel("y", "y", "vy"),
    Channel("vx", "vx", "ax"),
    Channel("vy", "vy", "ay"),
    Channel("vz", "vz", "az"),
    Channel("rolling speed", _rolling, _rolling_rate),
)


def _ratio(numerator: Numeric, denominator: Numeric) -> Numeric:
    with np.errstate(divide="ignore", invalid="ignore"):
        return numerator / denominator


def _least_amplitude(surface_amplitude: Array) -> Numeric:
    return np.maximum(surface_amplitude, 1e-6)


# Derived features that the elastic collar has as well.
SHARED: tuple[Derived, ...] = (
    Derived("lift_off_fraction", lambda on_rock: 1.0 - on_rock),
    Derived(
        "bit_force_max", lambda rock_stiffness, interference_max: rock_stiffness * np.maximum(interference_max, 0.0)
    ),
    *SURFACE_TORQUES,
)
FEATURES: tuple[Feature, ...] = (
    Extremes("bit position", "axial_max", "axial_min", "axial_peaks", smooth=True, compared=_least_amplitude),
    Extremes("twist", "twist_max", "twist_min", smooth=True, compared=None),
    Extremes("interference", "interference_max", maxima=True, smooth=True, compared=None),
    Extremes("reach", "radius_max", peaks="radius_peaks", maxima=True, smooth=True, compared="gap"),
    TimeAbove("bit speed", "unstuck"),
    TimeAbove("interference", "on_rock"),
    Mean("twist", "twist_mean"),
    MeanAbove("rolling speed", "wall_contact_fraction", "rolled"),
    MeanAbove("bit speed", "wall_contact_fraction", "rotated"),
    STICK_SLIP_INDEX,
    STUCK_FRACTION,
    Derived("whirl_ratio", lambda whirl_speed_mean, bit_speed_mean: _ratio(whirl_speed_mean, bit_speed_mean)),
    Derived(
        "rolling_ratio",
        lambda rolled, rotated, collar_radius: np.where(rotated != 0.0, _ratio(-rolled, rotated * collar_radius), 0.0),
    ),
    *SHARED,
)


def wall_force(hertz: int, stiffness: Numeric, penetration: Numeric) -> Numeric:
    """The force of the wall [N] at these penetrations [m], 0 where they are negative."""
    depth = np.maximum(penetration, 0.0)
    # as in the right-hand side; the bits of numpy's power depend on the processor
    return stiffness * depth * (np.sqrt(depth) if hertz else 1.0)


def _wall_force_max(hertz: int) -> Callable[..., Numeric]:
    return lambda wall_stiffness, gap, radius_max: wall_force(hertz, wall_stiffness, radius_max - gap)


@lru_cache
def declaration_of(options: Options) -> Declaration:
    """The declaration of a string with these options."""
    implicit = options.implicit
    channels, features = CHANNELS, FEATURES
    if options.driven:  # the twist of the pipe gives the torque at the surface
        pipe = Channel("pipe twist", _pipe_twist, _pipe_rate, _pipe_curvature, scale=0.1)
        channels += (
            pipe,
            Channel("lag", "lag", "drive_speed", "drive_acceleration", frame="set_speed"),
            Channel("drive speed", "drive_speed", "drive_acceleration", rate_of="lag"),
        )
        features = tuple(
            replace(feature, channel="pipe twist")
            if isinstance(feature, Extremes | Mean) and feature.channel == "twist"
            else feature
            for feature in features
        )
        features += (Extremes("drive speed", "drive_speed_max", "drive_speed_min", smooth=True, compared=None),)
    if options.weight:  # a vertical hole has no low side
        features += (Mean("x", "x_sum"), Mean("y", "y_sum"))
        features += (
            Derived("x_mean", lambda weight, x_sum: np.where(weight > 0.0, x_sum, np.nan)),
            Derived("y_mean", lambda weight, y_sum: np.where(weight > 0.0, y_sum, np.nan)),
        )
    # Friction holds the bit at the end of a step that is much longer than the time
    # constant of friction. The acceleration jumps inside such a step, so its polynomial
    # undershoots; and the bit creeps, so the sign of the acceleration is that of
    # rounding. The torque of a bit that is held during the whole step balances that of
    # the string and has no maximum inside.
    bit_speed = Extremes(
        "bit speed",
        "bit_speed_max",
        "bit_speed_min",
        "bit_speed_peaks",
        slip="set_speed",
        smooth=not implicit,
        unless=(None, _hold) if implicit else None,
        compared="set_speed",
    )
    torque = Extremes(
        "bit torque",
        "bit_torque_max",
        maxima=True,
        smooth=True,
        unless=(_slowness, _hold) if implicit else None,
        compared=None,
    )
    present = {"drive_speed": options.driven, "stabilizers": options.stabilizer, "inclined": options.weight}
    recorded = measured_by(variables.FEATURES, features, [word for word, is_present in present.items() if is_present])
    return Declaration(
        channels=(
            *channels,
            Channel(
                "bit torque",
                "torque",
                "torque_rate",
                scale=1.0,
                of=("interference", "bit speed"),
                inside=_torque_inside(options.friction),
            ),
        ),
        features=(bit_speed, torque, *features, *recorded, Derived("wall_force_max", _wall_force_max(options.hertz))),
        outputs=Outputs(OUTPUTS, _outputs(options.lobes, options.friction)),
        section=Section("bit angle", REVOLUTION),
    )


# The Poincare section in polar coordinates.
def coordinates(returns: Array) -> dict[str, Array]:
    """The variables of the section from returns (..., 9), the eight states and
    the bit angle, in polar coordinates
    with the whirl angle measured from the bit angle."""
    x, vx, y, vy, z, vz, twist, speed, angle = np.moveaxis(returns, -1, 0)
    r = np.sqrt(x * x + y * y)
    divisor = np.where(r > 0.0, r, 1.0)
    relative = _arctan2(y, x) - angle
    return {
        "section_radius": r,
        "section_radial_velocity": (x * vx + y * vy) / divisor,
        "section_whirl_angle": relative - REVOLUTION * np.round(relative / REVOLUTION),
        "section_whirl_speed": (x * vy - y * vx) / (divisor * divisor),
        "section_axial": z,
        "section_axial_velocity": vz,
        "section_twist": twist,
        "section_bit_speed": speed,
    }


def in_the_bit_frame(section: Mapping[str, Array]) -> Array:
    """The states at the section in the frame that rotates with the bit, shape (...,
    returns, 8), in the order of the states.

    A motion that repeats after some revolutions repeats in this frame, whatever the
    number of lobes and the drive angle.
    """
    r, angle = section["section_radius"], section["section_whirl_angle"]
    v_radial, v_tangential = section["section_radial_velocity"], r * section["section_whirl_speed"]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack(
        [
            r * c,
            v_radial * c - v_tangential * s,
            r * s,
            v_radial * s + v_tangential * c,
            section["section_axial"],
            section["section_axial_velocity"],
            section["section_twist"],
            section["section_bit_speed"],
        ],
        axis=-1,
    )
