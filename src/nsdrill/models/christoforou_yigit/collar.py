"""What models share whose collar moves in a round hole: the starts of an ensemble, their
labels, their returns in the frame of the bit, and the scaled features by which their
motions are compared.

**Draws of an ensemble of starts.** Start ``k`` has nine numbers, uniform in [0, 1): the upper 53 bits of the
words 9 k ... 9 k + 8 of the Philox 4x64 counter-based generator (Salmon et al. 2011)
whose key is the seed. So start ``k`` does not depend on the number of starts, and is
the same at every operating point: differences between operating points are not noise of
the draw.

**Scales.** The numbers are multiplied by natural scales of the operating point, so that
the ensemble covers the states that a string can have without breaking: with ``spread``
Q = 1, and for smaller Q nearer to steady drilling,

================  ==================================================================
lateral position  uniform over the disc of radius Q c0 about the hole axis, c0 the
                  gap: never beyond the wall
lateral velocity  uniform over the disc of radius Q max(c0 w_b, R_c Omega): the gap
                  times the bending frequency, or the speed of rolling along the
                  wall, whichever is faster
axial position    uniform within Q 2 (d + s0) of the static position -d, d = W/(k_a
                  + k_c): from off the rock to some three times the static
                  penetration
axial velocity    uniform within Q 2 s0 n_b Omega of zero
twist             uniform from (1 - Q) psi_0 to (1 - Q) psi_0 - Q 1.5 T_s/k_t, psi_0
                  = -T_0/k_t the twist of steady drilling: from an unwound string to
                  half as much again as the torque at rest T_s winds it up
bit speed         uniform within Q Omega of Omega: from stuck to twice the drive
                  speed
drive angle       uniform over a revolution
================  ==================================================================

T_s and T_0 are the torques of rock and torsional damping at mean bit force W, with the
static friction coefficient and with that of the drive speed. Only sums, products and
square roots in correctly rounded arithmetic depend on the operating point, so the
states have the same bits on every machine.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nsdrill.models.base import Array
from nsdrill.models.christoforou_yigit.coefficients import Coefficients, bit_arm, bit_load, cut_of, static_arm
from nsdrill.models.christoforou_yigit.columns import STATES, axial_scale, is_used
from nsdrill.models.christoforou_yigit.observed import in_the_bit_frame
from nsdrill.models.christoforou_yigit.parameters import Parameters
from nsdrill.models.driven import Driven
from nsdrill.models.numbers import drilled
from nsdrill.models.operation import Numeric, P, Values
from nsdrill.models.responses import STALLED, WHIRL, Stalled, Thresholds
from nsdrill.variables import BACKWARD, BACKWARD_ROLLING, FORWARD, IRREGULAR, LOW_SIDE, NO_WHIRL

# Weights of the scaled features, in their order, when attractors of neighbouring
# operating points are matched. Three features change much along one branch: the contact
# fraction goes from 0 to 1 while the radius grows by a hundredth; the mean whirl speed
# counts revolutions about the axis of the hole and jumps where the orbit crosses it;
# the acceleration in smooth drilling doubles from one speed to the next where the axial
# motion resonates.
WEIGHTS = np.array([1, 1 / 4, 1, 1, 1, 1 / 4, 1 / 2])


def scaled_features(variables: Mapping[str, Array], speed: Array, gap: Array) -> Array:
    """The scaled features of starts, shape (..., 7), from means over the observation:

    ==========================  ======================================================
    lift-off, contact, stuck    the three fractions of time, unscaled
    stick-slip index            over 200 %: the range of the bit speed over four times
                                its mean; at most 5, and 5 for a bit that is stalled,
                                as the index of its creep is arbitrary
    radius                      ``radius_mean`` over the gap
    whirl                       ``whirl_speed_mean`` times ``radius_mean`` over drive
                                speed times gap: on a small orbit the direction of
                                whirl, which then changes slowly, has little weight
    axial                       half the logarithm of ``axial_acceleration_rms``: 10 %
                                more is 0.05
    ==========================  ======================================================
    """
    radius, stuck = variables["radius_mean"] / gap, variables["stuck_fraction"]
    index = np.nan_to_num(variables["stick_slip_index"], nan=np.inf, posinf=np.inf)
    columns = (
        variables["lift_off_fraction"],
        variables["wall_contact_fraction"],
        stuck,
        np.where(variables["response"] & STALLED > 0, 5.0, np.minimum(index / 200, 5.0)),
        radius,
        variables["whirl_speed_mean"] / speed * radius,
        0.5 * np.log(np.maximum(variables["axial_acceleration_rms"], 1e-9)),
    )
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def extent(variables: Mapping[str, Array], speed: Array, gap: Array, axial: Array) -> Array:
    """The scaled extremes of the states of starts, shape (..., 4):

    =============  ===================================================================
    radius         ``radius_max`` over the gap
    bit position   half the logarithm of the axial range plus its natural scale
                   ``axial``: 65 % more is 0.25
    bit speed      ``bit_speed_min`` and ``bit_speed_max`` over four times the drive
                   speed
    =============  ===================================================================
    """
    columns = (
        variables["radius_max"] / gap,
        0.5 * np.log(variables["axial_max"] - variables["axial_min"] + axial),
        variables["bit_speed_min"] / (4 * speed),
        variables["bit_speed_max"] / (4 * speed),
    )
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


HANGS = 0.5  # of its mean radius, by which a collar that only taps the low side is below the middle on average
WIND_UP = 1.5  # times the wind-up under the torque at rest
AXIAL_REACH = 2.0  # times static penetration and lobe amplitude together
LOBE_SPEEDS = 2.0  # times the greatest speed of the rock under the bit


def reach_of_collar(k: Coefficients, speed: Numeric, spread: float) -> tuple[Numeric, Numeric]:
    """The greatest distance from the axis of the hole [m] and the greatest speed [m/s]
    of the collar in an ensemble."""
    fastest = spread * np.maximum(k.gap * np.sqrt(k.k_bend / k.m_l), k.collar_radius * speed)
    return spread * k.gap, fastest


def string_and_bit(
    parameters: Parameters,
    k: Coefficients,
    wob: Numeric,
    speed: Numeric,
    spread: float,
    z: Array,
    vz: Array,
    twist: Array,
    bit_speed: Array,
) -> dict[str, Array]:
    """The axial and torsional states of an ensemble, from numbers that are uniform in
    [0, 1)."""
    bit, q = parameters.bit, spread
    if bit.rock.regenerative:
        return _on_surface(parameters, k, wob, speed, q, z, vz, twist, bit_speed)
    rest = wob / (k.k_a + bit.rock_stiffness)
    lobes = bit.lobes * speed * bit.surface_amplitude
    damping = parameters.drillstring.torsional_damping * speed
    load = bit_load(parameters, wob)
    static = (load * static_arm(parameters, k) + damping) / k.k_t
    steady = (load * bit_arm(parameters, k, speed, "unsmoothed") + damping) / k.k_t
    return {
        "z": q * AXIAL_REACH * (rest + bit.surface_amplitude) * (2 * z - 1) - rest,
        "vz": q * LOBE_SPEEDS * lobes * (2 * vz - 1),
        "twist": -((1 - q) * steady + q * WIND_UP * static * twist),
        "bit_speed": speed * (1 + q * (2 * bit_speed - 1)),
    }


def _on_surface(
    parameters: Parameters,
    k: Coefficients,
    wob: Numeric,
    speed: Numeric,
    q: float,
    z: Array,
    vz: Array,
    twist: Array,
    bit_speed: Array,
) -> dict[str, Array]:
    """The same on the surface that the blades leave: positions within a depth of cut of a
    blade, velocities within the rate of penetration, and twists up to one and a half times
    that of steady drilling."""
    cut = cut_of(parameters, wob, speed)
    steady = (cut.steady_torque(wob) + parameters.drillstring.torsional_damping * speed) / k.k_t
    return {
        "z": q * cut.depth * (2 * z - 1),
        "vz": q * cut.rate * (2 * vz - 1),
        "twist": -steady * ((1 - q) + q * WIND_UP * twist),
        "bit_speed": speed * (1 + q * (2 * bit_speed - 1)),
    }


CLEAR = 0.05  # m above the highest crest of the lobes; a bit that bounced swings by some 20 mm after a pick up


def hanging(parameters: Parameters, axial_stiffness: Numeric) -> float | None:
    """The weight [N] with which the string holds the bit clear of the lobes, as much above the
    height without weight; on rock without lobes zero is enough. None where friction is given as
    torques, which stay."""
    bit = parameters.bit
    if bit.rock.regenerative:
        return 0.0
    if bit.friction.by_torque:
        return None
    if parameters.modes.axial == "frozen" or not is_used(bit.surface_amplitude):
        return 0.0
    return -float(axial_stiffness) * (float(bit.surface_amplitude) + CLEAR)


def resting_height(wob: Numeric, axial_stiffness: Numeric, rock_stiffness: Numeric) -> Numeric:
    """The height of a bit at rest under a weight on even rock, or hanging above it [m]."""
    return -np.asarray(wob) / (axial_stiffness + np.where(np.less(wob, 0.0), 0.0, rock_stiffness))


class CollarInHole(Driven[P]):
    """Every string of such a model has the lane parameters of the hole, the rock and
    the set speed."""

    def outputs(self, points: Values[P], state: Mapping[str, Array]) -> dict[str, Array]:
        """Polar coordinates, the angle unwrapped along the array."""
        x, vx, y, vy = (state[name] for name in ("x", "vx", "y", "vy"))
        radius = np.hypot(x, y)
        divisor = np.where(radius > 0, radius, 1.0)
        return {
            "radius": radius,
            "radial_velocity": (x * vx + y * vy) / divisor,
            "whirl_angle": np.unwrap(np.arctan2(y, x)),
            "whirl_speed": (x * vy - y * vx) / divisor / divisor,
        }

    def responses(self, features: Mapping[str, Array], thresholds: Thresholds) -> Array:
        """Those of all models; but a collar that lies on the low side does not whirl."""
        bits = super().responses(features, thresholds)
        if "y_mean" not in features:  # a vertical hole has no low side
            return bits
        return np.asarray(np.where(self._kinds(features, thresholds) == LOW_SIDE, bits & ~WHIRL, bits))

    def labels(self, features: Mapping[str, Array], response: Array, thresholds: Thresholds) -> dict[str, Array]:
        """The ``whirl_kind``; none of a stalled run."""
        stalled = response & STALLED > 0
        return {"whirl_kind": np.where(stalled, NO_WHIRL, self._kinds(features, thresholds))}

    def _kinds(self, features: Mapping[str, Array], thresholds: Thresholds) -> Array:
        """What the collar does on the wall."""
        t = thresholds.whirl
        with np.errstate(invalid="ignore"):
            on_wall_at_all = np.asarray(features["wall_contact_fraction"]) > t.wall_contact_fraction
        ratio = np.nan_to_num(features["whirl_ratio"])
        on_wall = features["wall_contact_fraction"] >= t.rolling_contact
        rolling = (np.abs(features["rolling_ratio"] - 1.0) <= t.rolling_tolerance) & on_wall
        no_precession = np.abs(ratio) < t.direction
        lies = np.zeros(on_wall.shape, bool)  # in the lower half, and is not thrown off the wall
        if "y_mean" in features:  # of an inclined hole
            with np.errstate(invalid="ignore"):
                # one that taps the wall hangs on the low side rather than about the middle
                below = np.asarray(features["y_mean"] < -HANGS * features["radius_mean"])
                lies = np.asarray(features["y_mean"] < 0.0) & (on_wall | below)
                if "lateral_acceleration_rms" in features:
                    lies &= np.asarray(features["lateral_acceleration_rms"] <= t.light_acceleration)
        return np.select(
            [~on_wall_at_all, rolling, no_precession & lies, no_precession, ratio > 0.0],
            [NO_WHIRL, BACKWARD_ROLLING, LOW_SIDE, IRREGULAR, FORWARD],
            default=BACKWARD,
        )

    def returns(self, section: Mapping[str, Array]) -> Array:
        return in_the_bit_frame(section)

    def seen(self, state_scales: Array) -> Array:
        """Those of string and bit, without a drive or higher modes."""
        return state_scales[..., : len(STATES)]

    def still(self, features: Mapping[str, Array], state_scales: Array, absolute: float) -> Array:
        """Whether bit and collar move by no more than ``absolute`` times the natural
        scales of their states."""
        least = np.nan_to_num(features["section_radius"], nan=np.inf).min(axis=-1)
        axial, bit_speed = STATES.index("z"), STATES.index("bit_speed")
        return np.asarray(
            (features["axial_max"] - features["axial_min"] <= absolute * state_scales[..., axial])
            & (features["bit_speed_max"] - features["bit_speed_min"] <= absolute * state_scales[..., bit_speed])
            & (features["radius_max"] - least <= absolute * state_scales[..., 0])
        )

    def derived(self, features: Mapping[str, Array], points: Values) -> dict[str, Array]:
        parameters, (_, wob, speed) = points.parameters, points.operation
        torque, speed = features["surface_torque_mean"], features.get("drive_speed_mean", speed)
        # in the long run the surface is as fast as the bit, but a bit that stalls only winds the string
        is_stuck = features["stuck_fraction"] > Stalled().stuck_fraction
        speed = np.where(is_stuck, features["bit_speed_mean"], speed)
        return drilled(torque, speed, parameters.bit.cutting, wob, parameters.well.diameter / 2)

    def scales(self, table: Array) -> dict[str, Array]:
        """The ``gap`` [m] between collar and wall, the ``drive_speed`` [rad/s], and
        ``lobe`` [m], the amplitude of the lobed surface, or the static penetration of
        the rock where the surface has no lobes."""
        p = self.by_name(table)
        amplitude = p["surface_amplitude"]
        return {
            "gap": p["gap"],
            "drive_speed": p[self.set_speed],
            "lobe": np.where(amplitude > 0, amplitude, axial_scale(p)),
        }

    def coordinates(self, features: Mapping[str, Array], table: Array) -> tuple[Array, Array]:
        p = self.by_name(table)
        speed, gap, axial = (scale[:, None] for scale in (p[self.set_speed], p["gap"], axial_scale(p)))
        scaled = scaled_features(features, speed, gap)
        matched = [scaled * WEIGHTS, extent(features, speed, gap, axial)]
        return scaled, np.concatenate(matched, axis=-1)
