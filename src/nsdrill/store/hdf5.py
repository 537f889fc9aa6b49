"""HDF5 files: dimension scales for xarray, checksums on all data, and a seal.

Small variables are stored in the object headers, large ones in chunks with a
Fletcher-32 checksum. The HDF5 part is followed by a *seal*: a magic number, the length
of that part and its SHA-256. HDF5 ignores the seal, and another program that edits the
file drops it: a file without one is read, with a warning. A file whose seal does not
match is rejected unread, but for the status flag of a file that another program has open:
such a file is read, with a warning.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import stat
import struct
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np
from h5py import Dataset, File
from numpy.typing import ArrayLike

from nsdrill.data import EDITED_SOURCE, Attributes, edited_together, edited_words
from nsdrill.errors import FileError, FileWarning, option, printable, warn
from nsdrill.files import MAKE_ROOM, reason, replacing
from nsdrill.store import in_use
from nsdrill.store.layout import plain_attribute, plain_attributes, stored_attributes, variable_attributes
from nsdrill.store.log import part_path
from nsdrill.store.log_format import MAGIC as LOG_MAGIC
from nsdrill.variables import FORMAT_VERSION, MODEL, Variable

EDITED = "Was the file edited, or made by another version of nsdrill? Make it again."
SIGNATURE = b"\x89HDF\r\n\x1a\n"
ZIP = b"PK\x03\x04"  # of numpy.savez
# what is needed in place of another kind of file
_NEEDED = {
    "results": "a results file is needed here, which nsdrill run makes",
    "branches": "a file of branches is needed here, which nsdrill branches makes",
    "trace": "a trace file is needed here",
}
_SEAL = struct.Struct("<8sQ32s")
_SEAL_MAGIC = b"nsdrill\x1a"
# HDF5 allows 64 KiB in an object header; beyond this size, chunks take no more space
_COMPACT_BYTES = 8192
_CHUNK = 1 << 16  # values of an array that is written in one step
UNREADABLE = (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError)  # of h5py, of a damaged file


@contextmanager
def writing(
    path: str | os.PathLike[str],
    remedy: Callable[[], str] = lambda: MAKE_ROOM,
    *,
    overwrite: bool = True,
    copy_of: str | os.PathLike[str] | None = None,
) -> Iterator[File]:
    """A new HDF5 file, or a ``copy_of`` another, or of ``path`` itself, which is sealed and
    takes the name ``path`` at the end, by the rules of
    :func:`nsdrill.files.replacing`.

    The format is that of HDF5 1.10: checksums in the metadata, small headers, and names
    in the order of writing. The chunk cache, 8 MiB per variable, is off, as every chunk
    is written once and in full.
    """
    options = {} if copy_of else {"track_order": True}
    with replacing(path, remedy, overwrite=overwrite) as raw:
        temporary = Path(raw.name)
        if copy_of:
            with in_use.Reader(copy_of) as old:
                shutil.copyfileobj(old, raw)
            shutil.copymode(copy_of, temporary)
            unseal(temporary)
        raw.deferring = True
        with h5py.File(raw, "r+" if copy_of else "w", libver=("v110", "v110"), rdcc_nbytes=0, **options) as file:
            yield file
        raw.raise_error()
        seal(temporary)


def add_array(file: File, name: str, dims: Sequence[str], values: ArrayLike, attrs: Attributes) -> None:
    """Write ``values`` along the dimensions ``dims``, text as UTF-8. Along a dimension of
    its own name it becomes a dimension scale; else the scales of its dimensions
    exist."""
    array = np.asarray(values)
    if array.dtype.kind in "OU":
        dataset = file.create_dataset(name, data=array.astype(object), dtype=h5py.string_dtype())
    else:
        chunk = tuple(max(1, min(n, _CHUNK)) for n in array.shape)
        dataset = file.create_dataset(name, data=array, **_storage(array.shape, array.dtype, chunk))
    dataset.attrs.update(attrs)
    if tuple(dims) == (name,):
        dataset.make_scale(name)
    else:
        _attach_scales(file, dataset, dims)


def add_variable(
    file: File, variable: Variable, dims: tuple[str, ...], chunk: tuple[int, ...], scalars: Sequence[str] = ()
) -> Dataset:
    """An empty dataset for ``variable`` on the existing coordinates ``dims``, in chunks
    of shape ``chunk`` if it is large. ``scalars`` names its scalar coordinates."""
    shape = tuple(len(file[name]) for name in dims)
    kind = np.dtype(f"<{variable.dtype}")
    dataset = file.create_dataset(variable.name, shape, kind, **_storage(shape, kind, chunk))
    states = file["state"].asstr()[()].tolist() if "state" in dims else ()
    dataset.attrs.update(variable_attributes(variable, states, str(file.attrs.get("model") or MODEL)))
    if kind.kind == "f":
        dataset.attrs["_FillValue"] = kind.type(np.nan)
    if scalars:
        dataset.attrs["coordinates"] = " ".join(scalars)
    _attach_scales(file, dataset, dims)
    return dataset


def _attach_scales(file: File, dataset: Dataset, dims: Sequence[str]) -> None:
    for axis, name in enumerate(dims):
        dataset.dims[axis].attach_scale(file[name])


def _storage(shape: tuple[int, ...], kind: np.dtype, chunk: tuple[int, ...]) -> dict[str, object]:
    """Storage options of a dataset: in the object header where it is small, else in
    compressed chunks, with checksums in both cases."""
    if np.prod(shape) * kind.itemsize <= _COMPACT_BYTES:
        properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        properties.set_layout(h5py.h5d.COMPACT)
        return {"dcpl": properties}
    return {"chunks": chunk, "shuffle": True, "compression": "gzip", "compression_opts": 2, "fletcher32": True}


def put_attributes(file: File, attrs: Attributes) -> None:
    """Set root attributes, converted by
    :func:`nsdrill.store.layout.stored_attributes`."""
    file.attrs.update(stored_attributes(attrs))


def arrays_in(file: File) -> dict[str, Dataset]:
    """The datasets of an open file by name."""
    return {name: node for name, node in file.items() if hasattr(node, "dtype")}


def seal(path: Path) -> None:
    """Append the seal to the closed HDF5 file ``path``."""
    with open(path, "r+b") as file:
        digest = hashlib.file_digest(file, "sha256").digest()
        length = file.seek(0, os.SEEK_END)
        file.write(_SEAL.pack(_SEAL_MAGIC, length, digest))


def unseal(path: Path) -> None:
    """Remove the seal, before the HDF5 file is edited."""
    with open(path, "r+b") as file:
        length, _ = _read_seal(file)
        if length is not None:
            file.truncate(length)


_checked: dict[tuple[int, ...], bool] = {}  # files by their state, and whether their flag is set


def _state(path: str | os.PathLike[str]) -> tuple[int, ...] | None:
    """What changes with the bytes of the file ``path``; None where there is none."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


