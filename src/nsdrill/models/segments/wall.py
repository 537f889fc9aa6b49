"""Coulomb friction of the string along the wall of an inclined hole, at every node between
top and bit: the load on the wall, and the law.

With w_b = (rho - rho_f) g A the weight of a metre in mud, a the inclination of the hole
at a depth and D the outer diameter, the load on a node and its torque at the turning
speed w are::

    N_i = integral of w_b sin(a) over half a segment above and below
    T_i = N_i (D/2) g(w) [mu_d + (mu_s - mu_d) / (1 + (w/w_t)^8)],  g = (2/pi) atan(eps w)

With ``axial_friction`` it acts against the slip, turning and along the hole. With v the
axial velocity of a node, less the rate of penetration of steady drilling, the slip over
the radius is (v/(D/2), w); the law has the size s of that in place of w, and torque and
force are shares of it, w/s and v/(D/2)/s. The force is counted from that of steady
drilling, as the weight on bit is that at the bit.

so that friction is static up to about the threshold w_t, and dynamic beyond it. The
load of the half segments at top and bit is borne by the next node: a shaft in bearings
holds the top, and an implicit stage solves for the speed of a bit with the torque of
the cutters alone. Left out: the load by which a tensioned string is pulled into a
bend, and the wider tool joints.

Source: Aarsnes & Shor 2018, J. Petrol. Sci. Eng. 163, for friction that is static up to a
threshold speed; the smooth fall at the threshold is made here.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from nsdrill.equations.graph import Number
from nsdrill.equations.library import Law, direction
from nsdrill.equations.plain import Rows, on_arrays
from nsdrill.equations.trace import Named
from nsdrill.models.christoforou_yigit.coefficients import one_by_one
from nsdrill.models.operation import Numeric
from nsdrill.models.segments.parameters import Parameters, WallFriction

STEEPEST = 2.04  # of the fall of 1/(1 + u^8), at u = 0.97
Part: TypeAlias = tuple[Numeric, Numeric, int]
Stations: TypeAlias = Sequence[tuple[float, Numeric]]
NUMBERS = ("wall_smoothing", "wall_per_threshold", "wall_rise", "wall_dynamic")


def _factors(v: Number, numbers: Named) -> tuple[Number, Number]:
    square = (numbers.per_threshold * v) * (numbers.per_threshold * v)
    fourth = square * square
    return direction(numbers.smoothing * v), 1.0 / (1.0 + fourth * fourth)


def _coefficient(v: Number, factors: tuple[Number, Number], numbers: Named) -> Number:
    turned, weakened = factors
    return turned * (numbers.rise * weakened + numbers.dynamic)


def _beyond_the_threshold(numbers: Named) -> Named:
    """A law that is dynamic at every speed: Newton's method ends at rest from there too."""
    return Named(
        smoothing=numbers.smoothing, decay=0.0, rise=0.0, dynamic=numbers.dynamic, per_threshold=numbers.per_threshold
    )


rubbing = Law(_factors, _coefficient, lambda n: STEEPEST * n.rise * n.per_threshold, _beyond_the_threshold)


def numbers_of(p: Named) -> Named:
    """The numbers of the law, among the lane parameters ``p``."""
    return Named(**{name.removeprefix("wall_"): getattr(p, name) for name in NUMBERS})


def is_used(parameters: Parameters) -> bool:
    """Whether the string rubs on the wall: with a coefficient that is not zero, or that is
    an axis."""
    law = parameters.well.friction_along
    return any(np.ndim(value) > 0 or value != 0.0 for value in (law.static, law.dynamic))


def columns(law: WallFriction) -> dict[str, Numeric]:
    """The lane parameters of the law, beside those of the nodes."""
    return {
        "wall_smoothing": law.smoothing,
        "wall_per_threshold": 1.0 / law.threshold,
        "wall_rise": law.static - law.dynamic,
        "wall_dynamic": law.dynamic,
    }


def names_of(last: int, axial: bool) -> tuple[str, ...]:
    """The names of all lane parameters of a string whose bit is the node ``last``; of one
    that rubs along the hole, too, with the rate of penetration, and of each node 1 over
    the radius, the force over the torque as accelerations, and the force of steady
    drilling over the mass."""
    inner = range(1, last)
    along = [f"wall_{name}_{node}" for name in ("per_radius", "along", "steady") for node in inner]
    return (*NUMBERS, *(f"wall_{node}" for node in inner), *(("penetration_rate", *along) if axial else ()))


