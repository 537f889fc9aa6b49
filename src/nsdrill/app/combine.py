"""Results files whose studies differ in one number, made into one file with that number
as an axis.

A point has the bits of a study of its own, so the file is the one that a sweep of that
axis would have made.
"""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from nsdrill.app.planned import plan_of
from nsdrill.app.provenance import provenance, versions
from nsdrill.data import Array, Results, resolved_study
from nsdrill.errors import InputError
from nsdrill.models.leaves import is_apart, place_of, states_of_all, word_at, words_of
from nsdrill.models.vocabulary import BY_NAME
from nsdrill.store import kind_of, read_results
from nsdrill.study.keys import Keys, keys_of
from nsdrill.study.resolved import axis_values, refined_axes, study_from_resolved
from nsdrill.study.study import Study
from nsdrill.study.written import changes, study_text, value_text
from nsdrill.variables import MODEL, POINT, dimension_of

# What all have alike, as points of one depend on others of the same file, and why.
_MUST_AGREE = {
    "sweep.procedure": "the same procedure in all. The way down of an up-down sweep begins where "
    "its way up ends, so "
    "two files are no parts of one; run it with --set sweep.procedure=up-down",
    "sweep.along": "the same axis in all, along which the state is carried",
    "sweep.refine": "the same in all, as a file has one grid",
    "uncertain": "the same samples in all, of the same unknowns. For more samples run the study "
    "with a larger "
    "uncertain.samples: the first ones are then the same",
    "initial.ensemble": "the same starts in all",
    "initial.slice": "the same starts in all",
}
NamedResults = tuple[str, Results]  # what messages call it, and the results
_MAKER_ATTRIBUTES = ("h5py_version", "python_version", "processor")


def combine(sources: Sequence[str | os.PathLike[str] | Results]) -> tuple[Results, str]:
    """The results of all ``sources``, results or their files, in one, and the key that
    became an axis. InputError where they differ in more than one number."""
    if len(sources) < 2:
        raise InputError(f"combine: found {len(sources)} file; allowed: two or more.")
    found = [_read(source, number) for number, source in enumerate(sources)]
    _check_made_alike(found)
    key, keys = _differing(found)
    if words_of(key):
        found = _with_common_variables(found)
    _check_variables(found)
    study, places = _study(found, key, keys)
    whole = _joined_results([results for _, results in found], study, places, dimension_of(key))
    names = ", ".join(name for name, _ in found)
    made = provenance(study, f"combine {names}")
    first = found[0][1].attrs
    kept = {name: first[name] for name in (*versions(), *_MAKER_ATTRIBUTES) if name in first}
    kept |= {
        name: first[name] for name in ("classification", "classification_resolved") if name in first
    }
    histories = dict.fromkeys(
        line for _, results in found for line in str(results.attrs["history"]).splitlines()
    )
    attrs = {**made, **kept, "history": "\n".join([*histories, made["history"]])}
    whole = replace(whole, attrs=attrs)
    if "points_run" in first:
        whole = replace(
            whole, attrs={**attrs, **_refinement([results.attrs for _, results in found])}
        )
    if "start" in whole.coords:  # attractors are numbered alike along the new axis, too
        from nsdrill.app.summary import relabelled

        whole = relabelled(whole, json.loads(attrs.get("classification", "[]")))
    return whole, key


def _read(source: str | os.PathLike[str] | Results, number: int) -> NamedResults:
    name = f"Dataset {number}" if isinstance(source, Results) else os.fspath(source)
    if not isinstance(source, Results) and kind_of(source) != "results":
        kind = (
            "a trace"
            if kind_of(source) == "trace"
            else "an unfinished run; finish it with --resume"
        )
        raise InputError(f"{name}: found {kind}; allowed: results of nsdrill run.")
    results = source if isinstance(source, Results) else read_results(source)
    if not resolved_study(results.attrs):
        raise InputError(f"{name}: found no study in the file; allowed: results of nsdrill run.")
    return name, results


def _check_made_alike(found: Sequence[NamedResults]) -> None:
    """InputError unless all were made by the same versions and labelled with the same
    thresholds."""
    name, first = found[0]
    for other, results in found[1:]:
        for attribute, what in (
            ("model_digest", "other versions of nsdrill or of its libraries"),
            ("classification_resolved", "labels with other thresholds"),
        ):
            if first.attrs.get(attribute) != results.attrs.get(attribute):
                raise InputError(
                    f"{other}: found {what} than in {name}; allowed: files that were made alike."
                )


