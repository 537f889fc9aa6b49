"""Two windows against each other: what a change of the string, the drive, the mud or the
bit wins and costs.
"""

from __future__ import annotations

import numpy as np

from nsdrill.analysis.comparison import common_places
from nsdrill.analysis.maps import SAFE, UNKNOWN, YIELDS, Classes, classes
from nsdrill.analysis.planes import axes_of, stretches
from nsdrill.analysis.safety import told_responses, unseen_responses
from nsdrill.analysis.window import find_window, obstacle, usual_confidence
from nsdrill.data import Answer, Array, Results, evenly_spaced
from nsdrill.errors import InputError
from nsdrill.models.choices import in_words
from nsdrill.models.responses import Response

# what lies beyond an end that is no border: the sweep ends there, or a run is not known
NO_BORDER = ("edge", "outside", "failed", "pending", "open", "unknown", "unmodelled")
MAX_ROWS = 400  # lines of a map that are compared one by one


def contrast(a: Results, b: Results, severity: int | None = None, confidence: float | None = None) -> Answer:
    """The windows of two results with the same axes as plain data in SI units:

    - ``windows``: the two, as of :func:`nsdrill.analysis.window.find_window`;
    - ``points``: the operating points that both have; how many of them are ``safe`` in
      each, safe in ``both``, ``gained`` (safe in b, and known not to be in a), ``lost``
      (safe in a, and known not to be in b), and ``unknown`` in either; ``not_known``, at
      how many of them a run is not known in ``a`` and in ``b``; and for each of the
      ``responses`` at how many it is known to occur in ``a`` and in ``b``, in any history.
      None stands for a number of which nothing is known, as all its points are unknown;
    - ``open_points``: at how many of all points of ``a`` and of ``b`` a run is not known;
    - ``borders``: for each line of the map along its first axis the safe intervals of
      the two that meet: ``at``, and for the ends ``lower`` and ``upper`` the last safe
      values in ``a`` and ``b``, how far it ``moved``, ``at_least`` so far where one of the two
      is no border (:data:`NO_BORDER`), and what lies beyond: the
      ``responses_a`` and ``responses_b``, and ``why_a`` and ``why_b``, as of a side of
      a window (``edge`` beyond the map). An end is None where the interval is only in
      the other; its responses are then those that occur there instead. ``moved`` is None
      there, and where no border is known to have moved, as at two ends of sweeps;
    - ``same_steps``: whether the two have the same values where their ranges overlap;
    - ``onsets``: for each line, way and response, the intervals in which it occurs in
      ``a`` and in ``b``, by their first and last value, and ``a_unknown`` and
      ``b_unknown``, those in which a run is not known;
    - ``rate``: the rate of penetration [m/s] at the recommended point, at the fastest
      safe point, and on average over the points that are safe in both;
    - ``most_probable``: of two with samples the points that are most probably safe,
      and whether the intervals of their probabilities are ``apart``.

    InputError where the axes differ.
    """
    if axes_of(a) is None or axes_of(a) != axes_of(b):
        swept = " and ".join(" x ".join(one.swept) or "a single point" for one in (a, b))
        raise InputError(
            f"window: found sweeps over {swept}; allowed: two sweeps over the same axes, at least "
            "one. Their values may differ."
        )
    levels = [usual_confidence(one, confidence) for one in (a, b)]
    maps = [classes(one, severity, level) for one, level in zip((a, b), levels, strict=True)]
    windows = [find_window(one, severity, level) for one, level in zip((a, b), levels, strict=True)]
    places = _places(*maps)
    state = [one.state[np.ix_(*places[side])] for side, one in enumerate(maps)]
    safe = [part == SAFE for part in state]
    found: Answer = {
        "kind": "contrast",
        "windows": windows,
        "points": int(state[0].size),
        "both": int(np.count_nonzero(safe[0] & safe[1])),
        "gained": int(np.count_nonzero(safe[1] & ~safe[0] & (state[0] != UNKNOWN))),
        "lost": int(np.count_nonzero(safe[0] & ~safe[1] & (state[1] != UNKNOWN))),
        "safe": {
            side: None if part.size and np.all(part == UNKNOWN) else int(np.count_nonzero(part == SAFE))
            for side, part in zip("ab", state, strict=True)
        },
        "unknown": int(np.count_nonzero((state[0] == UNKNOWN) | (state[1] == UNKNOWN))),
        "not_known": {
            side: int(np.count_nonzero(_is_open(one)[np.ix_(*place)]))
            for side, one, place in zip("ab", maps, places, strict=True)
        },
        "open_points": {side: int(np.count_nonzero(_is_open(one))) for side, one in zip("ab", maps, strict=True)},
        "responses": _responses(maps, places),
        "borders": _borders(maps, places),
        "same_steps": _have_same_steps(*maps),
        "onsets": _onsets(maps, places),
        "rate": _rates(maps, places, safe[0] & safe[1], windows),
        "most_probable": _most_probable(windows),
    }
    worded: Answer = in_words(found)
    return worded


