"""Results that were changed outside of nsdrill: whatever is made from them says so, and is
sealed all the same; axes that are not those of the study are refused by all that answers."""

import json
import shutil
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
from matplotlib import pyplot as plt

import nsdrill
from nsdrill.data import EDITED_SOURCE
from nsdrill.errors import FileError
from nsdrill.store import read_attributes
from nsdrill.web.session import Session

pytestmark = [pytest.mark.filterwarnings("ignore::nsdrill.FileWarning"), pytest.mark.usefixtures("words_only")]
TOLD = "NOT SEALED: changed outside of nsdrill"
SOURCE = "edited.h5, by another program"


@pytest.fixture
def edited(call, shared):
    """A map that another program wrote a response into; the call of a command there."""
    shutil.copy(shared / "map.h5", "edited.h5")
    with h5py.File("edited.h5", "r+") as file:
        file["response"][0, 0] = 1
    return call


def source_of(path):
    return read_attributes(path).get(EDITED_SOURCE)


def test_every_file_that_is_made_from_an_edited_one_says_so(edited):
    edited("classify edited.h5 -o new.h5")
    edited("export edited.h5 -o copy.nc")
    with nsdrill.open_results("edited.h5") as results:
        nsdrill.save(results, "saved.h5")
    nsdrill.save(nsdrill.classify(nsdrill.open_results("edited.h5")), "memory.h5")
    for name in ("new.h5", "copy.nc", "saved.h5", "memory.h5"):
        with h5py.File(name) as file:  # in the file itself, which is sealed
            assert SOURCE in file.attrs[EDITED_SOURCE], name
        assert f"{name}: {TOLD}" in edited("show", name).err, name
        assert f"  {TOLD}" in edited("show", name).out, name
    edited("classify new.h5 -o newer.h5")
    assert source_of("newer.h5") == source_of("new.h5") == SOURCE
    shutil.copy("edited.h5", "place.h5")
    edited("classify place.h5")
    assert source_of("place.h5") == "place.h5, by another program"
    assert "\n" in read_attributes("place.h5")["history"]


def test_combined_and_repeated_runs_say_so(call, shared):
    for wob in (20, 30):
        call("run", shared / "small.yaml", "--set", f"operation.wob={wob} kN", "-o", f"{wob}.h5", "-q")
    with h5py.File("20.h5", "r+") as file:
        file["response"][0, 0] = 1
    call("combine 20.h5 30.h5 -o both.h5")
    assert source_of("both.h5") == "20.h5, by another program"
    call("run", shared / "small.yaml", "--set", "simulation.max_steps=1000", "-o", "few.h5", "-q", code=3)
    with h5py.File("few.h5", "r+") as file:
        file["response"][0, 0] = 1
    more = ("--set", "simulation.max_steps=100000", "--retry-failed")
    call("run", shared / "small.yaml", *more, "-o", "few.h5", "-q")
    assert source_of("few.h5") == "few.h5, by another program"


def test_every_answer_says_so(rendered, edited, shared):
    edited("classify edited.h5 -o new.h5")
    whole = shared / "map.h5"
    window = json.loads(edited("window new.h5 --json").out)
    assert window["answer"]["warnings"][0].startswith(TOLD)
    assert SOURCE in window["answer"]["warnings"][0]
    assert window["file_warnings"][0].startswith(f"new.h5: {TOLD}")
    assert json.loads(edited("show new.h5 --json").out)[EDITED_SOURCE] == SOURCE
    assert TOLD in edited("window new.h5").out
    assert f"\nb is {TOLD}" in edited("diff", whole, "new.h5").out
    assert json.loads(edited("diff", whole, "new.h5", "--json").out)[EDITED_SOURCE] == {"a": "", "b": SOURCE}
    for file in ("edited.h5", "new.h5"):
        edited("report", file, "-o", "page.html", "--motions", "0", "--overwrite")
        assert TOLD in Path("page.html").read_text(), file
        edited("report", file, "-o", "sheet.html", "--one-page", "--overwrite")
        assert TOLD in Path("sheet.html").read_text(), file
        assert Session(file).meta()["edited"].startswith(TOLD)
        figure = nsdrill.plot(file, kind="map")
        assert TOLD in words_in(figure)
        figure = nsdrill.plot(file, kind="window", text=True)
        assert TOLD in words_in(figure)
        plt.close("all")
    edited("replay new.h5 --rotary-speed 30rpm --wob 20kN -o trace.h5")
    assert source_of("trace.h5") == SOURCE
    assert TOLD in edited("show trace.h5").out


