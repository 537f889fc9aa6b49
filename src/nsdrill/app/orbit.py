"""The motion of one point of a file of branches, as a trace."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from nsdrill.app.trajectory import DEFAULT_SAMPLE, Trajectory, simulate
from nsdrill.errors import FileError, InputError
from nsdrill.models.leaves import OPERATION
from nsdrill.models.registry import described
from nsdrill.orbit.flow import RTOL
from nsdrill.store import open_branches
from nsdrill.study.keys import keys_of
from nsdrill.study.study import Study

FEWEST_SAMPLES = 400  # of one period


@dataclass(frozen=True)
class OrbitPoint:
    """A point of a file of branches: its ``number``, the ``state`` at the drive angle 0 with that angle last, its
    ``period`` [s], the ``values`` of the numbers that are continued by their keys, and the count of ``unstable``
    directions."""

    number: int
    state: np.ndarray
    period: float
    values: dict[str, float]
    unstable: int


def orbit_point(path: str | os.PathLike[str], number: int) -> tuple[OrbitPoint, dict[str, Any]]:
    """The point of this number, and the root attributes of the file."""
    data = open_branches(path)
    points = int(data.sizes["point"])
    if not 0 <= number < points:
        raise InputError(f"--point: found {number}; allowed: 0 to {points - 1}, the points of the file.")
    key = str(data.attrs.get("along_key", "rotary_speed"))
    along = str(data.attrs.get("along", "rotary_speed"))
    state = np.append(data["state"].values[number], 0.0)
    return (
        OrbitPoint(
            number, state, float(data["period"].values[number]), {key: float(data[along].values[number])},
            int(data["unstable"].values[number]),
        ),
        dict(data.attrs),
    )  # fmt: skip


def settings_for(study: Study, point: OrbitPoint) -> list[str]:
    """The numbers of the point as texts ``key=value`` for the study."""
    keys = keys_of(study.model)
    texts = []
    for key, value in point.values.items():
        leaf = keys.axes[key]
        texts.append(f"{leaf.key}={keys.leaf(leaf.key, study.resolved).text(value)}")
    return texts


def check_study(path: str | os.PathLike[str], study: Study, attrs: dict[str, Any]) -> None:
    """FileError where the branches are of another model, or have other states than the study."""
    if str(attrs.get("model")) != study.model:
        raise FileError(
            f"{path}: branches of the model {attrs.get('model')}, the study has {study.model}. Give the study that "
            "they were made from."
        )


def simulate_orbit(
    study: Study,
    path: str | os.PathLike[str],
    point: OrbitPoint,
    *,
    duration: float | None = None,
    sample: float | None = None,
) -> Trajectory:
    """The trace of the motion at ``point``, over one period or ``duration`` [s]. ``study`` has the point's numbers."""
    states = described(study.model).states(study.parameters)
    if len(states) != len(point.state):
        raise FileError(f"{path}: its motions have {len(point.state)} states, the study {len(states)}. Give the study "
                        "that the branches were made from.")  # fmt: skip
    span = point.period if duration is None else duration
    fine = replace(study, simulation=replace(study.simulation, rtol=RTOL))
    return simulate(
        fine,
        **{name: value for name, value in point.values.items() if name in OPERATION},  # type: ignore[arg-type]
        duration=span,
        sample=min(DEFAULT_SAMPLE, span / FEWEST_SAMPLES) if sample is None else sample,
        state=point.state,
    )
