"""The motion of one point of a file of branches, as a trace."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nsdrill.analysis.comparison import string_differences
from nsdrill.app.trajectory import DEFAULT_SAMPLE, Trajectory, simulate
from nsdrill.data import Attributes, resolved_study
from nsdrill.errors import FileError, Refusal
from nsdrill.models.leaves import OPERATION
from nsdrill.orbit.flow import RTOL
from nsdrill.store import open_branches
from nsdrill.study.study import Study
from nsdrill.study.write import changes_text

FEWEST_SAMPLES = 400  # per period
_ITS_STUDY = "Give the study that the branches were made from, with its changes: nsdrill show --study prints it."


@dataclass(frozen=True)
class OrbitPoint:
    """A point of a file of branches: its ``number``, the ``state`` [states + 1] at the
    drive angle 0 with that angle last, its ``period`` [s], the ``values`` (SI) of the
    operating point and of the continued number by key, and the number of ``unstable``
    multipliers."""

    number: int
    state: np.ndarray
    period: float
    values: dict[str, float]
    unstable: int


def orbit_point(path: str | os.PathLike[str], number: int) -> tuple[OrbitPoint, Attributes]:
    """The point of this ``number``, and the root attributes of the file; InputError
    where there is no such point."""
    data = open_branches(path)
    points = int(data.sizes["point"])
    if not 0 <= number < points:
        raise Refusal("point", str(number), f"0 to {points - 1}, the points of the file")
    key = str(data.attrs.get("along_key", "rotary_speed"))
    along = str(data.attrs.get("along", "rotary_speed"))
    state = np.append(data["state"].values[number], 0.0)
    values = {name: float(data[name].values[number]) for name in OPERATION if name in data}
    values[key] = float(data[along].values[number])
    period, unstable = float(data["period"].values[number]), int(data["unstable"].values[number])
    return OrbitPoint(number, state, period, values, unstable), dict(data.attrs)


def trace_of(
    study: Study,
    changed: Callable[[list[str]], Study],
    path: str | os.PathLike[str],
    number: int,
    *,
    duration: float | None = None,
    sample: float | None = None,
) -> tuple[Trajectory, OrbitPoint]:
    """The trace of the motion at the point of this ``number``, over one period or
    ``duration`` [s], sampled every ``sample`` [s], and the point. ``changed`` returns
    the ``study`` with other values, texts ``key=value``. FileError where the branches
    are not those of the study's string."""
    point, attrs = orbit_point(path, number)
    here = changed(settings_for(study, point))
    check_study(path, here, point, attrs)
    return simulate_orbit(here, path, point, duration=duration, sample=sample), point


def settings_for(study: Study, point: OrbitPoint) -> list[str]:
    """The numbers of the point as texts ``key=value`` for the study."""
    keys = study.keys
    texts = []
    for key, value in point.values.items():
        leaf = keys.axes[key]
        texts.append(f"{leaf.key}={keys.leaf(leaf.key, study.resolved).text(value)}")
    return texts


def check_study(path: str | os.PathLike[str], study: Study, point: OrbitPoint, attrs: Attributes) -> None:
    """FileError where the branches and the ``study`` have different strings, apart from
    the numbers of the ``point``."""
    if str(attrs.get("model")) != study.model.name:
        raise FileError(
            f"{path}: branches of the model {attrs.get('model')}, the study has {study.model.name}. {_ITS_STUDY}"
        )
    free = {study.keys.axes[key].key for key in point.values}
    resolved = resolved_study(attrs)
    keys = [key for key, _, _ in string_differences(resolved, study.resolved, free)]
    if keys:
        changes = changes_text(resolved, study.resolved, keys)
        raise FileError(f"{path}: made from another string than that of the study ({changes}). {_ITS_STUDY}")


def simulate_orbit(
    study: Study,
    path: str | os.PathLike[str],
    point: OrbitPoint,
    *,
    duration: float | None = None,
    sample: float | None = None,
) -> Trajectory:
    """The trace of the motion at ``point``, over one period or ``duration`` [s].
    ``study`` must have the numbers of the point."""
    states = study.model.states(study.parameters)
    if len(states) != len(point.state):
        raise FileError(f"{path}: its motions have {len(point.state)} states, the study {len(states)}. {_ITS_STUDY}")
    span = point.period if duration is None else duration
    fine = replace(study, simulation=replace(study.simulation, rtol=RTOL))
    return simulate(
        fine,
        **{name: value for name, value in point.values.items() if name in OPERATION},  # type: ignore[arg-type]
        duration=span,
        sample=min(DEFAULT_SAMPLE, span / FEWEST_SAMPLES) if sample is None else sample,
        state=point.state,
    )
