"""The progress of a run: a bar in a terminal or a notebook, else lines at intervals, or
calls of a function."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

from nsdrill.compiler.functions import route
from nsdrill.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from nsdrill.sweep.engine import Progress as Counts

LINE_SECONDS = 10.0  # between two lines where there is no terminal
Watch = Callable[["Counts"], None]


@dataclass(frozen=True)
class Progress:
    """The progress of a run: points ``done`` of ``total``, including those of earlier
    sessions, and how many of them ``failed``; the ``seconds_left`` [s] at the rate of
    this session, None before the first point; and, if the run has several stages, the
    present one in ``note``. ``total`` grows if a map is refined or points are
    checked."""

    done: int
    total: int
    failed: int
    seconds_left: float | None
    note: str = ""


@contextmanager
def reporting(progress: bool | Callable[[Progress], object]) -> Iterator[Watch]:
    """The function that the run calls with its counts. It prints to stderr, or calls
    ``progress`` if that is a function, or does nothing if that is False."""
    if progress is False:
        yield lambda counts: None
    elif progress is not True:
        if not callable(progress):
            raise InputError(
                f"progress: found {progress!r}; allowed: True, False, or a function "
                "of one argument."
            )
        started, callback = time.monotonic(), progress

        def forward(counts: Counts) -> None:
            callback(_record(counts, time.monotonic() - started))

        yield forward
    else:
        from rich.console import Console

        console = Console(stderr=True)
        # In a notebook a bar is a widget.
        if find_spec("ipywidgets") if console.is_jupyter else console.is_terminal:
            with _bar(console) as update:
                yield update
        else:
            yield _lines()


def pace(done: int, left: int, seconds: float) -> str:
    """The rate, and the time for the remaining points, as text; from the points
    ``done`` in ``seconds`` of this session and the points ``left``."""
    if done == 0 or seconds <= 0:
        return "starting"
    rate = done / seconds
    per_second = (
        f"{rate:.0f}/s" if rate >= 10 else f"{rate:.1f}/s" if rate >= 1 else f"{60 * rate:.1f}/min"
    )
    minutes, rest = divmod(round(left / rate), 60)
    hours, minutes = divmod(minutes, 60)
    return (
        f"{per_second}, {f'{hours} h {minutes:02d} min' if hours else f'{minutes}:{rest:02d}'} left"
    )


def _record(counts: Counts, seconds: float) -> Progress:
    done = counts.before + counts.done
    seconds -= counts.compiling
    left = seconds / counts.done * (counts.total - done) if counts.done else None
    return Progress(done, counts.total, counts.failed, left, counts.note)


def _pace(counts: Counts, seconds: float) -> str:
    left = counts.total - counts.before - counts.done
    return pace(counts.done, left, seconds - counts.compiling)


@contextmanager
def _bar(console: Console) -> Iterator[Watch]:
    """A bar with points done, rate, time left and failures."""
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("points"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[pace]}"),
        TextColumn("{task.fields[failures]}"),
        TimeElapsedColumn(),
        TextColumn("{task.fields[note]}"),
    )
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("points", total=None, pace="starting", failures="", note="")
        started = time.monotonic()

        def update(counts: Counts) -> None:
            failures = f"[red]{counts.failed} failed[/red]" if counts.failed else ""
            bar.update(
                task,
                total=counts.total,
                completed=counts.before + counts.done,
                failures=failures,
                note=counts.note,
                pace=_pace(counts, time.monotonic() - started),
            )

        yield update


def _lines() -> Watch:
    """A line every :data:`LINE_SECONDS`, none in a shorter run; and one for compiling
    that took as long."""
    started = printed = time.monotonic()
    told = 0.0

    def update(counts: Counts) -> None:
        nonlocal printed, told
        now = time.monotonic()
        if counts.compiling > told + LINE_SECONDS:
            told = counts.compiling
            kept = "; kept for the next run" if route() == "native" else ""
            print(f"compiled in {told:.0f} s{kept}", file=sys.stderr, flush=True)
        if now - printed < LINE_SECONDS:
            return
        printed = now
        failed = f", {counts.failed} failed" if counts.failed else ""
        note = f" ({counts.note})" if counts.note else ""
        print(
            f"{counts.before + counts.done} of {counts.total} points{failed}; "
            f"{_pace(counts, now - started)}{note}",
            file=sys.stderr,
            flush=True,
        )

    return update
