"""Rate of penetration and mechanical specific energy.

The models with rock share one law of the rate, ROP = c1 W sqrt(omega) + c2
(Christoforou & Yigit 2003), in which the weight on bit W and the speed omega are means
over the observation. The mean speed is that at the surface, which in the long run is
that of the bit; with an ideal drive it is the set speed, and the rate is the one that
defines the depth of cut. The axial motion of the bit does not add to the rate: it is
measured from the mean surface of the rock.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.variables import feature

Array = np.ndarray[Any, np.dtype[Any]]

DRILLED = (
    feature("rate_of_penetration", "m s-1", "rate of penetration at the mean speed", "drilled"),
    feature("mechanical_specific_energy", "Pa", "mechanical specific energy, by the torque at the surface", "drilled"),
)


def drilled(torque: Array, speed: Any, cutting: Any, wob: Any, bit_radius: Any) -> dict[str, Array]:
    """The variables :data:`DRILLED` of runs with these mean torques [N m] and speeds
    [rad/s] at the surface, each an array [n] of SI values.

    ``cutting`` has c1 and c2 of the law; ``wob`` [N], ``bit_radius`` [m] and, like
    these, ``speed`` are numbers or arrays [n]. The energy is W/A + 2 pi N T / (A ROP)
    (Teale 1965) with the torque at the surface, as on a rig, which is not only that of
    the bit. It is infinite where the bit does not advance.
    """
    rate = np.maximum(cutting.c1 * wob * np.sqrt(np.maximum(speed, 0.0)) + cutting.c2, np.zeros(np.shape(torque)))
    power = wob * rate + speed * torque
    per_length = np.divide(power, rate, out=np.full(np.shape(rate), np.inf), where=rate > 0.0)
    return {"rate_of_penetration": rate, "mechanical_specific_energy": per_length / (math.pi * bit_radius * bit_radius)}
