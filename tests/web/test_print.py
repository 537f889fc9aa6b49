"""A printed report: on A4 and Letter nothing is cut, and its words are words."""

import json
import re
import shutil
import subprocess

import pytest
from click.testing import CliRunner

from nsdrill.cli.main import group
from nsdrill.web.server import static

from .pdf_words import pages

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
if BROWSER is None:
    pytest.skip("no browser: apt-get install chromium", allow_module_level=True)
if b"paint(" not in static("charts.js"):
    pytest.skip("charts that are not painted as vectors", allow_module_level=True)


@pytest.fixture(scope="module")
def report(shared, tmp_path_factory):
    """Lines with motions, and a map."""
    out = tmp_path_factory.mktemp("print") / "report.html"
    files = [str(shared / "small.h5"), str(shared / "map.h5")]
    done = CliRunner().invoke(group, ["report", *files, "-o", str(out), "--motions", "1"])
    assert done.exit_code == 0, done.output
    return out


@pytest.fixture(scope="module")
def printed(report):
    """As printed from the command line of the browser, without any waiting."""
    out = report.with_suffix(".pdf")
    subprocess.run(
        [
            str(BROWSER),
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-pdf-header-footer",
            f"--print-to-pdf={out}",
            report.as_uri(),
        ],
        check=True,
        capture_output=True,
        timeout=120,
    )
    return pages(out)


def test_every_chart_is_printed_with_its_last_label(printed):
    """The words of a chart are on one page: the axis, and its last tick."""
    text = "\n".join(printed)
    for words, last in (
        ("Rotaryspeed[rad/s]", "8"),  # the peaks of the sweep
        ("Radialpeaksr[mm]", ""),
        ("Rotaryspeed[rpm]" if "Rotaryspeed[rpm]" in text else "Rotaryspeed[rad/s]", ""),
        ("Time[s]", ""),
        ("Wallforce[kN]", ""),
        ("Bitspeed[rad/s]", ""),
        ("Weightonbit[kN]", "100"),
    ):
        assert any(words in page and last in page for page in printed), words
    # the ticks of the lowest panel stand before its label: the last one is there
    assert re.search(r"7(8)?Rotaryspeed\[rad/s\]", text)


def test_the_answer_is_on_the_first_page_and_provenance_on_the_last(printed):
    assert re.search("Runat|Nosafepoint", printed[0])
    assert "HISTORYWASNOTEXAMINED" in printed[0] + printed[1]
    assert "SHA-256" not in "".join(printed[: len(printed) // 2])
    assert "SHA-256" in "".join(printed[-2:])
    assert 4 <= len(printed) <= 12


# ---- in a window


@pytest.fixture(scope="module")
def chromium():
    playwright = pytest.importorskip("playwright.sync_api", reason="no browser: playwright")
    with playwright.sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        yield browser
        browser.close()


@pytest.mark.parametrize("paper", ["A4", "Letter"])
@pytest.mark.parametrize("width", [400, 1280, 2000])
def test_the_window_does_not_decide_what_is_printed(chromium, report, printed, tmp_path, paper, width):
    context = chromium.new_context(viewport={"width": width, "height": 900})
    page = context.new_page()
    page.goto(report.as_uri())
    page.locator("body[data-ready='1']").wait_for()
    page.pdf(path=tmp_path / "a.pdf", format=paper, print_background=True)
    words = "".join(pages(tmp_path / "a.pdf"))
    for label in ("Rotaryspeed[rad/s]", "Time[s]", "Wallforce[kN]", "Weightonbit[kN]"):
        assert words.count(label) == "".join(printed).count(label), label
    # on the screen the page is no wider than the window, on paper than the paper
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    page.emulate_media(media="print")
    page.set_viewport_size({"width": 690, "height": 1000})
    wide = page.evaluate(
        "JSON.stringify([...document.querySelectorAll('img, table, pre, canvas')]"
        ".map(e => e.getBoundingClientRect()).filter(r => r.width).map(r => r.right))"
    )
    assert max(json.loads(wide)) <= 690.5
    assert page.locator(".drawing canvas:visible").count() == 0
    context.close()
