"""The explorer's HTTP server, for pages on this machine only.

* It listens on the loopback address alone.
* A request must name that address in ``Host``: another name that resolves to it is
  refused (DNS rebinding).
* A request from a page of another origin, which is scheme, host and port, is refused.
* Data need a token. A page has it from the fragment of its URL, which browsers do not
  send.
* No file name comes from a request: the static files are a fixed table.
* The headers of a response forbid foreign scripts, framing by other machines, and
  guessing the content type.
"""

from __future__ import annotations

import hmac
import json
import os
import select
import socket
from collections.abc import Mapping
from functools import lru_cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from threading import Event
from typing import Any, Protocol

import numpy as np

from nsdrill import interrupt
from nsdrill.data import json_text
from nsdrill.errors import NsdrillError

ADDRESS = "127.0.0.1"
TOKEN_HEADER = "X-Nsdrill-Token"
MAX_REQUEST = 65536  # bytes
IDLE_SECONDS = 60.0  # that a connection may send nothing
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data: blob:; base-uri "
    "'none'; form-action 'none'; frame-ancestors 'self' http://localhost:* http://127.0.0.1:*"
)
STATIC_FILES = {
    "/": ("explorer.html", "text/html"),
    "/explorer.js": ("explorer.js", "text/javascript"),
    "/charts.js": ("charts.js", "text/javascript"),
    "/motion.js": ("motion.js", "text/javascript"),
    "/vector.js": ("vector.js", "text/javascript"),
    "/asking.js": ("asking.js", "text/javascript"),
    "/style.css": ("style.css", "text/css"),
    "/uPlot.js": ("uplot/uPlot.iife.min.js", "text/javascript"),
    "/uPlot.css": ("uplot/uPlot.min.css", "text/css"),
}


@lru_cache
def static(name: str) -> bytes:
    """One of the files of the pages."""
    return files("nsdrill.web").joinpath("static", *name.split("/")).read_bytes()


class Answering(Protocol):
    """What a server asks for the replies to a page, and tells that pages come and go."""

    token: str
    stopped: Event

    def answer(self, name: str, request: Mapping[str, Any]) -> tuple[str, bytes]: ...

    def add_page(self) -> None: ...

    def remove_page(self) -> None: ...


