"""Files that another program has open to write, or left open when it was killed: their
status flag is named, and whole data are read."""

import fcntl
import subprocess
import sys
import warnings

import h5py
import numpy as np
import pytest

from nsdrill.errors import FileError, FileWarning
from nsdrill.store import in_use, kind_of, open_results, read_results, rewrite_labels, to_netcdf

from .samples import make_results

HOLD = (
    "import h5py, sys\nfile = h5py.File(sys.argv[1], 'r+', libver='latest')\n{}\nprint(1, flush=True)\nsys.stdin.read()"
)


@pytest.fixture
def held():
    """A program that has a file open to write, after it did what ``work`` says."""
    programs = []

    def hold(path, work=""):
        words = [sys.executable, "-c", HOLD.format(work), str(path)]
        programs.append(subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE))
        assert programs[-1].stdout.readline()
        return programs[-1]

    yield hold
    for program in programs:
        program.kill()
        program.communicate()


def test_the_flag_is_all_that_differs(path, held):
    make_results(path)
    before = path.read_bytes()
    assert in_use.without_flag(before) is None
    program = held(path)
    during = path.read_bytes()
    differing = [place for place, (a, b) in enumerate(zip(before, during, strict=True)) if a != b]
    assert 11 in differing
    assert set(differing) <= {11, 44, 45, 46, 47}, "the flag, and the checksum of the superblock"
    assert in_use.without_flag(during) == before[: in_use.SUPERBLOCK]
    torn = bytearray(during)
    torn[in_use.SUPERBLOCK - 1] ^= 1  # the checksum is not that of the superblock
    assert in_use.without_flag(bytes(torn)) is None
    with in_use.Reader(path) as reader:
        assert reader.read() == before
    program.communicate()
    assert in_use.without_flag(path.read_bytes()) is None


def test_whole_data_are_read_with_a_warning(path, held, tmp_path):
    records = make_results(path)
    program = held(path)
    with pytest.warns(
        FileWarning, match=rf"status flag is set, as python\S* \(process {program.pid}\) has it open"
    ) as told:
        results = read_results(path)
    assert "h5clear -s" in str(told[0].message)
    assert results["axial_max"].tobytes() == records["axial_max"].tobytes()
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a file that stays as it is is told once
        assert kind_of(path) == "results"
        with open_results(path) as data:
            assert np.array_equal(data["axial_max"].values.ravel(), records["axial_max"], equal_nan=True)
        to_netcdf(path, tmp_path / "copy.nc")
        rewrite_labels(path, {}, "x", output=tmp_path / "copy.h5")
    with h5py.File(tmp_path / "copy.nc", "r") as copy:
        assert copy["axial_max"].size == len(records)
    read_results(tmp_path / "copy.h5")
    with pytest.raises(FileError, match=r"has it open to write, so it is not replaced.*path"):
        rewrite_labels(path, {}, "x")
    program.kill()
    program.communicate()
    path.touch()
    with pytest.warns(FileWarning, match="left it open when it was killed"):
        read_results(path)


@pytest.mark.parametrize(
    "work",
    ["file['status'][...] = 1; file.attrs['note'] = 'x' * 5000; file.flush()", "file.swmr_mode = True"],
    ids=["changed", "SWMR, which drops the seal"],
)
def test_what_cannot_be_checked_is_refused_without_a_word_of_damage(path, held, work):
    make_results(path)
    held(path, work)
    with pytest.raises(FileError, match=r"status flag is set, as .*its data cannot be checked.*h5clear -s") as error:
        read_results(path)
    assert "make it again" not in str(error.value)


def test_a_flag_hides_no_damage(path, held):
    make_results(path)
    held(path).kill()
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(FileError, match="its data cannot be checked"):
        read_results(path)


def test_a_file_that_cannot_be_locked(path):
    """As on network file systems without locks, or where another program has its own."""
    records = make_results(path)
    with open(path, "rb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        assert read_results(path)["axial_max"].tobytes() == records["axial_max"].tobytes()
        with open_results(path) as data:
            assert data["axial_max"].size == len(records)
