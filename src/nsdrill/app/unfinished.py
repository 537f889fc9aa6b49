"""The state of unfinished work, in one file next to its output, which is replaced in
one step."""

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
    """The part file next to the output ``path``, which holds unfinished work of the
    kind ``what`` ("fit"), and whether it exists and is to be resumed. FileError where
    ``path`` may not be written, by the rules of ``nsdrill run``."""
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
    part: Path, what: str, digest: str, data: Any, arrays: Mapping[str, Array], model: str
) -> None:
    """Replace ``part``, in one step, by a file with ``arrays`` and plain ``data``, from
    inputs with this ``digest`` and with this ``model``.

    The process goes on after this file, so an interrupt still takes effect."""
    origin = {"model": model, **versions(model), "processor": processor()}
    head = json_text({"magic": _magic(what), "digest": digest, "told": data, **origin})
    buffer = io.BytesIO()
    members: dict[str, Any] = {"head": np.frombuffer(head.encode(), np.uint8), **arrays}
    np.savez(buffer, **members)
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
    """The plain data and arrays that :func:`write_part` wrote to ``part``. FileError
    where it is damaged, of another kind or from other ``inputs``, which the message
    names, or where other versions may give other numbers."""
    try:
        with np.load(part, allow_pickle=False) as file:
            head = json.loads(file["head"].tobytes().decode())
            if head["magic"] != _magic(what):
                raise ValueError("it is another file")
            arrays = {name: file[name] for name in file.files if name != "head"}
            stored_digest, data = head["digest"], head["told"]
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise damaged(part, what, error) from error
    if stored_digest != digest:
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
    return data, arrays


def damaged(part: Path, what: str, error: Exception) -> FileError:
    """The error for a part file that cannot be read."""
    return FileError(
        f"{part}: cannot be read as an unfinished {what}: {reason(error)}. Start "
        f"anew by --overwrite."
    )


def discard(part: Path) -> None:
    """Remove ``part``, as the work is finished."""
    interrupt.unfinished_files.discard(str(part))
    part.unlink(missing_ok=True)


def _magic(what: str) -> str:
    return f"nsdrill unfinished {what}"
