"""A single operating point in words: what it showed in each history, and with samples how
probable that is."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from nsdrill.analysis.counts import beyond, beyond_words, open_words, turned_back, turned_back_words
from nsdrill.analysis.doubts import doubts_in, told_in_capitals
from nsdrill.analysis.planes import UNJUDGED, judges
from nsdrill.analysis.probability import SAFE, one_procedure, probabilities_of
from nsdrill.analysis.safety import counts_of, known_runs, run_safety
from nsdrill.data import Answer, Results, edited_words
from nsdrill.errors import count
from nsdrill.models.registry import model_in, responses_in
from nsdrill.variables import OK, SAMPLE
from nsdrill.words.values import WAYS, Formatter, percent, safe_words


def outcome(results: Results, units: str, severity: int | None = None) -> str:
    """The answer of a single point in one sentence."""
    if not judges(results):
        return f"{UNJUDGED[0].upper()}{UNJUDGED[1:]}."
    setting = Formatter(units, model_in(results.attrs).name).setting(results.held, results.held)
    if SAMPLE in results.coords:
        return f"{setting}: {_probable(results, severity)}."
    histories = []
    for number, name in enumerate(results.procedures):
        found = _of_history(one_procedure(results, number), severity)
        histories.append(f"{WAYS[name]} {found}" if len(results.procedures) > 1 and name in WAYS else found)
    return f"{setting}: {'; '.join(histories)}."


def _probable(results: Results, severity: int | None) -> str:
    """The probability of a safe run, and those of the responses, the greatest first."""
    found = probabilities_of(results, severity)
    told: dict[str, Answer] = {}
    for name in found.outcomes:
        ends = zip(("probability", "probability_low", "probability_high"), found.of(name), strict=True)
        told[name] = {key: float(values.item()) for key, values in ends} | {"samples_of": found.in_all}
        if not found.known[found.place(name)].item():
            told[name]["probability"] = None
    safe = told.pop(SAFE)
    may_occur = {name: row for name, row in told.items() if row["probability"] != 0.0 or row["probability_low"]}
    others = sorted(may_occur, key=lambda name: -(told[name]["probability"] or 0.0))
    parts = [f"{responses_in(results.attrs)[name].words} {percent(told[name])}" for name in others]
    return "; ".join(
        [f"{safe_words(severity, model_in(results.attrs).name)} with a probability of {percent(safe)}", *parts]
    )


def _of_history(results: Results, severity: int | None) -> str:
    """What the runs of one procedure showed; of several starts in how many."""
    safety, runs = run_safety(results, severity), results["status"].size
    bits = np.where(known_runs(results), results["response"], 0).astype(int)
    counts = {safe_words(severity, model_in(results.attrs).name): safety.safe}
    counts |= {one.words: bits & one.bit > 0 for one in responses_in(results.attrs).values()}
    counts |= {"a failed run": safety.failed, "checks that disagree": safety.distrusted}
    numbers = {words: int(np.count_nonzero(is_there)) for words, is_there in counts.items()}
    many = runs > 1
    parts = [f"{words} in {number} of {runs} starts" if many else words for words, number in numbers.items() if number]
    return ", ".join(parts) or "a critical severity"


def point_notes(results: Results) -> Iterator[str]:
    """What one must know before relying on the answer of a single point."""
    if told := edited_words(results.attrs):
        yield told
    yield "ONE SETTING ONLY: of other settings, and of other histories, nothing is known."
    counts = counts_of(results)
    if words := open_words(counts, "runs"):
        yield f"NOT KNOWN: {words}. What they would show may change the answer."
    if found := beyond(results):
        yield f"BEYOND THE MODEL: {beyond_words(found, results['status'].size)}."
    if back := turned_back(results):
        yield f"TURNED BACK: {turned_back_words(back)}."
    yield from told_in_capitals(doubts_in(results))
    if "settled" in results.variables:
        unsettled = np.count_nonzero((results["status"] == OK) & (results["settled"] == 0))
        if unsettled:
            yield (
                f"NOT SETTLED: in {unsettled} of {count(results['status'].size, 'run')} the motion was still changing "
                "when it was observed. Run with a longer transient (simulation.transient)."
            )
