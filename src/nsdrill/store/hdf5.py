"""HDF5 files: dimension scales for xarray, checksums on all data, and readers that
validate every file.

Small variables are stored in the object headers, large ones in chunks with a
Fletcher-32 checksum. The HDF5 part is followed by a *seal*: a magic number, the length
of that part and its SHA-256. HDF5 ignores the seal, and another program that edits the
file drops it. A file whose seal does not match is rejected unread, because the HDF5
library can crash on damaged files; a file without a seal is read in a child process
first. The seal protects against accidents only, as an edited file can be sealed again.
So no reader follows a link to another file or accepts a shape that the bytes of the
file cannot fill.
"""

from __future__ import annotations

import hashlib
import math
import os
import shutil
import stat
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill.data import Array
from nsdrill.errors import FileError, option, printable
from nsdrill.files import MAKE_ROOM, reason, replacing
from nsdrill.models.leaves import words_along
from nsdrill.store.attributes import LARGEST, plain_attribute, text_attribute
from nsdrill.store.layout import stored_attributes, variable_attributes
from nsdrill.store.log import part_path
from nsdrill.store.log_header import MAGIC as LOG_MAGIC
from nsdrill.units import plain_units
from nsdrill.variables import COUNTED, FORMAT_VERSION, PROCEDURES, Axis, Variable

EDITED = "Was the file edited, or made by another version of nsdrill? Make it again."
TRANSPOSED = (
    "Another program has transposed it. Give it that order again before it is written; in xarray, "
    "of a Dataset data, "
    "data.transpose(*data.attrs['dimensions'].split(), 'peak', 'crossing', 'state', "
    "missing_dims='ignore')."
)
SIGNATURE = b"\x89HDF\r\n\x1a\n"
ZIP = b"PK\x03\x04"  # of numpy.savez
_SEAL = struct.Struct("<8sQ32s")
_SEAL_MAGIC = b"nsdrill\x1a"
# HDF5 allows 64 KiB in an object header; beyond this size, chunks take no more space
_COMPACT_BYTES = 8192
_PROBE_SECONDS = 20.0
_RATIO = 2000  # of the size of numbers to that of their stored bytes; deflate reaches 1032
_MAX_MEMBERS = 1000
_MAX_NAMES = {"procedure": len(PROCEDURES), "state": 1000}
_EXIT_TRANSPOSED = 3  # exit code of the probe: dimensions in another order than the file says
_PROBE = f"""
import os, resource, sys
resource.setrlimit(resource.RLIMIT_AS, (8 << 30, 8 << 30))
import h5py
size = os.stat(sys.argv[1]).st_size
order = []
def check_item(name, node):
    dict(node.attrs)
    if isinstance(node, h5py.Dataset):
        if node.is_virtual or node.external:
            raise ValueError(name + " lies in another file")
        if node.nbytes > {_RATIO} * size:
            raise ValueError(name + " claims more numbers than the file can hold")
        named = [dim[0].name.strip("/") if order and len(dim) else "" for dim in node.dims]
        if all(named) and [item for item in named if item in order] != [item for item in order if item in named]:
            print(name)
            sys.exit({_EXIT_TRANSPOSED})
        for part in node.iter_chunks() if node.chunks else [()]:
            node[part]
with h5py.File(sys.argv[1], "r") as file:
    check_item("/", file)
    order += str(file.attrs.get("dimensions", "")).split()
    file.visititems(check_item)
"""


@contextmanager
def writing(
    path: str | os.PathLike[str],
    remedy: Callable[[], str] = lambda: MAKE_ROOM,
    *,
    overwrite: bool = True,
    copy_of: str | os.PathLike[str] | None = None,
) -> Iterator[Any]:
    """A new HDF5 file, or a ``copy_of`` another, or of ``path`` itself, which is sealed and
    takes the name ``path`` at the end, by the rules of
    :func:`nsdrill.files.replacing`.

    The format is that of HDF5 1.10: checksums in the metadata, small headers, and names
    in the order of writing. The chunk cache, 8 MiB per variable, is off, as every chunk
    is written once and in full.
    """
    import h5py

    options = {} if copy_of else {"track_order": True}
    with replacing(path, remedy, overwrite=overwrite) as raw:
        temporary = Path(raw.name)
        if copy_of:
            with open(copy_of, "rb") as old:
                shutil.copyfileobj(old, raw)
            shutil.copymode(copy_of, temporary)
            unseal(temporary)
        raw.deferring = True
        with h5py.File(raw, "r+" if copy_of else "w", libver=("v110", "v110"), rdcc_nbytes=0, **options) as file:
            yield file
        raw.raise_error()
        seal(temporary)


