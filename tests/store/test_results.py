"""The results file: bit for bit, as the contract names it, as xarray sees it, small,
and in bounded memory."""

import math
import os
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from nsdrill.analysis.knowledge import KNOWLEDGE
from nsdrill.errors import NsdrillError
from nsdrill.models.christoforou_yigit.columns import STATE_NAMES
from nsdrill.models.contents import Contents
from nsdrill.store import (
    MemoryLog,
    RunLog,
    kind_of,
    log_from_results,
    open_results,
    read_attributes,
    read_results,
    rewrite_labels,
    write_results,
)
from nsdrill.store.results import block_shape, blocks
from nsdrill.variables import COORDINATES, POINT

from .samples import POINTS, SHAPE, header, made, make_results


@pytest.mark.parametrize("peaks", [0, 1, 32])
@pytest.mark.parametrize("shape", [(1, 1, 1, 1), SHAPE, (3, 700, 1, 2)])
def test_round_trip_is_bit_for_bit(path, shape, peaks):
    records = make_results(path, shape, peaks)
    results = read_results(path)
    assert list(results.variables) == list(records.dtype.names)
    for name in records.dtype.names:
        assert results[name].dtype == records.dtype[name].base
        assert results[name].tobytes() == records[name].tobytes()
        assert results[name].shape == (*shape, *records[name].shape[1:])
    for name, values in header(shape)["coords"].items():
        np.testing.assert_array_equal(results.coords[name], values)
    assert tuple(results.coords["state"]) == STATE_NAMES
    assert results.attrs["title"] == "made up"
    assert results.attrs["format_version"] == 1
    assert results.attrs["model"] == "christoforou_yigit"
    assert kind_of(path) == "results"


def test_xarray_opens_it_as_it_is(path):
    records = make_results(path, peaks=3)
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert dict(data.sizes) == dict(zip((*POINT, "peak", "state"), (*SHAPE, 3, 9), strict=True))
        assert list(data.coords) == [*POINT, "peak", "state"]
        assert list(data.data_vars) == [*(variable.name for variable in Contents(3).variables), KNOWLEDGE.name]
        for variable in Contents(3).variables:
            seen = data[variable.name]
            assert seen.dims == variable.dims
            assert seen.dtype == np.dtype(variable.dtype)
            assert seen.attrs.get("units", "") == variable.units
            assert seen.attrs["long_name"] == variable.long_name
            for flags in ("flag_values", "flag_masks"):
                if getattr(variable, flags):
                    assert tuple(seen.attrs[flags]) == getattr(variable, flags)
                    assert seen.attrs[flags].dtype == np.dtype(variable.dtype)
            assert seen.attrs.get("flag_meanings") == variable.flag_meanings
            assert seen.values.tobytes() == records[variable.name].tobytes()
        for name in ("depth", "wob", "rotary_speed"):
            assert data[name].attrs["units"] == COORDINATES[name][0]
        up = data.sel(procedure="up", state="bit_speed").isel(depth=1, wob=2, rotary_speed=3)
        stored = read_results(path)["final_state"][1, 1, 2, 3, STATE_NAMES.index("bit_speed")]
        np.testing.assert_array_equal(float(up.final_state), stored)
        assert data.attrs["Conventions"] == "nsdrill-1"
    with open_results(path) as data:
        assert isinstance(data, xr.Dataset)


def test_types_are_those_that_every_reader_knows(path):
    make_results(path, resumed=True, versions={"numpy": "2"}, nothing=None)
    with h5py.File(path) as file:
        for thing in (file, *file.values()):
            for name, value in thing.attrs.items():
                if name not in ("DIMENSION_LIST", "REFERENCE_LIST"):
                    assert np.asarray(value).dtype.kind in "iufUSO"
                    assert isinstance(value, str) or np.asarray(value).dtype.kind in "iufS"
        for name, dataset in file.items():
            assert dataset.dtype.kind in "if" or h5py.check_string_dtype(dataset.dtype), name
        assert file.attrs["resumed"] == 1
        assert file.attrs["versions"] == '{"numpy": "2"}'
        assert "nothing" not in file.attrs


