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


FEATURES = """
import nsdrill


@nsdrill.feature("torsion", "bit_power", "W", "power of the bit", mean=True)
def bit_power(bit_speed, bit_torque):
    return bit_speed * bit_torque


@nsdrill.feature("segments", "closed", "m s-1", "rate of the interference", least=True)
def closed(closing):
    return closing
"""
TORSION = """\
model: torsion
simulation: {transient: 1 s, observe: 5 s}
sweep: {rotary_speed: [3 rad/s, 4 rad/s]}
"""
ROCKS = """\
model: segments
segments: {pipe: 2, collar: 2}
simulation: {transient: 1 s, observe: 2 s}
sweep: {bit.rock.law: [lobed, regenerative]}
"""


@pytest.fixture
def measuring(package):
    """The package with a module of features; a function that names its entry points."""
    (package / "installed" / "mine" / "features.py").write_text(FEATURES)
    (package / "torsion.yaml").write_text(TORSION)

    def named(**groups):
        text = "".join(f"[{group.replace('_', '.', 1)}]\nmine = {module}\n" for group, module in groups.items())
        (package / "installed" / "mine-1.0.dist-info" / "entry_points.txt").write_text(text)
        return package

    return named


BOTH = {"nsdrill_torsion": "mine.features", "nsdrill_segments": "mine.features"}


def test_what_a_package_measures_of_a_model_is_in_every_run_of_it(measuring):
    folder = measuring(**BOTH, nsdrill="mine.physics")
    command(folder, "run", "torsion.yaml", "-o", "out.h5")
    assert "mean power of the bit" in command(folder, "show", "out.h5")
    assert "Measured besides: bit_power (the package mine)." in command(folder, "check", "torsion.yaml")
    # that module alone is imported: nothing names the drive of the other one
    command(folder, "run", "torsion.yaml", "-o", "again.h5", "--set", "operation.wob=30 kN")
    assert (folder / "mark").read_text() == "x"  # of check, which tells what is wrong with packages
    (folder / "plain.yaml").write_text(STUDY)
    assert "bit_power" not in command(folder, "check", "plain.yaml")  # of another model
    (folder / "installed").rename(folder / "removed")
    said = command(folder, "show", "out.h5")
    assert "left out: bit_power_mean" in said
    assert "what a package measures where that is installed" in " ".join(said.split())


def test_a_string_without_what_a_package_reads_is_run_without_that_feature(measuring):
    folder = measuring(**BOTH)
    (folder / "rocks.yaml").write_text(ROCKS)
    said = command(folder, "run", "rocks.yaml", "-o", "rocks.h5")
    assert "feature closed: not measured of this string, which has no closing" in said
    table = command(folder, "export", "rocks.h5", "-o", "rocks.csv") and (folder / "rocks.csv").read_text()
    heading, *rows = [line.split(",") for line in table.splitlines() if not line.startswith("#")]
    at = next(k for k, name in enumerate(heading) if name.startswith("closed_min"))
    assert [row[at] not in ("", "nan") for row in rows] == [True, False]


@pytest.mark.parametrize(
    ("groups", "found"),
    [
        ({"nsdrill": "mine.features"}, "the model torsion in a module that only some studies of it import"),
        ({"nsdrill_torsion": "mine.features"}, "the model segments in a module that only some studies of it import"),
        ({"nsdrill_torsoin": "mine.features"}, "found no model torsoin"),
    ],
)
def test_a_feature_that_would_be_there_by_chance_is_told_of(measuring, groups, found):
    folder = measuring(**groups)
    said = command(folder, "check", "torsion.yaml")
    assert found in said
    assert "mine.features" in said


def test_without_packages_the_metadata_of_python_are_not_imported(tmp_path):
    """Importing importlib.metadata takes 70 ms."""
    (tmp_path / "torsion.yaml").write_text(TORSION)
    text = "import sys, nsdrill\nnsdrill.load_study('torsion.yaml')\nprint('importlib.metadata' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", text], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout.split()[-1] == "False", done.stderr


