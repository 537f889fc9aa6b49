"""The run log against kills, torn and misplaced records, full disks, second writers and
files of others."""

import errno
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from nsdrill.errors import FileError, NsdrillError
from nsdrill.models.contents import Contents
from nsdrill.models.registry import described
from nsdrill.store import RunLog, log_format, pending_records, read_partial
from nsdrill.store.log_format import slot_dtype
from nsdrill.store.points import record_dtype

from .samples import POINTS, SHAPE, header, made

PEAKS = 3
SLOT = slot_dtype(Contents(PEAKS)).itemsize


@pytest.fixture
def part(tmp_path):
    return tmp_path / "out.h5.part"


def filled(part):
    """A closed log in which every point is done; its records."""
    records = made(POINTS, PEAKS)
    with RunLog.create(part, header(), POINTS, Contents(PEAKS)) as log:
        log.write(np.arange(POINTS), records)
        log.sync()
    return records


def slots_at(part):
    """Offset of the first slot: the slots end the file."""
    return part.stat().st_size - POINTS * SLOT


def test_reopening_gives_back_header_and_records(part):
    records = made(POINTS, PEAKS)
    with RunLog.create(part, header(extra="ä€"), POINTS, Contents(PEAKS)) as log:
        log.write([3, 5], records[[3, 5]])
        log.sync()
    with RunLog.open(part) as log:
        assert (log.n_points, log.contents) == (POINTS, Contents(PEAKS))
        assert log.header["attrs"]["extra"] == "ä€"
        for name, values in header()["coords"].items():
            # the very same floats
            np.testing.assert_array_equal(log.header["coords"][name], values)
        assert np.flatnonzero(log.done()).tolist() == [3, 5]
        log.write([4], records[[4]])
        assert log.read(3, 6).tobytes() == records[3:6].tobytes()


def test_a_partial_run_can_be_looked_at_while_it_goes_on(part):
    with RunLog.create(part, header(), POINTS, Contents(PEAKS)) as log:
        log.write([2], made(1, PEAKS))
        assert np.count_nonzero(read_partial(part)["status"]) == 1


def test_discard_removes_the_file(part):
    log = RunLog.create(part, header(), POINTS, Contents(PEAKS))
    log.discard()
    assert not part.exists()


# The child writes as fast as it can and says after each sync which points are kept.
KILLED = """
import sys
import numpy as np
sys.path.insert(0, sys.argv[2])
from store.samples import POINTS, header, made
from nsdrill.store import RunLog
from nsdrill.models.contents import Contents
records = made(POINTS, 3)
log = RunLog.create(sys.argv[1], header(), POINTS, Contents(3))
order = np.random.default_rng(5).permutation(POINTS)
print("ready", flush=True)
sys.stdin.readline()
for turn in range(10**6):
    for block in np.split(order, 24):
        log.write(block, records[block])
        log.sync()
        if turn == 0:
            print(*block, flush=True)
"""


def test_a_kill_at_any_moment_loses_no_safe_point_and_makes_up_none(tmp_path):
    records = made(POINTS, PEAKS)
    chance = random.Random(3)
    tests = Path(__file__).parents[1]
    children = []
    for number in range(10):
        part = tmp_path / f"{number}.part"
        command = [sys.executable, "-c", KILLED, str(part), str(tests)]
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        children.append((part, subprocess.Popen(command, text=True, bufsize=1, **pipes)))
    for part, child in children:
        assert child.stdout.readline() == "ready\n"
        child.stdin.write("go\n")
        time.sleep(chance.uniform(0.0, 0.02))
        child.send_signal(signal.SIGKILL)
        said, _ = child.communicate()
        promised = [
            int(word) for line in said.splitlines(keepends=True) if line.endswith("\n") for word in line.split()
        ]
        with RunLog.open(part) as log:  # the lock of the dead process is gone
            done = log.done()
            assert done[promised].all()
            for index in np.flatnonzero(done):
                assert log.read(index, index + 1).tobytes() == records[index : index + 1].tobytes()


def test_a_log_cut_anywhere_keeps_its_whole_points(part):
    records = filled(part)
    whole, begin = part.read_bytes(), slots_at(part)
    for cut in (begin, begin + 1, begin + SLOT - 1, begin + SLOT, begin + 10 * SLOT + 100, len(whole) - 1):
        part.write_bytes(whole[:cut])
        left = (cut - begin) // SLOT
        with RunLog.open(part) as log:
            assert log.done().tolist() == [True] * left + [False] * (POINTS - left)
            log.write(np.arange(left, POINTS), records[left:])  # and the others can be run again
        assert part.read_bytes() == whole