@pytest.mark.parametrize("size", [70_000, 200_000])
def test_long_texts_fit(path, size):
    """64 KiB is where attributes in HDF5's oldest layout end."""
    text = "ä" * (size // 2)
    make_results(path, (1, 1, 1, 1), 0, study=text)
    assert read_attributes(path)["study"] == text
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert data.attrs["study"] == text


def test_text_that_hdf5_does_not_take_costs_no_points(path):
    records = make_results(path, (1, 1, 1, 1), 0, title="a\0b", study_source="\udcff.yaml")
    assert read_attributes(path)["title"] == "a\\x00b"
    assert read_attributes(path)["study_source"] == "\\xff.yaml"
    assert read_results(path)["steps"].ravel() == records["steps"]


def test_the_file_is_hardly_larger_than_its_numbers(path):
    """The limits are the design's: 1.2 times the numbers, and no megabytes for a
    handful of points."""
    records = make_results(path, (1, 300, 1, 1), 32)
    assert os.path.getsize(path) < 1.2 * records.nbytes
    make_results(path, (1, 4, 1, 1), 32)
    assert os.path.getsize(path) < 64_000


def test_pending_points_are_marked(path):
    log = MemoryLog(header(), POINTS, Contents(0))
    log.write([0], made(1, 0))
    write_results(path, log)
    results = read_results(path)
    assert np.count_nonzero(results["status"]) == 1
    assert np.isnan(results["axial_max"].ravel()[1:]).all()


def test_only_named_variables_are_read(path):
    make_results(path)
    assert set(read_results(path, ["status", "axial_max"]).variables) == {"status", "axial_max"}


def test_a_finished_file_becomes_a_log_again(path, tmp_path):
    log = MemoryLog(header(), POINTS, Contents(2))
    log.write(np.arange(0, POINTS, 2), made(POINTS // 2, 2))
    write_results(path, log)
    with log_from_results(path, tmp_path / "out.h5.part") as again:
        assert again.read(0, POINTS).tobytes() == log.read(0, POINTS).tobytes()
        assert again.header["attrs"]["title"] == "made up"
        again.clear([0])
    with RunLog.open(tmp_path / "out.h5.part") as again:
        assert np.flatnonzero(again.done()).tolist() == list(range(2, POINTS, 2))
        write_results(tmp_path / "again.h5", again)
    assert read_attributes(tmp_path / "again.h5") == read_attributes(path)


def test_new_labels_leave_everything_else_alone(path):
    records = make_results(path, (1, 2000, 1, 1), 2, history="made")
    os.chmod(path, 0o640)
    with h5py.File(path, "r+") as file:
        # a variable of the user's own; and the seal of the file goes with the edit
        file["mine"] = [1, 2]
    new = np.arange(2000).reshape(1, 2000, 1, 1) % 5
    rewrite_labels(path, {"whirl_kind": new, "settled": new % 2}, "classified again", {"study_resolved": "{}"})
    results = read_results(path)
    np.testing.assert_array_equal(results["whirl_kind"], new)
    for name in records.dtype.names:
        if name not in ("whirl_kind", "settled"):
            assert results[name].tobytes() == records[name].tobytes()
    assert results.attrs["history"] == "made\nclassified again"
    assert results.attrs["study_resolved"] == "{}"
    with h5py.File(path) as file:
        assert file["mine"][()].tolist() == [1, 2]
    assert os.stat(path).st_mode & 0o777 == 0o640


def test_new_labels_must_be_labels_on_the_grid(path):
    make_results(path)
    before = path.read_bytes()
    with pytest.raises(ValueError, match="not labels: axial_max"):
        rewrite_labels(path, {"axial_max": np.zeros(SHAPE)}, "no")
    with pytest.raises(ValueError, match="has shape"):
        rewrite_labels(path, {"settled": np.zeros(3)}, "no")
    assert path.read_bytes() == before


def test_a_failure_leaves_the_old_file_and_no_rubbish(path):
    make_results(path)
    before = path.read_bytes()

    class Broken(MemoryLog):
        def read(self, start, stop):
            raise OSError(28, "No space left on device")

    with pytest.raises(NsdrillError, match=r"no space left on device. Nothing was changed") as caught:
        write_results(path, Broken(header(), POINTS, Contents()))
    assert caught.value.exit_code == 1
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == ["out.h5"]


def test_a_full_disk_while_the_results_are_made(path):
    """A limit on the size of files stands for the full disk; HDF5 meets it anywhere,
    also while it closes."""
    code = """
import resource, signal, sys
sys.path.insert(0, sys.argv[2])
from store.samples import make_results
from nsdrill.errors import NsdrillError
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
for limit in (100, 5_000, 30_000, 100_000, 200_000):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    try:
        make_results(sys.argv[1], (1, 300, 1, 1), 32)
        print("made")
    except NsdrillError as error:
        print("refused")
"""
    tests = Path(__file__).parents[1]
    child = subprocess.run([sys.executable, "-c", code, path, tests], capture_output=True, text=True, check=False)
    assert child.stdout.split() == ["refused"] * 5, child.stderr
    assert child.returncode == 0, child.stderr
    assert os.listdir(path.parent) == []


def test_a_link_stays_a_link(path, tmp_path):
    (tmp_path / "disk").mkdir()
    path.symlink_to(tmp_path / "disk" / "real.h5")
    make_results(path)
    assert path.is_symlink()
    assert read_results(path).shape == SHAPE


@pytest.mark.parametrize("shape", [(1, 1, 1, 1), (3, 7, 5, 11), (1, 10_000, 1, 1), (2, 1, 900, 13), (1, 3, 2, 9000)])
@pytest.mark.parametrize("points", [1, 10, 4096])
def test_blocks_are_ranges_of_point_numbers(shape, points):
    block = block_shape(shape, points)
    assert math.prod(block) <= points
    if math.prod(shape) > 30_000 and points == 1:
        return  # too many to walk through
    numbers = np.arange(math.prod(shape)).reshape(shape)
    end = 0
    for place, start, stop in blocks(shape, block):
        assert start == end
        np.testing.assert_array_equal(numbers[place].ravel(), np.arange(start, stop))
        end = stop
    assert end == numbers.size


def test_a_million_points_need_little_memory(tmp_path):
    """Log and results of 10^6 points; the bound is far below the 300 MB that the points
    fill."""
    code = """
import resource, sys
import h5py, numpy as np
sys.path.insert(0, sys.argv[2])
from store.samples import header, made
from nsdrill.store import RunLog, write_results
from nsdrill.models.contents import Contents
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024  # KiB on Linux
records = made(10_000, 0)
log = RunLog.create(sys.argv[1] + ".part", header((1, 1000, 10, 100)), 10**6, Contents(0))
before = peak()
for start in range(0, 10**6, 100_000):
    log.write(np.arange(start, start + 10_000), records)
log.close()
log = RunLog.open(sys.argv[1] + ".part")
assert np.count_nonzero(log.done()) == 10**5
write_results(sys.argv[1], log)
print(peak() - before)
"""
    tests = Path(__file__).parents[1]
    command = [sys.executable, "-c", code, tmp_path / "out.h5", tests]
    child = subprocess.run(command, capture_output=True, text=True, check=False)
    assert child.returncode == 0, child.stderr
    assert float(child.stdout) < 60  # MiB: blocks of 4 MiB in several copies, and one byte a point
