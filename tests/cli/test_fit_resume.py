"""An interrupted fit goes on: with the same bits as one that was not, and only with the
runs that are missing."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import nsdrill
from nsdrill.analysis.fitting import Measured
from nsdrill.app.running.unfinished import Part, Rounds, summary
from nsdrill.errors import FileError, InputError
from nsdrill.store.log_format import MAGIC as LOG_MAGIC

from .helpers import finish, start

STUDY = """\
model: torsion
simulation: {transient: 20 s, observe: 20 s}
uncertain:
  bit.friction.static: {uniform: [0.2, 0.8]}
  bit.friction.dynamic: {uniform: [0.05, 0.2]}
"""
DATA = """\
rotary_speed [rad/s], wob [kN], stick_slip_index [%], surface_torque_max [kN*m]
2, 30, 150, 4
4, 50, 60, 4
9, 60, 3, 2
"""
HOW = {"batch": 16, "rounds": 4, "samples": 16}
OPTIONS = [word for name, value in HOW.items() for word in (f"--{name}", value)]


@pytest.fixture(autouse=True)
def inputs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("study.yaml").write_text(STUDY, encoding="utf-8")
    Path("rig.csv").write_text(DATA, encoding="utf-8")


def fit_until(runs: int, path: str = "adjusted.yaml", **more: object) -> int:
    """Fit; an interrupt comes as soon as so many runs are done. Gives how many this
    call has made."""
    made = 0

    def tell(progress: nsdrill.Progress) -> None:
        nonlocal made
        made = progress.done
        if progress.done >= runs:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match=r"runs are kept in adjusted.yaml.part.*resume=True"):
        nsdrill.fit("study.yaml", "rig.csv", path, progress=tell, **{**HOW, **more})
    return made


def test_a_fit_goes_on_with_the_same_bits():
    whole = nsdrill.fit("study.yaml", "rig.csv", progress=False, **HOW)
    first = 3 * 2 * HOW["batch"]  # the first round, three operating points
    fit_until(first + 1)
    assert Path("adjusted.yaml.part").exists()
    assert not Path("adjusted.yaml").exists()
    seen = []
    fit_until(first + 100, resume=True)  # once more, in a later round
    again = nsdrill.fit(
        "study.yaml",
        "rig.csv",
        "adjusted.yaml",
        resume=True,
        workers=1,
        progress=lambda progress: seen.append(progress.done),
        **HOW,
    )
    assert min(seen) >= first  # the runs of the first round were not made again
    assert again.study == whole.study == Path("adjusted.yaml").read_text(encoding="utf-8")
    assert again.note == whole.note
    assert not Path("adjusted.yaml.part").exists()


def test_only_the_runs_that_are_missing_are_made():
    calls = []

    def model(z):
        calls.append(len(z))
        if len(calls) == 3:
            raise KeyboardInterrupt
        return z * z

    study = nsdrill.load_study("study.yaml")
    values = {"stick_slip_index": np.ones(3)}
    measured = Measured("made up", {"wob": np.ones(3)}, values, values, ("a", "b", "c"))
    samples = [np.full((n, 2), float(n)) for n in (5, 4, 3)]
    kept = Rounds.beside("new.yaml", study, measured, 16)

    def fit():
        with kept.guarding():
            return [remembered(z).tolist() for z in samples]

    remembered = kept.recording(model)
    with pytest.raises(KeyboardInterrupt, match="27 runs are kept"):
        fit()
    kept = Rounds.beside("new.yaml", study, measured, 16, resume=True)
    remembered = kept.recording(model)
    assert fit() == [(z * z).tolist() for z in samples]
    assert calls == [5, 4, 3, 3]
    with pytest.raises(FileError, match="not those that these versions"):
        Rounds.beside("new.yaml", study, measured, 16, resume=True).recording(model)(samples[1])


def test_more_rounds_go_on_from_fewer():
    """A round does not know how many there may be."""
    whole = nsdrill.fit("study.yaml", "rig.csv", progress=False, **{**HOW, "rounds": 5})
    fit_until(3 * (2 * 16 + 20 + 16) + 1, rounds=3)
    again = nsdrill.fit("study.yaml", "rig.csv", "adjusted.yaml", resume=True, progress=False, **{**HOW, "rounds": 5})
    assert again.study == whole.study


def test_what_is_there_is_not_taken_for_another_fit(call):
    fit_until(3 * 2 * 16 + 1)
    part = Path("adjusted.yaml.part").read_bytes()
    words = ("fit", "study.yaml", "--data", "rig.csv", "-o", "adjusted.yaml", "--quiet", *OPTIONS)
    assert "adjusted.yaml.part: an unfinished fit is there. Go on with it by --resume, or" in call(*words, code=2).err
    for other in (("--set", "uncertain.seed=2"), ("--error", "stick_slip_index=20"), ("--batch", "20")):
        answer = call(*words, "--resume", *other, code=2)
        assert "made from another study, from other data or with another --batch" in answer.err
    call(*words, "--resume", "--overwrite", code=2)
    assert Path("adjusted.yaml.part").read_bytes() == part
    assert not Path("adjusted.yaml").exists()
    answer = call("run", "study.yaml", "--set", "sweep={wob: [10 kN]}", "-o", "adjusted.yaml", "--resume", code=2)
    assert "adjusted.yaml.part" in answer.err
    call(*words, "--overwrite")
    assert not Path("adjusted.yaml.part").exists()
    assert "adjusted.yaml: this fit is finished; nothing is left to run" in call(*words, "--resume", code=2).err


CHANGES = {
    "a number": lambda members: {**members, "samples_0": 2.0 * members["samples_0"]},
    "a shape": lambda members: {**members, "samples_0": members["samples_0"][None]},
    "a member less": lambda members: {name: values for name, values in members.items() if name != "samples_0"},
    "its head": lambda members: {
        **members,
        "head": np.frombuffer(members["head"].tobytes().replace(b"told", b"tale"), np.uint8),
    },
    "its seal": lambda members: {**members, "seal": members["seal"][:-1]},
}


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize("what", ["fit", "continuation"])
def test_a_part_file_that_was_changed_is_refused(call, what, change):
    out = {"fit": "out.yaml", "continuation": "out.h5"}[what]
    with Part.claim(out, what, "torsion", overwrite=False, resume=False) as part:
        part.write("digest", 1, {"samples_0": np.ones(3)}, "9 of them")
    with np.load(part.path) as file:
        members = {name: file[name] for name in file.files}
    with part.path.open("wb") as file:
        np.savez(file, **change(members))
    before = part.path.read_bytes()
    Path("b.yaml").write_text("model: torsion\ncontinue: {along: rotary_speed, from: 2 rad/s, to: 3 rad/s}\n")
    resume = {"fit": ("fit", "study.yaml", "--data", "rig.csv"), "continuation": ("branches", "b.yaml")}[what]
    for words in (("show", part.path), ("plot", part.path, "-o", "a.png"), (*resume, "-o", out, "--resume")):
        if words[0] == "plot" and what == "fit":
            continue  # of a fit nothing is drawn
        said = call(*words, code=2).err
        assert f"{out}.part: cannot be read as an unfinished {what}" in said, words
        assert "it was changed after it was written. Start anew" in said, words
    assert part.path.read_bytes() == before


@pytest.mark.parametrize(
    ("damage", "said", "replaced"),
    [
        (b"", "cannot be read as an unfinished fit", True),
        (b"PK\x03\x04 cut off", "cannot be read as an unfinished fit", True),
        (b"no file of ours\n" * 100, "this is no unfinished fit of nsdrill, though it has", False),
        (LOG_MAGIC, "the log of an unfinished run, no fit. Finish that first", False),
        ("continuation", "an unfinished continuation, no fit. Finish that first", False),
    ],
)
@pytest.mark.parametrize("option", ["", "--resume", "--overwrite"])
def test_a_damaged_file_and_that_of_other_work_are_told(call, damage, said, replaced, option):
    part = Path("adjusted.yaml.part")
    if damage == "continuation":
        with Part.claim("adjusted.yaml", damage, "torsion", overwrite=False, resume=False) as other:
            other.write("digest", None, {}, "2 branches")
    else:
        part.write_bytes(damage)
    before = part.read_bytes()
    words = ("fit", "study.yaml", "--data", "rig.csv", "-o", "adjusted.yaml", "--quiet", *OPTIONS)
    starts_anew = replaced and option == "--overwrite"
    answer = call(*words, *[option] * bool(option), code=0 if starts_anew else 2)
    if starts_anew:
        return
    assert f"adjusted.yaml.part: {said}" in answer.err
    assert part.read_bytes() == before


def test_very_many_runs_are_asked_for(call):
    rows = "2, 30, 150, 4\n" * 1000
    Path("rig.csv").write_text(DATA.splitlines()[0] + "\n" + rows, encoding="utf-8")
    answer = call("fit", "study.yaml", "--data", "rig.csv", "-o", "adjusted.yaml", code=2)
    # 1000 points, 10 rounds of 128 samples, two features of 8 bytes
    assert "1000 operating points, each with up to 1280 samples: 1 280 000 runs of 40 s" in answer.err
    assert "20.5 MB of memory and of the disk; allowed: up to 1 000 000 runs" in answer.err
    assert "--large" in answer.err
    assert not Path("adjusted.yaml.part").exists()


def test_nothing_is_kept_without_an_output(call):
    assert "--resume: found without -o" in call("fit", "study.yaml", "--data", "rig.csv", "--resume", code=2).err
    with pytest.raises(InputError, match="resume: found without path"):
        nsdrill.fit("study.yaml", "rig.csv", resume=True)
    with pytest.raises(KeyboardInterrupt, match="nothing was written"):
        nsdrill.fit("study.yaml", "rig.csv", progress=interrupt, **HOW)
    assert sorted(one.name for one in Path().iterdir()) == ["rig.csv", "study.yaml"]


def interrupt(progress: nsdrill.Progress) -> None:
    raise KeyboardInterrupt


def has_state(part):
    found = summary(part)
    return bool(found and found["kept"])


def test_a_signal_ends_the_command_with_130_and_it_goes_on(call):
    words = ["fit", "study.yaml", "--data", "rig.csv", "-o", "adjusted.yaml", "--batch", "100", "--rounds", "40"]
    words += ["--set", "simulation.observe=600 s"]
    process = start(*words)
    until = time.monotonic() + 120.0
    while not has_state("adjusted.yaml.part") and time.monotonic() < until:
        assert process.poll() is None, process.communicate()
        time.sleep(0.02)
    process.send_signal(signal.SIGSTOP)
    for option in ((), ("--resume",), ("--overwrite",)):
        answer = call(*words, *option, code=2)
        assert "adjusted.yaml.part: another process is writing these results now" in answer.err
    process.send_signal(signal.SIGINT)
    process.send_signal(signal.SIGCONT)
    answer = finish(process)
    assert answer.code == 130, answer.err
    assert "runs are kept in adjusted.yaml.part. Go on with the same command and --resume." in answer.err
    assert not Path("adjusted.yaml").exists()
    call(*words, "--resume", "--rounds", 2, "--quiet")
    assert nsdrill.load_study("adjusted.yaml").samples == 128


AT_ONCE = """\
import os, signal, sys, time

