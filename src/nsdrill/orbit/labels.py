"""Special points of a branch: folds, doublings, tori and the like from the multipliers,
grazing from the touches.

The codes and two-letter words are those of AUTO-07p; those above 100 are nsdrill's own.
A fold is where the number continued turns; a doubling where the count of real
multipliers below -1 changes; a branch point where that above 1 changes without a fold;
a torus bifurcation where a pair appears outside the unit circle and the real counts
stay. Signs of determinants alone would take a pair of reciprocal real multipliers for a
torus bifurcation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from nsdrill.analysis.bifurcations import BRANCH, DOUBLING, FOLD, HOPF, TORUS
from nsdrill.orbit.arclength import Point, Test
from nsdrill.orbit.periodic import Orbit

REAL = 1e-7  # of the modulus: an imaginary part that counts for nothing
NEAR = 1e-6  # of the unit circle


@dataclass(frozen=True)
class Graze:
    """What it means that a contact, by its place, is ``reached`` or ``lost``: codes of
    labels, None where it is no event of its own; whether it is one that it is reached
    another number of times in a period, ``counted``."""

    reached: int | None
    lost: int | None
    counted: bool = True


def counts(orbit: Orbit) -> tuple[int, int, int]:
    """How many real multipliers lie above 1 and below -1, and how many others outside
    the unit circle."""
    own = orbit.own
    real = np.abs(own.imag) <= REAL * np.maximum(np.abs(own), 1.0)
    value = own.real
    above, below = int(np.sum(real & (value > 1.0))), int(np.sum(real & (value < -1.0)))
    return above, below, int(np.sum(~real & (np.abs(own) > 1.0)))


def _product(at: float) -> Callable[[Point], float]:
    """The determinant of the monodromy less ``at`` times the identity, without the
    trivial multipliers."""

    def value(point: Point) -> float:
        own = point.found.own - at
        size = np.maximum(np.abs(own), 1e-300)
        return float(np.sign(np.prod(own / size).real) * np.min(size) if len(own) else 1.0)

    return value


def _pair(number: int) -> Callable[[Point], float]:
    """The modulus less 1 of the complex multiplier that is the ``number``-th
    largest."""

    def value(point: Point) -> float:
        own = point.found.own
        pairs = own[np.abs(own.imag) > REAL * np.maximum(np.abs(own), 1.0)]
        moduli = np.sort(np.abs(pairs))[::-1]
        return float(moduli[number] - 1.0) if len(moduli) > number else -1.0

    return value


def tests_of(
    grazes: Mapping[int, Graze], *, equilibrium: bool
) -> Callable[[Point, Point], list[Test]]:
    """The function that gives the tests for special points between two points of a
    branch. ``grazes`` says of which contacts, by place, what is an event;
    ``equilibrium``: a pair that leaves the unit circle is a Hopf bifurcation."""

    def tests(here: Point, there: Point) -> list[Test]:
        found = []
        one, two = here.found, there.found
        folded = (here.tangent[-1] > 0.0) != (there.tangent[-1] > 0.0)
        if folded:
            found.append(Test(FOLD, lambda point: float(point.tangent[-1])))
        (up1, down1, out1), (up2, down2, out2) = counts(one), counts(two)
        if down1 != down2 and (down1 + down2) % 2:
            found.append(Test(DOUBLING, _product(-1.0)))
        if up1 != up2 and (up1 + up2) % 2 and not folded:
            found.append(Test(BRANCH, _product(1.0)))
        if out1 != out2 and up1 == up2 and down1 == down2:
            found.append(Test(HOPF if equilibrium else TORUS, _pair(min(out1, out2))))
        for contact, graze in grazes.items():
            if (test := _grazing(one, two, contact, graze)) is not None:
                found.append(test)
        return found

    return tests


def _grazing(one: Orbit, two: Orbit, contact: int, graze: Graze) -> Test | None:
    (low1, high1, n1), (low2, high2, n2) = one.touches[contact], two.touches[contact]
    never1, never2, always1, always2 = high1 <= 0.0, high2 <= 0.0, low1 > 0.0, low2 > 0.0
    if never1 != never2 and graze.reached is not None:
        return Test(graze.reached, lambda point: float(point.found.touches[contact, 1]))
    if always1 != always2 and graze.lost is not None:
        return Test(graze.lost, lambda point: float(point.found.touches[contact, 0]))
    code = graze.reached if graze.reached is not None else graze.lost
    if (
        graze.counted
        and n1 != n2
        and not (never1 or never2 or always1 or always2)
        and code is not None
    ):
        level = 0.5 * (n1 + n2)
        words = f"{int(n1)} to {int(n2)} touches a period"
        return Test(
            code,
            lambda point: float(np.sign(point.found.touches[contact, 2] - level)),
            words,
            jumps=True,
        )
    return None


def kinks_of(contacts: int) -> Callable[[Orbit, Orbit], bool]:
    """The function that says whether one of the first ``contacts`` is reached, or lost,
    another number of times a period in one motion than in another."""

    def kinked(one: Orbit, two: Orbit) -> bool:
        first, second = one.touches[:contacts], two.touches[:contacts]
        return bool(
            np.any(first[:, 2] != second[:, 2])
            or np.any((first[:, :2] > 0.0) != (second[:, :2] > 0.0))
        )

    return kinked


def margins_of(orbit: Orbit) -> np.ndarray:
    """By how much each multiplier lies outside the unit circle, as the logarithm of its
    modulus, the largest first."""
    moduli = np.sort(np.abs(orbit.own))[::-1]
    return np.asarray(np.log(np.maximum(moduli, 1e-300)))


def critical_vector(orbit: Orbit, at: float) -> np.ndarray:
    """The unit eigenvector, in natural scales, of the multiplier nearest to ``at``."""
    assert orbit.monodromy is not None
    _, _, right = np.linalg.svd(orbit.monodromy - at * np.eye(len(orbit.monodromy)))
    return np.asarray(right[-1])
