"""What differs between two files: the studies, what they were made with, and the
numbers."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from nsdrill.analysis.comparison import compare_results, compare_traces
from nsdrill.app.reading import read_any
from nsdrill.data import Results, Trace, resolved_study
from nsdrill.errors import FileError
from nsdrill.store.hdf5 import EDITED
from nsdrill.study.written import changes

MAKER_ATTRIBUTES = (
    "study_sha256",
    "created",
    "nsdrill_version",
    "model_digest",
    "python",
    "python_version",
    "llvmlite",
    "numpy_version",
    "numba_version",
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


def diff(
    a: Results | Trace | str | os.PathLike[str], b: Results | Trace | str | os.PathLike[str]
) -> dict[str, Any]:
    """What differs between ``a`` and ``b``, results, unfinished runs or traces, in
    memory or files, as plain data in SI units.

    ``same_study`` (but for the title) and ``same_numbers``, to the bit; ``study``: the
    keys that differ, with both values as a study file has them (None: not there), the
    thresholds those in force; ``run``: the attributes of two traces that differ;
    ``made``: when, by which versions and where, as far as that differs; ``kinds`` of
    the two; and of two of one kind what
    :func:`nsdrill.analysis.comparison.compare_results` or ``compare_traces`` give:
    ``axes``, ``points``, ``responses``, ``variables``, ``only_a``, ``only_b``.
    FileError for a file that cannot be read.
    """
    one, two = (data if isinstance(data, Results | Trace) else read_any(data) for data in (a, b))
    names = [
        f"Dataset {label}" if isinstance(data, Results | Trace) else os.fspath(data)
        for label, data in (("a", a), ("b", b))
    ]
    try:
        differing = changes(_study(one.attrs), _study(two.attrs))
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        where = " or ".join(names)
        raise FileError(
            f"{where}: study_resolved in the file does not hold a study ({error}). {EDITED}"
        ) from error
    study = [{"key": key, "a": old, "b": new} for key, old, new in differing]
    found: dict[str, Any] = {
        "kind": "diff",
        "files": names,
        "kinds": [_kind(one), _kind(two)],
        "same_study": all(row["key"] == "title" for row in study),
        "same_numbers": False,
        "study": study,
        "run": [],
        "made": _attributes(one.attrs, two.attrs, dict.fromkeys(MAKER_ATTRIBUTES, "")),
    }
    if isinstance(one, Results) and isinstance(two, Results):
        found |= compare_results(one, two)
    elif isinstance(one, Trace) and isinstance(two, Trace):
        found |= {
            "run": _attributes(one.attrs, two.attrs, RUN_ATTRIBUTE_UNITS),
            **compare_traces(one, two),
        }
    else:
        return found
    found["same_numbers"] = (
        not found["only_a"]
        and not found["only_b"]
        and all(row["same"] for row in (*found["axes"], *found["variables"]))
    )
    return found


def _kind(data: Results | Trace) -> str:
    return "trace" if isinstance(data, Trace) else "results"


def _study(attrs: Mapping[str, Any]) -> dict[str, Any]:
    """The study of a file, with the thresholds in force; empty where it has none."""
    study = resolved_study(attrs)
    if study and "classification_resolved" in attrs:
        study["classify"] = json.loads(attrs["classification_resolved"])
    return study


def _attributes(
    a: Mapping[str, Any], b: Mapping[str, Any], units: Mapping[str, str]
) -> list[dict[str, Any]]:
    """The attributes that differ, as text with their units; None where one is not
    there."""

    def told(attrs: Mapping[str, Any], name: str) -> str | None:
        return f"{attrs[name]} {units[name]}".strip() if name in attrs else None

    return [
        {"name": name, "a": told(a, name), "b": told(b, name)}
        for name in units
        if told(a, name) != told(b, name)
    ]
