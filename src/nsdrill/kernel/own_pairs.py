"""Runge-Kutta pairs of scripts: checked against their order conditions, and known by name
beside those of :mod:`nsdrill.kernel.steppers`.

The conditions are those of Hairer, Norsett & Wanner, Solving Ordinary Differential
Equations I, table II.2.1.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence

import numpy as np

from nsdrill.kernel.pairs import Pair
from nsdrill.origin import Origin
from nsdrill.records import dataclass

CLOSE = 1e-13  # to which the conditions hold
LEAST, MOST = 2, 5  # orders of a pair


@dataclass(frozen=True)
class OwnPair:
    """A pair of a script, of an ``origin``; ``digest`` is that of its numbers."""

    pair: Pair
    origin: Origin

    @property
    def digest(self) -> str:
        return hashlib.sha256(repr(self.pair).encode()).hexdigest()[:16]


_known: dict[str, OwnPair] = {}


def own_pair(name: str) -> OwnPair | None:
    """The pair of a script by this name, None where there is none."""
    return _known.get(name)


def own_pair_names() -> tuple[str, ...]:
    return tuple(_known)


def register_pair(name: str, made: OwnPair) -> None:
    _known[name] = made


def withdraw_pairs(*names: str) -> None:
    """Make pairs of scripts unknown again; those that are not known are passed over."""
    for name in names:
        _known.pop(name, None)


def pair_named(name: str) -> Pair:
    """The pair of this name."""
    from nsdrill.kernel.steppers import STEPPERS  # the compiler, which a study does without

    return STEPPERS[name] if name in STEPPERS else _known[name].pair


def conditions(a: np.ndarray, c: np.ndarray) -> Iterator[tuple[int, str, np.ndarray, float]]:
    """(order, words, vector, value): weights b have an order where b times each of the
    vectors up to it is the value; with the matrix ``a`` [n, n] and its nodes ``c``."""
    ac, ac2, ac3 = a @ c, a @ c**2, a @ c**3
    yield 1, "sum b = 1", np.ones(len(c)), 1.0
    yield 2, "sum b c = 1/2", c, 1 / 2
    yield 3, "sum b c^2 = 1/3", c**2, 1 / 3
    yield 3, "sum b a c = 1/6", ac, 1 / 6
    yield 4, "sum b c^3 = 1/4", c**3, 1 / 4
    yield 4, "sum b c a c = 1/8", c * ac, 1 / 8
    yield 4, "sum b a c^2 = 1/12", ac2, 1 / 12
    yield 4, "sum b a a c = 1/24", a @ ac, 1 / 24
    yield 5, "sum b c^4 = 1/5", c**4, 1 / 5
    yield 5, "sum b c^2 a c = 1/10", c**2 * ac, 1 / 10
    yield 5, "sum b (a c)^2 = 1/20", ac * ac, 1 / 20
    yield 5, "sum b c a c^2 = 1/15", c * ac2, 1 / 15
    yield 5, "sum b a c^3 = 1/20", ac3, 1 / 20
    yield 5, "sum b c a a c = 1/30", c * (a @ ac), 1 / 30
    yield 5, "sum b a (c a c) = 1/40", a @ (c * ac), 1 / 40
    yield 5, "sum b a a c^2 = 1/60", a @ ac2, 1 / 60
    yield 5, "sum b a a a c = 1/120", a @ a @ ac, 1 / 120


def fault_of(rows: Sequence[Sequence[float]], b: Sequence[float], embedded: Sequence[float], order: int) -> str:
    """What is wrong with a pair, in words, "" where nothing is: with the ``rows`` of the
    stages after the first, weights ``b`` and those of the ``embedded`` formula."""
    try:
        rows = [[float(one) for one in row] for row in rows]
        b, embedded = [float(one) for one in b], [float(one) for one in embedded]
    except (TypeError, ValueError) as error:
        return f"what is no number, {error}; allowed: lists of numbers"
    n = len(rows) + 1
    if [len(row) for row in rows] != list(range(1, n)):
        found = ", ".join(str(len(row)) for row in rows)
        return f"rows of {found} numbers; allowed: 1, 2, 3, ... for stages 2, 3, ..., as a begins at stage 2"
    if not LEAST <= order <= MOST:
        return f"order={order}; allowed: {LEAST} to {MOST}"
    for what, weights in (("b", b), ("embedded", embedded)):
        if len(weights) != n:
            return f"{len(weights)} numbers in {what}; allowed: {n}, one for each stage"
        if not np.all(np.isfinite(weights)):
            return f"{what} with a number that is not finite; allowed: finite ones"
    if not np.allclose([*rows[-1], 0.0], b, rtol=0.0, atol=CLOSE):
        return "a last stage that is not the first of the next step; allowed: the last row of a as b, which ends with 0"
    a = np.zeros((n, n))
    for i, row in enumerate(rows, start=1):
        a[i, : len(row)] = row
    c = a.sum(axis=1)
    for what, weights, reached in (("b", b, order), ("embedded", embedded, order - 1)):
        for of, words, vector, value in conditions(a, c):
            off = abs(float(np.dot(weights, vector)) - value)
            if of <= reached and not off <= CLOSE:
                return f"{what} that is off by {off:.3g} in {words}, of order {of}; allowed: at most {CLOSE:g}"
    if np.allclose(b, embedded, rtol=0.0, atol=CLOSE):
        return "embedded weights that are b, so that no error is estimated; allowed: others"
    return ""


def made_of(name: str, rows: Sequence[Sequence[float]], embedded: Sequence[float], order: int) -> Pair:
    """The pair with these numbers, of which nothing is wrong."""
    matrix = tuple(tuple(map(float, row)) for row in rows)
    nodes = (0.0, *(float(np.sum(row)) for row in matrix))
    error = tuple(float(b - e) for b, e in zip((*matrix[-1], 0.0), embedded, strict=True))
    return Pair(name=name, order=order, nodes=(*nodes[:-1], 1.0), matrix=matrix, error=error)
