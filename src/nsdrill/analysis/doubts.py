"""What makes numbers of results wrong, or not those of their setting: one list, of which the end
of a run, answers, ``show`` and warnings in Python all tell."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from nsdrill.analysis.clocked import CLOCKED, clocked, clocked_words
from nsdrill.analysis.counts import (
    BEYOND,
    TURNED,
    TURNED_BACK,
    beyond,
    beyond_words,
    doubtful_fit,
    driving,
    driving_words,
    fit_words,
    guessed_scales,
    guessed_words,
    inexact_exponents,
    inexact_words,
    of_scripts,
    off_speed_words,
    outrun,
    outrun_words,
    runs_off_speed,
    runs_slower,
    slower_words,
    too_small,
    too_small_words,
    turned_back,
    turned_back_words,
)
from nsdrill.analysis.own_contacts import creeping, creeping_words, stepped_over, stepped_over_words
from nsdrill.analysis.unstable import FOLLOWED, resting, runs_unstable, unstable_words
from nsdrill.data import GUESSED_SCALES, INEXACT, Attributes, Results
from nsdrill.models.registry import model_in
from nsdrill.records import dataclass


@dataclass(frozen=True)
class Doubt:
    """One of them: its ``key`` in plain data, its name in capitals, the ``rest`` of its heading,
    what finds it in results, as plain data that is empty where there is none, and the words of
    what is found."""

    key: str
    name: str
    rest: str
    find: Callable[[Results], Any]
    words: Callable[[Any], str]
    in_answers: bool = True
    """Whether an answer tells it: not where it says more at its setting."""

    @property
    def heading(self) -> str:
        """The name and the rest."""
        return f"{self.name} {self.rest}".rstrip()


OF_RUNS = (
    Doubt("off_speed", "OFF SPEED", "", runs_off_speed, off_speed_words),
    Doubt("slower", "DRIVE SLOWER", "than it is set", runs_slower, slower_words, in_answers=False),
    Doubt("unstable_motion", "AN UNSTABLE MOTION", "", runs_unstable, unstable_words),
    Doubt("outrun", "TOO FAST", "for the steps", outrun, outrun_words),
    Doubt("driving", "FRICTION DRIVES", "", driving, driving_words),
    Doubt("creeping", "NO STICK", "", creeping, creeping_words),
    Doubt("stepped_over", "CONTACT STEPPED OVER", "", stepped_over, stepped_over_words),
    Doubt("too_small", "TOO SMALL", "for the tolerance", too_small, too_small_words),
)
BEFORE: tuple[tuple[str, str, Callable[[Attributes], Any], Callable[[Any], str]], ...] = (
    # known before a run, from root attributes, and told then
    (INEXACT, "EXPONENTS MAY BE WRONG", inexact_exponents, inexact_words),
    (GUESSED_SCALES, "A GUESS", guessed_scales, guessed_words),
    ("clocked", CLOCKED, clocked, clocked_words),
    ("doubtful_fit", "DOUBTFUL FIT", doubtful_fit, fit_words),
)


def _of_attributes(find: Callable[[Attributes], Any]) -> Callable[[Results], Any]:
    return lambda results: find(results.attrs)


ALL = (*OF_RUNS, *(Doubt(key, name, "", _of_attributes(find), words) for key, name, find, words in BEFORE))


def doubts_in(results: Results) -> dict[str, Any]:
    """What is found of each, plain data by its key."""
    return {one.key: one.find(results) for one in ALL}


def told_in_capitals(found: Mapping[str, Any]) -> Iterator[str]:
    """A sentence for each that is ``found``, of :func:`doubts_in`, and that answers tell, its heading
    in capitals."""
    for one in ALL:
        if found[one.key] and one.in_answers:
            yield f"{one.heading.upper()}: {one.words(found[one.key])}."


def known_before(attrs: Attributes) -> dict[str, Any]:
    """What is found of each that is known before a run, plain data by its key."""
    return {key: find(attrs) for key, _, find, _ in BEFORE}


def notes_before(attrs: Attributes) -> Iterator[str]:
    """What is known before a run, in sentences: the command line tells it then, Python after."""
    for _, name, find, words in BEFORE:
        if found := find(attrs):
            yield f"{name.capitalize()}: {words(found)}."


def used_by_notes(attrs: Attributes) -> tuple[str, ...]:
    """The variables that :func:`notes_of_run` uses, of results with these root attributes."""
    return ("status", BEYOND, TURNED_BACK, *TURNED, *FOLLOWED, *resting(model_in(attrs)), *of_scripts(attrs))


def notes_of_run(results: Results) -> Iterator[str]:
    """What there is to say of these results at the end of a run, in sentences: on the command
    line, and by the warnings in Python."""
    if far := beyond(results):
        yield f"BEYOND the validity of the model: {beyond_words(far, results['status'].size)}."
    if back := turned_back(results):
        yield f"TURNED BACK: {turned_back_words(back)}."
    for one in OF_RUNS:
        if found := one.find(results):
            yield f"{one.heading}: {one.words(found)}."