def words_in(figure):
    """All words of a figure, those of legends too, in one line."""
    return " ".join(" ".join(text.get_text() for text in figure.findobj(plt.Text)).split())


def test_files_of_runs_say_nothing(call, shared):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with nsdrill.open_results(shared / "map.h5") as results:
            assert EDITED_SOURCE not in results.attrs
            nsdrill.save(results, "whole.h5")
            nsdrill.save(results.isel(rotary_speed=slice(1, None, 2), wob=[0]), "part.h5")
            strict = nsdrill.classify(results, {"classify.whirl.wall_contact_fraction": 0.5})
            nsdrill.save(strict, "strict.h5")
    for file in ("whole.h5", "part.h5", "strict.h5"):
        assert source_of(file) is None
        assert "NOT SEALED" not in "".join(call("show", file).__dict__[name] for name in ("out", "err"))


@pytest.mark.parametrize("part", [{}, {"wob": [0, 1]}])
def test_labels_that_are_not_those_of_the_features_are_marked(call, shared, part):
    results = nsdrill.open_results(shared / "map.h5").load().isel(part)
    changed = results.copy(deep=True)
    changed["response"][:] = 1 - (results["response"] > 0)
    nsdrill.save(changed, "changed.h5")
    assert source_of("changed.h5") == "response of results in memory, by hand"
    assert TOLD in call("show changed.h5").out
    assert nsdrill.window(changed)[EDITED_SOURCE] == source_of("changed.h5"), "also before it is saved"
    assert TOLD in words_in(nsdrill.plot(changed))
    changed = results.copy(deep=True)
    changed["wall_contact_fraction"][:] = 0.0  # so that no label of whirl follows
    assert "response, whirl_kind" in nsdrill.window(changed)[EDITED_SOURCE]
    assert not nsdrill.window(results)[EDITED_SOURCE]


def of_other_code(data):
    """The results as those of a model that computes something else."""
    return data.assign_attrs(model_digest="0123456789abcdef")


def test_labels_of_other_code_are_made_again_and_marked_where_they_differ(call, shared):
    """Those that agree need no mark; of a study that is not of this version nothing is known."""
    results = nsdrill.open_results(shared / "map.h5").load()
    nsdrill.save(of_other_code(results), "same.h5")
    assert source_of("same.h5") is None
    changed = of_other_code(results.copy(deep=True))
    changed["response"][:] = 1 - (results["response"] > 0)
    nsdrill.save(changed, "changed.h5")
    said = source_of("changed.h5")
    assert said.startswith("response of results in memory, by hand, or labelled otherwise by other code: model digest ")
    assert "0123456789abcdef there" in said
    assert TOLD in call("show changed.h5").out
    resolved = json.loads(results.attrs["study_resolved"])
    unread = changed.assign_attrs(study_resolved=json.dumps({**resolved, "bit": {"friction": {"static": "many"}}}))
    nsdrill.save(unread, "unread.h5")
    assert "labels of results in memory, which cannot be checked: model digest 0123" in source_of("unread.h5")


def test_runs_of_other_code_that_are_labelled_or_combined_say_so(call, shared):
    """In the output and in the history of what is written."""
    for name, wob in (("a.h5", 20), ("b.h5", 30)):
        call("run", shared / "small.yaml", "--set", f"operation.wob={wob} kN", "-o", "run.h5", "-q", "--overwrite")
        with nsdrill.open_results("run.h5") as results:
            nsdrill.save(of_other_code(results.load()), name)
    for command, out in (("classify a.h5 -o c.h5", "c.h5"), ("combine a.h5 b.h5 -o both.h5", "both.h5")):
        assert "RUN BY OTHER CODE (model digest 0123456789abcdef there, " in call(command).err.replace("\n", " ")
        assert "(of runs by other code: model digest 0123456789abcdef" in read_attributes(out)["history"]
    assert "OTHER CODE" not in call("classify run.h5 -o d.h5").err
    assert "other code" not in read_attributes("d.h5")["history"]


