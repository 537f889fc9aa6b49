"""The explorer in a notebook: an object that shows it in a frame."""

from __future__ import annotations

import html
import os
from typing import Self

from nsdrill.web.server import Explorer


class View:
    """An explorer that :func:`view` gives; it runs until :meth:`close`, or the end of
    this process.

    A notebook shows it in a frame where it is the value of a cell; elsewhere :attr:`url`
    opens in a browser on this machine. As a context manager it closes at the end of the
    block.

    Examples
    --------
    >>> with nsdrill.view("out.h5") as explorer:
    ...     print(explorer.url.startswith("http://127.0.0.1:"))
    True
    """

    def __init__(self, explorer: Explorer, height: int) -> None:
        self._explorer, self._height = explorer, height
        explorer.start()

    @property
    def url(self) -> str:
        """The address of the page, with its token."""
        return self._explorer.url

    def close(self) -> None:
        """Stop the server; open pages keep what they show."""
        self._explorer.close()

    def __repr__(self) -> str:
        name = os.path.basename(self._explorer.session.path)
        if self._explorer.stopped.is_set():
            return f"The explorer of {name}, closed"
        return f"The explorer of {name} at {self.url}"

    def _repr_html_(self) -> str:
        if self._explorer.stopped.is_set():
            return f"<p>{html.escape(repr(self))}</p>"
        url = html.escape(self.url, quote=True)
        return f'<iframe src="{url}" width="100%" height="{self._height}" title="nsdrill" style="border: 0"></iframe>'

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()
