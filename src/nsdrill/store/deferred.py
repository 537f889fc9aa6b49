"""A file that swallows the errors of writing and gives them back when asked.

The HDF5 library does not survive a full disk: while it closes the file it tries again,
complains from destructors and may crash. So it is told that all went well, and the
truth comes out afterwards.
"""

from __future__ import annotations

import io
from typing import Any


class DeferredErrorFile(io.FileIO):
    """A binary file for ``h5py.File``. After the first error nothing more is written;
    see :meth:`raise_deferred`."""

    error: OSError | None = None

    def raise_deferred(self) -> None:
        """Raise the error that was swallowed, if there was one."""
        if self.error is not None:
            raise self.error

    def write(self, data: Any) -> int:
        """Write all of ``data``, or seem to."""
        view = memoryview(data).cast("B")
        size = len(view)
        try:
            while self.error is None and len(view):
                view = view[super().write(view) or 0 :]
        except OSError as error:
            self.error = error
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the length, or seem to."""
        try:
            if self.error is None:
                return super().truncate(size)
        except OSError as error:
            self.error = error
        return size or 0

    def readinto(self, buffer: Any) -> int:
        """Fill ``buffer``, with zeros where the file ends: what belongs there may have
        been swallowed."""
        view = memoryview(buffer).cast("B")
        size = len(view)
        while len(view):
            count = super().readinto(view) or 0
            if count == 0:
                view[:] = bytes(len(view))
            view = view[count or len(view) :]
        return size
