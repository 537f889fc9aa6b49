"""Standard streams that may be closed, full, or read by nobody."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any, NoReturn

import click

from nsdrill.errors import CacheWarning


class Leave(Exception):
    """Leave with this message and exit code. click has ideas of its own about an
    interrupt and a closed pipe."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.message, self.code = message, code


class _Stream:
    """A standard stream whose errors go to ``lost``, so that they are not taken for
    those of a file."""

    def __init__(self, stream: Any, lost: Callable[[OSError], None]) -> None:
        self._stream, self._lost = stream, lost

    def write(self, text: str) -> int:
        try:
            self._stream.write(text)
        except OSError as error:
            self._lost(error)
        return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError as error:
            self._lost(error)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def standard_streams() -> Iterator[None]:
    """Data that cannot be written raise :class:`Leave`; a message that reaches nobody
    stops nothing. Warnings about the cache become messages."""
    _open_closed()
    data, messages = sys.stdout, sys.stderr
    with (
        redirect_stdout(_Stream(data, _output_lost)),
        redirect_stderr(_Stream(messages, lambda error: None)),
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("always", CacheWarning)
        otherwise = warnings.showwarning

        def show(message: Any, category: type[Warning], *where: Any, **more: Any) -> None:
            if issubclass(category, CacheWarning):
                click.echo(f"Warning: {message}", err=True)
            else:
                otherwise(message, category, *where, **more)

        warnings.showwarning = show
        try:
            yield
        finally:
            for stream in (data, messages):
                try:
                    stream.flush()
                except OSError:  # which the end of the process would meet again
                    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _open_closed() -> None:
    """Give closed streams their numbers back: else the next file opened has one, and
    what a library prints is in it. Output is opened for reading, so data that reach
    nobody are still an error."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            # the lowest number free
            null = os.open(os.devnull, os.O_RDWR if name == "stderr" else os.O_RDONLY)
            os.set_inheritable(null, True)
            setattr(sys, name, open(null, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115


def _output_lost(error: OSError) -> NoReturn:
    if isinstance(error, BrokenPipeError):
        raise Leave("", 0) from error  # the reader has seen enough (`| head`)
    raise Leave(f"Error: standard output: cannot be written: {error.strerror}.", 1) from error
