"""The operating window: the operating points that are safe whatever the history, and the
best of them.

A *history* is a procedure and, in an ensemble, a start: one way to reach an operating
point. The state of a point:

- *safe*: every history in the file ended well without a critical response;
- *history-dependent* (``rim`` in data): only some did;
- *critical*: none did;
- *unknown*: a run failed or is missing, and the others do not decide.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nsdrill.analysis.hysteresis import response_text
from nsdrill.analysis.plane import largest_margin, regions, stretches
from nsdrill.analysis.probability import (
    RunSafety,
    check_samples,
    effective_number,
    independent,
    known,
    one_procedure,
    probabilities_of,
    run_safety,
    text,
    window_state,
)
from nsdrill.analysis.reasons import reason
from nsdrill.data import PASSED_OVER, Answer, Array, Results, overrides
from nsdrill.errors import InputError, option
from nsdrill.models.leaves import in_words, words_along
from nsdrill.models.responses import RESPONSES
from nsdrill.variables import OK, PENDING, SAMPLE

# axes of the maps: the first of these that is swept is x, the next one y
ACROSS = ("rotary_speed", "wob", "depth")
SAFE, HISTORY_DEPENDENT, CRITICAL, UNKNOWN = 2, 1, 0, -1
STATES = {SAFE: "safe", HISTORY_DEPENDENT: "rim", CRITICAL: "critical", UNKNOWN: "unknown"}
USUAL_CONFIDENCE = 0.9
LEVELS = (0.5, 0.8, 0.9, 0.95, 0.99)  # of confidence whose costs are listed


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
    - ``safety``: with a ``confidence`` the probability of a safe run and the ends of
      its 95 % interval;
    - ``unsettled``: whether any history was finished and did not settle; with a
      ``confidence`` whether more runs did not than may be critical.

    ``bits_in`` and ``is_safe_in`` are [procedure, third, y, x]: the responses in each
    procedure, and whether it is safe.

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
    unsettled: Array
    confidence: float | None = None
    safety: tuple[Array, ...] = ()
    over_all: bool = False

    @property
    def procedures(self) -> list[str]:
        return [text(name) for name in self.results.coords["procedure"]]

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
            raise InputError("window: found a single operating point; allowed: a sweep of at least one axis.")
        raise InputError(
            f"window: found the axes {', '.join(results.swept)}; allowed: a sweep of one to "
            f"three, among them words as "
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
        yields={name: _mean(planes(results[name])) for name in YIELDS if name in results.variables},
        **found,
    )


def _by_histories(results: Results, runs: RunSafety, planes: Planes) -> Answer:
    """The fields of classes where the histories decide on a point."""
    any_safe, any_unsafe = planes(runs.safe).any(axis=-1), planes(runs.unsafe).any(axis=-1)
    is_decided = planes(runs.safe | runs.unsafe).all(axis=-1) | (any_safe & any_unsafe)
    state = np.where(any_unsafe, np.where(any_safe, HISTORY_DEPENDENT, CRITICAL), SAFE)
    bits = np.where(known(results["status"]), results["response"], 0).astype(int)
    bits_in = np.array([np.bitwise_or.reduce(planes(part[None]), axis=-1) for part in bits])
    is_safe_in = np.array([planes(part[None]).all(axis=-1) for part in runs.safe])
    names = map(text, results.coords["procedure"])
    return {
        "state": np.where(is_decided, state, UNKNOWN),
        "bits": np.bitwise_or.reduce(bits_in, axis=0),
        "histories": planes(runs.safe).shape[-1],
        "safe_in": {name: int(np.count_nonzero(part)) for name, part in zip(names, is_safe_in, strict=True)},
        "bits_in": bits_in,
        "is_safe_in": is_safe_in,
        "unsettled": np.asarray(planes(_unsettled(results)).any(axis=-1)),
    }


def _unsettled(results: Results) -> Array:
    """Whether each run was finished and did not settle; nowhere in a file that does not
    say."""
    if "settled" not in results.variables:
        return np.zeros(results["status"].shape, dtype=bool)
    return np.asarray((results["status"] == OK) & (results["settled"] == 0))


def least_share(confidence: float) -> float:
    """The probability from which a response counts among those that may prevent that a
    point is safe: one of the three must have a third of 1 less ``confidence``."""
    return (1.0 - confidence) / 3


def _by_confidence(results: Results, severity: int | None, confidence: float, planes: Planes) -> Answer:
    """The fields of classes where a point is safe if the probability of a safe run reaches
    ``confidence``. ``bits`` are the responses that may prevent that."""
    probabilities = probabilities_of(results, severity)
    is_safe, is_undecided = window_state(probabilities, confidence)

    def placed(array: Array) -> Array:
        return planes(array[None])[..., 0]

    def bits_of(share: Array) -> Array:
        occurs = share >= least_share(confidence)
        return np.asarray(sum(placed(response).astype(int) << number for number, response in enumerate(occurs)))

    procedures = len(results.coords["procedure"])
    safe_by = {name: window_state(probabilities, confidence, name)[0] for name in probabilities.histories[:procedures]}
    return {
        "state": placed(np.where(is_safe, SAFE, np.where(is_undecided, UNKNOWN, CRITICAL))),
        "bits": bits_of(probabilities.share[-1, 1:]),
        "histories": procedures,
        "safe_in": {name: int(np.count_nonzero(safe)) for name, safe in safe_by.items()},
        "bits_in": np.array([bits_of(probabilities.share[number, 1:]) for number in range(procedures)]),
        "is_safe_in": np.array([placed(safe) for safe in safe_by.values()]),
        "unsettled": np.asarray(planes(_unsettled(results)).mean(axis=-1) > 1.0 - confidence + 1e-9),
        "confidence": confidence,
        "safety": tuple(placed(part) for part in probabilities.of("safe")),
    }


def _mean(values: Array) -> Array:
    """The mean of the finite values over the last axis; NaN where there are none."""
    finite = np.isfinite(values)
    count = finite.sum(axis=-1)
    total = np.where(finite, values, 0.0).sum(axis=-1)
    return np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)


def find_window(results: Results, severity: int | None = None, confidence: float | None = None) -> Answer:
    """The operating window of a sweep with ascending axes, as plain data in SI units; its
    keys are described on the page on the window. For results with samples the window
    has a ``confidence``, by default 0.9; InputError for a ``confidence`` without
    samples."""
    confidence = usual_confidence(results, confidence)
    maps = classes(results, severity, confidence)
    at = maps.values(maps.third)
    return dict(
        in_words(
            {
                "kind": "window",
                "title": str(results.attrs.get("title") or ""),
                "overrides": overrides(results.attrs, thresholds=True),
                **_runs(maps, severity),
                **_counts(maps.state),
                **_outcomes(maps),
                "confidence": confidence,
                **_samples(results),
                "most_probable": _most_probable(maps),
                "price": _confidence_costs(maps),
                "alone": _by_procedure(results, severity, confidence) if maps.histories > 1 else [],
                "maps": [
                    {"at": {maps.third: float(at[number])} if maps.third else {}, **_map(maps, number)}
                    for number in range(len(maps.state))
                ],
                "throughout": _map(_throughout(maps), 0) if maps.third else None,
                "depth": _over_depth(maps),
            }
        )
    )


def _runs(maps: Classes, severity: int | None) -> Answer:
    """What was run, and how."""
    results, axes = maps.results, [axis for axis in (maps.x, maps.y) if axis]
    return {
        "procedures": maps.procedures,
        "histories": maps.histories,
        "history_examined": maps.histories > 1,
        "severity": severity,
        "axes": axes,
        "third": maps.third,
        "fixed": results.held,
        "runs": int(results["status"].size),
        "failed_runs": maps.failed_runs,
        "failed_points": int(np.count_nonzero(maps.failed)),
        "distrusted_points": int(np.count_nonzero(maps.distrusted)),
        "pending_runs": int(np.count_nonzero(results["status"] == PENDING)),
        "unsettled_points": int(np.count_nonzero(maps.unsettled & (maps.state == SAFE))),
        "unsettled_in_all": int(np.count_nonzero(maps.unsettled)),
        "by_history": _by_history(maps),
        "ranges": {axis: [float(maps.values(axis)[end]) for end in (0, -1)] for axis in axes},
        "passed_over": json.loads(results.attrs.get(PASSED_OVER, "[]")),
    }


def _outcomes(maps: Classes) -> Answer:
    """What prevents that points are safe."""
    return {
        "unknown_failed": int(np.count_nonzero((maps.state == UNKNOWN) & maps.failed)),
        "safe_in": maps.safe_in,
        "obstacles": {one.name: int(np.count_nonzero(maps.bits & one.bit)) for one in RESPONSES.values()},
    }


def _samples(results: Results) -> Answer:
    """How many samples there are, and how many of them count; None without samples."""
    if SAMPLE not in results.coords:
        return dict.fromkeys(("samples", "counted", "effective"))
    samples, counted = results.coords[SAMPLE], independent(results)
    effective = effective_number(results, counted)
    return {"samples": len(samples), "counted": len(samples[counted]), "effective": effective}


def usual_confidence(results: Results, confidence: float | None) -> float | None:
    """The confidence of a window: for results with samples by default 0.9; InputError
    for one without samples."""
    if SAMPLE in results.coords:
        return USUAL_CONFIDENCE if confidence is None else confidence
    if confidence is not None:
        check_samples(results, option("confidence"))
    return None


def unknown_words(summary: Answer) -> str:
    """Why points of a window's ``summary`` are unknown: ``3 failed``, ``3 failed, 12
    inferred, without a severity``."""
    failed = summary["unknown_failed"]
    inferred = summary["unknown"] - failed
    return ", ".join(
        [f"{failed} failed"] * bool(failed) + [f"{inferred} inferred, without a severity"] * bool(inferred)
    )


def _by_history(maps: Classes) -> int:
    """The number of points that are safe by some histories only; of results with samples
    those that reach the confidence in some procedures only."""
    if maps.confidence is None:
        return int(np.count_nonzero(maps.state == HISTORY_DEPENDENT))
    return int(np.count_nonzero(maps.is_safe_in.any(axis=0) & (maps.state == CRITICAL)))


def _counts(state: Array) -> Answer:
    counts = {word: int(np.count_nonzero(state == value)) for value, word in STATES.items()}
    return {"points": int(state.size), **counts, "share": {word: n / state.size for word, n in counts.items()}}


def _throughout(maps: Classes) -> Classes:
    """One map of what holds at all values of the third axis: what occurs at any, the mean
    yields, and the least probability of a safe run."""

    def at_any(array: Array) -> Array:
        return np.asarray(array.any(axis=0, keepdims=True))

    least = np.argmin(maps.safety[0], axis=0)[None] if maps.safety else None
    return replace(
        maps,
        third=None,
        state=np.where(at_any(maps.state == CRITICAL), CRITICAL, maps.state.min(axis=0)),
        bits=np.bitwise_or.reduce(maps.bits, axis=0, keepdims=True),
        failed=at_any(maps.failed),
        distrusted=at_any(maps.distrusted),
        unsettled=at_any(maps.unsettled),
        yields={name: _mean(np.moveaxis(array, 0, -1))[None] for name, array in maps.yields.items()},
        is_safe_in=np.asarray(maps.is_safe_in.all(axis=1, keepdims=True)),
        safety=() if least is None else tuple(np.take_along_axis(part, least, axis=0) for part in maps.safety),
        over_all=True,
    )


def _map(maps: Classes, number: int) -> Answer:
    """The numbers of one map: shares, connected safe regions, the largest first, the
    recommended point and the fastest one."""
    x, y, state, connected = maps.values(maps.x), maps.values(maps.y), maps.state[number], []
    for cells, (top, bottom, left, right) in regions(state == SAFE):
        area: Answer = {"points": cells, "share": cells / state.size, maps.x: [float(x[left]), float(x[right])]}
        if maps.y:
            area[maps.y] = [float(y[top]), float(y[bottom])]
        else:
            area["sides"] = _limits(maps, (number, 0, left), 2)
        connected.append(area)
    is_here = (np.arange(len(maps.state)) == number)[:, None, None]
    fastest = _best(maps, (maps.state == SAFE) & is_here)
    return {
        **_counts(state),
        "regions": connected,
        "recommended": _recommended(maps, number),
        "fastest": None if fastest is None else {**_at(maps, fastest, (maps.x, maps.y)), **_yields(maps, fastest)},
    }


def _best(maps: Classes, allowed: Array) -> Cell | None:
    """The cell with the greatest rate of penetration among those ``allowed``
    [third, y, x]; None where no rate is known."""
    rate = maps.yields.get(YIELDS[0])
    if rate is None or not np.any(allowed & np.isfinite(rate)):
        return None
    return _cell(np.where(allowed & np.isfinite(rate), rate, -np.inf))


def _cell(values: Array) -> Cell:
    """The first cell with the greatest of ``values`` [third, y, x]."""
    third, y, x = (int(place) for place in np.unravel_index(np.argmax(values), values.shape))
    return third, y, x


def _at(maps: Classes, cell: Cell, axes: tuple[str | None, ...]) -> dict[str, float]:
    """The values of some axes at a cell."""
    places = dict(zip((maps.third, maps.y, maps.x), cell, strict=True))
    return {axis: float(maps.values(axis)[places[axis]]) for axis in axes if axis}


def _yields(maps: Classes, cell: Cell) -> dict[str, float]:
    """The yields of a cell that are known."""
    return {name: float(array[cell]) for name, array in maps.yields.items() if np.isfinite(array[cell])}


def _safety(maps: Classes, cell: Cell) -> dict[str, float]:
    """The probability of a safe run in a cell, and its interval."""
    names = ("probability", "probability_low", "probability_high")
    return {name: float(part[cell]) for name, part in zip(names, maps.safety, strict=False)}


def _everything(maps: Classes, cell: Cell) -> dict[str, float]:
    """Where a cell is, its safety and its yields."""
    return {**_at(maps, cell, (maps.third, maps.y, maps.x)), **_safety(maps, cell), **_yields(maps, cell)}


def _recommended(maps: Classes, number: int) -> Answer | None:
    """The safe point with the largest margin; None where no point is safe."""
    best = largest_margin(maps.state[number] == SAFE, maps.values(maps.y), maps.values(maps.x))
    if best is None:
        return None
    cell = (number, *best[:2])
    return {
        **_at(maps, cell, (maps.x, maps.y)),
        **_safety(maps, cell),
        **_yields(maps, cell),
        "margin": best[2],
        "margins": {axis: _limits(maps, cell, place) for axis, place in ((maps.x, 2), (maps.y, 1)) if axis},
        "settled": not maps.unsettled[cell],
    }


def _most_probable(maps: Classes) -> Answer | None:
    """The point with the greatest probability of a safe run; of several the one with
    the greatest rate of penetration, or the first where no rate is known."""
    if not maps.safety:
        return None
    is_best = maps.safety[0] >= np.max(maps.safety[0])
    cell = _best(maps, is_best) or _cell(is_best)
    return {**_everything(maps, cell), "ties": int(is_best.sum()) - 1}


def _confidence_costs(maps: Classes) -> list[Answer]:
    """What a confidence costs: for each of several the number of safe points, over all
    maps, and the fastest of these."""
    rows = []
    for level in sorted({*LEVELS, maps.confidence}) if maps.confidence is not None else ():
        is_safe = maps.safety[0] >= level - 1e-9
        fastest = _best(maps, is_safe)
        row: Answer = {"confidence": level, "safe": int(is_safe.sum()), "share": float(is_safe.mean())}
        rows.append(row | {"fastest": None if fastest is None else _everything(maps, fastest)})
    return rows


def _by_procedure(results: Results, severity: int | None, confidence: float | None) -> list[Answer]:
    """The window of each procedure by itself, for results with samples."""
    windows = []
    for number, name in enumerate(results.coords["procedure"]) if confidence is not None else ():
        maps = classes(one_procedure(results, number), severity, confidence)
        windows.append({"procedure": text(name), **(_map(maps, 0) if maps.third is None else _counts(maps.state))})
    return windows


def _limits(maps: Classes, start: Cell, place: int) -> Answer:
    """How far one axis, that at this ``place`` of a cell, may change to either side of
    ``start``, with the others fixed: to the last safe point, and what lies behind it."""
    values, sides = maps.values((maps.third, maps.y, maps.x)[place]), {}

    def cell(index: int) -> Cell:
        third, y, x = (index if axis == place else at for axis, at in enumerate(start))
        return third, y, x

    for side, step in (("less", -1), ("more", 1)):
        last = start[place]
        while 0 <= last + step < len(values) and maps.state[cell(last + step)] == SAFE:
            last += step
        beyond: Answer = {"first_not_safe": None, "why": "edge", "responses": [], "safe_in": [], "reason": None}
        if 0 <= last + step < len(values):
            beyond = {"first_not_safe": float(values[last + step]), **_hindrance(maps, start, cell(last + step))}
        margin = abs(float(values[last] - values[start[place]]))
        sides[side] = {"margin": margin, "safe_to": float(values[last]), **beyond}
    return sides


def _hindrance(maps: Classes, inside: Cell, cell: Cell) -> Answer:
    """Why a cell is not safe, while the one ``inside`` is."""
    bits, why = int(maps.bits[cell]), STATES[int(maps.state[cell])]
    if why == "unknown" and maps.failed[cell]:
        why = "failed"
    elif bits == 0 and maps.distrusted[cell]:
        why = "distrusted"
    return {
        "why": why,
        "responses": response_text(bits).split("+") if bits else [],
        "safe_in": [name for name, safe in zip(maps.procedures, maps.is_safe_in, strict=True) if safe[cell]],
        "reason": reason(maps, inside, cell),
    }


def _over_depth(maps: Classes) -> Answer | None:
    """How the window changes with depth, downwards: the counts at each depth, and the
    spans of depth in which it is open. None where depth is not swept."""
    if "depth" not in maps.results.swept:
        return None
    levels = np.moveaxis(maps.state, (maps.third, maps.y, maps.x).index("depth"), 0)
    depths = maps.values("depth").tolist()
    rows = [{"depth": depth, **_counts(level)} for depth, level in zip(depths, levels, strict=True)]
    spans = stretches(np.array([row["safe"] > 0 for row in rows]))
    is_closed_below = bool(spans) and spans[0][1] + 1 < len(depths)
    return {
        "open": [[depths[first], depths[last]] for first, last in spans],
        "closes": depths[spans[0][1] + 1] if is_closed_below else None,
        "reopens": depths[spans[1][0]] if len(spans) > 1 else None,
        "rows": rows,
    }
