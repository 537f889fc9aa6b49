"""The state of unfinished work, in one file next to its output, which is replaced in one
step; and that of a fit, which is the runs so far."""

from __future__ import annotations

import errno
import hashlib
import io
import json
import os
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from nsdrill import interrupt
from nsdrill.app import experiment
from nsdrill.data import Answer, Array, json_text
from nsdrill.errors import FileError, NsdrillError, again, count, option, printable
from nsdrill.files import lock, open_plain, reason, whole
from nsdrill.store import claim_work, part_path
from nsdrill.store.hdf5 import ZIP
from nsdrill.store.log_format import MAGIC as LOG_MAGIC

if TYPE_CHECKING:
    from nsdrill.analysis.fitting import Measured, Simulate
    from nsdrill.study.study import Study

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
        finished, unfinished = claim_work(output, overwrite, resume)
        part = cls(part_path(output), what, model)
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
            head, _ = _whole(self.path)
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
            self._holds("")

    def _holds(self, kept: str) -> None:
        """Note what the file now holds; without a state it is temporary."""
        self.kept, self._is_temporary = kept, not kept
        note = interrupt.unfinished_files.discard if kept else interrupt.unfinished_files.add
        note(str(self.path))

    @contextmanager
    def _becoming(self, kept: str) -> Iterator[None]:
        """The context in which a file with this state takes the name of the file: no
        signal ends the process before that is noted."""
        with interrupt.undivided():
            yield
            self._holds(kept)

    def held(self) -> str:
        """Which state is in the file, in words, as the process ends: as the file says, for
        a rename that takes long may be over though it is not noted."""
        try:
            return str(_head(self.path)["kept"])
        except _UNREADABLE:
            return self.kept

    def write(self, digest: str, data: object, arrays: Mapping[str, Array], kept: str) -> None:
        """Replace the file, in one step, by one with ``arrays`` and plain ``data``, from
        inputs with this ``digest``; ``kept`` says in words what that is.

        The process goes on after this file, so an interrupt still takes effect."""
        self._replace(digest, data, arrays, kept, True)

    def _replace(self, digest: str, data: object, arrays: Mapping[str, Array], kept: str, overwrite: bool) -> None:
        head = {
            "magic": _MAGIC + self.what,
            "digest": digest,
            "told": data,
            "kept": kept,
            "created": datetime.now(UTC).isoformat(timespec="seconds"),
            "model": self.model,
            **experiment.versions(self.model),
            "processor": experiment.processor(),
        }
        members: dict[str, Any] = {"head": np.frombuffer(json_text(head).encode(), np.uint8), **arrays}
        members["seal"] = _seal(members)
        try:
            with whole(self.path, overwrite=overwrite, renaming=self._becoming(kept)) as file:
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
                remedy = f"What it held before is kept: {self.kept}. Free some space, and run {again('resume')}."
            raise NsdrillError(f"{self.path}: could not be written: {reason(error)}. {remedy}") from error
        if self._lock is not None:
            self._lock.close()
        self._lock = taken

    def read(self, digest: str, inputs: str) -> tuple[Any, dict[str, Array]]:
        """The plain data and arrays that :meth:`write` wrote. FileError where the file is
        damaged or from other ``inputs``, which the message names, or where other
        versions may give other numbers."""
        try:
            head, arrays = _whole(self.path)
        except _UNREADABLE as error:
            raise self.damaged(error) from error
        if head["digest"] != digest:
            raise FileError(
                f"{self.path}: made from {inputs}. Go on with what it was made from, or start "
                f"anew by {option('overwrite')}."
            )
        if otherwise := experiment.made_otherwise(head):
            raise FileError(f"{self.path}: {otherwise}, or start anew by {option('overwrite')}.")
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
    try:
        _whole(path)
    except _UNREADABLE as error:
        raise _damaged(Path(path), printable(what), error) from error
    names = ("kept", "created", "model", "nsdrill_version")
    return {"kind": "unfinished", "what": what, **{name: head[name] for name in names}}


def contents(path: str | os.PathLike[str], what: str) -> tuple[Any, dict[str, Array]] | None:
    """The plain data and arrays in the part file ``path`` of the kind ``what``; None where
    it is another file, or holds nothing yet. FileError where it is damaged."""
    try:
        head = _head(path)
    except _UNREADABLE:
        return None
    if head["magic"] != _MAGIC + what or not head["kept"]:
        return None
    try:
        return head["told"], _whole(path)[1]
    except _UNREADABLE as error:
        raise _damaged(Path(path), what, error) from error


