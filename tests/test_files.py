"""Temporary names and locks: whole files, one winner, nothing left behind, no lock that
outlives its owner."""

import errno
import mmap
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import FrameType
from typing import Any

import pytest
from store.samples import POINTS, header

from nsdrill import files
from nsdrill.errors import FileError, NsdrillError
from nsdrill.files import Temporary, replacing, sweep_away, write_text
from nsdrill.models.contents import Contents
from nsdrill.store import RunLog, claim, part_path

KILLED = """
import os, sys
from pathlib import Path
from nsdrill.files import Temporary
temporary = Temporary(Path(sys.argv[1]))
temporary.file.write(b"half")
if len(sys.argv) > 2:  # in the middle of taking its name
    os.link(temporary.path, sys.argv[1])
os._exit(9)
"""


def killed_while_writing(path: Path, *more: str) -> None:
    subprocess.run([sys.executable, "-c", KILLED, str(path), *more], check=False)
    assert [name for name in os.listdir(path.parent) if ".tmp-" in name]


def test_a_file_is_whole_or_as_it_was(tmp_path):
    path = tmp_path / "a"
    write_text(path, "old")

    def fail():
        with replacing(path) as temporary:
            temporary.write(b"half")
            raise OSError(28, "No space left on device")

    with pytest.raises(NsdrillError, match=r"a: could not be written: no space.*Nothing was changed"):
        fail()
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a"]


@pytest.mark.parametrize("at_most", [1, 4096])
def test_a_write_that_takes_a_part_goes_on(tmp_path, monkeypatch, at_most):
    """As on a disk that fills up, or beyond 2 GiB."""
    data, real, real_at = os.urandom(10_000), os.write, os.pwrite
    monkeypatch.setattr(os, "write", lambda fd, part: real(fd, part[:at_most]))
    monkeypatch.setattr(os, "pwrite", lambda fd, part, at: real_at(fd, part[:at_most], at))
    with replacing(tmp_path / "a") as file:
        assert file.write(data) == len(data)
        with file.text() as text:
            text.write("ä\r\n" * 5000)
        files.write_at(file.fileno(), data[::-1], 3)
    assert (tmp_path / "a").read_bytes() == data[:3] + data[::-1] + ("ä\r\n" * 5000).encode()[3:]


def test_more_than_the_system_writes_at_once(tmp_path, monkeypatch):
    """Linux writes 0x7ffff000 bytes at most; the pages of the map are never touched."""
    size, most, calls = (2 << 30) + 10, 0x7FFFF000, []

    def taken(fd, part, at=-1):
        calls.append((len(part), at))
        return min(len(part), most)

    monkeypatch.setattr(os, "write", taken)
    monkeypatch.setattr(os, "pwrite", taken)
    with replacing(tmp_path / "a") as file, mmap.mmap(-1, size) as data:
        assert file.write(data) == size
        with memoryview(data) as view:
            files.write_at(file.fileno(), view, 7)
    assert calls == [(size, -1), (size - most, -1), (size, 7), (size - most, 7 + most)]


@pytest.mark.parametrize("deferring", [False, True])
def test_the_first_error_stays_also_where_a_library_hides_it(tmp_path, monkeypatch, deferring):
    write_text(tmp_path / "a", "old")
    codes = iter([errno.EDQUOT, errno.EIO])

    def refuse(fd, part):
        raise OSError(code := next(codes), os.strerror(code))

    monkeypatch.setattr(os, "write", refuse)

    def write():
        with replacing(tmp_path / "a") as file:
            file.deferring = deferring
            for _ in range(2):
                with suppress(OSError):
                    assert file.write(b"new") == 3
                    assert deferring

    with pytest.raises(NsdrillError, match="a: could not be written: disk quota exceeded"):
        write()
    assert (tmp_path / "a").read_text() == "old"


@pytest.mark.parametrize("more", [(), ("linked",)])
def test_what_a_killed_process_left_is_removed(tmp_path, more):
    path = tmp_path / "a"
    killed_while_writing(path, *more)
    write_text(path, "new")
    assert path.read_text() == "new"
    assert os.listdir(tmp_path) == ["a"]


def test_what_a_living_one_writes_and_what_is_not_ours_is_left(tmp_path):
    path = tmp_path / "a"
    others = [tmp_path / ".a.tmp-mine", tmp_path / ".ab.tmp-12345678", tmp_path / ".a.tmp-abcdef01"]
    for other in others[:2]:
        other.write_text("x")
    others[2].symlink_to(others[0])
    with Temporary(path) as temporary:
        sweep_away(path)
        assert {temporary.path, *others} == set(tmp_path.iterdir())
        with pytest.raises(FileError, match="another process is writing this file now"), replacing(path):
            pass
    assert set(others) == set(tmp_path.iterdir())


