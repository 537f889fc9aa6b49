"""Requests to end: SIGINT, SIGTERM and SIGHUP set a flag and raise no exception in the
handler.

An exception from a signal handler can be raised in any line, also in finalizers and
callbacks of libraries, where it is lost. So the handlers do nothing, and a thread
receives the signals. Work with unsaved results checks the flag where it can be
interrupted (:func:`interruptible`, :func:`check`). All other work is ended at once,
also inside a library call that does not return for a long time: the files of nsdrill
are whole at any moment.

Only the command line calls :func:`listen`. In use from Python the flag is never set,
and KeyboardInterrupt works as usual.
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
from contextvars import ContextVar
from typing import NoReturn

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
EXIT_CODE = 130
PATIENCE = 10.0  # seconds that work which checks the flag has for saving its results
# Seconds after which a second signal ends the process at once; before, it may be the
# same request, as batch systems send a signal twice.
SECOND_SIGNAL_SECONDS = 1.0
NOTHING = "Interrupted; nothing was written."
COMPLETE = "Interrupted, but the file was already complete."
UNSURE = "Interrupted while the file was being put in place: it is complete, or as it was before."

unfinished_files: set[str] = set()
"""Names of unfinished files, which are removed if the process is ended at once."""


class _State:
    """What the main thread and the thread that waits for signals share."""

    def __init__(self) -> None:
        self.pipe: int | None = None  # its write end, while signals are received
        self.end_requested = self.cooperative = self.completing = self.settled = self.ending = False
        self.end_message: Callable[[], str] = lambda: UNSURE if self.completing else NOTHING


_state = _State()
_end_lock = threading.Lock()  # held to end the process, or to complete a file or keep a state


_wanted: ContextVar[Callable[[], bool] | None] = ContextVar("wanted", default=None)


@contextmanager
def while_wanted(wanted: Callable[[], bool]) -> Iterator[None]:
    """For work of this thread alone: it is interrupted, as by a signal, once ``wanted``
    is false."""
    token = _wanted.set(wanted)
    try:
        yield
    finally:
        _wanted.reset(token)


def check_wanted() -> None:
    """KeyboardInterrupt if nobody waits for the work of this thread any more."""
    if (wanted := _wanted.get()) is not None and not wanted():
        raise KeyboardInterrupt


def check() -> None:
    """KeyboardInterrupt if the process is to end, or the work of this thread."""
    check_wanted()
    if _state.end_requested and not _state.settled:
        raise KeyboardInterrupt


def requested() -> bool:
    """Whether a signal requested the end of the process."""
    return _state.end_requested


@contextmanager
def interruptible() -> Iterator[None]:
    """For work that calls :func:`check` several times a second and saves its results
    when that raises. Contexts may be nested."""
    previous, _state.cooperative = _state.cooperative, True
    try:
        yield
        check()
    finally:
        _state.cooperative = previous


@contextmanager
def with_end_message(message: Callable[[], str]) -> Iterator[None]:
    """For work that is ended at once: ``message`` returns what to print then. It is
    called in another thread, after the unfinished files are removed: what it reads of
    other files stays so."""
    previous, _state.end_message = _state.end_message, message
    try:
        yield
    finally:
        _state.end_message = previous


@contextmanager
def completing() -> Iterator[None]:
    """For the step that completes the work: an interrupt before it raises, and one
    during or after it has no effect on the command."""
    check()
    with _end_lock:
        _state.completing = True
        try:
            yield
            _state.settled = True
        finally:
            _state.completing = False


@contextmanager
def undivided() -> Iterator[None]:
    """For a step that changes a file and what is known of it: the process ends before it
    or after it, unless the step takes longer than ``PATIENCE``."""
    with _end_lock:
        yield


def listen() -> None:
    """Receive signals from now on. An ignored SIGHUP (nohup) stays ignored. The others
    do not: a shell starts background jobs with SIGINT ignored, and children of a
    supervisor that ignores SIGTERM inherit that, but a signal sent to this process is
    intended. Does nothing outside the main thread."""
    if _state.pipe is not None or threading.current_thread() is not threading.main_thread():
        return
    reader, writer = map(_above_standard_streams, os.pipe())
    os.set_blocking(reader, False)
    os.set_blocking(writer, False)
    _state.pipe = writer
    _state.end_requested = _state.settled = False
    signal.set_wakeup_fd(writer, warn_on_full_buffer=False)
    threading.Thread(target=_end_on_signal, args=(reader,), daemon=True).start()
    for number in SIGNALS:
        if number != getattr(signal, "SIGHUP", None) or signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, lambda number, frame: None)
            # interrupted system calls of libraries are restarted
            signal.siginterrupt(number, False)


def orphaned() -> Callable[[], bool]:
    """A function that says whether the process that started this one has ended since.
    Never so for a process that is to live on by itself: under nohup, or at the head of a
    session of its own (setsid, tmux, a service)."""
    parent = os.getppid()
    hangup = getattr(signal, "SIGHUP", None)
    if os.getsid(0) == os.getpid() or (hangup is not None and signal.getsignal(hangup) is signal.SIG_IGN):
        return lambda: False
    return lambda: os.getppid() != parent


def wait_if_ending() -> None:
    """Return, but not while the process is being ended: an error in that time, such as
    a missing file, is not to be reported."""
    while _state.ending:
        time.sleep(1.0)


def _above_standard_streams(end: int) -> int:
    """An end of a pipe with a file descriptor above those of the standard streams,
    which may have been closed."""
    if end > 2:
        return end
    duplicate = fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 3)
    os.close(end)
    return duplicate


def ignore_signals() -> None:
    """Call when the exit code is known: signals are ignored until the interpreter has
    exited."""
    wait_if_ending()
    if _state.pipe is None or threading.current_thread() is not threading.main_thread():
        return
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    signal.set_wakeup_fd(-1)
    os.close(_state.pipe)
    _state.pipe = None


def end(message: str) -> NoReturn:
    """Print ``message`` and end the process, whatever its threads are doing."""
    _end_lock.acquire(timeout=PATIENCE)
    _end(lambda: message)


def _end(message: Callable[[], str]) -> NoReturn:
    _state.ending = True
    for name in list(unfinished_files):
        with suppress(OSError):
            os.unlink(name)
    try:
        said = message()
    except Exception:  # it may use objects under construction
        said = "Interrupted."
    with suppress(OSError):
        show_cursor = "\r\x1b[K\x1b[?25h" if os.isatty(2) else ""  # a progress bar hides the cursor
        os.write(2, f"{show_cursor}{said}\n".encode(errors="replace"))
    os._exit(EXIT_CODE)


def _end_on_signal(reader: int) -> None:
    """The thread's function: wait for a signal, and make sure that the process ends."""
    try:
        if not _signal_arrived(reader, None):
            return
        _state.end_requested = True
        acquired = _end_lock.acquire(timeout=PATIENCE)
        if _state.cooperative or _state.settled:
            if acquired:
                _end_lock.release()
            time.sleep(SECOND_SIGNAL_SECONDS)
            if (
                _signal_arrived(reader, 0.0) is None
                or _signal_arrived(reader, PATIENCE - SECOND_SIGNAL_SECONDS) is None
            ):
                return
            _end_lock.acquire(timeout=PATIENCE)
        _end(lambda: COMPLETE if _state.settled else _state.end_message())
    finally:
        os.close(reader)


def _signal_arrived(reader: int, seconds: float | None) -> bool | None:
    """Whether a signal arrived within these seconds; None if the command has ended."""
    if not select.select([reader], [], [], seconds)[0]:
        return False
    return True if os.read(reader, 4096) else None
