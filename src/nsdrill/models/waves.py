"""Standing waves of a string of even parts, axial and torsional: the modes of which a
lumped string has the first. The top is held by the drive; the bit is free, or pressed
against a spring, the rock.

Each part carries waves of a speed c with an impedance z. From the top, u = sin(w x / c) in
the first; in every part u is proportional to sin(theta) and the force to z w cos(theta),
with tan(theta) / z the same on both sides of a joint and theta growing by w L / c along a
part. With a free bit cos(theta) = 0 there, which for two parts is the known z_p cos cos =
z_c sin sin; on a spring of stiffness K tan(theta) = -z w / K. Theta grows with w, so no mode
is missed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from nsdrill.models.operation import Numeric
from nsdrill.models.sections import Part

Carrier = tuple[float, float, float]  # of waves: length [m], their speed [m/s], impedance


def torsional(parts: Sequence[Part]) -> list[Carrier]:
    """The parts as carriers of torsional waves, with impedances I_p sqrt(G rho) [N m s]."""
    return [_carrier(part.length, part.polar, part.shear, part.density) for part in parts]


def axial(parts: Sequence[Part]) -> list[Carrier]:
    """The parts as carriers of axial waves, with impedances A sqrt(E rho) [N s/m]."""
    return [_carrier(part.length, part.area, part.young, part.density) for part in parts]


def _carrier(length: Numeric, section: Numeric, modulus: Numeric, density: Numeric) -> Carrier:
    return float(length), math.sqrt(modulus / density), float(section) * math.sqrt(modulus * density)


def standing(parts: Sequence[Carrier], spring: float, count: int) -> np.ndarray:
    """The first ``count`` frequencies [rad/s] of these ``parts`` from the top; ``spring``
    is the stiffness at the bit, 0 for a free end."""

    def joint_angle(angle: float, ratio: float) -> float:
        """The angle in the same quadrant whose tangent is ``ratio`` times that of
        ``angle``."""
        multiple = round(angle / math.pi) * math.pi
        return multiple + math.atan(ratio * math.tan(angle - multiple))

    def phase(w: float) -> float:
        """A phase that grows with w and is n pi at mode n."""
        length, speed, z = parts[0]
        theta = w * length / speed
        for length, speed, lower in parts[1:]:
            theta, z = joint_angle(theta, lower / z) + w * length / speed, lower
        return theta + (math.atan(z * w / spring) if spring > 0.0 else math.pi / 2)

    frequencies, low = [], 0.0
    whole, fastest = sum(length for length, _, _ in parts), max(speed for _, speed, _ in parts)
    for number in range(1, count + 1):
        high = low + math.pi * fastest / whole
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