def test_other_processes_measure_what_a_package_and_a_script_do(measuring):
    folder = measuring(**BOTH)
    (folder / "twice.py").write_text(
        "import nsdrill\n\n\n@nsdrill.feature('torsion', 'twice', mean=True)\ndef twice(twist):\n    return 2 * twist\n"
    )
    (folder / "pool.py").write_text(
        "import nsdrill, twice\nfrom concurrent.futures import ProcessPoolExecutor\n"
        "from multiprocessing import get_context\nfrom nsdrill.app.running.run import run_in_memory\n\n"
        "if __name__ == '__main__':\n"
        "    study = nsdrill.load_study('torsion.yaml')\n"
        "    here = run_in_memory(study, workers=1)\n"
        "    with ProcessPoolExecutor(1, mp_context=get_context('spawn')) as pool:\n"
        "        there = run_in_memory(study, executor=pool, workers=1)\n"
        "    print(*((here[name] == there[name]).all() for name in ('bit_power_mean', 'twice_mean')))\n"
    )
    path = os.pathsep.join([str(folder / "installed"), str(folder)])
    done = subprocess.run(
        [sys.executable, "pool.py"], cwd=folder, env={**os.environ, "PYTHONPATH": path},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.stdout.split() == ["True", "True"], done.stderr[-2000:]


MODEL_OF_MODULE = """
MODEL = DESCRIPTION = None
"""


def add_package(folder, name, entries, **modules):
    """A further package, installed beside."""
    about = folder / "installed" / f"{name}-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (about / "entry_points.txt").write_bytes(entries)
    for module, text in modules.items():
        (folder / "installed" / f"{module}.py").write_text(text)


@pytest.mark.parametrize("entries", [b"[nsdrill]\nlonely\n", b"[nsdrill]\n# \xff\xfe\n"], ids=["no value", "no text"])
def test_entry_points_that_cannot_be_read_are_told_of_and_those_of_others_are_known(package, entries):
    add_package(package, "broken", entries)
    (package / "model.yaml").write_text("model: pendulum_of_package\nsimulation: {transient: 1 s, observe: 1 s}\n")
    said = " ".join(command(package, "check", "model.yaml").split())
    assert f"the package broken in {package / 'installed'}: its entry points cannot be read" in said
    assert "below [nsdrill]" in said


def test_of_two_packages_with_a_model_of_one_name_neither_is_run(package):
    """Which of them were first on the path would decide whose numbers these are."""
    add_package(package, "one", b"[nsdrill]\ntwin = one\n", one=MODEL_OF_MODULE)
    add_package(package, "two", b"[nsdrill]\ntwin = two\n", two=MODEL_OF_MODULE)
    (package / "twin.yaml").write_text("model: twin\n")
    said = command(package, "check", "twin.yaml", code=2)
    assert "the model twin: found two of this name, in " in said
    assert {"one", "two"} <= set(said.partition("of this name")[2].replace(";", "").split())


def test_two_packages_may_give_their_modules_one_name(package):
    brake = "import nsdrill\n\n\n@nsdrill.drive\ndef brake_of_{0}(drive_speed, set_speed, *, gain=900.0):\n"
    brake += "    return -gain * (drive_speed - set_speed)\n"
    for name in ("one", "two"):
        add_package(package, name, f"[nsdrill]\nbrakes = {name}\n".encode(), **{name: brake.format(name)})
    for name in ("one", "two"):
        (package / "brake.yaml").write_text(f"{STUDY}drive: {{kind: brake_of_{name}}}\n")
        command(package, "check", "brake.yaml")


def test_a_package_with_the_name_of_a_model_of_nsdrill_is_told_of(package):
    add_package(package, "one", b"[nsdrill]\ntorsion = one\n", one=MODEL_OF_MODULE)
    (package / "torsion.yaml").write_text(TORSION)
    said = command(package, "check", "torsion.yaml")
    assert "the entry point torsion of the group nsdrill, one: found the name torsion, which a model of nsdrill" in said


def test_a_module_that_changes_the_folder_leaves_files_where_they_belong(package):
    physics = package / "installed" / "mine" / "physics.py"
    physics.write_text(f"import os\nos.chdir('/')\n{physics.read_text()}")
    (package / "model.yaml").write_text("model: pendulum_of_package\nsimulation: {transient: 1 s, observe: 1 s}\n")
    command(package, "check", "model.yaml")
    command(package, "run", "model.yaml", "-o", "model_of_package.h5")
    assert (package / "model_of_package.h5").exists()


def test_an_error_that_fails_to_give_its_text_is_told_of(package):
    text = "class Odd(Exception):\n    def __str__(self):\n        raise ValueError\n\n\nraise Odd\n"
    add_package(package, "one", b"[nsdrill]\nodd = one\n", one=text)
    (package / "odd.yaml").write_text("model: odd\n")
    said = command(package, "check", "odd.yaml", code=2)
    assert "the model odd, in one: Odd, without a text (" in said
    assert "one.py, line 6)" in said
