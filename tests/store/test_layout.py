"""A dimension of a file is what varies: its order, what is left out, and that memory
never notices."""

import math

import h5py
import numpy as np
import pytest
import xarray as xr

from nsdrill.analysis.knowledge import KNOWLEDGE
from nsdrill.app.saving import table, write_rows
from nsdrill.errors import FileError, FileWarning
from nsdrill.models.registry import BY_NAME
from nsdrill.store import (
    MemoryLog,
    collect,
    log_from_results,
    open_results,
    read_point,
    read_results,
    rewrite_labels,
    write_results,
)
from nsdrill.store.layout import file_order, to_file, to_memory

from .samples import make_log


def grid(procedure=1, depth=1, wob=1, rotary_speed=1, **more):
    return {"procedure": procedure, "depth": depth, "wob": wob, "rotary_speed": rotary_speed, **more}


# What a study sweeps, in its words; the dimensions that the file must have.
CASES = {
    "nothing": (grid(), (), ()),
    "one value": (grid(mud_drag=1, start=1), ("mud.drag", "wob"), ()),
    "one axis": (grid(depth=5), ("depth",), ("depth",)),
    "up and down": (grid(2, rotary_speed=3), ("rotary_speed",), ("procedure", "rotary_speed")),
    "as the study says": (grid(depth=2, rotary_speed=3), ("rotary_speed", "depth"), ("rotary_speed", "depth")),
    "no study": (grid(depth=2, rotary_speed=3), (), ("depth", "rotary_speed")),
    "further first": (
        grid(2, wob=3, bit_rock_stiffness=4, mud_drag=1),
        ("bit.rock_stiffness", "mud.drag", "wob"),
        ("procedure", "bit_rock_stiffness", "wob"),
    ),
    "all of them": (
        grid(2, 2, 3, 2, bit_rock_stiffness=2, mud_drag=3, start=2),
        ("mud.drag", "rotary_speed", "bit.rock_stiffness", "wob", "depth"),
        ("procedure", "mud_drag", "rotary_speed", "bit_rock_stiffness", "wob", "depth", "start"),
    ),
    "starts": (grid(start=4), (), ("start",)),
    "starts and axes": (
        grid(wob=2, bit_rock_stiffness=3, start=2),
        ("bit.rock_stiffness", "wob"),
        ("bit_rock_stiffness", "wob", "start"),
    ),
}


IN_FILES = {**BY_NAME, KNOWLEDGE.name: KNOWLEDGE}


@pytest.fixture(params=CASES.values(), ids=CASES)
def case(request, path):
    """(log, lengths of the grid, dimensions of the file), and the file."""
    lengths, named, dims = request.param
    log = make_log(lengths, named, returns=3, verify=True)
    write_results(path, log)
    return log, lengths, dims


def alike(a, b):
    assert list(a.coords) == list(b.coords)
    assert list(a.variables) == list(b.variables)
    assert a.more == b.more
    for name in (*a.coords, *a.variables):
        assert a[name].dtype == b[name].dtype, name
        assert a[name].shape == b[name].shape, name
        assert a[name].tobytes() == b[name].tobytes(), name


def test_memory_does_not_notice(case, path):
    log, lengths, _ = case
    results = read_results(path)
    alike(results, collect(log))
    assert results.shape == tuple(lengths.values())
    assert all(values.flags.c_contiguous for values in results.variables.values())


def test_a_dimension_is_what_varies(case, path):
    log, lengths, dims = case
    there = collect(log)
    with xr.open_dataset(path, engine="h5netcdf") as data:
        assert set(data.coords) == {*lengths, "peak", "crossing", "state"}
        assert tuple(data.sizes) == (*dims, "peak", "crossing", "state")
        for name in data.data_vars:
            assert data[name].dims == (*dims, *IN_FILES[name].dims[4:]), name
        for name in lengths:
            assert data[name].dims == ((name,) if name in dims else ())
            assert np.atleast_1d(data[name].values).tolist() == list(there.coords[name])
        keys = {name: data[name].attrs.get("key") for name in lengths}
        # Every number of every point is where its coordinates say.
        for place in np.ndindex(*there.shape):
            at = {name: there.coords[name][i] for name, i in zip(lengths, place, strict=True) if name in dims}
            point = data[["steps", "final_state"]].sel(at)
            assert point.steps == there["steps"][place]
            np.testing.assert_array_equal(point.final_state.values, there["final_state"][place])
    assert keys == {
        name: {
            "depth": "operation.depth",
            "wob": "operation.wob",
            "rotary_speed": "operation.rotary_speed",
            "bit_rock_stiffness": "bit.rock_stiffness",
            "mud_drag": "mud.drag",
        }.get(name)
        for name in lengths
    }


def test_the_file_is_netcdf(case, path):
    """Every axis of a variable is a dimension scale, and what has no axis is none."""
    with h5py.File(path) as file:
        for dataset in file.values():
            assert dataset.is_scale or all(len(dim) == 1 for dim in dataset.dims)
            assert not dataset.is_scale or dataset.ndim == 1
        scalars = {name for name, dataset in file.items() if dataset.ndim == 0 and name not in IN_FILES}
        assert set(file["status"].attrs.get("coordinates", "").split()) == scalars


def test_single_points(case, path):
    log, lengths, _ = case
    there = collect(log)
    for place in [tuple(0 for _ in lengths), tuple(n - 1 for n in lengths.values())]:
        point = read_point(path, *place)
        assert {name: point[name] for name in lengths} == {
            name: there.coords[name][i] for name, i in zip(lengths, place, strict=True)
        }
        for name, values in there.variables.items():
            assert np.asarray(point[name]).tobytes() == values[place].tobytes(), name


