"""Uncertain numbers: their distributions, and samples of them.

An unknown is described by plain data, ``{kind: numbers}`` in SI, as in a resolved
study:

- ``{"uniform": [low, high]}``
- ``{"triangular": [low, mode, high]}``
- ``{"normal": {"mean": m, "deviation": s}}``, truncated below ``low`` and above
  ``high`` if these are given
- ``{"lognormal": {"median": m, "factor": f}}``: 68 % are between m/f and m f; truncated
  likewise
- ``{"values": [...]}``: all with the same probability
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any, Protocol

import numpy as np

from nsdrill.records import dataclass

Array = np.ndarray
Numbers = Mapping[str, Any]  # {kind: numbers}

KINDS = ("uniform", "normal", "lognormal", "triangular", "values")
BOUNDS = ("low", "high")  # keys of the bounds of a truncated distribution
NUMBERS_OF: dict[str, tuple[str, ...]] = {"normal": ("mean", "deviation"), "lognormal": ("median", "factor")}
DESIGNS = ("sobol", "saltelli")
DIGITS = 9  # of a sample: the last digits of a quantile depend on the version of SciPy
MAX_SAMPLES = 100_000
MAX_UNKNOWNS = 40


@dataclass(frozen=True)
class Uncertain:
    """The unknowns of a study by their keys, as plain data in SI: ``distributions``,
    and the columns of a joint ``table``, all of the same length, whose rows are
    samples. ``correlations`` are (key, key, rank correlation).

    The design ``sobol`` has ``samples`` samples. ``saltelli`` has as many in a matrix
    A, as many in B, and for every unknown as many with its column of A taken from B:
    samples x (unknowns + 2) in all, from which Sobol indices are estimated without
    further assumptions."""

    distributions: Mapping[str, Numbers] = field(default_factory=dict)
    table: Mapping[str, Sequence[float]] = field(default_factory=dict)
    samples: int = 256
    seed: int = 1
    design: str = "sobol"
    correlations: tuple[tuple[str, str, float], ...] = ()

    @property
    def keys(self) -> tuple[str, ...]:
        """The keys of all unknowns, in the order of their dimensions."""
        return (*self.distributions, *self.table)

    @property
    def runs(self) -> int:
        """The total number of samples."""
        return self.samples * (len(self.distributions) + 2) if self.design == "saltelli" else self.samples


@dataclass(frozen=True)
class Pair:
    """Two unknowns in order: ``lower`` is less than ``upper`` times ``factor``, or equal to
    it where ``equal`` is set."""

    lower: str
    upper: str
    equal: bool = False
    factor: float = 1.0


LEAST_IN_ORDER = 1 / 64  # of the draws; with fewer the ranges contradict the order


def in_order(drawn: Mapping[str, Array], pairs: Sequence[Pair]) -> Array:
    """Which samples have all ``pairs`` in order, a mask [samples]."""
    mask = np.ones(np.shape(next(iter(drawn.values()), ())), dtype=bool)
    for pair in pairs:
        room = pair.factor * drawn[pair.upper] - drawn[pair.lower]
        mask &= room >= 0.0 if pair.equal else room > 0.0
    return mask


def may_be_out_of_order(distributions: Mapping[str, Numbers], pairs: Sequence[Pair]) -> bool:
    """Whether the ranges of two unknowns in order overlap, so that their samples depend on
    each other."""
    ends = np.array([1e-6, 1.0 - 1e-6])
    known = [pair for pair in pairs if {pair.lower, pair.upper} <= distributions.keys()]
    return any(
        quantile(distributions[pair.lower], ends)[1] > pair.factor * quantile(distributions[pair.upper], ends)[0]
        for pair in known
    )


def draw(unknown: Uncertain, pairs: Sequence[Pair] = ()) -> dict[str, Array]:
    """The samples of each unknown by its key, float arrays [runs]; bit-identical for
    the same input.

    The points in the unit cube are the first ones of a scrambled Sobol sequence (Owen
    1998; :class:`scipy.stats.qmc.Sobol`), whose length is a power of two. Where unknowns
    with distributions are in order in ``pairs``, draws against the order are left out and
    the sequence goes on for as many, but for the design saltelli. ValueError where hardly
    any draw is in order."""
    return drawn_in_order(unknown, pairs)[0]


def drawn_in_order(unknown: Uncertain, pairs: Sequence[Pair]) -> tuple[dict[str, Array], int]:
    """The samples as :func:`draw` gives them, and how many draws were left out for them."""
    joint = {key: np.array(values, dtype=float) for key, values in unknown.table.items()}
    if not unknown.distributions:
        return joint, 0
    drawn = _draw_distributions(unknown)
    pairs = [pair for pair in pairs if {pair.lower, pair.upper} <= unknown.distributions.keys()]
    mask, wanted, count = in_order(drawn, pairs), unknown.samples, unknown.samples
    if unknown.design == "saltelli" or mask.all():
        return drawn | joint, 0
    while np.count_nonzero(mask) < wanted:
        if count * LEAST_IN_ORDER > wanted:
            raise ValueError(f"uncertain: found {np.count_nonzero(mask)} of {count} draws in order")
        count *= 2
        drawn = _draw_distributions(replace(unknown, samples=count))
        mask = in_order(drawn, pairs)
    kept = np.flatnonzero(mask)[:wanted]
    return {key: values[kept] for key, values in drawn.items()} | joint, int(kept[-1]) + 1 - wanted


def _draw_distributions(unknown: Uncertain) -> dict[str, Array]:
    names = list(unknown.distributions)
    u = correlated(unit_samples(unknown), correlation_matrix(names, unknown.correlations))
    return {key: rounded(quantile(unknown.distributions[key], u[:, i])) for i, key in enumerate(names)}


def unit_samples(unknown: Uncertain) -> Array:
    """The samples in the open unit cube [runs, distributions]."""
    count, n = len(unknown.distributions), unknown.samples
    if unknown.design != "saltelli":
        return _sobol(count, n, unknown.seed)
    both = _sobol(2 * count, n, unknown.seed)
    a, b = both[:, :count], both[:, count:]
    mixed = [np.where(np.arange(count) == i, b, a) for i in range(count)]
    return np.concatenate([a, b, *mixed])


def _sobol(dimensions: int, count: int, seed: int) -> Array:
    from scipy.stats import qmc

    points = qmc.Sobol(dimensions, scramble=True, rng=np.random.default_rng(seed))
    least = 2.0**-54  # 0 and 1 have no finite quantile
    return np.clip(points.random_base2(math.ceil(math.log2(count)))[:count], least, 1.0 - least)


def correlation_matrix(names: Sequence[str], correlations: Sequence[tuple[str, str, float]]) -> Array:
    """The correlations of a Gaussian copula with these rank correlations (Spearman's
    rho), by r = 2 sin(pi rho / 6) (Pearson 1907): [unknowns, unknowns]."""
    matrix = np.eye(len(names))
    for first, second, rank in correlations:
        i, j = names.index(first), names.index(second)
        matrix[i, j] = matrix[j, i] = 2.0 * math.sin(math.pi * rank / 6.0)
    return matrix


def correlated(u: Array, matrix: Array) -> Array:
    """Independent samples ``u`` in the unit cube [n, d] with the Gaussian copula of
    this correlation ``matrix``; LinAlgError where it is not positive definite."""
    if np.array_equal(matrix, np.eye(len(matrix))):
        return u
    from scipy.special import ndtr, ndtri

    return np.asarray(ndtr(ndtri(u) @ np.linalg.cholesky(matrix).T))


class Frozen(Protocol):
    """What is asked of a frozen distribution of :mod:`scipy.stats`."""

    def cdf(self, x: float) -> float: ...
    def sf(self, x: float) -> float: ...
    def ppf(self, q: Array) -> Array: ...


def distribution(numbers: Numbers) -> Frozen:
    """The distribution of one unknown, not truncated, as a frozen distribution of
    :mod:`scipy.stats`; for a list of values the uniform one over their indices."""
    from scipy import stats

    ((kind, shape),) = numbers.items()
    if kind == "uniform":
        low, high = shape
        return stats.uniform(low, high - low)
    if kind == "triangular":
        low, mode, high = shape
        return stats.triang((mode - low) / (high - low), low, high - low)
    if kind == "normal":
        return stats.norm(shape["mean"], shape["deviation"])
    if kind == "lognormal":
        return stats.lognorm(math.log(shape["factor"]), scale=shape["median"])
    if kind == "values":
        return stats.randint(0, len(shape))
    raise ValueError(f"distribution: found {kind}, allowed: {', '.join(KINDS)}")


def quantile(numbers: Numbers, u: Array) -> Array:
    """The quantiles of an unknown at the probabilities ``u``, in (0, 1)."""
    frozen = distribution(numbers)
    ((kind, shape),) = numbers.items()
    if kind == "values":
        return np.asarray(shape, dtype=float)[np.asarray(frozen.ppf(u), dtype=int)]
    if kind not in NUMBERS_OF:
        return np.asarray(frozen.ppf(u))
    below, above = part_below(numbers)
    low, high = cut_of(numbers)
    values = np.asarray(frozen.ppf(below + u * (above - below)))
    return np.clip(values, -math.inf if low is None else low, math.inf if high is None else high)


def cut_of(numbers: Numbers) -> tuple[float | None, float | None]:
    """The lower and upper bound at which a normal or lognormal distribution is
    truncated; None where it is not."""
    ((_, shape),) = numbers.items()
    return (shape.get("low"), shape.get("high")) if isinstance(shape, Mapping) else (None, None)


def part_below(numbers: Numbers) -> tuple[float, float]:
    """The probabilities of a normal or lognormal distribution, not truncated, below its
    two bounds."""
    frozen = distribution(numbers)
    low, high = cut_of(numbers)
    return (0.0 if low is None else float(frozen.cdf(low))), (1.0 if high is None else float(frozen.cdf(high)))


def rounded(values: Array) -> Array:
    """Values rounded to :data:`DIGITS` digits."""
    return np.array([float(f"{value:.{DIGITS - 1}e}") for value in np.ravel(values).tolist()])
