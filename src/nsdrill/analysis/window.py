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
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.analysis.hysteresis import response_text
from nsdrill.analysis.outcome import known, text
from nsdrill.analysis.plane import largest_margin, regions
from nsdrill.analysis.probability import (
    check_samples,
    effective_number,
    independent,
    one_procedure,
    probabilities_of,
    run_safety,
    window_state,
)
from nsdrill.analysis.reasons import reason
from nsdrill.data import PASSED_OVER, Array, Results, overrides
from nsdrill.errors import InputError
from nsdrill.models.leaves import in_words, words_along
from nsdrill.variables import BIT_BOUNCE, OK, PENDING, SAMPLE, STICK_SLIP, WHIRL

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

    ``histories`` and ``failed_runs`` are the numbers of histories and of failed runs,
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


def classes(results: Results, severity: int | None = None, confidence: float | None = None) -> Classes:
    """The state of every operating point. With ``severity`` a history is safe where
    none of the three severities exceeds it, whatever the response bits are. With
    ``confidence`` (0 to 1), for results with samples, a point is safe where the
    probability of a safe run reaches it, and critical where it does not. InputError
    where the axes do not make maps.

    An inferred point has a response but no severity: by severity it is unknown.
    """
    axes = axes_of(results)
    if axes is None:
        if not results.swept:
            raise InputError("window: found a single operating point; allowed: a sweep of at least one axis.")
        raise InputError(
            f"window: found the axes {', '.join(results.swept)}; allowed: a sweep of one to "
            f"three, among them words as "
            "one, beside one or two of numbers."
        )
    runs = run_safety(results, severity)
    x, y, third = axes

    def planes(array: Array) -> Array:
        """``array`` as [third, y, x, history]. Axes that are not swept have length 1;
        they are merged with the third one."""
        axes = results.axes
        order = [axis for axis in axes if axis not in (x, y)] + [axis for axis in (y, x) if axis]
        transposed = np.moveaxis(array, 0, len(axes))
        transposed = transposed.transpose(*(axes.index(axis) for axis in order), *range(len(axes), array.ndim))
        lengths = [len(results.coords[axis]) if axis else 1 for axis in (third, y, x)]
        return transposed.reshape(*lengths, -1)

    if confidence is not None:
        return _classes_by_confidence(results, severity, confidence, (x, y, third), planes)
    safe = runs.safe

    def of_each(array: Array) -> list[Array]:
        """The planes of each procedure."""
        return [planes(part[None]) for part in array]

    safe_maps, any_safe, any_unsafe = (planes(safe), planes(safe).any(axis=-1), planes(runs.unsafe).any(axis=-1))
    state = np.where(
        planes(safe | runs.unsafe).all(axis=-1) | (any_safe & any_unsafe),
        np.where(any_unsafe, np.where(any_safe, HISTORY_DEPENDENT, CRITICAL), SAFE),
        UNKNOWN,
    )
    all_bits = np.where(known(results["status"]), results["response"], 0).astype(int)
    bits_in = np.array([np.bitwise_or.reduce(part, axis=-1) for part in of_each(all_bits)])
    safe_in = {
        text(name): int(np.count_nonzero(procedure_safe.all(axis=tuple(range(len(results.axes), procedure_safe.ndim)))))
        for name, procedure_safe in zip(results.coords["procedure"], safe, strict=True)
    }
    yields = {name: _mean(planes(results[name])) for name in YIELDS if name in results.variables}
    return Classes(
        results,
        x,
        y,
        third,
        state,
        np.bitwise_or.reduce(bits_in, axis=0),
        np.asarray(planes(runs.failed).any(axis=-1)),
        np.asarray(planes(runs.distrusted).any(axis=-1)),
        safe_maps.shape[-1],
        int(np.count_nonzero(runs.failed)),
        safe_in,
        yields,
        bits_in,
        np.array([part.all(axis=-1) for part in of_each(safe)]),
        np.asarray(planes(_unsettled(results)).any(axis=-1)),
    )


def _unsettled(results: Results) -> Array:
    """Whether each run was finished and did not settle; nowhere in a file that does not
    say."""
    if "settled" not in results.variables:
        return np.zeros(results["status"].shape, dtype=bool)
    return np.asarray((results["status"] == OK) & (results["settled"] == 0))


