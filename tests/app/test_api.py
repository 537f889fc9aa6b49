"""The functions that Python users call: every form of a study, of results and of a
quantity in, Datasets out."""

import ast
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nsdrill
from nsdrill.errors import Refusal, naming_options, option
from nsdrill.store import part_path

NESTED: dict[str, Any] = {
    "title": "Small",
    "operation": {"depth": "2000 m", "wob": "22.24 kN", "rotary_speed": "3 rad/s"},
    "sweep": {"rotary_speed": {"from": "1 rad/s", "to": "8 rad/s", "points": np.int64(8)}, "procedure": "up-down"},
    "simulation": {"transient": "2 s", "observe": "2 s"},
    "record": {"peaks": 4},
}
DOTTED: dict[str, Any] = {
    "title": "Small",
    "operation.depth": "2 km",
    "operation": {"wob": "22.24 kN"},
    "operation.rotary_speed": "3 rad/s",
    "sweep.rotary_speed": {"from": "1 rad/s", "to": "8 rad/s"},
    "sweep.rotary_speed.points": 8,
    "sweep.procedure": "up-down",
    "simulation.transient": "2 s",
    "simulation.observe": "2 s",
    "record.peaks": 4,
}


@pytest.fixture(scope="module")
def small(shared):
    """The results of the small study in memory."""
    return nsdrill.run(shared / "small.yaml", workers=1, progress=False)


@pytest.fixture(scope="module")
def trace(shared):
    return nsdrill.simulate(shared / "small.yaml", rotary_speed="60 rpm", duration="2 s", sample=0.01)


def same(a: xr.Dataset, b: xr.Dataset) -> bool:
    """Whether all variables have the same bits, whatever dimensions of length one there
    are."""
    return set(a.data_vars) == set(b.data_vars) and all(
        a[name].squeeze().values.tobytes() == b[name].squeeze().transpose(*a[name].squeeze().dims).values.tobytes()
        for name in a.data_vars
    )


# --- studies


def test_a_study_in_every_form(shared):
    path = shared / "small.yaml"
    forms = [path, str(path), path.read_text(), NESTED, DOTTED, nsdrill.load_study(path)]
    assert {nsdrill.load_study(form).sha256 for form in forms} == {nsdrill.load_study(path).sha256}
    assert nsdrill.load_study("operation: {wob: 30 kN}").operation.wob == 30e3
    rock = ["10 MN/m", "20 MN/m"]
    for form in ({"sweep": {"bit.rock_stiffness": rock}}, {"sweep.bit.rock_stiffness": rock}):
        assert nsdrill.load_study(form).swept == ("bit.rock_stiffness",)


def test_the_text_of_a_mapping_is_the_study_again():
    study = nsdrill.load_study({**DOTTED, "title": "a: 'b' # no", "classify.stick_slip.stick_slip_index": 60})
    again = nsdrill.load_study(study.text)
    assert again.sha256 == study.sha256
    assert again.title == study.title


@pytest.mark.parametrize(
    "changes",
    [
        {"operation.wob": "30 kN", "record.peaks": 2, "sweep.rotary_speed": ["2 rad/s", "3 rad/s"]},
        ["operation.wob=30 kN", "record.peaks=2", "sweep.rotary_speed=[2 rad/s, 3 rad/s]"],
    ],
)
def test_keys_are_changed_in_every_form(shared, changes):
    path = shared / "small.yaml"
    for form in (path, path.read_text(), NESTED, nsdrill.load_study(path)):
        study = nsdrill.load_study(form, changes)
        assert study.operation.wob == 30e3
        assert study.record.peaks == 2
        assert study.axes["rotary_speed"].tolist() == [2.0, 3.0]
    both = nsdrill.load_study(nsdrill.load_study(path, {"title": "a: b"}), {"operation.wob": "1 kN"})
    assert (both.title, both.operation.wob) == ("a: b", 1e3)


