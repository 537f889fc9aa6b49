"""The file of branches: the points of all branches in one dimension, branch after
branch, as a contiguous ragged array of the CF conventions; written, and read with every
variable and attribute checked."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np

from nsdrill.analysis.bifurcations import (
    DOUBLING,
    HOPF,
    NONE,
    NOT_DECIDED,
    NOTHING_SPRINGS,
    SPRING_NOT_KNOWN,
    SPRINGS,
    UNKNOWN,
    meanings_of,
)
from nsdrill.data import Array, Attributes
from nsdrill.errors import FileError, brief
from nsdrill.files import MAKE_ROOM
from nsdrill.models.choices import further_axes
from nsdrill.models.registry import model_in, named_in
from nsdrill.store import hdf5
from nsdrill.store.dataset import opened_by_xarray
from nsdrill.store.layout import LARGEST, clean_text, plain_attributes, root_attributes
from nsdrill.variables import POINT, dimension_of, short_key

if TYPE_CHECKING:
    from xarray import DataArray, Dataset

KIND = "branches"
TEXT, WHOLE, REAL = "text", "whole numbers", "real numbers"
# The dimension of each variable and what it holds: those of branches that are needed, and
# those that all curves have.
_BRANCH = {
    "motion": TEXT,
    "lobes": WHOLE,
    "parent": WHOLE,
    "parent_point": WHOLE,
    "closed": WHOLE,
    "end_reason": TEXT,
    "row_size": WHOLE,
}
_OF_POINT = {
    "branch_of_point": WHOLE,
    "state": REAL,
    "period": REAL,
    "multiplier_real": REAL,
    "multiplier_imag": REAL,
    "unstable": WHOLE,
    "label": WHOLE,
    "arclength": REAL,
}
_CURVE = {
    "curve_label": WHOLE,
    "curve_motion": TEXT,
    "curve_lobes": WHOLE,
    "curve_end_reason": TEXT,
    "curve_row_size": WHOLE,
}
_MORE = {"label_note": TEXT, "criticality": WHOLE, "springs": WHOLE, "normal_form": REAL, "normal_form_error": REAL}
_LEAST = {
    "criticality": -1,
    "springs": SPRING_NOT_KNOWN,
    "row_size": 1,
    "curve_row_size": 1,
    "parent": -1,
    "parent_point": -1,
    "unstable": NOT_DECIDED,
    "label": -100,
    "curve_label": -100,
}
_MOST = 10**9  # of whole numbers; the least of others is 0
_NAME = "the Dataset"
_LONGEST = 500  # characters of a text


def write_branches(
    path: str | os.PathLike[str],
    data: Dataset,
    remedy: Callable[[], str] = lambda: MAKE_ROOM,
    *,
    overwrite: bool = True,
) -> None:
    """Write the Dataset ``data`` of branches to ``path``, in one step; NsdrillError, with
    ``remedy``, if the disk refuses."""
    with hdf5.writing(path, remedy, overwrite=overwrite) as file:
        hdf5.put_attributes(file, root_attributes(KIND, data.attrs))
        for name in data.dims:
            # without a coordinate xarray counts
            hdf5.add_array(file, str(name), (name,), data[name].values, data[name].attrs)
        for name in [*data.coords, *data.data_vars]:
            if name not in data.dims:
                fill = {"_FillValue": np.nan} if data[name].dtype.kind == "f" else {}
                hdf5.add_array(file, name, data[name].dims, data[name].values, {**data[name].attrs, **fill})


def open_branches(path: str | os.PathLike[str]) -> Dataset:
    """The Dataset of the branches in ``path``, in memory; FileError if it cannot be
    read as one."""
    with hdf5.opened(path, KIND) as file:
        attrs = hdf5.attributes_of(path, file)
    with opened_by_xarray(path, decode_cf=False) as dataset, dataset:
        data = dataset.load()
    for name in [*data.variables]:
        data[name].attrs.pop("_FillValue", None)
    try:
        return _checked(data, attrs)
    except _Wrong as error:
        raise FileError(f"{path}: {error}. {hdf5.EDITED}") from error


def branches_of(data: Dataset) -> Dataset:
    """The branches in a Dataset as they would be in a file; FileError where it has none."""
    try:
        return _checked(data.load(), plain_attributes(_NAME, data.attrs))
    except _Wrong as error:
        raise FileError(f"{_NAME}: {error}. Give it as nsdrill made it.") from error


class _Wrong(Exception):
    """What a file of branches should not have."""


def _checked(data: Dataset, attrs: Attributes) -> Dataset:
    """``data`` with the plain root attributes ``attrs`` and texts that can be printed;
    _Wrong where the rest of nsdrill could not use it."""
    own = {"branch", "point", "curve", "curve_point"}
    data = data.drop_vars([name for name, array in data.data_vars.items() if not own & {*array.dims[:1]}])
    along = _axis(data, attrs, "along", "point", "")
    fixed = [name for name in model_in(attrs).operation.names() if name in data.variables]
    named = named_in(attrs)
    features = [str(name) for name in data.data_vars if name in named and "point" in data[name].dims]
    if wrong := [name for name in features if data[name].ndim != 1 + len(named[name].dims[len(POINT) :])]:
        raise _Wrong(f"the variable {wrong[0]} does not have one value a point")
    data = _with(data, "branch", _BRANCH)
    data = _with(data, "point", {**_OF_POINT, **dict.fromkeys([along, *fixed, *features], REAL)})
    known = meanings_of(model_in(attrs))
    _check_parts(data, "row_size", "point", "label", known)
    for name in ("branch_of_point", "parent"):
        if np.any(data[name].values >= data.sizes["branch"]):
            raise _Wrong(f"the variable {name} has numbers of no branch")
    for name, kind in _MORE.items():
        if name not in data.variables:
            data = data.assign({name: ("point", _missing(data["label"].values, name, kind))})
    data = _with(data, "point", _MORE)
    if "curve_row_size" in data.variables:
        over = _axis(data, attrs, "over", "curve_point", "curve_")
        data = _with(data, "curve", _CURVE)
        data = _with(data, "curve_point", {f"curve_{along}": REAL, f"curve_{over}": REAL})
        _check_parts(data, "curve_row_size", "curve_point", "curve_label", known)
    data.attrs = dict(attrs)
    return data


def _axis(data: Dataset, attrs: Attributes, name: str, dim: str, prefix: str) -> str:
    """The number that the root attribute ``name`` names, whose values stand in a
    variable along ``dim``."""
    found, key = attrs.get(name), attrs.get(f"{name}_key", attrs.get(name))
    axes = {*model_in(attrs).axes, *further_axes(model_in(attrs))}
    if not isinstance(found, str) or found not in axes or dimension_of(short_key(str(key))) != found:
        words = "missing" if found is None else f"{brief(str(found))!r}, with the key {brief(str(key))!r}"
        raise _Wrong(f"the attribute {name} is {words}, and should name a number of the model")
    if f"{prefix}{found}" not in data.variables or data[f"{prefix}{found}"].dims != (dim,):
        raise _Wrong(f"the variable {prefix}{found} is missing or not along {dim}")
    return found


def _with(data: Dataset, dim: str, kinds: dict[str, str]) -> Dataset:
    """``data`` with the texts among the variables ``kinds`` along ``dim`` as they can be
    printed, and whole numbers as such; _Wrong unless all are there, hold what they should, and lie along ``dim``."""
    plain = {}
    for name, kind in kinds.items():
        if name not in data.variables:
            raise _Wrong(f"the variable {name} is missing")
        array = data[name]
        most = 2 if kind == REAL else 1
        if array.dims[:1] != (dim,) or array.ndim > most or not array.shape[0]:
            raise _Wrong(f"the variable {name} is not along {dim}, or empty")
        if kind == TEXT:
            plain[name] = (array.dims, _texts(array), array.attrs)
        elif not _are_numbers(array, kind, _LEAST.get(name, 0)):
            raise _Wrong(f"the variable {name} should have {kind} within their range")
        elif kind == WHOLE and array.dtype.kind == "f":
            plain[name] = (array.dims, array.values.astype(np.int64), array.attrs)
    return data.assign(plain)


def _missing(labels: Array, name: str, kind: str) -> Array:
    """The values of a variable of points with these ``labels`` that others than ours left
    out."""
    if kind == TEXT:
        return np.full(len(labels), "", dtype=object)
    if kind == REAL:
        return np.full(len(labels), np.nan)
    if name == "springs":
        return np.where(np.isin(labels, SPRINGS), SPRING_NOT_KNOWN, NOTHING_SPRINGS)
    return np.where(np.isin(labels, (HOPF, DOUBLING)), UNKNOWN, NONE)


def _texts(array: DataArray) -> Array:
    if array.dtype.kind not in "OUS":
        raise _Wrong(f"the variable {array.name} should have text")
    values = [clean_text(value) if isinstance(value, str | bytes) else "" for value in array.values.tolist()]
    return np.array([value[:_LONGEST] for value in values], dtype=object)


def _are_numbers(array: DataArray, kind: str, least: int) -> bool:
    values = array.values
    if kind == WHOLE:
        whole = values.dtype.kind in "iu" or (values.dtype.kind == "f" and bool(np.all(values == np.round(values))))
        return whole and bool(np.all((values >= least) & (values <= _MOST)))
    return values.dtype.kind == "f" and not np.any(np.abs(values) > LARGEST)


def _check_parts(data: Dataset, sizes: str, dim: str, labels: str, known: Iterable[int]) -> None:
    """_Wrong unless the parts with these ``sizes`` are all of ``dim``, and the
    ``labels`` are ``known``."""
    if int(data[sizes].values.sum()) != data.sizes[dim]:
        raise _Wrong(f"its {'curves' if dim == 'curve_point' else 'branches'} do not have as many points as they say")
    if unknown := sorted({int(code) for code in np.unique(data[labels].values)} - {*known}):
        raise _Wrong(f"{labels} has the code {unknown[0]}, which means nothing")
