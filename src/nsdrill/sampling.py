"""Unknown numbers: their distributions, and the samples that are drawn of them.

An unknown is described by plain data, ``{kind: numbers}`` in SI, as a resolved study
holds it:

- ``{"uniform": [low, high]}``
- ``{"triangular": [low, mode, high]}``
- ``{"normal": {"mean": m, "deviation": s}}``, cut off below ``low`` and above ``high``
  where these are given
- ``{"lognormal": {"median": m, "factor": f}}``: 68 % lie between m/f and m f; cut off
  likewise
- ``{"values": [...]}``: each as probable as the others
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]
Numbers = Mapping[str, Any]  # {kind: numbers}

KINDS = ("uniform", "normal", "lognormal", "triangular", "values")
CUT = ("low", "high")
NAMED: dict[str, tuple[str, ...]] = {
    "normal": ("mean", "deviation"),
    "lognormal": ("median", "factor"),
}
DESIGNS = ("sobol", "saltelli")
DIGITS = 9  # of a drawn value: the last ones of a quantile depend on the version of SciPy
MOST_SAMPLES = 100_000
MOST_UNKNOWNS = 40


@dataclass(frozen=True)
class Uncertain:
    """The unknowns of a study by their keys, as plain data in SI: ``distributions``,
    and the columns of a joint ``table``, all of one length, whose rows are samples.
    ``correlations`` are [key, key, rank correlation].

    With the design ``sobol`` there are ``samples`` samples; with ``saltelli`` as many
    in a matrix A, as many in B, and for every unknown as many with its column of A
    taken from B: samples x (unknowns + 2) in all, from which Sobol indices follow
    without further assumptions."""

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
        """How many samples there are in all."""
        return (
            self.samples * (len(self.distributions) + 2)
            if self.design == "saltelli"
            else self.samples
        )


def draw(unknown: Uncertain) -> dict[str, Array]:
    """The samples of each unknown by its key, float arrays [runs]. The same for the
    same input, to the bit.

    The points in the unit cube are a scrambled Sobol sequence (Owen 1998;
    :class:`scipy.stats.qmc.Sobol`), of which the first ones are taken where their
    number is no power of two."""
    drawn: dict[str, Array] = {}
    names = list(unknown.distributions)
    if names:
        u = correlated(unit_samples(unknown), correlation_matrix(names, unknown.correlations))
        drawn = {
            key: rounded(quantile(unknown.distributions[key], u[:, i]))
            for i, key in enumerate(names)
        }
    return drawn | {key: np.array(values, dtype=float) for key, values in unknown.table.items()}


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

    source = np.random.default_rng(seed)
    try:
        points = qmc.Sobol(dimensions, scramble=True, rng=source)
    except TypeError:  # before SciPy 1.15
        points = qmc.Sobol(dimensions, scramble=True, seed=source)
    half = 2.0**-54  # 0 and 1 have no quantile
    return np.clip(points.random_base2(math.ceil(math.log2(count)))[:count], half, 1.0 - half)


def correlation_matrix(
    names: Sequence[str], correlations: Sequence[tuple[str, str, float]]
) -> Array:
    """The correlations of a Gaussian copula with these rank correlations (Spearman's
    rho), by r = 2 sin(pi rho / 6) (Pearson 1907): [unknowns, unknowns]."""
    matrix = np.eye(len(names))
    for one, two, rank in correlations:
        i, j = names.index(one), names.index(two)
        matrix[i, j] = matrix[j, i] = 2.0 * math.sin(math.pi * rank / 6.0)
    return matrix


def correlated(u: Array, matrix: Array) -> Array:
    """Independent samples ``u`` in the unit cube [n, d] with the Gaussian copula of
    this correlation ``matrix``; LinAlgError where it is not positive definite."""
    if np.array_equal(matrix, np.eye(len(matrix))):
        return u
    from scipy.special import ndtr, ndtri

    return np.asarray(ndtr(ndtri(u) @ np.linalg.cholesky(matrix).T))


def distribution(numbers: Numbers) -> Any:
    """The distribution of one unknown, not cut off, as a frozen one of
    :mod:`scipy.stats`; of a list of values the uniform one over their places."""
    from scipy import stats

    ((kind, given),) = numbers.items()
    if kind == "uniform":
        low, high = given
        return stats.uniform(low, high - low)
    if kind == "triangular":
        low, mode, high = given
        return stats.triang((mode - low) / (high - low), low, high - low)
    if kind == "normal":
        return stats.norm(given["mean"], given["deviation"])
    if kind == "lognormal":
        return stats.lognorm(math.log(given["factor"]), scale=given["median"])
    if kind == "values":
        return stats.randint(0, len(given))
    raise ValueError(f"distribution: found {kind}, allowed: {', '.join(KINDS)}")


def quantile(numbers: Numbers, u: Array) -> Array:
    """The values below which the parts ``u``, in (0, 1), of an unknown lie."""
    made = distribution(numbers)
    ((kind, given),) = numbers.items()
    if kind == "values":
        return np.asarray(given, dtype=float)[np.asarray(made.ppf(u), dtype=int)]
    if kind not in NAMED:
        return np.asarray(made.ppf(u))
    below, above = part_below(numbers)
    low, high = cut_of(numbers)
    found = np.asarray(made.ppf(below + u * (above - below)))
    return np.clip(found, -math.inf if low is None else low, math.inf if high is None else high)


def cut_of(numbers: Numbers) -> tuple[float | None, float | None]:
    """Below and above which a normal or lognormal distribution is cut off; None where
    it is not."""
    ((_, given),) = numbers.items()
    return (given.get("low"), given.get("high")) if isinstance(given, Mapping) else (None, None)


def part_below(numbers: Numbers) -> tuple[float, float]:
    """The parts of a normal or lognormal distribution, not cut off, below its two ends."""
    made = distribution(numbers)
    low, high = cut_of(numbers)
    return (0.0 if low is None else float(made.cdf(low))), (
        1.0 if high is None else float(made.cdf(high))
    )


def rounded(values: Array) -> Array:
    """Values to :data:`DIGITS` digits."""
    return np.array([float(f"{value:.{DIGITS - 1}e}") for value in np.ravel(values).tolist()])
