"""Which starts of an operating point end on the same attractor, and which share of the
starts each attractor takes. How the attractors are numbered along a sweep:
:mod:`nsdrill.analysis.branches`.

Starts are compared by what was measured of their motion, not by their final states,
which lie anywhere along the orbit. Their labels must agree: response and kind of whirl,
and, where it was recorded, whether the motion rests, repeats with which period, or
shows none. (Whether that is quasi-periodic, chaotic or undetermined does not part: of
one motion some starts are told and others not.) And their scaled features must be near
each other, those that the model says (:meth:`nsdrill.models.base.Model.coordinates`).

These are means over the observed window where there is one, since the extremes of a
window scatter from start to start where the motion is chaotic. The distance is the
greatest difference of any of them. The settled starts are grouped by single linkage:
all that can be reached in steps of at most ``tolerance``. An unsettled one goes with
the nearest settled one within the tolerance, and so bridges no two groups. The others
are linked among themselves; as they are known less exactly, a step may be
``UNSETTLED_SHARE`` of the lesser of the two ``half_difference``, if that is more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.analysis.branches import Places
from nsdrill.analysis.probability import interval
from nsdrill.data import Array
from nsdrill.variables import (
    CHAOTIC,
    EQUILIBRIUM,
    OK,
    PENDING,
    PERIODIC,
    QUASI_PERIODIC,
    UNDETERMINED,
)

# beside what a model groups starts by
NEEDED = ("status", "response", "settled", "half_difference")
IF_THERE = ("whirl_kind", "motion", "period")
_LABELS = ("response", "settled", *IF_THERE)
UNSETTLED_SHARE = 1 / 4
_PAIRS = 1 << 20  # compared at once
_FAR = 1e6  # in place of a number that is missing
_NEAREST = 16  # neighbours that are looked up first


@dataclass(frozen=True)
class Attractor:
    """One attractor at an operating point: its ``number``, the same along a sweep, the
    labels of its members as values of the file (``motion`` and ``period`` of most of
    them, None where not recorded), the number of ``members`` and of ``unsettled`` ones
    among them, its ``share`` of the starts that ended well with the Wilson 95 %
    interval ``low`` to ``high``, and the medians of some ``features``, in SI."""

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


def label(variables: Mapping[str, Array], vectors: Array, tolerance: float) -> Array:
    """The group of every start, numbered from 1 at each operating point, 0 for starts
    that did not end well.

    ``variables`` are :data:`NEEDED`, and :data:`IF_THERE` if recorded, arrays
    (operating points, starts); ``vectors`` (operating points, starts, features) the
    scaled features of the starts. int32 (operating points, starts).
    """
    found = np.zeros(variables["status"].shape, np.int32)
    for i in range(len(found)):
        # A file that was changed by hand may lack features of a run that ended well.
        ok = np.flatnonzero(
            (variables["status"][i] == OK) & np.all(np.isfinite(vectors[i]), axis=-1)
        )
        labels = {name: variables[name][i, ok] for name in _LABELS if name in variables}
        found[i, ok] = 1 + _groups(
            vectors[i, ok], variables["half_difference"][i, ok], labels, tolerance
        )
    return found


def places(variables: Mapping[str, Array], groups: Array, vectors: Array) -> Places:
    """Where the ``groups`` that :func:`label` found are, by operating point and number;
    ``vectors`` (operating points, starts, coordinates) are those by which attractors of
    neighbouring operating points are matched."""
    vectors = np.nan_to_num(vectors, posinf=_FAR, neginf=-_FAR, nan=_FAR)
    kinds = _kinds(variables)
    found: list[tuple[Any, ...]] = []
    for i, group in enumerate(groups):
        order = np.argsort(group, kind="stable")
        counts = np.bincount(group)
        for chosen in np.split(order, np.cumsum(counts)[:-1])[1:]:
            found.append(
                (
                    i,
                    len(chosen),
                    np.median(vectors[i, chosen], axis=0),
                    kinds[i, chosen].max(),
                    np.mean(variables["settled"][i, chosen]) >= 0.5,
                )
            )
    point, members, place, kind, settled = zip(*found, strict=True) if found else ((),) * 5
    return Places(
        np.array(point, int),
        np.array(members, int),
        np.reshape(place, (len(found), vectors.shape[-1])),
        np.array(kind, int),
        np.array(settled, bool),
    )


def linked(vectors: Array, scatter: Array, tolerance: float) -> Array:
    """Single linkage: the number of its group for each of ``vectors`` [n, features],
    whose own uncertainty is ``scatter`` [n]."""
    # two are linked where each is in reach of the other
    reach = np.maximum(tolerance, UNSETTLED_SHARE * scatter)
    # Each once: a tree cannot divide equal vectors.
    once, which = np.unique(np.column_stack([vectors, reach]), axis=0, return_inverse=True)
    vectors, reach, n = once[:, :-1], once[:, -1], len(once)
    if n < 2:
        return np.zeros(len(which), np.int64)
    distance, near = _nearest(vectors, vectors, reach.max(), min(_NEAREST, n))
    full = np.flatnonzero(distance[:, -1] <= reach)  # these may have more neighbours
    rows, columns = np.nonzero(distance <= np.minimum(reach[:, None], reach[near]))
    links = np.stack([rows, near[rows, columns]])
    links = np.concatenate([links, _more_links(vectors, reach, _connected(links, n), full)], axis=1)
    return _connected(links, n)[which]


def _connected(links: Array, n: int) -> Array:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(links.shape[1], bool), links), (n, n))
    return np.asarray(connected_components(graph, directed=False)[1])


def _nearest(vectors: Array, to: Array, reach: float, count: int) -> tuple[Array, Array]:
    """The distances of the ``count`` nearest of ``vectors`` to each of ``to``, infinite
    beyond ``reach``, and which they are."""
    from scipy.spatial import cKDTree

    distance, near = cKDTree(vectors).query(
        to, range(1, count + 1), p=np.inf, distance_upper_bound=np.nextafter(reach, np.inf)
    )
    return distance, np.minimum(near, len(vectors) - 1)  # one beyond where there is none


def _more_links(vectors: Array, reach: Array, group: Array, full: Array) -> Array:
    """One link for each two groups that are linked by ``full`` vectors, if by no
    others."""
    from scipy.spatial.distance import cdist

    members = [full[group[full] == name] for name in np.unique(group[full])]
    low, high = (
        np.array([side(vectors[some], axis=0) for some in members]) for side in (np.min, np.max)
    )
    far = np.array([reach[some].max() for some in members])
    found = []
    for i, a in enumerate(members):
        apart = np.maximum(low[i + 1 :] - high[i], low[i] - high[i + 1 :]).max(
            axis=1, initial=-np.inf
        )
        for j in i + 1 + np.flatnonzero(apart <= np.minimum(far[i], far[i + 1 :])):
            b = members[j]
            step = max(1, _PAIRS // len(b))
            for block in np.split(a, range(step, len(a), step)):
                near = cdist(vectors[block], vectors[b], "chebyshev") <= np.minimum(
                    reach[block, None], reach[b]
                )
                if near.any():
                    x, y = np.argwhere(near)[0]
                    found.append((block[x], b[y]))
                    break
    return np.array(found, np.int64).reshape(-1, 2).T


def _kinds(labels: Mapping[str, Array]) -> Array:
    """The kind of motion as a number, the period included; 0 where it is not known."""
    if "motion" not in labels:
        return np.zeros(labels["settled"].shape, np.int64)
    motion = labels["motion"].astype(np.int64)
    kinds = np.where(
        np.isin(motion, (EQUILIBRIUM, PERIODIC)), motion * 10_000 + labels["period"], 0
    )
    # Without a period: which of the three may differ from start to start.
    kinds[np.isin(motion, (QUASI_PERIODIC, CHAOTIC, UNDETERMINED))] = 10_000 * QUASI_PERIODIC
    return kinds


def _groups(vectors: Array, scatter: Array, labels: Mapping[str, Array], tolerance: float) -> Array:
    """Groups of starts of one operating point whose labels agree: first the settled
    ones, then the others about them."""
    firm = np.stack([labels[name] for name in ("response", "whirl_kind") if name in labels], axis=1)
    kinds = _kinds(labels)
    settled = labels["settled"].astype(bool) & ((kinds > 0) | ("motion" not in labels))
    group = np.full(len(vectors), -1)
    for key in np.unique(firm, axis=0):
        alike = np.all(firm == key, axis=1)
        for first in (True, False):
            if not first:
                _join(vectors, tolerance, kinds, group, alike)
            for kind in np.unique(kinds[alike]):
                chosen = np.flatnonzero(
                    alike & (kinds == kind) & (group < 0) & (settled | (not first))
                )
                group[chosen] = (
                    group.max(initial=-1) + 1 + linked(vectors[chosen], scatter[chosen], tolerance)
                )
    return group


def _join(vectors: Array, tolerance: float, kinds: Array, group: Array, alike: Array) -> None:
    """Put the starts ``alike`` that have no group yet into that of the nearest one that
    has, if it is near enough and no other kind of motion. They cannot bridge two
    groups, as they would by linkage."""
    others, open_ = np.flatnonzero(alike & (group >= 0)), np.flatnonzero(alike & (group < 0))
    for kind in np.unique(kinds[open_]):
        some = open_[kinds[open_] == kind]
        allowed = others[(kinds[others] == kind) | (kind == 0)]
        if allowed.size:
            distance, nearest = (
                values[:, 0] for values in _nearest(vectors[allowed], vectors[some], tolerance, 1)
            )
            found = np.isfinite(distance)
            group[some[found]] = group[allowed[nearest[found]]]


def describe(
    variables: Mapping[str, Array], told: Sequence[str]
) -> Iterator[tuple[list[Attractor], dict[str, int]]]:
    """For each operating point its attractors, by falling share there, and the numbers
    of ``starts``, ``failed`` and ``pending`` ones, ``unsettled`` ones, and of those
    that are not ``grouped`` yet. ``variables``: arrays (operating points, starts) with
    ``attractor`` and ``settled``, and the features that are ``told`` as far as they are
    there."""
    for i, status in enumerate(variables["status"]):
        ok = status == OK
        of = {name: values[i] for name, values in variables.items()}
        total = int(np.count_nonzero(ok))
        of["attractor"] = np.where(ok, of["attractor"], 0)
        names, members = np.unique(of["attractor"][of["attractor"] > 0], return_counts=True)
        numbers = names[np.argsort(-members, kind="stable")].tolist()
        counts = {
            "starts": len(status),
            "failed": int(np.count_nonzero(~ok & (status != PENDING))),
            "pending": int(np.count_nonzero(status == PENDING)),
            "unsettled": int(np.count_nonzero(ok & (of["settled"] == 0))),
            "ungrouped": int(np.count_nonzero(ok & (of["attractor"] == 0))),
        }
        yield [_attractor(number, of, total, told) for number in numbers], counts


def _attractor(number: int, of: Mapping[str, Array], total: int, told: Sequence[str]) -> Attractor:
    inside = of["attractor"] == number
    members = int(np.count_nonzero(inside))
    first = int(np.argmax(inside))
    low, high = wilson(members, total)
    motion, period = _most(of, inside) if "motion" in of else (None, None)
    medians = {name: float(np.median(of[name][inside])) for name in told if name in of}
    return Attractor(
        number,
        int(of["response"][first]),
        int(of["whirl_kind"][first]) if "whirl_kind" in of else 0,
        motion,
        period,
        members,
        int(np.count_nonzero(inside & (of["settled"] == 0))),
        members / total,
        low,
        high,
        medians,
    )


def _most(of: Mapping[str, Array], inside: Array) -> tuple[int, int]:
    """Motion and period of most of the decided members, or of most where none is."""
    motion, period = of["motion"][inside], of["period"][inside]
    known = (motion >= EQUILIBRIUM) & (motion <= CHAOTIC)
    most = int(np.bincount(motion[known] if known.any() else motion).argmax())
    return most, int(period[motion == most][0])


def wilson(count: int, total: int) -> tuple[float, float]:
    """The 95 % interval of a share of which ``count`` in ``total`` independent draws
    were seen."""
    low, high = interval(np.array(count), total)
    return float(low), float(high)
