"""The pages, and the scripts of the documentation as modules."""

import importlib.util
import linecache
import os
import subprocess
import sys
import warnings
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.rglob("*.md"), *ROOT.glob("*.md")])


def script(name: str) -> ModuleType:
    """The script ``docs/NAME.py``, imported."""
    label = f"nsdrill_docs_{name}"
    if label not in sys.modules:
        spec = importlib.util.spec_from_file_location(label, DOCS / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        sys.modules[label] = module
        spec.loader.exec_module(module)
    return sys.modules[label]


SEVERAL = """\
import shlex, sys
from nsdrill.__main__ import main
codes, *lines = sys.argv[1:]
for line in lines:
    sys.argv = shlex.split(line, comments=True)
    print("$", line, flush=True)
    try:
        main()
    except SystemExit as end:
        if str(end.code or 0) not in codes:
            raise
"""


def run_commands(lines: list[str], folder: Path, codes: str = "0", **environment: str) -> list[str]:
    """What command lines as in a shell print, run one after the other in ``folder``, all
    in one process; each ends with one of these exit codes."""
    done = subprocess.run(
        [sys.executable, "-c", SEVERAL, codes, *lines],
        cwd=folder,
        env={**os.environ, "MPLBACKEND": "Agg", **environment},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
    return done.stdout.split("$ nsdrill ")[1:]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    if "page" in metafunc.fixturenames:
        metafunc.parametrize("page", PAGES, ids=lambda page: page.name)
    if "case" in metafunc.fixturenames:
        metafunc.parametrize("case", script("verify").CASES)


@pytest.fixture
def run_python(tmp_path, monkeypatch, capsys):
    """Gives what a program prints that is run in an empty folder, without a screen; a
    warning of a run is an error."""
    import matplotlib
    from matplotlib import pyplot

    from nsdrill.errors import RunWarning

    matplotlib.use("Agg")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pyplot, "show", lambda: None)

    def run(text):
        # models are read from their source, as a notebook keeps that of its cells
        linecache.cache["<page>"] = (len(text), None, text.splitlines(keepends=True), "<page>")
        with warnings.catch_warnings():
            warnings.simplefilter("error", RunWarning)
            exec(compile(text, "<page>", "exec"), {"__name__": "__main__"})
        return capsys.readouterr().out

    yield run
    pyplot.close("all")


@pytest.fixture(name="run_commands")
def _run_commands():
    return run_commands


@pytest.fixture
def docs():
    return DOCS


@pytest.fixture
def root():
    return ROOT


@pytest.fixture
def tables():
    return script("make_tables")


@pytest.fixture
def verify():
    return script("verify")


@pytest.fixture
def validate():
    return script("validate")


@pytest.fixture(scope="session")
def make_site():
    return script("make_site")