@pytest.mark.parametrize(
    ("study", "words"),
    [
        ({"operation.wob": 30000}, r"^the study: operation\.wob: found the number 30000 without a unit; allowed: .*kN"),
        ({"operation": {"wob": "30 m"}}, r"^the study: operation\.wob: found '30 m', in units of length"),
        ("title: a\noperation: {wob: 3}", r"^the study, line 2: operation\.wob: found the number 3 without a unit"),
        ({"operatoin": {}}, r"unknown key.*Did you mean operation\?"),
        ({"operation.wob": "3 kN", "operation": {"wob": "4 kN"}}, r"operation\.wob: found the key a second time"),
        ({"operation": "x", "operation.wob": "4 kN"}, r"operation\.wob: found the key a second time"),
        ({"title": object()}, r"title: found a value of the type object; allowed: text, numbers"),
        ({3: "x"}, r"found 3 as a key; allowed: names, nested or dotted"),
        ({"bit.friction.static": float("nan")}, r"bit\.friction\.static: found"),
        ("", "empty document"),
        ({}, "empty document"),
        (3, r"^study: found a value of the type int; allowed: a Study, the name of a YAML file, YAML text"),
        (None, r"found a value of the type NoneType"),
        ("nowhere.yaml", r"nowhere\.yaml: there is no such file"),
    ],
)
def test_a_wrong_study_is_told(study, words):
    for call in (nsdrill.load_study, nsdrill.check, nsdrill.run, nsdrill.simulate):
        with pytest.raises(nsdrill.InputError, match=words):
            call(study)


def test_a_list_that_holds_itself_is_told():
    ring = []
    ring.append(ring)
    with pytest.raises(nsdrill.StudyError, match="holds itself"):
        nsdrill.load_study({"sweep.depth": ring})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"operation.wob": 30}, r"small\.yaml: operation\.wob: found the number 30 without a unit \(set={'operation"),
        ("operation.wob=30 kN", "set: found .*; allowed: a mapping by dotted keys, or a list of texts 'key=value'"),
        (["operation.wob"], "found set operation.wob; allowed: set={'key': 'value'}"),
        ({3: 4}, "set: found 3 as a key"),
        ({"title": object()}, "set: title: found a value of the type object"),
        (7, "set: found 7"),
    ],
)
def test_wrong_changes_are_told(shared, changes, words):
    with pytest.raises(nsdrill.InputError, match=words) as caught:
        nsdrill.load_study(shared / "small.yaml", changes)
    assert "--" not in str(caught.value)


# --- run, open, save


