"""Pulses of a forcing: how long what depends on the time alone stays away from its usual
value. Steps are chosen by the motion, which a pulse that lies within one step does not show."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.equations import plain
from nsdrill.equations.graph import Graph, Node

SAMPLES = 1 << 16  # of the time that is looked at
SHORT = 0.02  # of it: longer pulses are noticed by the stages of a step
RESTS = 0.3  # of the time, in which pulses are: what is away for more, as a sum of waves, does not rest between
LEVEL = 0.5  # of the greatest departure, above which it is a pulse


Pulse = tuple[float, float]  # how long it lasts, and the time in which there is one [s]


OF_TIME = ("time", "phase")  # inputs


def forces_of(graph: Graph, outputs: Iterable[Node], sources: Collection[str] = OF_TIME) -> list[Node]:
    """What depends on these inputs and on no state beside them, and is read by something that
    does, or is an output."""
    outputs = list(outputs)
    timed: set[Node] = set()
    moving: set[Node] = set()  # what depends on a state
    nodes = graph.live(outputs)
    for node in nodes:
        name = str(node.extra) if node.op == "input" else ""
        if (name.startswith("s.") and name not in sources) or any(arg in moving for arg in node.args):
            moving.add(node)
        elif name in sources or any(arg in timed for arg in node.args):
            timed.add(node)
    read = {arg for node in nodes if node in moving for arg in node.args} | set(outputs)
    return [node for node in nodes if node in timed and node in read]


def shortest_pulse(
    terms: Iterable[Node],
    given: Mapping[str, Any],
    duration: float,
    *,
    repeats: bool,
    source: str = "time",
    rate: float = 1.0,
) -> Pulse | None:
    """The shortest pulse of these terms in the time from 0 to ``duration`` [s], after which they
    may repeat, with the numbers that are ``given``; None where none is short. What departs at the
    start alone is none, as steps are short there. The ``source`` is the input that changes, at
    the ``rate``."""
    time = np.linspace(0.0, duration, SAMPLES, endpoint=False)
    wanted = {str(number): node for number, node in enumerate(terms)}
    with np.errstate(all="ignore"):
        found = plain.values(wanted, {**given, source: rate * time}) if wanted else {}
        pulses = [_pulse(np.broadcast_to(np.asarray(one, float), SAMPLES), repeats) for one in found.values()]
    shortest = min((one for one in pulses if one is not None), default=None)
    return None if shortest is None else (shortest[0] * duration, shortest[1] * duration)


def _pulse(values: Array, repeats: bool) -> Pulse | None:
    """As parts of the time."""
    away = np.abs(values - np.median(values))
    if not 0.0 < away.max() < np.inf:
        return None
    is_away = away > LEVEL * away.max()
    if not repeats and is_away[0]:  # the others count
        first = int(np.argmin(is_away))
        is_away[:first], away[:first] = False, 0.0
        if not is_away.any():
            return None
    count = np.count_nonzero(is_away & ~np.roll(is_away, 1))
    away_in_all = float(np.sum(away)) ** 2 / (SAMPLES * float(np.sum(away * away)))
    share = away_in_all / count
    return (share, 1.0 / count) if share < SHORT and away_in_all < RESTS else None
