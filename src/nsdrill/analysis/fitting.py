"""Bayesian calibration: samples of the unknown numbers of a study, given measurements.

The unknowns are u in the unit cube, each the cumulative probability of its prior, and
are used as z = Phi^-1(u): the prior of z is the standard normal distribution whatever
the distributions are. A model run is a function of z whose gradient is useless where
the motion is chaotic, so samples are weighted, not moved: adaptive multiple importance
sampling (Cornuet, Marin, Mira & Robert 2012). Every round draws from a mixture of
kernels about the samples so far and from the prior. The weight of a sample is prior
times likelihood over the mixture of all proposals of all rounds. Early rounds temper
the likelihood, to its power beta, so that enough samples keep a weight.

A feature of a chaotic motion differs between runs with nearly equal numbers. This
spread is measured with runs that differ by a thousandth of the width of the prior. Its
variance counts twice in the error: once for the well and once for the model.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import logsumexp, ndtri

from nsdrill.data import Array
from nsdrill.records import dataclass
from nsdrill.sampling import Uncertain, unit_samples

Simulate = Callable[[Array], Array]
"""From samples z [n, unknowns] to the values that were measured [n, values], NaN where
a run failed."""

PRIOR_SHARE = 0.2  # of the samples of a round
KERNEL_COUNT = 64
NEIGHBOUR_DISTANCE = 1e-3  # in z, between runs that measure the spread
NEIGHBOUR_GROUPS, RUNS_PER_GROUP = 4, 5
# width of the posterior over that of the prior: above it the data say nothing of an
# unknown; below it they determine it well
LEAST_GAIN, GOOD_GAIN = 0.9, 0.5
TIGHT = 0.8  # correlation of two unknowns of which the data determine a combination
AT_THE_END = 0.02  # probability of the prior at each of its ends
# A posterior that is cut off where its prior ends: its median lies in the outermost part
# of the prior, and its outer tail is this short relative to the way from there to the
# median. That of half a normal distribution is 0.10, of a whole one 1.4.
OUTERMOST, CUT_OFF = 0.2, 0.2
ONE_SETTING = 0.05  # of each, within which points share an assumed error, as within a stretch of a log
SURE = 1e-3  # probability of the misfit below which the model cannot explain the data


@dataclass(frozen=True)
class Measured:
    """Measurements at ``points``, as arrays [points] by name in SI: ``at`` are the
    values of study keys; ``values`` those of features and severities, NaN where nothing
    was measured, with their standard deviations ``errors``. ``where`` is the origin of
    each point; ``notes`` name what was left out or assumed. The errors of the names in
    ``assumed`` were not given: they are mostly those of a sensor and of the model, common
    to all points at one setting, and do not average out over them."""

    source: str
    at: dict[str, Array]
    values: dict[str, Array]
    errors: dict[str, Array]
    where: tuple[str, ...]
    notes: tuple[str, ...] = ()
    assumed: frozenset[str] = frozenset()

    @property
    def points(self) -> int:
        return len(self.where)

    @property
    def flat(self) -> tuple[Array, Array, Array]:
        """The values that were measured, their errors, and their places among all
        values, ordered by name, then by point. Values at one setting with an assumed error
        have errors with which their mean is as uncertain as one of them, and as they scatter."""
        values = np.concatenate([self.values[name] for name in self.values])
        errors = np.concatenate([self._counted(name)[0] for name in self.values])
        present = np.flatnonzero(np.isfinite(values))
        return values[present], errors[present], present

    @property
    def independent(self) -> float:
        """The number of values, of which those at one setting count together as far as their
        error is common."""
        counted = [np.where(np.isfinite(self.values[name]), self._counted(name)[1], 0.0) for name in self.values]
        return float(np.sum(counted))

    @cached_property
    def settings(self) -> Array:
        """The number of the setting of each point: that of the first point whose settings all
        are within :data:`ONE_SETTING` of its own."""
        firsts: list[Array] = []
        found = np.zeros(self.points, dtype=int)
        columns = np.array([*self.at.values()]).reshape(len(self.at), self.points)
        for point, here in enumerate(columns.T):
            same = (k for k, one in enumerate(firsts) if np.all(np.abs(here - one) <= ONE_SETTING * np.abs(one)))
            if (place := next(same, None)) is None:
                place = len(firsts)
                firsts.append(here)
            found[point] = place
        return found

    def _counted(self, name: str) -> tuple[Array, Array]:
        """(errors, counts) of the values of a name. Of n values that scatter by s about their
        mean at one setting, whose errors a are common, the mean has the variance a^2 + s^2 / n:
        that of n values with the variance n a^2 + s^2 each."""
        values, errors = self.values[name], self.errors[name]
        if name not in self.assumed:
            return errors, np.ones(self.points)
        errors, counts = errors.copy(), np.ones(self.points)
        for place in range(int(self.settings.max(initial=0)) + 1):
            rows = np.flatnonzero((self.settings == place) & np.isfinite(values))
            if (n := len(rows)) > 1:
                scatter = float(np.var(values[rows], ddof=1))
                errors[rows] = np.sqrt(n * errors[rows] ** 2 + scatter)
                counts[rows] = (1.0 + (n - 1) * scatter / errors[rows] ** 2) / n
        return errors, counts


@dataclass(frozen=True)
class Posterior:
    """Samples ``z`` [n, unknowns] with ``weights`` [n], their model values ``found``
    [n, values]; ``spread`` [values], the standard deviation among runs with nearly
    equal numbers; ``beta``, 1 where the full likelihood was reached; ``size``, the
    effective number of samples."""

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
    best: int
    """The number of the sample that has it."""

    def drawn(self, count: int, seed: int) -> Array:
        """The numbers of ``count`` samples of equal weight, by systematic
        resampling."""
        edges = np.cumsum(self.weights)
        positions = (np.random.default_rng(seed).random() + np.arange(count)) / count
        return np.minimum(np.searchsorted(edges / edges[-1], positions), len(edges) - 1)

    @property
    def mean(self) -> Array:
        """The mean of z, [unknowns]."""
        return np.asarray(self.weights @ self.z)

    @property
    def covariance(self) -> Array:
        """The covariance of z, [unknowns, unknowns]; that of the prior is the unit
        matrix."""
        deviations = self.z - self.mean
        return np.asarray((self.weights[:, None] * deviations).T @ deviations)

    @property
    def widths(self) -> Array:
        """The standard deviations of z, [unknowns]: that of the prior is 1."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlations(self) -> Array:
        """The correlations of z, [unknowns, unknowns]."""
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
    """The posterior distribution of the unknowns, given the values ``measured`` with
    standard deviations ``errors``, both [values].

    Each round has ``batch`` runs, the first twice as many. The last is that in which
    the effective number of samples reaches ``wanted`` under the full likelihood, or
    number ``rounds``. ValueError where every run of the first round failed.
    """
    rng = np.random.default_rng(seed)
    prior = Uncertain({str(i): {"uniform": [0.0, 1.0]} for i in range(unknowns)}, samples=2 * batch, seed=seed)
    z = ndtri(unit_samples(prior))
    outputs = simulate(z)
    if not np.isfinite(outputs).all(axis=1).any():
        raise ValueError("every run with values from the distributions failed")
    proposals: list[tuple[int, _Mixture | None]] = [(len(z), None)]
    spread = np.zeros(len(measured))
    beta, estimates, extra_runs = 0.0, 0, 0
    for number in range(1, rounds + 1):
        log_l = _log_likelihood(outputs, measured, errors, spread)
        log_q = _log_mixture(z, proposals)
        beta, weights = _tempered(log_l, _log_normal(z) - log_q, beta, min(wanted, 0.25 * batch))
        if estimates == 0 or (estimates == 1 and beta == 1.0):
            spread = _spread(simulate, z, weights, rng)
            estimates, beta, extra_runs = (estimates + 1, 0.0, extra_runs + NEIGHBOUR_GROUPS * RUNS_PER_GROUP)
            log_l = _log_likelihood(outputs, measured, errors, spread)
            beta, weights = _tempered(log_l, _log_normal(z) - log_q, 0.0, min(wanted, 0.25 * batch))
        size = float(1 / np.sum(weights**2))
        if (beta == 1.0 and estimates == 2 and size >= wanted) or number == rounds:
            break
        kernels = _kernels(z, weights, rng)
        prior_count = round(PRIOR_SHARE * batch)
        new = np.concatenate([rng.standard_normal((prior_count, unknowns)), kernels.draw(batch - prior_count, rng)])
        proposals += [(prior_count, None), (batch - prior_count, kernels)]
        z, outputs = np.concatenate([z, new]), np.concatenate([outputs, simulate(new)])
    failed = int(np.count_nonzero(~np.isfinite(outputs).all(axis=1)))
    variance = errors**2 + 2 * spread**2
    squares = np.where(np.isfinite(outputs).all(axis=1), np.sum((outputs - measured) ** 2 / variance, axis=1), np.inf)
    best, runs = int(squares.argmin()), len(z) + extra_runs
    return Posterior(z, weights, outputs, spread, beta, size, number, runs, failed, float(squares[best]), best)


