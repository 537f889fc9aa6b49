"""What the fuzzer needs: the command line in this process, and finite JSON."""

import argparse
import json
import math
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click
from click.testing import CliRunner

from nsdrill.cli.main import group
from nsdrill.errors import NsdrillError


class Broken(Exception):
    """What must hold of every example does not hold of this one."""


def command(name: str, *words: object) -> str | None:
    """Standard output of ``nsdrill name words...``, None where it was refused in words;
    Broken for anything else."""
    found = CliRunner().invoke(group, [name, *map(str, words)], standalone_mode=False)
    error = found.exception
    if isinstance(error, NsdrillError | click.ClickException):
        said = error.format_message() if isinstance(error, click.ClickException) else str(error)
        if not said.strip() or not all(line.isprintable() for line in said.split("\n")):
            raise Broken(f"{name}: a message that cannot be printed: {said!r}")
        return None
    if error is not None:
        raise Broken(f"{name} {words[1:]}: {type(error).__name__}: {error}") from error
    return found.stdout


def check_json(text: str | None, *, null: bool = True) -> None:
    """Broken unless ``text`` is JSON with finite numbers; ``null`` says whether a
    number may be undefined."""
    if text is None:
        return
    for value in _leaves(json.loads(text, parse_constant=_refuse)):
        if isinstance(value, float) and not math.isfinite(value):
            raise Broken("a number in the JSON overflows")
        if value is None and not null:
            raise Broken("null in the JSON")


def _refuse(word: str) -> float:
    raise Broken(f"{word} in the JSON")


def _leaves(data: Any) -> Iterator[Any]:
    if isinstance(data, dict | list):
        for value in data.values() if isinstance(data, dict) else data:
            yield from _leaves(value)
    else:
        yield data


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Broken where the block takes longer."""

    def late(signum: int, frame: Any) -> None:
        raise Broken(f"not done after {seconds:g} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def arguments(text: str | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--examples", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first example")
    parser.add_argument("--keep-going", action="store_true", help="count what is broken rather than stop at the first")
    return parser.parse_args()
