"""Trace files, exports, and Datasets without a file."""

import csv
import subprocess
import sys

import h5py
import numpy as np
import pytest
import xarray as xr
from model_tables import TRACE_VARIABLES

from nsdrill.app.saving import table, write_rows
from nsdrill.data import Trace
from nsdrill.errors import FileError
from nsdrill.store import (
    collect,
    from_dataset,
    kind_of,
    open_results,
    read_results,
    read_trace,
    to_dataset,
    to_netcdf,
    write_results,
    write_trace,
)

from .samples import POINTS, SHAPE, make_log, make_results
from .test_layout import CASES, alike, grid


def trace(samples=30):
    random = np.random.default_rng(samples)
    values = {variable.name: random.standard_normal(samples) for variable in TRACE_VARIABLES}
    attrs = {"title": "made up", "depth": 5000.0, "steps": 3, "initial_state": np.ones(9)}
    return Trace(np.arange(samples) / 7.0, values, attrs)


@pytest.mark.parametrize("samples", [1, 100, 70_000])
def test_trace_round_trip_is_bit_for_bit(path, samples):
    wanted = trace(samples)
    write_trace(path, wanted)
    found = read_trace(path)
    assert kind_of(path) == "trace"
    assert found.time.tobytes() == wanted.time.tobytes()
    for name, values in wanted.variables.items():
        assert found[name].tobytes() == values.tobytes()
    np.testing.assert_array_equal(found.attrs.pop("initial_state"), wanted.attrs.pop("initial_state"))
    assert wanted.attrs.items() <= found.attrs.items()


def test_numbers_beyond_all_measure_are_refused(path):
    made = trace(100)
    made.variables["y"][7] = 1e308
    write_trace(path, made)
    with pytest.raises(FileError, match="y has values that are no finite numbers"):
        read_trace(path)


def test_a_trace_with_a_gap_is_the_callers_fault(path):
    broken = trace(10)
    del broken.variables["wall_force"]
    with pytest.raises(ValueError, match="needs wall_force"):
        write_trace(path, broken)
    assert not path.exists()


def test_results_and_trace_are_not_mixed_up(path, tmp_path):
    write_trace(path, trace(3))
    make_results(tmp_path / "results.h5")
    with pytest.raises(FileError, match="this is a trace file; a results file is needed"):
        read_results(path)
    with pytest.raises(FileError, match="this is a results file; a trace file is needed"):
        read_trace(tmp_path / "results.h5")


