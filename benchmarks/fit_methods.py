"""Which way of adjusting unknowns has intervals as wide as they should be: the one of
nsdrill fit, and an ensemble Kalman inversion (ES-MDA, Emerick & Reynolds 2013) with
about as many runs.

    python benchmarks/fit_methods.py [CASES]

Truths are drawn from the prior, data made with noise; printed are the shares of 90 %
and 50 % intervals that hold the truth, the mean width of the intervals, and the number
of runs. Takes about a minute.
"""

from __future__ import annotations

import sys
from zlib import crc32

import numpy as np

from nsdrill.analysis.fitting import posterior

LINEAR = np.array([[1, 0.5, 0], [0, 1, 0.3], [0.2, 0, 1], [1, 1, 1], [1, -1, 0.0]])
ERRORS = {"linear": 0.3, "curved": 0.2, "threshold": 0.1, "noisy": 0.1}


def linear(z):
    return z @ LINEAR.T


def curved(z):
    return np.stack([z[:, 0] + 0.5 * z[:, 1] ** 2, np.exp(0.5 * z[:, 1]), z[:, 0] * z[:, 2], 2 * np.tanh(z[:, 2])], 1)


def threshold(z):
    jump = 1 / (1 + np.exp(-20 * (z[:, 0] - 0.3)))
    return np.stack([jump * (1 + 0.3 * z[:, 1]), z[:, 1] + 0.2 * jump, np.abs(z[:, 2]), z[:, 2] ** 2 + z[:, 0]], 1)


def noisy(z):
    rng = np.random.default_rng(crc32(z.tobytes()))
    return curved(z) + 0.3 * rng.standard_normal((len(z), 4))


def kalman(simulate, y, errors, seed, members=128, steps=5):
    """Samples of equal weight, and the number of runs."""
    rng = np.random.default_rng(seed)
    z = rng.standard_normal((members, 3))
    for _ in range(steps):
        found = simulate(z)
        away_z, away = z - z.mean(axis=0), found - found.mean(axis=0)
        inflated = steps * np.diag(errors**2)
        gain = np.linalg.solve(away.T @ away / (members - 1) + inflated, away.T @ away_z / (members - 1))
        z = z + (y + np.sqrt(steps) * errors * rng.standard_normal(found.shape) - found) @ gain
    return z, np.full(members, 1 / members), members * steps


def main(cases: int) -> None:
    for problem in (linear, curved, threshold, noisy):
        error = ERRORS[problem.__name__]
        for method in ("fit", "kalman"):
            below, widths, runs = [], [], []
            for case in range(cases):
                rng = np.random.default_rng(1000 + case)
                truth = rng.standard_normal((1, 3))
                y = problem(truth)[0]
                errors = np.full(len(y), error)
                y = y + errors * rng.standard_normal(len(y))
                if method == "fit":
                    found = posterior(problem, y, errors, 3, seed=case)
                    z, weights, count = found.z, found.weights, found.runs
                else:
                    z, weights, count = kalman(problem, y, errors, case)
                below.append(weights @ (z < truth))
                widths.append(np.sqrt(weights @ (z - weights @ z) ** 2))
                runs.append(count)
            ranks = np.array(below)
            in_90, in_50 = (100 * np.mean(np.abs(ranks - 0.5) < half) for half in (0.45, 0.25))
            print(
                f"{problem.__name__:10s} {method:7s} 90 %: {in_90:3.0f}   50 %: {in_50:3.0f}   "
                f"width {np.mean(widths):.2f}   runs {np.mean(runs):.0f}"
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
