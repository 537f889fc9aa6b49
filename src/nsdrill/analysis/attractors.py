"""Which starts of an operating point end on the same attractor, and which share of the starts each attractor takes.

Starts are compared by what was measured of their motion, not by their final states, which lie anywhere along the orbit.
Their labels must agree: response and kind of whirl, and, where it was recorded, whether the motion rests, repeats with
which period, or shows none. (Whether that is quasi-periodic, chaotic or undetermined does not part: of one motion some
starts are told and others not.) And their scaled features must be near each other:

===============================  ================================================================================
lift-off, contact, stuck         the three fractions of time, as they are
stick-slip index                 over 200 %: the swing of the bit speed over four times its mean
radius                           ``radius_mean`` over the gap
whirl                            ``whirl_speed_mean`` times ``radius_mean`` over drive speed times gap: on a small
                                 orbit the direction of whirl, which then changes slowly, says little
axial                            half the logarithm of ``axial_acceleration_rms``: 10 % more acceleration is 0.05
===============================  ================================================================================

These are means over the observed window where there is one, since the extremes of a window scatter from start to start
where the motion is chaotic. The distance is the greatest difference of any of them. The settled starts are grouped by
single linkage: all that can be reached in steps of at most ``tolerance``. An unsettled one goes with the nearest
settled one within the tolerance, and so bridges no two groups. The others are linked among themselves; as they are
known less exactly, a step may be ``UNSETTLED_SHARE`` of the lesser of the two ``half_difference``, if that is more.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from nsdrill.data import Array
from nsdrill.variables import CHAOTIC, EQUILIBRIUM, OK, PENDING, PERIODIC, QUASI_PERIODIC, UNDETERMINED

NEEDED = ("status", "response", "whirl_kind", "settled", "lift_off_fraction", "wall_contact_fraction", "stuck_fraction",
          "stick_slip_index", "radius_mean", "whirl_speed_mean", "axial_acceleration_rms", "half_difference")
IF_THERE = ("motion", "period")
_LABELS = ("response", "whirl_kind", "settled", *IF_THERE)
SHOWN = ("stick_slip_index", "stuck_fraction", "lift_off_fraction", "axial_min", "axial_max", "bit_force_max",
         "radius_mean", "radius_max", "wall_contact_fraction", "whirl_ratio")
UNSETTLED_SHARE = 1 / 4
WILSON = 1.959963984540054  # standard deviations that hold 95 % of a normal distribution
_PAIRS = 1 << 20  # compared at once


@dataclass(frozen=True)
class Attractor:
    """One attractor: its ``number`` (1 has the largest share), the labels of its members as values of the file
    (``motion`` and ``period`` of most of them, None where not recorded), the number of ``members`` and of ``unsettled``
    ones among them, its ``share`` of the starts that ended well with the Wilson 95 % interval ``low`` to ``high``, and
    the medians of some ``features``, in SI."""

    number: int
    response: int
    whirl_kind: int
    motion: int | None
    period: int | None
    members: int
    unsettled: int
    share: float
    low: float
    high: float
    features: dict[str, float]


def label(variables: Mapping[str, Array], speed: Array, gap: Array, tolerance: float) -> Array:
    """The attractor of every start, numbered by falling share from 1, 0 for starts that did not end well.

    ``variables`` are :data:`NEEDED`, and :data:`IF_THERE` if recorded, arrays (operating points, starts); ``speed``
    [rad/s] and ``gap`` [m] those of the operating points. int16 of the same shape.
    """
    found = np.zeros(variables["status"].shape, np.int16)
    vectors = scaled(variables, speed[:, None], gap[:, None])
    for i in range(len(found)):
        ok = np.flatnonzero(variables["status"][i] == OK)
        labels = {name: variables[name][i, ok] for name in _LABELS if name in variables}
        groups = _groups(vectors[i, ok], variables["half_difference"][i, ok], labels, tolerance)
        found[i, ok] = _by_size(groups)
    return found


def scaled(variables: Mapping[str, Array], speed: Array, gap: Array) -> Array:
    """The scaled features of starts, shape (..., 7)."""
    radius = variables["radius_mean"] / gap
    columns = (
        variables["lift_off_fraction"], variables["wall_contact_fraction"], variables["stuck_fraction"],
        np.minimum(np.nan_to_num(variables["stick_slip_index"], nan=np.inf, posinf=np.inf) / 200, 5.0), radius,
        variables["whirl_speed_mean"] / speed * radius,
        0.5 * np.log(np.maximum(variables["axial_acceleration_rms"], 1e-9)),
    )
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def linked(vectors: Array, scatter: Array, tolerance: float) -> Array:
    """Single linkage: the number of its group for each of ``vectors`` [n, features], whose own uncertainty is
    ``scatter`` [n]; groups are numbered in the order of their first members."""
    group = np.full(len(vectors), -1)
    left, number = np.arange(len(vectors)), 0
    while left.size:
        frontier, left = left[:1], left[1:]
        while frontier.size:
            group[frontier] = number
            near = np.zeros(left.size, bool)
            step = max(1, _PAIRS // max(left.size, 1))
            for begin in range(0, frontier.size, step):
                block = frontier[begin : begin + step]
                near |= _near(vectors, scatter, tolerance, block, left)[0].any(axis=0)
            frontier, left = left[near], left[~near]
        number += 1
    return group


def _near(vectors: Array, scatter: Array, tolerance: float, a: Array, b: Array) -> tuple[Array, Array]:
    """Which of ``a`` and ``b`` are within one step, and their distances: [a, b]."""
    distance = np.abs(vectors[a, None] - vectors[None, b]).max(axis=-1, initial=0.0)
    allowed = np.maximum(tolerance, UNSETTLED_SHARE * np.minimum(scatter[a, None], scatter[None, b]))
    return distance <= allowed, distance


def _groups(vectors: Array, scatter: Array, labels: Mapping[str, Array], tolerance: float) -> Array:
    """Groups of starts of one operating point whose labels agree: first the settled ones, then the others about
    them."""
    firm = np.stack([labels["response"], labels["whirl_kind"]], axis=1)
    kinds = np.zeros(len(vectors), np.int64)  # 0 where the kind of motion is not known
    if "motion" in labels:
        motion = labels["motion"].astype(np.int64)
        kinds = np.where(np.isin(motion, (EQUILIBRIUM, PERIODIC)), motion * 10_000 + labels["period"], kinds)
        # Without a period: which of the three may differ from start to start.
        kinds[np.isin(motion, (QUASI_PERIODIC, CHAOTIC, UNDETERMINED))] = 10_000 * QUASI_PERIODIC
    settled = labels["settled"].astype(bool) & ((kinds > 0) | ("motion" not in labels))
    group = np.full(len(vectors), -1)
    for key in np.unique(firm, axis=0):
        alike = np.all(firm == key, axis=1)
        for first in (True, False):
            if not first:
                _join(vectors, scatter, tolerance, kinds, group, alike)
            for kind in np.unique(kinds[alike]):
                chosen = np.flatnonzero(alike & (kinds == kind) & (group < 0) & (settled | (not first)))
                group[chosen] = group.max(initial=-1) + 1 + linked(vectors[chosen], scatter[chosen], tolerance)
    return group


def _join(vectors: Array, scatter: Array, tolerance: float, kinds: Array, group: Array, alike: Array) -> None:
    """Put the starts ``alike`` that have no group yet into that of the nearest one that has, if it is near enough and
    no other kind of motion. They cannot bridge two groups, as they would by linkage."""
    others, open_ = np.flatnonzero(alike & (group >= 0)), np.flatnonzero(alike & (group < 0))
    if not others.size:
        return
    step = max(1, _PAIRS // others.size)
    for begin in range(0, open_.size, step):
        block = open_[begin : begin + step]
        near, distance = _near(vectors, scatter, tolerance, block, others)
        near &= (kinds[block, None] == kinds[None, others]) | (kinds[block, None] == 0)
        nearest = np.argmin(np.where(near, distance, np.inf), axis=1)
        found = near.any(axis=1)
        group[block[found]] = group[others[nearest[found]]]


def _by_size(group: Array) -> Array:
    """Groups numbered from 1 by falling size; the one with the earliest member first where two are equal."""
    if not group.size:
        return group
    names, first, inverse, counts = np.unique(group, return_index=True, return_inverse=True, return_counts=True)
    rank = np.empty(len(names), np.int64)
    rank[np.lexsort((first, -counts))] = np.arange(1, len(names) + 1)
    return np.minimum(rank, np.iinfo(np.int16).max)[inverse]


def describe(variables: Mapping[str, Array]) -> Iterator[tuple[list[Attractor], dict[str, int]]]:
    """For each operating point its attractors, by falling share, and the numbers of ``starts``, ``failed`` and
    ``pending`` ones, ``unsettled`` ones, and of those that are not ``grouped`` yet. ``variables``: arrays (operating
    points, starts) with ``attractor`` and ``settled``, and whatever of :data:`SHOWN` is to be told."""
    for i, status in enumerate(variables["status"]):
        ok = status == OK
        of = {name: values[i] for name, values in variables.items()}
        total = int(np.count_nonzero(ok))
        numbers = range(1, int(of["attractor"].max(initial=0)) + 1)
        counts = {
            "starts": len(status), "failed": int(np.count_nonzero(~ok & (status != PENDING))),
            "pending": int(np.count_nonzero(status == PENDING)),
            "unsettled": int(np.count_nonzero(ok & (of["settled"] == 0))),
            "ungrouped": int(np.count_nonzero(ok & (of["attractor"] == 0))),
        }
        yield [_attractor(number, of, total) for number in numbers], counts


def _attractor(number: int, of: Mapping[str, Array], total: int) -> Attractor:
    inside = of["attractor"] == number
    members = int(np.count_nonzero(inside))
    first = int(np.argmax(inside))
    low, high = wilson(members, total)
    motion, period = _most(of, inside) if "motion" in of else (None, None)
    medians = {name: float(np.median(of[name][inside])) for name in SHOWN if name in of}
    return Attractor(
        number, int(of["response"][first]), int(of["whirl_kind"][first]), motion, period, members,
        int(np.count_nonzero(inside & (of["settled"] == 0))), members / total, low, high, medians)


def _most(of: Mapping[str, Array], inside: Array) -> tuple[int, int]:
    """Motion and period of most of the decided members, or of most where none is."""
    motion, period = of["motion"][inside], of["period"][inside]
    known = (motion >= EQUILIBRIUM) & (motion <= CHAOTIC)
    most = int(np.bincount(motion[known] if known.any() else motion).argmax())
    return most, int(period[motion == most][0])


def wilson(count: int, total: int) -> tuple[float, float]:
    """The 95 % interval of a share of which ``count`` in ``total`` independent draws were seen (Wilson 1927)."""
    if total == 0:
        return 0.0, 1.0
    share, z2 = count / total, WILSON**2
    middle = (share + z2 / (2 * total)) / (1 + z2 / total)
    half = WILSON / (1 + z2 / total) * math.sqrt(share * (1 - share) / total + z2 / (4 * total**2))
    return 0.0 if count == 0 else middle - half, 1.0 if count == total else middle + half
