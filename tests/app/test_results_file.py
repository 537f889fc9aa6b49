"""The results file as others see it: by xarray and by h5py, against the table of the
contract."""

import hashlib
import json
from importlib import metadata

import h5py
import numpy as np
import pytest
import xarray

import nsdrill
from nsdrill.app.running.run import run_study
from nsdrill.app.simulating.trajectory import replay
from nsdrill.study import parse_study

# name -> units; the names that scripts of users rely on.
UNITS = {
    "1": "status response whirl_kind settled stuck_fraction lift_off_fraction wall_contact_fraction whirl_ratio steps "
    "rejected",
    "rad s-1": "bit_speed_min bit_speed_max bit_speed_mean",
    "percent": "stick_slip_index",
    "m": "axial_min axial_max radius_max radius_mean",
    "N": "bit_force_max wall_force_max",
    "N m": "bit_torque_max surface_torque_min surface_torque_max surface_torque_mean",
    "m s-2": "lateral_acceleration_rms axial_acceleration_rms",
}
POINTS = {name: units for units, names in UNITS.items() for name in names.split()}
PEAKS = {"axial_peaks": "m", "bit_speed_peaks": "rad s-1", "radius_peaks": "m"}
STATES = ["x", "vx", "y", "vy", "z", "vz", "twist", "bit_speed", "drive_angle"]
STATE_UNITS = dict(zip(STATES, [*("m", "m s-1") * 3, "rad", "rad s-1", "rad"], strict=True))
AXES = {"depth": "m", "wob": "N", "rotary_speed": "rad s-1"}
GRID = {
    "small": ("procedure", "rotary_speed"),
    "map": ("wob", "rotary_speed"),
    "failing": ("procedure", "rotary_speed"),
}  # what varies


@pytest.fixture(params=list(GRID))
def name(request):
    return str(request.param)


@pytest.fixture
def data(name, shared):
    with xarray.open_dataset(shared / f"{name}.h5", engine="h5netcdf") as opened:
        yield opened


def test_variables_units_and_names(data, name):
    grid = GRID[name]
    for name, units in POINTS.items():
        assert data[name].dims == grid, name
        assert data[name].attrs["units"] == units, name
        assert data[name].attrs["long_name"], name
    for name, units in PEAKS.items():
        assert data[name].dims == (*grid, "peak")
        assert data[name].attrs["units"] == units
    for name in ("initial_state", "final_state"):
        assert data[name].dims == (*grid, "state")
        # One unit for all nine would be wrong.
        assert "units" not in data[name].attrs
        assert dict(zip(STATES, data[name].attrs["state_units"].split(", "), strict=True)) == STATE_UNITS


def test_coordinates(data, name):
    assert {axis: data[axis].attrs["units"] for axis in AXES} == AXES
    assert {axis: data[axis].attrs["key"] for axis in AXES} == {axis: f"operation.{axis}" for axis in AXES}
    assert set(data.coords) == {"procedure", *AXES, "peak", "state"}
    assert [str(name) for name in data["state"].values] == STATES
    procedures = ["same"] if name == "map" else ["up", "down"]
    assert np.atleast_1d(data["procedure"].values).tolist() == procedures
    for axis in AXES:
        assert data[axis].dims == ((axis,) if axis in GRID[name] else ())
        assert (np.diff(np.atleast_1d(data[axis].values)) > 0).all()
        assert data[axis].attrs["long_name"]
    assert data.sizes["peak"] == 4


def test_values_of_the_axes(shared):
    with xarray.open_dataset(shared / "map.h5", engine="h5netcdf") as data:
        assert data["wob"].values.tolist() == [20e3, 40e3, 60e3, 80e3, 100e3]
        # The list of the study is 60, 30, 45, 75 rpm: ascending in the file, in rad/s.
        assert np.allclose(data["rotary_speed"].values, np.array([30, 45, 60, 75]) * np.pi / 30, rtol=1e-15)
        assert float(data["depth"]) == 2000.0