class Server(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = os.name == "posix"  # elsewhere two processes could share a port
    request_queue_size = 4096  # of connections that wait; the system may allow fewer

    def __init__(self, address: tuple[str, int], explorer: Answering) -> None:
        self.explorer = explorer
        super().__init__(address, _Handler)

    def server_bind(self) -> None:
        # Without looking up the name of the machine, which may take seconds.
        if self.allow_reuse_address:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.bind(self.server_address)
        self.server_address = self.socket.getsockname()
        self.server_name, self.server_port = ADDRESS, self.server_address[1]

    def handle_error(self, request: Any, client_address: object) -> None:
        """Ignore the error: a page may close in the middle of a reply."""


class _Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    wbufsize = -1
    timeout = IDLE_SECONDS
    server_version, sys_version = "nsdrill", ""
    server: Server

    def do_GET(self) -> None:
        """The static files, and ``/api/alive``, which lasts as long as the page."""
        if not self._check_origin():
            return
        path = self.path.partition("?")[0]
        if path == "/api/alive":
            if self._check_token():
                self._keep_alive()
        elif path in STATIC_FILES:
            name, kind = STATIC_FILES[path]
            self._send(200, f"{kind}; charset=utf-8", static(name))
        else:
            self._refuse(404, "There is no such page.")

    def do_POST(self) -> None:
        """``/api/NAME`` with a JSON object."""
        try:
            size = int(self.headers.get("Content-Length", ""))
        except ValueError:
            size = -1
        if not 0 <= size <= MAX_REQUEST or "Transfer-Encoding" in self.headers:
            self.close_connection = True
            self._refuse(
                413 if size > MAX_REQUEST else 411, f"A request has at most {MAX_REQUEST} bytes, and says how many."
            )
            return
        body = self.rfile.read(size)
        if not self._check_origin() or not self._check_token():
            return
        first, name = self.path.rpartition("/")[::2]
        try:
            request = json.loads(body or b"{}", parse_constant=_refuse_constant)
            if not isinstance(request, dict):
                raise ValueError("not an object")
        except (ValueError, RecursionError):
            self._refuse(400, "The request is no JSON object.")
            return
        try:
            if first != "/api" or name not in REQUESTS:
                self._refuse(404, "There is no such question.")
                return
            # The numbers of a page may be beyond all sense: what a run ends with is in the
            # reply, and numpy's warnings would be on the terminal.
            with interrupt.while_wanted(self._is_waited_for), np.errstate(all="ignore"):
                kind, reply = self.server.explorer.answer(name, request)
        except NsdrillError as error:
            self._refuse(400, str(error))
        except MemoryError:
            self._refuse(500, "Out of memory. Show fewer seconds, or fewer points.")
        except KeyboardInterrupt:
            self._refuse(503, "Stopped: the explorer ends, or nobody waits for the answer.")
        except Exception as error:
            if os.environ.get("NSDRILL_DEBUG"):
                raise
            self._refuse(500, f"This should not happen and is a bug of nsdrill ({type(error).__name__}: {error}).")
        else:
            self._send(200, kind, reply)

    def _is_waited_for(self) -> bool:
        """Whether the page has not closed the connection."""
        try:
            return not _has_input(self.connection) or self.connection.recv(1, socket.MSG_PEEK) != b""
        except OSError:
            return False

    def _check_origin(self) -> bool:
        """Whether the request names this server and comes from one of its pages; else
        it is refused."""
        port = self.server.server_port
        hosts = {f"{name}:{port}" for name in (ADDRESS, "localhost")}
        origins = {None, *(f"http://{host}" for host in hosts)}
        if self.headers.get("Host") not in hosts or self.headers.get("Origin") not in origins:
            self._refuse(403, "This explorer answers pages of its own only.")
            return False
        return True

    def _check_token(self) -> bool:
        """Whether the request has the token; else it is refused."""
        token = self.headers.get(TOKEN_HEADER, "")
        if hmac.compare_digest(token.encode("latin-1", "replace"), self.server.explorer.token.encode()):
            return True
        self._refuse(403, "The token is missing or of another explorer. Open the URL that nsdrill view printed.")
        return False

    def _keep_alive(self) -> None:
        """A response without end. Its end shows the page that the explorer has
        stopped, and the explorer that the page was closed."""
        explorer = self.server.explorer
        self.close_connection = True
        explorer.add_page()
        try:
            self.send_response(200)
            self._send_headers("application/octet-stream")
            self.send_header("Connection", "close")
            self.end_headers()
            self.wfile.write(b".")
            self.wfile.flush()
            while not explorer.stopped.is_set():
                if select.select([self.connection], [], [], 0.2)[0] and not self.connection.recv(1024):
                    return
        except OSError:
            pass
        finally:
            explorer.remove_page()

    def _refuse(self, code: int, words: str) -> None:
        self._send(code, "application/json", json_text({"error": words}).encode())

    def _send_headers(self, kind: str) -> None:
        self.send_header("Content-Type", kind)
        self.send_header("Cache-Control", "no-store")
        self.send_header("Content-Security-Policy", POLICY)
        self.send_header("X-Content-Type-Options", "nosniff")
        self.send_header("Referrer-Policy", "no-referrer")
        self.send_header("Cross-Origin-Resource-Policy", "same-origin")

    def _send(self, code: int, kind: str, body: bytes) -> None:
        self.send_response(code)
        self._send_headers(kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing: the terminal shows only messages to the user."""


REQUESTS = frozenset(("meta", "diagram", "plane", "area", "replay", "live", "section", "orbit", "saved"))


def _has_input(connection: socket.socket) -> bool:
    """Whether something has arrived that is not read yet, or the other side has
    closed."""
    try:
        poll = select.poll()  # unlike select, of files of any number
        poll.register(connection, select.POLLIN)
        return bool(poll.poll(0))
    except (OSError, ValueError):
        return False


def _refuse_constant(name: str) -> None:
    raise ValueError(name)
