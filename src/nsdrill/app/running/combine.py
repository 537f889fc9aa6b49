"""Combine results files whose studies differ in one number into one file, with that
number as an axis.

The bits of a point do not depend on the other points, so the file equals that of a
sweep of that axis.
"""

from __future__ import annotations

import copy
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.counts import inexact_exponents, with_failures
from nsdrill.app.answering.summary import relabelled
from nsdrill.app.datasets import sweep_in, with_variables
from nsdrill.app.experiment import prepare, provenance, told_of_other_code, versions
from nsdrill.data import INEXACT, Array, Attributes, Resolved, Results, edited_together, found_at, resolved_study
from nsdrill.errors import InputError, count, option
from nsdrill.models.choices import place_of, word_at, words_of
from nsdrill.models.parts import states_of_all
from nsdrill.models.registry import BY_NAME
from nsdrill.store import kind_of
from nsdrill.study.forms import axis_values
from nsdrill.study.keys import Keys, keys_named
from nsdrill.study.study import IN_WORDS_ONLY, Study, refined_axes, study_from_resolved
from nsdrill.study.write import changes, study_text, value_text
from nsdrill.variables import MODEL, dimension_of, short_key

if TYPE_CHECKING:
    from nsdrill.app.datasets import Source

# Sections that must agree, as points depend on others of the same file, and why.
_MUST_AGREE = {
    "sweep.procedure": "the same procedure in all. The way down of an up-down sweep begins where "
    "its way up ends, so "
    "two files are no parts of one; run it with sweep.procedure: up-down, or all",
    "sweep.along": "the same axis in all, along which the state is carried",
    "sweep.refine": "the same in all, as a file has one grid",
    "uncertain": "the same samples in all, of the same unknowns. For more samples run the study "
    "with a larger "
    "uncertain.samples: the first ones are then the same",
    "initial.ensemble": "the same starts in all",
    "initial.slice": "the same starts in all",
}
NamedResults = tuple[str, Results]  # the name in messages, and the results
_MAKER_ATTRIBUTES = ("h5py_version", "numba_version", "compiler", "python_version", "processor", "device")


def combine(sources: Sequence[Source]) -> tuple[Results, str]:
    """The combined results of all ``sources``, results or their files, and the key that
    becomes an axis. InputError where they differ in more than one number."""
    if len(sources) < 2:
        raise InputError(f"combine: found {count(len(sources), 'file')}; allowed: two or more.")
    named = [_read(source, number) for number, source in enumerate(sources)]
    _check_made_alike(named)
    key, keys = _differing(named)
    _check_variables(named, of_words=bool(words_of(key)))
    study, places = _study(named, key, keys)
    combined = _joined_results([results for _, results in named], study, places, dimension_of(key))
    names = ", ".join(name for name, _ in named)
    first = named[0][1].attrs
    other = told_of_other_code(
        named[0][0], first, "what is combined is of that code, and attractors are numbered by the code here"
    )
    origin = provenance(study, f"combine {names}{other}")
    kept_attrs = {name: first[name] for name in (*versions(), *_MAKER_ATTRIBUTES) if name in first}
    kept_attrs |= {name: first[name] for name in ("classification", "classification_resolved") if name in first}
    histories = dict.fromkeys(line for _, results in named for line in str(results.attrs["history"]).splitlines())
    attrs = {**origin, **kept_attrs, "history": "\n".join([*histories, origin["history"]])}
    attrs |= edited_together(*(results.attrs for _, results in named))
    if told := next(filter(None, (inexact_exponents(results.attrs) for _, results in named)), ""):
        attrs[INEXACT] = told
    combined = replace(combined, attrs=attrs)
    if "points_run" in first:
        combined = replace(combined, attrs={**attrs, **_refinement([results.attrs for _, results in named])})
    if "start" in combined.coords:  # number attractors consistently along the new axis
        combined = relabelled(combined, json.loads(attrs.get("classification", "[]")))
    return combined, key


def _read(source: Source, number: int) -> NamedResults:
    name = os.fspath(source) if isinstance(source, str | os.PathLike) else f"Dataset {number}"
    if isinstance(source, str | os.PathLike) and kind_of(source) != "results":
        kind = "a trace" if kind_of(source) == "trace" else f"an unfinished run; finish it with {option('resume')}"
        raise InputError(f"{name}: found {kind}; allowed: results of nsdrill run.")
    results = sweep_in(source, "combine", ("status", "response"), None)
    with_variables(results, name, ("status", "response"))
    if not resolved_study(results.attrs):
        raise InputError(f"{name}: found no study in the file; allowed: results of nsdrill run.")
    return name, results


