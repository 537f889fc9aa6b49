"""Only a page of this machine that has the token is answered, and only with what it may
have."""

import http.client
import json
import os
import re
import signal as signals
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest
from cli.helpers import call_here

from nsdrill.errors import InputError
from nsdrill.web import server
from nsdrill.web.explorer import CLOSE_DELAY, Explorer
from nsdrill.web.server import ADDRESS, MAX_REQUEST, TOKEN_HEADER
from nsdrill.web.session import Session

PATIENCE = 120  # s that a client waits: the machine of the tests may be busy


@contextmanager
def serving(session: Session) -> Iterator[Explorer]:
    made = Explorer(session)
    made._warm = lambda: None
    made.start()
    yield made
    made.close()


@pytest.fixture(scope="module")
def explorer(session):
    with serving(session) as made:
        yield made


@pytest.fixture
def own(session):
    """An explorer that a test may end."""
    with serving(session) as made:
        yield made


def ask(explorer: Explorer, method: str, path: str, body: str | bytes | None = None, **heads: str | None):
    """(status, heads, body) of a request with the token and the right origin, but for
    what is given."""
    named = {"Host": f"{ADDRESS}:{explorer.port}", TOKEN_HEADER: explorer.token}
    for name, value in heads.items():
        name = {"token": TOKEN_HEADER}.get(name, name.replace("_", "-"))
        if value is None:
            named.pop(name, None)
        else:
            named[name] = value
    connection = http.client.HTTPConnection(ADDRESS, explorer.port, timeout=PATIENCE)
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


def raw_request(port: int, token: str, line: str, body: str = "") -> socket.socket:
    """A connection over which this request was sent, with the token."""
    raw = socket.create_connection((ADDRESS, port))
    heads = [f"{line} HTTP/1.1", f"Host: {ADDRESS}:{port}", f"{TOKEN_HEADER}: {token}"]
    heads += [f"Content-Length: {len(body)}"] * line.startswith("POST")
    raw.sendall("\r\n".join([*heads, "", body]).encode())
    return raw


def test_a_page_with_the_token_is_answered(explorer):
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
@pytest.mark.parametrize(("method", "path"), [("POST", "/api/meta"), ("POST", "/api/saved"), ("GET", "/api/alive")])
def test_without_the_token_nothing_is_told(explorer, token, method, path):
    status, _, body = ask(explorer, method, path, "{}" if method == "POST" else None, token=token)
    assert status == 403
    assert b"Small" not in body


@pytest.mark.parametrize("host", ["example.com", "example.com:80", "127.0.0.1:1", "localhost", "[::1]:80", ""])
@pytest.mark.parametrize("path", ["/", "/explorer.js", "/api/meta"])
def test_another_host_is_refused(explorer, host, path):
    """A name that somebody makes lead to this machine must not serve."""
    status, _, _ = ask(explorer, "POST" if "api" in path else "GET", path, "{}" if "api" in path else None, Host=host)
    assert status == 403


@pytest.mark.parametrize(
    "origin", ["http://example.com", "null", "http://127.0.0.1:1", "https://127.0.0.1:{port}", "127.0.0.1:{port}"]
)
def test_a_page_of_another_origin_is_refused(explorer, origin):
    """An origin is scheme, host and port."""
    assert ask(explorer, "POST", "/api/meta", "{}", Origin=origin.format(port=explorer.port))[0] == 403
    assert ask(explorer, "POST", "/api/meta", "{}", Origin=f"http://localhost:{explorer.port}")[0] == 200


def test_a_preflight_is_not_granted(explorer):
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
def test_no_file_can_be_asked_for(explorer, path):
    assert ask(explorer, "GET", path)[0] == 404
    assert ask(explorer, "POST", path, "{}")[0] == 404


@pytest.mark.parametrize("body", ["", "[]", "1", "{", '{"a": NaN}', "\x00", "[" * 5000])
def test_what_is_no_json_object_is_refused(explorer, body):
    status, _, answer = ask(explorer, "POST", "/api/replay", body)
    assert status == 400
    assert json.loads(answer)["error"]


def test_a_request_has_a_limit(explorer):
    assert ask(explorer, "POST", "/api/meta", "{}", Content_Length=str(MAX_REQUEST + 1))[0] == 413
    assert ask(explorer, "POST", "/api/meta", "{}", Content_Length="-1")[0] == 411
    assert ask(explorer, "POST", "/api/meta", "{}", Content_Length="ten")[0] == 411
    assert ask(explorer, "POST", "/api/meta", "{}", Transfer_Encoding="chunked")[0] == 411
    assert ask(explorer, "POST", "/api/meta", "{}")[0] == 200  # and goes on


HUGE = 10**400


