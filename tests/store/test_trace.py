"""Trace files and exports."""

import csv

import h5py
import numpy as np
import pytest
import xarray as xr
from model_tables import TRACE_VARIABLES

from nsdrill.app.saving import table, write_rows
from nsdrill.data import Trace
from nsdrill.errors import FileError
from nsdrill.store import kind_of, read_results, read_trace, to_netcdf, write_trace

from .samples import POINTS, SHAPE, make_results


@pytest.fixture
def path(tmp_path):
    return tmp_path / "trace.h5"


def trace(samples):
    random = np.random.default_rng(samples)
    values = {variable.name: random.standard_normal(samples) for variable in TRACE_VARIABLES}
    return Trace(np.arange(samples) / 7.0, values, {"title": "made up", "depth": 5000.0, "seed": 3})


@pytest.mark.parametrize("samples", [1, 100, 70_000])
def test_trace_round_trip_is_bit_for_bit(path, samples):
    wanted = trace(samples)
    write_trace(path, wanted)
    found = read_trace(path)
    assert kind_of(path) == "trace"
    assert found.time.tobytes() == wanted.time.tobytes()
    for name, values in wanted.variables.items():
        assert found[name].tobytes() == values.tobytes()
    assert wanted.attrs.items() <= found.attrs.items()


def test_xarray_sees_the_trace_with_time_in_seconds(path):
    write_trace(path, trace(100))
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert list(data.data_vars) == [variable.name for variable in TRACE_VARIABLES]
        assert data.time.dtype == np.float64  # and no date made of it
        assert data.time.attrs["units"] == "s"


def test_numbers_beyond_all_measure_are_refused(path):
    made = trace(100)
    made.variables["y"][7] = 1e308
    write_trace(path, made)
    with pytest.raises(FileError, match="y has values that are no finite numbers"):
        read_trace(path)


def test_a_trace_of_an_earlier_version_has_its_operating_point(path, monkeypatch):
    """It held no operating values over time, as they were constant: they are its
    attributes."""
    wanted = trace(20)
    wanted.attrs |= {"depth": 5000.0, "wob": 22240.0, "rotary_speed": 3.0}
    before = tuple(v for v in TRACE_VARIABLES if v.name not in ("depth", "wob", "drive_speed"))
    monkeypatch.setattr("nsdrill.store.results.trace_variables", lambda trace: before)
    write_trace(path, wanted)
    monkeypatch.undo()
    found = read_trace(path)
    assert list(found["drive_speed"]) == [3.0] * 20
    assert list(found["wob"]) == [22240.0] * 20
    assert list(found["depth"]) == [5000.0] * 20


def test_a_trace_with_a_gap_is_the_callers_fault(path):
    broken = trace(10)
    del broken.variables["wall_force"]
    with pytest.raises(ValueError, match="needs wall_force"):
        write_trace(path, broken)
    assert not path.exists()


def test_results_and_trace_are_not_mixed_up(path, tmp_path):
    write_trace(path, trace(3))
    make_results(tmp_path / "out.h5")
    with pytest.raises(FileError, match="this is a trace file; a results file is needed"):
        read_results(path)
    with pytest.raises(FileError, match="this is a results file; a trace file is needed"):
        read_trace(tmp_path / "out.h5")


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