@pytest.mark.parametrize("state", ["new", "resume"])
def test_a_run_begins_with_an_empty_folder(tmp_path, state):
    """What a kill in the last phase leaves is as large as the results: it goes before
    the run needs the room."""
    path = tmp_path / "out.h5"
    if state == "resume":
        RunLog.create(part_path(path), header(), POINTS, Contents(0)).close()
    for name in (path, part_path(path)):
        killed_while_writing(name)
    assert claim(path, resume=True) == state
    assert [name for name in os.listdir(tmp_path) if ".tmp-" in name] == []


def test_the_temporary_name_is_taken_by_no_link(tmp_path, monkeypatch):
    monkeypatch.setattr(files.os, "urandom", bytes)
    (tmp_path / "precious").write_text("precious")
    (tmp_path / ".a.tmp-00000000").symlink_to(tmp_path / "precious")
    with pytest.raises(NsdrillError, match=r"file exists|another process"):
        write_text(tmp_path / "a", "new")
    assert (tmp_path / "precious").read_text() == "precious"


def test_a_link_as_run_log_is_refused_and_two_names_of_a_file_have_one_log(tmp_path):
    path, link = tmp_path / "out.h5", tmp_path / "link.h5"
    link.symlink_to(path)
    assert part_path(link) == part_path(path)
    RunLog.create(tmp_path / "elsewhere", header(), POINTS, Contents(0)).close()
    part_path(path).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(FileError, match="is a link"):
        RunLog.open(part_path(path))


def race(count: int, work: Callable[[], Any]) -> list[Any]:
    """What became of ``count`` threads that begin at once: results and exceptions."""
    barrier, ends = threading.Barrier(count), []

    def one() -> None:
        barrier.wait()
        try:
            ends.append(work())
        except Exception as error:
            ends.append(error)

    threads = [threading.Thread(target=one) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return ends


def test_of_several_writers_one_wins_and_the_others_are_told(tmp_path):
    for turn in range(20):
        part, path = tmp_path / f"{turn}.part", tmp_path / f"{turn}"
        logs = race(4, lambda part=part: RunLog.create(part, header(), POINTS, Contents(0)))
        assert sorted(type(end).__name__ for end in logs) == ["FileError"] * 3 + ["RunLog"], logs
        with next(log for log in logs if isinstance(log, RunLog)):
            pass
        RunLog.open(part).close()
        texts = race(4, lambda path=path: write_text(path, "x" * 10_000, overwrite=False))
        assert sorted(type(end).__name__ for end in texts) == ["FileError"] * 3 + ["NoneType"], texts
        assert path.read_text() == "x" * 10_000
    assert len(os.listdir(tmp_path)) == 40


def interrupted_at(moment: int, work: Callable[[], object]) -> bool:
    """Call ``work`` and interrupt it where Python looks for signals, at the start of a
    function of ours or after one of the system that we call, the ``moment``-th time;
    whether it got so far. As in a notebook, the exception with all its frames is still
    there afterwards."""
    global last
    left = moment

    def profile(frame: FrameType, event: str, argument: object) -> None:
        nonlocal left
        if event in ("call", "c_return") and frame.f_code.co_filename.endswith(OURS):
            left -= 1
            if left == 0:
                raise KeyboardInterrupt

    sys.setprofile(profile)
    try:
        work()
    except KeyboardInterrupt as error:
        last = error
    finally:
        sys.setprofile(None)
    return left <= 0


OURS = ("nsdrill/files.py", "store/log.py", "store/log_format.py")
last: BaseException | None = None


@pytest.mark.parametrize("what", ["create", "open"])
def test_an_interrupt_at_any_moment_leaves_no_lock(tmp_path, what):
    part, moment = tmp_path / "out.h5.part", 0
    if what == "open":
        RunLog.create(part, header(), POINTS, Contents(0)).close()
    got_there = True
    while got_there:
        moment += 1
        opened = []

        def work(opened=opened):
            opened.append(RunLog.create(part, header(), POINTS, Contents(0)) if what == "create" else RunLog.open(part))

        got_there = interrupted_at(moment, work)
        for log in opened:
            log.close()
        if what == "create" and not part.exists():
            RunLog.create(part, header(), POINTS, Contents(0)).close()
        with RunLog.open(part):
            pass
        assert [name for name in os.listdir(tmp_path) if ".tmp-" in name] == []
        if what == "create":
            part.unlink()
    assert moment > 20


def test_a_log_that_is_gone_is_not_called_safe(tmp_path):
    from store.samples import made

    folder = tmp_path / "folder"
    folder.mkdir()
    part = folder / "out.h5.part"
    with RunLog.create(part, header(), POINTS, Contents(0)) as log:
        log.write([0, 1], made(2, 0))
        log.sync()
        assert log.recovery_text().startswith(f"2 of {POINTS} points are kept in {part}. Go on")
        folder.rename(tmp_path / "moved")
        with pytest.raises(NsdrillError, match=r"its folder was moved.* 2 of 120 points are in that file"):
            log.sync()
        (tmp_path / "moved" / "out.h5.part").unlink()
        with pytest.raises(NsdrillError, match="was deleted while the run wrote it, and its 2 of 120 points are lost"):
            log.sync()
        assert "safe" not in log.recovery_text()
