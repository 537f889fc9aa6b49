"""What --set changed is said by everything that shows a result; and the study can be
had as it was run.

The failing study of the shared folder is the small one with simulation.max_steps=1000.
"""

import json
import shutil
from pathlib import Path

import h5py
import pytest

import nsdrill
from nsdrill import figures
from nsdrill.app.answering.summary import reclassify
from nsdrill.app.datasets import read_any as read
from nsdrill.app.experiment import overrides_of
from nsdrill.app.simulating.trajectory import replay
from nsdrill.store import log_from_results, write_trace

CHANGED = {"simulation.max_steps": "1000"}


@pytest.fixture
def old(shared, tmp_path):
    """A file that does not say its overrides."""
    path = Path(shutil.copy(shared / "failing.h5", tmp_path / "old.h5"))
    with h5py.File(path, "r+") as file:
        del file.attrs["study_overrides"]
    return path


def test_show(call, shared, old):
    log_from_results(shared / "failing.h5", "run.h5.part").close()
    for file in (shared / "failing.h5", old, "run.h5.part"):
        assert "\n  overrides      simulation.max_steps = 1000\n" in call("show", file).out
        assert json.loads(call("show", file, "--json").out)["overrides"] == CHANGED
    assert "overrides" not in call("show", shared / "small.h5").out
    assert json.loads(call("show", shared / "small.h5", "--json").out)["overrides"] == {}


def test_traces(call, shared):
    words = ["simulate", shared / "small.yaml", "-o", "trace.h5", "--duration", "1s", "--set", "operation.wob=30 kN"]
    call(*words)
    assert "  overrides      operation.wob = 30 kN\n" in call("show", "trace.h5").out
    # An operating value that was changed stands in the title among the others, once.
    title = figures.draw(read("trace.h5"), "orbit").get_suptitle()
    assert title.splitlines()[:2] == ["Small", "2000 m, 30 kN, 3 rad/s"]
    other = [word if word != "operation.wob=30 kN" else "bit.lobes=2" for word in words]
    call(*other, "--overwrite")
    assert "bit.lobes = 2" in figures.draw(read("trace.h5"), "orbit").get_suptitle()


def test_a_replay_has_those_of_its_sweep(call, shared, old):
    for file in (shared / "failing.h5", old):
        trace = replay(file, rotary_speed=1.0, procedure="up").trace
        assert json.loads(trace.attrs["study_overrides"]) == ["simulation.max_steps=1000"]
    # As early versions wrote it.
    write_trace("early.h5", trace)
    with h5py.File("early.h5", "r+") as file:
        file.attrs["study_overrides"] = "[]"
    assert json.loads(call("show", "early.h5", "--json").out)["overrides"] == CHANGED


def test_pictures(shared, old):
    for file in (shared / "failing.h5", old):
        for kind in ("summary", "bifurcation", "window", "radius_max"):
            title = figures.draw(read(str(file)), kind).get_suptitle()
            assert title.splitlines()[0].startswith("Small"), kind
            assert title.splitlines()[1] == "simulation.max_steps = 1000", kind


def test_new_thresholds_are_told_too(call, shared):
    shutil.copy(shared / "failing.h5", "labels.h5")
    reclassify("labels.h5", ["classify.whirl.wall_contact_fraction=0.9"])
    said = "classify.whirl.wall_contact_fraction = 0.9"  # what changes the labels, not how they were run
    assert figures.draw(read("labels.h5")).get_suptitle().splitlines()[1] == said
    assert json.loads(call("window", "labels.h5", "--json").out)["overrides"] == {
        **CHANGED,
        "classify.whirl.wall_contact_fraction": "0.9",
    }


@pytest.mark.parametrize(
    ("texts", "said"),
    [
        (["bit.lobes=1"], "bit.lobes = 1"),
        (["bit.lobes=2", " bit.lobes = 1"], "bit.lobes = 1"),
        (["title=Other"], "5000 m"),
        (["sweep.depth=[1 m, 2 m]"], "5000 m"),  # the axes show it
        (
            [f"mud.key{i}={i}{'0' * 20}" for i in range(5)],
            "mud.key0 = 000000000000000000000, mud.key1 = 100000000000000000000 and 3 more",
        ),
        (["other.depth=" + "[1 m]" * 99], "other.depth = " + ("[1 m]" * 99)[:82] + " ..."),
        (
            ["other.depth=" + "[1 m]" * 99, "bit.rock_stiffness=50 MN/m"],
            "other.depth = " + ("[1 m]" * 99)[:71] + " ... and 1 more",
        ),
        # where something physical changed, that alone
        (["simulation.observe=9 s", "uncertain=null", "bit.lobes=1"], "bit.lobes = 1"),
        (["simulation.observe=9 s"], "simulation.observe = 9 s"),
    ],
)
def test_a_title_stays_short(texts, said):
    from nsdrill.words.labels import heading

    attrs = {"title": "T", "study_overrides": json.dumps(texts)}
    lines = heading(attrs, "5000 m").splitlines()
    assert lines[1] == said
    assert max(map(len, lines)) <= 100


@pytest.mark.parametrize("value", ["", "no JSON", "{}", "3", "null", '["no equals sign"]', 5])
def test_odd_attributes_are_no_error(value):
    attrs = {"study_overrides": value}
    assert overrides_of(attrs) in ([], ["no equals sign="])


def test_study_as_it_was_run(call, shared, old):
    for file in (shared / "failing.h5", old):
        answer = call("show", file, "--study")
        assert ("NOT SEALED" in answer.err) == (file == old), "it was edited"
        assert "# Changed by --set: simulation.max_steps=1000\n" in answer.out
        Path("again.yaml").write_text(answer.out)
        call("check", "again.yaml")
        with h5py.File(file) as results:
            assert nsdrill.load_study("again.yaml").sha256 == results.attrs["study_sha256"]
    call("show", file, "--study", "--json", code=2)


def test_a_file_without_a_study(call, old):
    with h5py.File(old, "r+") as file:
        del file.attrs["study_resolved"]
    call("show", old)
    assert "found no study" in call("show", old, "--study", code=2).err