def test_in_memory_and_in_a_file_are_the_same(shared, small, tmp_path):
    with nsdrill.run(NESTED, tmp_path / "out.h5", progress=False) as written:
        assert isinstance(small, xr.Dataset)
        assert isinstance(written, xr.Dataset)
        assert same(small, written)
    with nsdrill.open_results(shared / "small.h5") as kept:
        assert same(small, kept)
        up = small.sel(procedure="up", rotary_speed=3.0).squeeze()
        assert float(up.final_state.sel(state="bit_speed")) == float(
            kept.sel(procedure="up", rotary_speed=3.0).final_state.squeeze().sel(state="bit_speed")
        )
    assert small.bit_speed_max.attrs["units"] == "rad s-1"
    assert small.response.attrs["flag_meanings"] == "bit_bounce stick_slip whirl stalled"


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"scheduler": "tcp://host:1"}, "scheduler: found with engine='threads'"),
        ({"resume": True}, "resume: found without path"),
        ({"retry_failed": True}, "retry_failed: found without path"),
        ({"overwrite": True}, "overwrite: found without path"),
        ({"progress": 3}, "progress: found 3; allowed: True, False, or a function"),
        ({"path": 3}, r"^path: found a value of the type int; allowed: the name of a file\."),
        ({"path": "out.h5", "overwrite": True, "resume": True}, "overwrite=True and resume=True exclude each other"),
        ({"path": "nowhere/out.h5"}, "there is no folder"),
        (
            {"set": {"sweep": None, "operation.rotary_speed": {"ramp": [["0 s", "1 rad/s"], ["1 s", "2 rad/s"]]}}},
            "found no sweep, only a ramp",
        ),
    ],
)
def test_a_wrong_run_is_told_and_leaves_nothing(shared, tmp_path, monkeypatch, more, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(nsdrill.InputError, match=words):
        nsdrill.run(shared / "small.yaml", **more)
    assert not list(tmp_path.iterdir())


def test_results_do_not_replace_their_study(tmp_path):
    (tmp_path / "study.yaml").write_text("simulation: {transient: 1 s, observe: 1 s}")
    with pytest.raises(nsdrill.InputError, match=r"this is the study\. Choose another path"):
        nsdrill.run(tmp_path / "study.yaml", tmp_path / "study.yaml", overwrite=True)
    assert [path.name for path in tmp_path.iterdir()] == ["study.yaml"]
    assert nsdrill.load_study(tmp_path / "study.yaml").simulation.observe == 1.0


def test_resume_after_an_interrupt(shared, tmp_path, small):
    """Whatever the function for the progress raises ends the run, and finished points
    are safe."""
    out, seen = tmp_path / "out.h5", []

    def stop(now):
        seen.append(now)
        if now.note != "compiling":  # the first stage, without points
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match=r"points are kept in .*\. Go on with the same call and resume=True"):
        nsdrill.run(shared / "small.yaml", out, workers=1, progress=stop)
    assert isinstance(seen[0], nsdrill.Progress)
    assert 0 < seen[-1].done <= seen[-1].total == 16
    with pytest.raises(nsdrill.FileError, match=r"unfinished run .* by resume=True, or .*overwrite=True"):
        nsdrill.run(shared / "small.yaml", out, progress=False)
    partial = nsdrill.open_results(part_path(out))
    assert int((partial.status == 1).sum()) == seen[-1].done
    assert "an unfinished sweep" in nsdrill.show(part_path(out))
    with nsdrill.run(shared / "small.yaml", out, resume=True, progress=False) as whole:
        assert same(whole, small)
    with pytest.raises(nsdrill.FileError, match=r"the file exists.*overwrite=True"):
        nsdrill.run(shared / "small.yaml", out, progress=False)
    with nsdrill.run(shared / "small.yaml", out, overwrite=True, progress=False) as again:
        assert same(again, small)


def test_failed_points_are_told(shared, tmp_path):
    for path in (None, tmp_path / "out.h5"):
        with pytest.warns(nsdrill.RunWarning, match=r"points failed; status says which") as told:
            made = nsdrill.run(shared / "small.yaml", path, set={"simulation.max_steps": 1000}, progress=False)
        assert int((made.status == 3).sum()) > 0
        assert [warning.filename for warning in told] == [__file__]
        made.close()


def test_a_whole_number_of_numpy_is_one(shared):
    for workers in (np.int64(1), np.array(1)):
        assert nsdrill.run(shared / "small.yaml", workers=workers, progress=False).sizes
    with pytest.raises(Refusal, match=r"workers: found array\(0\); allowed: a whole number, 1 or more\."):
        nsdrill.run(shared / "small.yaml", workers=np.array(0), progress=False)


@pytest.mark.parametrize("ending", ["h5", "nc", "hdf5"])
def test_results_and_traces_are_saved_as_they_are(small, trace, tmp_path, ending):
    for name, data in (("results", small), ("trace", trace)):
        path = tmp_path / f"{name}.{ending}"
        nsdrill.save(data, path)
        with nsdrill.open_results(path) as again:
            assert same(again, data)
            assert again.attrs["study_sha256"] == data.attrs["study_sha256"]
        with pytest.raises(nsdrill.FileError, match=r"the file exists.*overwrite=True"):
            nsdrill.save(data, path)
        nsdrill.save(data, path, overwrite=True)
        assert nsdrill.diff(data, path)["same_numbers"]
    assert nsdrill.replay(tmp_path / f"results.{ending}", rotary_speed=3.0, procedure="up").attrs["same_bits"] == 1


