"""The progress bar: on a terminal only, on stderr."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nsdrill.sweep.engine import Progress


@contextmanager
def progress_bar(enabled: bool) -> Iterator[Callable[[Progress], None]]:
    """A bar with points done, rate, time left and failures; gives the function that moves it."""
    if not enabled:
        yield lambda progress: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("points"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[pace]}"),
        TextColumn("{task.fields[failures]}"), TimeElapsedColumn(), TextColumn("{task.fields[note]}"),
    )  # fmt: skip
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("points", total=None, pace="starting", failures="", note="")
        begun = time.monotonic()

        def watch(progress: Progress) -> None:
            failures = f"[red]{progress.failed} failed[/red]" if progress.failed else ""
            bar.update(
                task, total=progress.total, completed=progress.before + progress.done, failures=failures,
                note=progress.note,
                pace=pace(progress.done, progress.total - progress.before - progress.done, time.monotonic() - begun),
            )  # fmt: skip

        yield watch


def pace(done: int, left: int, seconds: float) -> str:
    """Points per second, and the time that the rest takes. Points of an earlier session do not count as fast ones."""
    if done == 0 or seconds <= 0:
        return "starting"
    rate = done / seconds
    per_second = f"{rate:.0f}/s" if rate >= 10 else f"{rate:.1f}/s" if rate >= 1 else f"{60 * rate:.1f}/min"
    minutes, rest = divmod(round(left / rate), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{per_second}, {f'{hours} h {minutes:02d} min' if hours else f'{minutes}:{rest:02d}'} left"
