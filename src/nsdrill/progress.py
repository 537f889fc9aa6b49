"""The progress of a run: a bar in a terminal or a notebook, else lines at intervals, or
calls of a function. That of branches the same way, with what goes on in place of a bar."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from importlib.util import find_spec
from typing import TYPE_CHECKING

from nsdrill.app.telling import Telling
from nsdrill.compiler.functions import compiling
from nsdrill.errors import InputError, count
from nsdrill.records import dataclass

if TYPE_CHECKING:
    from rich.console import Console

    from nsdrill.sweep.engine import Progress as Counts

LINE_SECONDS = 10.0  # between two lines where there is no terminal
COMPILING_SECONDS = 0.5  # of compiling, from which it is said
Watch = Callable[["Counts"], None]


@dataclass(frozen=True)
class Progress:
    """The progress of a run, with which a function given as ``progress`` is called.

    Attributes
    ----------
    done, total, failed : int
        Points, including those of earlier sessions; ``total`` grows if a map is refined
        or points are checked.
    seconds_left : float or None
        At the rate of this session and, with ``progress=True``, at that of the points that
        were timed before a long run [s]; None where nothing is known. It takes at least so
        long where the state is carried and no points were timed, as ever fewer chains
        fill the processor.
    note : str
        The present stage, if the run has several.

    Examples
    --------
    >>> seen = []
    >>> results = nsdrill.run("study.yaml", progress=seen.append)
    >>> seen[-1].done, seen[-1].total
    (10, 10)
    """

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
        clock, callback = _Clock(), _function(progress)

        def forward(counts: Counts) -> None:
            callback(_record(counts, clock.seconds()))

        yield forward
    else:
        console, has_bar = _screen()
        shown, say = (_bar(console), console.print) if has_bar else (nullcontext(_lines()), _print)
        with shown as update, telling_compiling(say) as end:
            told: dict[str, str] = {}

            def watch(counts: Counts) -> None:
                end()  # a point is only run when its code is there
                said = {"Device": counts.device, "Memory": counts.shortage, "Time": counts.price, "Slow": _slow(counts)}
                for what, text in said.items():
                    if text and told.get(what) != text and (what == "Time" or what not in told):
                        told[what] = text  # the time again where it is known better
                        say(f"{what}: {text}.")
                update(counts)

            yield watch


@contextmanager
def telling(progress: bool | Callable[[str], object]) -> Iterator[Telling]:
    """What work calls whose end is not known, as branches. On a terminal its stages stay, and
    how far the present one is stands below them with the time so far; elsewhere there is a
    line every :data:`LINE_SECONDS`, none in shorter work. ``progress`` is called with every
    line if it is a function; nothing is told if it is False."""
    if progress is False:
        yield Telling()
    elif progress is not True:
        say = _function(progress)
        yield Telling(say, say, _now_and_then(say))
    else:
        console, has_bar = _screen()
        with _live(console) if has_bar else nullcontext(_lines_of_work()) as told, telling_compiling(told.note) as end:

            def after_compiling(say: Callable[[str], object]) -> Callable[[str], object]:
                return lambda text: (end(), say(text))

            yield Telling(told.note, after_compiling(told.begins), after_compiling(told.goes))


def _function(progress: object) -> Callable[..., object]:
    """The function that is called with the progress; InputError where it is none."""
    if not callable(progress):
        raise InputError(f"progress: found {progress!r}; allowed: True, False, or a function of one argument.")
    return progress


def _screen() -> tuple[Console, bool]:
    """The console, and whether it has a bar, which in a notebook is a widget."""
    from rich.console import Console

    console = Console(stderr=True)
    return console, bool(find_spec("ipywidgets") if console.is_jupyter else console.is_terminal)


def _now_and_then(say: Callable[[str], object]) -> Callable[[str], object]:
    """Of the lines that this is called with, one every :data:`LINE_SECONDS` with the time so
    far, none in shorter work."""
    clock, printed = _Clock(), time.monotonic()

    def goes(text: str) -> None:
        nonlocal printed
        if time.monotonic() - printed >= LINE_SECONDS:
            printed = time.monotonic()
            say(f"{text}; {clock_text(clock.seconds())} so far")

    return goes


def _lines_of_work() -> Telling:
    goes = _now_and_then(_print)
    return Telling(_print, goes, goes)


@contextmanager
def _live(console: Console) -> Iterator[Telling]:
    """Lines that stay, and below them how far the present stage is, with the time so far."""
    from rich import progress as rich

    columns = (rich.SpinnerColumn(), rich.TimeElapsedColumn(), rich.TextColumn("{task.description}", markup=False))
    with rich.Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("", total=None)

        def note(text: str) -> None:
            console.print(text, markup=False, highlight=False)

        def goes(text: str) -> None:
            bar.update(task, description=text)

        def begins(text: str) -> None:
            note(text)
            goes("")

        yield Telling(note, begins, goes)


def clock_text(seconds: float) -> str:
    """A time as ``1:05``, or as ``2 h 03 min`` where it is hours."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes}:{rest:02d}"


