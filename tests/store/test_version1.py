"""Files of format version 1 stay readable by everything, with their bits. expected.json
holds the digests of what the last reader that knew version 1 only gave."""

import csv
import hashlib
import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

import nsdrill
from nsdrill.app.datasets import with_missing_features
from nsdrill.app.experiment import processor, versions
from nsdrill.app.run import run_study
from nsdrill.app.saving import table, write_rows
from nsdrill.app.summary import reclassify
from nsdrill.cli.main import group
from nsdrill.errors import FileError
from nsdrill.store import (
    MemoryLog,
    from_dataset,
    log_from_results,
    open_results,
    read_attributes,
    read_point,
    read_results,
    read_trace,
    write_results,
    write_trace,
)

FOLDER = Path(__file__).parent / "version1"
EXPECTED = json.loads((FOLDER / "expected.json").read_text(encoding="utf-8"))
# The dimensions in memory, and those of version 2. The studies of version 1 had one
# order of axes.
NAMES = {
    "up_down": ((2, 1, 1, 4), ("procedure", "rotary_speed")),
    "rock_map": ((1, 1, 2, 2, 3), ("wob", "rotary_speed", "bit_rock_stiffness")),
    "starts": ((1, 1, 2, 1, 3), ("wob", "start")),
}


@pytest.fixture(params=NAMES)
def name(request):
    return request.param


def digests(arrays):
    return {
        name: [str(values.dtype), list(values.shape), hashlib.sha256(values.tobytes()).hexdigest()]
        for name, values in arrays.items()
    }


def of(results):
    return digests({**results.coords, **results.variables})


def complete(name):
    """The file with the features that this version measures besides, which are NaN."""
    return with_missing_features(read_results(FOLDER / f"{name}.h5"))


def test_the_bits_that_the_old_reader_gave(name):
    results = read_results(FOLDER / f"{name}.h5")
    assert results.attrs["format_version"] == 1
    assert results.shape == NAMES[name][0]
    assert of(results) == EXPECTED[name]


def test_a_file_of_version_2_made_from_it_has_its_bits(name, tmp_path):
    """By way of a log, as --retry-failed does, and from memory."""
    old = FOLDER / f"{name}.h5"
    with log_from_results(old, tmp_path / "new.h5.part") as log:
        write_results(tmp_path / "new.h5", log)
    write_results(tmp_path / "held.h5", MemoryLog.of(complete(name)))
    for made in ("new.h5", "held.h5"):
        results = read_results(tmp_path / made)
        assert of(results) == of(complete(name))
        assert of(results).items() >= EXPECTED[name].items()
        assert (results.attrs["format_version"], results.attrs["Conventions"]) == (2, "nsdrill-2")
        assert results.attrs["model"] == "christoforou_yigit"
        with open_results(tmp_path / made) as data:
            assert data.status.dims == NAMES[name][1]


def test_opened_it_has_the_dimensions_of_version_2(name, tmp_path):
    write_results(tmp_path / "new.h5", MemoryLog.of(complete(name)))
    with open_results(FOLDER / f"{name}.h5") as old, open_results(tmp_path / "new.h5") as new:
        assert old.identical(new.drop_vars(set(new.data_vars) - set(old.data_vars)))


def test_the_dataset_that_xarray_itself_reads_is_taken(name):
    with xr.open_dataset(FOLDER / f"{name}.h5", engine="h5netcdf") as data:
        assert data.status.dims[:4] == ("procedure", "depth", "wob", "rotary_speed")
        assert of(from_dataset(data)) == EXPECTED[name]


def test_single_points(name):
    results = read_results(FOLDER / f"{name}.h5")
    place = tuple(n - 1 for n in results.shape)
    point = read_point(FOLDER / f"{name}.h5", *place)
    for variable, values in results.variables.items():
        assert np.asarray(point[variable]).tobytes() == values[place].tobytes()


def test_the_trace(tmp_path):
    trace = read_trace(FOLDER / "trace.h5")
    assert digests({"time": trace.time, **trace.variables}) == EXPECTED["trace"]
    write_trace(tmp_path / "trace.h5", trace)
    again = read_trace(tmp_path / "trace.h5")
    assert digests({"time": again.time, **again.variables}) == EXPECTED["trace"]
    assert again.attrs["format_version"] == 2


