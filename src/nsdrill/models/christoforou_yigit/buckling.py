"""The axial loads at which a tube buckles: between supports, on the low side of an
inclined hole, under its own weight.

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
LONGEST = 100.0  # units of length; a longer column takes more terms than are made


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
    return 2.0 * np.sqrt(
        tube.bending * max(tube.weight, 0.0) * np.sin(inclination) / tube.clearance
    )


def half_wave(tube: Tube, inclination: float) -> float | None:
    """Half a wave [m] of that sinusoid; None where the tube does not lie on the low
    side."""
    if not tube.clearance > 0.0:
        return None
    pressing = tube.weight * math.sin(inclination)
    return math.pi * (tube.bending * tube.clearance / pressing) ** 0.25 if pressing > 0.0 else None


def vertical(tube: Tube) -> float | None:
    """Force [N] on the lower end of a vertical tube, hinged at both ends, at which it
    buckles under its own weight; None where the weight does not count, or the tube is
    longer than :data:`LONGEST` units.

    The least W of E I y'''' + ((W - w x) y')' = 0, by sines of both ends: a generalised
    eigenproblem.
    """
    if not tube.weight > 0.0:
        return None
    unit = (tube.bending / tube.weight) ** (1 / 3)
    length = tube.length / unit
    if length > LONGEST:
        return None
    number = np.arange(1, int(40 + 3 * length))
    wave = number * math.pi / length

    def part(difference: np.ndarray) -> np.ndarray:
        """The integral of x cos(difference pi x / length) over the length."""
        safe = np.where(difference == 0, 1, difference)
        odd = (-1.0) ** np.abs(difference) - 1.0
        return np.where(difference == 0, 0.5 * length**2, (length / (safe * math.pi)) ** 2 * odd)

    apart = number[:, None] - number[None, :]
    together = number[:, None] + number[None, :]
    hung = np.outer(wave, wave) * 0.5 * (part(apart) + part(together))
    bent = np.diag(wave**4 * length / 2) + hung
    shortened = wave * math.sqrt(length / 2)  # the roots of what the force does, which is diagonal
    least = np.linalg.eigvalsh(bent / np.outer(shortened, shortened))[0]
    return float(least) * (tube.bending * tube.weight**2) ** (1 / 3)
