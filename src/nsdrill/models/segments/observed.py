"""What is observed of the string of segments."""

from __future__ import annotations

import math

from nsdrill.models.turning import turning_channels, turning_features
from nsdrill.observe.channels import Channel, Declaration, Derived, Extremes, Mean, Outputs, Section, TimeAbove


def _bit(
    sine_,
    cosine_,
    interference_,
    closing_,
    force_,
    bit_speed,
    bit_acceleration,
    bit_axial_acceleration,
    rock_stiffness,
    closing_factor,
    surface_amplitude,
    lobes,
):
    """The interference of bit and rock [m], its rate and second derivative; the force
    [N] and its rate."""
    lobe_rate = lobes * bit_speed
    closing_rate = (
        surface_amplitude * (lobes * cosine_ * bit_acceleration - sine_ * lobe_rate * lobe_rate)
        - bit_axial_acceleration
    )
    damped = 1.0 + closing_factor * closing_
    force_rate = rock_stiffness * (closing_ * damped + interference_ * closing_factor * closing_rate)
    return interference_, closing_, closing_rate, force_, force_rate if force_ > 0.0 else 0.0


def _surface_torque(lag, drive_speed, angle_1, speed_1, surface_stiffness, torsional_time):
    return surface_stiffness * (lag - angle_1 + torsional_time * (drive_speed - speed_1))


def _surface_torque_rate(
    drive_speed, speed_1, drive_acceleration, angular_acceleration_1, surface_stiffness, torsional_time
):
    return surface_stiffness * (drive_speed - speed_1 + torsional_time * (drive_acceleration - angular_acceleration_1))


def _motor_torque(
    lag,
    drive_speed,
    twist,
    bit_speed,
    angle_1,
    speed_1,
    set_speed,
    drive_stiffness,
    drive_damping,
    twist_gain,
    speed_gain,
    torque_least,
    torque_most,
    on_at,
    surface_stiffness,
    torsional_time,
    top_drag,
    time,
):
    """The torque of the motor [N m]; while the top keeps the set speed, the torque that
    this takes."""
    law = drive_stiffness * lag + drive_damping * (drive_speed - set_speed)
    law = law + twist_gain * (twist - lag) + speed_gain * (bit_speed - set_speed)
    holding_torque = (
        surface_stiffness * (lag - angle_1 + torsional_time * (drive_speed - speed_1)) + top_drag * drive_speed
    )
    return min(max(-law, torque_least), torque_most) if time >= on_at else holding_torque


def _motor_torque_rate(
    lag,
    drive_speed,
    twist,
    bit_speed,
    speed_1,
    drive_acceleration,
    bit_acceleration,
    angular_acceleration_1,
    set_speed,
    drive_stiffness,
    drive_damping,
    twist_gain,
    speed_gain,
    torque_least,
    torque_most,
    on_at,
    surface_stiffness,
    torsional_time,
    top_drag,
    time,
):
    law = drive_stiffness * lag + drive_damping * (drive_speed - set_speed)
    law = law + twist_gain * (twist - lag) + speed_gain * (bit_speed - set_speed)
    rate = drive_stiffness * (drive_speed - set_speed) + drive_damping * drive_acceleration
    rate = rate + twist_gain * (bit_speed - drive_speed) + speed_gain * bit_acceleration
    law_rate = rate if (-law > torque_least) and (-law < torque_most) else 0.0
    holding_rate = surface_stiffness * (
        drive_speed - speed_1 + torsional_time * (drive_acceleration - angular_acceleration_1)
    )
    return -law_rate if time >= on_at else holding_rate + top_drag * drive_acceleration


def _declaration(drive: tuple[Channel, Extremes]) -> Declaration:
    """The declaration with this channel of the drive, and its extremes."""
    return Declaration(
        outputs=Outputs(("interference", "closing", "closing_rate", "force", "force_rate"), _bit),
        channels=(
            Channel("bit position", "z", "vz", "bit_axial_acceleration"),
            Channel("interference", "interference", "closing", "closing_rate", level=0.0),
            *turning_channels(
                "set_speed", "stuck", lambda twist, set_speed, time, phase: twist + (phase + set_speed * time)
            ),
            Channel("force", "force", "force_rate", scale="wob"),
            Channel("surface torque", _surface_torque, _surface_torque_rate, scale="steady_torque"),
            Channel("drive speed", "drive_speed", "drive_acceleration"),
            drive[0],
            Channel(
                "hook load",
                lambda u_0, v_0, top_stiffness, top_damping: -(top_stiffness * u_0 + top_damping * v_0),
                lambda v_0, top_acceleration, top_stiffness, top_damping: (
                    -(top_stiffness * v_0 + top_damping * top_acceleration)
                ),
                scale="wob",
            ),
        ),
        features=(
            Extremes("bit position", greatest="axial_max", least="axial_min", peaks="axial_peaks"),
            TimeAbove("interference", "touching"),
            Derived("lift_off_fraction", lambda touching: 1.0 - touching),
            *turning_features("set_speed"),
            Extremes("force", greatest="bit_force_max"),
            Extremes("surface torque", greatest="surface_torque_max", least="surface_torque_min"),
            Mean("surface torque", "surface_torque_mean"),
            Extremes("drive speed", greatest="drive_speed_max", least="drive_speed_min"),
            Mean("drive speed", "drive_speed_mean"),
            drive[1],
            Extremes("hook load", greatest="hook_load_change_max", least="hook_load_change_min"),
        ),
        section=Section("bit angle", 2.0 * math.pi),
    )


DECLARATION = _declaration(
    (Channel("current", "current", "current_rate"), Extremes("current", greatest="current_max", least="current_min"))
)
# As many channels of the same kinds, so that outcomes have the same columns.
BY_TORQUE = _declaration(
    (
        Channel("drive torque", _motor_torque, _motor_torque_rate, scale="steady_torque"),
        Extremes("drive torque", greatest="drive_torque_max", least="drive_torque_min"),
    )
)