def _slow(counts: Counts) -> str:
    """What is said of a run that will end at the limit of its steps."""
    if (one := counts.slow) is None:
        return ""
    return (
        f"after {one.steps:,.0f} steps a run is at {one.time:.4g} of {one.closes:g} s, with steps of {one.step:.1g} s, "
        f"and will end at the limit of {one.limit:,.0f} (simulation.max_steps), as may others: where equations jump "
        "and the motion stays there, or have a pole, no number of steps is enough"
    )


def _print(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


class _Clock:
    """The time [s] of this session without that in which code was compiled, which is
    no part of an estimate."""

    def __init__(self) -> None:
        self.started, self.compiled = time.monotonic(), compiling.seconds

    def seconds(self) -> float:
        return time.monotonic() - self.started - (compiling.seconds - self.compiled)


@contextmanager
def telling_compiling(say: Callable[[str], object]) -> Iterator[Callable[[], None]]:
    """Compiling as a stage of its own: ``say`` gets a line when it has taken
    :data:`COMPILING_SECONDS`, and one with how long it took at the end, or where the
    function that this yields is called."""
    before, timer, told = compiling.seconds, None, False

    def begin() -> None:
        nonlocal told
        told = True
        say("compiling the equations ...")

    def watch(begins: bool) -> None:
        nonlocal timer
        if timer is not None:
            timer.cancel()
        if begins and not told:  # the functions before this one count
            left = COMPILING_SECONDS - (compiling.seconds - before)
            timer = threading.Timer(max(0.0, left), begin)
            timer.daemon = True
            timer.start()

    def end() -> None:
        nonlocal before, told
        if told:
            seconds = compiling.seconds - before
            say(f"compiled in {seconds:.1f} s; kept for the next run")
            before, told = compiling.seconds, False

    compiling.watchers.append(watch)
    try:
        yield end
    finally:
        compiling.watchers.remove(watch)
        end()


def seconds_left(done: int, left: int, seconds: float, expected: float | None = None) -> float | None:
    """The time for the points ``left`` [s], from the points ``done`` in ``seconds`` of this
    session and the time ``expected`` for all of them, which counts less and less; None
    where nothing is known."""
    share = done / max(done + left, 1)
    if expected is not None:
        return (1.0 - share) * ((1.0 - share) * expected + seconds)
    return seconds / done * left if done else None


def pace(done: int, left: int, seconds: float, carried: bool = False, expected: float | None = None) -> str:
    """The rate, and the time for the remaining points, as text; from the points
    ``done`` in ``seconds`` of this session, the points ``left`` and the time ``expected``
    before. Without that it is the least time where the state is ``carried``."""
    if done == 0 or seconds <= 0:
        return "starting"
    rate = done / seconds
    remaining = seconds_left(done, left, seconds, expected)
    assert remaining is not None
    per_second = f"{rate:.0f}/s" if rate >= 10 else f"{rate:.1f}/s" if rate >= 1 else f"{60 * rate:.1f}/min"
    about = "about " if expected is not None else "at least " if carried else ""
    return f"{per_second}, {about}{clock_text(remaining)} left"


def _record(counts: Counts, seconds: float) -> Progress:
    done = counts.before + counts.done
    left = seconds_left(counts.done, counts.total - done, seconds, counts.expected)
    return Progress(done, counts.total, counts.failed, left, counts.note)


def _pace(counts: Counts, seconds: float) -> str:
    left = counts.total - counts.before - counts.done
    return "" if counts.note == "compiling" else pace(counts.done, left, seconds, counts.carried, counts.expected)


@contextmanager
def _bar(console: Console) -> Iterator[Watch]:
    """A bar with points done, rate, time left and failures."""
    from rich import progress as rich

    columns = (
        rich.TextColumn("points"),
        rich.BarColumn(),
        rich.MofNCompleteColumn(),
        rich.TextColumn("{task.fields[pace]}"),
        rich.TextColumn("{task.fields[failures]}"),
        rich.TimeElapsedColumn(),
        rich.TextColumn("{task.fields[note]}"),
    )
    with rich.Progress(*columns, console=console, transient=True) as bar:
        task = bar.add_task("points", total=None, pace="starting", failures="", note="")
        clock = _Clock()

        def update(counts: Counts) -> None:
            failures = f"[red]{counts.failed} failed[/red]" if counts.failed else ""
            bar.update(
                task,
                total=counts.total,
                completed=counts.before + counts.done,
                failures=failures,
                note=counts.note,
                pace=_pace(counts, clock.seconds()),
            )

        yield update


def _lines() -> Watch:
    """A line every :data:`LINE_SECONDS`, none in a shorter run."""
    clock, printed = _Clock(), time.monotonic()

    def update(counts: Counts) -> None:
        nonlocal printed
        now = time.monotonic()
        if now - printed < LINE_SECONDS or counts.note == "compiling":
            return
        printed = now
        failed = f", {counts.failed} failed" if counts.failed else ""
        note = f" ({counts.note})" if counts.note else ""
        points = f"{counts.before + counts.done} of {count(counts.total, 'point')}"
        _print(f"{points}{failed}; {_pace(counts, clock.seconds())}{note}")

    return update
