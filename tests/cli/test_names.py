"""Files with names that are not UTF-8, or not on one line, work like any other, and are
told in what can be printed."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import h5py
import pytest

from .helpers import Call, finish, start

NAMES = [b"\xff\xfe", b"two\nlines", "日本".encode()]


@pytest.mark.parametrize("name", NAMES)
def test_odd_names(call: Call, small: Path, shared: Path, tmp_path: Path, name: bytes) -> None:
    odd = tmp_path / os.fsdecode(name)
    study, results = f"{odd}.yaml", f"{odd}.h5"
    shutil.copyfile(small, study)
    shutil.copyfile(shared / "small.h5", results)
    told = call("check", study).out + call("show", results).out + call("window", results).out
    assert told.count(".h5: ") == 2
    assert json.loads(call("check", study, "--json").out)["points"] == 16
    call("simulate", study, "-o", f"{odd}.trace.h5", "--duration", "1 s")
    call("plot", results, "-o", f"{odd}.png")
    call("export", results, "-o", f"{odd}.csv")
    call("show", f"{odd}.nothing", code=2)
    again = call("replay", results, "-o", f"{odd}.again.h5", "--rotary-speed", "3 rad/s", "--procedure", "up")
    assert "bit for bit" in again.err
    for made, attribute in ((f"{odd}.trace.h5", "study_source"), (f"{odd}.again.h5", "replay_of")):
        with h5py.File(made) as file:
            assert file.attrs[attribute].isprintable()
    told += again.err
    assert told.isascii() or name == NAMES[2]


def test_a_run_under_an_odd_name(small: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a process of its own, whose output knows Latin letters only."""
    monkeypatch.setenv("PYTHONIOENCODING", "latin-1")
    odd = os.fsdecode(bytes(tmp_path) + b"/\xff\n")
    shutil.copyfile(small, f"{odd}.yaml")
    assert finish(start("run", f"{odd}.yaml", "-o", f"{odd}.h5", "--workers", "1", "--set", "title=\u65e5")).code == 0
    shown = finish(start("show", f"{odd}.h5"))
    assert shown.err == ""
    assert shown.out.splitlines()[0].endswith("\\xff\\n.h5: results of a sweep. \\u65e5")


def test_an_example_is_written_as_it_is(call: Call) -> None:
    """Every study that comes with the package loads; a wrong name lists all with their
    titles."""
    from nsdrill.study import load_study
    from nsdrill.study.write import examples

    assert len(examples()) > 10
    for name, path in examples().items():
        call("new", "--example", name, "-o", f"{name}.yaml")
        assert Path(f"{name}.yaml").read_text() == path.read_text()
        load_study(f"{name}.yaml")
    wrong = call("new", "--example", "torsional", code=2)
    assert "Did you mean torsional_speed?" in wrong.err
    assert "Stick-slip of the torsional model" in wrong.err
    assert "one of the two" in call("new", "--example", "torsional_speed", "--model", "torsion", code=2).err
