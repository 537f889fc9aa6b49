"""Files that are damaged, cut, foreign, or not there: one clear FileError each, never a
crash."""

import os
import random
import subprocess
import sys

import h5py
import numpy as np
import pytest

import nsdrill.store.hdf5 as hdf5
from nsdrill.errors import FileError, InputError
from nsdrill.models.contents import Contents
from nsdrill.store import (
    RunLog,
    kind_of,
    open_results,
    part_path,
    read_attributes,
    read_partial,
    read_point,
    read_results,
    read_trace,
    rewrite_labels,
    to_netcdf,
    variables_in,
)

from .samples import POINTS, header, make_results

READERS = {
    "read_results": read_results,
    "read_attributes": read_attributes,
    "read_point": lambda path: read_point(path, 0, 0, 0, 0),
    "open_results": open_results,
    "kind_of": kind_of,
    "read_trace": read_trace,
    "rewrite_labels": lambda path: rewrite_labels(path, {}, "x"),
    "to_netcdf": lambda path: to_netcdf(path, f"{path}.nc"),
}


def foreign(path):
    with h5py.File(path, "w") as file:
        file["depth"] = [1.0, 2.0]


def another_format(path):
    make_results(path)
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = 99


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS)
@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda path: None, "there is no such file"),
        (lambda path: path.write_bytes(b""), "this file is empty"),
        (lambda path: path.write_bytes(b"title: a study\n"), "not an HDF5 file"),
        (lambda path: path.write_bytes(hdf5.SIGNATURE + bytes(range(256)) * 40), "damaged or incomplete"),
        (foreign, "none of nsdrill"),
        (another_format, r"file format 99; this nsdrill reads format 1"),
    ],
    ids=["missing", "empty", "text", "only a signature", "of another program", "of another format"],
)
def test_what_is_no_file_of_ours(path, reader, make, words):
    make(path)
    with pytest.raises(FileError, match=words):
        reader(path)


@pytest.mark.parametrize(
    ("name", "words"),
    [("", "this is no file"), ("pipe", "this is no file"), ("a\0b", "cannot be read"), ("n" * 300, "cannot be read")],
)
def test_folders_pipes_and_impossible_names(tmp_path, name, words):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(FileError, match=words):
        read_results(tmp_path / name)


def test_a_file_that_may_not_be_read(path, monkeypatch):
    make_results(path)

    def refuse(*args):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "stat", refuse)  # root may read everything, so the system is not asked
    with pytest.raises(FileError, match="cannot be read: permission denied"):
        read_results(path)


def test_an_unfinished_run_is_pointed_at(path):
    RunLog.create(part_path(path), header(), POINTS, Contents(0)).close()
    with pytest.raises(FileError, match=r"unfinished run.*resume=True"):
        read_results(path)
    with pytest.raises(FileError, match=r"unfinished run.*resume=True"):
        read_results(part_path(path))
    assert kind_of(part_path(path)) == "partial"