def _whole(path: str | os.PathLike[str]) -> tuple[Answer, dict[str, Array]]:
    """The plain data at the beginning of a part file, and its arrays; one of
    ``_UNREADABLE`` where they are not those that were written."""
    head = _head(path)
    with np.load(path, allow_pickle=False) as file:
        members = {name: file[name] for name in file.files}
    seal = members.pop("seal", None)
    if seal is None or not np.array_equal(seal, _seal(members)):
        raise ValueError("it was changed after it was written")
    del members["head"]
    return head, members


def _seal(members: Mapping[str, Array]) -> Array:
    """The digest of all that is in a part file."""
    digest = hashlib.sha256()
    for name, values in members.items():
        digest.update(f"{name} {values.dtype.str} {values.shape} ".encode())
        digest.update(np.ascontiguousarray(values).tobytes())
    return np.frombuffer(digest.digest(), np.uint8)


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


WHAT = "fit"


@dataclass
class Rounds:
    """The calls of the model so far, samples [n, unknowns] and values [n, values], of
    which the first ``known`` were read from a file. Without ``part`` no file is
    written."""

    part: Part | None = None
    digest: str = ""
    points: int = 1
    calls: list[tuple[Array, Array]] = field(default_factory=list)
    known: int = 0
    _next_call: int = 0

    @classmethod
    def beside(
        cls,
        path: str | os.PathLike[str],
        study: Study,
        measured: Measured,
        batch: int,
        *,
        overwrite: bool = False,
        resume: bool = False,
    ) -> Rounds:
        """The calls of the fit that writes ``path``; with ``resume`` those that were
        saved. FileError where ``path`` may not be written, or where the saved calls
        belong to another fit."""
        part = Part.claim(path, WHAT, study.model.name, overwrite=overwrite, resume=resume)
        rounds = cls(part, _digest(study, measured, batch), measured.points)
        try:
            if part.kept:
                inputs = f"another study, from other data or with another {option('batch')}"
                count, arrays = part.read(rounds.digest, inputs)
                rounds.calls = [(arrays[f"samples_{i}"], arrays[f"answers_{i}"]) for i in range(count)]
                rounds.known = count
        except BaseException:
            part.close()
            raise
        return rounds

    @property
    def runs(self) -> int:
        """The number of saved runs."""
        return self.points * sum(len(samples) for samples, _ in self.calls)

    def recording(self, simulate: Simulate) -> Simulate:
        """The model ``simulate`` with its calls recorded, or answered by recorded
        ones."""

        def recorded(z: Array) -> Array:
            place, self._next_call = self._next_call, self._next_call + 1
            if place < len(self.calls):
                samples, answers = self.calls[place]
                if not np.array_equal(samples, z):
                    assert self.part is not None
                    raise FileError(
                        f"{self.part.path}: its samples are not those that these versions of NumPy and SciPy draw. "
                        f"Finish it with the versions that it was made with, or start anew by {option('overwrite')}."
                    )
                return answers
            answers = simulate(z)
            self.calls.append((z, answers))
            self._save()
            return answers

        return recorded

    @contextmanager
    def guarding(self) -> Iterator[None]:
        """A context in which the text of a KeyboardInterrupt says what is saved, and at
        whose end another process may go on with it."""
        with self.part or nullcontext(), interrupt.with_end_message(self._end_message):
            try:
                yield
            except KeyboardInterrupt:
                raise KeyboardInterrupt(self._end_message()) from None

    def recovery_text(self) -> str:
        """What is saved and how to resume, in a sentence or two."""
        assert self.part is not None
        return f"{self.part.held()} are kept in {self.part.path}. Go on with {again('resume')}."

    def _end_message(self) -> str:
        if self.part is None or not self.part.held():
            return interrupt.NOTHING
        return f"Interrupted: {self.recovery_text()}"

    def discard(self) -> None:
        """Remove the saved calls, once the output is written."""
        if self.part is not None:
            self.part.discard()

    def _save(self) -> None:
        if self.part is None:
            return
        arrays = {f"samples_{i}": samples for i, (samples, _) in enumerate(self.calls)}
        arrays |= {f"answers_{i}": answers for i, (_, answers) in enumerate(self.calls)}
        self.part.write(self.digest, len(self.calls), arrays, count(self.runs, "run"))


def _digest(study: Study, measured: Measured, batch: int) -> str:
    """Digest of all inputs that decide the samples and values, but not of the number of
    rounds, which may grow."""
    digest = hashlib.sha256(f"{study.sha256} {batch}".encode())
    for table in (measured.at, measured.values, measured.errors):
        for name, values in table.items():
            digest.update(name.encode() + np.ascontiguousarray(values, dtype=float).tobytes())
    return digest.hexdigest()
