"""Many branches in lock step: the legs of one round run in one batch."""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Hashable, Mapping
from typing import Any, TypeVar

from nsdrill.orbit.flow import Ends, Flow, Legs, joined

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")


def advance(
    flow: Flow,
    tasks: Mapping[K, Generator[Any, Any, Any]],
    poll: Callable[[], None] = lambda: None,
    watch: Callable[[Collection[K]], None] = lambda pending: None,
) -> dict[K, Any]:
    """Run generators that yield legs and are sent their ends until all have returned.
    Their return values, by key. ``poll`` is called once a round, and may raise to stop;
    ``watch`` with the keys of those that have not returned."""
    results: dict[K, Any] = {}
    pending = {}

    def resume(key: K, task: Generator[Any, Any, Any], value: Any) -> None:
        try:
            pending[key] = (task, task.send(value))
        except StopIteration as stop:
            pending.pop(key, None)
            results[key] = stop.value

    for key, task in tasks.items():
        resume(key, task, None)
    while pending:
        poll()
        watch(pending)
        requests = list(pending.items())
        ends = flow.run(joined([legs for _, (_, legs) in requests]))
        first = 0
        for key, (task, legs) in requests:
            rows = slice(first, first + len(legs))
            first = rows.stop
            resume(key, task, ends[rows])
    return results


def gather(tasks: list[Generator[Legs, Ends, T]]) -> Generator[Legs, Ends, list[T]]:
    """One generator that advances ``tasks`` side by side and returns their return
    values."""
    results: dict[int, T] = {}
    pending: dict[int, Legs] = {}

    def resume(number: int, ends: Ends | None) -> None:
        try:
            pending[number] = tasks[number].send(ends)  # type: ignore[arg-type]
        except StopIteration as stop:
            pending.pop(number, None)
            results[number] = stop.value

    for number in range(len(tasks)):
        resume(number, None)
    while pending:
        requests = list(pending.items())
        ends = yield joined([legs for _, legs in requests])
        first = 0
        for number, legs in requests:
            rows = slice(first, first + len(legs))
            first = rows.stop
            resume(number, ends[rows])
    return [results[number] for number in range(len(tasks))]