def _classes_by_confidence(
    results: Results,
    severity: int | None,
    confidence: float,
    swept: tuple[str, str | None, str | None],
    planes: Callable[[Array], Array],
) -> Classes:
    """The classes where a point is safe if the probability of a safe run reaches
    ``confidence``. ``bits`` are the responses that may prevent that: those with a
    probability of at least a third of 1 less ``confidence``."""
    x, y, third = swept
    runs, probabilities = run_safety(results, severity), probabilities_of(results, severity)
    is_safe, is_undecided = window_state(probabilities, confidence)

    def placed(array: Array) -> Array:
        return planes(array[None])[..., 0]

    def bits_of(share: Array) -> Array:
        occurs = share >= (1.0 - confidence) / 3
        return np.asarray(sum(placed(response).astype(int) << number for number, response in enumerate(occurs)))

    procedures = range(len(results.coords["procedure"]))
    state = np.where(is_safe, SAFE, np.where(is_undecided, UNKNOWN, CRITICAL))
    return Classes(
        results,
        x,
        y,
        third,
        placed(state),
        bits_of(probabilities.share[-1, 1:]),
        np.asarray(planes(runs.failed).any(axis=-1)),
        np.asarray(planes(runs.distrusted).any(axis=-1)),
        len(results.coords["procedure"]),
        int(np.count_nonzero(runs.failed)),
        {
            name: int(np.count_nonzero(window_state(probabilities, confidence, name)[0]))
            for name in probabilities.histories[:-1]
        }
        or {probabilities.histories[0]: int(np.count_nonzero(is_safe))},
        {name: _mean(planes(results[name])) for name in YIELDS if name in results.variables},
        np.array([bits_of(probabilities.share[number, 1:]) for number in procedures]),
        np.array(
            [
                placed(window_state(probabilities, confidence, name)[0])
                for name in probabilities.histories[: len(procedures)]
            ]
        ),
        np.asarray(planes(_unsettled(results)).mean(axis=-1) > 1.0 - confidence + 1e-9),
        confidence,
        tuple(placed(part) for part in probabilities.of("safe")),
    )


def _mean(values: Array) -> Array:
    """The mean of the finite values over the last axis; NaN where there are none."""
    finite = np.isfinite(values)
    count = finite.sum(axis=-1)
    total = np.where(finite, values, 0.0).sum(axis=-1)
    return np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)


def find_window(results: Results, severity: int | None = None, confidence: float | None = None) -> dict[str, Any]:
    """The operating window of a sweep with ascending axes, as plain data in SI units; its
    keys are described on the page on the window. For results with samples the window
    has a ``confidence``, by default 0.9; InputError for a ``confidence`` without
    samples."""
    confidence = usual_confidence(results, confidence)
    maps = classes(results, severity, confidence)
    axes = [axis for axis in (maps.x, maps.y) if axis]
    names = response_text(BIT_BOUNCE | STICK_SLIP | WHIRL).split("+")
    summary: dict[str, Any] = {
        "kind": "window",
        "title": str(results.attrs.get("title") or ""),
        "overrides": overrides(results.attrs, thresholds=True),
        "procedures": [text(name) for name in results.coords["procedure"]],
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
        **_counts(maps.state),
        "unknown_failed": int(np.count_nonzero((maps.state == UNKNOWN) & maps.failed)),
        "safe_in": maps.safe_in,
        "obstacles": {name: int(np.count_nonzero(maps.bits >> number & 1)) for number, name in enumerate(names)},
        "confidence": confidence,
        "samples": len(results.coords.get(SAMPLE, ())) or None,
        "counted": len(results.coords[SAMPLE][independent(results)]) if SAMPLE in results.coords else None,
        "effective": effective_number(results, independent(results)) if SAMPLE in results.coords else None,
        "most_probable": _most_probable(maps),
        "price": _confidence_costs(maps),
        "alone": _by_procedure(results, severity, confidence) if maps.histories > 1 else [],
        "maps": [],
        "throughout": None,
        "depth": _over_depth(maps),
    }
    thirds = maps.values(maps.third)
    for number, state in enumerate(maps.state):
        at = {maps.third: float(thirds[number])} if maps.third else {}
        summary["maps"].append({"at": at, **_map(maps, state, number)})
    if maps.third:
        throughout = np.where((maps.state == CRITICAL).any(axis=0), CRITICAL, maps.state.min(axis=0))
        summary["throughout"] = _map(maps, throughout, None)
    worded: dict[str, Any] = in_words(summary)
    return worded


def usual_confidence(results: Results, confidence: float | None) -> float | None:
    """The confidence of a window: for results with samples by default 0.9; InputError
    for one without samples."""
    if SAMPLE in results.coords:
        return USUAL_CONFIDENCE if confidence is None else confidence
    if confidence is not None:
        check_samples(results, "--confidence")
    return None


def unknown_words(summary: dict[str, Any]) -> str:
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


