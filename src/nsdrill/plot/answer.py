"""The answer of an operating window in words: where to run, what bounds it and why, and what
one must know before relying on it.

The text of ``nsdrill window``, its picture and the report have the same words. The data
are those of :func:`nsdrill.analysis.window.find_window`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from nsdrill.analysis.counts import open_words
from nsdrill.analysis.probability import interval, samples_for
from nsdrill.analysis.window import (
    BOUNCE_LASTS,
    PASSES_IN_STICK_SLIP,
    STALL_LASTS,
    STARTS_ON_WALL,
    STICKING_LASTS,
    unknown_words,
)
from nsdrill.data import Answer
from nsdrill.errors import count
from nsdrill.models.responses import MILD_TO_SEVERE, RESPONSES
from nsdrill.plot.labels import quantity as shown_quantity
from nsdrill.quantity import quantity
from nsdrill.units import from_si

ORDER = ("depth", "wob", "rotary_speed")  # the order in which drillers name them
WAYS = {"up": "coming up", "down": "coming down"}
FEW_SAMPLES = 0.1  # half of the interval of a probability, from which a warning says so


def in_order(axes: Iterable[str | None]) -> list[str]:
    """The axes in the order in which drillers name them, further ones by name."""
    return sorted(
        (axis for axis in axes if axis), key=lambda axis: (ORDER.index(axis) if axis in ORDER else len(ORDER), axis)
    )


class Formatter:
    """Values as text in one system of units; a speed in rad/s with the rpm in
    brackets."""

    def __init__(self, units: str) -> None:
        self.system = units

    def unit(self, axis: str) -> str:
        """The sign of the unit of an axis."""
        return shown_quantity(axis, self.system).unit

    def name(self, axis: str) -> str:
        """The name of an axis in a sentence."""
        return quantity(axis).words

    def number(self, axis: str, value: float) -> str:
        return shown_quantity(axis, self.system).number(value)

    def value(self, axis: str, value: float | str) -> str:
        if isinstance(value, str):  # a word
            return value
        return f"{self.number(axis, value)} {self.unit(axis)}".rstrip() + self._rpm(axis, value)

    def range(self, axis: str, ends: list[float]) -> str:
        """``105 to 150 rpm``; of two equal ends one."""
        if ends[0] == ends[1]:
            return self.value(axis, ends[0])
        numbers = " to ".join(self.number(axis, end) for end in ends)
        return f"{numbers} {self.unit(axis)}".rstrip() + self._rpm(axis, *ends)

    def span(self, axis: str, ends: list[float]) -> str:
        """As :meth:`range`, with the name of the axis before it."""
        return f"{quantity(axis).words} {self.range(axis, ends)}"

    def setting(self, point: Answer, axes: Iterable[str | None]) -> str:
        """The values of a point, in order: ``25 klbf, 125 rpm``; further axes with
        their names."""
        return ", ".join(
            self.value(axis, point[axis])
            if axis in ORDER
            else f"{quantity(axis).words} {self.value(axis, point[axis])}"
            for axis in in_order(axes)
        )

    def _rpm(self, axis: str, *values: float) -> str:
        if self.system == "field" or axis != "rotary_speed":
            return ""
        speeds = " to ".join(f"{from_si(value, 'rpm'):.3g}" for value in values)
        return f" ({speeds} rpm)"


def percent(point: Answer) -> str:
    """``97.3 % (94.4 to 98.7)``: a probability with its interval; ``not known (2.1 to 100;
    7 of 8 failed)`` where no sample tells it, and with what is not known otherwise too."""
    ends = " to ".join(f"{100 * point[f'probability_{end}']:.1f}" for end in ("low", "high"))
    words = open_words(point["samples_of"]) if "samples_of" in point else ""
    value = "not known" if point["probability"] is None else f"{100 * point['probability']:.1f} %"
    return f"{value} ({ends}{f'; {words}' if words else ''})"


def drilling(point: Answer, fmt: Formatter) -> str:
    """``rate of penetration 32 ft/h, specific energy 22 ksi``; "" where a file has
    neither."""
    words = {"rate_of_penetration": "rate of penetration", "mechanical_specific_energy": "specific energy"}
    return ", ".join(f"{word} {fmt.value(name, point[name])}" for name, word in words.items() if name in point)


def response_words(names: Iterable[str]) -> str:
    """The responses with these names in words, with commas."""
    return ", ".join(RESPONSES[name].words for name in names)


def safe_words(severity: int | None) -> str:
    """``safe``, with the vibration that a ``severity`` allows."""
    if severity is None:
        return "safe"
    return f"safe ({f'vibration up to {MILD_TO_SEVERE[severity]}' if severity else 'no vibration'} allowed)"


def answer(summary: Answer, units: str) -> str:
    """The answer in one sentence."""
    fmt, safe = Formatter(units), safe_words(summary["severity"])
    plane = chosen_map(summary)
    if plane is None or plane["recommended"] is None:
        return _nothing_safe(summary, fmt)
    best, axes = plane["recommended"], summary["axes"]
    speed = axes[0]
    at = plane.get("at") or {}
    where = f" at {fmt.setting(at, at)}" if at else ""
    if summary["third"] and not at:
        where = f", at every {quantity(summary['third']).words} of the file"
    setting = " and ".join(fmt.setting(best, axes).split(", "))
    if is_hint(summary, best):
        text = f"No setting can be recommended; the best hint is {setting}{where}"
    else:
        text = f"Run{where} at {setting}" if at else f"Run at {setting}{where}"
    sides = best["margins"][speed]
    ends = [sides["less"]["safe_to"], sides["more"]["safe_to"]]
    if ends[0] == ends[1]:
        text += f"; no other {quantity(speed).words} next to it is {safe}"
    else:
        text += f"; {safe} from {fmt.range(speed, ends)}"
    if summary["confidence"] is not None:
        text += f"; with a probability of {percent(best)}"
    text += f", {_in_histories(summary)}"
    may = summary["confidence"] is not None  # some of the samples do
    words = {side: _side_verb(sides[side], "below" if side == "less" else "above", may) for side in ("less", "more")}
    if all(side["why"] == "edge" for side in sides.values()):
        words = {"both": "the map ends on both sides"}
    return f"{text}; {', '.join(words.values())}{''.join(_stalls(best, axes[1:], fmt, may))}."


def _stalls(best: Answer, axes: Iterable[str], fmt: Formatter, may: bool) -> Iterator[str]:
    """Where the bit stalls along the other axes: ``; from 30 klbf the bit stalls``."""
    for axis in axes:
        for side, word in (("less", "down from"), ("more", "from")):
            border = best["margins"][axis][side]
            if "stalled" in border["responses"]:
                verb = "may stall" if may or border["why"] == "rim" else "stalls"
                yield f"; {word} {fmt.value(axis, border['first_not_safe'])} the bit {verb}"


def _in_histories(summary: Answer) -> str:
    """``coming up and coming down``: the histories that were run."""
    ways = [WAYS.get(name, name) for name in summary["procedures"]]
    if not summary["history_examined"]:
        return "on the one history that was run"
    return " and ".join(ways) if len(ways) == summary["histories"] else f"in all {summary['histories']} histories"


def has_no_room(best: Answer) -> bool:
    """Whether a point has no margin to one side or more: it might not be safe on a finer
    map."""
    return any(side["margin"] == 0.0 for sides in best["margins"].values() for side in sides.values())


def is_hint(summary: Answer, best: Answer) -> bool:
    """Whether the best point of a map is a hint, not a setting: it has no room, its
    motion had not settled, the sweep begins above a critical speed or may jump across
    it, or it is one sweep at whose point another motion may last, which neighbours may
    come to."""
    is_one_sweep = len(summary["axes"]) == 1 and not summary["third"]
    others_last = is_one_sweep and bool(_may_last(summary, best))
    is_missed = bool(summary["passed_over"]) or any(one["jumped"] for one in summary["lasting_motions"])
    return has_no_room(best) or not best["settled"] or is_missed or others_last


def _may_last(summary: Answer, point: Answer) -> list[Answer]:
    """The motions that may last at a point, once they begin, and whose critical speeds
    the sweep does not pass over."""
    speed = {**summary["fixed"], **point}.get("rotary_speed", -math.inf)
    met = [one for one in summary["lasting_motions"] if one["from"] is None]
    return [one for one in met if one["lasts"] and one["lasts"][0] < speed]


def chosen_map(summary: Answer) -> Answer | None:
    """The map that the answer is about: the only one; of several what is safe
    throughout, else the one with the most safe points."""
    maps = summary["maps"]
    if len(maps) == 1:
        return {**maps[0], "at": {}}
    if summary["throughout"] and summary["throughout"]["safe"]:
        return {**summary["throughout"], "at": {}}
    best: Answer = max(maps, key=lambda one: one["safe"])
    return best


def _side_verb(side: Answer, where: str, may: bool) -> str:
    """``below it sticks``, or that it ``may``; ``above the map ends``."""
    if side["why"] == "edge":
        return f"{where} the map ends"
    if side["why"] == "distrusted":
        return f"{where} the checks disagree"
    if side["why"] in ("failed", "unknown"):
        return f"{where} nothing is known"
    depends = may or side["why"] == "rim"
    if side["responses"] == ["stalled"]:
        return f"{where} the bit {'may stall' if depends else 'stalls'}"
    verbs = [RESPONSES[name].verb + ("" if depends else "s") for name in side["responses"]]
    if not verbs:
        return f"{where} it {'may be' if depends else 'is'} critical"
    return f"{where} it {'may ' if depends else ''}{' and '.join(verbs)}"


def _nothing_safe(summary: Answer, fmt: Formatter) -> str:
    known = summary["points"] - summary["unknown"]
    if not known:
        return "No answer: no run that decides on a point ended well."
    what = _in_histories(summary)
    text = f"No safe point: none of {summary['points']} is {safe_words(summary['severity'])} "
    if summary["confidence"] is not None:
        text += f"with a probability of {100 * summary['confidence']:g} %"
        if best := summary["most_probable"]:
            at = fmt.setting(best, (*summary["axes"], summary["third"]))
            return f"{text}; the most probable one is {at}, with {percent(best)}."
        return f"{text}, or in any of the samples."
    text += what
    found = [f"{name.replace('_', '-')} at {count}" for name, count in summary["obstacles"].items() if count]
    if summary["rim"]:
        text += f"; {summary['rim']} are on some histories"
    return f"{text}; {', '.join(found)}." if found else f"{text}."


def obstacle_words(why: str, responses: Iterable[str]) -> str:
    """What prevents that a point is safe; see :func:`nsdrill.analysis.window.obstacle`."""
    words = {"edge": "edge of the map", "failed": "a run failed", "unknown": "no severity is known"}
    otherwise = "the checks disagree" if why == "distrusted" else "critical"
    return words.get(why) or response_words(responses) or otherwise


def limit(axis: str, side: Answer, fmt: Formatter) -> str:
    """What lies behind one side of the window: ``65 rpm: stick-slip coming up, none
    coming down``."""
    if side["why"] == "edge":
        return "the edge of the map, nothing is known beyond"
    what = obstacle_words(side["why"], side["responses"])
    if side["why"] == "rim":
        what += ", depending on the history"
        if safe := [WAYS[name] for name in side["safe_in"] if name in WAYS]:
            what += f" (safe {' and '.join(safe)})"
    return f"at {fmt.value(axis, side['first_not_safe'])} {what}"


def why(axis: str, side: Answer, best: Answer, fmt: Formatter) -> str | None:
    """The reason for a border that may surprise, in a sentence; None where it needs
    none or the file does not tell it."""
    found = side["reason"]
    if found is None:
        return None
    way = WAYS[found["procedure"]].capitalize()
    if found["code"] == BOUNCE_LASTS:
        return (
            f"{way} the bit bounces already and goes on, as its axial motion is lightly damped; "
            "the other way it never begins."
        )
    if found["code"] == STICKING_LASTS:
        return (
            f"{way} the bit sticks already and goes on sticking: rock holds a standing bit "
            "more firmly than a turning one."
        )
    if found["code"] == STALL_LASTS:
        return (
            f"{way} the bit is stalled already and stays so: rock holds a standing bit more firmly than a turning one."
        )
    at = fmt.value(found["axis"], found["value"])
    if found["code"] == PASSES_IN_STICK_SLIP:
        here, there = (fmt.value(axis, value) for value in (best[axis], side["first_not_safe"]))
        return (
            f"{way}, the collar at {there} reaches the wall at {at} and stays on it; at {here} the string passes that "
            "in stick-slip, and the collar does not stay. It is safe only while nothing brings the collar to the wall."
        )
    if found["code"] == STARTS_ON_WALL:
        return f"{way}, the sweep starts on the wall at {at}, and a collar that rolls there stays: little damps it."
    return f"{way}, the collar reaches the wall at {at} and stays on it: little damps its rolling."


def of_both(a: Iterable[str], b: Iterable[str]) -> list[str]:
    """Texts on two files, each after the letter of its file; those on both once."""
    left, right = list(a), list(b)
    return [
        *(f"a and b: {text}" for text in left if text in right),
        *(f"a: {text}" for text in left if text not in right),
        *(f"b: {text}" for text in right if text not in left),
    ]


def warnings(summary: Answer, units: str) -> Iterator[str]:
    """All that one must know before relying on the window, a sentence or two each."""
    fmt = Formatter(units)
    if summary["safe"] or summary["most_probable"]:
        yield from _of_critical_speeds(summary, fmt)
    if not summary["history_examined"]:
        yield (
            f"HISTORY WAS NOT EXAMINED: the file holds one procedure only ({summary['procedures'][0]}). Run the study "
            "with procedure: up-down to learn whether the window holds whatever came before."
        )
    if len(summary["axes"]) == 1 and not summary["third"]:
        held = fmt.setting(summary["fixed"], summary["fixed"])
        yield (
            f"ONE AXIS ONLY: the {quantity(summary['axes'][0]).words} was swept"
            f"{f', at {held}' if held else ''}. Of other settings nothing is known."
        )
    if summary["pending_runs"]:
        yield (
            f"NOT ALL HAS RUN: {summary['pending_runs']} of {summary['runs']} runs are missing, "
            "and their points are unknown."
        )
    yield from _of_unknown_runs(summary)
    if inferred := summary["unknown"] - summary["unknown_failed"]:
        yield (f"NOT KNOWN at {count(inferred, 'point')} ({unknown_words(dict(summary))}); no window goes there.")
    if distrusted := summary["distrusted_points"]:
        is_one = distrusted == 1
        yield (
            f"CHECKS DISAGREE at {count(distrusted, 'point')}, which {'is' if is_one else 'are'} not to be trusted and "
            f"{'counts' if is_one else 'count'} as not safe."
        )
    yield from _of_motions(summary)
    yield from _of_recommended(summary, fmt)


def _of_unknown_runs(summary: Answer) -> Iterator[str]:
    """Runs that failed, those that came after one in a chain, and those whose checks
    failed."""
    if failed := summary["failed"]:
        points = count(summary["points_with_failed"], "point")
        meaning = "No window goes there."
        if summary["confidence"] is not None:
            meaning = "They count as not safe; probabilities are of the others, and their intervals cover both."
        yield f"FAILED: {failed} of {summary['of']} runs failed, at {points}. {meaning}"
    if after := summary["after_failure"]:
        yield (
            f"NOT CARRIED to {count(after, 'run')}: a run before them in their chain failed, so they began at the "
            "start of the study and their history is not known. Run them again (--retry-failed, with a larger "
            "simulation.max_steps)."
        )
    if others := summary["undecided_runs"]:
        yield f"NOT DECIDED: {count(others, 'run')} ended well, but the answer is not known, as a check of it failed."


def _of_critical_speeds(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """Critical speeds that the sweep passes over, or may jump across."""
    for speed in summary["passed_over"]:
        axis, begins = speed["axis"], "THE SWEEP BEGINS at"
        if speed["each"]:
            begins = "EACH SPEED IS SWEPT BY ITSELF, up to"
        yield (
            f"{begins} {fmt.value(axis, speed['from'])}, above {speed['words']}, "
            f"{fmt.range(axis, [speed['min'], speed['max']])}"
            f"{'' if speed['everywhere'] else ' (in a part of the study)'}. A string that is brought up to speed "
            "passes through that: a point that is safe here need not be safe then."
        )
    for speed in summary["lasting_motions"]:
        if jumped := speed["jumped"]:
            axis = speed["axis"]
            yield (
                f"STEPS OF {fmt.value(axis, jumped['step'])} MAY JUMP across {speed['words']}, anywhere from "
                f"{fmt.range(axis, [jumped['from'], jumped['to']])}: a point that is safe here need not be safe with "
                f"finer steps. There steps of {fmt.value(axis, jumped['enough'])} are fine enough."
            )


def _of_motions(summary: Answer) -> Iterator[str]:
    """Motions that had not settled and histories that decide, over the safe points; over
    all where none is safe."""
    plane = chosen_map(summary)
    best = plane and plane["recommended"]
    which, of, points = "", "point", summary["points"]
    unsettled = summary["unsettled_in_all"]
    if summary["safe"]:
        unsettled, of, points = summary["unsettled_points"], "safe point", summary["safe"]
        which = "" if not best or best["settled"] else ", the best one among them,"
    if unsettled:
        yield (
            f"NOT SETTLED: at {unsettled} of {count(points, of)}{which} a motion was still "
            "changing when it was observed. Run with a longer transient (simulation.transient)."
        )
    if decided := summary["by_history"]:
        yield (
            f"HISTORY DECIDES at {count(decided, 'point')} ({100 * decided / summary['points']:.1f} %): there it "
            "depends on the history whether the setting is safe."
        )


def _of_recommended(summary: Answer, fmt: Formatter) -> Iterator[str]:
    """What is said of the recommended point, and of the edges of the map and the samples
    also where there is none."""
    plane = chosen_map(summary) or {}
    best = plane.get("recommended")
    if not best:
        ends = " and ".join(fmt.range(axis, summary["ranges"][axis]) for axis in in_order(summary["axes"]))
        yield f"THE MAP ENDS: only {ends} was examined, and nothing is known beyond."
        yield from _of_samples(summary, summary["most_probable"] or {})
        return
    edges = [
        fmt.value(axis, side["safe_to"])
        for axis in in_order(summary["axes"])
        for side in best["margins"][axis].values()
        if side["why"] == "edge"
    ]
    if has_no_room(best):
        yield (
            "NO MARGIN to one side or more of the best point: it is a hint, not a setting. A finer map around it "
            "would show more."
        )
    for one in _may_last(summary, {**plane.get("at", {}), **best}):
        yield (
            f"{one['told']} above {fmt.range(one['axis'], one['lasts'])}: the best point is safe only while "
            f"{one['safe_while']}. "
            "Many starts of every point (--set sweep.procedure=same --set initial.ensemble=64) show how likely that is."
        )
    if edges:
        yield (f"THE MAP ENDS at {' and '.join(edges)}, and the window with it: nothing is known beyond.")
    yield from _of_samples(summary, best)


def _of_samples(summary: Answer, point: Answer) -> Iterator[str]:
    """Too few samples for the confidence, or for the probability of this ``point``."""
    told = list(_too_few_samples(summary))
    yield from told
    if "probability" in point and not told:
        half, level = (point["probability_high"] - point["probability_low"]) / 2, summary["confidence"]
        is_shown = not point["probability_low"] < level <= point["probability"]
        if half > FEW_SAMPLES or not is_shown:
            yield (
                f"FEW SAMPLES: {summary['counted']} give the probability to about {100 * half:.0f} %"
                f"{'' if is_shown else f', and do not show that it reaches {100 * level:g} %'}; four times as many "
                "halve that."
            )


def _too_few_samples(summary: Answer) -> Iterator[str]:
    """So few samples that the interval of a point at which all are safe reaches below the
    confidence."""
    confidence, count = summary["confidence"], summary["effective"]
    if confidence is None or count >= (needed := samples_for(confidence)):
        return
    low = float(interval(np.asarray(count), count)[0])
    text = f"{summary['counted']}"
    if count < summary["counted"]:
        text += f" samples, which count as {count:.3g},"
    yield (
        f"TOO FEW SAMPLES to show a confidence of {100 * confidence:g} %: where all of {text} are safe, the "
        f"probability may be as low as {100 * low:.1f} %. {needed} samples are needed, better more (uncertain.samples)."
    )


def explained(summary: Answer, units: str) -> Iterator[str]:
    """The borders of the recommended point that may surprise, each with its reason; a
    reason once."""
    fmt, plane = Formatter(units), chosen_map(summary)
    told: set[str] = set()
    if not plane or not plane["recommended"]:
        return
    best = plane["recommended"]
    for axis in in_order(summary["axes"]):
        for side in best["margins"][axis].values():
            text = why(axis, side, best, fmt)
            if text is not None and side["reason"]["code"] not in told:
                told.add(side["reason"]["code"])
                at = fmt.value(axis, side["first_not_safe"])
                yield f"At {at}: {text[0].lower()}{text[1:]}"


def notes(summary: Answer, units: str) -> list[str]:
    """The warnings and reasons without their advice, for a picture."""
    texts = [*warnings(summary, units), *explained(summary, units)]
    return [f"{text.partition('. ')[0].rstrip('.')}." for text in texts]
