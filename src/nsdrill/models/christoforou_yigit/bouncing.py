"""The bounce of a bit over lobes: from which speed on it may last once it has begun, and where
the bit is in it.

Off the rock the bit falls under the weight W on it and is held by the string, of stiffness k_a;
on the rock K = k_a + k_c holds it. Such an oscillator is softening: the higher the bounce, the
longer it takes, from the period of the axial contact mode to that of half a swing on the rock
and half a swing off it. So a bounce keeps step with the lobes far below ``lobe_resonance``.

It lasts as the lobes give it what damping takes. Of a bounce of period T without either, with
the velocity v of the bit, lobes of amplitude s that pass at w = 2 pi/T give at most
(Melnikov's integral, of first order in both)

    k_c s |integral of v exp(iwt) on the rock|   against   c integral of v^2 .

Where one passage of a lobe carries q bounces it gives them less. Seen from the surface, lobes
change the weight by the fraction a = s |m w^2 - k_a| / W, a locking to the q-th part of a
frequency is of order q in it, and they give at most

    a^q W |integral of v exp(iqwt)| ,

which is the former for q = 1. The least speed at which one of these is enough, less
:data:`SWING`, is a lower limit. Of 60 bits that move along the hole alone, with damping of 3e-4
to 3e-2 sqrt(K m), k_a of 0.002 to 0.05 K and s of 0.05 to 3 W/K, each started 47 times, none
bounced on below the least speed, and most did at the next one tried, 13 % above. Nor did
one of 390 strings that twist as well, but where the bit sticks and slips: it passes the lobes
faster while it slips, and bounces then.
"""

from __future__ import annotations

import math

import numpy as np

from nsdrill.data import Array
from nsdrill.models.christoforou_yigit.coefficients import Coefficients
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.operation import Operation
from nsdrill.records import dataclass

SWING = 0.9  # of a speed: a bounce makes the speed of the bit swing, which helps it
MOST_BOUNCES = 40  # in one passage of a lobe
HEIGHTS = 1.0 + np.geomspace(1e-6, 1e5, 2000)  # amplitudes on the rock, of W/K


@dataclass(frozen=True)
class Bounce:
    """A bounce at the top of its flight: the ``height`` z [m] of the bit, and the ``phase``
    [rad] of the lobes, of which the surface is the sine."""

    height: float
    phase: float


@dataclass(frozen=True)
class _Bounces:
    """Bounces of the amplitudes :data:`HEIGHTS`, without damping and lobes, with m_a, K and W
    as units: frequency, the integrals of v^2 and, as magnitude, of v exp(iwt) on the rock, and
    the height."""

    frequency: Array
    square: Array
    on_rock: Array
    height: Array


def _bounces(held: float) -> _Bounces:
    """Those with a fraction ``held`` of the stiffness in the string, above 0."""
    a, free = HEIGHTS, math.sqrt(held)
    contact = np.arccos(-1.0 / a)  # half of its time; the bit is at -1 - a cos(t)
    speed = np.sqrt(a * a - 1.0)  # as it leaves the rock
    swing = np.hypot(1.0 / held, speed / free)  # about -1/held, off the rock
    flight = np.arctan2(speed / free, 1.0 / held) / free  # half of its time
    w = math.pi / (contact + flight)
    square = a * a * (contact - np.sin(2.0 * contact) / 2.0)
    square += swing**2 * free * (free * flight - np.sin(2.0 * free * flight) / 2.0)
    # a integral of sin(t) sin(wt), with w below 1
    on_rock = a * contact * (np.sinc((1.0 - w) * contact / np.pi) - np.sinc((1.0 + w) * contact / np.pi))
    return _Bounces(w, square, np.abs(on_rock), swing - 1.0 / held)


@dataclass(frozen=True)
class _Bit:
    """A bit over lobes in these units, with the unit of frequency [rad/s] and of length [m]."""

    damping: float
    held: float
    lobes: float
    frequency: float
    length: float


def _bit(parameters: Parameters, operation: Operation, k: Coefficients) -> _Bit:
    bit = parameters.bit
    stiffness, mass = float(k.k_a + bit.rock_stiffness), float(k.m_a)
    frequency, length = math.sqrt(stiffness / mass), float(operation.wob) / stiffness
    damping = float(parameters.drillstring.axial_damping) / (mass * frequency)
    return _Bit(damping, float(k.k_a) / stiffness, float(bit.surface_amplitude) / length, frequency, length)


def bounce_speed(parameters: Parameters, operation: Operation, k: Coefficients) -> float | None:
    """The speed of the bit [rad/s] above which a bounce over the lobes, once it has begun, may
    last: a lower limit. None without lobes and where damping ends every bounce; 0 without weight
    or damping."""
    if float(parameters.bit.surface_amplitude) == 0.0:
        return None
    if not (float(operation.wob) > 0.0 and float(parameters.drillstring.axial_damping) > 0.0):
        return 0.0
    bit = _bit(parameters, operation, k)
    found = _bounces(bit.held)
    lost = bit.damping * found.square
    whole = found.on_rock * (1.0 - bit.held) / (found.frequency**2 - bit.held)  # |integral of v exp(iwt)|
    speeds = []
    for bounces in range(1, MOST_BOUNCES + 1):
        speed = found.frequency / bounces
        change = bit.lobes * np.abs(speed**2 - bit.held)
        given = (change if bounces == 1 else np.minimum(change, 1.0) ** bounces) * whole
        speeds += [float(speed[given >= lost].min())] if (given >= lost).any() else []
    return SWING * min(speeds) * bit.frequency / parameters.bit.lobes if speeds else None


def bounce(parameters: Parameters, speed: float, operation: Operation, k: Coefficients) -> Bounce | None:
    """The bounce in step with the lobes at a ``speed`` of the bit [rad/s], which its damping and
    the lobes leave in balance, and which stays so; None where there is none."""
    if not min(float(parameters.bit.surface_amplitude), float(operation.wob)) > 0.0:
        return None
    bit = _bit(parameters, operation, k)
    found, w = _bounces(bit.held), parameters.bit.lobes * speed / bit.frequency
    if not found.frequency[-1] < w < found.frequency[0]:
        return None
    lost, on_rock, height = (
        float(np.interp(-w, -found.frequency, values)) for values in (found.square, found.on_rock, found.height)
    )
    share = bit.damping * lost / (bit.lobes * (1.0 - bit.held) * on_rock)
    # A bounce that is too high comes down later in the phase, where it is given less.
    return Bounce(height * bit.length, -math.acos(-share)) if share <= 1.0 else None
