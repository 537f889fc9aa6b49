"""The home page, the notebooks and the site: what is shown there runs, and the site is
built without a warning."""

import base64
import importlib.util
import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from cli.helpers import call_here

DOCS = Path(__file__).parents[2] / "docs"
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
SECTIONS = re.split(r"^(?=\*\*\[)", (DOCS / "index.md").read_text(encoding="utf-8"), flags=re.M)[1:]
# Of studies that are to run in seconds: the command lines are those of the page, the
# motions shorter.
SHORT = ["--set", "simulation.transient=0.2 s", "--set", "simulation.observe=0.2 s"]


def lines_of(section: str) -> list[str]:
    (block,) = re.findall(r"^```sh\n(.*?)^```", section, re.M | re.S)
    return [line.removeprefix("nsdrill ") for line in block.splitlines()]


NAMES = [re.findall(r"\*\*\[(.*?)\]", section)[0] for section in SECTIONS]
# What takes long to compile is looked at by the test of all pages, which runs nothing.
QUICK = ("A map", "Basins", "Speeds to avoid")


def test_home_has_six_pictures_with_their_commands():
    assert len(SECTIONS) == 6
    for section in SECTIONS:
        assert len(re.findall(r"^!\[", section, re.M)) == 1
        assert lines_of(section)


@pytest.mark.parametrize("name", QUICK)
def test_the_pictures_of_home_run(name, root, tmp_path, capfd, monkeypatch):
    """The commands of a picture make it, from shorter runs of the examples that they
    name."""
    lines = [shlex.split(line) for line in lines_of(SECTIONS[NAMES.index(name)])]
    for example in (root / "configs").glob("*.yaml"):
        (tmp_path / example.name).symlink_to(example)
    monkeypatch.chdir(tmp_path)
    for words in lines:
        shorter = _shortened(words) if words[0] == "run" else words + ["--speed", "5"] * ("--animate" in words)
        call_here(capfd, monkeypatch, *shorter)
    assert (tmp_path / lines[-1][lines[-1].index("-o") + 1]).stat().st_size > 5000


def _shortened(words: list[str]) -> list[str]:
    text = (DOCS.parent / "configs" / words[1]).read_text(encoding="utf-8")
    more = list(SHORT)
    if "poincare" in text:  # of which a few returns are needed
        more = ["--set", "simulation.transient=1 s", "--set", "simulation.observe=20 s"]
    axis = re.search(r"^  (\w[\w.]*): \{from: .*points: (\d+)", text, re.M)
    if axis and int(axis[2]) > 60:
        more += ["--set", f"sweep.{axis[1]}.points=21"]
    if "ensemble:" in text:
        more += ["--set", "initial.ensemble=8"]
    if "slice:" in text:
        more += ["--set", "initial.slice.x.points=8", "--set", "initial.slice.vx.points=8"]
    return [*words, *more]


@pytest.fixture(params=NOTEBOOKS, ids=[path.stem for path in NOTEBOOKS])
def notebook(request):
    return json.loads(request.param.read_text(encoding="utf-8"))


def test_there_are_notebooks_and_the_site_has_them(root):
    assert {"paper_figures", "own_parameters", "coexistence", "branches", "drives", "how_sure"} <= {
        path.stem for path in NOTEBOOKS
    }
    pages = (root / "mkdocs.yml").read_text(encoding="utf-8")
    for path in NOTEBOOKS:
        assert f"notebooks/{path.name}" in pages
        assert path.stat().st_size < 400_000, path.name


def test_what_a_notebook_shows_is_stored(notebook):
    """No error, no warning; figures, Datasets and text are there, and a figure is an
    image wherever one ends a cell."""
    kinds = set()
    for cell in notebook["cells"]:
        for output in cell.get("outputs", ()):
            assert output["output_type"] != "error"
            assert output.get("name") != "stderr"
            kinds |= set(output.get("data", {"text": ""}))
            if image := output.get("data", {}).get("image/png"):
                assert base64.b64decode(image)[:4] == b"\x89PNG"
        last = "".join(cell["source"]).strip().splitlines()[-1]
        if cell["cell_type"] == "code" and last.startswith("nsdrill.plot("):
            assert any("image/png" in output.get("data", {}) for output in cell["outputs"]), last
    assert "image/png" in kinds


NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")


def test_the_cells_of_a_notebook_run_and_print_what_is_stored(notebook, run_python):
    """The words are the same; a number may differ as far as another C library moves a
    chaotic motion."""
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert len(cells) >= 4
    said = run_python("\n".join("".join(cell["source"]) for cell in cells))
    stored = "".join(
        "".join(output["text"]) for cell in cells for output in cell["outputs"] if output.get("name") == "stdout"
    )
    printed, kept = (
        [line for line in text.splitlines() if not line.strip().startswith("made ")] for text in (said, stored)
    )
    assert [NUMBER.sub("#", line) for line in printed] == [NUMBER.sub("#", line) for line in kept]
    for line, other in zip(printed, kept, strict=True):
        found, expected = (list(map(float, NUMBER.findall(text))) for text in (line, other))
        assert found == pytest.approx(expected, rel=0.15, abs=2), line


@pytest.mark.skipif(importlib.util.find_spec("mkdocs_jupyter") is None, reason="needs pip install '.[docs]'")
def test_the_site_is_built_without_a_warning(root, tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "-d", str(tmp_path / "site")],
        cwd=root,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},  # an advertisement of the theme's
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    for page in ("first_diagram", "python", "notebooks/drives"):
        assert (tmp_path / "site" / f"{page}.html").stat().st_size > 10_000, page
    fetched = re.compile(r"<(?:script|img|link)\b[^>]*\b(?:src|href)=\"(?:https?:)?//[^>]*>")
    for page in (tmp_path / "site").rglob("*.html"):
        links = fetched.findall(page.read_text(encoding="utf-8"))
        assert not [link for link in links if "canonical" not in link], page.name
