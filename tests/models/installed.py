"""Models of other packages in a folder, as if they were installed, and a Python that finds them."""

import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent / "others"


def install(folder: Path, *names: str) -> None:
    """Make the modules of these names in ``folder`` known as models: those of them that
    stand in ``others``, which are copied, and those that are there already."""
    for name in names:
        if (HERE / f"{name}.py").exists():
            (folder / f"{name}.py").write_text((HERE / f"{name}.py").read_text())
    about = folder / "others-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: others\nVersion: 1.0\n")
    points = "".join(f"{name} = {name}\n" for name in names)
    (about / "entry_points.txt").write_text(f"[nsdrill]\n{points}")


def python(folder: Path, text: str, *more: str) -> list[str]:
    """The lines that the program ``text`` prints in ``folder``, called with these arguments."""
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-c", text, *more],
        env={**os.environ, "PYTHONPATH": path},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout.splitlines()
