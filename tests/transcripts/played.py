"""A transcript: lines of a shell, each with what came of it.

``$ `` stands before a command, ``! `` before a line of standard error, ``= `` before an
exit code other than 0, ``-- `` before a remark; all else is standard output. Times,
versions and what else differs from one machine to the next are words in ``<>``.
"""

import re
import shlex
import subprocess
from collections.abc import Callable
from pathlib import Path

from cli.helpers import Answer

COMMAND, REMARK = "$ ", "-- "
REPLACED = (
    (r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(\.\d+)?( UTC|Z|[+-]\d\d:?\d\d)?", "<time>"),
    (r"\d{4}-\d\d-\d\d", "<date>"),
    (r"(nsdrill |version |version = \{)\d+\.\d+\.\d+[\w+]*(\.\w+)*", r"\1<version>"),
    (r"\b[0-9a-f]{64}\b", "<digest>"),
    (r"(stored_eof = )\d+", r"\1<bytes>"),
    (r"(steps in) [\d.]+ \w+", r"\1 <seconds>"),
)
"""What differs, as patterns, with what stands in its place."""


def written(transcript: str, call: Callable[..., Answer], folder: Path) -> str:
    """The transcript of the same commands, given by ``call`` in this folder."""
    parts = []
    for line in transcript.splitlines(keepends=True):
        if line.startswith(COMMAND):
            parts.append(line + _played(line.removeprefix(COMMAND).strip(), call, folder) + "\n")
        elif line.startswith(REMARK):
            parts.append(line)
    return "".join(parts)


def _played(line: str, call: Callable[..., Answer], folder: Path) -> str:
    if line.startswith("nsdrill "):
        answer = call(*shlex.split(line.removeprefix("nsdrill ")), code=None)
    else:
        done = subprocess.run(["/bin/sh", "-c", line], cwd=folder, capture_output=True, text=True, check=True)
        answer = Answer(0, done.stdout, done.stderr)
    lines = [*answer.out.splitlines(), *(f"! {text}" for text in answer.err.splitlines())]
    assert not [text for text in lines if text.startswith((COMMAND, REMARK))]
    if answer.code:
        lines.append(f"= {answer.code}")
    return _without_what_differs("".join(f"{text.rstrip()}\n" for text in lines), folder)


def _without_what_differs(text: str, folder: Path) -> str:
    text = text.replace(str(folder), "<folder>")
    for pattern, words in REPLACED:
        text = re.sub(pattern, words, text)
    return text
