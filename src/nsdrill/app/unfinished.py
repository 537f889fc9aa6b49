"""The state of unfinished work, in one file next to its output, which is replaced in
one step."""

from __future__ import annotations

import errno
import io
import json
import os
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Self

import numpy as np

from nsdrill import interrupt
from nsdrill.data import Answer, Array, json_text
from nsdrill.errors import FileError, NsdrillError, again, option
from nsdrill.files import lock, open_plain, reason, sweep_away, whole
from nsdrill.late import deferred
from nsdrill.store import claim_file, part_path
from nsdrill.store.hdf5 import ZIP
from nsdrill.store.log_format import MAGIC as LOG_MAGIC

with deferred():  # it imports the compiled sources, of which show needs none
    from nsdrill.app import provenance

_MAGIC = "nsdrill unfinished "
_UNREADABLE = (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile)


class Part:
    """The file ``path`` with the state of unfinished work of the kind ``what`` ("fit")
    and with this ``model``.

    It is locked from :meth:`claim` to :meth:`close`, so that no two processes do the
    same work. ``kept`` says in words which state is in it; without one it is removed at
    the end."""

    def __init__(self, path: Path, what: str, model: str) -> None:
        self.path, self.what, self.model = path, what, model
        self.kept = ""
        self._lock: io.FileIO | None = None
        self._is_temporary = False

    @classmethod
    def claim(cls, output: str | os.PathLike[str], what: str, model: str, *, overwrite: bool, resume: bool) -> Part:
        """The part file next to ``output``; with ``resume`` with the state that is in
        it. FileError where ``output`` may not be written, by the rules of ``nsdrill
        run``, or where another process is at the same work."""
        if overwrite and resume:
            raise FileError(
                f"{option('overwrite')} and {option('resume')} exclude each other: start anew, "
                f"or go on with what is there?"
            )
        claim_file(output, overwrite or resume)
        part = cls(part_path(output), what, model)
        sweep_away(part.path)
        finished, unfinished = os.path.lexists(output), os.path.lexists(part.path)
        if resume and finished and not unfinished:
            raise FileError(
                f"{output}: this {what} is finished; nothing is left to run. Start anew by {option('overwrite')}."
            )
        try:
            if unfinished:
                part._take(overwrite, resume)
            if not part.kept:
                part._begin(overwrite=unfinished)
        except BaseException:
            part.close()
            raise
        return part

    def _take(self, overwrite: bool, resume: bool) -> None:
        """Lock the existing file; FileError where it may not be replaced."""
        try:
            self._lock = open_plain(self.path, "r+")
            first = os.pread(self._lock.fileno(), len(LOG_MAGIC), 0)
        except OSError as error:
            raise FileError(f"{self.path}: cannot be opened: {reason(error)}.") from error
        lock(self._lock, self.path)
        other = f"Finish that first, move it away, or choose another {option('path')}."
        if first == LOG_MAGIC:
            raise FileError(f"{self.path}: the log of an unfinished run, no {self.what}. {other}")
        if first and not first.startswith(ZIP):
            raise FileError(
                f"{self.path}: this is no unfinished {self.what} of nsdrill, though it has the "
                f"name of one. Move it away or choose another {option('path')}."
            )
        try:
            head = _head(self.path)
        except _UNREADABLE as error:
            if not overwrite:
                raise _damaged(self.path, self.what, error) from error
            return
        if head["magic"] != _MAGIC + self.what:
            found = head["magic"].removeprefix(_MAGIC)
            raise FileError(f"{self.path}: an unfinished {found}, no {self.what}. {other}")
        if head["kept"] and not (overwrite or resume):
            raise FileError(
                f"{self.path}: an unfinished {self.what} is there. Go on with it by {option('resume')}, or "
                f"start anew by {option('overwrite')}."
            )
        if resume:
            self.kept = head["kept"]

    def _begin(self, *, overwrite: bool) -> None:
        try:
            self._replace("", None, {}, "", overwrite)
        except FileExistsError:
            self._take(False, False)  # made since :meth:`claim` looked, and in use
        interrupt.unfinished_files.add(str(self.path))
        self._is_temporary = True

    def write(self, digest: str, data: object, arrays: Mapping[str, Array], kept: str) -> None:
        """Replace the file, in one step, by one with ``arrays`` and plain ``data``, from
        inputs with this ``digest``; ``kept`` says in words what that is.

        The process goes on after this file, so an interrupt still takes effect."""
        self._replace(digest, data, arrays, kept, True)
        self.kept, self._is_temporary = kept, False
        interrupt.unfinished_files.discard(str(self.path))

    def _replace(self, digest: str, data: object, arrays: Mapping[str, Array], kept: str, overwrite: bool) -> None:
        # late: it imports the compiler
        head = {
            "magic": _MAGIC + self.what,
            "digest": digest,
            "told": data,
            "kept": kept,
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "model": self.model,
            **provenance.versions(self.model),
            "processor": provenance.processor(),
        }
        members: dict[str, Any] = {"head": np.frombuffer(json_text(head).encode(), np.uint8), **arrays}
        try:
            with whole(self.path, overwrite=overwrite) as file:
                np.savez(file, **members)
                with zipfile.ZipFile(file.name) as written:
                    if wrong := written.testzip():
                        raise OSError(errno.EIO, f"{wrong} is not as it was written")
                taken = io.FileIO(os.dup(file.fileno()))  # the lock goes over to the new file
        except FileExistsError:
            raise
        except (OSError, zipfile.BadZipFile) as error:
            remedy = f"Nothing is kept. Make room or choose another folder with {option('path')}."
            if self.kept:
                remedy = f"What it held before is safe: {self.kept}. Free some space, and run {again('resume')}."
            raise NsdrillError(f"{self.path}: could not be written: {reason(error)}. {remedy}") from error
        if self._lock is not None:
            self._lock.close()
        self._lock = taken

    def read(self, digest: str, inputs: str) -> tuple[Any, dict[str, Array]]:
        """The plain data and arrays that :meth:`write` wrote. FileError where the file is
        damaged or from other ``inputs``, which the message names, or where other
        versions may give other numbers."""
        try:
            head = _head(self.path)
            with np.load(self.path, allow_pickle=False) as file:
                arrays = {name: file[name] for name in file.files if name != "head"}
        except _UNREADABLE as error:
            raise self.damaged(error) from error
        if head["digest"] != digest:
            raise FileError(
                f"{self.path}: made from {inputs}. Go on with what it was made from, or start "
                f"anew by {option('overwrite')}."
            )
        if differing := provenance.unlike(head):
            raise FileError(
                f"{self.path}: made with other versions, whose numbers may differ "
                f"({'; '.join(differing)}). Finish it with "
                f"those, or start anew by {option('overwrite')}."
            )
        return head["told"], arrays

    def damaged(self, error: Exception) -> FileError:
        """The error for a part file that cannot be read."""
        return _damaged(self.path, self.what, error)

    def discard(self) -> None:
        """Remove the file, as the work is finished."""
        self._is_temporary = True
        self.close()

    def close(self) -> None:
        """Release the lock; without a state the file is removed first."""
        if self._lock is None:
            return
        if self._is_temporary:
            with suppress(OSError):
                if os.path.samestat(os.fstat(self._lock.fileno()), os.stat(self.path)):
                    os.unlink(self.path)
        interrupt.unfinished_files.discard(str(self.path))
        self._lock.close()
        self._lock = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def summary(path: str | os.PathLike[str]) -> Answer | None:
    """What is in the part file ``path``, as plain data; None where it is another
    file."""
    try:
        head = _head(path)
        what = head["magic"].removeprefix(_MAGIC)
    except _UNREADABLE:
        return None
    names = ("kept", "created", "model", "nsdrill_version")
    return {"kind": "unfinished", "what": what, **{name: head[name] for name in names}}


def _head(path: str | os.PathLike[str]) -> Answer:
    """The plain data at the beginning of a part file; one of ``_UNREADABLE`` where it is
    another file, or damaged."""
    if not os.path.isfile(path):  # opening a pipe would block
        raise ValueError("it is no file")
    with zipfile.ZipFile(path) as file, file.open("head.npy") as member:
        if file.getinfo("head.npy").compress_type != zipfile.ZIP_STORED:
            raise ValueError("it is another file")  # which might not fit into the memory
        head = json.loads(np.lib.format.read_array(member, allow_pickle=False).tobytes().decode())
    if not str(head["magic"]).startswith(_MAGIC) or not isinstance(head.get("kept"), str):
        raise ValueError("it is another file, or of another version of nsdrill")
    return dict(head)


def _damaged(part: Path, what: str, error: Exception) -> FileError:
    return FileError(
        f"{part}: cannot be read as an unfinished {what}: {reason(error)}. Start anew by {option('overwrite')}."
    )