def test_a_file_cut_anywhere_is_refused(path):
    make_results(path)
    whole = path.read_bytes()
    chance = random.Random(1)
    # All but the last cut go through a child process, so few of them.
    for length in (*(chance.randrange(8, len(whole) - 60) for _ in range(4)), len(whole) // 2):
        path.write_bytes(whole[:length])
        with pytest.raises(FileError, match="damaged or incomplete"):
            read_results(path)


def test_every_flipped_bit_is_noticed(path):
    make_results(path)
    whole = path.read_bytes()
    chance = random.Random(2)
    for _ in range(300):
        # the seal itself is 48 bytes; without it the child process reads
        spot = chance.randrange(len(whole) - 48)
        path.write_bytes(whole[:spot] + bytes([whole[spot] ^ (1 << chance.randrange(8))]) + whole[spot + 1 :])
        with pytest.raises(FileError, match=r"damaged|not an HDF5 file"):
            read_results(path)


def test_flipped_numbers_are_noticed_without_a_seal_too(path):
    records = make_results(path, (1, 2000, 1, 1), 0)
    with h5py.File(path, "r+") as file:
        file.attrs["note"] = "edited by another program, which drops the seal"
        offset = file["axial_max"].id.get_chunk_info(0).byte_offset
    assert read_results(path)["axial_max"].tobytes() == records["axial_max"].tobytes()
    data = bytearray(path.read_bytes())
    data[offset + 1000] ^= 1
    path.write_bytes(data)
    with pytest.raises(FileError, match="damaged"):
        read_results(path)


def giant_depth(file):
    """80 GB that fill no place in the file, and that nothing should read."""
    del file["depth"]
    file.create_dataset("depth", (10**10,), "f8", chunks=(1000,), fillvalue=1.0)


@pytest.mark.parametrize(
    ("edit", "words"),
    [
        (lambda file: file.pop("depth"), "the coordinate depth is missing"),
        (lambda file: file.pop("state"), "damaged or incomplete"),
        (lambda file: file["procedure"].write_direct(np.array(["same", "over"], object)), "the procedures are"),
        (lambda file: file["state"].write_direct(np.array(["x"] * 9, object)), "the states are"),
        (lambda file: replace(file, "axial_max", np.zeros((2, 5, 3, 5))), r"should have procedure \(2\), depth"),
        (lambda file: replace(file, "axial_max", np.zeros((2, 5, 3, 4), int), DIMS), "real numbers"),
        (lambda file: replace(file, "status", np.zeros((2, 5, 3, 4)), DIMS), "whole numbers"),
        (lambda file: file["status"].attrs.__setitem__("DIMENSION_LIST", "1e999"), "status names no dimensions"),
        (lambda file: replace(file, "depth", np.zeros((2, 2))), "coordinate depth"),
        (lambda file: replace(file, "depth", 500.0 - np.arange(5.0)), "depth: found values that do not ascend"),
        (lambda file: replace(file, "depth", 500.0 + np.arange(5.0) * 1e9), "depth: found .* at most 100 000 m"),
        (giant_depth, "depth has 10000000000 values, and no variable as many"),
        (lambda file: replace(file, "depth", np.full(5, np.nan)), "depth should have finite numbers"),
        (lambda file: replace(file, "wob", np.full(3, np.inf)), "wob should have finite numbers"),
        (lambda file: replace(file, "peak", np.array([5, 6, 7])), "coordinate peak does not count from 0"),
        (lambda file: file.__setitem__("start", np.zeros(0, int)), "coordinate start does not count from 0"),
        (lambda file: file["status"].write_direct(np.full((2, 5, 3, 4), 77, "i1")), "status has values that mean"),
        (lambda file: file["response"].write_direct(np.full((2, 5, 3, 4), -1, "i1")), "response has values that mean"),
        (lambda file: replace(file, "procedure", np.array(["up"] * 50, object)), "the procedures are up, up"),
        (lambda file: file.attrs.__setitem__("nsdrill_kind", "poem"), "poem"),
        (lambda file: file.attrs.__setitem__("nsdrill_kind", [1, 2]), "none of nsdrill"),
        (lambda file: file.attrs.__setitem__("format_version", "one"), "none of nsdrill"),
    ],
)
def test_edited_files_are_refused_in_words(path, edit, words):
    make_results(path)
    with h5py.File(path, "r+") as file:
        edit(file)
    with pytest.raises(FileError, match=words):
        read_results(path)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("title", 5, "title should be text"),
        ("history", np.zeros(3), "history should be text"),
        ("h5py_version", h5py.Empty("f8"), "h5py_version should be text"),
        ("axes", True, "axes should be text"),
        ("gap", "wide", "gap should be a finite number"),
        ("gap", np.inf, "gap should be a finite number"),
        ("gap", 1e300, "gap should be a finite number"),
        ("refine", 1.5, "refine should be a whole number"),
        ("refine", 1, "points_run of a refined sweep is missing"),
        ("study_resolved", "[1, 2]", "study_resolved should be a JSON object"),
        ("study_resolved", "[" * 100_000, "study_resolved should be a JSON object"),
        ("study_resolved", '{"title": NaN}', "study_resolved should be a JSON object"),
        ("study_resolved", '{"title": [1e999]}', "study_resolved should be a JSON object"),
        ("study_resolved", '{"classify": {"whirl": {"direction": "up"}}}', "whose classify has finite numbers"),
        ("study_resolved", '{"classify": null}', "whose classify has finite numbers"),
        ("classification_resolved", '{"whirl": {"direction": true}}', "of sections with finite numbers"),
        ("classification_resolved", '{"whirl": [0.1]}', "of sections with finite numbers"),
        ("classification", '{"a": 1}', "classification should be a JSON list"),
        ("classification", "[{}]", "classification should be a JSON list of texts"),
        ("study_overrides", "[5]", "study_overrides should be a JSON list of texts"),
        ("border_spacing", '{"wob": []}', "border_spacing should be a JSON object of finite numbers"),
        ("border_spacing", '{"wob": NaN}', "border_spacing should be a JSON object of finite numbers"),
        ("at", '{"bit.lobes": true}', "at should be a JSON object of words and finite numbers"),
        ("seeds", '{"followed": NaN}', "seeds should be a JSON object of whole numbers"),
        ("seeds", '{"followed": -1}', "seeds should be a JSON object of whole numbers"),
    ],
)
def test_attributes_of_other_types(path, name, value, words):
    make_results(path)
    with h5py.File(path, "r+") as file:
        file.attrs[name] = value
    for reader in (read_results, read_attributes):
        with pytest.raises(FileError, match=words):
            reader(path)