def _check_variables(found: Sequence[NamedResults]) -> None:
    """InputError unless all hold the same variables, states and samples."""
    name, first = found[0]
    for other, results in found[1:]:
        if alone := sorted(set(first.variables) ^ set(results.variables)):
            few = ", ".join(alone[:4])
            raise InputError(
                f"{other}: found other variables than in {name} ({few}); allowed: the same in all."
            )
        if not np.array_equal(first.coords["state"], results.coords["state"]):
            raise InputError(
                f"{other}: found other states than in {name}; allowed: the same in all."
            )
        for unknown, values in first.drawn.items():
            if not np.array_equal(results.drawn.get(unknown, np.empty(0)), values):
                raise InputError(
                    f"{other}: found other samples of {unknown.key} than in {name}, as another "
                    f"version of SciPy may "
                    "draw; allowed: the same in all."
                )


def _differing(found: Sequence[NamedResults]) -> tuple[str, Keys]:
    """The one key of an axis in which the studies differ, as a sweep names it."""
    name, first = found[0]
    base = resolved_study(first.attrs)
    keys = keys_of(base.get("model", MODEL))
    told: dict[str, str] = {}
    for other, results in found[1:]:
        here = [
            (key, a, b)
            for key, a, b in changes(base, resolved_study(results.attrs))
            if key != "title"
        ]
        if not here:
            raise InputError(
                f"{other}: found the same study as in {name}; allowed: one that "
                f"differs in one number."
            )
        told |= {
            key: f"{key}: {_value_text(a)} in {name}, {_value_text(b)} in {other}"
            for key, a, b in here
        }
    for section, hint in _MUST_AGREE.items():
        if listed := [words for one, words in told.items() if one.startswith(section)]:
            raise InputError(f"combine: found {listed[0]}; allowed: {hint}.")
    told = {
        key: words
        for key, words in told.items()
        if key in _choices(told, keys) or not _agree_where_read(found, key, told)
    }
    if len(told) > 1:
        raise InputError(
            f"combine: found {'; '.join(told.values())}; allowed: files that differ in one number."
        )
    ((key, words),) = told.items()
    axis = key.removeprefix("sweep.").removeprefix("operation.")
    if axis not in keys.axes:
        raise InputError(
            f"combine: found {words}; allowed: a difference in a number that a sweep may vary."
        )
    if axis in base.get("uncertain", {}):
        raise InputError(
            f"combine: found {words}, which is uncertain in them; allowed: a number that is not."
        )
    sweep = base["sweep"]
    if sweep["along"] == axis:
        raise InputError(
            f"combine: found {words}, along which the state is carried; allowed: an axis beside it."
        )
    if axis in refined_axes(sweep):
        raise InputError(
            f"combine: found {words}, which is refined: where it is divided depends on all of its "
            f"values. Allowed: a "
            "number beside those that are refined; run the whole range as one study."
        )
    if is_apart(keys.model.name, axis) and sweep["procedure"] != "same":
        raise InputError(
            f"combine: found {words}, which no state is carried over; allowed: with "
            f"sweep.procedure: same."
        )
    return axis, keys


def _choices(told: Iterable[str], keys: Keys) -> set[str]:
    """Of these keys those of choices that may be an axis."""
    return {
        key
        for key in told
        if words_of(key.removeprefix("sweep.")) and key.removeprefix("sweep.") in keys.axes
    }


def _agree_where_read(found: Sequence[NamedResults], key: str, told: Mapping[str, str]) -> bool:
    """Whether the files whose strings read ``key`` have one value of it, where a word
    is among what they differ in."""
    if not any(words_of(other) for other in told):
        return False
    values = [
        value_text(resolved_study(results.attrs), key)
        for _, results in found
        if key not in _unread_keys(results)
    ]
    return len(set(values)) < 2


def _unread_keys(results: Results) -> frozenset[str]:
    """The keys that the string of a file does not read."""
    return frozenset(
        getattr(study_from_resolved(resolved_study(results.attrs)).parameters, "unread", ())
    )


def _with_common_variables(found: Sequence[NamedResults]) -> list[NamedResults]:
    """The files with the states and the numbers that any of them has, NaN in the
    others: a drive has states that another has not."""
    states = states_of_all([tuple(results.coords["state"].tolist()) for _, results in found])
    shapes = {
        name: (values.shape[len(results.shape) :], values.dtype)
        for _, results in found
        for name, values in results.variables.items()
    }
    return [(name, _filled_up(results, states, shapes)) for name, results in found]


def _filled_up(
    results: Results, states: tuple[str, ...], shapes: Mapping[str, tuple[tuple[int, ...], Any]]
) -> Results:
    places = [states.index(name) for name in results.coords["state"].tolist()]
    variables = dict(results.variables)
    for name, (own, kind) in shapes.items():
        if name not in variables and kind.kind == "f":
            variables[name] = np.full((*results.shape, *own), np.nan)
        elif BY_NAME[name].room == "states":
            variables[name] = np.full((*results.shape, len(states)), np.nan)
            variables[name][..., places] = results.variables[name]
    order = {name: variables[name] for name in [*shapes, *variables] if name in variables}
    return replace(results, coords={**results.coords, "state": np.array(states)}, variables=order)


