"""Who may write under the name that was asked for: the rules of ``--overwrite`` and
``--resume``."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Literal

from nsdrill.errors import FileError
from nsdrill.files import reason, sweep_away
from nsdrill.store.log import RunLog, part_path
from nsdrill.store.log_header import MAGIC

Claim = Literal["new", "resume", "finished"]


def claim(path: str | os.PathLike[str], overwrite: bool = False, resume: bool = False) -> Claim:
    """What may be done with the output ``path``, or a FileError that says why not and
    what would help.

    ``new``: nothing is in the way, create a run log. ``resume``: an unfinished run is
    there, open its log. ``finished``: asked to resume, and the results file is there
    already, with no unfinished run.

    With ``overwrite`` the log of an unfinished run is removed here, unless a process is
    writing it; a finished file stays until the new one replaces it, so that an
    overwriting run that fails costs nothing. What killed processes left behind under
    temporary names is removed.
    """
    if overwrite and resume:
        raise FileError(
            "--overwrite and --resume exclude each other: start anew, or go on with what is there?"
        )
    check_target(path)
    part = part_path(path)
    finished, unfinished = os.path.lexists(path), os.path.lexists(part)
    for name in (Path(os.path.realpath(path)), part):
        sweep_away(name)
    if resume:
        # With both there, the log is of a run that was allowed to overwrite the file,
        # so it is the newer.
        return "resume" if unfinished else "finished" if finished else "new"
    if finished and not overwrite:
        raise FileError(
            f"{path}: the file exists. Choose another name, or replace it by --overwrite."
        )
    if unfinished:
        if not overwrite:
            # refuses, with the right words, a log that a process is writing
            with RunLog.open(part) as log:
                done, total = int(log.done().sum()), log.n_points
            raise FileError(
                f"{part}: an unfinished run with {done} of {total} points is there. Go on with it "
                f"by --resume, or "
                "start anew by --overwrite."
            )
        _remove_log(part)
    return "new"


def claim_file(path: str | os.PathLike[str], overwrite: bool = False) -> None:
    """The same rule for an output that is made in one go: a trace, a figure, an export."""
    check_target(path)
    if os.path.lexists(path) and not overwrite:
        raise FileError(
            f"{path}: the file exists. Choose another name, or replace it by --overwrite."
        )


def check_target(path: str | os.PathLike[str]) -> None:
    """FileError unless a file called ``path`` could be made: the folder is there and
    may be written."""
    text = os.fspath(path)
    if not text or "\0" in text:
        raise FileError(f"{text!r}: no name for a file. Give one with -o.")
    target = Path(os.path.realpath(text))
    try:
        kind = target.stat().st_mode if target.exists() else None
        longest = os.pathconf(target.parent, "PC_NAME_MAX") if target.parent.is_dir() else 255
    except OSError as error:
        raise FileError(
            f"{text}: cannot be used: {reason(error)}. Choose another name with -o."
        ) from error
    if text.endswith(os.sep) or (kind is not None and stat.S_ISDIR(kind)):
        raise FileError(
            f"{text}: this is a folder; -o needs the name of a file, "
            f"{os.path.join(text, 'out.h5')} say."
        )
    if kind is not None and not stat.S_ISREG(kind):
        raise FileError(
            f"{text}: this is a device or a pipe; results need a file. Choose another name with -o."
        )
    if not target.parent.is_dir():
        raise FileError(
            f"{text}: there is no folder {target.parent}. Make it first, or choose "
            f"another name with -o."
        )
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise FileError(
            f"{text}: the folder {target.parent} may not be written. Choose another one with -o."
        )
    if len(os.fsencode(target.name)) + 20 > longest:  # room for the ending of the temporary name
        raise FileError(f"{text}: the name is too long; this folder takes {longest - 20} bytes.")


def _remove_log(part: Path) -> None:
    """Remove the log of an unfinished run, damaged or not, but no file of another
    program and none in use."""
    try:
        ours = False
        if part.is_file():  # a pipe would be waited for
            with open(part, "rb") as file:
                ours = file.read(len(MAGIC)) == MAGIC
        if not ours:
            raise FileError(
                f"{part}: this is no run log of nsdrill, though it has the name of "
                f"one. Move it away."
            )
        RunLog.remove(part)
    except OSError as error:
        raise FileError(f"{part}: cannot be removed: {reason(error)}.") from error
