"""The safe window: the operating points that are safe whatever the history, and the
best of them.

A *history* is a procedure (and, in an ensemble, a start): one way of having come to an
operating point. A point is *safe* where every history in the file ended well without a
critical response, *history-dependent* (the key ``rim``) where only some did, *critical*
where none did, and *unknown* where a run failed or is missing and the others leave open
which of these it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nsdrill.analysis.hysteresis import words
from nsdrill.analysis.outcome import known, text
from nsdrill.analysis.plane import largest_margin, regions
from nsdrill.analysis.probability import (
    chances,
    check_samples,
    effective_number,
    independent,
    judged,
    one_procedure,
    window_state,
)
from nsdrill.data import Array, Results, overrides
from nsdrill.errors import InputError
from nsdrill.models.leaves import in_words, words_along
from nsdrill.variables import BIT_BOUNCE, SAMPLE, STICK_SLIP, WHIRL

# the first of these that is swept lies across, the next one up
ACROSS = ("rotary_speed", "wob", "depth")
SAFE, HISTORY_DEPENDENT, CRITICAL, UNKNOWN = 2, 1, 0, -1
STATES = {SAFE: "safe", HISTORY_DEPENDENT: "rim", CRITICAL: "critical", UNKNOWN: "unknown"}
USUAL_CONFIDENCE = 0.9
LEVELS = (0.5, 0.8, 0.9, 0.95, 0.99)  # at which the price of a confidence is told


@dataclass(frozen=True)
class Classes:
    """A sweep as maps: ``state`` [third, y, x] is SAFE, HISTORY_DEPENDENT, CRITICAL or
    UNKNOWN.

    ``bits`` are the responses that occur in any history; ``failed`` and ``distrusted``
    say whether any history (or the check of one that was safe) failed or has not run,
    or is not to be trusted; ``failed_runs`` how many there are of the first;
    ``safe_in`` how many points are safe in each procedure by itself. ``yields``
    [third, y, x] is what the points yield (:data:`YIELDS`), the mean of their histories
    and samples, NaN where none has run; of old files there is none. Where there is a
    ``confidence``, ``safety`` has the probability of a safe run and the ends of its 95
    % interval. ``y`` and ``third`` are None where no such axis is swept; their length
    is then 1.
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
    confidence: float | None = None
    safety: tuple[Array, ...] = ()

    def values(self, axis: str | None) -> Array:
        """The values of an axis; a single zero for one that is not there."""
        return np.zeros(1) if axis is None else np.asarray(self.results.coords[axis], dtype=float)


# told of a point where the file has them
YIELDS = ("rate_of_penetration", "mechanical_specific_energy")


def axes_of(results: Results) -> tuple[str, str | None, str | None] | None:
    """The axes of the maps: x, y and the third one, of which each value has a map.
    Words have maps of their own, as between them there is nothing. None where the axes
    of the sweep are not such."""
    swept = [axis for axis in (*ACROSS, *results.axes[len(ACROSS) :]) if axis in results.swept]
    words = [axis for axis in swept if words_along(axis)]
    numbers = [axis for axis in swept if axis not in words]
    if len(swept) > 3 or not numbers or len(words) > 1:
        return None
    third = words[0] if words else numbers[2] if len(numbers) == 3 else None
    return numbers[0], numbers[1] if len(numbers) > 1 else None, third


def classes(
    results: Results, severity: int | None = None, confidence: float | None = None
) -> Classes:
    """Safe, history-dependent or critical at every operating point. With ``severity`` a
    history is safe where none of the three severities exceeds it, whatever the response
    bits say.
    With ``confidence`` (0 to 1), of results with samples, a point is safe where the
    probability of a safe run reaches it, and critical where it does not.

    An inferred point has a response, but no severity: by severity it is not known.
    """
    axes = axes_of(results)
    if axes is None:
        if not results.swept:
            raise InputError(
                "window: found a single operating point; allowed: a sweep of at least one axis."
            )
        raise InputError(
            f"window: found the axes {', '.join(results.swept)}; allowed: a sweep of one to "
            f"three, among them words as "
            "one, beside one or two of numbers."
        )
    runs = judged(results, severity)
    x, y, third = axes

    def planes(array: Array) -> Array:
        """[third, y, x, history]: the axes not swept have length one and go first,
        together with a third one."""
        axes = results.axes
        order = [axis for axis in axes if axis not in (x, y)] + [axis for axis in (y, x) if axis]
        moved = np.moveaxis(array, 0, len(axes))
        moved = moved.transpose(
            *(axes.index(axis) for axis in order), *range(len(axes), array.ndim)
        )
        lengths = [len(results.coords[axis]) if axis else 1 for axis in (third, y, x)]
        return moved.reshape(*lengths, -1)

    if confidence is not None:
        return _confident(results, severity, confidence, (x, y, third), planes)
    each = runs.safe
    safe, some, none = planes(each), planes(each).any(axis=-1), planes(runs.bad).any(axis=-1)
    state = np.where(
        planes(each | runs.bad).all(axis=-1) | (some & none),
        np.where(none, np.where(some, HISTORY_DEPENDENT, CRITICAL), SAFE),
        UNKNOWN,
    )
    bits = np.bitwise_or.reduce(
        planes(np.where(known(results["status"]), results["response"], 0).astype(int)), axis=-1
    )
    safe_in = {
        text(name): int(np.count_nonzero(one.all(axis=tuple(range(len(results.axes), one.ndim)))))
        for name, one in zip(results.coords["procedure"], each, strict=True)
    }
    yields = {name: _mean(planes(results[name])) for name in YIELDS if name in results.variables}
    return Classes(
        results,
        x,
        y,
        third,
        state,
        bits,
        np.asarray(planes(runs.failed).any(axis=-1)),
        np.asarray(planes(runs.distrusted).any(axis=-1)),
        safe.shape[-1],
        int(np.count_nonzero(runs.failed)),
        safe_in,
        yields,
    )


