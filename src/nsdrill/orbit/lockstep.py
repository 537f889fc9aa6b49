"""Many branches in lock step: the legs of one round run in one batch."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Hashable, Mapping
from typing import Any, TypeVar

from nsdrill.orbit.flow import Ends, Flow, Legs, joined

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")
Task = Generator[Legs, Ends, T]


def gather(
    tasks: Mapping[K, Task[T]], watch: Callable[[Collection[K]], None] = lambda pending: None
) -> Task[dict[K, T]]:
    """One task that advances ``tasks``, generators that yield legs and are sent their
    ends, side by side, and returns their return values, by key. ``watch`` is called once
    a round, with the keys of those that have not returned."""
    results: dict[K, T] = {}
    pending: dict[K, Legs] = {}

    def resume(key: K, ends: Ends | None) -> None:
        try:
            pending[key] = tasks[key].send(ends)  # type: ignore[arg-type]
        except StopIteration as stop:
            pending.pop(key, None)
            results[key] = stop.value

    for key in tasks:
        resume(key, None)
    while pending:
        watch(pending)
        requests = list(pending.items())
        ends = yield joined([legs for _, legs in requests])
        first = 0
        for key, legs in requests:
            rows = slice(first, first + len(legs))
            first = rows.stop
            resume(key, ends[rows])
    return results


def advance(
    flow: Flow,
    tasks: Mapping[K, Task[Any]],
    poll: Callable[[], None] = lambda: None,
    watch: Callable[[Collection[K]], None] = lambda pending: None,
) -> dict[K, Any]:
    """The return values of ``tasks``, by key, as of :func:`gather`, their legs run by
    ``flow``. ``poll`` is called once a round, and may raise to stop."""
    every = gather(tasks, watch)
    try:
        legs = next(every)
        while True:
            poll()
            legs = every.send(flow.run(legs))
    except StopIteration as stop:
        return dict(stop.value)
