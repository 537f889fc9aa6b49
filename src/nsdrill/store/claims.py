"""Whether an output file may be written: the rules of ``--overwrite`` and
``--resume``."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Literal

from nsdrill.errors import FileError, count, option
from nsdrill.files import reason, sweep_away
from nsdrill.store.log import RunLog, part_path
from nsdrill.store.log_format import MAGIC

Claim = Literal["new", "resume", "finished"]


def claim(path: str | os.PathLike[str], overwrite: bool = False, resume: bool = False) -> Claim:
    """How a run may write the output ``path``; FileError, with the reason and a remedy,
    where it may not.

    ========= ========================================================================
    new       No file is in the way: create a run log.
    resume    An unfinished run exists: open its log.
    finished  ``resume`` is set, and the results file exists with no unfinished run.
    ========= ========================================================================

    With ``overwrite`` the log of an unfinished run is removed here, unless a process is
    writing it. A finished file stays until the new one replaces it, so that it survives
    a run that fails. Temporary files of killed processes are removed.
    """
    part, (finished, unfinished) = part_path(path), claim_work(path, overwrite, resume)
    if resume:
        # Where both exist, the log belongs to a run that was allowed to overwrite the
        # file, so it is the newer of the two.
        return "resume" if unfinished else "finished" if finished else "new"
    if unfinished:
        if not overwrite:
            # raises the FileError of a log that another process is writing
            with RunLog.open(part) as log:
                done, total = int(log.done().sum()), log.n_points
            raise FileError(
                f"{part}: an unfinished run with {done} of {count(total, 'point')} is there. Go on with it by "
                f"{option('resume')}, or start anew by {option('overwrite')}."
            )
        _remove_log(part)
    return "new"


def claim_work(path: str | os.PathLike[str], overwrite: bool, resume: bool) -> tuple[bool, bool]:
    """Whether the output ``path`` of work that is kept in its part file is there, and
    whether the part file is; FileError where it may not be written. Temporary files of
    killed processes are removed."""
    if overwrite and resume:
        raise FileError(
            f"{option('overwrite')} and {option('resume')} exclude each other: start anew, or go on with what is there?"
        )
    claim_file(path, overwrite or resume)
    part = part_path(path)
    finished, unfinished = os.path.lexists(path), os.path.lexists(part)
    for name in (Path(os.path.realpath(path)), part):
        sweep_away(name)
    return finished, unfinished


def claim_file(path: str | os.PathLike[str], overwrite: bool = False) -> None:
    """FileError unless ``path`` may be written in one step, as a trace, a figure or an
    export is."""
    check_target(path)
    if os.path.lexists(path) and not overwrite:
        raise FileError(f"{path}: the file exists. Choose another name, or replace it by {option('overwrite')}.")


def check_target(path: str | os.PathLike[str]) -> None:
    """FileError unless a file called ``path`` can be created: its folder exists and is
    writable, and the name is valid."""
    text = os.fspath(path)
    if not text or "\0" in text:
        raise FileError(f"{text!r}: no name for a file. Give one with {option('path')}.")
    target = Path(os.path.realpath(text))
    try:
        kind = target.stat().st_mode if target.exists() else None
        longest = os.pathconf(target.parent, "PC_NAME_MAX") if target.parent.is_dir() else 255
    except OSError as error:
        raise FileError(
            f"{text}: cannot be used: {reason(error)}. Choose another name with {option('path')}."
        ) from error
    if text.endswith(os.sep) or (kind is not None and stat.S_ISDIR(kind)):
        raise FileError(
            f"{text}: this is a folder; {option('path')} needs the name of a file, {os.path.join(text, 'out.h5')} say."
        )
    if kind is not None and not stat.S_ISREG(kind):
        raise FileError(
            f"{text}: this is a device or a pipe; results need a file. Choose another name with {option('path')}."
        )
    if not target.parent.is_dir():
        raise FileError(
            f"{text}: there is no folder {target.parent}. Make it first, or choose another name with {option('path')}."
        )
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise FileError(
            f"{text}: the folder {target.parent} may not be written. Choose another one with {option('path')}."
        )
    if len(os.fsencode(target.name)) + 20 > longest:  # room for the ending of the temporary name
        raise FileError(f"{text}: the name is too long; this folder takes {longest - 20} bytes.")


def _remove_log(part: Path) -> None:
    """Remove the log of an unfinished run, damaged or not. FileError for a file of
    another program, or one in use."""
    try:
        is_run_log = False
        if part.is_file():  # opening a pipe would block
            with open(part, "rb") as file:
                is_run_log = file.read(len(MAGIC)) == MAGIC
        if not is_run_log:
            raise FileError(f"{part}: this is no run log of nsdrill, though it has the name of one. Move it away.")
        RunLog.remove(part)
    except OSError as error:
        raise FileError(f"{part}: cannot be removed: {reason(error)}.") from error
