"""What packages add by an entry point of the group nsdrill: imported where a name is not
known, and nowhere else."""

import os
import subprocess
import sys

import pytest

MODULE = """
import nsdrill
from nsdrill import number

open({mark!r}, "a").write("x")


@nsdrill.drive
def packaged(lag, drive_speed, set_speed, *, soft=number(900.0, "N m/rad"), brake=number(1500.0, "N m s/rad")):
    return -soft * lag - brake * (drive_speed - set_speed)


@nsdrill.model
def pendulum_of_package(angle=1.0, speed=0.0, *, damping=0.2):
    return speed, -damping * speed - angle
"""
STUDY = """\
simulation: {transient: 1 s, observe: 1 s}
sweep: {rotary_speed: [3 rad/s]}
modes: {axial: frozen, lateral: frozen}
"""


@pytest.fixture
def package(tmp_path):
    folder = tmp_path / "installed"
    (folder / "mine").mkdir(parents=True)
    (folder / "mine" / "__init__.py").write_text("")
    (folder / "mine" / "physics.py").write_text(MODULE.format(mark=str(tmp_path / "mark")))
    (folder / "mine" / "faulty.py").write_text("x = 1\n1 / 0\n")
    about = folder / "mine-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[nsdrill]\nmine = mine.physics\nother = mine.faulty\n")
    return tmp_path


def command(folder, *words, code=0):
    path = os.pathsep.join([str(folder / "installed"), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, "-m", "nsdrill", *words], cwd=folder, env={**os.environ, "PYTHONPATH": path},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout + done.stderr


def test_a_module_of_a_package_is_imported_where_a_name_is_not_known(package):
    (package / "plain.yaml").write_text(STUDY)
    command(package, "run", "plain.yaml", "-o", "plain.h5")
    assert not (package / "mark").exists()
    (package / "own.yaml").write_text(f"{STUDY}drive: {{kind: packaged, soft: 800 N*m/rad}}\n")
    said = command(package, "run", "own.yaml", "-o", "own.h5")
    assert (package / "mark").read_text() == "x"
    assert "the entry point other of the group nsdrill, mine.faulty: ZeroDivisionError: division by zero" in said
    assert "faulty.py, line 2" in said
    assert "packaged" in command(package, "show", "own.h5")
    (package / "model.yaml").write_text("model: pendulum_of_package\nsimulation: {transient: 1 s, observe: 1 s}\n")
    command(package, "run", "model.yaml", "-o", "model.h5")
    assert "angle_max" in command(package, "show", "model.h5")
    (package / "installed").rename(package / "removed")
    for file, part in {"own.h5": "drive packaged", "model.h5": "model pendulum_of_package"}.items():
        said = command(package, "show", file, code=2)
        assert f"made with the {part} of the package mine, which is not installed here" in said
        assert "--with" not in said
    (package / "removed").rename(package / "installed")
    (package / "none.yaml").write_text("drive: {kind: nowhere}\n")
    assert "found 'nowhere'" in command(package, "check", "none.yaml", code=2)