def _confident(
    results: Results,
    severity: int | None,
    confidence: float,
    swept: tuple[str, str | None, str | None],
    planes: Callable[[Array], Array],
) -> Classes:
    """The classes where a point is safe if the probability of a safe run reaches
    ``confidence``. ``bits`` are the responses without which it might be: those that
    occur in a third or more of the samples that are too many."""
    x, y, third = swept
    runs, chance = judged(results, severity), chances(results, severity)
    inside, unsure = window_state(chance, confidence)

    def placed(array: Array) -> Array:
        return planes(array[None])[..., 0]

    often = chance.share[-1, 1:] >= (1.0 - confidence) / 3
    bits = sum(placed(one).astype(int) << number for number, one in enumerate(often))
    state = np.where(inside, SAFE, np.where(unsure, UNKNOWN, CRITICAL))
    return Classes(
        results,
        x,
        y,
        third,
        placed(state),
        np.asarray(bits),
        np.asarray(planes(runs.failed).any(axis=-1)),
        np.asarray(planes(runs.distrusted).any(axis=-1)),
        len(results.coords["procedure"]),
        int(np.count_nonzero(runs.failed)),
        {
            name: int(np.count_nonzero(window_state(chance, confidence, name)[0]))
            for name in chance.histories[:-1]
        }
        or {chance.histories[0]: int(np.count_nonzero(inside))},
        {name: _mean(planes(results[name])) for name in YIELDS if name in results.variables},
        confidence,
        tuple(placed(part) for part in chance.of("safe")),
    )


def _mean(values: Array) -> Array:
    """The mean over the last axis of what is finite; NaN where nothing is."""
    there = np.isfinite(values)
    count = there.sum(axis=-1)
    total = np.where(there, values, 0.0).sum(axis=-1)
    return np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)


def find_window(
    results: Results, severity: int | None = None, confidence: float | None = None
) -> dict[str, Any]:
    """The safe window of a sweep with ascending axes, as plain data in SI units. See
    the page on the window. Of results with samples it is that of a ``confidence``, 0.9
    where none is given. InputError for one of results without."""
    if SAMPLE in results.coords:
        confidence = USUAL_CONFIDENCE if confidence is None else confidence
    elif confidence is not None:
        check_samples(results, "--confidence")
    found = classes(results, severity, confidence)
    axes = [axis for axis in (found.x, found.y) if axis]
    names = words(BIT_BOUNCE | STICK_SLIP | WHIRL).split("+")
    note: dict[str, Any] = {
        "kind": "window",
        "title": str(results.attrs.get("title") or ""),
        "overrides": overrides(results.attrs, thresholds=True),
        "procedures": [text(name) for name in results.coords["procedure"]],
        "histories": found.histories,
        "history_examined": found.histories > 1,
        "severity": severity,
        "axes": axes,
        "third": found.third,
        "fixed": results.held,
        "runs": int(results["status"].size),
        "failed_runs": found.failed_runs,
        "failed_points": int(np.count_nonzero(found.failed)),
        "distrusted_points": int(np.count_nonzero(found.distrusted)),
        **_counts(found.state),
        "unknown_failed": int(np.count_nonzero((found.state == UNKNOWN) & found.failed)),
        "safe_in": found.safe_in,
        "obstacles": {
            name: int(np.count_nonzero(found.bits >> number & 1))
            for number, name in enumerate(names)
        },
        "confidence": confidence,
        "samples": len(results.coords.get(SAMPLE, ())) or None,
        "counted": len(results.coords[SAMPLE][independent(results)])
        if SAMPLE in results.coords
        else None,
        "effective": effective_number(results, independent(results))
        if SAMPLE in results.coords
        else None,
        "most_probable": _most_probable(found),
        "price": _price(found),
        "alone": _alone(results, severity, confidence) if found.histories > 1 else [],
        "maps": [],
        "throughout": None,
        "depth": _over_depth(found),
    }
    thirds = found.values(found.third)
    for number, state in enumerate(found.state):
        at = {found.third: float(thirds[number])} if found.third else {}
        note["maps"].append({"at": at, **_map(found, state, number)})
    if found.third:
        everywhere = np.where(
            (found.state == CRITICAL).any(axis=0), CRITICAL, found.state.min(axis=0)
        )
        note["throughout"] = _map(found, everywhere, None)
    told: dict[str, Any] = in_words(note)
    return told


