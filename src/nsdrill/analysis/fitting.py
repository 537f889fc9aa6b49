"""Unknown numbers adjusted to measurements: samples of what the unknowns may be, given
what was measured.

The unknowns are u in the unit cube, one part of the prior each, and worked with as z =
Phi^-1(u): the prior of z is the standard normal distribution whatever the distributions
are. A model run is a function of z that has no gradient of use where the motion is
chaotic, so samples are weighted, not moved: adaptive multiple importance sampling
(Cornuet, Marin, Mira & Robert 2012). Every round draws from a mixture of kernels about
the samples so far and from the prior; all samples of all rounds are weighted by prior
times likelihood over the mixture of all that they were drawn from. Early rounds temper
the likelihood (its power beta), so that enough samples keep a weight.

A feature of a chaotic run differs between runs of all but equal numbers. This spread is
measured by runs that differ by a thousandth of the prior's width, and counts twice as
an error: the well is one such run, and the model another.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nsdrill.data import Array
from nsdrill.sampling import Uncertain, unit_samples

Simulate = Callable[[Array], Array]
"""From samples z [n, unknowns] to what was measured [n, values], NaN where a run
failed."""

FROM_PRIOR = 0.2  # of the samples of a round
KERNELS = 64
NEAR = 1e-3  # how far apart runs are that tell the spread
GROUPS, IN_GROUP = 4, 5
LEAST_GAIN = 0.9  # of the width of the prior: above it the data tell nothing
GOOD_GAIN = 0.5
TIGHT = 0.8  # correlation of two unknowns of which the data tell a combination
AT_THE_END = 0.02  # parts of the prior at its ends
SURE = 1e-3  # probability of the misfit below which the model cannot give the data


@dataclass(frozen=True)
class Measured:
    """Measurements over ``points``: ``at`` the values of study keys, ``values`` those
    of features and severities with their standard deviations ``errors``, by name,
    arrays [points] in SI, NaN where nothing was measured. ``where`` says of each point
    whence it comes, ``notes`` what was left out or assumed."""

    source: str
    at: dict[str, Array]
    values: dict[str, Array]
    errors: dict[str, Array]
    where: tuple[str, ...]
    notes: tuple[str, ...] = ()

    @property
    def points(self) -> int:
        return len(self.where)

    @property
    def flat(self) -> tuple[Array, Array, Array]:
        """Values and errors that are there, and their places among all, name after
        name, point after point."""
        values = np.concatenate([self.values[name] for name in self.values])
        errors = np.concatenate([self.errors[name] for name in self.values])
        there = np.flatnonzero(np.isfinite(values))
        return values[there], errors[there], there


@dataclass(frozen=True)
class Posterior:
    """Samples ``z`` [n, unknowns] with ``weights`` [n], their model values ``found``
    [n, values]; ``spread`` [values], the standard deviation among runs of all but equal
    numbers; ``beta`` 1 where the full likelihood was reached; ``size`` the effective
    number of samples."""

    z: Array
    weights: Array
    found: Array
    spread: Array
    beta: float
    size: float
    rounds: int
    runs: int
    failed: int
    misfit: float
    """The least of the sums of squared deviations over their variance."""

    def drawn(self, count: int, seed: int) -> Array:
        """The places of ``count`` samples of equal weight, by systematic resampling."""
        edges = np.cumsum(self.weights)
        at = (np.random.default_rng(seed).random() + np.arange(count)) / count
        return np.minimum(np.searchsorted(edges / edges[-1], at), len(edges) - 1)

    @property
    def mean(self) -> Array:
        """Of z, [unknowns]."""
        return np.asarray(self.weights @ self.z)

    @property
    def covariance(self) -> Array:
        """Of z, [unknowns, unknowns]; of the prior it is the unit matrix."""
        away = self.z - self.mean
        return np.asarray((self.weights[:, None] * away).T @ away)

    @property
    def widths(self) -> Array:
        """The standard deviations of z, [unknowns]: that of the prior is 1."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlations(self) -> Array:
        """Between the unknowns, in z: [unknowns, unknowns]."""
        widths = np.maximum(self.widths, 1e-12)
        return np.asarray(self.covariance / np.outer(widths, widths))


def posterior(
    simulate: Simulate,
    measured: Array,
    errors: Array,
    unknowns: int,
    *,
    seed: int = 1,
    batch: int = 128,
    rounds: int = 8,
    wanted: float = 100.0,
) -> Posterior:
    """What the unknowns may be, given the values ``measured`` with standard deviations
    ``errors``, both [values].

    Rounds of ``batch`` runs are made, the first of twice as many, until the effective
    number of samples is ``wanted`` under the full likelihood, or until there are so
    many ``rounds``. ValueError where every run of the first failed.
    """
    from scipy.special import ndtri

    rng = np.random.default_rng(seed)
    prior = Uncertain(
        {str(i): {"uniform": [0.0, 1.0]} for i in range(unknowns)}, samples=2 * batch, seed=seed
    )
    z = ndtri(unit_samples(prior))
    found = simulate(z)
    if not np.isfinite(found).all(axis=1).any():
        raise ValueError("every run with values from the distributions failed")
    drawn_from: list[tuple[int, _Mixture | None]] = [(len(z), None)]
    spread = np.zeros(len(measured))
    beta, estimates, extra = 0.0, 0, 0
    for number in range(1, rounds + 1):
        log_l = _log_likelihood(found, measured, errors, spread)
        log_q = _log_mixture(z, drawn_from)
        beta, weights = _tempered(log_l, _log_normal(z) - log_q, beta, min(wanted, 0.25 * batch))
        if estimates == 0 or (estimates == 1 and beta == 1.0):
            spread = _spread(simulate, z, weights, rng)
            estimates, beta, extra = estimates + 1, 0.0, extra + GROUPS * IN_GROUP
            log_l = _log_likelihood(found, measured, errors, spread)
            beta, weights = _tempered(log_l, _log_normal(z) - log_q, 0.0, min(wanted, 0.25 * batch))
        size = float(1 / np.sum(weights**2))
        if (beta == 1.0 and estimates == 2 and size >= wanted) or number == rounds:
            break
        kernels = _kernels(z, weights, rng)
        wide = round(FROM_PRIOR * batch)
        new = np.concatenate(
            [rng.standard_normal((wide, unknowns)), kernels.draw(batch - wide, rng)]
        )
        drawn_from += [(wide, None), (batch - wide, kernels)]
        z, found = np.concatenate([z, new]), np.concatenate([found, simulate(new)])
    failed = int(np.count_nonzero(~np.isfinite(found).all(axis=1)))
    variance = errors**2 + 2 * spread**2
    squares = np.where(
        np.isfinite(found).all(axis=1), np.sum((found - measured) ** 2 / variance, axis=1), np.inf
    )
    return Posterior(
        z, weights, found, spread, beta, size, number, len(z) + extra, failed, float(squares.min())
    )