def test_every_damaged_byte_of_a_slot_is_noticed(part):
    filled(part)
    whole, begin = bytearray(part.read_bytes()), slots_at(part)
    chance = random.Random(4)
    for _ in range(100):
        index, byte = chance.randrange(POINTS), chance.randrange(SLOT)
        spot = begin + index * SLOT + byte
        whole[spot] ^= 1 << chance.randrange(8)
        part.write_bytes(whole)
        with RunLog.open(part) as log:
            assert np.flatnonzero(~log.done()).tolist() == [index]
        whole = bytearray(part.read_bytes())
        with RunLog.open(part) as log:
            log.write([index], made(1, PEAKS))
        whole = bytearray(part.read_bytes())


def test_misplaced_and_foreign_slots_are_not_believed(part, tmp_path):
    filled(part)
    begin = slots_at(part)
    whole = bytearray(part.read_bytes())
    whole[begin : begin + SLOT] = whole[begin + SLOT : begin + 2 * SLOT]  # a neighbour's
    other = tmp_path / "other.part"
    records = made(POINTS, PEAKS)
    with RunLog.create(other, header(title="Another"), POINTS, Contents(PEAKS)) as log:
        log.write(np.arange(POINTS), records)
    there = slots_at(other)
    whole[begin + 2 * SLOT : begin + 3 * SLOT] = other.read_bytes()[there + 2 * SLOT : there + 3 * SLOT]
    whole[begin + 5 * SLOT : begin + 6 * SLOT] = b"\xff" * SLOT
    part.write_bytes(whole)
    with RunLog.open(part) as log:
        assert np.flatnonzero(~log.done()).tolist() == [0, 2, 5]


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EIO, errno.EDQUOT])
def test_a_full_disk_is_told_and_the_log_stays_usable(part, monkeypatch, code):
    records = made(POINTS, PEAKS)
    log = RunLog.create(part, header(), POINTS, Contents(PEAKS))
    log.write(np.arange(10), records[:10])
    log.sync()
    real = os.pwrite

    def half(fd, data, offset):
        """Write a part of it, then refuse, as a disk does that fills up."""
        if len(data) < SLOT:
            raise OSError(code, os.strerror(code))
        return real(fd, data[: len(data) // 2], offset)

    with monkeypatch.context() as patch:
        patch.setattr(os, "pwrite", half)
        for point in (12, 3):  # a new one, and one that is written again
            with pytest.raises(NsdrillError, match=f"10 of {POINTS} points are kept.*resume=True") as caught:
                log.write([point], records[[point]])
            assert caught.value.exit_code == 1
    assert not log.done()[[12, 3]].any()
    log.write([12, 3], records[[12, 3]])
    log.close()
    with RunLog.open(part) as log:
        assert np.count_nonzero(log.done()) == 11
        assert log.read(12, 13).tobytes() == records[12:13].tobytes()


def test_after_a_failed_sync_no_later_sync_claims_success(part, monkeypatch):
    with RunLog.create(part, header(), POINTS, Contents(PEAKS)) as log:
        log.write([0], made(1, PEAKS))
        with monkeypatch.context() as patch:
            patch.setattr(os, "fsync", lambda fd: (_ for _ in ()).throw(OSError(errno.EIO, "Input/output error")))
            with pytest.raises(NsdrillError, match=f"0 of {POINTS} points are kept"):
                log.sync()
        with pytest.raises(NsdrillError, match="0 of"):
            log.sync()


def test_a_disk_too_small_for_the_points_is_told_before_the_run(part, monkeypatch):
    real = os.statvfs(part.parent)
    tiny = type("Disk", (), {"f_bavail": 1, "f_frsize": real.f_frsize})
    monkeypatch.setattr(os, "statvfs", lambda path: tiny)
    with pytest.raises(NsdrillError, match=r"the points need .* MB, the disk has .* Nothing has run"):
        RunLog.create(part, header(), POINTS, Contents(PEAKS))
    assert list(part.parent.iterdir()) == []


def test_a_second_writer_is_refused(part):
    with RunLog.create(part, header(), POINTS, Contents(PEAKS)):
        with pytest.raises(FileError, match="another process is writing these results now"):
            RunLog.open(part)
        with pytest.raises(FileError, match="another process is writing these results now"):
            RunLog.create(part, header(), POINTS, Contents(PEAKS))
        with pytest.raises(FileError, match="another process"):
            RunLog.remove(part)
    RunLog.open(part).close()
    assert [name.name for name in part.parent.iterdir()] == [part.name]


def test_the_lock_is_seen_by_another_process(part):
    code = "import sys; from nsdrill.store import RunLog; RunLog.open(sys.argv[1])"
    with RunLog.create(part, header(), POINTS, Contents(PEAKS)):
        child = subprocess.run([sys.executable, "-c", code, str(part)], capture_output=True, text=True, check=False)
    assert "another process is writing" in child.stderr


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda data: b"", "no run log of nsdrill"),
        (lambda data: data[:10], "no run log of nsdrill"),
        (lambda data: b"something else" + data, "no run log of nsdrill"),
        (lambda data: data[:100], "header of the run log is damaged"),
        (lambda data: data[:60] + b"\0" + data[61:], "header of the run log is damaged"),
        (lambda data: data.replace(b"made up", b"made UP", 1), "header of the run log is damaged"),
        (lambda data: data[:24] + b"\xff" * 8 + data[32:], "header of the run log is damaged"),
        (lambda data: data[:16] + b"\x63\0\0\0" + data[20:], "run log of format 99.*knows format 1"),
    ],
)
def test_what_is_no_log_of_ours_is_refused_in_words(part, damage, words):
    filled(part)
    part.write_bytes(damage(part.read_bytes()))
    with pytest.raises(FileError, match=words):
        RunLog.open(part)


