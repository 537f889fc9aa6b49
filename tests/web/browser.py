"""How the tests drive a page: Debian's chromium by Playwright. A test is skipped, by
name, where one is missing."""

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nsdrill.web.explorer import Explorer
from nsdrill.web.session import Session

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
WIDTHS = (1280, 400)
WAIT = 120_000  # ms: a first motion may be compiled


def opened(page: Any, url: str) -> Any:
    page.goto(url)
    page.locator("body[data-ready='1']").wait_for(timeout=WAIT)
    if page.url.startswith("http"):  # the first point is run
        page.locator("body[data-moved='1']").wait_for(timeout=WAIT)
    return page


def head_of(answer: Any) -> dict[str, Any]:
    body = answer.body()
    found: dict[str, Any] = json.loads(body[4 : 4 + int.from_bytes(body[:4], "little")])
    return found


def place(page: Any, across: float, up: float = 0.5, chart: str = "#diagram .u-over") -> tuple[float, float]:
    page.locator(chart).first.scroll_into_view_if_needed()
    box = page.locator(chart).first.bounding_box()
    return box["x"] + across * box["width"], box["y"] + up * box["height"]


def clicked(page: Any, across: float) -> dict[str, Any]:
    with page.expect_response("**/api/replay", timeout=WAIT) as answer:
        page.mouse.click(*place(page, across))
    page.locator("#bits").wait_for(timeout=WAIT)
    return head_of(answer.value)


@contextmanager
def running(path: Path, **more: Any) -> Iterator[Explorer]:
    made = Explorer(Session(path, **more))
    made.start()
    try:
        yield made
    finally:
        made.close()