def test_a_log_and_a_file_again(case, path, tmp_path):
    log, _, dims = case
    with log_from_results(path, tmp_path / "again.part") as again:
        assert again.read(0, again.n_points).tobytes() == log.read(0, log.n_points).tobytes()
        write_results(tmp_path / "again.h5", again)
    write_results(tmp_path / "held.h5", MemoryLog.of(read_results(path)))
    for name in ("again", "held"):
        alike(read_results(tmp_path / f"{name}.h5"), read_results(path))
        with open_results(tmp_path / f"{name}.h5") as data:
            assert data.status.dims == dims


def test_labels_are_put_where_their_points_are(case, path):
    log, _, _ = case
    before = read_results(path)
    new = np.arange(log.n_points).reshape(before.shape) % 5
    rewrite_labels(path, {"whirl_kind": new}, "again")
    after = read_results(path)
    np.testing.assert_array_equal(after["whirl_kind"], new)
    assert all(
        after[name].tobytes() == values.tobytes() for name, values in before.variables.items() if name != "whirl_kind"
    )


def test_a_table_has_a_row_for_each_point(case, path, tmp_path):
    log, lengths, _ = case
    write_rows(table(read_results(path)), tmp_path / "out.csv")
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert len(lines) == 1 + log.n_points
    assert [head.partition(" ")[0] for head in lines[0].split(",")[: len(lengths)]] == list(lengths)


def test_large_files_of_any_order_are_written_in_chunks_that_are_whole(path):
    """A block of points is one chunk, whatever the order of the axes: each is
    compressed once."""
    log = make_log(grid(wob=40, rotary_speed=50, bit_rock_stiffness=3), ("rotary_speed", "bit.rock_stiffness", "wob"))
    write_results(path, log)
    alike(read_results(path), collect(log))
    with h5py.File(path) as file:
        assert file["axial_max"].shape == (50, 3, 40)
        blocks = [-(-n // size) for n, size in zip((50, 3, 40), file["axial_max"].chunks, strict=True)]
        assert math.prod(blocks) == file["axial_max"].id.get_num_chunks()


def test_a_file_that_xarray_wrote_is_read(path, tmp_path):
    log = make_log(grid(2, depth=3, wob=3), ("wob", "depth"), returns=3, verify=True)
    write_results(path, log)
    with open_results(path) as data:
        data.to_netcdf(tmp_path / "same.nc", engine="h5netcdf")
        data.sel(procedure="up").isel(wob=slice(1, None)).to_netcdf(tmp_path / "part.nc", engine="h5netcdf")
    alike(read_results(tmp_path / "same.nc"), collect(log))
    part = read_results(tmp_path / "part.nc")
    assert part.coords["procedure"].tolist() == ["up"]
    np.testing.assert_array_equal(part["final_state"], collect(log)["final_state"][1:, :, 1:])
    for number, order in enumerate((("depth", ...), ("peak", "crossing", ...))):
        with open_results(path) as data:
            data.transpose(*order).to_netcdf(tmp_path / f"other{number}.nc", engine="h5netcdf")
        alike(read_results(tmp_path / f"other{number}.nc"), collect(log))


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda file: file.attrs.__setitem__("dimensions", 5), "dimensions should be text"),
        (lambda file: file.move("wob", "weight"), "the coordinate wob is missing"),
        (lambda file: scalar(file, "wob", 2e4), r"has the dimensions wob .*, depth .*; it should have depth"),
        (lambda file: scalar(file, "state", 1.0), "the states are 1.0; they should be"),
        (lambda file: scalar(file, "peak", 0), r"axial_peaks has the dimensions .* it should have .* peak \(1\)"),
        (lambda file: scalar(file, "procedure", np.nan), "the procedures are nan"),
        (lambda file: scalar(file, "rotary_speed", np.nan), "rotary_speed should have finite numbers"),
        (lambda file: file.attrs.__setitem__("model", 1), "model should be text"),
    ],
)
def test_edited_files_are_refused_in_words(path, edit, words):
    write_results(path, make_log(grid(depth=3, wob=3), ("wob", "depth")))
    with h5py.File(path, "r+") as file:
        edit(file)
    with pytest.raises(FileError, match=words):
        read_results(path)


def test_numbers_that_another_program_changed_are_told_of(path, recwarn):
    """What is whole otherwise is read; its seal went with the edit."""
    write_results(path, make_log(grid(depth=3, wob=3), ("wob", "depth")))
    read_results(path)
    assert not recwarn.list
    with h5py.File(path, "r+") as file:
        file["response"][...] = 0
    with pytest.warns(FileWarning, match="NOT SEALED: another program wrote or changed this file"):
        assert not read_results(path)["response"].any()


def scalar(file, name, value):
    del file[name]
    file[name] = value


def test_a_part_of_results_is_no_file(path):
    write_results(path, make_log(grid(wob=3)))
    with pytest.raises(FileError, match=r"a part of a file only: .*axial_max"):
        MemoryLog.of(read_results(path, ["status", "axial_min"]))


@pytest.mark.parametrize("text", ["", "[", "5", '{"sweep": 5}', '{"sweep": {"mud.drag": 1, "nothing": 2}}'])
def test_a_study_that_names_no_axis_leaves_them_as_they_are(text):
    lengths = grid(2, wob=3, depth=4)
    assert file_order(lengths, {"study_resolved": text}) == ("procedure", "depth", "wob")


def test_there_and_back():
    values = np.arange(24).reshape(3, 1, 4, 2)
    there = to_file(values, ("a", "b", "c"), ("c", "a"))
    assert there.shape == (4, 3, 2)
    np.testing.assert_array_equal(to_memory(there, ("c", "a", "own"), ("a", "b", "c")), values)
    np.testing.assert_array_equal(to_memory(there.T, ("own", "a", "c"), ("a", "b", "c")), values)
