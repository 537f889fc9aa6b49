"""The progress bar: on a terminal only, on stderr."""

from __future__ import annotations

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
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"),
        TextColumn("{task.fields[failures]}"), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(),
    )  # fmt: skip
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("points", total=None, rate="", failures="")

        def watch(progress: Progress) -> None:
            seconds = bar.tasks[0].elapsed or 0.0
            rate = f"{progress.done / seconds:.3g}/s" if seconds > 0 else ""
            failures = f"[red]{progress.failed} failed[/red]" if progress.failed else ""
            bar.update(
                task, total=progress.total, completed=progress.before + progress.done, rate=rate, failures=failures)

        yield watch
