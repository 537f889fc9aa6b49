"""How soon the pages answer: command to first diagram, click to motion, slider to
motion, the report.

    python -m benchmarks.explorer [--rounds 5] [--clicks 25] [--out explorer] [--quick]

Needs Playwright and Debian's chromium (`pip install '.[browser]'`, `apt-get install
chromium`). Headless, without a graphics processor. *Drawn* is the second animation
frame after the last change of the page. Two files: figure 4 of the paper, and 3200
points with 102,400 peaks in each panel. Machine code is in the cache. Times are wall
times, medians with least and greatest: run it on a machine that does nothing else.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machine import describe, table, where, write

CONFIG = Path(__file__).parents[1] / "configs" / "fig4_speed_22kN.yaml"
MANY = """\
title: A hundred thousand peaks
sweep: {rotary_speed: {from: 0.5 rad/s, to: 8 rad/s, points: 3200}}
simulation: {transient: 60 s, observe: 60 s}
"""
# When a hand has done something, and when what follows from it is on the screen.
WATCH = """
window.drawn = [];
for (const name of ["mousedown", "input"]) addEventListener(name, () => { window.begun = performance.now(); }, true);
addEventListener("DOMContentLoaded", () => {
  const frames = () => requestAnimationFrame(() => requestAnimationFrame(() => {
    if (window.begun) { window.drawn.push(performance.now() - window.begun); window.begun = 0; }
  }));
  new MutationObserver(frames).observe(document.getElementById("which"), { childList: true });
});
"""


def nsdrill(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "nsdrill", *arguments]


def first_diagram(browser: Any, file: Path) -> float:
    """Seconds from the command to the diagram in a browser that is there."""
    begun = time.perf_counter()
    with subprocess.Popen(nsdrill("view", str(file), "--no-browser"), stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.goto(process.stdout.readline().strip())
        page.locator("body[data-ready='1']").wait_for()
        page.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
        seconds = time.perf_counter() - begun
        page.close()
        process.terminate()
    return seconds


def answers(browser: Any, file: Path, count: int) -> dict[str, list[float]]:
    """Seconds until a click and a slider are drawn."""
    with subprocess.Popen(nsdrill("view", str(file), "--no-browser"), stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.add_init_script(WATCH)
        page.goto(process.stdout.readline().strip())
        page.locator("body[data-ready='1']").wait_for()
        box = page.locator("#diagram .u-over").first.bounding_box()
        page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"])
        page.locator("#bits").wait_for(timeout=300_000)
        page.wait_for_timeout(15_000)  # what computes is ready
        found: dict[str, list[float]] = {}

        def taken(name: str, work: Any, patience: float) -> None:
            page.evaluate("window.drawn.length = 0")
            work()
            limit = time.perf_counter() + patience
            while not (seen := page.evaluate("window.drawn")) and time.perf_counter() < limit:
                page.wait_for_timeout(20)
            found.setdefault(name, []).extend(0.001 * value for value in seen)

        for part in np.linspace(0.03, 0.97, count):
            place = box["x"] + float(part) * box["width"], box["y"] + 0.5 * box["height"]
            taken("click to motion", lambda place=place: page.mouse.click(*place), 10)
        for key in ("rotary_speed", "wob"):
            page.locator(f"#s-{key}").focus()
            for number in range(count):
                press = "ArrowRight" if number % 4 < 2 else "ArrowLeft"
                taken("slider to motion", lambda press=press: page.keyboard.press(press), 10)
        page.close()
        process.terminate()
    return found


def report(file: Path, folder: Path) -> tuple[float, int]:
    """Seconds for the command, and bytes of its page."""
    begun = time.perf_counter()
    subprocess.run(nsdrill("report", str(file), "-o", str(folder / "r.html"), "--overwrite"), check=True, stderr=-3)
    return time.perf_counter() - begun, (folder / "r.html").stat().st_size


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--clicks", type=int, default=25)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, help="write OUT.md and OUT.json")
    arguments = parser.parse_args()
    rounds, clicks = (2, 5) if arguments.quick else (arguments.rounds, arguments.clicks)
    from playwright.sync_api import sync_playwright

    machine, kept, rows = describe(), {}, []
    with tempfile.TemporaryDirectory() as name, sync_playwright() as engine:
        folder = Path(name)
        (folder / "many.yaml").write_text(MANY)
        browser = engine.chromium.launch(executable_path=shutil.which("chromium"), args=["--no-sandbox"])
        for label, study in (("figure 4", CONFIG), ("102,400 peaks", folder / "many.yaml")):
            file = folder / f"{study.stem}.h5"
            subprocess.run(nsdrill("run", str(study), "-o", str(file), "--quiet"), check=True)
            first_diagram(browser, file)
            times = {"command to first diagram": [first_diagram(browser, file) for _ in range(rounds)]}
            times |= answers(browser, file, clicks)
            pages = [report(file, folder) for _ in range(rounds)]
            times["report"] = [seconds for seconds, _ in pages]
            kept[label] = {**times, "report bytes": pages[0][1]}
            for what, seen in times.items():
                middle, least, most = np.median(seen), min(seen), max(seen)
                rows.append(
                    [label, what, str(len(seen)), f"{1e3 * middle:.0f}", f"{1e3 * least:.0f}", f"{1e3 * most:.0f}"]
                )
            rows.append([label, "size of the report", "1", f"{pages[0][1] / 1e6:.2f} MB", "", ""])
        browser.close()
    heads = ["file", "what", "times", "median ms", "least", "greatest"]
    write(arguments.out, f"{where(machine)}\n\n{table(heads, rows)}\n", {"machine": machine, "seconds": kept})


if __name__ == "__main__":
    main()