def _counts(state: Array) -> dict[str, Any]:
    counts = {word: int(np.count_nonzero(state == value)) for value, word in STATES.items()}
    return {"points": int(state.size), **counts, "share": {word: n / state.size for word, n in counts.items()}}


def _map(maps: Classes, state: Array, number: int | None) -> dict[str, Any]:
    """The numbers of one map [y, x]: shares, connected safe regions, the largest first,
    the recommended point and the fastest one."""
    x, y = maps.values(maps.x), maps.values(maps.y)
    connected = []
    for cells, (top, bottom, left, right) in regions(state == SAFE):
        area: dict[str, Any] = {"points": cells, "share": cells / state.size, maps.x: [float(x[left]), float(x[right])]}
        if maps.y:
            area[maps.y] = [float(y[top]), float(y[bottom])]
        else:
            area["sides"] = _limits(maps, state, number, x, left, lambda index: (0, index))
        connected.append(area)
    best = _recommended(maps, state, number)
    return {**_counts(state), "regions": connected, "recommended": best, "fastest": _fastest(maps, state, number)}


def _yields(maps: Classes, number: int | None, cell: tuple[int, int]) -> dict[str, float]:
    """The yields of a cell of the map ``number``; of None the mean over all maps."""
    yields = {
        name: _mean(array[:, *cell]) if number is None else array[number, *cell] for name, array in maps.yields.items()
    }
    return {name: float(value) for name, value in yields.items() if np.isfinite(value)}


def _fastest(maps: Classes, state: Array, number: int | None) -> dict[str, Any] | None:
    """The safe point with the greatest rate of penetration, whatever its margin; None
    where no rate is known."""
    name = YIELDS[0]
    if name not in maps.yields:
        return None
    rate = _mean(np.moveaxis(maps.yields[name], 0, -1)) if number is None else maps.yields[name][number]
    rate = np.where((state == SAFE) & np.isfinite(rate), rate, -1.0)
    row, column = (int(place) for place in np.unravel_index(np.argmax(rate), rate.shape))
    if rate[row, column] < 0.0:
        return None
    point = {maps.x: float(maps.values(maps.x)[column])}
    if maps.y:
        point[maps.y] = float(maps.values(maps.y)[row])
    return {**point, **_yields(maps, number, (row, column))}


def _recommended(maps: Classes, state: Array, number: int | None) -> dict[str, Any] | None:
    """The safe point with the largest margin; None where no point is safe."""
    best = largest_margin(state == SAFE, maps.values(maps.y), maps.values(maps.x))
    if best is None:
        return None
    row, column, margin = best
    x, y = maps.values(maps.x), maps.values(maps.y)
    point: dict[str, Any] = {maps.x: float(x[column])}
    margins = {maps.x: _limits(maps, state, number, x, column, lambda index: (row, index))}
    if maps.y:
        point[maps.y] = float(y[row])
        margins[maps.y] = _limits(maps, state, number, y, row, lambda index: (index, column))
    return {
        **point,
        **_safety(maps, number, (row, column)),
        **_yields(maps, number, (row, column)),
        "margin": margin,
        "margins": margins,
        "settled": not np.any(maps.unsettled[(slice(None) if number is None else number, row, column)]),
    }


def _safety(maps: Classes, number: int | None, cell: tuple[int, int]) -> dict[str, Any]:
    """The probability of a safe run in a cell of the map ``number``, and its interval;
    of None the least over all maps."""
    if not maps.safety:
        return {}
    values = [part[(slice(None) if number is None else number, *cell)] for part in maps.safety]
    least = int(np.argmin(np.atleast_1d(values[0])))
    probability, low, high = (float(np.atleast_1d(part)[least]) for part in values)
    return {"probability": probability, "probability_low": low, "probability_high": high}


def _most_probable(maps: Classes) -> dict[str, Any] | None:
    """The point with the greatest probability of a safe run; of several the one with
    the greatest rate of penetration, or the first where no rate is known."""
    if not maps.safety:
        return None
    is_best = maps.safety[0] >= np.max(maps.safety[0])
    rate = maps.yields.get(YIELDS[0], np.zeros(is_best.shape))
    order = np.where(is_best, np.where(np.isfinite(rate), rate, -1.0), -2.0)
    index = np.unravel_index(int(np.argmax(order)), maps.state.shape)
    axes = dict(zip((maps.third, maps.y, maps.x), index, strict=True))
    at = {axis: float(maps.values(axis)[i]) for axis, i in axes.items() if axis}
    cell = (int(index[1]), int(index[2]))
    return {
        **at,
        **_safety(maps, int(index[0]), cell),
        **_yields(maps, int(index[0]), cell),
        "ties": int(is_best.sum()) - 1,
    }


