"""The bit with its exact, state-dependent delay, written a second time: the path of the
blade is kept, and the surface under the next one is looked up in it.

Fourth-order Runge-Kutta steps of one length, shortened to end where the bit lands or
lifts off. The path is kept as pieces of cubic Hermite polynomials of time. A piece on
which the bit cuts gives the surface at an angle as the position at the time at which the
bit was there; one on which it is off bottom, the surface of a blade earlier. u is
positive down here, and absolute.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from nsdrill.data import Array

(MASS, STIFFNESS, DAMPING, WEIGHT, INERTIA, TORSION, TWISTING, SPEED, FORCE, TORQUE, WEAR, ARM, WEAR_STEEP, CONTACT,
 STEEP, RATE, SPACING) = range(17)  # fmt: skip
# a piece: angle, position, their rates, at its beginning and end; its length; whether it cuts
ANGLE0, ANGLE1, U0, U1, V0, V1, W0, W1, LENGTH, CUTS = range(10)


@njit(cache=True)
def hermite(a, b, da, db, h, s):
    return a + s * (h * da + s * (3 * (b - a) - h * (2 * da + db) + s * (h * (da + db) - 2 * (b - a))))


@njit(cache=True)
def surface_at(angle, pieces, count, p):
    """The surface that a blade has left at an angle of the bit; before the first piece that
    of steady drilling."""
    while True:
        if angle <= pieces[0, ANGLE0]:
            return pieces[0, U0] + (angle - pieces[0, ANGLE0]) * p[RATE] / p[SPEED]
        low, high = 0, count - 1
        while low < high:
            middle = (low + high) // 2
            if pieces[middle, ANGLE1] < angle:
                low = middle + 1
            else:
                high = middle
        q = pieces[low]
        if q[CUTS] == 1.0:
            break
        angle -= p[SPACING]
    begin, end = 0.0, 1.0
    for _ in range(52):
        s = 0.5 * (begin + end)
        if hermite(q[ANGLE0], q[ANGLE1], q[W0], q[W1], q[LENGTH], s) < angle:
            begin = s
        else:
            end = s
    return hermite(q[U0], q[U1], q[V0], q[V1], q[LENGTH], 0.5 * (begin + end))


@njit(cache=True)
def interference(y, pieces, count, farthest, p):
    """u less the surface before the blade; where the bit has turned back, less that which
    it has left itself."""
    angle = y[2] if y[2] < farthest else y[2] - p[SPACING]
    return y[0] - surface_at(angle, pieces, count, p)


@njit(cache=True)
def slopes(t, y, closed, pieces, count, farthest, p, f):
    """The slopes of (u, u', angle, speed) on the side ``closed`` of the contact."""
    depth = interference(y, pieces, count, farthest, p) if closed else 0.0
    bears = min(max(p[CONTACT] * depth, 0.0), 1.0)
    wear = 0.5 * p[WEAR] * bears * (1.0 + math.tanh(p[WEAR_STEEP] * y[1]))
    force = p[FORCE] * depth + wear
    torque = (p[TORQUE] * depth + p[ARM] * wear) * math.tanh(p[STEEP] * y[3])
    f[0] = y[1]
    f[1] = (p[WEIGHT] - p[STIFFNESS] * (y[0] - p[RATE] * t) - p[DAMPING] * (y[1] - p[RATE]) - force) / p[MASS]
    f[2] = y[3]
    f[3] = (-p[TORSION] * (y[2] - p[SPEED] * t) - p[TWISTING] * y[3] - torque) / p[INERTIA]
    return torque


@njit(cache=True)
def stepped(t, y, h, closed, pieces, count, farthest, p):
    k1, k2, k3, k4 = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4)
    slopes(t, y, closed, pieces, count, farthest, p, k1)
    slopes(t + 0.5 * h, y + 0.5 * h * k1, closed, pieces, count, farthest, p, k2)
    slopes(t + 0.5 * h, y + 0.5 * h * k2, closed, pieces, count, farthest, p, k3)
    slopes(t + h, y + h * k3, closed, pieces, count, farthest, p, k4)
    return y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@njit(cache=True)