def unknown_words(note: dict[str, Any]) -> str:
    """Why the unknown points of a note are so: ``3 failed``, ``3 failed, 12 inferred,
    without a severity``."""
    failed = note["unknown_failed"]
    rest = note["unknown"] - failed
    return ", ".join(
        [f"{failed} failed"] * bool(failed) + [f"{rest} inferred, without a severity"] * bool(rest)
    )


def _counts(state: Array) -> dict[str, Any]:
    counts = {word: int(np.count_nonzero(state == value)) for value, word in STATES.items()}
    return {
        "points": int(state.size),
        **counts,
        "share": {word: n / state.size for word, n in counts.items()},
    }


def _map(found: Classes, state: Array, number: int | None) -> dict[str, Any]:
    """One map [y, x]: shares, connected safe regions, the largest first, and the
    recommended point."""
    x, y = found.values(found.x), found.values(found.y)
    areas = []
    for cells, (top, bottom, left, right) in regions(state == SAFE):
        area: dict[str, Any] = {
            "points": cells,
            "share": cells / state.size,
            found.x: [float(x[left]), float(x[right])],
        }
        if found.y:
            area[found.y] = [float(y[top]), float(y[bottom])]
        areas.append(area)
    best = _recommended(found, state, number)
    return {
        **_counts(state),
        "regions": areas,
        "recommended": best,
        "fastest": _fastest(found, state, number),
    }


def _yields(found: Classes, number: int | None, cell: tuple[int, int]) -> dict[str, float]:
    """What a point yields; over all values of the third axis, ``number`` None, the mean
    of them."""
    all_ = {
        name: _mean(array[:, *cell]) if number is None else array[number, *cell]
        for name, array in found.yields.items()
    }
    return {name: float(value) for name, value in all_.items() if np.isfinite(value)}


def _fastest(found: Classes, state: Array, number: int | None) -> dict[str, Any] | None:
    """The safe point with the greatest rate of penetration, whatever room it has; None
    where no rate is known."""
    name = YIELDS[0]
    if name not in found.yields:
        return None
    rate = (
        _mean(np.moveaxis(found.yields[name], 0, -1))
        if number is None
        else found.yields[name][number]
    )
    rate = np.where((state == SAFE) & np.isfinite(rate), rate, -1.0)
    row, column = (int(place) for place in np.unravel_index(np.argmax(rate), rate.shape))
    if rate[row, column] < 0.0:
        return None
    point = {found.x: float(found.values(found.x)[column])}
    if found.y:
        point[found.y] = float(found.values(found.y)[row])
    return {**point, **_yields(found, number, (row, column))}


def _recommended(found: Classes, state: Array, number: int | None) -> dict[str, Any] | None:
    best = largest_margin(state == SAFE, found.values(found.y), found.values(found.x))
    if best is None:
        return None
    row, column, margin = best
    x, y = found.values(found.x), found.values(found.y)
    point: dict[str, Any] = {found.x: float(x[column])}
    limits = {found.x: _limits(found, state, number, x, column, lambda place: (row, place))}
    if found.y:
        point[found.y] = float(y[row])
        limits[found.y] = _limits(found, state, number, y, row, lambda place: (place, column))
    return {
        **point,
        **_safety(found, number, (row, column)),
        **_yields(found, number, (row, column)),
        "margin": margin,
        "margins": limits,
    }


def _safety(found: Classes, number: int | None, cell: tuple[int, int]) -> dict[str, Any]:
    """The probability of a safe run at a cell, and its interval; of all maps the
    least."""
    if not found.safety:
        return {}
    values = [part[(slice(None) if number is None else number, *cell)] for part in found.safety]
    least = int(np.argmin(np.atleast_1d(values[0])))
    probability, low, high = (float(np.atleast_1d(one)[least]) for one in values)
    return {"probability": probability, "probability_low": low, "probability_high": high}


