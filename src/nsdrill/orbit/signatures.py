"""What tells a motion from others of its kind: its signatures, and whether a line of
them passes near a motion."""

from __future__ import annotations

import math

import numpy as np

from nsdrill.analysis.bifurcations import CIRCLE, CYCLE
from nsdrill.orbit.flow import Flow
from nsdrill.orbit.periodic import lobe_starts
from nsdrill.orbit.shooting import Array, Orbit

Kind = tuple[str, int]  # of a motion, and its period in lobes


def signature(flow: Flow, kind: str, values: Array, state: Array, number: float = 0.0) -> Array:
    """A vector, in natural scales, that tells a motion of a ``kind`` at ``values`` from
    others: of an orbit its start, the free ``state``, and the parameter; of a cycle the
    logarithm of the ``number`` that is its period, and the parameter; of a circle its
    rotation, the ``number``, the mean of w, the free ``state``, and the parameter."""
    parameter = values[-1] / float(flow.scales[-1])
    if kind == CYCLE:
        return np.array([10.0 * math.log(number), parameter])
    scaled = np.append(state / flow.state_scales(values)[0][list(flow.symmetry.free)], parameter)
    return np.append(10.0 * number, scaled) if kind == CIRCLE else scaled


def signatures(flow: Flow, kind: Kind, orbit: Orbit) -> list[Array]:
    """The signatures of an orbit of a kind, one for each lobe at which it may begin."""
    motion, lobes = kind
    if motion == CYCLE:
        return [signature(flow, motion, orbit.values, orbit.state, orbit.period)]
    if motion == CIRCLE:
        return [signature_of_circle(flow, orbit, orbit.mesh_states)]
    return [signature(flow, motion, orbit.values, start) for start in lobe_starts(orbit, flow, lobes)]


def signature_of_circle(flow: Flow, orbit: Orbit, w: Array) -> Array:
    """The signature of a circle, begun at the lobe where its points are ``w``."""
    return signature(flow, CIRCLE, orbit.values, w.mean(axis=0)[list(orbit.free)], orbit.rotation)


def passes_near(line: Array, signatures: list[Array], tolerance: float = 0.0) -> bool:
    """Whether a ``line`` through points [points, coordinates] passes near one of the
    ``signatures`` [coordinates]: nearer than a fifth of the length of the chord there,
    plus 1e-3, plus ``tolerance``."""
    chords, starts = np.diff(line, axis=0), line[:-1]
    square = np.maximum(np.sum(chords**2, axis=1), 1e-300)
    for signature in signatures:
        offsets = signature - starts
        fraction = np.clip(np.sum(offsets * chords, axis=1) / square, 0.0, 1.0)
        distances = np.linalg.norm(offsets - fraction[:, None] * chords, axis=1)
        if np.any(distances < 0.2 * np.sqrt(square) + 1e-3 + tolerance):
            return True
    return False
