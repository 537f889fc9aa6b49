"""Standard streams that may be closed, full, or a pipe without a reader."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from typing import Any, NoReturn, TextIO

import click

from nsdrill.errors import CacheWarning, RunWarning


class CommandExit(Exception):
    """End the command with this message and exit code. click would choose its own for
    an interrupt or a closed pipe."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.message, self.code = message, code


class _Stream:
    """A standard stream whose errors go to ``on_error``, so that they are not mistaken
    for those of a file."""

    def __init__(self, stream: TextIO, on_error: Callable[[OSError], None]) -> None:
        self._stream, self._on_error = stream, on_error

    def write(self, text: str) -> int:
        try:
            self._stream.write(text)
        except OSError as error:
            self._on_error(error)
        return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError as error:
            self._on_error(error)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def standard_streams() -> Iterator[None]:
    """Data that cannot be written raise :class:`CommandExit`; a message that cannot be
    written is dropped. Warnings of nsdrill become messages."""
    _open_closed()
    data, messages = sys.stdout, sys.stderr
    with (
        redirect_stdout(_Stream(data, _output_failed)),
        redirect_stderr(_Stream(messages, lambda error: None)),
        warnings.catch_warnings(),
    ):
        for category in (CacheWarning, RunWarning):
            warnings.simplefilter("always", category)
        original = warnings.showwarning

        def show(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
            if issubclass(category, CacheWarning | RunWarning):
                click.echo(f"Warning: {message}", err=True)
            else:
                original(message, category, *where, **more)

        warnings.showwarning = show
        try:
            yield
        finally:
            for stream in (data, messages):
                try:
                    stream.flush()
                except OSError:  # or the interpreter fails with it at its end
                    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _open_closed() -> None:
    """Open closed streams under their numbers: else the next file to be opened gets
    one, and what a library prints goes into it. Output is opened for reading only, so
    that writing data is still an error."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            # takes the lowest free number
            null = os.open(os.devnull, os.O_RDWR if name == "stderr" else os.O_RDONLY)
            os.set_inheritable(null, True)
            setattr(sys, name, open(null, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115


def _output_failed(error: OSError) -> NoReturn:
    if isinstance(error, BrokenPipeError):
        raise CommandExit("", 0) from error  # the reader has closed the pipe (`| head`)
    raise CommandExit(f"Error: standard output: cannot be written: {error.strerror}.", 1) from error
