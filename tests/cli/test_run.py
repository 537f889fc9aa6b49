"""nsdrill run: the file, the rules of the output, failures, interruptions."""

import os
import pty
import resource
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from same_bits import different

from nsdrill.progress import pace
from nsdrill.store import read_results

from .helpers import SCRIPT, finish, start

# Some seconds of work, in points of some milliseconds: time to interrupt, and something
# to keep. Some seconds: time for a slow machine to see the first points and to
# interrupt before the last.
LONG_MAP = (
    "title: Long\nsweep: {wob: {from: 20 kN, to: 100 kN, points: 20}, rotary_speed: {from: 1 rad/s, to: 8 rad/s, "
    "points: 20}}\nsimulation: {transient: 200 s, observe: 10 s}\nrecord: {peaks: 2}\n"
)
LONG_CHAIN = (
    "title: Long\nsweep: {rotary_speed: {from: 1 rad/s, to: 8 rad/s, points: 100}, procedure: up-down}\n"
    "simulation: {transient: 80 s, observe: 10 s}\nrecord: {peaks: 2}\n"
)


def test_run_says_what_it_did_on_stderr(call, small):
    answer = call("run", small, "-o", "out.h5")
    assert answer.out == ""
    warning, done = answer.err.rsplit("\n", 2)[:2]
    assert "\nWarning: Short: " in f"\n{warning}"  # those of check
    assert done.startswith("out.h5: 16 points, ")
    assert call("check", small).err.rstrip() == warning
    assert "\x1b" not in answer.err  # no bar where there is no terminal
    assert sorted(os.listdir()) == ["out.h5", "small.yaml"]


def test_output_is_never_overwritten_unasked(call, small):
    Path("out.h5").write_text("mine")
    assert "--overwrite" in call("run", small, "-o", "out.h5", code=2).err
    assert Path("out.h5").read_text() == "mine"
    call("run", small, "-o", "out.h5", "--overwrite")
    assert read_results("out.h5").shape == (2, 1, 1, 8)


def test_resume(call, small):
    # nothing there yet: a run like any other
    call("run", small, "-o", "out.h5", "--resume")
    before = Path("out.h5").read_bytes()
    assert "16 were there already" in call("run", small, "-o", "out.h5", "--resume").err
    other = call("run", small, "-o", "out.h5", "--resume", "--set", "mud.density=1400 kg/m^3", code=2)
    assert "another study (mud.density: 1500 kg/m^3 there, 1400 kg/m^3 here)" in other.err
    call("run", small, "-o", "out.h5", "--resume", "--overwrite", code=2)
    assert Path("out.h5").read_bytes() == before
    call("run", small, "-o", "out.h5", "--resume", "--set", "title=Renamed")


def test_failed_points_are_exit_code_3_and_listed(call, small):
    answer = call("run", small, "-o", "out.h5", "--set", "simulation.max_steps=1000", code=3)
    failed = np.count_nonzero(read_results("out.h5")["status"] == 3)
    assert failed > 0
    assert f"{failed} points failed and are marked" in answer.err
    call("run", small, "-o", "out.h5", "--resume", "--set", "simulation.max_steps=1000", code=3)
    assert f"Failed points ({failed})" in call("show", "out.h5").out


def test_interrupted_and_resumed_is_as_undisturbed(tmp_path, call):
    (tmp_path / "long.yaml").write_text(LONG_CHAIN)
    process = start("run", "long.yaml", "-o", "out.h5", "--workers", "1", cwd=tmp_path)
    part = tmp_path / "out.h5.part"
    # As soon as the first points are in the log.
    while process.poll() is None and not (part.exists() and _points(tmp_path) > 0):
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    used, before = _processor_seconds(process.pid), _processor_seconds_of_ended()
    answer = finish(process)
    assert _processor_seconds_of_ended() - before - used < 2.0
    assert answer.code == 130, answer
    assert "points are kept in out.h5.part. Go on with the same command and --resume." in answer.err
    assert not (tmp_path / "out.h5").exists()
    assert "--resume" in call("run", "long.yaml", "-o", "out.h5", code=2).err
    unfinished = call("show", "out.h5.part")
    assert "an unfinished sweep" in unfinished.out
    assert "pending" in unfinished.out
    resumed = call("run", "long.yaml", "-o", "out.h5", "--resume", "--workers", "2")
    assert "were there already" in resumed.err
    call("run", "long.yaml", "-o", "undisturbed.h5", "--quiet")
    assert not different(tmp_path / "out.h5", tmp_path / "undisturbed.h5")


