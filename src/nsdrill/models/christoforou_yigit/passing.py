"""How fast the speed is to be raised off bottom for the collar to pass where its imbalance would
bring it to the wall: by integration, as the bit lags behind the drive.

While the set speed rises at the rate a from W_0, the bit swings about it and turns at

    W = W_0 + a (t + d),  W' = a (1 + d'),

with d the response of string and drive to a unit rate: below a held top, without damping,
d = -sin(w t)/w, so that the bit hardly speeds up once in each period 2 pi/w. Where it then has a
speed at which the imbalance drives the collar to the wall, it keeps it for longer than at a
constant rate, so that a faster rate may fail where a slower one passes.

Where the rise ends after a time T, the bit goes on at a (d(t) - d(t - T)) from the end speed: it lags behind
the drive, overtakes it, and swings below the end speed by up to 2 a/w, which :func:`swing_below` has per rate.

The collar z = x + iy moves off the wall as :mod:`.equations` has it, at this speed of the bit. Stabilisers
rub with their greatest coefficient. What the collar does to the speed is left out.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from nsdrill.data import Array
from nsdrill.models.christoforou_yigit.coefficients import Coefficients
from nsdrill.models.christoforou_yigit.columns import stabilizer_radius, weights
from nsdrill.models.christoforou_yigit.derived_quantities import greatest_coefficient
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.christoforou_yigit.table import drilling_at
from nsdrill.models.drilling import Drilling
from nsdrill.models.operation import Operation

SURE = 2.0  # times the estimate at a constant rate
SLOWEST, FASTEST = 0.5 * math.pi / 30, 20.0 * math.pi / 30  # rad/s^2: rates that are tried
RATIO = 1.04  # of a rate that is tried over the next slower one
STARTS = np.array([0.0, 0.15, 0.3, 0.45])  # of the least speed at the wall, at which the ramp begins
CLEAR = 0.9  # of the gap, up to which the collar may go: the rest is for what is left out
STEPS = 20  # in a period of bending, of the integration
SWING_STEPS = 48  # in a period of torsion, of the response of the string
REACH = 5.0  # times sqrt(a): how far below and above the speeds at the wall the integration goes
FURTHEST = 0.4  # of the least of these speeds, below which it does not go further down
TINY, SLOW_SLIP = 1e-12, 0.01  # m, m/s: of the contact of a stabiliser
SWUNG = 10.0  # periods of torsion, after which a swing is known
GROUPS = 4  # of rates of similar duration that are integrated together


class _Response(NamedTuple):
    """What the bit does at a unit rate, at steps of time [s] from where the rise begins: d, d' and
    the integral of d."""

    step: float
    late: Array
    slope: Array
    angle: Array

    def at(self, time: Array) -> tuple[Array, Array, Array]:
        place = time / self.step
        below = np.minimum(place.astype(np.intp), len(self.late) - 2)
        part = place - below
        late, slope, angle = ((1.0 - part) * one[below] + part * one[below + 1] for one in self[1:])
        return late, slope, angle


def least_sure_rate(
    parameters: Parameters, operation: Operation, k: Coefficients, wall: tuple[float, float], estimate: float
) -> float | None:
    """The rate [rad/s^2] from which on, up to :data:`FASTEST`, the collar stays off the wall as the
    speed is raised through the speeds of the ``wall`` [rad/s] off bottom, from rest or from a lower
    speed: at least :data:`SURE` times the ``estimate`` at a constant rate. None where no such rate is
    known."""
    if estimate == 0.0:  # no imbalance
        return 0.0
    least = max(SURE * estimate, SLOWEST)
    if least > FASTEST or not math.isfinite(wall[1]) or wall[0] <= 0.0:
        return None
    rates = np.geomspace(least, FASTEST, 1 + math.ceil(math.log(FASTEST / least) / math.log(RATIO)))
    far = greatest_radii(parameters, operation, k, wall, rates)
    fails = np.flatnonzero(~(far < CLEAR * float(k.gap)))  # what is not a number fails, too
    first = int(fails[-1]) + 1 if fails.size else 0
    return float(rates[first]) if first < len(rates) else None


def greatest_radii(
    parameters: Parameters, operation: Operation, k: Coefficients, wall: tuple[float, float], rates: Array
) -> Array:
    """How far from the axis [m] a collar without a wall goes at each of the ``rates`` [rad/s^2], from
    the worst of the :data:`STARTS`."""
    drilling = drilling_at(parameters, operation)
    rate, start = (one.ravel() for one in np.meshgrid(rates, STARTS * wall[0], indexing="ij"))
    margin = REACH * np.sqrt(rate)
    begin = (wall[0] - np.minimum(margin, FURTHEST * wall[0]) - start) / rate - drilling.period / 2
    begin = np.maximum(begin, 0.0)
    end = (wall[1] + margin - start) / rate + drilling.period / 2
    response = _response(drilling, float(end.max()))
    far, slow_first = np.empty(len(rate)), np.argsort(begin - end)
    for those in np.array_split(slow_first, GROUPS):
        if those.size:
            times = begin[those], end[those]
            far[those] = _integrated(parameters, k, (rate[those], start[those]), times, response)
    return far.reshape(len(rates), -1).max(axis=1)


def swing_below(parameters: Parameters, operation: Operation) -> float:
    """How far [rad/s] the bit swings below the speed at which a rise of the set speed ends, from there on, for each
    rad/s^2 of its rate: the most, whenever it ends."""
    drilling = drilling_at(parameters, operation)
    late = _response(drilling, SWUNG * drilling.period).late
    return float(np.max(np.maximum.accumulate(late) - late))


def _response(drilling: Drilling, longest: float) -> _Response:
    """That of the string and its drive, up to the ``longest`` time [s]; a string lags where the study
    freezes its torsion, too."""
    step = drilling.period / SWING_STEPS
    count = math.ceil(longest / step) + 2
    matrix, bit = drilling.matrix, drilling.string.bit
    size, angles = len(matrix), len(drilling.string.turning.angles)
    speeds = range(bit - angles + 1, bit + 1)
    whole = np.zeros((size + 2, size + 2))  # with the angle of the bit, and 1
    whole[:size, :size], whole[speeds, -1], whole[size, bit] = matrix, -1.0, 1.0
    across, states = exponential(whole * step), np.zeros((count, size + 2))
    states[0, -1] = 1.0
    for number in range(1, count):
        states[number] = across @ states[number - 1]
    return _Response(step, states[:, bit], states @ whole[bit], states[:, size])


def _integrated(
    parameters: Parameters, k: Coefficients, ramps: tuple[Array, Array], times: tuple[Array, Array], response: _Response
) -> Array:
    """How far from the axis [m] the collar goes in ``ramps`` of the speed, their rates and the speeds
    where they begin, between these ``times``, of the longest first."""
    (rate, start), (begin, end) = ramps, times
    mass, mud, swirl = float(k.m_l), float(k.m_f / k.m_l), float(parameters.mud.swirl)
    spring, stabilizer = float(k.k_bend) / mass, parameters.stabilizer
    clearance = float(stabilizer.clearance or 0.0)
    rubbing = greatest_coefficient(stabilizer.friction) if stabilizer.clearance is not None else 0.0
    arm_of_rub = float(stabilizer_radius(parameters, clearance))
    arm = float(k.m_e * parameters.drillstring.eccentricity) / mass
    weight = 1j * float(weights(parameters)[0]) / mass
    step = 2.0 * math.pi / math.sqrt(spring) / STEPS
    counts = np.ceil((end - begin) / step).astype(int)
    time = begin + step * np.arange(counts.max())[:, None]
    late, slope, angle = response.at(time)
    speed = start + rate * (time + late)
    push = np.exp(1j * (start * time + rate * (0.5 * time * time + angle)))
    push *= step * arm * (speed * speed - 1j * rate * (1.0 + slope))
    push -= step * weight
    square = np.minimum(speed[0] ** 2, (1.0 - FURTHEST / 2) * spring)
    z = (push[0] / step + weight) / (spring - square) - weight / spring  # it swings about its sag
    v = 1j * speed[0] * (z + weight / spring)
    if clearance:
        z -= 1j * clearance * (weight != 0.0)
    drag, held, far = step * float(k.c_h) / mass, step * spring, np.zeros(len(rate))
    mud_rate = swirl * (start + rate * time)
    going = np.searchsorted(-counts, -np.arange(counts.max()), side="left")
    for number, lanes in enumerate(going.tolist()):
        at, by, most = z[:lanes], v[:lanes], far[:lanes]
        radius = np.abs(at)
        np.maximum(most, radius, out=most)
        pulled = held * at
        if stabilizer.clearance is not None:
            apart = np.maximum(radius, clearance + TINY)
            around = (by * at.conj()).imag / apart**2
            slip = speed[number, :lanes] * arm_of_rub + around * clearance
            pulled *= (1.0 - clearance / apart) * (1.0 + 1j * rubbing * np.tanh(slip / SLOW_SLIP))
        if swirl:
            turning = mud_rate[number, :lanes]
            half_turn = np.exp(1j * step * mud * turning)  # half before the forces and half after: no energy
            by *= half_turn
            through = by - 1j * turning * at
            by += step * mud * turning**2 * at - drag * np.abs(through) * through + push[number, :lanes] - pulled
            by *= half_turn
        else:
            by *= 1.0 - drag * np.abs(by)
            by += push[number, :lanes] - pulled
        at += step * by
    return far


def exponential(matrix: Array) -> Array:
    """That of a small matrix: its series, and squares of it."""
    squares = max(0, math.ceil(math.log2(max(float(np.abs(matrix).sum(axis=1).max()), 1.0))) + 1)
    small, found, term = matrix / 2.0**squares, np.eye(len(matrix)), np.eye(len(matrix))
    for order in range(1, 15):
        term = term @ small / order
        found = found + term
    for _ in range(squares):
        found = found @ found
    return found