@pytest.mark.parametrize("file", [*NAMES, "trace"])
def test_commands_that_read(file, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = str(FOLDER / f"{file}.h5")
    asks = [
        ["show", path],
        ["show", path, "--json"],
        ["export", path, "-o", "out.nc"],
        ["plot", path, "-o", "out.png"],
        ["diff", path, path],
    ]
    if file != "trace":
        asks += [["export", path, "-o", "out.csv"], ["window", path], ["show", path, "--study"]]
    for ask in asks:
        with pytest.raises(SystemExit) as left:
            group(ask)
        assert left.value.code in (0, None), (ask, capsys.readouterr().err)
    assert Path("out.png").stat().st_size > 1000
    assert read_attributes("out.nc")["format_version"] == 1


def test_the_table_is_that_of_version_2(name, tmp_path):
    write_results(tmp_path / "new.h5", MemoryLog.of(complete(name)))
    rows = []
    for path in (FOLDER / f"{name}.h5", tmp_path / "new.h5"):
        write_rows(table(read_results(path), peaks=True, states=True), tmp_path / "out.csv")
        rows.append(list(csv.DictReader((tmp_path / "out.csv").read_text(encoding="utf-8").splitlines())))
    assert all(new.items() >= old.items() for old, new in zip(*rows, strict=True))


def test_new_labels_in_place(name, tmp_path):
    path = tmp_path / "out.h5"
    shutil.copyfile(FOLDER / f"{name}.h5", path)
    before = read_results(path)
    reclassify(path, ["classify.stick_slip.stick_slip_index=1"])
    after = read_results(path)
    ok = before["status"] == 1
    stalled = before["stuck_fraction"] > 0.99  # which version 1 called stick-slip
    np.testing.assert_array_equal((after["response"] & 2) > 0, ok & (before["stick_slip_index"] > 1.0) & ~stalled)
    assert after.attrs["format_version"] == 1
    reclassify(path, [])
    np.testing.assert_array_equal(read_results(path)["response"], np.where(stalled, 8, before["response"]))


def test_a_replay_finds_its_point():
    """Its numbers are those of the present model, which may have changed since; that is
    said."""
    made = nsdrill.replay(FOLDER / "rock_map.h5", wob=60e3, rotary_speed=6.28, at={"bit.rock_stiffness": 1e8})
    point = read_point(FOLDER / "rock_map.h5", 0, 0, 1, 1, 2)
    assert made.attrs["wob"] == point["wob"]
    assert made.attrs["rotary_speed"] == point["rotary_speed"]
    assert json.loads(made.attrs["at"]) == {"bit.rock_stiffness": 1e8}


@pytest.fixture
def present(tmp_path):
    """A copy of the map that says that the present versions made it, of which some
    points failed."""
    path = tmp_path / "out.h5"
    shutil.copyfile(FOLDER / "rock_map.h5", path)
    with h5py.File(path, "r+") as file:
        file.attrs.update({**versions(), "python_version": versions()["python"], "processor": processor()})
    return path


def test_resumed_it_is_left_as_it_is(present):
    study = nsdrill.load_study(FOLDER / "rock_map.yaml")
    before = present.read_bytes()
    outcome = run_study(study, present, resume=True, workers=1)
    assert (outcome.already, outcome.failed) == (12, 3)
    assert present.read_bytes() == before


def test_its_failed_points_run_again_into_version_2(present):
    study = nsdrill.load_study(FOLDER / "rock_map.yaml", ("simulation.max_steps=100000",))
    before = read_results(present)
    assert run_study(study, present, retry_failed=True, workers=1).failed == 0
    after = read_results(present)
    assert after.attrs["format_version"] == 2
    ok = before["status"] == 1
    assert (after["status"] == 1).all()
    for variable, values in before.variables.items():
        assert after[variable][ok].tobytes() == values[ok].tobytes(), variable
    with open_results(present) as data:  # the study that is there now names its axes so
        assert data.status.dims == ("bit_rock_stiffness", "rotary_speed", "wob")


def test_another_study_does_not_go_on_with_it(present):
    with pytest.raises(FileError, match="made from another study"):
        run_study(nsdrill.load_study(FOLDER / "starts.yaml"), present, resume=True)