def _processor_seconds(process: int) -> float:
    times = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[11:13]
    return sum(map(int, times)) / os.sysconf("SC_CLK_TCK")


def _processor_seconds_of_ended() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _points(folder: Path) -> int:
    from nsdrill.store import RunLog

    with RunLog.open(folder / "out.h5.part", writable=False) as log:
        return int(log.done().sum())


def test_two_processes_do_not_share_an_output(tmp_path, call):
    (tmp_path / "long.yaml").write_text(LONG_MAP)
    shorter = ("--set", "simulation.transient=150 s")
    first = start("run", "long.yaml", "-o", "out.h5", "--workers", "1", *shorter, cwd=tmp_path)
    while first.poll() is None and not (tmp_path / "out.h5.part").exists():
        time.sleep(0.02)
    first.send_signal(signal.SIGSTOP)  # so that it does not end before the others have begun
    for more in ([], ["--overwrite"], ["--resume"]):
        answer = call("run", "long.yaml", "-o", "out.h5", *more, code=2)
        assert "another process is writing these results" in answer.err
    first.send_signal(signal.SIGCONT)
    assert finish(first).code == 0
    assert read_results(tmp_path / "out.h5").shape == (1, 1, 20, 20)


@pytest.mark.parametrize("kilobytes", [1, 20])
def test_full_disk(call, small, kilobytes):
    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (1024 * kilobytes,) * 2)

    folder = small.parent
    answer = finish(start("run", "small.yaml", "-o", "out.h5", cwd=folder, preexec_fn=limit))
    assert answer.code == 1
    assert "file too large" in answer.err
    assert not (folder / "out.h5").exists()
    # 20 KiB hold the log, so that the points are kept, but not the results.
    kept = kilobytes == 20
    assert ("kept in out.h5.part" in answer.err) == kept
    resumed = call("run", "small.yaml", "-o", "out.h5", "--resume")
    assert ("16 were there already" in resumed.err) == kept


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_folder_that_may_not_be_written(call, small):
    Path("locked").mkdir(mode=0o500)
    assert "may not be written" in call("run", small, "-o", "locked/out.h5", code=2).err


def test_bar_on_a_terminal(tmp_path):
    (tmp_path / "long.yaml").write_text(LONG_MAP)
    pid, terminal = pty.fork()
    if pid == 0:
        os.chdir(tmp_path)
        os.execv(SCRIPT, [SCRIPT, "run", "long.yaml", "-o", "out.h5", "--workers", "1"])
    seen, sent = b"", False
    while True:
        try:
            data = os.read(terminal, 65536)
        except OSError:  # the other end is closed
            break
        if not data:
            break
        seen += data
        if not sent and b"left" in seen:
            os.write(terminal, b"\x03")  # Ctrl-C, as typed
            sent = True
    assert os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) == 130
    assert b"/400" in seen
    assert b"points are kept in out.h5.part" in seen
    assert b"Traceback" not in seen


def test_pace():
    assert pace(0, 100, 5.0) == "starting"
    assert pace(600, 600, 2.0) == "300/s, 0:02 left"
    assert pace(5, 15, 2.5) == "2.0/s, 0:08 left"
    assert pace(10, 350, 120.0) == "5.0/min, 1 h 10 min left"
    assert pace(600, 600, 2.0, carried=True) == "300/s, at least 0:02 left"
