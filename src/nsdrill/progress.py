"""How far a run is, for people: a bar in a terminal or a notebook, a line now and then
elsewhere, or a callable."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING

from nsdrill.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from nsdrill.sweep.engine import Progress as Counts

LINE_SECONDS = 10.0  # between two lines where there is no terminal
Watch = Callable[["Counts"], None]


@dataclass(frozen=True)
class Progress:
    """How far a run is: points ``done`` of ``total`` so far, those of earlier sessions
    among them, and how many of them ``failed``; the ``seconds_left`` [s] at the pace of
    this session, None before the first point; and, where the run takes several passes,
    in ``note`` the present one. ``total`` grows where a map is refined or points are
    checked."""

    done: int
    total: int
    failed: int
    seconds_left: float | None
    note: str = ""


@contextmanager
def reporting(progress: bool | Callable[[Progress], object]) -> Iterator[Watch]:
    """The function that the run calls; what it is told goes to stderr, to the callable
    ``progress``, or nowhere where that is False."""
    if progress is False:
        yield lambda counts: None
    elif progress is not True:
        if not callable(progress):
            raise InputError(
                f"progress: found {progress!r}; allowed: True, False, or a function "
                f"of one argument."
            )
        begun, report = time.monotonic(), progress

        def tell(counts: Counts) -> None:
            report(_record(counts, time.monotonic() - begun))

        yield tell
    else:
        from rich.console import Console

        console = Console(stderr=True)
        # In a notebook a bar is a widget.
        if find_spec("ipywidgets") if console.is_jupyter else console.is_terminal:
            with _bar(console) as watch:
                yield watch
        else:
            yield _lines()


def pace(done: int, left: int, seconds: float) -> str:
    """Points per second, and the time that the rest takes. Points of an earlier session
    do not count as fast ones."""
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
    left = seconds / counts.done * (counts.total - done) if counts.done else None
    return Progress(done, counts.total, counts.failed, left, counts.note)


def _pace(counts: Counts, seconds: float) -> str:
    return pace(counts.done, counts.total - counts.before - counts.done, seconds)


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
        begun = time.monotonic()

        def watch(counts: Counts) -> None:
            failures = f"[red]{counts.failed} failed[/red]" if counts.failed else ""
            bar.update(
                task,
                total=counts.total,
                completed=counts.before + counts.done,
                failures=failures,
                note=counts.note,
                pace=_pace(counts, time.monotonic() - begun),
            )

        yield watch


def _lines() -> Watch:
    """A line every :data:`LINE_SECONDS`; a run that is shorter says nothing."""
    begun = said = time.monotonic()

    def watch(counts: Counts) -> None:
        nonlocal said
        now = time.monotonic()
        if now - said < LINE_SECONDS:
            return
        said = now
        failed = f", {counts.failed} failed" if counts.failed else ""
        note = f" ({counts.note})" if counts.note else ""
        print(
            f"{counts.before + counts.done} of {counts.total} points{failed}; "
            f"{_pace(counts, now - begun)}{note}",
            file=sys.stderr,
            flush=True,
        )

    return watch
