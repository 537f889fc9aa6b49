"""Made-up points for the tests of the store: every bit pattern that a sweep could
leave, no physics."""

import json
import math

import numpy as np

from nsdrill.models.contents import Contents
from nsdrill.models.registry import described
from nsdrill.store import MemoryLog, pending_records, write_results
from nsdrill.variables import PROCEDURES, Axis

SHAPE = (2, 5, 3, 4)
POINTS = math.prod(SHAPE)


ROCK = Axis("bit.rock_stiffness", "N/m", "stiffness of the rock (bit.rock_stiffness)")
DRAG = Axis("mud.drag", "", "drag coefficient of the mud (mud.drag)")


def made(count, peaks, seed=0):
    """``count`` finished records with random numbers, some NaN, and every status but
    pending. The features that decide on a response are numbers that can be measured, as
    those of every run that ended well."""
    return made_of(count, Contents(peaks), seed)


def made_of(count, kept, seed=0):
    """The same with all that is ``kept``."""
    random, decide = np.random.default_rng(seed), described(kept.model).labelled
    records = pending_records(count, kept)
    for name in records.dtype.names:
        kind = records.dtype[name]
        shape = (count, *kind.shape)
        if kind.base.kind == "f":
            numbers, lacks = random.standard_normal(shape) * 1e3, random.random(shape) < 0.1
            records[name] = np.where(
                lacks & (name.removeprefix("tight_").removeprefix("long_") not in decide), np.nan, numbers
            )
        else:
            records[name] = random.integers(0, 2, shape)
    for name in {name for name in records.dtype.names if name.removeprefix("tight_").removeprefix("long_") in decide}:
        records[name] = np.abs(records[name]) / (1.0 + np.abs(records[name]))  # as measured: a share, no less than none
    for of in [name.removesuffix("bit_speed_mean") for name in records.dtype.names if name.endswith("bit_speed_mean")]:
        parts = [
            f"{of}bit_speed_{end}" for end in ("min", "mean", "max") if f"{of}bit_speed_{end}" in records.dtype.names
        ]
        for part, values in zip(parts, np.sort([records[part] for part in parts], axis=0), strict=True):
            records[part] = values
    records["status"] = random.integers(1, 5, count)
    records["steps"] = random.integers(0, 2**62, count)
    return records


def header(shape=SHAPE, **attrs):
    """A header for a grid of ``shape``; the axes are numbers that have no short decimal
    form."""
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
    log = MemoryLog(header(shape, **attrs), len(records), Contents(peaks))
    log.write(np.arange(len(records)), records)
    write_results(path, log)
    return records


def make_log(lengths, named=(), peaks=2, seed=0, returns=0, verify=False):
    """A log of random points of a grid with these ``lengths`` of its dimensions, in
    their order in memory: procedure, depth, wob, rotary_speed, then bit_rock_stiffness,
    mud_drag and start where they are given. The study names its axes in the order
    ``named``."""
    axes = tuple(axis for axis in (ROCK, DRAG) if axis.name in lengths)
    kept = Contents(peaks, returns, starts=lengths.get("start", 0), verify=verify, axes=axes)
    shape = tuple(lengths[name] for name in kept.grid)
    study = {} if not named else {"study_resolved": json.dumps({"sweep": {key: [1.0] for key in named}})}
    about = header(shape[:4], **study)
    about["coords"] |= {axis.name: np.linspace(1.0, 2.0, lengths[axis.name]) / 7.0 for axis in axes}
    about["coords"] |= {"start": list(range(lengths["start"]))} if "start" in lengths else {}
    records = made_of(math.prod(shape), kept, seed)
    log = MemoryLog(about, len(records), kept)
    log.write(np.arange(len(records)), records)
    return log
