"""A point of a file of branches: its motion, and whether it is one of a study."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.comparison import string_differences
from nsdrill.data import Attributes, resolved_study
from nsdrill.errors import FileError, Refusal
from nsdrill.models.registry import model_in
from nsdrill.records import dataclass
from nsdrill.store import branches_of, open_branches
from nsdrill.study.study import Study
from nsdrill.study.write import changes_text

if TYPE_CHECKING:
    from xarray import Dataset

ITS_STUDY = "Give the study that the branches were made from, with its changes: nsdrill show --study prints it."


@dataclass(frozen=True)
class OrbitPoint:
    """A point of a file of branches: its ``number``, the ``state`` [states + 1] at the
    drive angle 0 with that angle last, its ``period`` [s], the ``values`` (SI) of the
    operating point and of the continued number by key, the number of ``unstable``
    multipliers, and the ``motion`` of its branch, over so many ``lobes``."""

    number: int
    state: np.ndarray
    period: float
    values: dict[str, float]
    unstable: int
    motion: str
    lobes: int


def orbit_point(path: str | os.PathLike[str] | Dataset, number: int) -> tuple[OrbitPoint, Attributes]:
    """The point of this ``number`` in a file or Dataset of branches, and the root
    attributes; InputError where there is no such point."""
    data = open_branches(path) if isinstance(path, str | os.PathLike) else branches_of(path)
    points = int(data.sizes["point"])
    if not 0 <= number < points:
        raise Refusal("point", str(number), f"0 to {points - 1}, the points of the file")
    along = str(data.attrs["along"])
    key = str(data.attrs.get("along_key", along))
    state = np.append(data["state"].values[number], 0.0)
    values = {name: float(data[name].values[number]) for name in model_in(data.attrs).operation.names() if name in data}
    values[key] = float(data[along].values[number])
    period, unstable = float(data["period"].values[number]), int(data["unstable"].values[number])
    branch = int(data["branch_of_point"].values[number])
    motion, lobes = str(data["motion"].values[branch]), int(data["lobes"].values[branch])
    return OrbitPoint(number, state, period, values, unstable, motion, lobes), dict(data.attrs)


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
            f"{path}: branches of the model {attrs.get('model')}, the study has {study.model.name}. {ITS_STUDY}"
        )
    free = {study.keys.axes[key].key for key in point.values}
    resolved = resolved_study(attrs)
    keys = [key for key, _, _ in string_differences(resolved, study.resolved, free)]
    if keys:
        changes = changes_text(resolved, study.resolved, keys)
        raise FileError(f"{path}: made from another string than that of the study ({changes}). {ITS_STUDY}")
