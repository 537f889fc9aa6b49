"""The explorer of one file: a server with its session, in threads of its own, and the
object that shows it in a notebook."""

from __future__ import annotations

import html
import os
import secrets
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cached_property
from pathlib import Path
from typing import Self

from nsdrill import interrupt
from nsdrill.data import json_text
from nsdrill.errors import InputError, NsdrillError, Refusal, option
from nsdrill.models.registry import showing
from nsdrill.web.asked import Request, packed
from nsdrill.web.server import ADDRESS, Server
from nsdrill.web.session import Session

# s without a page after which the explorer stops. A page that is reloaded is away for a
# moment.
CLOSE_DELAY = 3.0
WARM_DELAY = 5.0  # s for the first page to get its diagram before anything is compiled


class Explorer:
    """The server of one session, in its own threads: :meth:`start`, :attr:`url`,
    :meth:`wait`, :meth:`close`.

    InputError where the ``port`` is in use; 0 chooses a free one.
    """

    def __init__(self, session: Session, port: int = 0) -> None:
        self.session, self.token = session, secrets.token_urlsafe(24)
        self.stopped, self._first_reply = threading.Event(), threading.Event()
        self.pages, self.page_opened, self.page_closed_at = 0, False, 0.0
        self._page_lock = threading.Lock()
        self._private_file: Path | None = None
        try:
            self._server = Server((ADDRESS, port), self)
        except OSError as error:
            raise InputError(
                f"{option('port')}: found {port}, which cannot be had ({(error.strerror or str(error)).lower()}); "
                "allowed: another one, or none for any that is free."
            ) from error
        except OverflowError:
            raise Refusal("port", f"{port}", "0 to 65535") from None
        self.port = self._server.server_address[1]

    @property
    def url(self) -> str:
        """The address of the page, with the token in the fragment."""
        return f"http://{ADDRESS}:{self.port}/#{self.token}"

    @contextmanager
    def private_page(self) -> Iterator[str]:
        """The address of a file that only this user can read and that leads to the page,
        for a browser: what a program is started with can be read by every user of the
        machine. The file is removed at the end, or earlier once a page was opened."""
        # Not in a hidden folder or that for temporary files, which a confined browser
        # cannot read.
        home = os.path.expanduser("~")
        number, name = tempfile.mkstemp(".html", "nsdrill-view-", home if os.access(home, os.W_OK) else None)
        interrupt.unfinished_files.add(name)
        try:
            with open(number, "w", encoding="utf-8") as file:
                file.write(
                    f'<!doctype html><meta charset="utf-8"><title>nsdrill</title><meta '
                    f'http-equiv="refresh" content="0; url={self.url}">'
                    f'<a href="{self.url}">The explorer</a>'
                )
            self._private_file = Path(name)
            yield self._private_file.as_uri()
        finally:
            Path(name).unlink(missing_ok=True)
            interrupt.unfinished_files.discard(name)

    def start(self) -> None:
        """Start to serve, and load or compile the machine code once the first page has
        its diagram."""
        threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True).start()
        threading.Thread(target=self._warm, daemon=True).start()

    def _warm(self) -> None:
        if self.session.results is not None:
            self._first_reply.wait(WARM_DELAY)
        # An error is not reported here: a page gets it with its first request.
        with suppress(NsdrillError, KeyboardInterrupt):
            self.session.warm()

    def wait(self, look: Callable[[], None], left_alone: Callable[[], bool] = lambda: False) -> str:
        """Wait until the last page is closed, until no page is open and nobody wants one,
        as ``left_alone`` says, or until ``look`` raises; the reason in words."""
        while not self.stopped.wait(0.1):
            look()
            with self._page_lock:
                idle = time.monotonic() - self.page_closed_at
                is_idle = not self.pages and idle > CLOSE_DELAY
            if is_idle and self.page_opened:
                return "The page was closed."
            if is_idle and left_alone():
                return "The program that started the explorer has ended."
        return "Stopped."

    def close(self) -> None:
        """Stop the server."""
        if self.stopped.is_set():
            return
        self.stopped.set()
        self._server.shutdown()
        self._server.server_close()

    def add_page(self) -> None:
        """Count a page that was opened."""
        with self._page_lock:
            self.pages, self.page_opened = self.pages + 1, True
        if self._private_file is not None:
            self._private_file.unlink(missing_ok=True)

    def remove_page(self) -> None:
        """Count a page that was closed."""
        with self._page_lock:
            self.pages, self.page_closed_at = self.pages - 1, time.monotonic()

    @cached_property
    def _meta(self) -> bytes:
        """What every page asks for first, made once."""
        with showing(self.session.attrs):
            return json_text(self.session.meta()).encode()

    def answer(self, name: str, request: Request) -> tuple[str, bytes]:
        """The content type and the body of the reply to one of
        :data:`nsdrill.web.server.REQUESTS`."""
        session = self.session
        if name == "meta":
            return "application/json", self._meta
        with showing(session.attrs):
            reply = getattr(session, name)(request)  # one of REQUESTS, nothing else
        if isinstance(reply, dict):
            return "application/json", json_text(reply).encode()
        body = packed(*reply)
        self._first_reply.set()
        return "application/octet-stream", body


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
