"""The Poincare section: the state each time the bit has turned by a revolution, or by a
lobe.

The bit angle reaches the next multiple of the spacing (2 pi, or 2 pi over the lobes)
once, when it gets there first: a bit that turns back and comes again is not counted
twice. The crossing is located on the continuous solution.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.abi import inlined
from nsdrill.elementary import fma
from nsdrill.observe.interpolant import crossing, quintic

Array = np.ndarray[Any, np.dtype[np.float64]]
REVOLUTION = 2.0 * math.pi
# What is kept of a crossing: the eight states and the bit angle.
ENTRY = 9
# numpy's own arctan2 differs in the last bit between processors with AVX-512 and
# without.
_arctan2 = np.vectorize(math.atan2, otypes=[float])


@inlined
def bit_angle_crossing(twist0, omega0, alpha0, twist1, omega1, alpha1, h, drive, turned, level):  # type: ignore[no-untyped-def]
    """Where in the step (0 to 1) the bit angle is ``level``; ``turned`` is the drive
    angle at the step's start."""
    p0, p1, p2, p3, p4, p5 = quintic(
        twist0 + turned - level,
        h * omega0,
        h * h * alpha0,
        fma(drive, h, twist1 + turned) - level,
        h * omega1,
        h * h * alpha1,
    )
    return crossing(p0, p1, p2, p3, p4, p5, 0.0, 1.0)


def section_width(returns: int) -> int:
    """Columns of a ring: the count, then the entries."""
    return 1 + ENTRY * returns if returns else 0


def returns_of(ring: Array, returns: int) -> Array:
    """The last ``returns`` crossings of each run, oldest first, NaN where fewer: shape
    (runs, returns, ENTRY).

    ``ring`` holds the observer's columns, shape (runs, section_width(returns)).
    """
    found = ring[:, :1].astype(np.int64)
    entries = ring[:, 1:].reshape(len(ring), returns, ENTRY)
    place = np.arange(returns)
    oldest = np.where(found > returns, found % returns, 0)
    ordered = np.take_along_axis(entries, ((oldest + place) % returns)[:, :, None], axis=1)
    return np.where((place < found)[:, :, None], ordered, np.nan)


def coordinates(crossings: Array) -> dict[str, Array]:
    """The variables of the section from crossings (..., ENTRY): polar, the whirl angle
    counted from the bit's."""
    x, vx, y, vy, z, vz, twist, speed, angle = np.moveaxis(crossings, -1, 0)
    r = np.sqrt(x * x + y * y)
    safe = np.where(r > 0.0, r, 1.0)
    relative = _arctan2(y, x) - angle
    return {
        "section_radius": r,
        "section_radial_velocity": (x * vx + y * vy) / safe,
        "section_whirl_angle": relative - REVOLUTION * np.round(relative / REVOLUTION),
        "section_whirl_speed": (x * vy - y * vx) / (safe * safe),
        "section_axial": z,
        "section_axial_velocity": vz,
        "section_twist": twist,
        "section_bit_speed": speed,
    }


def in_the_bit_frame(section: Mapping[str, Array]) -> Array:
    """States at the section as an observer on the bit sees them: shape (..., returns,
    8), in the order of the states.

    A motion that repeats after some revolutions does so in this frame, whatever the
    lobes and the drive angle.
    """
    r, angle = section["section_radius"], section["section_whirl_angle"]
    outward, around = section["section_radial_velocity"], r * section["section_whirl_speed"]
    c, s = np.cos(angle), np.sin(angle)
    return np.stack(
        [
            r * c,
            outward * c - around * s,
            r * s,
            outward * s + around * c,
            section["section_axial"],
            section["section_axial_velocity"],
            section["section_twist"],
            section["section_bit_speed"],
        ],
        axis=-1,
    )
