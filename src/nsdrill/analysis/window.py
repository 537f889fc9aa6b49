"""The operating window: the operating points that are safe whatever the history, the best
of them, and why a side of the window lies where it does, as far as the responses in the
file tell.

A motion that is there only on one way, or only at one of two neighbouring settings,
surprises: it follows from what the string met before it came to the point.
"""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

from nsdrill.analysis.advice import Kind, advise
from nsdrill.analysis.counts import after_failure, carried_axis
from nsdrill.analysis.graded import graded
from nsdrill.analysis.histories import Grade
from nsdrill.analysis.hysteresis import response_text
from nsdrill.analysis.maps import CRITICAL, HISTORY_DEPENDENT, SAFE, STATES, UNKNOWN, YIELDS, Classes, classes, regions
from nsdrill.analysis.planes import Cell, mean_known, stretches
from nsdrill.analysis.probability import (
    check_samples,
    counts_of,
    effective_number,
    independent,
    known,
    needed,
    one_procedure,
)
from nsdrill.analysis.room import Kind as Room
from nsdrill.analysis.room import choose
from nsdrill.data import ENDS_EARLY, LASTING_MOTIONS, Answer, Array, Results, overrides
from nsdrill.errors import option
from nsdrill.models.leaves import in_words
from nsdrill.models.responses import BIT_BOUNCE, RESPONSES, STALLED, STICK_SLIP, WHIRL
from nsdrill.variables import INFERRED, PENDING, SAMPLE

USUAL_CONFIDENCE = 0.9
LEAST = 3  # of the safety of a map: the share of samples that are known to be safe
MILD = (1, 2)  # severities that may be allowed where nothing is free of vibration
LEVELS = (0.5, 0.8, 0.9, 0.95, 0.99)  # of confidence whose costs are listed


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
                "answer": advise(maps.grades),
                "milder": _milder(results, severity, confidence, maps),
                "grades": _grades(maps),
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
    status, counts = results["status"], counts_of(results, severity)
    after = int(np.count_nonzero(after_failure(results) & known(status)))
    # an inferred point has no severity, and is told of by its class
    inferred = int(np.count_nonzero(status == INFERRED)) if severity is not None else 0
    others = counts["of"] - counts["known"] - counts["failed"] - counts["pending"]
    lasting = json.loads(results.attrs.get(LASTING_MOTIONS, "[]"))
    return {
        "procedures": list(results.procedures),
        "histories": maps.histories,
        "history_examined": maps.histories > 1,
        "severity": severity,
        "axes": axes,
        "third": maps.third,
        "fixed": results.held,
        "runs": int(results["status"].size),
        "failed_runs": maps.failed_runs,
        "after_failure": after,
        "undecided_runs": max(others - after - inferred, 0),
        **counts,
        "failed_points": int(np.count_nonzero(maps.failed)),
        "points_with_failed": int(np.count_nonzero(maps.counts.failed)),
        "distrusted_points": int(np.count_nonzero(maps.distrusted)),
        "pending_runs": int(np.count_nonzero(results["status"] == PENDING)),
        "unsettled_points": int(np.count_nonzero(maps.unsettled & (maps.state == SAFE))),
        "unsettled_in_all": int(np.count_nonzero(maps.unsettled)),
        "by_history": _by_history(maps),
        "ranges": {axis: [float(maps.values(axis)[end]) for end in (0, -1)] for axis in axes},
        "passed_over": [speed for speed in lasting if speed["from"] is not None],
        "lasting_motions": lasting,
        ENDS_EARLY: json.loads(results.attrs.get(ENDS_EARLY, "[]")),
    }


def _outcomes(maps: Classes) -> Answer:
    """What prevents that points are safe."""
    return {
        "unknown_failed": int(np.count_nonzero((maps.state == UNKNOWN) & maps.failed)),
        "safe_in": maps.safe_in,
        "obstacles": {one.name: int(np.count_nonzero(maps.bits & one.bit)) for one in RESPONSES.values()},
    }


def _milder(results: Results, severity: int | None, confidence: float | None, maps: Classes) -> Answer | None:
    """The least severity that allows a setting where no response is, and the setting;
    None where there is none, or where a setting is allowed without."""
    if severity is not None or maps.grades.allowed.any():
        return None
    for level in MILD if all(name in results.variables for name in needed(0)) else ():
        found = advise(graded(results, level, confidence))
        if found.kind not in (Kind.NOTHING, Kind.UNKNOWN):
            return {"severity": level, "answer": found}
    return None


