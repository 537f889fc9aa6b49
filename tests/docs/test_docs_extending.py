"""The examples on the page for those who extend nsdrill run and give what the page says."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest


@pytest.fixture
def blocks(docs: Path, tmp_path: Path) -> list[Path]:
    """The Python blocks of the page, each in a file of its own, as numba wants its functions."""
    found = re.findall(r"^```python\n(.*?)^```", (docs / "extending.md").read_text(encoding="utf-8"), re.M | re.S)
    paths = []
    for number, text in enumerate(found):
        paths.append(tmp_path / f"block_{number}.py")
        paths[-1].write_text(text)
    return paths


def run(path: Path) -> dict[str, Any]:
    names: dict[str, Any] = {"__name__": path.stem, "__file__": str(path)}
    exec(compile(path.read_text(), str(path), "exec"), names)
    return names


def test_the_pairs_are_listed(blocks: list[Path], capsys: pytest.CaptureFixture[str]) -> None:
    run(blocks[0])
    listed = capsys.readouterr().out.splitlines()
    assert listed == ["tsitouras Tsitouras 5(4) 5", "dormand_prince Dormand-Prince 5(4) 5"]


def test_a_limit_cycle_returns_after_its_period(blocks: list[Path]) -> None:
    """Van der Pol's, mu = 1, with the published period; the multiplier of the cycle is 8.6e-4, so that 100 periods have
    forgotten the start. Some thousand steps at rtol 1e-10: 1e-7."""
    names = run(blocks[1])
    difference = names["second"].final[0, :2] - names["first"].final[names["first"].job == 0][0, :2]
    assert np.abs(difference).max() < 1e-7
    assert (names["first"].status == 1).all()


def test_a_model_is_observed_as_declared(blocks: list[Path], docs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The page shows what the example prints. Its numbers make sense: the bit turns as fast as the drive in the mean,
    what it needs is the surface torque, and weak friction lets it turn steadily, at 3 rad/s."""
    names = run(blocks[2])
    page = (docs / "extending.md").read_text(encoding="utf-8")
    shown = re.search(r"^```text\n(bit_speed_max.*?)^```", page, re.M | re.S)
    assert shown is not None
    assert capsys.readouterr().out.split() == shown.group(1).split()
    found, (_, _, damping, drive, torque) = names["found"], names["parameters"][0]
    friction = torque * 2 / np.pi * np.arctan(20.0 * drive) * (0.5 + 1.0 / (1.0 + 3.0 * drive))
    assert found["surface_torque_mean"][0] == pytest.approx(friction + damping * drive, rel=1e-6)
    assert found["stuck_fraction"][0] == 0.0
    assert found["bit_speed_max"][0] == pytest.approx(drive, abs=1e-6)
    assert found["stuck_fraction"][1] > 0.1


STUDY = """\
model: spring
operation: {wob: 60 kN}
sweep:
  rotary_speed: {from: 1 rad/s, to: 9 rad/s, points: 5}
  procedure: up-down
simulation: {transient: 60 s, observe: 40 s}
record: {peaks: 4}
"""


def test_a_model_of_another_package_runs_through_the_commands(blocks: list[Path], tmp_path: Path) -> None:
    """Installed as the page says, with an entry point: each command in a process of its own finds it."""
    folder = tmp_path / "installed"
    (folder / "mypackage").mkdir(parents=True)
    (folder / "mypackage" / "__init__.py").write_text("")
    (folder / "mypackage" / "spring.py").write_text(blocks[3].read_text())
    about = folder / "mypackage-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: mypackage\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[nsdrill.models]\nspring = mypackage.spring\n")
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])

    def nsdrill(*words: str) -> str:
        made = subprocess.run(
            [sys.executable, "-m", "nsdrill", *words],
            cwd=tmp_path, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert made.returncode == 0, made.stderr
        return made.stdout + made.stderr

    (tmp_path / "study.yaml").write_text(STUDY)
    assert "spring.stiffness" in nsdrill("new", "--model", "spring")
    nsdrill("run", "study.yaml", "-o", "out.h5")
    shown = nsdrill("show", "out.h5")
    assert "stick-slip" in shown
    assert "whirl" not in shown
    assert "bit for bit" in nsdrill("replay", "out.h5", "--rotary-speed", "3rad/s", "--procedure", "down", "-o", "r.h5")
    nsdrill("run", "study.yaml", "--set", "sweep.spring.stiffness=[150 N*m/rad, 197 N*m/rad]", "--set",
            "sweep.along=rotary_speed", "-o", "map.h5")  # fmt: skip
    nsdrill("run", "study.yaml", "--set", "record.exponent=true", "-o", "exponent.h5")
    nsdrill("plot", "out.h5", "-o", "out.png")
    nsdrill("plot", "r.h5", "-o", "r.png")
    nsdrill("window", "out.h5")
    nsdrill("export", "out.h5", "-o", "out.csv")
    assert "spring.stiffness" in nsdrill("diff", "out.h5", "map.h5")
