"""The differences between two files: their studies, their origins and their
numbers."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping

from nsdrill.analysis.comparison import compare_results, compare_traces
from nsdrill.app.datasets import read_any
from nsdrill.data import Answer, Attributes, Resolved, Results, Trace, resolved_study
from nsdrill.errors import FileError
from nsdrill.store.hdf5 import EDITED
from nsdrill.study.study import IN_WORDS_ONLY
from nsdrill.study.write import changes

MAKER_ATTRIBUTES = (
    "study_sha256",
    "created",
    "nsdrill_version",
    "model_digest",
    "python",
    "python_version",
    "llvmlite",
    "numpy_version",
    "h5py_version",
    "processor",
)
RUN_ATTRIBUTE_UNITS = {
    "depth": "m",
    "wob": "N",
    "rotary_speed": "rad/s",
    "procedure": "",
    "sample": "",
    "start": "",
    "transient": "s",
    "observe": "s",
    "status": "",
    "steps": "",
    "rejected": "",
}  # attributes of a trace


def diff(a: Results | Trace | str | os.PathLike[str], b: Results | Trace | str | os.PathLike[str]) -> Answer:
    """The differences between ``a`` and ``b``, results, unfinished runs or traces, in
    memory or files, as plain data in SI units.

    ============ =======================================================================
    same_study   Whether the studies are equal, apart from the title and the units.
    same_numbers Whether all numbers are equal, to the bit.
    study        The keys that differ, with both values as in a study file (None:
                 missing); thresholds are those in force.
    run          Of traces, the attributes of the run that differ.
    made         The attributes of the origin that differ: date, versions, machine.
    kinds        The kinds of the two, ``results`` or ``trace``.
    ============ =======================================================================

    For two of one kind there are also the ``axes``, ``points``, ``responses``,
    ``variables``, ``only_a`` and ``only_b`` of
    :func:`nsdrill.analysis.comparison.compare_results` or ``compare_traces``.
    FileError for a file that cannot be read.
    """
    data_a, data_b = (data if isinstance(data, Results | Trace) else read_any(data) for data in (a, b))
    names = [
        f"Dataset {label}" if isinstance(data, Results | Trace) else os.fspath(data)
        for label, data in (("a", a), ("b", b))
    ]
    study = _study_changes(data_a, data_b, names)
    differences: Answer = {
        "kind": "diff",
        "files": names,
        "kinds": [_kind(data_a), _kind(data_b)],
        "same_study": all(row["key"] in IN_WORDS_ONLY for row in study),
        "same_numbers": False,
        "study": study,
        "run": [],
        "made": _attributes(data_a.attrs, data_b.attrs, dict.fromkeys(MAKER_ATTRIBUTES, "")),
    }
    if isinstance(data_a, Results) and isinstance(data_b, Results):
        differences |= compare_results(data_a, data_b)
    elif isinstance(data_a, Trace) and isinstance(data_b, Trace):
        differences |= {
            "run": _attributes(data_a.attrs, data_b.attrs, RUN_ATTRIBUTE_UNITS),
            **compare_traces(data_a, data_b),
        }
    else:
        return differences
    differences["same_numbers"] = (
        not differences["only_a"]
        and not differences["only_b"]
        and all(row["same"] for row in (*differences["axes"], *differences["variables"]))
    )
    return differences


def _study_changes(a: Results | Trace, b: Results | Trace, names: list[str]) -> list[Answer]:
    """The keys of the studies that differ, with both values; FileError, about these
    ``names``, where one holds no study."""
    try:
        return [{"key": key, "a": old, "b": new} for key, old, new in changes(_study(a.attrs), _study(b.attrs))]
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        where = " or ".join(names)
        raise FileError(f"{where}: study_resolved in the file does not hold a study ({error}). {EDITED}") from error


def _kind(data: Results | Trace) -> str:
    return "trace" if isinstance(data, Trace) else "results"


def _study(attrs: Attributes) -> Resolved:
    """The study of a file, with the thresholds in force; empty where the file has no
    study."""
    study = resolved_study(attrs)
    if study and "classification_resolved" in attrs:
        study["classify"] = json.loads(attrs["classification_resolved"])
    return study


def _attributes(a: Attributes, b: Attributes, units: Mapping[str, str]) -> list[Answer]:
    """The attributes that differ, as text with their units; None where one is
    missing."""

    def text(attrs: Attributes, name: str) -> str | None:
        return f"{attrs[name]} {units[name]}".strip() if name in attrs else None

    return [{"name": name, "a": text(a, name), "b": text(b, name)} for name in units if text(a, name) != text(b, name)]
