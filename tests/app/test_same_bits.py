"""The same bits, or a sentence that says what differs: across Pythons, processors,
versions and workers."""

import hashlib
import json
import os
import platform
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from pythons import SRC, pythons, run

import nsdrill
from nsdrill.abi import COMPILED
from nsdrill.app.experiment import model_digest, unlike, versions
from nsdrill.app.running.cluster import _call_on_same_versions, dask_executor
from nsdrill.app.running.run import Interrupted, run_study
from nsdrill.app.simulating.trajectory import replay
from nsdrill.errors import FileError, NsdrillError
from nsdrill.kernel import steppers
from nsdrill.kernel.pairs import TSITOURAS
from nsdrill.kernel.steppers import STEPPERS
from nsdrill.store import RunLog, part_path, read_attributes, read_results

HERE = ".".join(platform.python_version_tuple()[:2])

# For any Python, without a package: the weights of the tableau, and every expression of
# numbers in the sources that are compiled, as the interpreter computes it. Prints all
# of them as hexadecimal floats.
CONSTANTS = """
import ast, importlib.util, math, sys
src, *paths = sys.argv[1:]
spec = importlib.util.spec_from_file_location("pairs", src + "/nsdrill/kernel/pairs.py")
pairs = sys.modules["pairs"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(pairs)
pair = pairs.TSITOURAS
for row in (pair.nodes, *pair.matrix, pair.error, *pair.positions, pair.position_error[0]):
    print("tableau", *map(float.hex, row))

class Numbers(ast.NodeVisitor):
    def __init__(self, path):
        self.path, self.names = path, {"math": math, "sum": sum}

    def value(self, node):
        try:
            return eval(compile(ast.Expression(node), self.path, "eval"), {"__builtins__": {}}, self.names)
        except Exception:  # not of numbers alone
            return None

    def visit(self, node):
        if isinstance(node, ast.expr) and isinstance(value := self.value(node), float):
            return print(self.path, node.lineno, value.hex())
        self.generic_visit(node)

    def visit_Module(self, node):
        for line in node.body:
            self.visit(line)
            if isinstance(line, ast.Assign) and isinstance(line.targets[0], ast.Name):
                self.names[line.targets[0].id] = self.value(line.value)

for path in paths:
    with open(src + "/nsdrill/" + path, encoding="utf-8") as file:
        Numbers(path).visit(ast.parse(file.read()))
"""
# The study whose results the fixture `shared` holds.
BITS = """
import hashlib, json, sys
import nsdrill
from nsdrill.app.experiment import versions
from nsdrill.app.running.run import run_in_memory
made = run_in_memory(nsdrill.load_study(sys.argv[1]), workers=1)
print(json.dumps([versions(), {name: hashlib.sha256(made[name].tobytes()).hexdigest() for name in made.variables}]))
"""


def test_the_weights_are_exact_products_rounded_once():
    with mpmath.workprec(400):
        a = mpmath.zeros(7)
        for i, row in enumerate(TSITOURAS.matrix, start=1):
            for j, weight in enumerate(row):
                a[i, j] = weight
        square, error = a * a, mpmath.matrix([TSITOURAS.error]) * a
        positions = [[float(square[i, j]) for j in range(i - 1)] for i in range(2, 7)]
        assert [list(row) for row in TSITOURAS.positions] == [[], *positions]
        assert list(TSITOURAS.position_error[0]) == [float(error[0, j]) for j in range(6)]
        assert float(mpmath.log(0.9, 2)) == steppers.SAFETY


def test_every_python_computes_the_same_constants():
    found = pythons()
    if len(found) < 2:
        pytest.skip(f"found no other Python than {', '.join(found)}")
    paths = [
        str(path.relative_to(SRC / "nsdrill"))
        for name in COMPILED
        for path in sorted((SRC / "nsdrill").glob(name if name.endswith(".py") else f"{name}/*.py"))
    ]
    told = {}
    for version, (python, *_) in found.items():
        done = run(python, "-c", CONSTANTS, str(SRC), *paths)
        assert done.returncode == 0, (version, done.stderr)
        told[version] = done.stdout.splitlines()
    mine = told.pop(HERE)
    assert sum(line.startswith("tableau") for line in mine) == 1 + 6 + 1 + 6 + 1
    assert sum("elementary.py" in line for line in mine) > 40
    for version, lines in told.items():
        assert [pair for pair in zip(mine, lines, strict=True) if pair[0] != pair[1]] == [], version


