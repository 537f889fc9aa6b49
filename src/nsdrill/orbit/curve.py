"""Curves of special points in two numbers: folds and doublings of periodic orbits, and grazing of contacts.

To the equations of a periodic orbit comes one more: the bordered system of a multiplier of 1 or -1 (Govaerts 2000,
Numerical Methods for Bifurcations of Dynamical Equilibria, chapter 4), or the least or greatest value of a contact's
function over the period. Its derivatives are central differences, of monodromies where it needs them; those by the
start of a segment need that segment alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.orbit.arclength import Reading, Steps
from nsdrill.orbit.flow import Flow, Legs
from nsdrill.orbit.frame import turn_matrix, turned
from nsdrill.orbit.periodic import ANGLES, Orbit, over_segments, product, ring

Array = np.ndarray[Any, np.dtype[np.float64]]
STEP = 1e-4  # of differences, in natural sizes


@dataclass(frozen=True)
class Condition:
    """What holds along a curve: a multiplier is ``multiplier`` (1 or -1), or of the contact at the place ``contact``
    the least (``which`` 0) or greatest (1) value of its function vanishes."""

    multiplier: float = 0.0
    contact: int = -1
    which: int = 0


@dataclass(frozen=True)
class Curve:
    """Points of periodic orbits over ``lobes`` at which the condition holds. The unknowns are those of the orbit and
    two numbers over their scales, of which the last runs along the curve. ``left`` and ``right`` [free] border the
    monodromy."""

    flow: Flow
    lobes: int
    segments: int
    size: Array
    fixed: Array
    condition: Condition
    left: Array
    right: Array
    slack = 1.0

    @classmethod
    def at(cls, flow: Flow, lobes: int, orbit: Orbit, values: Array, condition: Condition) -> Curve:
        """The problem near a special orbit, at ``values`` of both numbers."""
        assert orbit.pieces is not None
        size = flow.sizes(values)[0][list(orbit.free)]
        made = cls(
            flow,
            lobes,
            len(orbit.pieces),
            size,
            orbit.state.copy(),
            condition,
            np.zeros(len(size)),
            np.zeros(len(size)),
        )
        return made._bordered(orbit)

    def _bordered(self, orbit: Orbit) -> Curve:
        if not self.condition.multiplier or orbit.monodromy is None:
            return self
        shifted = orbit.monodromy - self.condition.multiplier * np.eye(len(orbit.monodromy))
        u, _, v = np.linalg.svd(shifted)
        return replace(self, left=u[:, -1], right=v[-1])

    @property
    def angle(self) -> float:
        return 2.0 * math.pi * self.lobes / (self.flow.symmetry.folds or ANGLES)

    def unknowns(self, states: Array, values: Array) -> Array:
        """``x`` from the states at the starts of the segments and both numbers."""
        scaled = states[:, list(self.flow.symmetry.free)] / (self.size * math.sqrt(self.segments))
        return np.concatenate([scaled.ravel(), values / self.flow.scales])

    def states(self, x: Array) -> Array:
        """The states at the starts of the segments, shape (segments, states)."""
        made = np.tile(self.fixed, (self.segments, 1))
        scaled = x[:-2].reshape(self.segments, -1) * (self.size * math.sqrt(self.segments))
        made[:, list(self.flow.symmetry.free)] = scaled
        return made

    def read(self, x: Array) -> Steps[Reading | None]:
        flow, J = self.flow, self.segments
        free = list(flow.symmetry.free)
        n, share = len(free), math.sqrt(J)
        scale = self.size * share
        states, values = self.states(x), x[-2:] * flow.scales
        step = STEP / share
        # All of it; then each segment with each of its states moved to both sides; then all with each number moved.
        moved = [states]
        for place in range(n):
            for sign in (1.0, -1.0):
                other = states.copy()
                other[:, free[place]] += sign * step * scale[place]
                moved.append(other)
        at = [values] * (2 * n + 1)
        for number in range(2):
            for sign in (1.0, -1.0):
                shifted = values.copy()
                shifted[number] += sign * STEP * flow.scales[number]
                moved.append(states)
                at.append(shifted)
        numbers = np.repeat(np.stack(at), J, axis=0)
        phases = np.tile(np.arange(J) * self.angle / J, len(moved))
        tangent = np.arange(len(numbers)) < (len(numbers) if self.condition.multiplier else J)
        ends = yield Legs(
            np.concatenate(moved), phases, np.full(len(numbers), self.angle / J), numbers, tangent, angular=True
        )
        if not ends.ok.all():
            return None
        end = ends.state.reshape(len(moved), J, -1).copy()
        end[:, -1] = turned(flow.symmetry, end[:, -1], -self.angle)
        back = turn_matrix(flow.symmetry, flow.states, -self.angle)
        blocks = ends.monodromy.reshape(len(moved), J, flow.states, flow.states).copy()
        blocks[:, -1] = back @ blocks[:, -1]
        blocks = blocks[:, :, free][:, :, :, free] * (scale / scale[:, None])
        touches = ends.touches.reshape(len(moved), J, *ends.touches.shape[1:])
        residual = np.zeros(J * n + 1)
        jacobian = np.zeros((J * n + 1, J * n + 2))
        residual[:-1] = ((end[0] - np.roll(states, -1, axis=0))[:, free] / scale).ravel()
        residual[-1] = self._value(blocks[0], touches[0])
        jacobian[:-1, : J * n] = ring(blocks[0])
        for j in range(J):
            for place in range(n):
                sides = []
                for side in (1 + 2 * place, 2 + 2 * place):
                    own, contact = blocks[0].copy(), touches[0].copy()
                    own[j], contact[j] = blocks[side, j], touches[side, j]
                    sides.append(self._value(own, contact))
                jacobian[-1, j * n + place] = (sides[0] - sides[1]) / (2.0 * step)
        for number in range(2):
            up, down = 2 * n + 1 + 2 * number, 2 * n + 2 + 2 * number
            jacobian[:-1, J * n + number] = ((end[up] - end[down])[:, free] / scale / (2.0 * STEP)).ravel()
            rise = self._value(blocks[up], touches[up]) - self._value(blocks[down], touches[down])
            jacobian[-1, J * n + number] = rise / (2.0 * STEP)
        if not (np.isfinite(jacobian).all() and np.isfinite(residual).all()):
            return None
        whole = product(blocks[0])
        period = float(ends.duration[:J].sum())
        orbit = Orbit(
            states[0], values, period, np.linalg.eigvals(whole), over_segments(touches[0]), 0, whole, 0.0, states,
            tuple(free),
        )  # fmt: skip
        return Reading(residual, jacobian, lambda: orbit)

    def _value(self, blocks: Array, touches: Array) -> float:
        """What vanishes along the curve, from the monodromies of the segments, or from their touches."""
        if not self.condition.multiplier:
            values = touches[:, self.condition.contact, self.condition.which]
            return float(values.max() if self.condition.which else values.min()) / 1e-3
        whole = product(blocks)
        n = len(whole)
        bordered = np.zeros((n + 1, n + 1))
        bordered[:n, :n] = whole - self.condition.multiplier * np.eye(n)
        bordered[:n, n], bordered[n, :n] = self.left, self.right
        right = np.zeros(n + 1)
        right[n] = 1.0
        try:
            return float(np.linalg.solve(bordered, right)[n])
        except np.linalg.LinAlgError:
            return math.nan

    def moved(self, x: Array) -> Curve:
        return self