def test_a_part_of_the_results_can_be_saved(small, tmp_path):
    part = small.sel(procedure=["up"]).sel(rotary_speed=[2.0, 3.0])
    nsdrill.save(part, tmp_path / "part.h5")
    with nsdrill.open_results(tmp_path / "part.h5") as again:
        assert same(again, part)


@pytest.mark.parametrize(
    ("change", "name", "words"),
    [
        (lambda d: d, "x.txt", r"x\.txt: found the ending \.txt; allowed: \.h5, \.hdf5, \.nc, \.csv"),
        (lambda d: d.assign(mine=1.0), "x.h5", "found mine, which nsdrill does not know"),
        (lambda d: d[["response"]], "x.h5", "found results without status"),
        (lambda d: d.sortby("rotary_speed", ascending=False), "x.h5", "rotary_speed that do not ascend"),
        (lambda d: d.isel(peak=[1]), "x.h5", "found a part of peak"),
        (lambda d: d.isel(rotary_speed=slice(0, 0)), "x.h5", "found no values of rotary_speed; allowed: one or more"),
        (lambda d: d, "", "^path: found an empty text"),
        (lambda d: d.drop_vars("rotary_speed"), "x.h5", "coordinate rotary_speed is missing"),
        (lambda d: 3, "x.h5", "found a value of the type int; allowed: a Dataset, or a figure"),
        (lambda d: d, 3, r"^path: found a value of the type int; allowed: the name of a file\."),
        (lambda d: d, "nowhere/x.h5", "there is no folder"),
    ],
)
def test_what_cannot_be_saved(small, tmp_path, monkeypatch, change, name, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(nsdrill.InputError, match=words):
        nsdrill.save(change(small), name)
    assert not list(tmp_path.iterdir())


def test_dask_gives_the_same_bits(small, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None, protocol="tcp"
    ) as cluster:
        where = {"engine": "dask", "scheduler": cluster.scheduler_address}
        assert same(nsdrill.run(NESTED, **where), small)
        with nsdrill.run(NESTED, tmp_path / "out.h5", **where) as written:
            assert same(written, small)
    with pytest.raises(nsdrill.InputError, match=r"^scheduler: found 'nonsense'.*tcp://host:8786"):
        nsdrill.run(NESTED, engine="dask", scheduler="nonsense")


def test_dask_workers_that_do_not_start_are_told(monkeypatch):
    distributed = pytest.importorskip("distributed")

    def fail(**more):
        raise RuntimeError("Nanny failed to start.")

    monkeypatch.setattr(distributed, "LocalCluster", fail)
    with pytest.raises(nsdrill.NsdrillError, match=r"did not start .*`if __name__ == \"__main__\":`"):
        nsdrill.run(NESTED, engine="dask")


# --- simulate, replay


def test_simulate_starts_as_the_study_says(shared):
    changes = {"initial.x": "5 mm", "initial.vy": "3 cm/s"}
    trace = nsdrill.simulate(shared / "small.yaml", set=changes, duration=1.0, sample=0.25)
    assert trace.time.values.tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert trace.x.values[0] == 0.005
    assert trace.vy.values[0] == 0.03
    assert trace.drive_angle.values.tolist() == [0, 0.75, 1.5, 2.25, 3]


@pytest.mark.parametrize(
    "asked",
    [
        {"wob": 80e3, "rotary_speed": "60 rpm"},
        {"wob": "80 kN", "rotary_speed": np.float64(2 * np.pi)},
        {"at": {"wob": "80 kN", "operation.rotary_speed": "60 rpm"}},
        {"at": {"wob": xr.DataArray(80e3), "rotary_speed": np.array(2 * np.pi)}},
        {"at": {"wob": 80_000}, "rotary_speed": "1 rev/s"},
    ],
)
def test_simulate_is_the_point_of_a_sweep(shared, asked):
    """A sweep from one initial state and a simulation at one of its points are the same
    run."""
    with nsdrill.open_results(shared / "map.h5") as results:
        point = results.sel(wob=80e3, rotary_speed=2 * np.pi).squeeze()
        trace = nsdrill.simulate(shared / "map.yaml", **asked)
        assert trace.attrs["final_state"].tobytes() == point.final_state.values.tobytes()
        for name, end in zip(point.state.values, point.final_state.values, strict=True):
            assert name == "drive_angle" or trace[name].values[-1] == end


@pytest.mark.parametrize("value", ["20 MN/m", 20e6])
@pytest.mark.parametrize("key", ["bit.rock_stiffness", "bit_rock_stiffness"])
def test_simulate_at_any_number(shared, key, value):
    wanted = nsdrill.simulate(shared / "small.yaml", duration=1, set={"bit.rock_stiffness": "20 MN/m"})
    assert same(nsdrill.simulate(shared / "small.yaml", duration="1 s", at={key: value}), wanted)


def test_the_wall_stiffness_has_the_units_of_its_law():
    text = "simulation: {transient: 0 s, observe: 1 s}\nwell: {law: hertz, stiffness: 1e9 N/m^1.5}\n"
    trace = nsdrill.simulate(text, at={"well.stiffness": "2e9 N/m^1.5"}, sample="0.5 s")
    assert same(trace, nsdrill.simulate(text, at={"well.stiffness": 2e9}, sample="0.5 s"))
    assert "2e+09" in trace.attrs["study_overrides"] or "2000" in trace.attrs["study_overrides"]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"wob": "30"}, r"^wob: found '30', a number without a unit; .*; a number is in N\."),
        ({"wob": -3.0}, r"^wob: found the number -3; allowed"),
        ({"wob": float("nan")}, r"^wob: found the number nan"),
        ({"wob": True}, r"^wob: found true"),
        ({"wob": [1.0, 2.0]}, r"^wob: found a list"),
        ({"wob": np.array([1.0, 2.0])}, r"^wob: found a value of the type ndarray"),
        ({"wob": 10**400}, r"^wob: found the number inf"),
        ({"depth": 10.0}, r"depth: found 10 m, allowed: more than the length of the collars"),
        ({"at": {"bit.rockstiffness": 3}}, r"at: found the key 'bit\.rockstiffness'; .*mean bit\.rock_stiffness\?"),
        ({"at": {"bit.rock_stiffness": "3 kN"}}, r"^at\['bit\.rock_stiffness'\]: found '3 kN'"),
        ({"at": {"wob": 3e3}, "wob": 3e3}, "at: found a second value of wob"),
        ({"at": "wob=3 kN"}, "at: found 'wob=3 kN'; allowed: a mapping"),
        ({"duration": -1}, r"^duration: found -1 s"),
        ({"sample": "1 h"}, r"^sample: found 3600 s; allowed: at most"),
        ({"sample": 0}, r"^sample: found 0 s; allowed: more than 0 s"),
        ({"point": 3}, r"^point: found without orbit; allowed: with it"),
        ({"start": 3}, r"start: found 3; allowed: nothing"),
    ],
)
def test_a_wrong_simulation_is_told(shared, asked, words):
    with pytest.raises(nsdrill.InputError, match=words) as caught:
        nsdrill.simulate(shared / "small.yaml", **asked)
    assert "--" not in str(caught.value)