def test_a_refined_sweep_has_run_points(path):
    make_results(path)
    with h5py.File(path, "r+") as file:
        file.attrs.update(refine=1, points_run=0, points_inferred=0, border_spacing='{"wob": 1000.0}')
    with pytest.raises(FileError, match="points_run should be above 0"):
        read_results(path)


def test_the_log_of_a_run_is_not_trusted_either(path):
    RunLog.create(part_path(path), header(study_resolved="[1, 2]"), POINTS, Contents(0)).close()
    with pytest.raises(FileError, match="study_resolved should be a JSON object"):
        read_partial(part_path(path))


def test_what_others_wrote_beside_ours_is_no_obstacle(path):
    make_results(path)
    with h5py.File(path, "r+") as file:
        file.attrs["note"] = b"\xff is not UTF-8\x1b"
        file.attrs["table"] = np.zeros((3, 3))
        file.attrs["pair"] = np.void(b"\0\1")
        file.attrs["title"] = np.bytes_("caf\xe9".encode("latin-1"))
    attrs = read_attributes(path)
    assert attrs["title"] == "caf\N{REPLACEMENT CHARACTER}"
    assert attrs["note"] == "\N{REPLACEMENT CHARACTER} is not UTF-8"
    assert not {"table", "pair"} & set(attrs)


def test_points_outside_and_unknown_names(path):
    make_results(path)
    with pytest.raises(FileError, match=r"there is no point \(0, 5, 0, 0\); the sweep has 2 x 5 x 3 x 4"):
        read_point(path, 0, 5, 0, 0)
    with pytest.raises(FileError, match="no variable is called axial_maximum"):
        read_results(path, ["axial_maximum"])


DIMS = ("procedure", "depth", "wob", "rotary_speed")


def replace(file, name, values, dims=()):
    """Put other values under ``name``."""
    del file[name]
    file[name] = values
    for axis, scale in enumerate(dims):
        file[name].dims[axis].attach_scale(file[scale])


def test_a_file_from_before_lacks_what_is_measured_now(path):
    """Sealed, so nobody has edited it: the version that made it did not know the
    variable."""
    make_results(path)
    whole = read_results(path)
    hdf5.unseal(path)
    with h5py.File(path, "r+") as file:
        del file["axial_max"]
    hdf5.seal(path)
    found = read_results(path)
    assert set(whole.variables) - set(found.variables) == {"axial_max"}
    np.testing.assert_array_equal(found["axial_min"], whole["axial_min"])
    assert "axial_max" not in {variable.name for variable in variables_in(path)}
    assert "axial_max" not in read_point(path, 0, 0, 0, 0)
    with pytest.raises(InputError, match=r"results without axial_max; .*run the study again"):
        found["axial_max"]


@pytest.mark.parametrize("value", [b"9" * 5000, b"", 1.5, np.zeros(3)])
def test_names_of_dimensions_of_another_type_end_no_process(path, value):
    """HDF5 takes them for references, and frees what is none: the process ended by a signal."""
    make_results(path)
    hdf5.unseal(path)
    with h5py.File(path, "r+") as file:
        del file["lift_off_fraction"].attrs["DIMENSION_LIST"]
        file["lift_off_fraction"].attrs["DIMENSION_LIST"] = np.bytes_(value) if isinstance(value, bytes) else value
    hdf5.seal(path)
    said = subprocess.run(
        [sys.executable, "-c", f"import nsdrill\nnsdrill.open_results({str(path)!r}).close()"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert said.returncode == 1
    assert "the file is damaged or incomplete: /lift_off_fraction names no dimensions" in said.stderr
