"""What is kept of unfinished work beside its output, in one file that is there whole or
not at all."""

from __future__ import annotations

import io
import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nsdrill import interrupt
from nsdrill.app.provenance import processor, unlike, versions
from nsdrill.data import Array, json_text
from nsdrill.errors import FileError, NsdrillError
from nsdrill.files import Temporary, reason, sweep_away
from nsdrill.store import check_target, part_path


def claim_part(
    path: str | os.PathLike[str], what: str, *, overwrite: bool, resume: bool
) -> tuple[Path, bool]:
    """The file beside the output ``path`` in which unfinished work is kept, ``what``
    says which ("fit"), and whether it is there to go on with. FileError where ``path``
    may not be written, by the rules of ``nsdrill run``."""
    if overwrite and resume:
        raise FileError(
            "--overwrite and --resume exclude each other: start anew, or go on with what is there?"
        )
    check_target(path)
    part = part_path(path)
    sweep_away(part)
    finished, unfinished = os.path.lexists(path), os.path.lexists(part)
    if resume and finished and not unfinished:
        raise FileError(
            f"{path}: this {what} is finished; nothing is left to run. Start anew by --overwrite."
        )
    if finished and not (overwrite or resume):
        raise FileError(
            f"{path}: the file exists. Choose another name, or replace it by --overwrite."
        )
    if unfinished and not (overwrite or resume):
        raise FileError(
            f"{part}: an unfinished {what} is there. Go on with it by --resume, or start anew by "
            f"--overwrite."
        )
    return part, resume and unfinished


def write_part(
    part: Path, what: str, digest: str, told: Any, arrays: Mapping[str, Array], model: str
) -> None:
    """Replace ``part``, in one step, by one with ``arrays`` and plain data ``told``.
    ``digest`` says of what input, and ``model`` of which model.

    The file is not the last one of its process: an interrupt is still heeded after
    it."""
    made = {"model": model, **versions(model), "processor": processor()}
    head = json_text({"magic": _magic(what), "digest": digest, "told": told, **made})
    buffer = io.BytesIO()
    held: dict[str, Any] = {"head": np.frombuffer(head.encode(), np.uint8), **arrays}
    np.savez(buffer, **held)
    try:
        with Temporary(Path(os.path.realpath(part))) as temporary:
            temporary.file.write(buffer.getbuffer())
            os.fsync(temporary.file.fileno())
            temporary.replace()
    except OSError as error:
        raise NsdrillError(
            f"{part}: could not be written: {reason(error)}. Make room, and go on with the same "
            f"command and --resume."
        ) from error


def read_part(part: Path, what: str, digest: str, inputs: str) -> tuple[Any, dict[str, Array]]:
    """What :func:`write_part` put into ``part``: plain data and arrays. FileError where it is
    damaged, of another kind or of other ``inputs``, which are named in words, or where
    other versions would make other numbers."""
    try:
        with np.load(part, allow_pickle=False) as held:
            head = json.loads(held["head"].tobytes().decode())
            if head["magic"] != _magic(what):
                raise ValueError("it is another file")
            arrays = {name: held[name] for name in held.files if name != "head"}
            there, told = head["digest"], head["told"]
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise damaged(part, what, error) from error
    if there != digest:
        raise FileError(
            f"{part}: made from {inputs}. Go on with what it was made from, or start "
            f"anew by --overwrite."
        )
    if differing := unlike(head):
        raise FileError(
            f"{part}: made with other versions, whose numbers may differ "
            f"({'; '.join(differing)}). Finish it with "
            "those, or start anew by --overwrite."
        )
    return told, arrays


def damaged(part: Path, what: str, error: Exception) -> FileError:
    """The error of a file that is not what :func:`write_part` made."""
    return FileError(
        f"{part}: cannot be read as an unfinished {what}: {reason(error)}. Start "
        f"anew by --overwrite."
    )


def discard(part: Path) -> None:
    """Remove ``part``, as the work is finished."""
    interrupt.doomed.discard(str(part))
    part.unlink(missing_ok=True)


def _magic(what: str) -> str:
    return f"nsdrill unfinished {what}"
