"""A run whose drive, law and feature are of a script is killed and resumed: with that script it
ends with the same bits, and with another meaning of any of the three it is refused."""

import signal
import subprocess
import sys
from functools import partial

import pytest
from cli.helpers import call_here
from interrupts import look_often
from same_bits import different

from nsdrill import load_study
from nsdrill.app.running.run import Interrupted, run_study
from nsdrill.models import friction, own_drives, registry
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
simulation: {transient: 5 s, observe: 5 s}
record: {peaks: 4}
sweep:
  wob: {from: 10 kN, to: 100 kN, points: 8}
  rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 8}
"""
COMMAND = ["run", "study.yaml", "--with", "own.py", "--quiet", "--workers", "2"]
# A run that looks up often, and is killed, with all processes that it started, as soon as
# it has kept a point.
KILLED = """
import os, signal, sys

import own
from nsdrill import load_study
from nsdrill.app.running.run import run_study
from nsdrill.kernel import batch
from nsdrill.sweep import engine

engine.QUANTUM, batch.STEPS_PER_CALL = 1e-6, 2_000

def kill(progress):
    if progress.done:
        os.killpg(0, signal.SIGKILL)

run_study(load_study("study.yaml"), "out.h5", workers=1, lanes=8, watch=kill)
"""
# Each changes what one of the three computes, and no name.
MEANINGS = {
    "drive": ("k_p * (drive_speed - set_speed)", "1.1 * k_p * (drive_speed - set_speed)"),
    "number of the drive": ("number(900.0", "number(901.0"),
    "law": ("1.0 + n.decay", "1.5 + n.decay"),
    "feature": ("return bit_speed * bit_torque", "return 2.0 * bit_speed * bit_torque"),
}


def points(log):
    """How many points the log of an unfinished run holds."""
    with RunLog.open(log, writable=False) as opened:
        return int(opened.done().sum())


def forget():
    """What the script declared is unknown again, as in another process."""
    sys.modules.pop("own", None)
    own_drives.withdraw_drives("written")
    friction.withdraw_laws("again")
    registry.withdraw_features(*registry.NAMES)


@pytest.fixture
def folder(tmp_path, script, monkeypatch):
    """A study and its script, which this process has executed too, as it reads the log; each
    run there looks up often."""
    monkeypatch.chdir(tmp_path)
    look_often(monkeypatch, 2_000)
    script(SCRIPT, "own")
    (tmp_path / "study.yaml").write_text(STUDY)
    return tmp_path


def interrupted(folder):
    """How many points the run in ``folder`` has that went on and was interrupted once it
    had added some."""

    def watch(progress):
        if progress.done:
            raise KeyboardInterrupt

    study = load_study(folder / "study.yaml")
    with pytest.raises(Interrupted):
        run_study(study, folder / "out.h5", resume=True, workers=1, lanes=8, watch=watch)
    return points(part_path(folder / "out.h5"))


def test_a_killed_run_with_parts_of_a_script_ends_with_the_same_bits(folder, script):
    run_study(load_study(folder / "study.yaml"), folder / "whole.h5", workers=1)
    killed = subprocess.run([sys.executable, "-c", KILLED], cwd=folder, capture_output=True, start_new_session=True)
    assert killed.returncode == -signal.SIGKILL, killed.stderr.decode()
    done = points(part_path(folder / "out.h5"))
    assert done > 0
    for _ in range(2):
        before, done = done, interrupted(folder)
        assert done > before, "points that were safe are gone"
    # words of the script mean nothing
    text = (folder / "own.py").read_text()
    assert text.count("    return bit_speed") == 1
    (folder / "own.py").write_text(text.replace("    return bit_speed", "    # its power\n    return bit_speed"))
    command = [sys.executable, "-m", "nsdrill", *COMMAND, "-o", "out.h5", "--resume"]
    resumed = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=600)
    assert resumed.returncode == 0, resumed.stderr
    assert "Traceback" not in resumed.stderr
    assert not different(folder / "whole.h5", folder / "out.h5")


def test_a_script_with_another_meaning_does_not_go_on_with_the_run(folder, capfd, monkeypatch):
    assert interrupted(folder) > 0
    call = partial(call_here, capfd, monkeypatch, *COMMAND, "-o", "out.h5", "--resume")
    kept, text = part_path(folder / "out.h5").read_bytes(), (folder / "own.py").read_text()
    for what, (old, new) in MEANINGS.items():
        assert text.count(old) == 1, what
        forget()
        (folder / "own.py").write_text(text.replace(old, new))
        said = " ".join(call(code=2).err.split())
        changed = "CHANGED SINCE THE RUNS: the script of its model, drive or law"
        assert changed in said or "made from another study" in said, (what, said)
        assert part_path(folder / "out.h5").read_bytes() == kept, what
    forget()
    (folder / "own.py").write_text(text)
    call()
    assert not part_path(folder / "out.h5").exists()
