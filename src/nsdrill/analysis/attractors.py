"""Which starts of an operating point end on the same attractor, and the share of the
starts on each attractor. :mod:`nsdrill.analysis.branch_numbers` numbers the attractors along
a sweep.

Starts are compared by features of their motion, not by their final states, which lie
anywhere along the orbit. Two conditions hold in a group:

- The labels agree: response and kind of it, and, where it was recorded, the kind of
  motion: an equilibrium, periodic with the same period, or neither. (Quasi-periodic,
  chaotic and undetermined count as one kind, as starts on one attractor may be
  classified as any of them.)
- The scaled features are near each other, those that the model names
  (:meth:`nsdrill.models.base.Model.coordinates`). They are means over the observation
  time where there is a mean, since extremes scatter from start to start where the
  motion is chaotic. The distance is the greatest difference of any of them.

The settled starts are grouped by single linkage: all that can be reached in steps of at
most ``tolerance``. An unsettled start joins the nearest settled one within the
tolerance, and so bridges no two groups. The other unsettled starts are linked among
themselves; as their features are less exact, a step may be ``UNSETTLED_SHARE`` of the
lesser of the two ``half_difference``, if that is more.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from nsdrill.analysis.branch_numbers import Places
from nsdrill.analysis.counts import Counts, knowledge
from nsdrill.analysis.probability import interval
from nsdrill.data import Answer, Array
from nsdrill.models.responses import RESPONSE_KINDS
from nsdrill.records import dataclass
from nsdrill.variables import CHAOTIC, EQUILIBRIUM, OK, PERIODIC, QUASI_PERIODIC, UNDETERMINED

# variables beside the features by which a model groups starts: required, and optional
NEEDED = ("status", "response", "settled", "half_difference")
IF_THERE = (*RESPONSE_KINDS, "motion", "period")
_LABELS = ("response", "settled", *IF_THERE)
UNSETTLED_SHARE = 1 / 4  # of the half difference: the step between unsettled starts
_PAIRS_AT_ONCE = 1 << 20  # in one comparison of blocks
_MISSING_VALUE = 1e6  # in place of a missing coordinate


@dataclass(frozen=True)
class Attractor:
    """One attractor at an operating point: its ``number``, the same along a sweep, the
    labels of its members as values of the file (``kinds`` of responses by the names of
    their labels, 0 where not recorded, and ``motion`` and ``period`` of most of
    them, None where not recorded), the number of ``members`` and of ``unsettled`` ones
    among them, its ``share`` of the starts that are on a known attractor with the Wilson
    95 % interval ``low`` to ``high``, which covers whatever attractors the others are on,
    and the medians of some ``features``, in SI."""

    number: int
    response: int
    kinds: dict[str, int]
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
    groups = np.zeros(variables["status"].shape, np.int32)
    for point in range(len(groups)):
        # A file that was changed by hand may lack features of a run that ended well.
        ok = np.flatnonzero((variables["status"][point] == OK) & np.all(np.isfinite(vectors[point]), axis=-1))
        point_labels = {name: variables[name][point, ok] for name in _LABELS if name in variables}
        groups[point, ok] = 1 + _groups(
            vectors[point, ok], variables["half_difference"][point, ok], point_labels, tolerance
        )
    return groups


def places(variables: Mapping[str, Array], groups: Array, vectors: Array) -> Places:
    """Where the ``groups`` that :func:`label` found are, by operating point and number;
    ``vectors`` (operating points, starts, coordinates) are those by which attractors of
    neighbouring operating points are matched."""
    vectors = np.nan_to_num(vectors, posinf=_MISSING_VALUE, neginf=-_MISSING_VALUE, nan=_MISSING_VALUE)
    kinds = _motion_kinds(variables)
    attractors: list[tuple[int, int, Array, int, bool]] = []
    for point, group in enumerate(groups):
        order = np.argsort(group, kind="stable")
        counts = np.bincount(group)
        for chosen in np.split(order, np.cumsum(counts)[:-1])[1:]:
            attractors.append(
                (
                    point,
                    len(chosen),
                    np.median(vectors[point, chosen], axis=0),
                    kinds[point, chosen].max(),
                    np.mean(variables["settled"][point, chosen]) >= 0.5,
                )
            )
    points, members, place, kind, settled = zip(*attractors, strict=True) if attractors else ((),) * 5
    return Places(
        np.array(points, int),
        np.array(members, int),
        np.reshape(place, (len(attractors), vectors.shape[-1])),
        np.array(kind, int),
        np.array(settled, bool),
    )


def linked(vectors: Array, scatter: Array, tolerance: float) -> Array:
    """Single linkage: the number of its group for each of ``vectors`` [n, features],
    whose own uncertainty is ``scatter`` [n]. Two are linked where each is in reach of the
    other."""
    from scipy.spatial.distance import cdist

    reach = np.maximum(tolerance, UNSETTLED_SHARE * scatter)
    distinct, inverse = np.unique(np.column_stack([vectors, reach]), axis=0, return_inverse=True)
    vectors, reach = distinct[:, :-1], distinct[:, -1]
    group = np.full(len(distinct), -1)
    while (left := np.flatnonzero(group < 0)).size:
        number, front = group.max() + 1, left[:1]
        while front.size:
            group[front] = number
            left = left[group[left] < 0]
            near = np.zeros(len(left), bool)
            for block in np.array_split(front, 1 + len(front) * len(left) // _PAIRS_AT_ONCE):
                step = cdist(vectors[block], vectors[left], "chebyshev")
                near |= (step <= np.minimum(reach[block, None], reach[left])).any(axis=0)
            front = left[near]
    return group[inverse]


def _nearest(vectors: Array, queries: Array, reach: float, count: int) -> tuple[Array, Array]:
    """The distances of the ``count`` nearest of ``vectors`` to each of ``queries``,
    infinite beyond ``reach``, and their indices."""
    from scipy.spatial import cKDTree

    distance, neighbours = cKDTree(vectors).query(
        queries, range(1, count + 1), p=np.inf, distance_upper_bound=np.nextafter(reach, np.inf)
    )
    return distance, np.minimum(neighbours, len(vectors) - 1)  # the tree gives n for none


def _motion_kinds(labels: Mapping[str, Array]) -> Array:
    """The kind of motion as a number that includes the period; 0 where it is not
    known."""
    if "motion" not in labels:
        return np.zeros(labels["settled"].shape, np.int64)
    motion = labels["motion"].astype(np.int64)
    kinds = np.where(np.isin(motion, (EQUILIBRIUM, PERIODIC)), motion * 10_000 + labels["period"], 0)
    # Starts on one attractor may be classified as any of the three.
    kinds[np.isin(motion, (QUASI_PERIODIC, CHAOTIC, UNDETERMINED))] = 10_000 * QUASI_PERIODIC
    return kinds


def _groups(vectors: Array, scatter: Array, labels: Mapping[str, Array], tolerance: float) -> Array:
    """The group of each start of one operating point, from 0: the settled starts are
    grouped first, then the others are added to them or grouped."""
    discrete = np.stack([labels[name] for name in ("response", *RESPONSE_KINDS) if name in labels], axis=1)
    kinds = _motion_kinds(labels)
    settled = labels["settled"].astype(bool) & ((kinds > 0) | ("motion" not in labels))
    group = np.full(len(vectors), -1)
    for key in np.unique(discrete, axis=0):
        agrees = np.all(discrete == key, axis=1)
        for settled_pass in (True, False):
            if not settled_pass:
                _assign_unsettled(vectors, tolerance, kinds, group, agrees)
            for kind in np.unique(kinds[agrees]):
                chosen = np.flatnonzero(agrees & (kinds == kind) & (group < 0) & (settled | (not settled_pass)))
                group[chosen] = group.max(initial=-1) + 1 + linked(vectors[chosen], scatter[chosen], tolerance)
    return group


def _assign_unsettled(vectors: Array, tolerance: float, kinds: Array, group: Array, agrees: Array) -> None:
    """Put the starts in ``agrees`` that have no group into the group of the nearest
    start that has one, within ``tolerance`` and of the same kind of motion. By linkage
    they would bridge two groups."""
    grouped, ungrouped = np.flatnonzero(agrees & (group >= 0)), np.flatnonzero(agrees & (group < 0))
    for kind in np.unique(kinds[ungrouped]):
        chosen = ungrouped[kinds[ungrouped] == kind]
        allowed = grouped[(kinds[grouped] == kind) | (kind == 0)]
        if allowed.size:
            distance, nearest = (values[:, 0] for values in _nearest(vectors[allowed], vectors[chosen], tolerance, 1))
            is_near = np.isfinite(distance)
            group[chosen[is_near]] = group[allowed[nearest[is_near]]]


def describe(
    variables: Mapping[str, Array], is_known: Array, features: Sequence[str]
) -> Iterator[tuple[list[Attractor], dict[str, int]]]:
    """For each operating point its attractors, by falling share, and the numbers of
    ``starts``: all, ``known`` ones, on a known attractor, ``failed``, ``pending``,
    ``unsettled``, ``doubtful`` and ``ungrouped`` ones.
    ``variables`` are arrays (operating points, starts) with ``attractor`` and
    ``settled``, and ``is_known`` one of the runs that are known
    (:func:`nsdrill.analysis.safety.known_runs`): one that ended well and is not is
    doubtful, and on no attractor, as what it shows is not what a real system keeps doing
    there. Of ``features`` those that are among the variables are summarised."""
    for i, status in enumerate(variables["status"]):
        ended_well, counted = status == OK, (status == OK) & is_known[i]
        at_point = {name: values[i] for name, values in variables.items()}
        at_point["attractor"] = np.where(counted, at_point["attractor"], 0)
        groups, members = np.unique(at_point["attractor"][at_point["attractor"] > 0], return_counts=True)
        numbers = groups[np.argsort(-members, kind="stable")].tolist()
        runs = Counts.over(knowledge(status, at_point["attractor"] > 0)).at()
        counts = {
            "starts": len(status),
            **{name: runs[name] for name in ("known", "failed", "pending")},
            "unsettled": int(np.count_nonzero(ended_well & (at_point["settled"] == 0))),
            "doubtful": int(np.count_nonzero(ended_well & ~counted)),
            "ungrouped": int(np.count_nonzero(counted & (at_point["attractor"] == 0))),
        }
        yield [_attractor(number, at_point, runs, features) for number in numbers], counts


def _attractor(number: int, at_point: Mapping[str, Array], runs: Answer, features: Sequence[str]) -> Attractor:
    is_member = at_point["attractor"] == number
    members = int(np.count_nonzero(is_member))
    first_member = int(np.argmax(is_member))
    low, high = wilson(members, runs["of"], runs["of"] - runs["known"])
    has_motion = {"motion", "period"} <= at_point.keys()  # pictures may read the first alone
    motion, period = _majority_motion(at_point, is_member) if has_motion else (None, None)
    medians = {name: float(np.median(at_point[name][is_member])) for name in features if name in at_point}
    return Attractor(
        number,
        int(at_point["response"][first_member]),
        {name: int(at_point[name][first_member]) if name in at_point else 0 for name in RESPONSE_KINDS},
        motion,
        period,
        members,
        int(np.count_nonzero(is_member & (at_point["settled"] == 0))),
        members / runs["known"],
        low,
        high,
        medians,
    )


def _majority_motion(at_point: Mapping[str, Array], is_member: Array) -> tuple[int, int]:
    """The motion and period of most members whose motion is decided, or of most members
    where none is."""
    motion, period = at_point["motion"][is_member], at_point["period"][is_member]
    is_decided = (motion >= EQUILIBRIUM) & (motion <= CHAOTIC)
    majority = int(np.bincount(motion[is_decided] if is_decided.any() else motion).argmax())
    return majority, int(period[motion == majority][0])


def wilson(count: int, total: int, unknown: int = 0) -> tuple[float, float]:
    """The Wilson 95 % interval of a share, of which ``count`` occurred in ``total``
    independent draws, and of ``unknown`` further ones among them it is not known."""
    low, high = interval(np.array(count), total, unknown)
    return float(low), float(high)
