"""How far two motions at one operating point differ, in one number. Plain numpy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.models.christoforou_yigit.rhs import INDEX, STATES, state_scales

Array = np.ndarray[Any, np.dtype[Any]]


def scales(table: Array) -> dict[str, Array]:
    """What differences are measured in at operating points with the lane parameters
    ``table`` [points, parameters]: ``gap`` [m] between collar and wall, ``drive_speed``
    [rad/s], ``lobe`` [m], the amplitude of the lobed surface, on a surface without
    lobes the static penetration of the rock."""
    amplitude = table[:, INDEX["surface_amplitude"]]
    return {
        "gap": table[:, INDEX["gap"]],
        "drive_speed": table[:, INDEX["drive_speed"]],
        "lobe": np.where(amplitude > 0, amplitude, state_scales(table)[:, STATES.index("z")]),
    }


# Of the scaled features when attractors of neighbouring operating points are matched,
# in their order: three change much along one branch. The contact fraction goes from 0
# to 1 while the radius grows by a hundredth; the mean whirl speed counts turns about
# the axis of the hole and jumps where the orbit crosses it; the acceleration in smooth
# drilling doubles from one speed to the next where the axial motion resonates.
WEIGHTS = np.array([1, 1 / 4, 1, 1, 1, 1 / 4, 1 / 2])


def scaled(variables: Mapping[str, Array], speed: Array, gap: Array) -> Array:
    """The scaled features of starts, shape (..., 7), means over the observed window
    where there is one:

    ===============================  ===========================================================================
    lift-off, contact, stuck         the three fractions of time, as they are
    stick-slip index                 over 200 %: the swing of the bit speed over four times its mean
    radius                           ``radius_mean`` over the gap
    whirl                            ``whirl_speed_mean`` times ``radius_mean`` over drive speed times gap: on a
                                     small orbit the direction of whirl, which then
                                     changes slowly, says little
    axial                            half the logarithm of ``axial_acceleration_rms``: 10 % more is 0.05
    ===============================  ===========================================================================
    """
    radius = variables["radius_mean"] / gap
    columns = (
        variables["lift_off_fraction"],
        variables["wall_contact_fraction"],
        variables["stuck_fraction"],
        np.minimum(
            np.nan_to_num(variables["stick_slip_index"], nan=np.inf, posinf=np.inf) / 200, 5.0
        ),
        radius,
        variables["whirl_speed_mean"] / speed * radius,
        0.5 * np.log(np.maximum(variables["axial_acceleration_rms"], 1e-9)),
    )
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def extent(variables: Mapping[str, Array], speed: Array, gap: Array, axial: Array) -> Array:
    """The scaled extremes of the states of starts, shape (..., 4):

    ===============================
    =========================================================================== radius
    ``radius_max`` over the gap bit position                     half the logarithm of
    the axial range plus its natural scale: 65 % more is 0.25 bit speed
    ``bit_speed_min`` and ``bit_speed_max`` over four times the drive speed
    ===============================
    ===========================================================================
    """
    columns = (
        variables["radius_max"] / gap,
        0.5 * np.log(variables["axial_max"] - variables["axial_min"] + axial),
        variables["bit_speed_min"] / (4 * speed),
        variables["bit_speed_max"] / (4 * speed),
    )
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def coordinates(
    features: Mapping[str, Array], scale: Mapping[str, Array], axial: Array
) -> tuple[Array, Array]:
    """By which starts are told apart, and by which attractors along a sweep are
    matched, shapes (points, starts, ...): of ``features`` [points, starts], with the
    :func:`scales` and the natural scale of the bit position [m] [points]."""
    speed, gap = scale["drive_speed"][:, None], scale["gap"][:, None]
    apart = scaled(features, speed, gap)
    return apart, np.concatenate(
        [apart * WEIGHTS, extent(features, speed, gap, axial[:, None])], axis=-1
    )
