"""The frame in which motions repeat: how a state is turned with the drive."""

from __future__ import annotations

from typing import Any

import numpy as np

from nsdrill.models.base import Symmetry

Array = np.ndarray[Any, np.dtype[np.float64]]


def turned(symmetry: Symmetry, state: Array, angle: Any) -> Array:
    """States (..., states) turned by ``angle`` [rad], a number or an array over all but
    the last dimension."""
    made = np.array(state, dtype=float)
    cosine, sine = np.cos(angle), np.sin(angle)
    for one, two in symmetry.turned:
        made[..., one] = cosine * state[..., one] - sine * state[..., two]
        made[..., two] = sine * state[..., one] + cosine * state[..., two]
    return made


def turn_matrix(symmetry: Symmetry, states: int, angle: float) -> Array:
    """The matrix of :func:`turned`."""
    return turned(symmetry, np.eye(states), angle).T


def turning(symmetry: Symmetry, state: Array) -> Array:
    """The rate at which a state changes where it is turned by one radian a second."""
    made = np.zeros_like(state)
    for one, two in symmetry.turned:
        made[..., one], made[..., two] = -state[..., two], state[..., one]
    return made