@contextmanager
def opened(path: str | os.PathLike[str], kind: str = "") -> Iterator[File]:
    """The HDF5 file ``path``, checked and open for reading; every error becomes a
    FileError, as does another ``kind`` of file, where one is given. A file that stays as
    it is is checked once."""
    state = _state(path)
    flagged = _checked.get(state) if state is not None else None
    if flagged is None:
        flagged = check_readable(path)
    try:
        with _open(path, flagged) as file:
            found = check_version(path, file.attrs)
            if kind and found != kind:
                raise FileError(f"{path}: this is a {found} file; {_NEEDED[kind]}.")
            if state is None or state not in _checked:
                _tell_if_edited(path, file)
            if state is not None:
                _checked[state] = flagged
            yield file
    except UNREADABLE as error:
        if "already open" in str(error):  # since it was checked
            raise FileError(f"{path}: {in_use.told(path)}. {in_use.remedy(path)}") from error
        raise damaged(path, reason(error)) from error


def attributes_of(path: str | os.PathLike[str], file: File, *, changed: bool = False) -> Attributes:
    """The root attributes of the open ``file`` as plain values, as :func:`plain_attributes`. That
    another program wrote or changed it stands among them, so that what is made from it says so
    too."""
    attrs = plain_attributes(path, file.attrs, changed=changed)
    if _is_sealed(path):
        return attrs
    return attrs | edited_together(attrs, further=f"{printable(Path(path).name)[:80]}, by another program")


def _is_sealed(path: str | os.PathLike[str]) -> bool:
    with open(path, "rb") as file:
        return _read_seal(file)[0] is not None


def _tell_if_edited(path: str | os.PathLike[str], file: File) -> None:
    """A FileWarning for a file that another program wrote or edited, and for one that was
    made from such a file."""
    if _is_sealed(path):
        if told := edited_words({EDITED_SOURCE: plain_attribute(file.attrs, EDITED_SOURCE)}):
            warn(f"{path}: {told}", FileWarning)
    else:
        warn(
            f"{path}: NOT SEALED: another program wrote or changed this file, so its numbers need not be those of its "
            "runs. What nsdrill writes is sealed; nsdrill.save writes a part of results.",
            FileWarning,
        )


def _open(path: str | os.PathLike[str], flagged: bool) -> File:
    if not flagged:
        try:
            return h5py.File(path, "r")
        except OSError as error:  # as on network file systems that have no locks
            if not in_use.refuses_lock(error):
                raise
    return h5py.File(in_use.Reader(path), "r")