def _check_made_alike(named: Sequence[NamedResults]) -> None:
    """InputError unless all are from the same versions and have labels with the same
    thresholds."""
    name, first = named[0]
    for other, results in named[1:]:
        for attribute, what in (
            ("model_digest", "other versions of nsdrill or of its libraries"),
            ("classification_resolved", "labels with other thresholds"),
        ):
            if first.attrs.get(attribute) != results.attrs.get(attribute):
                raise InputError(f"{other}: found {what} than in {name}; allowed: files that were made alike.")


def _check_variables(named: Sequence[NamedResults], *, of_words: bool) -> None:
    """InputError unless all have the same variables, states and samples. Of files that
    differ in a word, as a drive, some may lack states and real variables."""
    name, first = named[0]
    for other, results in named[1:]:
        alone = sorted(set(first.variables) ^ set(results.variables))
        if alone := [one for one in alone if not of_words or not BY_NAME[one].dtype.startswith("f")]:
            few = ", ".join(alone[:4])
            raise InputError(f"{other}: found other variables than in {name} ({few}); allowed: the same in all.")
        if not of_words and not np.array_equal(first.coords["state"], results.coords["state"]):
            raise InputError(f"{other}: found other states than in {name}; allowed: the same in all.")
        for unknown, values in first.drawn.items():
            if not np.array_equal(results.drawn.get(unknown, np.empty(0)), values):
                raise InputError(
                    f"{other}: found other samples of {unknown.key} than in {name}, as another version of SciPy may "
                    "draw; allowed: the same in all."
                )


def _differing(named: Sequence[NamedResults]) -> tuple[str, Keys]:
    """The key, as in a sweep, of the one axis in which the studies differ, and the keys
    of their model."""
    name, first = named[0]
    base = resolved_study(first.attrs)
    keys = keys_named(base.get("model", MODEL))
    changed: dict[str, str] = {}
    for other, results in named[1:]:
        differences = [
            (key, a, b) for key, a, b in changes(base, resolved_study(results.attrs)) if key not in IN_WORDS_ONLY
        ]
        if not differences:
            raise InputError(f"{other}: found the same study as in {name}; allowed: one that differs in one number.")
        changed |= {key: f"{key}: {_value_text(a)} in {name}, {_value_text(b)} in {other}" for key, a, b in differences}
    for section, hint in _MUST_AGREE.items():
        if listed := [words for changed_key, words in changed.items() if changed_key.startswith(section)]:
            raise InputError(f"combine: found {listed[0]}; allowed: {hint}.")
    changed = {
        key: words
        for key, words in changed.items()
        if key in _choices(changed, keys) or not _agree_where_read(named, key, changed)
    }
    if len(changed) > 1:
        raise InputError(f"combine: found {'; '.join(changed.values())}; allowed: files that differ in one number.")
    ((key, words),) = changed.items()
    axis = short_key(key.removeprefix("sweep."))
    if axis not in keys.axes:
        raise InputError(f"combine: found {words}; allowed: a difference in a number that a sweep may vary.")
    if axis in base.get("uncertain", {}):
        raise InputError(f"combine: found {words}, which is uncertain in them; allowed: a number that is not.")
    sweep = base["sweep"]
    if sweep["along"] == axis:
        raise InputError(f"combine: found {words}, along which the state is carried; allowed: an axis beside it.")
    if axis in refined_axes(sweep):
        raise InputError(
            f"combine: found {words}, which is refined: where it is divided depends on all of its values. Allowed: a "
            "number beside those that are refined; run the whole range as one study."
        )
    return axis, keys


def _choices(changed: Iterable[str], keys: Keys) -> set[str]:
    """Those of the ``changed`` keys that are choices and may be an axis."""
    return {key for key in changed if words_of(key.removeprefix("sweep.")) and key.removeprefix("sweep.") in keys.axes}


def _agree_where_read(named: Sequence[NamedResults], key: str, changed: Mapping[str, str]) -> bool:
    """Whether the studies differ in a choice, and those whose strings read ``key``
    agree in it."""
    if not any(words_of(other) for other in changed):
        return False
    values = [
        value_text(resolved_study(results.attrs), key) for _, results in named if key not in _unread_keys(results)
    ]
    return len(set(values)) < 2


def _unread_keys(results: Results) -> frozenset[str]:
    """The keys that the string of the results does not read."""
    return frozenset(getattr(study_from_resolved(resolved_study(results.attrs)).parameters, "unread", ()))


def _value_text(value: str | None) -> str:
    return "nothing" if value is None else value


