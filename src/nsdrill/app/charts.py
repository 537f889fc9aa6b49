"""Charts of a study that need no integration: the choice of a chart and its
numbers."""

from __future__ import annotations

import difflib
import math
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from nsdrill.app.check import ends_of, operation_of
from nsdrill.data import OVERRIDES, json_text
from nsdrill.errors import InputError, Refusal, option
from nsdrill.models.leaves import OPERATION, with_values
from nsdrill.models.operation import Operation
from nsdrill.models.registry import of_all
from nsdrill.plot.registry import STUDY, kinds_of
from nsdrill.variables import dimension_of, short_key

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from nsdrill.models.numbers import CriticalSpeeds
    from nsdrill.plot.kinds.charts import Numbers
    from nsdrill.plot.look import Look
    from nsdrill.study.study import Study

VALUES = 181  # along an axis
SHALLOWEST, DEEPEST = (
    0.15,
    1.6,
)  # depths of a chart without a swept depth: share of the part above the collars, factor
LEAST_INCLINATION = math.radians(0.5)
# The function of a model that makes each chart.
MAKERS = {
    "critical-speeds": "critical_speeds",
    "buckling": "buckling_along",
    "drive-card": "drive_card",
    "drive-tuning": "drive_tuning",
}


def draw_chart(
    study: Study,
    kind: str | None,
    along: str | None = None,
    *,
    units: str = "si",
    look: Look | None = None,
    ax: Axes | None = None,
) -> Figure:
    """The chart ``kind`` of a study as a figure. InputError where the kind is unknown,
    or the study lacks the quantities that it shows."""
    from nsdrill.plot import draw
    from nsdrill.plot.kinds.charts import Chart

    numbers = chart_of(study, kind, along)
    attrs = {
        "title": study.title,
        OVERRIDES: json_text(list(study.overrides)),
        "study_resolved": json_text(study.resolved),
    }
    operation = operation_of(study)
    axis = getattr(numbers, "axis", None)
    point = {name: getattr(operation, name) for name in OPERATION if name != axis}
    return draw(Chart(numbers, attrs, point, ends_of(study, "rotary_speed")), units=units, look=look, ax=ax)


def chart_of(study: Study, kind: str | None, along: str | None = None) -> Numbers:
    """The numbers of the chart ``kind``, in SI, ``along`` an axis that the study
    sweeps; by default along the depth, ``buckling`` along the inclination of the hole.
    InputError where the kind is unknown, or the study lacks the quantities that it
    shows."""
    name = (kind or "").replace("_", "-")  # spelled like the other kinds
    known = kinds_of(STUDY)
    if name not in known:
        near = difflib.get_close_matches(name, known, n=1)
        hint = f" Did you mean {near[0]!r}?" if near else ""
        listing = "\n".join(f"  {name:<24} {one.words}" for name, one in known.items())
        found = "a study without a kind" if kind is None else f"{kind!r} with a study"
        raise InputError(f"plot kind: found {found}.{hint} Allowed of a study, which is not run:\n{listing}")
    home = study.model.charts
    if not home:
        having = ", ".join(model for model, charts in of_all(lambda model: model.charts) if charts)
        raise InputError(f"{option('kind', name)}: found a study of the model {study.model.name}; allowed: {having}.")
    charts: Any = import_module(home)
    if not hasattr(charts, MAKERS[name]):
        own = ", ".join(word for word, maker in MAKERS.items() if hasattr(charts, maker))
        raise InputError(
            f"{option('kind', name)}: found a study of the model {study.model.name}; allowed of this model: {own}."
        )
    if name in ("drive-card", "drive-tuning"):
        if along is not None:
            raise Refusal("along", f"with {option('kind', name)}, which is of one point", "with the other charts")
        modes = getattr(study.parameters, "modes", None)  # not every model has modes
        if modes is not None and modes.torsional == "frozen":
            raise InputError(f"{option('kind', name)}: found modes.torsional: frozen; allowed: a string that twists.")
        make = charts.drive_card if name == "drive-card" else charts.drive_tuning
        return make(study.parameters, operation_of(study))
    operation = operation_of(study)
    if name == "buckling" and along is None:
        angles = np.linspace(LEAST_INCLINATION, math.pi / 2, VALUES)
        return charts.buckling_by_inclination((study.parameters, operation), angles)
    key = "depth" if along is None else _axis(study, along)
    x = _values(study, key, operation)
    points = _points(study.parameters, operation, key, x)
    try:
        if name == "buckling":
            return charts.buckling_along(dimension_of(key), x, points)
        return _without_frozen(study, charts.critical_speeds(dimension_of(key), x, points))
    except ValueError as error:  # of a depth that does not reach below the collars
        raise InputError(f"{option('along')} {key}: {error}.") from error


def _axis(study: Study, along: str) -> str:
    """The key in the study of the axis ``along``; InputError where it is not swept."""
    keys = {dimension_of(key): key for key in (*study.swept, "depth")}
    wanted = dimension_of(short_key(along))
    if wanted not in keys:
        raise InputError(
            f"{option('along')}: found {along}, which the study does not sweep; allowed: "
            f"{', '.join(keys.values())}. Sweep it with "
            f"{option('set', f'sweep.{along}={{from: ..., to: ..., points: ...}}')}."
        )
    return keys[wanted]


def _values(study: Study, key: str, operation: Operation) -> np.ndarray:
    """Values [SI] along an axis between the ends of the sweep, dense enough for a
    line."""
    if key in study.swept:
        low, high = float(study.axes[key][0]), float(study.axes[key][-1])
    else:
        collars = study.parameters.drillstring.collar.length
        low = collars + SHALLOWEST * (operation.depth - collars)
        high = DEEPEST * operation.depth
    if low == high:
        raise Refusal("along", f"one value of {key} in the sweep", "two or more")
    return np.linspace(low, high, VALUES)


def _points(parameters: Any, operation: Operation, key: str, x: np.ndarray) -> Sequence[tuple[Any, Operation]]:
    if key in OPERATION:
        return [(parameters, replace(operation, **{key: float(value)})) for value in x]
    if key.startswith("initial."):
        raise Refusal("along", f"{key}, on which no chart depends", "a number of the string or the hole")
    return [(with_values(parameters, {key: float(value)}), operation) for value in x]


def _without_frozen(study: Study, chart: CriticalSpeeds) -> CriticalSpeeds:
    """``chart`` without the critical speeds of frozen motions."""
    modes, none = study.parameters.modes, chart.lateral[:0]
    if modes.lateral == "frozen":
        chart = replace(chart, lateral=none)
    if modes.torsional == "frozen":
        chart = replace(chart, torsional=none)
    if modes.axial == "frozen":
        chart = replace(chart, axial=none, axial_on_rock=none)
    return chart