def _most_probable(found: Classes) -> dict[str, Any] | None:
    """The point at which a run is safe with the greatest probability; of several the
    one that drills fastest, the first where the file does not tell."""
    if not found.safety:
        return None
    best = found.safety[0] >= np.max(found.safety[0])
    rate = found.yields.get(YIELDS[0], np.zeros(best.shape))
    order = np.where(best, np.where(np.isfinite(rate), rate, -1.0), -2.0)
    place = np.unravel_index(int(np.argmax(order)), found.state.shape)
    axes = dict(zip((found.third, found.y, found.x), place, strict=True))
    at = {axis: float(found.values(axis)[i]) for axis, i in axes.items() if axis}
    cell = (int(place[1]), int(place[2]))
    return {
        **at,
        **_safety(found, int(place[0]), cell),
        **_yields(found, int(place[0]), cell),
        "ties": int(best.sum()) - 1,
    }


def _price(found: Classes) -> list[dict[str, Any]]:
    """What a confidence costs: at several of them how many points are safe, over all
    maps, and the fastest of these."""
    if found.confidence is None:
        return []
    probability, rate, rows = found.safety[0], found.yields.get(YIELDS[0]), []
    for level in sorted({*LEVELS, found.confidence}):
        inside = probability >= level - 1e-9
        row: dict[str, Any] = {
            "confidence": level,
            "safe": int(inside.sum()),
            "share": float(inside.mean()),
        }
        row["fastest"] = None
        if rate is not None and np.any(inside & np.isfinite(rate)):
            best = np.unravel_index(
                np.argmax(np.where(inside & np.isfinite(rate), rate, -np.inf)), rate.shape
            )
            place = tuple(int(i) for i in best)
            axes = dict(zip((found.third, found.y, found.x), place, strict=True))
            at = {axis: float(found.values(axis)[i]) for axis, i in axes.items() if axis}
            cell = (place[1], place[2])
            row["fastest"] = {
                **at,
                **_safety(found, place[0], cell),
                **_yields(found, place[0], cell),
            }
        rows.append(row)
    return rows


def _alone(
    results: Results, severity: int | None, confidence: float | None
) -> list[dict[str, Any]]:
    """The window of each procedure by itself, for results with samples."""
    if confidence is None:
        return []
    found = []
    for number, name in enumerate(results.coords["procedure"]):
        one = classes(one_procedure(results, number), severity, confidence)
        whole = _map(one, one.state[0], 0) if one.third is None else _counts(one.state)
        found.append({"procedure": text(name), **whole})
    return found


def _limits(
    found: Classes, state: Array, number: int | None, values: Array, here: int, at: Any
) -> dict[str, Any]:
    """How far one axis may go each way, the other held: to the last safe point, and
    what stands behind it."""
    sides = {}
    for side, step in (("less", -1), ("more", 1)):
        place = here
        while 0 <= place + step < len(values) and state[at(place + step)] == SAFE:
            place += step
        beyond = place + step
        entry: dict[str, Any] = {
            "margin": abs(float(values[place] - values[here])),
            "safe_to": float(values[place]),
            "first_not_safe": None,
            "why": "edge",
            "responses": [],
        }
        if 0 <= beyond < len(values):
            cell = at(beyond)
            behind = (slice(None) if number is None else number, *cell)
            bits = int(np.bitwise_or.reduce(np.atleast_1d(found.bits[behind])))
            why = STATES[int(state[cell])]
            if why == "unknown" and np.any(found.failed[behind]):
                why = "failed"
            elif bits == 0 and np.any(
                found.distrusted[behind]
            ):  # no response: say what else is the matter
                why = "distrusted"
            entry |= {
                "first_not_safe": float(values[beyond]),
                "why": why,
                "responses": [] if bits == 0 else words(bits).split("+"),
            }
        sides[side] = entry
    return sides


def _over_depth(found: Classes) -> dict[str, Any] | None:
    """How the window changes with depth, going down: the counts at each depth, and
    where it is open."""
    if "depth" not in found.results.swept:
        return None
    axis = (found.third, found.y, found.x).index("depth")
    levels = np.moveaxis(found.state, axis, 0)
    depths = found.values("depth")
    rows = [
        {"depth": float(depth), **_counts(level)}
        for depth, level in zip(depths, levels, strict=True)
    ]
    is_open = [row["safe"] > 0 for row in rows]
    spans: list[list[float]] = []
    for number, (row, now) in enumerate(zip(rows, is_open, strict=True)):
        if now and (number == 0 or not is_open[number - 1]):
            spans.append([row["depth"], row["depth"]])
        elif now:
            spans[-1][1] = row["depth"]
    closes = next(
        (
            row["depth"]
            for row, now in zip(rows, is_open, strict=True)
            if not now and spans and row["depth"] > spans[0][0]
        ),
        None,
    )
    return {
        "open": spans,
        "closes": closes,
        "reopens": spans[1][0] if len(spans) > 1 else None,
        "rows": rows,
    }
