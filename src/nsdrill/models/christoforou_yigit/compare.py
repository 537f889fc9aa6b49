"""Scaled features by which motions are compared. Plain numpy."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nsdrill.data import Array

# Weights of the scaled features, in their order, when attractors of neighbouring
# operating points are matched. Three features change much along one branch: the contact
# fraction goes from 0 to 1 while the radius grows by a hundredth; the mean whirl speed
# counts revolutions about the axis of the hole and jumps where the orbit crosses it;
# the acceleration in smooth drilling doubles from one speed to the next where the axial
# motion resonates.
WEIGHTS = np.array([1, 1 / 4, 1, 1, 1, 1 / 4, 1 / 2])


def scaled(variables: Mapping[str, Array], speed: Array, gap: Array) -> Array:
    """The scaled features of starts, shape (..., 7), from means over the observation:

    ==========================  ======================================================
    lift-off, contact, stuck    the three fractions of time, unscaled
    stick-slip index            over 200 %: the range of the bit speed over four times
                                its mean; at most 5
    radius                      ``radius_mean`` over the gap
    whirl                       ``whirl_speed_mean`` times ``radius_mean`` over drive
                                speed times gap: on a small orbit the direction of
                                whirl, which then changes slowly, has little weight
    axial                       half the logarithm of ``axial_acceleration_rms``: 10 %
                                more is 0.05
    ==========================  ======================================================
    """
    radius = variables["radius_mean"] / gap
    columns = (
        variables["lift_off_fraction"],
        variables["wall_contact_fraction"],
        variables["stuck_fraction"],
        np.minimum(np.nan_to_num(variables["stick_slip_index"], nan=np.inf, posinf=np.inf) / 200, 5.0),
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