@dataclass(frozen=True)
class _Mixture:
    """Normal kernels of equal weight about ``centres`` [n, d]; ``root`` is the Cholesky
    factor of their covariance."""

    centres: Array
    root: Array

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        at = rng.integers(len(self.centres), size=count)
        return np.asarray(
            self.centres[at] + rng.standard_normal((count, len(self.root))) @ self.root.T
        )

    def log_density(self, z: Array) -> Array:
        from scipy.linalg import solve_triangular
        from scipy.special import logsumexp

        d = len(self.root)
        scaled = solve_triangular(self.root, np.concatenate([z, self.centres]).T, lower=True).T
        apart = scaled[: len(z), None] - scaled[None, len(z) :]
        logs = -0.5 * np.sum(apart**2, axis=2)
        constant = (
            -0.5 * d * np.log(2 * np.pi)
            - np.sum(np.log(np.diag(self.root)))
            - np.log(len(self.centres))
        )
        return np.asarray(logsumexp(logs, axis=1) + constant)


def _kernels(z: Array, weights: Array, rng: np.random.Generator) -> _Mixture:
    """Kernels about samples, as wide as Silverman's rule has it (1986, eq. 4.15) and a
    fifth wider."""
    d = z.shape[1]
    mean = weights @ z
    covariance = (weights[:, None] * (z - mean)).T @ (z - mean) + 1e-8 * np.eye(d)
    size = max(1 / np.sum(weights**2), 2.0)
    width = 1.2 * (4 / ((d + 2) * min(size, KERNELS))) ** (1 / (d + 4))
    centres = z[rng.choice(len(z), KERNELS, p=weights)]
    return _Mixture(centres, np.linalg.cholesky(width**2 * covariance))


def _log_normal(z: Array) -> Array:
    return np.asarray(-0.5 * np.sum(z**2, axis=1) - 0.5 * z.shape[1] * np.log(2 * np.pi))


def _log_mixture(z: Array, parts: list[tuple[int, _Mixture | None]]) -> Array:
    """The logarithm of the density from which all samples together were drawn; None
    stands for the prior."""
    from scipy.special import logsumexp

    total = sum(count for count, _ in parts)
    prior = sum(count for count, one in parts if one is None)
    logs = [np.log(prior / total) + _log_normal(z)]
    logs += [np.log(count / total) + one.log_density(z) for count, one in parts if one is not None]
    return np.asarray(logsumexp(logs, axis=0))


def _log_likelihood(found: Array, measured: Array, errors: Array, spread: Array) -> Array:
    squares = np.sum((found - measured) ** 2 / (errors**2 + 2 * spread**2), axis=1)
    return np.where(np.isfinite(squares), -0.5 * squares, -np.inf)


def _tempered(log_l: Array, log_ratio: Array, least: float, size: float) -> tuple[float, Array]:
    """The greatest power of the likelihood, from ``least`` to 1, that leaves an
    effective number ``size`` of samples, and their weights."""

    def weights(beta: float) -> Array:
        logs = np.where(
            np.isfinite(log_l), beta * np.where(np.isfinite(log_l), log_l, 0.0) + log_ratio, -np.inf
        )
        found = np.exp(logs - logs.max())
        return np.asarray(found / found.sum())

    def effective(beta: float) -> float:
        return float(1 / np.sum(weights(beta) ** 2))

    low, high = least, 1.0
    if effective(high) >= size:
        return 1.0, weights(1.0)
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(middle) >= size else (low, middle)
    return low, weights(low)


def _spread(simulate: Simulate, z: Array, weights: Array, rng: np.random.Generator) -> Array:
    """The standard deviation of each value among runs that differ by next to nothing,
    where the weight is: [values]."""
    centres = z[rng.choice(len(z), GROUPS, p=weights)]
    near = np.repeat(centres, IN_GROUP, axis=0)
    found = simulate(near + NEAR * rng.standard_normal(near.shape)).reshape(GROUPS, IN_GROUP, -1)
    there = np.isfinite(found).all(axis=(1, 2))
    if not there.any():
        return np.zeros(found.shape[-1])
    return np.asarray(np.sqrt(np.mean(np.var(found[there], axis=1, ddof=1), axis=0)))
