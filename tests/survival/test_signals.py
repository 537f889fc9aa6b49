"""SIGINT, SIGTERM and SIGHUP at any moment: exit code 130 and one sentence, and
--resume gives the undisturbed file."""

import importlib.util
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from same_bits import different

from nsdrill.app.running.run import run_study
from nsdrill.study import load_study

# Short runs of which much is kept, so that the file takes about as long as its points.
STUDY = """
simulation: {transient: 1 s, observe: 1 s}
record: {peaks: 4, poincare: 2000}
sweep:
  wob: {from: 10 kN, to: 100 kN, points: 10}
  rotary_speed: {from: 2 rad/s, to: 8 rad/s, points: 40}
"""


def start(folder: Path, out: str, *more: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "nsdrill", "run", "study.yaml", "-o", out, "--quiet", *more]
    return subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True, start_new_session=True)


def named(part: str) -> Callable[[Path], bool]:
    return lambda folder: any(part in name for name in os.listdir(folder))


def await_heard(process: subprocess.Popen[str]) -> None:
    """Wait until the process has its own answer to SIGTERM; nsdrill is being imported
    by then."""
    if not Path("/proc/self/status").exists():
        time.sleep(1.0)
        return
    while process.poll() is None:
        caught = next(line for line in Path(f"/proc/{process.pid}/status").read_text().splitlines() if "SigCgt" in line)
        if int(caught.split()[1], 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.002)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("signals")
    (folder / "study.yaml").write_text(STUDY)
    run_study(load_study(folder / "study.yaml"), folder / "whole.h5")
    return folder


def after_warnings(said: str) -> str:
    """What a quiet run says after the warnings about its study."""
    return said[max(said.find("Interrupted"), 0) :]


@pytest.mark.parametrize(
    ("number", "moment"),
    [
        pytest.param(signal.SIGINT, lambda folder: True, id="SIGINT, start"),
        pytest.param(signal.SIGHUP, named("out.h5.part"), id="SIGHUP, log"),
        pytest.param(signal.SIGTERM, named(".out.h5.tmp-"), id="SIGTERM, file"),
    ],
)
def test_a_signal_ends_the_run_in_one_sentence(folder, number, moment):
    for _ in range(20):  # on a busy machine a run may end before the moment is seen
        (folder / "out.h5").unlink(missing_ok=True)
        process = start(folder, "out.h5")
        await_heard(process)
        while process.poll() is None and not moment(folder):
            time.sleep(0.002)
        process.send_signal(number)
        said = after_warnings(process.communicate()[1])
        if process.returncode:
            break
    assert process.returncode == 130, said
    assert said.startswith("Interrupted")
    assert said.count("\n") == 1
    assert set(os.listdir(folder)) <= {"study.yaml", "whole.h5", "out.h5.part"}
    assert ("--resume" in said) == (folder / "out.h5.part").exists() or moment(folder)
    run_study(load_study(folder / "study.yaml"), folder / "out.h5", resume=True)
    assert not different(folder / "whole.h5", folder / "out.h5")
    assert sorted(os.listdir(folder)) == ["out.h5", "study.yaml", "whole.h5"]


@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="needs distributed")
def test_no_word_of_dask_where_a_cluster_that_starts_is_interrupted(folder):
    """A terminal sends Ctrl-C to the workers as well."""
    process = start(folder, "dask.h5", "--engine", "dask", "--workers", "2", "--set", "simulation.transient=500s")
    await_heard(process)
    time.sleep(1.5)
    os.killpg(process.pid, signal.SIGINT)
    said = after_warnings(process.communicate()[1])
    assert process.returncode == 130, said
    assert said.startswith("Interrupted")
    assert said.count("\n") == 1
    (folder / "dask.h5.part").unlink(missing_ok=True)


ASK = "import os, signal, sys, time; from nsdrill import interrupt; ask = lambda number: os.kill(os.getpid(), number)\n"