@pytest.mark.parametrize(
    ("name", "request_", "words"),
    [
        ("live", {"changes": {"wob": HUGE}}, "wob: found 1000"),
        ("live", {"changes": {"wob": 1e308}}, r"wob: found 1e\+308; allowed: a number with its unit"),
        ("saved", {"changes": {"rotary_speed": -1e308}}, r"rotary_speed: found -1e\+308"),
        ("live", {"changes": {"depth": 1e308}}, r"depth: found 1e\+308"),
        ("live", {"changes": {"bit.lobes": HUGE}}, "bit.lobes: found 1000"),
        ("live", {"state": [HUGE] * 9}, "state: found something else"),
        *[
            (
                name,
                {"state": state},
                rf"state: found {found}; allowed: 9 numbers between -1e\+12 and 1e\+12 in SI units",
            )
            for name in ("live", "saved")
            for state, found in (
                ([1e300] + [0] * 8, r"9 numbers up to 1e\+300"),
                ([0] * 8 + [-1e308], r"9 numbers up to 1e\+308"),
                ([0] * 8, "8 numbers up to 0"),
            )
        ],
        ("live", {"state": [float("1e309")]}, "no JSON object"),
        ("live", {"seconds": HUGE}, "seconds: found 1000"),
        ("replay", {"place": [HUGE, 0, 0, 0]}, r"place: found \[1000"),
    ],
)
def test_extreme_numbers_are_refused_in_words(explorer, name, request_, words):
    body = json.dumps({"place": [0, 0, 0, 1]} | request_)
    status, _, answer = ask(explorer, "POST", f"/api/{name}", body)
    assert status == 400, answer
    assert re.search(words, json.loads(answer)["error"]), answer


def test_warnings_of_numpy_stay_off_the_terminal(explorer, monkeypatch, recwarn):
    def overflowing(request):
        return {}, {"x": np.exp(np.array([1e308])) - np.exp(np.array([1e308]))}

    monkeypatch.setattr(explorer.session, "live", overflowing)
    assert ask(explorer, "POST", "/api/live", "{}")[0] == 200
    assert not recwarn.list


def test_a_run_that_nobody_waits_for_stops(explorer):
    """Each would take its limit of 4 million steps, some seconds."""
    _, _, reply = ask(explorer, "POST", "/api/live", '{"seconds": 1}')
    head = json.loads(reply[4 : 4 + int.from_bytes(reply[:4], "little")])
    body = json.dumps({"state": head["state"], "states": head["states"], "seconds": 1e6})
    used = time.process_time()
    for _ in range(8):
        with raw_request(explorer.port, explorer.token, "POST /api/live", body):
            time.sleep(0.3)
    replay = '{"place": [0, 0, 0, 1], "seconds": 1}'
    assert ask(explorer, "POST", "/api/replay", replay)[0] == 200
    with explorer.session._compute_lock:
        assert time.process_time() - used < 8.0


def test_idle_connections_hold_nobody_up_and_end(explorer, monkeypatch):
    """Some with a part of a request, or one without a token."""
    monkeypatch.setattr(server._Handler, "timeout", 2.0)
    before = threading.active_count()
    idle = [socket.create_connection((ADDRESS, explorer.port)) for _ in range(200)]
    for number, raw in enumerate(idle):
        raw.sendall((b"", b"POST /api/meta HTT", b"GET /nothing HTTP/1.1\r\n\r\n")[number % 3])
    assert ask(explorer, "POST", "/api/meta", "{}")[0] == 200
    until = time.monotonic() + PATIENCE
    while threading.active_count() > before and time.monotonic() < until:
        time.sleep(0.1)
    assert threading.active_count() <= before
    for raw in idle:
        raw.close()


