"""String and drive as a linear system x' = A x: what grows, what oscillates, how steep a
fall of the bit's friction steady drilling withstands, and what ``check`` says of these."""

from __future__ import annotations

from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.models.drives import Gains
from nsdrill.models.numbers import DerivedQuantity

BISECTIONS = 60


def growing(matrix: Array) -> complex | None:
    """The eigenvalue [1/s] that grows fastest; None where none grows."""
    roots = np.linalg.eigvals(matrix)
    worst = roots[np.argmax(roots.real)]
    return complex(worst) if worst.real > 1e-9 * np.abs(roots).max() else None


def steepest_fall(matrix: Array, bit: int, inertia: float, low: float, high: float) -> Array:
    """The steepest fall of the bit's torque with its speed [N m s/rad], between ``low``,
    where drilling is stable, and ``high``, where it is not, with which steady drilling is
    stable: of matrices [..., n, n] an array [...]. ``bit`` is the row of the bit's
    speed, and ``inertia`` [kg m^2] that of the bit."""
    lowest, highest = (np.full(matrix.shape[:-2], float(end)) for end in (low, high))
    falling = matrix.copy()
    for _ in range(BISECTIONS):
        middle = 0.5 * (lowest + highest)
        falling[..., bit, bit] = matrix[..., bit, bit] + middle / inertia  # negative damping
        stable = np.linalg.eigvals(falling).real.max(axis=-1) < 0.0
        lowest, highest = np.where(stable, middle, lowest), np.where(stable, highest, middle)
    return lowest


def quantities_of_drive(
    drive: Any, matrix: Array, torque: float, reflected: Any, law: Gains | None = None, most: int | None = None
) -> dict[str, DerivedQuantity]:
    """What ``check`` says of a ``drive`` and its string: the gains of its ``law``, what it
    reflects of a wave, by its coefficient, what its limit leaves above a steady ``torque``
    [N m], and the first ``most`` modes of ``matrix``."""
    quantities: dict[str, DerivedQuantity] = {}
    if law is not None:
        gain, damping = "integral gain of the drive, K_i", "proportional gain of the drive, K_p"
        quantities["drive_stiffness"] = DerivedQuantity(float(law.stiffness), "N m/rad", gain)
        quantities["drive_damping"] = DerivedQuantity(float(law.damping), "N m s/rad", damping)
    if drive.kind != "ideal":
        share, meaning = (
            None if reflected is None else float(abs(reflected)),
            "share of a wave at the torsional frequency",
        )
        quantities["drive_reflection"] = DerivedQuantity(share, "1", f"{meaning} that the drive reflects")
    if drive.torque_limit is not None:
        reserve, meaning = float(drive.torque_limit) - torque, "torque limit of the drive less the steady torque"
        quantities["torque_reserve"] = DerivedQuantity(reserve, "N m", meaning)
    oscillating = sorted((complex(root) for root in np.linalg.eigvals(matrix) if root.imag > 0), key=abs)
    for number, root in enumerate(oscillating[:most], start=1):
        frequency, ratio = f"frequency {number} of string and drive", "its damping ratio, without friction at the bit"
        quantities[f"drive_mode_{number}"] = DerivedQuantity(abs(root), "rad/s", frequency)
        quantities[f"drive_damping_{number}"] = DerivedQuantity(-root.real / abs(root), "1", ratio)
    return quantities