def test_a_run_that_ends_early_is_told(shared):
    with pytest.warns(nsdrill.RunWarning, match=r"ended early \(step_limit\).*simulation\.max_steps"):
        trace = nsdrill.simulate(shared / "small.yaml", duration="20 s", set={"simulation.max_steps": 1000})
    assert trace.attrs["status"] == "step_limit"


def test_replay_of_a_file_and_of_a_dataset(shared):
    with nsdrill.open_results(shared / "map.h5") as results:
        for source in (shared / "map.h5", str(shared / "map.h5"), results, results.load()):
            trace = nsdrill.replay(source, wob="41 kN", rotary_speed=6.3)
            assert trace.attrs["same_bits"] == 1
            assert trace.attrs["wob"] == 40e3


def test_replay_that_ends_elsewhere_is_told(shared, tmp_path):
    with nsdrill.open_results(shared / "map.h5") as results:
        changed = results.load().copy(deep=True)
    changed["final_state"] = changed.final_state * 1.5
    with pytest.warns(nsdrill.RunWarning, match="does not end in the stored final state"):
        assert nsdrill.replay(changed, wob=40e3, rotary_speed=6.3).attrs["same_bits"] == 0


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"procedure": "up"}, r"8 values of rotary_speed\. Say which one with rotary_speed\."),
        ({"rotary_speed": 3.0}, r"the sweep went up and down\. Say which one with procedure\."),
        ({"rotary_speed": "600 rpm", "procedure": "up"}, r"rotary_speed: found 600 rpm; allowed: from 9\.5493 rpm"),
        ({"at": {"bit.rock_stiffness": 1e6}}, "at: found bit.rock_stiffness; allowed: the axes"),
        ({"rotary_speed": 3.0, "procedure": "up", "start": 1}, "start: found 1; allowed: nothing"),
    ],
)
def test_a_wrong_replay_is_told(shared, small, asked, words):
    for source in (small, shared / "small.h5"):
        with pytest.raises(nsdrill.InputError, match=words) as caught:
            nsdrill.replay(source, **asked)
        assert "--" not in str(caught.value)


