"""Run the notebooks of the documentation and keep what they show.

    python docs/make_notebooks.py [NAME ...]

The cells are written by hand, in any editor of notebooks; this runs them anew, in a
folder of their own, and writes them back without what changes from one run to the next.
"""

from __future__ import annotations

import base64
import io
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from PIL import Image  # matplotlib needs it, so it is there

FOLDER = Path(__file__).parent / "notebooks"


def executed(path: Path) -> nbformat.NotebookNode:
    """The notebook with the outputs of a run in an empty folder."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        NotebookClient(notebook, timeout=600, resources={"metadata": {"path": folder}}).execute()
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number}"
        cell.metadata = {}
        if cell.cell_type == "code":
            cell.outputs = [_smaller(one) for one in cell.outputs if not _passing(one)]
    notebook.metadata = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}}
    return notebook


def _passing(output: nbformat.NotebookNode) -> bool:
    """What is only there while a cell runs: the bar of a run, and lines on standard
    error."""
    data = output.get("data", {"text/plain": " "})
    return (
        output.get("name") == "stderr"
        or not data.get("text/plain")
        or "application/vnd.jupyter.widget-view+json" in data
    )


def _smaller(output: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """With fewer colours in its picture: the pictures are flat, and the repository
    keeps them for ever."""
    if "image/png" in output.get("data", {}):
        image = Image.open(io.BytesIO(base64.b64decode(output.data["image/png"]))).convert("RGB")
        small = io.BytesIO()
        image.quantize(96, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(
            small, format="PNG", optimize=True
        )
        output.data["image/png"] = base64.b64encode(small.getvalue()).decode()
    return output


def main(names: list[str]) -> None:
    for path in sorted(FOLDER.glob("*.ipynb")):
        if not names or path.stem in names:
            nbformat.write(executed(path), path)
            print(f"{path.name}: {path.stat().st_size // 1024} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
