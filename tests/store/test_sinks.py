"""The protocol of a run log: file and memory pass the same tests."""

import tracemalloc

import numpy as np
import pytest
from model_tables import VARIABLES

from nsdrill.models.christoforou_yigit.columns import DRIVEN_STATE_NAMES
from nsdrill.models.contents import Contents
from nsdrill.store import MemoryLog, RunLog, collect, columns, pending_records, record_dtype
from nsdrill.variables import PENDING, POINT

from .samples import POINTS, SHAPE, header, made


@pytest.fixture(params=["memory", "file"])
def new_log(request, tmp_path):
    """A function that makes an empty log with so many peaks."""

    def make(peaks=3):
        if request.param == "memory":
            return MemoryLog(header(), POINTS, Contents(peaks))
        return RunLog.create(tmp_path / "out.h5.part", header(), POINTS, Contents(peaks))

    return make


@pytest.mark.parametrize("peaks", [0, 1, 32])
def test_what_is_written_is_read_bit_for_bit(new_log, peaks):
    records = made(POINTS, peaks)
    with new_log(peaks) as log:
        order = np.random.default_rng(1).permutation(POINTS)
        log.write(order[:50], records[order[:50]])
        log.write(order[50:], records[order[50:]])
        log.sync()
        assert log.read(0, POINTS).tobytes() == records.tobytes()
        assert log.read(7, 11).tobytes() == records[7:11].tobytes()
        assert log.done().all()
        np.testing.assert_array_equal(log.status(), records["status"])


def test_points_not_written_are_pending(new_log):
    with new_log() as log:
        log.write([4, 9], made(2, 3))
        assert np.flatnonzero(log.done()).tolist() == [4, 9]
        pending = log.read(5, 9)
        assert (pending["status"] == PENDING).all()
        for variable in Contents(3).variables:
            values = pending[variable.name]
            assert np.isnan(values).all() if variable.dtype == "f8" else (values == 0).all()


def test_a_point_may_be_rewritten_and_taken_back(new_log):
    first, second = made(3, 3, seed=1), made(3, 3, seed=2)
    with new_log() as log:
        log.write([1, 2, 3], first)
        log.write([2], second[:1])
        assert log.read(1, 4)[1].tobytes() == second[0].tobytes()
        log.clear([3])
        assert log.done().tolist()[:5] == [False, True, True, False, False]
        assert log.read(3, 4)["status"] == PENDING
        assert np.isnan(log.read(3, 4)["axial_max"])


def test_writing_nothing_is_allowed(new_log):
    with new_log() as log:
        log.write([], made(0, 3))
        log.sync()
        assert not log.done().any()


def test_later_of_two_records_for_one_point_wins(new_log):
    records = made(2, 3)
    with new_log() as log:
        log.write([6, 6], records)
        assert log.read(6, 7).tobytes() == records[1:].tobytes()


@pytest.mark.parametrize(
    ("indices", "count", "peaks", "words"),
    [
        ([POINTS], 1, 3, "must lie in"),
        ([-1], 1, 3, "must lie in"),
        ([0, 1], 1, 3, "shape"),
        ([0], 1, 2, "record_dtype"),
    ],
)
def test_wrong_calls_are_refused(new_log, indices, count, peaks, words):
    with new_log() as log, pytest.raises(ValueError, match=words):
        log.write(indices, made(count, peaks))


def test_a_pending_record_is_no_result(new_log):
    records = made(1, 3)
    records["status"] = PENDING
    with new_log() as log, pytest.raises(ValueError, match="pending"):
        log.write([0], records)


def test_collect_gives_results_on_the_grid(new_log):
    records = made(POINTS, 3)
    with new_log() as log:
        log.write(np.arange(POINTS), records)
        results = collect(log)
    assert results.shape == SHAPE
    for name in records.dtype.names:
        assert results[name].tobytes() == records[name].tobytes()
        assert results[name].shape == (*SHAPE, *records[name].shape[1:])
    for name in POINT:
        np.testing.assert_array_equal(results.coords[name], header()["coords"][name])


def test_records_follow_the_table_of_variables():
    everything = Contents(
        peaks=5,
        returns=4,
        exponent=True,
        starts=2,
        verify=True,
        states=DRIVEN_STATE_NAMES,
        options=("stabilizers", "inclined", "drilled", "regenerative"),
        method=True,
    )
    assert record_dtype(everything).names == tuple(variable.name for variable in VARIABLES)
    assert not [name for name in record_dtype(Contents(0)).names if name.endswith("_peaks")]
    with pytest.raises(ValueError, match="negative"):
        record_dtype(Contents(-1))


def test_a_header_must_span_the_points(tmp_path):
    for make in (MemoryLog, lambda *args: RunLog.create(tmp_path / "x.part", *args)):
        with pytest.raises(ValueError, match="span"):
            make(header(), POINTS + 1, Contents())


def test_columns_take_the_memory_of_their_own(tmp_path):
    """Not that of the records: with 10 000 returns one has 640 kB, and a sweep has
    thousands."""
    kept = Contents(3, returns=10_000)
    with RunLog.create(tmp_path / "out.h5.part", header((1, 1, 30, 20)), 600, kept) as log:
        records = pending_records(1, kept)
        records["status"], records["steps"] = 1, 7
        log.write([321], records)
        tracemalloc.start()
        found = columns(log, ["status", "steps"], 300, 600)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert np.flatnonzero(found["status"]).tolist() == [21]
    assert found["steps"][21] == 7
    assert most < 40e6, "300 records are 192 MB"
