"""The trace file: one trajectory sampled in time."""

from __future__ import annotations

import os

import numpy as np

from nsdrill.data import Attributes, Trace
from nsdrill.errors import FileError
from nsdrill.models.operation import SCHEDULED
from nsdrill.models.registry import model_in
from nsdrill.store import hdf5
from nsdrill.store.layout import coordinate_attributes, plain_attributes, root_attributes
from nsdrill.store.read import Arrays, PathLike, coordinate, real_values
from nsdrill.variables import Variable

_CHUNK = 65536  # samples: 512 KiB of one variable


def write_trace(path: PathLike, trace: Trace, *, overwrite: bool = True) -> None:
    """Write ``trace`` to ``path``, in one step; NsdrillError if the disk refuses."""
    samples = len(trace.time)
    chunk = (min(_CHUNK, samples),)
    stored = trace_variables(trace)
    for variable in stored:
        if np.shape(trace.variables.get(variable.name, 0.0)) != (samples,):
            raise ValueError(f"the trace needs {variable.name}, an array of {samples} samples")
    with hdf5.writing(path, overwrite=overwrite) as file:
        hdf5.put_attributes(file, root_attributes("trace", trace.attrs))
        hdf5.add_array(file, "time", ("time",), np.asarray(trace.time, "<f8"), coordinate_attributes("time"))
        for variable in stored:
            hdf5.add_variable(file, variable, variable.dims, chunk)[...] = trace.variables[variable.name]


def trace_variables(trace: Trace) -> tuple[Variable, ...]:
    """The variables of a trace, in the order of files: all of its model, without the
    optional ones that ``trace`` lacks."""
    return tuple(v for v in model_in(trace.attrs).trace if v.only is None or v.name in trace.variables)


def read_trace(path: str | os.PathLike[str]) -> Trace:
    """The trace file ``path`` in memory; FileError if it cannot be read."""
    with hdf5.opened(path, "trace") as file:
        return trace_in(path, hdf5.arrays_in(file), plain_attributes(path, file.attrs), hdf5.EDITED)


def trace_in(where: PathLike, arrays: Arrays, attrs: Attributes, remedy: str) -> Trace:
    """The trace in the ``arrays`` of a file or a Dataset, which ``where`` names in
    messages; ``remedy`` ends them."""
    time = coordinate(where, arrays, "time", remedy)
    if time.ndim != 1 or not len(time) or not np.all(np.diff(time) > 0.0):
        raise FileError(f"{where}: the coordinate time does not ascend. {remedy}")
    variables = {}
    for variable in model_in(attrs).trace:
        name = variable.name
        # Traces of earlier versions are of one operating point, which is in their
        # attributes.
        operating = attrs.get(next((axis for axis, scheduled in SCHEDULED.items() if scheduled == name), ""))
        if name not in arrays and isinstance(operating, float):
            variables[name] = np.full(time.shape, operating)
        elif name not in arrays and variable.only is not None:
            continue
        elif name not in arrays or arrays[name].shape != time.shape:
            raise FileError(
                f"{where}: the variable {name} is missing or has no {len(time)} real numbers over time. {remedy}"
            )
        else:
            variables[name] = real_values(where, arrays[name], name, remedy)
    return Trace(time, variables, attrs)
