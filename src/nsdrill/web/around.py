"""The diagram around the present point: points along one number, each run from the
present state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.data import Array
from nsdrill.errors import InputError
from nsdrill.models.registry import drawn_in
from nsdrill.variables import dimension_of
from nsdrill.web import asked
from nsdrill.web.diagrams import Reply
from nsdrill.web.shown import quantity_data
from nsdrill.web.sliders import CONTINUOUS, changes, start_state, value_at

if TYPE_CHECKING:
    from nsdrill.study.study import Study
    from nsdrill.web.source import Source

# The number of points, fewer where the string is slow to compute; the times of each
# point in s; and the half width of the diagram relative to the value.
MAX_POINTS, MIN_POINTS = 96, 12
SETTLE, OBSERVE = 60.0, 40.0
MAX_STEPS = 1.2e6  # of all points, of a string of eight states: about 1 s on few, old processors
HALF_WIDTH = 0.2


def local(session: Source, request: Mapping[str, Any]) -> Reply:
    """A diagram around the present point along ``key``; each of its points is run
    from ``state``."""
    values, key = session.values(request), asked.name(request, "key")
    leaf = session.adjustable.get(key)
    if leaf is None or leaf.kind not in CONTINUOUS:
        raise InputError(f"key: found {key}; allowed: a number of the study that has a slider.")
    with session.computing():
        study = session.motions.at(values, changes(session, request))
        state = start_state(session, request, study)
        state = session.motions.start(study) if state is None else state
        centre = float(value_at(study.resolved, leaf.key) or 0.0)
        width = asked.number(request, "wide", 0.001, 10.0, HALF_WIDTH) * (abs(centre) or 1.0)
        low, high = max(leaf.low, centre - width), min(leaf.high, centre + width)
        for end in (low, high):  # InputError where the study is not valid there
            session.motions.at(values, {**changes(session, request), key: leaf.text(end)})
        probe = session.motions.run_from(study, state, asked.DEFAULT_SECONDS, asked.DEFAULT_SECONDS)
        cost = max(1.0, len(state) / 9) * probe.steps / asked.DEFAULT_SECONDS * (SETTLE + OBSERVE)
        points = int(np.clip(MAX_STEPS / cost, MIN_POINTS, MAX_POINTS))
        x = np.linspace(low, high, points)
        columns = session.motions.run_along(study, state, key, x, settle=SETTLE, observe=OBSERVE)
    return _drawn(session, study, key, x, columns, centre, state)


def _drawn(
    session: Source, study: Study, key: str, x: Array, point_columns: Mapping[str, Array], centre: float, state: Array
) -> Reply:
    from nsdrill.analysis.outcome import outcome

    axis = quantity_data(dimension_of(key), session.units)
    head: dict[str, Any] = {
        "x": {**axis, "key": key, "values": x / axis["scale"], "log": False},
        "exact": x,
        "centre": centre / axis["scale"],
        "settle": SETTLE,
        "observe": OBSERVE,
        "panels": [],
        "procedures": ["from here"],
        "state": state,
        "states": session.motions.states(study),
    }
    columns: dict[str, Array] = {"outcome": outcome(point_columns["status"], point_columns["response"])[np.newaxis]}
    for panel in drawn_in(session.attrs).panels:
        values = point_columns[panel.peaks].copy()
        constant = np.asarray(~np.isfinite(values).any(axis=1))
        values[:, 0] = np.where(constant, point_columns[panel.greatest], values[:, 0])
        shown = quantity_data(panel.peaks, session.units)
        head["panels"].append({**shown, "mode": panel.mode, "trace": panel.trace})
        columns[panel.peaks] = values[np.newaxis] / shown["scale"]
        columns[f"{panel.peaks} constant"] = constant[np.newaxis]
    return head, columns