def end_pressed(u: Array, weights: Array, width: float) -> str | None:
    """The end of its prior, "low" or "high", against which an unknown presses; None
    where it presses against neither, or the data say nothing of it. ``u`` are its
    samples as cumulative probabilities of the prior, ``width`` that of the posterior
    over that of the prior."""
    for end, outward in (("low", u), ("high", 1.0 - u)):
        if float(weights @ (outward < AT_THE_END)) > 10 * AT_THE_END:
            return end
        if width >= LEAST_GAIN:
            continue
        order = np.argsort(outward)
        edges = np.cumsum(weights[order])
        outer, median = (
            float(outward[order[min(int(np.searchsorted(edges, q)), len(edges) - 1)]]) for q in (0.05, 0.5)
        )
        if median < OUTERMOST and outer < CUT_OFF * (median - outer):
            return end
    return None


@dataclass(frozen=True)
class _Mixture:
    """Normal kernels of equal weight about ``centres`` [n, d]; ``root`` is the Cholesky
    factor of their covariance."""

    centres: Array
    root: Array

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        chosen = rng.integers(len(self.centres), size=count)
        return np.asarray(self.centres[chosen] + rng.standard_normal((count, len(self.root))) @ self.root.T)

    def log_density(self, z: Array) -> Array:
        d = len(self.root)
        scaled = solve_triangular(self.root, np.concatenate([z, self.centres]).T, lower=True).T
        distances = scaled[: len(z), None] - scaled[None, len(z) :]
        logs = -0.5 * np.sum(distances**2, axis=2)
        constant = -0.5 * d * np.log(2 * np.pi) - np.sum(np.log(np.diag(self.root))) - np.log(len(self.centres))
        return np.asarray(logsumexp(logs, axis=1) + constant)