def test_every_python_computes_the_same_bits(shared):
    """All with the packages of nsdrill, where they are of the versions here."""
    kept = read_results(shared / "small.h5")
    mine = {name: hashlib.sha256(kept[name].tobytes()).hexdigest() for name in kept.variables}
    compared, passed_over = [], []
    for version, interpreters in pythons().items():
        if version == HERE:
            continue
        for python in interpreters:
            done = run(python, "-c", BITS, str(shared / "small.yaml"))
            if done.returncode == 0 or "ModuleNotFoundError" not in done.stderr:
                break
        if "ModuleNotFoundError" in done.stderr:
            passed_over.append(f"{version} lacks {done.stderr.split()[-1]}")
            continue
        assert done.returncode == 0, (version, done.stderr)
        there, bits = json.loads(done.stdout)
        if differing := [text for text in unlike(there) if not text.startswith(("Python", "model digest"))]:
            passed_over.append(f"{version} has {'; '.join(differing)}")
            continue
        assert [name for name in mine if bits[name] != mine[name]] == [], version
        compared.append(version)
    if not compared:
        pytest.skip(f"found no Python to compare {HERE} with: {', '.join(passed_over) or 'there is no other one'}")


# Numbers made by numpy after a run, of a Hertz wall and of returns to the section.
AFTERWARDS = """
import hashlib
import numpy as np
from nsdrill.models.christoforou_yigit.columns import PARAMETERS
from nsdrill.models.registry import model_named
from nsdrill.observe.motion_kinds import zero_one
from nsdrill.observe.thresholds import Record
from nsdrill.models.christoforou_yigit.columns import Options
from nsdrill.models.christoforou_yigit.observed import coordinates
from nsdrill.models.variant import variant_of
draw = np.random.Generator(np.random.PCG64(1))
model, options = model_named("christoforou_yigit"), Options(hertz=1)
report = draw.uniform(0.5, 2, (200, variant_of(model, options).outcome_width(Record())))
table = draw.uniform(0.01, 0.5, (200, len(PARAMETERS)))
made = variant_of(model, options).features(report, table, 9.0)
made |= coordinates(draw.uniform(-2, 2, (40, 150, 9)))
made["zero_one"] = zero_one(draw.uniform(-1, 1, (5, 150, 8)), np.ones((5, 8)))
print({name: hashlib.sha256(value.tobytes()).hexdigest() for name, value in made.items()})
"""


def test_numbers_made_afterwards_do_not_depend_on_the_processor():
    """numpy has code of its own for newer processors, and its BLAS for every kind of
    them."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    newer = [name for name in __cpu_dispatch__ if __cpu_features__[name]]
    if not newer:
        pytest.skip("numpy has no code for newer processors here")
    told = set()
    for more in ({}, {"NPY_DISABLE_CPU_FEATURES": " ".join(newer), "OPENBLAS_CORETYPE": "Prescott"}):
        env = {**os.environ, **more, "PYTHONPATH": str(SRC)}
        done = subprocess.run([sys.executable, "-c", AFTERWARDS], capture_output=True, text=True, env=env, timeout=300)
        assert done.returncode == 0, done.stderr
        told.add(done.stdout)
    assert len(told) == 1, told


def begin(study: Any, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run interrupted before its results file was made."""
    with monkeypatch.context() as patch:
        patch.setattr(
            "nsdrill.app.running.run.write_results", lambda path, log: (_ for _ in ()).throw(KeyboardInterrupt)
        )
        with pytest.raises(Interrupted):
            run_study(study, path)


def other(monkeypatch: pytest.MonkeyPatch, **found: str) -> None:
    """Let this process find other versions: ``python`` or the name of a package."""
    from importlib.metadata import version

    monkeypatch.setattr("importlib.metadata.version", lambda name: found.get(name) or version(name))
    if "python" in found:
        monkeypatch.setattr("platform.python_version", lambda: found["python"])


@pytest.mark.parametrize(
    ("found", "said"),
    [
        ({"python": "3.99.1"}, rf"Python {HERE} there, 3\.99 here"),
        ({"llvmlite": "99.2"}, r"llvmlite \S+ there, 99\.2 here"),
    ],
)
def test_resume_names_what_differs(small, tmp_path, monkeypatch, found, said):
    study, out = nsdrill.load_study(small), tmp_path / "out.h5"
    begin(study, out, monkeypatch)
    before = part_path(out).read_bytes()
    with monkeypatch.context() as patch:
        other(patch, **found)
        with pytest.raises(FileError, match=f"made with other versions.*{said}.*Finish it with those.*overwrite=True"):
            run_study(study, out, resume=True)
    assert part_path(out).read_bytes() == before
    assert run_study(study, out, resume=True).already == 16


