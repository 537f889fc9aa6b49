"""The examples on the page for those who extend nsdrill run and give what the page
says."""

# as the modules have into which the blocks of the page are put, which compile() inherits
from __future__ import annotations

import ast
import csv
import os
import re
import subprocess
import sys
import textwrap
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nsdrill.equations import library


@pytest.fixture
def blocks(docs, tmp_path):
    """The Python blocks of the page, each in a file of its own, as the compiler reads the
    source of a function again."""
    found = re.findall(
        r"^```python\n(.*?)^```", (docs / "dev" / "extending.md").read_text(encoding="utf-8"), re.M | re.S
    )
    paths = []
    for number, text in enumerate(found):
        paths.append(tmp_path / f"block_{number}.py")
        paths[-1].write_text(text)
    return paths


def run(path: Path) -> dict[str, Any]:
    names: dict[str, Any] = {"__name__": path.stem, "__file__": str(path)}
    exec(compile(path.read_text(), str(path), "exec"), names)
    return names


def test_the_pairs_are_listed(blocks, capsys):
    run(blocks[8])
    listed = capsys.readouterr().out.splitlines()
    assert listed == [
        "tsitouras Tsitouras 5(4) 5",
        "dormand_prince Dormand-Prince 5(4) 5",
        "kennedy_carpenter ARK4(3)7L[2]SA 4",
    ]


def test_a_limit_cycle_returns_after_its_period(blocks):
    """Van der Pol's, mu = 1, with the published period; the multiplier of the cycle is
    8.6e-4, so that 100 periods have forgotten the start. Some thousand steps at rtol
    1e-10: 1e-7."""
    names = run(blocks[6])
    difference = names["second"].final[0, :2] - names["first"].final[names["first"].job == 0][0, :2]
    assert np.abs(difference).max() < 1e-7
    assert (names["first"].status == 1).all()


def test_every_function_that_is_offered_exists(docs):
    """In the library, and on the page with its name."""
    page = (docs / "dev" / "extending.md").read_text(encoding="utf-8")
    for name in library.FUNCTIONS:
        assert callable(getattr(library, name))
        assert re.search(rf"`{name}[`(]", page), name


def test_a_model_is_observed_as_declared(blocks, docs, capsys):
    """The page shows what the example prints. Its numbers make sense: the bit turns as
    fast as the drive in the mean, what it needs is the surface torque, and weak
    friction lets it turn steadily, at 3 rad/s."""
    names = run(blocks[7])
    page = (docs / "dev" / "extending.md").read_text(encoding="utf-8")
    shown = re.search(r"^```text\n(bit_speed_max.*?)^```", page, re.M | re.S)
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


def installed(folder: Path, model: str, named: str = "mypackage.spring") -> str:
    """A package with this model, installed in ``folder`` with an entry point that says how
    it is ``named``; the path on which Python finds it."""
    (folder / "mypackage").mkdir(parents=True)
    (folder / "mypackage" / "__init__.py").write_text("")
    (folder / "mypackage" / "spring.py").write_text(model)
    about = folder / "mypackage-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: mypackage\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[nsdrill]\nspring = {named}\n")
    return os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])


def command(folder: Path, path: str, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "nsdrill", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )


def test_a_model_of_another_package_runs_through_the_commands(blocks, tmp_path, run_commands):
    """Installed as the page says, with an entry point: another process finds it in what
    the first has written."""
    path = installed(tmp_path / "installed", blocks[4].read_text())
    (tmp_path / "study.yaml").write_text(STUDY)
    lines = """\
nsdrill new --model spring
nsdrill run study.yaml -o out.h5
nsdrill run study.yaml --set 'sweep.spring.stiffness=[150 N*m/rad, 197 N*m/rad]' --set sweep.along=rotary_speed -o m.h5
nsdrill run study.yaml --set record.exponent=true -o exponent.h5
nsdrill show out.h5
nsdrill replay out.h5 --rotary-speed 3rad/s --procedure down -o r.h5
nsdrill plot out.h5 -o out.png
nsdrill plot r.h5 -o r.png
nsdrill window out.h5
nsdrill export out.h5 -o out.csv
nsdrill diff out.h5 m.h5""".splitlines()
    new, *_ = run_commands(lines[:4], tmp_path, PYTHONPATH=path)
    shown, replayed, *_, differs = run_commands(lines[4:], tmp_path, PYTHONPATH=path)
    assert "stiffness: " in new
    assert "stick-slip" in shown
    assert "whirl" not in shown
    assert "bit for bit" in replayed
    assert "spring.stiffness" in differs


