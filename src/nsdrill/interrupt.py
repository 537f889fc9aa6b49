"""A request to end: SIGINT, SIGTERM and SIGHUP as a flag, never as an exception out of
nowhere.

An exception from a signal handler comes up in any line, in finalizers and callbacks of
libraries too, where it is lost. So the handlers do nothing, and a thread receives the
signals. Work that has something in hand looks at the flag at places where it can be
left (:func:`heeded`, :func:`look`). All other work is ended at once, also inside a
library that does not return for long: the files of nsdrill survive that at any moment.

Only the command line calls :func:`listen`. From Python no flag is ever set, and a
KeyboardInterrupt is what it is everywhere.
"""

from __future__ import annotations

import fcntl
import os
import select
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import NoReturn

SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]
EXIT_CODE = 130
PATIENCE = 10.0  # seconds that work which heeds the flag has to save what it has in hand
# seconds after which a second signal is one of impatience; batch systems send the same
# one twice
AGAIN = 1.0
NOTHING = "Interrupted; nothing was written."
COMPLETE = "Interrupted, but the file was already complete."

doomed: set[str] = set()
"""Names of unfinished files, which are removed if the process ends at once."""


class _State:
    """What the main thread and the one that waits for signals tell each other."""

    def __init__(self) -> None:
        self.pipe: int | None = None  # its end for writing, while signals are heard
        self.asked = self.heeded = self.settled = self.ending = False
        self.told: Callable[[], str] = lambda: NOTHING


_state = _State()
_last = threading.Lock()  # who has it may end the process, or finish a file


def look() -> None:
    """KeyboardInterrupt if the end was asked for."""
    if _state.asked and not _state.settled:
        raise KeyboardInterrupt


def asked() -> bool:
    """Whether a signal asked for the end."""
    return _state.asked


@contextmanager
def heeded() -> Iterator[None]:
    """Work that calls :func:`look` several times a second, and saves what it has in
    hand when that raises; also within other such work."""
    before, _state.heeded = _state.heeded, True
    try:
        yield
        look()
    finally:
        _state.heeded = before


@contextmanager
def telling(words: Callable[[], str]) -> Iterator[None]:
    """What to say where work in here is ended at once. ``words`` is called in another
    thread."""
    before, _state.told = _state.told, words
    try:
        yield
    finally:
        _state.told = before


@contextmanager
def settling() -> Iterator[None]:
    """A step with which the work is done: an interrupt comes before it, or the command
    ends as if there was none."""
    look()
    with _last:
        yield
        _state.settled = True


def listen() -> None:
    """Hear signals from now on. A SIGHUP that is ignored (nohup) stays ignored. The
    others do not: a shell starts background jobs deaf to SIGINT, and a supervisor deaf
    to SIGTERM makes its children so, but a signal that is sent to this process is
    meant. Does nothing outside of the main thread."""
    if _state.pipe is not None or threading.current_thread() is not threading.main_thread():
        return
    reader, writer = map(_above_the_standard_streams, os.pipe())
    os.set_blocking(reader, False)
    os.set_blocking(writer, False)
    _state.pipe = writer
    _state.asked = _state.settled = False
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    threading.Thread(target=_wait, args=(reader,), daemon=True).start()
    for number in SIGNALS:
        if (
            number != getattr(signal, "SIGHUP", None)
            or signal.getsignal(number) is not signal.SIG_IGN
        ):
            signal.signal(number, lambda number, frame: None)
            # libraries go on as if nothing was, until the thread has its turn
            signal.siginterrupt(number, False)


def give_way() -> None:
    """Return, but not while the process is being ended: what fails then, for want of a
    file say, is not to be told."""
    while _state.ending:
        time.sleep(1.0)


def _above_the_standard_streams(end: int) -> int:
    """An end of a pipe under a number that is no standard stream's, which may have been
    free."""
    if end > 2:
        return end
    moved = fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 3)
    os.close(end)
    return moved


def decided() -> None:
    """The exit code is settled: signals are ignored until the interpreter is gone,
    which takes a moment."""
    give_way()
    if _state.pipe is None or threading.current_thread() is not threading.main_thread():
        return
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    signal.set_wakeup_fd(-1)
    os.close(_state.pipe)
    _state.pipe = None


def end(message: str) -> NoReturn:
    """Say ``message`` and end the process, whatever its threads are doing."""
    _last.acquire(timeout=PATIENCE)
    _end(message)


def _end(message: str) -> NoReturn:
    _state.ending = True
    for name in list(doomed):
        with suppress(OSError):
            os.unlink(name)
    with suppress(OSError):
        shown = "\r\x1b[K\x1b[?25h" if os.isatty(2) else ""  # a progress bar hides the cursor
        os.write(2, f"{shown}{message}\n".encode(errors="replace"))
    os._exit(EXIT_CODE)


def _wait(reader: int) -> None:
    """The thread: wait for a signal, and see to it that the process ends."""
    try:
        if not _heard(reader, None):
            return
        _state.asked = True
        _last.acquire(timeout=PATIENCE)
        if _state.heeded or _state.settled:
            _last.release()
            time.sleep(AGAIN)
            if _heard(reader, 0.0) is None or _heard(reader, PATIENCE - AGAIN) is None:
                return
            _last.acquire(timeout=PATIENCE)
        try:
            message = COMPLETE if _state.settled else _state.told()
        except Exception:  # of half-made things
            message = "Interrupted."
        _end(message)
    finally:
        os.close(reader)


def _heard(reader: int, seconds: float | None) -> bool | None:
    """Whether a signal came within these seconds; None where the command has ended."""
    if not select.select([reader], [], [], seconds)[0]:
        return False
    return True if os.read(reader, 4096) else None