SCALED = "found other values of rotary_speed than in its study"


def test_axes_of_another_study_are_refused_by_all_that_answers(call, shared):
    shutil.copy(shared / "map.h5", "scaled.h5")
    with h5py.File("scaled.h5", "r+") as file:
        file["rotary_speed"][...] = 1.5 * file["rotary_speed"][...]
    for command in (
        "window scaled.h5",
        "show scaled.h5",
        f"diff {shared / 'map.h5'} scaled.h5",
        "report scaled.h5 -o page.html",
        "report scaled.h5 --one-page -o page.html",
        "plot scaled.h5 -o picture.png",
        "plot scaled.h5 --kind window -o picture.png",
        "classify scaled.h5",
    ):
        assert SCALED in call(command, code=2).err, command
    results = nsdrill.open_results(shared / "map.h5").load()
    scaled = results.assign_coords(rotary_speed=1.5 * results.rotary_speed)
    for answer in (nsdrill.show, nsdrill.window, nsdrill.plot, lambda data: nsdrill.save(data, "saved.h5")):
        with pytest.raises(FileError, match=SCALED):
            answer(scaled)
    assert not Path("saved.h5").exists()


def test_ways_that_changed_places_are_refused(call, shared):
    results = nsdrill.open_results(shared / "small.h5").load()
    swapped = results.assign_coords(procedure=np.array(["down", "up"], dtype=object))
    with pytest.raises(FileError, match="found procedure down and up, of up and down in its study"):
        nsdrill.save(swapped, "swapped.h5")
    nsdrill.save(results.isel(procedure=[1]), "down.h5")
    assert "down" in call("show down.h5").out


def test_a_replay_and_a_spectrum_say_that_nothing_was_carried(call, shared):
    """The run after one that failed began at the start of the study."""
    results = nsdrill.open_results(shared / "small.h5").load()
    results["status"][0, 2] = 3
    with pytest.warns(nsdrill.RunWarning, match="NOT CARRIED: a run before it in its chain failed"):
        trace = nsdrill.replay(results, rotary_speed=5.0, procedure="up", sample=0.1)
    nsdrill.save(trace, "trace.h5")
    assert "NOT CARRIED" in call("show trace.h5").out
    assert "NOT CARRIED" in words_in(nsdrill.plot(trace))
    assert "NOT CARRIED" not in words_in(nsdrill.plot(nsdrill.replay(results, rotary_speed=1.0, procedure="up")))
    plt.close("all")
    nsdrill.save(results, "failed.h5")
    where = "--rotary-speed 5rad/s --procedure up"
    assert "NOT CARRIED" in call(f"replay failed.h5 {where} -o other.h5").err
    assert "NOT CARRIED" in call(f"spectrum failed.h5 {where} --duration 1s").out
    assert json.loads(call(f"spectrum failed.h5 {where} --duration 1s --json").out)["not_carried"] is True
    first = "--rotary-speed 1rad/s --procedure up"
    assert "NOT CARRIED" not in call(f"replay failed.h5 {first} -o first.h5").err


def test_what_is_no_section_of_a_study_is_none(call, shared):
    """Where another program has written it into the resolved study: answers go without, and no study is written."""
    results = nsdrill.open_results(shared / "map.h5").load()
    resolved = json.loads(results.attrs["study_resolved"])
    nsdrill.save(results.assign_attrs(study_resolved=json.dumps({**resolved, "sweep": "x"})), "sweep.h5")
    assert call("window sweep.h5").out
    followed = {"along": True, "from": 1.0, "to": 2.0, "curves": None}
    nsdrill.save(results.assign_attrs(study_resolved=json.dumps({**resolved, "continue": followed})), "along.h5")
    assert "found True, which is no axis" in call("show along.h5 --study", code=2).err