@pytest.mark.parametrize(
    ("named", "says"),
    [
        ("mypackage.spring [extra]", None),
        ("mypackage.spring:SpringModel", "No module named 'mypackage.spring:SpringModel'"),
        ("my package", "No module named"),
        ("", "the model spring"),
    ],
)
def test_an_entry_point_names_the_module(blocks, tmp_path, named, says):
    path = installed(tmp_path / "installed", blocks[4].read_text(), named)
    done = command(tmp_path, path, "simulate", "--set", "model=spring", "--duration", "1 s", "-o", "t.h5", "-")
    if says is None:
        assert done.returncode == 0, done.stderr
    else:
        assert done.returncode == 2
        assert says in done.stderr
        assert "a module with a DESCRIPTION and a MODEL (spring = package.module)" in " ".join(done.stderr.split())


def test_other_slopes_of_a_model_are_another_version(blocks, tmp_path):
    """The points of one file come from one model: what another package's file says is
    part of what made them."""
    path = installed(tmp_path / "installed", blocks[4].read_text())
    (tmp_path / "study.yaml").write_text(STUDY.replace("points: 5", "points: 2"))
    limits = ("--set", "simulation.max_steps=1000", "--set", "simulation.rtol=1e-12")
    words = ("run", "study.yaml", *limits, "-o", "out.h5")
    made = command(tmp_path, path, *words)
    assert made.returncode == 3, made.stderr
    model = tmp_path / "installed" / "mypackage" / "spring.py"
    model.write_text(model.read_text().replace("0.4 + 0.6 /", "0.5 + 0.5 /"))
    again = command(tmp_path, path, *words, "--retry-failed")
    assert again.returncode == 2, again.stderr
    assert "CHANGED SINCE THE RUNS" in again.stderr
    assert "allowed: what they were made with, as it was, or the study run again" in " ".join(again.stderr.split())


def test_what_is_wrong_with_a_model_of_another_package_is_said(blocks, tmp_path):
    text = blocks[4].read_text()
    (tmp_path / "study.yaml").write_text(STUDY)

    def said(name, model, *more):
        made = command(tmp_path, installed(tmp_path / name, model), *more)
        assert made.returncode == 2, made.stderr
        assert "bug of nsdrill" not in made.stderr
        return made.stderr

    other = 'features=(*known(*FEATURES), feature("radius_max", "m", "how far it went")),'
    clash = text.replace("features=known(*FEATURES),", other)
    clash = "from nsdrill.variables import feature\n" + clash.replace("from dataclasses", "from dataclasses", 1)
    assert clash.count("radius_max") == 1
    found = said("clash", clash, "check", "study.yaml")
    assert "radius_max, how far it went [m]" in found
    assert "allowed: another name" in found

    found = said("empty", "DESCRIPTOR = None\n", "check", "study.yaml")
    assert "the model spring, in mypackage.spring: AttributeError" in found
    assert "a DESCRIPTION and a MODEL" in found
    found = said("faulty", text.replace("NAMES = Names(", "NAMES = Namen("), "check", "study.yaml")
    assert re.search(r"name 'Namen' is not defined.*spring\.py, line \d+", found, re.S)

    found = said("section", text, "check", "study.yaml", "--set", "record.poincare=8")
    assert "record.poincare: found the number 8, with the model spring, which has no Poincare section" in found
    starts = ("--set", "initial.ensemble=4", "--set", "sweep.procedure=same", "-o", "out.h5")
    assert "initial.ensemble: found with the model spring" in said("starts", text, "run", "study.yaml", *starts)


