"""A sweep as maps over its axes, and the safe points of a map as a figure in the plane: its
connected regions, and the point deepest inside.

A *history* is a procedure and, in an ensemble, a start: one way to reach an operating
point. The state of a point:

- *safe*: every history in the file ended well without a critical response;
- *history-dependent* (``rim`` in data): only some did;
- *critical*: none did;
- *unknown*: a run failed or is missing, and the others do not decide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nsdrill.analysis.counts import Counts, knowledge
from nsdrill.analysis.probability import SAFE as PROBABLY_SAFE
from nsdrill.analysis.probability import RunSafety, known_runs, probabilities_of, run_safety, window_state
from nsdrill.data import Answer, Array, Results
from nsdrill.errors import InputError
from nsdrill.models.leaves import words_along
from nsdrill.models.responses import RESPONSES
from nsdrill.variables import OK

# axes of the maps: the first of these that is swept is x, the next one y
ACROSS = ("rotary_speed", "wob", "depth")
SAFE, HISTORY_DEPENDENT, CRITICAL, UNKNOWN = 2, 1, 0, -1
STATES = {SAFE: "safe", HISTORY_DEPENDENT: "rim", CRITICAL: "critical", UNKNOWN: "unknown"}


@dataclass(frozen=True)
class Classes:
    """A sweep as maps over the axes ``x``, ``y`` and ``third``; the last two are None
    where no such axis is swept, and their length is then 1. Arrays are [third, y, x]:

    - ``state``: SAFE, HISTORY_DEPENDENT, CRITICAL or UNKNOWN;
    - ``bits``: the responses that occur in any history;
    - ``failed``: whether any history, or the check of a safe one, failed or has not
      run;
    - ``distrusted``: whether the checks of any history gave another response;
    - ``yields``: those of :data:`YIELDS` that the file has, as the mean over histories
      and samples, NaN where none has run;
    - ``safety``: with a ``confidence`` the probability of a safe run, the ends of its
      95 % interval, and the share of the samples that are known to be safe;
    - ``counts``: of the runs of the point how many are known, failed and pending, of
      results with samples those of samples;
    - ``unsettled``: whether any history was finished and did not settle; with a
      ``confidence`` whether more runs did not, or are not known, than may be critical.

    ``bits_in``, ``is_safe_in`` and ``is_known_in`` are [procedure, third, y, x]: the
    responses in each procedure, whether it is safe, and whether all of its runs are
    known.

    ``over_all``: this is one map of what holds at all values of a third axis. ``histories``
    and ``failed_runs`` are the numbers of histories and of failed runs,
    ``safe_in`` the number of safe points in each procedure by itself.
    """

    results: Results
    x: str
    y: str | None
    third: str | None
    state: Array
    bits: Array
    failed: Array
    distrusted: Array
    histories: int
    failed_runs: int
    safe_in: dict[str, int]
    yields: dict[str, Array]
    bits_in: Array
    is_safe_in: Array
    is_known_in: Array
    unsettled: Array
    counts: Counts
    confidence: float | None = None
    safety: tuple[Array, ...] = ()
    over_all: bool = False

    def values(self, axis: str | None) -> Array:
        """The values of an axis; a single zero for None."""
        return np.zeros(1) if axis is None else np.asarray(self.results.coords[axis], dtype=float)


# the yields of a point, listed where the file has them
YIELDS = ("rate_of_penetration", "mechanical_specific_energy")
# what a window is made of beside the responses, where the file has it
USES = (*YIELDS, "settled")


def axes_of(results: Results) -> tuple[str, str | None, str | None] | None:
    """The axes of the maps: x, y, and the third one, which has a map for each value. An
    axis of words is always the third, as there is nothing between words. None where the
    axes of the sweep do not make maps."""
    swept = [axis for axis in (*ACROSS, *results.axes[len(ACROSS) :]) if axis in results.swept]
    words = [axis for axis in swept if words_along(axis)]
    numbers = [axis for axis in swept if axis not in words]
    if len(swept) > 3 or not numbers or len(words) > 1:
        return None
    third = words[0] if words else numbers[2] if len(numbers) == 3 else None
    return numbers[0], numbers[1] if len(numbers) > 1 else None, third


Planes = Callable[[Array], Array]  # from the grid of the runs to [third, y, x, history]
Cell = tuple[int, int, int]  # of the maps: third, y, x


def classes(results: Results, severity: int | None = None, confidence: float | None = None) -> Classes:
    """The state of every operating point. With ``severity`` a history is safe where
    none of the three severities exceeds it, whatever the response bits are. With
    ``confidence`` (0 to 1), for results with samples, a point is safe where the
    probability of a safe run reaches it, and critical where it does not. InputError
    where the axes do not make maps.

    An inferred point has a response but no severity: by severity it is unknown.
    """
    swept = axes_of(results)
    if swept is None:
        if not results.swept:
            raise InputError(
                "window: found a single operating point; allowed: a sweep of at least one axis. nsdrill show and "
                "report tell of a point."
            )
        raise InputError(
            f"window: found the axes {', '.join(results.swept)}; allowed: a sweep of one to three, among them words as "
            "one, beside one or two of numbers."
        )
    x, y, third = swept

    def planes(array: Array) -> Array:
        """``array`` as [third, y, x, history]. Axes that are not swept have length 1;
        they are merged with the third one."""
        axes = results.axes
        order = [axis for axis in axes if axis not in (x, y)] + [axis for axis in (y, x) if axis]
        transposed = np.moveaxis(array, 0, len(axes))
        transposed = transposed.transpose(*(axes.index(axis) for axis in order), *range(len(axes), array.ndim))
        lengths = [len(results.coords[axis]) if axis else 1 for axis in (third, y, x)]
        return transposed.reshape(*lengths, -1)

    runs = run_safety(results, severity)
    if confidence is None:
        found = _by_histories(results, runs, planes)
    else:
        found = _by_confidence(results, severity, confidence, planes)
    return Classes(
        results,
        *swept,
        failed=np.asarray(planes(runs.failed).any(axis=-1)),
        distrusted=np.asarray(planes(runs.distrusted).any(axis=-1)),
        failed_runs=int(np.count_nonzero(runs.failed)),
        is_known_in=np.array([planes(part[None]).all(axis=-1) for part in known_runs(results)]),
        yields={name: mean_known(planes(results[name])) for name in YIELDS if name in results.variables},
        **found,
    )


def _by_histories(results: Results, runs: RunSafety, planes: Planes) -> Answer:
    """The fields of classes where the histories decide on a point."""
    any_safe, any_unsafe = planes(runs.safe).any(axis=-1), planes(runs.unsafe).any(axis=-1)
    is_decided = planes(runs.safe | runs.unsafe).all(axis=-1) | (any_safe & any_unsafe)
    state = np.where(any_unsafe, np.where(any_safe, HISTORY_DEPENDENT, CRITICAL), SAFE)
    bits = np.where(known_runs(results), results["response"], 0).astype(int)
    bits_in = np.array([np.bitwise_or.reduce(planes(part[None]), axis=-1) for part in bits])
    is_safe_in = np.array([planes(part[None]).all(axis=-1) for part in runs.safe])
    return {
        "state": np.where(is_decided, state, UNKNOWN),
        "bits": np.bitwise_or.reduce(bits_in, axis=0),
        "histories": planes(runs.safe).shape[-1],
        "safe_in": {
            name: int(np.count_nonzero(part)) for name, part in zip(results.procedures, is_safe_in, strict=True)
        },
        "bits_in": bits_in,
        "is_safe_in": is_safe_in,
        "unsettled": np.asarray(planes(_unsettled(results)).any(axis=-1)),
        "counts": Counts.over(planes(knowledge(results["status"], runs.safe | runs.unsafe)), -1),
    }


def _unsettled(results: Results) -> Array:
    """Whether each run was finished and did not settle; nowhere in a file that does not
    say."""
    if "settled" not in results.variables:
        return np.zeros(results["status"].shape, dtype=bool)
    return np.asarray((results["status"] == OK) & (results["settled"] == 0))


def least_share(confidence: float) -> float:
    """The probability from which a response counts among those that may prevent that a
    point is safe: one of the four must have a quarter of 1 less
    ``confidence``."""
    return (1.0 - confidence) / len(RESPONSES)


def _by_confidence(results: Results, severity: int | None, confidence: float, planes: Planes) -> Answer:
    """The fields of classes where a point is safe if the probability of a safe run reaches
    ``confidence``. ``bits`` are the responses that may prevent that."""
    probabilities = probabilities_of(results, severity)
    is_safe, is_undecided = window_state(probabilities, confidence)

    def placed(array: Array) -> Array:
        return planes(array[None])[..., 0]

    def bits_of(share: Array) -> Array:
        occurs = np.nan_to_num(share) >= least_share(confidence)
        bits = (one.bit * placed(occurs_here) for one, occurs_here in zip(RESPONSES.values(), occurs, strict=True))
        return np.asarray(sum(bits))

    unsettled, unknown = planes(_unsettled(results)), planes(~known_runs(results))
    procedures = len(results.coords["procedure"])
    safe_by = {name: window_state(probabilities, confidence, name)[0] for name in probabilities.histories[:procedures]}
    return {
        "state": placed(np.where(is_safe, SAFE, np.where(is_undecided, UNKNOWN, CRITICAL))),
        "bits": bits_of(probabilities.share[-1, 1:]),
        "histories": procedures,
        "safe_in": {name: int(np.count_nonzero(safe)) for name, safe in safe_by.items()},
        "bits_in": np.array([bits_of(probabilities.share[number, 1:]) for number in range(procedures)]),
        "is_safe_in": np.array([placed(safe) for safe in safe_by.values()]),
        "unsettled": unsettled.any(axis=-1) & ((unsettled | unknown).mean(axis=-1) > 1.0 - confidence + 1e-9),
        "confidence": confidence,
        "safety": tuple(
            map(placed, (*probabilities.of(PROBABLY_SAFE), probabilities.least[probabilities.place(PROBABLY_SAFE)]))
        ),
        "counts": probabilities.runs.each(lambda part: placed(part[-1])),
    }


def mean_known(values: Array) -> Array:
    """The mean of the finite values over the last axis; NaN where there are none."""
    finite = np.isfinite(values)
    count = finite.sum(axis=-1)
    total = np.where(finite, values, 0.0).sum(axis=-1)
    return np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)


_TOLERANCE = 1e-9  # between equal distances, which are fractions of the range


def regions(safe: Array) -> list[tuple[int, tuple[int, int, int, int]]]:
    """The connected regions of ``safe`` [y, x], the largest first: the number of
    points, and the first and last row and column. Points are neighbours along the axes,
    not across corners."""
    from scipy import ndimage

    labels, count = ndimage.label(safe)
    if not count:
        return []
    sizes = np.bincount(labels.ravel(), minlength=count + 1)[1:]
    boxes = ndimage.find_objects(labels)
    # stable: by place where the sizes are equal
    order = sorted(range(count), key=lambda number: -int(sizes[number]))
    return [
        (int(sizes[n]), (boxes[n][0].start, boxes[n][0].stop - 1, boxes[n][1].start, boxes[n][1].stop - 1))
        for n in order
    ]


def stretches(chosen: Array) -> list[tuple[int, int]]:
    """The first and last place of each stretch of neighbours of ``chosen`` [n] that are
    true."""
    steps = np.flatnonzero(np.diff(np.pad(chosen.astype(int), 1))).tolist()
    return [(begin, end - 1) for begin, end in zip(steps[::2], steps[1::2], strict=True)]


def largest_margin(safe: Array, y: Array, x: Array) -> tuple[int, int, float] | None:
    """The row and column of the safe point of ``safe`` [y, x] with the largest margin,
    and the margin; None where no point is safe.

    The margin is the Euclidean distance to the nearest point that is not safe, or to
    the edge of the map, whichever is less; each axis is in fractions of its range, so
    that the margin has no unit. An axis of one value has no edge. Points whose
    neighbours are all safe come first, however near the others of a coarse axis seem.
    Of equal margins the point farthest from points that are not safe is taken, then
    that with the largest clearance along the axes, then the first.
    """
    with_room = _with_room(safe)
    rows, columns = np.nonzero(with_room if with_room.any() else safe)
    if not rows.size:
        return None
    across, up = normalised(x), normalised(y)
    points = np.column_stack((up[rows], across[columns]))
    to_unsafe = _nearest_distances(
        points, np.column_stack([axis[indices] for axis, indices in zip((up, across), np.nonzero(~safe), strict=True)])
    )
    edges = [
        np.minimum(axis[indices], 1.0 - axis[indices])
        for axis, indices in ((up, rows), (across, columns))
        if len(axis) > 1
    ]
    margin = np.min([to_unsafe, *edges], axis=0)
    candidates = np.flatnonzero(margin >= margin.max() - _TOLERANCE)
    candidates = candidates[to_unsafe[candidates] >= to_unsafe[candidates].max() - _TOLERANCE]
    clearance = np.array(
        [
            _clearance(safe[rows[i]], across, columns[i]) + _clearance(safe[:, columns[i]], up, rows[i])
            for i in candidates
        ]
    )
    chosen = candidates[int(np.flatnonzero(clearance >= clearance.max() - _TOLERANCE)[0])]
    return int(rows[chosen]), int(columns[chosen]), float(margin[chosen])


def _with_room(safe: Array) -> Array:
    """Where ``safe`` [y, x] has safe neighbours on both sides of each axis of several
    values."""
    from scipy import ndimage

    of_axes = tuple(slice(None) if length > 1 else slice(1, 2) for length in safe.shape)
    neighbours = ndimage.generate_binary_structure(safe.ndim, 1)[of_axes]
    return np.asarray(ndimage.binary_erosion(safe, neighbours))


def normalised(values: Array) -> Array:
    """An ascending axis in fractions of its range: 0 to 1; 0 where it has one value."""
    return (values - values[0]) / ((values[-1] - values[0]) or 1.0)


def _nearest_distances(points: Array, others: Array) -> Array:
    """The distance of each of ``points`` [n, 2] from the nearest of ``others`` [m, 2];
    infinite where there is none."""
    if not len(others):
        return np.full(len(points), np.inf)
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(others).query(points)[0])


def _clearance(safe: Array, axis: Array, index: int) -> float:
    """The smaller of the distances from point ``index`` of a line to the nearest point
    that is not safe, or to the end, on the two sides."""
    unsafe = np.flatnonzero(~safe)
    low = unsafe[unsafe < index].max(initial=0)
    high = unsafe[unsafe > index].min(initial=len(axis) - 1)
    return float(min(axis[index] - axis[low], axis[high] - axis[index]))