def test_only_whole_results_are_replayed_and_classified(small, trace):
    part = small.sel(rotary_speed=[2.0, 3.0])
    words = r"found 2 values of rotary_speed, of \d+ in its study; allowed: all points of the run"
    for call in (lambda: nsdrill.replay(part, rotary_speed=2.0, procedure="up"), lambda: nsdrill.classify(part)):
        with pytest.raises(nsdrill.FileError, match=words):
            call()
    with pytest.raises(nsdrill.InputError, match="replay: found a trace"):
        nsdrill.replay(trace)


# --- what is in results


def test_classify_a_dataset_and_a_file(shared, small, tmp_path):
    nsdrill.save(small, tmp_path / "out.h5")
    changes = {"classify.stick_slip.stick_slip_index": 10}
    before = small.copy(deep=True)
    other = nsdrill.classify(small, changes)
    assert small.identical(before)
    assert not np.array_equal(other.response, small.response)
    assert other.bit_speed_max.identical(small.bit_speed_max)
    assert other.attrs["history"].splitlines()[-1].endswith("classify classify.stick_slip.stick_slip_index=10")
    with nsdrill.classify(tmp_path / "out.h5", changes) as in_file:
        assert same(in_file, other)
    assert nsdrill.diff(other, tmp_path / "out.h5")["same_study"]
    assert "stick_slip_index=10" in nsdrill.show(other)
    back = nsdrill.classify(other)
    assert np.array_equal(back.response, small.response)
    with pytest.raises(nsdrill.InputError, match=r"^changes: operation: found a change of something else"):
        nsdrill.classify(small, {"operation.wob": "3 kN"})
    with pytest.raises(nsdrill.InputError, match=r"classify: found results without bit_speed_min, .* more"):
        nsdrill.classify(small[["status", "response"]])


def test_a_feature_that_is_left_out_is_told(small, tmp_path):
    part = small.drop_vars("surface_torque_mean")
    for refused in (lambda: nsdrill.save(part, tmp_path / "part.h5"), lambda: nsdrill.classify(part)):
        with pytest.raises(nsdrill.InputError, match="without surface_torque_mean"):
            refused()