NOTHING = (130, "Interrupted; nothing was written.\n")
# What a process does, its exit code, and what it says.
ACTED_ON = {
    "at once": ("interrupt.listen(); ask(signal.SIGHUP); time.sleep(300)", *NOTHING),
    "inside a library": (
        "import hashlib, threading; interrupt.listen()\n"
        "threading.Timer(0.3, lambda: ask(signal.SIGTERM)).start()\n"
        "hashlib.pbkdf2_hmac('sha256', b'', b'', 10**9)",
        *NOTHING,
    ),
    "by the second one": (
        "interrupt.listen(); interrupt.SECOND_SIGNAL_SECONDS = 0.1\nwith interrupt.interruptible():\n"
        "  ask(signal.SIGINT); time.sleep(0.5); ask(signal.SIGINT); time.sleep(300)",
        *NOTHING,
    ),
    "when patience ends": (
        "interrupt.listen(); interrupt.PATIENCE = interrupt.SECOND_SIGNAL_SECONDS = 0.1\n"
        "with interrupt.interruptible():\n  ask(signal.SIGINT); time.sleep(300)",
        *NOTHING,
    ),
    "when patience ends before a file has its name": (
        "interrupt.listen(); interrupt.PATIENCE = 0.1\n"
        "with interrupt.completing():\n  ask(signal.SIGINT); time.sleep(300)",
        130,
        "Interrupted while the file was being put in place: it is complete, or as it was before.\n",
    ),
    "at a safe place after a long step": (
        "interrupt.listen(); interrupt.PATIENCE = 0.1\ntry:\n with interrupt.interruptible():\n"
        "  with interrupt.undivided(): ask(signal.SIGTERM); time.sleep(0.5); interrupt.PATIENCE = 60.0\n"
        "  interrupt.check()\nexcept KeyboardInterrupt: interrupt.end('told')",
        130,
        "told\n",
    ),
    "at a safe place": (
        "interrupt.listen()\ntry:\n with interrupt.interruptible():\n  ask(signal.SIGTERM); time.sleep(0.5)\n"
        "  print('saved', file=sys.stderr, flush=True); interrupt.check()\n"
        "except KeyboardInterrupt: interrupt.end('told')",
        130,
        "saved\ntold\n",
    ),
    "without errors that come of it": (
        "from nsdrill.cli.main import _leave; interrupt.listen(); leave = os._exit\n"
        "os._exit = lambda code: (time.sleep(0.5), leave(code)); ask(signal.SIGTERM); time.sleep(0.2)\n"
        "_leave('Error: the unfinished file is gone.', 1)",
        *NOTHING,
    ),
    "not once the file is there": (
        "interrupt.listen()\nwith interrupt.completing(): pass\n"
        "ask(signal.SIGTERM); time.sleep(0.5); interrupt.check(); interrupt.ignore_signals(); sys.exit(0)",
        0,
        "",
    ),
    "not while the interpreter ends": (
        "interrupt.listen(); interrupt.ignore_signals()\nfor number in interrupt.SIGNALS: ask(number)\nsys.exit(3)",
        3,
        "",
    ),
    "not under nohup": (
        "signal.signal(signal.SIGHUP, signal.SIG_IGN); interrupt.listen()\n"
        "ask(signal.SIGHUP); time.sleep(0.5); sys.exit(0)",
        0,
        "",
    ),
    "also as the child of one that is deaf to it": (
        "signal.signal(signal.SIGTERM, signal.SIG_IGN); interrupt.listen()\nask(signal.SIGTERM); time.sleep(300)",
        *NOTHING,
    ),
    "nothing from Python": (
        "import nsdrill; nsdrill.run, nsdrill.load_study\n"
        "sys.exit(signal.getsignal(signal.SIGINT) is not signal.default_int_handler)",
        0,
        "",
    ),
}


@pytest.mark.parametrize(("code", "ends", "said"), ACTED_ON.values(), ids=ACTED_ON)
def test_when_a_signal_is_acted_on(code, ends, said):
    done = subprocess.run([sys.executable, "-c", ASK + code], capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stderr) == (ends, said)