def test_resume_takes_a_later_release_of_the_same_python(small, tmp_path, monkeypatch):
    study, out = nsdrill.load_study(small), tmp_path / "out.h5"
    begin(study, out, monkeypatch)
    other(monkeypatch, python=f"{HERE}.99", numpy="99.9")
    assert run_study(study, out, resume=True).already == 16


def test_a_log_of_an_older_nsdrill_is_refused(small, tmp_path, monkeypatch):
    """It holds fewer attributes; what it does hold is compared."""
    study, out = nsdrill.load_study(small), tmp_path / "out.h5"
    begin(study, out, monkeypatch)
    with RunLog.open(part_path(out)) as log:
        header, kept = log.header, log.contents
    new = ("python", "llvmlite", "libm_digest")
    attrs = {name: value for name, value in header["attrs"].items() if name not in new}
    for change, said in (
        ({"model_digest": "0123456789abcdef"}, "model digest 0123456789abcdef there, "),
        ({"model_digest": "0123456789abcdef", "python_version": "3.10.2"}, f"Python 3.10 there, {HERE} here; model"),
    ):
        part_path(out).unlink()
        RunLog.create(part_path(out), {**header, "attrs": {**attrs, **change}}, 16, kept).close()
        with pytest.raises(FileError, match=said):
            run_study(study, out, resume=True)


def test_the_digest_holds_the_constants(monkeypatch):
    before = model_digest()
    last_bit = np.nextafter(TSITOURAS.matrix[4][0], 9.0)
    row = (float(last_bit), *TSITOURAS.matrix[4][1:])
    changed = replace(TSITOURAS, matrix=(*TSITOURAS.matrix[:4], row, TSITOURAS.matrix[5]))
    monkeypatch.setitem(STEPPERS, "tsitouras", changed)
    assert model_digest() != before


@pytest.mark.parametrize("what", ["abi.source_digest", "app.experiment._libm_digest"])
def test_the_digest_holds_sources_and_mathematics(monkeypatch, what):
    before = versions()
    monkeypatch.setattr(f"nsdrill.{what}", lambda: "another")
    assert any(text.startswith("model digest") for text in unlike(before))
    assert any("mathematics" in text for text in unlike(before)) == what.endswith("_libm_digest")


def test_files_say_what_computed_them(shared):
    import llvmlite

    attrs = read_attributes(shared / "small.h5")
    assert attrs["python"] == platform.python_version()
    assert attrs["llvmlite"] == llvmlite.__version__
    assert unlike(attrs, "numpy_version", "processor") == []


def test_replay_says_what_differs(shared, monkeypatch):
    other(monkeypatch, python="3.99.1", numpy="99.9")
    result = replay(shared / "map.h5", wob=40e3, rotary_speed=6.3)
    assert result.same_bits
    assert result.differing[0].endswith("there, 99.9 here")
    assert result.differing[1] == f"Python {HERE} there, 3.99 here"


@pytest.mark.parametrize("name", ["python", "numpy_version", "llvmlite", "model_digest"])
def test_a_worker_with_other_versions_is_refused(monkeypatch, name):
    distributed = pytest.importorskip("distributed")
    worker = {**versions(), name: "9.9"}
    monkeypatch.setattr(distributed.Client, "run", lambda self, function, **more: {"tcp://far:1": worker})
    with (
        distributed.LocalCluster(n_workers=1, processes=False, dashboard_address=None, protocol="tcp") as cluster,
        pytest.raises(NsdrillError, match=r"worker tcp://far:1 has other versions.* 9\.9 there.*Nothing has run"),
        dask_executor(cluster.scheduler_address),
    ):
        pass


def test_a_worker_that_joined_later_is_refused():
    assert _call_on_same_versions(versions(), {}, divmod, 7, 2) == (3, 1)
    with pytest.raises(NsdrillError, match=r"other versions \(Python 3\.1 there"):
        _call_on_same_versions({**versions(), "python": "3.1.2"}, {}, divmod, 7, 2)
    with pytest.raises(NsdrillError, match="another version of the model spring, or none"):
        _call_on_same_versions(versions(), {"spring": "0123456789abcdef"}, divmod, 7, 2)
