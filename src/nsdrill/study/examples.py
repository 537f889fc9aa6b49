"""Studies that come with nsdrill: those of the papers, by the names of their files."""

from __future__ import annotations

from pathlib import Path

_INSTALLED = Path(__file__).parents[1] / "examples"
# in place of them, where the package is not installed
_CHECKOUT = Path(__file__).parents[3] / "configs"


def examples() -> dict[str, Path]:
    """The files by name, in alphabetical order."""
    folder = _INSTALLED if _INSTALLED.is_dir() else _CHECKOUT
    return {path.stem: path for path in sorted(folder.glob("*.yaml"))}


def title_of(path: Path) -> str:
    """The title that a study's file begins with, or its name."""
    lines = path.read_text(encoding="utf-8").splitlines()
    found = next(
        (line.partition(":")[2].strip() for line in lines if line.startswith("title:")), ""
    )
    return found.strip("\"'") or path.stem