# A model of another package that is at fault, and what is said where it is asked for.
FAULTY = {
    "parts": (  # first: its message names all that were imported
        "from dataclasses import replace\nfrom nsdrill.models.torsion import DESCRIPTION\n"
        "DESCRIPTION = replace(DESCRIPTION, name='parts', parameters=None)\n",
        "The models parts, number come from other packages",
    ),
    "lacks": ("import nothing_of_this_name\n", "ModuleNotFoundError: .*lacks.py, line 1"),
    "syntax": ("def (\n", r"SyntaxError: invalid syntax \(spoiled_syntax.py, line 1\)"),
    "leaves": ("import sys\nsys.exit(7)\n", "SystemExit: 7 .*leaves.py, line 2"),
    "number": ("DESCRIPTION = 3\n", "DESCRIPTION is 3, not the description of a model"),
    "torsion": ("raise ValueError\n", None),  # the name of a model of nsdrill, which remains
}


def test_a_faulty_model_of_another_package_touches_no_other(tmp_path, shared, run_commands):
    about = tmp_path / "spoiled-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: spoiled\nVersion: 1.0\n")
    entries = "".join(f"{name} = spoiled_{name}\n" for name in FAULTY)
    (about / "entry_points.txt").write_text(f"[nsdrill]\n{entries}")
    for name, (text, _) in FAULTY.items():
        (tmp_path / f"spoiled_{name}.py").write_text(text)
    path = os.pathsep.join([str(tmp_path), *filter(None, [os.environ.get("PYTHONPATH")])])
    results = str(shared / "small.h5")
    lines = (
        f"nsdrill run {shared / 'small.yaml'} -o out.h5",
        f"nsdrill show {results}",
        f"nsdrill plot {results} -o out.png",
        f"nsdrill report {results} -o out.html --motions 0",
        f"nsdrill export {results} -o out.csv",
        f"nsdrill check {shared / 'small.yaml'} --set model=torsion",
    )
    said = run_commands(lines, tmp_path, PYTHONPATH=path)
    assert "valid. Small" in said[-1]
    # a picture may be of a package, and so what fails to be read is told there, and nowhere else
    drawn = [line.split()[1] for line, text in zip(lines, said, strict=True) if "spoiled" in text]
    assert set(drawn) <= {"plot", "report"}
    wrong = {name: words for name, (_, words) in FAULTY.items() if words is not None}
    lines = [f"nsdrill check {shared / 'small.yaml'} --set model={name}" for name in wrong]
    told = run_commands(lines, tmp_path, codes="12", PYTHONPATH=path)
    for (name, words), said in zip(wrong.items(), told, strict=True):
        assert re.search(rf"he models? (\w+, )*{name}\b", said.partition("\n")[2])
        assert re.search(words, said), said


def extended(blocks: list[Path]) -> str:
    """The model of the page with what the page adds to it."""
    text, added = blocks[4].read_text(), blocks[5].read_text()

    def after(found: str, more: str) -> None:
        nonlocal text
        assert text.count(found) == 1, found
        text = text.replace(found, found + more)

    after('rate_of="twist"', ", level=6.0")
    lines = re.findall(r"^((?:TimeAbove|Extremes)\(.*\))$", added, re.M)
    assert len(lines) == 2
    after('        Mean("bit speed", "bit_speed_mean"),\n', "".join(f"        {line},\n" for line in lines))
    after("Mean, Names", ", TimeAbove")
    after("from nsdrill.ranges import Checked, parameter\n", added.splitlines()[0] + "\n")
    method = re.search(r"^def classify.*?\n\n", added, re.M | re.S)
    after('    name = "spring"\n', textwrap.indent(method.group(), "    ") + "\n")
    ends = {
        "labels": 'responses=("stick_slip",), labels=(',
        "peaks": 'peaks=(*known("bit_speed_peaks")',
        "features": "features=(*known(*FEATURES)",
        "summary": 'summary=("stick_slip_index"',
        "panels": '"bit_speed_peaks", "bit_speed_max")',
    }
    text = text.replace('responses=("stick_slip",)', f"{ends['labels']})")
    for name in ("peaks", "features"):  # a tuple, which may have more
        text = text.replace(ends[name].replace("(*", "", 1), f"{ends[name]},)")
    more = {one.target.id: one.value for one in ast.parse(added).body if isinstance(one, ast.AugAssign)}
    assert more.keys() == ends.keys()
    for name, end in ends.items():
        items = [ast.unparse(item) for item in more[name].elts]
        after(end, "".join(f"{item}, " if name == "labels" else f", {item}" for item in items))
    return text


