"""The rock under the blades of a drag bit, whose surface each blade leaves for the next
one: the regenerative effect, once, for every model that has such a rock.

The depth of cut of a blade is the position of the bit less the surface that the blade
before it left, a delay of an n-th part of a revolution that depends on the motion. Here
the surface between two blades is a field that rotation carries past them, and no
history is kept. With u the position of the bit, down, and x from 0 behind a blade to 1
before the next one, h(x) is u less the height of the surface::

    dh/dt + c dh/dx = u',   c = n w / 2 pi
    h(0) = min(h(1), 0),  d = max(h(1), 0)   bit turns forward
    h(1) = h(0)                              backward: what the blade left returns

so that a bit off bottom leaves the surface as it is, and any number of earlier passes
counts. Of N coefficients h_k of Legendre polynomials P_k(2x - 1), with the heights F0
and F1 from the upwind side at both ends::

    h_k' = c (2k + 1) [(-1)^k F0 - F1 + 2 (h_{k-1} + h_{k-3} + ...)] + u' delta_{k0}

The transfer function from end to end is the Pade approximation [N-1/N] of the delay.
In steady drilling h = x d, which two coefficients represent exactly.

The rock's force and torque, with the depth d of a blade and a length l of wear flats,
of all blades together::

    F = n zeta eps a d + sigma a l H(u'),   T = n eps a^2 d / 2 + (mu gamma a / 2) sigma a l H(u')

where H is 1 while the bit penetrates and 0 while it withdraws or is off bottom. This is
friction along the hole, F_w/2 + (F_w/2) sgn(u'), with the direction smoothed over a
part of the rate of penetration, and of the depth of cut for the contact.

Sources: Detournay & Defourny 1992, Int. J. Rock Mech. Min. Sci. 29: 13-23, for the
loads; Richard, Germay & Detournay 2007, J. Sound Vib. 305: 432-456, for the delay;
Aarsnes & van de Wouw 2019, J. Sound Vib. 444: 127-151, for the surface as a field.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.equations.graph import Node, Number
from nsdrill.equations.library import friction, touching
from nsdrill.equations.trace import Named, part
from nsdrill.models.friction import LAWS, Numbers, columns_of, numbers_of
from nsdrill.models.operation import Numeric

LEAST_DEPTH = 1e-5  # m, over which contact and friction are smoothed at least
# A delay of the phase theta is right to 1 % with 3 + 1.75 theta / pi coefficients.
FIRST_STATES, STATES_PER_TURN = 3.0, 1.75
# Each landing of a bit that bounces leaves a kink: so many times these coefficients follow
# its cycle to 0.5 % and its greatest depth of cut to 3 % (tests/regenerative).
OFF_BOTTOM = 2.5


class Cut(NamedTuple):
    """Steady cutting; numbers, or arrays over operating points. The ``force`` [N/m] and
    the ``torque`` [N] per depth of cut of a blade, the force under the ``wear`` flats [N]
    and its ``arm`` [m], the ``depth`` of cut of a blade [m] and the ``rate`` of
    penetration [m/s]."""

    force: Numeric
    torque: Numeric
    wear: Numeric
    arm: Numeric
    depth: Numeric
    rate: Numeric

    def steady_torque(self, wob: Numeric) -> Numeric:
        """The torque of steady drilling [N m] under the weight [N] of this cut."""
        return self.torque * self.depth + self.arm * np.minimum(self.wear, wob)


def cut_of(bit: Any, radius: Numeric, wob: Numeric, speed: Numeric) -> Cut:
    """Steady cutting of a ``bit`` with blades (:class:`.blades.Blades`) and this radius [m] under a
    weight [N] at a speed [rad/s]. A bit whose wear flats bear the whole weight does not cut:
    its depth is 0."""
    force = bit.blades * bit.zeta * bit.specific_energy * radius
    torque = bit.blades * bit.specific_energy * radius * radius / 2
    wear = bit.contact_stress * radius * bit.wear_length
    share = 0.5 * (1.0 + np.tanh(bit.wear_smoothing))  # of the friction that is smoothed
    depth = np.maximum((wob - wear * share) / force, 0.0)
    arm = bit.friction * bit.geometry * radius / 2
    return Cut(force, torque, wear, arm, depth, depth * bit.blades * speed / (2 * math.pi))


# The lane parameters.
OWN_LANES = (  # beside those of the law of the bit, which every rock has
    "cutting_force",
    "cutting_torque",
    "wear_half",
    "wear_arm",
    "per_contact_depth",
    *columns_of("wear"),
    "penetration",
    "per_spacing",
    "blade_depth",
)
LAW = "rational"  # of LAWS: it has a smoothed sign alone


def columns(bit: Any, radius: Numeric, wob: Numeric, speed: Numeric) -> dict[str, Numeric]:
    """The lane parameters of a bit; ``blade_depth`` is a scale, never 0."""
    cut = cut_of(bit, radius, wob, speed)
    scale = np.maximum(cut.depth, LEAST_DEPTH)
    rate = scale * bit.blades * speed / (2 * math.pi)
    return {
        "cutting_force": cut.force,
        "cutting_torque": cut.torque,
        "wear_half": 0.5 * cut.wear,
        "wear_arm": cut.arm,
        "per_contact_depth": bit.contact_smoothing / scale,
        **Numbers(bit.wear_smoothing / rate, 0.0, 0.0, 1.0).columns("wear"),
        **Numbers(bit.smoothing, 0.0, 0.0, 1.0).columns("bit"),
        "penetration": cut.rate,
        "per_spacing": bit.blades / (2 * math.pi),
        "blade_depth": scale,
    }


def friction_rates(
    bit: Any, radius: Numeric, wob: Numeric, speed: Numeric, per_mass: Numeric, per_inertia: Numeric
) -> dict[str, Any]:
    """The rates [1/s] at which friction at rest brakes the bit, by the keys of ``bit``
    that make it steep."""
    lanes, cut = columns(bit, radius, wob, speed), cut_of(bit, radius, wob, speed)
    return {
        "smoothing": lanes["bit_smoothing"] * cut.steady_torque(wob) * per_inertia,
        "wear_smoothing": lanes["wear_smoothing"] * lanes["wear_half"] * per_mass,
    }


# The equations.


def names(count: int) -> tuple[str, ...]:
    """The names of so many states of the surface [m]."""
    return tuple(f"surface_{k}" for k in range(count))


def steady(depth: Numeric, count: int) -> dict[str, Numeric]:
    """These states in steady drilling with this depth of cut of a blade [m]."""
    values: dict[str, Numeric] = dict.fromkeys(names(count), 0.0 * depth)
    return values | {"surface_0": depth / 2, "surface_1": depth / 2}


def fastest(count: int, per_spacing: Numeric, speed: Numeric) -> Numeric:
    """The greatest eigenvalue of so many states of the surface [1/s]."""
    return 1.8 * count * per_spacing * speed


@part
def _contact(depth: Node, per_depth: Node) -> Any:
    """How much of the wear flats bears."""
    found: Any = min(per_depth * depth, 1.0)
    return found


def loads(depth: Number, axial_velocity: Number, bit_speed: Number, p: Named) -> tuple[Any, Any]:
    """(force [N], torque [N m]) of the rock on a bit whose blades cut this ``depth`` [m]. The
    velocity is positive up, less that of steady drilling."""
    bearing = p.wear_half * _contact(depth, p.per_contact_depth)
    law, slip = LAWS[LAW], axial_velocity - p.penetration
    wear = bearing - friction("wear", slip=slip, normal=bearing, law=law, numbers=numbers_of(p, "wear"))
    normal = p.cutting_torque * depth + p.wear_arm * wear
    torque = friction("bit", slip=bit_speed, normal=normal, law=law, numbers=numbers_of(p, "bit"))
    return p.cutting_force * depth + wear, torque


@part
def _upwind(front: Node, depth: Node, behind: Node, rate: Node) -> tuple[Node, Node]:
    """h at both ends of the surface, from the side from which it comes."""
    left = front - depth if rate > 0.0 else behind
    reached = front if rate > 0.0 else behind
    return left, reached


def sums_of(h: Sequence[Number]) -> tuple[list[Any], Any, Any]:
    """(for each state the sum h_{k-1} + h_{k-3} + ... of those below it, h behind a blade, at x =
    0, and before the next one, at x = 1)."""
    even, odd = h[0], h[1]
    below: list[Any] = [0.0, even]
    for k, one in enumerate(h[2:], 2):
        if k % 2:
            below.append(even)
            odd = odd + one
        else:
            below.append(odd)
            even = even + one
    return below, even - odd, even + odd


def rates_of(
    below: Sequence[Number], behind: Number, front: Number, depth: Number, advance: Number, rate: Number
) -> list[Any]:
    """The rates of the states [m/s], from their :func:`sums_of`: ``advance`` is u' [m/s],
    ``rate`` the passages of blades per second, negative where the bit turns back."""
    left, reached = _upwind(front, depth, behind, rate)
    even, odd, twice = rate * (left - reached), -(rate * (left + reached)), 2.0 * rate
    rates = [(2 * k + 1) * ((odd if k % 2 else even) + twice * sums) for k, sums in enumerate(below)]
    return [rates[0] + advance, *rates[1:]]


def bit_on_rock(s: Named, p: Named, count: int) -> tuple[Any, ...]:
    """(h before the blade [m], force and torque of the rock, rates of the ``count`` states of
    the surface)."""
    below, behind, front = sums_of([getattr(s, name) for name in names(count)])
    depth = touching("rock", front)
    force, torque = loads(depth, s.vz, s.bit_speed, p)
    rates = rates_of(below, behind, front, depth, p.penetration - s.vz, p.per_spacing * s.bit_speed)
    return front, force, torque, dict(zip(names(count), rates, strict=True))


# What theory says of it.


class Threshold(NamedTuple):
    """The set speed [rad/s] above which steady drilling is stable to axial vibration, and
    the frequency of that at the threshold [rad/s]; both 0 where it is stable at every
    speed."""

    speed: float
    frequency: float


def axial_threshold(mass: float, stiffness: float, damping: float, cutting: float, blades: int) -> Threshold:
    """The threshold of a bit of one mass [kg] on a spring [N/m] and a damper [N s/m] with
    a ``cutting`` force per depth [N/m], in closed form.

    At a frequency w of the margin m w^2 - k = F (1 - cos w tau) and c w = -F sin w tau, so
    that (k - m w^2)^2 + 2 F (k - m w^2) + (c w)^2 = 0. Without spring and damper the speed
    is (2/n) sqrt(2 F/m), which is 2 sqrt(2 psi/n) of Richard, Germay & Detournay 2007."""
    half = mass * (stiffness + cutting) - 0.5 * damping * damping
    root = half * half - mass * mass * stiffness * (stiffness + 2.0 * cutting)
    if root < 0.0 or half <= 0.0:
        return Threshold(0.0, 0.0)
    found = []
    for square in ((half + math.sqrt(root)) / mass**2, (half - math.sqrt(root)) / mass**2):
        if square <= 0.0:
            continue
        frequency = math.sqrt(square)
        cosine = max(-1.0, min(1.0, 1.0 + (stiffness - mass * square) / cutting))
        phase = 2.0 * math.pi - math.acos(cosine)  # its sine is negative
        found.append(Threshold(2.0 * math.pi * frequency / (blades * phase), frequency))
    return max(found, default=Threshold(0.0, 0.0))


def greatest_frequency(mass: float, stiffness: float, damping: float, cutting: float) -> float:
    """The greatest frequency [rad/s] at which the rock can feed axial vibration at any
    speed; that of the mass on the rock where it feeds none."""
    half = mass * (stiffness + cutting) - 0.5 * damping * damping
    root = half * half - mass * mass * stiffness * (stiffness + 2.0 * cutting)
    if root < 0.0 or half <= 0.0:
        return math.sqrt((stiffness + cutting) / mass)
    return math.sqrt((half + math.sqrt(root)) / mass**2)


STEPS = 4000  # frequencies at which a chain is tried


def fed_by(stiffness: Callable[[Array], Array], force: float, blades: int, most: float) -> tuple[Threshold, float]:
    """(the axial threshold, the greatest frequency that the rock feeds [rad/s]) of a bit with
    a dynamic ``stiffness`` [N/m], complex at frequencies [rad/s], and a cutting ``force``
    per depth [N/m], up to the frequency ``most``.

    With that stiffness D the rock feeds a frequency w at some speed where |D + F| is less
    than F, and there is no growth and no decay where exp(-i w tau) = 1 + D/F."""
    frequencies = most * (np.arange(STEPS) + 0.5) / STEPS

    def excess(trial: Array) -> Array:
        return np.abs(stiffness(trial) + force) - force

    fed = excess(frequencies) < 0.0
    edges = np.flatnonzero(fed[1:] != fed[:-1])
    if len(edges) == 0:
        return Threshold(0.0, 0.0), most if fed[-1] else 0.0
    low, high, inside = frequencies[edges], frequencies[edges + 1], fed[edges]
    for _ in range(50):
        middle = 0.5 * (low + high)
        same = (excess(middle) < 0.0) == inside
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    phase = 2.0 * math.pi - np.abs(np.angle(1.0 + stiffness(low) / force))  # its sine is negative
    speeds = 2.0 * math.pi * low / (blades * phase)
    fastest = int(np.argmax(speeds))
    return Threshold(float(speeds[fastest]), float(low[fastest])), most if fed[-1] else float(low[-1])


def states_needed(theta: float) -> int:
    """How many states represent a delay of this phase [rad] to 1 %."""
    return max(2, math.ceil(FIRST_STATES + STATES_PER_TURN * theta / math.pi - 1e-9))


def states_off_bottom(theta: float) -> int:
    """How many states represent a motion that comes off bottom: its cycle to 0.5 %, its
    greatest depth of cut to 3 %, with a delay of this phase [rad]."""
    return math.ceil(OFF_BOTTOM * (FIRST_STATES + STATES_PER_TURN * theta / math.pi) - 1e-9)