def _places(a: Classes, b: Classes) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """The indices [third, y, x] of the common values of the axes, in each of the two."""
    pairs = [common_places(a.values(axis), b.values(axis))[:2] for axis in (a.third, a.y, a.x)]
    return tuple(i for i, _ in pairs), tuple(j for _, j in pairs)


def _responses(maps: list[Classes], places: tuple[tuple[Array, ...], tuple[Array, ...]]) -> Answer:
    """At how many of the common points each response is known to occur, in ``a`` and in ``b``;
    None where it was met at none of them, and of none all is known, or where these results
    cannot show it."""
    bits = [one.bits[np.ix_(*place)].astype(int) for one, place in zip(maps, places, strict=True)]
    is_open = [_is_open(one)[np.ix_(*place)] for one, place in zip(maps, places, strict=True)]

    unseen = [unseen_responses(one.results.attrs) for one in maps]

    def number(side: int, name: str, bit: int) -> int | None:
        if name in unseen[side]:
            return None
        met = int(np.count_nonzero(bits[side] & bit))
        return None if not met and is_open[side].size and np.all(is_open[side]) else met

    return {name: {"a": number(0, name, one.bit), "b": number(1, name, one.bit)} for name, one in _told(maps).items()}


def _is_open(one: Classes) -> Array:
    """Whether a run of each point is not known."""
    return np.asarray(one.counts.known < one.counts.of)


def _told(maps: list[Classes]) -> dict[str, Response]:
    """The responses that one of the two or both may have."""
    return {name: one for part in maps for name, one in told_responses(part.results.attrs).items()}


def _lines(
    maps: list[Classes], places: tuple[tuple[Array, ...], tuple[Array, ...]]
) -> list[tuple[dict[str, float], tuple[int, int], tuple[int, int]]]:
    """The lines along the first axis that both have: where they are, and their indices
    (third, y) in each; evenly chosen where there are many."""
    one = maps[0]
    rows = [
        (
            {axis: float(one.values(axis)[index]) for axis, index in ((one.third, k), (one.y, i)) if axis},
            (int(k), int(i)),
            (int(places[1][0][m]), int(places[1][1][n])),
        )
        for m, k in enumerate(places[0][0])
        for n, i in enumerate(places[0][1])
    ]
    return evenly_spaced(rows, MAX_ROWS)


def _borders(maps: list[Classes], places: tuple[tuple[Array, ...], tuple[Array, ...]]) -> list[Answer]:
    rows = []
    x = [one.values(one.x) for one in maps]
    for at, *cells in _lines(maps, places):
        spans = [stretches(one.state[cell] == SAFE) for one, cell in zip(maps, cells, strict=True)]
        for pair in _pairs(x, spans):
            row: Answer = {"at": at, "axis": maps[0].x}
            for side_name, step in (("lower", -1), ("upper", 1)):
                last = [span and span[0 if step < 0 else 1] for span in pair]
                ends = [None if place is None else float(x[side][place]) for side, place in enumerate(last)]
                found = [
                    obstacle(one, (*cell, place + step)) if place is not None else _there(one, cell, ends[1 - side])
                    for side, (one, cell, place) in enumerate(zip(maps, cells, last, strict=True))
                ]
                row[side_name] = {
                    "a": ends[0],
                    "b": ends[1],
                    **_move(ends, [one["why"] for one in found], step),
                    **{
                        f"{name}_{side}": one[name]
                        for name in ("responses", "why")
                        for side, one in zip("ab", found, strict=True)
                    },
                }
            rows.append(row)
    return rows


def _move(ends: list[float | None], why: list[str], outwards: int) -> Answer:
    """How far a border ``moved`` between two ends of an interval, from what lies beyond
    each, and whether ``at_least`` so far. Where nothing is known beyond an end, the
    border lies there or further ``outwards`` (-1 or 1)."""
    a, b = ends
    is_border = [one not in NO_BORDER for one in why]
    if a is None or b is None or not any(is_border):
        return {"moved": None, "at_least": False}
    moved = b - a
    if all(is_border):
        return {"moved": moved, "at_least": False}
    is_known = moved * outwards < 0.0 if is_border[1] else moved * outwards > 0.0
    return {"moved": moved if is_known else None, "at_least": is_known}