def test_a_feature_a_label_and_a_panel_of_ones_own(blocks, tmp_path, run_commands):
    (tmp_path / "study.yaml").write_text(STUDY)
    model = extended(blocks)
    path = installed(tmp_path / "installed", model)
    lines = ("run study.yaml -o out.h5", "plot out.h5 -o out.svg", "export out.h5 -o out.csv")
    run_commands([f"nsdrill {line}" for line in lines], tmp_path, PYTHONPATH=path)
    assert "Last local maxima of the twist [rad]" in (tmp_path / "out.svg").read_text()
    with open(tmp_path / "out.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        assert row["fast_words"] == ("fast" if float(row["fast_fraction [1]"]) > 0.1 else "slow")
    assert {row["fast_words"] for row in rows} == {"fast", "slow"}

    for out, words in (
        ('TimeAbove("bit speed", "fast_fraction"),', "found fast_fraction among the features of its description"),
        (", feature('twist_max', 'rad', 'greatest twist')", "found drawn.panels: twist_max in its description"),
    ):
        assert model.count(out) == 1
        path = installed(tmp_path / words.split()[1].strip(":"), model.replace(out, ""))
        made = command(tmp_path, path, "run", "study.yaml", "-o", "other.h5", "--overwrite")
        assert made.returncode == 2
        assert f"the model spring: {words}" in made.stderr


def test_a_command_of_ones_own(blocks, shared, tmp_path, capsys, monkeypatch):
    """The blocks of the section, put in their places: the command is listed, does
    what it says, as Python does, and refuses a trace in words."""
    import json

    import nsdrill
    from nsdrill.cli import look_group
    from nsdrill.cli.main import group
    from nsdrill.cli.overview import COMMANDS, GROUPS
    from nsdrill.errors import FileError
    from nsdrill.operations import questions
    from nsdrill.store import read_results

    efforts = types.ModuleType("nsdrill.app.effort")
    vars(efforts).update(run(blocks[1]))
    monkeypatch.setitem(sys.modules, efforts.__name__, efforts)
    names = vars(questions) | {"efforts": efforts}
    in_its_file = f"from __future__ import annotations\n{blocks[2].read_text()}"  # as questions.py begins
    exec(compile(in_its_file, str(blocks[2]), "exec"), names)
    monkeypatch.setattr(questions, "effort", names["effort"], raising=False)
    monkeypatch.setattr(look_group, "effort", run(blocks[3])["effort"], raising=False)
    line = "Say how many steps the points of a results file took."
    for listed in (GROUPS["Look"], COMMANDS):
        monkeypatch.setitem(listed, "effort", line)
    results, trace = shared / "small.h5", tmp_path / "trace.h5"
    group.main(["effort", str(results)], standalone_mode=False)
    found = read_results(results)
    steps = found["steps"]
    assert nsdrill.open_results(str(results)).pipe(questions.effort) == questions.effort(results)
    speed = found.coords["rotary_speed"][steps.max(axis=0).argmax()]
    said = capsys.readouterr().out.splitlines()
    assert said[0] == f"{int(steps.sum())} steps at {steps.size} points"
    assert said[1].startswith("most of them at 2000 m, 22.24 kN")
    assert f"{speed:.4g} rad/s" in said[1]
    group.main(["effort", str(results), "--json", "--units", "field"], standalone_mode=False)
    told = json.loads(capsys.readouterr().out)
    assert told["most"]["rotary_speed"] == pytest.approx(speed * 30 / np.pi)
    assert told["units"]["rotary_speed"] == "rpm"
    group.main(["--help"], standalone_mode=False)
    assert "how many steps the points" in capsys.readouterr().out
    nsdrill.save(nsdrill.simulate(shared / "small.yaml", duration=1.0), trace)
    with pytest.raises(FileError, match="a trace"):
        group.main(["effort", str(trace)], standalone_mode=False)
