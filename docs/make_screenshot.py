"""Photograph the explorer for its page: the study of figure 4, a point clicked, the
speed moved down.

    python docs/make_screenshot.py fig4.h5

Needs Playwright and chromium (`pip install '.[browser]' && apt-get install chromium`).
"""

from __future__ import annotations

import argparse
import shutil
from importlib.util import find_spec
from pathlib import Path

from PIL import Image  # matplotlib needs it, so it is there

import nsdrill

PICTURE = Path(__file__).parent / "pictures" / "explorer.png"


def main(results: str, chromium: str) -> None:
    from playwright.sync_api import sync_playwright

    with nsdrill.view(results) as view, sync_playwright() as engine:
        browser = engine.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1280, "height": 1000})
        page.goto(view.url)
        page.locator("body[data-ready='1']").wait_for()
        box = page.locator("#diagram .u-over").first.bounding_box()
        with page.expect_response("**/api/replay", timeout=300_000):
            page.mouse.click(box["x"] + 0.83 * box["width"], box["y"] + 0.2 * box["height"])
        page.wait_for_timeout(1000)
        page.locator("#s-rotary_speed").focus()
        for _ in range(14):
            with page.expect_response("**/api/live", timeout=300_000):
                page.keyboard.press("ArrowLeft")
        page.wait_for_timeout(500)
        page.screenshot(path=PICTURE, full_page=True)
        browser.close()
    image = Image.open(PICTURE).convert("RGB")
    image.quantize(64, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(PICTURE, optimize=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("results", help="results of configs/fig4_speed_22kN.yaml: nsdrill run ... -o fig4.h5")
    asked = parser.parse_args()
    browser = shutil.which("chromium")
    if find_spec("playwright") is None or browser is None:
        missing = "chromium on the PATH" if browser is None else "Playwright"
        parser.exit(
            1,
            f"make_screenshot.py: found no {missing}; `pip install '.[browser]' && apt-get install chromium` helps.\n",
        )
    try:
        main(asked.results, browser)
    except nsdrill.NsdrillError as error:
        parser.exit(1, f"make_screenshot.py: {error}\n")