def _value_text(value: str | None) -> str:
    return "nothing" if value is None else value


def _study(found: Sequence[NamedResults], key: str, keys: Keys) -> tuple[Study, list[Array]]:
    """The study of all, and of each file the places of its values on the new axis."""
    values = [_values(resolved_study(results.attrs), key, keys, name) for name, results in found]
    every = np.unique(np.concatenate(values))
    if len(every) < sum(map(len, values)):
        raise InputError(
            f"combine: found a value of {key} in two files; allowed: each value in one of them."
        )
    resolved = copy.deepcopy(resolved_study(found[0][1].attrs))
    if words_of(key):
        _copy_read_keys(resolved, found)
    sweep = resolved["sweep"]
    axes = {
        name: axis for name, axis in sweep.items() if name not in ("procedure", "along", "refine")
    }
    rest = {name: sweep[name] for name in sweep if name not in axes}
    whole = keys.axes[key].kind == "whole"
    told = [
        word_at(key, one) if words_of(key) else int(one) if whole else one for one in every.tolist()
    ]
    resolved["sweep"] = {**axes, key: told, **rest}
    study = study_from_resolved(resolved)
    head = [f"Made by nsdrill combine of {', '.join(name for name, _ in found)}"]
    study = replace(study, text=study_text(resolved, head), source="nsdrill combine")
    samples = {unknown.short: drawn for unknown, drawn in found[0][1].drawn.items()}
    study = replace(
        study, drawn={name: samples.get(name, drawn) for name, drawn in study.drawn.items()}
    )
    return study, [np.searchsorted(every, one) for one in values]


def _copy_read_keys(resolved: dict[str, Any], found: Sequence[NamedResults]) -> None:
    """Put into ``resolved``, that of the first file, what it does not read and another
    one does."""
    for key in _unread_keys(found[0][1]):
        readers = [results for _, results in found if key not in _unread_keys(results)]
        if readers:
            *sections, name = key.split(".")
            inside, other = resolved, resolved_study(readers[0].attrs)
            for section in sections:
                inside, other = inside[section], other[section]
            inside[name] = other[name]


def _values(resolved: dict[str, Any], key: str, keys: Keys, name: str) -> Array:
    """The values of ``key`` in a study, ascending."""
    if key in resolved["sweep"]:
        return axis_values(resolved["sweep"][key], choice=key if words_of(key) else "")
    value: Any = resolved
    for part in keys.axes[key].key.split("."):
        value = value[part]
    if value is None:
        raise InputError(f"{name}: found {key}: null; allowed: a number, as the others have.")
    return np.array([place_of(key, value) if words_of(key) else float(value)])


def _refinement(parts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The root attributes of refined sweeps together: each value of the new axis is a
    grid of its own."""
    first = parts[0]
    counts = {
        name: sum(int(one[name]) for one in parts) for name in ("points_run", "points_inferred")
    }
    return {"refine": first["refine"], **counts, "border_spacing": first["border_spacing"]}


def _joined_results(
    parts: Sequence[Results], study: Study, places: Sequence[Array], dimension: str
) -> Results:
    """All points in one set of arrays. InputError where other axes differ, by rounding
    say."""
    several = [name for name in ("sample", "start") if name in parts[0].coords]
    grid = (*POINT, *(axis.name for axis in study.more), *several)
    place = grid.index(dimension)
    plan = plan_of(study)
    for one in parts:
        for name in grid:
            wanted = plan.dimensions[name] if name in plan.dimensions else parts[0].coords[name]
            if name != dimension and not np.array_equal(one.coords[name], wanted):
                raise InputError(
                    f"combine: found other values of {name} in one of the files; allowed: the "
                    f"same in all."
                )
    order = np.argsort(np.concatenate(places), kind="stable")

    def joined(name: str) -> Array:
        arrays = [one.variables[name] for one in parts]
        arrays = [
            a if dimension in one.grid else np.expand_dims(a, place)
            for a, one in zip(arrays, parts, strict=True)
        ]
        return np.concatenate(arrays, axis=place).take(order, axis=place)

    own = {
        name: values
        for name, values in parts[0].coords.items()
        if name in ("peak", "crossing", "state")
    }
    coords = {
        name: plan.dimensions[name] if name in plan.dimensions else parts[0].coords[name]
        for name in grid
    }
    variables = {name: joined(name) for name in parts[0].variables}
    return Results({**coords, **own}, variables, {}, study.more, parts[0].drawn)
