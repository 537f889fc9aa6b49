"""A sweep as maps over its axes, and the allowed points of a map as a figure in the plane:
its connected regions.

The state of a point follows from its grade (:mod:`nsdrill.analysis.histories`):

- *safe*: it may be recommended, at least if it is brought up from below;
- *history-dependent* (``rim`` in data): borderline, free where stick-slip that was met below
  may last, or free only when lowered from above;
- *critical*: it vibrates or stalls on the way in;
- *unknown*: a run failed or is missing, and the others do not decide.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nsdrill.analysis.counts import BEYOND, Counts, knowledge
from nsdrill.analysis.graded import Graded, graded, least_share
from nsdrill.analysis.histories import Grade, is_allowed
from nsdrill.analysis.planes import Planes, axes_or_refusal, planes_of, stretches
from nsdrill.analysis.probability import probabilities_of
from nsdrill.analysis.safety import DECIDING, RunSafety, barring, known_runs, run_safety
from nsdrill.data import Answer, Array, Results
from nsdrill.models.registry import responses_in
from nsdrill.models.responses import SEVERITIES
from nsdrill.records import dataclass

SAFE, HISTORY_DEPENDENT, CRITICAL, UNKNOWN = 2, 1, 0, -1
STATES = {SAFE: "safe", HISTORY_DEPENDENT: "rim", CRITICAL: "critical", UNKNOWN: "unknown"}


@dataclass(frozen=True)
class Classes:
    """A sweep as maps over the axes ``x``, ``y`` and ``third``; the last two are None
    where no such axis is swept, and their length is then 1. Arrays are [third, y, x]:

    - ``state``: SAFE, HISTORY_DEPENDENT, CRITICAL or UNKNOWN; it follows from ``grades``;
    - ``bits``: the responses that occur in any history, without those that a severity
      allows; ``stops``: those that prevent that a point is safe, on the way in, else on any;
    - ``failed``: whether any history, or the check of a safe one, failed or has not
      run;
    - ``distrusted``: whether the checks of any history gave another response;
    - ``yields``: those of :data:`YIELDS` that the file has, as the mean of the known
      samples on the way in, NaN where none is known;
    - ``safety``: with a ``confidence`` the probability of a safe run, the ends of its
      95 % interval, and the share of the samples that are known to be safe;
    - ``counts``: of the runs of the point how many are known, failed and pending, of
      results with samples those of samples;
    - ``unsettled``: whether a run on which its class rests was finished and did not
      settle: that on the way in, of a point safe after any history any; with a
      ``confidence`` whether more runs did not, or are not known, than may be critical.

    ``bits_in`` and ``is_known_in`` are [procedure, third, y, x]: the responses in each
    procedure, and whether all of its runs are known. ``histories`` is their number.
    """

    results: Results
    x: str
    y: str | None
    third: str | None
    grades: Graded
    state: Array
    bits: Array
    stops: Array
    failed: Array
    distrusted: Array
    histories: int
    yields: dict[str, Array]
    bits_in: Array
    is_known_in: Array
    unsettled: Array
    counts: Counts
    confidence: float | None = None
    safety: tuple[Array, ...] = ()

    def values(self, axis: str | None) -> Array:
        """The values of an axis; a single zero for None."""
        return np.zeros(1) if axis is None else np.asarray(self.results.coords[axis], dtype=float)


# the yields of a point, listed where the file has them
YIELDS = ("rate_of_penetration", "mechanical_specific_energy")
# what a window is made of beside the responses, where the file has it
SEEN = (
    "surface_torque_min",
    "surface_torque_mean",
    "surface_torque_max",
    "stick_slip_period",
    "lateral_acceleration_rms",
    "lift_off_fraction",
    *SEVERITIES,
    "wall_contact_fraction",
    "whirl_kind",
)
USES = (*YIELDS, *DECIDING, BEYOND, *SEEN)


def classes(results: Results, severity: int | None = None, confidence: float | None = None) -> Classes:
    """The state of every operating point. With ``severity`` a run is clear where no
    severity exceeds it, whatever the response bits are. With ``confidence`` (0 to 1),
    for results with samples, a point is safe where the share of samples in which it is
    allowed reaches it, and critical where it does not. InputError where the axes do not
    make maps.

    An inferred point has a response but no severity: by severity it is unknown.
    """
    swept = axes_or_refusal(results)
    planes = planes_of(results, *swept)
    runs, grades = run_safety(results, severity), graded(results, severity, confidence)
    if confidence is None:
        found = _by_histories(results, severity, runs, planes, grades)
    else:
        found = _by_confidence(results, severity, confidence, planes, grades)
    on_way_in = grades.barred
    return Classes(
        results,
        *swept,
        grades,
        stops=np.where(grades.allowed, 0, np.where(on_way_in > 0, on_way_in, found["bits"])),
        failed=np.asarray(planes(runs.failed).any(axis=-1)),
        distrusted=np.asarray(planes(runs.distrusted).any(axis=-1)),
        is_known_in=np.array([planes(part[None]).all(axis=-1) for part in known_runs(results)]),
        unsettled=grades.unsettled,
        yields={name: grades.yields(name) for name in YIELDS if name in results.variables},
        **found,
    )


def _by_histories(results: Results, severity: int | None, runs: RunSafety, planes: Planes, grades: Graded) -> Answer:
    """The fields of classes where the histories decide on a point."""
    by_history = np.isin(grades.grade, (Grade.BORDERLINE, Grade.STICKS_ON, Grade.FROM_SOME, Grade.ONLY_FROM_ABOVE))
    if grades.outside is not None:  # free, but only to pass
        by_history |= grades.outside & is_allowed(grades.grade)
    is_known = grades.grade != Grade.UNKNOWN
    bits = np.where(known_runs(results), results["response"], 0).astype(int)
    bits_in = np.array([np.bitwise_or.reduce(planes(part[None]), axis=-1) for part in bits])
    return {
        "state": np.select([grades.allowed, by_history, is_known], [SAFE, HISTORY_DEPENDENT, CRITICAL], UNKNOWN),
        "bits": np.bitwise_or.reduce([planes(part[None]) for part in barring(results, severity)], axis=(0, -1)),
        "histories": planes(runs.safe).shape[-1],
        "bits_in": bits_in,
        "counts": Counts.over(planes(knowledge(results["status"], runs.safe | runs.unsafe)), -1),
    }


def _by_confidence(results: Results, severity: int | None, confidence: float, planes: Planes, grades: Graded) -> Answer:
    """The fields of classes where a point is safe if the share of samples in which it is
    allowed reaches ``confidence``. ``bits`` are the responses that may prevent that."""
    probabilities, critical = probabilities_of(results, severity), responses_in(results.attrs)

    def placed(array: Array) -> Array:
        return planes(array[None])[..., 0]

    def bits_of(share: Array) -> Array:
        occurs = np.nan_to_num(share) >= least_share(confidence, len(critical))
        bits = (one.bit * placed(occurs_here) for one, occurs_here in zip(critical.values(), occurs, strict=True))
        return np.asarray(sum(bits))

    procedures, barred = len(results.coords["procedure"]), probabilities
    if severity is not None:
        bars = barring(results, severity).astype(results["response"].dtype)
        barred = probabilities_of(replace(results, variables={**results.variables, "response": bars}), severity)
    return {
        "state": np.select([grades.allowed, grades.may_be], [SAFE, UNKNOWN], CRITICAL),
        "bits": bits_of(barred.share[-1, 1:]),
        "histories": procedures,
        "bits_in": np.array([bits_of(probabilities.share[number, 1:]) for number in range(procedures)]),
        "confidence": confidence,
        "safety": (*grades.probability(), grades.least),
        "counts": probabilities.runs.each(lambda part: placed(part[-1])),
    }


def regions(safe: Array) -> list[tuple[int, tuple[int, int, int, int]]]:
    """The connected regions of ``safe`` [y, x], the largest first: the number of
    points, and the first and last row and column. Points are neighbours along the axes,
    not across corners."""
    # stretches of rows that lie side by side, as a forest; an import of scipy takes longer than the rest
    spans: list[tuple[int, int, int]] = []
    parent: list[int] = []

    def root(number: int) -> int:
        while parent[number] != number:
            parent[number] = parent[parent[number]]
            number = parent[number]
        return number

    above: range = range(0)
    for row, one in enumerate(safe):
        begin = len(spans)
        for first, last in stretches(one):
            parent.append(len(spans))
            for other in above:
                if spans[other][1] <= last and first <= spans[other][2]:
                    low, high = sorted((root(other), root(len(spans))))
                    parent[high] = low
            spans.append((row, first, last))
        above = range(begin, len(spans))
    together: dict[int, list[tuple[int, int, int]]] = {}
    for number, span in enumerate(spans):
        together.setdefault(root(number), []).append(span)
    found = []
    for rows, firsts, lasts in (zip(*one, strict=True) for one in together.values()):
        size = sum(lasts) - sum(firsts) + len(rows)
        found.append((size, (min(rows), max(rows), min(firsts), max(lasts))))
    # stable: by place where the sizes are equal
    return sorted(found, key=lambda one: -one[0])
