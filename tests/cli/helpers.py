"""Commands as a user gives them: in this process where that is enough, in one of their
own where it is not."""

import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from nsdrill.cli.main import main

SCRIPT = str(Path(sys.executable).with_name("nsdrill"))
Call = Callable[..., "Answer"]


@dataclass
class Answer:
    code: int
    out: str
    err: str


def call_here(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, *words: object, code: int | None = 0
) -> Answer:
    """``nsdrill words...`` in this process, which ends with this exit code, or with any if
    that is None. Words in one string are separated as by a shell."""
    separate = shlex.split(words[0]) if len(words) == 1 and isinstance(words[0], str) else map(str, words)
    monkeypatch.setattr(sys, "argv", ["nsdrill", *separate])
    capfd.readouterr()
    with pytest.raises(SystemExit) as end:
        main()
    out, err = capfd.readouterr()
    assert "Traceback" not in out + err
    found = int(end.value.code or 0)
    assert code in (found, None), out + err
    return Answer(found, out, err)


def start(*words: object, cwd: Path | None = None, **more: object) -> subprocess.Popen[str]:
    """``nsdrill words...`` in a process of its own."""
    return subprocess.Popen(
        [SCRIPT, *map(str, words)],
        cwd=cwd,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "COLUMNS": "100"},
        **more,
    )


def finish(process: subprocess.Popen[str]) -> Answer:
    out, err = process.communicate(timeout=120)
    assert "Traceback" not in out + err, err
    return Answer(process.returncode, out, err)


def unwrapped(text: str) -> str:
    """Words that are broken into lines, in one."""
    return " ".join(text.split())


def changed(*changes: str) -> list[str]:
    """The words that change keys of a study: ``--set`` before each of them."""
    return [word for change in changes for word in ("--set", change)]
