"""Only a page of this machine that has the token is answered, and only with what it may
have."""

from __future__ import annotations

import http.client
import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from nsdrill.errors import InputError
from nsdrill.web.server import ADDRESS, CLOSE_DELAY, MAX_REQUEST, TOKEN_HEADER, Explorer
from nsdrill.web.session import Session


@pytest.fixture
def explorer(session: Session) -> Iterator[Explorer]:
    made = Explorer(session)
    made._warm = lambda: None  # type: ignore[method-assign]
    made.start()
    yield made
    made.close()


def ask(
    explorer: Explorer, method: str, path: str, body: str | bytes | None = None, **heads: str | None
):  # type: ignore[no-untyped-def]
    """(status, heads, body) of a request with the token and the right origin, but for
    what is given."""
    named = {"Host": f"{ADDRESS}:{explorer.port}", TOKEN_HEADER: explorer.token}
    for name, value in heads.items():
        name = {"token": TOKEN_HEADER}.get(name, name.replace("_", "-"))
        if value is None:
            named.pop(name, None)
        else:
            named[name] = value
    connection = http.client.HTTPConnection(ADDRESS, explorer.port, timeout=20)
    connection.putrequest(method, path, skip_host=True)
    if body is not None and "Content-Length" not in named:
        named["Content-Length"] = str(len(body))
    for name, value in named.items():
        connection.putheader(name, value)
    connection.endheaders(body.encode() if isinstance(body, str) else body)
    answer = connection.getresponse()
    found = answer.read()
    connection.close()
    return answer.status, answer.headers, found


def test_a_page_with_the_token_is_answered(explorer: Explorer) -> None:
    status, heads, body = ask(explorer, "POST", "/api/meta", "{}")
    assert status == 200
    assert json.loads(body)["points"] == 16
    assert "Access-Control-Allow-Origin" not in heads
    assert heads["X-Content-Type-Options"] == "nosniff"
    policy = heads["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'")
    assert "unsafe" not in policy
    status, _, body = ask(explorer, "POST", "/api/replay", '{"place": [0, 0, 0, 1], "seconds": 1}')
    assert status == 200
    assert json.loads(body[4 : 4 + int.from_bytes(body[:4], "little")])["same_bits"] is True


@pytest.mark.parametrize("token", [None, "", "wrong", "ä"])
@pytest.mark.parametrize(
    ("method", "path"), [("POST", "/api/meta"), ("POST", "/api/saved"), ("GET", "/api/alive")]
)
def test_without_the_token_nothing_is_told(
    explorer: Explorer, token: str | None, method: str, path: str
) -> None:
    status, _, body = ask(explorer, method, path, "{}" if method == "POST" else None, token=token)
    assert status == 403
    assert b"Small" not in body


@pytest.mark.parametrize(
    "host", ["example.com", "example.com:80", "127.0.0.1:1", "localhost", "[::1]:80", ""]
)
@pytest.mark.parametrize("path", ["/", "/explorer.js", "/api/meta"])
def test_another_host_is_refused(explorer: Explorer, host: str, path: str) -> None:
    """A name that somebody makes lead to this machine must not serve."""
    status, _, _ = ask(
        explorer,
        "POST" if "api" in path else "GET",
        path,
        "{}" if "api" in path else None,
        Host=host,
    )
    assert status == 403


@pytest.mark.parametrize(
    "origin", ["http://example.com", "null", "http://127.0.0.1:1", "https://localhost"]
)
def test_a_page_of_another_origin_is_refused(explorer: Explorer, origin: str) -> None:
    assert ask(explorer, "POST", "/api/meta", "{}", Origin=origin)[0] == 403
    assert (
        ask(explorer, "POST", "/api/meta", "{}", Origin=f"http://localhost:{explorer.port}")[0]
        == 200
    )


def test_a_preflight_is_not_granted(explorer: Explorer) -> None:
    status, heads, _ = ask(explorer, "OPTIONS", "/api/meta", Origin="http://example.com")
    assert status >= 400
    assert not [name for name in heads if name.lower().startswith("access-control")]


@pytest.mark.parametrize(
    "path",
    [
        "/../session.py",
        "/static/../../web/session.py",
        "/%2e%2e/session.py",
        "//etc/passwd",
        "/etc/passwd",
        "/charts",
        "/uplot/LICENSE",
        "/api/../explorer.js",
        "/api/",
        "/api/alive/x",
        "/api/path",
    ],
)
def test_no_file_can_be_asked_for(explorer: Explorer, path: str) -> None:
    assert ask(explorer, "GET", path)[0] == 404
    assert ask(explorer, "POST", path, "{}")[0] == 404