def test_show_is_what_the_command_prints(shared, small, trace):
    file = str(shared / "small.h5")
    words = [sys.executable, "-m", "nsdrill", "show", file]
    assert nsdrill.show(file) + "\n" == subprocess.run(words, capture_output=True, text=True, check=True).stdout
    told = nsdrill.show(small).splitlines()
    assert told[0] == "Dataset: results of a sweep. Small"
    assert told[3:] == nsdrill.show(file).splitlines()[3:]
    assert "trace of one run" in nsdrill.show(trace)
    with pytest.raises(nsdrill.InputError, match="show: found results without status"):
        nsdrill.show(small[["response"]])
    with pytest.raises(nsdrill.InputError, match=r"^results: found a value of the type int; .* or a Dataset"):
        nsdrill.show(3)


def test_window_hysteresis_and_diff_of_files_and_datasets(shared, small, trace):
    file = shared / "small.h5"
    assert nsdrill.window(small) == nsdrill.window(file)
    assert nsdrill.window(small, severity=4)["safe"] == nsdrill.window(file, severity=4)["safe"] == 8
    found = nsdrill.window(file, file)
    assert (found["kind"], found["both"], found["gained"], found["lost"]) == ("contrast", 0, 0, 0)
    assert nsdrill.window(small, small, severity=4)["both"] == 8
    assert {**nsdrill.window(file, small), "names": 0} == {**found, "names": 0}
    with pytest.raises(nsdrill.InputError, match=r"no-such.h5: there is no such file"):
        nsdrill.window(file, "no-such.h5")
    assert nsdrill.hysteresis(small) == nsdrill.hysteresis(file) != []
    for a, b in ((small, file), (file, small), (small, small)):
        found = nsdrill.diff(a, b)
        assert found["same_study"]
        assert found["same_numbers"]
    assert not nsdrill.diff(small, nsdrill.run(NESTED, set={"operation.wob": "30 kN"}, progress=False))["same_numbers"]
    assert nsdrill.diff(trace, small)["kinds"] == ["trace", "results"]
    assert nsdrill.diff(trace, small)["files"] == ["Dataset a", "Dataset b"]
    for call in (nsdrill.window, nsdrill.hysteresis, nsdrill.attractors):
        with pytest.raises(nsdrill.InputError, match="found a trace; allowed: results of a sweep"):
            call(trace)
        with pytest.raises(nsdrill.InputError, match="found results without status"):
            call(small[["bit_speed_max"]])
        with pytest.raises(nsdrill.InputError, match="found a value of the type float"):
            call(1.0)


def test_attractors(small, tmp_path):
    made = nsdrill.run(NESTED, set={"sweep": {"rotary_speed": ["3 rad/s"]}, "initial.ensemble": 4}, progress=False)
    nsdrill.save(made, tmp_path / "starts.h5")
    assert nsdrill.attractors(made) == nsdrill.attractors(tmp_path / "starts.h5")
    assert nsdrill.attractors(made)[0]["starts"] == 4
    trace = nsdrill.replay(made, start=2)
    assert trace.attrs["same_bits"] == 1
    with pytest.raises(nsdrill.FileError, match=r"one start.*set={'initial\.ensemble': 64}"):
        nsdrill.attractors(small)


def test_check(shared):
    for form in (shared / "small.yaml", NESTED, nsdrill.load_study(NESTED)):
        report = nsdrill.check(form)
        assert report.coefficients.gap == pytest.approx(0.0762, rel=1e-12)
        assert report.points == 16
        assert any(warning.startswith("Short") for warning in report.warnings)
    assert nsdrill.check(NESTED, {"well.diameter": "400 mm"}).coefficients.gap == pytest.approx(0.0857, rel=1e-12)


def test_parts_of_which_nothing_is_left(small, trace, tmp_path):
    for call in (nsdrill.show, nsdrill.plot, nsdrill.window, nsdrill.classify, nsdrill.hysteresis):
        with pytest.raises(nsdrill.InputError, match="found no values of rotary_speed; allowed: one or more"):
            call(small.isel(rotary_speed=slice(0, 0)))
    for part in (trace.isel(time=slice(0, 0)), trace.isel(time=slice(None, None, -1))):
        for call in (nsdrill.show, nsdrill.plot, lambda data: nsdrill.save(data, tmp_path / "x.h5")):
            with pytest.raises(nsdrill.InputError, match="time does not ascend"):
                call(part)
    assert not list(tmp_path.iterdir())
    assert nsdrill.plot(trace.sel(time=slice(0.5, 1.0))).axes


