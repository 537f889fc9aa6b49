"""The explorer's server: this machine only, one secret, no name of a file from outside.

It listens on the loopback address alone. A request has to name that address (``Host``),
so no other name that is made to lead here serves; one that a page of another origin
sends is refused; and what has data needs the token, which a page has from the fragment
of its URL, a part that browsers send nowhere. Static files are known by name. Answers
forbid scripts from elsewhere, framing by other machines, and guesses of their type.
"""

from __future__ import annotations

import hmac
import json
import os
import secrets
import select
import socket
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import lru_cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from typing import Any

from nsdrill.data import json_text
from nsdrill.errors import InputError, NsdrillError
from nsdrill.web.packet import packed
from nsdrill.web.session import Session

ADDRESS = "127.0.0.1"
TOKEN = "X-Nsdrill-Token"
MOST = 65536  # bytes of a request
PATIENCE = (
    # seconds without a page, after which the explorer stops: a page that is loaded anew
    # is gone for a moment
    3.0
)
DRAWN = 5.0  # seconds after which there is no waiting for a page any more
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' "
    "data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'self' http://localhost:* "
    "http://127.0.0.1:*"
)
STATIC = {
    "/": ("explorer.html", "text/html"),
    "/explorer.js": ("explorer.js", "text/javascript"),
    "/charts.js": ("charts.js", "text/javascript"),
    "/style.css": ("style.css", "text/css"),
    "/uPlot.js": ("uplot/uPlot.iife.min.js", "text/javascript"),
    "/uPlot.css": ("uplot/uPlot.min.css", "text/css"),
}


@lru_cache
def static(name: str) -> bytes:
    """One of the files of the pages."""
    return files("nsdrill.web").joinpath("static", *name.split("/")).read_bytes()