@pytest.mark.parametrize("body", ["", "[]", "1", "{", '{"a": NaN}', "\x00", "[" * 5000])
def test_what_is_no_json_object_is_refused(explorer: Explorer, body: str) -> None:
    status, _, answer = ask(explorer, "POST", "/api/replay", body)
    assert status == 400
    assert json.loads(answer)["error"]


def test_a_request_has_a_limit(explorer: Explorer) -> None:
    assert ask(explorer, "POST", "/api/meta", "{}", Content_Length=str(MAX_REQUEST + 1))[0] == 413
    assert ask(explorer, "POST", "/api/meta", "{}", Content_Length="-1")[0] == 411
    assert ask(explorer, "POST", "/api/meta", "{}", Content_Length="ten")[0] == 411
    assert ask(explorer, "POST", "/api/meta", "{}", Transfer_Encoding="chunked")[0] == 411
    assert ask(explorer, "POST", "/api/meta", "{}")[0] == 200  # and goes on


def test_it_listens_on_this_machine_only(explorer: Explorer) -> None:
    assert explorer._server.socket.getsockname()[0] == "127.0.0.1"


def test_tokens_differ(session: Session) -> None:
    one, two = Explorer(session), Explorer(session)
    assert one.token != two.token
    assert one.port != two.port
    assert len(one.token) >= 32
    one._server.server_close()
    two._server.server_close()


def test_a_taken_port_is_said(explorer: Explorer, session: Session) -> None:
    with pytest.raises(InputError, match=f"--port: found {explorer.port}"):
        Explorer(session, explorer.port)
    with pytest.raises(InputError, match="0 to 65535"):
        Explorer(session, 70000)


def test_a_page_that_goes_away_in_the_middle_stops_nothing(explorer: Explorer) -> None:
    for _ in range(3):
        with socket.create_connection((ADDRESS, explorer.port)) as raw:
            raw.sendall(
                f"POST /api/replay HTTP/1.1\r\nHost: {ADDRESS}:{explorer.port}\r\n{TOKEN_HEADER}: "
                f"{explorer.token}\r\n"
                'Content-Length: 33\r\n\r\n{"place": [0, 0, 0, 1], "x": "y"}'.encode()
            )
    assert ask(explorer, "POST", "/api/meta", "{}")[0] == 200


def test_it_stops_with_its_last_page(explorer: Explorer) -> None:
    def page() -> socket.socket:
        raw = socket.create_connection((ADDRESS, explorer.port))
        raw.sendall(
            f"GET /api/alive HTTP/1.1\r\nHost: {ADDRESS}:{explorer.port}\r\n{TOKEN_HEADER}: "
            f"{explorer.token}\r\n\r\n".encode()
        )
        assert raw.recv(100).startswith(b"HTTP/1.1 200")
        return raw

    one, two = page(), page()
    one.close()
    begun = time.monotonic()
    ends: list[float] = []

    def look() -> None:
        now = time.monotonic() - begun
        if now > 0.8 and not ends:
            ends.append(now)
            two.close()
        assert now < 30

    assert explorer.wait(look) == "The page was closed."
    assert ends
    assert time.monotonic() - begun >= ends[0] + CLOSE_DELAY - 0.5


@pytest.mark.parametrize("signal", ["SIGINT", "SIGTERM"])
def test_the_command_prints_its_address_and_ends_with_a_signal(shared: Path, signal: str) -> None:
    import signal as signals

    command = [sys.executable, "-m", "nsdrill", "view", str(shared / "small.h5"), "--no-browser"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        url = process.stdout.readline().strip()
        assert url.startswith(f"http://{ADDRESS}:")
        assert len(url.partition("#")[2]) >= 32
        process.send_signal(getattr(signals, signal))
        _, said = process.communicate(timeout=60)
    assert process.returncode == 0
    assert said.splitlines()[-1] == "Stopped."
    assert "Traceback" not in said


@pytest.mark.parametrize(
    "arguments", [["nothing.h5"], ["small.h5", "--port", "70000"], ["small.h5", "--set", "a=b"]]
)
def test_wrong_commands_end_with_words(shared: Path, arguments: list[str]) -> None:
    command = [sys.executable, "-m", "nsdrill", "view", "--no-browser", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=shared, timeout=60)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Error: " in done.stderr
    assert "Traceback" not in done.stderr