def _grades(maps: Classes) -> dict[str, int]:
    """How many points have each grade."""
    found = {grade.words: int(np.count_nonzero(maps.grades.grade == grade)) for grade in Grade}
    return {words: number for words, number in found.items() if number}


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
    """Why points of a window's ``summary`` are unknown: ``3 failed``, ``3 failed or not
    carried``, ``3 failed, 12 inferred, without a severity``."""
    failed = summary["unknown_failed"]
    inferred = summary["unknown"] - failed
    chain = " or not carried" if summary["after_failure"] else ""
    return ", ".join(
        [f"{failed} failed{chain}"] * bool(failed) + [f"{inferred} inferred, without a severity"] * bool(inferred)
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

    least = np.argmin(maps.safety[LEAST], axis=0)[None] if maps.safety else None
    fewest = np.argmin(maps.counts.known, axis=0)[None]
    return replace(
        maps,
        third=None,
        state=np.where(at_any(maps.state == CRITICAL), CRITICAL, maps.state.min(axis=0)),
        bits=np.bitwise_or.reduce(maps.bits, axis=0, keepdims=True),
        failed=at_any(maps.failed),
        distrusted=at_any(maps.distrusted),
        unsettled=at_any(maps.unsettled),
        yields={name: mean_known(np.moveaxis(array, 0, -1))[None] for name, array in maps.yields.items()},
        is_safe_in=np.asarray(maps.is_safe_in.all(axis=1, keepdims=True)),
        is_known_in=np.asarray(maps.is_known_in.all(axis=1, keepdims=True)),
        safety=() if least is None else tuple(np.take_along_axis(part, least, axis=0) for part in maps.safety),
        counts=maps.counts.each(lambda part: np.take_along_axis(part, fewest, axis=0)),
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


def _safety(maps: Classes, cell: Cell) -> Answer:
    """The probability of a safe run in a cell, None where it is not known of any sample,
    its interval, and of how many samples it is known; nothing without samples."""
    if not maps.safety:
        return {}
    names = ("probability", "probability_low", "probability_high")
    found = {name: float(part[cell]) for name, part in zip(names, maps.safety, strict=False)}
    counts = maps.counts.at(cell)
    return {name: value if np.isfinite(value) else None for name, value in found.items()} | {"samples_of": counts}


def _everything(maps: Classes, cell: Cell) -> Answer:
    """Where a cell is, its safety and its yields."""
    return {**_at(maps, cell, (maps.third, maps.y, maps.x)), **_safety(maps, cell), **_yields(maps, cell)}


def _recommended(maps: Classes, number: int) -> Answer | None:
    """The setting of one map, or its best hint (:mod:`nsdrill.analysis.room`); None where no
    point is allowed."""
    y, x = ((axis, maps.values(axis)) for axis in (maps.y, maps.x))
    grades, rate = maps.grades, maps.yields.get(YIELDS[0])
    rates = np.full(maps.state[number].shape, np.nan) if rate is None else rate[number]
    place, how, _ = choose(grades.allowed[number], grades.better[number], y, (maps.x, x[1]), rates)
    if place is None:
        return None
    cell = (number, *place)
    return {
        **_at(maps, cell, (maps.x, maps.y)),
        **_safety(maps, cell),
        **_yields(maps, cell),
        "hint": how != Room.RUN,
        "margins": {axis: _limits(maps, cell, place) for axis, place in ((maps.x, 2), (maps.y, 1)) if axis},
        "settled": not maps.unsettled[cell],
    }


def _most_probable(maps: Classes) -> Answer | None:
    """The point at which most samples are known to be safe; of several the one with the
    greatest rate of penetration, or the first where no rate is known. None where no
    sample is safe at any point."""
    if not maps.safety or not (greatest := np.max(maps.safety[LEAST])):
        return None
    is_best = maps.safety[LEAST] >= greatest
    cell = _best(maps, is_best) or _cell(is_best)
    return {**_everything(maps, cell), "ties": int(is_best.sum()) - 1}


def _confidence_costs(maps: Classes) -> list[Answer]:
    """What a confidence costs: for each of several the number of safe points, over all
    maps, and the fastest of these."""
    rows = []
    for level in sorted({*LEVELS, maps.confidence}) if maps.confidence is not None else ():
        is_safe = maps.safety[LEAST] >= level - 1e-9
        fastest = _best(maps, is_safe)
        row: Answer = {"confidence": level, "safe": int(is_safe.sum()), "share": float(is_safe.mean())}
        rows.append(row | {"fastest": None if fastest is None else _everything(maps, fastest)})
    return rows


def _by_procedure(results: Results, severity: int | None, confidence: float | None) -> list[Answer]:
    """The window of each procedure by itself, for results with samples."""
    windows = []
    for number, name in enumerate(results.procedures) if confidence is not None else ():
        maps = classes(one_procedure(results, number), severity, confidence)
        windows.append({"procedure": name, **(_map(maps, 0) if maps.third is None else _counts(maps.state))})
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
        beyond: Answer = {"first_not_safe": None, **obstacle(maps, cell(last + step)), "safe_in": [], "reason": None}
        if beyond["why"] != "edge":
            beyond["first_not_safe"] = float(values[last + step])
            beyond["safe_in"] = [
                name
                for name, is_safe in zip(maps.results.procedures, maps.is_safe_in, strict=True)
                if is_safe[cell(last + step)]
            ]
            beyond["reason"] = reason(maps, start, cell(last + step))
        margin = abs(float(values[last] - values[start[place]]))
        sides[side] = {"margin": margin, "safe_to": float(values[last]), **beyond}
    return sides


def obstacle(maps: Classes, cell: Cell) -> Answer:
    """What prevents that a cell is safe: ``why``, and its ``responses``. A cell beyond
    the end of its row or column is at the edge."""
    if not all(0 <= place < length for place, length in zip(cell, maps.state.shape, strict=True)):
        return {"why": "edge", "responses": []}
    bits, why = int(maps.stops[cell]), STATES[int(maps.state[cell])]
    if why == "unknown" and maps.failed[cell]:
        why = "failed"
    elif bits == 0 and maps.distrusted[cell]:
        why = "distrusted"
    return {"why": why, "responses": response_text(bits).split("+") if bits else []}


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


# The reasons, by the names that they have in data.
PASSES_IN_STICK_SLIP = "passes_in_stick_slip"
STARTS_ON_WALL = "starts_on_wall"
STAYS_ON_WALL = "stays_on_wall"
BOUNCE_LASTS = "bounce_lasts"
STICKING_LASTS = "sticking_lasts"
STALL_LASTS = "stall_lasts"


def reason(maps: Classes, inside: Cell, beyond: Cell) -> Answer | None:
    """Why the point ``beyond`` the window is not safe, while ``inside`` is; None where
    its response needs no explanation, or where the file does not tell. Plain data:

    - ``code``: one of the names above;
    - ``procedure``: the way on which the motion is met;
    - ``axis``, ``value``: the setting at which it begins on that way, of
      ``starts_on_wall`` the first one of the sweep.
    """
    along = carried_axis(maps.results)
    if maps.over_all or maps.confidence is not None or along not in (maps.x, maps.y):
        return None
    values = maps.values(along)
    place = beyond[2] if along == maps.x else beyond[1]
    # the neighbour at another setting of the axis along which nothing is carried
    is_beside = beyond[1] != inside[1] if along == maps.x else beyond[2] != inside[2]
    safe_on = [bool(is_safe[beyond]) for is_safe in maps.is_safe_in]
    for procedure, bits, is_safe in zip(maps.results.procedures, maps.bits_in, safe_on, strict=True):
        if is_safe or procedure == "same":
            continue
        there, here = (_chain(bits, cell, along == maps.x) for cell in (beyond, inside))
        first, step = (len(values) - 1, -1) if procedure == "down" else (0, 1)
        if there[place] & WHIRL:
            begin = place
            while begin != first and there[begin - step] & WHIRL:
                begin -= step
            found = {"procedure": procedure, "axis": along, "value": float(values[begin])}
            if is_beside and here[begin] & STICK_SLIP and not here[begin] & WHIRL:
                return {"code": PASSES_IN_STICK_SLIP, **found}
            if begin == place and not is_beside:
                return None  # it begins here
            if begin == first != place:
                return {"code": STARTS_ON_WALL, **found}
            if begin != place and (is_beside or any(safe_on)):
                return {"code": STAYS_ON_WALL, **found}
        elif any(safe_on) and there[place]:
            lasting = {BIT_BOUNCE: BOUNCE_LASTS, STALLED: STALL_LASTS, STICK_SLIP: STICKING_LASTS}
            code = next(code for bit, code in lasting.items() if there[place] & bit)
            return {"code": code, "procedure": procedure, "axis": along, "value": None}
    return None


def _chain(bits: Array, cell: Cell, along_x: bool) -> list[int]:
    """The responses along the carried axis through a cell."""
    return [int(b) for b in np.asarray(bits[cell[:2]] if along_x else bits[cell[0], :, cell[2]])]
