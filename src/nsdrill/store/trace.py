"""The trace file: one trajectory sampled in time."""

from __future__ import annotations

import os

import numpy as np

from nsdrill.data import Trace
from nsdrill.errors import FileError
from nsdrill.models.registry import model_in
from nsdrill.store import hdf5
from nsdrill.store.attributes import LARGEST, get_attributes
from nsdrill.store.layout import coordinate_attributes, root_attributes
from nsdrill.variables import SCHEDULED, Variable

_CHUNK = 65536  # samples: 512 KiB of one variable


def write_trace(path: str | os.PathLike[str], trace: Trace, *, overwrite: bool = True) -> None:
    """Write ``trace`` to ``path``, in one step; NsdrillError if the disk refuses."""
    samples = len(trace.time)
    chunk = (min(_CHUNK, samples),)
    stored = trace_variables(trace)
    for variable in stored:
        if np.shape(trace.variables.get(variable.name, 0.0)) != (samples,):
            raise ValueError(f"the trace needs {variable.name}, an array of {samples} samples")
    with hdf5.writing(path, overwrite=overwrite) as file:
        hdf5.put_attributes(file, root_attributes("trace", trace.attrs))
        hdf5.add_coordinate(file, "time", np.asarray(trace.time, "<f8"), coordinate_attributes("time"))
        for variable in stored:
            hdf5.add_variable(file, variable, variable.dims, chunk)[...] = trace.variables[variable.name]


def trace_variables(trace: Trace) -> tuple[Variable, ...]:
    """The variables of a trace, in the order of files: all of its model, without the
    optional ones that ``trace`` lacks."""
    return tuple(v for v in model_in(trace.attrs).trace if v.only is None or v.name in trace.variables)


def read_trace(path: str | os.PathLike[str]) -> Trace:
    """The trace file ``path`` in memory; FileError if it cannot be read."""
    with hdf5.opened(path) as file:
        if file.attrs["nsdrill_kind"] != "trace":
            raise FileError(f"{path}: this is a {file.attrs['nsdrill_kind']} file; a trace file is needed here.")
        time = hdf5.read_coordinate(path, file, "time")
        if time.ndim != 1 or not len(time) or not np.all(np.isfinite(time)) or not np.all(np.diff(time) > 0.0):
            raise FileError(f"{path}: the coordinate time does not ascend. {hdf5.EDITED}")
        attrs = get_attributes(path, file)
        # Traces of earlier versions are of one operating point, which is in their
        # attributes.
        constant = {
            name: np.full(time.shape, attrs[axis])
            for axis, name in SCHEDULED.items()
            if name not in file and isinstance(attrs.get(axis), float)
        }
        variables = {
            v.name: constant[v.name]
            if v.name in constant
            else hdf5.check_shape(path, file, v.name, time.shape, "f")[()]
            for v in model_in(attrs).trace
            if v.only is None or v.name in file
        }
        for name, values in variables.items():
            if np.any(np.abs(values) > LARGEST):
                raise FileError(f"{path}: {name} has values that are no finite numbers. {hdf5.EDITED}")
        return Trace(time, variables, attrs)