def test_values_out_of_order_or_twice_are_refused(small, tmp_path):
    """A window reads neighbours from the order of the values, and a share counts runs."""
    backwards = small.isel(rotary_speed=slice(None, None, -1))
    permuted, doubled = small.isel(rotary_speed=[1, 0, 2]), small.isel(rotary_speed=[0, 1, 1])
    calls = (nsdrill.show, nsdrill.plot, nsdrill.window, nsdrill.classify, nsdrill.hysteresis, nsdrill.diff)
    for part in (backwards, permuted, doubled):
        for call in calls:
            with pytest.raises(nsdrill.InputError, match="values of rotary_speed that do not ascend"):
                call(*[part] * (2 if call is nsdrill.diff else 1))
        with pytest.raises(nsdrill.InputError, match="values of rotary_speed that do not ascend"):
            nsdrill.save(part, tmp_path / "x.h5")


def test_results_without_their_attributes(small, tmp_path):
    """Arithmetic of xarray may drop them: what needs no study still works."""
    bare = small.copy()
    bare.attrs = {}
    assert nsdrill.plot(bare).axes
    assert nsdrill.window(bare)["safe"] == nsdrill.window(small)["safe"]
    assert "Responses, up" in nsdrill.show(bare)
    nsdrill.save(bare, tmp_path / "bare.h5")
    assert nsdrill.diff(bare, tmp_path / "bare.h5")["same_numbers"]
    for call in (nsdrill.classify, lambda data: nsdrill.replay(data, rotary_speed=3.0, procedure="up")):
        with pytest.raises(nsdrill.FileError, match="found no study"):
            call(bare)


def test_something_else_than_nsdrill_made(tmp_path):
    for data in (xr.Dataset(), xr.Dataset({"a": ("b", [1.0])}), xr.Dataset({"x": ("time", [1.0])}, {"time": [0.0]})):
        for call in (nsdrill.show, nsdrill.plot, nsdrill.window, nsdrill.classify):
            with pytest.raises(nsdrill.InputError, match="the Dataset: "):
                call(data)


# --- words


OPTION = re.compile(r"(?<![\w-])--[a-z]")
FRONTS = ("cli", "operations", "text", "web")


def test_no_error_below_names_an_option_itself():
    """Commands and functions share the rooms below them, whose errors name arguments by
    ``option``."""
    root = Path(nsdrill.__file__).parent
    errors, named = 0, []
    for path in root.rglob("*.py"):
        if path.relative_to(root).parts[0] in FRONTS:
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and re.search(r"(Error|Refusal|Fault)$", ast.unparse(node.func)):
                errors += 1
                named += [text for text in map(ast.unparse, node.args) if OPTION.search(text)]
    assert errors > 300
    assert named == []


def test_an_argument_has_the_name_of_the_caller():
    said = ("overwrite", None), ("kind", "map"), ("at", "sample=..."), ("set", "bit.lobes=3"), ("path", None)
    with naming_options():
        options = [option(name, value) for name, value in said]
        refused = str(Refusal("at", "5", "4", key="wob", bare="N"))
    assert options == ["--overwrite", "--kind map", "--at sample=...", "--set bit.lobes=3", "-o"]
    assert refused == "--at wob: found 5; allowed: 4."
    names = [option(name, value) for name, value in said]
    assert names == ["overwrite=True", "kind='map'", "at={'sample': ...}", "set={'bit.lobes': 3}", "path"]
    assert str(Refusal("at", "5", "4", key="wob", bare="N")) == "at['wob']: found 5; allowed: 4; a number is in N."