def test_many_clients_at_once_are_all_answered(explorer):
    together, found = threading.Barrier(1000), []

    def one():
        together.wait()
        found.append(ask(explorer, "POST", "/api/meta", "{}")[0])

    threads = [threading.Thread(target=one) for _ in range(together.parties)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [200] * together.parties


def test_the_browser_is_not_started_with_the_token(shared, tmp_path):
    """Programs' arguments can be read by every user of the machine, a file of mode 0600
    by its owner. It is removed with the first page, or with the explorer."""
    seen = tmp_path / "seen"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\nprintf %s "$*" > {seen}.part; mv {seen}.part {seen}\n')
    browser.chmod(0o700)
    for opens in (True, False):
        command = [sys.executable, "-m", "nsdrill", "view", str(shared / "small.h5")]
        environment = {**os.environ, "HOME": str(tmp_path), "BROWSER": f"{browser} %s"}
        with subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as process:
            url, _, token = process.stdout.readline().strip().partition("#")
            until = time.monotonic() + 30
            while not seen.exists() and time.monotonic() < until:
                time.sleep(0.02)
            words = seen.read_text()
            seen.unlink()
            page = Path(words.removeprefix("file://"))
            assert token not in words
            assert page.stat().st_mode & 0o777 == 0o600
            assert f"{url}#{token}" in page.read_text()
            if opens:
                port = int(url.rstrip("/").rpartition(":")[2])
                raw = raw_request(port, token, "GET /api/alive")
                assert raw.recv(20).startswith(b"HTTP/1.1 200")
                while page.exists() and time.monotonic() < until:
                    time.sleep(0.02)
                assert not page.exists()
                raw.close()
            process.send_signal(signals.SIGINT)
            process.communicate(timeout=60)
        assert process.returncode == 0
        assert not page.exists()


def test_it_listens_on_this_machine_only(explorer):
    assert explorer._server.socket.getsockname()[0] == "127.0.0.1"


def test_tokens_differ(session):
    one, two = Explorer(session), Explorer(session)
    assert one.token != two.token
    assert one.port != two.port
    assert len(one.token) >= 32
    one._server.server_close()
    two._server.server_close()


def test_a_taken_port_is_said(explorer, session):
    with pytest.raises(InputError, match=f"port: found {explorer.port}"):
        Explorer(session, explorer.port)
    with pytest.raises(InputError, match="0 to 65535"):
        Explorer(session, 70000)


def test_a_page_that_goes_away_in_the_middle_stops_nothing(explorer):
    for _ in range(3):
        raw_request(explorer.port, explorer.token, "POST /api/replay", '{"place": [0, 0, 0, 1], "x": "y"}').close()
    assert ask(explorer, "POST", "/api/meta", "{}")[0] == 200


def test_it_stops_with_its_last_page(own):
    def page():
        raw = raw_request(own.port, own.token, "GET /api/alive")
        assert raw.recv(100).startswith(b"HTTP/1.1 200")
        return raw

    one, two = page(), page()
    one.close()
    begun = time.monotonic()
    ends = []

    def look():
        now = time.monotonic() - begun
        if now > 0.8 and not ends:
            ends.append(now)
            two.close()
        assert now < 30

    assert own.wait(look) == "The page was closed."
    assert ends
    assert time.monotonic() - begun >= ends[0] + CLOSE_DELAY - 0.5


@pytest.mark.parametrize("signal", ["SIGINT", "SIGTERM"])
def test_the_command_prints_its_address_and_ends_with_a_signal(shared, signal):
    command = [sys.executable, "-m", "nsdrill", "view", str(shared / "small.h5"), "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        url = process.stdout.readline().strip()
        assert url.startswith(f"http://{ADDRESS}:")
        assert len(url.partition("#")[2]) >= 32
        process.send_signal(getattr(signals, signal))
        _, said = process.communicate(timeout=60)
    assert process.returncode == 0
    assert said.splitlines()[-1] == "Stopped."
    assert "Traceback" not in said


STARTER = """\
import os, subprocess, sys
apart = sys.argv[1] == "setsid"
print(subprocess.Popen(sys.argv[2:], stdin=subprocess.DEVNULL, start_new_session=apart).pid, flush=True)
sys.stdin.read()
"""


@pytest.mark.parametrize("way", ["plain", "setsid"])
def test_an_explorer_whose_program_is_killed_ends_unless_it_is_to_live_on(shared, way):
    view = [sys.executable, "-m", "nsdrill", "view", str(shared / "small.h5"), "--no-browser"]
    starter = subprocess.Popen(
        [sys.executable, "-c", STARTER, way, *view], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    number = int(starter.stdout.readline())
    try:
        assert starter.stdout.readline().startswith(f"http://{ADDRESS}:")
        starter.kill()
        starter.wait()
        until = time.monotonic() + (60 if way == "plain" else 3)
        while (is_alive := Path(f"/proc/{number}/stat").exists()) and time.monotonic() < until:
            is_alive = Path(f"/proc/{number}/stat").read_text().split()[2] != "Z"
            if not is_alive:
                break
            time.sleep(0.1)
        assert is_alive == (way == "setsid")
    finally:
        with suppress(ProcessLookupError):
            os.kill(number, signals.SIGKILL)
        starter.stdin.close()
        starter.stdout.close()


@pytest.mark.parametrize("arguments", [["nothing.h5"], ["small.h5", "--port", "70000"], ["small.h5", "--set", "a=b"]])
def test_wrong_commands_end_with_words(shared, arguments, capfd, monkeypatch):
    monkeypatch.chdir(shared)
    answer = call_here(capfd, monkeypatch, "view", "--no-browser", *arguments, code=2)
    assert answer.out == ""
    assert "Error: " in answer.err