def test_flags(data):
    status, response, kind = data["status"].attrs, data["response"].attrs, data["whirl_kind"].attrs
    assert list(status["flag_values"][:4]) == [0, 1, 2, 3]
    assert status["flag_meanings"].split()[:4] == ["pending", "ok", "diverged", "step_limit"]
    assert list(response["flag_masks"]) == [1, 2, 4, 8]
    assert response["flag_meanings"] == "bit_bounce stick_slip whirl stalled"
    assert list(kind["flag_values"]) == [0, 1, 2, 3, 4, 5]
    assert kind["flag_meanings"] == "none forward backward backward_rolling irregular low_side"
    assert data["status"].dtype.kind == "i"


def test_values_are_consistent(data):
    ok = data["status"].values == 1
    v = {name: data[name].values[ok] for name in POINTS}
    for name in ("stuck_fraction", "lift_off_fraction", "wall_contact_fraction"):
        assert ((v[name] >= 0) & (v[name] <= 1 + 1e-12)).all()
    assert (v["bit_speed_min"] <= v["bit_speed_mean"]).all()
    assert (v["bit_speed_mean"] <= v["bit_speed_max"]).all()
    assert np.allclose(
        v["stick_slip_index"], 100 * (v["bit_speed_max"] - v["bit_speed_min"]) / (2 * v["bit_speed_mean"]), rtol=1e-9
    )
    stalled = v["stuck_fraction"] > 0.99
    assert np.array_equal((v["response"] & 1) > 0, (v["lift_off_fraction"] > 0.01) & ~stalled)
    assert np.array_equal((v["response"] & 2) > 0, (v["stick_slip_index"] > 80) & ~stalled)
    assert np.array_equal((v["response"] & 4) > 0, (v["wall_contact_fraction"] > 0.01) & ~stalled)
    assert np.array_equal(v["response"] == 8, stalled)
    assert np.array_equal(v["whirl_kind"] > 0, (v["response"] & 4) > 0)
    # the gap of the default well
    assert ((v["wall_force_max"] > 0) == (v["radius_max"] > 0.0762)).all()
    for name in ("axial", "bit_speed", "radius"):
        peaks = data[f"{name}_peaks"].values[ok]
        high = data[f"{name}_max"].values[ok][..., np.newaxis]
        assert not (peaks > high + 1e-9 * np.abs(high)).any(), name
    assert (data["steps"].values > 0).all()
    assert np.isfinite(data["final_state"].values).all()


def test_failed_points_have_no_features_but_their_end(shared):
    with xarray.open_dataset(shared / "failing.h5", engine="h5netcdf") as data:
        failed = data["status"].values == 3
        assert failed.any()
        assert np.isnan(data["bit_speed_max"].values[failed]).all()
        assert (data["response"].values[failed] == 0).all()
        assert (data["steps"].values[failed] + data["rejected"].values[failed] >= 1000).all()


def test_root_attributes(shared):
    import numpy

    with xarray.open_dataset(shared / "small.h5", engine="h5netcdf") as data:
        attrs = data.attrs
    assert attrs["title"] == "Small"
    assert attrs["study"] == (shared / "small.yaml").read_text()
    assert attrs["nsdrill_version"] == nsdrill.__version__
    assert attrs["numpy_version"] == numpy.__version__
    assert attrs["h5py_version"] == h5py.__version__
    assert attrs["numba_version"] == metadata.version("numba")  # installed; what compiled is said beside it
    assert attrs["compiler"] == "native"
    assert attrs["processor"]
    # No claim of CF: the coordinates procedure and state are text, and depth is
    # measured along the hole.
    assert attrs["Conventions"] == "nsdrill-1"
    assert attrs["format_version"] == 1
    assert attrs["model"] == "christoforou_yigit"
    assert attrs["created"][:2] == "20"
    assert attrs["history"].endswith(" run")


