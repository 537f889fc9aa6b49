"""The starts of a sweep, grouped by the attractor that they lead to, when all of them have
run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace

import numpy as np

from nsdrill.analysis.attractors import IF_THERE, NEEDED, label, places
from nsdrill.analysis.branch_numbers import Places, number
from nsdrill.app.experiment import Experiment
from nsdrill.data import Array
from nsdrill.models.model_description import Description
from nsdrill.models.parts import values_in_parts
from nsdrill.models.registry import model_named
from nsdrill.observe.thresholds import Attractors
from nsdrill.store import Sink, columns, points_in_block
from nsdrill.study.study import Study
from nsdrill.variables import OK

_BLOCK = 1 << 14  # starts in memory at once


def names_needed(model: Description) -> tuple[str, ...]:
    """The variables by which starts of this model are grouped; some are optional."""
    return tuple(dict.fromkeys((*NEEDED, *IF_THERE, *model.compared, *model.grouped)))


def write_attractors(experiment: Experiment, log: Sink) -> None:
    """Write the attractor of every start into the finished ``log``."""
    study, plan = experiment.study, experiment.plan
    step = points_in_block(log.contents)
    kept = {variable.name for variable in log.contents.variables}
    names = [name for name in names_needed(study.model) if name in kept]
    per_block = max(1, _BLOCK // plan.starts) * plan.starts
    ranges = [(begin, min(begin + per_block, plan.points)) for begin in range(0, plan.points, per_block)]
    numbers = _attractor_numbers(
        experiment, (columns(log, names, *ends) for ends in ranges), study.thresholds.attractors
    )
    for first in range(0, plan.points, step):
        records = log.read(first, min(first + step, plan.points))
        block = numbers[first : first + step]
        changed = np.flatnonzero((records["status"] == OK) & (records["attractor"] != block))
        records["attractor"] = block
        log.write(first + changed, records[changed])
    log.sync()


def labels_of(experiment: Experiment, variables: Mapping[str, Array], thresholds: Attractors) -> Array:
    """The attractor of each point of an experiment, on the grid, as are the
    ``variables``."""
    needed = {name: variables[name].ravel() for name in names_needed(experiment.study.model) if name in variables}
    return _attractor_numbers(experiment, [needed], thresholds).reshape(experiment.plan.grid)


def _attractor_numbers(experiment: Experiment, blocks: Iterable[Mapping[str, Array]], thresholds: Attractors) -> Array:
    """The number of the attractor of each point of an experiment: int16 [points].
    ``blocks`` have the variables of complete operating points, in order."""
    study, plan = experiment.study, experiment.plan
    groups, group_places, first = [], [], 0
    for block in blocks:
        variables = {name: values.reshape(-1, plan.starts) for name, values in block.items()}
        size = len(variables["status"])
        points = np.arange(first, first + size)
        grouping, matching = _coordinates(study, variables, plan.values(points * plan.starts))
        group = label(variables, grouping, thresholds.tolerance)
        place = places(variables, group, matching)
        groups.append(group)
        group_places.append(replace(place, point=first + place.point))
        first += size
    all_places = Places(
        *(
            np.concatenate([getattr(block_places, item.name) for block_places in group_places])
            for item in fields(Places)
        )
    )
    numbers = np.minimum(number(all_places, plan.shape, thresholds.matching), np.iinfo(np.int16).max)
    # The groups of an operating point are numbered from 1; those of all operating
    # points follow each other in ``numbers``.
    group = np.concatenate(groups)
    begin = np.searchsorted(all_places.point, np.arange(len(group)))
    chosen = np.where(group > 0, begin[:, None] + group, 0)
    return np.concatenate([[0], numbers]).astype(np.int16)[chosen].ravel()


def _coordinates(study: Study, variables: Mapping[str, Array], values: Mapping[str, Array]) -> tuple[Array, Array]:
    """The coordinates by which starts are grouped, and those by which groups are
    matched along the axes (:meth:`nsdrill.models.base.Model.coordinates`), at operating
    points with these ``values`` [points]."""
    model = model_named(study.model.name)
    places, several = [], []
    for at, there in values_in_parts(study.model, study.parameters, study.initial, values):
        place = np.arange(len(next(iter(variables.values()))))[there]
        table = model.pack(at, study.thresholds, len(place))
        here = {name: value[there] for name, value in variables.items()}
        places.append(place)
        several.append(model.coordinates(here, table))
    order = np.argsort(np.concatenate(places))
    grouping, matching = (np.concatenate(parts)[order] for parts in zip(*several, strict=True))
    return grouping, matching
