"""The axial loads at which a tube buckles: between supports, on the low side of an
inclined hole, and under its own weight.

Sources: Euler for the span. On the low side of a hole of inclination alpha the sinusoid
begins at ``F_s = 2 sqrt(E I w sin(alpha) / c)`` (Dawson & Paslay 1984) with the half
wave ``pi (E I c / (w sin(alpha)))^(1/4)``, the helix at ``sqrt(2) F_s`` (Chen, Lin &
Cheatham 1990), and some authors have ``(2 sqrt(2) - 1) F_s`` for a helix that is
complete (Wu & Juvkam-Wold 1993); all as commonly cited. ``w`` is the weight in mud by
length and ``c`` the radial clearance. A column that hangs vertical buckles under its
own weight at ``n (E I w^2)^(1/3)`` (Lubinski 1950), where ``n`` depends on its length
in units of ``(E I / w)^(1/3)``: 1.94 is the value for eight units, not a number for
every string.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.tubes import Tube

# Effective length over length. A beam fixed at one end and pinned at the other has
# tan(x) = x, x = 4.4934...
ENDS = {"fixed_free": 2.0, "fixed_pinned": math.pi / 4.493409457909064, "fixed_fixed": 0.5}
MAX_UNITS = 100.0  # units of length; a longer column needs more terms than are computed


def euler(bending: float, span: float, ends: str | None = None) -> float:
    """Euler load [N] of a span [m] of bending stiffness E I [N m^2], pinned at both
    ends or with other ``ends``."""
    return math.pi**2 * bending / ((ENDS[ends] if ends else 1.0) * span) ** 2


def sinusoidal(tube: Tube, inclination: Any) -> Any:
    """Axial load [N] at which a tube on the low side buckles into a sinusoid, at an
    ``inclination`` [rad] of the hole from the vertical, a number or an array; NaN for a
    tube that is wider than the hole."""
    if not tube.clearance > 0.0:
        return math.nan * np.sin(inclination)
    return 2.0 * np.sqrt(tube.bending * max(tube.weight, 0.0) * np.sin(inclination) / tube.clearance)


def half_wave(tube: Tube, inclination: float) -> float | None:
    """The half wavelength [m] of the sinusoid at an ``inclination`` [rad]; None where
    the tube does not lie on the low side."""
    if not tube.clearance > 0.0:
        return None
    side_load = tube.weight * math.sin(inclination)
    return math.pi * (tube.bending * tube.clearance / side_load) ** 0.25 if side_load > 0.0 else None


def vertical(tube: Tube) -> float | None:
    """Force [N] on the lower end of a vertical tube, hinged at both ends, at which it
    buckles under its own weight; None where it has no weight in mud, or is longer than
    :data:`MAX_UNITS` units of length.

    It is the least W of E I y'''' + ((W - w x) y')' = 0, expanded in sines that vanish
    at both ends: a generalised eigenproblem.
    """
    if not tube.weight > 0.0:
        return None
    unit = (tube.bending / tube.weight) ** (1 / 3)
    length = tube.length / unit
    if length > MAX_UNITS:
        return None
    order = np.arange(1, int(40 + 3 * length))
    wavenumber = order * math.pi / length

    def moment(difference: np.ndarray) -> np.ndarray:
        """The integral of x cos(difference pi x / length) over the length."""
        safe = np.where(difference == 0, 1, difference)
        odd = (-1.0) ** np.abs(difference) - 1.0
        return np.where(difference == 0, 0.5 * length**2, (length / (safe * math.pi)) ** 2 * odd)

    differences = order[:, None] - order[None, :]
    sums = order[:, None] + order[None, :]
    work = np.outer(wavenumber, wavenumber) * 0.5 * (moment(differences) + moment(sums))
    stiffness = np.diag(wavenumber**4 * length / 2) + work
    scale = wavenumber * math.sqrt(length / 2)  # square roots of the diagonal matrix of the force
    eigenvalue = np.linalg.eigvalsh(stiffness / np.outer(scale, scale))[0]
    return float(eigenvalue) * (tube.bending * tube.weight**2) ** (1 / 3)
