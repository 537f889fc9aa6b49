"""A file that stores the first error of writing and raises it later.

The HDF5 library does not survive a full disk: while it closes the file it writes again,
raises errors from destructors and may crash. So every write succeeds as far as the
library is concerned, and the error is raised after the file is closed.
"""

from __future__ import annotations

import io
from typing import Any


class DeferredErrorFile(io.FileIO):
    """A binary file for ``h5py.File``. After the first error it writes nothing more;
    :meth:`raise_deferred` raises that error."""

    error: OSError | None = None

    def raise_deferred(self) -> None:
        """Raise the first error of writing, if there was one."""
        if self.error is not None:
            raise self.error

    def write(self, data: Any) -> int:
        """Write ``data``; return its size, also where it could not be written."""
        view = memoryview(data).cast("B")
        size = len(view)
        try:
            while self.error is None and len(view):
                view = view[super().write(view) or 0 :]
        except OSError as error:
            self.error = error
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the length; return it, also where it could not be set."""
        try:
            if self.error is None:
                return super().truncate(size)
        except OSError as error:
            self.error = error
        return size or 0

    def readinto(self, buffer: Any) -> int:
        """Fill ``buffer``, with zeros beyond the end of the file, where an earlier
        write may have failed."""
        view = memoryview(buffer).cast("B")
        size = len(view)
        while len(view):
            count = super().readinto(view) or 0
            if count == 0:
                view[:] = bytes(len(view))
            view = view[count or len(view) :]
        return size