def _have_same_steps(a: Classes, b: Classes) -> bool:
    """Whether the two have the same values of each axis wherever both were swept."""
    for axis in filter(None, (a.third, a.y, a.x)):
        sides = [np.asarray(one.values(axis), float) for one in (a, b)]
        low, high = max(side.min() for side in sides), min(side.max() for side in sides)
        slack = 1e-9 * max(abs(low), abs(high))
        first, second = (side[(side >= low - slack) & (side <= high + slack)] for side in sides)
        if len(first) != len(second) or not np.allclose(first, second, rtol=1e-9, atol=0.0):
            return False
    return True


Span = tuple[int, int]


def _pairs(x: list[Array], spans: list[list[Span]]) -> list[tuple[Span | None, Span | None]]:
    """The safe intervals of a line in a, each with the one in b that it meets most, and
    those in b that are left, likewise; None where it meets none. ``x`` are the values
    along the line in a and in b."""

    def meets_most(span: Span, side: int) -> Span | None:
        low, high = x[side][list(span)]
        overlaps = {one: min(high, x[1 - side][one[1]]) - max(low, x[1 - side][one[0]]) for one in spans[1 - side]}
        best = max(overlaps, key=lambda one: overlaps[one], default=None)
        return best if best is not None and overlaps[best] >= 0.0 else None

    pairs: list[tuple[Span | None, Span | None]] = [(span, meets_most(span, 0)) for span in spans[0]]
    met = {there for _, there in pairs}
    return pairs + [(meets_most(span, 1), span) for span in spans[1] if span not in met]


def _there(one: Classes, cell: tuple[int, int], value: float | None) -> Answer:
    """What prevents that the point of a line at this value is safe: that at the nearest
    point of the line that is not."""
    values = one.values(one.x)
    not_safe = np.flatnonzero(one.state[cell] != SAFE)
    if value is None or not values[0] <= value <= values[-1] or not not_safe.size:
        return obstacle(one, (*cell, -1))
    return obstacle(one, (*cell, int(not_safe[np.argmin(np.abs(values[not_safe] - value))])))


def _onsets(maps: list[Classes], places: tuple[tuple[Array, ...], tuple[Array, ...]]) -> list[Answer]:
    rows = []
    ways = [name for name in maps[0].results.procedures if name in maps[1].results.procedures]
    for at, *cells in _lines(maps, places):
        for way in ways:
            for name, response in _told(maps).items():
                row: Answer = {"at": at, "axis": maps[0].x, "procedure": way, "response": name}
                for side, one, cell in zip(("a", "b"), maps, cells, strict=True):
                    line = (one.results.procedures.index(way), *cell)
                    for key, chosen in (
                        (side, (one.bits_in[line] & response.bit).astype(bool)),
                        (f"{side}_unknown", ~one.is_known_in[line]),
                    ):
                        row[key] = [one.values(one.x)[list(ends)].tolist() for ends in stretches(chosen)]
                if row["a"] or row["b"]:
                    rows.append(row)
    return rows


def _most_probable(windows: list[Answer]) -> Answer | None:
    """The points of the two that are most probably safe, ``a`` and ``b``; None where one
    has none."""
    a, b = (window["most_probable"] for window in windows)
    if not a or not b:
        return None
    first, second = sorted((a, b), key=lambda point: float(point["probability"]))
    return {"a": a, "b": b, "apart": bool(first["probability_high"] < second["probability_low"])}


def _rates(
    maps: list[Classes], places: tuple[tuple[Array, ...], tuple[Array, ...]], safe_in_both: Array, windows: list[Answer]
) -> Answer | None:
    """The rates of penetration [m/s], ``a`` and ``b``; None where a file has none."""
    name = YIELDS[0]
    if any(name not in one.yields for one in maps):
        return None
    common = [one.yields[name][np.ix_(*places[side])][safe_in_both] for side, one in enumerate(maps)]
    known = np.isfinite(common[0]) & np.isfinite(common[1])

    def pair(values: list[float | None]) -> dict[str, float | None]:
        return dict(zip(("a", "b"), values, strict=True))

    def of(window: Answer, which: str) -> float | None:
        points = [one[which] for one in window["maps"] if one[which]]
        rates = [point[name] for point in points if name in point]
        return max(rates) if rates else None

    return {
        "recommended": pair([of(window, "recommended") for window in windows]),
        "fastest": pair([of(window, "fastest") for window in windows]),
        "both_safe": pair([float(part[known].mean()) if known.any() else None for part in common]),
    }