def coefficient(law: WallFriction, speed: Numeric) -> Numeric:
    """The coefficient, with its sign, at turning speeds [rad/s]."""
    return on_arrays(_coefficient_of, {"speed": speed, **columns(law)})["coefficient"]


def _coefficient_of(n: Rows) -> dict[str, Number]:
    return {"coefficient": rubbing(n.speed, numbers_of(n))}


def shares(law: WallFriction, speed: Numeric, along: Numeric) -> tuple[Numeric, Numeric]:
    """The coefficient against turning and that along the hole, with their signs, at turning
    speeds [rad/s] and axial velocities over the radius [rad/s]."""
    size = np.sqrt(speed * speed + along * along)
    share = coefficient(law, size) / size
    return share * speed, share * along


def radii(parameters: Parameters, lying: Sequence[Part], rubbing: Sequence[Part]) -> list[Numeric]:
    """The radius [m] at which the wall brakes each node between top and bit, from the
    :func:`levers` of the weights and of these times the radii; 1 m where no load is."""
    loads = zip(levers(parameters, lying), levers(parameters, rubbing), strict=True)
    return [
        np.where(np.greater(load, 0.0), lever / np.where(np.greater(load, 0.0), load, 1.0), 1.0)
        for load, lever in loads
    ]


def levers(parameters: Parameters, parts: Sequence[Part]) -> list[Numeric]:
    """The load on the wall times the radius [N m] of each node between top and bit: the
    torque there with a coefficient of one. Of each part of the string from the top are
    given the weight of a metre in mud times the radius [N], the length [m] and the number
    of its segments."""
    tubes: list[Numeric] = []
    ends: list[Numeric] = [0.0]
    for lever, length, count in parts:
        start = ends[-1]
        ends += [start + length * (i / count) for i in range(1, count + 1)]
        tubes += [lever] * count
    found: list[Numeric] = [0.0] * len(ends)
    for i, lever in enumerate(tubes):
        middle = 0.5 * (ends[i] + ends[i + 1])
        for node, top, bottom in ((i, ends[i], middle), (i + 1, middle, ends[i + 1])):
            node = min(max(node, 1), len(tubes) - 1)
            found[node] = found[node] + lever * across(parameters, top, bottom)
    return found[1:-1]


def across(parameters: Parameters, top: Numeric, bottom: Numeric) -> Numeric:
    """The integral of the sine of the inclination between two depths [m], exact. The
    inclination is linear between the stations of the survey, and beyond them that of
    the next one."""
    stations = tuple(_stations(parameters))
    if isinstance(top, float) and isinstance(bottom, float) and all(isinstance(angle, float) for _, angle in stations):
        return _integral_of_numbers(stations, top, bottom)
    return _integral(stations, top, bottom)


def _integral(stations: Stations, top: Numeric, bottom: Numeric) -> Numeric:
    depths = [depth for depth, _ in stations]
    total: Numeric = 0.0
    for low, high in pairwise((-np.inf, *depths, np.inf)):
        ends = np.clip(top, low, high), np.clip(bottom, low, high)
        if np.all(ends[0] == ends[1]):
            continue
        first, last = (inclination_at(stations, end) for end in ends)
        middle, half = 0.5 * (first + last), 0.5 * (last - first)
        bent = np.where(half != 0.0, one_by_one(math.sin, half) / np.where(half != 0.0, half, 1.0), 1.0)
        total = total + (ends[1] - ends[0]) * one_by_one(math.sin, middle) * bent
    return total


# A search for an onset asks for the same half segments at every speed.
_integral_of_numbers = lru_cache(maxsize=4096)(_integral)


def inclination_at(stations: Stations, depth: Numeric) -> Numeric:
    """The inclination [rad] at depths [m]."""
    found = stations[0][1] + 0.0 * depth
    for (low, above), (high, below) in pairwise(stations):
        found = found + np.clip((depth - low) / (high - low), 0.0, 1.0) * (below - above)
    return found


def _stations(parameters: Parameters) -> Stations:
    """The depth [m] and the inclination [rad] of each station."""
    well = parameters.well
    return [(one.depth, well.inclination if one.inclination is None else one.inclination) for one in well.survey]


def greatest_sine(parameters: Parameters) -> float:
    """The greatest sine of an inclination of the survey, 0 of a vertical hole."""
    return max(math.sin(float(np.max(angle))) for _, angle in _stations(parameters))