def _confidence_costs(maps: Classes) -> list[dict[str, Any]]:
    """What a confidence costs: for each of several the number of safe points, over all
    maps, and the fastest of these."""
    if maps.confidence is None:
        return []
    probability, rate, rows = maps.safety[0], maps.yields.get(YIELDS[0]), []
    for level in sorted({*LEVELS, maps.confidence}):
        is_safe = probability >= level - 1e-9
        row: dict[str, Any] = {"confidence": level, "safe": int(is_safe.sum()), "share": float(is_safe.mean())}
        row["fastest"] = None
        if rate is not None and np.any(is_safe & np.isfinite(rate)):
            best = np.unravel_index(np.argmax(np.where(is_safe & np.isfinite(rate), rate, -np.inf)), rate.shape)
            index = tuple(int(i) for i in best)
            axes = dict(zip((maps.third, maps.y, maps.x), index, strict=True))
            at = {axis: float(maps.values(axis)[i]) for axis, i in axes.items() if axis}
            cell = (index[1], index[2])
            row["fastest"] = {**at, **_safety(maps, index[0], cell), **_yields(maps, index[0], cell)}
        rows.append(row)
    return rows


def _by_procedure(results: Results, severity: int | None, confidence: float | None) -> list[dict[str, Any]]:
    """The window of each procedure by itself, for results with samples."""
    if confidence is None:
        return []
    windows = []
    for number, name in enumerate(results.coords["procedure"]):
        maps = classes(one_procedure(results, number), severity, confidence)
        window = _map(maps, maps.state[0], 0) if maps.third is None else _counts(maps.state)
        windows.append({"procedure": text(name), **window})
    return windows


def _limits(maps: Classes, state: Array, number: int | None, values: Array, start: int, cell_at: Any) -> dict[str, Any]:
    """How far one axis may change to either side, with the other fixed: to the last
    safe point, and what lies behind it."""
    sides = {}
    for side, step in (("less", -1), ("more", 1)):
        last = start
        while 0 <= last + step < len(values) and state[cell_at(last + step)] == SAFE:
            last += step
        beyond = last + step
        entry: dict[str, Any] = {
            "margin": abs(float(values[last] - values[start])),
            "safe_to": float(values[last]),
            "first_not_safe": None,
            "why": "edge",
            "responses": [],
            "safe_in": [],
            "reason": None,
        }
        if 0 <= beyond < len(values):
            cell = cell_at(beyond)
            cells_behind = (slice(None) if number is None else number, *cell)
            bits = int(np.bitwise_or.reduce(np.atleast_1d(maps.bits[cells_behind])))
            why = STATES[int(state[cell])]
            if why == "unknown" and np.any(maps.failed[cells_behind]):
                why = "failed"
            elif bits == 0 and np.any(maps.distrusted[cells_behind]):
                why = "distrusted"
            entry |= {
                "first_not_safe": float(values[beyond]),
                "why": why,
                "responses": [] if bits == 0 else response_text(bits).split("+"),
                "safe_in": [
                    name
                    for name, is_safe in zip(maps.procedures, maps.is_safe_in, strict=True)
                    if np.all(is_safe[cells_behind])
                ],
                "reason": reason(maps, number, cell_at(start), cell),
            }
        sides[side] = entry
    return sides


def _over_depth(maps: Classes) -> dict[str, Any] | None:
    """How the window changes with depth, downwards: the counts at each depth, and the
    spans of depth in which it is open. None where depth is not swept."""
    if "depth" not in maps.results.swept:
        return None
    axis = (maps.third, maps.y, maps.x).index("depth")
    levels = np.moveaxis(maps.state, axis, 0)
    depths = maps.values("depth")
    rows = [{"depth": float(depth), **_counts(level)} for depth, level in zip(depths, levels, strict=True)]
    is_open = [row["safe"] > 0 for row in rows]
    spans: list[list[float]] = []
    for number, (row, open_here) in enumerate(zip(rows, is_open, strict=True)):
        if open_here and (number == 0 or not is_open[number - 1]):
            spans.append([row["depth"], row["depth"]])
        elif open_here:
            spans[-1][1] = row["depth"]
    closes = next(
        (
            row["depth"]
            for row, open_here in zip(rows, is_open, strict=True)
            if not open_here and spans and row["depth"] > spans[0][0]
        ),
        None,
    )
    return {"open": spans, "closes": closes, "reopens": spans[1][0] if len(spans) > 1 else None, "rows": rows}
