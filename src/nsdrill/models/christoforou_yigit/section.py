"""The Poincare section: the state each time the bit has rotated by a revolution, or by
a lobe.

A return is recorded when the bit angle first reaches the next multiple of the spacing
(2 pi, or 2 pi over the lobes): a bit that rotates back and forth over it is not counted
twice. The crossing is located on the continuous solution.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.compiler.functions import inlined
from nsdrill.compiler.words import fma
from nsdrill.observe.interpolant import crossing, quintic

Array = np.ndarray[Any, np.dtype[np.float64]]
REVOLUTION = 2.0 * math.pi
# Values of a crossing: the eight states and the bit angle.
ENTRY = 9
# The last bit of numpy's arctan2 differs between processors with and without AVX-512.
_arctan2 = np.vectorize(math.atan2, otypes=[float])


@inlined
def bit_angle_crossing(  # type: ignore[no-untyped-def]
    twist0, omega0, alpha0, twist1, omega1, alpha1, h, set_speed, drive_angle, level
):
    """The place in the step (0 to 1) where the bit angle is ``level``, from twist, bit
    speed and its rate at both ends, the length ``h`` of the step, the speed
    ``set_speed`` of the drive and its angle ``drive_angle`` at the start of the
    step."""
    p0, p1, p2, p3, p4, p5 = quintic(
        twist0 + drive_angle - level,
        h * omega0,
        h * h * alpha0,
        fma(set_speed, h, twist1 + drive_angle) - level,
        h * omega1,
        h * h * alpha1,
    )
    return crossing(p0, p1, p2, p3, p4, p5, 0.0, 1.0)


def section_width(returns: int) -> int:
    """The number of columns of a ring of ``returns``: the count, then the entries."""
    return 1 + ENTRY * returns if returns else 0


def returns_of(ring: Array, returns: int) -> Array:
    """The last ``returns`` crossings of each run, oldest first, NaN where fewer: shape
    (runs, returns, ENTRY).

    ``ring`` holds the observer's columns, shape (runs, section_width(returns)).
    """
    counts = ring[:, :1].astype(np.int64)
    entries = ring[:, 1:].reshape(len(ring), returns, ENTRY)
    index = np.arange(returns)
    oldest = np.where(counts > returns, counts % returns, 0)
    ordered = np.take_along_axis(entries, ((oldest + index) % returns)[:, :, None], axis=1)
    return np.where((index < counts)[:, :, None], ordered, np.nan)


def coordinates(crossings: Array) -> dict[str, Array]:
    """The variables of the section from crossings (..., ENTRY), in polar coordinates
    with the whirl angle measured from the bit angle."""
    x, vx, y, vy, z, vz, twist, speed, angle = np.moveaxis(crossings, -1, 0)
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
