"""The rotating frame of the drive, in which motions repeat."""

from __future__ import annotations

from typing import Any

import numpy as np

from nsdrill.models.base import Symmetry

Array = np.ndarray[Any, np.dtype[np.float64]]


def rotated(symmetry: Symmetry, state: Array, angle: Any) -> Array:
    """States (..., states) rotated by ``angle`` [rad], a number or an array over all
    but the last dimension."""
    rotated_state = np.array(state, dtype=float)
    cosine, sine = np.cos(angle), np.sin(angle)
    for x, y in symmetry.turned:
        rotated_state[..., x] = cosine * state[..., x] - sine * state[..., y]
        rotated_state[..., y] = sine * state[..., x] + cosine * state[..., y]
    return rotated_state


def rotation_matrices(symmetry: Symmetry, states: int, angles: Array) -> Array:
    """The matrices [n, states, states] of :func:`rotated` for ``angles`` [n]."""
    return np.swapaxes(rotated(symmetry, np.tile(np.eye(states), (len(angles), 1, 1)), angles[:, None]), 1, 2)


def rotation_derivative(symmetry: Symmetry, state: Array) -> Array:
    """The derivative of :func:`rotated` by the angle, at the angle 0."""
    derivative = np.zeros_like(state)
    for x, y in symmetry.turned:
        derivative[..., x], derivative[..., y] = -state[..., y], state[..., x]
    return derivative
