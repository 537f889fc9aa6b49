"""How the results of a report were made: the sweep, the machine, versions and digests,
and the study."""

from __future__ import annotations

import html

import numpy as np

from nsdrill.app.overrides import study_of
from nsdrill.data import Results
from nsdrill.models.leaves import words_along
from nsdrill.plot.labels import quantity
from nsdrill.variables import AXES
from nsdrill.web.branches import Branches
from nsdrill.web.diagrams import member_dimension
from nsdrill.web.session import Session
from nsdrill.web.shown import plain, quantity_data

VERSIONS = ("python_version", "numpy_version", "llvmlite", "h5py_version", "processor", "model_digest")
Rows = list[tuple[str, str]]


def origin_rows(session: Session) -> Rows:
    """What was run and what computed it, as rows of a table."""
    meta = session.meta()
    rows: Rows = [("File", session.path), ("Model", meta["model"])]
    if session.results is not None:
        rows += _sweep(session, session.results)
    elif session.branches is not None:
        rows += _branches(session, session.branches)
    attrs = session.attrs
    software = [
        f"{name.removesuffix('_version').replace('_', ' ')} {attrs[name]}" for name in VERSIONS if name in attrs
    ]
    version = attrs.get("nsdrill_version", "")
    rows += [
        ("Changed by --set", "; ".join(meta["overrides"]) or "nothing"),
        ("Made", f"{attrs.get('created', '')} by nsdrill {version}"),
        ("With", ", ".join(software)),
        ("Study", f"SHA-256 {attrs.get('study_sha256', '')}"),
    ]
    return rows


def study_details(session: Session) -> str:
    """The study with every key, as HTML that is opened with a click."""
    text = html.escape(study_of(session.path, session.attrs))
    return f"<details><summary>The study, every key</summary><pre>{text}</pre></details>"


def _sweep(session: Session, results: Results) -> Rows:
    rows: Rows = []
    for name in results.axes:
        axis = quantity_data(name, session.units)
        values = results.coords[name] / quantity(name, session.units).scale
        if words_along(name):
            words = ", ".join(quantity(name).value(value) for value in results.coords[name])
            rows.append((axis["words"], words))
            continue
        span = f"{values[0]:.6g} to {values[-1]:.6g}" if len(values) > 1 else f"{values[0]:.6g}"
        count = f", {len(values)} values" if len(values) > 1 else ""
        rows.append((axis["words"], f"{span} {axis['unit']}".strip() + count))
    procedures = [str(name) for name in results.coords["procedure"]]
    carried = "carried " + " and ".join(procedures)
    rows.append(("State", "the same at every start" if procedures == ["same"] else carried))
    if member := member_dimension(results):
        count = f"{len(results.coords[member])} of every operating point"
        rows.append((f"{member.capitalize()}s", count))
    simulation = session.study.simulation
    times = f"{simulation.transient:g} s, then observed for {simulation.observe:g} s"
    return [*rows, ("Each run", times)]


def _branches(session: Session, branches: Branches) -> Rows:
    x = quantity(branches.along, session.units)
    ends = [float(branches.attrs.get(name, np.nan)) for name in ("continue_from", "continue_to")]
    if not np.all(np.isfinite(ends)):
        ends = [float(branches.numbers.min()), float(branches.numbers.max())]
    rows: Rows = [(f"Along {plain(x.words).lower()}", " to ".join(map(x.value, ends)))]
    for name in AXES:
        if name != branches.along and name in branches.features:
            shown = quantity(name, session.units)
            rows.append((plain(shown.words), shown.value(float(branches.features[name][0]))))
    return [*rows, ("Points", f"{len(branches.label)} on {len(branches.sizes)} branches")]