def add_coordinate(file: Any, name: str, values: Any, attrs: Mapping[str, Any]) -> None:
    """Write the coordinate ``name``: values [n] as a dimension scale, one value as a
    scalar. Text becomes UTF-8."""
    import h5py

    array = np.asarray(values)
    if array.dtype.kind in "OU":
        dataset = file.create_dataset(name, data=array.astype(object), dtype=h5py.string_dtype())
    else:
        dataset = file.create_dataset(name, data=array, **_storage(array.shape, array.dtype, array.shape))
    for attribute, value in attrs.items():
        dataset.attrs[attribute] = value
    if array.ndim:
        dataset.make_scale(name)


def add_samples(file: Any, name: str, values: Array, attrs: Mapping[str, Any]) -> None:
    """Write the samples [n] of an uncertain number, as a coordinate along the existing
    scale ``sample``."""
    dataset = file.create_dataset(name, data=values, **_storage(values.shape, values.dtype, values.shape))
    for attribute, value in attrs.items():
        dataset.attrs[attribute] = value
    dataset.dims[0].attach_scale(file["sample"])


def add_variable(
    file: Any, variable: Variable, dims: tuple[str, ...], chunk: tuple[int, ...], scalars: Sequence[str] = ()
) -> Any:
    """An empty dataset for ``variable`` on the existing coordinates ``dims``, in chunks
    of shape ``chunk`` if it is large. ``scalars`` names its scalar coordinates."""
    shape = tuple(len(file[name]) for name in dims)
    kind = np.dtype(f"<{variable.dtype}")
    dataset = file.create_dataset(variable.name, shape, kind, **_storage(shape, kind, chunk))
    states = file["state"].asstr()[()].tolist() if "state" in dims else ()
    for attribute, value in variable_attributes(variable, states).items():
        dataset.attrs[attribute] = value
    if kind.kind == "f":
        dataset.attrs["_FillValue"] = kind.type(np.nan)
    if scalars:
        dataset.attrs["coordinates"] = " ".join(scalars)
    for axis, name in enumerate(dims):
        dataset.dims[axis].attach_scale(file[name])
    return dataset


def _storage(shape: tuple[int, ...], kind: np.dtype[Any], chunk: tuple[int, ...]) -> dict[str, Any]:
    """Storage options of a dataset: in the object header where it is small, else in
    compressed chunks, with checksums in both cases."""
    import h5py

    if np.prod(shape) * kind.itemsize <= _COMPACT_BYTES:
        properties = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        properties.set_layout(h5py.h5d.COMPACT)
        return {"dcpl": properties}
    return {"chunks": chunk, "shuffle": True, "compression": "gzip", "compression_opts": 2, "fletcher32": True}


def storage_of(values: Array) -> dict[str, Any]:
    """Storage options of a dataset that is written with ``values`` in one step."""
    return _storage(values.shape, values.dtype, tuple(max(1, min(n, 4096)) for n in values.shape))


def put_attributes(file: Any, attrs: Mapping[str, Any]) -> None:
    """Set root attributes, converted by
    :func:`nsdrill.store.layout.stored_attributes`."""
    for name, value in stored_attributes(attrs).items():
        file.attrs[name] = value


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


def is_sealed(path: str | os.PathLike[str]) -> bool:
    """Whether the readable file ``path`` ends in a seal of nsdrill."""
    with open(path, "rb") as file:
        return _read_seal(file)[0] is not None


_checked: set[tuple[int, ...]] = set()