def _kernels(z: Array, weights: Array, rng: np.random.Generator) -> _Mixture:
    """Kernels about samples, a fifth wider than by Silverman's rule (1986, eq.
    4.15)."""
    d = z.shape[1]
    mean = weights @ z
    covariance = (weights[:, None] * (z - mean)).T @ (z - mean) + 1e-8 * np.eye(d)
    size = max(1 / np.sum(weights**2), 2.0)
    width = 1.2 * (4 / ((d + 2) * min(size, KERNEL_COUNT))) ** (1 / (d + 4))
    centres = z[rng.choice(len(z), KERNEL_COUNT, p=weights)]
    return _Mixture(centres, np.linalg.cholesky(width**2 * covariance))


def _log_normal(z: Array) -> Array:
    return np.asarray(-0.5 * np.sum(z**2, axis=1) - 0.5 * z.shape[1] * np.log(2 * np.pi))


def _log_mixture(z: Array, proposals: list[tuple[int, _Mixture | None]]) -> Array:
    """The logarithm of the mixture of all ``proposals``, (number of samples, kernels),
    at ``z``; the kernels None stand for the prior."""
    total = sum(count for count, _ in proposals)
    prior = sum(count for count, kernels in proposals if kernels is None)
    logs = [np.log(prior / total) + _log_normal(z)]
    logs += [np.log(count / total) + kernels.log_density(z) for count, kernels in proposals if kernels is not None]
    return np.asarray(logsumexp(logs, axis=0))


def _log_likelihood(outputs: Array, measured: Array, errors: Array, spread: Array) -> Array:
    squares = np.sum((outputs - measured) ** 2 / (errors**2 + 2 * spread**2), axis=1)
    return np.where(np.isfinite(squares), -0.5 * squares, -np.inf)


def _tempered(log_l: Array, log_ratio: Array, min_beta: float, size: float) -> tuple[float, Array]:
    """The greatest power of the likelihood, from ``min_beta`` to 1, that leaves an
    effective number ``size`` of samples, and their weights."""

    def weights(beta: float) -> Array:
        logs = np.where(np.isfinite(log_l), beta * np.where(np.isfinite(log_l), log_l, 0.0) + log_ratio, -np.inf)
        likelihoods = np.exp(logs - logs.max())
        return np.asarray(likelihoods / likelihoods.sum())

    def effective(beta: float) -> float:
        return float(1 / np.sum(weights(beta) ** 2))

    low, high = min_beta, 1.0
    if effective(high) >= size:
        return 1.0, weights(1.0)
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if effective(middle) >= size else (low, middle)
    return low, weights(low)


def _spread(simulate: Simulate, z: Array, weights: Array, rng: np.random.Generator) -> Array:
    """The standard deviation of each value among runs with nearly equal numbers, about
    samples drawn by weight: [values]."""
    centres = z[rng.choice(len(z), NEIGHBOUR_GROUPS, p=weights)]
    neighbours = np.repeat(centres, RUNS_PER_GROUP, axis=0)
    outputs = simulate(neighbours + NEIGHBOUR_DISTANCE * rng.standard_normal(neighbours.shape)).reshape(
        NEIGHBOUR_GROUPS, RUNS_PER_GROUP, -1
    )
    succeeded = np.isfinite(outputs).all(axis=(1, 2))
    if not succeeded.any():
        return np.zeros(outputs.shape[-1])
    return np.asarray(np.sqrt(np.mean(np.var(outputs[succeeded], axis=1, ddof=1), axis=0)))
