"""A run whose drive, law and feature are of a script is killed and resumed: with that script it
ends with the same bits, and with another meaning of any of the three it is refused."""

import os
import signal
import subprocess
import sys
import time

import pytest
from same_bits import different

from nsdrill.errors import FileError
from nsdrill.store import RunLog, part_path

SCRIPT = """
import nsdrill
from nsdrill import number
from nsdrill.equations.library import direction

@nsdrill.drive
def written(lag, drive_speed, set_speed, *, k_i=number(900.0, "N m/rad"), k_p=number(1500.0, "N m s/rad")):
    return -(k_i * lag + k_p * (drive_speed - set_speed))

@nsdrill.law(fall=lambda n: n.rise * n.decay)
def again(v, n):
    return direction(n.smoothing * v) * (n.rise / (1.0 + n.decay * abs(v)) + n.dynamic)

@nsdrill.feature("christoforou_yigit", "bit_power", "W", "power of the bit")
def bit_power(bit_speed, bit_torque):
    return bit_speed * bit_torque
"""
STUDY = """
drive: {kind: written}
bit: {friction: {law: again}}
simulation: {transient: 1500 s, observe: 50 s}
record: {peaks: 4}
sweep:
  wob: {from: 10 kN, to: 100 kN, points: 24}
  rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 24}
"""
KILLS = 3
COMMAND = [sys.executable, "-m", "nsdrill", "run", "study.yaml", "--with", "own.py", "--quiet", "--workers", "2"]
# Each changes what one of the three computes, and no name.
MEANINGS = {
    "drive": ("k_p * (drive_speed - set_speed)", "1.1 * k_p * (drive_speed - set_speed)"),
    "number of the drive": ("number(900.0", "number(901.0"),
    "law": ("1.0 + n.decay", "1.5 + n.decay"),
    "feature": ("return bit_speed * bit_torque", "return 2.0 * bit_speed * bit_torque"),
}


def begin(folder, out, *more):
    environment = {**os.environ, "PYTHONPATH": ""}
    command = [*COMMAND, "-o", out, *more]
    return subprocess.Popen(command, cwd=folder, env=environment, stderr=subprocess.PIPE, start_new_session=True)


def ended(process):
    """Its exit code and its messages, in one line."""
    said = process.communicate(timeout=600)[1].decode()
    assert "Traceback" not in said
    return process.returncode, " ".join(said.split())


def points(log):
    """How many points the log of a run, dead or alive, holds."""
    try:
        with RunLog.open(log, writable=False) as opened:
            return int(opened.done().sum())
    except FileError:  # not there yet
        return 0


def killed(folder, name):
    """How many points a run had that was killed once it had added some."""
    log = part_path(folder / name)
    before, process = points(log), begin(folder, name, "--resume")
    while process.poll() is None and points(log) <= before:
        time.sleep(0.01)
    assert process.poll() is None, ended(process)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    return points(log)


@pytest.fixture
def folder(tmp_path, script):
    """A study and its script, which this process has executed too, as it reads the log."""
    script(SCRIPT, "own")
    (tmp_path / "own.py").write_text(SCRIPT)
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path


def test_a_killed_run_with_parts_of_a_script_ends_with_the_same_bits(folder):
    assert ended(begin(folder, "whole.h5"))[0] == 0
    done = 0
    for _ in range(KILLS):
        before, done = done, killed(folder, "out.h5")
        assert done > before, "points that were safe are gone"
    # words of the script mean nothing
    (folder / "own.py").write_text(SCRIPT.replace("    return bit_speed", "    # its power\n    return bit_speed"))
    assert ended(begin(folder, "out.h5", "--resume"))[0] == 0
    assert not different(folder / "whole.h5", folder / "out.h5")


def test_a_script_with_another_meaning_does_not_go_on_with_the_run(folder):
    assert killed(folder, "out.h5") > 0
    kept = part_path(folder / "out.h5").read_bytes()
    for what, (old, new) in MEANINGS.items():
        assert old in SCRIPT
        (folder / "own.py").write_text(SCRIPT.replace(old, new))
        code, said = ended(begin(folder, "out.h5", "--resume"))
        assert code == 2, what
        assert "made with other versions" in said or "made from another study" in said, (what, said)
        assert part_path(folder / "out.h5").read_bytes() == kept, what
    (folder / "own.py").write_text(SCRIPT)
    code, said = ended(begin(folder, "out.h5", "--resume"))
    assert code == 0, said
