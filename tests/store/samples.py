"""Made-up points for the tests of the store: every bit pattern that a sweep could leave, no physics."""

from __future__ import annotations

import math

import numpy as np

from nsdrill.store import MemoryLog, pending_records, write_results
from nsdrill.variables import PROCEDURES, Kept

SHAPE = (2, 5, 3, 4)
POINTS = math.prod(SHAPE)


def made(count, peaks, seed=0):
    """``count`` finished records with random numbers, some NaN, and every status but pending."""
    random = np.random.default_rng(seed)
    records = pending_records(count, Kept(peaks))
    for name in records.dtype.names:
        kind = records.dtype[name]
        shape = (count, *kind.shape)
        if kind.base.kind == "f":
            records[name] = np.where(random.random(shape) < 0.1, np.nan, random.standard_normal(shape) * 1e3)
        else:
            records[name] = random.integers(0, 2, shape)
    records["status"] = random.integers(1, 5, count)
    records["steps"] = random.integers(0, 2**62, count)
    return records


def header(shape=SHAPE, **attrs):
    """A header for a grid of ``shape``; the axes are numbers that have no short decimal form."""
    p, d, w, s = shape
    return {
        "coords": {
            "procedure": list(PROCEDURES[:p]),
            "depth": np.linspace(500.0, 9000.0, d) / 3.0,
            "wob": np.linspace(2e4, 6e4, w) / 7.0,
            "rotary_speed": np.linspace(1.0, 20.0, s) / 11.0,
        },
        "attrs": {"title": "made up", "study": "title: made up\n", **attrs},
    }


def make_results(path, shape=SHAPE, peaks=3, seed=0, **attrs):
    """Write a results file of random points and return its records."""
    records = made(math.prod(shape), peaks, seed)
    log = MemoryLog(header(shape, **attrs), len(records), Kept(peaks))
    log.write(np.arange(len(records)), records)
    write_results(path, log)
    return records
