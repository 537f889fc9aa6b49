"""Runge-Kutta pairs of scripts: checked against their order conditions, and known by name
beside those of :mod:`nsdrill.kernel.steppers`.

The conditions are those of rooted trees: Hairer, Norsett & Wanner, Solving Ordinary
Differential Equations I, section II.2 and table II.2.1.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from nsdrill.data import Array
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


Tree = tuple[Any, ...]  # a rooted tree, of the trees at its root


@lru_cache
def trees_of(order: int) -> tuple[Tree, ...]:
    """The rooted trees with so many vertices, each once: of each there is a condition."""
    if order == 1:
        return ((),)
    smaller = [(size, tree) for size in range(1, order) for tree in trees_of(size)]

    def rest(size: int, first: int) -> Iterator[Tree]:
        """The ways to fill this ``size`` with trees from the ``first`` on."""
        if size == 0:
            yield ()
        for k in range(first, len(smaller)):
            if smaller[k][0] <= size:
                yield from ((smaller[k][1], *others) for others in rest(size - smaller[k][0], k))

    return tuple(rest(order - 1, 0))


def _size(tree: Tree) -> int:
    return 1 + sum(map(_size, tree))


def _density(tree: Tree) -> int:
    return _size(tree) * math.prod(map(_density, tree))


def _symmetry(tree: Tree) -> int:
    return math.prod(_symmetry(one) ** times * math.factorial(times) for one, times in Counter(tree).items())


def _words(tree: Tree) -> list[str]:
    """The factors of the vector of a tree: c for a leaf, else a times those of the branch."""
    found = []
    for one, times in Counter(tree).items():
        factors = _words(one)
        inner = "c" if not factors else f"a {factors[0]}" if len(factors) == 1 else f"a ({' '.join(factors)})"
        power = f"^{times}" if times > 1 else ""
        found.append(f"({inner}){power}" if power and factors else f"{inner}{power}")
    return found


def _vector(tree: Tree, a: Array) -> Array:
    """Weights b have the order of a tree where b times this vector is one over its density; with
    the matrix ``a`` [n, n]."""
    return np.asarray(math.prod((a @ _vector(one, a) for one in tree), start=np.ones(len(a))))


def _line(order: int) -> Tree:
    """The tree without branches, whose differential is that of y' = y."""
    return (_line(order - 1),) if order > 1 else ()


def _fan(order: int) -> Tree:
    """The tree all of whose vertices but the root are leaves, whose differential is that of y' = f(t)."""
    return ((),) * (order - 1)


TRIED = 1e-6  # the default of simulation.rtol, at which an estimate is judged
SEEN = 10.0  # of it: the error of a step where that is estimated to be it; known pairs have 2 at most
MOTIONS: dict[str, Callable[[int], tuple[Tree, ...]]] = {
    "": trees_of,
    " of y' = y": lambda order: (_line(order),),
    " of y' = f(t)": lambda order: (_fan(order),),
}


def _errors_of_a_step(a: Array, b: Array, embedded: Array, order: int) -> Iterator[tuple[str, float]]:
    """Of each of :data:`MOTIONS`, in words: how many times the tolerance the first error of a step
    is that is estimated to be as large as the tolerance, at one of 1e-6."""
    for words, trees in MOTIONS.items():

        def size(weights: Array, at: int, exact: float, trees: Any = trees) -> float:
            off = [(weights @ _vector(tree, a) - exact / _density(tree)) / _symmetry(tree) for tree in trees(at)]
            return float(np.linalg.norm(off))

        seen = [(at, size(b - embedded, at, 0.0)) for at in (order, order + 1)]
        # a step in radians, or e-folds, of the motion
        step = min(((TRIED / one) ** (1 / at) for at, one in seen if one > CLOSE), default=math.inf)
        missed = size(b, order + 1, 1.0)
        yield words, missed * step ** (order + 1) / TRIED if missed > CLOSE else 0.0


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
    for what, weights, reached in (("b", b, order), ("embedded", embedded, order - 1)):
        for of in range(1, reached + 1):
            for tree in trees_of(of):
                off = abs(float(np.dot(weights, _vector(tree, a))) - 1 / _density(tree))
                if not off <= CLOSE:
                    condition = f"sum {' '.join(['b', *_words(tree)])} = 1{f'/{_density(tree)}' if of > 1 else ''}"
                    return f"{what} that is off by {off:.3g} in {condition}, of order {of}; allowed: at most {CLOSE:g}"
    if np.allclose(b, embedded, rtol=0.0, atol=CLOSE):
        return "embedded weights that are b, so that no error is estimated; allowed: others"
    for words, times in _errors_of_a_step(a, np.array(b), np.array(embedded), order):
        if not times <= SEEN:
            return (
                f"embedded weights too close to b: the error of a step{words} is {times:.2g} times the one that they "
                f"estimate, at simulation.rtol {TRIED:g}; allowed: up to {SEEN:g} times, so weights further from b"
            )
    return ""


def made_of(name: str, rows: Sequence[Sequence[float]], embedded: Sequence[float], order: int) -> Pair:
    """The pair with these numbers, of which nothing is wrong."""
    matrix = tuple(tuple(map(float, row)) for row in rows)
    nodes = (0.0, *(float(np.sum(row)) for row in matrix))
    error = tuple(float(b - e) for b, e in zip((*matrix[-1], 0.0), embedded, strict=True))
    return Pair(name=name, order=order, nodes=(*nodes[:-1], 1.0), matrix=matrix, error=error)
