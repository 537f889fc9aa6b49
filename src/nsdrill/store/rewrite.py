"""Rewriting a run log, to run some of its points again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from nsdrill.data import Array, Attributes
from nsdrill.errors import FileError, NsdrillError
from nsdrill.files import reason, sync_folder
from nsdrill.store.log import RunLog
from nsdrill.store.results import points_in_block
from nsdrill.variables import PENDING


def rewrite_log(
    log: RunLog, attrs: Attributes, rerun: Array, change: Callable[[Array], None] = lambda records: None
) -> RunLog:
    """Replace ``log``, in one step, by one with the root attributes ``attrs`` in which
    the points ``rerun`` (bool [n_points]) are pending; ``change`` edits the records of
    the other points in place.

    Return the new log and close ``log``. NsdrillError, with ``log`` unchanged, if the
    disk rejects the write. A kill leaves the old log or the new one."""
    try:
        temporary, new = RunLog.begin(log.path, {**log.header, "attrs": dict(attrs)}, log.n_points, log.kept)
        try:
            step = points_in_block(log.kept)
            for start in range(0, log.n_points, step):
                records = log.read(start, min(start + step, log.n_points))
                kept = np.flatnonzero((records["status"] != PENDING) & ~rerun[start : start + step])
                records = records[kept]
                change(records)
                new.write(start + kept, records)
            new.sync()
            temporary.replace()
            new.path = log.path
            sync_folder(log.path.parent)
            log.close()
            return new
        except BaseException:
            temporary.remove()
            raise
    except FileError:
        raise
    except (OSError, NsdrillError) as error:  # of the new log, which is gone
        raise NsdrillError(
            f"{log.path}: could not be rewritten: {reason(error.__cause__ or error)}. Nothing was "
            f"changed. Make room first."
        ) from error
