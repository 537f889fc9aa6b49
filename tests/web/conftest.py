"""Sessions of the small studies, opened once, and pages in a browser."""

import pytest

from nsdrill.web.explorer import Explorer
from nsdrill.web.session import Session

from .browser import BROWSER


@pytest.fixture(scope="session")
def session(shared):
    return Session(shared / "small.h5")


@pytest.fixture(scope="session")
def of_map(shared):
    return Session(shared / "map.h5")


@pytest.fixture(scope="module")
def chromium():
    playwright = pytest.importorskip("playwright.sync_api", reason="no browser: pip install playwright")
    if BROWSER is None:
        pytest.skip("no browser: apt-get install chromium")
    with playwright.sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.fixture(scope="module")
def explorer(session):
    made = Explorer(session)
    made.start()
    yield made
    made.close()


@pytest.fixture
def page(chromium, request):
    """A page that may say nothing on the console, fail nowhere, and ask nobody else."""
    width = getattr(request, "param", 1280)
    context = chromium.new_context(viewport={"width": width, "height": 900}, accept_downloads=True)
    made, wrong = context.new_page(), []
    made.on("console", lambda message: wrong.append(f"{message.type}: {message.text}"))
    made.on("pageerror", lambda error: wrong.append(str(error)))
    made.on("request", lambda asked: wrong.append(asked.url) if not _own(asked.url) else None)
    yield made
    context.close()
    assert wrong == getattr(made, "expected", [])


def _own(url: str) -> bool:
    return url.startswith(("http://127.0.0.1:", "file:", "data:", "blob:"))