def test_study_digest_is_of_the_resolved_study(shared):
    """What changes no number changes no digest: comments, the title, the order of keys,
    another unit for one value."""
    study = nsdrill.load_study(shared / "small.yaml")
    text = (shared / "small.yaml").read_text()
    same = "# A comment\n" + text.replace("Small", "Another").replace("2000 m,", "2 km,")
    assert parse_study(same).sha256 == study.sha256
    assert parse_study(text.replace("22.24", "22.25")).sha256 != study.sha256
    with h5py.File(shared / "small.h5") as file:
        attrs = dict(file.attrs)
    assert attrs["study_sha256"] == study.sha256
    parts = {
        name: value for name, value in json.loads(attrs["study_resolved"]).items() if name not in ("title", "units")
    }
    del parts["operation"]["rotary_speed"]  # swept
    line = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    assert hashlib.sha256(line.encode()).hexdigest() == study.sha256


def test_overrides_are_on_record(shared, tmp_path):
    changes = ("operation.wob=30 kN", "title=Changed")
    study = nsdrill.load_study(shared / "small.yaml", changes)
    run_study(study, tmp_path / "out.h5")
    with h5py.File(tmp_path / "out.h5") as file:
        assert json.loads(file.attrs["study_overrides"]) == list(changes)
        assert file.attrs["study"] == (shared / "small.yaml").read_text()
        assert json.loads(file.attrs["study_resolved"])["operation"]["wob"] == 30e3
        assert file.attrs["title"] == "Changed"
        assert file["wob"][()] == 30e3


def test_trace_file(shared, tmp_path):
    from nsdrill.store import write_trace

    write_trace(tmp_path / "trace.h5", replay(shared / "map.h5", wob=40e3, rotary_speed=6.0).trace)
    with xarray.open_dataset(tmp_path / "trace.h5", engine="h5netcdf") as data:
        forces = ("bit_force", "bit_torque", "wall_force")
        for name in (*STATES, "radius", "whirl_angle", *forces):
            assert data[name].dims == ("time",)
            assert data[name].attrs["units"]
        assert data["time"].attrs["units"] == "s"
        assert np.allclose(data["radius"], np.hypot(data["x"], data["y"]), rtol=1e-12)
        assert data.attrs["study_sha256"] == nsdrill.load_study(shared / "map.yaml").sha256


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("wob", [30e3], "found other values of wob than in its study"),
        ("procedure", "up", "found procedure up and down, of up in its study"),
        ("rotary_speed", {"from": 1.0, "to": 8.0, "points": 10**12}, "at most 10000000"),
        ("rotary_speed", {"from": 1.0, "to": 1e300, "points": 8}, "at most 1000 rad/s"),
        ("procedure", "over", "found over along"),
    ],
)
def test_a_study_that_is_not_that_of_the_points(shared, tmp_path, key, value, words):
    """Labels and replays are made from the study in the file, so it must be the one
    that the points were run with."""
    from nsdrill.app.answering.summary import reclassify

    path = tmp_path / "out.h5"
    path.write_bytes((shared / "small.h5").read_bytes())
    with h5py.File(path, "r+") as file:
        resolved = json.loads(file.attrs["study_resolved"])
        resolved["sweep"][key] = value
        file.attrs["study_resolved"] = json.dumps(resolved)
    for ask in (lambda: reclassify(path, []), lambda: replay(path, rotary_speed=3.0, procedure="up")):
        with pytest.raises(nsdrill.FileError, match=words):
            ask()


def test_the_window_by_severity_of_a_file_without_severities(shared, tmp_path):
    """The first files have the severity of stick-slip only."""
    path = tmp_path / "out.h5"
    path.write_bytes((shared / "map.h5").read_bytes())
    with h5py.File(path, "r+") as file:
        del file["bounce_severity"], file["whirl_severity"]
    assert nsdrill.window(path)["maps"]
    with pytest.raises(nsdrill.FileError, match="found no bounce_severity and no whirl_severity"):
        nsdrill.window(path, severity=1)
