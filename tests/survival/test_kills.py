"""Kill a sweep at random moments, resume it, and demand the very file of an undisturbed
run.

``NSDRILL_KILLS`` sets how many kills each sweep takes (default 3), ``NSDRILL_SEED`` the
moments.
"""

import importlib.util
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from same_bits import different

from nsdrill.app.running.run import run_study
from nsdrill.errors import FileError
from nsdrill.store import RunLog, open_branches, part_path, read_results
from nsdrill.study import load_study, parse_study
from nsdrill.variables import INFERRED, OK

KILLS = int(os.environ.get("NSDRILL_KILLS", "3"))
SEED = int(os.environ.get("NSDRILL_SEED", "1"))
COMMAND = [sys.executable, "-c", "from nsdrill.cli.main import main; main()"]

# Some seconds of work each: the kills are to come in the middle.
GRID = """
simulation: {transient: 150 s, observe: 50 s}
record: {peaks: 4}
sweep:
  wob: {from: 10 kN, to: 100 kN, points: 24}
  rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 20}
"""
CHAINS = """
simulation: {transient: 120 s, observe: 30 s}
record: {peaks: 4}
sweep:
  wob: {from: 10 kN, to: 100 kN, points: 9}
  rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 25}
  procedure: all
  along: rotary_speed
"""
REFINED = """
simulation: {transient: 100 s, observe: 30 s, verify: true}
record: {peaks: 4}
sweep:
  wob: {from: 10 kN, to: 100 kN, points: 8}
  rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 7}
  refine: 2
"""


def start(study: Path, out: Path, *more: str) -> subprocess.Popen[bytes]:
    command = [*COMMAND, "run", str(study), "-o", str(out), "--quiet", "--workers", "2", *more]
    return subprocess.Popen(command, stderr=subprocess.PIPE, start_new_session=True)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The results of a study that nothing has disturbed, run once."""
    folder, made = tmp_path_factory.mktemp("undisturbed"), dict[str, Path]()

    def results(text):
        if text not in made:
            made[text] = folder / f"{len(made)}.h5"
            run_study(parse_study(text), made[text], workers=2)
        return made[text]

    return results


def points_in(log_path: Path) -> int:
    """How many points the log of a run, dead or alive, holds."""
    try:
        with RunLog.open(log_path, writable=False) as log:
            return int(log.done().sum())
    except FileError:  # not there yet
        return 0


def await_points(process: subprocess.Popen[bytes], out: Path, count: int) -> None:
    """Wait until the run has more than ``count`` points or has ended, however long the
    machine takes."""
    while process.poll() is None and points_in(part_path(out)) <= count:
        time.sleep(0.01)


def kill_all(process: subprocess.Popen[bytes]) -> None:
    """Kill the process and everything it started (a cluster's workers)."""
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.mark.parametrize(
    ("text", "more"),
    [
        pytest.param(GRID, (), id="grid"),
        pytest.param(CHAINS, (), id="chains"),
        pytest.param(REFINED, (), id="refined and checked"),
        pytest.param(
            CHAINS,
            ("--engine", "dask"),
            id="chains-dask",
            marks=pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="needs distributed"),
        ),
    ],
)
def test_a_killed_sweep_ends_with_the_same_bits(tmp_path, undisturbed, text, more):
    study, out = tmp_path / "study.yaml", tmp_path / "out.h5"
    study.write_text(text)
    whole = undisturbed(text)
    status = read_results(whole)["status"]
    assert np.isin(status, (OK, INFERRED)).all()
    points = status.size
    rng = random.Random(SEED)
    wanted = KILLS if not more else max(1, KILLS // 3)
    kills, attempts, gained, before = 0, 0, 0, 0
    while kills < wanted:
        attempts += 1
        assert attempts <= 4 * wanted + 4, "nearly every run ended before it could be killed"
        process = start(study, out, "--resume", *more)
        if kills % 3 == 2:  # at any time, mostly before there is a point
            time.sleep(rng.uniform(0.0, 2.0))
        else:  # while points are being saved
            await_points(process, out, rng.randint(before, before + (points - before) // 2))
            time.sleep(rng.uniform(0.0, 0.1))
        if process.poll() is not None:
            assert process.returncode == 0, process.stderr.read().decode() if process.stderr else ""
            out.unlink()  # done before the kill: once more from the start
            before = 0
            continue
        kill_all(process)
        kills += 1
        if out.exists():  # killed after its last act
            out.unlink()
            before = 0
        elif part_path(out).exists():
            done = points_in(part_path(out))
            assert done >= before, "points that were safe are gone"
            gained += done - before
            before = done
    run_study(load_study(study), out, workers=1, resume=True)
    assert not part_path(out).exists()
    assert not different(whole, out)
    assert gained > 0, "every kill came before the first point: the test tested nothing"


BRANCHES = """
model: torsion
operation: {depth: 5000 m, wob: 22.24 kN}
simulation: {transient: 50 s, observe: 50 s}
continue: {along: rotary_speed, from: 1.5 rad/s, to: 6 rad/s, seeds: {rotary_speed: [1.7 rad/s, 5 rad/s]}, points: 150}
"""
FIT = """
model: torsion
simulation: {transient: 100 s, observe: 50 s}
uncertain: {bit.friction.static: {uniform: [0.2, 0.8]}, bit.friction.dynamic: {uniform: [0.05, 0.2]}}
"""
DATA = "rotary_speed [rad/s], wob [kN], stick_slip_index [%]\n2, 30, 150\n4, 50, 60\n9, 60, 3\n"
WORK = {
    "branches": (BRANCHES, "out.h5", ("branches", "--workers", "1")),
    "fit": (FIT, "out.yaml", ("fit", "--data", "rig.csv", "--batch", "64", "--rounds", "6", "--samples", "32")),
}


@pytest.mark.parametrize(("text", "name", "words"), WORK.values(), ids=WORK)
def test_killed_work_ends_with_the_same_bits(tmp_path, text, name, words):
    """A continuation and a fit, ended at any time: by SIGKILL, or by a signal that they
    hear."""
    (tmp_path / "study.yaml").write_text(text)
    (tmp_path / "rig.csv").write_text(DATA)
    command = [*COMMAND, words[0], "study.yaml", *words[1:]]

    def begin(out: str, *more: str) -> subprocess.Popen[bytes]:
        inputs = [*command, "-o", out, *more]
        return subprocess.Popen(inputs, cwd=tmp_path, stderr=subprocess.PIPE, start_new_session=True)

    started = time.monotonic()
    assert begin(f"whole_{name}").wait() == 0
    took, rng, out = time.monotonic() - started, random.Random(SEED), tmp_path / name

    for number in (signal.SIGKILL, signal.SIGINT, signal.SIGTERM, *[signal.SIGKILL] * (KILLS - 3)):
        process, deadline = begin(name, "--resume"), time.monotonic() + rng.uniform(0.3, 1.1) * took
        while process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.01)
        process.send_signal(number)
        assert process.wait() in (0, -number, 130)

        out.unlink(missing_ok=True)
    assert begin(name, "--resume").wait() == 0
    assert not part_path(out).exists()
    if out.suffix == ".h5":
        one, two = open_branches(tmp_path / f"whole_{name}"), open_branches(out)
        assert all(one[key].equals(two[key]) for key in one.variables)
    else:
        assert out.read_bytes() == (tmp_path / f"whole_{name}").read_bytes()
