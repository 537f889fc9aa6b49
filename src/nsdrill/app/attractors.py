"""The attractors of a sweep with several starts: grouped when all starts are there,
told as plain data."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np

from nsdrill.analysis.attractors import IF_THERE, NEEDED, Attractor, describe, label, places
from nsdrill.analysis.branches import Places, number
from nsdrill.data import IN_MEMORY, Array, Results
from nsdrill.errors import FileError
from nsdrill.models.description import Description
from nsdrill.models.leaves import as_told, in_parts, values_at
from nsdrill.models.registry import described, model_in, model_named
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.observe.thresholds import Attractors
from nsdrill.store import Sink, columns, flag_words, points_in_block, read_results
from nsdrill.study.study import Study
from nsdrill.sweep.plan import Plan
from nsdrill.variables import OK

_BLOCK = 1 << 14  # starts in memory at once


def names_needed(model: Description) -> tuple[str, ...]:
    """The variables from which starts of this model are grouped; some need not be
    there."""
    return tuple(dict.fromkeys((*NEEDED, *IF_THERE, *model.compared, *model.grouped)))


def write_attractors(study: Study, plan: Plan, log: Sink) -> None:
    """Write the attractor of every start into the finished ``log``."""
    step = points_in_block(log.kept)
    kept = {variable.name for variable in log.kept.variables}
    names = [name for name in names_needed(described(study.model)) if name in kept]
    per_block = max(1, _BLOCK // plan.starts) * plan.starts
    ranges = [
        (begin, min(begin + per_block, plan.points)) for begin in range(0, plan.points, per_block)
    ]
    found = _attractor_numbers(
        study, plan, (columns(log, names, *ends) for ends in ranges), study.thresholds.attractors
    )
    for first in range(0, plan.points, step):
        records = log.read(first, min(first + step, plan.points))
        given = found[first : first + step]
        changed = np.flatnonzero((records["status"] == OK) & (records["attractor"] != given))
        records["attractor"] = given
        log.write(first + changed, records[changed])
    log.sync()


def labels_of(
    study: Study, plan: Plan, variables: Mapping[str, Array], thresholds: Attractors
) -> Array:
    """The attractors of the points of ``plan``, on the grid; ``variables`` on the grid
    as well."""
    needed = {
        name: variables[name].ravel()
        for name in names_needed(described(study.model))
        if name in variables
    }
    return _attractor_numbers(study, plan, [needed], thresholds).reshape(plan.grid)


def _attractor_numbers(
    study: Study, plan: Plan, blocks: Iterable[Mapping[str, Array]], thresholds: Attractors
) -> Array:
    """The attractors of the points of ``plan``; ``blocks`` have the variables of whole
    operating points in turn."""
    groups, found, done = [], [], 0
    for block in blocks:
        variables = {name: values.reshape(-1, plan.starts) for name, values in block.items()}
        size = len(variables["status"])
        points = np.arange(done, done + size)
        apart, along = _coordinates(study, variables, plan.values(points * plan.starts))
        group = label(variables, apart, thresholds.tolerance)
        place = places(variables, group, along)
        groups.append(group)
        found.append(replace(place, point=done + place.point))
        done += size
    every = Places(
        *(np.concatenate([getattr(some, item.name) for some in found]) for item in fields(Places))
    )
    numbers = np.minimum(number(every, plan.shape, thresholds.matching), np.iinfo(np.int16).max)
    # The groups of an operating point are numbered from 1, and those of the next one
    # follow.
    group = np.concatenate(groups)
    begin = np.searchsorted(every.point, np.arange(len(group)))
    chosen = np.where(group > 0, begin[:, None] + group, 0)
    return np.concatenate([[0], numbers]).astype(np.int16)[chosen].ravel()


def _coordinates(
    study: Study, variables: Mapping[str, Array], values: Mapping[str, Array]
) -> tuple[Array, Array]:
    """By which starts are told apart and matched along the axes
    (:meth:`nsdrill.models.base.Model.coordinates`), at operating points with these
    ``values`` [points]."""
    model = model_named(study.model)
    places, several = [], []
    for apart, there in in_parts(study.model, values):
        at = values_at(
            study.parameters,
            study.initial,
            {key: value[there] for key, value in values.items()} | apart,
        )
        table = model.pack(at, study.thresholds)
        here = {name: value[there] for name, value in variables.items()}
        places.append(np.arange(len(values["depth"]))[there])
        several.append(model.coordinates(here, table, model.variant(at.parameters)))
    order = np.argsort(np.concatenate(places))
    one, other = (np.concatenate(parts)[order] for parts in zip(*several, strict=True))
    return one, other


def attractors(source: Results | str | os.PathLike[str]) -> list[dict[str, Any]]:
    """The attractors of each operating point of a results file, or of results in
    memory, that has several starts.

    A list with one entry for each operating point in the order of the file: ``depth``
    [m], ``wob`` [N], ``rotary_speed`` [rad/s], the numbers of ``starts``, ``failed``,
    ``pending``, ``unsettled`` and ``ungrouped`` ones, and ``attractors``, by falling
    share: ``number``, the same for one attractor in all entries, ``response``,
    ``whirl_kind``, ``motion`` and ``period`` where recorded, ``members``, ``unsettled``
    members, ``share`` of the starts that ended well and its 95 % interval ``low`` to
    ``high`` (None in a slice, whose starts are no sample), and the median ``features``
    in SI (None where not finite). FileError where every operating point has one start.
    """
    results = source if isinstance(source, Results) else read_results(source)
    if "start" not in results.coords:
        name = IN_MEMORY if isinstance(source, Results) else os.fspath(source)
        raise FileError(
            f"{name}: every operating point has one start, so no attractors were told apart. Run "
            f"a study with "
            "initial.ensemble, say --set initial.ensemble=64."
        )
    starts = len(results.coords["start"])
    told = model_in(results.attrs).told
    names = dict.fromkeys((*NEEDED, *IF_THERE, *told, "attractor"))
    flat = {name: results[name].reshape(-1, starts) for name in names if name in results.variables}
    sampled = not results.slice
    places = np.ndindex(*results.shape[1:-1])
    return [
        {
            **{
                name: as_told(name, float(results.coords[name][i]))
                for name, i in zip(results.grid[1:-1], place, strict=True)
            },
            **counts,
            "attractors": [attractor_as_data(one, sampled) for one in found],
        }
        for place, (found, counts) in zip(places, describe(flat, told), strict=True)
    ]


def attractor_as_data(one: Attractor, sampled: bool) -> dict[str, Any]:
    """An attractor with its labels in words."""
    data: dict[str, Any] = {
        "number": one.number,
        "response": flag_words(BY_NAME["response"], one.response),
        "whirl_kind": flag_words(BY_NAME["whirl_kind"], one.whirl_kind),
    }
    if one.motion is not None:
        data |= {"motion": flag_words(BY_NAME["motion"], one.motion), "period": one.period}
    return data | {
        "members": one.members,
        "unsettled": one.unsettled,
        "share": one.share,
        "low": one.low if sampled else None,
        "high": one.high if sampled else None,
        "features": {
            name: value if np.isfinite(value) else None for name, value in one.features.items()
        },
    }