def check_version(path: str | os.PathLike[str], attrs: Attributes) -> str:
    """The kind of the file with the root attributes ``attrs``; FileError unless nsdrill
    made it, in a format that this version reads."""
    version, kind = (plain_attribute(attrs, name) for name in ("format_version", "nsdrill_kind"))
    if not isinstance(kind, str) or not isinstance(version, int):
        raise FileError(f"{path}: an HDF5 file, but none of nsdrill. Give a file that nsdrill run wrote.")
    if version != FORMAT_VERSION:
        raise FileError(
            f"{path}: file format {version}; this nsdrill reads format {FORMAT_VERSION}. Use the nsdrill that made it."
        )
    return kind


def check_readable(path: str | os.PathLike[str]) -> bool:
    """FileError unless ``path`` is an HDF5 file whose seal, if it has one, is that of its
    bytes. Reads it once (1 to 2 GB/s). Whether its status flag is set; the bytes without
    it are then those of the seal, and a FileWarning says so."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise FileError(f"{path}: this is no file. Give a file that nsdrill run wrote.")
        with open(path, "rb") as file:
            first = file.read(in_use.SUPERBLOCK)
            flagged = in_use.without_flag(first) is not None
            length, digest = _read_seal(file)
        with in_use.Reader(path) as bytes_without_flag:
            whole = length is not None and digest == _digest(bytes_without_flag, length)
        if flagged and not whole:
            raise FileError(
                f"{path}: {in_use.told(path)}, and its data cannot be checked: they are changed, or not all on the "
                f"disk. {in_use.remedy(path)}"
            )
        if length is not None and not whole and first.startswith(SIGNATURE):
            raise damaged(path, "its bytes are not those that were written (SHA-256)")
    except FileNotFoundError as error:
        unfinished = f" There is an unfinished run, {part_path(path)}; finish it with {option('resume')}."
        raise FileError(f"{path}: there is no such file.{unfinished if part_path(path).exists() else ''}") from error
    except (OSError, ValueError) as error:
        raise FileError(f"{path}: cannot be read: {reason(error)}.") from error
    if first.startswith(LOG_MAGIC):
        raise FileError(
            f"{path}: the log of an unfinished run, not yet a results file. Finish it with {option('resume')}."
        )
    if first.startswith(ZIP) and str(path).endswith(".part"):
        raise FileError(
            f"{path}: what is kept of an unfinished continuation or fit, which nsdrill show "
            f"describes. Finish it with {option('resume')}."
        )
    if flagged:
        warn(
            f"{path}: {in_use.told(path)}. Its data are those that nsdrill wrote (SHA-256), and are read. "
            f"{in_use.remedy(path)}",
            FileWarning,
        )
    if first.startswith(SIGNATURE):
        return flagged
    if first and str(path).endswith((".yaml", ".yml")):
        raise FileError(
            f"{path}: this is not an HDF5 file but a study, it seems. Run it first: nsdrill run {path} -o out.h5"
        )
    measured = (
        f" Measurements are for nsdrill fit and for plot {option('data')}."
        if str(path).lower().endswith(".csv")
        else ""
    )
    found = "not an HDF5 file" if first else "empty"
    raise FileError(f"{path}: this file is {found}. Give a file that nsdrill run wrote.{measured}")


def to_netcdf(path: str | os.PathLike[str], path_nc: str | os.PathLike[str], *, overwrite: bool = True) -> None:
    """Copy the results file ``path`` to ``path_nc``. A results file is already a
    netCDF-4 file, HDF5 with dimension scales and no type that netCDF lacks, so its
    bytes are checked and copied; a copy of one that another program changed says so."""
    with opened(path) as file:
        attrs = attributes_of(path, file)
    if not _is_sealed(path):
        with writing(path_nc, overwrite=overwrite, copy_of=path) as changed:
            put_attributes(changed, {EDITED_SOURCE: attrs[EDITED_SOURCE]})
        return
    with replacing(path_nc, overwrite=overwrite) as copy, in_use.Reader(path) as file:
        shutil.copyfileobj(file, copy)


def damaged(path: str | os.PathLike[str], why: str) -> FileError:
    """The error for a file of nsdrill that is damaged, for the reason ``why``."""
    return FileError(f"{path}: the file is damaged or incomplete: {why}. Take it from a backup or make it again.")


def _read_seal(file: BinaryIO) -> tuple[int | None, bytes]:
    """Length of the HDF5 part and its digest; (None, b"") where the open ``file`` does
    not end in a seal."""
    size = file.seek(0, os.SEEK_END)
    if size < _SEAL.size:
        return None, b""
    file.seek(size - _SEAL.size)
    magic, length, digest = _SEAL.unpack(file.read(_SEAL.size))
    return (length, digest) if magic == _SEAL_MAGIC and length == size - _SEAL.size else (None, b"")


def _digest(file: BinaryIO | in_use.Reader, length: int) -> bytes:
    """SHA-256 of the first ``length`` bytes of the open ``file``."""
    file.seek(0)
    digest = hashlib.sha256()
    while length > 0:
        piece = file.read(min(length, 1 << 20))
        digest.update(piece)
        length -= len(piece) or length
    return digest.digest()
