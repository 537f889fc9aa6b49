"""Many branches in lock step: all that they need in one round is run in one batch."""

from __future__ import annotations

from collections.abc import Callable, Generator, Hashable, Mapping
from typing import Any, TypeVar

from nsdrill.orbit.flow import Ends, Flow, Legs, joined

K = TypeVar("K", bound=Hashable)
T = TypeVar("T")


def advance(
    flow: Flow,
    jobs: Mapping[K, Generator[Any, Any, Any]],
    done: Callable[[K, Any], None] = lambda key, result: None,
    look: Callable[[], None] = lambda: None,
) -> dict[K, Any]:
    """Run generators that yield legs and are sent their ends, until all have returned;
    what they returned, by key. ``done`` is told of each that returns, ``look`` is
    called once a round."""
    results: dict[K, Any] = {}
    waiting = {}

    def resume(key: K, job: Generator[Any, Any, Any], value: Any) -> None:
        try:
            waiting[key] = (job, job.send(value))
        except StopIteration as stop:
            waiting.pop(key, None)
            results[key] = stop.value
            done(key, stop.value)

    for key, job in jobs.items():
        resume(key, job, None)
    while waiting:
        look()
        asked = list(waiting.items())
        ends = flow.run(joined([legs for _, (_, legs) in asked]))
        first = 0
        for key, (job, legs) in asked:
            part = slice(first, first + len(legs))
            first = part.stop
            resume(key, job, ends[part])
    return results


def together(jobs: list[Generator[Legs, Ends, T]]) -> Generator[Legs, Ends, list[T]]:
    """What each of these generators returns, advanced side by side as one."""
    results: dict[int, T] = {}
    waiting: dict[int, Legs] = {}

    def resume(number: int, ends: Ends | None) -> None:
        try:
            waiting[number] = jobs[number].send(ends)  # type: ignore[arg-type]
        except StopIteration as done:
            waiting.pop(number, None)
            results[number] = done.value

    for number in range(len(jobs)):
        resume(number, None)
    while waiting:
        asked = list(waiting.items())
        ends = yield joined([legs for _, legs in asked])
        first = 0
        for number, legs in asked:
            part = slice(first, first + len(legs))
            first = part.stop
            resume(number, ends[part])
    return [results[number] for number in range(len(jobs))]