class Explorer:
    """The server of one session, in threads of its own: :meth:`start`, :attr:`url`,
    :meth:`wait`, :meth:`close`.

    InputError where the ``port`` is taken; 0 takes a free one.
    """

    def __init__(self, session: Session, port: int = 0) -> None:
        self.session, self.token = session, secrets.token_urlsafe(24)
        self.stopped, self._drawn = threading.Event(), threading.Event()
        self.pages, self.seen, self.left = 0, False, 0.0
        self._count = threading.Lock()
        try:
            self._server = _Server((ADDRESS, port), self)
        except OSError as error:
            raise InputError(
                f"--port: found {port}, which cannot be had "
                f"({(error.strerror or str(error)).lower()}); allowed: "
                "another one, or none for any that is free."
            ) from error
        except OverflowError:
            raise InputError(f"--port: found {port}; allowed: 0 to 65535.") from None
        self.port = self._server.server_address[1]

    @property
    def url(self) -> str:
        """Where the page is; the token stands after the number sign."""
        return f"http://{ADDRESS}:{self.port}/#{self.token}"

    def start(self) -> None:
        """Begin to answer, and make ready what computes, once the first page has its
        diagram."""
        threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True).start()
        threading.Thread(target=self._warm, daemon=True).start()

    def _warm(self) -> None:
        if self.session.results is not None:
            self._drawn.wait(DRAWN)
        with suppress(NsdrillError, KeyboardInterrupt):  # a page is told when it asks
            self.session.warm()

    def wait(self, look: Callable[[], None]) -> str:
        """Until the last page has gone, or ``look`` raises: why it ended, in words."""
        while not self.stopped.wait(0.1):
            look()
            with self._count:
                gone = self.seen and not self.pages and time.monotonic() - self.left > PATIENCE
            if gone:
                return "The page was closed."
        return "Stopped."

    def close(self) -> None:
        """Answer no more."""
        if self.stopped.is_set():
            return
        self.stopped.set()
        self._server.shutdown()
        self._server.server_close()

    def entered(self) -> None:
        """A page is there."""
        with self._count:
            self.pages, self.seen = self.pages + 1, True

    def gone(self) -> None:
        """A page has gone."""
        with self._count:
            self.pages, self.left = self.pages - 1, time.monotonic()

    def answer(self, name: str, asked: Mapping[str, Any]) -> tuple[str, bytes]:
        """The type and the body of the answer to one of :data:`NAMES`."""
        session = self.session
        if name == "meta":
            return "application/json", json_text(session.meta()).encode()
        if name == "saved":
            return "application/json", json_text(session.saved(asked)).encode()
        reply = {
            "diagram": session.diagram,
            "plane": session.plane,
            "replay": session.replay,
            "live": session.live,
            "local": session.local,
            "section": session.section,
            "orbit": session.orbit,
        }[name](asked)
        body = packed(*reply)
        self._drawn.set()
        return "application/octet-stream", body


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = os.name == "posix"  # elsewhere that lets two processes have one port
    request_queue_size = 64

    def __init__(self, address: tuple[str, int], explorer: Explorer) -> None:
        self.explorer = explorer
        super().__init__(address, _Handler)

    def server_bind(self) -> None:
        # Without a look-up of the machine's name, which may take seconds.
        if self.allow_reuse_address:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = ADDRESS, self.server_address[1]

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A page that went away in the middle of an answer is no error."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    wbufsize = -1
    timeout = 3600.0
    server_version, sys_version = "nsdrill", ""
    server: _Server

    def do_GET(self) -> None:
        """The page and its parts; and ``/api/alive``, which lasts as long as the page."""
        if not self._welcome():
            return
        path = self.path.partition("?")[0]
        if path == "/api/alive":
            if self._has_token():
                self._alive()
        elif path in STATIC:
            name, kind = STATIC[path]
            self._send(200, f"{kind}; charset=utf-8", static(name))
        else:
            self._refuse(404, "There is no such page.")

    def do_POST(self) -> None:
        """``/api/NAME`` with a JSON object."""
        try:
            size = int(self.headers.get("Content-Length", ""))
        except ValueError:
            size = -1
        if not 0 <= size <= MOST or "Transfer-Encoding" in self.headers:
            self.close_connection = True
            self._refuse(
                413 if size > MOST else 411,
                f"A request has at most {MOST} bytes, and says how many.",
            )
            return
        body = self.rfile.read(size)
        if not self._welcome() or not self._has_token():
            return
        first, name = self.path.rpartition("/")[::2]
        try:
            asked = json.loads(body or b"{}", parse_constant=_no_constant)
            if not isinstance(asked, dict):
                raise ValueError("no object")
        except (ValueError, RecursionError):
            self._refuse(400, "The request is no JSON object.")
            return
        try:
            if first != "/api" or name not in NAMES:
                self._refuse(404, "There is no such question.")
                return
            kind, found = self.server.explorer.answer(name, asked)
        except NsdrillError as error:
            self._refuse(400, str(error))
        except MemoryError:
            self._refuse(500, "Out of memory. Show fewer seconds, or fewer points.")
        except KeyboardInterrupt:
            self._refuse(503, "The explorer is being stopped.")
        except Exception as error:
            if os.environ.get("NSDRILL_DEBUG"):
                raise
            self._refuse(
                500,
                f"This should not happen and is a bug of nsdrill "
                f"({type(error).__name__}: {error}).",
            )
        else:
            self._send(200, kind, found)

    def _welcome(self) -> bool:
        """Whether the request is meant for here, and comes from a page of here."""
        port = self.server.server_port
        hosts = {f"{name}:{port}" for name in (ADDRESS, "localhost")}
        origin = self.headers.get("Origin")
        if self.headers.get("Host") not in hosts or (
            origin is not None and origin.partition("://")[2] not in hosts
        ):
            self._refuse(403, "This explorer answers pages of its own only.")
            return False
        return True

    def _has_token(self) -> bool:
        given = self.headers.get(TOKEN, "")
        if hmac.compare_digest(
            given.encode("latin-1", "replace"), self.server.explorer.token.encode()
        ):
            return True
        self._refuse(
            403,
            "The token is missing or of another explorer. Open the URL that nsdrill view printed.",
        )
        return False

    def _alive(self) -> None:
        """An answer without end: that it breaks off tells the page that the explorer
        has stopped, and the explorer that the page has gone."""
        explorer = self.server.explorer
        self.close_connection = True
        explorer.entered()
        try:
            self.send_response(200)
            self._heads("application/octet-stream")
            self.send_header("Connection", "close")
            self.end_headers()
            self.wfile.write(b".")
            self.wfile.flush()
            while not explorer.stopped.is_set():
                if select.select([self.connection], [], [], 0.2)[0] and not self.connection.recv(
                    1024
                ):
                    return
        except OSError:
            pass
        finally:
            explorer.gone()

    def _refuse(self, code: int, words: str) -> None:
        self._send(code, "application/json", json_text({"error": words}).encode())

    def _heads(self, kind: str) -> None:
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("Cross-Origin-Resource-Policy", "same-origin")

    def _send(self, code: int, kind: str, body: bytes) -> None:
        self.send_response(code)
        self._heads(kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal is for what matters."""


NAMES = ("meta", "diagram", "plane", "replay", "live", "local", "section", "orbit", "saved")


def _no_constant(name: str) -> None:
    raise ValueError(name)