from nsdrill.cli.main import main

replace, number = os.replace, 0
def interrupted(source, target):
    global number
    replace(source, target)
    number += str(target).endswith(".part")
    if number == NUMBER:
        os.kill(os.getpid(), signal.NAME)
        time.sleep(1.0)  # the thread that ends the process has the time to do it
os.replace = interrupted
main()
"""


@pytest.mark.parametrize(("number", "name"), [(1, "SIGINT"), (2, "SIGTERM")])
def test_a_signal_just_after_a_round_is_kept_is_told_so(number, name):
    words = ["fit", "study.yaml", "--data", "rig.csv", "-o", "adjusted.yaml", *map(str, OPTIONS)]
    code = AT_ONCE.replace("NUMBER", str(number)).replace("NAME", name)
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 130, done.stderr
    kept = summary("adjusted.yaml.part")["kept"]
    assert f"{kept} are kept in adjusted.yaml.part. Go on with the same command and --resume." in done.stderr
    assert not Path("adjusted.yaml").exists()


SLOW = """\
import os, signal, sys, time

from nsdrill import interrupt
from nsdrill.cli.main import main

replace, number = os.replace, 0
def slow(source, target):
    global number
    number += str(target).endswith(".part")
    late = number == 2 and WHEN == "late"
    if not late:
        replace(source, target)
    if number == 2:
        interrupt.PATIENCE = 0.2
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(60.0)
    if late:
        replace(source, target)
os.replace = slow
main()
"""


@pytest.mark.parametrize("when", ["early", "late"])
def test_what_is_told_is_in_the_file_where_its_rename_takes_longer_than_one_waits(when):
    """``early`` the file has its name long before the system says so."""
    words = ["fit", "study.yaml", "--data", "rig.csv", "-o", "adjusted.yaml", *map(str, OPTIONS)]
    code = SLOW.replace("WHEN", repr(when))
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 130, done.stderr
    kept = summary("adjusted.yaml.part")["kept"]
    assert f"{kept} are kept in adjusted.yaml.part. Go on with the same command and --resume." in done.stderr
    assert sorted(one.name for one in Path().iterdir()) == ["adjusted.yaml.part", "rig.csv", "study.yaml"]
