"""Operations on files."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

from nsdrill.errors import InputError, Refusal
from nsdrill.late import deferred
from nsdrill.operations.argument import Argument, Flag
from nsdrill.operations.arguments import AnyFile, CitedData, HDF5Path, ManyResults, Overwrite, Saved, SavePath

with deferred():
    from nsdrill import data as forms
    from nsdrill import store
    from nsdrill.analysis import knowledge
    from nsdrill.app import citing, conversion, datasets, labelling, picture_making, saving
    from nsdrill.app.running import combine as joining
    from nsdrill.models import registry

if TYPE_CHECKING:
    from xarray import Dataset

    from nsdrill.data import Results


def cite(
    data: CitedData = None, bibtex: Annotated[bool, Argument("Give BibTeX.", "bool", "--bibtex", kind=Flag())] = False
) -> str:
    """Say what to cite: nsdrill, the version and study that made ``data``, and the works
    behind its model.

    Returns
    -------
    str

    Raises
    ------
    FileError
        Where the file cannot be read.

    Examples
    --------
    >>> print(nsdrill.cite("out.h5").splitlines()[0])
    The nsdrill developers, nsdrill: a bifurcation explorer for coupled drill-string vibration, version 0.2.0.
    """
    if data is None:
        return citing.citation(bibtex=bibtex)
    branches = datasets.branches_in(data)
    attrs = branches.attrs if branches is not None else datasets.data_in(data, ()).attrs
    name = "" if datasets.is_dataset(data) else conversion.name_in(data)
    return citing.citation(attrs, name, bibtex=bibtex)


def combine(results: ManyResults, path: HDF5Path = None, overwrite: Overwrite = False) -> tuple[Results, str]:
    """Combine results whose studies differ in one number, which becomes an axis.

    The result equals that of a sweep of that axis, to the bit.

    Returns
    -------
    Dataset

    Raises
    ------
    InputError
        Where they differ in anything else.

    Examples
    --------
    >>> parts = [
    ...     nsdrill.run("study.yaml", set={"operation.wob": wob}, progress=False)
    ...     for wob in ("20 kN", "30 kN")
    ... ]
    >>> nsdrill.combine(parts).wob.values.tolist()
    [20000.0, 30000.0]
    """
    if isinstance(results, str) or not isinstance(results, Sequence):
        one = isinstance(results, str | os.PathLike) or datasets.is_dataset(results)
        found = "one of them" if one else f"a value of the type {type(results).__name__}"
        raise Refusal("results", found, "a list of two or more")
    if path is not None:
        path = conversion.name_in(path, "path")
        store.claim_file(path, overwrite)
    whole, key = joining.combine(results)
    if path is not None:
        saving.save(whole, path, overwrite=overwrite)
    return whole, key


def open_results(path: AnyFile) -> Dataset:
    """Open a file as a Dataset: results, a trace, branches, or the points so far of an
    unfinished run (``path.part``).

    Results are read lazily: close the Dataset after use, or use ``with``.

    Returns
    -------
    Dataset
        With units and names on every variable, in SI.

    Raises
    ------
    FileError
        Where the file cannot be read.

    Examples
    --------
    >>> with nsdrill.open_results("out.h5") as results:
    ...     print(results.rotary_speed.attrs["units"], results.rotary_speed.values[0])
    rad s-1 2.0
    """
    name = conversion.name_in(path, "path")
    kind = store.kind_of(name) if os.path.lexists(name) else None
    if kind == "results":
        return store.open_results(name)
    if kind == "branches":
        return store.open_branches(name)
    return store.to_dataset(datasets.read_any(name))


def save(data: Saved, path: SavePath, overwrite: Overwrite = False) -> None:
    """Write results, a trace, branches or a figure to a file, in one step.

    Results whose labels are not those of their features are written as changed by hand,
    which everything that is made from them says.

    Returns
    -------
    None

    Raises
    ------
    FileError
        Where the file exists, unless ``overwrite``; where the results are at other values
        than their study has.
    InputError
        For other endings, or for a Dataset that lacks variables of its kind of file or has
        further ones.

    Examples
    --------
    >>> nsdrill.save(nsdrill.open_results("out.h5"), "table.csv")
    >>> nsdrill.save(nsdrill.plot("out.h5"), "picture.pdf")
    """
    path = conversion.name_in(path, "path")
    if datasets.is_figure(data):
        picture_making.save_picture(data, path, overwrite)
        return
    if not datasets.is_dataset(data):
        raise InputError(f"save: found a value of the type {type(data).__name__}; allowed: a Dataset, or a figure.")
    if data.attrs.get("nsdrill_kind") == "branches" or "branch" in data.dims:
        store.claim_file(path, overwrite)
        store.write_branches(path, data, overwrite=overwrite)
        return
    known = {*registry.BY_NAME, *registry.IN_TRACE, knowledge.KNOWLEDGE.name}
    if extra := [str(name) for name in data.data_vars if name not in known]:
        raise InputError(
            f"the Dataset: found {', '.join(extra)}, which nsdrill does not know; allowed: its "
            f"own variables. Leave the others out with drop_vars, or write all with to_netcdf."
        )
    whole = datasets.with_own_axes(forms.IN_MEMORY, datasets.validated(store.from_dataset(data)))
    saving.save(labelling.marked(whole), path, overwrite=overwrite)
