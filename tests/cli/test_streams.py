"""Standard streams that are closed, full or read by nobody, inputs that are no files,
and a cache that is damaged."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from pathlib import Path

import pytest
from same_bits import different

from nsdrill.cache import cache_directory

from .helpers import SCRIPT, Answer, Call, finish, start


def shell(text: str, cwd: Path) -> Answer:
    """``text`` in a shell, where $N stands for nsdrill; a command that waits for ever
    ends with TimeoutExpired."""
    env = {**os.environ, "N": SCRIPT, "PYTHONUNBUFFERED": ""}
    done = subprocess.run(
        ["/bin/bash", "-c", f"set -o pipefail; {text}"], cwd=cwd, env=env, capture_output=True, text=True, timeout=120
    )
    assert "Traceback" not in done.stderr
    assert "bug" not in done.stderr
    return Answer(done.returncode, done.stdout, done.stderr)


@pytest.mark.parametrize(
    ("command", "code", "said"),
    [
        ("$N new >&-", 1, "Error: standard output: cannot be written: Bad file descriptor.\n"),
        ("$N new > /dev/full", 1, "Error: standard output: cannot be written: No space left on device.\n"),
        (
            "PYTHONUNBUFFERED=1 $N --version > /dev/full",
            1,
            "Error: standard output: cannot be written: No space left on device.\n",
        ),
        ("$N new >&- 2>&- <&-", 1, ""),
        # More than the 64 KiB of a pipe, so that the writer notices that nobody reads.
        ("$N schema | head -c 1 > /dev/null", 0, ""),
        ("$N show nowhere 2> /dev/full", 2, ""),
        ("$N nothing 2>&-", 2, ""),
    ],
)
def test_output_that_reaches_nobody(tmp_path: Path, command: str, code: int, said: str) -> None:
    assert shell(command, tmp_path) == Answer(code, "", said)


@pytest.mark.parametrize("streams", [">&- 2>&- <&-", "2> /dev/full"])
def test_a_run_that_nobody_listens_to(small: Path, shared: Path, streams: str) -> None:
    """The file is whole, without a word of a library in it, and that is what counts."""
    assert shell(f"$N run {small} -o out.h5 {streams}", small.parent).code == 0
    assert not different(small.parent / "out.h5", shared / "small.h5")


def test_data_come_where_messages_do_not(small: Path) -> None:
    answer = shell(f"$N check {small} 2>/dev/full <&-", small.parent)
    assert answer.code == 0
    assert "valid. Small" in answer.out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["show", "pipe"], "pipe: this is no file."),
        (["plot", "pipe", "-o", "x.png"], "pipe: this is no file."),
        (["check", "pipe"], "pipe: is a pipe, and nobody writes to it"),
        (["run", "STUDY", "-o", "old.h5", "--overwrite"], "old.h5.part: this is no run log of nsdrill"),
        (["show", "socket"], "socket: this is no file."),
        (["check", "socket"], "socket: is a socket"),
        (["show", "/dev/zero"], "/dev/zero: this is no file."),
        (["check", "/dev/zero"], "/dev/zero: is larger than 1 MB"),
    ],
)
def test_inputs_that_are_no_files(call: Call, shared: Path, words: list[str], said: str) -> None:
    os.mkfifo("pipe")
    os.mkfifo("old.h5.part")
    with socket.socket(socket.AF_UNIX) as one:
        one.bind("socket")  # a name that is short
    assert said in call(*(shared / "small.yaml" if word == "STUDY" else word for word in words), code=2).err
    assert sorted(os.listdir()) == ["old.h5.part", "pipe", "socket"]


def test_a_study_from_a_pipe(small: Path) -> None:
    answer = shell(f"$N check <(sleep 0.2; cat {small})", small.parent)
    assert answer.code == 0
    assert "valid. Small" in answer.out


def test_the_end_of_a_file_is_no_interrupt(call: Call, small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """click takes EOFError for one: code 130, with which a job script would go on for
    ever."""

    def ends(*args: object) -> None:
        raise EOFError("Ran out of input")

    monkeypatch.setattr("nsdrill.app.check.check", ends)
    assert "Ran out of input" in call("check", small, code=1).err


def test_a_damaged_cache_is_told_once(shared: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Empty files, as a power cut leaves them; one small function, to be quick."""
    study, whole = shared / "small.yaml", shared / "small.h5"  # whose functions are in the cache
    folder = Path(shutil.copytree(cache_directory(), tmp_path / "compiled"))
    damaged = [path for path in folder.iterdir() if path.name.startswith("right_hand_side")]
    assert damaged
    for path in damaged:
        path.write_bytes(b"")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    first = finish(start("run", study, "-o", "out.h5", "--workers", "1", cwd=tmp_path))
    assert first.code == 0
    warning, done = first.err.splitlines()
    assert warning.startswith(f"Warning: {folder}")
    assert "compiled again" in warning
    assert done.startswith("out.h5: 16 points")
    assert not different(tmp_path / "out.h5", whole)
    assert any(path.stat().st_size for path in damaged), "what this study needs is there again"