def run(y, p, end, observe_from, step):
    """The states, the interference and the torque at the ends of the observed steps, [n, 7]."""
    room, count = 1 << 16, 1
    pieces, kept, number = np.zeros((room, 10)), np.zeros((room, 7)), 0
    pieces[0] = np.array([y[2], y[2], y[0], y[0], y[1], y[1], y[3], y[3], 0.0, 1.0])
    t, farthest, f = 0.0, y[2], np.zeros(4)
    closed = interference(y, pieces, count, farthest, p) > 0.0
    while t < end:
        # a stage never needs the surface of its own step
        h = min(step, 0.3 * p[SPACING] / max(abs(y[3]), 1e-9))
        after = stepped(t, y, h, closed, pieces, count, farthest, p)
        changes = (interference(after, pieces, count, farthest, p) > 0.0) != closed
        if changes:
            low, high = 0.0, h
            for _ in range(50):
                middle = 0.5 * (low + high)
                trial = stepped(t, y, middle, closed, pieces, count, farthest, p)
                if (interference(trial, pieces, count, farthest, p) > 0.0) != closed:
                    high = middle
                else:
                    low = middle
            h = high
            after = stepped(t, y, h, closed, pieces, count, farthest, p)
        if after[2] > farthest:
            if count == room or number >= room - 1:
                room *= 2
                more, some = np.zeros((room, 10)), np.zeros((room, 7))
                more[:count], some[:number] = pieces[:count], kept[:number]
                pieces, kept = more, some
            pieces[count] = np.array(
                [y[2], after[2], y[0], after[0], y[1], after[1], y[3], after[3], h, 1.0 if closed else 0.0]
            )
            if y[2] < farthest:
                pieces[count, ANGLE0] = y[2]
            count, farthest = count + 1, after[2]
        t, y = t + h, after
        if changes:
            closed = not closed
        if t >= observe_from:
            if number == room:
                room *= 2
                more, some = np.zeros((room, 10)), np.zeros((room, 7))
                more[:count], some[:number] = pieces[:count], kept[:number]
                pieces, kept = more, some
            torque = slopes(t, y, closed, pieces, count, farthest, p, f)
            kept[number, 0] = t
            kept[number, 1:5] = y
            kept[number, 5] = interference(y, pieces, count, farthest, p)
            kept[number, 6] = torque
            number += 1
    return kept[:number]


@dataclass
class Measured:
    """Features of the reference, with the names and signs of those of the model."""

    swing: float
    axial_velocity_max: float
    axial_velocity_min: float
    axial_velocity_rms: float
    bit_speed_min: float
    bit_speed_max: float
    lift_off_fraction: float
    blade_depth_max: float
    surface_torque_mean: float


def measured(
    table: dict[str, Any],
    transient: float,
    observe: float,
    vz: float,
    step: float = 2.5e-4,
    twist: float | None = None,
    speed: float | None = None,
) -> Measured:
    """The features of a run with these lane parameters from steady drilling, disturbed by an
    axial velocity [m/s], or from another twist [rad]
    and bit speed [rad/s]."""
    one = {name: float(np.ravel(value)[0]) for name, value in table.items()}
    p = np.array([
        1 / one["per_mass"], one["axial_stiffness"], one["axial_damping"], one["wob"], 1 / one["per_inertia"],
        one["torsional_stiffness"], one["torsional_damping"], one["set_speed"], one["cutting_force"],
        one["cutting_torque"], 2 * one["wear_half"], one["wear_arm"], one["wear_smoothing"], one["per_contact_depth"],
        one["bit_smoothing"], one["penetration"], 1 / one["per_spacing"],
    ])  # fmt: skip
    depth = one["blade_depth"]
    torque = (p[TORQUE] * depth + p[ARM] * p[WEAR]) * math.tanh(p[STEEP] * p[SPEED])
    twist = -(torque + p[TWISTING] * p[SPEED]) / p[TORSION] if twist is None else twist
    start = np.array([0.0, p[RATE] - vz, twist, p[SPEED] if speed is None else speed])
    kept = run(start, p, transient + observe, transient, step)
    t, u, v, angle, w, front, torque = kept.T
    up, twists = p[RATE] - v, angle - p[SPEED] * t
    return Measured(
        float(np.ptp(u - p[RATE] * t)), float(up.max()), float(up.min()), _mean(t, up * up) ** 0.5,
        float(w.min()), float(w.max()), _mean(t, (front <= 0.0) * 1.0), float(front.max()),
        -p[TORSION] * _mean(t, twists),
    )  # fmt: skip


def _mean(t: Array, values: Array) -> float:
    return float(np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(t)) / (t[-1] - t[0]))
