"""Two windows against each other: what a change of the string, the drive, the mud or the
bit wins and costs.
"""

from __future__ import annotations

import numpy as np

from nsdrill.analysis.comparison import common_places
from nsdrill.analysis.hysteresis import response_text
from nsdrill.analysis.maps import SAFE, UNKNOWN, YIELDS, Classes, axes_of, classes, stretches
from nsdrill.analysis.window import find_window, usual_confidence
from nsdrill.data import Answer, Array, Results, evenly_spaced
from nsdrill.errors import InputError
from nsdrill.models.leaves import in_words
from nsdrill.models.responses import RESPONSES

MAX_ROWS = 400  # lines of a map that are compared one by one


def contrast(a: Results, b: Results, severity: int | None = None, confidence: float | None = None) -> Answer:
    """The windows of two results with the same axes as plain data in SI units:

    - ``windows``: the two, as of :func:`nsdrill.analysis.window.find_window`;
    - ``points``: the operating points that both have; how many of them are safe in
      ``both``, ``gained`` (in b alone), ``lost`` (in a alone), and ``unknown`` in
      either;
    - ``borders``: for each line of the map along its first axis the safe intervals of
      the two that meet: ``at``, and for the ends ``lower`` and ``upper`` the last safe
      values in ``a`` and ``b``, how far it ``moved``, and the ``responses_a`` and
      ``responses_b`` beyond (empty at the edge of the map). An end is None where the
      interval is only in the other;
    - ``onsets``: for each line, way and response, the least and the greatest value at
      which it occurs in ``a`` and in ``b``; None where it does not;
    - ``rate``: the rate of penetration [m/s] at the recommended point, at the fastest
      safe point, and on average over the points that are safe in both.

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
        "gained": int(np.count_nonzero(safe[1] & ~safe[0])),
        "lost": int(np.count_nonzero(safe[0] & ~safe[1])),
        "unknown": int(np.count_nonzero((state[0] == UNKNOWN) | (state[1] == UNKNOWN))),
        "borders": _borders(maps, places),
        "onsets": _onsets(maps, places),
        "rate": _rates(maps, places, safe[0] & safe[1], windows),
    }
    worded: Answer = in_words(found)
    return worded


def _places(a: Classes, b: Classes) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
    """The indices [third, y, x] of the common values of the axes, in each of the two."""
    pairs = [common_places(a.values(axis), b.values(axis))[:2] for axis in (a.third, a.y, a.x)]
    return tuple(i for i, _ in pairs), tuple(j for _, j in pairs)


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
        free = set(range(len(spans[1])))
        pairs: list[tuple[tuple[int, int] | None, tuple[int, int] | None]] = []
        for begin, end in spans[0]:
            low, high = x[0][begin], x[0][end]
            overlaps = {n: min(high, x[1][spans[1][n][1]]) - max(low, x[1][spans[1][n][0]]) for n in free}
            meeting = {n: overlap for n, overlap in overlaps.items() if overlap >= 0.0}
            if meeting:
                chosen = max(meeting, key=lambda n: (meeting[n], -n))
                free.discard(chosen)
                pairs.append(((begin, end), spans[1][chosen]))
            else:
                pairs.append(((begin, end), None))
        pairs += [(None, spans[1][n]) for n in sorted(free)]
        for pair in pairs:
            row: Answer = {"at": at, "axis": maps[0].x}
            for side_name, step in (("lower", -1), ("upper", 1)):
                values: list[float | None] = []
                responses: list[list[str]] = []
                for side, span in enumerate(pair):
                    if span is None:
                        values.append(None)
                        responses.append([])
                        continue
                    last = span[0] if step < 0 else span[1]
                    values.append(float(x[side][last]))
                    responses.append(_beyond(maps[side], cells[side], last + step))
                in_a, in_b = values
                row[side_name] = {
                    "a": in_a,
                    "b": in_b,
                    "moved": None if in_a is None or in_b is None else in_b - in_a,
                    "responses_a": responses[0],
                    "responses_b": responses[1],
                }
            rows.append(row)
    return rows


def _beyond(one: Classes, cell: tuple[int, int], place: int) -> list[str]:
    """The responses at a point of a line; none beyond its end."""
    if not 0 <= place < len(one.values(one.x)):
        return []
    bits = int(one.bits[(*cell, place)])
    return response_text(bits).split("+") if bits else []


def _onsets(maps: list[Classes], places: tuple[tuple[Array, ...], tuple[Array, ...]]) -> list[Answer]:
    rows = []
    ways = [name for name in maps[0].results.procedures if name in maps[1].results.procedures]
    for at, *cells in _lines(maps, places):
        for way in ways:
            for name, response in RESPONSES.items():
                row: Answer = {"at": at, "axis": maps[0].x, "procedure": way, "response": name}
                for side, one, cell in zip(("a", "b"), maps, cells, strict=True):
                    bits = one.bits_in[(one.results.procedures.index(way), *cell)]
                    found = one.values(one.x)[(bits & response.bit).astype(bool)]
                    row[side] = [float(found[0]), float(found[-1])] if found.size else None
                if row["a"] is not None or row["b"] is not None:
                    rows.append(row)
    return rows


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
