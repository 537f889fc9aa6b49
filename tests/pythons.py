"""The Pythons of this machine: those of pyenv and uv, those on the PATH, and those
named in NSDRILL_TEST_PYTHONS."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

OLDEST = (3, 11)
SRC = Path(__file__).parents[1] / "src"


def _candidates() -> Iterator[Path]:
    """First the environments that somebody has made for this, separated like the
    folders of the PATH."""
    yield Path(sys.executable)
    yield from map(Path, filter(None, os.environ.get("NSDRILL_TEST_PYTHONS", "").split(os.pathsep)))
    home = Path.home()
    pyenv = Path(os.environ.get("PYENV_ROOT", home / ".pyenv")) / "versions"
    uv = Path(os.environ.get("UV_PYTHON_INSTALL_DIR", home / ".local/share/uv/python"))
    for folder in (pyenv, uv):
        yield from sorted(folder.glob("*/bin/python3"))
    for minor in range(OLDEST[1], 20):
        if found := shutil.which(f"python3.{minor}"):
            yield Path(found)


def _version(python: Path) -> str:
    """As "3.12"; empty where it does not run, as a shim of pyenv may not, or is too
    old."""
    code = f"import sys; print('%d.%d' % sys.version_info[:2] if sys.version_info >= {OLDEST} else '')"
    try:
        done = subprocess.run([str(python), "-I", "-c", code], capture_output=True, text=True, timeout=30)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""


@lru_cache(maxsize=1)
def pythons() -> dict[str, list[Path]]:
    """The interpreters of each version; one version may have several, and not all of
    them the packages. The one that runs the tests is the first of the first version."""
    found: dict[str, list[Path]] = {}
    for python in dict.fromkeys(_candidates()):
        if version := _version(python):
            found.setdefault(version, []).append(python)
    return found


def run(python: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """The words as a Python's command line, with this checkout as the package."""
    env = {**os.environ, "PYTHONPATH": str(SRC), "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run([str(python), *words], capture_output=True, text=True, env=env, timeout=600)