@pytest.mark.parametrize(
    ("shape", "contents"),
    [((1, 4000, 4000, 1), Contents(PEAKS)), (SHAPE, Contents(10**7))],
    ids=["more points than any study has", "a larger record than any point has"],
)
def test_a_header_that_no_run_has_is_refused_at_once(part, shape, contents):
    """Its checksum is right."""
    pieces, _ = log_format.pack_header(header(shape), int(np.prod(shape)), contents)
    part.write_bytes(b"".join(map(bytes, pieces)))
    with pytest.raises(FileError, match="header of the run log is damaged"):
        RunLog.open(part)


def test_missing_and_odd_files_are_refused_in_words(part, tmp_path):
    with pytest.raises(FileError, match="no such file"):
        RunLog.open(part)
    with pytest.raises(FileError, match=r"cannot be opened|not a file"):
        RunLog.open(tmp_path)
    os.mkfifo(part)
    with pytest.raises(FileError, match="not a file"):
        RunLog.open(part)


def test_a_log_with_other_variables_is_refused(part, monkeypatch):
    filled(part)
    fewer = property(lambda kept: described(kept.model).variables[:-1])
    monkeypatch.setattr(Contents, "variables", fewer)
    monkeypatch.setattr("nsdrill.store.log_format.record_dtype", record_dtype.__wrapped__)  # remembers nothing
    with pytest.raises(FileError, match="other variables than this nsdrill writes"):
        RunLog.open(part)


def test_of_an_empty_log_next_to_nothing_is_read(part, monkeypatch):
    """With 10 000 returns a slot has 640 kB: reading the zeros of a large sweep would
    take minutes."""
    asked = []
    preadv = os.preadv
    monkeypatch.setattr(os, "preadv", lambda fd, buffers, at: asked.append(len(buffers[0])) or preadv(fd, buffers, at))
    shape, kept = (1, 1, 40, 50), Contents(PEAKS, 10_000)
    one = pending_records(1, kept)
    one["status"] = 1
    with RunLog.create(part, header(shape), 2000, kept) as log:
        log.write([1234], one)
        assert not log.read(0, 3)["status"].any()
    with RunLog.open(part) as log:
        assert np.flatnonzero(log.done()).tolist() == [1234]
        assert log.read(1234, 1235).tobytes() == one.tobytes()
    assert sum(asked) < 20e6


def test_an_empty_log_takes_hardly_any_space(part):
    shape = (1, 1000, 1, 100)
    with RunLog.create(part, header(shape), 100_000, Contents(32)):
        assert part.stat().st_size > 100_000_000
        assert part.stat().st_blocks * 512 < 1_000_000  # st_blocks counts 512 bytes by POSIX
