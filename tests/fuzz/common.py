"""What the fuzzer needs: the command line in this process, and finite JSON."""

import argparse
import json
import math
import signal
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import click
from click.testing import CliRunner

from nsdrill.cli.main import group
from nsdrill.errors import CacheWarning, FileWarning, NsdrillError, RunWarning


class Broken(Exception):
    """What must hold of every example does not hold of this one."""


LONGEST = 1600  # characters of a line of a message or of an answer in words


def command(name: str, *words: object, ours: bool = True) -> str | None:
    """Standard output of ``nsdrill name words...``, None where it was refused in words,
    with exit code 2; Broken for anything else, and for warnings of libraries. Not
    ``ours`` is a text that stands in the input, which may have any lines."""
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        found = CliRunner().invoke(group, [name, *map(str, words)], standalone_mode=False)
    for one in warned:
        # numpy's own, of numbers that are made up, are no harm
        if one.category not in (FileWarning, RunWarning, CacheWarning, ResourceWarning, RuntimeWarning):
            raise Broken(f"{name} {words[1:]}: a warning of a library: {one.category.__name__}: {one.message}")
    error = found.exception
    if isinstance(error, NsdrillError | click.ClickException):
        said = error.format_message() if isinstance(error, click.ClickException) else str(error)
        if not said.strip() or not all(line.isprintable() for line in said.split("\n")):
            raise Broken(f"{name}: a message that cannot be printed: {said!r}")
        if max(map(len, said.split("\n"))) > LONGEST or "bug of nsdrill" in said:
            raise Broken(f"{name}: a message that nobody reads: {said[:500]!r}")
        if error.exit_code != 2:
            raise Broken(f"{name} {words[1:]}: exit code {error.exit_code}: {said!r}")
        return None
    if error is not None:
        raise Broken(f"{name} {words[1:]}: {type(error).__name__}: {error}") from error
    for line in found.stdout.split("\n") if ours and "--json" not in words else ():
        if len(line) > LONGEST or not line.isprintable():
            raise Broken(f"{name} {words[1:]}: a line that cannot be read: {line[:500]!r}")
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