def _state(path: str | os.PathLike[str]) -> tuple[int, ...] | None:
    """What changes with the bytes of the file ``path``; None where there is none."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator[Any]:
    """The HDF5 file ``path``, checked and open for reading; every error becomes a
    FileError. A file that stays as it is is checked once."""
    import h5py

    state = _state(path)
    if state not in _checked:
        check_readable(path)
    try:
        with h5py.File(path, "r") as file:
            if state not in _checked:
                check_version(path, file)
                check_plain(path, file)
            if state is not None:
                _checked.add(state)
            yield file
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError) as error:
        raise damaged(path, reason(error)) from error


def check_version(path: str | os.PathLike[str], file: Any) -> None:
    """FileError unless nsdrill made ``file``, in a format that this version reads."""
    version, kind = (plain_attribute(file.attrs, name) for name in ("format_version", "nsdrill_kind"))
    if not isinstance(kind, str) or not isinstance(version, int):
        raise FileError(f"{path}: an HDF5 file, but none of nsdrill. Give a file that nsdrill run wrote.")
    if not 1 <= version <= FORMAT_VERSION:
        raise FileError(
            f"{path}: file format {version}; this nsdrill reads formats 1 to {FORMAT_VERSION}. Use a newer nsdrill."
        )


def check_plain(path: str | os.PathLike[str], file: Any) -> None:
    """FileError unless all data are in ``file`` itself, and no dataset claims more
    numbers than its bytes can hold, so that reading takes memory in proportion to the
    size of the file."""
    import h5py

    if len(file) > _MAX_MEMBERS:
        raise damaged(path, f"it has {len(file)} datasets")
    claimed, size = 0, os.stat(path).st_size
    for name in file:
        if not isinstance(file.get(name, getlink=True), h5py.HardLink):
            raise damaged(path, f"{printable(name)} is a link to elsewhere")
        dataset = file[name]
        if not isinstance(dataset, h5py.Dataset):
            continue
        if dataset.is_virtual or dataset.external:
            raise damaged(path, f"{printable(name)} lies in another file")
        if not _refers_to_objects(dataset):
            raise damaged(path, f"{printable(name)} does not say which dimensions it has")
        chunk = math.prod(dataset.chunks) * dataset.dtype.itemsize if dataset.chunks else 0
        claims = max(dataset.nbytes, chunk)
        claimed += claims
        if claims > _RATIO * dataset.id.get_storage_size() or claimed > _RATIO * size:
            raise damaged(path, f"{printable(name)} claims more numbers than the file can hold")


def _refers_to_objects(dataset: Any) -> bool:
    """Whether the attributes by which a dataset and its dimensions refer to each other
    have the types that the HDF5 library assumes: it follows them unchecked."""
    from h5py import h5a, h5t

    kinds = {
        name: h5a.open(dataset.id, name).get_type()
        for name in (b"DIMENSION_LIST", b"REFERENCE_LIST")
        if h5a.exists(dataset.id, name)
    }
    dimensions, users = kinds.get(b"DIMENSION_LIST"), kinds.get(b"REFERENCE_LIST")
    return (
        dimensions is None or (dimensions.get_class() == h5t.VLEN and dimensions.get_super().equal(h5t.STD_REF_OBJ))
    ) and (users is None or (users.get_class() == h5t.COMPOUND and users.get_member_class(0) == h5t.REFERENCE))


def check_readable(path: str | os.PathLike[str]) -> None:
    """FileError unless ``path`` is an HDF5 file that is safe to open. Reads it once (1
    to 2 GB/s)."""
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise FileError(f"{path}: this is no file. Give a file that nsdrill run wrote.")
        with open(path, "rb") as file:
            first = file.read(16)
            length, digest = _read_seal(file)
            if length is not None and first.startswith(SIGNATURE):
                if digest != _digest(file, length):
                    raise damaged(path, "its bytes are not those that were written (SHA-256)")
                return
    except FileNotFoundError as error:
        unfinished = f" There is an unfinished run, {part_path(path)}; finish it with {option('resume')}."
        raise FileError(f"{path}: there is no such file.{unfinished if part_path(path).exists() else ''}") from error
    except (OSError, ValueError) as error:
        raise FileError(f"{path}: cannot be read: {reason(error)}.") from error
    if first == LOG_MAGIC:
        raise FileError(
            f"{path}: the log of an unfinished run, not yet a results file. Finish it with {option('resume')}."
        )
    if first.startswith(ZIP) and str(path).endswith(".part"):
        raise FileError(
            f"{path}: what is kept of an unfinished continuation or fit, which nsdrill show "
            f"describes. Finish it with {option('resume')}."
        )
    if not first.startswith(SIGNATURE):
        state = "empty" if not first else "not an HDF5 file"
        if first and str(path).endswith((".yaml", ".yml")):
            raise FileError(
                f"{path}: this is not an HDF5 file but a study, it seems. Run it first: nsdrill run {path} -o out.h5"
            )
        measured = f" Measurements are for nsdrill fit and for plot {option('data')}."
        raise FileError(
            f"{path}: this file is {state}. Give a file that nsdrill run wrote."
            f"{measured if str(path).lower().endswith('.csv') else ''}"
        )
    _probe(path)


def _probe(path: str | os.PathLike[str]) -> None:
    """Read an HDF5 file without a seal in a child process, as the HDF5 library may
    crash or hang; FileError where it does."""
    seconds = _PROBE_SECONDS + os.stat(path).st_size / 20e6  # a slow disk reads 20 MB/s
    command = [sys.executable, "-c", _PROBE, os.path.abspath(path)]
    try:
        child = subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired as error:
        raise damaged(path, "reading it does not end") from error
    if child.returncode < 0:
        raise damaged(path, f"the HDF5 library crashes on it (signal {-child.returncode})")
    if child.returncode == _EXIT_TRANSPOSED:
        raise FileError(
            f"{path}: {printable(child.stdout.strip())} has its dimensions in another order than "
            f"the attribute "
            f"dimensions says. {TRANSPOSED}"
        )
    if child.returncode:
        lines = child.stderr.strip().splitlines() or ["no reason given"]
        raise damaged(path, lines[-1])


def damaged(path: str | os.PathLike[str], why: str) -> FileError:
    """The error for a file of nsdrill that is damaged, for the reason ``why``."""
    return FileError(f"{path}: the file is damaged or incomplete: {why}. Take it from a backup or make it again.")


def _read_seal(file: Any) -> tuple[int | None, bytes]:
    """Length of the HDF5 part and its digest; (None, b"") where the open ``file`` does
    not end in a seal."""
    size = file.seek(0, os.SEEK_END)
    if size < _SEAL.size:
        return None, b""
    file.seek(size - _SEAL.size)
    magic, length, digest = _SEAL.unpack(file.read(_SEAL.size))
    return (length, digest) if magic == _SEAL_MAGIC and length == size - _SEAL.size else (None, b"")


def _digest(file: Any, length: int) -> bytes:
    """SHA-256 of the first ``length`` bytes of the open ``file``."""
    file.seek(0)
    digest = hashlib.sha256()
    while length > 0:
        piece = file.read(min(length, 1 << 20))
        digest.update(piece)
        length -= len(piece) or length
    return digest.digest()


def check_shape(path: str | os.PathLike[str], file: Any, name: str, shape: tuple[int, ...], kinds: str) -> Any:
    """The dataset ``name``; FileError unless it has this ``shape`` and a type of one of
    the ``kinds`` (letters of ``dtype.kind``)."""
    import h5py

    dataset = file.get(name)
    if not isinstance(dataset, h5py.Dataset):
        raise FileError(f"{path}: the variable {name} is missing. {EDITED}")
    if dataset.shape != shape or dataset.dtype.kind not in kinds:
        raise FileError(
            f"{path}: {name} has shape {dataset.shape} and type {dataset.dtype}; it should have "
            f"shape {shape} and "
            f"{'real' if kinds == 'f' else 'whole'} numbers. "
            + (TRANSPOSED if dataset.shape != shape and sorted(dataset.shape) == sorted(shape) else EDITED)
        )
    return dataset


def read_coordinate(path: str | os.PathLike[str], file: Any, name: str) -> Array:
    """The coordinate ``name``: array of float, int or str [n]; 0-D where it does not
    vary. The words of a choice become their places in the list of all its words."""
    import h5py

    scale, choices = file.get(name), words_along(name)
    kinds = "OS" if name in ("procedure", "state") or choices else "i" if name in COUNTED else "f"
    if not isinstance(scale, h5py.Dataset) or scale.shape is None or scale.ndim > 1 or scale.dtype.kind not in kinds:
        raise FileError(f"{path}: the coordinate {name} is missing or no list of values. Make the file again.")
    if kinds != "OS":
        values = np.asarray(scale[()])
        if not np.all(np.abs(values) <= LARGEST):
            raise FileError(f"{path}: the coordinate {name} has values that are no finite numbers. {EDITED}")
        return values
    # text can be larger than the file, as many values can share one string
    if scale.size > (len(choices) or _MAX_NAMES[name]):
        raise FileError(f"{path}: the coordinate {name} has {scale.size} values. Make the file again.")
    words = np.array(scale.asstr()[()], dtype=str)
    return places_of_words(path, name, words) if choices else words


def places_of_words(path: str | os.PathLike[str], name: str, words: Array) -> Array:
    """The places of ``words`` in the list of all words of the choice ``name``;
    FileError for other words."""
    choices = words_along(name)
    if unknown := sorted(set(np.atleast_1d(words).tolist()) - {*choices}):
        raise FileError(f"{path}: {name} is {printable(str(unknown[0]))[:40]!r}; it should be of {', '.join(choices)}.")
    return np.vectorize(choices.index, otypes=[float])(words)


def read_axes(path: str | os.PathLike[str], file: Any, attribute: str = "axes") -> tuple[Axis, ...]:
    """The swept axes other than those of the operation, in the order of the dimensions,
    as the root ``attribute`` "axes" names them; with "unknowns" the uncertain
    numbers."""
    axes = []
    for name in text_attribute(path, file, attribute).split():
        scale = file.get(name)
        attributes = (
            {} if scale is None else {item: text_attribute(path, scale, item) for item in ("key", "units", "long_name")}
        )
        if not attributes or not attributes["key"]:
            raise FileError(f"{path}: the axis {name} is missing or does not say what it is. {EDITED}")
        axes.append(Axis(attributes["key"], plain_units(attributes["units"]), attributes["long_name"]))
    return tuple(axes)