def _study(named: Sequence[NamedResults], key: str, keys: Keys) -> tuple[Study, list[Array]]:
    """The combined study, and for each file the places of its values on the new
    axis."""
    values = [_values(resolved_study(results.attrs), key, keys, name) for name, results in named]
    merged = np.unique(np.concatenate(values))
    if len(merged) < sum(map(len, values)):
        raise InputError(f"combine: found a value of {key} in two files; allowed: each value in one of them.")
    resolved = copy.deepcopy(resolved_study(named[0][1].attrs))
    if words_of(key):
        _copy_read_keys(resolved, named)
    sweep = resolved["sweep"]
    sweep_axes = {name: axis for name, axis in sweep.items() if name not in ("procedure", "along", "refine")}
    rest = {name: sweep[name] for name in sweep if name not in sweep_axes}
    is_whole = keys.axes[key].kind == "whole"
    axis = [word_at(key, one) if words_of(key) else int(one) if is_whole else one for one in merged.tolist()]
    resolved["sweep"] = {**sweep_axes, key: axis, **rest}
    study = study_from_resolved(resolved)
    head = [f"Made by nsdrill combine of {', '.join(name for name, _ in named)}"]
    study = replace(study, text=study_text(resolved, head), source="nsdrill combine")
    samples = {unknown.short: drawn for unknown, drawn in named[0][1].drawn.items()}
    study = replace(study, drawn={name: samples.get(name, drawn) for name, drawn in study.drawn.items()})
    return study, [np.searchsorted(merged, one) for one in values]


def _copy_read_keys(resolved: Resolved, named: Sequence[NamedResults]) -> None:
    """Set the keys in ``resolved``, the study of the first file, that its string does
    not read to their values in a file whose string does."""
    for key in _unread_keys(named[0][1]):
        readers = [results for _, results in named if key not in _unread_keys(results)]
        if readers:
            *sections, name = key.split(".")
            target, source = resolved, resolved_study(readers[0].attrs)
            for section in sections:
                target, source = target[section], source[section]
            target[name] = source[name]


def _values(resolved: Resolved, key: str, keys: Keys, name: str) -> Array:
    """The values of ``key`` in a study, in ascending order."""
    if key in resolved["sweep"]:
        return axis_values(resolved["sweep"][key], choice=key if words_of(key) else "")
    value = found_at(resolved, keys.axes[key].key)
    if value is None:
        raise InputError(f"{name}: found {key}: null; allowed: a number, as the others have.")
    return np.array([place_of(key, value) if words_of(key) else float(value)])


def _refinement(parts: Sequence[Attributes]) -> Attributes:
    """The root attributes of combined refined sweeps: each value of the new axis has
    its own grid."""
    first = parts[0]
    counts = {name: sum(int(one[name]) for one in parts) for name in ("points_run", "points_inferred")}
    return {"refine": first["refine"], **counts, "border_spacing": first["border_spacing"]}


def _joined_results(parts: Sequence[Results], study: Study, places: Sequence[Array], dimension: str) -> Results:
    """All points in one set of arrays, NaN for the states and variables that the string
    of a part lacks. InputError where other axes differ, for example by rounding."""
    several = [name for name in ("sample", "start") if name in parts[0].coords]
    grid = ("procedure", *study.model.axes, *(axis.name for axis in study.more), *several)
    plan, states = prepare(study).plan, states_of_all([tuple(one.coords["state"].tolist()) for one in parts])
    own = {name: values for name, values in parts[0].coords.items() if name in ("peak", "crossing")}
    coords = {name: plan.dimensions[name] if name in plan.dimensions else parts[0].coords[name] for name in grid}
    coords |= {**own, "state": np.array(states)}
    shape, axis = tuple(len(coords[name]) for name in grid), grid.index(dimension)
    variables: dict[str, Array] = {}
    for one, place in zip(parts, places, strict=True):
        axes = [name for name in grid if name != dimension]
        if other := [name for name in axes if not np.array_equal(one.coords[name], coords[name])]:
            found = f"found other values of {other[0]} in one of the files"
            raise InputError(f"combine: {found}; allowed: the same in all.")
        columns = np.array([states.index(name) for name in one.coords["state"].tolist()])
        for name, values in with_failures(one).items():
            values = values if dimension in one.grid else np.expand_dims(values, axis)
            of_states = name in BY_NAME and BY_NAME[name].origin == "states"
            if name not in variables:
                dims = (len(states),) if of_states else values.shape[len(grid) :]
                empty = np.nan if values.dtype.kind == "f" else 0
                variables[name] = np.full((*shape, *dims), empty, values.dtype)
            there = np.moveaxis(variables[name], axis, 0)  # a view
            values = np.moveaxis(values, axis, 0)
            if of_states:
                there[np.ix_(place, *map(np.arange, there.shape[1:-1]), columns)] = values
            else:
                there[place] = values
    return Results(coords, variables, {}, study.more, parts[0].drawn)
