"""The attractors of a sweep with several starts: grouped when all starts are there, told as plain data."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from nsdrill.analysis.attractors import IF_THERE, NEEDED, SHOWN, Attractor, describe, label
from nsdrill.data import Array, Results
from nsdrill.errors import FileError
from nsdrill.model.coefficients import derive
from nsdrill.store import Sink, columns, flag_words, points_in_block, read_results
from nsdrill.study.study import Study
from nsdrill.sweep.plan import Plan
from nsdrill.variables import BY_NAME, OK

TOLD = (*dict.fromkeys((*NEEDED, *IF_THERE, *SHOWN, "settled", "attractor")),)
_BLOCK = 1 << 14  # starts in memory at once


def mark(study: Study, plan: Plan, log: Sink) -> None:
    """Write the attractor of every start into the finished ``log``."""
    step = points_in_block(log.kept)
    names = [name for name in (*NEEDED, *IF_THERE) if log.kept.has(BY_NAME[name])]
    per_block = max(1, _BLOCK // plan.starts) * plan.starts
    for begin in range(0, plan.points, per_block):
        end = min(begin + per_block, plan.points)
        variables = {name: values.reshape(-1, plan.starts) for name, values in columns(log, names, begin, end).items()}
        found = _label(study, plan, np.arange(begin, end), variables, study.thresholds.attractors.tolerance)
        for first in range(begin, end, step):
            records = log.read(first, min(first + step, end))
            given = found[first - begin : first - begin + step]
            changed = np.flatnonzero((records["status"] == OK) & (records["attractor"] != given))
            records["attractor"] = given
            log.write(first + changed, records[changed])
    log.sync()


def labels_of(study: Study, plan: Plan, variables: Mapping[str, Array], tolerance: float) -> Array:
    """The attractors of the points of ``plan``, on the grid; ``variables`` on the grid as well."""
    needed = {name: variables[name].reshape(-1, plan.starts) for name in (*NEEDED, *IF_THERE) if name in variables}
    return _label(study, plan, np.arange(plan.points), needed, tolerance).reshape(plan.grid)


def _label(study: Study, plan: Plan, points: Array, variables: Mapping[str, Array], tolerance: float) -> Array:
    depth, wob, speed = plan.values(points[:: plan.starts]).values()
    gap = np.full(len(speed), derive(study.parameters, depth[0], wob[0], speed[0]).gap)
    return label(variables, speed, gap, tolerance).ravel()


def attractors(source: Results | str | os.PathLike[str]) -> list[dict[str, Any]]:
    """The attractors of each operating point of a results file, or of results in memory, that has several starts.

    A list with one entry for each operating point in the order of the file: ``depth`` [m], ``wob`` [N],
    ``rotary_speed`` [rad/s], the numbers of ``starts``, ``failed``, ``pending``, ``unsettled`` and ``ungrouped`` ones,
    and ``attractors``, by falling share: ``number``, ``response``, ``whirl_kind``, ``motion`` and ``period`` where
    recorded, ``members``, ``unsettled`` members, ``share`` of the starts that ended well and its 95 % interval ``low``
    to ``high`` (None in a slice, whose starts are no sample), and the median ``features`` in SI (None where not
    finite). FileError where every operating point has one start.
    """
    results = source if isinstance(source, Results) else read_results(source)
    if "start" not in results.coords:
        name = "the results" if isinstance(source, Results) else os.fspath(source)
        raise FileError(
            f"{name}: every operating point has one start, so no attractors were told apart. Run a study with "
            "initial.ensemble, say --set initial.ensemble=64.")
    starts = len(results.coords["start"])
    flat = {name: results[name].reshape(-1, starts) for name in TOLD if name in results.variables}
    sampled = not results.slice
    places = np.ndindex(*results.shape[1:-1])
    return [
        {
            **{name: float(results.coords[name][i]) for name, i in zip(results.grid[1:-1], place, strict=True)},
            **counts,
            "attractors": [plain(one, sampled) for one in found],
        }
        for place, (found, counts) in zip(places, describe(flat), strict=True)
    ]


def plain(one: Attractor, sampled: bool) -> dict[str, Any]:
    """An attractor with its labels in words."""
    data: dict[str, Any] = {
        "number": one.number,
        "response": flag_words(BY_NAME["response"], one.response),
        "whirl_kind": flag_words(BY_NAME["whirl_kind"], one.whirl_kind),
    }
    if one.motion is not None:
        data |= {"motion": flag_words(BY_NAME["motion"], one.motion), "period": one.period}
    return data | {
        "members": one.members, "unsettled": one.unsettled, "share": one.share,
        "low": one.low if sampled else None, "high": one.high if sampled else None,
        "features": {name: value if np.isfinite(value) else None for name, value in one.features.items()},
    }
