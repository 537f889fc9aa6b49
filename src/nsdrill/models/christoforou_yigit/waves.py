"""Standing waves of pipe and collars, axial and torsional: the modes of which the
lumped string has the first.

The top is held by the drive; the bit is free, or pressed against a spring, the rock.
Both parts carry waves of the same speed c, with impedances z_p and z_c. From the top, u
= sin(w x / c) in the pipe; in the collars u is proportional to sin(theta) and the force
to z_c w cos(theta), with tan(theta) = (z_c / z_p) tan(w L_p / c) at the joint and theta
growing by w L_c / c to the bit. With a free bit cos(theta) = 0 there, which is the
known z_p cos cos = z_c sin sin; on a spring of stiffness K tan(theta) = -z_c w / K.
Theta grows with w, so no mode is missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nsdrill.models.christoforou_yigit import tubes
from nsdrill.models.christoforou_yigit.parameters import Parameters


def torsional_waves(parameters: Parameters, depth: float, count: int) -> np.ndarray:
    """The first ``count`` torsional frequencies [rad/s] of a string to ``depth`` [m]:
    top fixed, bit free."""
    collar, pipe = tubes.collars(parameters), tubes.pipe(parameters, depth)
    steel = parameters.drillstring.material
    speed = math.sqrt(steel.shear_modulus / steel.density)
    return _standing(speed, (pipe.length, pipe.torsional), (collar.length, collar.torsional), 0.0, count)


def axial_waves(parameters: Parameters, depth: float, count: int, *, on_rock: bool = False) -> np.ndarray:
    """The first ``count`` axial frequencies [rad/s] of a string to ``depth`` [m]: top
    fixed, bit off or on the rock."""
    collar, pipe = tubes.collars(parameters), tubes.pipe(parameters, depth)
    steel = parameters.drillstring.material
    speed = math.sqrt(steel.young_modulus / steel.density)
    spring = parameters.bit.rock_stiffness if on_rock else 0.0
    return _standing(speed, (pipe.length, pipe.axial), (collar.length, collar.axial), spring, count)


def _standing(
    speed: float, pipe: tuple[float, float], collar: tuple[float, float], spring: float, count: int
) -> np.ndarray:
    """The first ``count`` frequencies [rad/s] of two parts, each (length, impedance),
    in which waves have this ``speed``; ``spring`` is the stiffness at the bit, 0 for a
    free end."""
    (pipe_length, z_p), (collar_length, z_c) = pipe, collar

    def joint_angle(angle: float, ratio: float) -> float:
        """The angle in the same quadrant whose tangent is ``ratio`` times that of
        ``angle``."""
        multiple = round(angle / math.pi) * math.pi
        return multiple + math.atan(ratio * math.tan(angle - multiple))

    def phase(w: float) -> float:
        """A phase that grows with w and is n pi at mode n."""
        theta = joint_angle(w * pipe_length / speed, z_c / z_p) + w * collar_length / speed
        return theta + (math.atan(z_c * w / spring) if spring > 0.0 else math.pi / 2)

    frequencies, low = [], 0.0
    for number in range(1, count + 1):
        high = low + math.pi * speed / (pipe_length + collar_length)
        while phase(high) < number * math.pi:
            high *= 1.5
        low = rising_root(lambda w, target=number * math.pi: phase(w) - target, low, high)  # type: ignore[misc]
        frequencies.append(low)
    return np.array(frequencies)


def rising_root(function: Callable[[float], float], low: float, high: float) -> float:
    """The zero, to the last bit, of a ``function`` that grows from ``low`` to
    ``high``."""
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if function(middle) < 0.0 else (low, middle)
    return high
