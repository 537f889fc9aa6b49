"""The string of the control literature: drive, pipe and bit as three inertias, under a drive
with a proportional and an integral gain (after Navarro-Lopez and Cortes 2007)."""

import nsdrill
from nsdrill import number


@nsdrill.model
def three_inertias(
    lag=number(0.0, "rad", "lag of the drive"),
    drive=number(3.0, "rad/s", "speed of the table"),
    pipe=number(0.0, "rad", "twist of the pipe"),
    pipe_speed=number(3.0, "rad/s", "speed of the pipe"),
    twist=number(0.0, "rad", "twist of the bit"),
    bit_speed=number(3.0, "rad/s", "speed of the bit"),
    *,
    speed=number(3.0, "rad/s", "set speed", low=1e-3),
    weight=number(22.24e3, "N", "weight on bit", low=0.0),
    J_drive=number(930.0, "kg m^2"),
    J_pipe=number(2782.25, "kg m^2"),
    J_bit=number(471.97, "kg m^2"),
    upper=number(698.06, "N m/rad"),
    lower=number(907.48, "N m/rad"),
    c_upper=number(139.61, "N m s/rad"),
    c_lower=number(181.49, "N m s/rad"),
    c_table=number(425.0, "N m s/rad"),
    c_bit=number(50.0, "N m s/rad"),
    K_p=number(1000.0, "N m s/rad"),
    K_i=number(500.0, "N m/rad"),
    radius=number(0.155575, "m", "arm of friction at the bit"),
    static=0.8,
    dynamic=0.5,
    decay=0.9,
    smoothing=500.0,
):
    """Drive, pipe and bit as three inertias"""
    upper_torque = upper * (lag - pipe) + c_upper * (drive - pipe_speed)
    lower_torque = lower * (pipe - twist) + c_lower * (pipe_speed - bit_speed)
    bit_torque = nsdrill.friction(
        "bit",
        slip=bit_speed,
        normal=weight * radius,
        law="exponential",
        static=static,
        dynamic=dynamic,
        decay=decay,
        smoothing=smoothing,
    )
    control = -K_p * (drive - speed) - K_i * lag
    return {
        "lag": drive - speed,
        "drive": (control - c_table * drive - upper_torque) / J_drive,
        "pipe": pipe_speed - speed,
        "pipe_speed": (upper_torque - lower_torque) / J_pipe,
        "twist": bit_speed - speed,
        "bit_speed": (lower_torque - c_bit * bit_speed - bit_torque) / J_bit,
    }