def test_csv_gives_back_every_bit_and_the_flags_in_words(tmp_path):
    make_results(tmp_path / "out.h5", peaks=2)
    results = read_results(tmp_path / "out.h5")
    write_rows(table(results, peaks=True, states=True), tmp_path / "out.csv")
    with open(tmp_path / "out.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == POINTS
    assert list(rows[0])[:7] == [
        "procedure",
        "depth [m]",
        "wob [N]",
        "rotary_speed [rad s-1]",
        "status",
        "status_words",
        "response",
    ]
    words = {1: "ok", 2: "diverged", 3: "step_limit", 4: "step_underflow"}
    for place, row in zip(np.ndindex(*SHAPE), rows, strict=True):
        assert row["procedure"] == results.coords["procedure"][place[0]]
        assert float(row["depth [m]"]) == results.coords["depth"][place[1]]
        np.testing.assert_equal(float(row["axial_max [m]"]), results["axial_max"][place])
        np.testing.assert_equal(float(row["axial_peaks_1 [m]"]), results["axial_peaks"][place][1])
        np.testing.assert_equal(float(row["final_state_bit_speed [rad s-1]"]), results["final_state"][place][7])
        assert int(row["steps"]) == results["steps"][place]
        assert row["status_words"] == words[int(row["status"])]
        known = {0: "none", 1: "bit_bounce"}[int(row["response"])]
        assert row["response_words"] == (known if row["status_words"] == "ok" else "unknown")
    write_rows(table(results), tmp_path / "out.csv")
    header = (tmp_path / "out.csv").read_text().splitlines()[0]
    assert "peaks" not in header
    assert "state_" not in header


def test_netcdf_is_what_netcdf_asks_for(tmp_path):
    """A netCDF-4 file is HDF5 in which every axis of a variable is a dimension scale."""
    records = make_results(tmp_path / "out.h5", peaks=2)
    to_netcdf(tmp_path / "out.h5", tmp_path / "out.nc")
    with xr.open_dataset(tmp_path / "out.nc", engine="h5netcdf") as data:
        assert data["axial_max"].values.tobytes() == records["axial_max"].tobytes()
    with h5py.File(tmp_path / "out.nc") as file:
        for dataset in file.values():
            assert dataset.is_scale or all(len(dim) == 1 for dim in dataset.dims)


def exactly(made, read):
    """Names, order, values, types and attributes, and how xarray would write it."""
    xr.testing.assert_identical(made, read)
    assert list(made.variables) == list(read.variables)
    assert list(made.coords) == list(read.coords)
    assert dict(made.sizes) == dict(read.sizes)
    assert {name: type(value) for name, value in made.attrs.items()} == {
        name: type(value) for name, value in read.attrs.items()
    }
    for name in read.variables:
        assert made[name].dtype == read[name].dtype, name
        assert set(made[name].attrs) == set(read[name].attrs)
        for attribute, value in read[name].attrs.items():
            assert np.asarray(made[name].attrs[attribute]).dtype == np.asarray(value).dtype
            np.testing.assert_array_equal(made[name].attrs[attribute], value)
        for how in ("coordinates", "_FillValue"):
            assert str(made[name].encoding.get(how)) == str(read[name].encoding.get(how)), name


@pytest.mark.parametrize(("lengths", "named", "dims"), CASES.values(), ids=CASES)
def test_results_are_what_xarray_reads_of_their_file(path, lengths, named, dims):
    log = make_log(lengths, named, returns=3, verify=True)
    log.header["attrs"] |= {
        "gap": 0.0762,
        "refine": 1,
        "points_run": 3,
        "points_inferred": 5,
        "nothing": None,
        "border_spacing": {"depth": 1.0},
        "study_source": "\udcff.yaml",
    }
    write_results(path, log)
    with xr.open_dataset(path, engine="h5netcdf") as read:
        # which runs came after a failed one follows from the others, and is not in the file
        of_file, of_log = (
            to_dataset(one).drop_vars("not_carried", errors="ignore") for one in (read_results(path), collect(log))
        )
        exactly(of_file, read.load())
        exactly(of_log, read)
        assert read.status.dims == dims
        for data in (read, of_file):
            back = from_dataset(data)
            alike(back, read_results(path))
            assert back.attrs == read_results(path).attrs


def test_a_trace_is_what_xarray_reads_of_its_file(path):
    write_trace(path, trace())
    with xr.open_dataset(path, engine="h5netcdf") as read:
        exactly(to_dataset(trace()), read.load())
        back, there = from_dataset(read), read_trace(path)
    assert back.time.tobytes() == there.time.tobytes()
    assert all(back[name].tobytes() == values.tobytes() for name, values in there.variables.items())
    assert set(back.attrs) == set(there.attrs)
    np.testing.assert_array_equal(back.attrs["initial_state"], np.ones(9))
    assert back.attrs["steps"] == 3


def test_selections_are_results(path):
    lengths = grid(2, wob=3, rotary_speed=4, bit_rock_stiffness=2)
    write_results(path, make_log(lengths, ("rotary_speed", "wob"), returns=3, verify=True))
    whole = read_results(path)
    with open_results(path) as data:
        one = from_dataset(data.isel(wob=1).sel(procedure="up"))
        some = from_dataset(data.isel(rotary_speed=slice(1, 3)).transpose("peak", "wob", ...))
        point = from_dataset(data.isel(procedure=0, wob=0, rotary_speed=0, bit_rock_stiffness=0))
    assert one.shape == (1, 1, 1, 4, 2)
    assert one.coords["wob"].tolist() == [whole.coords["wob"][1]]
    assert one.coords["procedure"].tolist() == ["up"]
    np.testing.assert_array_equal(one["axial_peaks"], whole["axial_peaks"][1:, :, 1:2])
    np.testing.assert_array_equal(some["axial_peaks"], whole["axial_peaks"][:, :, :, 1:3])
    assert point["final_state"].shape == (1, 1, 1, 1, 1, 9)
    assert point["steps"].ravel() == whole["steps"][0, 0, 0, 0, 0]
    with xr.set_options(keep_attrs=True):
        exactly(to_dataset(one), to_dataset(from_dataset(to_dataset(one))))


def test_only_named_variables():
    data = to_dataset(collect(make_log(grid(wob=3))))
    assert set(from_dataset(data[["status", "axial_max"]]).variables) == {"status", "axial_max"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: {"depth": 1}, r"type dict; allowed: an xarray Dataset. Give one of nsdrill\.run"),
        (lambda data: data.status, "type DataArray; allowed: an xarray Dataset"),
        (lambda data: xr.Dataset(), "found no attribute nsdrill_kind"),
        (lambda data: data.assign_attrs(nsdrill_kind="poem"), "found no attribute nsdrill_kind that says"),
        (lambda data: data.assign_attrs(format_version=9), "file format 9; this nsdrill reads format 1"),
        (lambda data: data.assign_attrs(study_resolved="[1, 2]"), "study_resolved should be a JSON object"),
        (lambda data: data.assign_attrs(axes="bit_lobes"), "the axis bit_lobes is missing"),
        (lambda data: data.drop_vars("depth"), "the coordinate depth is missing"),
        (lambda data: data.drop_vars("state"), "initial_state has the dimensions wob .*, state .*; it should have"),
        (lambda data: data.isel(wob=0, drop=True), "the coordinate wob is missing"),
        (lambda data: data.assign_coords(wob=["a", "b", "c"]), "coordinate wob should have finite numbers"),
        (lambda data: data.assign_coords(wob=[1.0, 2.0, np.inf]), "coordinate wob should have finite numbers"),
        (lambda data: data.assign_coords(depth=("wob", [1.0, 2.0, 3.0])), "depth is missing or no list of values"),
        (lambda data: data.assign_coords(procedure="over"), "the procedures are over"),
        (lambda data: data.isel(state=0), "the states are x; they should be x, vx, y"),
        (lambda data: data.isel(state=slice(2)), "the states are x, vx; they should be x, vx, y"),
        (lambda data: data.isel(peak=1), r"axial_peaks has the dimensions wob \(3\); it should have wob \(3\), peak"),
        (lambda data: data.assign(status=data.status.astype(float)), "status has the type float64; .* whole numbers"),
        (lambda data: data.assign(status=data.status + 70), "status has values that mean nothing"),
        (lambda data: data.assign(axial_max=data.status), "axial_max has the type int8; it should have real numbers"),
        (lambda data: data.assign(axial_max=1.0), "axial_max has the dimensions none; it should have wob"),
        (lambda data: data.assign(axial_max=data.axial_peaks), r"wob .*, peak .*; it should have wob \(3\)\."),
        (lambda data: data.assign(axial_peaks=data.axial_max), r"dimensions wob \(3\); it should have wob \(3\), peak"),
        (lambda data: data.assign(final_state=data.final_state.rename(state="other")), "should have wob .*, state"),
    ],
)
def test_what_is_no_dataset_of_nsdrill_is_refused_in_words(change, words):
    data = to_dataset(collect(make_log(grid(wob=3))))
    with pytest.raises(FileError, match=words):
        from_dataset(change(data))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: data.isel(time=slice(None, None, -1)), "time does not ascend"),
        (lambda data: data.drop_vars("y"), "the variable y is missing"),
        (lambda data: data.assign(y=data.y + 1e200), "y has values that are no finite numbers"),
        (lambda data: data.drop_vars("time"), "the coordinate time is missing"),
    ],
)
def test_what_is_no_trace_is_refused_in_words(change, words):
    with pytest.raises(FileError, match=words):
        from_dataset(change(to_dataset(trace())))


def test_numbers_that_can_no_longer_be_read(path):
    write_results(path, make_log(grid(wob=3)))
    data = open_results(path)
    data.close()
    path.write_bytes(b"gone")
    with pytest.raises(FileError, match="the Dataset: cannot be read"):
        from_dataset(data)


def test_xarray_comes_when_it_is_needed():
    """It takes half a second; the command line needs none of it."""
    code = "import sys, nsdrill.store; print('xarray' in sys.modules, 'pandas' in sys.modules)"
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert child.stdout.split() == ["False", "False"]
