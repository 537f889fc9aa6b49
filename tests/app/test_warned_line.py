"""Warnings stand at the line of the user: of a script or a test, not at one of nsdrill."""

import ast
import contextlib
import shutil
import warnings
from pathlib import Path

import h5py
import pytest

import nsdrill
from nsdrill import api
from nsdrill.errors import warn

PACKAGE = Path(nsdrill.__file__).parent
READS = {  # of a file that another program has changed, which each tells of
    "attractors": nsdrill.attractors,
    "cite": nsdrill.cite,
    "classify": lambda name: nsdrill.classify(name, {"classify.stuck_below": "6 rpm"}, f"{name}.new.h5"),
    "combine": lambda name: nsdrill.combine([name, name]),
    "continue_branches": lambda name: nsdrill.continue_branches(
        {"continue": {"along": "rotary_speed", "from": "1 rad/s", "to": "8 rad/s"}}, seeds=name, progress=False
    ),
    "diff": lambda name: nsdrill.diff(name, name),
    "hysteresis": nsdrill.hysteresis,
    "lyapunov_spectrum": lambda name: nsdrill.lyapunov_spectrum(name, rotary_speed=3.0, procedure="up"),
    "open_results": lambda name: nsdrill.open_results(name).close(),
    "plot": nsdrill.plot,
    "probability": nsdrill.probability,
    "replay": lambda name: nsdrill.replay(name, rotary_speed=3.0, procedure="up"),
    "report": lambda name: nsdrill.report(name, f"{name}.html"),
    "sensitivity": nsdrill.sensitivity,
    "show": nsdrill.show,
    "view": lambda name: nsdrill.view(name).close(),
    "window": nsdrill.window,
}
COMPUTES = {"run", "simulate", "fit", "animate"}  # which tell of other things
# what reads no file of results and runs nothing, or gets data that were told of where they were read
READS_NONE = {"load_study", "check", "chart", "save"}
NAMES = {name for name in nsdrill.__all__ if getattr(getattr(api, name, None), "__wrapped__", None)}


@contextlib.contextmanager
def told_here():
    """The warnings of nsdrill in the block, of which there is one, at a line of this file."""
    with warnings.catch_warnings(record=True) as every:
        warnings.simplefilter("always")
        yield
    found = [one for one in every if issubclass(one.category, nsdrill.RunWarning | nsdrill.FileWarning)]
    assert found
    assert {one.filename for one in found} == {__file__}, [str(one) for one in found]


def test_every_function_is_tried():
    assert {*READS, *COMPUTES, *READS_NONE} == NAMES


def test_one_place_warns():
    """All warnings go through the one function that finds the line of the user."""
    calls = [
        f"{file.relative_to(PACKAGE)}:{node.lineno}"
        for file in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.Attribute) and node.attr in ("warn", "warn_explicit")
    ]
    assert {call.partition(":")[0] for call in calls} == {"errors.py"}, calls


@pytest.mark.parametrize("name", READS)
def test_a_file_that_another_program_changed(name, shared, tmp_path):
    copy = shutil.copy(shared / "small.h5", tmp_path / "changed.h5")
    with h5py.File(copy, "r+") as file:
        file.attrs["title"] = "Changed"
    with told_here(), contextlib.suppress(nsdrill.NsdrillError):  # what does not fit it is refused
        READS[name](copy)


@pytest.mark.parametrize("accessor", [False, True])
def test_points_that_failed(accessor, shared):
    changes = {"simulation.max_steps": 1000}
    with told_here():
        data = nsdrill.run(shared / "small.yaml", set=changes, progress=False)
    with told_here() if accessor else contextlib.nullcontext():
        if accessor:
            data.assign_attrs(title="\U0001fae8").nsdrill.plot()


def test_runs_that_end_early(shared):
    with told_here():
        nsdrill.simulate(shared / "small.yaml", duration="20 s", set={"simulation.max_steps": 1000})


def test_a_fit_far_from_the_sweep(tmp_path):
    (tmp_path / "field.csv").write_text("rotary_speed [rad/s], bit_speed_max [rad/s]\n4, 6\n5, 7\n")
    study = {
        "model": "torsion",
        "simulation": {"transient": "1 s", "observe": "1 s"},
        "uncertain": {"bit.friction.static": {"uniform": [0.2, 0.8]}},
    }
    with told_here():
        nsdrill.fit(
            study, tmp_path / "field.csv", tmp_path / "out.yaml", batch=16, rounds=2, samples=16, resume=True,
            progress=False,
        )  # fmt: skip


def test_libraries_between_are_no_place(recwarn):
    """Where nsdrill enters a context of its own, a module of Python calls it."""
    text = "@contextmanager\ndef entered():\n    warn('entered', RunWarning)\n    yield\n"
    names = {"contextmanager": contextlib.contextmanager, "warn": warn, "RunWarning": nsdrill.RunWarning}
    exec(compile(text, str(PACKAGE / "inside.py"), "exec"), names)
    with names["entered"]():
        pass
    assert [one.filename for one in recwarn] == [__file__]
